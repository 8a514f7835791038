//! Tests of the mesh crate: facts from geometry, topology and brute force.

mod assembly;
mod defects;
mod generators;
mod geometry;
mod middles;
mod search;
mod selection;
mod support;
mod topology;
