//! The stages of the two-stage scheme: each has the tangent of its frozen state, and a symmetric
//! matrix.

use std::rc::Rc;

use contact_petsc::dynamics::{Equations, Freeze, KnownFriction, MultigridHints, Sides, Split, Staging};
use contact_petsc::petsc::{Format, Session, Symmetry};
use contact_petsc::terms::Terms;

use super::cases::{Case, plane_cases, solid_cases};
use super::tangent::{disturb, note_closed_points, prescribed, rate, residual, scatter, set};

const STAGES: [(Split, Terms); 3] = [
    (Split::NormalStage(KnownFriction::Bound), Terms::NORMAL_STAGE),
    (Split::NormalStage(KnownFriction::Traction), Terms::NORMAL_STAGE),
    (Split::FrictionStage, Terms::FRICTION_STAGE),
];

pub fn all(session: &Rc<Session>) {
    plane_cases().iter().filter(|case| case.friction.is_some()).for_each(|case| check(session, case));
    solid_cases().iter().filter(|case| case.friction.is_some()).for_each(|case| check(session, case));
}

fn check<const D: usize>(session: &Rc<Session>, case: &Case<D>) {
    let mut scene = case.scene(session, Format::Aij);
    let held = prescribed(&mut scene);
    disturb(&mut scene);
    note_closed_points(&mut scene);
    let mut u = scene.stage.trial.u.like().expect("PETSc");
    u.copy_from(&scene.stage.trial.u).expect("PETSc");
    let mut d = u.like().expect("PETSc");
    let values = scatter(&scene, 6.0).into_iter().zip(&held);
    set(&mut d, values.map(|(value, held)| if *held { 0.0 } else { 0.5 * value }));
    let name = format!("{} ({} ranks)", case.name, session.size());

    // Where the stages hold what the balance has, they have its residual.
    let balance = residual(&mut scene, (&u, &d), 0.0);
    scene.system.freeze(Freeze::NormalTractions);
    scene.system.freeze(Freeze::FrictionTractions);
    let change = scene.system.force_change();
    assert!(change.friction == 0.0 && change.normal > 0.0, "{name}: {change:?}");
    let mut matrix = scene.system.matrix().like().expect("PETSc");
    let size = balance.norm().expect("PETSc");
    for (split, terms) in STAGES {
        scene.system.set_split(split);
        let mut apart = residual(&mut scene, (&u, &d), 0.0);
        apart.axpy(-1.0, &balance).expect("PETSc");
        let apart = apart.norm().expect("PETSc") / size;
        assert!(apart < 1e-12, "{name}: {split:?} is {apart:.1e} from the balance");
        // Away from there they differ, as the tangent of each knows.
        let found = rate(&mut scene, (&u, &d), Terms::ALL);
        assert!(found > 1.95, "{name}: rate {found} of {split:?}");
        residual(&mut scene, (&u, &d), 0.0);
        scene.system.jacobian_into(&scene.stage, terms, &mut matrix).expect("PETSc");
        let asymmetry = matrix.asymmetry().expect("PETSc");
        assert!(asymmetry < 1e-13, "{name}: {split:?} has an asymmetry of {asymmetry:.1e}");
        assert_eq!(matrix.symmetry(), Symmetry::Symmetric, "{name}: {split:?}");
    }
    scene.system.set_split(Split::Monolithic);
    residual(&mut scene, (&u, &d), 0.0);
    scene.system.jacobian(&scene.stage, Terms::ALL, None).expect("PETSc");
    let whole = scene.system.matrix().asymmetry().expect("PETSc");
    assert!(whole > 1e-8, "{name}: the whole matrix is symmetric");
    joints_are_symmetric(&mut scene, &name);
    nodes_in_contact_have_normals(&mut scene, &name);
}

/// The matrix of the bodies joined by springs is symmetric. It is stiffer than that of the bodies
/// alone, but only where there is contact.
fn joints_are_symmetric<const D: usize>(scene: &mut super::scene::Scene<D>, name: &str) {
    let mut joined = scene.system.matrix().like().expect("PETSc");
    let mut bodies = joined.like().expect("PETSc");
    scene.system.joined_bodies_into(&scene.stage, &mut joined).expect("PETSc");
    scene.system.jacobian_into(&scene.stage, Terms::BODIES, &mut bodies).expect("PETSc");
    let asymmetry = joined.asymmetry().expect("PETSc");
    assert!(asymmetry < 1e-13, "{name}: joined bodies have an asymmetry of {asymmetry:.1e}");
    let touching = scene.system.contact_nodes(Sides::Both);
    let [mut stiffer, mut alone] = [(); 2].map(|()| scene.stage.trial.u.like().expect("PETSc"));
    joined.diagonal(&mut stiffer).expect("PETSc");
    bodies.diagonal(&mut alone).expect("PETSc");
    stiffer.axpy(-1.0, &alone).expect("PETSc");
    let size = alone.norm().expect("PETSc");
    for (node, added) in stiffer.owned().chunks_exact(D).enumerate() {
        assert!(added.iter().all(|k| *k >= -1e-13 * size), "{name}: {added:?}");
        let free = added.iter().all(|k| k.abs() <= 1e-13 * size);
        assert!(free || touching[node], "{name}: a spring on a node without contact");
    }
    assert!(stiffer.norm().expect("PETSc") > 1e-6 * size, "{name}: no spring");
}

/// The normals are unit vectors where there is contact, and zero elsewhere.
fn nodes_in_contact_have_normals<const D: usize>(scene: &mut super::scene::Scene<D>, name: &str) {
    let mut normals = scene.stage.trial.u.like().expect("PETSc");
    scene.system.contact_normals(&mut normals).expect("PETSc");
    let sizes: Vec<f64> =
        normals.owned().chunks_exact(D).map(|n| n.iter().map(|n| n * n).sum::<f64>().sqrt()).collect();
    assert!(sizes.iter().all(|size| *size == 0.0 || (size - 1.0).abs() < 1e-12), "{name}: {sizes:?}");
    let total = normals.norm().expect("PETSc");
    assert!(total > 0.0, "{name}: no node in contact");
}
