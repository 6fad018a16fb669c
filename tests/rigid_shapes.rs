//! Rigid tools of shapes with edges and of surfaces from files: forces against formulas, ranks,
//! restart, and refusals of broken files.

mod common;

use std::collections::HashMap;

use common::{Folder, Results, Table, assert_says, near, run};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;
use contact_petsc::output::{pvd, pvtu};

/// A sphere of radius 1 about the origin as text STL: a cube whose faces have `n` times `n` cells of
/// two triangles.
fn sphere(n: u32) -> String {
    let place = |k: u32| ((2.0 * f64::from(k) / f64::from(n) - 1.0) * std::f64::consts::FRAC_PI_4).tan();
    let mut text = String::from("solid sphere\n");
    for face in 0..6_usize {
        let (axis, up) = (face / 2, face % 2 == 1);
        let at = |i: u32, j: u32| {
            let mut x = [0.0; 3];
            x[axis] = if up { 1.0 } else { -1.0 };
            x[(axis + 1) % 3] = place(i);
            x[(axis + 2) % 3] = place(j);
            let size = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            x.map(|x| x / size)
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for mut triangle in [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] {
                if !up {
                    triangle.swap(0, 1);
                }
                text.push_str("facet normal 0 0 0\nouter loop\n");
                for [x, y, z] in triangle {
                    text.push_str(&format!("vertex {x:.9} {y:.9} {z:.9}\n"));
                }
                text.push_str("endloop\nendfacet\n");
            }
        }
    }
    text + "endsolid sphere\n"
}

const SURFACE: &str = "surface: { file: tool.stl, scale: 0.1, position: [0.003, -0.004, 0.18] }";

/// A block into which a tool is pressed by 0.01.
fn press(shape: &str) -> String {
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [-0.1, -0.1, 0], max: [0.1, 0.1, 0.08], cells: [10, 10, 4] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.3 }} }}
rigid:
  tool:
    shape: {{ {shape} }}
    motion: {{ translation: {{ z: \"-0.01 * t\", x: \"0.002 * t\" }} }}
contact:
  press: {{ contactor: block.top, target: tool, friction: none }}
boundary:
  clamp: {{ on: block.bottom, displacement: {{ x: 0, y: 0, z: 0 }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 5 }} }} }}
output: {{ checkpoint: {{ every: 2 }} }}
"
    )
}

/// Runs a case beside the file of a sphere.
fn results(shape: &str, ranks: usize) -> Folder {
    let folder = Folder::new("shape");
    folder.write("tool.stl", &sphere(20));
    folder.write("case.yml", &press(shape));
    run(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).success();
    folder
}

fn table(folder: &Folder, name: &str) -> Table {
    Table::read(&folder.join("out").join(name))
}

/// Iterations of Newton's method of each step.
fn iterations(folder: &Folder) -> HashMap<String, usize> {
    let table = table(folder, "iterations.csv");
    let mut counts = HashMap::new();
    table.texts("step").iter().for_each(|step| *counts.entry((*step).to_owned()).or_insert(0) += 1);
    counts
}

/// A sphere of 4800 triangles from a file has the force of the formula sphere at every step, with
/// nearly as many iterations and no repeated step, on one and on two ranks. A changed file is
/// refused at a restart.
#[test]
fn a_sphere_from_a_file_presses_like_the_formula() {
    let exact = results("sphere: { center: [0.003, -0.004, 0.18], radius: 0.1 }", 1);
    let forces = table(&exact, "rigid.csv").numbers("force_z");
    assert!(forces.last().is_some_and(|force| *force > 100.0), "{forces:?}");
    for ranks in [1, 2] {
        let folder = results(SURFACE, ranks);
        let found = table(&folder, "rigid.csv").numbers("force_z");
        assert_eq!(found.len(), forces.len());
        for (found, exact) in found.iter().zip(&forces) {
            assert!((found - exact).abs() <= 0.005 * exact.abs(), "{found} {exact} on {ranks} ranks");
        }
        let [of_file, of_formula] = [&folder, &exact].map(iterations);
        for (step, count) in &of_file {
            assert!(*count <= of_formula[step] + 2, "step {step}: {count} against {}", of_formula[step]);
        }
        if ranks == 1 {
            folder.write("tool.stl", &sphere(19));
            let restart = ["case.yml", "--output", "out", "--quiet", "--restart"];
            let output = run(1, &restart, &folder);
            assert_ne!(output.code, Some(0));
            assert_says(&output.text(), &["surface differs from that of the checkpoint"]);
        }
    }
}

/// Files that bound no solid are refused on every number of ranks with their name and a cure.
#[test]
fn broken_surfaces_are_refused_on_1_and_2_ranks() {
    let good = sphere(3);
    let facets: Vec<&str> = good.split_inclusive("endfacet\n").collect();
    let vertex = good.lines().find(|line| line.starts_with("vertex")).expect("a corner");
    let without = |k: usize| facets[..k].concat() + &facets[k + 1..].concat();
    let reversed = {
        let lines: Vec<&str> = facets[7].lines().collect();
        let swapped = [lines[0], lines[1], lines[3], lines[2], lines[4], lines[5], lines[6]];
        facets[..7].concat() + &swapped.join("\n") + "\n" + &facets[8..].concat()
    };
    let rows: Vec<(String, &[&str], usize)> = vec![
        (String::new(), &["neither an STL file nor a Gmsh mesh"], 2),
        ("garbage ".repeat(50), &["damaged or truncated"], 1),
        (facets[..10].concat(), &["line", "truncated"], 2),
        (good.replacen(vertex, "vertex nan 0 0", 1), &["not finite"], 1),
        ("solid x\nendsolid x\n".to_owned(), &["no triangles"], 2),
        (without(5), &["open at the edge", "repair"], 1),
        (reversed, &["oriented oppositely", "repair"], 2),
    ];
    let folder = Folder::new("broken");
    folder.write("case.yml", &press(SURFACE));
    for (text, fragments, ranks) in rows {
        folder.write("tool.stl", &text);
        let output = run(ranks, &["case.yml", "--output", "out"], &folder);
        assert_eq!(output.code, Some(4), "{fragments:?}: {}", output.text());
        assert_says(&output.text(), &["tool.stl"]);
        assert_says(&output.text(), fragments);
        assert!(!output.text().contains("panicked"));
    }
    std::fs::remove_file(folder.join("tool.stl")).expect("the file");
    let output = run(2, &["case.yml", "--output", "out"], &folder);
    assert_says(&output.text(), &["tool.stl", "relative to the folder of the case file"]);
}

/// A finite cylinder and a finite cone that are longer than the block press like infinite ones, on one
/// and on two ranks.
#[test]
fn turned_solids_press_like_their_infinite_twins() {
    let tangent = 1.1_f64.tan();
    let cone = format!(
        "turned: {{ point: [0.003, -0.004, 0.1], axis: [0, 0, 1], \
         profile: [[0, 0], [{}, 0.4], [0, 0.4]], radius: 0.02 }}",
        0.4 * tangent
    );
    for [one, other] in [
        [
            "cylinder: { point: [0, 0, 0.13], axis: [0.3, 1, 0], radius: 0.05 }".to_owned(),
            "turned: { point: [0, 0, 0.13], axis: [0.3, 1, 0], \
             profile: [[0, -1], [0.03, -1], [0.03, 1], [0, 1]], radius: 0.02 }"
                .to_owned(),
        ],
        [
            "cone: { tip: [0.003, -0.004, 0.08], axis: [0, 0, 1], half_angle: 1.1, radius: 0.02 }".to_owned(),
            cone,
        ],
    ] {
        let forces = [(one, 1), (other.clone(), 1), (other, 2)]
            .map(|(shape, ranks)| table(&results(&shape, ranks), "rigid.csv").numbers("force_z"));
        let largest = forces[0].iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        assert!(largest > 10.0, "{forces:?}");
        for other in &forces[1..] {
            let worst = forces[0].iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-8 * largest && other.len() == forces[0].len(), "{forces:?}");
        }
    }
}

/// A tool with a prescribed motion and a free body, away from a block.
const MOVING: &str = "dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [2, 0.5], cells: [4, 1] } }
    material: { neo_hookean: { young_modulus: 5e6, poisson_ratio: 0.3 } }
    density: 1000
rigid:
  brick:
    shape: { box: { center: [0.5, 1.5], size: [0.4, 0.2], radius: 0.05 } }
    motion: { translation: { y: \"0.2 * t\" }, rotation: { about: [0.3, 1.4], angle: \"5 * t\" } }
  disc:
    shape: { sphere: { center: [1.5, 1.5], radius: 0.2 } }
    free: { mass: 2, inertia: [0.1], center: [1.6, 1.5], initial_velocity: [1, 0.5], initial_spin: [-7] }
contact:
  one: { contactor: block.top, target: brick, friction: none }
  two: { contactor: block.top, target: disc, friction: none }
boundary: { clamp: { on: block.bottom, displacement: { x: 0, y: 0 } } }
time: { end: 0.1, step: 0.02, scheme: { newmark: {} } }
output: { fields: { every: 1 } }
";

/// The surfaces in `rigid.pvd` move with their bodies about the right points, on one and on two ranks.
/// Figures are drawn with them, and without them when other results replace the folder.
#[test]
fn pictures_move_with_their_bodies() {
    let folder = Folder::new("pictures");
    folder.write("case.yml", MOVING);
    for ranks in [1, 2] {
        run(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).success();
        let rigid = table(&folder, "rigid.csv");
        let entries = pvd::read(&folder.join("out/rigid.pvd")).expect("a series");
        let index = folder.join("out").join(&entries.last().expect("a step").file);
        let source = pvtu::read(&index).expect("an index").remove(0);
        let piece = read_piece(&index.with_file_name(source)).expect("a piece");
        let VtuValues::Float64(moved) = &piece.point_data["displacement"].values else { panic!("numbers") };
        let VtuValues::Int32(numbers) = &piece.cell_data["rigid"].values else { panic!("numbers") };
        for (number, name, centre) in [(0, "brick", [0.3, 1.4]), (1, "disc", [1.6, 1.5])] {
            let own = rigid.only("body", name);
            let (sine, cosine) = own.last("rotation_z").sin_cos();
            assert!(sine.abs() > 0.4 && entries.len() == 6);
            let position = [own.last("position_x"), own.last("position_y")];
            let cells = numbers.iter().enumerate().filter(|(_, found)| **found == number);
            let points: Vec<usize> =
                cells.flat_map(|(cell, _)| piece.cell(cell).iter().map(|&point| point as usize)).collect();
            assert!(points.len() >= 96, "{}", points.len());
            for point in points {
                let x = &piece.points[point];
                let arm = [x[0] - centre[0], x[1] - centre[1]];
                let now = [
                    position[0] + cosine * arm[0] - sine * arm[1],
                    position[1] + sine * arm[0] + cosine * arm[1],
                ];
                for i in 0..2 {
                    assert!((x[i] + moved[3 * point + i] - now[i]).abs() < 1e-12, "{name} at {x:?}");
                }
            }
        }
    }
    run(0, &["plot", "out"], &folder).success();
    let figure = folder.join("out/figures/deformed_von_mises.svg");
    assert!(figure.exists());
    let (bodies, rest) = MOVING.split_once("rigid:\n").expect("rigid bodies");
    let (_, rest) = rest.split_once("boundary:").expect("a boundary");
    folder.write("case.yml", &format!("{bodies}boundary:{rest}"));
    run(1, &["case.yml", "--output", "out", "--quiet"], &folder).success();
    assert!(!folder.join("out/rigid.pvd").exists() && !figure.exists());
    let plotted = run(0, &["plot", "out"], &folder).success();
    assert!(figure.exists() && !plotted.text().contains("rigid"), "{}", plotted.text());
}

/// Shapes in the plane that describe the same solid press alike: a rounded box and a closed
/// polyline, a capsule and an open polyline.
#[test]
fn one_solid_presses_alike_in_two_descriptions() {
    let forces = |shape: &str| {
        let text = press(shape)
            .replace("dimension: 3", "dimension: 2")
            .replace(
                "min: [-0.1, -0.1, 0], max: [0.1, 0.1, 0.08], cells: [10, 10, 4]",
                "min: [-0.1, 0], max: [0.1, 0.08], cells: [20, 8]",
            )
            .replace("z: \"-0.01 * t\", x: \"0.002 * t\"", "y: \"-0.01 * t\"")
            .replace("{ x: 0, y: 0, z: 0 }", "{ x: 0, y: 0 }");
        let folder = Folder::new("alike");
        folder.write("case.yml", &text);
        run(1, &["case.yml", "--output", "out", "--quiet"], &folder).success();
        table(&folder, "rigid.csv").numbers("force_y")
    };
    for [one, other] in [
        [
            "box: { center: [0, 0.12], size: [0.1, 0.08], radius: 0.02 }",
            "polyline: { points: [[-0.03, 0.1], [-0.03, 0.14], [0.03, 0.14], [0.03, 0.1]], closed: true, radius: 0.02 }",
        ],
        [
            "capsule: { from: [-0.03, 0.1], to: [0.03, 0.1], radius: 0.02 }",
            "polyline: { points: [[-0.03, 0.1], [0.01, 0.1], [0.03, 0.1]], radius: 0.02 }",
        ],
    ] {
        let [one, other] = [one, other].map(forces);
        let largest = one.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        assert!(largest > 1e3 && one.len() == other.len(), "{one:?}");
        assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-9 * largest), "{one:?} {other:?}");
    }
}

/// A block that is pressed into a die whose edges are rounded by a twenty-fifth of a facet.
const DIE: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.1, 0.1], cells: [4, 4], element: KIND } }
    material: { neo_hookean: { young_modulus: 1.0e+6, poisson_ratio: 0.3 } }
obstacles:
  die: { box: { center: [0.05, 0.1], size: [0.11, 0.2001], radius: 0.001, side: inside } }
contact:
CONTACTS
boundary:
  ram: { on: block.top, displacement: { x: 0, y: '-0.03 * t' } }
time: { end: 1, scheme: { static: { increments: 25 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { checkpoint: { every: 12, keep: 9 } }
";

/// One contact over these sides, or a contact for each.
fn over(text: &str, sides: &[&str], together: bool) -> String {
    let law = "target: die, initial_overclosure: accept, friction: { coulomb: { coefficient: 0.2, \
               regularization: { stick_stiffness: 1.0e+9 } } }";
    let line = |name: &str, contactor: &str| format!("  {name}: {{ contactor: {contactor}, {law} }}\n");
    let lists = sides.iter().map(|side| format!("block.{side}")).collect::<Vec<_>>();
    let contacts = match together {
        true => line("all", &format!("[{}]", lists.join(", "))),
        false => sides.iter().zip(&lists).map(|(side, set)| line(side, set)).collect(),
    };
    text.replace("CONTACTS\n", &contacts)
}

/// One contact over several sides of a body is the contacts of its sides together, also where a sharp
/// edge of the body meets two walls of a die. The vertices on the edge have a gap for each side, on any
/// number of ranks and after a restart.
#[test]
fn one_contact_over_several_sides_is_those_of_the_sides() {
    let space = DIE
        .replace("dimension: 2", "dimension: 3")
        .replace(
            "min: [0, 0], max: [0.1, 0.1], cells: [4, 4]",
            "min: [0, 0, 0], max: [0.1, 0.1, 0.1], cells: [3, 3, 3]",
        )
        .replace(
            "center: [0.05, 0.1], size: [0.11, 0.2001]",
            "center: [0.05, 0.05, 0.1], size: [0.11, 0.112, 0.2001]",
        )
        .replace("y: '-0.03 * t'", "y: 0, z: '-0.03 * t'");
    for (text, kind, ranks) in [(DIE, "quad4", 2), (DIE, "quad8", 1), (DIE, "tri3", 1), (&space, "hex8", 2)] {
        let text = text.replace("KIND", kind);
        let (up, sides) = match kind {
            "hex8" => ("force_z", &["bottom", "left", "right", "front", "back"][..]),
            _ => ("force_y", &["bottom", "left", "right"][..]),
        };
        let one = Results::of(&over(&text, sides, true), ranks);
        let many = Results::of(&over(&text, sides, false), 1);
        let force = |results: &Results, folder: &str| {
            Table::read(&results.0.join(folder).join("reactions.csv")).numbers(up)
        };
        let (found, known) = (force(&one, "out"), force(&many, "out"));
        assert_eq!(found.len(), 26, "{kind}: no step was cut");
        near(&found, &known, 1e-8);
        let closed = many.table("contact.csv");
        let beside = closed.only("contact", "left").last("force_n");
        assert!(beside > 1e-4 * known[25].abs(), "{kind}: the walls carry, {beside}");
        let start = "--restart=out/checkpoints/step-000012.ckpt";
        run(3 - ranks, &["case.yml", "-q", "-o", "branch", start], &one.0).success();
        near(&force(&one, "branch"), &known[13..], 1e-8);
    }
}

/// A ring on a disc of its own radius. The nodes of its bore lie on the disc, and its straight facets cut
/// into it.
const FITS: &str = "
dimension: 2
bodies:
  ring:
    mesh: { box: { min: [0, 50], max: [360, 60], cells: [48, 2], element: KIND, map: { x: '-y * cos(x * pi / 180)', y: 'y * sin(x * pi / 180)' }, merge: { tolerance: 1.0e-6 } } }
    sets: { sides: { of: nodes, where: 'abs(y) < 1e-6' }, poles: { of: nodes, where: 'abs(x) < 1e-6' } }
    material: { neo_hookean: { young_modulus: 2.0e+5, poisson_ratio: 0.3 } }
obstacles: { core: { sphere: { center: [0, 0], radius: 50, side: outside } } }
contact: { seat: { contactor: ring.bottom, target: core, friction: none, initial_overclosure: START } }
boundary:
  level: { on: ring.sides, displacement: { y: 0 } }
  middle: { on: ring.poles, displacement: { x: 0 } }
  squeeze: { on: ring.top, pressure: '10 * t' }
time: { end: 1, scheme: { static: { increments: 2 } } }
output: { fields: { every: 0 } }
";

/// `adjust` and `conform` remove the overlap of straight facets with a round obstacle, and `conform` their
/// gap in a hollow one. The pressure is then that of the load alone: of a thick ring on a rigid core under
/// pressure on its rim, or in a rigid bore under pressure from inside.
#[test]
fn facets_on_a_round_obstacle_fit() {
    let inner = 50.0_f64;
    let outer = 60.0_f64;
    let ratio = 0.3;
    // Lame's solution in plane strain, without displacement at the obstacle.
    let pressure = |loaded: f64, fixed: f64| {
        10.0 * 2.0 * (1.0 - ratio) / (1.0 + (1.0 - 2.0 * ratio) * (fixed / loaded).powi(2))
    };
    let hollow = FITS
        .replace("contactor: ring.bottom", "contactor: ring.top")
        .replace("radius: 50, side: outside", "radius: 60, side: inside")
        .replace("squeeze: { on: ring.top", "squeeze: { on: ring.bottom");
    let mean = |text: &str, radius: f64, kind: &str, start: &str, ranks: usize| {
        let results = Results::of(&text.replace("KIND", kind).replace("START", start), ranks);
        results.table("contact.csv").last("force_n") / (2.0 * std::f64::consts::PI * radius)
    };
    let core = pressure(outer, inner);
    for (kind, start, ranks) in [("quad4", "adjust", 1), ("quad4", "conform", 2), ("quad8", "adjust", 1)] {
        let found = mean(FITS, inner, kind, start, ranks);
        assert!((found / core - 1.0).abs() < 0.02, "{kind}, {start}: {found}, not {core}");
    }
    assert!(mean(FITS, inner, "quad4", "accept", 1) > 3.0 * core);
    let bore = pressure(inner, outer);
    for ranks in [1, 3] {
        let found = mean(&hollow, outer, "quad4", "conform", ranks);
        assert!((found / bore - 1.0).abs() < 0.02, "in a bore: {found}, not {bore}");
    }
    assert!(mean(&hollow, outer, "quad4", "adjust", 1) < 0.5 * bore);
}
