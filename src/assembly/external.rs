//! External forces: weight, tractions and pressures of the case (3.4).

use std::cell::Cell;

use super::contact::facets_of;
use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use super::solid::SolidElements;
use super::supports::in_space;
use crate::case::{Motion, PlacedFunction};
use crate::element::{Configuration, ElementSink, Kinematics, LoadedSurface};
use crate::error::{Error, Result};
use crate::mesh::{Facet, Mesh};
use crate::model::{Load, LoadKind};
use crate::partition::{IndexMap, LocalMesh};
use crate::petsc::{BlockPattern, BlockValues};

/// Facets with equal numbers of nodes under one load.
struct Patch<const D: usize> {
    surface: LoadedSurface<D>,
    map: ScatterMap,
}

/// A load of the case on this rank.
struct Applied<const D: usize> {
    kind: LoadKind<D>,
    /// Bodies that a body force acts on.
    bodies: Vec<bool>,
    patches: Vec<Patch<D>>,
    /// Whether the pressure follows the surface.
    follows: bool,
}

/// Data of the rank that are needed to resolve the loads.
pub struct LoadContext<'a, const D: usize> {
    /// The rank's mesh.
    pub local: &'a LocalMesh<D>,
    /// Pattern of the matrix.
    pub pattern: &'a BlockPattern,
    /// Prescribed unknowns.
    pub constrained: &'a [bool],
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
    /// Resolves the loads on the rank's mesh.
    ///
    /// # Errors
    /// If a set does not exist.
    pub fn new(loads: &[Load<D>], place: &LoadContext<D>) -> Result<Self> {
        let loads = loads.iter().map(|load| Applied::new(load, place)).collect::<Result<_>>()?;
        Ok(Self { loads, dead: Vec::new(), dead_at: None, trouble: Trouble::default() })
    }

    /// Recomputes the positions of all entries for another pattern.
    pub fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        let patches = self.loads.iter_mut().flat_map(|load| &mut load.patches);
        patches.for_each(|patch| patch.map.relocate(pattern, index));
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

    /// Returns the first non-finite load on this rank since the last call.
    pub fn take_trouble(&mut self) -> Option<Error> {
        self.trouble.0.take()
    }

    /// Adds the stiffness of following loads to the matrix.
    pub fn add_stiffness(
        &self,
        at: &Moment,
        constrained: &[bool],
        values: &mut BlockValues,
        mut lift: Option<LiftTarget>,
    ) {
        let following = self.loads.iter().filter(|load| load.follows);
        for (load, patch) in following.flat_map(|load| load.patches.iter().map(move |patch| (load, patch))) {
            let mut sink = MatrixSink::<D> {
                map: &patch.map,
                constrained,
                values: &mut *values,
                lift: lift.as_mut().map(LiftTarget::reborrow),
                scratch: Vec::new(),
            };
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
        if let LoadKind::BodyForce(_) = load.kind {
            bodies[load.body] = true;
        } else {
            let of_body = |facet: &&Facet| usize::from(mesh.body[facet.element as usize]) == load.body;
            facets = facets_of(place.local, &load.set)?.iter().filter(of_body).copied().collect();
        }
        let finite = place.kinematics[load.body] == Kinematics::Finite;
        let follows = matches!(load.kind, LoadKind::Pressure(_)) && finite;
        Ok(Self { kind: load.kind.clone(), bodies, patches: patches(mesh, &facets, place), follows })
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
                let density = |point: &[f64; D]| values(components, point, time, trouble);
                for patch in &self.patches {
                    let mut sink = ForceSink::<D> { map: &patch.map, force: &mut *force };
                    patch.surface.traction(density, &mut sink);
                }
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

    fn pressure(&self, patch: &Patch<D>, at: &Moment, trouble: &Trouble, sink: &mut dyn ElementSink) {
        let LoadKind::Pressure(pressure) = &self.kind else { return };
        let strength = |point: &[f64; D]| at.factor * trouble.value(pressure, point, at.time);
        patch.surface.pressure(Configuration::Current(at.u), strength, sink);
    }
}

fn values<const D: usize>(
    components: &[PlacedFunction; D],
    point: &[f64; D],
    time: f64,
    trouble: &Trouble,
) -> [f64; D] {
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
        let map = ScatterMap::new::<D>(wanted, nodes, place.pattern, &place.local.index, place.constrained);
        Patch { surface, map }
    };
    widths.iter().map(patch).collect()
}
