//! `output`: what is written, and how often.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::{At, Named};
use crate::reader::quantity::{Duration, Length};

/// Output in addition to the histories, which are always written every step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Fields for ParaView.
    pub fields: Fields,
    /// Material points whose history is written, by name.
    pub probes: Named<Probe>,
    /// Checkpoints, from which `--restart` resumes a run. Without this key only a signal writes one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<Checkpoint>,
}

/// Checkpoints, from which a run can be resumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Checkpoint {
    /// Number of steps between two checkpoints, >= 1. One is written at the end as well.
    pub every: At<u32>,
    /// Number of most recent checkpoints that are kept, >= 1.
    pub keep: At<u32>,
    /// Wall time limit of this process \[s\] in every system of units, > 0: the run stops before it
    /// with a checkpoint and exit code 7. `--wall-time` overrides it.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::reader::quantity::wall_time"
    )]
    pub wall_time: Option<Duration>,
}

impl Default for Checkpoint {
    fn default() -> Self {
        Self { every: 100.into(), keep: 2.into(), wall_time: None }
    }
}

/// Fields for ParaView.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fields {
    /// Number of steps between two outputs; start and end are always written. 0: no fields.
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
    /// Reference position \[m\]; the nearest node is used.
    pub at: At<Vec<Length>>,
    /// Body of the node, if two bodies meet there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<At<String>>,
}
