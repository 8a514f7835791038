use super::*;
use crate::equations::motion::{Component, RotationAxis, Waypoint};

fn nodes(nodes: &[u32]) -> Moved {
    Moved::Nodes(nodes.to_vec())
}

fn driven() -> Dirichlet {
    Dirichlet {
        set: "top".into(),
        load_case: None,
        components: vec![Component::X, Component::Y, Component::Z],
        rotations: Vec::new(),
        motion: vec![
            Waypoint { t: 0.5, u: [0.0, -1.0, 0.0], angle: 0.0 },
            Waypoint { t: 1.0, u: [2.0, -1.0, 0.0], angle: 90.0 },
        ],
        rotation: Some(RotationAxis { point: [1.0, 0.0, 0.0], direction: [0.0, 2.0, 0.0] }),
        from: 0.0,
        until: None,
    }
}

#[test]
fn motion_is_piecewise_linear_and_rotates_about_its_axis() {
    let prescribed = Prescribed::new(vec![driven()], &[nodes(&[0])], &[2.0, 5.0, 0.0], &[]).unwrap();
    let mut d = vec![0.0; 3];
    prescribed.apply(0.25.into(), &mut d);
    assert_eq!(d, [0.0, -0.5, 0.0]);
    prescribed.apply(1.0.into(), &mut d);
    // a quarter turn about +y takes the arm +x to −z
    for (found, exact) in d.iter().zip([2.0 - 1.0, -1.0, -1.0]) {
        assert!((found - exact).abs() < 1e-15);
    }
    assert!((prescribed.largest(&[0.5.into(), 1.0.into()]) - 3f64.sqrt()).abs() < 1e-14);
}

/// Motion and angle scaled by 1 ± h in the tables themselves.
#[test]
fn amplitudes_match_finite_differences() {
    let coordinates = [2.0, 5.0, 0.0, 0.3, -1.0, 0.8];
    let at = |factor: f64| {
        let mut motion = driven();
        for waypoint in &mut motion.motion {
            waypoint.u.iter_mut().for_each(|u| *u *= factor);
            waypoint.angle *= factor;
        }
        Prescribed::new(
            vec![Dirichlet { set: "rest".into(), ..driven() }, motion],
            &[nodes(&[1]), nodes(&[0])],
            &coordinates,
            &[],
        )
        .unwrap()
    };
    let weights = [0.3, -0.7, 1.1, 0.0, 0.0, 0.0];
    let (h, time) = (1e-5, 0.8);
    let value = |factor: f64| {
        let mut d = [0.0; 6];
        at(factor).apply(time.into(), &mut d);
        d.iter().zip(weights).map(|(d, w)| d * w).sum::<f64>()
    };
    let mut slopes = [0.0; 2];
    at(1.0).pull_back_amplitudes(time.into(), &weights, &mut slopes);
    let expected = (value(1.0 + h) - value(1.0 - h)) / (2.0 * h);
    assert!((slopes[1] - expected).abs() < 1e-9, "{} for {expected}", slopes[1]);
    assert_eq!(slopes[0], 0.0);
}

#[test]
fn contradicting_tables_are_refused() {
    let mut other = driven();
    other.motion.pop();
    let result =
        Prescribed::new(vec![driven(), driven(), other], &[nodes(&[0]), nodes(&[0]), nodes(&[0])], &[0.0; 3], &[]);
    let set = "top".to_owned();
    assert_eq!(
        result.unwrap_err(),
        ConflictingMotion { node: 0, component: 0, first: 0, set, motion: 2, temporary: false }
    );
}

/// A support and a motion within its plane meet at a node: they agree in y, which both hold,
/// and differ in x.
#[test]
fn tables_may_share_a_component_that_both_hold() {
    let held = |components: &[Component]| Dirichlet {
        set: "plane".into(),
        components: components.to_vec(),
        rotations: Vec::new(),
        motion: Vec::new(),
        rotation: None,
        load_case: None,
        from: 0.0,
        until: None,
    };
    let mut pushed = driven();
    (pushed.motion, pushed.rotation) = (vec![Waypoint { t: 1.0, u: [2.0, 0.0, 0.0], angle: 0.0 }], None);
    let of = |held| Prescribed::new(vec![held, pushed.clone()], &[nodes(&[0]), nodes(&[0])], &[0.0; 3], &[]);
    let mut d = [9.0; 3];
    of(held(&[Component::Y])).unwrap().apply(0.5.into(), &mut d);
    assert_eq!(d, [1.0, 0.0, 0.0]);
    let conflict = of(held(&[Component::X, Component::Y])).unwrap_err();
    assert_eq!((conflict.component, conflict.first, conflict.motion), (0, 0, 1));
    assert!(conflict.to_string().contains("`plane`"), "{conflict}");
}

/// Two cases move one node differently; another node moves only in the second case.
#[test]
fn each_load_case_has_its_motions() {
    let of = |case: &str, y: f64| Dirichlet {
        load_case: Some(case.into()),
        motion: vec![Waypoint { t: 1.0, u: [0.0, y, 0.0], angle: 0.0 }],
        rotation: None,
        ..driven()
    };
    let motions = vec![of("a", -1.0), of("b", 2.0), of("b", 3.0)];
    let prescribed =
        Prescribed::new(motions, &[nodes(&[0]), nodes(&[0]), nodes(&[1])], &[0.0; 6], &["a", "b"]).unwrap();
    let at = |time: f64| {
        let mut d = [9.0; 6];
        prescribed.apply(LoadTime::of_axis(time), &mut d);
        (d[1], d[4])
    };
    assert_eq!([at(0.5), at(1.0), at(2.0), at(3.0)], [(-0.5, 0.0), (-1.0, 0.0), (0.0, 0.0), (2.0, 3.0)]);
    assert_eq!(prescribed.largest_step(&LoadTime::ends(2, 2)), 1.5);
    let mut slopes = [0.0; 3];
    prescribed.pull_back_amplitudes(LoadTime::of_axis(2.5), &[1.0; 6], &mut slopes);
    assert_eq!(slopes, [0.0, 1.0, 1.5]);
    let twice = Prescribed::new(vec![of("a", 1.0), driven()], &[nodes(&[0]), nodes(&[0])], &[0.0; 3], &["a"]);
    let set = "top".to_owned();
    assert_eq!(
        twice.unwrap_err(),
        ConflictingMotion { node: 0, component: 0, first: 0, set, motion: 1, temporary: false }
    );
}
