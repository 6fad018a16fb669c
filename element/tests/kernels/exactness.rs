//! States with a known solution.

use super::*;
use serial::material::{Law, LawTask, PlaneStress, PointEnergy};

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
        if formulation.plane == PlaneState::Stress {
            assert!(state.cauchy.0[2] == 0.0, "{kind} {formulation:?}");
        } else if formulation.kinematics == Kinematics::Finite {
            let f =
                nalgebra::SMatrix::<f64, D, D>::from_fn(|i, j| grad_u[i][j] + f64::from(u8::from(i == j)));
            let det = nalgebra::DMatrix::from_fn(D, D, |i, j| f[(i, j)]).determinant();
            assert!((state.det_f - det).abs() < 1e-13);
        }
        // The resultant of the internal force on the part of the body beyond a node vanishes in the
        // interior: only boundary nodes carry force.
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
        let density = match formulation.kinematics {
            Kinematics::Linear => Hooke::energy(&formulation.own_moduli(), &grad_u),
            Kinematics::Finite if formulation.plane == PlaneState::Stress => {
                PlaneStress::new(&formulation.material).energy(&grad_u)
            }
            Kinematics::Finite => formulation.material.accept(EnergyAt(grad_u)),
        };
        assert!((group.strain_energy(&u, &everyone) - density * volume).abs() < 1e-13, "{kind}");
    }
}

/// Energy per volume at a displacement gradient.
struct EnergyAt<const D: usize>([[f64; D]; D]);

impl<const D: usize> LawTask for EnergyAt<D> {
    type Output = f64;
    fn run<P: Law>(self, law: &P) -> f64 {
        P::energy(&law.constants(Part::Whole), &self.0)
    }
}

/// The mesh with the same corners and straight sides.
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

/// A linear displacement of a distorted patch gives a constant stress, the energy of the law, and
/// equilibrium in the interior.
#[test]
fn linear_displacement_gives_constant_stress() {
    for_every_kind!(patch);
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

/// Forces for strains near 1e-12 keep full precision.
#[test]
fn tiny_strains_keep_their_digits() {
    for_every_kind!(tiny_strains);
}

/// Selective reduced integration prevents locking of quad4 and hex8 in nearly incompressible
/// bending. Full integration locks.
#[test]
fn reduced_volume_terms_cure_locking() {
    let tip = |locking| {
        let shape =
            BoxShape { min: [0.0, 0.0], max: [10.0, 1.0], cells: [20, 4], element: ElementKind::Quad4 };
        let mesh = shape.mesh().unwrap();
        let material = Material::named("neo_hookean", 1000.0, 0.4999).unwrap();
        let group = group(&mesh, formulation(material, Kinematics::Linear, locking));
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

/// The von Mises stress of uniaxial tension equals the tension; that of pressure is zero.
#[test]
fn von_mises_measures_shear() {
    assert!((Cauchy([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]).von_mises() - 3.0).abs() < 1e-15);
    assert!(Cauchy([3.0, 3.0, 3.0, 0.0, 0.0, 0.0]).von_mises() < 1e-15);
    assert!((Cauchy([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]).von_mises() - 3.0_f64.sqrt()).abs() < 1e-15);
}

/// In plane strain the out-of-plane stress is `lambda tr(eps)` for small strain.
#[test]
fn plane_strain_holds_the_body_flat() {
    let mesh = distorted::<2>(ElementKind::Quad4);
    let u = affine(&mesh, &[[2e-9, 0.0], [0.0, 1e-9]]);
    for formulation in variants(ElementKind::Quad4).into_iter().filter(|f| f.plane == PlaneState::Strain) {
        group(&mesh, formulation).stress(&u, |_, stress| {
            assert!(
                (stress.mean.cauchy.0[2] / (MODULI.lambda * 3e-9) - 1.0).abs() < 1e-6,
                "{formulation:?} {stress:?}"
            );
        });
    }
}

/// Under plane stress uniaxial tension has the stress `E` times the strain, and thins the body by Poisson's ratio.
#[test]
fn plane_stress_leaves_the_thickness_free() {
    let mesh = distorted::<2>(ElementKind::Quad4);
    let ratio = MODULI.poisson_ratio();
    let u = affine(&mesh, &[[1e-9, 0.0], [0.0, -ratio * 1e-9]]);
    for formulation in variants(ElementKind::Quad4).into_iter().filter(|f| f.plane == PlaneState::Stress) {
        group(&mesh, formulation).stress(&u, |_, stress| {
            let [xx, yy, zz, ..] = stress.mean.cauchy.0;
            assert!((xx / (MODULI.young_modulus() * 1e-9) - 1.0).abs() < 1e-6, "{formulation:?} {stress:?}");
            assert!(yy.abs() < 1e-6 * xx && zz == 0.0, "{formulation:?} {stress:?}");
            let thinning = stress.right_cauchy_green[2] - 1.0;
            assert!((thinning / (-2.0 * ratio * 1e-9) - 1.0).abs() < 1e-6, "{formulation:?} {stress:?}");
            let growth = stress.mean.det_f - 1.0;
            assert!((growth / (1e-9 * (1.0 - 2.0 * ratio)) - 1.0).abs() < 1e-6, "{formulation:?} {stress:?}");
        });
    }
}

/// The default treats locking only at a high Poisson's ratio and on elements that support the
/// treatment.
#[test]
fn the_default_cure_follows_poissons_ratio_and_element() {
    for (ratio, cures) in [(0.3, false), (0.449, false), (0.45, true), (0.499, true)] {
        let material = Material::named("neo_hookean", 5e6, ratio).unwrap();
        for kind in ElementKind::SOLIDS {
            let simplex =
                matches!(kind.corners(), 3) || matches!((kind.dimension(), kind.corners()), (3, 4..=6));
            let chosen = Locking::default().on(kind, &material.moduli());
            let expected = match (cures, simplex) {
                (true, false) => Locking::SelectiveReduced,
                (true, true) if kind.order() == 1 => Locking::MeanDilatation,
                _ => Locking::None,
            };
            assert_eq!(chosen, expected, "{kind} at {ratio}");
            assert_eq!(Locking::None.on(kind, &material.moduli()), Locking::None);
        }
    }
}
