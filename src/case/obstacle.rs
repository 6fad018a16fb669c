//! `obstacles`: rigid targets, given by a formula and never meshed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::quantity::{Length, Number};
use crate::reader::tagged::tagged;

/// A rigid body at rest that others touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Obstacle")]
pub enum Obstacle {
    /// Half space below a plane.
    Plane {
        /// A point of the plane \[m\].
        point: At<Vec<Length>>,
        /// Normal out of the obstacle, of any length but zero.
        normal: At<Vec<Number>>,
    },
    /// Ball, in 2D a disc.
    Sphere {
        /// Centre \[m\].
        center: At<Vec<Length>>,
        /// Radius \[m\], > 0.
        radius: Length,
        /// The side on which the bodies are.
        #[serde(default)]
        side: Side,
    },
    /// Endless cylinder, in 3D only.
    Cylinder {
        /// A point of the axis \[m\].
        point: At<Vec<Length>>,
        /// Direction of the axis, of any length but zero.
        axis: At<Vec<Number>>,
        /// Radius \[m\], > 0.
        radius: Length,
        /// The side on which the bodies are.
        #[serde(default)]
        side: Side,
    },
}
tagged!(Obstacle, "obstacle");

/// The side of an obstacle's surface on which the bodies are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Side")]
pub enum Side {
    /// The obstacle is solid.
    #[default]
    Outside,
    /// The obstacle is a hole, as a bearing's shell.
    Inside,
}
tagged!(Side, "side");
