//! `boundary`: supports and loads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::components::{Components, Force, Torque};
use super::elastic::{Foundation, Spring};
use super::rigid::PrescribedMotion;
use super::roller::Roller;
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
    /// A support along one direction, for example the normal of the surface; the others stay free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roller: Option<At<Roller>>,
    /// Prescribed translation and rotation of all nodes, as of a rigid body, in all directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<At<PrescribedMotion>>,
    /// Acceleration of gravity \[m/s2\] on a body, one entry per direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<At<Vec<VaryingAcceleration>>>,
    /// Dead load on facets [Pa of reference area]; zero in directions that are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<At<Components<1, -1, -2>>>,
    /// Pressure on facets [Pa of current area], positive towards the body; a follower load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<At<VaryingPressure>>,
    /// Dead force per length [N/m of reference length] on the edges of elements in 3D whose nodes are all
    /// in a set of points; zero in directions that are not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_force: Option<At<Components<1, 0, -2>>>,
    /// Total dead force \[N\]: spread uniformly over the reference area of facets, or shared equally by
    /// the nodes of a set of points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<At<Force>>,
    /// Total dead torque on facets \[N m\]: a traction without resultant force that varies linearly over
    /// the reference surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<At<Torque>>,
    /// Springs and dashpots between facets and the ground, per reference area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foundation: Option<At<Foundation>>,
    /// A spring and a dashpot between each node of the set and the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring: Option<At<Spring>>,
}

/// What a boundary does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<'a> {
    /// Prescribed displacement, direction by direction \[m\].
    Displacement([Option<&'a VaryingLength>; 3]),
    /// Prescribed displacement along one direction.
    Roller(&'a At<Roller>),
    /// Prescribed translation and rotation.
    Motion(&'a At<PrescribedMotion>),
    /// Acceleration \[m/s2\], one entry per direction.
    Gravity(&'a [VaryingAcceleration]),
    /// Dead load per reference area, direction by direction \[Pa\].
    Traction([Option<&'a VaryingPressure>; 3]),
    /// Follower pressure \[Pa\], positive towards the body.
    Pressure(&'a VaryingPressure),
    /// Dead load per reference length, direction by direction \[N/m\].
    LineForce([Option<&'a Varying<1, 0, -2>>; 3]),
    /// Total force on a surface or on nodes \[N\].
    Force(&'a Force),
    /// Total torque on a surface \[N m\].
    Torque([Option<&'a Varying<1, 2, -2>>; 3]),
    /// Springs and dashpots on a surface.
    Foundation(&'a Foundation),
    /// Springs and dashpots at nodes.
    Spring(&'a Spring),
}

impl Action<'_> {
    /// Whether it acts on facets only.
    pub fn needs_facets(&self) -> bool {
        match self {
            Action::Traction(_) | Action::Pressure(_) | Action::Torque(_) | Action::Foundation(_) => true,
            Action::Force(force) => force.at.is_some(),
            Action::Roller(roller) => roller.direction.is_none(),
            Action::Displacement(_)
            | Action::Motion(_)
            | Action::Gravity(_)
            | Action::LineForce(_)
            | Action::Spring(_) => false,
        }
    }

    /// Whether it can hold a body at rest.
    pub fn holds(&self) -> bool {
        match self {
            Action::Displacement(_) | Action::Motion(_) | Action::Roller(_) => true,
            Action::Foundation(foundation) => foundation.stiffness.is_some(),
            Action::Spring(spring) => spring.stiffness.is_some(),
            _ => false,
        }
    }
}

impl Boundary {
    /// Everything that the boundary does; exactly one entry in a case that passed its checks.
    pub fn actions(&self) -> impl Iterator<Item = Action<'_>> {
        let displacement = self.displacement.as_ref().map(|value| Action::Displacement(value.as_array()));
        let roller = self.roller.as_ref().map(Action::Roller);
        let motion = self.motion.as_ref().map(Action::Motion);
        let gravity = self.gravity.as_ref().map(|value| Action::Gravity(value));
        let traction = self.traction.as_ref().map(|value| Action::Traction(value.as_array()));
        let pressure = self.pressure.as_ref().map(|value| Action::Pressure(value));
        let line_force = self.line_force.as_ref().map(|value| Action::LineForce(value.as_array()));
        let force = self.force.as_ref().map(|value| Action::Force(value));
        let torque = self.torque.as_ref().map(|value| Action::Torque(value.as_array()));
        let foundation = self.foundation.as_ref().map(|value| Action::Foundation(value));
        let spring = self.spring.as_ref().map(|value| Action::Spring(value));
        [
            displacement,
            motion,
            roller,
            gravity,
            traction,
            pressure,
            line_force,
            force,
            torque,
            foundation,
            spring,
        ]
        .into_iter()
        .flatten()
    }
}
