//! Results on disk: [`output`] has the file formats, [`run`] the directory of a run.

pub mod output;
pub mod run;
