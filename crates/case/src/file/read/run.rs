//! Names of units, output, and solver settings: `[units]`, `[output]`, `[solver]`, `[adjoint]`.

use std::path::{Component, Path};

use super::super::CaseCode;
use super::super::document::Table;
use super::super::resolved::{Adjoint, LinearSolverChoice, Memory, Output, PetscPreconditioner, Solver, Units};

pub(super) fn units(root: &Table<'_>) -> Units {
    root.table("units").map_or(Units::default(), |table| {
        let length = unit(&table, "length");
        let force = unit(&table, "force");
        table.finish();
        Units { length, force }
    })
}

fn unit(table: &Table<'_>, key: &'static str) -> Option<String> {
    let help = "for instance \"mm\" or \"N\"";
    table.string(key).check(CaseCode::Empty, |name| !name.trim().is_empty(), "is empty", help).optional()
}

pub(super) fn output(root: &Table<'_>) -> Output {
    let default = Output { directory: None, every: 10, pieces: false, vtkhdf: false };
    root.table("output").map_or(default, |table| {
        let directory = table
            .string("directory")
            .check(CaseCode::Empty, |path| !path.is_empty(), "is empty", "omit the key")
            .check(
                CaseCode::OutOfRange,
                |path| !path.contains(char::is_control),
                "contains control characters",
                "name a folder for the results, for instance \"results\"",
            )
            .check(
                CaseCode::OutOfRange,
                |path| matches!(Path::new(path).components().next_back(), None | Some(Component::Normal(_))),
                "is no folder of its own: results would lie among other files",
                "name a folder for the results, for instance \"results\"",
            )
            .optional();
        let every = table.integer("every").count(CaseCode::OutOfRange, 1).or(10);
        let pieces = table.boolean("pieces").or(false);
        let vtkhdf = table.boolean("vtkhdf").or(false);
        table.finish();
        Output { directory, every, pieces, vtkhdf }
    })
}

pub(super) fn solver(root: &Table<'_>) -> Solver {
    let petsc_preconditioner = PetscPreconditioner::Direct;
    let default = Solver { linear: LinearSolverChoice::Auto, petsc_options: None, petsc_preconditioner, threads: None };
    root.table("solver").map_or(default, |table| {
        let words = [
            ("auto", LinearSolverChoice::Auto),
            ("direct", LinearSolverChoice::Direct),
            ("multifrontal", LinearSolverChoice::Multifrontal),
            ("strict", LinearSolverChoice::Strict),
            ("schwarz", LinearSolverChoice::Schwarz),
            ("petsc", LinearSolverChoice::Petsc),
            ("cudss", LinearSolverChoice::Cudss),
        ];
        let linear = table.word("linear", &words).or(LinearSolverChoice::Auto);
        let others = "requires the solver PETSc";
        let cure = "omit it, or use `linear = \"petsc\"`";
        let petsc = matches!(linear, LinearSolverChoice::Auto | LinearSolverChoice::Petsc);
        let petsc_options = table
            .string("petsc_options")
            .check(
                CaseCode::OutOfRange,
                |text| text.trim_start().starts_with('-') && !text.contains('\0'),
                "must consist of PETSc options",
                "for instance \"-mat_mumps_icntl_14 60\"",
            )
            .check(CaseCode::Unsupported, |_| petsc, others, cure)
            .optional();
        let words = [("direct", PetscPreconditioner::Direct), ("contact_zone", PetscPreconditioner::ContactZone)];
        let petsc_preconditioner = table
            .word("petsc_preconditioner", &words)
            .check(CaseCode::Unsupported, |chosen| petsc || *chosen == PetscPreconditioner::Direct, others, cure)
            .or(PetscPreconditioner::Direct);
        let threads = table.integer("threads").count(CaseCode::OutOfRange, 1).optional();
        table.finish();
        Solver { linear, petsc_options, petsc_preconditioner, threads }
    })
}

pub(super) fn adjoint(root: &Table<'_>) -> Adjoint {
    let default = Adjoint { memory: Memory::DEFAULT };
    root.table("adjoint").map_or(default, |table| {
        let memory = table
            .string("memory")
            .check(
                CaseCode::OutOfRange,
                |text| Memory::parse(text).is_some(),
                "is not an amount of memory",
                "for instance \"8 GiB\", \"500 MiB\" or \"0\"",
            )
            .map(|text| Memory::parse(&text).unwrap_or(Memory::DEFAULT))
            .or(Memory::DEFAULT);
        table.finish();
        Adjoint { memory }
    })
}
