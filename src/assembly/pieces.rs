//! Pieces of bodies, which move as rigid bodies if nothing holds them.
//!
//! A body whose elements are all connected through sides is one piece. Pieces that share only nodes
//! are hinged at these and form one group.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use nalgebra::{DMatrix, SymmetricEigen};

use super::elastic::ElasticSupports;
use super::supports::Supports;
use crate::collective::Collective;
use crate::mesh::{DisjointSets, Mesh, spelled};
use crate::model::Model;
use crate::partition::LocalMesh;

/// Properties of a piece, with the same values on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BodyPiece<const D: usize> {
    /// Index of its body; of tied bodies the first.
    pub body: usize,
    /// Indices of all bodies that ties join in it.
    pub bodies: Vec<usize>,
    /// Index of its group.
    pub group: usize,
    /// Number of its elements.
    pub elements: u64,
    /// Mean of the centres of its elements \[m\].
    pub centre: [f64; D],
}

/// The pieces of all bodies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pieces<const D: usize> {
    pub all: Vec<BodyPiece<D>>,
    /// Pieces of each group, which are hinged to each other, in ascending order.
    pub groups: Vec<Vec<usize>>,
    /// Owned nodes that several pieces share, with these pieces, in ascending order.
    pub hinges: Vec<(u32, Vec<usize>)>,
    /// Whether a contact uses a surface of each group.
    pub touched: Vec<bool>,
    names: Vec<String>,
    /// The unit of length.
    unit: String,
}

impl<const D: usize> Pieces<D> {
    /// Finds the pieces of the distributed mesh. Collective.
    pub fn new(world: &impl CommunicatorCollectives, local: &LocalMesh<D>, model: &Model<D>) -> Self {
        let mesh = &local.mesh;
        let own = mesh.piece.iter().max().map_or(0, |last| last + 1);
        let mut count = 0;
        world.reduce_all(&own, &mut count, SystemOperation::max());
        let count = count as usize;
        let names: Vec<String> = model.bodies.iter().map(|body| body.name.clone()).collect();
        let mut own = vec![0_u8; count * names.len()];
        let mut sums = vec![0.0_f64; count * (D + 1)];
        for element in 0..mesh.element_count() {
            let piece = mesh.piece[element] as usize;
            own[piece * names.len() + usize::from(mesh.body[element])] = 1;
            if local.mine[element] {
                let sums = &mut sums[piece * (D + 1)..][..D + 1];
                sums[0] += 1.0;
                sums[1..].iter_mut().zip(mesh.element_centre(element)).for_each(|(sum, x)| *sum += x);
            }
        }
        let mut members = vec![0_u8; own.len()];
        let mut totals = vec![0.0_f64; sums.len()];
        world.reduce_all(&own[..], &mut members[..], SystemOperation::max());
        world.reduce_all(&sums[..], &mut totals[..], SystemOperation::sum());
        let hinges = hinges(mesh, local.index.owned);
        let (group, groups) = group(world, &hinges, count);
        let all = (0..count).map(|piece| {
            let sums = &totals[piece * (D + 1)..][..D + 1];
            let is_in = |body: &usize| members[piece * names.len() + body] > 0;
            let bodies: Vec<usize> = (0..names.len()).filter(is_in).collect();
            BodyPiece {
                body: bodies.first().copied().unwrap_or_default(),
                bodies,
                group: group[piece],
                elements: sums[0] as u64,
                centre: std::array::from_fn(|i| sums[i + 1] / sums[0].max(1.0)),
            }
        });
        let all: Vec<BodyPiece<D>> = all.collect();
        let touched = touched(world, mesh, model, &group, groups.len());
        Self { all, groups, hinges, touched, names, unit: model.units.of("m") }
    }

    /// Name of a piece in messages: that of its body, if the body is in one piece.
    pub fn name(&self, piece: usize) -> String {
        let BodyPiece { bodies, elements, centre, .. } = &self.all[piece];
        let is_shared =
            |body: &usize| self.all.iter().filter(|other| other.bodies.contains(body)).count() > 1;
        let names: Vec<&str> = bodies.iter().map(|&body| self.names[body].as_str()).collect();
        let name = names.join("' tied to '");
        if !bodies.iter().any(is_shared) {
            return format!("'{name}'");
        }
        let s = if *elements == 1 { "" } else { "s" };
        // Enough digits to locate the piece.
        let centre = centre.map(|x| format!("{x:.4e}").parse().unwrap_or(x));
        format!("the piece of '{name}' with {elements} element{s} around {} {}", spelled(&centre), self.unit)
    }

    /// Name of a group in messages.
    pub fn group_name(&self, group: usize) -> String {
        let pieces = &self.groups[group];
        let names: Vec<String> = pieces.iter().map(|&piece| self.name(piece)).collect();
        match names.as_slice() {
            [name] => name.clone(),
            _ => format!("the pieces joined at single nodes ({})", names.join(", ")),
        }
    }

    /// For each group, whether a support, foundation or spring holds it along each axis. Collective.
    pub fn held(
        &self,
        world: &impl CommunicatorCollectives,
        mesh: &Mesh<D>,
        supports: &Supports<D>,
        elastic: &ElasticSupports<D>,
    ) -> Vec<[bool; D]> {
        let resisted = elastic.resisted(mesh.points.len() * D);
        let mut own = vec![0.0; self.groups.len() * D * D];
        for element in 0..mesh.element_count() {
            let group = self.all[mesh.piece[element] as usize].group;
            for &node in mesh.element_nodes(element) {
                let free = supports.dofs.held.projection(node as usize);
                let sums = &mut own[group * D * D..][..D * D];
                for (ij, sum) in sums.iter_mut().enumerate() {
                    let (i, j) = (ij / D, ij % D);
                    let unit = f64::from(u8::from(i == j));
                    *sum += unit - free[i][j];
                    // A ring resists a change of its radius.
                    let is_ring = mesh.plane.is_revolved() && i == 0;
                    if i == j && (is_ring || resisted[node as usize * D + i]) {
                        *sum += unit;
                    }
                }
            }
        }
        let mut held = vec![0.0; own.len()];
        world.reduce_all(&own[..], &mut held[..], SystemOperation::sum());
        held.chunks_exact(D * D).map(axes_in_range).collect()
    }
}

/// Sums of projections, and parts of an axis outside of the held directions, below which they are
/// rounding. A direction that one node holds adds one to its sum.
const OUTSIDE: f64 = 1e-6;

/// For each axis, whether it is a combination of directions that a sum of projections, row-major,
/// holds.
fn axes_in_range<const D: usize>(held: &[f64]) -> [bool; D] {
    let eigen = SymmetricEigen::new(DMatrix::from_row_slice(D, D, held));
    let free = (0..D).filter(|&k| eigen.eigenvalues[k] <= OUTSIDE);
    let free: Vec<_> = free.map(|k| eigen.eigenvectors.column(k)).collect();
    std::array::from_fn(|i| free.iter().all(|direction| direction[i].abs() < OUTSIDE))
}

/// Owned nodes at elements of several pieces, with these pieces. All elements at an owned node are
/// local.
fn hinges<const D: usize>(mesh: &Mesh<D>, owned: usize) -> Vec<(u32, Vec<usize>)> {
    let mut first = vec![u32::MAX; owned];
    let mut more: Vec<(u32, u32)> = Vec::new();
    for element in 0..mesh.element_count() {
        let piece = mesh.piece[element];
        for &node in mesh.element_nodes(element) {
            match first.get_mut(node as usize) {
                Some(known) if *known == u32::MAX => *known = piece,
                Some(known) if *known != piece => more.push((node, piece)),
                _ => {}
            }
        }
    }
    more.sort_unstable();
    more.dedup();
    let at_nodes = more.chunk_by(|a, b| a.0 == b.0);
    let hinge = |at_node: &[(u32, u32)]| {
        let node = at_node[0].0;
        let mut pieces: Vec<usize> = at_node.iter().map(|(_, piece)| *piece as usize).collect();
        pieces.push(first[node as usize] as usize);
        pieces.sort_unstable();
        (node, pieces)
    };
    at_nodes.map(hinge).collect()
}

/// Finds the group of each piece, and the pieces of each group. Collective.
fn group(
    world: &impl CommunicatorCollectives,
    hinges: &[(u32, Vec<usize>)],
    count: usize,
) -> (Vec<usize>, Vec<Vec<usize>>) {
    let mut sets = DisjointSets::new(count);
    for (_, pieces) in hinges {
        pieces.windows(2).for_each(|pair| {
            sets.join(pair[0] as u32, pair[1] as u32);
        });
    }
    // In each round, every rank learns the lowest member that another rank knows of each of its
    // sets.
    loop {
        let own: Vec<u32> = (0..count as u32).map(|piece| sets.find(piece)).collect();
        let mut all = vec![0; count];
        world.reduce_all(&own[..], &mut all[..], SystemOperation::min());
        let mut changed = 0u8;
        for (piece, &lowest) in (0..).zip(&all) {
            changed |= u8::from(sets.join(piece, lowest));
        }
        let mut any = 0u8;
        world.reduce_all(&changed, &mut any, SystemOperation::max());
        if any == 0 {
            break;
        }
    }
    let group: Vec<usize> = sets.labels().into_iter().map(|label| label as usize).collect();
    let mut groups = vec![Vec::new(); group.iter().max().map_or(0, |last| last + 1)];
    group.iter().enumerate().for_each(|(piece, &group)| groups[group].push(piece));
    (group, groups)
}

/// Whether contacts use a surface of each group. Collective.
fn touched<const D: usize>(
    world: &impl CommunicatorCollectives,
    mesh: &Mesh<D>,
    model: &Model<D>,
    group: &[usize],
    count: usize,
) -> Vec<bool> {
    let mut own = vec![0u8; count];
    for contact in &model.contacts {
        for set in contact.sets() {
            for facet in mesh.facet_sets.get(set).into_iter().flatten() {
                own[group[mesh.piece[facet.element as usize] as usize]] = 1;
            }
        }
    }
    let mut all = vec![0u8; count];
    world.reduce_all(&own[..], &mut all[..], SystemOperation::max());
    all.into_iter().map(|touched| touched > 0).collect()
}
