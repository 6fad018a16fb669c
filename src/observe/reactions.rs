//! `reactions.csv`: force and moment of each support, roller, foundation, spring and pair of tied surfaces. One entry of [`REACTION_COLUMNS`] is one column.

use nalgebra::Vector3;

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::ContactSystem;
use crate::mesh::Mesh;
use crate::petsc::{Vector, sum_over_ranks};

/// Resultant of one support, roller, foundation, boundary with springs, pair of tied surfaces, or
/// load, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Name of the boundary or of the tied surfaces.
    pub name: String,
    /// Force that it exerts on the bodies \[N\], per metre of depth in 2D.
    pub force: [f64; 3],
    /// Moment that it exerts on the bodies about the origin \[N m\], per metre of depth in 2D.
    pub moment: [f64; 3],
    /// Point of the line of action of the force that is nearest to the mean position of its nodes
    /// \[m\]; `None` if the force vanishes.
    pub centre: Option<[f64; 3]>,
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
    CENTRE,
];

/// The column of the centre of a force.
pub(super) const CENTRE: Column<Reaction> = Column {
    quantity: ReportedQuantity::vector(
        "centre",
        "m",
        "centre of this force: the point of its line of action that is nearest to the mean position of its nodes; empty if the nodal forces cancel",
    ),
    value: Value::OptionalVector(|reaction| reaction.centre),
};

/// Sums over the nodes on which forces act.
#[derive(Debug, Clone, Default)]
pub(super) struct ForceSums {
    force: [f64; 3],
    moment: [f64; 3],
    /// Sum of the absolute values of the components.
    size: f64,
    /// Number of components and the sum of their positions.
    count: f64,
    places: [f64; 3],
}

impl ForceSums {
    /// Nodal forces are taken to cancel if their resultant is below this part of the sum of their
    /// absolute values. It is above what rounding (1e-16) and the default tolerance of Newton's
    /// method (1e-7) leave of forces that cancel. Half and twice the value differ only for
    /// resultants of this size, whose centre may be a million times the size of the surface away.
    const CANCELS: f64 = 1e-6;

    /// Adds the component `own` along `axis` of a force at `place`.
    pub fn add(&mut self, place: &[f64; 3], axis: usize, own: f64) {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        self.force[axis] += own;
        self.moment[next] += place[last] * own;
        self.moment[last] -= place[next] * own;
        self.size += own.abs();
        self.count += 1.0;
        self.places.iter_mut().zip(place).for_each(|(sum, x)| *sum += x);
    }

    /// The sums of forces on nodes at their places.
    fn of_nodes<const D: usize>(
        forces: impl IntoIterator<Item = (usize, [f64; D])>,
        place: impl Fn(usize) -> [f64; 3],
    ) -> Self {
        let mut sum = Self::default();
        for (node, force) in forces {
            (0..D).for_each(|axis| sum.add(&place(node), axis, force[axis]));
        }
        sum
    }

    /// All sums, for a reduction over the ranks.
    pub fn terms(&mut self) -> impl Iterator<Item = &mut f64> {
        let vectors = self.force.iter_mut().chain(&mut self.moment).chain(&mut self.places);
        vectors.chain([&mut self.size, &mut self.count])
    }

    /// Centre of the force \[m\]: the point of its line of action that is nearest to the mean
    /// position `m` of its nodes, `m + F x (M - m x F) / |F|^2`. `None` if the force vanishes.
    fn centre(&self) -> Option<[f64; 3]> {
        let force = Vector3::from(self.force);
        if force.norm() <= Self::CANCELS * self.size {
            return None;
        }
        let middle = Vector3::from(self.places) / self.count;
        let about_middle = Vector3::from(self.moment) - middle.cross(&force);
        Some((middle + force.cross(&about_middle) / force.norm_squared()).into())
    }

    /// The row of the sums over all ranks.
    pub fn row(&self, name: &str) -> Reaction {
        Reaction { name: name.to_owned(), force: self.force, moment: self.moment, centre: self.centre() }
    }
}

/// Position of a node at the displacement `u` \[m\], with a zero along z in 2D.
pub(super) fn place_of<const D: usize>(mesh: &Mesh<D>, u: &[f64], node: usize) -> [f64; 3] {
    std::array::from_fn(|i| if i < D { mesh.points[node][i] + u[node * D + i] } else { 0.0 })
}

/// Reactions of all supports at the displacement `u` \[m\] from the imbalance at the nodes \[N\], then
/// those of foundations, springs and ties at the last evaluation.
/// Collective.
pub fn reactions<const D: usize>(system: &ContactSystem<D>, u: &Vector, imbalance: &Vector) -> Vec<Reaction> {
    let (u, imbalance) = (u.owned(), imbalance.owned());
    let local = system.bodies().local();
    let place = |node: usize| place_of(&local.mesh, &u, node);
    let mut sums: Vec<(&str, ForceSums)> = Vec::new();
    let rollers = &system.bodies().supports().rollers;
    for boundary in system.bodies().boundaries() {
        let mut sum = ForceSums::default();
        for &(node, component) in boundary.entries.iter().filter(|(node, _)| local.index.owns(*node)) {
            let (node, axis) = (node as usize, usize::from(component));
            let own = rollers.force_along(node, axis, &imbalance).unwrap_or(imbalance[node * D + axis]);
            sum.add(&place(node), axis, own);
        }
        sums.push((&boundary.name, sum));
    }
    for (name, forces) in rollers.forces(&imbalance) {
        sums.push((name, ForceSums::of_nodes(forces, place)));
    }
    for (name, forces) in system.bodies().elastic_supports().forces() {
        sums.push((name, ForceSums::of_nodes(forces, place)));
    }
    for (name, torque) in system.bodies().elastic_supports().torques() {
        sums.push((name, ForceSums { moment: torque, ..ForceSums::default() }));
    }
    for (name, forces) in system.bodies().ties().forces() {
        sums.push((name, ForceSums::of_nodes(forces, place)));
    }
    sum_over_ranks(system.session().world(), sums.iter_mut().flat_map(|(_, sum)| sum.terms()));
    sums.iter().map(|(name, sum)| sum.row(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pressure that grows linearly over two nodes acts nearer to the second one, a couple has no
    /// centre, and a force along the line between the nodes acts at their middle.
    #[test]
    fn forces_act_at_their_centre() {
        let of = |forces: [[f64; 3]; 2]| {
            let mut sum = ForceSums::default();
            for (force, place) in forces.iter().zip([[1.0, 2.0, 0.5], [4.0, 2.0, 0.5]]) {
                (0..3).for_each(|axis| sum.add(&place, axis, force[axis]));
            }
            sum.row("a")
        };
        let near = |found: Option<[f64; 3]>, exact: [f64; 3]| {
            let found = found.expect("a centre");
            assert!(found.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-12), "{found:?}");
        };
        let growing = of([[0.0, -1.0, 0.0], [0.0, -2.0, 0.0]]);
        assert_eq!(growing.force, [0.0, -3.0, 0.0]);
        assert_eq!(growing.moment, [1.5, 0.0, -9.0]);
        near(growing.centre, [3.0, 2.0, 0.5]);
        assert_eq!(of([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]).centre, None);
        near(of([[5.0, 0.0, 0.0], [1.0, 0.0, 0.0]]).centre, [2.5, 2.0, 0.5]);
    }
}
