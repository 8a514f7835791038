//! Mortar contact between deformable bodies: kinematics, Coulomb friction and its enforcement.
//!
//! The discrete contact conditions are those of Rinderer, Popp and Gee (2025), sections 2.2–2.5,
//! with the signs of `docs/notation.md`. Everything is based on one object per slave node j, its
//! **mortar row**: signed coefficients `b_js` over the nodes s of both surfaces,
//!
//! ```text
//! b_js = +D_jk  for a slave node s = k,      b_js = −M_jl  for a master node s = l,      Σ_s b_js = 0
//! w_j  = Σ_s b_js x_s                       weighted relative position, 3-vector
//! g̃_j  = −n_j · w_j                          weighted gap, ≥ 0 open                            (22)
//! ũ_τj = −τ_jᵀ (w_j − Σ_s b_js,n−1 x_s)       objective slip increment                          (24)
//! f_s += b_js z_j                            contact force                                     (17)
//! ```
//!
//! so the enforcement methods only need the coefficients and their gradients from the geometry.
//! This crate has no notion of design variables or time.

pub mod enforcement;
pub mod friction;
pub mod kinematics;

mod cones;
mod interface;
mod overlap;
mod slant;
mod slave_node;

pub use interface::{ContactInterface, InterfaceError, InterfaceOptions, InterfaceWorkspace};
pub use overlap::{COUNTED_BESIDE_CONTACT, COUNTED_OVERLAP, Overlap};
pub use slave_node::SlaveNode;
