//! Mass, body force, traction and pressure.

use super::*;

fn masses<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let group = group(mesh, formulation(neo_hookean(), Kinematics::Finite, Locking::None));
    let mut volumes = Vec::new();
    let still = vec![0.0; mesh.points.len() * D];
    group.stress(&still, |_, stress| volumes.push(stress.volume));
    let n = kind.nodes();
    // The volume is computed with the full rule and the mass with its own. On curved sides they
    // differ, but only slightly.
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
    // A constant body force gives the mass times this force.
    let nodes = |index| mesh.element_nodes(index).to_vec();
    let mut sink = Dense::new(mesh, &nodes);
    group.body_force(|_| std::array::from_fn(|i| 1.0 + i as f64), &mut sink);
    for i in 0..D {
        let sum: f64 = (0..mesh.points.len()).map(|node| sink.force[node * D + i]).sum();
        assert!((sum - (1.0 + i as f64) * totals.iter().sum::<f64>()).abs() < 1e-13, "{kind}: {sum}");
    }
}

/// Consistent and lumped mass are positive and sum to density times volume; weight is mass times
/// gravity.
#[test]
fn mass_sums_to_density_times_volume() {
    for_every_kind!(masses);
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
    // Virtual work for a uniform expansion: minus pressure times the change of volume, which is D
    // times the volume.
    let mut sink = Dense::new(mesh, &nodes);
    closed.pressure(Configuration::Reference, |_| 2.0, &mut sink);
    let work: f64 = mesh.points.iter().flatten().zip(sink.force.iter()).map(|(x, f)| x * f).sum();
    let group = group(mesh, formulation(neo_hookean(), Kinematics::Finite, Locking::None));
    let mut volume = 0.0;
    group.mass(|_, mass| volume += mass.iter().sum::<f64>() / 3.0);
    let tolerance = if kind.order() == 1 { 1e-13 } else { 1e-2 };
    assert!((work / (-2.0 * D as f64 * volume) - 1.0).abs() < tolerance, "{kind}: {work} {volume}");
}

/// Pressure has an exact tangent, acts inward, and has no resultant on a closed surface.
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
