//! Contact between two bodies by mortar segments: the patch test to rounding, the same results on
//! any number of ranks and with every strategy and solver, sharp corners, self-contact, and refused
//! input. If the covered area is omitted from a gap, or if averaged normals are used, the patch
//! tests fail.

mod common;

use common::{Folder, Results, run, shipped, stretch};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

/// Largest error of stress in all blocks and of pressure at all nodes of contactors at the last
/// step, divided by the load of 0.1 MPa.
fn errors(results: &Results, dimension: usize) -> [f64; 2] {
    const LOAD: f64 = 1e5;
    let mut steps: Vec<_> = std::fs::read_dir(results.0.join("out/fields"))
        .expect("fields")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    steps.sort();
    let mut worst = [0.0_f64; 2];
    let mut seen = [0, 0];
    for entry in std::fs::read_dir(steps.pop().expect("a step")).expect("pieces") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "vtu") {
            continue;
        }
        let piece = read_piece(&path).expect("a piece");
        if let Some(field) = piece.cell_data.get("cauchy_stress") {
            let VtuValues::Float64(stress) = &field.values else { panic!("stress is of numbers") };
            for (k, value) in stress.iter().enumerate().map(|(at, value)| (at % 6, value)) {
                let plane_strain = dimension == 2 && k == 2;
                let exact = if k == dimension - 1 { -LOAD } else { 0.0 };
                let error = if plane_strain { 0.0 } else { (value - exact).abs() / LOAD };
                worst[0] = worst[0].max(error);
                seen[0] += 1;
            }
        } else if let Some(field) = piece.point_data.get("contact_pressure") {
            let VtuValues::Float64(pressure) = &field.values else { panic!("pressure is of numbers") };
            pressure.iter().for_each(|value| worst[1] = worst[1].max((value - LOAD).abs() / LOAD));
            seen[1] += pressure.len();
        }
    }
    assert!(seen[0] > 0 && seen[1] > 0, "fields are there");
    worst
}

/// The lowest and the highest contact pressure at any node of the last step [Pa].
fn surface_pressures(results: &Results) -> [f64; 2] {
    let mut steps: Vec<_> = std::fs::read_dir(results.0.join("out/fields"))
        .expect("fields")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    steps.sort();
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for entry in std::fs::read_dir(steps.pop().expect("a step")).expect("pieces") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "vtu") {
            continue;
        }
        let piece = read_piece(&path).expect("a piece");
        let Some(field) = piece.point_data.get("contact_pressure") else { continue };
        let VtuValues::Float64(pressure) = &field.values else { panic!("pressure is of numbers") };
        range = pressure.iter().fold(range, |[low, high], p| [low.min(*p), high.max(*p)]);
    }
    range
}

const TWO_PASSES: [&str; 2] = [
    "  two_swapped: { contactor: two_lower.top, target: two_upper.bottom, normal: { penalty: { compliance: 2.0e-9 } }, friction: none }\n",
    "",
];

/// Blocks on blocks under a uniform pressure, on matching and non-matching meshes. Stress and
/// pressure are uniform to 1e-9 with every kind of element, with the roles of the scene.
#[test]
fn every_element_passes_the_patch_test() {
    let plane = ["quad4", "quad8", "quad9", "tri3", "tri6"].map(|element| ("blocks", 2, "quad4", element));
    let space = ["hex8", "hex20", "hex27", "wedge6", "pyramid5", "tet4", "tet10"]
        .map(|element| ("blocks-solid", 3, "hex8", element));
    for (case, dimension, shipped_element, element) in plane.into_iter().chain(space) {
        let changes = [
            (TWO_PASSES[0], TWO_PASSES[1]),
            (
                "contactor: two_upper.bottom, target: two_lower.top",
                "contactor: two_lower.top, target: two_upper.bottom",
            ),
            (shipped_element, element),
        ];
        let results = Results::of(&shipped(&format!("patch/{case}.yml"), &changes), 1);
        let [stress, pressure] = errors(&results, dimension);
        println!("{element}: stress {stress:.1e}, pressure {pressure:.1e}");
        assert!(stress < 1e-9 && pressure < 1e-9, "{element}: stress {stress:e}, pressure {pressure:e}");
        let free = dimension as i32 - 1;
        let force = 1e5 * 0.4_f64.powi(free) * stretch(free).powi(free);
        let axis = ["force_x", "force_y", "force_z"][dimension - 1];
        let contact = results.table("contact.csv");
        for (name, sign) in [("match", 1.0), ("one", 1.0), ("two", -1.0)] {
            let found = contact.only("contact", name).last(axis);
            assert!((found - sign * force).abs() < 1e-9 * force, "{element}, {name}: {found}, not {force}");
        }
    }
}

/// Two blocks side by side on one block whose facets end elsewhere. Each of the two covers
/// contactor facets partly.
const SIDE_BY_SIDE: &str = "
dimension: 2
bodies:
  lower:
    mesh: { box: { min: [0, 0], max: [0.4, 0.2], cells: [4, 2], element: ELEMENT } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
  left:
    mesh: { box: { min: [0, 0.2], max: [0.29, 0.4], cells: [3, 2], element: ELEMENT } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
  right:
    mesh: { box: { min: [0.29, 0.2], max: [0.4, 0.4], cells: [2, 2], element: ELEMENT } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
contact:
  left: { contactor: lower.top, target: left.bottom, normal: { penalty: { compliance: 1.0e-9 } } }
  right: { contactor: lower.top, target: right.bottom, normal: { penalty: { compliance: 1.0e-9 } } }
boundary:
  left_load: { on: left.top, pressure: '1.0e5 * t' }
  right_load: { on: right.top, pressure: '1.0e5 * t' }
  base: { on: lower.bottom, displacement: { y: 0 } }
  lower_side: { on: lower.left, displacement: { x: 0 } }
  left_side: { on: left.left, displacement: { x: 0 } }
  right_side: { on: right.left, displacement: { x: STRETCHED } }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 2 } }
";

/// The patch test on partly covered facets.
#[test]
fn partly_covered_facets_pass_the_patch_test() {
    for element in ["quad4", "quad9", "tri6"] {
        let moved = format!("'{:.17} * t'", 0.29 * (stretch(1) - 1.0));
        let text = SIDE_BY_SIDE.replace("ELEMENT", element).replace("STRETCHED", &moved);
        let results = Results::of(&text, 1);
        let table = results.table("contact.csv");
        // Pressures at nodes are means over both contacts: those of the vertices are in the table.
        let mut total = 0.0;
        for name in ["left", "right"] {
            let contact = table.only("contact", name);
            let peak = contact.last("max_pressure");
            assert!((peak / 1e5 - 1.0).abs() < 1e-9, "{element}, {name}: {peak}");
            total -= contact.last("force_y");
        }
        let force = 1e5 * 0.4 * stretch(1);
        assert!((total / force - 1.0).abs() < 1e-9, "{element}: {total}, not {force}");
        let reaction = results.table("reactions.csv").only("boundary", "base").last("force_y");
        assert!((reaction / force - 1.0).abs() < 1e-9, "{element}: {reaction}");
    }
}

/// Two blocks that are turned by half a radian. The base of the lower one and a side of the upper
/// one have the exact displacements.
const INCLINED: &str = "
dimension: 2
bodies:
  lower:
    mesh: { box: { min: [0, 0], max: [0.4, 0.2], cells: [5, 3], element: ELEMENT, map: TURN } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
  upper:
    mesh: { box: { min: [0, 0.2], max: [0.4, 0.4], cells: [4, 2], element: ELEMENT, map: TURN } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
contact: { joint: { contactor: upper.bottom, target: lower.top, normal: { penalty: { compliance: 1.0e-9 } } } }
boundary:
  load: { on: upper.top, pressure: '1.0e5 * t' }
  base: { on: lower.bottom, displacement: LOWER }
  side: { on: upper.left, displacement: UPPER }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 2 } }
";

/// The patch test on an inclined interface.
#[test]
fn an_inclined_interface_passes_the_patch_test() {
    let (sin, cos) = 0.5_f64.sin_cos();
    let (shear, lambda) = (1e6 / 2.6, 0.3e6 / (1.3 * 0.4));
    let along = stretch(1);
    let across = ((1.0 - along * along) * shear / lambda).exp() / along;
    let [a, b] = [along - 1.0, across - 1.0];
    let gradient = [
        [a * cos * cos + b * sin * sin, (a - b) * sin * cos],
        [(a - b) * sin * cos, a * sin * sin + b * cos * cos],
    ];
    let moved = |shift: f64| {
        let [[xx, xy], [yx, yy]] = gradient;
        let [x, y] = [-shift * -sin, -shift * cos];
        format!(
            "{{ x: 't * ({xx:.17} * x + {xy:.17} * y + {x:.17})', y: 't * ({yx:.17} * x + {yy:.17} * y + {y:.17})' }}"
        )
    };
    let turn = format!("{{ x: '{cos:.17} * x - {sin:.17} * y', y: '{sin:.17} * x + {cos:.17} * y' }}");
    for element in ["quad4", "quad9", "tri6"] {
        let text = INCLINED.replace("ELEMENT", element).replace("TURN", &turn);
        let text = text.replace("LOWER", &moved(0.0)).replace("UPPER", &moved(1e-4));
        let results = Results::of(&text, 1);
        let pressures = surface_pressures(&results);
        println!("{element}: pressures {pressures:?}");
        assert!(pressures.iter().all(|p| (p / 1e5 - 1.0).abs() < 1e-9), "{element}: {pressures:?}");
        let (contact, force) = (results.table("contact.csv"), 1e5 * 0.4 * along);
        for (column, exact) in [("force_x", -sin * force), ("force_y", cos * force)] {
            let found = contact.last(column);
            assert!((found - exact).abs() < 1e-9 * force, "{element}, {column}: {found}, not {exact}");
        }
    }
}

/// The patch test on quadrilaterals whose nodes are displaced within the interface. They are no
/// parallelograms, so that the quadrature is not exact.
#[test]
fn irregular_quadrilaterals_pass_the_patch_test() {
    let shifted = |from: f64, size: &str| {
        let bump = format!("sin(pi * (x - {from}) / 0.4) * sin(pi * y / 0.4)");
        format!("map: {{ x: 'x + {size} * {bump}', y: 'y - {size} * {bump}' }}, element: hex8")
    };
    let text = shipped("patch/blocks-solid.yml", &[(TWO_PASSES[0], TWO_PASSES[1]), ("2.0e-9", "1.0e-9")]);
    let lines = text.lines().map(|line| match line.split_once("min: [") {
        Some((_, rest)) => {
            let from: f64 = rest[..3].parse().expect("a number");
            let size = if rest.contains("0.0, 0.0], max") { "0.02" } else { "0.03" };
            line.replace("element: hex8", &shifted(from, size))
        }
        None => line.to_owned(),
    });
    let results = Results::of(&lines.map(|line| line + "\n").collect::<String>(), 1);
    let [stress, pressure] = errors(&results, 3);
    println!("irregular: stress {stress:.1e}, pressure {pressure:.1e}");
    assert!(stress < 1e-5 && pressure < 1e-5, "stress {stress:e}, pressure {pressure:e}");
}

/// 3D ironing at reduced size.
fn ironing_solid() -> String {
    shipped(
        "ironing/solid.yml",
        &[
            ("cells: [12, 12, 2]", "cells: [8, 8, 1]"),
            ("cells: [15, 11, 3]", "cells: [12, 8, 2]"),
            ("end: 1,", "end: 0.5,"),
        ],
    )
}

/// 2D ironing at reduced size.
fn ironing(strategy: &str) -> String {
    let text = shipped(
        "ironing/case.yml",
        &[
            ("cells: [48, 6]", "cells: [12, 3]"),
            ("cells: [40, 10]", "cells: [20, 4]"),
            ("end: 1,", "end: 0.5,"),
        ],
    );
    format!("{text}solver: {strategy}\n")
}

/// Checks that histories of a column agree to a fraction of its largest value.
#[track_caller]
fn agree(one: &Results, other: &Results, table: &str, column: &str, tolerance: f64) {
    let [one, other] = [one, other].map(|results| results.table(table).numbers(column));
    assert_eq!(one.len(), other.len(), "{column}");
    let size = one.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for (a, b) in one.iter().zip(&other) {
        assert!((a - b).abs() <= tolerance * size, "{column}: {a} and {b}");
    }
}

/// Displacements, forces, steps and Newton iterations are the same on 1, 2, 3, 4 and 8 ranks. On
/// eight ranks some own no contact.
#[test]
fn the_same_on_1_2_3_4_8_ranks() {
    for (text, probe) in [(ironing_solid(), "nose.u_z"), (ironing("{ linear: auto }"), "way.u_y")] {
        let alone = Results::of(&text, 1);
        for ranks in [2, 3, 4, 8] {
            let results = Results::of(&text, ranks);
            agree(&alone, &results, "probes.csv", probe, 1e-9);
            for column in ["force_n", "force_x", "force_y", "area", "max_pressure"] {
                agree(&alone, &results, "contact.csv", column, 1e-9);
            }
            let [a, b] = [&alone, &results].map(Results::record);
            for key in ["steps", "cut_steps", "newton_iterations"] {
                assert_eq!(a[key], b[key], "{key} on {ranks} ranks");
            }
        }
    }
}

/// A coarse curved target: the staggered strategy and the contact preconditioners find the forces
/// of the monolithic strategy. There is one equilibrium, independent of the facet below a vertex.
#[test]
fn strategies_and_solvers_agree_on_a_coarse_curved_target() {
    let monolithic = Results::of(&ironing("{ linear: direct }"), 1);
    for solver in [
        "{ strategy: { staggered: { tolerance: 1.0e-9 } } }",
        "{ linear: two_stage }",
        "{ linear: filtered_amg }",
        "{ linear: gmres_asm_ilu }",
    ] {
        let results = Results::of(&ironing(solver), 2);
        for column in ["force_x", "force_y"] {
            agree(&monolithic, &results, "contact.csv", column, 1e-6);
        }
    }
}

/// Without friction the equilibrium does not depend on the path. Ironing by five facets per step
/// gives the forces of steps of a quarter of a facet. For this reason only motion with friction is
/// limited.
#[test]
fn long_steps_without_friction_find_the_forces_of_short_ones() {
    let changes = [
        ("cells: [48, 6]", "cells: [12, 3]"),
        ("cells: [40, 10]", "cells: [20, 4]"),
        ("{ coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 5.0e9 } } }", "none"),
    ];
    let sides = [["slab.top", "indenter.bottom"], ["indenter.bottom", "slab.top"]];
    for [contactor, target] in sides {
        let ironed = |step: &str| {
            let text = shipped("ironing/case.yml", &changes)
                .replace("contactor: slab.top", &format!("contactor: {contactor}"))
                .replace("target: indenter.bottom", &format!("target: {target}"))
                .replace("step: 2.5e-2", &format!("step: {step}"));
            let table = Results::of(&text, 1).table("contact.csv");
            let at = |time: f64, column: &str| {
                let times = table.numbers("time");
                let row = times.iter().position(|t| (t - time).abs() < 1e-9).expect("a row");
                table.numbers(column)[row]
            };
            [0.5, 0.75, 1.0].map(|time| [at(time, "force_x"), at(time, "force_y")])
        };
        let [long, short] = ["0.25", "0.0125"].map(ironed);
        for (long, short) in long.iter().zip(&short) {
            let off = (long[0] - short[0]).hypot(long[1] - short[1]) / short[1].abs();
            assert!(off < 1e-4, "{contactor}: {long:?} {short:?}");
        }
    }
}

/// A block with sharp corners, pressed by a tenth of its height into a longer slab with another
/// mesh and dragged.
const SHARP: &str = "
dimension: 2
bodies:
  slab:
    mesh: { box: { min: [0, 0], max: [2.3, 0.6], cells: [23, 6], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0, poisson_ratio: 0.3 } }
  block:
    mesh: { box: { min: [0.4, 0.6], max: [1.4, 1.2], cells: [11, 7], element: quad4 } }
    material: { neo_hookean: { young_modulus: YOUNG, poisson_ratio: 0.3 } }
contact:
  sole:
    contactor: CONTACTOR
    target: TARGET
    normal: { penalty: { compliance: 1.0e-3 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 500 } } }
boundary:
  bed: { on: slab.bottom, displacement: { x: 0, y: 0 } }
  grip: { on: block.top, displacement: { x: 'if(t > 0.5, 0.6 * (t - 0.5), 0)', y: '-0.12 * min(t, 0.5)' } }
time: { end: 1, step: 2.5e-2, scheme: { static: {} } }
output: { fields: { every: 100 } }
";

/// The run of a sharp block completes without a cut step, with either side as the contactor, with
/// equal or ten times the stiffness, with penalties of 1, 10 and 100 E/h, and in few corrections
/// per step. The forces do not depend on the step, and those of the two roles agree.
#[test]
fn a_sharp_block_is_dragged_by_either_side() {
    let dragged = |young: &str, [contactor, target]: [&str; 2], penalty: f64, step: &str| {
        let text = SHARP
            .replace("YOUNG", young)
            .replace("CONTACTOR", contactor)
            .replace("TARGET", target)
            .replace("compliance: 1.0e-3", &format!("compliance: {}", 1.0 / penalty))
            .replace("stick_stiffness: 500", &format!("stick_stiffness: {}", 0.5 * penalty))
            .replace("step: 2.5e-2", &format!("step: {step}"));
        let results = Results::of(&text, 1);
        let record = results.record();
        let [steps, iterations, cuts] =
            ["steps", "newton_iterations", "cut_steps"].map(|key| record[key].as_u64().expect("a count"));
        println!(
            "E = {young}, {contactor}, {penalty}, {step}: {iterations} iterations in {steps} steps, {cuts} cut"
        );
        assert!(iterations <= 4 * steps && cuts == 0, "{contactor}: {iterations} in {steps}, {cuts} cut");
        let bed = results.table("reactions.csv").only("boundary", "bed");
        [bed.last("force_x"), bed.last("force_y")]
    };
    let roles = [["block.bottom", "slab.top"], ["slab.top", "block.bottom"]];
    for young in ["1.0", "10.0"] {
        for penalty in [10.0, 100.0, 1000.0] {
            let [one, other] = roles.map(|roles| dragged(young, roles, penalty, "2.5e-2"));
            println!("forces {one:?} and {other:?}");
            assert!((one[1] - other[1]).abs() < 0.01 * one[1].abs(), "{one:?} {other:?}");
            // Friction at the two corners, where pressures are singular, is resolved by the facets of the
            // contactor: 1.9 % at most here.
            assert!((one[0] - other[0]).abs() < 0.025 * one[0].abs(), "{one:?} {other:?}");
            if penalty == 1000.0 {
                for (roles, long) in roles.into_iter().zip([one, other]) {
                    let short = dragged(young, roles, penalty, "5.0e-3");
                    let apart = (short[0] - long[0]).hypot(short[1] - long[1]);
                    assert!(apart < 1e-6 * long[1].abs(), "{short:?} {long:?}");
                }
            }
        }
    }
}

/// A block, tilted by 15 degrees, that is pressed into a slab with its lower edge and dragged without friction.
const TILTED: &str = r#"
dimension: 2
bodies:
  slab:
    mesh: { box: { min: [0, 0], max: [2, 0.8], cells: [20, 8], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1, poisson_ratio: 0.3 } }
  block:
    mesh:
      box:
        min: [0, 0]
        max: [0.6, 0.6]
        cells: [4, 4]
        element: quad4
        map: { x: 0.7 + 0.9659 * x - 0.2588 * y, y: 0.8 + 0.2588 * x + 0.9659 * y }
    sets: { skin: { of: facets, where: "x > 0" } }
    material: { neo_hookean: { young_modulus: 1, poisson_ratio: 0.3 } }
contact:
  skin:
    contactor: CONTACTOR
    target: TARGET
    normal: { penalty: { compliance: 0.01 } }
    initial_overclosure: accept
boundary:
  bed: { on: slab.bottom, displacement: { x: 0, y: 0 } }
  grip: { on: block.top, displacement: { x: "max(t - 1, 0)", y: "-0.1 * min(t, 1)" } }
time: { end: 1.3, step: 0.05, scheme: { static: {} } }
output: { fields: { every: 0 } }
"#;

/// Without friction the force on a flat slab is normal to it, whichever side is the contactor. With the
/// normals of the block's facets a quarter of it would be tangential, and the run would end with code 5. With
/// `block.bottom` the edge is the end of the contactor.
#[test]
fn an_edge_slides_without_friction_on_1_2_3_4_8_ranks() {
    let dragged = |[contactor, target]: [&str; 2], ranks: usize| {
        let text = TILTED.replace("CONTACTOR", contactor).replace("TARGET", target);
        let results = Results::of(&text, ranks);
        let bed = results.table("reactions.csv").only("boundary", "bed");
        [bed.numbers("force_x"), bed.numbers("force_y")]
    };
    let last = |forces: &[Vec<f64>; 2]| forces[1][forces[1].len() - 1];
    let slab = dragged(["slab.top", "block.skin"], 1);
    for (contactor, several) in [("block.skin", &[2, 3, 4, 8][..]), ("block.bottom", &[3])] {
        let alone = dragged([contactor, "slab.top"], 1);
        println!("{contactor}: {alone:?}, slab: {slab:?}");
        for (along, normal) in alone[0].iter().zip(&alone[1]) {
            assert!(along.abs() <= 0.025 * normal, "{contactor}: {along} and {normal}");
        }
        assert!((last(&alone) / last(&slab) - 1.0).abs() < 0.04, "{contactor}: {alone:?} {slab:?}");
        for &ranks in several {
            let found = dragged([contactor, "slab.top"], ranks);
            for (a, b) in alone.concat().iter().zip(found.concat()) {
                assert!((a - b).abs() < 1e-9 * last(&alone), "{contactor}, {ranks} ranks: {a} and {b}");
            }
        }
    }
}

/// A flat contactor keeps its own normals beside an edge of the target, also if it is one facet wide, so
/// that all its facets are at its boundary.
#[test]
fn a_narrow_slab_keeps_its_normals() {
    let narrow = TILTED
        .replace("dimension: 2", "dimension: 3")
        .replace("min: [0, 0]", "min: [0, 0, 0]")
        .replace(
            "max: [2, 0.8], cells: [20, 8], element: quad4",
            "max: [2, 0.8, 0.1], cells: [20, 8, 1], element: hex8",
        )
        .replace("max: [0.6, 0.6]", "max: [0.6, 0.6, 0.1]")
        .replace("cells: [4, 4]\n        element: quad4", "cells: [4, 4, 1]\n        element: hex8")
        .replace("0.7 + 0.9659", "0.73 + 0.9659")
        .replace("slab.bottom", "slab.front")
        .replace("block.top", "block.back")
        .replace("CONTACTOR", "slab.back")
        .replace("TARGET", "block.skin");
    let results = Results::of(&narrow, 2);
    let bed = results.table("reactions.csv").only("boundary", "bed");
    let (along, normal) = (bed.numbers("force_x"), bed.numbers("force_y"));
    assert!(normal[normal.len() - 1] > 5e-4, "{normal:?}");
    for (along, normal) in along.iter().zip(&normal) {
        assert!(along.abs() <= 0.04 * normal, "{along} and {normal}");
    }
}

/// Two bodies collide off-centre and separate. Energy and both momenta are conserved to rounding,
/// with and without friction, in 2D and 3D. The energy lost to friction is heat.
#[test]
fn collisions_keep_energy_and_momentum() {
    let plane = [
        ("cells: [12, 12]", "cells: [6, 6]"),
        ("cells: [14, 14]", "cells: [7, 7]"),
        ("step: 5.0e-5", "step: 1.0e-4"),
    ];
    let space = [
        ("cells: [6, 6, 6]", "cells: [3, 3, 3]"),
        ("cells: [7, 7, 7]", "cells: [4, 4, 4]"),
        ("step: 1.0e-4", "step: 2.0e-4"),
    ];
    for (case, changes) in [("case", plane), ("friction", plane), ("solid", space)] {
        let results = Results::of(&shipped(&format!("collision/{case}.yml"), &changes), 1);
        let energy = results.table("energy.csv");
        let kinetic = energy.numbers("kinetic");
        let lost = energy.numbers("numerical").iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        assert!(lost < 1e-12 * kinetic[0], "{case}: {lost} J of {} J", kinetic[0]);
        let met = energy.numbers("contact").iter().any(|energy| *energy > 1e-4 * kinetic[0]);
        assert!(met, "{case}: the bodies meet");
        let heat = energy.last("friction_dissipated");
        let expected = case != "case";
        assert!((heat > 1e-3 * kinetic[0]) == expected, "{case}: heat {heat} J");
        let momentum = results.table("momentum.csv");
        for column in momentum.names().skip(2).map(str::to_owned).collect::<Vec<_>>() {
            let values = momentum.numbers(&column);
            let size = if column.starts_with("angular") { "angular" } else { "linear" };
            let largest = momentum
                .names()
                .filter(|name| name.starts_with(size))
                .flat_map(|name| momentum.numbers(name))
                .fold(0.0_f64, |most, value| most.max(value.abs()));
            let drift = values.iter().map(|value| (value - values[0]).abs()).fold(0.0, f64::max);
            assert!(
                drift < 1e-8 * largest.max(1e-3 * kinetic[0]),
                "{case}: {column} drifts by {drift:e} of {largest:e}"
            );
        }
    }
}

/// Two blocks that are one body, of `cells` in x and y each, with sets `seam` (both touching
/// faces), `base`, `lid` and `side`, in Gmsh's format.
fn two_in_one(cells: [[usize; 2]; 2]) -> String {
    let mut nodes = Vec::new();
    let mut lines = Vec::new();
    let mut quads = Vec::new();
    for (block, [nx, ny]) in cells.into_iter().enumerate() {
        let first = nodes.len() + 1;
        let node = |i: usize, j: usize| first + j * (nx + 1) + i;
        for (j, i) in (0..=ny).flat_map(|j| (0..=nx).map(move |i| (j, i))) {
            nodes.push([0.4 * i as f64 / nx as f64, 0.2 * (block as f64 + j as f64 / ny as f64)]);
        }
        let (low, high) = if block == 0 { (2, 1) } else { (1, 3) };
        lines.extend((0..nx).map(|i| (low, node(i, 0), node(i + 1, 0))));
        lines.extend((0..nx).map(|i| (high, node(i, ny), node(i + 1, ny))));
        lines.extend((0..ny).map(|j| (4, node(0, j), node(0, j + 1))));
        let corners = |(i, j)| [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        quads.extend((0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(corners));
    }
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n1 1 \"seam\"\n1 2 \"base\"\n1 3 \"lid\"\n1 4 \"side\"\n2 5 \"all\"\n\
         $EndPhysicalNames\n",
    );
    text += &format!("$Nodes\n{}\n", nodes.len());
    for (number, [x, y]) in nodes.iter().enumerate() {
        text += &format!("{} {x:.17} {y:.17} 0\n", number + 1);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", lines.len() + quads.len());
    for (number, (set, a, b)) in lines.iter().enumerate() {
        text += &format!("{} 1 2 {set} {set} {a} {b}\n", number + 1);
    }
    for (number, [a, b, c, d]) in quads.iter().enumerate() {
        text += &format!("{} 3 2 5 5 {a} {b} {c} {d}\n", lines.len() + number + 1);
    }
    text + "$EndElements\n"
}

const ITSELF: &str = "
dimension: 2
bodies:
  blocks:
    mesh: { file: blocks.msh, merge: never }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
contact:
  seam: { contactor: blocks.seam, target: blocks.seam, normal: { penalty: { compliance: 1.0e-9 } } }
boundary:
  load: { on: blocks.lid, pressure: '1.0e5 * t' }
  base: { on: blocks.base, displacement: { y: 0 } }
  side: { on: blocks.side, displacement: { x: 0 } }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 2 } }
";

/// A surface that is its own target passes the patch test. Its facets are contactors and targets in
/// turn, with half of the pressure each.
#[test]
fn a_surface_meets_itself() {
    for ranks in [1, 3] {
        let folder = Folder::new("itself");
        folder.write("blocks.msh", &two_in_one([[5, 3], [4, 2]]));
        folder.write("case.yml", ITSELF);
        run(ranks, &["case.yml", "--output", "out"], &folder).success();
        let results = Results(folder);
        let [stress, pressure] = errors(&results, 2);
        assert!(stress < 1e-9 && pressure < 1e-9, "{ranks} ranks: stress {stress:e}, pressure {pressure:e}");
        let (contact, force) = (results.table("contact.csv"), 1e5 * 0.4 * stretch(1));
        let found = contact.last("force_n");
        assert!((found - force).abs() < 1e-9 * force, "{ranks} ranks: {found} N, not {force} N");
    }
}

/// A block of a tenth of the size of the plate's facets, which turns over the plate by 180 degrees and is
/// then pressed into it. No component of a corner's motion exceeds 0.14 m; a search needs 0.15 m.
const TURNING: &str = "
dimension: 2
bodies:
  plate:
    mesh: { box: { min: [-1.5, -1], max: [1.5, 0], cells: [3, 1] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
  block:
    mesh: { box: { min: [-0.05, 0.03], max: [0.05, 0.13], cells: [2, 2] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
contact: { joint: { contactor: [block.left, block.right, block.bottom, block.top], target: plate.top, normal: { penalty: { compliance: 1.0e-7 } } } }
boundary:
  base: { on: plate.bottom, displacement: { x: 0, y: 0 } }
  held: { on: block, motion: { translation: { y: DOWN }, rotation: { about: [0, 0.08], angle: ANGLE } } }
TIME
solver: { newton: { tolerance: 1.0e-10 } }
";

/// A facet that turns towards the target without moving far is found, in statics and over the steps of the
/// conserving scheme: the block presses with the other side as with the first.
#[test]
fn what_turns_over_the_target_is_found() {
    let statics = "time: { end: 7, scheme: { static: { increments: 7 } } }";
    let conserving = "time: { end: 7, step: 1, scheme: conserving }";
    let force = |time: &str, angle: &str| {
        let folder = Folder::new("turning");
        let down = "'-0.04 * max(t - 6, 0)'";
        let text = TURNING.replace("DOWN", down).replace("ANGLE", angle).replace("TIME", time);
        folder.write("case.yml", &text);
        run(1, &["case.yml", "--output", "out"], &folder).success();
        Results(folder).table("contact.csv").last("force_n")
    };
    for time in [statics, conserving] {
        let expected = force(time, "0");
        assert!(expected > 100.0, "{time}: {expected} N");
        let found = force(time, "'min(t, 6) * pi / 6'");
        assert!((found - expected).abs() < 1e-6 * expected, "{time}: {found} N, not {expected} N");
    }
}

/// Blocks with different meshes that stand on each other and on a plane. Every surface may touch
/// every other one.
const GENERAL: &str = "
dimension: 2
bodies:
  upper:
    mesh: { box: { min: [0, 0.2], max: [0.4, 0.4], cells: [5, 3] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
  lower:
    mesh: { box: { min: [0, 0], max: [0.4, 0.2], cells: [4, 2] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact: all
boundary:
  load: { on: upper.top, pressure: '1.0e5 * t' }
  side: { on: upper.left, displacement: { x: 0 } }
  other: { on: lower.left, displacement: { x: 0 } }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 2 } }
";

/// [`GENERAL`] in space.
fn general_in_3d() -> String {
    [
        ("dimension: 2", "dimension: 3"),
        (
            "min: [0, 0.2], max: [0.4, 0.4], cells: [5, 3]",
            "min: [0, 0, 0.2], max: [0.4, 0.3, 0.4], cells: [5, 3, 2]",
        ),
        (
            "min: [0, 0], max: [0.4, 0.2], cells: [4, 2]",
            "min: [0, 0, 0], max: [0.4, 0.3, 0.2], cells: [4, 4, 1]",
        ),
        ("point: [0, 0], normal: [0, 1]", "point: [0, 0, 0], normal: [0, 0, 1]"),
        ("other: {", "front: { on: [upper.front, lower.front], displacement: { y: 0 } }\n  other: {"),
    ]
    .iter()
    .fold(GENERAL.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// Contact of all surfaces with all others and with the obstacle passes the patch test in 2D and 3D, on
/// any number of ranks. The stress is uniform, and both contacts carry the load. Between the blocks
/// each side carries half of it as the contactor.
#[test]
fn whatever_there_is_meets_whatever_else() {
    let plane = (2, GENERAL.to_owned(), 0.4 * stretch(1));
    let space = (3, general_in_3d(), 0.12 * stretch(2).powi(2));
    for (dimension, text, area) in [plane, space] {
        for ranks in [1, 3] {
            let results = Results::of(&text, ranks);
            let [stress, _] = errors(&results, dimension);
            assert!(stress < 1e-9, "{ranks} ranks: stress {stress:e}");
            let force = 1e5 * area;
            for name in ["all", "all-floor"] {
                let found = results.table("contact.csv").only("contact", name).last("force_n");
                assert!(
                    (found - force).abs() < 1e-9 * force,
                    "{ranks} ranks, {name}: {found} N, not {force} N"
                );
            }
        }
    }
}

/// A block on a wider one under their weight, without friction. The sides of the upper block stand
/// upright on the lower one, which bulges beside it.
const STACK: &str = "
dimension: 3
bodies:
  lower: { mesh: { box: { min: [0, 0, 0], max: [1, 1, 0.5], cells: [3, 3, 2] } }, material: { neo_hookean: { young_modulus: 1.0e+6, poisson_ratio: 0.3 } }, density: 1000 }
  upper: { mesh: { box: { min: [0.1, 0.15, 0.5], max: [0.9, 0.85, 0.9], cells: [4, 2, 2] } }, material: { neo_hookean: { young_modulus: 5.0e+5, poisson_ratio: 0.3 } }, density: 1000 }
obstacles: { floor: { plane: { point: [0, 0, 0], normal: [0, 0, 1] } } }
contact: CONTACT
boundary: { weight: { on: [lower, upper], gravity: [0, 0, -9.81] } }
time: { end: 1, scheme: { static: { increments: 2 } } }
output: { fields: { every: 0 } }
";

/// Facets that stand upright on the other side carry nothing: `contact: all` needs no more iterations than
/// a contact that names the faces, and carries the same weight.
#[test]
fn upright_sides_carry_nothing() {
    let named = "{ pair: { contactor: upper.bottom, target: lower.top, friction: none }, \
                 base: { contactor: lower.bottom, target: floor, friction: none } }";
    let weight = 1000.0 * 9.81 * 0.8 * 0.7 * 0.4;
    for (contact, name, ranks) in [(named, "pair", 1), ("all", "all", 1), ("all", "all", 3)] {
        let results = Results::of(&STACK.replace("CONTACT", contact), ranks);
        let force = results.table("contact.csv").only("contact", name).last("force_n");
        // The sum of the normal forces is larger than the weight by the slope of the dented surface.
        assert!((force / weight - 1.0).abs() < 1e-5, "{name}: {force} N, not {weight} N");
        let iterations = results.record()["newton_iterations"].as_u64().expect("a count");
        assert!(iterations <= 3, "{name}: {iterations}");
    }
}

/// A block that falls on its corner. Facets next to the corner have an angle of more than 60
/// degrees to the plane, so that all their nodes share the force of the vertex.
const ON_A_CORNER: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [-1, -1], max: [1, 1], cells: [2, 2], map: { x: '0.1 * (cos(0.2) * x - sin(0.2) * y)', y: '0.1186 + 0.1 * (sin(0.2) * x + cos(0.2) * y)' } } }
    material: { neo_hookean: { young_modulus: 1.0e5, poisson_ratio: 0.3 } }
    density: 1000
    initial_velocity: [0, -2]
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact: { floor: { contactor: all, target: floor } }
time: { end: 0.05, step: 1.0e-3, scheme: conserving }
output: { fields: { every: 0 } }
";

/// Forces of a vertex also reach the nodes of other ranks over a plane. Energy and the momentum
/// along the plane are conserved to rounding.
#[test]
fn a_corner_on_a_plane_is_alike_on_1_2_3_4_ranks() {
    for ranks in [1, 2, 3, 4] {
        let results = Results::of(ON_A_CORNER, ranks);
        let lost = results.table("energy.csv").last("numerical");
        let sideways = results.table("momentum.csv").last("linear_x");
        assert!(
            lost.abs() < 1e-8 && sideways.abs() < 1e-10,
            "{ranks} ranks: {lost} J of 80 J, {sideways} N s"
        );
        assert!(results.table("contact.csv").numbers("force_n").iter().any(|force| *force > 0.0));
    }
}

/// A node of two contacts, such as every surface node under `contact: all`, has the pressure of the
/// closed one, in tables and in fields.
#[test]
fn a_node_of_two_contacts_has_their_pressure() {
    let one =
        GENERAL.replace("fields: { every: 2 }", "fields: { every: 2 }, probes: { foot: { at: [0, 0] } }");
    let results = Results::of(&one, 1);
    let found = results.table("probes.csv").last("foot.contact_pressure");
    assert!((found - 1e5).abs() < 1e-4, "{found} Pa at the foot");
    let [_, highest] = surface_pressures(&results);
    assert!((highest - 1e5).abs() < 1e-3, "{highest} Pa at most in the fields");
}

/// Rings with different meshes that touch on a circle, under internal pressure
/// (`meshes/patch/rings.yml`). If the gaps of their polygons are treated as zero, the contact
/// pressure is Lame's everywhere. Otherwise the rings do not touch.
#[test]
fn polygons_on_one_circle_fit() {
    // Of unit radius, with bores and rims at 0.5 and 1.5, under 0.001 inside: overclosure over compliances.
    let exact = 0.91e-3 * (0.5 / 0.75) / (1.308_996_938_995_747e-3 + 0.91 * (1.25 / 0.75 + 3.25 / 1.25));
    for ranks in [1, 3] {
        let results = Results::of(&shipped("patch/rings.yml", &[]), ranks);
        let (contact, probes) = (results.table("contact.csv"), results.table("probes.csv"));
        let found = ["end.contact_pressure", "middle.contact_pressure"].map(|name| probes.last(name));
        for pressure in found.into_iter().chain([contact.last("max_pressure")]) {
            assert!((pressure / exact - 1.0).abs() < 5e-3, "{ranks} ranks: {pressure}, not {exact}");
        }
    }
    let apart = Results::of(&shipped("patch/rings.yml", &[("conform", "adjust")]), 1);
    assert_eq!(apart.table("contact.csv").last("points"), 0.0);
}

/// A gap of a tenth of a facet that `initial_overclosure: conform` treats as closed carries the forces of
/// blocks that touch. If the weight of points fades from gap zero on there, they act on two thirds of the area.
#[test]
fn a_closed_gap_carries_like_none() {
    let law = "target: match_lower.top, normal: { penalty: { compliance: 1.0e-9 } }";
    let closed = format!("{law}, initial_overclosure: conform");
    let gap = [
        ("min: [0.0, 0.2], max: [0.4, 0.4]", "min: [0.0, 0.21], max: [0.4, 0.41]"),
        ("match: { at: [0.4, 0.2]", "match: { at: [0.4, 0.21]"),
        (law, &*closed),
    ];
    let moving = [
        ("poisson_ratio: 0.3 } }", "poisson_ratio: 0.3 } }\n    density: 1000"),
        (
            "time: { end: 1, scheme: { static: { increments: 2 } } }",
            "time: { end: 4.0e-4, step: 1.0e-4, scheme: conserving }",
        ),
        ("1.0e5 * t", "1.0e5"),
    ];
    for scheme in [&[][..], &moving] {
        let results =
            |changes: &[&[(&str, &str)]]| Results::of(&shipped("patch/blocks.yml", &changes.concat()), 1);
        let (touching, apart) = (results(&[scheme]), results(&[scheme, &gap]));
        for column in ["force_n", "max_pressure", "area"] {
            agree(&touching, &apart, "contact.csv", column, 1e-9);
        }
    }
}

/// The pressures of rings that overlap are at the start far above those of the balance. Tangents must not
/// have them: with them Newton's method takes 6 iterations, and fails on a finer mesh.
#[test]
fn overlapping_rings_converge_at_once() {
    let [inner, outer] = ["cells: [6, 12]", "cells: [8, 16]"];
    let [refined, wider] = [inner, outer].map(|cells| format!("{cells}, element: tri6"));
    let changes =
        [(inner, &*refined), (outer, &*wider), ("min: [1, 0]", "min: [0.98, 0]"), ("conform", "accept")];
    let results = Results::of(&shipped("patch/rings.yml", &changes), 1);
    assert_eq!(results.table("contact.csv").last("points"), 13.0);
    let iterations = results.record()["newton_iterations"].as_u64().expect("a number");
    assert!(iterations <= 3, "{iterations}");
}

/// Blocks fall on each other and on the floor, tip over and slide off (`meshes/pile`). Energy is
/// conserved to rounding. Without friction no force acts sideways. The results are the same on any
/// number of ranks.
#[test]
fn a_pile_keeps_its_energy() {
    let mut counts = Vec::new();
    for ranks in [1, 3] {
        let results = Results::of(&shipped("pile/case.yml", &[("end: 0.8", "end: 0.3")]), ranks);
        let (energy, momentum) = (results.table("energy.csv"), results.table("momentum.csv"));
        let largest = energy.numbers("total").into_iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        let lost = energy.numbers("numerical").into_iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        assert!(largest > 300.0 && lost < 1e-9 * largest, "{ranks} ranks: {lost} J of {largest} J");
        let sideways = momentum.numbers("linear_x").into_iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        let down = momentum.numbers("linear_y").into_iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        assert!(sideways < 1e-9 * down, "{ranks} ranks: {sideways} of {down} kg m/s");
        let record = results.record();
        counts.push([record["steps"].as_u64(), record["newton_iterations"].as_u64()]);
    }
    assert_eq!(counts[0], counts[1]);
}

/// A thin tube under pressure touches itself, and is flattened, like an inextensible ring
/// (`meshes/tube/elastica.py`), on any number of ranks.
#[test]
fn a_tube_closes_at_the_pressure_of_the_elastica() {
    const UNIT: f64 = 0.7326;
    let mut forces = Vec::new();
    for ranks in [1, 3] {
        let results = Results::of(&shipped("tube/case.yml", &[]), ranks);
        let (contact, probes) = (results.table("contact.csv"), results.table("probes.csv"));
        let pressures: Vec<f64> = contact.numbers("time").iter().map(|time| 12.0 * time).collect();
        let (points, force) = (contact.numbers("points"), contact.numbers("force_n"));
        let closed = points.iter().position(|points| *points > 0.0).expect("it closes");
        let u = probes.numbers("upper.u_y");
        let slope = (pressures[closed - 1] - pressures[closed - 2]) / (u[closed - 1] - u[closed - 2]);
        let touches = pressures[closed - 1] + slope * (-2.0 * 0.9801 - u[closed - 1]);
        assert!((touches / 5.1883 - 1.0).abs() < 0.01, "{ranks} ranks: it touches at {touches}");
        for (pressure, exact) in [(7.0, 1.4132), (8.0, 2.1960), (9.0, 2.9792)] {
            let at = pressures.iter().position(|p| *p >= pressure - 1e-9).expect("a step");
            let part = (pressure - pressures[at - 1]) / (pressures[at] - pressures[at - 1]);
            let found = (force[at - 1] + part * (force[at] - force[at - 1])) / UNIT;
            assert!((found / exact - 1.0).abs() < 0.01, "{ranks} ranks: {found} at {pressure}, not {exact}");
        }
        forces.push(force);
    }
    assert_eq!(forces[0].len(), forces[1].len());
    let differ = forces[0].iter().zip(&forces[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(differ < 1e-6, "forces differ by {differ} N");
}

/// In space a slice of the tube between two fixed planes folds onto itself as in the plane. It has
/// three skewed layers of elements, so that its facets meet others that do not match. Per width its
/// force is that of the plane tube to 1e-5.
#[test]
fn a_slice_of_the_tube_folds_as_in_the_plane() {
    const WIDTH: f64 = 0.15;
    let shorter = (
        "time: { end: 1, scheme: { static: { increments: 48 } } }",
        "time: { end: 0.75, scheme: { static: { increments: 36 } } }",
    );
    let plane = shipped("tube/case.yml", &[shorter]);
    let slice = plane
        .replace("dimension: 2", "dimension: 3")
        .replace("min: [0.99, -1.5707963267948966]", "min: [0.99, -1.5707963267948966, 0]")
        .replace("max: [1.01, 1.5707963267948966]", "max: [1.01, 1.5707963267948966, 0.15]")
        .replace("cells: [1, 80]", "cells: [1, 80, 3]")
        .replace("element: quad8", "element: hex20")
        .replace("y: \"0.99 * x * sin(y)\"", "y: \"0.99 * x * sin(y)\", z: \"z + 2 * z * (0.15 - z) * sin(5 * y)\"")
        .replace("on: tube.bottom", "on: tube.front")
        .replace("on: tube.top", "on: tube.back")
        .replace("boundary:\n", "boundary:\n  near: { on: tube.bottom, displacement: { z: 0 } }\n  far: { on: tube.top, displacement: { z: 0 } }\n")
        .replace("at: [0, 0.9801]", "at: [0, 0.9801, 0]");
    let force = |case: &str| Results::of(case, 1).table("contact.csv").last("force_n");
    let [plane, slice] = [force(&plane), force(&slice) / WIDTH];
    assert!(plane > 2.0, "the tube is closed: {plane} N/m");
    assert!((slice / plane - 1.0).abs() < 1e-5, "{slice} N/m in space, {plane} N/m in the plane");
}

/// Surfaces that cannot be distinguished, or cannot touch themselves, are refused with their line.
#[test]
fn sides_with_common_facets_are_refused() {
    for (contactor, target, words) in [
        ("blocks.seam", "blocks.rim", "have 9 facets in common"),
        ("blocks.foot", "blocks.foot", "single facet"),
    ] {
        let folder = Folder::new("itself");
        let mesh = two_in_one([[5, 3], [4, 2]])
            .replace("5\n1 1 \"seam\"", "7\n1 6 \"rim\"\n1 7 \"foot\"\n1 1 \"seam\"");
        // A line of Gmsh has one physical group: groups of the same lines are made by lines of their own.
        let (head, rest) = mesh.split_once("$Elements\n").expect("elements");
        let (count, lines) = rest.split_once('\n').expect("a count");
        let seam: Vec<&str> = lines.lines().filter(|line| line.contains(" 1 2 1 1 ")).collect();
        let base = lines.lines().find(|line| line.contains(" 1 2 2 2 ")).expect("a line of the base");
        let more: Vec<String> = seam
            .iter()
            .map(|line| line.replacen(" 1 2 1 1 ", " 1 2 6 6 ", 1))
            .chain([base.replacen(" 1 2 2 2 ", " 1 2 7 7 ", 1)])
            .collect();
        let numbered = more.iter().enumerate().map(|(k, line)| {
            let (_, rest) = line.split_once(' ').expect("a number");
            format!("{} {rest}\n", 1000 + k)
        });
        let total = count.parse::<usize>().expect("a count") + more.len();
        let added: String = numbered.collect();
        let mesh = format!("{head}$Elements\n{total}\n{added}{lines}");
        folder.write("blocks.msh", &mesh);
        let text = ITSELF.replace(
            "contactor: blocks.seam, target: blocks.seam",
            &format!("contactor: {contactor}, target: {target}"),
        );
        folder.write("case.yml", &text);
        let output = run(1, &["case.yml", "--output", "out"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        assert!(output.stderr.contains(words) && output.stderr.contains("case.yml:8:"), "{}", output.stderr);
    }
}
