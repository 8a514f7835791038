//! Tests of the public functions: against finite differences, dual numbers and an independent implementation.

mod kinematics;
mod picture;
mod pressed;
mod random_poses;
mod reference;
