//! The processes that solve a problem: a single one, or the ranks of a parallel run.

use crate::build::{BuildError, Platform};
use crate::case::{self, LinearSolverChoice};
use slipstick_linalg::{Alone, Automatic, Nodes, Precision, Ranks, Schwarz, SolverChoice};
use slipstick_mesh::Mesh;
use slipstick_path::LinearSystem;
use std::sync::Arc;

/// The processes that solve a problem: this one only, or, with the feature `petsc`, the ranks of a
/// session.
#[derive(Debug, Clone, Default)]
pub struct Machine {
    #[cfg(feature = "petsc")]
    session: Option<slipstick_petsc::Session>,
}

impl Machine {
    /// The ranks of a PETSc session; a process can have only one.
    #[cfg(feature = "petsc")]
    pub fn of(session: slipstick_petsc::Session) -> Self {
        Self { session: Some(session) }
    }

    /// The ranks of the machine.
    pub fn ranks(&self) -> Arc<dyn Ranks> {
        #[cfg(feature = "petsc")]
        if let Some(session) = &self.session {
            return Arc::new(session.clone());
        }
        Arc::new(Alone)
    }

    #[cfg(feature = "petsc")]
    fn petsc(
        &self,
        solver: &case::Solver,
        owners: &[u32],
        mesh: &Mesh,
        slaves: &[&str],
    ) -> Result<LinearSystem, BuildError> {
        let Some(session) = &self.session else {
            return Err(BuildError::new(
                "solver.linear",
                "PETSc is not started",
                "create the machine from a PETSc session",
            ));
        };
        if let Some(options) = &solver.petsc_options {
            let contact_zone = solver.petsc_preconditioner == case::PetscPreconditioner::ContactZone;
            session.try_options(options, contact_zone).map_err(|error| {
                let help = "give options of its linear solver as PETSc's manual writes them (docs/cluster.md); set others \
                            in the variable PETSC_OPTIONS";
                BuildError::new("solver.petsc_options", error, help)
            })?;
        }
        let backend = slipstick_petsc::PetscBackend::new(session.clone(), owners);
        Ok(LinearSystem::new(match solver.petsc_preconditioner {
            case::PetscPreconditioner::Direct => backend,
            case::PetscPreconditioner::ContactZone => backend.with_contact_zone(contact_zone(mesh, slaves)),
        }))
    }

    #[cfg(not(feature = "petsc"))]
    fn petsc(&self, _: &case::Solver, _: &[u32], _: &Mesh, _: &[&str]) -> Result<LinearSystem, BuildError> {
        Err(BuildError::new(
            "solver.linear",
            "this program was built without PETSc",
            "choose \"auto\", or build it with `--features petsc` (docs/cluster.md)",
        ))
    }
}

impl Platform for Machine {
    fn ranks(&self) -> Arc<dyn Ranks> {
        self.ranks()
    }

    fn linear(
        &self,
        solver: &case::Solver,
        owners: &[u32],
        mesh: &Mesh,
        slaves: &[&str],
    ) -> Result<LinearSystem, BuildError> {
        let several = self.ranks().size() > 1;
        let alone = || match several {
            false => Ok(()),
            true => Err(BuildError::new(
                "solver.linear",
                "this solver works on one rank only",
                "choose \"petsc\", or omit the key",
            )),
        };
        let one = |choice: SolverChoice| alone().map(|()| LinearSystem::new(choice));
        match solver.linear {
            LinearSolverChoice::Auto if !several => Ok(LinearSystem::new(Automatic(nodes(mesh)))),
            LinearSolverChoice::Direct => one(SolverChoice::Auto),
            LinearSolverChoice::Multifrontal => one(SolverChoice::Multifrontal { precision: Precision::F64 }),
            LinearSolverChoice::Strict => one(SolverChoice::Strict),
            LinearSolverChoice::Schwarz => alone().map(|()| LinearSystem::new(Schwarz(nodes(mesh)))),
            LinearSolverChoice::Cudss => alone().and_then(|()| cudss()),
            LinearSolverChoice::Auto | LinearSolverChoice::Petsc => self.petsc(solver, owners, mesh, slaves),
        }
    }
}

/// The contact zone around these slave surfaces.
#[cfg(feature = "petsc")]
pub fn contact_zone(mesh: &Mesh, slaves: &[&str]) -> slipstick_petsc::ContactZone {
    let nodes: Vec<u32> = slaves.iter().filter_map(|name| mesh.surfaces.get(*name)).flat_map(|s| s.nodes()).collect();
    let mut zone = slipstick_petsc::ContactZone::new(mesh.nodes.as_slice(), nodes);
    zone.apart = mesh.rigid.iter().flat_map(|rigid| [rigid.reference, rigid.rotation()]).collect();
    zone
}

/// The solver on a GPU.
#[cfg(feature = "cudss")]
fn cudss() -> Result<LinearSystem, BuildError> {
    use slipstick_cudss::{CudssBackend, CudssError, Device};

    let device = Device::open().map_err(|error| {
        let help = match error {
            CudssError::Library { .. } | CudssError::Version { .. } => {
                "install the NVIDIA driver and cuDSS 1, and name the folder of libcudss in LD_LIBRARY_PATH \
                 (docs/gpu.md); or choose \"auto\""
            }
            _ => "choose \"auto\", or check with `nvidia-smi` that a GPU is free (docs/gpu.md)",
        };
        BuildError::new("solver.linear", error, help)
    })?;
    Ok(LinearSystem::new(CudssBackend::new(Arc::new(device))))
}

#[cfg(not(feature = "cudss"))]
fn cudss() -> Result<LinearSystem, BuildError> {
    Err(BuildError::new(
        "solver.linear",
        "this program was built without cuDSS",
        "choose \"auto\", or build it with `--features cudss` (docs/gpu.md)",
    ))
}

/// The nodes of a mesh for the Schwarz preconditioner.
fn nodes(mesh: &Mesh) -> Nodes {
    let mut bodies = vec![None; mesh.nodes.len()];
    for (body, number) in mesh.bodies.iter().zip(0..) {
        bodies[body.nodes.clone()].fill(Some(number));
    }
    for rigid in &mesh.rigid {
        [rigid.reference, rigid.rotation()].into_iter().for_each(|node| bodies[node as usize] = None);
    }
    Nodes { coordinates: mesh.nodes.as_slice().into(), bodies: bodies.into() }
}
