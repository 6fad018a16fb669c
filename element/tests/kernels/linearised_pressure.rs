//! Pressures linearised at an earlier state.

use super::axisymmetric::ring;
use super::*;

/// Moduli with a Poisson's ratio of 0.49994.
const STIFF: Moduli<f64> = Moduli { lambda: 5000.0, mu: 0.6 };

/// Formulations of finite kinematics with these moduli: every law with every treatment of locking.
fn stiff(kind: ElementKind, plane: PlaneState) -> Vec<Formulation> {
    let laws: Vec<_> =
        MATERIALS.iter().filter_map(|entry| Material::with_moduli(entry.name, STIFF)).collect();
    let cures = Locking::ALL.into_iter().map(|(locking, ..)| locking);
    let offered = cures.filter(|locking| *locking != Locking::Auto && locking.offered(kind));
    let of = |locking| {
        let of_law =
            move |law: &Material| Formulation { plane, ..formulation(*law, Kinematics::Finite, locking) };
        laws.iter().map(of_law).collect::<Vec<_>>()
    };
    offered.flat_map(of).collect()
}

/// Force and stiffness of the difference between the pressure linearised at `earlier` and that at `u`.
fn pressure_change<const D: usize>(
    mesh: &Mesh<D>,
    solid: &Solid<D>,
    u: &[f64],
    earlier: &[f64],
    terms: Terms,
) -> (DVector<f64>, DMatrix<f64>) {
    let (force, _) = solid.sum(
        mesh,
        |sink| solid.group.pressure_change(u, earlier, sink),
        |patches, sink| patches.pressure_change(u, earlier, sink),
    );
    let stiffness =
        |linearised_at| solid.requested(mesh, u, Request { linearised_at, ..Request::of(terms) }).1;
    (force, stiffness(Some(earlier)) - stiffness(None))
}

/// All formulations on all elements, in the plane, in space and around an axis.
fn every_stiff_formulation(
    test_2d: impl Fn(ElementKind, &Mesh<2>, Formulation),
    test_3d: impl Fn(ElementKind, &Mesh<3>, Formulation),
) {
    let of_plane = |kind: ElementKind, mesh: Mesh<2>| {
        stiff(kind, PlaneState::Strain).into_iter().for_each(|of| test_2d(kind, &mesh, of));
        stiff(kind, PlaneState::Axisymmetric).into_iter().for_each(|of| test_2d(kind, &ring(kind), of));
    };
    every_kind(of_plane, |kind, mesh| {
        stiff(kind, PlaneState::Strain).into_iter().for_each(|of| test_3d(kind, &mesh, of));
    });
}

/// The linearised pressure is that of the same state at this state, and differs from the pressure by the square
/// of the motion from there.
fn second_order<const D: usize>(kind: ElementKind, mesh: &Mesh<D>, of: Formulation) {
    let solid = group(mesh, of);
    let (u, d) = (random(mesh, 0.01, 31), random(mesh, 0.01, 32));
    let moved = |h: f64| -> Vec<f64> { u.iter().zip(&d).map(|(u, d)| u + h * d).collect() };
    let change = |h: f64| pressure_change(mesh, &solid, &moved(h), &u, Terms::ALL);
    let (rest, still) = change(0.0);
    assert!(rest.amax() < 1e-12 && still.amax() < 1e-12, "{kind} {of:?}");
    let [large, small] = [0.2, 0.1].map(|h| change(h).0.norm());
    assert!((3.5..4.5).contains(&(large / small)), "{kind} {of:?}: {large} {small}");
}

#[test]
fn linearised_pressures_have_order_two() {
    every_stiff_formulation(second_order, second_order);
}

/// At fixed pressures, the stiffness is the derivative of the force. A change of the force with the pressures is
/// a combination of the forces of other earlier states.
fn derivative<const D: usize>(kind: ElementKind, mesh: &Mesh<D>, of: Formulation) {
    let solid = group(mesh, of);
    let u = random(mesh, 0.02, 41);
    let earlier = random(mesh, 0.02, 42);
    let d = DVector::from_vec(random(mesh, 1.0, 43));
    let h = 1e-5;
    let moved = |h: f64| -> Vec<f64> { u.iter().zip(d.iter()).map(|(u, d)| u + h * d).collect() };
    let force = |h: f64| pressure_change(mesh, &solid, &moved(h), &earlier, Terms::empty()).0;
    let found = (force(h) - force(-h)) / (2.0 * h);
    let change = |terms| pressure_change(mesh, &solid, &u, &earlier, terms).1;
    let stiffness = change(Terms::ALL);
    let other = |seed| pressure_change(mesh, &solid, &u, &random(mesh, 0.02, seed), Terms::empty()).0;
    let mut directions: Vec<DVector<f64>> = Vec::new();
    let outside = |directions: &[DVector<f64>], vector: DVector<f64>| {
        directions.iter().fold(vector, |rest, direction| &rest - direction * direction.dot(&rest))
    };
    for seed in 100..100 + u.len() as u32 {
        let vector = other(seed);
        let size = vector.norm();
        // Twice, because rounding leaves a part.
        let rest = outside(&directions, outside(&directions, vector));
        if rest.norm() > 1e-7 * size {
            directions.push(rest.normalize());
        }
    }
    let outside = |vector| outside(&directions, vector).norm();
    let size = (&stiffness * &d).norm();
    let error = outside(found - &stiffness * &d) / size;
    assert!(error < 1e-5, "{kind} {of:?}: {error:e}");
    // Elements with many pressures leave no direction in which the derivative shows.
    if directions.len() < u.len() / 2 {
        assert!(outside(&stiffness * &d) > 0.05 * size, "{kind} {of:?}");
    }
    let parts = change(Terms::MATERIAL) + change(Terms::GEOMETRIC);
    assert!((parts - &stiffness).amax() < 1e-12 * stiffness.amax(), "{kind} {of:?}");
    assert!((&stiffness - stiffness.transpose()).amax() < 1e-12 * stiffness.amax(), "{kind} {of:?}");
}

#[test]
fn stiffness_of_linearised_pressures_is_their_derivative() {
    every_stiff_formulation(derivative, derivative);
}

/// Newton's iterations at a load of half the shear modulus in one increment, with the pressure linearised at the
/// iterate before.
fn iterations<const D: usize>(kind: ElementKind, mesh: &Mesh<D>, of: Formulation) {
    let solid = group(mesh, of);
    let ends = mesh.points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
        [low.min(point[0]), high.max(point[0])]
    });
    let free: Vec<usize> = (0..mesh.points.len())
        .filter(|&node| mesh.points[node][0] > ends[0] + 0.2)
        .flat_map(|node| (0..D).map(move |i| node * D + i))
        .collect();
    let loaded: Vec<usize> =
        (0..mesh.points.len()).filter(|&node| mesh.points[node][0] > ends[1] - 0.2).collect();
    let mut load = DVector::zeros(mesh.points.len() * D);
    for node in &loaded {
        load[node * D + 1] = 0.05 * STIFF.mu / loaded.len() as f64;
    }
    let size = load.norm();
    let mut u = vec![0.0; mesh.points.len() * D];
    let mut earlier: Option<Vec<f64>> = None;
    let count = (0..20).find(|_| {
        let request = Request { linearised_at: earlier.as_deref(), ..Request::TANGENT };
        let (force, stiffness) = solid.requested(mesh, &u, request);
        let residual = (&load - force).select_rows(&free);
        if residual.norm() < 1e-8 * size {
            return true;
        }
        let reduced = stiffness.select_rows(&free).select_columns(&free);
        let correction = reduced.lu().solve(&residual).unwrap();
        earlier = Some(u.clone());
        free.iter().zip(correction.iter()).for_each(|(&dof, correction)| u[dof] += correction);
        false
    });
    assert!(count.is_some_and(|count| count <= 6), "{kind} {of:?}: {count:?}");
}

#[test]
fn linearised_pressures_keep_iterations_few() {
    every_stiff_formulation(iterations, iterations);
}
