//! The facets of the target that this rank's contactor facets may meet, also those that other ranks hold.
//!
//! Every rank tells in a few boxes where its contactor facets lie; target facets travel only where boxes meet. What is
//! gathered holds while the surfaces move less than a slack, so that it is done once in many steps.

mod facets;
mod parcel;

use mpi::traits::CommunicatorCollectives;

use crate::contact::target::TargetFacets;
use crate::error::{Error, Result, agree};
use crate::mesh::{Bounds, BoundsTree, ElementKind, Facet, stretch};
use crate::partition::exchange::sparse_all_to_all;
use crate::partition::{IndexMap, LocalMesh};

pub use facets::ForeignNodes;
use facets::Gathered;
use parcel::Parcel;

/// Boxes by which a rank tells where its contactor facets lie: so many that a long or bent surface does not meet all.
const CLUSTERS: usize = 8;

/// The two surfaces of one contact on this rank.
#[derive(Debug, Clone, Copy)]
pub struct Surfaces<'a, const D: usize> {
    /// What the rank holds.
    pub local: &'a LocalMesh<D>,
    /// Local facets of the contactor.
    pub contactor: &'a [Facet],
    /// Local facets of the target; those of other ranks' elements are passed over.
    pub target: &'a [Facet],
}

/// How far to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Target facets within this distance of a contactor facet are never missed \[m\].
    pub radius: f64,
    /// So far the surfaces may move towards each other before the next gathering \[m\].
    pub slack: f64,
}

/// Target facets near this rank's contactor facets, and where the surfaces were when they were gathered.
#[derive(Debug, Clone)]
pub struct TargetGather<const D: usize> {
    /// The facets by ascending identity, on local nodes, then foreign ones.
    pub facets: TargetFacets,
    /// The nodes that this rank does not hold.
    pub foreign: ForeignNodes<D>,
    slack: f64,
    contactor: Track<D>,
    target: Track<D>,
}

impl<const D: usize> TargetGather<D> {
    /// Gathers the target facets whose boxes meet, on the current positions and with the reach around, a box of one of
    /// this rank's own contactor facets. Collective.
    ///
    /// `positions`: current positions of all local nodes, `D` each \[m\]. The result depends on which contactor facets are
    /// the rank's own, and on nothing else of the partition; facets come by ascending identity.
    ///
    /// # Errors
    /// The same on every rank, when a message is damaged.
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
        let mut gathered = Gathered::new(local);
        for (&facet, _) in target.iter().zip(&target_boxes).filter(|(_, one)| near(one)) {
            gathered.push_own(facet);
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

    /// Places of the nodes of the facets in fields of local nodes with the nodes `foreign` behind them.
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

    /// The nodes that this rank does not hold, with their reference points.
    pub fn foreign_nodes(&self) -> impl Iterator<Item = (i32, [f64; D])> + '_ {
        self.foreign.numbers.iter().copied().zip(self.foreign.points.iter().copied())
    }

    /// How far this rank's own facets of contactor and target have moved since they were gathered, at most \[m\].
    ///
    /// `position` tells the current position of a local node \[m\]. The largest of each over all ranks goes to
    /// [`holds`](Self::holds).
    pub fn motion(&self, position: impl Fn(u32) -> [f64; D]) -> [f64; 2] {
        [self.contactor.motion(&position), self.target.motion(&position)]
    }

    /// Whether the facets still are all that matter, after the surfaces moved by `motion` (largest of all ranks) \[m\].
    pub fn holds(&self, motion: [f64; 2]) -> bool {
        motion[0] + motion[1] <= self.slack
    }
}

/// Nodes of a surface where they were, and how much further than they a point of their facets may have moved.
#[derive(Debug, Clone)]
struct Track<const D: usize> {
    nodes: Vec<u32>,
    places: Vec<[f64; D]>,
    stretch: f64,
}

impl<const D: usize> Track<D> {
    fn new(local: &LocalMesh<D>, facets: &[Facet], positions: &[f64]) -> Self {
        let mut nodes = Vec::new();
        let mut list = Vec::new();
        let mut most = 1.0_f64;
        for &facet in facets {
            local.mesh.facet_nodes(facet, &mut list);
            nodes.extend_from_slice(&list);
            most = most.max(stretch(local.mesh.facet_kind(facet)));
        }
        nodes.sort_unstable();
        nodes.dedup();
        let places = nodes.iter().map(|&node| position(positions, node)).collect();
        Self { nodes, places, stretch: most }
    }

    /// In the norm of the largest component, in which boxes are inflated. Infinite if a position is not finite.
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

/// For each rank the boxes around its contactor facets. Collective.
fn places<const D: usize>(world: &impl CommunicatorCollectives, own: &[Bounds<D>]) -> Vec<Vec<Bounds<D>>> {
    let mut clusters = Bounds::clusters(&mut own.to_vec(), CLUSTERS);
    clusters.resize(CLUSTERS, Bounds::EMPTY);
    let told: Vec<f64> = clusters.iter().flat_map(|one| one.low.into_iter().chain(one.high)).collect();
    let mut all = vec![0.0; told.len() * world.size() as usize];
    world.all_gather_into(&told[..], &mut all[..]);
    let read = |corners: &[f64]| Bounds {
        low: std::array::from_fn(|k| corners[k]),
        high: std::array::from_fn(|k| corners[D + k]),
    };
    let of_rank =
        |told: &[f64]| told.chunks_exact(2 * D).map(read).filter(|one: &Bounds<D>| !one.is_empty()).collect();
    all.chunks_exact(told.len()).map(of_rank).collect()
}
