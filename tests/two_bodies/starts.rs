//! Static starts of bodies that only contact holds, and situations that may be mistaken for a
//! missed contact.

use super::*;
use crate::common::{Folder, run};

/// A block that is a million times as stiff as its stratum also rests on it. The spring under free
/// bodies is soft compared with their support, and the tolerance of a linear solve is limited by
/// rounding.
#[test]
fn a_block_rests_on_a_stratum_a_million_times_softer() {
    let mut text = shipped("concrete-block/case.yml", &COARSE_BLOCK).replace("end: 0.03", "end: 1.0e-3");
    let stratum = 1.0e6 / 2.3e8;
    for (as_shipped, scaled) in [
        ("2.3e10".to_owned(), "1.0e12".to_owned()),
        ("2.3e8".to_owned(), "1.0e6".to_owned()),
        ("-9.81".to_owned(), format!("{:e}", -9.81 * stratum)),
        ("-3.0e5".to_owned(), format!("{:e}", -3.0e5 * stratum)),
        ("8.0e4 *".to_owned(), format!("{:e} *", 8.0e4 * stratum)),
        ("compliance: 1.0e-11".to_owned(), "compliance: 1.0e-8".to_owned()),
    ] {
        assert!(text.contains(&as_shipped), "{as_shipped}");
        text = text.replace(&as_shipped, &scaled);
    }
    let results = Results::of(&text, 1);
    let [x, y] = supports_at_rest(&results);
    assert!((y / (BURDEN * stratum) - 1.0).abs() < 1e-8 && x.abs() < 1e-8 * y, "{x} and {y} N");
    let settled: Vec<f64> = results.probes("u_y").iter().map(|u| u[0]).collect();
    // It settles without bending.
    assert!(settled.iter().all(|u| *u < 0.0 && (u / settled[0] - 1.0).abs() < 1e-5), "{settled:?}");
}

/// Off the middle of its stratum the block has no nearby frictionless equilibrium. It is held in
/// its position by a small force, which is reported, equally on 1, 2 and 3 ranks, on its own mesh
/// and on a graded one.
#[test]
fn the_concrete_block_is_held_off_the_middle_on_1_2_3_ranks() {
    let aside = ("min: [1.0, 1.0], max: [2.0, 1.5]", "min: [1.1137, 1.0], max: [2.1137, 1.5]");
    let graded = ("cells: [10, 5],", "cells: [10, 5], map: { x: \"x + 0.05*(x-1)*(2-x)\" },");
    for change in [aside, graded] {
        let text = shipped("concrete-block/case.yml", &COARSE_BLOCK).replace("end: 0.03", "end: 1.0e-3");
        assert!(text.contains(change.0), "{}", change.0);
        let text = text.replace(change.0, change.1);
        let alone = Results::of(&text, 1);
        let [x, y] = supports_at_rest(&alone);
        assert!((y / BURDEN - 1.0).abs() < 1e-8, "base {y}, burden {BURDEN}");
        assert!((1e-8 * BURDEN..1e-3 * BURDEN).contains(&x.abs()), "{x} N along x");
        // What is told is what the supports of the stratum feel.
        let told = &alone.record()["held"];
        let size = told["by"]["size"].as_f64().expect("a force");
        assert!((size / x.abs() - 1.0).abs() < 1e-4, "{x} N along x, {told}");
        let [along, down] = ["u_x", "u_y"].map(|u| alone.probes(u).iter().map(|u| u[0]).collect::<Vec<_>>());
        assert!(along[1].abs() < 0.1 * down[1].abs(), "{along:?}, {down:?}");
        for ranks in [2, 3] {
            let apart = apart(&alone, &Results::of(&text, ranks));
            assert!(apart < 1e-9, "{ranks} ranks: {apart}");
        }
    }
}

/// Two elastic blocks of tetrahedra, one on the other and both on a base, with non-matching meshes.
/// Hardly anything resists their sliding, and the bent equilibrium is far away. They are held in
/// their positions, equally on 1, 2 and 3 ranks.
#[test]
fn a_stack_that_bends_is_held_on_1_2_3_ranks() {
    let alone = Results::of(STACK, 1);
    let told = &alone.record()["held"];
    assert_eq!(told["motions"], 6, "{told}");
    assert!((1e-8..1e-2).contains(&told["force"].as_f64().expect("a force")), "{told}");
    // Each level of the loads takes a few corrections, though the hold gives way with what it holds.
    let iterations = alone.table("iterations.csv");
    let begun = iterations.numbers("iteration").into_iter().zip(iterations.texts("stage"));
    let counts: Vec<f64> = begun.filter(|(_, stage)| *stage == "start").map(|row| row.0).collect();
    assert!(counts.last().is_some_and(|count| *count <= 6.0), "{counts:?}");
    let attempts = counts.iter().filter(|count| **count == 0.0).count();
    assert!(attempts <= 5, "the loads were cut to the end before anything was held: {counts:?}");
    let [along, down] = [".u_x", ".u_z"].map(|u| largest(alone.probes(u).iter().map(|u| u[0])));
    assert!(along < 0.1 * down, "moved {along} m aside and {down} m down");
    for ranks in [2, 3] {
        let apart = apart(&alone, &Results::of(STACK, ranks));
        assert!(apart < 1e-9, "{ranks} ranks: {apart}");
    }
}

/// The stack: `base`, `mid` and `top`.
const STACK: &str = "
dimension: 3
bodies:
  base: { mesh: { box: { min: [0, 0, 0], max: [1, 1, 0.3], cells: [3, 3, 1], element: tet4 } }, material: &rubber { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }, density: 1000 }
  mid: { mesh: { box: { min: [0.2, 0.2, 0.3], max: [0.8, 0.8, 0.6], cells: [2, 2, 1], element: tet4 } }, material: *rubber, density: 1000 }
  top: { mesh: { box: { min: [0.3, 0.25, 0.6], max: [0.7, 0.75, 0.8], cells: [2, 2, 1], element: tet4 } }, material: *rubber, density: 1000 }
contact:
  one: { contactor: mid.bottom, target: base.top, normal: { penalty: { compliance: 1.0e-9 } }, friction: &stick { coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e9 } } } }
  two: { contactor: top.bottom, target: mid.top, normal: { penalty: { compliance: 1.0e-9 } }, friction: *stick }
boundary:
  base: { on: base.bottom, displacement: { x: 0, y: 0, z: 0 } }
  mid: { on: mid, gravity: [0, 0, -9.81] }
  top: { on: top, gravity: [0, 0, -9.81] }
start: { equilibrium: { friction: false, increments: 1 } }
time: { end: 1.0e-3, step: 5.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
output: { probes: { edge: { at: [0.7, 0.75, 0.8], on: top } } }
";

/// Soft bodies above soft targets, or on them with a single node, fall until they touch, and are
/// supported: a block a millimetre above, a disc whose lowest node is where the target begins, and
/// a block over a round obstacle.
#[test]
fn soft_bodies_find_what_carries_them_on_1_and_2_ranks() {
    let slab = "slab: { mesh: { box: { min: [0, 0], max: [2, 0.3], cells: [17, 3] } }, material: *rubber, density: 1000 }";
    let base = "base: { on: slab.bottom, displacement: { x: 0, y: 0 } }";
    let block = "{ box: { min: [0.3, 0.301], max: [0.8, 0.6], cells: [5, 3] } }";
    let disc = "{ box: { min: [-1, -1], max: [1, 1], cells: [12, 12], map: { x: \"1.0 + 0.2*x*sqrt(1-y^2/2)\", y: \"0.5 + 0.2*y*sqrt(1-x^2/2)\" } } }";
    let ball = "obstacles: { ball: { sphere: { center: [0.55, -0.7], radius: 1.0 } } }";
    let scenes = [
        (format!("bodies:\n  {slab}"), base, "slab.top", block, "[0.8, 0.6]"),
        (format!("bodies:\n  {}", slab.replace("[17, 3]", "[40, 4]")), base, "slab.top", disc, "[1.0, 0.7]"),
        (format!("{ball}\nbodies:"), "", "ball", block, "[0.8, 0.6]"),
    ];
    for (others, base, target, mesh, at) in scenes {
        let others = others
            .replace("*rubber", "&rubber { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }");
        let rubber = if others.contains('&') {
            "*rubber"
        } else {
            "{ neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }"
        };
        let text = format!(
            "dimension: 2\n{others}\n  a: {{ mesh: {mesh}, material: {rubber}, density: 1000 }}
contact:
  one: {{ contactor: a.bottom, target: {target}, normal: {{ penalty: {{ compliance: 1.0e-9 }} }}, friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_stiffness: 1.0e8 }} }} }} }}
boundary:\n  weight: {{ on: a, gravity: [0, -9.81] }}\n  {base}
start: {{ equilibrium: {{ friction: false, increments: 1 }} }}
time: {{ end: 1.0e-3, step: 5.0e-4, scheme: {{ generalized_alpha: {{ spectral_radius: 0.8 }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-12 }} }}
output: {{ probes: {{ top: {{ at: {at}, on: a }} }} }}
"
        );
        let alone = Results::of(&text, 1);
        let carried = alone.table("contact.csv").numbers("force_n [N]");
        let energy = alone.table("energy.csv");
        let [kinetic, strain] = ["kinetic [J]", "strain [J]"].map(|name| energy.last(name));
        assert!(carried.iter().all(|force| *force > 500.0), "{target}: {carried:?}");
        assert!(kinetic < 1e-4 * strain, "{target}: {kinetic} J of {strain} J");
        // Without friction a disc may roll: nothing but rounding says where it is.
        let rounding = if mesh == disc { 1e-7 } else { 1e-9 };
        let apart = apart(&alone, &Results::of(&text, 2));
        assert!(apart < rounding, "{target}: {apart}");
    }
}

/// A block slides off a slab with its bottom and its left side in contacts. The corner of the slab,
/// pressed a little into the bottom, is centimetres behind the left side, but has not entered
/// there.
#[test]
fn a_corner_comes_in_through_one_side_only_on_1_and_3_ranks() {
    for ranks in [1, 3] {
        let results = Results::of(SLIDING_OFF, ranks);
        let contacts = results.table("contact.csv");
        let pressed = contacts.only("contact", "bottom").numbers("force_n [N]");
        assert!(pressed.iter().any(|force| *force > 100.0), "{pressed:?}");
        assert!(contacts.only("contact", "left").numbers("force_n [N]").iter().all(|force| *force == 0.0));
    }
}

/// The block on the slab.
const SLIDING_OFF: &str = "
dimension: 2
bodies:
  slab: { mesh: { box: { min: [0, 0], max: [1.0, 0.3], cells: [13, 4], element: tri3 } }, material: &m { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }, density: 1000 }
  a: { mesh: { box: { min: [0.85, 0.3], max: [1.15, 0.5], cells: [5, 3], element: quad9 } }, material: *m, density: 1000, initial_velocity: [2.5, 0] }
contact:
  bottom: { contactor: slab.top, target: a.bottom, normal: { penalty: { compliance: 1.0e-9 } }, friction: &f { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e8 } } } }
  left: { contactor: a.left, target: slab.right, normal: { penalty: { compliance: 1.0e-9 } }, friction: *f }
boundary:
  base: { on: slab.bottom, displacement: { x: 0, y: 0 } }
  g: { on: a, gravity: [0, -9.81] }
time: { end: 0.07, step: 1.0e-3, scheme: conserving }
output: { probes: { a: { at: [0.85, 0.3], on: a } } }
";

/// A comb of three teeth of width 1 at a pitch of 3 on a tall base, as an input file of Abaqus with
/// the nodes at `place(x, y)`.
fn comb(place: impl Fn(f64, f64) -> [f64; 2]) -> String {
    let is_solid = |column: u32, row: u32| row < 12 || column % 6 < 2;
    let mut nodes = String::from("*NODE\n");
    for (row, column) in (0..15).flat_map(|row| (0..15).map(move |column| (row, column))) {
        let touches = |column: u32, row: u32| column < 14 && row < 14 && is_solid(column, row);
        let beside = [(0, 0), (1, 0), (0, 1), (1, 1)];
        if beside.iter().any(|(i, j)| column >= *i && row >= *j && touches(column - i, row - j)) {
            let [x, y] = place(0.5 * f64::from(column), 0.5 * f64::from(row));
            nodes += &format!("{}, {x}, {y}\n", 15 * row + column + 1);
        }
    }
    let mut elements = String::from("*ELEMENT, TYPE=CPE4\n");
    for (row, column) in (0..14).flat_map(|row| (0..14).map(move |column| (row, column))) {
        if is_solid(column, row) {
            let first = 15 * row + column + 1;
            elements += &format!("{}, {first}, {}, {}, {}\n", first, first + 1, first + 16, first + 15);
        }
    }
    nodes + &elements
}

/// Two combs whose teeth mesh with a clearance start without an overclosure. Behind each flank, at
/// less than half of the box around the body, is a flank of another tooth. The combs press where
/// flanks meet.
#[test]
fn teeth_mesh_on_1_2_3_4_ranks() {
    let text = "dimension: 2
bodies:
  lower:
    mesh: { file: lower.inp }
    sets: { teeth: \"y > 5.99\", back: \"y < 0.01\" }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
  upper:
    mesh: { file: upper.inp }
    sets: { teeth: \"y < 7.11\", back: \"y > 13.09\" }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
contact: { mesh: { contactor: lower.teeth, target: upper.teeth } }
boundary:
  hold: { on: lower.back, displacement: { x: 0, y: 0 } }
  push: { on: upper.back, displacement: { x: \"-0.66 * t\", y: 0 } }
time: { end: 1, scheme: { static: { increments: 6 } } }
";
    let results = [1, 2, 3, 4].map(|ranks| {
        let folder = Folder::new("teeth");
        folder.write("lower.inp", &comb(|x, y| [x, y]));
        folder.write("upper.inp", &comb(|x, y| [8.5 - x, 13.1 - y]));
        folder.write("case.yml", text);
        run(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).success();
        Results(folder)
    });
    let contact = results[0].table("contact.csv");
    let points = contact.numbers("points");
    assert!(
        points[..5].iter().all(|&points| points == 0.0) && points[5..].iter().all(|&points| points > 0.0),
        "{points:?}"
    );
    let [pressed, held] = ["contact.csv", "reactions.csv"].map(|table| results[0].table(table));
    let force = pressed.last("force_x");
    // Backs that move by 0.16 beyond the clearance shear the bases by 0.08 each if the teeth are rigid:
    // 36 kN. Soft teeth take a part of it.
    assert!((3.6e3..3.6e4).contains(&-force), "{force} N");
    assert!((held.last("force_x").abs() / force.abs() - 1.0).abs() < 1e-6, "{force} N");
    for other in &results[1..] {
        let found = other.table("contact.csv").last("force_x");
        assert!((found / force - 1.0).abs() < 1e-9, "{found} and {force} N");
    }
}
