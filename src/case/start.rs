//! `start`: the state at t = 0.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::tagged::tagged;

/// State at t = 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Start")]
pub enum Start {
    /// Undeformed.
    #[default]
    Rest,
    /// Static equilibrium under the supports and loads at t = 0.
    Equilibrium {
        /// Whether friction acts in the equilibrium.
        #[serde(default)]
        friction: bool,
        /// Number of increments in which supports and loads are applied, >= 1.
        #[serde(default = "four")]
        increments: u32,
    },
}
tagged!(Start, "start");

fn four() -> u32 {
    4
}
