//! The commands, one file each.

pub mod bench;
pub mod check;
pub mod completions;
pub mod evaluate;
pub mod explain;
pub mod export;
pub mod gradient;
pub mod new;
pub mod optimize;
pub mod render;
pub mod report;
pub mod resume;
pub mod schema;
pub mod solve;
pub mod study;
pub mod verify;
pub mod verify_deck;
