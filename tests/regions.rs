//! Bodies of several materials in complete runs: layers in series and in parallel, regions with the
//! material of the body, viscoelastic regions with a restart, the modulus beneath a contact, mistakes, and
//! equal results on any number of ranks.

mod common;

use std::collections::BTreeSet;

use common::{Folder, Results, Table, assert_says, near, run};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

/// A bar of length 2 and unit section whose elements in `WHERE` are four times as stiff.
const BAR: &str = "
dimension: 2
bodies:
  bar:
    mesh: { box: { min: [0, 0], max: [2, 1], cells: [4, 4], element: KIND } }
    sets: { hard: { of: elements, where: 'WHERE' } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0 } }
    density: 1000
    regions:
      hard: { material: { saint_venant_kirchhoff: { young_modulus: 4.0e6, poisson_ratio: 0 } }, density: 3000 }
    kinematics: linear
boundary:
  left: { on: bar.left, displacement: { x: 0 } }
  floor: { on: bar.bottom, displacement: { y: 0 } }
  pull: { on: bar.right, LOAD }
time: { end: 1, scheme: { static: { increments: 1 } } }
output: { bodies: true, probes: { middle: { at: [1, 0] }, end: { at: [2, 0] } } }
";

fn bar(kind: &str, condition: &str, load: &str) -> String {
    let text = BAR.replace("KIND", kind).replace("WHERE", condition).replace("LOAD", load);
    match kind {
        "hex8" | "tet10" => text
            .replace("dimension: 2", "dimension: 3")
            .replace("[0, 0], max: [2, 1], cells: [4, 4]", "[0, 0, 0], max: [2, 1, 1], cells: [4, 4, 2]")
            .replace("at: [1, 0]", "at: [1, 0, 0]")
            .replace("at: [2, 0]", "at: [2, 0, 0]")
            .replace("displacement: { y: 0 }", "displacement: { y: 0, z: 0 }"),
        _ => text,
    }
}

/// In series the elongations `p L / E` add up; in parallel the forces `E e A` do. The mass is that of both.
#[test]
fn layers_in_series_and_in_parallel() {
    for (kind, ranks) in [("quad4", 1), ("tri6", 2), ("quad9", 3), ("hex8", 4), ("tet10", 2)] {
        let series = Results::of(&bar(kind, "x >= 1", "traction: { x: 1000 }"), ranks);
        let probes = series.table("probes.csv");
        near(&[probes.last("middle.u_x"), probes.last("end.u_x")], &[1e-3, 1.25e-3], 1e-9);
        near(&[series.table("bodies.csv").last("mass")], &[4000.0], 1e-12);
        near(&[series.table("energy.csv").last("strain")], &[0.5 * 1000.0 * 1.25e-3], 1e-9);
        let condition = if probes.names().any(|name| name.contains("u_z")) { "z >= 0.5" } else { "y >= 0.5" };
        let parallel = Results::of(&bar(kind, condition, "displacement: { x: 1.0e-3 }"), ranks);
        let pull = parallel.table("reactions.csv").only("boundary", "pull").last("force_x");
        near(&[pull], &[0.5 * (1.0e6 + 4.0e6) * 0.5e-3], 1e-9);
    }
}

/// The stress at the nodes of an interface is that of each layer, because these nodes have a point for each
/// material. Without stresses they have one.
#[test]
fn nodal_stresses_jump_at_the_interface() {
    let text = bar("quad4", "y >= 0.5", "displacement: { x: 1.0e-3 }");
    let with = |fields: &str| text.replace("bodies: true,", &format!("fields: {{ every: 1{fields} }},"));
    for (ranks, fields, points) in [(1, ", stresses: true", 30), (3, ", stresses: true", 30), (1, "", 25)] {
        let results = Results::of(&with(fields), ranks);
        let mut found = BTreeSet::new();
        for rank in 0..ranks {
            let path = results.0.join(format!("out/fields/step_000001/volume_{rank:04}.vtu"));
            let piece = read_piece(&path).expect("a piece");
            let codes = |values: &VtuValues| match values {
                VtuValues::Int32(codes) => codes.clone(),
                other => panic!("{other:?}"),
            };
            let materials = codes(&piece.cell_data["material"].values);
            let nodes = codes(&piece.point_data["node"].values);
            for (cell, &material) in materials.iter().enumerate() {
                for &point in piece.cell(cell) {
                    let layer = if fields.is_empty() { 0 } else { material };
                    found.insert((nodes[point as usize], layer));
                    let Some(stress) = piece.point_data.get("nodal_stress") else { continue };
                    let VtuValues::Float64(stress) = &stress.values else { panic!("{stress:?}") };
                    let expected = if material == 1 { 4.0e6 } else { 1.0e6 } * 0.5e-3;
                    near(&[stress[6 * point as usize]], &[expected], 1e-8);
                }
            }
        }
        assert_eq!(found.len(), points);
    }
}

/// A block that falls on a plane, in two parts. `REGIONS` has their materials.
const BLOCK: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0.01], max: [0.2, 0.21], cells: [4, 6], element: quad4 } }
    sets: { lower: { of: elements, where: 'y <= 0.12' } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    initial_velocity: [0.5, -1]
REGIONS
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e8 } } }
TIME
output: { probes: { top: { at: [0.2, 0.21] } }, checkpoint: { every: 10 } }
";

fn block(regions: &str, time: &str) -> String {
    BLOCK.replace("REGIONS", regions).replace("TIME", time)
}

/// A region with the material of its body changes nothing, in every scheme.
#[test]
fn a_region_of_the_same_material_changes_nothing() {
    let same =
        "    regions: { lower: { material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } } } }";
    for scheme in ["conserving", "{ generalized_alpha: { spectral_radius: 0.8 } }"] {
        let time = format!(
            "time: {{ end: 0.04, step: 0.001, scheme: {scheme} }}\nsolver: {{ newton: {{ tolerance: 1.0e-11 }} }}"
        );
        let one = Results::of(&block("", &time), 1);
        let two = Results::of(&block(same, &time), 3);
        for (table, columns) in [
            ("probes.csv", ["top.u_x", "top.u_y"].as_slice()),
            ("energy.csv", ["kinetic", "strain", "contact", "friction_dissipated"].as_slice()),
        ] {
            let last = |results: &Results| {
                columns.iter().map(|name| results.table(table).last(name)).collect::<Vec<_>>()
            };
            near(&last(&two), &last(&one), 1e-7);
        }
        assert!(one.table("energy.csv").last("friction_dissipated") > 0.0);
    }
}

/// The conserving scheme keeps the energy of a body with two materials.
#[test]
fn energy_is_kept_with_two_materials() {
    let hard = "    regions: { lower: { material: { mooney_rivlin: { c10: 1.0e6, c01: 2.0e5, bulk_modulus: 1.0e7 } }, density: 2000 } }";
    let time =
        "time: { end: 0.04, step: 0.001, scheme: conserving }\nsolver: { newton: { tolerance: 1.0e-12 } }";
    let energy =
        Results::of(&block(hard, time).replace("coefficient: 0.3", "coefficient: 0"), 2).table("energy.csv");
    let total = energy.numbers("total");
    let most = total.iter().fold(0.0, |most: f64, value| most.max((value - total[0]).abs()));
    assert!(energy.numbers("strain").iter().any(|strain| *strain > 0.1 * total[0]));
    assert!(most < 1e-8 * total[0], "{most} of {}", total[0]);
}

/// A viscoelastic region loses energy, and a continued run has the same bits.
#[test]
fn a_viscoelastic_region_continues_from_a_checkpoint() {
    let viscous = "    regions: { lower: { material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }, viscoelasticity: { prony: [{ share: 0.5, time: 0.005 }] } } }";
    let time = "time: { end: 0.03, step: 0.001, scheme: midpoint }\nsolver: { linear: gmres_asm_ilu }";
    let folder = Folder::new("regions");
    folder.write("case.yml", &block(viscous, time));
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000020.ckpt";
    run(2, &["case.yml", "-q", "-o", "branch", start], &folder).success();
    run(3, &["case.yml", "-q", "-o", "other", start], &folder).success();
    let rows = |of: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.join(of).join("energy.csv")).expect("a table");
        text.lines().map(str::to_owned).collect()
    };
    let [whole, branch, other] = ["whole", "branch", "other"].map(rows);
    assert_eq!(branch[branch.len() - 9..], whole[whole.len() - 9..]);
    let numbers =
        |row: &String| -> Vec<f64> { row.split(',').filter_map(|cell| cell.parse().ok()).collect() };
    let [a, b] = [&whole, &other].map(|rows| numbers(rows.last().expect("a row")));
    near(&b, &a, 1e-6);
    let column =
        whole[0].split(',').position(|name| name.starts_with("viscous")).expect("the heat of branches");
    assert!(numbers(whole.last().expect("a row"))[column] > 0.0);
}

/// The default penalty follows the material beneath the surface, not that of the core.
#[test]
fn the_penalty_follows_the_skin() {
    let stiffness = |regions: &str| -> String {
        let folder = Folder::new("regions-check");
        folder.write("case.yml", &block(regions, "time: { end: 0.01, step: 0.001, scheme: midpoint }"));
        let text = run(0, &["check", "case.yml"], &folder).success().text();
        let line =
            text.lines().find(|line| line.contains("normal stiffness:")).expect("the stiffness").to_owned();
        line.split_whitespace().nth(3).expect("a number").to_owned()
    };
    let with = |set: &str| {
        format!(
            "    regions: {{ {set}: {{ material: {{ neo_hookean: {{ young_modulus: 1.0e8, poisson_ratio: 0.3 }} }} }} }}"
        )
    };
    let plain = stiffness("").parse::<f64>().expect("a number");
    let hard_skin = stiffness(&with("lower")).parse::<f64>().expect("a number");
    near(&[hard_skin], &[100.0 * plain], 1e-3);
    let upper = with("upper");
    let hard_core = block(&upper, "time: { end: 0.01, step: 0.001, scheme: midpoint }")
        .replace("sets: {", "sets: { upper: { of: elements, where: 'y >= 0.1' },");
    let folder = Folder::new("regions-core");
    folder.write("case.yml", &hard_core);
    let text = run(0, &["check", "case.yml"], &folder).success().text();
    let line = text.lines().find(|line| line.contains("normal stiffness:")).expect("the stiffness");
    near(&[line.split_whitespace().nth(3).expect("a number").parse().expect("a number")], &[plain], 1e-3);
    assert_says(&text, &["region block.upper", "1.0000e8"]);
}

/// Remarks on locking look at each region with its own remedy: selective integration of quad9 is good
/// enough for a nearly incompressible region, that of quad8 is not, and the elements of the soft part
/// do not matter.
#[test]
fn locking_is_judged_by_region() {
    let remarks = |kind: &str| {
        let folder = Folder::new("regions-locking");
        let nearly = "young_modulus: 4.0e6, poisson_ratio: 0.4995";
        let text = bar(kind, "x >= 1", "traction: { x: 1000 }");
        folder.write("case.yml", &text.replace("young_modulus: 4.0e6, poisson_ratio: 0", nearly));
        run(0, &["check", "case.yml"], &folder).success().text()
    };
    assert_says(&remarks("quad8"), &["pressures of quad8 elements of 'bar'"]);
    let good = remarks("quad9");
    assert!(!good.contains("pressures of"), "{good}");
    assert_says(&good, &["none of quad9, selective_reduced of quad9"]);
}

/// Mistakes are found with their place and a cure.
#[test]
fn mistakes_with_regions_are_explained() {
    let material = "{ material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } } }";
    let time = "time: { end: 0.01, step: 0.001, scheme: conserving }";
    for (regions, says) in [
        (format!("    regions: {{ lowr: {material} }}"), ["no set of elements 'lowr'", "lower"]),
        (format!("    regions: {{ left: {material} }}"), ["'block.left' is a set of facets", "of: elements"]),
        (
            format!("    regions: {{ lower: {material}, all_below: {material} }}"),
            ["12 elements in common", "difference"],
        ),
        ("    regions: { lower: {} }".to_owned(), ["material", "case.yml:"]),
        (
            "    regions: { lower: { material: { neo_hookean: { young_modulus: -1, poisson_ratio: 0.3 } } } }".to_owned(),
            ["young_modulus", "case.yml:"],
        ),
        (
            "    regions: { lower: { material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }, viscoelasticity: { prony: [{ share: 0.5, time: 0.005 }] } } }".to_owned(),
            ["viscoelasticity", "conserving"],
        ),
    ] {
        let folder = Folder::new("regions-mistakes");
        let text = block(&regions, time).replace("sets: {", "sets: { all_below: { of: elements, where: 'y <= 0.2' },");
        folder.write("case.yml", &text);
        let output = run(2, &["case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{regions}: {}", output.text());
        assert_says(&output.text(), &says);
    }
}

/// A free bar of which two thirds of the mass are damped in proportion to it loses its momentum at two
/// thirds of the rate. A region without damping of its own has that of the body.
#[test]
fn the_damped_part_slows_the_body_by_its_share_of_the_mass() {
    let law = "material: { neo_hookean: { young_modulus: 1e9, poisson_ratio: 0.3 } }";
    let damping = |rate: f64| format!("damping: {{ rayleigh: {{ mass: {rate} }} }}");
    for (of_body, of_region, rate) in [
        (String::new(), format!(", {}", damping(3.0)), 3.0 * 2.0 / 3.0),
        (damping(1.5), String::new(), 1.5),
        (damping(3.0), format!(", {}", damping(1.5)), 2.0),
    ] {
        let text = format!(
            "dimension: 2\nbodies:\n  bar:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [2, 1] }} }}\n    \
             sets: {{ heavy: {{ of: elements, where: 'x < 0.5 + 1e-9' }} }}\n    {law}\n    density: 1000\n    {of_body}\n    \
             regions: {{ heavy: {{ {law}, density: 2000{of_region} }} }}\n    \
             initial_velocity: [2, 0]\nstart: {{ rest: {{}} }}\n\
             time: {{ end: 0.5, step: 0.005, scheme: {{ generalized_alpha: {{ spectral_radius: 0.5 }} }} }}\n\
             output: {{ bodies: true }}\n"
        );
        let bodies = Results::of(&text, 2).table("bodies.csv");
        near(&[bodies.last("mass")], &[750.0], 1e-12);
        near(&[bodies.last("linear_x")], &[1500.0 * (-rate * 0.5_f64).exp()], 1e-4);
    }
}

/// A body of two materials that differ in everything, sliding on its floor.
const SLIDING: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.4], cells: [4, 4] } }
    sets: { part: { of: elements, where: 'x + y < 0.5' } }
    material: { mooney_rivlin: { c10: 4e5, c01: 1e5, bulk_modulus: 1e8 } }
    density: 1100
    viscoelasticity: { prony: [{ share: 0.3, time: 1e-3 }, { share: 0.2, time: 1e-2 }] }
    locking: LOCKING
    regions:
      part:
        material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
        density: 1700
        viscoelasticity: { prony: [{ share: 0.3, time: 1e-3 }] }
        damping: { rayleigh: { mass: 20, stiffness: 1e-4 } }
obstacles:
  floor: { plane: { point: [0, 0], normal: [0, 1] } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } }
boundary:
  clamp: { on: block.top, displacement: { x: '1.0 * t', y: -0.01 } }
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 0.003, step: 5.0e-4 }
solver: { strategy: STRATEGY, newton: { tolerance: 1.0e-12 } }
output: { bodies: true, checkpoint: { every: 2 } }
";

/// Materials with different Prony series, densities, damping and treatments of locking give equal results
/// on 1 to 4 ranks in both strategies, and after a restart on other numbers of ranks.
#[test]
fn different_materials_are_independent_of_ranks_and_restarts() {
    let columns = [
        ("energy.csv", "strain"),
        ("energy.csv", "viscous_stored"),
        ("energy.csv", "damping_dissipated"),
        ("reactions.csv", "force_y"),
        ("bodies.csv", "kinetic"),
    ];
    for (strategy, locking) in [
        ("monolithic", "auto"),
        ("{ staggered: { tolerance: 1.0e-10, max_sweeps: 100 } }", "mean_dilatation"),
    ] {
        let text = SLIDING.replace("STRATEGY", strategy).replace("LOCKING", locking);
        let one = Results::of(&text, 1);
        for ranks in 2..=4 {
            let several = Results::of(&text, ranks);
            for (table, column) in columns {
                let known = one.table(table).numbers(column);
                assert!(known.iter().any(|value| value.abs() > 0.0), "{column}");
                near(&several.table(table).numbers(column), &known, 1e-7);
            }
        }
    }
    let folder = Folder::new("regions");
    folder.write("case.yml", &SLIDING.replace("STRATEGY", "monolithic").replace("LOCKING", "auto"));
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let checkpoint = "whole/checkpoints/step-000004.ckpt";
    let bytes = std::fs::read(folder.join(checkpoint)).expect("a checkpoint");
    let holds = |name: &str| bytes.windows(name.len()).any(|part| part == name.as_bytes());
    assert!(holds("branches of block.part") && holds("branch 2_zz"));
    let start = format!("--restart={checkpoint}");
    for ranks in 1..=4 {
        let out = format!("after-{ranks}");
        run(ranks, &["case.yml", "-q", "-o", &out, &start], &folder).success();
        for (table, column) in columns {
            let [whole, after] =
                ["whole", &out].map(|of| Table::read(&folder.join(of).join(table)).numbers(column));
            let last = |values: &[f64]| values[values.len() - 2..].to_vec();
            assert!(after.len() < whole.len());
            near(&last(&after), &last(&whole), 1e-7);
        }
    }
}

/// `check` compares a normal law to the material beneath the surface, not to a softer core.
#[test]
fn check_compares_with_the_material_beneath_the_surface() {
    let hard =
        "    regions: { lower: { material: { neo_hookean: { young_modulus: 1.0e8, poisson_ratio: 0.3 } } } }";
    let folder = Folder::new("regions-check");
    folder.write("case.yml", &block(hard, "time: { end: 0.01, step: 0.001, scheme: midpoint }"));
    let text = run(2, &["check", "case.yml"], &folder).success().text();
    assert_says(&text, &["at a pressure of 1.000e7 Pa", "times E/h = 3.0000e9 Pa/m"]);
}

/// A free body moves by its inertia if a region has mass. One whose regions have none is refused.
#[test]
fn a_body_is_massless_only_with_all_its_regions() {
    let folder = Folder::new("regions-mass");
    for (density, code) in [("density: 2000", 0), ("density: 0", 3)] {
        let law = "material: { neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 } }";
        let text = format!(
            "dimension: 2\nbodies:\n  bar:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [2, 1] }} }}\n    \
             sets: {{ heavy: {{ of: elements, where: 'x < 0.5 + 1e-9' }} }}\n    {law}\n    density: 0\n    \
             regions: {{ heavy: {{ {law}, {density} }} }}\ntime: {{ end: 0.5, step: 0.005 }}\n"
        );
        folder.write("case.yml", &text);
        let output = run(1, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(code), "{}", output.text());
        assert_eq!(
            output.text().contains("no support or contact holds the body 'bar', and it has no mass"),
            code == 3
        );
    }
}
