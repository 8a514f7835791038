//! Resumption, bad input, extreme scales.

use super::*;

/// A history that is written as JSON and read back gives the same bits as one that stays in memory.
#[test]
fn resumes_bit_for_bit() {
    let (lower, upper) = ([1.0; 5], [10.0; 5]);
    let advance = |mma: &mut Mma, x: &mut Vec<f64>| {
        let (value, gradient, constraints, constraint_gradients) = cantilever(x);
        *x = mma
            .update(x, [&lower, &upper], &Functions::new(value, &gradient, &constraints, &constraint_gradients))
            .unwrap()
            .x;
    };
    let mut kept = Mma::new(5, 1, MmaParameters::default());
    let mut x = vec![5.0; 5];
    for _ in 0..9 {
        let mut read: Mma = serde_json::from_str(&serde_json::to_string(&kept).unwrap()).unwrap();
        assert_eq!(read, kept);
        let mut x_read: Vec<f64> = serde_json::from_str(&serde_json::to_string(&x).unwrap()).unwrap();
        advance(&mut kept, &mut x);
        advance(&mut read, &mut x_read);
        assert_eq!(x_read, x);
        assert_eq!(read, kept);
    }
}

/// Whether `error` reports that entry `index` of `vector` is not finite.
fn not_finite(error: &MmaError, vector: &str, index: usize) -> bool {
    matches!(error, MmaError::NotFinite { what, index: i, .. } if what.contains(vector) && *i == index)
}

#[test]
fn bad_input_is_named_and_leaves_the_history() {
    let mut mma = Mma::new(2, 1, MmaParameters::default());
    let fresh = mma.clone();
    let (x, lower, upper) = ([0.5; 2], [0.0; 2], [1.0; 2]);
    let good = vec![vec![1.0; 2]];
    let nan = f64::NAN;
    let error = mma.update(&x, [&lower, &upper], &Functions::new(nan, &[1.0; 2], &[0.0], &good)).unwrap_err();
    assert!(not_finite(&error, "objective", 0));
    let error =
        mma.update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0, f64::INFINITY], &[0.0], &good)).unwrap_err();
    assert!(not_finite(&error, "objective gradient", 1));
    let error = mma.update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[nan], &good)).unwrap_err();
    assert!(not_finite(&error, "constraint values", 0));
    let error =
        mma.update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &[vec![0.0, nan]])).unwrap_err();
    assert!(not_finite(&error, "gradient of constraint 0", 1));
    let error = mma.update(&[0.5, nan], [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &good)).unwrap_err();
    assert!(not_finite(&error, "design", 1));
    let error = mma.update(&[0.5, 1.5], [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &good)).unwrap_err();
    assert_eq!(error, MmaError::Bounds { index: 1, value: 1.5, lower: 0.0, upper: 1.0 });
    let error = mma.update(&x, [&upper, &lower], &Functions::new(1.0, &[1.0; 2], &[0.0], &good)).unwrap_err();
    assert!(matches!(error, MmaError::Bounds { index: 0, .. }));
    let error = mma.update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &[])).unwrap_err();
    assert!(matches!(error, MmaError::Length { expected: 1, found: 0, .. }));
    assert_eq!(mma, fresh);
    assert!(mma.update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &good)).is_ok());

    let wrong = MmaParameters { asydecr: 1.5, ..MmaParameters::default() };
    let error =
        Mma::new(2, 1, wrong).update(&x, [&lower, &upper], &Functions::new(1.0, &[1.0; 2], &[0.0], &good)).unwrap_err();
    assert!(matches!(error, MmaError::Parameter { name: "asydecr", .. }));
}

/// An incomplete history that was read back is reported; it causes neither a panic nor a step.
#[test]
fn a_damaged_memory_is_named() {
    let (lower, upper) = ([1.0; 5], [10.0; 5]);
    let mut mma = Mma::new(5, 1, MmaParameters::default());
    let mut x = vec![5.0; 5];
    for _ in 0..3 {
        assert_eq!(mma.check(5, 1), Ok(()));
        let (value, gradient, constraints, slopes) = cantilever(&x);
        x = mma.update(&x, [&lower, &upper], &Functions::new(value, &gradient, &constraints, &slopes)).unwrap().x;
    }
    assert!(matches!(mma.check(4, 1), Err(MmaError::Length { expected: 4, found: 5, .. })));
    assert!(matches!(mma.check(5, 2), Err(MmaError::Length { expected: 2, found: 1, .. })));
    let whole = serde_json::to_value(&mma).unwrap();
    type Damage<'a> = (&'a str, &'a dyn Fn(&mut serde_json::Value));
    let damages: [Damage<'_>; 6] = [
        ("one step ago has 4", &|v| drop(v["x1"].as_array_mut().unwrap().pop())),
        ("two steps ago has 0", &|v| v["x2"] = serde_json::json!([])),
        ("lower asymptotes has 6", &|v| v["low"].as_array_mut().unwrap().push(1.0.into())),
        ("upper asymptotes has 0", &|v| v["upp"] = serde_json::json!([])),
        ("one step ago has 5", &|v| v["iteration"] = 0.into()),
        ("outside its bounds", &|v| v["low"][2] = 100.0.into()),
    ];
    for (expected, damage) in damages {
        let mut value = whole.clone();
        damage(&mut value);
        let mut damaged: Mma = serde_json::from_value(value).unwrap();
        let error = damaged.check(5, 1).unwrap_err();
        assert!(error.to_string().contains(expected), "{expected}: {error}");
        let (value, gradient, constraints, slopes) = cantilever(&x);
        let step = damaged.update(&x, [&lower, &upper], &Functions::new(value, &gradient, &constraints, &slopes));
        assert_eq!(step.unwrap_err(), error);
    }
}

/// Derivatives from 1e-12 to 1e12 either give a step or an error that asks for scaling.
#[test]
fn extreme_scales() {
    for exponent in [-300, -12, -6, 6, 12, 200] {
        let size = 10f64.powi(exponent);
        let mut mma = Mma::new(3, 1, MmaParameters::default());
        let gradients = [vec![1.0, 0.5, 0.2]];
        let gradient = [size, -size, 0.0];
        match mma.update(&[0.5; 3], [&[0.0; 3], &[1.0; 3]], &Functions::new(size, &gradient, &[0.1], &gradients)) {
            Ok(step) => assert!(step.x.iter().all(|x| (0.0..=1.0).contains(x))),
            Err(error) => assert!(matches!(error, MmaError::Subproblem { .. }) && exponent > 6, "{exponent}: {error}"),
        }
    }
}

/// If only a few floating-point numbers lie between the bounds, the result is still one of them.
#[test]
fn narrow_bounds_far_from_zero() {
    for range in [1e-3, 1e-6, 1e-9, 2e-10] {
        let (lower, upper) = ([1e6], [1e6 + range]);
        let mut mma = Mma::new(1, 1, MmaParameters::default());
        let mut x = vec![1e6 + 0.5 * range];
        for _ in 0..10 {
            let (value, slope) = ((x[0] - 1e6) / range, [1.0 / range]);
            let step = mma.update(&x, [&lower, &upper], &Functions::new(value, &slope, &[-1.0], &[vec![0.0]])).unwrap();
            assert!(lower[0] <= step.x[0] && step.x[0] <= x[0]);
            x = step.x;
        }
        // To 1e-5 of the range, or the spacing of numbers at 1e6.
        assert!(x[0] - 1e6 <= (1e-5 * range).max(1.2e-10), "{range:e}: {:e}", x[0] - 1e6);
    }
}
