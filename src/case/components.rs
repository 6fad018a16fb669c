//! Values by direction: of displacements and tractions, and totals of forces and torques.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::function::Varying;
use crate::reader::quantity::Length;

/// Values in the given directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Components<const KG: i8, const M: i8, const S: i8> {
    /// Along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<Varying<KG, M, S>>,
    /// Along y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Varying<KG, M, S>>,
    /// Along z, in 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<Varying<KG, M, S>>,
}

impl<const KG: i8, const M: i8, const S: i8> Components<KG, M, S> {
    /// In the order of the directions.
    pub fn as_array(&self) -> [Option<&Varying<KG, M, S>>; 3] {
        [self.x.as_ref(), self.y.as_ref(), self.z.as_ref()]
    }
}

/// Components of a force \[N\], and the point that its line of action passes through.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Force {
    /// Along x \[N\], a function of t alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<Varying<1, 1, -2>>,
    /// Along y \[N\], a function of t alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Varying<1, 1, -2>>,
    /// Along z \[N\], a function of t alone, in 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<Varying<1, 1, -2>>,
    /// Point of the line of action in the reference configuration \[m\], for facets only; the centroid of
    /// the facets if absent. Elsewhere the traction varies linearly, so that its moment is that of
    /// the force at this point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<At<Vec<Length>>>,
}

impl Force {
    /// In the order of the directions.
    pub fn as_array(&self) -> [Option<&Varying<1, 1, -2>>; 3] {
        [self.x.as_ref(), self.y.as_ref(), self.z.as_ref()]
    }
}

/// Components of a torque \[N m\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Torque {
    /// About x \[N m\], a function of t alone, in 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<Varying<1, 2, -2>>,
    /// About y \[N m\], a function of t alone, in 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Varying<1, 2, -2>>,
    /// About z \[N m\], a function of t alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<Varying<1, 2, -2>>,
}

impl Torque {
    /// In the order of the axes.
    pub fn as_array(&self) -> [Option<&Varying<1, 2, -2>>; 3] {
        [self.x.as_ref(), self.y.as_ref(), self.z.as_ref()]
    }
}
