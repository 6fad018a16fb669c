//! Two deformable bodies on 1, 2, 3, 4 and 8 ranks. Every scene at reduced size gives the same
//! displacements, the same number of Newton iterations and the same contact points at every step.
//! The scenes run with a factorisation, with each iterative solver that is selected automatically
//! or made for contact, and with second-order elements.

#[path = "../common/mod.rs"]
mod common;
mod krylov;
mod second_order;

use common::{Results, shipped};

const RANKS: [usize; 4] = [2, 3, 4, 8];

/// Displacements agree to this fraction of the largest one.
const AGREEMENT: f64 = 1e-9;

/// A shipped case, the changes that reduce its size, and those that reduce its duration.
struct Scene {
    case: &'static str,
    changes: &'static [(&'static str, &'static str)],
}

const fn scene(case: &'static str, changes: &'static [(&'static str, &'static str)]) -> Scene {
    Scene { case, changes }
}

const CONCRETE_CHANGES: [(&str, &str); 3] = [
    ("cells: [20, 10]", "cells: [10, 5]"),
    ("cells: [50, 16]", "cells: [25, 8]"),
    ("end: 0.094", "end: 5.0e-3"),
];

/// With the printed moduli the penetration is 3 nm. A gap rounded like the coordinates of its two
/// sides would fail here.
const CONCRETE: &[Scene] = &[
    scene("concrete-block/case.yml", &CONCRETE_CHANGES),
    scene("concrete-block/as-printed.yml", &CONCRETE_CHANGES),
];

const ROUND: &[Scene] = &[
    scene("hertz/case.yml", &[("cells: [45, 35]", "cells: [15, 12]"), ("increments: 5", "increments: 2")]),
    scene("hertz/finite.yml", &[("cells: [45, 35]", "cells: [15, 12]"), ("increments: 5", "increments: 2")]),
    scene(
        "hertz/spheres.yml",
        &[("[10, 10, 8]", "[5, 5, 4]"), ("[8, 8, 8]", "[4, 4, 4]"), ("increments: 8", "increments: 2")],
    ),
    scene(
        "cattaneo-mindlin/case.yml",
        &[("cells: [120, 48]", "cells: [24, 10]"), ("increments: 16", "increments: 4")],
    ),
];

/// The bodies are closer and the steps slower than as shipped.
const BARS: &[Scene] = &[scene(
    "bar-impact/two-bars.yml",
    &[
        ("cells: [1, 100]", "cells: [1, 25]"),
        ("min: [0, 5], max: [1, 15]", "min: [0, 0.13], max: [1, 10.13]"),
        ("at: [0, 15]", "at: [0, 10.13]"),
        ("end: 1.5, step: 2.5e-3", "end: 0.2, step: 1.0e-2"),
    ],
)];

const PATCHES: &[Scene] = &[scene("patch/blocks.yml", &[]), scene("patch/blocks-solid.yml", &[])];

const IRONING: &[Scene] = &[
    scene(
        "ironing/case.yml",
        &[
            ("cells: [48, 6]", "cells: [48, 2]"),
            ("cells: [40, 10]", "cells: [40, 5]"),
            ("end: 1,", "end: 0.5,"),
        ],
    ),
    // Steps of five facets: target facets are gathered anew within solves.
    scene(
        "ironing/case.yml",
        &[("step: 2.5e-2", "step: 0.25"), ("output:", "guard: { motion: 10 }\noutput:")],
    ),
    scene(
        "ironing/solid.yml",
        &[
            ("cells: [12, 12, 2]", "cells: [8, 8, 1]"),
            ("cells: [15, 11, 3]", "cells: [12, 8, 2]"),
            ("end: 1,", "end: 0.42,"),
        ],
    ),
];

const COLLISIONS: &[Scene] = &[
    scene(
        "collision/case.yml",
        &[
            ("cells: [12, 12]", "cells: [6, 6]"),
            ("cells: [14, 14]", "cells: [7, 7]"),
            ("end: 0.012, step: 5.0e-5", "end: 0.0012, step: 1.0e-4"),
        ],
    ),
    scene(
        "collision/friction.yml",
        &[
            ("cells: [12, 12]", "cells: [6, 6]"),
            ("cells: [14, 14]", "cells: [7, 7]"),
            ("end: 0.012, step: 5.0e-5", "end: 0.0012, step: 1.0e-4"),
        ],
    ),
    scene("collision/touching.yml", &[("cells: [8, 8]", "cells: [4, 4]"), ("end: 0.008", "end: 0.001")]),
    scene(
        "collision/solid.yml",
        &[
            ("cells: [6, 6, 6]", "cells: [3, 3, 3]"),
            ("cells: [7, 7, 7]", "cells: [4, 4, 4]"),
            ("end: 0.010, step: 1.0e-4", "end: 0.005, step: 2.0e-4"),
            ("compliance: 1.0e-10", "compliance: 1.0e-9"),
        ],
    ),
];

const CUBES: &[Scene] = &[scene(
    "two-cubes/case.yml",
    &[
        ("cells: [10, 10, 10]", "cells: [5, 5, 4]"),
        ("cells: [8, 8, 8]", "cells: [4, 4, 3]"),
        ("end: 0.01,", "end: 0.0025,"),
    ],
)];

/// The results that must agree between one rank and any other number of them.
struct Answer {
    displacements: Vec<f64>,
    newton: serde_json::Value,
    /// Linear solves that another preset had to complete.
    fallbacks: u64,
    /// Closed, sticking and slipping points of each step and contact.
    points: Vec<String>,
}

impl Answer {
    fn of(text: &str, ranks: usize) -> Self {
        let results = Results::of(text, ranks);
        let (probes, contact) = (results.table("probes.csv"), results.table("contact.csv"));
        let names = probes.names().filter(|name| name.contains(".u_"));
        let columns = ["step", "contact", "points", "stick", "slip"].map(|name| contact.texts(name));
        let row = |row: usize| columns.iter().map(|column| column[row]).collect::<Vec<_>>().join(" ");
        let record = results.record();
        Self {
            displacements: names.flat_map(|name| probes.numbers(name)).collect(),
            newton: record["newton_iterations"].clone(),
            fallbacks: record["linear_fallbacks"].as_u64().expect("a count"),
            points: (0..contact.len()).map(row).collect(),
        }
    }

    /// Whether any contact closed.
    fn touches(&self) -> bool {
        self.points.iter().any(|row| row.split(' ').nth(2).is_some_and(|points| points != "0"))
    }

    /// Largest difference of displacements, divided by the largest displacement.
    fn apart(&self, other: &Self) -> f64 {
        let (a, b) = (&self.displacements, &other.displacements);
        assert!(!a.is_empty() && a.len() == b.len(), "{} and {} displacements", a.len(), b.len());
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, u| most.max(u.abs()));
        largest(&mut a.iter().zip(b).map(|(a, b)| a - b)) / largest(&mut a.iter().copied())
    }
}

/// Runs each scene with a factorisation, so that the ranks differ by rounding only.
#[track_caller]
fn invariant(scenes: &[Scene]) {
    scenes.iter().for_each(|scene| invariant_by(scene, "linear: direct", &RANKS));
}

/// Runs a scene with the solver `solver`. Solves are exact, or accurate to the tolerance of the
/// Krylov method, in every iteration.
#[track_caller]
fn invariant_by(Scene { case, changes }: &Scene, solver: &str, ranks: &[usize]) {
    let text = shipped(case, changes);
    let others = text.lines().filter(|line| !line.starts_with("solver:"));
    let line = format!("solver: {{ {solver}, newton: {{ inexact: false }} }}");
    let text: String = others.chain([line.as_str()]).map(|line| format!("{line}\n")).collect();
    let what = format!("{case} by {solver}");
    let alone = Answer::of(&text, 1);
    assert!(alone.touches(), "{what}: nothing touches");
    for &ranks in ranks {
        let together = Answer::of(&text, ranks);
        assert_eq!(alone.newton, together.newton, "{what} on {ranks} ranks: Newton iterations");
        assert_eq!(together.fallbacks, 0, "{what} on {ranks} ranks: another solver took over");
        assert_eq!(alone.points.len(), together.points.len(), "{what} on {ranks} ranks: steps");
        for (one, other) in alone.points.iter().zip(&together.points) {
            assert_eq!(one, other, "{what} on {ranks} ranks: step contact points stick slip");
        }
        let apart = alone.apart(&together);
        println!("{what} on {ranks} ranks: {apart:.1e}");
        assert!(apart < AGREEMENT, "{what} on {ranks} ranks: displacements differ by {apart:.1e}");
    }
}

#[test]
fn concrete_block_on_1_2_3_4_8_ranks() {
    invariant(CONCRETE);
}

#[test]
fn hertz_and_cattaneo_mindlin_on_1_2_3_4_8_ranks() {
    invariant(ROUND);
}

#[test]
fn conserving_bars_on_1_2_3_4_8_ranks() {
    invariant(BARS);
}

#[test]
fn patches_that_do_not_match_on_1_2_3_4_8_ranks() {
    invariant(PATCHES);
}

#[test]
fn ironing_on_1_2_3_4_8_ranks() {
    invariant(IRONING);
}

#[test]
fn collisions_on_1_2_3_4_8_ranks() {
    invariant(COLLISIONS);
}

#[test]
fn two_cubes_on_1_2_3_4_8_ranks() {
    invariant(CUBES);
}
