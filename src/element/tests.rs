//! The element kernels against energies, differences, exact solutions and each other, for all elements.

use super::solid::{Job, Solid};
use super::*;
use crate::lanes::dispatch_portable;
use crate::material::{Hooke, MATERIALS, Material, Model, Moduli, NeoHookean, SaintVenantKirchhoff};
use crate::mesh::{BoxShape, ElementKind, Facet, Mesh};
use crate::taylor::{scatter, taylor_rate};
use nalgebra::{DMatrix, DVector};

const MODULI: Moduli<f64> = Moduli { lambda: 1.7, mu: 0.6 };

/// A sink that assembles dense.
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

/// A box of few elements with all nodes pushed about; quadratic elements end up curved.
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

fn formulation(model: Model, kinematics: Kinematics, locking: Locking) -> Formulation {
    Formulation { material: Material { model, moduli: MODULI }, kinematics, locking, density: 3.0 }
}

fn group<const D: usize>(mesh: &Mesh<D>, formulation: Formulation) -> ElementGroup<D> {
    ElementGroup::new(mesh, (0..mesh.element_count() as u32).collect(), formulation).unwrap()
}

fn variants(kind: ElementKind) -> Vec<Formulation> {
    let mut all = Vec::new();
    for (locking, ..) in Locking::ALL.into_iter().filter(|(locking, ..)| locking.offered(kind)) {
        all.extend(MATERIALS.iter().map(|entry| formulation(entry.model, Kinematics::Finite, locking)));
        all.push(formulation(Model::NeoHookean, Kinematics::Linear, locking));
    }
    all
}

fn assemble<const D: usize>(
    mesh: &Mesh<D>,
    group: &ElementGroup<D>,
    u: &[f64],
    terms: Terms,
) -> (DVector<f64>, DMatrix<f64>) {
    let nodes = |index| mesh.element_nodes(group.elements()[index] as usize).to_vec();
    let mut sink = Dense::new(mesh, &nodes);
    group.evaluate(u, Request { stiffness: Some(terms) }, &mut sink).unwrap();
    (sink.force, sink.stiffness)
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

fn derivatives<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let (u, d) = (random(mesh, 0.02, 21), random(mesh, 0.02, 22));
    let everyone = vec![true; mesh.element_count()];
    for formulation in variants(kind) {
        let what = format!("{kind} {formulation:?}");
        let group = group(mesh, formulation);
        let energy = |u: &[f64]| vec![group.strain_energy(u, &everyone)];
        let force = |u: &[f64]| plain(assemble(mesh, &group, u, Terms::empty()).0);
        let work = |u: &[f64], d: &[f64]| vec![force(u).iter().zip(d).map(|(f, d)| f * d).sum()];
        assert!(
            taylor_rate(energy, work, &u, &d) > 1.9,
            "{what}: the force is not the derivative of the energy"
        );
        let rate = |terms| {
            let change = |u: &[f64], d: &[f64]| {
                plain(assemble(mesh, &group, u, terms).1 * DVector::from_column_slice(d))
            };
            taylor_rate(force, change, &u, &d)
        };
        assert!(
            rate(Terms::ALL) > 1.9,
            "{what}: the tangent is not the derivative of the force: {}",
            rate(Terms::ALL)
        );
        assert!(rate(Terms::GEOMETRIC) < 1.3, "{what}: the material stiffness is not missed");
        if formulation.kinematics == Kinematics::Finite {
            assert!(rate(Terms::MATERIAL) < 1.3, "{what}: the geometric stiffness is not missed");
        }
    }
}

/// Energy, internal force and tangent are derivatives of one another for every element, law, kinematics and cure for locking, to
/// second order; without `K_0 + K_NL` or without `K_S` the order falls.
#[test]
fn force_and_tangent_have_order_two() {
    for_every_kind!(derivatives);
}

fn symmetry<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let u = random(mesh, 0.02, 23);
    for formulation in variants(kind) {
        let (_, k) = assemble(mesh, &group(mesh, formulation), &u, Terms::ALL);
        assert!((&k - k.transpose()).amax() < 1e-14 * k.amax(), "{kind} {formulation:?}");
        let linear = formulation.kinematics == Kinematics::Linear;
        let (_, still) = assemble(mesh, &group(mesh, formulation), &vec![0.0; u.len()], Terms::ALL);
        let hooke = Formulation { kinematics: Kinematics::Linear, ..formulation };
        let (_, small) = assemble(mesh, &group(mesh, hooke), &u, Terms::ALL);
        assert!(
            (&still - &small).amax() < 1e-13 * small.amax(),
            "{kind} {formulation:?}: not Hooke's at rest"
        );
        assert!(
            linear || (&k - &small).amax() > 1e-3 * small.amax(),
            "{kind}: the tangent does not depend on u"
        );
    }
}

/// The tangent is symmetric to rounding, and at rest it is that of linear elasticity.
#[test]
fn tangent_is_symmetric_and_hookes_at_rest() {
    for_every_kind!(symmetry);
}

/// Nodal displacements of `x -> a x`.
fn affine<const D: usize>(mesh: &Mesh<D>, a: &[[f64; D]; D]) -> Vec<f64> {
    let place = |p: &[f64; D]| -> [f64; D] { std::array::from_fn(|i| (0..D).map(|k| a[i][k] * p[k]).sum()) };
    mesh.points.iter().flat_map(place).collect()
}

fn rotation<const D: usize>(mesh: &Mesh<D>) -> Vec<f64> {
    let mut turn = [[0.0; D]; D];
    let (sine, cosine) = 1.1_f64.sin_cos();
    (turn[0][0], turn[0][1], turn[1][0], turn[1][1]) = (cosine - 1.0, -sine, sine, cosine - 1.0);
    affine(mesh, &turn)
}

fn rigid<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let turned = rotation(mesh);
    for formulation in variants(kind).into_iter().filter(|f| f.kinematics == Kinematics::Finite) {
        let group = group(mesh, formulation);
        let (force, _) = assemble(mesh, &group, &turned, Terms::ALL);
        assert!(force.amax() < 1e-14, "{kind} {formulation:?}: {}", force.amax());
        group.stress(&turned, |_, stress| assert!(stress.mean.cauchy.von_mises() < 1e-14, "{kind}"));
    }
}

/// A rigid rotation by more than a radian gives no force and no stress.
#[test]
fn rotation_gives_no_stress() {
    for_every_kind!(rigid);
}

fn patch<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let mesh = &match kind {
        // On curved sides neither four points nor the reduced rule integrate the cofactors exactly.
        ElementKind::Tet10 | ElementKind::Hex20 | ElementKind::Hex27 => straightened(mesh.clone()),
        _ => mesh.clone(),
    };
    let numbers = scatter(D * D, 5);
    let grad_u: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|j| 0.2 * numbers[i * D + j]));
    let u = affine(mesh, &grad_u);
    for formulation in variants(kind) {
        let group = group(mesh, formulation);
        let mut first = None;
        let mut volume = 0.0;
        group.stress(&u, |_, stress| {
            let expected = *first.get_or_insert(stress.mean);
            for state in stress.points.iter().chain(&stress.nodes).chain([&stress.mean]) {
                for (a, b) in state.cauchy.0.iter().zip(expected.cauchy.0) {
                    assert!((a - b).abs() < 1e-13, "{kind} {formulation:?}: {state:?} {expected:?}");
                }
                assert!((state.det_f - expected.det_f).abs() < 1e-13);
            }
            volume += stress.volume;
        });
        let state = first.unwrap();
        if formulation.kinematics == Kinematics::Finite {
            let f =
                nalgebra::SMatrix::<f64, D, D>::from_fn(|i, j| grad_u[i][j] + f64::from(u8::from(i == j)));
            let det = nalgebra::DMatrix::from_fn(D, D, |i, j| f[(i, j)]).determinant();
            assert!((state.det_f - det).abs() < 1e-13);
        }
        // The resultant of the internal force on the half of the body beyond a node vanishes inside: only boundary
        // nodes carry force.
        let (force, _) = assemble(mesh, &group, &u, Terms::empty());
        let inner = interior(mesh);
        for node in inner {
            for i in 0..D {
                assert!(
                    force[node * D + i].abs() < 1e-13,
                    "{kind} {formulation:?}: inner node {node} is not in balance"
                );
            }
        }
        let everyone = vec![true; mesh.element_count()];
        let density = match (formulation.kinematics, formulation.material.model) {
            (Kinematics::Linear, _) => <Hooke as crate::material::Law>::energy(&MODULI, &grad_u),
            (_, Model::NeoHookean) => <NeoHookean as crate::material::Law>::energy(&MODULI, &grad_u),
            (_, Model::SaintVenantKirchhoff) => {
                <SaintVenantKirchhoff as crate::material::Law>::energy(&MODULI, &grad_u)
            }
        };
        assert!((group.strain_energy(&u, &everyone) - density * volume).abs() < 1e-13, "{kind}");
    }
}

/// The same corners with straight sides.
fn straightened<const D: usize>(mut mesh: Mesh<D>) -> Mesh<D> {
    for element in 0..mesh.element_count() {
        let nodes = mesh.element_nodes(element).to_vec();
        for (&node, parents) in nodes.iter().zip(mesh.kinds[element].parents()) {
            let of =
                |i: usize| parents.iter().map(|&a| mesh.points[nodes[a as usize] as usize][i]).sum::<f64>();
            let place = std::array::from_fn(|i| of(i) / parents.len() as f64);
            mesh.points[node as usize] = place;
        }
    }
    mesh
}

/// Nodes on no side of the box.
fn interior<const D: usize>(mesh: &Mesh<D>) -> Vec<usize> {
    let mut on_side = vec![false; mesh.points.len()];
    let mut nodes = Vec::new();
    for facet in mesh.facet_sets.values().flatten() {
        mesh.facet_nodes(*facet, &mut nodes);
        nodes.iter().for_each(|&node| on_side[node as usize] = true);
    }
    (0..on_side.len()).filter(|&node| !on_side[node]).collect()
}

/// A linear displacement of a distorted patch gives one stress everywhere, the law's energy, and balance inside.
#[test]
fn linear_displacement_gives_constant_stress() {
    for_every_kind!(patch);
}

fn lanes<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let u = random(mesh, 0.02, 24);
    for formulation in variants(kind) {
        let whole = group(mesh, formulation);
        let together = collect(&whole, &u);
        for index in 0..mesh.element_count() {
            let alone = ElementGroup::new(mesh, vec![index as u32], formulation).unwrap();
            assert!(collect(&alone, &u)[0] == together[index], "{kind}: lanes see each other");
        }
        for (plain, fast) in collect_portable(&whole, &u).iter().zip(&together) {
            let largest = fast.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let apart = plain.iter().zip(fast).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(apart < 1e-14 * largest, "{kind} {formulation:?}: {apart}");
        }
    }
}

#[derive(Default)]
struct Rows(Vec<Vec<f64>>);

impl ElementSink for Rows {
    fn element(&mut self, index: usize, force: &[f64], stiffness: Option<&[f64]>) {
        assert_eq!(index, self.0.len());
        self.0.push([force, stiffness.unwrap_or_default()].concat());
    }
}

fn collect<const D: usize>(group: &ElementGroup<D>, u: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = Rows::default();
    group.evaluate(u, Request::TANGENT, &mut rows).unwrap();
    rows.0
}

fn collect_portable<const D: usize>(group: &ElementGroup<D>, u: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = Rows::default();
    let job = Job { group, u, request: Request::TANGENT, sink: &mut rows };
    let formulation = group.formulation();
    match (formulation.kinematics, formulation.material.model) {
        (Kinematics::Linear, _) => dispatch_portable(Solid::<Hooke, D>::new(job)),
        (_, Model::NeoHookean) => dispatch_portable(Solid::<NeoHookean, D>::new(job)),
        (_, Model::SaintVenantKirchhoff) => dispatch_portable(Solid::<SaintVenantKirchhoff, D>::new(job)),
    }
    .unwrap();
    rows.0
}

/// An element's numbers are the same bits alone and in any company, and the plain lanes agree with the fast ones.
#[test]
fn lanes_do_not_change_the_answer() {
    for_every_kind!(lanes);
}

fn masses<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let group = group(mesh, formulation(Model::NeoHookean, Kinematics::Finite, Locking::None));
    let mut volumes = Vec::new();
    let still = vec![0.0; mesh.points.len() * D];
    group.stress(&still, |_, stress| volumes.push(stress.volume));
    let n = kind.nodes();
    // Volumes by the full rule and mass by its own differ on curved sides, but only a little.
    let tolerance = if kind.order() == 1 { 1e-13 } else { 1e-2 };
    group.mass(|index, mass| {
        let total: f64 = mass.iter().sum();
        assert!((total / (3.0 * volumes[index]) - 1.0).abs() < tolerance, "{kind}: {total}");
        let matrix = DMatrix::from_row_slice(n, n, mass);
        assert!(matrix.clone().cholesky().is_some(), "{kind}: the mass is not positive");
        assert!((&matrix - matrix.transpose()).amax() == 0.0);
    });
    let mut totals = Vec::new();
    group.mass(|_, mass| totals.push(mass.iter().sum::<f64>()));
    group.lumped_mass(|index, mass| {
        assert!(mass.iter().all(|&m| m > 0.0), "{kind}: {mass:?}");
        assert!((mass.iter().sum::<f64>() - totals[index]).abs() < 1e-14);
    });
    // A constant body force is the mass times it.
    let nodes = |index| mesh.element_nodes(index).to_vec();
    let mut sink = Dense::new(mesh, &nodes);
    group.body_force(|_| std::array::from_fn(|i| 1.0 + i as f64), &mut sink);
    for i in 0..D {
        let sum: f64 = (0..mesh.points.len()).map(|node| sink.force[node * D + i]).sum();
        assert!((sum - (1.0 + i as f64) * totals.iter().sum::<f64>()).abs() < 1e-13, "{kind}: {sum}");
    }
}

/// Consistent and lumped mass are positive and sum to density times volume; weight is mass times gravity.
#[test]
fn mass_sums_to_density_times_volume() {
    for_every_kind!(masses);
}

fn surface<const D: usize>(mesh: &Mesh<D>, sets: &[&str]) -> LoadedSurface<D> {
    let facets: Vec<Facet> = sets.iter().flat_map(|set| mesh.facet_sets[*set].clone()).collect();
    LoadedSurface::new(mesh, &facets)
}

fn pressures<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let top = surface(mesh, &["top"]);
    let nodes = |index| top.nodes(index).to_vec();
    let evaluate = |u: &[f64]| {
        let mut sink = Dense::new(mesh, &nodes);
        top.pressure(Configuration::Current(u), |p| 1.0 + p[0], &mut sink);
        (sink.force, sink.stiffness)
    };
    let (u, d) = (random(mesh, 0.05, 31), random(mesh, 0.05, 32));
    let force = |u: &[f64]| plain(evaluate(u).0);
    // The stiffness is minus the derivative of the external force.
    let change = |u: &[f64], d: &[f64]| plain(-evaluate(u).1 * DVector::from_column_slice(d));
    let rate = taylor_rate(force, change, &u, &d);
    assert!(rate > 1.9, "{kind}: {rate}");
    if D == 3 {
        assert!(rate < 2.1, "{kind}: in space a pressure load is not affine");
    }
    let everything: Vec<_> = mesh.facet_sets.keys().map(String::as_str).collect();
    let closed = surface(mesh, &everything);
    let nodes = |index| closed.nodes(index).to_vec();
    let mut sink = Dense::new(mesh, &nodes);
    closed.pressure(Configuration::Current(&u), |_| 2.0, &mut sink);
    for i in 0..D {
        let sum: f64 = (0..mesh.points.len()).map(|node| sink.force[node * D + i]).sum();
        assert!(sum.abs() < 1e-13, "{kind}: a pressure all around pushes the body: {sum}");
    }
    // Virtual work on a uniform growth: minus pressure times the change of volume, D times the volume.
    let mut sink = Dense::new(mesh, &nodes);
    closed.pressure(Configuration::Reference, |_| 2.0, &mut sink);
    let work: f64 = mesh.points.iter().flatten().zip(sink.force.iter()).map(|(x, f)| x * f).sum();
    let group = group(mesh, formulation(Model::NeoHookean, Kinematics::Finite, Locking::None));
    let mut volume = 0.0;
    group.mass(|_, mass| volume += mass.iter().sum::<f64>() / 3.0);
    let tolerance = if kind.order() == 1 { 1e-13 } else { 1e-2 };
    assert!((work / (-2.0 * D as f64 * volume) - 1.0).abs() < tolerance, "{kind}: {work} {volume}");
}

/// Pressure has an exact tangent, pushes inward, and cancels over a closed surface.
#[test]
fn pressure_follows_the_surface() {
    for_every_kind!(pressures);
}

fn tractions<const D: usize>(kind: ElementKind, _: &Mesh<D>) {
    let mesh = BoxShape { min: [0.0; D], max: [2.0; D], cells: [2; D], element: kind }.mesh().unwrap();
    let right = surface(&mesh, &["right"]);
    let nodes = |index| right.nodes(index).to_vec();
    let mut sink = Dense::new(&mesh, &nodes);
    right.traction(|p| std::array::from_fn(|i| if i == 0 { 3.0 } else { p[1] }), &mut sink);
    let sum = |i: usize| (0..mesh.points.len()).map(|node| sink.force[node * D + i]).sum::<f64>();
    let area = 2.0_f64.powi(D as i32 - 1);
    assert!((sum(0) - 3.0 * area).abs() < 1e-13, "{kind}: {}", sum(0));
    assert!((sum(1) - area).abs() < 1e-13, "{kind}: {}", sum(1));
    assert!(!right.is_empty() && right.len() == mesh.facet_sets["right"].len());
}

/// A traction acts on the reference area and may vary over it.
#[test]
fn traction_sums_to_the_force() {
    for_every_kind!(tractions);
}

fn tiny_strains<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let u = random(mesh, 1e-12, 41);
    for formulation in variants(kind) {
        let (force, _) = assemble(mesh, &group(mesh, formulation), &u, Terms::empty());
        let hooke = Formulation { kinematics: Kinematics::Linear, ..formulation };
        let (exact, _) = assemble(mesh, &group(mesh, hooke), &u, Terms::empty());
        assert!((&force - &exact).amax() < 1e-9 * exact.amax(), "{kind} {formulation:?}");
    }
}

/// Forces of strains near 1e-12 keep their digits.
#[test]
fn tiny_strains_keep_their_digits() {
    for_every_kind!(tiny_strains);
}

fn inversions<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    // Two reversed elements: the lower one must be named, whatever the lanes.
    let count = mesh.element_count();
    let victims = [count - 1, count / 2];
    let mut u = vec![0.0; mesh.points.len() * D];
    for victim in victims {
        for &node in mesh.element_nodes(victim) {
            u[node as usize * D] = -3.0 * mesh.points[node as usize][0];
        }
    }
    for formulation in variants(kind) {
        let result = group(mesh, formulation).evaluate(&u, Request::FORCE, &mut Rows::default());
        if formulation.kinematics == Kinematics::Linear {
            assert!(result.is_ok(), "{kind}: linear kinematics can not invert");
            let mut broken = u.clone();
            let node = mesh.element_nodes(count - 1)[0] as usize;
            broken[node * D + 1] = f64::NAN;
            let found = group(mesh, formulation).evaluate(&broken, Request::FORCE, &mut Rows::default());
            assert!(found.unwrap_err().det.is_nan());
            continue;
        }
        let found = result.unwrap_err();
        assert!(!(found.det > 0.0), "{kind}: {found:?}");
        let first = (0..count as u32)
            .find(|&e| {
                let alone = ElementGroup::new(mesh, vec![e], formulation).unwrap();
                alone.evaluate(&u, Request::TANGENT, &mut Rows::default()).is_err()
            })
            .unwrap();
        assert_eq!(found.element, first, "{kind}");
        assert!(found.point.iter().all(|x| x.abs() <= 1.0));
    }
}

/// An element turned inside out is reported, the first of the group, with the place; so is a NaN.
#[test]
fn inverted_elements_are_reported() {
    for_every_kind!(inversions);
}

/// Selective reduced integration frees quad4 and hex8 from locking in nearly incompressible bending, and full
/// integration does lock.
#[test]
fn reduced_volume_terms_cure_locking() {
    let tip = |locking| {
        let shape =
            BoxShape { min: [0.0, 0.0], max: [10.0, 1.0], cells: [20, 4], element: ElementKind::Quad4 };
        let mesh = shape.mesh().unwrap();
        let material = Material::named("neo_hookean", 1000.0, 0.4999).unwrap();
        let group =
            group(&mesh, Formulation { material, kinematics: Kinematics::Linear, locking, density: 1.0 });
        let (_, mut k) = assemble(&mesh, &group, &vec![0.0; mesh.points.len() * 2], Terms::ALL);
        let right = surface(&mesh, &["right"]);
        let nodes = |index| right.nodes(index).to_vec();
        let mut load = Dense::new(&mesh, &nodes);
        right.traction(|_| [0.0, 1.0], &mut load);
        let left = surface(&mesh, &["left"]);
        for node in (0..left.len()).flat_map(|facet| left.nodes(facet)) {
            for dof in [2 * *node as usize, 2 * *node as usize + 1] {
                k.row_mut(dof).fill(0.0);
                k[(dof, dof)] = 1.0;
            }
        }
        let u = k.lu().solve(&load.force).unwrap();
        u[2 * right.nodes(0)[0] as usize + 1]
    };
    // Euler-Bernoulli with the plane strain modulus, and Timoshenko's shear.
    let (young, mu) = (1000.0 / (1.0 - 0.4999 * 0.4999), 1000.0 / (2.0 * 1.4999));
    let beam = 1000.0 / (3.0 * young / 12.0) + 10.0 / (5.0 / 6.0 * mu);
    let (free, locked) = (tip(Locking::SelectiveReduced), tip(Locking::None));
    assert!((free / beam - 1.0).abs() < 0.1, "{free} {beam}");
    assert!(locked < 0.7 * beam, "{locked} {beam}");
}

/// Von Mises stress of uniaxial tension is the tension, of pressure nothing.
#[test]
fn von_mises_measures_shear() {
    assert!((Cauchy([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]).von_mises() - 3.0).abs() < 1e-15);
    assert!(Cauchy([3.0, 3.0, 3.0, 0.0, 0.0, 0.0]).von_mises() < 1e-15);
    assert!((Cauchy([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]).von_mises() - 3.0_f64.sqrt()).abs() < 1e-15);
}

/// In plane strain the stress that holds the body flat is `lambda tr(eps)` for small strain.
#[test]
fn plane_strain_holds_the_body_flat() {
    let mesh = distorted::<2>(ElementKind::Quad4);
    let u = affine(&mesh, &[[2e-9, 0.0], [0.0, 1e-9]]);
    for formulation in variants(ElementKind::Quad4) {
        group(&mesh, formulation).stress(&u, |_, stress| {
            assert!(
                (stress.mean.cauchy.0[2] / (MODULI.lambda * 3e-9) - 1.0).abs() < 1e-6,
                "{formulation:?} {stress:?}"
            );
        });
    }
}

/// Groups that make no sense are refused with a sentence.
#[test]
fn wrong_groups_are_refused() {
    let neo = |locking| formulation(Model::NeoHookean, Kinematics::Finite, locking);
    let mut mesh = distorted::<2>(ElementKind::Tri3);
    let locked = ElementGroup::new(&mesh, vec![0], neo(Locking::SelectiveReduced)).unwrap_err();
    assert!(locked.message.contains("does not exist for tri3"), "{locked}");
    let weightless = Formulation { density: -1.0, ..neo(Locking::None) };
    assert!(ElementGroup::new(&mesh, vec![0], weightless).is_err());
    assert!(ElementGroup::new(&mesh, vec![], neo(Locking::None)).is_err());
    mesh.nodes.swap(0, 1);
    let flipped = ElementGroup::new(&mesh, vec![0], neo(Locking::None)).unwrap_err();
    assert!(flipped.message.contains("element 0") && flipped.message.contains("inverted"), "{flipped}");
}
