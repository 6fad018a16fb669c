//! `rigid`: rigid bodies whose motion is prescribed or follows from forces.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::components::Components;
use super::elastic::Spring;
use crate::contact::obstacle::Obstacle;
use crate::reader::at::At;
use crate::reader::function::{Function, Varying, VaryingAcceleration, VaryingNumber};
use crate::reader::quantity::{Density, Length, Number, Quantity, Rate, Velocity};
use crate::reader::turn::Turn;
use crate::tensor::{Tensor, Vector};

/// A rigid body that others touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// Shape and position in the reference configuration.
    pub shape: Obstacle,
    /// Prescribed motion; at rest if absent. If `free` is given, only the given directions are
    /// prescribed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<At<PrescribedMotion>>,
    /// Mass and loads of a body that moves freely in all directions that `motion` and `fixed` leave
    /// open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free: Option<At<FreeMotion>>,
}

/// Mass, loads and initial velocity of a rigid body that moves freely.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeMotion {
    /// Mass [kg, per metre of depth in 2D], > 0. Statics needs no mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Quantity<1, 0, 0>>,
    /// Inertia about the centre of mass in the reference configuration [kg m2, per metre of depth in
    /// 2D]: one moment > 0 in 2D. In 3D the moments about the axes x, y, z if these are principal axes, or
    /// the six entries xx, yy, zz, xy, yz, xz of the tensor of inertia. Its entry xy is minus the
    /// integral of `x y` over the mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<At<Vec<Quantity<1, 2, 0>>>>,
    /// Density \[kg/m3\], in place of `mass`, `inertia` and `center`, of a shape that is a solid: a
    /// sphere, box, capsule, torus, turned solid, closed polyline, or surface without `radius`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
    /// Centre of mass in the reference configuration \[m\]. If absent, that of the solid if there is a
    /// `density`, and the centre of the shape otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<At<Vec<Length>>>,
    /// Directions in which the body does not move: `ux`, `uy`, `uz`, and the rotations `rx`, `ry`,
    /// `rz` (2D: `ux`, `uy`, `rz`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<At<Degree>>,
    /// Force at the centre of mass [N, per metre of depth in 2D].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<At<Components<1, 1, -2>>>,
    /// Torque [N m, per metre of depth in 2D]; z only in 2D. Its direction is fixed in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<At<Components<1, 2, -2>>>,
    /// Springs and dashpots between the centre of mass and the ground along the axes x, y, z, which do
    /// not turn with the body. They exert the force `-k u - c v` [per metre of depth in 2D].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring: Option<At<Spring>>,
    /// Spring and dashpot between the rotation of the body and the ground. They exert the torque
    /// `-k angle - c spin` about the only axis about which the body is free to rotate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion_spring: Option<At<TorsionSpring>>,
    /// Acceleration of gravity \[m/s2\], one entry per direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<At<Vec<VaryingAcceleration>>>,
    /// Initial velocity of the centre of mass \[m/s\], one entry per direction, zero where it is held; zero if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_velocity: Option<At<Vec<Velocity>>>,
    /// Initial angular velocity \[1/s\]: one entry in 2D, three in 3D, zero where it is held; zero if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_spin: Option<At<Vec<Rate>>>,
}

/// A spring and a dashpot that resist the rotation of a free rigid body about its only free axis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorsionSpring {
    /// Torque per angle [N m, per metre of depth in 2D], >= 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Quantity<1, 2, -2>>,
    /// Torque per angular velocity [N m s, per metre of depth in 2D], >= 0. The static scheme has no
    /// velocities and refuses it; a static start ignores it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Quantity<1, 2, -1>>,
}

/// The tensor of inertia from one moment about z, three moments about x, y and z, or the six entries
/// xx, yy, zz, xy, yz, xz. Zero for other numbers of entries.
pub fn inertia_tensor(list: &[Quantity<1, 2, 0>]) -> Tensor<3> {
    let entry = |k: usize| list.get(k).map_or(0.0, |entry| entry.value);
    let moments = match list.len() {
        1 => [0.0, 0.0, entry(0)],
        3 | 6 => [entry(0), entry(1), entry(2)],
        _ => [0.0; 3],
    };
    let [xy, yz, xz] = if list.len() == 6 { [entry(3), entry(4), entry(5)] } else { [0.0; 3] };
    let [xx, yy, zz] = moments;
    Tensor::<3>::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// A degree of freedom of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Degree {
    /// Displacement along x.
    Ux,
    /// Displacement along y.
    Uy,
    /// Displacement along z.
    Uz,
    /// Rotation about the axis of the body that is initially x.
    Rx,
    /// Rotation about the axis of the body that is initially y.
    Ry,
    /// Rotation about the axis of the body that is initially z.
    Rz,
}

impl Degree {
    /// Direction of a displacement; `None` for a rotation.
    pub fn direction(self) -> Option<usize> {
        [Self::Ux, Self::Uy, Self::Uz].iter().position(|&degree| degree == self)
    }

    /// Axis of a rotation; `None` for a displacement.
    pub fn axis(self) -> Option<usize> {
        [Self::Rx, Self::Ry, Self::Rz].iter().position(|&degree| degree == self)
    }
}

impl FreeMotion {
    /// Axes about which the body is free to rotate, in this number of dimensions; 0 is x.
    pub fn free_axes(&self, dimension: usize) -> impl Iterator<Item = usize> {
        let axes = if dimension == 2 { 2..3 } else { 0..3 };
        axes.filter(|&axis| !self.fixes(|degree| degree.axis() == Some(axis)))
    }

    /// Whether a degree of freedom is fixed.
    pub fn fixes(&self, wanted: impl Fn(Degree) -> bool) -> bool {
        self.fixed.iter().any(|degree| wanted(degree.value))
    }
}

impl Rigid {
    /// Whether the body rotates.
    pub fn rotates(&self) -> bool {
        self.free.is_some() || self.motion.as_ref().is_some_and(|motion| motion.rotation.is_some())
    }
}

/// Prescribed motion of a rigid body, or of a boundary of a deformable one, as functions of time.
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

/// Rotation about an axis of fixed direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Reference point in the reference configuration \[m\], which moves with the translation. A
    /// boundary needs it. For a rigid body it is the centre of the shape if absent: the centre of a
    /// sphere, or the given point of a plane or of the axis of a cylinder.
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

    /// Displacement in a direction \[m\] as a function of the reference point and of time.
    pub fn along(&self, direction: usize) -> Function {
        let still = || Function::constant(0.0);
        let translation = self.components()[direction].map_or_else(still, |given| given.function.clone());
        let Some(rotation) = &self.rotation else { return translation };
        let about = rotation.about.as_ref();
        Function::turn(Turn {
            component: direction,
            about: std::array::from_fn(|i| about.and_then(|about| about.get(i)).map_or(0.0, |x| x.value)),
            axis: rotation.unit_axis(),
            angle: rotation.angle.function.clone(),
            translation,
        })
    }
}

impl Rotation {
    /// Unit vector along the axis; z if `axis` is absent.
    pub fn unit_axis(&self) -> [f64; 3] {
        let Some(axis) = &self.axis else { return [0.0, 0.0, 1.0] };
        Vector::<3>::from_fn(|i, _| axis.get(i).map_or(0.0, |entry| entry.value)).normalize().into()
    }
}
