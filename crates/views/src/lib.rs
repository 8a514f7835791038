//! Views of results: [`render`] draws pictures, [`picture`] draws those of a run, [`report`] makes
//! web pages of runs, and [`export`] makes surfaces of designs.

pub mod export;
pub mod picture;
pub mod render;
pub mod report;
