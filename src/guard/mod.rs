//! Supervision of a run: steps that are too long for the contact, energy without an origin, and
//! impacts.

mod closing;
mod motion;
mod passage;
mod run;
mod slide;
mod unexplained;

pub use closing::{ClosingContact, closings};
pub use motion::MotionWatch;
pub use passage::missed_contact;
pub use run::RunGuard;
pub use slide::{Slide, slides};
