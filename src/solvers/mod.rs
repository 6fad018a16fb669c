//! Solvers of one stage: Newton's method on the full system (3.10), and the linear solvers below it.
//!
//! A solver sees a [`Stage`](crate::dynamics::Stage) and the equations as
//! [`Dynamics`](crate::dynamics::Dynamics); it knows neither elements nor time integration.

mod convergence;
mod forcing;
mod ladder;
mod linear;
mod monolithic;
mod presets;

pub use convergence::{IterationReport, Outcome, SolveReport};
pub use forcing::Forcing;
pub use ladder::{LinearChoice, Problem, ladder, storage};
pub use linear::{Fallback, LinearSolver, Solved};
pub use monolithic::{Monolithic, NewtonSettings};
pub use presets::{PRESETS, Preset};
