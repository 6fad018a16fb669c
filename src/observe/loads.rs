//! `loads.csv`: force and moment of each load of `boundary`. One entry of [`LOAD_COLUMNS`] is one
//! column.

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use super::reactions::{CENTRE, ForceSums, Reaction, place_of};
use crate::assembly::ContactSystem;
use crate::dynamics::Stage;
use crate::petsc::sum_over_ranks;

/// The table of all loads.
pub const LOAD_FILE: TableFile = TableFile {
    name: "loads.csv",
    rows: "one per step and boundary with a traction, a pressure, a line force, a force, a torque or gravity; the file exists only with `output: { loads: true }`",
    keys: &[STEP, TIME, ReportedQuantity::number("boundary", "", "name of the boundary in the case")],
};

/// The columns of `loads.csv` after step, time and the name of the boundary.
pub const LOAD_COLUMNS: &[Column<Reaction>] = &[
    Column {
        quantity: ReportedQuantity::vector(
            "force",
            "N",
            "sum of its nodal forces on the bodies at the end of the step",
        ),
        value: Value::Vector(|load| load.force),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "moment",
            "N m",
            "moment of this force about the origin, at the current positions; about a point c it is moment - c x force",
        ),
        value: Value::Vector(|load| load.moment),
    },
    CENTRE,
];

/// Names of the boundaries with loads, in the order of [`load_reports`].
pub fn load_names<'a>(loads: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names = Vec::new();
    for name in loads {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Reports the loads of all boundaries at the trial state of `stage`. Collective.
pub fn load_reports<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<Reaction> {
    let names = load_names(system.load_names());
    let row = |name: &str| names.iter().position(|known| *known == name);
    let rows: Vec<Option<usize>> = system.load_names().map(row).collect();
    let mut sums = vec![ForceSums::default(); names.len()];
    let mesh = &system.bodies().local().mesh;
    let u = stage.trial.u.owned();
    system.each_load(stage, |load, forces| {
        let Some(sum) = rows[load].and_then(|row| sums.get_mut(row)) else { return };
        for (node, force) in forces.chunks_exact(D).enumerate() {
            if force.iter().any(|own| *own != 0.0) {
                let place = place_of(mesh, &u, node);
                (0..D).for_each(|axis| sum.add(&place, axis, force[axis]));
            }
        }
    });
    sum_over_ranks(system.session().world(), sums.iter_mut().flat_map(ForceSums::terms));
    names.iter().zip(&sums).map(|(name, sum)| sum.row(name)).collect()
}
