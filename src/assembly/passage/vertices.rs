//! Whether a target got between the points of a contactor: a part of it that is smaller than their spacing.
//!
//! Contact is looked for at points. A vertex of the target that has sunk into the contactor between them, with no point of a
//! contact between the two bodies that touches within a facet's length of it, is a contact missed where the target falls away from
//! it so steeply that no point there is about to touch: however shallow among points on all sides, and by an edge of the contactor's
//! surface where it is deeper than the facet resolves or than a fourth of the thinner body. In space so is a place on an edge.

use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::traits::{Communicator, CommunicatorCollectives};

use super::super::contact::Contact;
use super::super::meeting::Meeting;
use super::super::system::ContactSystem;
use super::moving::{Ends, Moving, any_above, around, nodes_of, parts, paths};
use crate::contact::passage::{Path, normal_of};
use crate::contact::surface::SurfaceFacet;
use crate::mesh::{Bounds, BoundsTree, Facet, Mesh, spelled};
use crate::tensor::Vector as Point;

/// A vertex may sink into a facet by this part of the facet's length before a point of it would have to touch: its points
/// are no further than that from where an edge of a right angle comes in.
const PART: f64 = 0.25;

/// From this part of the facet's length on a vertex has sunk in at all.
const SHALLOW: f64 = 0.02;

/// No steeper falls a target, on some side of a vertex, that points will meet in time: the faces of a cube that stands on its
/// corner fall by the root of two. It is that of the chord from the vertex to the target below or above a point.
const SLOPE: f64 = 1.45;

/// Edges of the target are looked at in places this part of a mean facet of the contactor apart.
const SPACING: f64 = 0.5;

/// A vertex of a target in the contactor, at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sunk<const D: usize> {
    /// Which contact.
    pub contact: usize,
    /// Behind a facet of the contactor \[m\].
    pub depth: f64,
    /// The depth that it may have where there are not points on all sides \[m\].
    pub deep: f64,
    /// Length of that facet \[m\].
    pub facet: f64,
    pub place: Point<D>,
    /// Outward of that facet.
    pub normal: Point<D>,
}

/// A facet is nearer to a vertex than another one where its distance is this part of the other's.
const NEARER: f64 = 0.99;

/// What is found out about a vertex: whether a point touches near by, whether one is about to, and in which of the quadrants
/// around it (in the plane halves) there are points.
const MARKS: usize = 6;

impl<const D: usize> Sunk<D> {
    const WIDTH: usize = 4 + 2 * D;

    fn pack(&self, into: &mut Vec<f64>) {
        into.extend([self.contact as f64, self.depth, self.deep, self.facet]);
        into.extend(self.place.iter().chain(self.normal.iter()));
    }

    fn unpack(numbers: &[f64]) -> Self {
        let (contact, depth, deep, facet) = (numbers[0] as usize, numbers[1], numbers[2], numbers[3]);
        let [place, normal] = [4, 4 + D].map(|at| Point::from_column_slice(&numbers[at..at + D]));
        Self { contact, depth, deep, facet, place, normal }
    }

    /// The quadrants around this vertex in which a point lies, on an axis both of its sides.
    fn quadrants(&self, point: &Point<D>) -> [bool; MARKS - 2] {
        let away = point - self.place;
        // The axes of the plane that are furthest from the normal, made perpendicular to it.
        let axis = |i: usize| Point::<D>::from_fn(|k, _| f64::from(u8::from(k == i)));
        let main = (0..D).max_by(|i, k| self.normal[*i].abs().total_cmp(&self.normal[*k].abs())).unwrap_or(0);
        let mut others = (0..D).filter(|i| *i != main).map(|i| axis(i) - self.normal * self.normal[i]);
        let mut side = || others.next().map_or(0.0, |axis| axis.dot(&away));
        let [a, b] = [side(), side()];
        [a >= 0.0 && b >= 0.0, a <= 0.0 && b >= 0.0, a >= 0.0 && b <= 0.0, a <= 0.0 && b <= 0.0]
    }

    /// Whether the target falls away from this vertex towards a point no steeper than what points meet in time.
    fn nears(&self, point: &Point<D>, target: &[[Path<D>; D]]) -> bool {
        let away = point - self.place;
        let height = away.dot(&self.normal);
        let most = SLOPE * (away - self.normal * height).norm() - height;
        any_above(target, point, &self.normal, most)
    }

    /// Whether what was found out says that the vertex is no contact missed.
    fn is_met(&self, marks: &[u8]) -> bool {
        let surrounded = marks[2..].iter().all(|mark| *mark > 0);
        marks[0] > 0 || marks[1] > 0 || self.depth <= self.deep && !surrounded
    }
}

impl<const D: usize> ContactSystem<D> {
    /// Vertices of the target that sank into facets of this rank none of whose points touches. `far` where things moved so
    /// far in the step that they may be anywhere at its end.
    pub(super) fn sunk(
        &self,
        number: usize,
        meeting: &Meeting<D>,
        moving: &Moving<D>,
        (ends, far): (Ends<'_>, bool),
    ) -> Vec<Sunk<D>> {
        let contact = &self.contacts[number];
        let (near, mut sunk) = (moving.bounds(), Vec::new());
        if near.is_empty() || contact.bodies[0] == contact.bodies[1] {
            return sunk;
        }
        let open = |facet: &&SurfaceFacet| {
            !contact.state.current[facet.points.clone()].iter().any(|point| point.is_closed())
        };
        let open = contact.surface().facets().iter().filter(open);
        let solids = open.map(|facet| Solid::new(self, contact, facet, ends));
        let solids = solids.map(|solid| (solid.bounds(), solid)).filter(|(around, _)| around.meets(&near));
        let (boxes, solids): (Vec<Bounds<D>>, Vec<Solid<D>>) = solids.unzip();
        if solids.is_empty() {
            return sunk;
        }
        let tree = BoundsTree::new(&boxes);
        for vertex in moving.vertices(SPACING * contact.facet_size) {
            let path = vertex.path;
            for hit in tree.meeting(&around(&[path])) {
                let solid = &solids[hit as usize];
                parts(solid.facet.kind, |part| {
                    let corners: [Path<D>; D] = std::array::from_fn(|k| solid.nodes[part[k]]);
                    let normal = normal_of(&corners.map(|corner| corner.end));
                    // Cheap, before what is dear.
                    if (path.end - corners[0].end).dot(&normal) >= 0.0 {
                        return;
                    }
                    let [from, deep] =
                        [SHALLOW, PART].map(|p| solid.enough(&corners, p, 0.5 * meeting.depth()));
                    let depth = path.sinks(&corners, from, |t| solid.holds(&path, t), far);
                    if let Some(depth) = depth.filter(|_| moving.faces(&vertex, &normal)) {
                        let (facet, place) = (solid.length(), path.end);
                        let normal = normal.try_normalize(0.0).unwrap_or_else(Point::zeros);
                        sunk.push(Sunk { contact: number, depth, deep, facet, place, normal });
                    }
                });
            }
        }
        sunk
    }

    /// Those of the vertices found on all ranks near which no point touches, or is about to, the deepest first; `targets` of each
    /// contact. Collective.
    pub(super) fn without_contact(
        &self,
        found: &[Sunk<D>],
        targets: &[Moving<D>],
        ends: Ends<'_>,
    ) -> Vec<Sunk<D>> {
        let world = self.session.world();
        let mut own = Vec::with_capacity(found.len() * Sunk::<D>::WIDTH);
        found.iter().for_each(|sunk| sunk.pack(&mut own));
        let mut counts = vec![0i32; world.size() as usize];
        world.all_gather_into(&(own.len() as i32), &mut counts[..]);
        let starts = counts.iter().scan(0, |sum, &count| Some(std::mem::replace(sum, *sum + count)));
        let starts: Vec<i32> = starts.collect();
        let mut all = vec![0.0; counts.iter().map(|&count| count as usize).sum()];
        world.all_gather_varcount_into(
            &own[..],
            &mut PartitionMut::new(&mut all[..], &counts[..], &starts[..]),
        );
        let all: Vec<Sunk<D>> = all.chunks_exact(Sunk::<D>::WIDTH).map(Sunk::unpack).collect();
        let mut marks = vec![0u8; all.len() * MARKS];
        for (contact, target) in self.contacts.iter().zip(targets) {
            let alike = |sunk: &Sunk<D>| self.contacts[sunk.contact].joins_those_of(contact);
            if !all.iter().any(alike) {
                continue;
            }
            let target = target.simplices();
            let each = || all.iter().zip(0..).filter(|(sunk, _)| alike(sunk));
            for (point, closed) in paths(contact, ends) {
                let near = each().filter(|(sunk, _)| (point.end - sunk.place).norm() <= sunk.facet);
                for (sunk, at) in near {
                    let marks = &mut marks[at * MARKS..(at + 1) * MARKS];
                    marks[0] |= u8::from(closed);
                    marks[1] |= u8::from(marks[0] == 0 && marks[1] == 0 && sunk.nears(&point.end, &target));
                    let quadrants = sunk.quadrants(&point.end);
                    marks[2..].iter_mut().zip(quadrants).for_each(|(mark, is)| *mark |= u8::from(is));
                }
            }
            for (sunk, at) in each() {
                marks[at * MARKS] |= u8::from(self.lies_shallow(sunk, contact, ends));
            }
        }
        let mut known = vec![0u8; marks.len()];
        world.all_reduce_into(&marks[..], &mut known[..], SystemOperation::max());
        let left = all.into_iter().zip(known.chunks_exact(MARKS)).filter(|(sunk, marks)| !sunk.is_met(marks));
        let mut left: Vec<Sunk<D>> = left.map(|(sunk, _)| sunk).collect();
        left.sort_by(|a, b| (a.contact.cmp(&b.contact)).then(b.depth.total_cmp(&a.depth)));
        left
    }

    /// Whether a vertex lies just below a facet of another contact of the two bodies: over an edge it came in there, and whether
    /// that facet carries it is for that contact to say.
    fn lies_shallow(&self, sunk: &Sunk<D>, contact: &Contact<D>, ends: Ends<'_>) -> bool {
        let (mesh, body) = (&self.local.mesh, self.contacts[sunk.contact].bodies[0]);
        let vertex = Path { start: sunk.place, end: sunk.place };
        let surfaces = contact.meeting().into_iter().flat_map(|meeting| meeting.surfaces());
        let facets =
            surfaces.zip(contact.bodies).filter(|(_, of)| *of == body).flat_map(|(facets, _)| facets);
        // A facet to which it is nearer than to the one that it has sunk behind.
        let within = sunk.deep.min(NEARER * sunk.depth);
        let (mut nodes, mut shallow) = (Vec::new(), false);
        for &facet in facets {
            mesh.facet_nodes(facet, &mut nodes);
            let path = |node: u32| ends.path(&mesh.points[node as usize].into(), node);
            parts(mesh.kinds[facet.element as usize].facet_kind(), |part| {
                let corners = std::array::from_fn(|k| path(nodes[part[k]]));
                shallow |= vertex.is_over(&corners, within);
            });
        }
        shallow
    }

    /// What a user reads of the vertices of the first contact that has some.
    pub(super) fn tell_sunk(&self, sunk: &[Sunk<D>]) -> Option<String> {
        let first = sunk.first()?;
        let contact = &self.contacts[first.contact];
        let mut places: Vec<[u64; D]> = sunk
            .iter()
            .filter(|sunk| sunk.contact == first.contact)
            .map(|sunk| std::array::from_fn(|i| sunk.place[i].to_bits()))
            .collect();
        places.sort_unstable();
        places.dedup();
        let m = self.units.of("m");
        let [contactor, target] = contact.bodies.map(|body| self.bodies[body].name());
        Some(format!(
            "contact '{}': '{target}' lies in '{contactor}' between its contact points at {} places, none of which is within {:.3e} {m} of a point that \
             touches, the deepest {:.3e} {m} behind a facet at {}: mesh '{contactor}' finer there, or exchange contactor and target",
            contact.name,
            places.len(),
            first.facet,
            first.depth,
            spelled(first.place.as_slice())
        ))
    }
}

/// A facet of a contactor with the element behind it.
struct Solid<'a, const D: usize> {
    contact: &'a Contact<D>,
    mesh: &'a Mesh<D>,
    ends: Ends<'a>,
    facet: &'a SurfaceFacet,
    /// Of the facet.
    nodes: Vec<Path<D>>,
}

impl<'a, const D: usize> Solid<'a, D> {
    fn new(
        system: &'a ContactSystem<D>,
        contact: &'a Contact<D>,
        facet: &'a SurfaceFacet,
        ends: Ends<'a>,
    ) -> Self {
        let nodes = nodes_of(contact.surface(), facet, ends);
        Self { contact, mesh: &system.local.mesh, ends, facet, nodes }
    }

    fn element(&self) -> usize {
        self.facet.facet.element as usize
    }

    fn path(&self, node: u32) -> Path<D> {
        self.ends.path(&self.mesh.points[node as usize].into(), node)
    }

    /// A box around the element, at both ends of the step.
    fn bounds(&self) -> Bounds<D> {
        let nodes = self.mesh.element_nodes(self.element()).iter().map(|&node| self.path(node));
        Bounds::of(nodes.flat_map(|path| [path.start.into(), path.end.into()]))
    }

    /// Whether a point is in the element at the part `t` of the step: behind all its sides.
    fn holds(&self, path: &Path<D>, t: f64) -> bool {
        let kind = self.mesh.kinds[self.element()];
        let (mut nodes, mut holds) = (Vec::new(), true);
        for side in 0..kind.sides().len() as u8 {
            self.mesh.facet_nodes(Facet { side, ..self.facet.facet }, &mut nodes);
            parts(kind.facet_kind(), |part| {
                holds &= path.is_behind(&std::array::from_fn(|k| self.path(nodes[part[k]])), t);
            });
        }
        holds
    }

    /// Longest distance of two nodes at the end of the step \[m\].
    fn length(&self) -> f64 {
        let apart = |a: &Path<D>| self.nodes.iter().map(|b| (a.end - b.end).norm()).fold(0.0, f64::max);
        self.nodes.iter().map(apart).fold(0.0, f64::max)
    }

    /// Depth behind the plane of `corners` from which a vertex counts as sunk \[m\]: a `part` of the facet, `at_most`, and
    /// beyond that how far the facet bulges and the overclosure that was adjusted.
    fn enough(&self, corners: &[Path<D>; D], part: f64, at_most: f64) -> f64 {
        let plane = corners.map(|corner| corner.end);
        let normal = normal_of(&plane).try_normalize(0.0).unwrap_or_else(Point::zeros);
        let bulge =
            self.nodes.iter().map(|node| (node.end - plane[0]).dot(&normal).abs()).fold(0.0, f64::max);
        let state = &self.contact.state;
        let adjusted = self.facet.points.clone().map(|point| -state.adjusted(point)).fold(0.0, f64::max);
        (part * self.length()).min(at_most) + bulge + adjusted
    }
}
