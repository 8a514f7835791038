//! Views of results: [`render`] draws pictures, [`picture`] draws those of a run, [`report`] makes
//! web pages of runs, [`charts`] names the axes of charts, [`export`] makes surfaces of designs, [`deck`] writes cases as decks for CalculiX and
//! compares its results, [`part`] prepares such a surface to be
//! meshed and analysed as a part, and [`step`] writes parts as solids for CAD.

pub mod charts;
mod closest;
mod crossings;
pub mod deck;
pub mod export;
pub mod part;
pub mod picture;
pub mod render;
pub mod report;
pub mod step;
mod vector;
