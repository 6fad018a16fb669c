//! Rollers: supports along one direction, which need not be an axis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::function::VaryingLength;
use crate::reader::quantity::Number;

/// A support along one direction: the nodes slide freely across it. An empty roller `{}` makes a
/// plane surface a plane of symmetry or a guide, inclined or not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Roller {
    /// The held direction, of any non-zero length; fixed in space. The outward normal of the facets at
    /// each node in the reference configuration if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<At<Vec<Number>>>,
    /// Prescribed displacement along the direction \[m\]; zero if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<VaryingLength>,
}
