//! Nearly incompressible bodies with `locking: mean_dilatation` in whole runs: Cook's membrane and a block under a
//! partial load, against references by refinement and from the literature.

mod common;

use common::{Folder, Results, assert_says, rubber_pad, run, shipped};

/// Displacement of the corner of Cook's membrane [mm], from quad9 with 64 x 64 cells (`meshes/cook/README.md`).
const CORNER: f64 = 6.93;

fn cook(element: &str, locking: &str, cells: u32) -> String {
    let changes = [("quad9", element), ("locking: mean_dilatation", locking)];
    shipped("cook/case.yml", &changes).replace("[8, 8]", &format!("[{cells}, {cells}]"))
}

fn corner(text: &str, ranks: usize) -> f64 {
    Results::of(text, ranks).table("probes.csv").last("corner.u_y")
}

/// The corner of Cook's membrane moves as in the limit of fine meshes with every element that has a mean dilatation. Fully
/// integrated quad4 lock.
#[test]
fn cooks_membrane_does_not_lock() {
    for (element, cells, tolerance) in
        [("quad9", 8, 0.01), ("quad8", 8, 0.02), ("tri6", 8, 0.01), ("quad4", 16, 0.03), ("tri3", 16, 0.035)]
    {
        let found = corner(&cook(element, "locking: mean_dilatation", cells), 1);
        assert!((found / CORNER - 1.0).abs() < tolerance, "{element}: {found}");
    }
    for (element, cells) in [("quad4", 16), ("tri3", 4)] {
        let locked = corner(&cook(element, "locking: none", cells), 1);
        assert!(locked < 0.7 * CORNER, "{element}: {locked}");
    }
}

/// The membrane does not depend on the number of ranks. Patches of elements are cut by the parts.
#[test]
fn cooks_membrane_on_1_and_3_ranks() {
    for (element, locking) in [("quad9", "mean_dilatation"), ("tri3", "auto"), ("quad4", "patch_dilatation")]
    {
        let text = cook(element, &format!("locking: {locking}"), 4);
        let [one, three] = [1, 3].map(|ranks| corner(&text, ranks));
        assert!((one / three - 1.0).abs() < 1e-9, "{element}: {one} {three}");
    }
}

/// The middle of the block under a partial load, on meshes of few elements.
#[test]
fn a_block_under_a_partial_load_does_not_lock() {
    let middle = |element: &str, locking: &str, cells: &str| {
        let changes = [
            ("hex8", element),
            ("locking: mean_dilatation", locking),
            ("[4, 4, 4]", cells),
            ("-320 * t", "-80 * t"),
            ("increments: 16", "increments: 4"),
        ];
        -Results::of(&shipped("cook/block.yml", &changes), 1).table("probes.csv").last("middle.u_z")
    };
    // hex27 with 4 x 4 x 4 cells, see docs/validation/incompressible.md.
    let reference = 0.218_826 * 50.0;
    for (element, cells, tolerance) in [
        ("hex8", "[4, 4, 4]", 0.01),
        ("hex27", "[2, 2, 2]", 0.035),
        ("hex20", "[2, 2, 2]", 0.07),
        ("tet10", "[2, 2, 2]", 0.02),
    ] {
        let found = middle(element, "locking: mean_dilatation", cells);
        assert!((found / reference - 1.0).abs() < tolerance, "{element}: {found}, expected {reference}");
    }
    let locked = middle("hex8", "locking: none", "[4, 4, 4]");
    assert!(locked < 0.1 * reference, "{locked}");
}

/// A cube of tet4, harder in its upper half, is dragged over a slab of hex8, both with patches. Results do not
/// depend on the number of ranks, and the conserving scheme keeps the energy.
#[test]
fn patches_in_contact_on_1_2_and_5_ranks() {
    let text = "dimension: 3
bodies:
  cube:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.1, 0.05], cells: [3, 3, 2], element: tet4 } }
    material: { neo_hookean: { young_modulus: 5.0e+6, poisson_ratio: 0.499 } }
    density: 1100
    sets: { hard: { of: elements, where: 'z > 0.0249' } }
    regions: { hard: { material: { neo_hookean: { young_modulus: 5.0e+7, poisson_ratio: 0.3 } } } }
  slab:
    mesh: { box: { min: [-0.05, -0.05, -0.03], max: [0.15, 0.15, 0], cells: [4, 4, 2], element: hex8 } }
    material: { mooney_rivlin: { c10: 4.0e+5, c01: 1.0e+5, poisson_ratio: 0.495 } }
    density: 1100
    locking: patch_dilatation
contact:
  sole:
    contactor: cube.bottom
    target: slab.top
    friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } }
boundary:
  top: { on: cube.top, displacement: { x: '0.5 * t', y: 0, z: '-0.2 * t' } }
  floor: { on: slab.bottom, displacement: { x: 0, y: 0, z: 0 } }
time: { end: 0.002, step: 0.0005, scheme: { conserving: {} } }
output: { probes: { corner: { at: [0.1, 0.1, 0], on: cube } } }
";
    let results = [1, 2, 5].map(|ranks| Results::of(text, ranks));
    let moved = results.each_ref().map(|results| results.table("probes.csv").last("corner.u_x"));
    assert!(moved.iter().all(|u| (u / moved[0] - 1.0).abs() < 1e-8), "{moved:?}");
    for results in &results {
        let energy = results.table("energy.csv");
        let [numerical, work] = ["numerical", "external_work"].map(|column| energy.last(column));
        assert!(work > 0.0 && numerical.abs() < 1e-9 * work, "{numerical:e} of {work:e} J");
    }
}

/// Newton's method in large increments at a Poisson's ratio of 0.4999: with every treatment of locking, under loads,
/// with moving supports, and with friction on a rigid disc that presses and drags. The tangent without the
/// linearised pressure takes 83 to 146 iterations for the cube and 1461 for the pad.
#[test]
fn newtons_iterations_stay_few() {
    let cube = |element: &str, locking: &str, top: &str| {
        format!(
            "dimension: 3
bodies:
  cube:
    mesh: {{ box: {{ min: [0, 0, 0], max: [1, 1, 1], cells: [3, 3, 3], element: {element} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e+6, poisson_ratio: 0.4999 }} }}
    locking: {locking}
boundary:
  clamp: {{ on: cube.bottom, displacement: {{ x: 0, y: 0, z: 0 }} }}
  top: {{ on: cube.top, {top} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}
"
        )
    };
    let pressed = "traction: { x: '5e4 * t', z: '-5e4 * t' }";
    let moved = "displacement: { x: '0.1 * t', y: 0, z: '-0.1 * t' }";
    for (element, locking) in [
        ("tet4", "auto"),
        ("hex8", "auto"),
        ("hex8", "mean_dilatation"),
        ("hex8", "patch_dilatation"),
        ("tet10", "none"),
        ("hex27", "mean_dilatation"),
    ] {
        for top in [pressed, moved] {
            let found = newton_iterations(&cube(element, locking, top), 1);
            assert!(found <= 14, "{element} {locking} {top}: {found}");
        }
    }
    let counts = [1, 2, 3, 4].map(|ranks| newton_iterations(&cube("tet4", "auto", pressed), ranks));
    assert_eq!(counts, [counts[0]; 4]);
    let found = newton_iterations(&rubber_pad("[24, 10]", 0.4999, 10), 1);
    assert!(found <= 110, "{found}");
}

/// Newton's iterations of a run, with those of steps that were cut.
fn newton_iterations(text: &str, ranks: usize) -> u64 {
    let record = Results::of(text, ranks).record();
    record["newton_iterations"].as_u64().expect("a count")
}

/// `selective_reduced` on simplices is refused, with the line of the element and what to write.
#[test]
fn reduced_integration_of_simplices_is_refused() {
    let folder = Folder::new("refused");
    folder.write("case.yml", &cook("tri3", "locking: selective_reduced", 4));
    let output = run(0, &["check", "case.yml"], &folder);
    assert_eq!(output.code, Some(3), "{}", output.text());
    assert_says(&output.stderr, &["tri3 does not support selective_reduced", "mean_dilatation", ":12:"]);
}
