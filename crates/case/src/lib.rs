//! Case files: [`case`] reads and checks one, [`build`] makes a problem of it on a [`machine`], [`check`] inspects that before
//! anything is solved.

pub mod build;
pub mod case;
pub mod check;
pub mod machine;
