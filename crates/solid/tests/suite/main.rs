//! Tests of the public functions, in one program: each further one would compile the kernels again.

mod assembly;
mod heat;
mod incompressible;
mod neo_hooke_forms;
mod plasticity;
mod positions;
mod wedges;
