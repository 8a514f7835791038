//! Orthotropic bodies whose axes turn about a line.

use crate::common::scene::{Scene, of_law};
use crate::common::*;
use crate::gradient::check;
use slipstick::build::build;
use slipstick::case::{LawKind, parse_case};
use slipstick_mesh::{BoxShape, box_mesh};

/// A quarter of a wound ring of radii 10 and 14 under internal pressure, in a plane without Poisson's effect along the
/// axis: u(r) = A r^k + B r^−k with k² = E_t/E_r, from σ_r(a) = −p and σ_r(b) = 0.
///
/// Reference: Lekhnitskii, Theory of Elasticity of an Anisotropic Body (1963), section 26.
#[test]
fn a_wound_ring_under_pressure() {
    let (radial, tangential, ratio) = (2000.0_f64, 30000.0_f64, 0.02);
    let (a, b, pressure) = (10.0_f64, 14.0_f64, 0.5);
    let k = (tangential / radial).sqrt();
    // σ_r = c (u′ + ν_tr u/r), ν_tr = ν_rt E_t/E_r
    let turned = ratio * tangential / radial;
    let c = radial / (1.0 - ratio * turned);
    let stress = |r: f64| [c * (k + turned) * r.powf(k - 1.0), c * (turned - k) * r.powf(-k - 1.0)];
    let ([p, q], [s, t]) = (stress(a), stress(b));
    let determinant = p * t - q * s;
    let (big, small) = (-pressure * t / determinant, pressure * s / determinant);
    let exact = |r: f64| big * r.powf(k) + small * r.powf(-k);
    let mut errors = Vec::new();
    for n in [1, 2] {
        let shape = BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [6 * n, 1, 8 * n], grading: [1.0; 3] };
        let mut mesh = box_mesh("ring", &shape).expect("a mesh");
        for x in &mut mesh.nodes {
            let (r, angle) = (a + x[0], (1.0 - x[2]) * std::f64::consts::FRAC_PI_2);
            *x = [r * angle.cos(), x[1], r * angle.sin()];
        }
        let text = format!(
            "[[body]]\nname = 'ring'\nmesh = {{ file = 'ring.inp' }}\naxes_about = {{ direction = [0, -2, 0] }}\n\
             material = {{ orthotropic = {{ e1 = {radial:?}, e2 = {tangential:?}, e3 = 2000, nu12 = {ratio:?}, nu13 = 0, nu23 = 0, \
             g12 = 800, g13 = 800, g23 = 800 }} }}\n\
             [[set]]\nname = 'x'\nbody = 'ring'\nplane = {{ point = [0, 0, 0], normal = [1, 0, 0] }}\n\
             [[set]]\nname = 'z'\nbody = 'ring'\nplane = {{ point = [0, 0, 0], normal = [0, 0, 1] }}\n\
             [[set]]\nname = 'low'\nbody = 'ring'\nplane = {{ point = [0, 0, 0], normal = [0, 1, 0] }}\n\
             [[set]]\nname = 'end'\nbody = 'ring'\nwithin = 'z'\nnearest = [14, 0, 0]\n\
             [[surface]]\nname = 'bore'\nbody = 'ring'\ncylinder = {{ start = [0, 0, 0], end = [0, 1, 0], radius = 10, tolerance = 0.2 }}\n\
             [[dirichlet]]\nset = 'x'\ncomponents = ['x']\n[[dirichlet]]\nset = 'z'\ncomponents = ['z']\n\
             [[dirichlet]]\nset = 'low'\ncomponents = ['y']\n\
             [[load]]\nsurface = 'bore'\npressure = {pressure:?}\n[load_path]\nsteps = 1\n\
             [[quantity]]\nname = 'end'\ndisplacement = {{ set = 'end', component = 'x' }}\n"
        );
        let mut problem = problem_with(&text, &[("ring.inp", mesh)]);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let found = slipstick::quantities::quantities(&problem, &run.path);
        let found = *found.get("end").expect("a quantity").last().expect("a step");
        println!("{n}: {found}, exact {}", exact(b));
        errors.push((found / exact(b) - 1.0).abs());
    }
    assert!(errors[1] < 0.02 && errors[1] < 0.4 * errors[0], "{errors:?}");
}

/// Axes that differ between the elements of both bodies.
#[test]
fn gradients_of_wound_bodies() {
    let text = of_law(&Scene::default().text(), LawKind::Orthotropic);
    let turned =
        text.replace("\nplace = ", "\naxes_about = { point = [0.3, -1, 0.2], direction = [0.2, 1, 0.1] }\nplace = ");
    assert_ne!(turned, text);
    check("wound", &mut problem(&turned), 7);
}

#[test]
fn a_line_through_a_centroid_is_refused() {
    let cube = "[[body]]\nname = 'cube'\nbox = { min = [0, 0, 0], max = [1, 1, 1], elements = [1, 1, 1] }\n\
                material = { orthotropic = { e1 = 1, e2 = 1, e3 = 1, nu12 = 0, nu13 = 0, nu23 = 0, g12 = 1, g13 = 1, g23 = 1 } }\n\
                axes_about = { point = [0.5, 0.5, 7], direction = [0, 0, 3] }\n[[dirichlet]]\nset = 'cube_ymin'\n\
                [load_path]\nsteps = 1\n";
    let case = parse_case(cube, "case.toml").expect("a case").case;
    let error = build(&case).err().expect("no direction is radial");
    assert!(error.message.contains("no direction is radial") && error.path == "body[0].axes_about", "{error:?}");
    let isotropic =
        Scene::default().text().replacen("\nplace = ", "\naxes_about = { direction = [0, 0, 1] }\nplace = ", 1);
    let errors = parse_case(&isotropic, "case.toml").expect_err("one law for all directions").to_string();
    assert!(errors.contains("the same stiffness in all directions"), "{errors}");
}
