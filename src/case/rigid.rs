//! `rigid`: rigid bodies with prescribed motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::components::Components;
use crate::contact::obstacle::Obstacle;
use crate::reader::at::At;
use crate::reader::function::{Varying, VaryingNumber};
use crate::reader::quantity::{Length, Number};

/// A rigid body that others touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// Shape and position in the reference configuration.
    pub shape: Obstacle,
    /// Prescribed motion; at rest if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<At<PrescribedMotion>>,
}

impl Rigid {
    /// Whether the body rotates.
    pub fn rotates(&self) -> bool {
        self.motion.as_ref().is_some_and(|motion| motion.rotation.is_some())
    }
}

/// Prescribed motion of a rigid body as functions of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrescribedMotion {
    /// Displacement of the reference point \[m\]; zero in directions that are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<At<Components<0, 1, 0>>>,
    /// Rotation about the reference point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<At<Rotation>>,
}

/// Rotation of a rigid body about an axis of fixed direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Reference point in the reference configuration \[m\], which moves with the translation. The
    /// centre of the shape if absent: the centre of a sphere, or the given point of a plane or of
    /// the axis of a cylinder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<At<Vec<Length>>>,
    /// Direction of the axis in 3D, of any non-zero length. In 2D the axis is z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<At<Vec<Number>>>,
    /// Angle \[rad\].
    pub angle: VaryingNumber,
}

impl PrescribedMotion {
    /// The functions of the displacement, in the order of the directions.
    pub fn components(&self) -> [Option<&Varying<0, 1, 0>>; 3] {
        self.translation.as_ref().map_or([None; 3], |translation| translation.as_array())
    }
}
