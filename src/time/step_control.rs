//! Step control of a run: equal steps, or steps as long as the errors allow.

use serde::{Deserialize, Serialize};

use super::adaptive::{Adaptive, Judgement};
use super::halving::Halving;
use super::retry::Retry;

/// Step control of a run. It contains the complete state that is needed to resume.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepControl {
    /// Equal steps that are halved on failure.
    Halving(Halving),
    /// Steps that follow an error estimate.
    Adaptive(Adaptive),
}

impl StepControl {
    /// Creates steps of about `step` from `start` to `end` \[s\], each cut at most `max_depth`
    /// times; see [`Halving`].
    pub fn new(start: f64, end: f64, step: f64, max_depth: u32) -> Self {
        Self::Halving(Halving::new(start, end, step, max_depth))
    }

    /// Creates steps of at most `largest` that follow their errors and end at each of `instants`
    /// \[s\]; see [`Adaptive`].
    pub fn adaptive([start, end]: [f64; 2], largest: f64, instants: &[f64], max_cuts: u32) -> Self {
        Self::Adaptive(Adaptive::new([start, end], largest, instants, max_cuts))
    }

    /// Whether the end is reached.
    pub fn finished(&self) -> bool {
        match self {
            Self::Halving(steps) => steps.finished(),
            Self::Adaptive(steps) => steps.finished(),
        }
    }

    /// Length of the next step \[s\].
    pub fn dt(&self) -> f64 {
        match self {
            Self::Halving(steps) => steps.dt(),
            Self::Adaptive(steps) => steps.dt(),
        }
    }

    /// Current time \[s\].
    pub fn time(&self) -> f64 {
        match self {
            Self::Halving(steps) => steps.time(),
            Self::Adaptive(steps) => steps.time(),
        }
    }

    /// Time at the end of the next step \[s\].
    pub fn end_of_step(&self) -> f64 {
        match self {
            Self::Halving(steps) => steps.end_of_step(),
            Self::Adaptive(steps) => steps.end_of_step(),
        }
    }

    /// The end \[s\].
    pub fn end(&self) -> f64 {
        match self {
            Self::Halving(steps) => steps.end(),
            Self::Adaptive(steps) => steps.end(),
        }
    }

    /// Completed fraction of the interval, between 0 and 1.
    pub fn fraction(&self) -> f64 {
        match self {
            Self::Halving(steps) => steps.fraction(),
            Self::Adaptive(steps) => steps.fraction(),
        }
    }

    /// Number of cuts of steps, either after an attempt that was rolled back or before the step was
    /// tried.
    pub fn cuts(&self) -> u64 {
        match self {
            Self::Halving(steps) => steps.cuts(),
            Self::Adaptive(steps) => steps.cuts(),
        }
    }

    /// Number of steps that were solved and repeated because their errors were too large.
    pub fn rejected(&self) -> u64 {
        match self {
            Self::Halving(_) => 0,
            Self::Adaptive(steps) => steps.rejected(),
        }
    }

    /// Whether the next step is at most the shortest that errors can request.
    pub fn is_shortest(&self) -> bool {
        match self {
            Self::Halving(_) => false,
            Self::Adaptive(steps) => steps.is_shortest(),
        }
    }

    /// Decides whether a solved step is accepted. Equal steps are always accepted.
    pub fn judge(&mut self, judgement: &Judgement) -> bool {
        match self {
            Self::Halving(_) => true,
            Self::Adaptive(steps) => steps.judge(judgement),
        }
    }

    /// Records that the step is accepted.
    pub fn succeed(&mut self) {
        match self {
            Self::Halving(steps) => steps.succeed(),
            Self::Adaptive(steps) => steps.succeed(),
        }
    }

    /// Whether a shorter step can be tried.
    pub fn can_cut(&self) -> bool {
        match self {
            Self::Halving(steps) => steps.can_cut(),
            Self::Adaptive(steps) => steps.can_cut(),
        }
    }

    /// Records that the step failed, and shortens it.
    pub fn fail(&mut self) -> Retry {
        match self {
            Self::Halving(steps) => steps.fail(),
            Self::Adaptive(steps) => steps.fail(),
        }
    }
}
