//! Compiles the shim between Rust and PETSc's C interface, with the compiler that PETSc's MPI
//! names.

fn main() {
    println!("cargo::rerun-if-changed=src/shim.c");
    println!("cargo::rerun-if-changed=src/shim.h");
    #[cfg(feature = "petsc")]
    petsc::link();
}

#[cfg(feature = "petsc")]
mod petsc {
    use std::process::Command;

    const CURE: &str = "install PETSc 3.18 or later with MUMPS, for real numbers (on Debian and Ubuntu: \
                        apt-get install libpetsc-real-dev pkg-config), or name the folder of its petsc.pc in \
                        PKG_CONFIG_PATH; or build without the feature `petsc`";

    pub fn link() {
        let library = match pkg_config::Config::new().atleast_version("3.18").probe("petsc") {
            Ok(library) => library,
            Err(error) => {
                println!("cargo::error=the feature `petsc` needs PETSc, which pkg-config does not find: {CURE}");
                println!("cargo::error={}", error.to_string().replace('\n', "; "));
                return;
            }
        };
        // The wrapper of the MPI that PETSc was built with knows that MPI's folders and libraries.
        let wrapper = pkg_config::get_variable("petsc", "ccompiler").unwrap_or_else(|_| "mpicc".into());
        let flags = match Command::new(&wrapper).arg("-show").output() {
            Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).into_owned(),
            _ => {
                println!("cargo::error=`{wrapper} -show`, the compiler of PETSc's MPI, does not work: {CURE}");
                return;
            }
        };
        let mut shim = cc::Build::new();
        shim.file("src/shim.c").includes(&library.include_paths).warnings(true);
        for flag in flags.split_whitespace() {
            if let Some(folder) = flag.strip_prefix("-I") {
                shim.include(folder);
            }
        }
        shim.compile("slipstick_petsc_shim");
        for flag in flags.split_whitespace() {
            if let Some(folder) = flag.strip_prefix("-L") {
                println!("cargo::rustc-link-search=native={folder}");
            } else if let Some(name) = flag.strip_prefix("-l") {
                println!("cargo::rustc-link-lib={name}");
            }
        }
    }
}
