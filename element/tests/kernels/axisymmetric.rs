//! Bodies of revolution.

use std::f64::consts::TAU;

use super::consistency::require_derivatives;
use super::*;

/// A distorted patch in the meridian plane, away from the axis.
pub(super) fn ring(kind: ElementKind) -> Mesh<2> {
    let mut mesh = distorted::<2>(kind);
    mesh.points.iter_mut().for_each(|point| point[0] += 0.4);
    mesh.plane = PlaneState::Axisymmetric;
    mesh
}

/// A box from the axis to the radius 2, of height 3.
fn solid(kind: ElementKind) -> Mesh<2> {
    let mut mesh =
        BoxShape { min: [0.0, 0.0], max: [2.0, 3.0], cells: [3, 2], element: kind }.mesh().unwrap();
    mesh.plane = PlaneState::Axisymmetric;
    mesh
}

fn kinds() -> impl Iterator<Item = ElementKind> {
    ElementKind::SOLIDS.into_iter().filter(|kind| kind.dimension() == 2)
}

/// All formulations of bodies of revolution.
fn revolved(kind: ElementKind) -> Vec<Formulation> {
    let strained = variants(kind).into_iter().filter(|formulation| formulation.plane == PlaneState::Strain);
    strained.map(|formulation| Formulation { plane: PlaneState::Axisymmetric, ..formulation }).collect()
}

/// Energy, internal force and tangent are derivatives of one another to second order, for every
/// element, law, kinematics and treatment of locking.
#[test]
fn force_and_tangent_have_order_two() {
    for kind in kinds() {
        require_derivatives(kind, &ring(kind), revolved(kind));
    }
}

/// The displacement `(a R, b Z)` stretches the radius and the circumference alike. Stress and energy
/// are constant, and the internal forces are those of the tractions on the surface.
#[test]
fn uniform_stretches_give_a_constant_stress() {
    let (a, b) = (0.1, -0.2);
    for kind in kinds() {
        let mesh = solid(kind);
        let u = affine(&mesh, &[[a, 0.0], [0.0, b]]);
        for formulation in revolved(kind) {
            let what = format!("{kind} {formulation:?}");
            let group = group(&mesh, formulation);
            let mut cauchy = None;
            group.stress(&u, |_, stress| {
                let expected = *cauchy.get_or_insert(stress.mean.cauchy);
                for state in stress.points.iter().chain(&stress.nodes) {
                    for (found, expected) in state.cauchy.0.iter().zip(expected.0) {
                        assert!((found - expected).abs() < 1e-12, "{what}: {state:?} {expected:?}");
                    }
                }
                let [xx, _, zz, xy, ..] = expected.0;
                assert!((xx - zz).abs() < 1e-12 && xy.abs() < 1e-12, "{what}: {expected:?}");
                let stretch = stress.right_cauchy_green;
                assert!((stretch[0] - (1.0 + a).powi(2)).abs() < 1e-12, "{what}: {stretch:?}");
                assert!((stretch[2] - (1.0 + a).powi(2)).abs() < 1e-12, "{what}: {stretch:?}");
            });
            let [radial, axial, ..] = cauchy.unwrap().0;
            // First Piola stresses: forces per area before the deformation.
            let [radial, axial] = match formulation.kinematics {
                Kinematics::Linear => [radial, axial],
                Kinematics::Finite => [radial * (1.0 + a) * (1.0 + b), axial * (1.0 + a).powi(2)],
            };
            let (mut rest, _) = assemble(&mesh, &group, &u, Terms::empty());
            for (set, traction) in
                [("right", [radial, 0.0]), ("top", [0.0, axial]), ("bottom", [0.0, -axial])]
            {
                let loaded = surface(&mesh, &[set]);
                let nodes = |index| loaded.nodes(index).to_vec();
                let mut sink = Dense::new(&mesh, &nodes);
                loaded.traction(|_| traction, &mut sink);
                rest -= sink.force;
            }
            // The radial force at the axis is a reaction of the support there, which is zero as well.
            assert!(rest.amax() < 1e-12, "{what}: {}", rest.amax());
        }
    }
}

/// Energies agree with those of the law in space. Volume and mass are those of Pappus and Guldin.
#[test]
fn energy_and_mass_are_those_of_the_revolution() {
    for kind in kinds() {
        let mesh = solid(kind);
        let volume = TAU / 2.0 * 4.0 * 3.0;
        let u = affine(&mesh, &[[0.02, 0.0], [0.0, 0.03]]);
        let linear = Formulation {
            plane: PlaneState::Axisymmetric,
            ..formulation(neo_hookean(), Kinematics::Linear, Locking::None)
        };
        let group = group(&mesh, linear);
        let gradient = [[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.02]];
        let expected = Hooke::energy(&MODULI, &gradient) * volume;
        let energy = group.strain_energy(&u, &vec![true; mesh.element_count()]);
        assert!((energy / expected - 1.0).abs() < 1e-12, "{kind}: {energy} {expected}");
        let mut mass = 0.0;
        group.mass(|_, entries| mass += entries.iter().sum::<f64>());
        assert!((mass / (3.0 * volume) - 1.0).abs() < 1e-12, "{kind}: {mass}");
        let nodes = |index| mesh.element_nodes(index).to_vec();
        let mut sink = Dense::new(&mesh, &nodes);
        group.body_force(|_| [0.0, -9.81], &mut sink);
        let weight: f64 = sink.force.iter().skip(1).step_by(2).sum();
        assert!((weight / (-9.81 * mass) - 1.0).abs() < 1e-12, "{kind}: {weight}");
        let side = surface(&mesh, &["right"]);
        let area: f64 = (0..side.len()).map(|index| side.area(index)).sum();
        assert!((area / (TAU * 2.0 * 3.0) - 1.0).abs() < 1e-12, "{kind}: {area}");
    }
}

/// The tangent of a pressure includes the growth of the circles on which it acts. All around, it has
/// no axial resultant, and its work in a uniform expansion is that of the volume.
#[test]
fn pressure_acts_on_circles() {
    for kind in kinds() {
        let mesh = ring(kind);
        let outer = surface(&mesh, &["right", "top"]);
        let nodes = |index| outer.nodes(index).to_vec();
        let evaluate = |u: &[f64]| {
            let mut sink = Dense::new(&mesh, &nodes);
            outer.pressure(Configuration::Current(u), |p| 1.0 + p[0], &mut sink);
            (sink.force, sink.stiffness)
        };
        let (u, d) = (random(&mesh, 0.05, 31), random(&mesh, 0.05, 32));
        let force = |u: &[f64]| plain(evaluate(u).0);
        let change = |u: &[f64], d: &[f64]| plain(-evaluate(u).1 * DVector::from_column_slice(d));
        let rate = taylor_rate(force, change, &u, &d);
        assert!(rate > 1.9, "{kind}: {rate}");

        let mesh = solid(kind);
        let closed = surface(&mesh, &["right", "top", "bottom"]);
        let nodes = |index| closed.nodes(index).to_vec();
        let mut sink = Dense::new(&mesh, &nodes);
        closed.pressure(Configuration::Reference, |_| 2.0, &mut sink);
        let axial: f64 = sink.force.iter().skip(1).step_by(2).sum();
        assert!(axial.abs() < 1e-12, "{kind}: {axial}");
        let work: f64 = mesh.points.iter().flatten().zip(sink.force.iter()).map(|(x, f)| x * f).sum();
        let volume = TAU / 2.0 * 4.0 * 3.0;
        assert!((work / (-2.0 * 3.0 * volume) - 1.0).abs() < 1e-12, "{kind}: {work}");
    }
}

/// A group whose plane crosses the axis is refused.
#[test]
fn negative_radii_are_refused() {
    let mut mesh = solid(ElementKind::Quad4);
    mesh.points.iter_mut().for_each(|point| point[0] -= 1.0);
    let of = Formulation {
        plane: PlaneState::Axisymmetric,
        ..formulation(neo_hookean(), Kinematics::Finite, Locking::None)
    };
    let error = ElementGroup::new(&mesh, vec![0], of).unwrap_err().to_string();
    assert!(error.contains("element 0") && error.contains("axis"), "{error}");
}

/// A state in which a circle shrinks through the axis is inverted, also where the plane is inverted as well.
#[test]
fn states_beyond_the_axis_are_inverted() {
    let mesh = solid(ElementKind::Quad4);
    let of = Formulation {
        plane: PlaneState::Axisymmetric,
        ..formulation(neo_hookean(), Kinematics::Finite, Locking::None)
    };
    let group = group(&mesh, of);
    let nodes = |index| mesh.element_nodes(index).to_vec();
    for axial in [0.0, -3.0] {
        let u = affine(&mesh, &[[-1.5, 0.0], [0.0, axial]]);
        let mut sink = Dense::<2>::new(&mesh, &nodes);
        assert!(group.evaluate(&u, Request::FORCE, &mut sink).is_err(), "{axial}");
    }
}
