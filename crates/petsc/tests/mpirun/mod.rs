//! Programs on several ranks of MPI, for the tests of this crate and of those above it.

use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

/// Set in the processes that are ranks of a test.
const RANK: &str = "SLIPSTICK_TEST_RANK";

/// `mpirun` of a program on so many ranks, with one thread each; `None`, which is said, where it
/// cannot be started.
pub fn mpirun(ranks: usize, program: &Path) -> Option<Command> {
    if let Err(error) = Command::new("mpirun").arg("--version").stdout(Stdio::null()).status() {
        println!("skipped: mpirun cannot be started: {error}");
        return None;
    }
    let mut run = Command::new("mpirun");
    run.args(["--oversubscribe", "-n", &ranks.to_string()]).arg(program);
    for library in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"] {
        run.env(library, "1");
    }
    // OpenMPI refuses the superuser, whom containers have, unless told twice
    run.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    Some(run)
}

/// The `main` of a test whose process is started once for each of `ranks`, as that many ranks which
/// do `rank`.
#[allow(dead_code)] // not every test is its own ranks
pub fn on_ranks(ranks: &[usize], rank: fn()) -> ExitCode {
    if std::env::var_os(RANK).is_some() {
        // the others would wait for ever for a rank that has failed
        let tell = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            tell(panic);
            std::process::abort();
        }));
        rank();
        return ExitCode::SUCCESS;
    }
    let program = std::env::current_exe().expect("a path");
    for &count in ranks {
        let Some(mut run) = mpirun(count, &program) else { return ExitCode::SUCCESS };
        let status = run.env(RANK, "1").status().expect("started before");
        if !status.success() {
            println!("{count} ranks: {status}");
            return ExitCode::FAILURE;
        }
        println!("{count} ranks: ok");
    }
    ExitCode::SUCCESS
}
