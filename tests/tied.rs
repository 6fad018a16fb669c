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
    for linear in ["gmres_asm_ilu", "cg_icc", "filtered_amg", "gmres_amg", "cg_filtered_amg"] {
        let solver = format!("solver: {{ linear: {linear}, krylov: {{ tolerance: 1e-11 }} }}\n");
        let results = Results::of(&format!("{text}{solver}"), 2);
        let worst = worst_stress(&results, &stress);
        assert!(worst < 1e-7, "{linear}: {worst:.1e}");
        assert_eq!(results.record()["linear_fallbacks"], 0, "{linear}");
    }
}

/// Multigrid takes as many iterations with a stiff bond as with one that is as soft as an element.
#[test]
fn multigrid_does_not_feel_the_stiffness_of_the_bond() {
    let text = PATCH_3D.replace("LOWER", "hex8").replace("UPPER", "hex8");
    let text =
        text.replace("cells: [2, 3, 2]", "cells: [6, 6, 4]").replace("cells: [3, 2, 1]", "cells: [7, 7, 3]");
    let iterations = |stiffness: &str| {
        let text =
            text.replace("target: lower.top }", &format!("target: lower.top, stiffness: {stiffness} }}"));
        let solver = "solver: { linear: cg_filtered_amg, krylov: { tolerance: 1e-8 } }\n";
        let record = Results::of(&format!("{text}{solver}"), 1).record();
        assert_eq!(record["linear_fallbacks"], 0, "{stiffness}");
        record["krylov_iterations"].as_u64().expect("a number")
    };
    let soft = iterations("1.0e7");
    let stiff = iterations("1.0e12");
    assert!(stiff <= soft + 2, "{soft} and {stiff}");
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
