//! Rollers: supports along directions that need not be axes (3.31).

use mpi::traits::CommunicatorCollectives;
use nalgebra::DMatrix;

use crate::case::PlacedFunction;
use crate::error::{Error, Result, agree};
use crate::mesh::{Facet, spelled};
use crate::model::RollerModel;
use crate::partition::LocalMesh;
use crate::partition::exchange::NodeExchange;
use crate::space::{Held, PrescribedFields, facet_normal, facet_tangents, reference};
use crate::tensor::{Vector, in_space};

/// Length of the part of a unit direction outside of those that are held already, below which it
/// adds nothing but rounding.
const SAME: f64 = 1e-6;
/// Smallest cosine of the angle between the normal of a facet and the mean normal at its node. Faces
/// that meet at more than 60 degrees form an edge: at a right angle the cosine is 0.71, on a circle of
/// eight facets 0.92.
const EDGE_COSINE: f64 = 0.866;

/// What holds a node along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
enum HeldBy {
    /// A displacement boundary, along this axis.
    Axis(usize),
    /// The roller with this index.
    Roller(usize),
}

/// A held direction of a node.
#[derive(Debug, Clone, PartialEq)]
struct HeldDirection<const D: usize> {
    by: HeldBy,
    /// Unit vector.
    direction: Vector<D>,
    /// Vector in the span of all held directions of the node whose product with this direction is one
    /// and with the others zero.
    dual: Vector<D>,
}

/// An owned node on rollers.
#[derive(Debug, Clone, PartialEq)]
struct RollerNode<const D: usize> {
    node: u32,
    /// Its independent directions.
    held: Vec<HeldDirection<D>>,
    /// Rollers whose direction the others hold already.
    implied: Vec<(usize, Vector<D>)>,
}

/// The rollers, with the nodes that this rank owns.
#[derive(Debug, Default)]
pub struct Rollers<const D: usize> {
    names: Vec<String>,
    motions: Vec<PlacedFunction>,
    nodes: Vec<RollerNode<D>>,
}

impl<const D: usize> Rollers<D> {
    /// Resolves the rollers on the rank's mesh, and gives their directions to `held`. Collective.
    ///
    /// # Errors
    /// If a set does not exist or has no normal. All ranks return the same error.
    pub(super) fn new(
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        rollers: &[RollerModel<D>],
        held: &mut Held<D>,
    ) -> Result<Self> {
        if rollers.is_empty() {
            return Ok(Self { names: Vec::new(), motions: Vec::new(), nodes: Vec::new() });
        }
        let nodes = agree(world, own_nodes(local, rollers, held))?;
        let own = nodes.iter().map(|node| (node.node, node.projection())).collect();
        *held = held.clone().with_inclined(own);
        share(world, local, held)?;
        Ok(Self {
            names: rollers.iter().map(|roller| roller.name.clone()).collect(),
            motions: rollers.iter().map(|roller| roller.displacement.clone()).collect(),
            nodes,
        })
    }

    /// Writes the prescribed `u`, `v`, `a` along the held directions at `time`, times `factor`, into
    /// the local arrays. The displacement boundaries have written theirs.
    ///
    /// # Errors
    /// If a prescribed value is not finite, or supports prescribe different motions of a node.
    pub fn fill(&self, points: &[[f64; D]], time: f64, factor: f64, fields: PrescribedFields) -> Result<()> {
        for node in &self.nodes {
            let point = &points[node.node as usize];
            let motion = |roller: usize| {
                let function = &self.motions[roller];
                let at = function.motion(in_space(point), time);
                function.require_sound(&at, point, time)?;
                Ok([factor * at.value, factor * at.rate, factor * at.second])
            };
            let first = node.node as usize * D;
            for held in &node.held {
                let HeldBy::Roller(roller) = held.by else { continue };
                let targets = motion(roller)?;
                let fields = [&mut *fields.u, &mut *fields.v, &mut *fields.a];
                for (values, target) in fields.into_iter().zip(targets) {
                    let Some(values) = values.get_mut(first..first + D) else { continue };
                    let missing =
                        target - held.direction.iter().zip(&*values).map(|(d, u)| d * u).sum::<f64>();
                    values
                        .iter_mut()
                        .zip(held.dual.iter())
                        .for_each(|(value, dual)| *value += missing * dual);
                }
            }
            for (roller, direction) in &node.implied {
                let [wanted, ..] = motion(*roller)?;
                let u = Vector::<D>::from_fn(|i, _| fields.u[first + i]);
                if (direction.dot(&u) - wanted).abs() > SAME * u.norm().max(wanted.abs()) {
                    let message = format!(
                        "the roller '{}' and other supports prescribe different displacements of the node at {}",
                        self.names[*roller],
                        spelled(point)
                    );
                    let cure =
                        "leave this node out of the set of one of them, or prescribe the same displacement";
                    return Err(self.motions[*roller].error(message, cure));
                }
            }
        }
        Ok(())
    }

    /// Largest prescribed displacement \[m\] and velocity \[m/s\] on this rank at `instants` \[s\].
    pub fn largest(&self, points: &[[f64; D]], instants: &[f64]) -> [f64; 2] {
        let mut most = [0.0_f64; 2];
        for node in &self.nodes {
            for held in &node.held {
                let HeldBy::Roller(roller) = held.by else { continue };
                for &time in instants {
                    let at = self.motions[roller].motion(in_space(&points[node.node as usize]), time);
                    most = [most[0].max(at.value.abs()), most[1].max(at.rate.abs())];
                }
            }
        }
        most
    }

    /// Names of the rollers, each with its owned nodes and the forces on them. `imbalance` is that of the
    /// owned rows \[N\].
    pub fn forces<'a>(
        &'a self,
        imbalance: &'a [f64],
    ) -> impl Iterator<Item = (&'a str, impl Iterator<Item = (usize, [f64; D])> + 'a)> + 'a {
        self.names.iter().enumerate().map(move |(roller, name)| {
            let of_roller = move |node: &'a RollerNode<D>| {
                let held = node.held.iter().find(|held| held.by == HeldBy::Roller(roller))?;
                Some((node.node as usize, held.force(node.node as usize, imbalance)))
            };
            (name.as_str(), self.nodes.iter().filter_map(of_roller))
        })
    }

    /// Force of a displacement boundary along an axis on a node that is also on a roller \[N\].
    pub fn force_along(&self, node: usize, axis: usize, imbalance: &[f64]) -> Option<f64> {
        let place = self.nodes.binary_search_by_key(&(node as u32), |node| node.node).ok()?;
        let held = self.nodes[place].held.iter().find(|held| held.by == HeldBy::Axis(axis))?;
        Some(held.force(node, imbalance)[axis])
    }
}

impl<const D: usize> HeldDirection<D> {
    /// The part of the force on a node that acts along this direction \[N\].
    fn force(&self, node: usize, imbalance: &[f64]) -> [f64; D] {
        let size: f64 = self.dual.iter().zip(&imbalance[node * D..]).map(|(dual, force)| dual * force).sum();
        (self.direction * size).into()
    }
}

impl<const D: usize> RollerNode<D> {
    /// The projection onto the free directions.
    fn projection(&self) -> [[f64; D]; D] {
        let held = |i: usize, j: usize| -> f64 {
            self.held
                .iter()
                .map(|held| held.dual[i] * held.direction[j] + held.direction[i] * held.dual[j])
                .sum()
        };
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        std::array::from_fn(|i| std::array::from_fn(|j| unit(i, j) - 0.5 * held(i, j)))
    }
}

/// The owned nodes on rollers, in ascending order.
fn own_nodes<const D: usize>(
    local: &LocalMesh<D>,
    rollers: &[RollerModel<D>],
    held: &Held<D>,
) -> Result<Vec<RollerNode<D>>> {
    let mut found: Vec<(u32, usize, Vector<D>)> = Vec::new();
    for (number, roller) in rollers.iter().enumerate() {
        match &roller.direction {
            Some(direction) => {
                let Some(nodes) = local.mesh.set_nodes(&roller.set) else {
                    let message = format!("boundary '{}': there is no set '{}'", roller.name, roller.set);
                    return Err(Error::case(message));
                };
                let own = nodes.into_iter().filter(|&node| local.index.owns(node));
                found.extend(own.map(|node| (node, number, (*direction).into())));
            }
            None => {
                let normals = normals(local, roller)?;
                found.extend(normals.into_iter().map(|(node, normal)| (node, number, normal)));
            }
        }
    }
    found.sort_by_key(|&(node, number, _)| (node, number));
    let nodes = found.chunk_by(|a, b| a.0 == b.0).map(|at_node| {
        let node = at_node[0].0;
        let axes = (0..D).filter(|i| held.axes()[node as usize * D + i]);
        let along_axis =
            |axis: usize| (HeldBy::Axis(axis), Vector::from_fn(|i, _| f64::from(u8::from(i == axis))));
        let of_rollers = at_node.iter().map(|&(_, roller, direction)| (HeldBy::Roller(roller), direction));
        resolve(node, axes.map(along_axis).chain(of_rollers))
    });
    nodes.collect()
}

/// Separates the directions of a node into independent and implied ones.
fn resolve<const D: usize>(
    node: u32,
    directions: impl Iterator<Item = (HeldBy, Vector<D>)>,
) -> Result<RollerNode<D>> {
    let mut basis: Vec<Vector<D>> = Vec::new();
    let mut held: Vec<(HeldBy, Vector<D>)> = Vec::new();
    let mut implied = Vec::new();
    for (by, direction) in directions {
        // Twice, against rounding.
        let outside = |of: Vector<D>| basis.iter().fold(of, |rest, unit| rest - unit * unit.dot(&rest));
        let rest = outside(outside(direction));
        match by {
            HeldBy::Roller(roller) if rest.norm() < SAME => implied.push((roller, direction)),
            _ => {
                basis.push(rest.normalize());
                held.push((by, direction));
            }
        }
    }
    let products = DMatrix::from_fn(held.len(), held.len(), |k, l| held[k].1.dot(&held[l].1));
    let Some(inverse) = products.try_inverse() else {
        return Err(Error::internal("the directions of a roller are not independent"));
    };
    let dual = |k: usize| -> Vector<D> { (0..held.len()).map(|l| held[l].1 * inverse[(k, l)]).sum() };
    let direction = |(k, &(by, direction))| HeldDirection { by, direction, dual: dual(k) };
    Ok(RollerNode { node, held: held.iter().enumerate().map(direction).collect(), implied })
}

/// Unit normals of a surface at its owned nodes: means over the facets, weighted by their area at the
/// node. All facets at an owned node are local.
fn normals<const D: usize>(local: &LocalMesh<D>, roller: &RollerModel<D>) -> Result<Vec<(u32, Vector<D>)>> {
    let Some(facets) = local.mesh.facet_sets.get(&roller.set) else {
        let message =
            format!("the roller '{}' has no normal, because '{}' is no surface", roller.name, roller.set);
        return Err(roller
            .displacement
            .error(message, "give the roller a direction, or name a set of facets"));
    };
    let mut found = Vec::new();
    for &facet in facets {
        found.extend(facet_normals(local, facet));
    }
    found.sort_by_key(|&(node, _)| node);
    let mean = |at_node: &[(u32, Vector<D>)]| {
        let node = at_node[0].0;
        let mean = at_node.iter().map(|(_, normal)| normal).sum::<Vector<D>>().normalize();
        if at_node.iter().all(|(_, normal)| normal.dot(&mean) >= EDGE_COSINE * normal.norm()) {
            return Ok((node, mean));
        }
        let at = spelled(&local.mesh.points[node as usize]);
        let message = format!("the facets of the roller '{}' meet at an edge at {at}", roller.name);
        Err(roller.displacement.error(message, "write a roller for each face, or give it a direction"))
    };
    found.chunk_by(|a, b| a.0 == b.0).map(mean).collect()
}

/// Normals of a facet at its owned nodes, each as long as the area of the facet there.
fn facet_normals<const D: usize>(local: &LocalMesh<D>, facet: Facet) -> Vec<(u32, Vector<D>)> {
    let kind = local.mesh.facet_kind(facet);
    let element = reference(kind);
    let mut nodes = Vec::new();
    local.mesh.facet_nodes(facet, &mut nodes);
    let points: Vec<Vector<D>> = nodes.iter().map(|&node| local.mesh.points[node as usize].into()).collect();
    let area: f64 = element.full_rule().weights.iter().sum();
    let mut gradient = vec![0.0; nodes.len() * (D - 1)];
    let at_node = |(&node, xi): (&u32, &[f64; 3])| {
        local.index.owns(node).then(|| {
            element.gradient(xi, &mut gradient);
            (node, facet_normal(&facet_tangents(&points, &gradient)) * area)
        })
    };
    nodes.iter().zip(element.node_coordinates()).filter_map(at_node).collect()
}

/// Gives the ghosts the projections of their owners. Collective.
fn share<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    held: &mut Held<D>,
) -> Result<()> {
    let mut exchange = NodeExchange::new(world, &local.index, &local.index.ghosts)?;
    let mut projections = vec![0.0; local.index.ghosts.len() * D * D];
    let give = |node: u32, values: &mut [f64]| {
        values.copy_from_slice(held.projection(node as usize).as_flattened());
    };
    exchange.forward_from(world, D * D, give, &mut projections);
    *held = held.first_nodes(local.index.owned).followed_by(&projections);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roller at 45 degrees beside a support along x holds the whole plane: the projection is zero, and
    /// the duals separate the two.
    #[test]
    fn two_directions_hold_a_plane() {
        let slope = Vector::from([0.6, 0.8]);
        let directions = [(HeldBy::Axis(0), Vector::from([1.0, 0.0])), (HeldBy::Roller(0), slope)];
        let node = resolve(0, directions.into_iter()).expect("independent");
        assert!(node.projection().as_flattened().iter().all(|entry| entry.abs() < 1e-15));
        for (k, held) in node.held.iter().enumerate() {
            for (l, other) in node.held.iter().enumerate() {
                let product = held.dual.dot(&other.direction);
                assert!((product - f64::from(u8::from(k == l))).abs() < 1e-15);
            }
        }
        // A force along y is carried by both.
        let forces = [0, 1].map(|k| node.held[k].force(0, &[0.0, 1.0]));
        assert!((forces[0][0] + forces[1][0]).abs() < 1e-15 && (forces[1][1] - 1.0).abs() < 1e-15);
    }

    /// A third roller in a plane is implied by two others.
    #[test]
    fn directions_beyond_the_dimension_are_implied() {
        let unit = |angle: f64| Vector::from([angle.cos(), angle.sin()]);
        let directions = (0..3).map(|k| (HeldBy::Roller(k), unit(0.7 * k as f64)));
        let node = resolve(3, directions).expect("independent");
        assert_eq!((node.held.len(), node.implied.len()), (2, 1));
        assert_eq!(node.implied[0].0, 2);
    }

    /// The projection of one direction removes that direction only.
    #[test]
    fn one_direction_leaves_its_plane() {
        let normal = Vector::from([1.0, 2.0, 2.0]) / 3.0;
        let node = resolve(0, std::iter::once((HeldBy::Roller(0), normal))).expect("independent");
        let projection = node.projection();
        let apply =
            |x: &Vector<3>| Vector::<3>::from_fn(|i, _| (0..3).map(|j| projection[i][j] * x[j]).sum());
        let along = Vector::from([2.0, -1.0, 0.0]);
        assert!(apply(&normal).norm() < 1e-15 && (apply(&along) - along).norm() < 1e-15);
    }
}
