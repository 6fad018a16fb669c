//! Mass redistribution: mass without the nodes that may touch (Khenous, Laborde, Renard 2008;
//! Doyen, Ern, Piperno 2011; theory, section 4.6).
//!
//! An element with nodes on a contact surface moves its mass to its other nodes. The rows and
//! columns of the contact nodes are removed, and the rest is scaled to the mass of the element. The
//! mass is the mean of the consistent and the lumped mass, whose errors of the wave speed have
//! opposite signs. With the consistent mass alone, short waves run ahead of the front; with the
//! lumped one, behind it. Contact nodes then follow their neighbours without inertia, so that the
//! contact force excites no oscillation of them.
//!
//! The moments that this changes are restored by a factor on the whole body, `m_ab (f_a + f_b) / 2`
//! with `f` a polynomial of the reference position. The polynomial of second degree keeps mass,
//! centre of mass and all second moments, hence the inertia about any axis. If it cannot do this
//! (for a body of one layer, for example), one of first degree keeps mass and centre. `f` differs
//! from 1 by the square of the ratio of element size to body size.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use nalgebra::{DMatrix, DVector};

use super::contact::facets_of;
use super::solid::SolidElements;
use crate::collective::Collective;
use crate::error::{Error, Result, agree};
use crate::mesh::Facet;
use crate::model::{MassChoice, Model};
use crate::partition::LocalMesh;
use crate::petsc::{Session, Vector};

/// Range of factors that count as a small correction.
const FACTORS: [f64; 2] = [0.25, 4.0];

/// Largest accepted error of a moment, relative to the body's mass and size.
const ROUNDING: f64 = 1e-10;

/// Nodes without mass, and the factors on the mass of the others.
pub struct Redistribution {
    /// Bodies whose mass is redistributed, and those whose mass cannot be redistributed as
    /// required.
    bodies: [BTreeSet<usize>; 2],
    /// For each local node, whether it has no mass.
    massless: Vec<bool>,
    /// For each local node, the factor on its mass.
    factor: Vec<f64>,
    /// Nodes of each body whose mass is redistributed, over all ranks.
    counts: BTreeMap<usize, NodeCounts>,
}

/// Numbers of nodes of a body, over all ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodeCounts {
    /// Nodes without mass.
    pub massless: u64,
    /// All nodes.
    pub all: u64,
}

impl NodeCounts {
    /// Whether more nodes follow their neighbours without inertia than have mass. Of a wall between
    /// two contact surfaces, this is the case with two elements of first order through the
    /// thickness, and not with three.
    pub fn are_mostly_massless(&self) -> bool {
        2 * self.massless > self.all
    }
}

/// Coordinate frame of a body. Monomials are of `(X - centre) / size`.
#[derive(Clone, Copy)]
struct Frame<const D: usize> {
    centre: [f64; D],
    size: f64,
}

impl Redistribution {
    /// Redistributes the mass of all bodies that request it; `None` if no body does. Collective.
    ///
    /// # Errors
    /// If a body would be left without mass, or would have to change a lot, unless it may keep its
    /// mass. All ranks return the same error.
    pub fn new<const D: usize>(
        session: &Rc<Session>,
        local: &LocalMesh<D>,
        model: &Model<D>,
        solids: &[SolidElements<D>],
    ) -> Result<Option<Self>> {
        let wants = |body: &usize| {
            let body = &model.bodies[*body];
            body.mass.spares_contact() && body.has_mass()
        };
        let wanting: BTreeSet<usize> = (0..model.bodies.len()).filter(wants).collect();
        if wanting.is_empty() {
            return Ok(None);
        }
        let own = touching(local, model, &wanting);
        let mut marks = Vector::ghosted(session, local.index.owned, D, &local.index.ghosts)?;
        let own = agree(session.world(), own)?;
        for (mark, touches) in marks.owned_mut().chunks_exact_mut(D).zip(&own) {
            mark[0] = f64::from(u8::from(*touches));
        }
        marks.update_ghosts()?;
        let massless = marks.local().chunks_exact(D).map(|mark| mark[0] > 0.0).collect::<Vec<_>>();
        let factor = vec![1.0; massless.len()];
        let counts = BTreeMap::new();
        let mut all = Self { bodies: [wanting.clone(), BTreeSet::new()], massless, factor, counts };
        for body in wanting {
            let model = &model.bodies[body];
            let nodes = nodes_of(local, body);
            if all.balance(session, local, body, &nodes, solids) {
                let counts = all.count(session.world(), local, &nodes);
                all.counts.insert(body, counts);
                continue;
            }
            if model.mass == MassChoice::Redistributed {
                return Err(refusal(&model.name));
            }
            all.bodies[0].remove(&body);
            all.bodies[1].insert(body);
        }
        Ok(Some(all))
    }

    /// Whether the mass of the body is redistributed.
    pub fn has(&self, body: usize) -> bool {
        self.bodies[0].contains(&body)
    }

    /// Memory for the marks and factors of the nodes \[bytes\].
    pub fn bytes(&self) -> usize {
        size_of_val(&self.massless[..]) + size_of_val(&self.factor[..])
    }

    /// The bodies whose mass is redistributed, and those whose mass cannot be redistributed as
    /// required.
    pub fn bodies(&self) -> &[BTreeSet<usize>; 2] {
        &self.bodies
    }

    /// Numbers of nodes of the bodies whose mass is redistributed.
    pub fn counts(&self) -> &BTreeMap<usize, NodeCounts> {
        &self.counts
    }

    /// Counts the `nodes` of a body on all ranks. Collective.
    fn count<const D: usize>(
        &self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        nodes: &[u32],
    ) -> NodeCounts {
        // The owner of a node has all elements around it.
        let owned = || nodes.iter().filter(|&&node| local.index.owns(node));
        let massless = owned().filter(|&&node| self.massless[node as usize]).count();
        let own = [massless as u64, owned().count() as u64];
        let mut total = [0; 2];
        world.reduce_all(&own[..], &mut total[..], SystemOperation::sum());
        NodeCounts { massless: total[0], all: total[1] }
    }

    /// Moves the consistent mass `mass[a * n + b]` of the element with these nodes to its other
    /// nodes \[kg\].
    pub fn apply(&self, nodes: &[u32], mass: &[f64], out: &mut Vec<f64>) {
        self.strip(nodes, mass, out);
        let factor = |a: usize| self.factor[nodes[a] as usize];
        let n = nodes.len();
        for (k, value) in out.iter_mut().enumerate() {
            *value *= 0.5 * (factor(k / n) + factor(k % n));
        }
    }

    /// Moves the consistent mass of an element to its other nodes, without the factor.
    fn strip(&self, nodes: &[u32], mass: &[f64], out: &mut Vec<f64>) {
        let n = nodes.len();
        let heavy = |a: usize| !self.massless[nodes[a] as usize];
        let total: f64 = mass.iter().sum();
        let diagonal: f64 = mass.iter().step_by(n + 1).sum();
        let lumped = |k: usize| {
            if k.is_multiple_of(n + 1) && diagonal > 0.0 { mass[k] * total / diagonal } else { 0.0 }
        };
        let mean = |k: usize| 0.5 * (mass[k] + lumped(k));
        out.clear();
        out.extend((0..n * n).map(|k| if heavy(k / n) && heavy(k % n) { mean(k) } else { 0.0 }));
        let left: f64 = out.iter().sum();
        let scale = if left > 0.0 { total / left } else { 0.0 };
        out.iter_mut().for_each(|m| *m *= scale);
    }

    /// Finds the factor of a body with these local nodes. Returns whether there is one. Collective.
    fn balance<const D: usize>(
        &mut self,
        session: &Rc<Session>,
        local: &LocalMesh<D>,
        body: usize,
        nodes: &[u32],
        solids: &[SolidElements<D>],
    ) -> bool {
        let frame = Frame::around(session.world(), local, nodes);
        let all = frame.monomials(&[0.0; D]).len();
        let [matrix, right] = self.moments(session.world(), local, body, &frame, solids);
        let matrix = DMatrix::from_row_slice(all, all, &matrix);
        let right = DVector::from_vec(right);
        for count in [all, D + 1] {
            let part = (matrix.view((0, 0), (count, count)).into_owned(), right.rows(0, count).into_owned());
            let Some(polynomial) = solve(&part) else { continue };
            let value = |&node: &u32| {
                let monomials = frame.monomials(&local.mesh.points[node as usize]);
                monomials.iter().zip(polynomial.iter()).map(|(m, c)| m * c).sum::<f64>()
            };
            let values: Vec<f64> = nodes.iter().map(value).collect();
            let heavy = nodes.iter().zip(&values).filter(|(node, _)| !self.massless[**node as usize]);
            let wrong = heavy.filter(|(_, f)| !(FACTORS[0]..=FACTORS[1]).contains(*f)).count() as u64;
            let mut everywhere = 0u64;
            session.world().reduce_all(&wrong, &mut everywhere, SystemOperation::sum());
            if everywhere == 0 {
                nodes.iter().zip(values).for_each(|(&node, f)| self.factor[node as usize] = f);
                return true;
            }
        }
        false
    }

    /// Moments of the remaining mass, weighted by each monomial, and of the original mass.
    /// Collective.
    fn moments<const D: usize>(
        &self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        body: usize,
        frame: &Frame<D>,
        solids: &[SolidElements<D>],
    ) -> [Vec<f64>; 2] {
        let count = frame.monomials(&[0.0; D]).len();
        let mut own = vec![0.0; count * (count + 1)];
        let mut left = Vec::new();
        for solid in solids.iter().filter(|solid| solid.body == body) {
            solid.group.mass(|index, mass| {
                let element = solid.group.elements()[index] as usize;
                if !local.mine[element] {
                    return;
                }
                let nodes = local.mesh.element_nodes(element);
                self.strip(nodes, mass, &mut left);
                let at: Vec<Vec<f64>> =
                    nodes.iter().map(|&node| frame.monomials(&local.mesh.points[node as usize])).collect();
                let n = nodes.len();
                for (a, b) in (0..n * n).map(|k| (k / n, k % n)) {
                    for row in 0..count {
                        let moment = frame.moment(row, &at[a], &at[b]);
                        own[count * count + row] += moment * mass[a * n + b];
                        for column in 0..count {
                            let weight = 0.5 * (at[a][column] + at[b][column]);
                            own[row * count + column] += moment * weight * left[a * n + b];
                        }
                    }
                }
            });
        }
        let mut total = vec![0.0; own.len()];
        world.reduce_all(&own[..], &mut total[..], SystemOperation::sum());
        let right = total.split_off(count * count);
        [total, right]
    }
}

fn refusal(name: &str) -> Error {
    Error::case(format!(
        "bodies.{name}: mass: redistributed can not preserve the mass and the centre of mass of the body \
         with massless contact nodes"
    ))
    .hint("refine the mesh (several layers of elements must lie behind the surface), or use mass: consistent")
}

/// The local nodes of a body, in ascending order.
fn nodes_of<const D: usize>(local: &LocalMesh<D>, body: usize) -> Vec<u32> {
    let mut nodes: Vec<u32> = (0..local.mesh.element_count())
        .filter(|&element| usize::from(local.mesh.body[element]) == body)
        .flat_map(|element| local.mesh.element_nodes(element).iter().copied())
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// The owned nodes of bodies in `wanting` that are on a surface of a contact.
fn touching<const D: usize>(
    local: &LocalMesh<D>,
    model: &Model<D>,
    wanting: &BTreeSet<usize>,
) -> Result<Vec<bool>> {
    let mut touches = vec![false; local.index.owned];
    let mut nodes = Vec::new();
    for contact in &model.contacts {
        for set in contact.sets() {
            let of_wanting =
                |facet: &&Facet| wanting.contains(&usize::from(local.mesh.body[facet.element as usize]));
            for &facet in facets_of(local, set)?.iter().filter(of_wanting) {
                local.mesh.facet_nodes(facet, &mut nodes);
                for &node in &nodes {
                    if let Some(touches) = touches.get_mut(node as usize) {
                        *touches = true;
                    }
                }
            }
        }
    }
    Ok(touches)
}

impl<const D: usize> Frame<D> {
    /// Frame of the box around nodes of all ranks. Collective.
    fn around(world: &impl CommunicatorCollectives, local: &LocalMesh<D>, nodes: &[u32]) -> Self {
        let mut own = [f64::INFINITY; 6];
        for point in nodes.iter().map(|&node| &local.mesh.points[node as usize]) {
            for (i, x) in point.iter().enumerate() {
                own[i] = own[i].min(*x);
                own[3 + i] = own[3 + i].min(-x);
            }
        }
        let mut all = [0.0; 6];
        world.reduce_all(&own[..], &mut all[..], SystemOperation::min());
        let centre = std::array::from_fn(|i| 0.5 * (all[i] - all[3 + i]));
        let size = (0..D).map(|i| -all[3 + i] - all[i]).fold(0.0, f64::max);
        Self { centre, size: 0.5 * size }
    }

    /// Values at `point` of one, the coordinates, and their products.
    fn monomials(&self, point: &[f64; D]) -> Vec<f64> {
        let x: [f64; D] = std::array::from_fn(|i| (point[i] - self.centre[i]) / self.size);
        let products = (0..D).flat_map(|i| (i..D).map(move |j| x[i] * x[j]));
        std::iter::once(1.0).chain(x).chain(products).collect()
    }

    /// Contribution to moment `row` of a mass between nodes with the monomials `a` and `b`.
    fn moment(&self, row: usize, a: &[f64], b: &[f64]) -> f64 {
        if row <= D {
            return 0.5 * (a[row] + b[row]);
        }
        let pairs = (0..D).flat_map(|i| (i..D).map(move |j| (i, j)));
        let (i, j) = pairs.into_iter().nth(row - D - 1).unwrap_or((0, 0));
        0.5 * (a[1 + i] * b[1 + j] + a[1 + j] * b[1 + i])
    }
}

/// Finds the smallest polynomial that keeps all moments; `None` if there is no such polynomial.
fn solve((matrix, right): &(DMatrix<f64>, DVector<f64>)) -> Option<DVector<f64>> {
    let mass = right[0];
    if mass.is_nan() || mass <= 0.0 {
        return None;
    }
    let found = matrix.clone().svd(true, true).solve(right, 1e-12 * mass).ok()?;
    ((matrix * &found - right).amax() <= ROUNDING * mass).then_some(found)
}
