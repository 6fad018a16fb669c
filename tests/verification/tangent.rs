//! The assembled matrix is the derivative of the whole residual: Taylor tests with every term in the game.

use std::rc::Rc;

use contact_petsc::assembly::SystemOptions;
use contact_petsc::contact::friction::coefficient::{Coefficient, Constant, Stribeck};
use contact_petsc::contact::friction::{Coulomb, Friction, FrictionLaw, PowerLaw, Regularization};
use contact_petsc::contact::normal::{NormalLaw, Penalty, PowerLaw as PowerNormal};
use contact_petsc::contact::obstacle::{Cylinder, Obstacle, Plane, Side, Sphere};
use contact_petsc::dynamics::{Dynamics, Lift};
use contact_petsc::mesh::ElementKind::{self, Hex8, Quad4, Quad9, Tet4, Tet10, Tri6};
use contact_petsc::mesh::{BoxShape, Facet, Mesh};
use contact_petsc::model::{Body, Contact, InitialOverclosure, LoadKind, NormalChoice, Quadrature, Target};
use contact_petsc::petsc::{Format, Operator, Session, Vector as Distributed};
use contact_petsc::tensor::Vector;
use contact_petsc::terms::Terms;
use contact_petsc::time::Scheme;

use super::scene::{Scene, Solid, function, load, support};

const NH: &str = "neo_hookean";
const SVK: &str = "saint_venant_kirchhoff";

/// A scene with the terms that are at work in it, besides those of the solid and the normal contact.
pub struct Case<const D: usize> {
    pub name: &'static str,
    solid: Solid,
    lumped: bool,
    obstacle: Obstacle<D>,
    /// Elements of a second body that takes the place of the obstacle.
    bed: Option<ElementKind>,
    normal: NormalLaw,
    pub friction: Option<Friction>,
    current_area: bool,
    at_work: Terms,
}

const CURVED: Terms = Terms::NORMAL_GEOMETRY.union(Terms::FRICTION_GEOMETRY);
const RUBBING: Terms = Terms::FRICTION_NORMAL_COUPLING.union(Terms::ZONE_CHANGE);

pub fn all(session: &Rc<Session>) {
    let plane = plane_cases();
    let solid = solid_cases();
    for format in [Format::Aij, Format::Baij] {
        plane.iter().for_each(|case| check(session, case, format));
        solid.iter().for_each(|case| check(session, case, format));
    }
}

fn coulomb(coefficient: Coefficient, regularization: Regularization) -> Option<Friction> {
    Some(Friction { law: FrictionLaw::Coulomb(Coulomb { coefficient }), regularization })
}

fn constant() -> Coefficient {
    Coefficient::Constant(Constant::new(0.6).expect("positive"))
}

/// Points stick below this slip velocity [m/s], and slip above.
fn velocity(limit: f64) -> Regularization {
    Regularization::stick_velocity(limit).expect("positive")
}

fn penalty() -> NormalLaw {
    NormalLaw::Penalty(Penalty::new(0.05).expect("positive"))
}

fn floor<const D: usize>() -> Obstacle<D> {
    let up = Vector::from_fn(|i, _| if i + 1 == D { 1.0 } else { 0.1 });
    Obstacle::Plane(
        Plane::new(Vector::from_fn(|i, _| if i + 1 == D { 0.2 } else { 0.5 }), up).expect("a plane"),
    )
}

/// A ball from below, into which the whole bottom has sunk.
fn ball<const D: usize>() -> Obstacle<D> {
    let centre = Vector::from_fn(|i, _| if i + 1 == D { -2.0 } else { 0.45 });
    Obstacle::Sphere(Sphere::new(centre, 2.3, Side::Outside).expect("a ball"))
}

pub fn plane_cases() -> Vec<Case<2>> {
    let power = Friction {
        law: FrictionLaw::PowerLaw(PowerLaw::new(8.0, 1.5).expect("positive")),
        regularization: velocity(1e-3),
    };
    let stribeck = Coefficient::Stribeck(Stribeck::new(0.9, 0.4, 3.0).expect("positive"));
    let stick = Regularization::stick_stiffness(20.0).expect("positive");
    let slip = Regularization::stick_stiffness(1e4).expect("positive");
    let new = |name, kind, law, friction, at_work| Case {
        name,
        solid: Solid::new(kind, law),
        lumped: false,
        obstacle: floor(),
        bed: None,
        normal: penalty(),
        friction,
        current_area: true,
        at_work,
    };
    let damped = RUBBING | Terms::FRICTION_DAMPING;
    vec![
        new("stick by velocity", Quad4, NH, coulomb(constant(), velocity(8.0)), damped),
        Case {
            obstacle: ball(),
            solid: Solid::new(Quad4, NH).reduced(),
            ..new("slip on a disc", Quad4, NH, coulomb(constant(), velocity(1e-3)), RUBBING | CURVED)
        },
        Case {
            lumped: true,
            ..new(
                "slip by Stribeck",
                Tri6,
                SVK,
                coulomb(stribeck, velocity(1e-3)),
                RUBBING | Terms::COEFFICIENT_CHANGE,
            )
        },
        Case {
            obstacle: ball(),
            ..new(
                "stick by stiffness",
                Tri6,
                NH,
                coulomb(constant(), stick),
                Terms::ZONE_CHANGE | Terms::FRICTION_DAMPING | CURVED,
            )
        },
        new("slip by stiffness", Quad4, SVK, coulomb(constant(), slip), RUBBING),
        Case {
            normal: NormalLaw::PowerLaw(PowerNormal::new(40.0, 2.0).expect("positive")),
            ..new("power laws", Quad4, NH, Some(power), RUBBING)
        },
        Case { current_area: false, ..new("no friction", Quad4, NH, None, Terms::empty()) },
        Case {
            bed: Some(Quad4),
            ..new("stick on a body", Quad4, NH, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            bed: Some(Tri6),
            ..new("slip on a body", Quad9, NH, coulomb(constant(), velocity(1e-3)), RUBBING | CURVED)
        },
        Case {
            bed: Some(Quad4),
            current_area: false,
            ..new("no friction on a body", Tri6, NH, None, Terms::NORMAL_GEOMETRY)
        },
        Case {
            obstacle: ball(),
            ..new("no friction on a disc", Quad4, SVK, None, Terms::NORMAL_GEOMETRY | Terms::ZONE_CHANGE)
        },
    ]
}

pub fn solid_cases() -> Vec<Case<3>> {
    let stribeck = Coefficient::Stribeck(Stribeck::new(0.9, 0.4, 3.0).expect("positive"));
    let cylinder =
        Cylinder::new(Vector::from([0.4, 0.0, -2.0]), Vector::from([0.1, 1.0, 0.0]), 2.3, Side::Outside);
    let slip = Regularization::stick_stiffness(1e4).expect("positive");
    let new = |name, kind, law, friction, at_work| Case {
        name,
        solid: Solid::new(kind, law),
        lumped: false,
        obstacle: floor(),
        bed: None,
        normal: penalty(),
        friction,
        current_area: true,
        at_work,
    };
    // In space a slipping point turns: its slip has a tangent.
    let damped = RUBBING | Terms::FRICTION_DAMPING;
    vec![
        new("slip in space", Hex8, NH, coulomb(constant(), velocity(1e-3)), damped),
        Case {
            obstacle: Obstacle::Cylinder(cylinder.expect("a cylinder")),
            ..new("stick on a cylinder", Tet10, SVK, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            obstacle: ball(),
            solid: Solid::new(Hex8, NH).reduced(),
            ..new(
                "slip on a ball",
                Hex8,
                NH,
                coulomb(stribeck, velocity(1e-3)),
                damped | CURVED | Terms::COEFFICIENT_CHANGE,
            )
        },
        Case {
            bed: Some(Tet4),
            ..new("stick on a body in space", Hex8, NH, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            bed: Some(Hex8),
            ..new("slip on a body in space", Tet10, SVK, coulomb(constant(), velocity(1e-3)), damped | CURVED)
        },
        new("slip by stiffness in space", Tet4, NH, coulomb(constant(), slip), damped),
    ]
}

impl<const D: usize> Case<D> {
    pub fn scene(&self, session: &Rc<Session>, format: Format) -> Scene<D> {
        let mut model = self.solid.model::<D>();
        model.bodies[0].lumped_mass = self.lumped;
        let only = |axis: usize, text| std::array::from_fn(|i| if i == axis { text } else { "" });
        model.supports.push(support("block.top", only(D - 1, "-0.2 * t")));
        model.supports.push(support("block.right", only(0, "2 * t - 0.7")));
        if self.current_area {
            model.loads.push(load("block.left", LoadKind::Pressure(function("1.5 + 0.5 * y"))));
        }
        model.loads.push(load("block", LoadKind::BodyForce(std::array::from_fn(|_| function("0.3")))));
        model.contacts.push(Contact {
            name: "sole".to_owned(),
            contactor: "block.bottom".to_owned(),
            body: 0,
            target: match self.bed {
                None => Target::Obstacle(self.obstacle),
                Some(_) => Target::Surface { set: "bed.top".to_owned(), body: 1 },
            },
            target_name: "foundation".to_owned(),
            softer: 5.0e6,
            normal: NormalChoice::Law(self.normal),
            penetration: None,
            friction: self.friction,
            quadrature: Quadrature::Auto,
            current_area: self.current_area,
            initial_overclosure: InitialOverclosure::Accept,
        });
        let options = SystemOptions { inertia: true, format };
        let mut mesh = self.solid.mesh(2, |_| ());
        if let Some(kind) = self.bed {
            let bed = Solid::new(kind, NH);
            model.bodies.push(Body { name: "bed".to_owned(), ..bed.model::<D>().bodies.remove(0) });
            model.supports.push(support("bed.bottom", std::array::from_fn(|_| "0.1 * t")));
            mesh = beside(mesh, &bed);
        }
        Scene::new(session, mesh, &model, options)
    }
}

/// A second body below the block, wider and of other cells, into whose top the whole bottom of the block has sunk.
fn beside<const D: usize>(mut block: Mesh<D>, bed: &Solid) -> Mesh<D> {
    let mut bed = BoxShape {
        min: std::array::from_fn(|i| if i + 1 == D { -1.0 } else { -0.45 }),
        max: std::array::from_fn(|i| if i + 1 == D { 0.2 } else { 1.55 }),
        cells: [3; D],
        element: bed.kind,
    }
    .mesh()
    .expect("a box");
    let first = block.points.len() as u32;
    let elements = block.element_count() as u32;
    block.points.append(&mut bed.points);
    for element in 0..bed.element_count() {
        let nodes: Vec<u32> = bed.element_nodes(element).iter().map(|node| node + first).collect();
        block.push(bed.kinds[element], nodes);
        *block.body.last_mut().expect("just pushed") = 1;
    }
    for (name, facets) in bed.facet_sets {
        let facets = facets.iter().map(|facet| Facet { element: facet.element + elements, ..*facet });
        block.facet_sets.insert(format!("bed.{name}"), facets.collect());
    }
    block
}

/// Numbers in (-1, 1) that look random, and depend on the node of the input mesh and not on the partition.
pub fn scatter<const D: usize>(scene: &Scene<D>, seed: f64) -> Vec<f64> {
    let entry = |node: &u32, i: usize| {
        ((f64::from(*node) * D as f64 + i as f64 + 1.0) * 12.9898 + seed * 78.233).sin()
    };
    let number = |value: f64| 2.0 * (value * 43_758.545_3 - (value * 43_758.545_3).floor()) - 1.0;
    scene.local().input_node.iter().flat_map(|node| (0..D).map(move |i| number(entry(node, i)))).collect()
}

pub fn set(vector: &mut Distributed, values: impl IntoIterator<Item = f64>) {
    vector.local_mut().iter_mut().zip(values).for_each(|(entry, value)| *entry = value);
}

/// One for the nodes of the block, zero for those of the body under it.
fn moving<const D: usize>(scene: &Scene<D>) -> Vec<f64> {
    let mesh = &scene.local().mesh;
    let mut moves = vec![1.0; mesh.points.len()];
    for element in (0..mesh.element_count()).filter(|&element| mesh.body[element] == 1) {
        mesh.element_nodes(element).iter().for_each(|&node| moves[node as usize] = 0.0);
    }
    moves
}

/// Brings the stage to a random state in the middle of a step of generalised-alpha.
pub fn disturb<const D: usize>(scene: &mut Scene<D>) {
    let [start, velocity, acceleration, forces, change] =
        [1.0, 2.0, 3.0, 4.0, 5.0].map(|seed| scatter(scene, seed));
    let moves = moving(scene);
    let stage = &mut scene.stage;
    set(&mut stage.start.u, start.iter().map(|value| 0.02 * value));
    set(
        &mut stage.start.v,
        velocity
            .iter()
            .enumerate()
            .map(|(dof, value)| moves[dof / D] * [5.0, 3.0, 0.5][dof % D] + 0.4 * value),
    );
    set(&mut stage.start.a, acceleration.iter().map(|value| 3.0 * value));
    set(&mut stage.start_forces, forces);
    stage.start.time = 0.3;
    Scheme::generalized_alpha(0.8).prepare(stage, 0.1, 0.4).expect("PETSc");
    // Along x and y all points of the block move on, so that the increment slips where the velocity does.
    let drift = [0.03, 0.02, 0.0];
    let last = |dof: usize| dof % D == D - 1;
    let moved = start.iter().zip(change).enumerate();
    let moved = moved.map(|(dof, (start, change))| {
        0.02 * (start + 0.5 * change) + if last(dof) { 0.0 } else { moves[dof / D] * drift[dof % D] }
    });
    set(&mut stage.trial.u, moved);
}

/// Residual at the state `u + h d`; prescribed unknowns do not move.
pub fn residual<const D: usize>(
    scene: &mut Scene<D>,
    (u, d): (&Distributed, &Distributed),
    h: f64,
) -> Distributed {
    let mut out = u.like().expect("PETSc");
    let Scene { system, stage, .. } = scene;
    stage.trial.u.waxpy(h, d, u).expect("PETSc");
    stage.update_rates().expect("PETSc");
    system.prescribe(stage).expect("PETSc");
    let found = system.residual(stage, &mut out).expect("PETSc");
    assert!(found.norm.is_finite(), "an inverted element");
    out
}

/// Matrix of the terms at `u`, times `d`.
fn slope<const D: usize>(
    scene: &mut Scene<D>,
    (u, d): (&Distributed, &Distributed),
    terms: Terms,
) -> Distributed {
    residual(scene, (u, d), 0.0);
    let mut out = u.like().expect("PETSc");
    scene.system.jacobian(&scene.stage, terms, None).expect("PETSc");
    scene.system.matrix().multiply(d, &mut out).expect("PETSc");
    out
}

/// Order with which `R(u + h d) - R(u) - h K d` vanishes.
pub fn rate<const D: usize>(scene: &mut Scene<D>, at: (&Distributed, &Distributed), terms: Terms) -> f64 {
    let base = residual(scene, at, 0.0);
    let slope = slope(scene, at, terms);
    let [coarse, fine] = [0.5f64.powi(14), 0.5f64.powi(15)].map(|h: f64| {
        let mut rest = residual(scene, at, h);
        rest.axpy(-1.0, &base).expect("PETSc");
        rest.axpy(-h, &slope).expect("PETSc");
        rest.norm().expect("PETSc")
    });
    (coarse / fine).log2()
}

/// Order with which `R(u + h e) - R(u) + h rhs` vanishes, where prescribed unknowns change by `e` and `rhs` is what the
/// matrix has moved to the right side for it, in statics.
fn lift_rate<const D: usize>(scene: &mut Scene<D>, (u, e): (&Distributed, &mut Distributed)) -> f64 {
    e.update_ghosts().expect("PETSc");
    scene.stage.inertia = false;
    let mut moved = |h: f64| {
        let mut out = u.like().expect("PETSc");
        let Scene { system, stage, .. } = &mut *scene;
        stage.trial.u.waxpy(h, e, u).expect("PETSc");
        stage.update_rates().expect("PETSc");
        stage.trial.u.update_ghosts().expect("PETSc");
        stage.trial.v.update_ghosts().expect("PETSc");
        system.residual(stage, &mut out).expect("PETSc");
        out
    };
    let steps = [0.5f64.powi(14), 0.5f64.powi(15)];
    let ([coarse, fine], base) = (steps.map(&mut moved), moved(0.0));
    let mut rhs = u.like().expect("PETSc");
    let lift = Lift { change: e, rhs: &mut rhs };
    scene.system.jacobian(&scene.stage, Terms::ALL, Some(lift)).expect("PETSc");
    let [coarse, fine] = [(coarse, steps[0]), (fine, steps[1])].map(|(mut rest, h)| {
        rest.axpy(-1.0, &base).expect("PETSc");
        rest.axpy(h, &rhs).expect("PETSc");
        rest.norm().expect("PETSc")
    });
    (coarse / fine).log2()
}

/// Which owned unknowns are prescribed: those that `prescribe` changes.
pub fn prescribed<const D: usize>(scene: &mut Scene<D>) -> Vec<bool> {
    const FREE: f64 = 7.0;
    scene.stage.trial.u.set(FREE);
    scene.system.prescribe(&mut scene.stage).expect("PETSc");
    scene.stage.trial.u.owned().iter().map(|value| *value != FREE).collect()
}

fn check<const D: usize>(session: &Rc<Session>, case: &Case<D>, format: Format) {
    let mut scene = case.scene(session, format);
    let held = prescribed(&mut scene);
    disturb(&mut scene);
    scene.system.prescribe(&mut scene.stage).expect("PETSc");
    let mut u = scene.stage.trial.u.like().expect("PETSc");
    u.copy_from(&scene.stage.trial.u).expect("PETSc");
    let [free, mut fixed] = [false, true].map(|of_held| {
        let mut d = u.like().expect("PETSc");
        let values = scatter(&scene, 6.0).into_iter().zip(&held);
        set(&mut d, values.map(|(value, held)| if *held == of_held { 0.5 * value } else { 0.0 }));
        d
    });
    let at = (&u, &free);
    let name = format!("{} ({:?}, {} ranks)", case.name, format, session.size());
    let whole = rate(&mut scene, at, Terms::ALL);
    assert!(whole > 1.95, "{name}: rate {whole}");
    let at_work = case.at_work | Terms::MASS | Terms::MATERIAL | Terms::GEOMETRIC | Terms::NORMAL_CONTACT;
    let follows = if case.current_area { Terms::FOLLOWING_LOAD } else { Terms::empty() };
    let at_work = at_work | follows;
    for term in Terms::ALL.iter() {
        let without = rate(&mut scene, at, Terms::ALL - term);
        let right = if at_work.contains(term) { without < 1.5 } else { without > 1.95 };
        assert!(right, "{name}: rate {without} without {term:?}, {whole} with it");
    }
    // Neither rows nor columns couple free and prescribed unknowns, the residual has no prescribed rows.
    let (by_free, by_fixed) =
        (slope(&mut scene, at, Terms::ALL), slope(&mut scene, (&u, &fixed), Terms::ALL));
    let force = residual(&mut scene, at, 0.0);
    let columns = [by_free.owned(), by_fixed.owned(), force.owned()];
    for (dof, held) in held.iter().enumerate() {
        let [by_free, by_fixed, force] = [columns[0][dof], columns[1][dof], columns[2][dof]];
        assert!(
            if *held { by_free == 0.0 && force == 0.0 } else { by_fixed == 0.0 },
            "{name}: unknown {dof}"
        );
    }
    drop(columns);
    let promised = scene.system.is_symmetric(&scene.stage, Terms::ALL);
    let asymmetry = scene.system.matrix().asymmetry().expect("PETSc");
    assert!(
        if promised { asymmetry < 1e-13 } else { asymmetry > 1e-8 },
        "{name}: {promised} but {asymmetry:.1e}"
    );
    let lifted = lift_rate(&mut scene, (&u, &mut fixed));
    assert!(lifted > 1.95, "{name}: rate {lifted} of the prescribed columns");
    if session.rank() == 0 {
        println!("{name}: rate {whole:.3}, asymmetry {asymmetry:.1e}");
    }
}
