//! `bodies.NAME.damping`: damping of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::findings::Findings;
use crate::reader::place::Place;
use crate::reader::quantity::{Duration, Rate};
use crate::reader::tagged::tagged;

/// Damping law of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Damping")]
pub enum Damping {
    /// Rayleigh damping, `C = mass * M + stiffness * K`, with the stiffness `K` of the undeformed
    /// body. A vibration of angular frequency `w` has the damping ratio `mass / (2 w) + stiffness *
    /// w / 2`.
    Rayleigh(Rayleigh),
}
tagged!(Damping, "damping law");

/// Factors of Rayleigh damping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rayleigh {
    /// Factor of the mass matrix [1/s], >= 0. It damps slow vibrations, and rigid motions as well.
    #[serde(default)]
    pub mass: Rate,
    /// Factor of the stiffness matrix \[s\], >= 0. It damps fast vibrations. A body that rotates by
    /// a large angle is damped as well.
    #[serde(default)]
    pub stiffness: Duration,
}

impl Damping {
    /// Reports invalid factors.
    pub(super) fn check(&self, place: Place, findings: &mut Findings) {
        let Self::Rayleigh(Rayleigh { mass, stiffness }) = self;
        findings.not_negative("the factor of the mass", mass.value, mass.place);
        findings.not_negative("the factor of the stiffness", stiffness.value, stiffness.place);
        let any = mass.value != 0.0 || stiffness.value != 0.0;
        findings.require(any, place, "both factors of the damping are zero");
        if !any {
            findings.cure("give `mass` or `stiffness` a value above zero, or remove the damping");
        }
    }
}
