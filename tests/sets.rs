//! Sets by the reference position and lists of sets, in complete runs on several ranks.

mod common;

use common::{Folder, Results, SMALL_BLOCK, assert_says, run};

/// The small block with these sets, one per line, and other names for its surfaces.
fn with_sets(sets: &[&str], contactor: &str, on: &str) -> String {
    let lines: String = sets.iter().map(|set| format!("      {set}\n")).collect();
    let text = SMALL_BLOCK.replace("    density: 1700\n", &format!("    density: 1700\n    sets:\n{lines}"));
    text.replace("contactor: block.bottom", &format!("contactor: {contactor}"))
        .replace("on: block.top", &format!("on: {on}"))
}

/// The small block in 3D.
fn solid(text: &str) -> String {
    text.replace("dimension: 2", "dimension: 3")
        .replace(
            "min: [0, 0], max: [0.4, 0.4], cells: [4, 4]",
            "min: [0, 0, 0], max: [0.4, 0.4, 0.4], cells: [3, 3, 3]",
        )
        .replace("point: [0, 0], normal: [0, 1]", "point: [0, 0, 0], normal: [0, 0, 1]")
        .replace("x: \"1.0 * t\", y: -0.01", "x: \"1.0 * t\", y: 0, z: -0.01")
        .replace("at: [0, 0]", "at: [0, 0, 0]")
}

/// Checks that two cases give the same histories, bit for bit. MUMPS would round differently in each run
/// (docs/validation/reproducibility.md).
#[track_caller]
fn equal(one: &str, other: &str, ranks: usize) {
    let repeatable = |text: &str| format!("{text}solver: {{ linear: gmres_asm_ilu }}\n");
    let [one, other] = [one, other].map(|text| Results::of(&repeatable(text), ranks));
    for table in ["probes.csv", "contact.csv", "reactions.csv", "energy.csv"] {
        let [one, other] = [&one, &other]
            .map(|results| std::fs::read_to_string(results.0.join("out").join(table)).expect("a table"));
        assert!(one.lines().count() > 4, "{table}");
        assert_eq!(one, other, "{table} on {ranks} ranks");
    }
}

/// The sum of a column over the rows of the last step.
fn last_sum(results: &Results, table: &str, column: &str) -> f64 {
    let table = results.table(table);
    let steps = table.numbers("step");
    let last = steps.last().expect("a row");
    table.numbers(column).iter().zip(&steps).filter(|(_, step)| *step == last).map(|(value, _)| value).sum()
}

/// Sides selected by expressions give the results of the named sides, in 2D and 3D on 1 to 4 ranks.
#[test]
fn expressions_give_the_results_of_named_sides_on_1_to_4_ranks() {
    let plane = with_sets(&["sole: \"y < 1e-6\"", "lid: \"y > 0.4 - 1e-6\""], "block.sole", "block.lid");
    let space = solid(&with_sets(
        &["sole: \"z < 1e-6\"", "lid: { box: { min: [0, 0, 0.4], max: [1, 1, 1] } }"],
        "block.sole",
        "block.lid",
    ));
    for ranks in 1..=4 {
        equal(SMALL_BLOCK, &plane, ranks);
        equal(&solid(SMALL_BLOCK), &space, ranks);
    }
}

/// A side in two overlapping parts, listed together, is the side: as a contact, a support and a load.
#[test]
fn lists_of_parts_give_the_results_of_the_whole_on_1_to_4_ranks() {
    let parts = [
        "west: \"y < 1e-6 and x < 0.25\"",
        "east: \"y < 1e-6 and x > 0.05\"",
        "lid: \"y > 0.4 - 1e-6 and x > 0.25\"",
    ];
    let load = "boundary:\n  push: { on: block.right, traction: { x: \"-1e4 * y\" } }\n  press: { on: block.left, pressure: \"1e4 * tanh(y)\" }";
    let whole = SMALL_BLOCK.replace("boundary:", load);
    let parts = with_sets(&parts, "[block.east, block.west]", "[block.lid, block.top]").replace(
        "boundary:",
        &load
            .replace("on: block.right", "on: [block.up, block.right]")
            .replace("on: block.left", "on: [block.left, block.low]"),
    );
    let parts = parts.replace(
        "      west:",
        "      up: \"x > 0.4 - 1e-6 and y > 0.15\"\n      low: \"x < 1e-6 and y < 0.25\"\n      west:",
    );
    for ranks in 1..=4 {
        equal(&whole, &parts, ranks);
    }
}

/// Two blocks on a floor.
const BLOCKS: &str = r#"dimension: 2
bodies:
  one:
    mesh: { box: { min: [0, 0], max: [0.4, 0.3], cells: [4, 3] } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
  two:
    mesh: { box: { min: [0.6, 0], max: [1, 0.3], cells: [4, 3] } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
obstacles:
  floor: { plane: { point: [0, 0], normal: [0, 1] } }
contact:
CONTACT
boundary:
BOUNDARY
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 0.002, step: 5.0e-4 }
output: { probes: { corner: { at: [0.6, 0] } } }
"#;

const LAWS: &str = "target: floor, normal: { penalty: { compliance: 1.0e-9 } }, \
    friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } } }";

/// A boundary of each kind on these places.
fn boundaries(name: &str, top: &str, body: &str, left: &str) -> String {
    format!(
        "  clamp{name}: {{ on: {top}, displacement: {{ x: \"1.0 * t\", y: -0.01 }} }}\n  \
         weight{name}: {{ on: {body}, gravity: [0, -9.81] }}\n  \
         push{name}: {{ on: {left}, traction: {{ x: \"1e5 * y\" }} }}\n  \
         press{name}: {{ on: {left}, pressure: \"1e5 * y\" }}\n"
    )
}

/// One contact, support or load over the surfaces of two bodies equals one for each, since they have no common edges.
#[test]
fn lists_over_two_bodies_equal_one_entry_for_each_on_1_to_3_ranks() {
    let two = format!("  a: {{ contactor: one.bottom, {LAWS}\n  b: {{ contactor: two.bottom, {LAWS}");
    let each =
        ["one", "two"].map(|body| boundaries(body, &format!("{body}.top"), body, &format!("{body}.left")));
    let list = format!("  both: {{ contactor: [one.bottom, two.bottom], {LAWS}");
    let all = boundaries("", "[one.top, two.top]", "[one, two]", "[one.left, two.left]");
    for ranks in 1..=3 {
        let [two, list] = [(&two, each.concat()), (&list, all.clone())].map(|(contact, boundary)| {
            Results::of(&BLOCKS.replace("CONTACT", contact).replace("BOUNDARY\n", &boundary), ranks)
        });
        for (table, column) in [
            ("contact.csv", "force_n"),
            ("contact.csv", "force_x"),
            ("contact.csv", "area"),
            ("reactions.csv", "force_x"),
            ("reactions.csv", "force_y"),
            ("energy.csv", "strain"),
        ] {
            let [two, list] = [&two, &list].map(|results| last_sum(results, table, column));
            assert!((two - list).abs() < 1e-9 * two.abs(), "{column}: {two} {list}");
            assert!(list.abs() > 0.0, "{column}");
        }
    }
}

/// A block that rests on the floor, with its sides and its top in the contact as well, carries its weight. Its corners
/// belong to two sides.
#[test]
fn contact_over_sides_with_common_edges_carries_the_weight_on_2_ranks() {
    for dimension in [2, 3] {
        let sides = "[block.left, block.bottom, block.right, block.top]";
        let text = with_sets(&["edge: { of: nodes, where: \"x < 1e-6\" }"], sides, "block.edge");
        let text = text
            .replace("displacement: { x: \"1.0 * t\", y: -0.01 }", "displacement: { x: 0 }")
            .replace("boundary:", "boundary:\n  weight: { on: block, gravity: [0, -9.81] }")
            .replace("start: { equilibrium: { friction: false, increments: 2 } }\n", "")
            .replace("step: 5.0e-4 }", "scheme: { static: { increments: 1 } } }")
            .replace(
                "regularization: { stick_velocity: 1.0e-3 }",
                "regularization: { stick_stiffness: 1.0e9 }",
            );
        let text = match dimension {
            3 => solid(&text).replace("gravity: [0, -9.81]", "gravity: [0, 0, -9.81]"),
            _ => text,
        };
        let weight = 1700.0 * 9.81 * 0.4_f64.powi(dimension);
        let force = last_sum(&Results::of(&text, 2), "contact.csv", "force_n");
        assert!((force - weight).abs() < 1e-3 * weight, "{force} for {weight}");
    }
}

/// A run with sets of the case and a list, resumed from a checkpoint, has the histories of the uninterrupted run.
#[test]
fn restart_finds_the_same_sets_on_2_ranks() {
    let text = with_sets(
        &["west: \"y < 1e-6 and x < 0.25\"", "east: \"y < 1e-6 and x > 0.05\""],
        "[block.west, block.east]",
        "block.top",
    );
    let text = text.replace("output: {", "output: { checkpoint: { every: 2, keep: 9 },");
    let folder = Folder::new("sets");
    folder.write("case.yml", &text);
    run(2, &["case.yml", "--output", "whole", "--quiet"], &folder).success();
    let checkpoint = "--restart=whole/checkpoints/step-000002.ckpt";
    run(2, &["case.yml", checkpoint, "--output", "branch", "--quiet"], &folder).success();
    for table in ["probes.csv", "contact.csv"] {
        let [whole, branch] = ["whole", "branch"].map(|results| {
            let text = std::fs::read_to_string(folder.join(results).join(table)).expect("a table");
            text.lines().last().expect("a row").to_owned()
        });
        assert_eq!(whole, branch, "{table}");
    }
}

/// A set that combines a faulty one has no error of its own.
#[test]
fn only_the_cause_is_reported() {
    let folder = Folder::new("sets");
    let text = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    sets:
      part: { difference: [top, lefft] }
      whole: { union: [part, bottom] }
boundary: { clamp: { on: block.whole, displacement: { x: 0, y: 0 } } }
time: { end: 1, scheme: { static: { increments: 1 } } }
";
    folder.write("case.yml", text);
    let output = run(0, &["check", "case.yml"], &folder);
    assert_eq!(output.code, Some(3), "{}", output.text());
    assert_says(&output.stderr, &["case.yml:8:33", "no set 'lefft' above this one", "did you mean 'left'?"]);
    assert!(!output.stderr.contains("case.yml:9:") && !output.stderr.contains("'part'"), "{}", output.stderr);
}
