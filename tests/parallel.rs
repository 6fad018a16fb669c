//! Results do not depend on the number of ranks, for every scene.
//!
//! The scenes are those of `meshes`, on coarser meshes and with fewer steps.

mod common;

use std::collections::BTreeSet;

use common::{Folder, Results, Table, run, shipped};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

/// Displacements agree to this fraction of the largest one.
const AGREEMENT: f64 = 1e-9;

/// Numbers of ranks compared with one rank.
const RANKS: [usize; 4] = [2, 3, 4, 8];

const DIRECT: &str = "{ linear: direct, newton: { inexact: false } }";
const GMRES: &str = "{ linear: gmres_asm_ilu, newton: { inexact: false } }";
const INEXACT: &str = "{ linear: gmres_asm_ilu, newton: { inexact: true } }";
const AUTO: &str = "{ linear: auto }";

/// The case with its own solver block replaced.
fn solved_by(text: &str, solver: &str) -> String {
    let others = text.lines().filter(|line| !line.starts_with("solver:"));
    others.chain([&*format!("solver: {solver}")]).map(|line| format!("{line}\n")).collect()
}

fn rubber_block() -> String {
    shipped("rubber-block/case.yml", &[("cells: [48, 50]", "cells: [12, 13]"), ("end: 0.07", "end: 0.01")])
}

impl Results {
    /// Every Newton iteration with its contact points, as text.
    fn iterations(&self) -> Vec<String> {
        let table = self.table("iterations.csv");
        let columns = ["step", "attempt", "stage", "iteration", "points", "changed", "line_search"];
        let columns = columns.map(|name| table.texts(name));
        (0..table.len()).map(|row| columns.iter().map(|c| c[row]).collect::<Vec<_>>().join(" ")).collect()
    }

    /// The contact points of each contact in every step, as text.
    fn contact_points(&self) -> Vec<String> {
        let table = self.table("contact.csv");
        let columns = ["step", "contact", "points", "stick", "slip"].map(|name| table.texts(name));
        (0..table.len()).map(|row| columns.iter().map(|c| c[row]).collect::<Vec<_>>().join(" ")).collect()
    }

    /// The cells of all parts of the first fields, each as the numbers of its nodes.
    fn cells(&self, ranks: usize, grid: &str) -> Vec<Vec<i32>> {
        let mut cells = Vec::new();
        for rank in 0..ranks {
            let file = self.0.join("out/fields/step_000000").join(format!("{grid}_{rank:04}.vtu"));
            let piece = read_piece(&file).expect("a piece of every rank");
            let VtuValues::Int32(numbers) = &piece.point_data["node"].values else { panic!("no numbers") };
            let nodes = |cell| piece.cell(cell).iter().map(|&point| numbers[point as usize]).collect();
            cells.extend((0..piece.offsets.len()).map(nodes));
        }
        cells
    }
}

/// Largest difference of all columns of a kind, divided by their largest value.
fn difference(one: &Table, other: &Table, columns: &[String]) -> f64 {
    let (mut largest, mut apart) = (0.0f64, 0.0f64);
    for column in columns {
        for (a, b) in one.numbers(column).into_iter().zip(other.numbers(column)) {
            assert_eq!(a.is_nan(), b.is_nan(), "{column}");
            largest = largest.max(a.abs());
            apart = apart.max((a - b).abs());
        }
    }
    apart / largest.max(f64::MIN_POSITIVE)
}

/// Checks that iterations, contact points and displacements agree between one rank and each of
/// `ranks`, and that the parts contain every element and facet once. Returns the results of one
/// rank.
#[track_caller]
fn invariant(text: &str, ranks: &[usize]) -> Results {
    let alone = Results::of(text, 1);
    let probes = alone.table("probes.csv");
    let displacements: Vec<String> =
        probes.names().filter(|name| name.contains(".u_")).map(str::to_owned).collect();
    assert!(!displacements.is_empty());
    let grids = ["volume", "contact"].map(|grid| (grid, alone.cells(1, grid)));
    for &ranks in ranks {
        let together = Results::of(text, ranks);
        for (one, other) in alone.iterations().iter().zip(together.iterations()) {
            assert_eq!(*one, other, "{ranks} ranks: an iteration (step attempt stage iteration points ...)");
        }
        assert_eq!(alone.iterations().len(), together.iterations().len(), "{ranks} ranks: iterations");
        for (one, other) in alone.contact_points().iter().zip(together.contact_points()) {
            assert_eq!(*one, other, "{ranks} ranks: step, contact, points, stick, slip");
        }
        let apart = difference(&probes, &together.table("probes.csv"), &displacements);
        println!("{ranks} ranks: displacements differ by {apart:.1e} of the largest");
        assert!(apart <= AGREEMENT, "{ranks} ranks: displacements differ by {apart:.1e} of the largest");
        for (grid, cells) in &grids {
            let pieces = together.cells(ranks, grid);
            let once: BTreeSet<_> = pieces.iter().collect();
            assert_eq!((pieces.len(), once.len()), (cells.len(), cells.len()), "{grid} cells, each once");
            assert_eq!(once, cells.iter().collect(), "{grid} cells");
        }
    }
    alone
}

/// The rubber block with a factorisation.
#[test]
fn rubber_block_direct_on_1_2_3_4_8_ranks() {
    invariant(&solved_by(&rubber_block(), DIRECT), &RANKS);
}

/// The rubber block with GMRES, every linear system solved to full accuracy.
#[test]
fn rubber_block_gmres_on_1_2_3_4_ranks() {
    invariant(&solved_by(&rubber_block(), GMRES), &[2, 3, 4]);
}

/// The complete rubber block with the default settings: 140 steps. A single iterate on the wrong
/// side of the tolerance would be visible.
#[test]
fn rubber_block_to_its_end_on_1_2_3_4_ranks() {
    invariant(&shipped("rubber-block/case.yml", &[("cells: [48, 50]", "cells: [24, 25]")]), &[2, 3, 4]);
}

/// The rubber block with the default settings for large problems. Inexact Newton must not make the
/// result depend on the partition.
#[test]
fn rubber_block_inexact_on_1_2_3_4_ranks() {
    invariant(&solved_by(&rubber_block(), INEXACT), &[2, 3, 4]);
}

/// The parts of PT-Scotch give the results of one rank, in which nothing is partitioned.
#[test]
fn rubber_block_by_ptscotch_on_1_2_3_4_ranks() {
    invariant(&format!("partition: ptscotch\n{}", solved_by(&rubber_block(), GMRES)), &[2, 3, 4]);
}

/// The case chooses the library that partitions: two libraries cut different sides.
#[test]
fn the_case_chooses_the_partitioner() {
    let folder = Folder::new("partitioner");
    let cut = |partitioner: &str| {
        let text =
            shipped("rubber-block/case.yml", &[("dimension: 2", &format!("dimension: 2\n{partitioner}"))]);
        folder.write("case.yml", &text);
        let output = run(3, &["check", "case.yml"], &folder).success();
        let line = output.stdout.lines().find(|line| line.contains("ranks: each of 3 ranks"));
        line.expect("the partition").to_owned()
    };
    assert_eq!(cut(""), cut("partition: metis"));
    assert_ne!(cut(""), cut("partition: ptscotch"));
}

/// More ranks than elements: some own no element, no node and no contact facet.
#[test]
fn two_elements_on_1_4_7_ranks() {
    let tiny = [("cells: [48, 50]", "cells: [2, 1]"), ("end: 0.07", "end: 0.01")];
    let text = shipped("rubber-block/case.yml", &tiny);
    invariant(&solved_by(&text, DIRECT), &[4, 7]);
    invariant(&solved_by(&text, INEXACT), &[4, 7]);
}

/// The other laws of section 4.1 of the paper: a pressure-dependent coefficient, power laws of gap
/// and friction, and the same law with another motion. The block is dragged ten times as fast as
/// shipped and pressed less, until points slip.
#[test]
fn rubber_block_by_every_law_on_1_2_3_4_8_ranks() {
    let on = |law: &str, motion: &[(&str, &str)], ranks: &[usize]| {
        let mut changes = vec![("cells: [48, 50]", "cells: [8, 6]"), ("y: -0.05", "y: -0.02")];
        changes.extend(motion);
        let text = shipped(&format!("rubber-block/{law}.yml"), &changes);
        let contact = invariant(&solved_by(&text, DIRECT), ranks).table("contact.csv");
        assert!(contact.numbers("slip").iter().any(|&points| points > 0.0), "{law}: nothing slipped");
    };
    let fast = [("x: \"1.0", "x: \"10"), ("end: 0.07", "end: 0.01")];
    on("grosch-schallamach", &fast, &RANKS);
    for law in
        ["power-law-1", "power-law-2", "power-law-3", "power-law-1-kn", "power-law-2-kn", "power-law-3-kn"]
    {
        on(law, &fast, &[2, 3, 4]);
    }
    let smooth = [("x: \"if", "x: \"20 * if"), ("end: 0.07, step: 1.25e-4", "end: 0.012, step: 5.0e-4")];
    on("smooth-start", &smooth, &[2, 3, 4]);
}

/// The block on the incline: a body that only friction holds, with a start whose free motion is
/// restrained. Linear systems are solved to the required accuracy.
#[test]
fn incline_inexact_on_1_2_3_4_ranks() {
    let coarse = [("cells: [16, 8]", "cells: [8, 4]"), ("end: 0.5", "end: 0.03")];
    invariant(&solved_by(&shipped("incline/case.yml", &coarse), INEXACT), &[2, 3, 4]);
}

/// The block on the incline, sliding, creeping and held by a return map. Its slope rises ten times
/// as fast as shipped.
#[test]
fn incline_on_1_2_3_4_8_ranks() {
    let coarse = [
        ("cells: [16, 8]", "cells: [8, 4]"),
        ("t < 0.1", "t < 0.01"),
        ("10*pi*t", "100*pi*t"),
        ("end: 0.5", "end: 0.03"),
    ];
    for case in ["case", "creep", "stick"] {
        invariant(&solved_by(&shipped(&format!("incline/{case}.yml"), &coarse), DIRECT), &RANKS);
    }
}

/// The sliding block, with the velocity regularisation and with the return map.
#[test]
fn sliding_block_on_1_2_3_4_8_ranks() {
    for case in ["sliding-block/case.yml", "sliding-block/return-map.yml"] {
        let text = shipped(case, &[("cells: [16, 4]", "cells: [8, 2]"), ("end: 0.25", "end: 0.02")]);
        invariant(&solved_by(&text, INEXACT), &RANKS);
    }
}

/// The bar on the wall: no friction, symmetric matrices, contact that opens and closes.
///
/// The bar starts nearer than shipped, at a distance such that the tip does not touch the wall at
/// the very end of a step, where rounding would decide.
#[test]
fn bar_impact_on_1_2_3_4_8_ranks() {
    let coarse = [
        ("cells: [1, 100]", "cells: [1, 25]"),
        ("min: [0, 5], max: [1, 15]", "min: [0, 0.13], max: [1, 10.13]"),
        ("at: [0, 5]", "at: [0, 0.13]"),
        ("at: [0, 15]", "at: [0, 10.13]"),
        ("end: 1.5, step: 2.5e-3", "end: 0.75, step: 1.0e-2"),
    ];
    let text = shipped("bar-impact/case.yml", &coarse);
    invariant(&solved_by(&text, AUTO), &RANKS);
    invariant(&solved_by(&text, "{ linear: cg_icc }"), &[3]);
}

/// The bar with every other shipped scheme and law. It starts nearer than shipped, so that all of
/// them touch the wall.
#[test]
fn bar_by_every_scheme_on_1_2_3_4_ranks() {
    let on = |case: &str, [low, high]: [&str; 2], [near, end]: [&str; 2]| {
        let [from, to] = [[low, high], [near, end]].map(|[low, high]| {
            [
                format!("min: [0, {low}], max: [1, {high}]"),
                format!("at: [0, {low}]"),
                format!("at: [0, {high}]"),
            ]
        });
        let mut changes: Vec<(&str, &str)> =
            from.iter().zip(&to).map(|(from, to)| (from.as_str(), to.as_str())).collect();
        match case {
            "ten-bounces" => {
                changes.extend([("cells: [1, 50]", "cells: [1, 25]"), ("end: 64,", "end: 0.1,")])
            }
            _ => changes.extend([
                ("cells: [1, 100]", "cells: [1, 25]"),
                ("end: 1.5, step: 2.5e-3", "end: 0.1, step: 1.0e-2"),
            ]),
        }
        let alone = invariant(&shipped(&format!("bar-impact/{case}.yml"), &changes), &[2, 3, 4]);
        let points = alone.table("contact.csv").numbers("points");
        assert!(points.iter().any(|&points| points > 0.0), "{case}: nothing touched the wall");
    };
    for case in ["newmark", "hht", "generalized-alpha-0.5", "backward-euler", "conserving"] {
        on(case, ["5", "15"], ["0.13", "10.13"]);
    }
    for case in ["finite-strain", "conserving-saint-venant-kirchhoff"] {
        on(case, ["0.15", "10.15"], ["0.013", "10.013"]);
    }
    on("ten-bounces", ["0.45", "10.45"], ["0.0003", "10.0003"]);
}

/// A bar on the wall with energy-conserving steps, whose forces depend on the previous and the next
/// gap. It starts nearer than shipped.
#[test]
fn conserving_bar_on_1_2_3_4_8_ranks() {
    let near = [
        ("cells: [1, 100]", "cells: [1, 25]"),
        ("0.15]", "0.013]"),
        ("end: 1.5, step: 2.5e-3", "end: 0.2, step: 1.0e-2"),
    ];
    invariant(&shipped("bar-impact/conserving-neo-hookean.yml", &near), &RANKS);
}

/// The patches of all plane elements, five bodies.
#[test]
fn plane_patches_on_1_2_3_4_8_ranks() {
    invariant(&shipped("patch/plane.yml", &[]), &RANKS);
}

/// The patches of all solid elements.
#[test]
fn solid_patches_on_1_2_3_4_8_ranks() {
    invariant(&shipped("patch/solid.yml", &[]), &RANKS);
}

/// The rubber cube on the plane, on the ball and in the tube: slip in two directions.
#[test]
fn rubber_cube_on_1_2_3_4_8_ranks() {
    for case in ["rubber-cube/case.yml", "rubber-cube/sphere.yml", "rubber-cube/cylinder.yml"] {
        let text = shipped(case, &[("cells: [10, 10, 10]", "cells: [4, 4, 4]"), ("end: 0.03", "end: 0.003")]);
        invariant(&solved_by(&text, INEXACT), &RANKS);
    }
}

/// A thin belt that touches a drum in small steps. The rounding error of its forces exceeds
/// Newton's tolerance, and shorter steps do not reduce it. No step needs many iterations or is cut,
/// on any number of ranks, and the forces agree.
#[test]
fn a_belt_converges_to_rounding_on_1_2_3_and_4_ranks() {
    let text = "title: Thin belt on a drum\ndimension: 2\nbodies:\n  belt:\n    \
        mesh: { box: { min: [-0.05, 0], max: [0.05, 1.0e-4], cells: [200, 2] } }\n    \
        material: { saint_venant_kirchhoff: { young_modulus: 1.0e9, poisson_ratio: 0.3 } }\n    kinematics: finite\n\
        obstacles:\n  drum: { sphere: { center: [0, -0.03], radius: 0.03, side: outside } }\n\
        contact:\n  sole:\n    contactor: belt.bottom\n    target: drum\n    normal: { penalty: { compliance: 1.0e-12 } }\n    \
        friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e11 } } }\n    \
        initial_overclosure: accept\n\
        boundary:\n  ends: { on: belt.left, displacement: { x: 0, y: \"-1e-6 * t\" } }\n  \
        pull: { on: belt.right, displacement: { x: 0, y: \"-1e-6 * t\" } }\n\
        time: { end: 1, step: 0.0333333, cuts: 0, scheme: { static: {} } }\n\
        solver: { newton: { max_iterations: 6 } }\n";
    let force = |ranks: usize| {
        let results = Results::of(text, ranks);
        assert_eq!(results.record()["steps"], 31, "{ranks} ranks");
        let worst = results.table("iterations.csv").last("residual");
        assert!(worst > 1e-9, "{ranks} ranks: {worst:e} is no rounding above the tolerance");
        results.table("reactions.csv").last("force_y")
    };
    let alone = force(1);
    for ranks in [2, 3, 4] {
        let found = force(ranks);
        assert!((found / alone - 1.0).abs() < 1e-7, "{ranks} ranks: {found:e} N, not {alone:e} N");
    }
}

/// A block on a disc with a radius of 1 km, and on a slope through a point 10 000 km away. Gaps
/// lose no digits to the size or the position of an obstacle. Newton's method therefore takes at
/// most two iterations more than on a plane, in which contact spreads over the disc. No step is cut.
#[test]
fn obstacles_may_be_large_and_far_on_1_2_and_3_ranks() {
    let text = |obstacle: &str| {
        format!(
            "title: Block on something large\ndimension: 2\nbodies:\n  b:\n    \
             mesh: {{ box: {{ min: [0, 0], max: [0.4, 0.4], cells: [4, 4] }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 5.0e6, poisson_ratio: 0.3 }} }}\n\
             obstacles:\n  floor: {obstacle}\n\
             contact:\n  sole: {{ contactor: b.bottom, target: floor, normal: {{ penalty: {{ compliance: 1.0e-11 }} }}, \
             initial_overclosure: accept }}\n\
             boundary:\n  side: {{ on: b.left, displacement: {{ x: 0 }} }}\n  press: {{ on: b.top, displacement: {{ y: -0.01 }} }}\n\
             time: {{ end: 1, cuts: 0, scheme: {{ static: {{ increments: 2 }} }} }}\n\
             solver: {{ newton: {{ tolerance: 1e-9 }} }}\n"
        )
    };
    let flat = Results::of(&text("{ plane: { point: [0, 0], normal: [0, 1] } }"), 1);
    let force = |results: &Results| results.table("contact.csv").last("force_n");
    let iterations = |results: &Results| results.record()["newton_iterations"].as_u64().expect("a count");
    for obstacle in [
        "{ sphere: { center: [0.2, -1000], radius: 1000 } }",
        "{ sphere: { center: [0.2, -1.0e6], radius: 1.0e6 } }",
        "{ plane: { point: [1.0e7, 0], normal: [0, 1] } }",
    ] {
        for ranks in [1, 2, 3] {
            let results = Results::of(&text(obstacle), ranks);
            let newton = iterations(&results);
            assert!(newton <= iterations(&flat) + 2, "{obstacle} on {ranks} ranks: {newton} iterations");
            let found = force(&results) / force(&flat);
            assert!((found - 1.0).abs() < 0.01, "{obstacle} on {ranks} ranks: {found}");
        }
    }
}
