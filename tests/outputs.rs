//! Quantities that complete runs report, against known values: moments and centres of
//! pressure, work and area of contacts, momentum and energy of bodies, stresses at elements and nodes,
//! derived quantities.

mod common;

use common::{Folder, Results, assert_says, near, run, shipped, stretch};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::{ReadPiece, VtuField, read_piece};

/// A block whose top is loaded more on one side stands on a floor without friction.
const ECCENTRIC: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 0.5], cells: [3, 2], element: KIND } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e11, poisson_ratio: 0.3 } }
    kinematics: linear
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact: { sole: { contactor: block.bottom, target: floor, normal: { penalty: { compliance: 1.0e-12 } } } }
boundary:
  guide: { on: block.top, displacement: { x: 0 } }
  load: { on: block.top, traction: { y: '-1.0e4 * (1 + x)' } }
time: { end: 1, scheme: { static: { increments: 2 } } }
";

/// The centre of pressure lies below the resultant of an eccentric load, to the accuracy of the balance
/// and with every element on a coarse mesh, and the moment about the origin is that of the load.
#[test]
fn the_centre_of_pressure_is_below_an_eccentric_load() {
    for (kind, ranks) in [("quad4", 1), ("quad8", 3), ("tri3", 2), ("tri6", 1)] {
        let contact = Results::of(&ECCENTRIC.replace("KIND", kind), ranks).table("contact.csv");
        let [force, at] = [1.5e4, 5.0 / 9.0];
        near(&[contact.last("force_n"), contact.last("moment_z")], &[force, force * at], 1e-5);
        near(&[contact.last("centre_of_pressure_x")], &[at], 1e-5);
        assert!(contact.last("centre_of_pressure_y").abs() < 1e-5);
        // The contact is open at the start.
        assert!(contact.numbers("centre_of_pressure_x")[0].is_nan());
        assert_eq!(contact.numbers("moment_z")[0], 0.0);
    }
}

/// Friction that sticks is not distributed like the pressure, and does not enter the centre of pressure.
/// On a floor through the origin it has no moment, so that the centre is the moment over the force.
#[test]
fn friction_does_not_move_the_centre_of_pressure() {
    let friction =
        "friction: { coulomb: { coefficient: 0.9, regularization: { stick_stiffness: 1.0e12 } } } } }";
    let text = ECCENTRIC
        .replace("KIND", "quad4")
        .replace(
            "{ penalty: { compliance: 1.0e-12 } } } }",
            &format!("{{ penalty: {{ compliance: 1.0e-12 }} }}, {friction}"),
        )
        .replace("displacement: { x: 0 }", "displacement: { x: 5.0e-8 }");
    let contact = Results::of(&text, 2).table("contact.csv");
    let force = ["force_x", "force_y"].map(|column| contact.last(column));
    assert!(force[0].abs() > 0.1 * force[1] && contact.last("stick") > 0.0, "{force:?}");
    near(&[contact.last("centre_of_pressure_x")], &[contact.last("moment_z") / force[1]], 1e-6);
}

/// A rigid body that carries two blocks has one centre of pressure, below the resultant of both loads.
#[test]
fn a_rigid_body_has_the_centre_of_all_its_pressures() {
    let blocks = ECCENTRIC.replace("KIND", "quad4");
    let (head, tail) = blocks.split_once("obstacles:").expect("a floor");
    let (_, block) = head.split_once("  block:").expect("a block");
    let other = block.replace("min: [0, 0], max: [1, 0.5]", "min: [2, 0], max: [3, 0.5]");
    let text = format!("{head}  other:{other}rigid:{tail}")
        .replace("floor: { plane: { point: [0, 0], normal: [0, 1] } }", "floor: { shape: { plane: { point: [0, 0], normal: [0, 1] } } }")
        .replace("contact: { sole:", "contact:\n  second: { contactor: other.bottom, target: floor, normal: { penalty: { compliance: 1.0e-12 } } }\n  sole:")
        .replace("1.0e-12 } } } }\nboundary", "1.0e-12 } } }\nboundary")
        .replace("on: block.top", "on: [block.top, other.top]");
    let rigid = Results::of(&text, 2).table("rigid.csv");
    // The integrals of 1 + x and x (1 + x) over both tops.
    let [force, moment] = [5.0, 29.0 / 3.0];
    near(&[-rigid.last("force_y")], &[1.0e4 * force], 1e-5);
    near(&[rigid.last("centre_of_pressure_x")], &[moment / force], 1e-5);
    assert!(rigid.last("centre_of_pressure_y").abs() < 1e-5);
    assert!(rigid.numbers("centre_of_pressure_x")[0].is_nan());
}

/// A block is pressed by a linear load on a floor with damping, and slides.
const DAMPED: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, -1.0e-3], max: [10, 0.099], cells: [4, 1], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e9, poisson_ratio: 0 } }
    density: 1
    kinematics: linear
    initial_velocity: [0.2, -0.05]
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-3 } }
    friction: none
    damping: DAMPING
    area: reference
    initial_overclosure: accept
boundary: { load: { on: block.top, traction: { y: '-0.2 * x' } } }
time: { end: 2.0e-4, step: 1.0e-4, scheme: SCHEME }
";

/// Damping along the normal is part of the pressure, with its moment and its centre, in schemes whose
/// forces act over the step as well. Damping along the surface is part of the tangential force, and does
/// not enter the centre of pressure. The floor passes through the origin.
#[test]
fn resultants_contain_the_damping_of_a_contact() {
    let normal = "{ normal: { kelvin: { viscosity: 200 } } }";
    let both = "{ normal: { kelvin: { viscosity: 200 } }, tangential: 2.0e3 }";
    for scheme in ["conserving", "midpoint", "{ newmark: {} }"] {
        for (damping, is_tangential) in [(normal, false), (both, true)] {
            let text = DAMPED.replace("SCHEME", scheme).replace("DAMPING", damping);
            let contact = Results::of(&text, 2).table("contact.csv");
            // Damping stops the block within 5e-4 s.
            let of = |column: &str| contact.numbers(column)[1];
            let by_force =
                of("centre_of_pressure_x") * of("force_n") - of("centre_of_pressure_y") * of("force_x");
            near(&[of("moment_z")], &[by_force], 1e-3);
            near(&[of("force_t").abs()], &[of("force_x").abs()], 1e-3);
            // The stiffness alone has 10 N.
            assert!(of("force_n") > 20.0, "{scheme}: {}", of("force_n"));
            assert_eq!(of("force_x").abs() > 1.0, is_tangential, "{scheme}: {}", of("force_x"));
        }
    }
}

/// In space the load is eccentric along both axes.
#[test]
fn the_centre_of_pressure_in_space() {
    let space = ECCENTRIC
        .replace("dimension: 2", "dimension: 3")
        .replace(
            "min: [0, 0], max: [1, 0.5], cells: [3, 2]",
            "min: [0, 0, 0], max: [1, 1, 0.5], cells: [3, 2, 2]",
        )
        .replace("point: [0, 0], normal: [0, 1]", "point: [0, 0, 0], normal: [0, 0, 1]")
        .replace("displacement: { x: 0 }", "displacement: { x: 0, y: 0 }")
        .replace("traction: { y: '-1.0e4 * (1 + x)' }", "traction: { z: '-1.0e4 * (1 + x + 2 * y)' }");
    for (kind, ranks) in [("hex8", 2), ("tet4", 1), ("hex20", 3)] {
        let contact = Results::of(&space.replace("KIND", kind), ranks).table("contact.csv");
        let [force, x, y] = [2.5e4, 8.0 / 15.0, 17.0 / 30.0];
        let moment = ["moment_x", "moment_y", "moment_z"].map(|column| contact.last(column));
        near(&moment, &[force * y, -force * x, 0.0], 1e-5);
        let centre = ["x", "y", "z"].map(|axis| contact.last(&format!("centre_of_pressure_{axis}")));
        near(&centre, &[x, y, 0.0], 1e-5);
    }
}

/// A block that is pressed, bent and dragged on another one, whose lower side is clamped.
const DRAGGED: &str = "
dimension: 2
bodies:
  lower:
    mesh: { box: { min: [0, 0], max: [1.2, 0.4], cells: [7, 2], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
  upper:
    mesh: { box: { min: [0.2, 0.4], max: [0.9, 0.8], cells: [5, 3], element: ELEMENT } }
    material: { neo_hookean: { young_modulus: 2.0e7, poisson_ratio: 0.3 } }
contact:
  pair:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.0e-10 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e10 } } }
boundary:
  clamp: { on: lower.bottom, displacement: { x: 0, y: 0 } }
  drag: { on: upper.top, displacement: { x: '0.02 * t', y: '-0.01 * (1 + 0.3 * x) * t' } }
time: { end: 1, scheme: { static: { increments: 4 } } }
solver: { newton: { tolerance: 1.0e-10 } }
";

/// The moment of a contact with friction between bodies at large strain balances that of the support of
/// its contactor at the current positions. That of the support of the target differs from it by friction
/// times the penetration, and that of the pressure by the moment of the friction.
#[test]
fn moments_of_a_contact_balance_those_of_the_supports() {
    for (element, ranks) in [("quad4", 2), ("tri6", 1)] {
        let results = Results::of(&DRAGGED.replace("ELEMENT", element), ranks);
        let (contact, reactions) = (results.table("contact.csv"), results.table("reactions.csv"));
        let columns = ["force_x", "force_y", "moment_z"];
        let found = columns.map(|column| contact.last(column));
        let clamp = columns.map(|column| reactions.only("boundary", "clamp").last(column));
        let drag = columns.map(|column| -reactions.only("boundary", "drag").last(column));
        assert!(contact.last("force_t").abs() > 0.29 * contact.last("force_n"), "it slides");
        near(&found, &drag, 1e-8);
        near(&found[..2], &clamp[..2], 1e-8);
        let by_gap = contact.last("force_t").abs() * contact.last("max_penetration");
        assert!((found[2] - clamp[2]).abs() < 1.01 * by_gap, "{found:?}, {clamp:?}");
        let arm = contact.last("centre_of_pressure_x") * contact.last("force_y");
        assert!((found[2] - arm).abs() > 0.05 * arm.abs(), "friction has a moment about the origin");
    }
}

/// Two blocks that are pressed by 10 kN each and dragged over one floor with different friction.
const TWO_BLOCKS: &str = "
dimension: 2
bodies:
  rough:
    mesh: { box: { min: [0, 0], max: [1, 0.5], cells: [4, 2], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e8, poisson_ratio: 0.3 } }
    kinematics: linear
  smooth:
    mesh: { box: { min: [2, 0], max: [3, 0.5], cells: [3, 2], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e8, poisson_ratio: 0.3 } }
    kinematics: linear
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  much:
    contactor: rough.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-10 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e9 } } }
  little:
    contactor: smooth.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-10 } }
    friction: { coulomb: { coefficient: 0.1, regularization: { stick_stiffness: 1.0e9 } } }
boundary:
  press_rough: { on: rough.top, traction: { y: -1.0e4 } }
  press_smooth: { on: smooth.top, traction: { y: -1.0e4 } }
  drag_rough: { on: rough.left, displacement: { x: '0.01 * t' } }
  drag_smooth: { on: smooth.left, displacement: { x: '0.01 * t' } }
time: { end: 1, scheme: { static: { increments: 8 } } }
solver: { newton: { tolerance: 1.0e-11 }, linear: gmres_asm_ilu }
output: { bodies: true, checkpoint: { every: 4 } }
";

/// In a step of full sliding under a constant force each contact turns `mu N` times the path into heat,
/// while the elastic energy stays. The sums over the contacts are in `energy.csv`. A restart continues
/// the sums with the same bits.
#[test]
fn each_contact_has_its_own_heat() {
    let folder = Folder::new("heat");
    // The load is on from the start, and the path of the drag continues with it.
    let text = TWO_BLOCKS.replace("traction: { y: -1.0e4 }", "traction: { y: '-1.0e4 * min(1, 4 * t)' }");
    folder.write("case.yml", &text);
    run(2, &["case.yml", "-q", "-o", "out"], &folder).success();
    let results = Results(folder);
    let (contact, energy) = (results.table("contact.csv"), results.table("energy.csv"));
    let [much, little] = ["much", "little"].map(|name| contact.only("contact", name));
    for (contact, coefficient) in [(&much, 0.3), (&little, 0.1)] {
        let heat = contact.numbers("friction_work");
        let gain = heat[8] - heat[7];
        near(&[gain], &[coefficient * 1.0e4 * 0.01 / 8.0], 1e-6);
        // Only friction does work: the normal force and the elastic energy stay.
        let work = contact.numbers("work");
        near(&[work[8] - work[7]], &[-coefficient * 1.0e4 * 0.01 / 8.0], 1e-6);
        let stored = contact.numbers("stored");
        // A uniform pressure stores the least. The drag tilts the blocks a little.
        let least = 0.5 * 1.0e4 * (1.0e4 * 1.0e-10 + coefficient * coefficient * 1.0e4 / 1.0e9);
        assert!(
            stored[7..].iter().all(|stored| (1.0..1.1).contains(&(stored / least))),
            "{stored:?}, {least}"
        );
    }
    for (own, total) in [("friction_work", "friction_dissipated"), ("stored", "contact")] {
        let sum: Vec<f64> = much.numbers(own).iter().zip(little.numbers(own)).map(|(a, b)| a + b).collect();
        near(&sum, &energy.numbers(total), 1e-12);
    }
    let folder = results.0;
    run(2, &["case.yml", "-q", "-o", "branch", "--restart=out/checkpoints/step-000004.ckpt"], &folder)
        .success();
    for table in ["contact.csv", "energy.csv", "bodies.csv"] {
        let lines = |of: &str| -> Vec<String> {
            let text = std::fs::read_to_string(folder.join(of).join(table)).expect("a table");
            text.lines().map(str::to_owned).collect()
        };
        let (whole, branch) = (lines("out"), lines("branch"));
        assert!(branch.len() > 4);
        assert_eq!(branch[1..], whole[whole.len() + 1 - branch.len()..], "{table}");
    }
}

/// A neo-Hookean block that spreads under pressure: the tractions act on the undeformed area, and the
/// deformed area is the closed form.
#[test]
fn the_area_of_a_contact_is_known_undeformed_and_deformed() {
    let block = |axes: &str, size: &str, cells: &str, up: &str, slides: &str| {
        format!(
            "
dimension: {axes}
bodies:
  block:
    mesh: {{ box: {{ min: {size}, cells: {cells} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
obstacles: {{ floor: {{ plane: {{ {up} }} }} }}
contact:
  sole: {{ contactor: block.bottom, target: floor, area: reference, normal: {{ penalty: {{ compliance: 1.0e-12 }} }} }}
boundary:
  press: {{ on: block.top, pressure: 1.0e5 }}
  {slides}
time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-10 }} }}
"
        )
    };
    let plane = block(
        "2",
        "[0, 0], max: [0.4, 0.2]",
        "[3, 2]",
        "point: [0, 0], normal: [0, 1]",
        "wall: { on: block.left, displacement: { x: 0 } }",
    );
    let space = block(
        "3",
        "[0, 0, 0], max: [0.4, 0.3, 0.2]",
        "[3, 2, 2]",
        "point: [0, 0, 0], normal: [0, 0, 1]",
        "wall: { on: block.left, displacement: { x: 0 } }\n  side: { on: block.front, displacement: { y: 0 } }",
    );
    for (text, ranks, area, ratio) in [(plane, 2, 0.4, stretch(1)), (space, 3, 0.12, stretch(2).powi(2))] {
        let contact = Results::of(&text, ranks).table("contact.csv");
        near(&[contact.last("area"), contact.last("current_area")], &[area, area * ratio], 1e-6);
    }
}

/// Two bodies without contact that fly and spin, of which one is stiff.
const SPINNING: &str = "
dimension: 2
bodies:
  plate:
    mesh: { box: { min: [1, 2], max: [1.4, 2.2], cells: [4, 3], element: KIND } }
    material: { neo_hookean: { young_modulus: 1.0e9, poisson_ratio: 0.3 } }
    density: 1000
    mass: MASS
    initial_velocity: ['3 - 5 * (y - 2.1)', '-1 + 5 * (x - 1.2)']
  soft:
    mesh: { box: { min: [4, 0], max: [5, 1], cells: [2, 2], element: tri3 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 100
    initial_velocity: ['0.5 * (x - 4.5)', '-0.5 * (y - 0.5)']
time: { end: 0.002, step: 2.0e-4, scheme: midpoint }
solver: { newton: { tolerance: 1.0e-11 } }
output: { bodies: true, fields: { every: 0 } }
";

/// Mass, centre, momenta and energy of a body that spins freely: its angular momentum about the centre
/// is `I w`, its path straight. The sums over the bodies are those of all bodies, on any number of ranks.
#[test]
fn momenta_and_energies_of_single_bodies() {
    for (kind, mass, ranks) in
        [("quad4", "consistent", 1), ("quad8", "consistent", 3), ("quad4", "lumped", 2)]
    {
        let results = Results::of(&SPINNING.replace("KIND", kind).replace("MASS", mass), ranks);
        let all = results.table("bodies.csv");
        let plate = all.only("body", "plate");
        let start = |column: &str| plate.numbers(column)[0];
        let weight = 1000.0 * 0.4 * 0.2;
        // The mass is lumped to the corners of the elements, further outside than it is.
        let lumped = if mass == "lumped" { 2.0 / 3.0 * (0.01 + 0.04 / 9.0) / 4.0 } else { 0.0 };
        let inertia = weight * ((0.16 + 0.04) / 12.0 + lumped);
        near(&[start("mass"), start("centre_x"), start("centre_y")], &[weight, 1.2, 2.1], 1e-12);
        near(&[start("linear_x"), start("linear_y")], &[3.0 * weight, -weight], 1e-12);
        let about = 1.2 * -weight - 2.1 * 3.0 * weight;
        near(&[start("spin_z"), start("angular_z")], &[5.0 * inertia, about + 5.0 * inertia], 1e-12);
        near(&[start("kinetic")], &[0.5 * weight * 10.0 + 0.5 * inertia * 25.0], 1e-12);
        near(&plate.numbers("spin_z"), &[5.0 * inertia; 11], 1e-8);
        near(&[plate.last("centre_x"), plate.last("centre_y")], &[1.206, 2.098], 1e-9);
        let soft = all.only("body", "soft");
        assert!(soft.last("strain") > 1e-6 * soft.last("kinetic") && soft.last("spin_z").abs() < 1e-9);
        for (table, columns) in [
            ("momentum.csv", &["linear_x", "linear_y", "angular_z"][..]),
            ("energy.csv", &["kinetic", "strain"][..]),
        ] {
            for column in columns {
                let sum: Vec<f64> =
                    plate.numbers(column).iter().zip(soft.numbers(column)).map(|(a, b)| a + b).collect();
                near(&sum, &results.table(table).numbers(column), 1e-10);
            }
        }
    }
}

/// Two bodies side by side without contact. All sides are prescribed: a bent one whose stress is linear,
/// and one under a constant stress.
const BENT: &str = "
dimension: 2
bodies:
  bent:
    mesh: { box: { min: [0, 0], max: [1, 0.6], cells: [3, 2], element: KIND } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
  plain:
    mesh: { box: { min: [1, 0], max: [2, 0.6], cells: [2, 3], element: tri3 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
boundary:
  bend:
    on: [bent.left, bent.right, bent.bottom, bent.top]
    displacement: { x: '0.01 * x * y', y: '-0.005 * (x * x + 0.3 / 0.7 * y * y)' }
  pull:
    on: [plain.left, plain.right, plain.bottom, plain.top]
    displacement: { x: '0.2 * (x - 1) + 0.1 * y', y: 0 }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100, stresses: true } }
";

/// The numbers of a field.
#[track_caller]
fn numbers(field: &VtuField) -> &[f64] {
    match &field.values {
        VtuValues::Float64(numbers) => numbers,
        other => panic!("{other:?}"),
    }
}

/// The body of each point of a piece, and of each cell.
fn bodies_of(piece: &ReadPiece) -> (Vec<i32>, Vec<i32>) {
    let VtuValues::Int32(of_cells) = &piece.cell_data["body"].values else { panic!("no bodies") };
    let mut of_points = vec![-1; piece.points.len()];
    for (cell, body) in of_cells.iter().enumerate() {
        piece.cell(cell).iter().for_each(|&point| of_points[point as usize] = *body);
    }
    (of_points, of_cells.clone())
}

/// The nodal stress is exact where the stress is linear, with elements of second order, also on the
/// boundary of the body, of the part of a rank, and beside another body. It is exact where the stress is
/// constant, with every element. Principal stresses and stretches are those of the closed form.
#[test]
fn stresses_of_a_bent_and_of_a_plain_body_are_exact() {
    for (kind, ranks) in [("quad8", 1), ("quad9", 3), ("tri6", 2)] {
        let results = Results::of(&BENT.replace("KIND", kind), ranks);
        let mut plain = Vec::new();
        for rank in 0..ranks {
            let name = format!("out/fields/step_000002/volume_{rank:04}.vtu");
            let piece = read_piece(&results.0.join(name)).expect("a piece");
            let (of_points, of_cells) = bodies_of(&piece);
            let stress = numbers(&piece.point_data["nodal_stress"]).chunks_exact(6);
            let von_mises = numbers(&piece.point_data["nodal_von_mises"]);
            for (((place, stress), von_mises), body) in
                piece.points.iter().zip(stress).zip(von_mises).zip(&of_points)
            {
                if *body == 1 {
                    plain.push(stress.to_vec());
                    continue;
                }
                let along = 1.0e6 / (1.0 - 0.09) * 0.01 * place[1];
                let known = [along, 0.0, 0.3 * along, 0.0, 0.0, 0.0];
                let error = stress.iter().zip(known).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(error < 1e-9 * 6.6e3, "{kind} at {place:?}: {stress:?}, {known:?}");
                let equivalent = along * (1.0_f64 - 0.3 + 0.09).sqrt();
                assert!((von_mises - equivalent).abs() < 1e-9 * 6.6e3);
            }
            let cell = |name: &str, width: usize| -> Vec<Vec<f64>> {
                let all = numbers(&piece.cell_data[name]).chunks_exact(width);
                all.zip(&of_cells)
                    .filter(|(_, body)| **body == 1)
                    .map(|(values, _)| values.to_vec())
                    .collect()
            };
            // F = [1.2 0.1; 0 1]: the squares of the stretches have the sum 2.45 and the product 1.44.
            let root = (2.45_f64 * 2.45 - 4.0 * 1.44).sqrt();
            let known = [(0.5 * (2.45 + root)).sqrt(), 1.0, (0.5 * (2.45 - root)).sqrt()];
            let principal = cell("principal_stress", 3);
            let others =
                cell("von_mises", 1).into_iter().zip(cell("pressure", 1)).zip(cell("cauchy_stress", 6));
            for ((stretch, s), ((von_mises, pressure), cauchy)) in
                cell("principal_stretch", 3).iter().zip(&principal).zip(others)
            {
                near(stretch, &known, 1e-9);
                assert!(s[0] >= s[1] && s[1] >= s[2]);
                near(
                    &[s[0] + s[1] + s[2], -3.0 * pressure[0]],
                    &[cauchy[0] + cauchy[1] + cauchy[2]; 2],
                    1e-12,
                );
                let shear = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
                near(&von_mises, &[(0.5 * shear).sqrt()], 1e-9);
                // Principal axes of the stress are in the plane and along z.
                let product = s[0] * s[1] * s[2];
                near(&[product], &[cauchy[2] * (cauchy[0] * cauchy[1] - cauchy[3] * cauchy[3])], 1e-9);
                plain.push(cauchy);
            }
        }
        let first = plain[0].clone();
        assert!(first[0] > 1e5 && plain.len() >= 12 + 12);
        plain.iter().for_each(|stress| near(stress, &first, 1e-9));
    }
}

/// The apparent friction of a block that slides freely is its coefficient of friction, its deceleration
/// is `mu g`, and it has a value only while there is contact. The columns are those of the tables, in the
/// units of the case, on any number of ranks.
#[test]
fn the_apparent_friction_of_a_sliding_block() {
    let derived = "output:
  bodies: true
  derived:
    mu_app: contact.base.force_x / contact.base.force_n
    speed: bodies.block.linear_x / bodies.block.mass
    rear: probes.rear.v_x
    stored: 100 * (energy.total - energy.kinetic) / max(energy.total, 1)
    mixed: if(t > 0.005, momentum.linear_x + 2 * contact.base.points, contact.base.centre_of_pressure_x)
";
    for (case, ranks, speed, deceleration) in [
        ("sliding-block/case.yml", 1, 1.0, 0.5 * 9.81),
        ("sliding-block/case-mm.yml", 3, 1000.0, 0.5 * 9810.0),
    ] {
        let text = shipped(case, &[("end: 0.25", "end: 0.01"), ("output:\n", derived)]);
        let results = Results::of(&text, ranks);
        let table = results.table("derived.csv");
        assert_eq!(
            table.names().skip(2).collect::<Vec<_>>(),
            ["mu_app", "speed", "rear", "stored", "mixed"],
            "{case}"
        );
        let steps = table.len();
        near(&table.numbers("mu_app")[1..], &vec![-0.5; steps - 1], 1e-6);
        near(&[table.last("speed")], &[speed - 0.01 * deceleration], 1e-3);
        let [contact, momentum, energy] =
            ["contact.csv", "momentum.csv", "energy.csv"].map(|name| results.table(name));
        near(&table.numbers("rear"), &results.table("probes.csv").numbers("rear.v_x"), 1e-14);
        let total = energy.last("total");
        near(&[table.last("stored")], &[100.0 * (total - energy.last("kinetic")) / total.max(1.0)], 1e-12);
        let mixed = momentum.last("linear_x") + 2.0 * contact.last("points");
        near(&[table.last("mixed")], &[mixed], 1e-14);
        near(&table.numbers("mixed")[..2], &contact.numbers("centre_of_pressure_x")[..2], 1e-14);
    }
}

/// A quantity without a value is an empty field. A restart continues the table with the same bits, also
/// where the case may change.
#[test]
fn derived_quantities_continue_after_a_restart() {
    let folder = Folder::new("derived");
    let text = TWO_BLOCKS
        .replace("traction: { y: -1.0e4 }", "traction: { y: '-1.0e4 * min(1, 4 * t)' }")
        .replace("bodies: true,", "derived: { mu: abs(contact.much.force_t) / contact.much.force_n },");
    folder.write("case.yml", &text);
    run(2, &["case.yml", "-q", "-o", "out"], &folder).success();
    let read = || std::fs::read_to_string(folder.join("out/derived.csv")).expect("a table");
    let whole = read();
    let lines: Vec<&str> = whole.lines().collect();
    assert_eq!((lines.len(), lines[0], lines[1]), (10, "step,time [s],mu", "0,0,"));
    let last: f64 = lines[9].rsplit(',').next().and_then(|cell| cell.parse().ok()).expect("a number");
    near(&[last], &[0.3], 1e-9);
    let start = "--restart=out/checkpoints/step-000004.ckpt";
    run(2, &["case.yml", "-q", "-o", "out", start], &folder).success();
    assert_eq!(read(), whole);
    folder.write("other.yml", &text.replace("force_n }", "force_y }"));
    let refused = run(1, &["other.yml", "-q", "-o", "branch", start], &folder);
    assert_says(&refused.stderr, &["output.derived.mu"]);
}

/// Unknown columns, rows and tables are errors at their place in the expression, with a list of those that
/// exist, also of a probe that is not on a contactor.
#[test]
fn unknown_columns_are_refused_at_their_place() {
    let folder = Folder::new("derived");
    for (expression, fragments) in [
        ("1 + contact.much.force", &["case.yml:31:30", "unknown column", "contact.much.force_n"][..]),
        (
            "contact.most.force_n",
            &["case.yml:31:25", "unknown row 'contact.most'", "contact.much, contact.little"],
        ),
        ("contacts.much.force_n", &["unknown table 'contacts'", "contact, reactions"]),
        ("bodies.rough.mass", &["bodies.csv", "`bodies: true`"]),
        ("reactions.press_rough.force_x", &["unknown row", "reactions.drag_rough"]),
        ("probes.high.gap", &["case.yml:31:25", "unknown column 'probes.high.gap'", "probes.high.u_x"]),
        ("probes.low.status", &["unknown column", "probes.low.gap"]),
        ("x + 1", &["unknown name 'x'", "TABLE.NAME.COLUMN"]),
    ] {
        let output = format!(
            "output: {{ derived: {{ q: '{expression}' }}, probes: {{ high: {{ at: [0, 0.5] }}, low: {{ at: [0, 0] }} }} }}"
        );
        let text = TWO_BLOCKS.replace("output: { bodies: true, checkpoint: { every: 4 } }", &output);
        assert!(text.lines().nth(30).is_some_and(|line| line.starts_with("output: { derived")));
        folder.write("case.yml", &text);
        for arguments in [&["case.yml", "-q", "-o", "out"][..], &["check", "case.yml"]] {
            let refused = run(0, arguments, &folder);
            assert_eq!(refused.code, Some(3), "{expression}: {}", refused.text());
            assert_says(&refused.stderr, fragments);
        }
    }
}

/// A block under a traction, a pressure that follows its side and its weight.
const LOADED: &str = "
dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, 0], max: [1, 1, 0.5], cells: [3, 2, 2], element: hex8 } }
    material: { neo_hookean: { young_modulus: YOUNG, poisson_ratio: 0.3 } }
    density: 1000
boundary:
  base: { on: block.bottom, displacement: { x: 0, y: 0, z: 0 } }
  top: { on: block.top, traction: { z: '-1.0e4 * (1 + x) * t' } }
  side: { on: block.right, pressure: '2.0e4 * t' }
  weight: { on: block, gravity: [0, 0, -10] }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { loads: true, derived: { share: 'loads.top.force_z / loads.weight.force_z' } }
";

/// `loads.csv` has the totals of a stiff block, each at its centre. The line of action of the force
/// of the support passes through its centre. A soft block balances in forces and moments, on 1 and
/// 3 ranks.
#[test]
fn resultants_of_loads_and_supports() {
    let stiff = Results::of(&LOADED.replace("YOUNG", "1.0e13"), 1);
    let loads = stiff.table("loads.csv");
    for (name, force, centre) in [
        ("top", [0.0, 0.0, -1.5e4], [5.0 / 9.0, 0.5, 0.5]),
        ("side", [-1.0e4, 0.0, 0.0], [1.0, 0.5, 0.25]),
        ("weight", [0.0, 0.0, -5.0e3], [0.5, 0.5, 0.25]),
    ] {
        let load = loads.only("boundary", name);
        let of = |column: &str| ["x", "y", "z"].map(|axis| load.last(&format!("{column}_{axis}")));
        near(&of("force"), &force, 1e-7);
        near(&of("centre"), &centre, 1e-7);
    }
    // Statics begins without loads.
    assert!(loads.numbers("force_z")[..3].iter().all(|force| *force == 0.0));
    near(&[stiff.table("derived.csv").last("share")], &[3.0], 1e-6);
    let base = stiff.table("reactions.csv").only("boundary", "base");
    let of = |column: &str| ["x", "y", "z"].map(|axis| base.last(&format!("{column}_{axis}")));
    let [force, centre] = ["force", "centre"].map(of);
    near(&force, &[1.0e4, 0.0, 2.0e4], 1e-6);
    near(&[centre[1]], &[0.5], 1e-6);
    // The moment of the loads about y balances that of the support.
    let moment = centre[2] * force[0] - centre[0] * force[2];
    near(&[moment], &[-(1.5e4 * 5.0 / 9.0 + 5.0e3 * 0.5) + 1.0e4 * 0.25], 1e-6);
    for ranks in [1, 3] {
        let soft = Results::of(&LOADED.replace("YOUNG", "3.0e5"), ranks);
        let [loads, reactions] = ["loads.csv", "reactions.csv"].map(|name| soft.table(name));
        for column in ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"] {
            let of = |name: &str| loads.only("boundary", name).last(column);
            let sum = of("top") + of("side") + of("weight") + reactions.last(column);
            assert!(sum.abs() < 1e-5, "{column}: {sum}");
        }
        assert!(loads.only("boundary", "side").last("force_z").abs() > 100.0, "the pressure does not follow");
    }
}
