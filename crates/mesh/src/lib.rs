//! Hexahedral meshes of several bodies, with named node sets and oriented surfaces.
//!
//! This crate knows geometry and topology only; it knows no physics.

mod mesh;

pub use mesh::{Body, Facet, HEX_FACES, Mesh, Surface};
