//! Consistency of energy, force and tangent.

use super::*;

fn derivatives<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    require_derivatives(kind, mesh, variants(kind));
}

/// Fails unless energy, force and tangent of these formulations are derivatives of one another.
pub(super) fn require_derivatives<const D: usize>(
    kind: ElementKind,
    mesh: &Mesh<D>,
    formulations: Vec<Formulation>,
) {
    let (u, d) = (random(mesh, 0.02, 21), random(mesh, 0.02, 22));
    let everyone = vec![true; mesh.element_count()];
    for formulation in formulations {
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

/// Energy, internal force and tangent are derivatives of one another to second order, for every
/// element, law, kinematics and treatment of locking. Without `K_0 + K_NL` or without `K_S` the
/// order decreases.
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

/// The tangent is symmetric to rounding, and in the undeformed state it is that of linear
/// elasticity.
#[test]
fn tangent_is_symmetric_and_hookes_at_rest() {
    for_every_kind!(symmetry);
}
