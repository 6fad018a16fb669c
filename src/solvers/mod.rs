//! Solvers of one stage: Newton's method on the full system (3.10), the two-stage scheme (3.6),
//! (3.7), and the linear solvers that both use.
//!
//! A solver uses a [`Stage`](crate::dynamics::Stage) and the equations as
//! [`Dynamics`](crate::dynamics::Dynamics). It does not depend on elements or time integration.

mod augmented;
mod coarse;
mod convergence;
mod descent;
mod diagonal;
mod fatigue;
mod filtered_amg;
mod filtered_ilu;
mod forcing;
mod free_motion;
mod held;
pub mod incomplete;
mod joined;
mod kept_tangent;
mod ladder;
mod linear;
mod monolithic;
mod one_rank;
mod own;
mod progress;
mod staggered;
mod strategy;
mod subdomain;
mod tried;
mod two_stage;
mod users_options;
mod zone;
mod zone_rows;

pub use crate::presets::{PRESETS, Preset, Second};
pub use augmented::Augmented;
pub use coarse::CoarseSpace;
pub use convergence::{IterationReport, Outcome, SolvePhase, SolveReport, Trouble};
pub use forcing::Forcing;
pub use free_motion::FreeMotions;
pub use held::{Driven, HeldMotions, describe};
pub use ladder::{LinearChoice, Problem, ladder, storage};
pub use linear::{Fallback, LinearSolver, Solved};
pub use monolithic::{Monolithic, NewtonSettings};
pub use staggered::{StageMatrix, Staggered, StaggeredSettings};
pub use strategy::{STRATEGIES, Strategy, first_guess};
pub use two_stage::TwoStageSettings;
