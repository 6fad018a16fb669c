//! The target facets that this rank's contactor facets may touch, including those of other ranks.
//!
//! Every rank describes the position of its contactor facets by a few boxes. Target facets are sent
//! only where boxes overlap. A gathering remains valid while the surfaces move less than a slack,
//! so that many steps share it.

mod facets;
mod parcel;

use std::collections::HashSet;

use mpi::traits::CommunicatorCollectives;

use crate::collective::Collective;
use crate::contact::mortar::facing::FacetNormal;
use crate::contact::target::TargetFacets;
use crate::error::{Error, Result, agree};
use crate::mesh::{Bounds, BoundsTree, ElementKind, Facet, stretch};
use crate::partition::exchange::sparse_all_to_all;
use crate::partition::{IndexMap, LocalMesh};
use crate::tensor::Vector;

pub use facets::ForeignNodes;
use facets::GatheredFacets;
use parcel::Parcel;

/// Number of boxes per rank around its contactor facets. With so many, a long or bent surface does
/// not overlap all target boxes.
const CLUSTERS: usize = 8;

/// The two surfaces of one contact on this rank.
#[derive(Debug, Clone, Copy)]
pub struct Surfaces<'a, const D: usize> {
    /// The rank's part of the mesh.
    pub local: &'a LocalMesh<D>,
    /// Local facets of the contactor.
    pub contactor: &'a [Facet],
    /// Local facets of the target. Those of other ranks' elements are skipped.
    pub target: &'a [Facet],
    /// Those of them with a corner on a sharp edge of the target or on its boundary.
    pub target_edges: &'a HashSet<Facet>,
}

/// Search distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Target facets within this distance of a contactor facet are never missed \[m\].
    pub radius: f64,
    /// Distance that the surfaces may move towards each other before the next gathering \[m\].
    pub slack: f64,
}

/// Target facets near this rank's contactor facets, and the positions of the surfaces when they
/// were gathered.
#[derive(Debug, Clone)]
pub struct TargetGather<const D: usize> {
    /// The facets in ascending order of identity, on local nodes, then foreign ones.
    pub facets: TargetFacets,
    /// The nodes that are not on this rank.
    pub foreign: ForeignNodes<D>,
    slack: f64,
    contactor: Track<D>,
    target: Track<D>,
}

impl<const D: usize> TargetGather<D> {
    /// Gathers the target facets whose boxes overlap a box of one of this rank's own contactor
    /// facets. Collective.
    ///
    /// The boxes use the current positions and are enlarged by the reach. `positions` are the
    /// current positions of all local nodes, `D` each \[m\]. The result depends on which contactor
    /// facets are the rank's own, but on nothing else of the partition. Facets are in ascending
    /// order of identity.
    ///
    /// # Errors
    /// If a message is damaged, the same on every rank.
    pub fn new(
        world: &impl CommunicatorCollectives,
        surfaces: &Surfaces<'_, D>,
        positions: &[f64],
        reach: Reach,
    ) -> Result<Self> {
        let local = surfaces.local;
        let (contactor, contactor_boxes) = own(local, surfaces.contactor.to_vec(), positions);
        let mine = |facet: &&Facet| local.mine[facet.element as usize];
        let target: Vec<Facet> = surfaces.target.iter().filter(mine).copied().collect();
        let (target, target_boxes) = own(local, target, positions);
        let inflated: Vec<Bounds<D>> =
            contactor_boxes.iter().map(|one| one.inflate(reach.radius + reach.slack)).collect();
        let places = places(world, &inflated);
        let parcels = Parcel::pack_for(world.rank(), &places, surfaces, &target, &target_boxes);
        let integers = sparse_all_to_all(world, &parcels.integers);
        let reals = sparse_all_to_all(world, &parcels.reals);

        let tree = BoundsTree::new(&inflated);
        let near = |one: &Bounds<D>| tree.meeting(one).next().is_some();
        let mut gathered = GatheredFacets::new(local);
        for (&facet, _) in target.iter().zip(&target_boxes).filter(|(_, one)| near(one)) {
            gathered.push_own(facet, surfaces.target_edges.contains(&facet));
        }
        let arrived =
            integers.iter().zip(&reals).map(|((_, integers), (_, reals))| Parcel { integers, reals });
        let whole = arrived.into_iter().try_for_each(|parcel| parcel.unpack(near, &mut gathered));
        agree(
            world,
            whole.ok_or_else(|| Error::internal("contact: a message with target facets is damaged")),
        )?;
        let (facets, foreign) = gathered.finish();
        Ok(Self {
            facets,
            foreign,
            slack: reach.slack,
            contactor: Track::new(local, &contactor, positions),
            target: Track::new(local, &target, positions),
        })
    }

    /// Indices of the facets' nodes in fields that contain the local nodes followed by the nodes
    /// `foreign`.
    pub fn placed(&self, index: &IndexMap, foreign: &[i32]) -> Vec<u32> {
        let numbers = &self.foreign.numbers;
        let place = |&node: &u32| match (node as usize).checked_sub(index.local_count()) {
            None => node,
            Some(beyond) => {
                let place = foreign.partition_point(|&other| other < numbers[beyond]);
                (index.local_count() + place) as u32
            }
        };
        self.facets.nodes.iter().map(place).collect()
    }

    /// The nodes that are not on this rank, with their reference points.
    pub fn foreign_nodes(&self) -> impl Iterator<Item = (i32, [f64; D])> + '_ {
        self.foreign.numbers.iter().copied().zip(self.foreign.points.iter().copied())
    }

    /// Whether one of this rank's own facets has turned so far since they were gathered that it may face
    /// others than then. `position` is the current position of a local node \[m\].
    pub fn has_turned(&self, position: impl Fn(u32) -> [f64; D]) -> bool {
        self.contactor.has_turned(&position) || self.target.has_turned(&position)
    }

    /// Largest motion of this rank's own facets of contactor and target since they were gathered
    /// \[m\].
    ///
    /// `position` is the current position of a local node \[m\]. Pass the largest of each over all
    /// ranks to [`holds`](Self::holds).
    pub fn motion(&self, position: impl Fn(u32) -> [f64; D]) -> [f64; 2] {
        [self.contactor.motion(&position), self.target.motion(&position)]
    }

    /// Whether the gathered facets are still sufficient after the surfaces moved by `motion`
    /// (largest of all ranks) \[m\].
    pub fn holds(&self, motion: [f64; 2]) -> bool {
        motion[0] + motion[1] <= self.slack
    }
}

/// Former positions of the nodes of a surface, how much further than the nodes a point of their
/// facets may have moved, and the former normals of the facets.
#[derive(Debug, Clone)]
struct Track<const D: usize> {
    nodes: Vec<u32>,
    places: Vec<[f64; D]>,
    stretch: f64,
    /// Kind and former normal of each facet.
    normals: Vec<(ElementKind, FacetNormal<D>)>,
    /// The nodes of the facets, one facet after the other.
    facet_nodes: Vec<u32>,
}

impl<const D: usize> Track<D> {
    fn new(local: &LocalMesh<D>, facets: &[Facet], positions: &[f64]) -> Self {
        let mut nodes = Vec::new();
        let mut list = Vec::new();
        let mut most = 1.0_f64;
        let mut normals = Vec::with_capacity(facets.len());
        for &facet in facets {
            local.mesh.facet_nodes(facet, &mut list);
            nodes.extend_from_slice(&list);
            let kind = local.mesh.facet_kind(facet);
            most = most.max(stretch(kind));
            let places: Vec<Vector<D>> = list.iter().map(|&node| position(positions, node).into()).collect();
            normals.push((kind, FacetNormal::of(kind, &places)));
        }
        let facet_nodes = nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        let places = nodes.iter().map(|&node| position(positions, node)).collect();
        Self { nodes, places, stretch: most, normals, facet_nodes }
    }

    fn has_turned(&self, position: impl Fn(u32) -> [f64; D]) -> bool {
        let mut nodes = self.facet_nodes.iter();
        let mut places = Vec::new();
        self.normals.iter().any(|(kind, before)| {
            places.clear();
            places.extend(nodes.by_ref().take(kind.nodes()).map(|&node| Vector::from(position(node))));
            FacetNormal::of(*kind, &places).has_turned(before)
        })
    }

    /// Largest component of the motion, which is the norm in which boxes are enlarged. Infinite if
    /// a position is not finite.
    fn motion(&self, position: impl Fn(u32) -> [f64; D]) -> f64 {
        let mut most = 0.0_f64;
        for (&node, place) in self.nodes.iter().zip(&self.places) {
            let now = position(node);
            for k in 0..D {
                let moved = (now[k] - place[k]).abs();
                most = if moved.is_finite() { moved.max(most) } else { f64::INFINITY };
            }
        }
        self.stretch * most
    }
}

/// Facets with the boxes around them.
fn own<const D: usize>(
    local: &LocalMesh<D>,
    own: Vec<Facet>,
    positions: &[f64],
) -> (Vec<Facet>, Vec<Bounds<D>>) {
    let mut nodes = Vec::new();
    let mut around = |&facet: &Facet| {
        local.mesh.facet_nodes(facet, &mut nodes);
        let kind: ElementKind = local.mesh.facet_kind(facet);
        Bounds::of_facet(kind, nodes.iter().map(|&node| position(positions, node)))
    };
    let boxes = own.iter().map(&mut around).collect();
    (own, boxes)
}

fn position<const D: usize>(positions: &[f64], node: u32) -> [f64; D] {
    std::array::from_fn(|k| positions[node as usize * D + k])
}

/// The boxes around the contactor facets of each rank. Collective.
fn places<const D: usize>(world: &impl CommunicatorCollectives, own: &[Bounds<D>]) -> Vec<Vec<Bounds<D>>> {
    let mut clusters = Bounds::clusters(&mut own.to_vec(), CLUSTERS);
    clusters.resize(CLUSTERS, Bounds::EMPTY);
    let told: Vec<f64> = clusters.iter().flat_map(|one| one.low.into_iter().chain(one.high)).collect();
    let mut all = vec![0.0; told.len() * world.size() as usize];
    world.gather_all(&told[..], &mut all[..]);
    let read = |corners: &[f64]| Bounds {
        low: std::array::from_fn(|k| corners[k]),
        high: std::array::from_fn(|k| corners[D + k]),
    };
    let of_rank =
        |told: &[f64]| told.chunks_exact(2 * D).map(read).filter(|one: &Bounds<D>| !one.is_empty()).collect();
    all.chunks_exact(told.len()).map(of_rank).collect()
}
