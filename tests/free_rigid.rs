//! Rigid bodies that forces move: rolling and sliding, the free top, pressing by a force, Hertz's
//! contact, momentum and energy, ranks, restart.

mod common;

use common::{Folder, Results, Table, assert_says, run};

/// Largest difference of two columns, relative to the largest value of the first.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    assert!(one.len() == other.len() && !one.is_empty());
    let largest = one.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(one.iter().chain(other).all(|value| value.is_finite()));
    one.iter().zip(other).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / largest
}

/// Slope of a column over time from `from` on, by least squares.
fn slope(table: &Table, column: &str, from: f64) -> f64 {
    let rows = table.numbers("time").into_iter().zip(table.numbers(column));
    let rows: Vec<(f64, f64)> = rows.filter(|(t, _)| *t >= from).collect();
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
    let (t, y) = (mean(&|row| row.0), mean(&|row| row.1));
    mean(&|row| (row.0 - t) * (row.1 - y)) / mean(&|row| (row.0 - t).powi(2))
}

/// A disc of radius 0.1 m on an incline with gravity 2 m/s2 along and 9 m/s2 against it.
fn incline(friction: f64) -> String {
    format!(
        "dimension: 2
bodies:
  ramp:
    mesh: {{ box: {{ min: [0, -0.04], max: [0.8, 0], cells: [160, 2] }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e+7, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  disc:
    shape: {{ sphere: {{ center: [0.2, 0.1], radius: 0.1 }} }}
    free:
      density: 1000
      gravity: ['2 * min(1, t / 0.02)', '-9 * min(1, t / 0.02)']
contact:
  roll:
    contactor: ramp.top
    target: disc
    friction: {{ coulomb: {{ coefficient: {friction}, regularization: {{ stick_stiffness: 1.0e+9 }} }} }}
boundary: {{ clamp: {{ on: ramp.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: 0.4, step: 0.002, scheme: {{ generalized_alpha: {{ spectral_radius: 0.5 }} }} }}
output: {{ fields: {{ every: 100000 }} }}
"
    )
}

/// A disc that sticks rolls with two thirds of the acceleration of a point mass. Beyond the limit of
/// friction, `mu = tan(slope) / 3`, it slides with Coulomb's friction, which also turns it.
#[test]
fn a_disc_rolls_or_slides_down_an_incline() {
    let [rolls, slides] = [0.5, 0.05].map(|friction| Results::of(&incline(friction), 1).table("rigid.csv"));
    let a = slope(&rolls, "velocity_x", 0.1);
    assert!((a / (2.0 / 3.0 * 2.0) - 1.0).abs() < 0.02, "rolls with {a}");
    let turn = slope(&rolls, "spin_z", 0.1);
    assert!((turn / (-2.0 / 3.0 * 2.0 / 0.1) - 1.0).abs() < 0.02, "rolls with {turn}");
    let a = slope(&slides, "velocity_x", 0.1);
    assert!((a / (2.0 - 0.05 * 9.0) - 1.0).abs() < 0.02, "slides with {a}");
    let turn = slope(&slides, "spin_z", 0.1);
    assert!((turn / (-2.0 * 0.05 * 9.0 / 0.1) - 1.0).abs() < 0.02, "turns with {turn}");
}

/// A free symmetric top beside a block at rest.
fn top(step: f64, scheme: &str) -> String {
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0, 0], max: [1, 1, 1], cells: [1, 1, 1] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  top:
    shape: {{ sphere: {{ center: [3, 0, 0], radius: 0.5 }} }}
    free:
      mass: 2
      inertia: [1, 1, 1.5]
      initial_velocity: [0.5, -0.25, 0]
      initial_spin: [2, 0, 3]
boundary: {{ clamp: {{ on: block, displacement: {{ x: 0, y: 0, z: 0 }} }} }}
time: {{ end: 2, step: {step}, scheme: {scheme} }}
output: {{ fields: {{ every: 100000 }} }}
"
    )
}

/// The angular velocity of a symmetric top precesses about the angular momentum at the rate `|L| /
/// J_1`. Angular velocity, energy and angular momentum converge with order two, and the linear momentum is
/// exact.
#[test]
fn a_free_top_precesses() {
    let momentum = nalgebra::Vector3::new(2.0, 0.0, 4.5);
    let axis = nalgebra::Unit::new_normalize(momentum);
    let turn = nalgebra::Rotation3::from_axis_angle(&axis, 2.0 * momentum.norm());
    let exact = turn * nalgebra::Vector3::new(2.0, 0.0, 3.0);
    for scheme in [
        "{ newmark: { beta: 0.25, gamma: 0.5 } }",
        "midpoint",
        "{ generalized_alpha: { spectral_radius: 0.8 } }",
        "{ hht: { spectral_radius: 0.8 } }",
    ] {
        let errors = [0.02, 0.01].map(|step| {
            let results = Results::of(&top(step, scheme), 1);
            let [rigid, momenta, energy] =
                ["rigid.csv", "momentum.csv", "energy.csv"].map(|name| results.table(name));
            let read = |table: &Table, name: &str| {
                nalgebra::Vector3::from(["x", "y", "z"].map(|axis| table.last(&format!("{name}_{axis}"))))
            };
            let velocity = read(&rigid, "velocity") - nalgebra::Vector3::new(0.5, -0.25, 0.0);
            assert!(velocity.norm() < 1e-12);
            assert!((read(&momenta, "linear") - nalgebra::Vector3::new(1.0, -0.5, 0.0)).norm() < 1e-12);
            // The centre of mass moves on a line through (3, 0, 0), about the origin.
            let spin = read(&momenta, "angular") - nalgebra::Vector3::new(0.0, 0.0, 3.0 * -0.5);
            // The block is at rest.
            assert!((read(&rigid, "linear") - read(&momenta, "linear")).norm() < 1e-9);
            assert!((read(&rigid, "angular") - spin).norm() < 1e-9, "{}", read(&rigid, "angular"));
            assert!((rigid.last("kinetic") - energy.last("kinetic")).abs() < 1e-9);
            let kinetic = 0.5 * (2.0 * 4.0 + 1.5 * 9.0) - 0.5 * 4.0 + 0.5 * 2.0 * (0.25 + 0.0625);
            [
                (read(&rigid, "spin") - exact).norm(),
                (spin - momentum).norm(),
                (energy.last("kinetic") - kinetic).abs(),
            ]
        });
        assert!(errors[1][0] < 0.02, "{scheme}: {errors:?}");
        let orders = [0, 1].map(|k| (errors[0][k] / errors[1][k]).log2());
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.1), "{scheme}: {errors:?} {orders:?}");
        assert!(errors[1][2] < 1e-3, "{scheme}: {errors:?}");
    }
}

/// A top whose tensor of inertia has products moves as the same top with its principal axes along x,
/// y and z, turned. Energy and angular momentum converge with order two.
#[test]
fn a_top_with_products_of_inertia_is_a_turned_top() {
    use nalgebra::{Matrix3, Rotation3, Vector3};
    let principal = Matrix3::from_diagonal(&Vector3::new(1.0, 1.2, 1.9));
    let turn = Rotation3::from_scaled_axis(Vector3::new(0.5, -0.9, 0.3));
    let spin = Vector3::new(2.0, -1.0, 3.0);
    let tops = |step: f64, scheme: &str| {
        let all = [(principal, spin), (turn * principal * turn.inverse(), turn * spin)];
        all.map(|(inertia, spin)| {
            let six = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|at| inertia[at]);
            let six = if inertia == principal { six[..3].to_vec() } else { six.to_vec() };
            let case = top(step, scheme)
                .replace("inertia: [1, 1, 1.5]", &format!("inertia: {six:?}"))
                .replace("initial_spin: [2, 0, 3]", &format!("initial_spin: {:?}", spin.as_slice()));
            let results = Results::of(&case, 1);
            let [rigid, momenta, energy] =
                ["rigid.csv", "momentum.csv", "energy.csv"].map(|name| results.table(name));
            let read = |table: &Table, name: &str| {
                Vector3::from(["x", "y", "z"].map(|axis| table.last(&format!("{name}_{axis}"))))
            };
            let orbit = Vector3::new(0.0, 0.0, 3.0 * -0.5);
            (read(&rigid, "spin"), read(&momenta, "angular") - orbit, energy.last("kinetic"))
        })
    };
    let momentum = principal * spin;
    let kinetic = 0.5 * spin.dot(&momentum) + 0.5 * 2.0 * (0.25 + 0.0625);
    for scheme in ["midpoint", "{ generalized_alpha: { spectral_radius: 0.8 } }"] {
        let errors = [0.02, 0.01].map(|step| {
            let [plain, turned] = tops(step, scheme);
            assert!((turn * plain.0 - turned.0).norm() < 1e-8, "{scheme}: {plain:?} {turned:?}");
            assert!((turn * plain.1 - turned.1).norm() < 1e-8, "{scheme}: {plain:?} {turned:?}");
            assert!((plain.2 - turned.2).abs() < 1e-8, "{scheme}: {plain:?} {turned:?}");
            [(turned.1 - turn * momentum).norm(), (turned.2 - kinetic).abs()]
        });
        let order = (errors[0][0] / errors[1][0]).log2();
        assert!((order - 2.0).abs() < 0.1, "{scheme}: {errors:?} {order}");
        assert!(errors[1][0] < 0.02 && errors[1][1] < 2e-3, "{scheme}: {errors:?}");
    }
}

/// A tetrahedron from a file has the mass, the centre of mass and the inertia of its density, and
/// moves about this centre: equal on 1 and 3 ranks.
#[test]
fn a_density_gives_a_surface_its_mass() {
    let folder = Folder::new("free-surface");
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut stl = String::from("solid t\n");
    for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        stl += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in face.map(|k: usize| corners[k]) {
            stl += &format!("vertex {x} {y} {z}\n");
        }
        stl += "endloop\nendfacet\n";
    }
    folder.write("tetra.stl", &(stl + "endsolid t\n"));
    let case = top(0.02, "midpoint")
        .replace(
            "{ sphere: { center: [3, 0, 0], radius: 0.5 } }",
            "{ surface: { file: tetra.stl, position: [3, 0, 0] } }",
        )
        .replace("mass: 2\n", "density: 600\n")
        .replace("      inertia: [1, 1, 1.5]\n", "");
    folder.write("case.yml", &case);
    let tables = [1, 3].map(|ranks| {
        let out = format!("results-{ranks}");
        run(ranks, &["case.yml", "--output", &out], &folder).success();
        ["rigid.csv", "momentum.csv"].map(|name| Table::read(&folder.join(&out).join(name)))
    });
    let [rigid, momenta] = &tables[0];
    for (axis, at) in [("x", 3.25), ("y", 0.25), ("z", 0.25)] {
        assert!((rigid.numbers(&format!("position_{axis}"))[0] - at).abs() < 1e-12);
    }
    // Mass 100 kg. About the centroid the moments are m (1/10 - 1/16) 2, and the products m / 80.
    let inertia = nalgebra::Matrix3::from_fn(|i, j| if i == j { 7.5 } else { 1.25 });
    let position = nalgebra::Vector3::new(3.25, 0.25, 0.25);
    let velocity = nalgebra::Vector3::new(0.5, -0.25, 0.0);
    let expected = position.cross(&velocity) * 100.0 + inertia * nalgebra::Vector3::new(2.0, 0.0, 3.0);
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let linear = momenta.numbers(&format!("linear_{axis}"));
        assert!(linear.iter().all(|value| (value - 100.0 * velocity[i]).abs() < 1e-10));
        assert!((momenta.numbers(&format!("angular_{axis}"))[0] - expected[i]).abs() < 1e-10);
        let spin = format!("spin_{axis}");
        assert!(apart(&rigid.numbers(&spin), &tables[1][0].numbers(&spin)) < 1e-10);
    }
}

/// A prescribed rotation that is not zero at the start is there from the start, while forces move
/// the body.
#[test]
fn a_prescribed_rotation_may_begin_anywhere() {
    let text = top(0.1, "midpoint")
        .replace(
            "    free:\n",
            "    motion: { rotation: { axis: [0, 3, 4], angle: '0.5 + 0.7 * t' } }\n    free:\n",
        )
        .replace("      initial_spin: [2, 0, 3]\n", "      force: { y: 4 }\n");
    let rigid = Results::of(&text, 1).table("rigid.csv");
    for (axis, share) in [("x", 0.0), ("y", 0.6), ("z", 0.8)] {
        let rows = rigid.numbers("time").into_iter().zip(rigid.numbers(&format!("rotation_{axis}")));
        let apart = rows.map(|(t, angle)| (angle - share * (0.5 + 0.7 * t)).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-12, "{axis}: {apart:e}");
    }
    // From -0.25 m/s, with 2 m/s2 over 2 s.
    assert!((rigid.last("velocity_y") - 3.75).abs() < 1e-9);
}

/// A disc that is pressed into a block in statics. `drive` is what moves it.
fn press(drive: &str, solver: &str) -> String {
    format!(
        "dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [-0.4, 0], max: [0.4, 0.3], cells: [48, 18] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: 0.4 }} }}
rigid:
  tool:
    shape: {{ sphere: {{ center: [0, 0.4], radius: 0.1 }} }}
    {drive}
contact:
  press:
    contactor: block.top
    target: tool
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 5.0e+10 }} }} }}
boundary: {{ clamp: {{ on: block.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 10 }} }} }}
solver: {{ linear: {solver}, newton: {{ tolerance: 1.0e-12, inexact: false }} }}
output: {{ fields: {{ every: 100000 }} }}
"
    )
}

/// A tool under force and torque carries exactly these, and moves as the tool with the prescribed
/// motion that has these forces. Its work is that of the applied loads.
#[test]
fn force_and_motion_are_two_sides_of_one_equilibrium() {
    let free = "free: { fixed: [ux], force: { y: '-1.0e+5 * t' }, torque: { z: '500 * t' } }";
    let results = Results::of(&press(free, "direct"), 1);
    let [forced, energy] = ["rigid.csv", "energy.csv"].map(|name| results.table(name));
    assert!((forced.last("force_y") / 1e5 - 1.0).abs() < 1e-8);
    assert!((forced.last("torque_z") / -500.0 - 1.0).abs() < 1e-8);
    let rows = |name: &str| -> String {
        let times = forced.numbers("time").into_iter().zip(forced.numbers(name));
        let offset = if name == "position_y" { 0.4 } else { 0.0 };
        let rows: Vec<String> = times.map(|(t, value)| format!("[{t}, {:e}]", value - offset)).collect();
        format!("{{ table: [{}] }}", rows.join(", "))
    };
    let motion = format!(
        "motion: {{ translation: {{ y: {} }}, rotation: {{ angle: {} }} }}",
        rows("position_y"),
        rows("rotation_z")
    );
    let moved = Results::of(&press(&motion, "direct"), 1).table("rigid.csv");
    for column in ["force_x", "force_y", "torque_z", "work"] {
        let apart = apart(&forced.numbers(column), &moved.numbers(column));
        assert!(apart < 1e-6, "{column}: {apart:e}");
    }
    let work = energy.last("external_work");
    assert!((work / forced.last("work") - 1.0).abs() < 0.01 && work > 1e3, "{work}");
}

/// A failed step names the tool if the loads lift it off its contact, and does not if they press it.
#[test]
fn a_tool_that_is_lifted_is_named() {
    let start = |force: &str| {
        press(&format!("free: {{ fixed: [ux, rz], force: {{ y: {force} }} }}"), "direct")
            .replace("center: [0, 0.4]", "center: [0, 0.398]")
            .replace("target: tool\n", "target: tool\n    initial_overclosure: accept\n")
            .replace("newton: {", "newton: { max_iterations: 2,")
    };
    for (force, lifted) in [("1.0e+5", true), ("-1.0e+6", false)] {
        let folder = Folder::new("lifted");
        folder.write("case.yml", &start(force));
        for ranks in [0, 3] {
            let output = run(ranks, &["case.yml", "-q"], &folder);
            assert_eq!(output.code, Some(5), "{force}: {}", output.text());
            assert_eq!(output.stderr.contains("'tool' along"), lifted, "{force}: {}", output.stderr);
        }
    }
}

/// A disc between a floor and a free lid. It touches neither: the nearest nodes are 0.01 mm from both.
/// `force` drives the lid \[N\].
fn under_a_lid(modulus: f64, force: f64) -> String {
    format!(
        "dimension: 2
units: {{ length: mm, mass: t, time: s }}
bodies:
  disc:
    mesh:
      box:
        min: [-1, -1]
        max: [1, 1]
        cells: [15, 15]
        map: {{ x: '10 * x * sqrt(1 - y^2 / 2)', y: '10 + 10 * y * sqrt(1 - x^2 / 2)' }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: {modulus}, poisson_ratio: 0.3 }} }}
rigid:
  floor: {{ shape: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }} }}
  lid:
    shape: {{ plane: {{ point: [0, 20], normal: [0, -1] }} }}
    free: {{ fixed: [ux, rz], force: {{ y: '{force} * t' }} }}
contact:
  bottom: {{ contactor: disc.bottom, target: floor, friction: none }}
  top: {{ contactor: disc.top, target: lid, friction: none }}
time: {{ end: 1, scheme: {{ static: {{ increments: 4 }} }} }}
output: {{ fields: {{ every: 0 }} }}
"
    )
}

/// Nothing carries the force on a lid before both gaps are closed. One attempt finds the equilibrium in
/// which floor and lid carry it.
#[test]
fn a_force_closes_the_gaps_on_both_sides_of_a_disc() {
    for (modulus, force, ranks) in [(10.0, 1.0, 1), (30.0, 20.0, 1), (30.0, 20.0, 2), (300.0, 20.0, 3)] {
        let results = Results::of(&under_a_lid(modulus, -force), ranks);
        let contact = results.table("contact.csv");
        for name in ["top", "bottom"] {
            let carried = contact.only("contact", name).last("force_n");
            let what = format!("{modulus} MPa on {ranks} ranks, {name}: {carried}");
            assert!((carried / force - 1.0).abs() < 1e-6, "{what}");
        }
        let attempts = results.table("iterations.csv").numbers("attempt");
        assert!(attempts.iter().all(|attempt| *attempt == 1.0), "{modulus} MPa on {ranks} ranks");
    }
}

/// The failed attempt names a lid that its force pulls away from a disc, and the force.
#[test]
fn a_lid_that_is_pulled_away_is_named() {
    for ranks in [1, 2] {
        let folder = Folder::new("lid");
        folder.write("case.yml", &under_a_lid(30.0, 20.0));
        let output = run(ranks, &["case.yml", "--output", "out"], &folder);
        assert_eq!(output.code, Some(5), "{}", output.text());
        let attempt = "step 1 of 2.500e-1 s failed";
        let told = output.stderr.lines().find(|line| line.starts_with(attempt)).unwrap_or_default();
        assert_says(told, &["nothing resists the motion of 'lid' along y", "driven by 5.000e0 N"]);
    }
}

/// Pressing by a force gives the same results with each solver and on 1 to 4 ranks.
#[test]
fn solvers_and_ranks_agree_on_a_free_body() {
    let free = "free: { fixed: [ux], force: { y: '-1.0e+5 * t' }, torque: { z: '500 * t' } }";
    let one = Results::of(&press(free, "direct"), 1).table("rigid.csv");
    for (solver, petsc, ranks) in [
        ("direct", "", 2),
        ("direct", "", 3),
        ("direct", "", 4),
        ("filtered_amg", "", 1),
        ("filtered_amg", "", 2),
        ("filtered_ilu", "", 1),
        ("filtered_ilu", "petsc: { filter_pc_type: asm }\n", 3),
        ("filtered_amg", "petsc: { filter_pc_type: asm }\n", 3),
        ("gmres_asm_ilu", "", 2),
        ("two_stage", "", 1),
    ] {
        let other = Results::of(&format!("{}\n{petsc}", press(free, solver)), ranks).table("rigid.csv");
        for column in ["force_y", "torque_z", "position_y", "rotation_z"] {
            let apart = apart(&one.numbers(column), &other.numbers(column));
            assert!(apart < 1e-8, "{solver} on {ranks}, {column}: {apart:e}");
        }
    }
}

/// A ball with spin falls obliquely on a free block, in 3D.
fn thrown(scheme: &str) -> String {
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [-0.2, -0.2, -0.1], max: [0.2, 0.2, 0], cells: [6, 6, 2] }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e+6, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  ball:
    shape: {{ sphere: {{ center: [0.01, -0.02, 0.1005], radius: 0.1 }} }}
    free:
      density: 2000
      initial_velocity: [0.3, 0.1, -1]
      initial_spin: [5, 20, -10]
contact:
  hit:
    contactor: block.top
    target: ball
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 1.0e+8 }} }} }}
time: {{ end: 0.02, step: 5.0e-4, scheme: {scheme} }}
solver: {{ newton: {{ tolerance: 1.0e-12, inexact: false }} }}
output: {{ fields: {{ every: 100000 }} }}
"
    )
}

/// In an impact the total linear momentum is exact, and the angular momentum converges with order
/// two. The energy is that of a contact that opens and closes between the ends of steps.
#[test]
fn an_impact_keeps_the_momentum() {
    let [coarse, fine] = [5e-4, 2.5e-4].map(|step| {
        let text = thrown("midpoint").replace("step: 5.0e-4", &format!("step: {step}"));
        let results = Results::of(&text, 1);
        let [momentum, energy, rigid] =
            ["momentum.csv", "energy.csv", "rigid.csv"].map(|name| results.table(name));
        let change = |column: &str| {
            let all = momentum.numbers(column);
            (all[all.len() - 1] - all[0]).abs()
        };
        let most = rigid.numbers("force_z").iter().fold(0.0_f64, |most, force| most.max(*force));
        assert!(most > 100.0 && energy.last("friction_dissipated") > 1e-2, "{most}");
        for axis in ["x", "y", "z"] {
            assert!(change(&format!("linear_{axis}")) < 1e-10 * 8.4, "{axis}");
        }
        let angular = ["x", "y", "z"].map(|axis| change(&format!("angular_{axis}")));
        let size = momentum.numbers("angular_y")[0].abs();
        (
            energy.last("numerical").abs() / energy.numbers("total")[0],
            angular.into_iter().fold(0.0, f64::max) / size,
        )
    });
    assert!(fine.0 < 0.01 && fine.1 < 1e-6, "{coarse:?} {fine:?}");
    assert!((coarse.1 / fine.1).log2() > 1.9, "{coarse:?} {fine:?}");
}

/// A ball in space moves equally on any number of ranks.
#[test]
fn a_ball_does_not_depend_on_the_number_of_ranks() {
    let text = thrown("{ generalized_alpha: { spectral_radius: 0.8 } }");
    let one = Results::of(&text, 1).table("rigid.csv");
    let staggered = text.replace("solver: {", "solver: { strategy: staggered,");
    let apart_by_stages = |column: &str| {
        let other = Results::of(&staggered, 2).table("rigid.csv");
        apart(&one.numbers(column), &other.numbers(column))
    };
    assert!(apart_by_stages("position_z") < 1e-6 && apart_by_stages("spin_x") < 1e-6);
    for ranks in [2, 3, 4, 8] {
        let other = Results::of(&text, ranks).table("rigid.csv");
        for column in ["position_z", "rotation_y", "spin_x", "force_z", "torque_y"] {
            let apart = apart(&one.numbers(column), &other.numbers(column));
            assert!(apart < 1e-7, "{column} on {ranks} ranks: {apart:e}");
        }
    }
}

/// A run that resumes from a checkpoint in the middle of an impact repeats the results of the
/// uninterrupted run: bit by bit on the same number of ranks, and to rounding on another.
#[test]
fn a_free_body_resumes() {
    let checkpoint = "checkpoint: { every: 7, keep: 10 }";
    let text = thrown("midpoint").replace("output: {", &format!("output: {{ {checkpoint},"));
    let text = text.replace("solver: {", "solver: { linear: gmres_asm_ilu,");
    let folder = Folder::new("free-resume");
    folder.write("case.yml", &text);
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let whole = Table::read(&folder.join("whole/rigid.csv"));
    let start = "--restart=whole/checkpoints/step-000028.ckpt";
    for ranks in [2, 3] {
        let branch = format!("branch-{ranks}");
        run(ranks, &["case.yml", "-q", "-o", &branch, start], &folder).success();
        let resumed = Table::read(&folder.join(format!("{branch}/rigid.csv")));
        for column in ["position_z", "rotation_y", "spin_x", "force_z", "work"] {
            let [all, rest] = [&whole, &resumed].map(|table| table.numbers(column));
            let all = &all[all.len() - rest.len()..];
            assert!(rest.len() == 12, "{}", rest.len());
            let apart = apart(all, &rest);
            assert!(apart < if ranks == 2 { 1e-300 } else { 1e-8 }, "{column} on {ranks}: {apart:e}");
        }
    }
}

/// A free disc far from a block, on springs and a dashpot.
fn on_springs(free: &str, time: &str) -> String {
    format!(
        "dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [0, -1], max: [1, 0], cells: [2, 2] }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e+7, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  disc:
    shape: {{ sphere: {{ center: [0.5, 1], radius: 0.1 }} }}
    free: {{ mass: 2, inertia: [0.01], fixed: [rz], {free} }}
contact: {{ far: {{ contactor: block.top, target: disc, friction: none }} }}
boundary: {{ clamp: {{ on: block.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {time}
output: {{ fields: {{ every: 100000 }}, checkpoint: {{ every: 50, keep: 10 }} }}
"
    )
}

/// A rigid body on a spring and a dashpot is the damped oscillator, to the second order of the scheme.
/// Its energy is in the ledger and its force in `reactions.csv`. Results are the same on several ranks.
#[test]
fn a_body_on_a_spring_oscillates() {
    let free = "spring: { stiffness: { x: 800, y: 200 }, damping: { x: 8 } }, initial_velocity: [3, 0]";
    let run = |step: f64, ranks| {
        let time = format!("{{ end: 0.5, step: {step}, scheme: {{ newmark: {{}} }} }}");
        let derived = "output: { derived: { pull: reactions.disc.spring.force_x / 2 },";
        Results::of(&on_springs(free, &time).replace("output: {", derived), ranks)
    };
    let (omega, xi) = (20.0f64, 0.1f64);
    let damped = omega * (1.0 - xi * xi).sqrt();
    let exact = |t: f64| 3.0 / damped * (-xi * omega * t).exp() * (damped * t).sin();
    let error = |results: &Results| (results.table("rigid.csv").last("position_x") - 0.5 - exact(0.5)).abs();
    let [coarse, fine] = [5e-3, 2.5e-3].map(|step| run(step, 1));
    let ratio = error(&coarse) / error(&fine);
    assert!(error(&coarse) < 2e-3 && (3.7..4.3).contains(&ratio), "{:e}, {ratio}", error(&coarse));
    let energy = coarse.table("energy.csv");
    let u = coarse.table("rigid.csv").last("position_x") - 0.5;
    assert!((energy.last("springs") / (400.0 * u * u) - 1.0).abs() < 1e-9);
    let whole = energy.last("total") + energy.last("damping_dissipated");
    assert!((whole / 9.0 - 1.0).abs() < 1e-9, "{whole} of 9 J");
    let reactions = coarse.table("reactions.csv");
    let row = reactions.texts("boundary").iter().rposition(|name| *name == "disc.spring").expect("a row");
    let v = coarse.table("rigid.csv").last("velocity_x");
    let force = -800.0 * u - 8.0 * v;
    assert!((reactions.numbers("force_x")[row] / force - 1.0).abs() < 1e-9);
    assert!((coarse.table("derived.csv").last("pull") / (0.5 * force) - 1.0).abs() < 1e-9);
    let several = run(5e-3, 3);
    let apart = several.table("rigid.csv").last("position_x") - 0.5 - u;
    assert!(apart.abs() < 1e-12, "{apart:e}");
}

/// In statics springs hold a free body along their directions, and a direction without any is named.
#[test]
fn springs_hold_a_free_body_in_statics() {
    let text = |stiffness: &str| {
        let free = format!("spring: {{ stiffness: {stiffness} }}, force: {{ x: '40 * t', y: '-10 * t' }}");
        on_springs(&free, "{ end: 1, scheme: { static: { increments: 2 } } }")
    };
    for ranks in [1, 3] {
        let rigid = Results::of(&text("{ x: 800, y: 200 }"), ranks).table("rigid.csv");
        let [x, y] = ["position_x", "position_y"].map(|name| rigid.last(name));
        assert!((x - 0.55).abs() < 1e-12 && (y - 0.95).abs() < 1e-12, "{x} {y}");
    }
    let folder = Folder::new("springs");
    folder.write("case.yml", &text("{ x: 800 }"));
    let output = run(1, &["case.yml", "-q"], &folder);
    assert_eq!(output.code, Some(5), "{}", output.text());
    assert!(output.text().contains("the motion of 'disc' along -y"), "{}", output.text());
}

/// A disc on a torsion spring and a dashpot is the damped oscillator of its angle, to the second order of the
/// scheme. Its energy is in the ledger and its torque in `reactions.csv`. In statics the spring holds the disc.
#[test]
fn a_torsion_spring_turns_a_body_back() {
    let turning =
        |free: &str, time: &str| on_springs(free, time).replace("fixed: [rz], ", "fixed: [ux, uy], ");
    let free = "torsion_spring: { stiffness: 4, damping: 0.04 }, initial_spin: [30]";
    let swing = |step: f64, ranks| {
        let time = format!("{{ end: 0.5, step: {step}, scheme: {{ newmark: {{}} }} }}");
        Results::of(&turning(free, &time), ranks)
    };
    // The moment of inertia is 0.01.
    let (omega, xi) = (20.0f64, 0.1f64);
    let damped = omega * (1.0 - xi * xi).sqrt();
    let exact = 30.0 / damped * (-xi * omega * 0.5).exp() * (damped * 0.5).sin();
    let angle = |results: &Results| results.table("rigid.csv").last("rotation_z");
    let [coarse, fine] = [5e-3, 2.5e-3].map(|step| swing(step, 1));
    let [error, finer] = [&coarse, &fine].map(|results| (angle(results) - exact).abs());
    assert!(error < 2e-2 && (3.7..4.3).contains(&(error / finer)), "{error:e}, {}", error / finer);
    let energy = coarse.table("energy.csv");
    let theta = angle(&coarse);
    assert!((energy.last("springs") / (2.0 * theta * theta) - 1.0).abs() < 1e-9);
    let whole = energy.last("total") + energy.last("damping_dissipated");
    assert!((whole / 4.5 - 1.0).abs() < 1e-9, "{whole} of 4.5 J");
    let torque = |results: &Results, column: &str| {
        let table = results.table("reactions.csv");
        let rows = table.texts("boundary");
        let row = rows.iter().rposition(|name| name.ends_with(".torsion_spring")).expect("a row");
        table.numbers(column)[row]
    };
    let expected = -4.0 * theta - 0.04 * coarse.table("rigid.csv").last("spin_z");
    assert!((torque(&coarse, "moment_z") / expected - 1.0).abs() < 1e-9);
    assert!((angle(&swing(5e-3, 3)) - theta).abs() < 1e-12);

    let held = "{ end: 1, scheme: { static: { increments: 2 } } }";
    let pushed = Results::of(&turning("torsion_spring: { stiffness: 4 }, torque: { z: '10 * t' }", held), 2);
    assert!((angle(&pushed) - 2.5).abs() < 1e-12 && (torque(&pushed, "moment_z") + 10.0).abs() < 1e-9);
    let refused = |free: &str, cause: &str| {
        let folder = Folder::new("torsion");
        folder.write("case.yml", &turning(free, held));
        let output = run(0, &["check", "case.yml"], &folder);
        assert!(output.code == Some(3) && output.stderr.contains(cause), "{}", output.text());
    };
    refused("torsion_spring: { damping: 4 }", "not allowed with the static scheme");
    refused("torsion_spring: { stiffness: -1 }", "must be >= 0");
    refused("torsion_spring: {}", "neither stiffness nor damping");
}

/// In space a torsion spring acts about the one axis that is free.
#[test]
fn a_torsion_spring_in_space_needs_one_axis() {
    let lever = |fixed: &str| {
        format!(
            "dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0, -1], max: [1, 1, 0], cells: [1, 1, 1] }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e+7, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  lever:
    shape: {{ capsule: {{ from: [0.2, 0.5, 1], to: [0.8, 0.5, 1], radius: 0.1 }} }}
    free:
      mass: 2
      inertia: [0.01, 0.02, 0.03]
      fixed: [{fixed}]
      initial_spin: [0, 30, 0]
      torsion_spring: {{ stiffness: 8 }}
contact: {{ far: {{ contactor: block.top, target: lever, friction: none }} }}
boundary: {{ clamp: {{ on: block.bottom, displacement: {{ x: 0, y: 0, z: 0 }} }} }}
time: {{ end: 0.5, step: 1.0e-3, scheme: {{ newmark: {{}} }} }}
output: {{ fields: {{ every: 100000 }} }}
"
        )
    };
    let results = Results::of(&lever("ux, uy, uz, rx, rz"), 2);
    let theta = results.table("rigid.csv").last("rotation_y");
    assert!((theta - 1.5 * 10.0f64.sin()).abs() < 1e-3, "{theta}");
    let energy = results.table("energy.csv");
    assert!((energy.last("springs") / (4.0 * theta * theta) - 1.0).abs() < 1e-9);
    assert!((energy.last("total") / 9.0 - 1.0).abs() < 1e-9, "{}", energy.last("total"));
    let folder = Folder::new("axes");
    folder.write("case.yml", &lever("ux, uy, uz, rx"));
    let output = run(0, &["check", "case.yml"], &folder);
    assert!(output.code == Some(3) && output.stderr.contains("2 are free"), "{}", output.text());
}

/// In space the springs act along the fixed axes while the body turns.
#[test]
fn springs_of_a_ball_do_not_turn_with_it() {
    let text = "dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, -1], max: [1, 1, 0], cells: [1, 1, 1] } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e+7, poisson_ratio: 0.3 } }
    density: 1000
rigid:
  ball:
    shape: { sphere: { center: [0.5, 0.5, 1], radius: 0.1 } }
    free:
      mass: 2
      inertia: [0.01, 0.02, 0.03]
      initial_velocity: [3, 0, 0]
      initial_spin: [5, 40, 3]
      spring: { stiffness: { x: 800, y: 50, z: 3000 } }
contact: { far: { contactor: block.top, target: ball, friction: none } }
boundary: { clamp: { on: block.bottom, displacement: { x: 0, y: 0, z: 0 } } }
time: { end: 0.5, step: 1.0e-3, scheme: { newmark: {} } }
output: { fields: { every: 100000 } }
";
    let [alone, several] = [1, 2].map(|ranks| Results::of(text, ranks).table("rigid.csv"));
    let x = alone.last("position_x") - 0.5;
    assert!((x - 3.0 / 20.0 * 10.0f64.sin()).abs() < 1e-4, "{x}");
    for axis in ["y", "z"] {
        let moved = alone.last(&format!("position_{axis}")) - if axis == "y" { 0.5 } else { 1.0 };
        assert!(moved.abs() < 1e-12, "{axis}: {moved:e}");
    }
    assert!((several.last("position_x") - 0.5 - x).abs() < 1e-12);
}
