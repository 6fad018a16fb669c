//! The element kernels compared with energies, finite differences, exact solutions and each other,
//! for all elements.

mod axisymmetric;
mod consistency;
mod exactness;
mod lanes;
mod linearised_pressure;
mod loads;
mod mixed;
mod step;
mod viscous;

use element::{
    Cauchy, Configuration, DilatationSpace, ElementGroup, ElementSink, ElementStress, Formulation,
    Kinematics, LoadedSurface, Locking, PatchGroup, Request, ViscousHistory, components, reference_gradients,
};
use nalgebra::{DMatrix, DVector};
use serial::material::{Hooke, MATERIALS, Material, Moduli, Part, Potential};
use serial::mesh::{
    BoxShape, ElementKind, ElementPatch, Facet, Mesh, PlaneState, element_patches, patches_with,
};
use serial::taylor::{scatter, taylor_rate};
use serial::terms::Terms;
use std::collections::BTreeMap;

const MODULI: Moduli<f64> = Moduli { lambda: 1.7, mu: 0.6 };

/// A sink that assembles a dense matrix.
struct Dense<'a, const D: usize> {
    nodes: &'a dyn Fn(usize) -> Vec<u32>,
    force: DVector<f64>,
    stiffness: DMatrix<f64>,
}

impl<'a, const D: usize> Dense<'a, D> {
    fn new(mesh: &Mesh<D>, nodes: &'a dyn Fn(usize) -> Vec<u32>) -> Self {
        let size = mesh.points.len() * D;
        Self { nodes, force: DVector::zeros(size), stiffness: DMatrix::zeros(size, size) }
    }
}

impl<const D: usize> ElementSink for Dense<'_, D> {
    fn element(&mut self, index: usize, force: &[f64], stiffness: Option<&[f64]>) {
        let nodes = (self.nodes)(index);
        let n = nodes.len();
        assert_eq!(force.len(), n * D);
        let dof = |a: usize, i: usize| nodes[a] as usize * D + i;
        for (a, i) in (0..n * D).map(|k| (k / D, k % D)) {
            self.force[dof(a, i)] += force[a * D + i];
            for (b, j) in (0..n * D).map(|k| (k / D, k % D)) {
                if let Some(stiffness) = stiffness {
                    assert_eq!(stiffness.len(), n * n * D * D);
                    self.stiffness[(dof(a, i), dof(b, j))] += stiffness[((a * n + b) * D + i) * D + j];
                }
            }
        }
    }
}

/// A box of few elements with all nodes perturbed; quadratic elements become curved.
fn distorted<const D: usize>(kind: ElementKind) -> Mesh<D> {
    let cells = std::array::from_fn(|i| {
        if D == 2 || kind == ElementKind::Hex8 || i == 0 && kind.nodes() < 20 { 2 } else { 1 }
    });
    let mut mesh = BoxShape { min: [0.0; D], max: [1.0; D], cells, element: kind }.mesh().unwrap();
    let jitter = scatter(mesh.points.len() * D, 11);
    for (point, jitter) in mesh.points.iter_mut().zip(jitter.chunks(D)) {
        for (x, jitter) in point.iter_mut().zip(jitter) {
            *x += 0.03 * jitter;
        }
    }
    mesh
}

fn formulation(material: Material, kinematics: Kinematics, locking: Locking) -> Formulation {
    Formulation { material, kinematics, plane: PlaneState::Strain, locking, density: 3.0 }
}

/// Every law of the table with [`MODULI`].
fn laws() -> impl Iterator<Item = Material> {
    MATERIALS.iter().filter_map(|entry| Material::with_moduli(entry.name, MODULI))
}

fn neo_hookean() -> Material {
    Material::with_moduli("neo_hookean", MODULI).unwrap()
}

/// The elements of a mesh with their patches.
struct Solid<const D: usize> {
    group: ElementGroup<D>,
    patches: Vec<PatchGroup<D>>,
}

impl<const D: usize> std::ops::Deref for Solid<D> {
    type Target = ElementGroup<D>;
    fn deref(&self) -> &ElementGroup<D> {
        &self.group
    }
}

impl<const D: usize> Solid<D> {
    fn strain_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        let of_patches = self.patches.iter().map(|patches| patches.energy(u, &vec![true; patches.len()]));
        of_patches.fold(self.group.strain_energy(u, mine), |sum, energy| sum + energy)
    }

    fn stress(&self, u: &[f64], receive: impl FnMut(usize, &ElementStress)) {
        let mut pressures = vec![0.0; self.group.elements().len()];
        for patches in &self.patches {
            patches.pressures(u, |element, pressure| pressures[element as usize] = pressure);
        }
        self.group.full_stress(u, None, &pressures, receive);
    }

    /// Force and stiffness, with those over a step from `start`, if it is given.
    fn assemble(
        &self,
        mesh: &Mesh<D>,
        start: Option<&[f64]>,
        u: &[f64],
        terms: Terms,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let request = Request::of(terms);
        match start {
            None => self.requested(mesh, u, request),
            Some(start) => self.sum(
                mesh,
                |sink| self.group.evaluate_step(start, u, request, sink).unwrap(),
                |patches, sink| patches.evaluate_step(start, u, request, sink),
            ),
        }
    }

    /// Force and stiffness.
    fn requested(&self, mesh: &Mesh<D>, u: &[f64], request: Request) -> (DVector<f64>, DMatrix<f64>) {
        self.sum(
            mesh,
            |sink| self.group.evaluate(u, request, sink).unwrap(),
            |patches, sink| patches.evaluate(u, request, sink),
        )
    }

    /// Sum of what elements and patches pass to their sinks.
    fn sum(
        &self,
        mesh: &Mesh<D>,
        of_elements: impl FnOnce(&mut dyn ElementSink),
        of_patches: impl Fn(&PatchGroup<D>, &mut dyn ElementSink),
    ) -> (DVector<f64>, DMatrix<f64>) {
        let nodes = |index| mesh.element_nodes(self.group.elements()[index] as usize).to_vec();
        let mut sink = Dense::new(mesh, &nodes);
        of_elements(&mut sink);
        let mut sums = (sink.force, sink.stiffness);
        for patches in &self.patches {
            let nodes = |index| patches.nodes()[index * patches.width()..][..patches.width()].to_vec();
            let mut sink = Dense::new(mesh, &nodes);
            of_patches(patches, &mut sink);
            sums.0 += sink.force;
            sums.1 += sink.stiffness;
        }
        sums
    }
}

fn group<const D: usize>(mesh: &Mesh<D>, formulation: Formulation) -> Solid<D> {
    with_patches(mesh, formulation, element_patches)
}

/// All elements of a mesh, those that share a pressure in the patches of `divide`.
fn with_patches<const D: usize>(
    mesh: &Mesh<D>,
    formulation: Formulation,
    divide: impl Fn(&Mesh<D>, &[Option<(u16, u32)>]) -> Vec<ElementPatch>,
) -> Solid<D> {
    let group = ElementGroup::new(mesh, (0..mesh.element_count() as u32).collect(), formulation).unwrap();
    let mut mesh = mesh.clone();
    let label = |kind: &ElementKind| formulation.shares_pressure(*kind).then_some((0, 0));
    let labels: Vec<_> = mesh.kinds.iter().map(label).collect();
    mesh.patches = divide(&mesh, &labels);
    let mut by_width: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (number, patch) in (0..).zip(&mesh.patches) {
        by_width.entry(PatchGroup::<D>::nodes_of(patch).len()).or_default().push(number);
    }
    let patches = by_width.values().map(|numbers| PatchGroup::new(&mesh, numbers, formulation).unwrap());
    Solid { group, patches: patches.collect() }
}

fn variants(kind: ElementKind) -> Vec<Formulation> {
    let mut all = Vec::new();
    let cures = Locking::ALL.into_iter().map(|(locking, ..)| locking);
    // `auto` is equivalent to one of the others.
    for locking in cures.filter(|locking| *locking != Locking::Auto && locking.offered(kind)) {
        all.extend(laws().map(|law| formulation(law, Kinematics::Finite, locking)));
        all.push(formulation(neo_hookean(), Kinematics::Linear, locking));
    }
    if kind.dimension() == 2 {
        let strained = all.clone().into_iter().filter(|formulation| formulation.locking == Locking::None);
        all.extend(strained.map(|formulation| Formulation { plane: PlaneState::Stress, ..formulation }));
    }
    all
}

fn assemble<const D: usize>(
    mesh: &Mesh<D>,
    solid: &Solid<D>,
    u: &[f64],
    terms: Terms,
) -> (DVector<f64>, DMatrix<f64>) {
    solid.assemble(mesh, None, u, terms)
}

fn plain(v: DVector<f64>) -> Vec<f64> {
    v.data.into()
}

fn random<const D: usize>(mesh: &Mesh<D>, size: f64, seed: u32) -> Vec<f64> {
    scatter(mesh.points.len() * D, seed).into_iter().map(|x| size * x).collect()
}

fn every_kind(test_2d: impl Fn(ElementKind, Mesh<2>), test_3d: impl Fn(ElementKind, Mesh<3>)) {
    for kind in ElementKind::SOLIDS {
        match kind.dimension() {
            2 => test_2d(kind, distorted(kind)),
            _ => test_3d(kind, distorted(kind)),
        }
    }
}

macro_rules! for_every_kind {
    ($test:ident) => {
        every_kind(|kind, mesh| $test::<2>(kind, &mesh), |kind, mesh| $test::<3>(kind, &mesh))
    };
}
use for_every_kind;

/// Nodal displacements of `x -> a x`.
fn affine<const D: usize>(mesh: &Mesh<D>, a: &[[f64; D]; D]) -> Vec<f64> {
    let place = |p: &[f64; D]| -> [f64; D] { std::array::from_fn(|i| (0..D).map(|k| a[i][k] * p[k]).sum()) };
    mesh.points.iter().flat_map(place).collect()
}

fn surface<const D: usize>(mesh: &Mesh<D>, sets: &[&str]) -> LoadedSurface<D> {
    let facets: Vec<Facet> = sets.iter().flat_map(|set| mesh.facet_sets[*set].clone()).collect();
    LoadedSurface::new(mesh, &facets)
}
