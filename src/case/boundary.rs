//! `boundary`: supports and loads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sets::SetNames;
use crate::reader::at::At;
use crate::reader::function::{Varying, VaryingAcceleration, VaryingLength, VaryingPressure};

/// A support or a load: `on` and one of the other keys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundary {
    /// A body, or its facets, points or elements as body.set; or a list of these, which act as one.
    pub on: SetNames,
    /// Prescribed displacement \[m\] in the given directions; the others stay free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<At<Components<0, 1, 0>>>,
    /// Acceleration of gravity \[m/s2\] on a body, one entry per direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<At<Vec<VaryingAcceleration>>>,
    /// Dead load on facets [Pa of reference area]; zero in directions that are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<At<Components<1, -1, -2>>>,
    /// Pressure on facets [Pa of current area], positive towards the body; a follower load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<At<VaryingPressure>>,
}

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

/// What a boundary does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<'a> {
    /// Prescribed displacement, direction by direction \[m\].
    Displacement([Option<&'a VaryingLength>; 3]),
    /// Acceleration \[m/s2\], one entry per direction.
    Gravity(&'a [VaryingAcceleration]),
    /// Dead load per reference area, direction by direction \[Pa\].
    Traction([Option<&'a VaryingPressure>; 3]),
    /// Follower pressure \[Pa\], positive towards the body.
    Pressure(&'a VaryingPressure),
}

impl Boundary {
    /// Everything that the boundary does; exactly one entry in a case that passed its checks.
    pub fn actions(&self) -> impl Iterator<Item = Action<'_>> {
        let displacement = self.displacement.as_ref().map(|value| Action::Displacement(value.as_array()));
        let gravity = self.gravity.as_ref().map(|value| Action::Gravity(value));
        let traction = self.traction.as_ref().map(|value| Action::Traction(value.as_array()));
        let pressure = self.pressure.as_ref().map(|value| Action::Pressure(value));
        [displacement, gravity, traction, pressure].into_iter().flatten()
    }
}
