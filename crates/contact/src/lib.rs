//! Mortar contact between deformable bodies: kinematics, Coulomb friction and its enforcement.
//!
//! The discrete contact conditions are those of Rinderer, Popp and Gee (2025), sections 2.2–2.5,
//! with the signs of `docs/method/notation.md`. Everything is based on one object per slave
//! node j, its **mortar row**: signed coefficients `b_js` over the nodes s of both surfaces,
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
//!
#![doc = include_str!("../mortar.svg")]
//!
//! The mortar segments are the parts of the slave facet opposite to each master facet. D and M are
//! integrated over them; they give each slave node its gap, and the forces of its multiplier.
//!
//! The smallest interface, two facets that penetrate each other by 0.01, with a penalty:
//!
//! ```
//! use nalgebra::Vector3;
//! use slipstick_contact::kinematics::{CellRule, MultiplierShape};
//! use slipstick_contact::{ContactInterface, InterfaceOptions};
//!
//! // the slave, of area 1, faces down; the master, of area 9, faces up
//! let slave = [[0.0, 0.0, -0.01], [0.0, 1.0, -0.01], [1.0, 1.0, -0.01], [1.0, 0.0, -0.01]];
//! let master = [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [2.0, 2.0, 0.0], [-1.0, 2.0, 0.0]];
//! let x = [slave, master].concat().concat();
//! let (shape, rule) = (MultiplierShape::Standard, CellRule::Seven);
//! let options = InterfaceOptions { shape, rule, reach: 0.5, feature_angle: 0.8 };
//! let interface = ContactInterface::new(vec![[0, 1, 2, 3].into()], vec![[4, 5, 6, 7].into()], &x, options)?;
//! let mut rows = Vec::new();
//! interface.evaluate(&x, false, &mut interface.workspace(|_| true), &mut rows)?;
//!
//! let mut force = [0.0; 8]; // along the third axis, at each node
//! for row in &rows {
//!     let gap = row.gap() / row.area; // g̃ is the gap times the area around the node
//!     assert!((gap + 0.01).abs() < 1e-12);
//!     let pressure = f64::max(0.0, -2e4 * gap);
//!     let z = row.frame.to_global(&Vector3::new(pressure, 0.0, 0.0));
//!     for (&node, b) in row.support.iter().zip(&row.coefficient) {
//!         force[node as usize] -= b * z[2]; // the residual contains +f, so the force on the node is −f
//!     }
//! }
//! // a pressure of 200 on an area of 1 lifts the slave and presses the master down
//! let [on_slave, on_master] = [&force[..4], &force[4..]].map(|part| part.iter().sum::<f64>());
//! assert!((on_slave - 200.0).abs() < 1e-9 && (on_master + 200.0).abs() < 1e-9);
//! # Ok::<(), slipstick_contact::InterfaceError>(())
//! ```

pub mod enforcement;
pub mod friction;
pub mod kinematics;

mod closed;
mod coarse;
mod cones;
mod interface;
mod overlap;
mod slant;
mod slave_node;

pub use interface::{ContactInterface, InterfaceError, InterfaceOptions, InterfaceWorkspace};
pub use overlap::{COUNTED_BESIDE_CONTACT, COUNTED_OVERLAP, Overlap};
pub use slave_node::SlaveNode;
pub use slipstick_status::ContactStatus;
