//! Supports that yield: elastic foundations of surfaces, springs and dashpots at nodes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::components::Components;
use crate::reader::at::At;
use crate::reader::function::Varying;

/// Springs and dashpots between a surface and the ground. They exert the traction `-k u - c v` per
/// reference area, with the displacement `u` and the velocity `v` of the surface. The normal is that of
/// the reference configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foundation {
    /// Stiffness of the springs per reference area [Pa/m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<At<Directional<1, -2, -2>>>,
    /// Viscosity of the dashpots per reference area [Pa s/m]. The static scheme has no velocities and
    /// refuses it; a static start ignores it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<At<Directional<1, -2, -1>>>,
}

/// Coefficients by direction: `normal` and `tangential` to the reference surface, or along the axes.
/// Directions that are not given have none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Directional<const KG: i8, const M: i8, const S: i8> {
    /// Along the reference normal, >= 0, without t.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<Varying<KG, M, S>>,
    /// In every direction of the tangential plane, >= 0, without t.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangential: Option<Varying<KG, M, S>>,
    /// Along x, >= 0, without t.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<Varying<KG, M, S>>,
    /// Along y, >= 0, without t.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Varying<KG, M, S>>,
    /// Along z, >= 0, without t, in 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<Varying<KG, M, S>>,
}

impl<const KG: i8, const M: i8, const S: i8> Directional<KG, M, S> {
    /// Those relative to the surface: normal and tangential.
    pub fn of_surface(&self) -> [Option<&Varying<KG, M, S>>; 2] {
        [self.normal.as_ref(), self.tangential.as_ref()]
    }

    /// Those along the axes.
    pub fn of_axes(&self) -> [Option<&Varying<KG, M, S>>; 3] {
        [self.x.as_ref(), self.y.as_ref(), self.z.as_ref()]
    }
}

/// A spring and a dashpot between the ground and each node of a set, or the centre of mass of a free
/// rigid body. They exert the force `-k u - c v`, with the displacement `u` and the velocity `v` of that
/// point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Stiffness of each \[N/m\], >= 0, without t.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<At<Components<1, 0, -2>>>,
    /// Viscosity of each [N s/m], >= 0, without t. The static scheme has no velocities and refuses
    /// it; a static start ignores it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<At<Components<1, 0, -1>>>,
}
