//! Time integration: Newmark and its family, and the control of the step.
//!
//! An integrator turns an accepted state and a step into a [`Stage`](crate::dynamics::Stage); it sees
//! displacement, velocity, acceleration and two shifts, nothing else.

mod scheme;
mod step_control;

pub use scheme::{SCHEMES, Scheme, SchemeEntry};
pub use step_control::{Retry, StepControl};
