//! `reactions.csv`: force and moment of each support, roller, foundation, spring and pair of tied surfaces. One entry of [`REACTION_COLUMNS`] is one column.

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::ContactSystem;
use crate::petsc::{Vector, sum_over_ranks};

/// Reaction of one support, roller, foundation, boundary with springs or pair of tied surfaces, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Name of the boundary or of the tied surfaces.
    pub name: String,
    /// Force that it exerts on the bodies \[N\], per metre of depth in 2D.
    pub force: [f64; 3],
    /// Moment that it exerts on the bodies about the origin \[N m\], per metre of depth in 2D.
    pub moment: [f64; 3],
}

/// The table of all supports.
pub const REACTION_FILE: TableFile = TableFile {
    name: "reactions.csv",
    rows: "one per step and boundary with a displacement, a motion, a roller, a foundation or springs, per free rigid body with springs, and per pair of tied surfaces",
    keys: &[
        STEP,
        TIME,
        ReportedQuantity::number(
            "boundary",
            "",
            "name of the boundary, or of the tied surfaces, in the case",
        ),
    ],
};

/// The columns of `reactions.csv` after step, time and the name of the support.
pub const REACTION_COLUMNS: &[Column<Reaction>] = &[
    Column {
        quantity: ReportedQuantity::vector(
            "force",
            "N",
            "force of the support on the bodies, with the inertia of the nodes that it moves; of a foundation or of springs, the sum over its facets or nodes; of tied surfaces, the force on the contactor",
        ),
        value: Value::Vector(|reaction| reaction.force),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "moment",
            "N m",
            "moment of this force about the origin, at the current positions; about a point c it is moment - c x force. Of a torsion spring, its torque",
        ),
        value: Value::Vector(|reaction| reaction.moment),
    },
];

/// Reactions of all supports at the displacement `u` \[m\] from the imbalance at the nodes \[N\], then
/// those of foundations, springs and ties at the last evaluation.
/// Collective.
pub fn reactions<const D: usize>(system: &ContactSystem<D>, u: &Vector, imbalance: &Vector) -> Vec<Reaction> {
    let (u, imbalance) = (u.owned(), imbalance.owned());
    let local = system.bodies().local();
    let mut reactions: Vec<Reaction> = Vec::new();
    let add = |reaction: &mut Reaction, node: usize, axis: usize, own: f64| {
        let at = |i: usize| if i < D { local.mesh.points[node][i] + u[node * D + i] } else { 0.0 };
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        reaction.force[axis] += own;
        reaction.moment[next] += at(last) * own;
        reaction.moment[last] -= at(next) * own;
    };
    let none = |name: &str| Reaction { name: name.to_owned(), force: [0.0; 3], moment: [0.0; 3] };
    let rollers = &system.bodies().supports().rollers;
    for boundary in system.bodies().boundaries() {
        let mut reaction = none(&boundary.name);
        for &(node, component) in boundary.entries.iter().filter(|(node, _)| local.index.owns(*node)) {
            let (node, axis) = (node as usize, usize::from(component));
            let own = rollers.force_along(node, axis, &imbalance).unwrap_or(imbalance[node * D + axis]);
            add(&mut reaction, node, axis, own);
        }
        reactions.push(reaction);
    }
    for (name, forces) in rollers.forces(&imbalance) {
        let mut reaction = none(name);
        for (node, force) in forces {
            (0..D).for_each(|axis| add(&mut reaction, node, axis, force[axis]));
        }
        reactions.push(reaction);
    }
    for (name, forces) in system.bodies().elastic_supports().forces() {
        let mut reaction = none(name);
        for (node, force) in forces {
            (0..D).for_each(|axis| add(&mut reaction, node, axis, force[axis]));
        }
        reactions.push(reaction);
    }
    for (name, torque) in system.bodies().elastic_supports().torques() {
        reactions.push(Reaction { moment: torque, ..none(name) });
    }
    for (name, forces) in system.bodies().ties().forces() {
        let mut reaction = none(name);
        for (node, force) in forces {
            (0..D).for_each(|axis| add(&mut reaction, node, axis, force[axis]));
        }
        reactions.push(reaction);
    }
    let parts =
        reactions.iter_mut().flat_map(|reaction| reaction.force.iter_mut().chain(&mut reaction.moment));
    sum_over_ranks(system.session().world(), parts);
    reactions
}
