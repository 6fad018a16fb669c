//! `tied`: surfaces that stay together.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::components::Components;
use super::sets::SetNames;
use crate::reader::at::At;
use crate::reader::quantity::{Length, Stiffness};

/// Two surfaces that are bonded to each other in the reference configuration, or opposite sides of a
/// periodic cell. Their meshes need not match. Vertices of the contactor that have no target within reach stay free.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tied {
    /// Facets whose vertices carry the ties, as body.set; the finer or softer side. A list of sets is
    /// one surface.
    pub contactor: SetNames,
    /// Facets of the other side, as body.set. A list of sets is one surface.
    pub target: SetNames,
    /// Stiffness of the bond per reference area [Pa/m], > 0, in all directions. If absent, 100 times
    /// the Young's modulus of the softer side over the size of a facet of the contactor, and 10000
    /// times with `offset`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Stiffness>,
    /// Distance up to which points of the two surfaces are tied \[m\], > 0. If absent, a tenth of the
    /// size of a facet of the contactor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Length>,
    /// For periodic sides: vector from the contactor to the target in the reference configuration \[m\].
    /// Without it the surfaces touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<At<Vec<Length>>>,
    /// Prescribed displacement of the target minus that of the contactor \[m\]: functions of t that are
    /// zero at t = 0; zero in directions that are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jump: Option<At<Components<0, 1, 0>>>,
}

impl Tied {
    /// Whether one of the surfaces is on that body.
    pub fn is_on(&self, body: &str) -> bool {
        [&self.contactor, &self.target].into_iter().any(|side| side.bodies().any(|name| name == body))
    }
}
