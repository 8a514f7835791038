//! The facet tree against brute force.

use proptest::prelude::*;
use slipstick_mesh::{FacetNodes, FacetTree, HalfBallShape, half_ball};

/// All facets whose box meets the box, in ascending order, one by one.
fn brute(facets: &[FacetNodes], x: &[f64], min: [f64; 3], max: [f64; 3]) -> Vec<u32> {
    let meets = |facet: &FacetNodes| {
        (0..3).all(|c| {
            let along = facet.iter().map(|&n| x[3 * n as usize + c]);
            let low = along.clone().fold(f64::INFINITY, f64::min);
            let high = along.fold(f64::NEG_INFINITY, f64::max);
            low <= max[c] && high >= min[c]
        })
    };
    (0..).zip(facets).filter(|(_, facet)| meets(facet)).map(|(f, _)| f).collect()
}

fn query(tree: &FacetTree, min: [f64; 3], max: [f64; 3]) -> Vec<u32> {
    let mut hits = Vec::new();
    tree.query(min, max, &mut hits);
    hits
}

/// Coordinates on a coarse lattice, so that boxes touch, coincide and are flat often.
fn lattice() -> impl Strategy<Value = f64> {
    (-4_i32..=4).prop_map(f64::from)
}

fn corners() -> impl Strategy<Value = ([f64; 3], [f64; 3])> {
    (prop::array::uniform3(lattice()), prop::array::uniform3(lattice())).prop_map(|(a, b)| {
        (std::array::from_fn(|c| f64::min(a[c], b[c])), std::array::from_fn(|c| f64::max(a[c], b[c])))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn queries_agree_with_brute_force_also_after_a_refit(
        facets in prop::collection::vec((prop::array::uniform4(0_u32..30), 3_usize..5), 0..70),
        before in prop::collection::vec(lattice(), 90),
        after in prop::collection::vec(lattice(), 90),
        boxes in prop::collection::vec(corners(), 1..12),
    ) {
        let facets: Vec<_> = facets.iter().map(|(nodes, n)| FacetNodes::new(&nodes[..*n]).unwrap()).collect();
        let mut tree = FacetTree::build(&facets, &before);
        prop_assert_eq!(tree.len(), facets.len());
        for &(min, max) in &boxes {
            prop_assert_eq!(query(&tree, min, max), brute(&facets, &before, min, max));
            // A point is the flattest box.
            prop_assert_eq!(query(&tree, min, min), brute(&facets, &before, min, min));
        }
        tree.refit(&after);
        for &(min, max) in &boxes {
            prop_assert_eq!(query(&tree, min, max), brute(&facets, &after, min, max));
        }
    }
}

#[test]
fn a_curved_surface_is_searched_right_and_touching_counts() {
    let mesh = half_ball("b", &HalfBallShape { radius: 1.0, elements: [10, 5, 1] }).unwrap();
    let facets: Vec<FacetNodes> = mesh.surfaces["b_dome"].facets.iter().map(|facet| facet.nodes).collect();
    let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
    let tree = FacetTree::build(&facets, &x);
    for (f, facet) in facets.iter().enumerate() {
        let centre: [f64; 3] =
            std::array::from_fn(|c| facet.iter().map(|&n| mesh.nodes[n as usize][c]).sum::<f64>() / 4.0);
        let (min, max) = (centre.map(|c| c - 0.05), centre.map(|c| c + 0.05));
        let hits = query(&tree, min, max);
        assert!(hits.contains(&(f as u32)));
        assert_eq!(hits, brute(&facets, &x, min, max));
        assert!(hits.len() < 30);
    }
    // The plane y = 0 touches the rim only: one facet per segment of the rim.
    assert_eq!(query(&tree, [-2.0, 0.0, -2.0], [2.0, 1.0, 2.0]).len(), 40);
    assert!(query(&tree, [-2.0, 1e-12, -2.0], [2.0, 1.0, 2.0]).is_empty());
    let (min, max) = tree.bounds().unwrap();
    assert!((0..3).all(|c| (min[c] + 1.0).abs() < 0.02) && max[1] == 0.0);
}

#[test]
fn hits_are_appended_in_order() {
    let x = [0.0; 12];
    let tree = FacetTree::build(&[[0, 1, 2, 3].into(); 9], &x);
    let mut hits = vec![77];
    tree.query([0.0; 3], [0.0; 3], &mut hits);
    assert_eq!(hits, [77, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
    let none = FacetTree::build(&[], &x);
    assert!(none.is_empty() && none.bounds().is_none());
    assert!(query(&none, [-1.0; 3], [1.0; 3]).is_empty());
}

#[test]
fn coordinates_that_are_no_numbers_hit_everything() {
    let facets: Vec<FacetNodes> = (0..20).map(|f| [4 * f, 4 * f + 1, 4 * f + 2, 4 * f + 3].into()).collect();
    let mut x: Vec<f64> = (0..240).map(f64::from).collect();
    let mut tree = FacetTree::build(&facets, &x);
    let nowhere = ([-9.0; 3], [-8.0; 3]);
    assert!(query(&tree, nowhere.0, nowhere.1).is_empty());
    // All corners of facet 7.
    (84..96).for_each(|i| x[i] = f64::NAN);
    tree.refit(&x);
    assert_eq!(query(&tree, nowhere.0, nowhere.1), [7]);
    assert_eq!(query(&FacetTree::build(&facets, &x), nowhere.0, nowhere.1), [7]);
    assert_eq!(query(&tree, [f64::NAN; 3], [f64::NAN; 3]).len(), 20);
}
