//! What people look at: [`render`] draws pictures, [`picture`] those of a run, [`report`] makes web pages of runs, [`export`]
//! surfaces of designs.

pub mod export;
pub mod picture;
pub mod render;
pub mod report;
