//! Tests of the library, in one program: it links once, and its tests share the cores.
//! `cargo test --release -p slipstick --test suite newton::` runs those of one module.

mod body_forces;
mod bolts;
#[path = "../common/mod.rs"]
mod common;
mod conservative;
mod constrained;
mod crushed;
mod curved;
mod derivatives;
mod design_maps;
mod edges;
mod equations;
mod examples;
mod failures;
mod few_facets;
mod free;
mod friction;
mod gradient;
mod heated;
mod hertz;
mod inputs;
mod invariance;
mod joints;
mod jumps;
mod kinks;
mod linear;
mod load_cases;
mod loads;
mod losses;
mod meshes;
mod newton;
mod output;
mod overlaps;
mod pairs;
mod parameters;
mod patch;
mod plasticity;
mod positions;
mod pressures;
mod quantities;
mod quantity_gradients;
mod rigid;
mod rolling;
mod rounding;
mod run;
mod scenarios;
mod schwarz;
mod sections;
mod serendipity;
mod soft_contact;
#[path = "../verification/solved.rs"]
#[allow(dead_code)]
mod solved;
mod springs;
mod symmetry;
#[path = "../common/table.rs"]
mod table;
mod tapers;
mod temperature;
mod temporary;
mod ties;
mod void;
mod void_contact;
mod wound;
