//! The solver against a stand-in for the libraries, on any machine, and, where there is a GPU, with
//! cuDSS itself.
#![cfg(unix)]

#[path = "../../linalg/tests/common/mod.rs"]
mod common;
mod stand_in;

use common::{Brick, Random};
use slipstick_cudss::{CudssBackend, CudssError, CudssSolver, Device};
use slipstick_linalg::{Backend, CsrMatrix, FactorizationError, LinearSolver, Precision, solve_verified};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

const BRICK: Brick =
    Brick { nodes: [5, 4, 4], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true };

/// The stand-in: a library compiled from C, used by one test at a time.
struct StandIn {
    path: PathBuf,
    library: libloading::Library,
}

static STAND_IN: OnceLock<Mutex<StandIn>> = OnceLock::new();

impl StandIn {
    fn get() -> MutexGuard<'static, Self> {
        let made = STAND_IN.get_or_init(|| {
            let [path, _] = stand_in::compile(&tempfile::tempdir().unwrap().keep());
            // SAFETY: the library has no initializers.
            let library = unsafe { libloading::Library::new(&path) }.unwrap();
            Mutex::new(Self { path, library })
        });
        let stand_in = made.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        stand_in.set("stand_in_devices", 1);
        stand_in.set("stand_in_major", 1);
        stand_in.set_room(1 << 30);
        stand_in
    }

    fn open(&self) -> Result<Device, CudssError> {
        // SAFETY: the stand-in has the functions of both libraries.
        unsafe { Device::with_libraries(&self.path, &self.path) }
    }

    fn set(&self, function: &str, value: i32) {
        // SAFETY: a function of the stand-in with this argument.
        unsafe { self.library.get::<unsafe extern "C" fn(i32)>(function).unwrap()(value) }
    }

    fn set_room(&self, bytes: usize) {
        // SAFETY: as above.
        unsafe { self.library.get::<unsafe extern "C" fn(usize)>("stand_in_room").unwrap()(bytes) }
    }

    fn live(&self) -> i32 {
        // SAFETY: as above.
        unsafe { self.library.get::<unsafe extern "C" fn() -> i32>("stand_in_live").unwrap()() }
    }
}

/// Solves with `a` and its transpose for one and for three right-hand sides, to the accuracy that
/// all solvers must reach.
fn solves(a: &CsrMatrix, solver: &mut dyn LinearSolver, precision: Precision) {
    let factors = solver.analyse_and_factorize(a).unwrap();
    assert_eq!(factors.precision(), precision);
    let b = Random(2).vector(a.n());
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let most = if factors.precision() == Precision::F64 { 1e-10 } else { 1e-3 };
    for transpose in [false, true] {
        let mut x = vec![0.0; a.n()];
        let report = solve_verified(a, factors.as_ref(), transpose, &b, &mut x, 1e-12).unwrap();
        assert!(a.residual_norm(transpose, &x, &b) <= 1e-12 * norm(&b), "{report:?}");
        let mut raw: Vec<f64> = [1.0, -2.0, 0.5].iter().flat_map(|factor| b.iter().map(move |b| factor * b)).collect();
        if transpose {
            factors.solve_transpose_many(&mut raw);
        } else {
            factors.solve_many(&mut raw);
        }
        for (column, factor) in raw.chunks(a.n()).zip([1.0, -2.0, 0.5]) {
            let error: Vec<f64> = column.iter().zip(&x).map(|(found, x)| found - factor * x).collect();
            assert!(norm(&error) <= most * norm(&x), "{transpose}: {:e}", norm(&error) / norm(&x));
        }
    }
}

#[test]
fn saddle_points_are_solved_in_both_precisions() {
    let stand_in = StandIn::get();
    let before = stand_in.live();
    let device = Arc::new(stand_in.open().unwrap());
    assert_eq!((device.name(), device.version()), ("stand-in", "1.0.0"));
    let (a, _) = BRICK.reduced(1);
    for precision in [Precision::F32, Precision::F64] {
        solves(&a, &mut CudssSolver::new(&device, precision), precision);
    }
    // the first solver of the chain, in single precision
    solves(&a, CudssBackend::new(device.clone()).solver().as_mut(), Precision::F32);
    drop(device);
    assert_eq!(stand_in.live(), before, "everything on the device is freed");
}

/// Factors that are still in use keep their values; those that are not are overwritten.
#[test]
fn factors_in_use_are_not_overwritten() {
    let stand_in = StandIn::get();
    let device = Arc::new(stand_in.open().unwrap());
    let (a, _) = BRICK.reduced(1);
    let twice = CsrMatrix { values: a.values.iter().map(|value| 2.0 * value).collect(), ..a.clone() };
    let mut solver = CudssSolver::new(&device, Precision::F64);
    let symbolic = solver.analyse(&a.pattern).unwrap();
    let b = Random(3).vector(a.n());
    let solve = |factors: &dyn slipstick_linalg::Factorization| {
        let mut x = b.clone();
        factors.solve(&mut x);
        x
    };
    let first = solver.factorize(&symbolic, &a).unwrap();
    let expected = solve(first.as_ref());
    let second = solver.factorize(&symbolic, &twice).unwrap();
    assert_eq!(solve(first.as_ref()), expected);
    let half: Vec<f64> = expected.iter().map(|x| 0.5 * x).collect();
    assert_eq!(solve(second.as_ref()), half);
    drop(first);
    let live = stand_in.live();
    let third = solver.factorize(&symbolic, &a).unwrap();
    assert_eq!(stand_in.live(), live, "the first factors are overwritten");
    assert_eq!((solve(third.as_ref()), solve(second.as_ref())), (expected, half));
}

/// Factors in single precision that nothing uses are freed when a chain goes on to double precision.
#[test]
fn factors_of_the_other_precision_are_freed() {
    let stand_in = StandIn::get();
    let device = Arc::new(stand_in.open().unwrap());
    let (a, _) = BRICK.reduced(1);
    let mut single = CudssSolver::new(&device, Precision::F32);
    let mut double = single.in_precision(Precision::F64);
    let symbolic = single.analyse(&a.pattern).unwrap();
    let before = stand_in.live();
    drop(single.factorize(&symbolic, &a).unwrap());
    let one = stand_in.live() - before;
    let factors = double.factorize(&symbolic, &a).unwrap();
    assert_eq!(stand_in.live() - before, one);
    drop((factors, single, double));
    assert_eq!(stand_in.live(), before);
}

#[test]
fn failures_say_what_is_missing() {
    let stand_in = StandIn::get();
    let before = stand_in.live();
    let message = |device: Result<Device, CudssError>| device.map(|_| ()).unwrap_err().to_string();
    // SAFETY: as above, or there is no library.
    let missing = unsafe { Device::with_libraries(Path::new("/nonesuch/libcuda.so"), &stand_in.path) };
    assert!(message(missing).starts_with("the CUDA driver cannot be loaded: "));
    // SAFETY: as above.
    let missing = unsafe { Device::with_libraries(&stand_in.path, Path::new("/nonesuch/libcudss.so")) };
    assert!(message(missing).starts_with("cuDSS cannot be loaded: "));
    stand_in.set("stand_in_major", 0);
    assert_eq!(message(stand_in.open()), "found cuDSS 0.0.0, but version 1 is required");
    stand_in.set("stand_in_major", 1);
    stand_in.set("stand_in_devices", 0);
    assert_eq!(stand_in.open().map(|_| ()), Err(CudssError::NoDevice));
    assert_eq!(stand_in.live(), before);
}

/// If the device is full, the error says so; in the chain, the processor solves a matrix of this size.
#[test]
fn a_full_device_is_reported() {
    let stand_in = StandIn::get();
    let device = Arc::new(stand_in.open().unwrap());
    let (a, _) = BRICK.reduced(1);
    stand_in.set_room(1000);
    let mut solver = CudssSolver::new(&device, Precision::F32);
    let error = solver.analyse_and_factorize(&a).map(|_| ()).unwrap_err();
    let FactorizationError::Backend { solver: "cuDSS", reason, .. } = error else { panic!("{error}") };
    assert!(reason.starts_with("stand-in has too little memory for allocating an array"), "{reason}");
    let used = stand_in.live();
    // the last solver of the chain, on the processor
    solves(&a, CudssBackend::new(device.clone()).solver().as_mut(), Precision::F64);
    assert_eq!(stand_in.live(), used);
}

/// A free body: no factors pass the test, and the processor's name the unknown.
#[test]
fn a_singular_matrix_is_reported() {
    let stand_in = StandIn::get();
    let device = Arc::new(stand_in.open().unwrap());
    let (a, _) = Brick { fixed_bottom: false, multipliers: false, contrast: 0.0, nonsymmetry: 0.0, ..BRICK }.reduced(1);
    let singular = CudssBackend::new(device).solver().analyse_and_factorize(&a).map(|_| ());
    assert!(matches!(singular, Err(FactorizationError::Singular { .. })), "{singular:?}");
}

/// With cuDSS itself, where there is a GPU.
#[test]
fn cudss_solves_on_a_gpu() {
    let device = match Device::open() {
        Ok(device) => Arc::new(device),
        Err(reason) => return println!("not run: {reason}"),
    };
    let (a, _) = Brick { nodes: [12, 12, 12], ..BRICK }.reduced(1);
    for precision in [Precision::F32, Precision::F64] {
        solves(&a, &mut CudssSolver::new(&device, precision), precision);
    }
    solves(&a, CudssBackend::new(device).solver().as_mut(), Precision::F32);
}
