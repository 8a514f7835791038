//! Facts that every body must satisfy.

use std::collections::BTreeMap;

use slipstick_mesh::{BoxShape, FacetCorners, Mesh, Surface, box_mesh, facet_area_vector};

/// Sum of the volumes of all elements.
pub fn volume(mesh: &Mesh) -> f64 {
    mesh.element_volumes().iter().sum()
}

/// ∫ n dA over a surface.
pub fn area_vector(mesh: &Mesh, surface: &Surface) -> [f64; 3] {
    surface.facets.iter().fold([0.0; 3], |sum, facet| {
        let area = facet_area_vector(&mesh.facet_coordinates(facet));
        std::array::from_fn(|c| sum[c] + area[c])
    })
}

/// ∫ x·n dA over a facet. Of a bilinear one, x·(∂x/∂ξ × ∂x/∂η) is quadratic in each of ξ, η, so 2×2
/// Gauss points are exact; on a triangle x·n is constant.
fn flux(facet: &FacetCorners) -> f64 {
    let corners = match facet {
        FacetCorners::Triangle(corners) => {
            let area = facet_area_vector(facet);
            return (0..3).map(|c| corners[0][c] * area[c]).sum();
        }
        FacetCorners::Quadrilateral(corners) => corners,
    };
    let gauss = 1.0 / 3.0_f64.sqrt();
    let mut flux = 0.0;
    for (xi, eta) in [(-gauss, -gauss), (gauss, -gauss), (gauss, gauss), (-gauss, gauss)] {
        let sum = |weights: [f64; 4]| -> [f64; 3] {
            std::array::from_fn(|c| (0..4).map(|n| 0.25 * weights[n] * corners[n][c]).sum())
        };
        let (l, r, b, t) = (1.0 - xi, 1.0 + xi, 1.0 - eta, 1.0 + eta);
        let (x, u, v) = (sum([l * b, r * b, r * t, l * t]), sum([-b, b, t, -t]), sum([-l, -r, r, l]));
        flux += (0..3).map(|c| x[c] * (u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3])).sum::<f64>();
    }
    flux
}

/// Asserts that a generated body is sound and watertight; returns the Euler characteristic
/// V − E + F of its boundary.
pub fn assert_sound(mesh: &Mesh) -> i64 {
    assert_eq!(mesh.check(), vec![]);
    assert_eq!(mesh.bodies.len(), 1);
    let boundary = mesh.boundary(0);

    // The named surfaces cover each boundary face once.
    let mut named: Vec<_> =
        mesh.surfaces.values().flat_map(|s| s.facets.iter().map(|f| (f.element, f.nodes))).collect();
    let mut all: Vec<_> = boundary.facets.iter().map(|f| (f.element, f.nodes)).collect();
    named.sort_unstable();
    all.sort_unstable();
    assert_eq!(named, all);
    assert!(mesh.surfaces.keys().all(|name| name.starts_with(&format!("{}_", mesh.bodies[0].name))));

    // Closed: each edge is passed once in each direction, and the outward areas cancel.
    let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for facet in &boundary.facets {
        let count = facet.nodes.len();
        for i in 0..count {
            let (a, b) = (facet.nodes[i], facet.nodes[(i + 1) % count]);
            *edges.entry([a, b]).or_default() += 1;
        }
    }
    assert!(edges.iter().all(|(&[a, b], &count)| count == 1 && edges.get(&[b, a]) == Some(&1)));
    let area = mesh.surface_area(&boundary);
    assert!(area_vector(mesh, &boundary).iter().all(|c| c.abs() < 1e-13 * area));

    // Outward: the divergence theorem gives the volume, V = ∫ x·n dA / 3.
    let volume = volume(mesh);
    let flux: f64 = boundary.facets.iter().map(|facet| flux(&mesh.facet_coordinates(facet))).sum();
    assert!((flux / 3.0 - volume).abs() < 1e-12 * (volume + flux.abs()), "flux {flux}, volume {volume}");
    boundary.nodes().len() as i64 - edges.len() as i64 / 2 + boundary.facets.len() as i64
}

/// Least scaled Jacobian of all elements.
pub fn quality(mesh: &Mesh) -> f64 {
    mesh.element_qualities().into_iter().fold(f64::INFINITY, f64::min)
}

/// Asserts agreement to a relative tolerance.
#[track_caller]
pub fn assert_close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance * expected.abs(), "{value} instead of {expected}");
}

/// A box of unit cubes from the origin.
pub fn cubes(name: &str, elements: [usize; 3]) -> Mesh {
    let max = elements.map(|n| n as f64);
    box_mesh(name, &BoxShape { min: [0.0; 3], max, elements, grading: [1.0; 3] }).unwrap()
}
