//! The room between the library and its front ends.
//!
//! ```text
//! case file ──read──▶ case ──check, prepare──▶ problem ──start──▶ run ──drive──▶ end
//!                                directory of a run ──resume──▶ ┘
//! ```
//!
//! A case is [read], [checked](check) against the memory of the [`Host`](host::Host), and run: the
//! directory of a [run] records how it started, failed and ended, and an
//! [optimization] is driven to its end or resumed there. Requests, answers and
//! [events](host::Event) are plain data, and every request fails with a
//! [`Failure`](failure::Failure). The program's text, events and exit status and the exceptions of the
//! Python package are renderings of them. Nothing here prints, reads a command line or knows an
//! interpreter. To cancel a request, its host's [interrupt](host::Host::interrupt) returns `true`.
//!
//! A front end that only checks:
//!
//! ```
//! use slipstick::case::{parse_case, template};
//! use slipstick_service::{check::check, failure::Outcome, host::Host, memory::Budget};
//!
//! struct Quiet;
//!
//! impl Host for Quiet {
//!     fn threads(&self, of_case: Option<usize>) -> Outcome<usize> {
//!         Ok(of_case.unwrap_or(1))
//!     }
//!     fn memory(&self) -> Budget {
//!         Budget::of_machine()
//!     }
//!     fn line(&self) -> Vec<String> {
//!         std::env::args().collect()
//!     }
//! }
//!
//! let resolved = parse_case(template("cube-on-cuboid").unwrap().text, "case.toml")?;
//! let (checked, _problem) = check(&Quiet, resolved).map_err(|failure| failure.text())?;
//! assert_eq!((checked.inspection.steps, checked.warnings.len()), (10, 0));
//! assert!(checked.forecast.peak_bytes > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod check;
pub mod failure;
pub mod forecast;
pub mod host;
pub mod memory;
pub mod optimization;
pub mod read;
pub mod run;
pub mod warnings;
