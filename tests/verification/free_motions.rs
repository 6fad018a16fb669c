//! Free motions of a static equilibrium: their number, the report of a loaded one, and that a body
//! that only friction would hold keeps its position.

use std::rc::Rc;

use contact_petsc::assembly::{ContactSystem, SystemOptions};
use contact_petsc::case::Case;
use contact_petsc::dynamics::{
    ContactMonitor, Continuation, Equations, FloatingBodies, FrictionMode, Shifts, Stage,
};
use contact_petsc::model::{Model, read_mesh};
use contact_petsc::partition::{Plan, distribute};
use contact_petsc::petsc::{Format, Session};
use contact_petsc::solvers::{FreeMotions, LinearChoice, Outcome};
use contact_petsc::terms::Terms;
use contact_petsc::time::{Integrate, Scheme};

use super::scene::Scene;

const HOLDING: f64 = 1e-7;

pub fn all(session: &Rc<Session>) {
    counts(session);
    foundations(session);
    driven(session);
    stays(session);
    pieces(session);
}

/// A case of one body over a plane through `point` with this `normal`. There is no plane if
/// `normal` is empty.
fn case(dimension: usize, mesh: &str, point: &str, normal: &str, boundary: &str) -> String {
    let contact = "contact: { sole: { contactor: block.bottom, target: floor, normal: { penalty: { compliance: 1.0e-8 } }, \
                   friction: FRICTION, initial_overclosure: accept } }";
    let (floor, contact) = match normal {
        "" => (String::new(), ""),
        _ => {
            (format!("obstacles: {{ floor: {{ plane: {{ point: {point}, normal: {normal} }} }} }}"), contact)
        }
    };
    format!(
        "
dimension: {dimension}
bodies:
  block:
    mesh: {{ box: {{ {mesh} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}
    density: 1000
    kinematics: finite
{floor}
{contact}
{boundary}
start: {{ equilibrium: {{ friction: false, increments: 1 }} }}
time: {{ end: 1, step: 0.1 }}
"
    )
}

const SQUARE: &str = "min: [0, 0], max: [1, 0.5], cells: [6, 3]";
const TILTED: &str =
    "min: [0, 0], max: [1, 0.5], cells: [6, 3], map: { x: 0.8 * x - 0.6 * y, y: 0.6 * x + 0.8 * y }";
const DISC: &str = "min: [-1, -1], max: [1, 1], cells: [6, 6], \
                    map: { x: 0.1 * x * sqrt(1 - y^2 / 2), y: 0.1 * y * sqrt(1 - x^2 / 2) }";
const CUBE: &str = "min: [0, 0, 0], max: [1, 1, 0.5], cells: [4, 3, 2]";
const BALL: &str = "min: [-1, -1, -1], max: [1, 1, 1], cells: [4, 4, 4], map: { \
                    x: 0.1 * x * sqrt(1 - y^2 / 2 - z^2 / 2 + y^2 * z^2 / 3), \
                    y: 0.1 * y * sqrt(1 - z^2 / 2 - x^2 / 2 + z^2 * x^2 / 3), \
                    z: 0.1 * z * sqrt(1 - x^2 / 2 - y^2 / 2 + x^2 * y^2 / 3) }";
const NO_FRICTION: &str = "none";
const STICK: &str = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e8 } } }";

/// The distributed system of a case, and a stage at rest.
fn scene<const D: usize>(session: &Rc<Session>, text: &str, friction: &str) -> Scene<D> {
    let case = Case::parse(&text.replace("FRICTION", friction), "case.yml")
        .unwrap_or_else(|e| panic!("{e}\n{text}"));
    let model = Model::<D>::new(&case).expect("a model");
    let mesh = (session.rank() == 0).then(|| read_mesh(&case).expect("a mesh"));
    let (local, _) = distribute(session.world(), mesh, &Plan::default()).expect("a partition");
    let options = SystemOptions { inertia: true, format: Format::Aij };
    let system = ContactSystem::new(session, local, &model, options).expect("a system");
    let stage = Stage::at_rest(system.pattern_vector()).expect("a stage");
    let mut scene = Scene { system, stage, session: session.clone() };
    let friction = if friction == NO_FRICTION { FrictionMode::Off } else { FrictionMode::AsGiven };
    scene.system.set_continuation(Continuation { spring: HOLDING, friction, ..Continuation::default() });
    scene
}

/// The free motions of the undeformed state under its loads. Loads up to `allowed` along a motion
/// are ignored.
fn free<const D: usize>(session: &Rc<Session>, text: &str, friction: &str, allowed: f64) -> FreeMotions {
    let mut scene = scene::<D>(session, text, friction);
    let Scene { system, stage, .. } = &mut scene;
    Scheme::Static.prepare(stage, 1.0, 0.0).expect("a stage");
    stage.shifts = Shifts::default();
    system.prescribe(stage).expect("PETSc");
    let mut rhs = system.pattern_vector().like().expect("a vector");
    system.residual(stage, &mut rhs).expect("PETSc");
    rhs.scale(-1.0).expect("PETSc");
    system.observe().expect("PETSc");
    system.jacobian(stage, Terms::ALL - Terms::ZONE_CHANGE, None).expect("PETSc");
    FreeMotions::find(system, stage, &rhs, allowed).expect("PETSc")
}

/// On a plane in 2D a block slides, and a disc slides and rolls. In 3D a block slides in two
/// directions and rotates about the normal, and a ball also rolls in two directions. Sticking
/// friction and supports leave fewer free motions.
fn counts(session: &Rc<Session>) {
    let up = "normal: [0, 1]";
    let count2 = |text: &str, friction: &str| free::<2>(session, text, friction, f64::MAX).held();
    let count3 = |text: &str| free::<3>(session, text, NO_FRICTION, f64::MAX).held();
    let plane = |mesh: &str, point: &str| case(2, mesh, point, &up["normal: ".len()..], "");
    let hold = |components: &str| {
        format!("boundary: {{ wall: {{ on: block.left, displacement: {{ {components} }} }} }}")
    };
    assert_eq!(count2(&plane(SQUARE, "[0, 1.0e-6]"), NO_FRICTION), 1, "a block slides");
    assert_eq!(
        count2(
            &case(2, TILTED, "[0, 0]", "[-0.6, 0.8]", "")
                .replace("[0, 0], normal", "[-6.0e-7, 8.0e-7], normal"),
            NO_FRICTION
        ),
        1,
        "tilted"
    );
    assert_eq!(count2(&plane(SQUARE, "[0, 1.0e-6]"), STICK), 0, "friction holds it");
    assert_eq!(count2(&plane(DISC, "[0, -0.0999999]"), NO_FRICTION), 2, "a disc slides and rolls");
    assert_eq!(count2(&plane(DISC, "[0, -0.5]"), NO_FRICTION), 3, "nothing touches it");
    assert_eq!(count2(&case(2, SQUARE, "", "", ""), NO_FRICTION), 3, "there is nothing");
    assert_eq!(count2(&case(2, SQUARE, "", "", &hold("x: 0")), NO_FRICTION), 1, "a wall leaves one motion");
    assert_eq!(count2(&case(2, SQUARE, "", "", &hold("x: 0, y: 0")), NO_FRICTION), 0, "a clamp leaves none");
    let solid = |mesh: &str, height: &str| case(3, mesh, &format!("[0, 0, {height}]"), "[0, 0, 1]", "");
    assert_eq!(count3(&solid(CUBE, "1.0e-6")), 3, "a block in space");
    assert_eq!(count3(&solid(BALL, "-0.0999999")), 5, "a ball");
    assert_eq!(count3(&case(3, CUBE, "", "", "")), 6, "there is nothing in space");
}

/// The motions that neither supports nor foundations and springs resist, whatever the size of the
/// coefficients, and the directions that are reported as not held.
fn foundations(session: &Rc<Session>) {
    fn found<const D: usize>(session: &Rc<Session>, mesh: &str, boundary: &str) -> (usize, Vec<String>) {
        let text = case(D, mesh, "", "", &format!("boundary: {{ {boundary} }}"));
        let scene = scene::<D>(session, &text, NO_FRICTION);
        let motions = scene.system.rigid_motions(&scene.stage).expect("PETSc");
        (motions.len(), scene.system.bodies().holding().free_bodies())
    }
    let soil = |coefficients: &str| {
        format!("soil: {{ on: block.bottom, foundation: {{ stiffness: {{ {coefficients} }} }} }}")
    };
    let along = |axes: &str| vec![format!("'block' along {axes}")];
    let plane = |mesh: &str, boundary: &str| found::<2>(session, mesh, boundary);
    assert_eq!(plane(SQUARE, &soil("normal: 1.0e-3")), (1, along("x")));
    assert_eq!(plane(TILTED, &soil("normal: 1.0e12")), (1, vec![]), "the slope leaves a motion in x and y");
    assert_eq!(plane(SQUARE, &soil("tangential: 1")), (2, along("y")));
    assert_eq!(plane(SQUARE, &soil("normal: 1.0e12, tangential: 1.0e-12")), (0, vec![]));
    assert_eq!(plane(SQUARE, &soil("y: 'if(x < 0.4, 1, 0)'")), (1, along("x")));
    assert_eq!(
        plane(SQUARE, "soil: { on: block.bottom, foundation: { damping: { y: 1 } } }"),
        (3, along("x, y"))
    );
    let wall = "wall: { on: block.left, foundation: { stiffness: { x: 1 } } }, ";
    assert_eq!(plane(SQUARE, &(wall.to_owned() + &soil("y: 1"))), (0, vec![]));
    assert_eq!(plane(SQUARE, "feet: { on: block.bottom, spring: { stiffness: { y: 1 } } }"), (1, along("x")));
    let solid = |boundary: &str| found::<3>(session, CUBE, boundary);
    assert_eq!(solid(&soil("normal: 5")), (3, along("x, y")));
    assert_eq!(solid(&soil("normal: 5, tangential: 1")), (0, vec![]));
    let held = "clamp: { on: block.left, displacement: { x: 0 } }, ";
    assert_eq!(solid(&(held.to_owned() + &soil("normal: 5"))), (1, along("y")));
}

/// A motion with a load along it is not restrained, and is reported with body, direction and
/// resultant. The others are restrained.
fn driven(session: &Rc<Session>) {
    let load = |gravity: &str| format!("boundary: {{ weight: {{ on: block, gravity: {gravity} }} }}");
    let told = |text: &str| {
        let free = free::<2>(session, text, NO_FRICTION, 1e-6);
        (free.held(), free.free, free.driven.expect("a load"))
    };
    // 500 kg.
    let (held, free, falls) = told(&case(2, SQUARE, "[0, -1]", "[0, 1]", &load("[0, -10]")));
    assert_eq!((held, free, &*falls.words), (2, 3, "the motion of 'block' along -y"));
    assert!((falls.force / 5000.0 - 1.0).abs() < 1e-9, "{falls:?}");
    let (held, free, slides) = told(&case(2, SQUARE, "[0, 1.0e-6]", "[0, 1]", &load("[2, -10]")));
    assert_eq!((held, free, &*slides.words), (0, 1, "the motion of 'block' along x"));
    assert!((slides.force / 1000.0 - 1.0).abs() < 1e-9, "{slides:?}");
    let wheel = "boundary: { crank: { on: block.top, traction: { x: 1000 } }, back: { on: block.bottom, traction: { x: -1000 } } }";
    let (held, free, turns) = told(&case(2, &SQUARE.replace("0.5]", "1]"), "[0, -1]", "[0, 1]", wheel));
    assert_eq!((held, free, &*turns.words), (2, 3, "the rotation of 'block' about -z"));
    assert!((turns.force / 1000.0 - 1.0).abs() < 1e-9, "{turns:?}");
}

/// A block on a plane, pressed unevenly. Along the motions that friction would restrain it keeps
/// its position to rounding, although the block deforms by a millimetre and unevenly.
fn stays(session: &Rc<Session>) {
    let press = "boundary: { press: { on: block.top, traction: { y: \"-1.0e5 * (0.5 + x)\" } }, weight: { on: block, gravity: [0, -10] } }";
    let text = case(2, &format!("{SQUARE}, map: {{ x: x + 0.2 * x * y, y: y }}"), "[0, 0]", "[0, 1]", press);
    let mut scene = scene::<2>(session, &text, NO_FRICTION);
    let mut strategy = scene.strategy(&LinearChoice::Named("direct"), false);
    Scheme::Static.prepare(&mut scene.stage, 1.0, 0.0).expect("a stage");
    scene.stage.shifts = Shifts::default();
    let outcome = strategy.solve(&mut scene.system, &mut scene.stage, |_| ()).expect("PETSc");
    let Outcome::Converged(report) = outcome else { panic!("{outcome:?}") };
    assert_eq!(report.held.motions, 1);
    assert!(report.held.force < 1e-12, "{:?}", report.held);
    let u = scene.stage.trial.u.local().to_vec();
    let [shift, moved, sunk] = scene.integrate([&u], |_, [u]| [u.x, u.x.abs(), u.y.abs()]);
    assert!(moved > 1e-4 && sunk > 1e-4, "{moved}, {sunk}");
    assert!(shift.abs() < 1e-14, "the centre of mass moved by {shift} of {moved}");
}

/// Squares in a mesh file at these positions, which share nodes where they touch. The first one is
/// the set `held`.
fn squares(session: &Rc<Session>, places: &[[u32; 2]]) -> String {
    let path = std::path::PathBuf::from(std::env::var(super::FOLDER).expect("a folder")).join("squares.msh");
    if session.rank() == 0 {
        let mut corners: Vec<[u32; 2]> = Vec::new();
        let mut lines = String::new();
        for (number, [x, y]) in places.iter().enumerate() {
            lines += &format!("{} 3 2 9 1", number + 2);
            for corner in [[*x, *y], [x + 1, *y], [x + 1, y + 1], [*x, y + 1]] {
                let known = corners.iter().position(|other| *other == corner);
                let index = known.unwrap_or_else(|| {
                    corners.push(corner);
                    corners.len() - 1
                });
                lines += &format!(" {}", index + 1);
            }
            lines.push('\n');
        }
        let nodes: String =
            (1..).zip(&corners).map(|(number, [x, y])| format!("{number} {x} {y} 0\n")).collect();
        let text = format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"held\"\n$EndPhysicalNames\n\
             $Nodes\n{}\n{nodes}$EndNodes\n$Elements\n{}\n1 1 2 1 1 1 2\n{lines}$EndElements\n",
            corners.len(),
            places.len() + 1
        );
        std::fs::write(path.as_path(), text).expect("a mesh");
    }
    path.display().to_string()
}

/// Pieces that hinge on a clamped one rotate about it, a ring of squares folds, and islands move
/// freely. A loaded motion is reported with its piece.
fn pieces(session: &Rc<Session>) {
    let clamp = "hold: { on: block.held, displacement: { x: 0, y: 0 } }";
    let text = |places: &[[u32; 2]], boundary: &str| {
        let boundary = format!("boundary: {{ {clamp}{boundary} }}");
        let path = squares(session, places);
        case(2, "", "", "", &boundary).replace("box: {  }", &format!("file: {path}"))
    };
    let count = |places: &[[u32; 2]]| free::<2>(session, &text(places, ""), NO_FRICTION, f64::MAX).held();
    assert_eq!(count(&[[0, 0], [1, 0]]), 0, "two squares with a common side");
    assert_eq!(count(&[[0, 0], [1, 1]]), 1, "a hinge");
    assert_eq!(count(&[[0, 0], [1, 1], [2, 2]]), 2, "two hinges");
    assert_eq!(count(&[[1, 0], [0, 1], [2, 1], [1, 2]]), 1, "a ring of four squares, one of them clamped");
    assert_eq!(count(&[[0, 0], [5, 5]]), 3, "an island");
    assert_eq!(count(&[[0, 0], [1, 0], [5, 5], [6, 6]]), 4, "an island with a hinge");
    let driven = |places: &[[u32; 2]]| {
        let text = text(places, ", weight: { on: block, gravity: [0, -10] }");
        free::<2>(session, &text, NO_FRICTION, 1e-6).driven.expect("a load").words
    };
    assert_eq!(
        driven(&[[0, 0], [5, 5]]),
        "the motion of the piece of 'block' with 1 element around [5.5, 5.5] m along -y"
    );
    let turns = driven(&[[0, 0], [1, 0], [2, 1]]);
    assert!(turns.contains("the piece of 'block' with 1 element around [2.5, 1.5] m"), "{turns}");
}
