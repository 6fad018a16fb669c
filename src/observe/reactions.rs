//! `reactions.csv`: force and moment of each support. One entry of [`REACTION_COLUMNS`] is one column.

use super::quantity::{Column, Quantity, STEP, TIME, TableFile, Value};
use crate::assembly::ContactSystem;
use crate::petsc::{Vector, sum_over_ranks};

/// Reaction of one support, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Name of the support.
    pub name: String,
    /// Force that it exerts on the bodies \[N\], per metre of depth in 2D.
    pub force: [f64; 3],
    /// Moment that it exerts on the bodies about the origin \[N m\], per metre of depth in 2D.
    pub moment: [f64; 3],
}

/// The table of all supports.
pub const REACTION_FILE: TableFile = TableFile {
    name: "reactions.csv",
    rows: "one per step and displacement boundary",
    keys: &[STEP, TIME, Quantity::number("boundary", "", "name of the boundary in the case")],
};

/// The columns of `reactions.csv` after step, time and the name of the support.
pub const REACTION_COLUMNS: &[Column<Reaction>] = &[
    Column {
        quantity: Quantity::vector(
            "force",
            "N",
            "force of the support on the bodies, with the inertia of the nodes that it moves",
        ),
        value: Value::Vector(|reaction| reaction.force),
    },
    Column {
        quantity: Quantity::rotation(
            "moment",
            "N m",
            "moment of this force about the origin, at the current positions; about a point c it is moment - c x force",
        ),
        value: Value::Vector(|reaction| reaction.moment),
    },
];

/// Reactions of all supports at the displacement `u` \[m\] from the imbalance at the nodes \[N\].
/// Collective.
pub fn reactions<const D: usize>(system: &ContactSystem<D>, u: &Vector, imbalance: &Vector) -> Vec<Reaction> {
    let (u, imbalance) = (u.owned(), imbalance.owned());
    let local = system.bodies().local();
    let mut reactions: Vec<Reaction> = Vec::new();
    for boundary in system.bodies().boundaries() {
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for &(node, component) in boundary.entries.iter().filter(|(node, _)| local.index.owns(*node)) {
            let (node, axis) = (node as usize, usize::from(component));
            let own = imbalance[node * D + axis];
            let at = |i: usize| if i < D { local.mesh.points[node][i] + u[node * D + i] } else { 0.0 };
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            force[axis] += own;
            moment[next] += at(last) * own;
            moment[last] -= at(next) * own;
        }
        reactions.push(Reaction { name: boundary.name.clone(), force, moment });
    }
    let parts =
        reactions.iter_mut().flat_map(|reaction| reaction.force.iter_mut().chain(&mut reaction.moment));
    sum_over_ranks(system.session().world(), parts);
    reactions
}
