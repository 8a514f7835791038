//! The slipstick program.
fn main() {}
