//! Time integration: the Newmark family of schemes, and step control.
//!
//! An integrator turns an accepted state and a step into a [`Stage`](crate::dynamics::Stage). It
//! uses only displacement, velocity, acceleration and two shifts.

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
pub use scheme::{Integrate, Scheme};
pub use step_control::StepControl;
