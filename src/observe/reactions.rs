//! `reactions.csv`: force of each support. One entry of [`REACTION_COLUMNS`] is one column.

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
}

/// The table of all supports.
pub const REACTION_FILE: TableFile = TableFile {
    name: "reactions.csv",
    rows: "one per step and displacement boundary",
    keys: &[STEP, TIME, Quantity::number("boundary", "", "name of the boundary in the case")],
};

/// The columns of `reactions.csv` after step, time and the name of the support.
pub const REACTION_COLUMNS: &[Column<Reaction>] = &[Column {
    quantity: Quantity::vector(
        "force",
        "N",
        "force of the support on the bodies, with the inertia of the nodes that it moves",
    ),
    value: Value::Vector(|reaction| reaction.force),
}];

/// Reactions of all supports from the imbalance at the nodes \[N\]. Collective.
pub fn reactions<const D: usize>(system: &ContactSystem<D>, imbalance: &Vector) -> Vec<Reaction> {
    let imbalance = imbalance.owned();
    let index = &system.bodies().local().index;
    let mut reactions: Vec<Reaction> = Vec::new();
    for boundary in system.bodies().boundaries() {
        let mut force = [0.0; 3];
        for &(node, component) in boundary.entries.iter().filter(|(node, _)| index.owns(*node)) {
            force[usize::from(component)] += imbalance[node as usize * D + usize::from(component)];
        }
        reactions.push(Reaction { name: boundary.name.clone(), force });
    }
    sum_over_ranks(system.session().world(), reactions.iter_mut().flat_map(|reaction| &mut reaction.force));
    reactions
}
