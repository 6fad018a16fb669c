//! Time integration: Newmark and its family, and the control of the step.
//!
//! An integrator turns an accepted state and a step into a [`Stage`](crate::dynamics::Stage); it sees
//! displacement, velocity, acceleration and two shifts, nothing else.

mod adaptive;
mod budget;
pub mod estimate;
mod halving;
mod retry;
pub mod saturation;
mod scheme;
mod step_control;

pub use adaptive::{Adaptive, Judgement};
pub use budget::Budget;
pub use halving::Halving;
pub use retry::Retry;
pub use scheme::{SCHEMES, Scheme, SchemeEntry};
pub use step_control::StepControl;
