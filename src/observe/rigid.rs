//! `rigid.csv`: motion, load and work of each rigid body of `rigid`. One entry of
//! [`RIGID_COLUMNS`] is one column.

use super::energy::EnergyLedger;
use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::{ContactResultants, ContactSystem, ToolState};
use crate::contact::mortar::resultant::ContactResultant;

/// A rigid body at the end of a step, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidReport {
    /// Position, motion and load.
    pub state: ToolState,
    /// Work on the deformable bodies since the start \[J\].
    pub work: f64,
    /// Centre of the pressure of all its contacts \[m\]; `None` if the pressure balances itself.
    pub centre_of_pressure: Option<[f64; 3]>,
}

/// The rigid bodies at the end of the last step. `resultants` are those of each contact, summed over
/// the ranks.
pub fn reports<const D: usize>(
    system: &ContactSystem<D>,
    ledger: &EnergyLedger,
    resultants: &[ContactResultants<D>],
) -> Vec<RigidReport> {
    let centre = |name: &str| {
        let contacts = system.contacts().iter().zip(resultants);
        let pressures =
            contacts.filter(|(contact, _)| contact.target_name == name).map(|(_, sums)| sums.normal);
        let centre = pressures.sum::<ContactResultant<D>>().centre()?;
        Some(std::array::from_fn(|i| if i < D { centre[i] } else { 0.0 }))
    };
    let report = |(state, work): (&ToolState, f64)| RigidReport {
        centre_of_pressure: centre(&state.name),
        state: state.clone(),
        work,
    };
    ledger.rigid().map(report).collect()
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
        quantity: ReportedQuantity::vector(
            "centre_of_pressure",
            "m",
            "mean position of the forces of the pressure of all contacts with the body, weighted by their component \
             along their resultant; empty if they balance each other",
        ),
        value: Value::OptionalVector(|report| report.centre_of_pressure),
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
