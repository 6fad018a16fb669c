//! `bodies.csv`: mass, position, momentum and energy of each deformable body. One entry of
//! [`BODY_COLUMNS`] is one column.

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::{BodySums, ContactSystem};
use crate::dynamics::Stage;

/// A deformable body at the end of a step, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyReport {
    /// Name of the body.
    pub name: String,
    /// Sums over its elements.
    pub sums: BodySums,
}

impl BodyReport {
    /// Centre of mass \[m\]; `None` without mass.
    fn centre(&self) -> Option<[f64; 3]> {
        let BodySums { mass, first_moment, .. } = self.sums;
        (mass > 0.0).then(|| first_moment.map(|moment| moment / mass))
    }

    /// Angular momentum about the centre of mass [N m s].
    fn spin(&self) -> [f64; 3] {
        let BodySums { linear, angular, .. } = self.sums;
        let Some(centre) = self.centre() else { return angular };
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            angular[i] - (centre[j] * linear[k] - centre[k] * linear[j])
        })
    }
}

/// The table of all deformable bodies.
pub const BODY_FILE: TableFile = TableFile {
    name: "bodies.csv",
    rows: "one per step and deformable body; the file exists only with `output: { bodies: true }`",
    keys: &[STEP, TIME, ReportedQuantity::number("body", "", "name of the body in the case")],
};

/// The columns of `bodies.csv` after step, time and the name of the body.
pub const BODY_COLUMNS: &[Column<BodyReport>] = &[
    Column {
        quantity: ReportedQuantity::number("mass", "kg", "mass"),
        value: Value::Number(|body| body.sums.mass),
    },
    Column {
        quantity: ReportedQuantity::vector(
            "centre",
            "m",
            "centre of mass at the current positions; empty without `density`",
        ),
        value: Value::OptionalVector(BodyReport::centre),
    },
    Column {
        quantity: ReportedQuantity::vector("linear", "N s", "linear momentum; 0 in statics"),
        value: Value::Vector(|body| body.sums.linear),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "angular",
            "N m s",
            "angular momentum about the origin, at the current positions; 0 in statics",
        ),
        value: Value::Vector(|body| body.sums.angular),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "spin",
            "N m s",
            "angular momentum about the centre of mass: angular - centre x linear",
        ),
        value: Value::Vector(BodyReport::spin),
    },
    Column {
        quantity: ReportedQuantity::number("kinetic", "J", "kinetic energy; 0 in statics"),
        value: Value::Number(|body| body.sums.kinetic),
    },
    Column {
        quantity: ReportedQuantity::number(
            "strain",
            "J",
            "strain energy, without the springs of viscous branches",
        ),
        value: Value::Number(|body| body.sums.strain),
    },
];

/// Reports all deformable bodies at the trial state of `stage`. Collective.
pub fn body_reports<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<BodyReport> {
    let sums = system.bodies().body_sums(stage);
    let names = system.bodies().body_names();
    names.zip(sums).map(|(name, sums)| BodyReport { name: name.to_owned(), sums }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::quantity::{Cell, headings};
    use super::*;

    /// Two points of 1 kg at (1, 2) and (3, 2), of which the second moves upwards at 4 m/s.
    #[test]
    fn each_value_is_under_its_heading() {
        let sums = BodySums {
            mass: 2.0,
            first_moment: [4.0, 4.0, 0.0],
            linear: [0.0, 4.0, 0.0],
            angular: [0.0, 0.0, 12.0],
            kinetic: 8.0,
            strain: 0.5,
        };
        let cells = |sums: BodySums| -> Vec<Cell<'static>> {
            let body = BodyReport { name: "b".into(), sums };
            let own = BODY_COLUMNS.iter().flat_map(|column| column.cells::<2>(&body));
            own.map(|cell| if let Cell::Number(value) = cell { Cell::Number(value) } else { Cell::Absent })
                .collect()
        };
        let known = [2.0, 2.0, 2.0, 0.0, 4.0, 12.0, 4.0, 8.0, 0.5].map(Cell::Number);
        assert_eq!(cells(sums), known);
        let massless = cells(BodySums::default());
        assert_eq!(massless[1..3], [Cell::Absent; 2]);
        assert_eq!(massless[5..7], [Cell::Number(0.0); 2]);
        assert_eq!(
            headings::<2>(BODY_COLUMNS.iter().map(|column| &column.quantity)).join(","),
            "mass [kg],centre_x [m],centre_y [m],linear_x [N s],linear_y [N s],angular_z [N m s],spin_z [N m s],\
             kinetic [J],strain [J]"
        );
    }
}
