//! Regions of a body with a material of their own.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::damping::Damping;
use super::viscoelasticity::Viscoelasticity;
use crate::material::Material;
use crate::reader::at::At;
use crate::reader::quantity::Density;

/// The material of a set of elements of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Hyperelastic law and its parameters.
    pub material: Material,
    /// Relaxation of the isochoric stress; none if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscoelasticity: Option<At<Viscoelasticity>>,
    /// Reference density [kg/m3], >= 0; that of the body if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
    /// Damping; that of the body if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<At<Damping>>,
}
