//! Tied surfaces whose meshes do not match, in complete runs: uniform stress passes through, rotations
//! cost nothing, and every solver and number of ranks gives the same answer.

mod common;

use common::{Folder, Results, assert_says, run};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

/// Two boxes with tied faces under tractions on all other faces. Three nodes prevent rigid motions.
const PATCH_2D: &str = "
dimension: 2
bodies:
  lower:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [3, 2], element: LOWER } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
    sets:
      corner: { of: nodes, where: 'x < 1e-9 and y < 1e-9' }
      other: { of: nodes, where: 'x > 1 - 1e-9 and y < 1e-9' }
  upper:
    mesh: { box: { min: [0, 1], max: [1, 1.5], cells: [4, 2], element: UPPER } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
tied:
  glue: { contactor: upper.bottom, target: lower.top }
boundary:
  corner: { on: lower.corner, displacement: { x: 0, y: 0 } }
  other: { on: lower.other, displacement: { y: 0 } }
  left: { on: [lower.left, upper.left], traction: { x: -1.0e4, y: -4.0e3 } }
  right: { on: [lower.right, upper.right], traction: { x: 1.0e4, y: 4.0e3 } }
  foot: { on: lower.bottom, traction: { x: -4.0e3, y: -2.0e4 } }
  head: { on: upper.top, traction: { x: 4.0e3, y: 2.0e4 } }
time: { end: 1, scheme: { static: { increments: 1 } } }
output: { fields: { every: 1 } }
";

/// The same in space.
const PATCH_3D: &str = "
dimension: 3
bodies:
  lower:
    mesh: { box: { min: [0, 0, 0], max: [1, 1, 1], cells: [2, 3, 2], element: LOWER } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
    sets:
      corner: { of: nodes, where: 'x < 1e-9 and y < 1e-9 and z < 1e-9' }
      other: { of: nodes, where: 'x > 1 - 1e-9 and y < 1e-9 and z < 1e-9' }
      third: { of: nodes, where: 'x < 1e-9 and y > 1 - 1e-9 and z < 1e-9' }
  upper:
    mesh: { box: { min: [0, 0, 1], max: [1, 1, 1.5], cells: [3, 2, 1], element: UPPER } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
tied:
  glue: { contactor: upper.bottom, target: lower.top }
boundary:
  corner: { on: lower.corner, displacement: { x: 0, y: 0, z: 0 } }
  other: { on: lower.other, displacement: { y: 0, z: 0 } }
  third: { on: lower.third, displacement: { z: 0 } }
  left: { on: [lower.left, upper.left], traction: { x: -1.0e4, y: -2.0e3, z: -4.0e3 } }
  right: { on: [lower.right, upper.right], traction: { x: 1.0e4, y: 2.0e3, z: 4.0e3 } }
  front: { on: [lower.front, upper.front], traction: { x: -2.0e3, y: 5.0e3, z: -3.0e3 } }
  back: { on: [lower.back, upper.back], traction: { x: 2.0e3, y: -5.0e3, z: 3.0e3 } }
  foot: { on: lower.bottom, traction: { x: -4.0e3, y: -3.0e3, z: -2.0e4 } }
  head: { on: upper.top, traction: { x: 4.0e3, y: 3.0e3, z: 2.0e4 } }
time: { end: 1, scheme: { static: { increments: 1 } } }
output: { fields: { every: 1 } }
";

/// Largest difference between the stress of an element in the last fields and a uniform one, over the
/// largest component of that one.
fn worst_stress(results: &Results, uniform: &[(usize, f64)]) -> f64 {
    let mut steps: Vec<_> = std::fs::read_dir(results.0.join("out/fields"))
        .expect("fields")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    steps.sort();
    let mut worst = 0.0_f64;
    let mut elements = 0;
    for piece in std::fs::read_dir(steps.last().expect("a step")).expect("pieces") {
        let path = piece.expect("a piece").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if !name.starts_with("volume") || !name.ends_with(".vtu") {
            continue;
        }
        let piece = read_piece(&path).expect("a piece");
        let field = &piece.cell_data["cauchy_stress"];
        let VtuValues::Float64(values) = &field.values else { panic!("stresses are numbers") };
        for stress in values.chunks_exact(field.components) {
            elements += 1;
            for &(component, value) in uniform {
                worst = worst.max((stress[component] - value).abs());
            }
        }
    }
    assert!(elements > 8, "{elements} elements");
    worst / uniform.iter().fold(0.0, |most: f64, (_, value)| most.max(value.abs()))
}

/// A uniform stress with shear passes through the tied surfaces of all elements with facets of one or
/// two orders, also where the sides differ.
#[test]
fn uniform_stress_passes_in_the_plane_on_1_and_3_ranks() {
    let stress = [(0, 1.0e4), (1, 2.0e4), (3, 4.0e3)];
    for (lower, upper, ranks) in [
        ("quad4", "quad4", 1),
        ("quad4", "tri3", 3),
        ("tri6", "quad8", 1),
        ("quad9", "quad9", 3),
        ("quad4", "quad8", 1),
    ] {
        let results = Results::of(&PATCH_2D.replace("LOWER", lower).replace("UPPER", upper), ranks);
        let worst = worst_stress(&results, &stress);
        assert!(worst < 1e-10, "{lower} under {upper}: {worst:.1e}");
        let glue = results.table("reactions.csv").only("boundary", "glue");
        for (column, force) in [("force_x", -4.0e3), ("force_y", -2.0e4)] {
            assert!((glue.last(column) - force).abs() < 1e-9 * 2.0e4, "{column} of {lower}");
        }
    }
}

/// The same in space, where segments are polygons.
#[test]
fn uniform_stress_passes_in_space_on_1_to_4_ranks() {
    let stress = [(0, 1.0e4), (1, -5.0e3), (2, 2.0e4), (3, 2.0e3), (4, 3.0e3), (5, 4.0e3)];
    for (lower, upper, ranks) in [
        ("hex8", "hex8", 4),
        ("tet4", "hex8", 1),
        ("hex20", "tet10", 2),
        ("wedge6", "wedge6", 3),
        ("pyramid5", "pyramid5", 2),
        ("hex27", "hex27", 1),
    ] {
        let results = Results::of(&PATCH_3D.replace("LOWER", lower).replace("UPPER", upper), ranks);
        let worst = worst_stress(&results, &stress);
        assert!(worst < 1e-10, "{lower} under {upper}: {worst:.1e}");
    }
}

/// A tied bar is longer than a whole one by `t / stiffness`, and the ties store `t^2 A / (2 stiffness)`.
#[test]
fn a_bond_yields_by_its_stiffness_on_2_ranks() {
    let stress = 1.0e4;
    let stiffness = 2.0e7;
    let young = 1.0e6;
    let text = PATCH_2D
        .replace("LOWER", "quad4")
        .replace("UPPER", "quad4")
        .replace("poisson_ratio: 0.3", "poisson_ratio: 0.0")
        .replace("target: lower.top }", &format!("target: lower.top, stiffness: {stiffness} }}"))
        .replace("x: 4.0e3, y: 2.0e4", "y: 1.0e4")
        .replace("x: -4.0e3, y: -2.0e4", "y: -1.0e4")
        .replace("x: 1.0e4, y: 4.0e3", "x: 0, y: 0")
        .replace("x: -1.0e4, y: -4.0e3", "x: 0, y: 0")
        .replace("output: {", "output: { probes: { top: { at: [0.5, 1.5], on: upper } },");
    let results = Results::of(&text, 2);
    let lift = results.table("probes.csv").last("top.u_y");
    let expected = 1.5 * stress / young + stress / stiffness;
    assert!((lift - expected).abs() < 1e-10 * expected, "{lift}, expected {expected}");
    let energy = results.table("energy.csv").last("springs");
    let stored = 0.5 * stress * stress / stiffness;
    assert!((energy - stored).abs() < 1e-9 * stored, "{energy}, expected {stored}");
}

/// A tied pair that is turned by a right angle keeps its shape: the weights add up to zero, and flat
/// surfaces have no gap that could turn.
#[test]
fn a_rotation_costs_nothing_in_the_plane_and_in_space() {
    let turned = |dimension: usize| {
        let patch = if dimension == 2 { PATCH_2D } else { PATCH_3D };
        let kind = if dimension == 2 { ["quad4", "tri6"] } else { ["hex8", "tet10"] };
        let text = patch.replace("kinematics: linear", "kinematics: finite");
        let text = text.replace("LOWER", kind[0]).replace("UPPER", kind[1]);
        let head = text.split("boundary:").next().expect("a head").to_owned();
        let z = if dimension == 2 { "" } else { ", z: 0" };
        format!(
            "{head}boundary:
  turn:
    on: lower.bottom
    displacement: {{ x: 'x * (cos(a * t) - 1) - y * sin(a * t)', y: 'x * sin(a * t) + y * (cos(a * t) - 1)'{z} }}
parameters: {{ a: 'pi / 2' }}
time: {{ end: 1, scheme: {{ static: {{ increments: 6 }} }} }}
output: {{ probes: {{ far: {{ at: {at}, on: upper }} }} }}
",
            at = if dimension == 2 { "[1, 1.5]" } else { "[1, 1, 1.5]" },
        )
    };
    for (dimension, ranks) in [(2, 1), (3, 2)] {
        let results = Results::of(&turned(dimension), ranks);
        let probes = results.table("probes.csv");
        let far = if dimension == 2 { [1.0, 1.5] } else { [1.0, 1.0] };
        assert!((probes.last("far.u_x") - (-far[1] - far[0])).abs() < 1e-9, "{dimension}D");
        assert!((probes.last("far.u_y") - (far[0] - far[1])).abs() < 1e-9, "{dimension}D");
        let energy = results.table("energy.csv");
        assert!(energy.last("strain").abs() < 1e-9 && energy.last("springs").abs() < 1e-9, "{dimension}D");
    }
}

/// A beam whose upper half is tied to the lower one along its length.
const BEAM: &str = "
dimension: 2
bodies:
  lower:
    mesh: { box: { min: [0, 0], max: [4, 0.2], cells: [CELLS, 3], element: quad8 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0 } }
    density: 1000
  upper:
    mesh: { box: { min: [0, 0.2], max: [4, 0.4], cells: [17, 3], element: quad8 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0 } }
    density: 1000
tied:
  glue: { contactor: upper.bottom, target: lower.top }
boundary:
  wall: { on: [lower.left, upper.left], displacement: { x: 0, y: 0 } }
  push: { on: upper.right, traction: { y: '10 * if(t > 0, 1, 0)' } }
";

/// The tied beam bends like one of full height: the deflection of Timoshenko's beam. Loose halves would
/// bend four times as far.
#[test]
fn a_tied_beam_bends_as_a_whole_on_2_ranks() {
    let tail = "time: { end: 1, scheme: { static: { increments: 1 } } }
output: { probes: { tip: { at: [4, 0.4], on: upper } } }
";
    let results = Results::of(&format!("{}{tail}", BEAM.replace("CELLS", "12")), 2);
    let force = 2.0;
    let length = 4.0_f64;
    let young = 1.0e6;
    let inertia = 0.4_f64.powi(3) / 12.0;
    let bending = force * length.powi(3) / (3.0 * young * inertia);
    let shear = force * length / (5.0 / 6.0 * 0.5 * young * 0.4);
    let found = results.table("probes.csv").last("tip.u_y");
    let expected = bending + shear;
    assert!((found / expected - 1.0).abs() < 3e-3, "{found}, expected {expected}");
}

/// In motion, the conserving scheme keeps the energy with the part that the ties store.
#[test]
fn ties_conserve_energy_on_1_and_4_ranks() {
    let tail = "time: { end: 0.2, step: 0.01, scheme: { conserving: {} } }
output: { probes: { tip: { at: [4, 0.4], on: upper } } }
";
    let text = format!("{}{tail}", BEAM.replace("CELLS", "12").replace("10 * if(t > 0, 1, 0)", "100"));
    let tips: Vec<f64> = [1, 4]
        .iter()
        .map(|&ranks| {
            let results = Results::of(&text, ranks);
            let energy = results.table("energy.csv");
            let work = energy.last("external_work");
            assert!(work > 0.0 && energy.last("springs") > 1e-7 * work, "{work}");
            assert!(energy.last("numerical").abs() < 1e-9 * work, "{:e}", energy.last("numerical") / work);
            results.table("probes.csv").last("tip.u_y")
        })
        .collect();
    assert!((tips[0] - tips[1]).abs() < 1e-8 * tips[0].abs(), "{tips:?}");
}

/// Iterative solvers find the answer of the factorisation.
#[test]
fn solvers_agree_on_2_ranks() {
    let text = PATCH_3D.replace("LOWER", "hex8").replace("UPPER", "hex8");
    let stress = [(0, 1.0e4), (1, -5.0e3), (2, 2.0e4), (3, 2.0e3), (4, 3.0e3), (5, 4.0e3)];
    for linear in ["gmres_asm_ilu", "cg_icc", "filtered_ilu", "filtered_amg", "gmres_amg", "cg_filtered_amg"]
    {
        let solver = format!("solver: {{ linear: {linear}, krylov: {{ tolerance: 1e-11 }} }}\n");
        let results = Results::of(&format!("{text}{solver}"), 2);
        let worst = worst_stress(&results, &stress);
        assert!(worst < 1e-7, "{linear}: {worst:.1e}");
        assert_eq!(results.record()["linear_fallbacks"], 0, "{linear}");
    }
}

/// Multigrid takes as many iterations with a stiff bond as with one that is as soft as an element, if
/// the tied nodes are factorised as a whole, and at most twice as many in pieces.
#[test]
fn multigrid_does_not_feel_the_stiffness_of_the_bond() {
    let text = PATCH_3D.replace("LOWER", "hex8").replace("UPPER", "hex8");
    let text =
        text.replace("cells: [2, 3, 2]", "cells: [6, 6, 4]").replace("cells: [3, 2, 1]", "cells: [7, 7, 3]");
    for (ranks, petsc) in [(1, ""), (3, "petsc: { filter_pc_type: asm }\n")] {
        let iterations = |stiffness: &str| {
            let text =
                text.replace("target: lower.top }", &format!("target: lower.top, stiffness: {stiffness} }}"));
            let solver = "solver: { linear: cg_filtered_amg, krylov: { tolerance: 1e-8 } }\n";
            let record = Results::of(&format!("{text}{solver}{petsc}"), ranks).record();
            assert_eq!(record["linear_fallbacks"], 0, "{stiffness}");
            assert_eq!(record["inner_krylov_iterations"].as_u64() > Some(0), ranks > 1, "pieces");
            record["krylov_iterations"].as_u64().expect("a number")
        };
        let soft = iterations("1.0e7");
        let stiff = iterations("1.0e12");
        // The tolerance on the tied nodes is felt in pieces: 20 and 33.
        let limit = if ranks > 1 { 2 * soft } else { soft + 2 };
        assert!(stiff <= limit, "{ranks} ranks: {soft} and {stiff}");
    }
}

/// A pad that is tied to a block, pressed on a soft ground and dragged over its facets.
const PAD: &str = "
dimension: 2
bodies:
  pad:
    mesh: { box: { min: [0, 0], max: [1, 0.3], cells: [10, 3] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
  block:
    mesh: { box: { min: [0, 0.3], max: [1, 0.6], cells: [7, 2] } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    density: 1000
  ground:
    mesh: { box: { min: [-0.2, -0.2], max: [2, 0], cells: [30, 2] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
tied:
  bond: { contactor: pad.top, target: block.bottom }
contact:
  sole: { contactor: pad.bottom, target: ground.top, friction: { coulomb: { coefficient: 0.3, regularization: { stick_velocity: 0.01 } } } }
boundary:
  base: { on: ground.bottom, displacement: { x: 0, y: 0 } }
  head: { on: block.top, displacement: { x: '10 * t^2', y: '-0.02 * min(t / 0.05, 1)' } }
time: { end: 0.12, step: 0.01, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
output: { fields: { every: 0 }, probes: { corner: { at: [1, 0], on: pad } } }
";

/// Position of the probe and force of the bond at the end.
fn dragged(results: &Results) -> [f64; 4] {
    let probes = results.table("probes.csv");
    let bond = results.table("reactions.csv").only("boundary", "bond");
    [probes.last("corner.u_x"), probes.last("corner.u_y"), bond.last("force_x"), bond.last("force_y")]
}

#[track_caller]
fn same(what: &str, found: [f64; 4], known: [f64; 4], tolerance: f64) {
    for (found, known) in found.into_iter().zip(known) {
        assert!((found - known).abs() <= tolerance * (1.0 + known.abs()), "{what}: {found}, {known}");
    }
}

/// With friction on the other side of the pad and a matrix whose pattern grows, all numbers of ranks, both strategies and multigrid give
/// the same motion, also where ranks have no tie. The bond carries the weight of the pressure.
#[test]
fn a_dragged_pad_is_the_same_on_1_to_8_ranks() {
    let known = dragged(&Results::of(PAD, 1));
    assert!(known[2].abs() > 1e3 && known[3] < -2e4, "{known:?}");
    for ranks in [2, 4, 8] {
        same(&format!("{ranks} ranks"), dragged(&Results::of(PAD, ranks)), known, 1e-7);
    }
    for solver in ["strategy: staggered", "linear: filtered_amg", "linear: two_stage"] {
        let text = format!("{PAD}solver: {{ {solver} }}\n");
        same(solver, dragged(&Results::of(&text, 2)), known, 1e-6);
    }
}

/// A run that continues from a checkpoint writes the same tables to the bit.
#[test]
fn a_dragged_pad_resumes_on_2_ranks() {
    let folder = Folder::new("tied");
    let text = format!("{PAD}solver: {{ linear: gmres_asm_ilu }}\n");
    let text = text.replace("output: {", "output: { checkpoint: { every: 8, keep: 9 },");
    folder.write("case.yml", &text);
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000008.ckpt";
    run(2, &["case.yml", "-q", "-o", "resumed", start], &folder).success();
    let rows = |run: &str| {
        let path = folder.join(run).join("reactions.csv");
        let text = std::fs::read_to_string(path).expect("a table");
        text.lines().rev().take(10).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(rows("whole"), rows("resumed"));
}

/// `contact: all` leaves out tied facets: under pressure the bond alone carries the load.
#[test]
fn general_contact_leaves_tied_facets_out() {
    let text = PATCH_2D.replace("LOWER", "quad4").replace("UPPER", "tri3").replace("y: 2.0e4", "y: -2.0e4");
    let text = text.replace("y: -2.0e4 } }\n  head", "y: 2.0e4 } }\n  head");
    let stress = [(0, 1.0e4), (1, -2.0e4), (3, 4.0e3)];
    let results = Results::of(&format!("{text}contact: all\n"), 1);
    let worst = worst_stress(&results, &stress);
    assert!(worst < 1e-10, "{worst:.1e}");
    let carried = results.table("reactions.csv").only("boundary", "glue").last("force_y");
    assert!((carried - 2.0e4).abs() < 1e-6 * 2.0e4, "the bond carries {carried}");
}

/// Mistakes are explained where they are written.
#[test]
fn mistakes_are_explained() {
    let good = PATCH_2D.replace("LOWER", "quad4").replace("UPPER", "quad4");
    let says = |from: &str, to: &str, fragments: &[&str]| {
        let text = good.replace(from, to);
        assert_ne!(text, good, "{from}");
        let folder = Folder::new("tied");
        folder.write("case.yml", &text);
        let output = run(1, &["case.yml", "-q", "-o", "out"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        assert_says(&output.text(), fragments);
    };
    let line = "case.yml:16:";
    says(
        "target: lower.top",
        "target: lower.bottom",
        &[line, "upper.bottom", "face each other within", "touch"],
    );
    says("target: lower.top", "target: upper.bottom", &[line, "on both sides"]);
    says("target: lower.top", "target: lower", &[line, "whole body", "lower.bottom"]);
    says("target: lower.top", "target: lower.tip", &[line, "no set 'tip'"]);
    says("target: lower.top }", "target: lower.top, stiffness: 0 }", &[line, "stiffness", "> 0"]);
    says("target: lower.top }", "target: lower.top, within: -1 }", &[line, "distance", "> 0"]);
    says("  glue:", "  foot:", &[line, "'foot' also names a boundary", "reactions.csv"]);
    let floor = "obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }\ntied:";
    let onto = "target: floor }";
    let text = good.replace("tied:", floor).replace("target: lower.top }", onto);
    let folder = Folder::new("tied");
    folder.write("case.yml", &text);
    let output = run(1, &["case.yml", "-q", "-o", "out"], &folder);
    assert_says(&output.text(), &["case.yml:17:", "'floor' is an obstacle", "only surfaces of bodies"]);
}

/// The part of the contactor that has no target stays free, and a remark gives its size.
#[test]
fn an_overhang_stays_free() {
    let text = PATCH_2D
        .replace("LOWER", "quad4")
        .replace("UPPER", "quad4")
        .replace("min: [0, 1], max: [1, 1.5]", "min: [0.5, 1], max: [1.5, 1.5]");
    let folder = Folder::new("tied");
    folder.write("case.yml", &text);
    let output = run(2, &["case.yml", "-o", "out"], &folder).success();
    assert_says(&output.text(), &["tied 'glue'", "50.000 % of 'upper.bottom'", "within"]);
}

/// Lame constants of the cells.
const LAME: [f64; 2] = [0.3e6 / (1.3 * 0.4), 0.5e6 / 1.3];

/// A cell whose opposite sides are periodic with jumps, and do not match: the nodes of a side are
/// shifted along it. One node holds the cell.
fn cell(dimension: usize, element: &str) -> String {
    let [corners, maps, zeros] = match dimension {
        2 => [
            "min: [0, 0], max: [1, 1], cells: [4, 3]",
            "x: 'x + 0.3 * y * x * (1 - x)', y: 'y + 0.3 * x * y * (1 - y)'",
            "x: 0, y: 0",
        ],
        _ => [
            "min: [0, 0, 0], max: [1, 1, 1], cells: [2, 3, 2]",
            "x: 'x + 0.3 * y * x * (1 - x)', y: 'y + 0.3 * z * y * (1 - y)', z: 'z + 0.3 * x * z * (1 - z)'",
            "x: 0, y: 0, z: 0",
        ],
    };
    let z = if dimension == 2 { "" } else { " and z < 1e-9" };
    let mut pairs = String::new();
    for (axis, sides) in
        [["left", "right"], SIDES[dimension - 2], ["bottom", "top"]].iter().enumerate().take(dimension)
    {
        let offset: Vec<&str> = (0..dimension).map(|i| if i == axis { "1" } else { "0" }).collect();
        let jump: Vec<String> =
            (0..dimension).map(|i| format!("{}: '{} * t^2'", ["x", "y", "z"][i], JUMPS[axis][i])).collect();
        let [contactor, target] = sides;
        pairs += &format!(
            "  along_{axis}: {{ contactor: cell.{contactor}, target: cell.{target}, stiffness: 1e9, offset: [{}], jump: {{ {} }} }}\n",
            offset.join(", "),
            jump.join(", ")
        );
    }
    format!(
        "
dimension: {dimension}
bodies:
  cell:
    mesh: {{ box: {{ {corners}, element: {element}, map: {{ {maps} }} }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
    kinematics: linear
    sets: {{ corner: {{ of: nodes, where: 'x < 1e-9 and y < 1e-9{z}' }} }}
tied:
{pairs}boundary: {{ corner: {{ on: cell.corner, displacement: {{ {zeros} }} }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}
output: {{ derived: {{ pull: reactions.along_0.force_x }}, fields: {{ every: 1 }} }}
"
    )
}

/// Names of the sides across y, in the plane and in space.
const SIDES: [[&str; 2]; 2] = [["bottom", "top"], ["front", "back"]];

/// Jump of each pair at the end.
const JUMPS: [[f64; 3]; 3] = [[0.01, 0.002, -0.001], [0.003, -0.004, 0.002], [0.001, 0.0015, 0.006]];

/// The uniform stress of a cell with bonds of this stiffness: `s = C (J - s / eps)`, with the
/// symmetric part of the jumps per length.
fn stress_of_cell(dimension: usize, bond: f64) -> Vec<(usize, f64)> {
    let [lambda, mu] = LAME;
    let d = dimension as f64;
    let softened = |modulus: f64| modulus / (1.0 + modulus / bond);
    let trace: f64 = (0..dimension).map(|i| JUMPS[i][i]).sum();
    let entry = |i: usize, j: usize| {
        let mean = if i == j { trace / d } else { 0.0 };
        softened(d * lambda + 2.0 * mu) * mean
            + softened(2.0 * mu) * (0.5 * (JUMPS[i][j] + JUMPS[j][i]) - mean)
    };
    match dimension {
        2 => vec![(0, entry(0, 0)), (1, entry(1, 1)), (3, entry(0, 1))],
        _ => [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
            .iter()
            .map(|&(i, j)| entry(i, j))
            .enumerate()
            .collect(),
    }
}

/// A cell with periodic sides, which do not match with elements of first order, has the uniform stress
/// of its jumps, in the plane and in space. The work of the jumps is the stored energy.
#[test]
fn a_periodic_cell_has_the_uniform_stress_of_its_jumps() {
    for (dimension, element, ranks) in
        [(2, "quad4", 1), (2, "tri3", 3), (2, "quad9", 1), (3, "hex8", 4), (3, "tet4", 2), (3, "tet10", 1)]
    {
        let mut case = cell(dimension, element);
        // Sides of second order match: shifted nodes would not be in the middle of their edges.
        if ["quad9", "tet10"].contains(&element) {
            case = case.replace("0.3 *", "0 *");
        }
        // The tolerance of the solver must not hide the error.
        case += "solver: { linear: direct }\n";
        let results = Results::of(&case, ranks);
        let worst = worst_stress(&results, &stress_of_cell(dimension, 1e9));
        // Points of quadrilaterals that are no parallelograms are found by iteration: 4e-10.
        let limit = if element == "hex8" { 1e-9 } else { 1e-10 };
        assert!(worst < limit, "{element}: {worst:.1e}");
        let pull = results.table("reactions.csv").only("boundary", "along_0").last("force_x");
        assert!(pull != 0.0 && results.table("derived.csv").last("pull") == pull);
        let energy = results.table("energy.csv");
        let [work, strain, springs] = ["external_work", "strain", "springs"].map(|name| energy.last(name));
        assert!(strain > 10.0 && springs > 1e-4 * strain);
        assert!((work - strain - springs).abs() < 1e-9 * work, "{element}: {work} {strain} {springs}");
    }
}

/// Without `stiffness` the stress of a cell is that of its jumps to 1e-4.
#[test]
fn periodic_sides_are_stiff() {
    let results = Results::of(&cell(2, "quad4").replace("stiffness: 1e9, ", ""), 1);
    let exact = stress_of_cell(2, 1e30);
    let worst = worst_stress(&results, &exact);
    assert!(worst < 1e-4, "{worst:.1e}");
}

/// A laminate of a soft and a stiff layer in shear has the harmonic mean of their shear moduli.
#[test]
fn a_laminate_has_its_effective_shear_modulus() {
    let case = "
dimension: 2
bodies:
  soft:
    mesh: { box: { min: [0, 0], max: [1, 0.6], cells: [3, 3] } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.25 } }
    kinematics: linear
    sets: { corner: { of: nodes, where: 'x < 1e-9 and y < 1e-9' } }
  stiff:
    mesh: { box: { min: [0, 0.6], max: [1, 1], cells: [4, 2] } }
    material: { saint_venant_kirchhoff: { young_modulus: 2.0e7, poisson_ratio: 0.25 } }
    kinematics: linear
tied:
  glue: { contactor: soft.top, target: stiff.bottom, stiffness: 1e10 }
  across: { contactor: soft.bottom, target: stiff.top, stiffness: 2e10, offset: [0, 1], jump: { x: '0.01 * t' } }
  along: { contactor: [soft.left, stiff.left], target: [soft.right, stiff.right], stiffness: 1e10, offset: [1, 0] }
boundary: { corner: { on: soft.corner, displacement: { x: 0, y: 0 } } }
time: { end: 1, scheme: { static: { increments: 1 } } }
";
    let results = Results::of(case, 2);
    let across = results.table("reactions.csv").only("boundary", "across");
    let [soft, stiff] = [1e6 / 2.5, 2e7 / 2.5];
    let expected = 0.01 / (0.6 / soft + 0.4 / stiff + 1e-10 + 0.5e-10 + 1e-10);
    let found = across.last("force_x");
    assert!((found + expected).abs() < 1e-8 * expected, "{found} and {expected}");
    assert!(across.last("force_y").abs() < 1e-8 * expected);
}

/// In dynamics the conserving scheme balances the energy of a large periodic shear to rounding, and
/// the number of ranks does not change the result.
#[test]
fn a_periodic_cell_conserves_energy() {
    let case = cell(2, "quad4")
        .replace("kinematics: linear", "density: 1000")
        .replace("scheme: { static: { increments: 2 } }", "step: 0.1, scheme: conserving")
        .replace("* t^2", "* 30 * t^2");
    let results = [1, 3].map(|ranks| Results::of(&case, ranks).table("energy.csv"));
    let energy = &results[0];
    let [work, numerical] = ["external_work", "numerical"].map(|name| energy.last(name));
    assert!(work > 1e3 && energy.last("kinetic") > 1.0, "{work}");
    assert!(numerical.abs() < 1e-7 * work, "{numerical:e} of {work:e}");
    for column in ["strain", "kinetic", "external_work"] {
        let [one, other] = [0, 1].map(|k| results[k].last(column));
        assert!((one - other).abs() < 1e-7 * work, "{column}");
    }
}

/// The error of the work in two long load steps of a large stretch is explained by the trapezoidal rule,
/// so that the run has no warning of energy from nowhere.
#[test]
fn a_large_stretch_in_few_steps_leaves_no_unexplained_energy() {
    let case = cell(2, "quad4")
        .replace("saint_venant_kirchhoff", "neo_hookean")
        .replace("    kinematics: linear\n", "")
        .replace("'0.01 * t^2'", "'1.2 * t'");
    let folder = Folder::new("stretch");
    folder.write("case.yml", &case);
    let output = run(2, &["case.yml", "-o", "out"], &folder).success();
    let energy = Results(folder).table("energy.csv");
    let [numerical, work] = ["numerical", "external_work"].map(|column| energy.last(column));
    assert!(numerical.abs() > 0.02 * work, "{numerical} of {work}");
    assert!(!output.text().contains("unexplained"), "{}", output.text());
}

/// Mistakes with periodic sides are reported with cause and cure.
#[test]
fn wrong_periodic_sides_are_refused() {
    let good = cell(2, "quad4");
    let rows = [
        (good.replace("offset: [1, 0]", "offset: [1, 0, 0]"), "2 entries"),
        (good.replace("offset: [1, 0]", "offset: [0, 0]"), "the offset is zero"),
        (good.replace("offset: [1, 0]", "offset: [-1, 0]"), "vector from the contactor to the target"),
        (good.replace("offset: [1, 0], ", ""), "periodic sides need `offset`"),
        (good.replace("'0.01 * t^2'", "0.01"), "the jump is 0.01 at t = 0"),
        (good.replace("'0.01 * t^2'", "'0.01 * x * t'"), "depends on t only"),
        (good.replace("x: '0.01 * t^2'", "z: '0.01 * t^2'"), "a 2D case has no z"),
        (good.replace("tied:", "  other:\n    mesh: { box: { min: [1, 0], max: [2, 1], cells: [2, 2] } }\n    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }\ntied:")
            .replace("target: cell.right", "target: other.right").replace("offset: [1, 0]", "offset: [2, 0]"), "on parts that are not joined"),
        (good.replace("displacement: { x: 0, y: 0 }", "displacement: { x: 0 }"), "along y"),
    ];
    for (text, words) in rows {
        let folder = Folder::new("periodic");
        folder.write("case.yml", &text);
        let output = run(0, &["case.yml", "-q"], &folder);
        assert_eq!(output.code, Some(3), "{words}: {}", output.text());
        assert_says(&output.stderr, &[words]);
    }
}
