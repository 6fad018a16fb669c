//! Nearly incompressible bodies with `locking: mean_dilatation` in whole runs: Cook's membrane and a block under a
//! partial load, against references by refinement and from the literature.

mod common;

use common::{Folder, Results, assert_says, run, shipped};

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

/// `selective_reduced` on simplices is refused, with the line of the element and what to write.
#[test]
fn reduced_integration_of_simplices_is_refused() {
    let folder = Folder::new("refused");
    folder.write("case.yml", &cook("tri3", "locking: selective_reduced", 4));
    let output = run(0, &["check", "case.yml"], &folder);
    assert_eq!(output.code, Some(3), "{}", output.text());
    assert_says(&output.stderr, &["tri3 does not support selective_reduced", "mean_dilatation", ":12:"]);
}
