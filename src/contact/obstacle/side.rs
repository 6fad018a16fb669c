//! Side of a closed surface on which the bodies are.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::tagged::tagged;

/// The side of an obstacle's surface on which the bodies are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Side")]
pub enum Side {
    /// The obstacle is solid.
    #[default]
    Outside,
    /// The obstacle is a hole, such as the shell of a bearing.
    Inside,
}
tagged!(Side, "side");

impl Side {
    /// 1 outside, -1 inside.
    pub fn sign(self) -> f64 {
        match self {
            Self::Outside => 1.0,
            Self::Inside => -1.0,
        }
    }
}
