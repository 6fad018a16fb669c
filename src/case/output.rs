//! `output`: what is written, and how often.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::place::{At, Named};
use super::quantity::Length;
use super::tagged::tagged;

/// What is written beside the histories, which are always written every step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Fields for ParaView.
    pub fields: Fields,
    /// Material points whose history is written, by name.
    pub probes: Named<Probe>,
    /// State for --restart; none if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<Checkpoint>,
}

/// Fields for ParaView.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fields {
    /// Every so many steps, >= 1; the start and the end are always written.
    pub every: At<u32>,
    /// Which fields; an empty list writes none.
    pub include: Vec<Field>,
}

impl Default for Fields {
    fn default() -> Self {
        Self { every: 10.into(), include: Field::ALL.to_vec() }
    }
}

/// A field for ParaView.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Field")]
pub enum Field {
    /// Displacement [m] of the nodes.
    Displacement,
    /// Velocity [m/s] of the nodes.
    Velocity,
    /// Cauchy stress [Pa] of the elements.
    CauchyStress,
    /// Ratio of current to reference volume of the elements.
    DetF,
    /// Everything on contact surfaces: contact_pressure, traction_t, gap, slip, slip_velocity, status, friction_work.
    Contact,
}

tagged!(Field, "field");

impl Field {
    /// All fields.
    pub const ALL: [Self; 5] =
        [Self::Displacement, Self::Velocity, Self::CauchyStress, Self::DetF, Self::Contact];
}

/// A material point whose history is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Reference position [m]; the nearest node is taken.
    pub at: At<Vec<Length>>,
    /// Body of the node, where two bodies meet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<At<String>>,
}

/// State from which --restart continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Every so many steps, >= 1.
    pub every: At<u32>,
}
