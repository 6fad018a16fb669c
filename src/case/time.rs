//! `time`: from when to when, in which steps, by which scheme.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::quantity::{Duration, Number};
use crate::reader::tagged::tagged;

/// Time and its discretisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End \[s\], > 0; the start is 0. In statics time is only the load parameter.
    pub end: Duration,
    /// Largest step \[s\], between 0 and end. In statics `increments` of the scheme can be given
    /// instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Duration>,
    /// Integration scheme.
    #[serde(default)]
    pub scheme: At<Scheme>,
    /// How often a failed step is halved before the run ends; the step grows again after both
    /// halves succeed.
    #[serde(default = "five")]
    pub cuts: At<u32>,
}

impl Time {
    /// The largest step \[s\]; the whole time where a case is not completed.
    pub fn step(&self) -> f64 {
        self.step.map_or(self.end.value, |step| step.value)
    }
}

fn five() -> At<u32> {
    5.into()
}

/// Time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Scheme")]
pub enum Scheme {
    /// Newmark; alpha = 0.25 and beta = 0.5 of the paper are beta and gamma here.
    Newmark {
        /// Between 0 (excluded) and 0.5.
        #[serde(default = "quarter")]
        beta: Number,
        /// Between 0.5 and 1.
        #[serde(default = "half")]
        gamma: Number,
    },
    /// Hilber, Hughes and Taylor.
    Hht {
        /// Spectral radius at infinite frequency, between 0.5 and 1; 1 is Newmark.
        #[serde(default = "default_radius")]
        spectral_radius: Number,
    },
    /// Chung and Hulbert.
    GeneralizedAlpha {
        /// Spectral radius at infinite frequency, between 0 and 1.
        #[serde(default = "default_radius")]
        spectral_radius: Number,
    },
    /// Midpoint rule: conserves linear and angular momentum, no damping.
    Midpoint,
    /// For impact: the midpoint rule with forces in bodies and contacts whose work equals the
    /// change of energy. Conserves energy, linear and angular momentum, no damping; contact acts on
    /// the reference area. Best with `mass: redistributed`.
    Conserving,
    /// First order, strong damping.
    BackwardEuler,
    /// No inertia.
    Static {
        /// Number of equal load increments, >= 1, instead of `step`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        increments: Option<At<u32>>,
    },
}
tagged!(Scheme, "scheme");

impl Default for Scheme {
    fn default() -> Self {
        Self::GeneralizedAlpha { spectral_radius: default_radius() }
    }
}

fn quarter() -> Number {
    Number::new(0.25)
}

fn half() -> Number {
    Number::new(0.5)
}

fn default_radius() -> Number {
    Number::new(0.8)
}
