//! External forces: weight, tractions, pressures, forces and torques of the case (3.4).

use std::cell::Cell;

use mpi::traits::CommunicatorCollectives;
use nalgebra::{Matrix3, Vector3};

use super::contact::facets_of;
use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use super::solid::SolidElements;
use crate::case::{Motion, PlacedFunction};
use crate::element::{Configuration, ElementSink, Kinematics, LoadedLine, LoadedSurface};
use crate::error::{Error, Result, agree};
use crate::mesh::{Edge, Facet, Mesh};
use crate::model::{Load, LoadKind};
use crate::partition::{IndexMap, LocalMesh};
use crate::petsc::{BlockPattern, BlockValues, sum_over_ranks};
use crate::space::Held;
use crate::tensor::in_space;

/// Facets with equal numbers of nodes under one load.
struct Patch<const D: usize> {
    surface: LoadedSurface<D>,
    map: ScatterMap,
}

/// Edges with equal numbers of nodes under one load.
struct LinePatch<const D: usize> {
    line: LoadedLine<D>,
    map: ScatterMap,
}

/// A load of the case on this rank.
struct Applied<const D: usize> {
    /// Name in the case.
    name: String,
    kind: LoadKind<D>,
    /// Bodies that a body force acts on.
    bodies: Vec<bool>,
    patches: Vec<Patch<D>>,
    lines: Vec<LinePatch<D>>,
    /// Whether the pressure follows the surface.
    follows: bool,
    /// How a total force or torque is spread; `None` for other loads.
    spread: Option<Spread<D>>,
}

/// How a total is spread.
enum Spread<const D: usize> {
    /// Over a surface.
    Surface(SurfaceShape<D>),
    /// In equal parts over nodes.
    Nodes {
        /// Owned nodes.
        nodes: Vec<u32>,
        /// Part of each node.
        share: f64,
    },
}

/// Area of a surface and its moments, the same on all ranks.
struct SurfaceShape<const D: usize> {
    /// \[m^(D - 1)\]
    area: f64,
    /// Centroid \[m\].
    centre: [f64; D],
    /// Inverse of `int |r|^2 1 - r r dS` about the centroid [1/m^(D + 1)]. In 2D only the entry of z.
    inverse: Matrix3<f64>,
}

impl<const D: usize> SurfaceShape<D> {
    /// Moments of the facets of all ranks by the quadrature of tractions. Collective.
    ///
    /// # Errors
    /// The surface has no area, the same on all ranks.
    fn new(
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        facets: &[Facet],
        name: &str,
    ) -> Result<Self> {
        let mine: Vec<Facet> =
            facets.iter().filter(|facet| local.mine[facet.element as usize]).copied().collect();
        let surface = LoadedSurface::new(&local.mesh, &mine);
        let mut area = 0.0;
        let mut first = [0.0; D];
        surface.points(|point, part| {
            area += part;
            first.iter_mut().zip(point).for_each(|(sum, x)| *sum += part * x);
        });
        sum_over_ranks(world, std::iter::once(&mut area).chain(&mut first));
        let centre = first.map(|sum| sum / area);
        let mut second = Matrix3::zeros();
        surface.points(|point, part| {
            let arm = arm(&centre, point);
            second += (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * part;
        });
        sum_over_ranks(world, second.iter_mut());
        let inverse = match D {
            2 => Some(Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0 / second[(2, 2)]))),
            _ => second.try_inverse(),
        };
        let inverse = inverse.filter(|inverse| inverse.iter().all(|entry| entry.is_finite()));
        let without = || Error::case(format!("boundary '{name}': the surface has no area"));
        Ok(Self { area, centre, inverse: inverse.ok_or_else(without)? })
    }

    /// The traction with this resultant force \[N\], and with this moment about the centroid \[N m\], at
    /// a point \[Pa\] (3.20).
    fn traction(&self, force: &[f64; D], moment: &Vector3<f64>, point: &[f64; D]) -> [f64; D] {
        let turning = (self.inverse * moment).cross(&arm(&self.centre, point));
        std::array::from_fn(|i| force[i] / self.area + turning[i])
    }
}

/// Vector from a centre to a point, with a zero along z in 2D \[m\].
fn arm<const D: usize>(centre: &[f64; D], point: &[f64; D]) -> Vector3<f64> {
    Vector3::from(in_space(point)) - Vector3::from(in_space(centre))
}

/// Data of the rank that are needed to resolve the loads.
pub struct LoadContext<'a, const D: usize> {
    /// The rank's mesh.
    pub local: &'a LocalMesh<D>,
    /// Pattern of the matrix.
    pub pattern: &'a BlockPattern,
    /// Prescribed unknowns.
    pub held: &'a Held<D>,
    /// Kinematics of each body.
    pub kinematics: &'a [Kinematics],
}

/// All loads of a rank.
pub struct External<const D: usize> {
    loads: Vec<Applied<D>>,
    /// Dead loads at one time, reused until the time changes.
    dead: Vec<f64>,
    dead_at: Option<f64>,
    /// The first non-finite load, if there is one.
    trouble: Trouble,
}

impl<const D: usize> External<D> {
    /// Resolves the loads on the rank's mesh. Collective.
    ///
    /// # Errors
    /// A set does not exist, or it cannot carry the load; the same on all ranks.
    pub fn new(
        world: &impl CommunicatorCollectives,
        loads: &[Load<D>],
        place: &LoadContext<D>,
    ) -> Result<Self> {
        let applied = loads.iter().map(|load| Applied::new(load, place)).collect::<Result<Vec<_>>>();
        let mut applied = agree(world, applied)?;
        for (applied, load) in applied.iter_mut().zip(loads) {
            if let LoadKind::Force { .. } | LoadKind::Torque(_) = load.kind {
                applied.spread = Some(spread(world, place.local, load)?);
            }
        }
        let loads = applied;
        Ok(Self { loads, dead: Vec::new(), dead_at: None, trouble: Trouble::default() })
    }

    /// Recomputes the positions of all entries for another pattern.
    pub fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        let patches = self.loads.iter_mut().flat_map(|load| &mut load.patches);
        patches.for_each(|patch| patch.map.relocate(pattern, index));
        let lines = self.loads.iter_mut().flat_map(|load| &mut load.lines);
        lines.for_each(|patch| patch.map.relocate(pattern, index));
    }

    /// Whether a load depends on the displacement, and therefore has a (non-symmetric) stiffness.
    pub fn follows(&self) -> bool {
        self.loads.iter().any(|load| load.follows)
    }

    /// Adds `factor F_ext(u, time)` to the owned rows of `force` \[N\].
    pub fn add_force(&mut self, at: &Moment, solids: &[SolidElements<D>], force: &mut [f64]) {
        self.refresh(at.time, solids, force.len());
        force.iter_mut().zip(&self.dead).for_each(|(entry, load)| *entry += at.factor * load);
        let following = self.loads.iter().filter(|load| load.follows);
        for (load, patch) in following.flat_map(|load| load.patches.iter().map(move |patch| (load, patch))) {
            let mut sink = ForceSink::<D> { map: &patch.map, force: &mut *force };
            load.pressure(patch, at, &self.trouble, &mut sink);
        }
    }

    /// Names of all loads, in the order of [`Self::each`].
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.loads.iter().map(|load| load.name.as_str())
    }

    /// Calls `receive` with the number of each load and its force on `rows` owned rows \[N\].
    pub fn each(
        &self,
        at: &Moment,
        solids: &[SolidElements<D>],
        rows: usize,
        mut receive: impl FnMut(usize, &[f64]),
    ) {
        let mut force = vec![0.0; rows];
        for (number, load) in self.loads.iter().enumerate() {
            force.fill(0.0);
            if load.follows {
                for patch in &load.patches {
                    let mut sink = ForceSink::<D> { map: &patch.map, force: &mut force };
                    load.pressure(patch, at, &self.trouble, &mut sink);
                }
            } else {
                load.add_dead(at.time, solids, &self.trouble, &mut force);
                force.iter_mut().for_each(|entry| *entry *= at.factor);
            }
            receive(number, &force);
        }
    }

    /// Returns the first non-finite load on this rank since the last call.
    pub fn take_trouble(&mut self) -> Option<Error> {
        self.trouble.0.take()
    }

    /// Adds the stiffness of following loads to the matrix.
    pub fn add_stiffness(
        &self,
        at: &Moment,
        held: &Held<D>,
        values: &mut BlockValues,
        mut lift: Option<LiftTarget>,
    ) {
        let following = self.loads.iter().filter(|load| load.follows);
        for (load, patch) in following.flat_map(|load| load.patches.iter().map(move |patch| (load, patch))) {
            let lift = lift.as_mut().map(LiftTarget::reborrow);
            let mut sink = MatrixSink::<D>::new(&patch.map, held, values, lift);
            load.pressure(patch, at, &self.trouble, &mut sink);
        }
    }

    /// Assembles the dead loads again if they change with time.
    fn refresh(&mut self, time: f64, solids: &[SolidElements<D>], rows: usize) {
        let steady = self.loads.iter().all(|load| load.follows || load.kind.is_constant_in_time());
        if self.dead_at == Some(time) || (steady && self.dead_at.is_some()) {
            return;
        }
        let mut dead = std::mem::take(&mut self.dead);
        dead.clear();
        dead.resize(rows, 0.0);
        for load in self.loads.iter().filter(|load| !load.follows) {
            load.add_dead(time, solids, &self.trouble, &mut dead);
        }
        self.dead = dead;
        self.dead_at = Some(time);
    }
}

/// Time, displacement and factor at which loads act.
pub struct Moment<'a> {
    /// Time \[s\].
    pub time: f64,
    /// Local displacement \[m\].
    pub u: &'a [f64],
    /// Factor on all loads.
    pub factor: f64,
}

impl<const D: usize> Applied<D> {
    fn new(load: &Load<D>, place: &LoadContext<D>) -> Result<Self> {
        let mesh = &place.local.mesh;
        let mut bodies = vec![false; place.kinematics.len()];
        let mut facets = Vec::new();
        let mut edges = Vec::new();
        match load.kind {
            LoadKind::BodyForce(_) => bodies.iter_mut().enumerate().for_each(|(body, loaded)| {
                *loaded = load.body.is_none_or(|of_load| of_load == body);
            }),
            LoadKind::Line(_) => {
                let nodes = mesh.point_sets.get(&load.set).map_or(&[][..], |nodes| nodes);
                edges = mesh.edges_within(nodes);
                edges.retain(|edge| load.body.is_none_or(|of_load| of_load == usize::from(edge.body)));
            }
            // At nodes that belong to no facets of a set.
            LoadKind::Force { .. } if !mesh.facet_sets.contains_key(&load.set) => {}
            _ => {
                let of_body = |facet: &&Facet| {
                    let body = usize::from(mesh.body[facet.element as usize]);
                    load.body.is_none_or(|of_load| of_load == body)
                };
                facets = facets_of(place.local, &load.set)?.iter().filter(of_body).copied().collect();
            }
        }
        let finite = load.body.is_some_and(|body| place.kinematics[body] == Kinematics::Finite);
        let follows = matches!(load.kind, LoadKind::Pressure(_)) && finite;
        let patches = patches(mesh, &facets, place);
        let lines = lines(mesh, &edges, place);
        let name = load.name.clone();
        Ok(Self { name, kind: load.kind.clone(), bodies, patches, lines, follows, spread: None })
    }

    fn add_dead(&self, time: f64, solids: &[SolidElements<D>], trouble: &Trouble, force: &mut [f64]) {
        match &self.kind {
            LoadKind::BodyForce(components) => {
                let density = |point: &[f64; D]| values(components, point, time, trouble);
                for solid in solids.iter().filter(|solid| self.bodies[solid.body]) {
                    solid
                        .group
                        .body_force(density, &mut ForceSink::<D> { map: &solid.map, force: &mut *force });
                }
            }
            LoadKind::Traction(components) => {
                self.add_traction(|point| values(components, point, time, trouble), force);
            }
            LoadKind::Line(components) => {
                for patch in &self.lines {
                    let mut sink = ForceSink::<D> { map: &patch.map, force: &mut *force };
                    patch.line.force(|point| values(components, point, time, trouble), &mut sink);
                }
            }
            LoadKind::Force { components, at } => match &self.spread {
                Some(Spread::Surface(shape)) => {
                    let total = values(components, &shape.centre, time, trouble);
                    let lever = at.map_or_else(Vector3::zeros, |at| arm(&shape.centre, &at));
                    let moment = lever.cross(&Vector3::from(in_space(&total)));
                    self.add_traction(|point| shape.traction(&total, &moment, point), force);
                }
                Some(Spread::Nodes { nodes, share }) => {
                    let total = values(components, &[0.0; D], time, trouble);
                    for &node in nodes {
                        let entries = &mut force[node as usize * D..][..D];
                        entries.iter_mut().zip(total).for_each(|(entry, total)| *entry += share * total);
                    }
                }
                None => {}
            },
            LoadKind::Torque(components) => {
                let Some(Spread::Surface(shape)) = &self.spread else { return };
                let moment = values(components, &shape.centre, time, trouble);
                self.add_traction(|point| shape.traction(&[0.0; D], &moment.into(), point), force);
            }
            LoadKind::Pressure(pressure) => {
                for patch in &self.patches {
                    let mut sink = ForceSink::<D> { map: &patch.map, force: &mut *force };
                    let strength = |point: &[f64; D]| trouble.value(pressure, point, time);
                    patch.surface.pressure(Configuration::Reference, strength, &mut sink);
                }
            }
        }
    }

    /// Adds the forces of a dead traction \[Pa\] to owned rows \[N\].
    fn add_traction(&self, density: impl Fn(&[f64; D]) -> [f64; D], force: &mut [f64]) {
        for patch in &self.patches {
            let mut sink = ForceSink::<D> { map: &patch.map, force: &mut *force };
            patch.surface.traction(&density, &mut sink);
        }
    }

    fn pressure(&self, patch: &Patch<D>, at: &Moment, trouble: &Trouble, sink: &mut dyn ElementSink) {
        let LoadKind::Pressure(pressure) = &self.kind else { return };
        let strength = |point: &[f64; D]| at.factor * trouble.value(pressure, point, at.time);
        patch.surface.pressure(Configuration::Current(at.u), strength, sink);
    }
}

/// Finds how the total of a load is spread over its set. Collective.
fn spread<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    load: &Load<D>,
) -> Result<Spread<D>> {
    if let Some(facets) = local.mesh.facet_sets.get(&load.set) {
        return Ok(Spread::Surface(SurfaceShape::new(world, local, facets, &load.name)?));
    }
    let nodes = local
        .mesh
        .set_nodes(&load.set)
        .ok_or_else(|| Error::case(format!("boundary '{}': there is no set '{}'", load.name, load.set)));
    let mut nodes = agree(world, nodes)?;
    nodes.retain(|&node| local.index.owns(node));
    let mut count = nodes.len() as f64;
    sum_over_ranks(world, [&mut count]);
    let any = if count > 0.0 {
        Ok(())
    } else {
        Err(Error::case(format!("boundary '{}': the set '{}' has no nodes", load.name, load.set)))
    };
    any.map(|()| Spread::Nodes { nodes, share: 1.0 / count })
}

fn values<const D: usize, const N: usize>(
    components: &[PlacedFunction; N],
    point: &[f64; D],
    time: f64,
    trouble: &Trouble,
) -> [f64; N] {
    std::array::from_fn(|i| trouble.value(&components[i], point, time))
}

/// The first non-finite load. Kernels take values and cannot return an error.
#[derive(Default)]
struct Trouble(Cell<Option<Error>>);

impl Trouble {
    fn value<const D: usize>(&self, function: &PlacedFunction, point: &[f64; D], time: f64) -> f64 {
        let value = function.value(in_space(point), time);
        let still = Motion { value, rate: 0.0, second: 0.0 };
        if let Err(error) = function.require_sound(&still, point, time) {
            let first = self.0.take().unwrap_or(error);
            self.0.set(Some(first));
        }
        value
    }
}

/// Groups the facets by their number of nodes, each group with its map.
fn patches<const D: usize>(mesh: &Mesh<D>, facets: &[Facet], place: &LoadContext<D>) -> Vec<Patch<D>> {
    let width = |facet: &Facet| mesh.facet_kind(*facet).nodes();
    let mut widths: Vec<usize> = facets.iter().map(width).collect();
    widths.sort_unstable();
    widths.dedup();
    let patch = |&wanted: &usize| {
        let of_width: Vec<Facet> = facets.iter().filter(|facet| width(facet) == wanted).copied().collect();
        let surface = LoadedSurface::new(mesh, &of_width);
        let nodes = (0..surface.len()).flat_map(|index| surface.nodes(index)).copied().collect();
        let map = ScatterMap::new::<D>(wanted, nodes, place.pattern, &place.local.index, place.held);
        Patch { surface, map }
    };
    widths.iter().map(patch).collect()
}

/// Groups the edges by their number of nodes, each group with its map.
fn lines<const D: usize>(mesh: &Mesh<D>, edges: &[Edge], place: &LoadContext<D>) -> Vec<LinePatch<D>> {
    let mut widths: Vec<usize> = edges.iter().map(|edge| edge.nodes.len()).collect();
    widths.sort_unstable();
    widths.dedup();
    let patch = |&wanted: &usize| {
        let of_width: Vec<Edge> = edges.iter().filter(|edge| edge.nodes.len() == wanted).cloned().collect();
        let line = LoadedLine::new(mesh, &of_width);
        let nodes = line.nodes().collect();
        let map = ScatterMap::new::<D>(wanted, nodes, place.pattern, &place.local.index, place.held);
        LinePatch { line, map }
    };
    widths.iter().map(patch).collect()
}
