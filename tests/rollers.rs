//! Rollers, supports along directions that are not axes, in complete runs: bodies that are turned with
//! their supports give the turned results, exact states between inclined planes, a ring that turns on a
//! round guide, mistakes, and equal results on any number of ranks and after a restart.

mod common;

use common::{Folder, Results, assert_says, near, run};

/// A piece of a sphere, in 2D of a disc, between inclined planes through the origin, under the follower
/// pressure `p` on its other two faces. It contracts uniformly about the origin.
fn sector(dimension: usize, element: &str, more: &str) -> String {
    let (bounds, map, faces) = match dimension {
        2 => (
            "min: [1, 0], max: [2, 1], cells: [4, 3]",
            "{ y: '(0.2 + 0.6 * y) * x' }",
            ["bottom", "top"].as_slice(),
        ),
        _ => (
            "min: [1, 0, 0], max: [2, 1, 1], cells: [3, 2, 2]",
            "{ y: '(0.2 + 0.6 * y) * x', z: '(0.3 * y + 0.5 * z) * x' }",
            ["bottom", "top", "front", "back"].as_slice(),
        ),
    };
    let rollers: String =
        faces.iter().map(|face| format!("  {face}: {{ on: piece.{face}, roller: {{}} }}\n")).collect();
    format!(
        "
dimension: {dimension}
bodies:
  piece:
    mesh: {{ box: {{ {bounds}, element: {element}, map: {map} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
boundary:
{rollers}  inside: {{ on: piece.left, pressure: 2.0e5 }}
  outside: {{ on: piece.right, pressure: 2.0e5 }}
time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-12 }}, {more} }}
output: {{ probes: {{ tip: {{ at: POINT }} }} }}
"
    )
    .replace("POINT", if dimension == 2 { "[2, 1.6]" } else { "[2, 1.6, 1.6]" })
}

/// Stretch at which a neo-Hookean body under plane strain, or in space, has the pressure `p`.
fn contraction(dimension: i32, p: f64) -> f64 {
    let mu = 1.0e6 / 2.6;
    let lambda = 1.0e6 * 0.3 / (1.3 * 0.4);
    // Cauchy stress (mu (l^2 - 1) + lambda ln J) / J with J = l^dimension.
    let excess = |l: f64| {
        let j = l.powi(dimension);
        (mu * (l * l - 1.0) + lambda * j.ln()) / j + p
    };
    let (mut low, mut high) = (0.5, 1.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { high = middle } else { low = middle }
    }
    low
}

/// The contraction is exact with elements that integrate it exactly, also at edges where two planes meet, with every linear
/// solver and on any number of ranks. The plane carries the pressure on its area.
#[test]
fn a_piece_of_a_sphere_contracts_uniformly() {
    for (dimension, element, more, ranks) in [
        (2, "quad4", "", 1),
        (2, "tri6", "", 2),
        (2, "quad9", "linear: gmres_asm_ilu", 3),
        (3, "hex8", "linear: gmres_asm_ilu", 4),
        (3, "hex8", "linear: filtered_amg", 2),
        (3, "tet4", "", 1),
        (3, "hex20", "", 2),
        (3, "wedge6", "", 2),
        (3, "pyramid5", "", 3),
    ] {
        let results = Results::of(&sector(dimension, element, more), ranks);
        let change = contraction(dimension as i32, 2.0e5) - 1.0;
        let probes = results.table("probes.csv");
        let found = ["tip.u_x", "tip.u_y"].map(|column| probes.last(column));
        near(&found, &[2.0 * change, 1.6 * change], 1e-9);
        // The lower plane lies between the radii 1 and 2, with the normal (0.2, -1) / |.|.
        if dimension == 2 {
            let reactions = results.table("reactions.csv").only("boundary", "bottom");
            let length = 1.0 + change;
            let found = ["force_x", "force_y"].map(|column| reactions.last(column));
            near(&found, &[-0.2 * 2.0e5 * length, 2.0e5 * length], 1e-9);
        }
    }
}

/// Marks a case without friction.
const FRICTIONLESS: &str = "\n# frictionless";

/// A block on the floor with an obstacle to press on. `c` and `s` are cosine and sine of the angle
/// by which everything is turned.
const PRESSED: &str = "
dimension: 2
parameters: { c: COSINE, s: SINE }
bodies:
  block:
    mesh:
      box: { min: [0, 0], max: [1, 0.5], cells: [6, 3], element: quad4, map: { x: 'c * x - s * y', y: 's * x + c * y' } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    DAMPING
obstacles:
  stamp: { plane: { point: POINT, normal: NORMAL } }
boundary:
  left: { on: block.left, SUPPORT_LEFT }
  floor: { on: block.bottom, SUPPORT_FLOOR }
contact:
  top:
    contactor: block.top
    target: stamp
    initial_overclosure: accept
    friction: { coulomb: { coefficient: 0.4, regularization: { stick_stiffness: 1.0e8 } } }
    normal: { penalty: { compliance: 1.0e-8 } }
TIME
output: { probes: { corner: { at: CORNER } }, checkpoint: { every: 5 } }
";

/// The friction of this block.
const FRICTION: &str = "{ coulomb: { coefficient: 0.4, regularization: { stick_stiffness: 1.0e8 } } }";

fn pressed(turned: bool, time: &str) -> String {
    let (cosine, sine) = if turned { (0.8, 0.6) } else { (1.0, 0.0) };
    let turn = |x: f64, y: f64| format!("[{}, {}]", cosine * x - sine * y, sine * x + cosine * y);
    let support = |motion: &str, axis: &str| match turned {
        true => format!("roller: {{ {motion} }}"),
        false => format!(
            "displacement: {{ {axis}: {} }}",
            if motion.is_empty() { "0" } else { "'0.03 * sin(3 * t)'" }
        ),
    };
    PRESSED
        .replace("COSINE", &cosine.to_string())
        .replace("SINE", &sine.to_string())
        .replace("POINT", &turn(0.0, 0.49))
        .replace("NORMAL", &turn(0.0, -1.0))
        .replace("CORNER", &turn(1.0, 0.5))
        .replace("SUPPORT_LEFT", &support("displacement: '-0.03 * sin(3 * t)'", "x"))
        .replace("SUPPORT_FLOOR", &support("", "y"))
        .replace(
            "DAMPING",
            if time.contains("static") {
                ""
            } else {
                "damping: { rayleigh: { mass: 5, stiffness: 5.0e-3 } }"
            },
        )
        .replace("TIME", time)
        .replace(if time.contains(FRICTIONLESS) { FRICTION } else { "none" }, "none")
}

/// In statics and with every scheme, with both strategies and every preconditioner, under friction and
/// damping, the turned block moves like the block along the axes, and its energies are the same.
#[test]
fn a_turned_block_moves_like_the_straight_one() {
    let dynamic = |scheme: &str, solver: &str| {
        let time = format!("time: {{ end: 0.4, step: 0.02, scheme: {scheme} }}");
        format!("{time}\nsolver: {{ newton: {{ tolerance: 1.0e-11 }}, {solver} }}")
    };
    let newmark = "{ newmark: { beta: 0.25, gamma: 0.5 } }";
    let static_time = "time: { end: 0.4, scheme: { static: { increments: 8 } } }";
    for (time, friction, ranks) in [
        (format!("{static_time}\nsolver: {{ newton: {{ tolerance: 1.0e-11 }} }}"), true, 2),
        (dynamic("{ generalized_alpha: { spectral_radius: 0.8 } }", "linear: gmres_asm_ilu"), true, 3),
        (dynamic("{ hht: { spectral_radius: 0.8 } }", "linear: gmres_asm_ilu1"), true, 4),
        (dynamic("backward_euler", "linear: two_stage"), true, 2),
        (dynamic(newmark, ""), true, 1),
        (dynamic("midpoint", "linear: filtered_amg"), true, 2),
        (dynamic("conserving", ""), true, 1),
        (dynamic("midpoint", "strategy: staggered"), true, 1),
        (dynamic(newmark, "linear: cholesky"), false, 1),
        (dynamic(newmark, "linear: cg_icc"), false, 2),
        (dynamic(newmark, "linear: cg_filtered_amg"), false, 3),
        (dynamic(newmark, "linear: gmres_amg"), false, 1),
        (dynamic(newmark, "linear: cg_amg"), false, 2),
        (dynamic(newmark, "linear: cg_jacobi"), false, 1),
    ] {
        let time = if friction { time } else { time + FRICTIONLESS };
        let straight = Results::of(&pressed(false, &time), 1);
        let turned = Results::of(&pressed(true, &time), ranks);
        let columns = ["corner.u_x", "corner.u_y"];
        let [x, y] = columns.map(|column| straight.table("probes.csv").last(column));
        let found = columns.map(|column| turned.table("probes.csv").last(column));
        near(&found, &[0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y], 1e-6);
        let reaction = |results: &Results, boundary: &str| {
            let table = results.table("reactions.csv").only("boundary", boundary);
            ["force_x", "force_y"].map(|column| table.last(column))
        };
        for boundary in ["left", "floor"] {
            let [x, y] = reaction(&straight, boundary);
            near(&reaction(&turned, boundary), &[0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y], 1e-5);
        }
        let energy = |results: &Results| {
            ["external_work", "strain", "friction_dissipated"]
                .map(|column| results.table("energy.csv").last(column))
        };
        near(&energy(&turned), &energy(&straight), 1e-5);
        // The tangent and the first guess are those of the straight block. Iterative solvers round
        // differently.
        let iterations = |results: &Results| results.table("iterations.csv").len();
        let counts = [iterations(&turned), iterations(&straight)];
        let apart = if time.contains("linear") { 2 } else { 0 };
        assert!(counts[0].abs_diff(counts[1]) <= apart, "{counts:?} in {time}");
    }
}

/// One slice of a thick pipe under internal pressure, between planes through its axis, follows Lame's
/// solution for plane strain. The errors are those of the table in docs/how-to/rollers.md.
#[test]
fn a_slice_of_a_pipe_follows_lame() {
    let case = "
dimension: 3
bodies:
  pipe:
    mesh:
      box:
        min: [1, -HALF, 0]
        max: [2, HALF, 0.1]
        cells: [CELLS, 1, 1]
        element: KIND
        map: { x: 'x * cos(y * pi / 180)', y: 'x * sin(y * pi / 180)' }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
boundary:
  sides: { on: [pipe.front, pipe.back], roller: {} }
  ends: { on: [pipe.bottom, pipe.top], displacement: { z: 0 } }
  inside: { on: pipe.left, pressure: 1000 }
time: { end: 1, scheme: { static: { increments: 1 } } }
output: { probes: { inside: { at: [1, 0, 0] }, outside: { at: [2, 0, 0] } } }
";
    // Radii 1 and 2: u = p (1 + nu) / (3 E) ((1 - 2 nu) r + 4 / r).
    let exact = |r: f64| 1000.0 * 1.3 / 3.0e6 * (0.4 * r + 4.0 / r);
    for (kind, half, cells, known) in [
        ("hex8", 1.0, 8, 2.7e-3),
        ("hex8", 1.0, 16, 7.4e-4),
        ("hex8", 1.0, 32, 2.5e-4),
        ("hex8", 2.5, 8, 3.1e-3),
        ("hex8", 2.5, 16, 1.2e-3),
        ("hex8", 2.5, 32, 7.4e-4),
        ("hex20", 1.0, 8, 4.0e-6),
        ("hex20", 2.5, 8, 3.0e-6),
    ] {
        let angle = f64::to_radians(half);
        let case = case.replace("HALF", &half.to_string()).replace("CELLS", &cells.to_string());
        let corner = |radius: f64| format!("[{}, {}, 0]", radius * angle.cos(), -radius * angle.sin());
        let case =
            case.replace("KIND", kind).replace("[1, 0, 0]", &corner(1.0)).replace("[2, 0, 0]", &corner(2.0));
        let probes = Results::of(&case, 2).table("probes.csv");
        let error = |probe: &str, radius: f64| {
            let [x, y] = ["u_x", "u_y"].map(|component| probes.last(&format!("{probe}.{component}")));
            (x.hypot(y) / exact(radius) - 1.0).abs()
        };
        let worst = error("inside", 1.0).max(error("outside", 2.0));
        assert!((worst / known - 1.0).abs() < 0.05, "{kind}, {half}, {cells}: {worst:.3e}");
    }
}

/// The answer does not depend on the number of ranks.
#[test]
fn a_turned_block_on_1_to_4_ranks() {
    let time = "time: { end: 0.2, step: 0.02, scheme: midpoint }\nsolver: { newton: { tolerance: 1.0e-12 } }";
    let all = [1, 2, 3, 4].map(|ranks| Results::of(&pressed(true, time), ranks));
    for (table, columns) in
        [("probes.csv", ["corner.u_x", "corner.u_y"]), ("energy.csv", ["strain", "friction_dissipated"])]
    {
        let [one, others @ ..] =
            all.each_ref().map(|results| columns.map(|name| results.table(table).last(name)));
        others.iter().for_each(|other| near(other, &one, 1e-9));
    }
}

/// A ring on a round guide can turn, and nothing else: it keeps its kinetic energy, and a static case
/// names this motion.
#[test]
fn a_ring_turns_on_a_round_guide() {
    let case = "
dimension: 2
bodies:
  ring:
    mesh:
      box:
        { min: [1, 0], max: [1.5, 1], cells: [2, 24], element: quad4, map: { x: 'x * cos(2 * pi * y)', y: 'x * sin(2 * pi * y)' }, merge: { tolerance: 1.0e-9 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
    density: 1000
    INITIAL
boundary:
  guide: { on: ring.left, roller: {} }
TIME
solver: { newton: { tolerance: 1.0e-12 } }
output: { probes: { inside: { at: [1, 0] } } }
";
    let moving = case
        .replace("INITIAL", "initial_velocity: ['-0.1 * y', '0.1 * x']")
        .replace("TIME", "time: { end: 1, step: 0.1, scheme: midpoint }");
    let results = Results::of(&moving, 2);
    let kinetic = results.table("energy.csv").numbers("kinetic");
    assert!(kinetic[0] > 0.0);
    near(&[kinetic[kinetic.len() - 1]], &[kinetic[0]], 1e-9);
    let probes = results.table("probes.csv");
    near(&[probes.last("inside.u_x"), probes.last("inside.u_y")], &[0.0, 0.1], 1e-9);
    let folder = Folder::new("roller-ring");
    let still = case
        .replace("INITIAL", "")
        .replace("TIME", "time: { end: 1, scheme: { static: { increments: 1 } } }");
    folder.write("case.yml", &still);
    let output = run(1, &["case.yml"], &folder);
    assert_says(&output.success().text(), &["'ring' can move without strain (1 motion)"]);
}

/// A run that continues from a checkpoint gives the same bits.
#[test]
fn a_restart_continues_on_rollers() {
    let time = "time: { end: 0.2, step: 0.02, scheme: midpoint }\nsolver: { linear: gmres_asm_ilu }";
    let folder = Folder::new("roller-restart");
    folder.write("case.yml", &pressed(true, time));
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000005.ckpt";
    run(2, &["case.yml", "-q", "-o", "branch", start], &folder).success();
    let rows = |of: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.join(of).join("reactions.csv")).expect("a table");
        text.lines().map(str::to_owned).collect()
    };
    let [whole, branch] = ["whole", "branch"].map(rows);
    assert!(branch.len() > 10);
    assert_eq!(branch[branch.len() - 10..], whole[whole.len() - 10..]);
}

/// Mistakes are found with their place and a cure.
#[test]
fn mistakes_with_rollers_are_explained() {
    let good = sector(2, "quad4", "");
    for (from, to, says) in [
        ("roller: {} }\n  top", "roller: { direction: [1, 2, 3] } }\n  top", ["direction of a roller", "2"]),
        (
            "roller: {} }\n  top",
            "roller: { direction: [0, 0] } }\n  top",
            ["finite and not zero", "case.yml:"],
        ),
        ("on: piece.bottom", "on: piece", ["a roller without a direction", "body.set"]),
        (
            "on: piece.bottom, roller: {}",
            "on: [piece.bottom, piece.left], roller: {}",
            ["case.yml:8:", "meet at an edge"],
        ),
        (
            "on: piece.bottom, roller: {}",
            "on: piece.bottom, displacement: { x: 0, y: '0.01 * (1 + 0 * x)' } }\n  again: { on: piece.bottom, roller: {}",
            ["different displacements", "'again'"],
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let folder = Folder::new("roller-mistakes");
        folder.write("case.yml", &good.replacen(from, to, 1));
        let output = run(2, &["case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{to}: {}", output.text());
        assert_says(&output.text(), &says);
        assert_eq!(output.text().matches("contact-petsc: error").count(), 1, "{}", output.text());
    }
}
