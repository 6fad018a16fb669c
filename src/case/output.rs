//! `output`: what is written, and how often.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::place::{At, Named};
use super::quantity::Length;

/// What is written beside the histories, which are always written every step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Fields for ParaView.
    pub fields: Fields,
    /// Material points whose history is written, by name.
    pub probes: Named<Probe>,
}

/// Fields for ParaView.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fields {
    /// Every so many steps, >= 1; the start and the end are always written.
    pub every: At<u32>,
}

impl Default for Fields {
    fn default() -> Self {
        Self { every: 10.into() }
    }
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
