//! `rigid.csv`: motion, load and work of each rigid body of `rigid`. One entry of
//! [`RIGID_COLUMNS`] is one column.

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::ToolState;

/// A rigid body at the end of a step, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidReport {
    /// Position, motion and load.
    pub state: ToolState,
    /// Work on the deformable bodies since the start \[J\].
    pub work: f64,
}

/// The table of the bodies of `rigid`.
pub const RIGID_FILE: TableFile = TableFile {
    name: "rigid.csv",
    rows: "one per step and body of `rigid`; the file exists only if there is one",
    keys: &[STEP, TIME, ReportedQuantity::number("body", "", "name of the rigid body in the case")],
};

/// The columns of `rigid.csv` after step, time and the name of the body.
pub const RIGID_COLUMNS: &[Column<RigidReport>] = &[
    Column {
        quantity: ReportedQuantity::vector("position", "m", "position of the reference point"),
        value: Value::Vector(|report| report.state.position),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "rotation",
            "rad",
            "rotation vector since the reference configuration",
        ),
        value: Value::Vector(|report| report.state.rotation),
    },
    Column {
        quantity: ReportedQuantity::vector("velocity", "m/s", "velocity of the reference point"),
        value: Value::Vector(|report| report.state.velocity),
    },
    Column {
        quantity: ReportedQuantity::rotation("spin", "1/s", "angular velocity"),
        value: Value::Vector(|report| report.state.spin),
    },
    Column {
        quantity: ReportedQuantity::vector(
            "force",
            "N",
            "contact force on the rigid body; in the conserving scheme its mean over the step",
        ),
        value: Value::Vector(|report| report.state.force),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "torque",
            "N m",
            "contact torque on the rigid body about its reference point; in the conserving scheme its mean over \
             the step",
        ),
        value: Value::Vector(|report| report.state.torque),
    },
    Column {
        quantity: ReportedQuantity::number(
            "work",
            "J",
            "work of the rigid body on the deformable bodies since the start",
        ),
        value: Value::Number(|report| report.work),
    },
    Column {
        quantity: ReportedQuantity::vector(
            "linear",
            "N s",
            "linear momentum of a free body; empty for other bodies and without mass",
        ),
        value: Value::OptionalVector(|report| report.state.motion.map(|motion| motion.linear)),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "angular",
            "N m s",
            "angular momentum of a free body about its centre of mass; empty for other bodies and without mass",
        ),
        value: Value::OptionalVector(|report| report.state.motion.map(|motion| motion.angular)),
    },
    Column {
        quantity: ReportedQuantity::number(
            "kinetic",
            "J",
            "kinetic energy of a free body; empty for other bodies and without mass",
        ),
        value: Value::Optional(|report| report.state.motion.map(|motion| motion.kinetic)),
    },
];
