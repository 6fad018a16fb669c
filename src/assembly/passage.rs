//! Whether a contact was missed because a body went through its target between the ends of a step.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::{Contact, Pair};
use super::meeting::Meeting;
use super::system::ContactSystem;
use super::targets::{Reach, Surfaces, TargetGather};
use crate::contact::obstacle::Obstacle;
use crate::contact::passage::{Path, lies_between};
use crate::dynamics::Stage;
use crate::error::Result;
use crate::mesh::{Bounds, BoundsTree, ElementKind};
use crate::partition::exchange::{Field, NodeExchange};
use crate::tensor::Vector as Point;

/// Displacements at the two ends of a step \[m\].
#[derive(Clone, Copy)]
struct Ends<'a> {
    start: &'a [f64],
    end: &'a [f64],
}

impl<const D: usize> ContactSystem<D> {
    /// Why the step of `stage` can not be accepted although it balances: a point went through a target and is open on
    /// the other side. Deformable targets are looked at only where something moved further than a point may unseen, or
    /// a point has no facet any more. Collective.
    ///
    /// # Errors
    /// The same on all ranks, when a message is damaged.
    pub fn missed_contact(&mut self, stage: &Stage) -> Result<Option<String>> {
        if self.contacts.is_empty() {
            return Ok(None);
        }
        let (start, end) = (stage.start.u.local(), stage.trial.u.local());
        let ends = Ends { start: &start, end: &end };
        let mut motions: Vec<f64> =
            self.contacts.iter().flat_map(|contact| self.shifts(contact, ends)).collect();
        let own = motions.clone();
        self.session.world().all_reduce_into(&own[..], &mut motions[..], SystemOperation::max());
        let mut missed: Vec<u64> = Vec::with_capacity(2 * self.contacts.len());
        for contact in &self.contacts {
            missed.push(match &contact.pair {
                Pair::Rigid { contact: rigid, .. } => between_points(contact, &rigid.obstacle, ends),
                Pair::Deformable(_) => 0,
            });
        }
        for (contact, motion) in self.contacts.iter().zip(motions.chunks_exact(3)) {
            let [motion, lost] = [motion[0] + motion[1], motion[2]];
            missed.push(match &contact.pair {
                Pair::Rigid { contact: rigid, .. } => {
                    let passes = |path: Path<D>| path.passes_obstacle(&rigid.obstacle);
                    if motion > 0.0 {
                        paths(contact, ends, true).filter(|path| passes(*path)).count() as u64
                    } else {
                        0
                    }
                }
                Pair::Deformable(meeting) if motion > meeting.stride() || lost > 0.0 => {
                    self.passages(meeting, contact, ends, motion)?
                }
                Pair::Deformable(_) => 0,
            });
        }
        let mut all = vec![0u64; missed.len()];
        self.session.world().all_reduce_into(&missed[..], &mut all[..], SystemOperation::sum());
        let [between, all] = <[&[u64]; 2]>::from(all.split_at(self.contacts.len()));
        if let Some((contact, facets)) = self.contacts.iter().zip(between).find(|(_, facets)| **facets > 0) {
            let radius = match &contact.pair {
                Pair::Rigid { contact, .. } => contact.obstacle.outer_radius().unwrap_or(0.0),
                Pair::Deformable(_) => 0.0,
            };
            return Ok(Some(format!(
                "contact '{}': the obstacle, of radius {radius:.3e} m, lies between the points of {facets} facets of about {:.3e} m, none of which \
                 touches it: mesh the contactor finer than the radius, or take quadrature: gauss",
                contact.name, contact.facet_size
            )));
        }
        let through =
            self.contacts.iter().zip(all).zip(motions.chunks_exact(3)).find(|((_, points), _)| **points > 0);
        Ok(through.map(|((contact, points), motion)| {
            format!(
                "contact '{}': {points} points would go through the target within one step, in which \
                 the surfaces move by {:.3e} m",
                contact.name,
                motion[0] + motion[1]
            )
        }))
    }

    /// How far own nodes of contactor and target move in the step, at most \[m\]; 1 where a point has lost its facet.
    fn shifts(&self, contact: &Contact<D>, ends: Ends<'_>) -> [f64; 3] {
        let of_node = |node: u32| {
            let dofs = node as usize * D..node as usize * D + D;
            dofs.map(|dof| (ends.end[dof] - ends.start[dof]).powi(2)).sum::<f64>()
        };
        let surface = contact.surface();
        let contactor = surface.facets().iter().flat_map(|facet| surface.facet_nodes(facet));
        let contactor = contactor.map(|&node| of_node(node)).fold(0.0, f64::max);
        let (mut target, mut lost, mut nodes) = (0.0_f64, false, Vec::new());
        if let Some(meeting) = contact.meeting() {
            let knew = contact.state.history.iter().map(|history| history.normal != Point::<D>::zeros());
            lost = knew.enumerate().any(|(point, knew)| knew && meeting.pairing.facet(point).is_none());
            for &facet in &meeting.surfaces()[1] {
                self.local.mesh.facet_nodes(facet, &mut nodes);
                target = nodes.iter().map(|&node| of_node(node)).fold(target, f64::max);
            }
        }
        [contactor.sqrt(), target.sqrt(), f64::from(u8::from(lost))]
    }

    /// Points that pass through facets of the target, which are gathered as far as anything moves. Collective.
    fn passages(
        &self,
        meeting: &Meeting<D>,
        contact: &Contact<D>,
        ends: Ends<'_>,
        motion: f64,
    ) -> Result<u64> {
        let (world, depth) = (self.session.world(), meeting.depth());
        let reference = self.local.mesh.points.as_flattened();
        let positions: Vec<f64> = reference.iter().zip(ends.start).map(|(x, u)| x + u).collect();
        let [contactor, target] = meeting.surfaces();
        let surfaces = Surfaces { local: &self.local, contactor, target };
        let reach = Reach { radius: motion + depth, slack: 0.0 };
        let TargetGather { facets, foreign, .. } = TargetGather::new(world, &surfaces, &positions, reach)?;
        let mut bring = NodeExchange::new(world, &self.local.index, &foreign.numbers)?;
        let [mut start, mut end] = [0, 1].map(|_| vec![0.0; foreign.numbers.len() * D]);
        let fields = [(ends.start, &mut start), (ends.end, &mut end)];
        let mut fields = fields.map(|(owned, wanted)| Field { width: D, owned, wanted: &mut wanted[..] });
        bring.forward_many(world, &mut fields);
        let local = self.local.index.local_count();
        let path = |&node: &u32| {
            let node = node as usize;
            let (point, [from, to], at) = match node.checked_sub(local) {
                None => (self.local.mesh.points[node], [ends.start, ends.end], node * D),
                Some(beyond) => (foreign.points[beyond], [&start[..], &end[..]], beyond * D),
            };
            let place = |u: &[f64]| Point::<D>::from_fn(|i, _| point[i] + u[at + i]);
            Path { start: place(from), end: place(to) }
        };
        let mut simplices: Vec<[Path<D>; D]> = Vec::new();
        for facet in 0..facets.count() {
            let corners: Vec<Path<D>> = facets.nodes_of(facet).iter().map(path).collect();
            parts(facets.kinds[facet], |part| {
                simplices.push(std::array::from_fn(|k| corners[part[k]]));
            });
        }
        let boxes: Vec<Bounds<D>> = simplices.iter().map(|corners| around(corners)).collect();
        let tree = BoundsTree::new(&boxes);
        let passes = |path: &Path<D>| {
            tree.meeting(&around(&[*path]).inflate(depth))
                .any(|simplex| path.passes_simplex(&simplices[simplex as usize], depth))
        };
        Ok(paths(contact, ends, false).filter(passes).count() as u64)
    }
}

/// Facets of this rank without a closed point in which a small round obstacle lies.
fn between_points<const D: usize>(contact: &Contact<D>, obstacle: &Obstacle<D>, ends: Ends<'_>) -> u64 {
    // A facet that is not longer than the obstacle is thick always has a point in it before it lies so deep.
    let Some(radius) = obstacle.outer_radius().filter(|radius| *radius < 2.0 * contact.facet_size) else {
        return 0;
    };
    let (surface, mut count) = (contact.surface(), 0);
    for facet in surface.facets().iter().filter(|facet| facet.mine) {
        if contact.state.current[facet.points.clone()].iter().any(|point| point.is_closed()) {
            continue;
        }
        let nodes = surface.reference_points(facet).iter().zip(surface.facet_nodes(facet));
        let corners: Vec<Path<D>> = nodes
            .map(|(x, &node)| {
                let at = |u: &[f64]| x + Point::from_fn(|i, _| u[node as usize * D + i]);
                Path { start: at(ends.start), end: at(ends.end) }
            })
            .collect();
        let around = around(&corners);
        let size = (Point::<D>::from(around.high) - Point::from(around.low)).norm();
        if obstacle.gap(&corners[0].end) > size - 0.5 * radius {
            continue;
        }
        let mut lies = false;
        parts(facet.kind, |part| lies |= lies_between(&std::array::from_fn(|k| corners[part[k]]), obstacle));
        count += u64::from(lies);
    }
    count
}

/// Paths of the points of a contact that are open at the end of the step, or of all.
fn paths<'a, const D: usize>(
    contact: &'a Contact<D>,
    ends: Ends<'a>,
    all: bool,
) -> impl Iterator<Item = Path<D>> + 'a {
    let surface = contact.surface();
    surface.facets().iter().flat_map(move |facet| {
        let at = move |u: &[f64]| -> Vec<Point<D>> {
            let nodes = surface.reference_points(facet).iter().zip(surface.facet_nodes(facet));
            nodes.map(|(x, &node)| x + Point::from_fn(|i, _| u[node as usize * D + i])).collect()
        };
        let open = facet
            .points
            .clone()
            .enumerate()
            .filter(move |(_, point)| all || !contact.state.current[*point].is_closed());
        let mut open = open.peekable();
        let [from, to] =
            if open.peek().is_some() { [at(ends.start), at(ends.end)] } else { [Vec::new(), Vec::new()] };
        open.map(move |(q, _)| {
            let place = surface.facet_point(facet, q);
            Path { start: place.position(&from), end: place.position(&to) }
        })
    })
}

/// Corners of the lines or triangles that fill the corners of a facet.
fn parts(kind: ElementKind, mut receive: impl FnMut(&[usize])) {
    match (kind.dimension(), kind.corners()) {
        (1, _) => receive(&[0, 1]),
        (_, 3) => receive(&[0, 1, 2]),
        _ => {
            receive(&[0, 1, 2]);
            receive(&[0, 2, 3]);
        }
    }
}

/// A box around everything that moves on these paths.
fn around<const D: usize>(paths: &[Path<D>]) -> Bounds<D> {
    Bounds::of(paths.iter().flat_map(|path| [path.start.into(), path.end.into()]))
}
