//! Two deformable bodies on 1, 2, 3, 4 and 8 ranks: every scene at reduced size gives the same displacements, the same
//! number of Newton iterations, the same contact points at every step, and every point paired with the same facet; with a
//! factorisation, and with each iterative solver that is chosen by itself or for contact; with elements of second order.

#[path = "../common/mod.rs"]
mod common;
mod krylov;
mod second_order;

use std::collections::BTreeMap;
use std::fs::File;

use contact_petsc::checkpoint::{Store, examine};

use common::{Results, shipped};

const RANKS: [usize; 4] = [2, 3, 4, 8];

/// Displacements agree to this part of the largest one.
const AGREEMENT: f64 = 1e-9;

/// Steps after which the pairs are kept, unless a scene says otherwise: all. What the search remembers from step to step is forgotten
/// where they are kept, so that scenes which slide far keep those of every other or third step.
const EVERY: u64 = 1;
/// Target of a point without a facet.
const NO_FACET: u64 = u64::MAX;

/// A shipped case, what makes it small, and what makes it short.
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

/// As printed the penetration is 3 nm: a gap rounded like the coordinates of its two sides fails here.
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

/// Nearer to each other and slower steps than as shipped.
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
            ("fields: { every: 10 }", "checkpoint: { every: 2, keep: 1000 }"),
        ],
    ),
    scene(
        "ironing/solid.yml",
        &[
            ("cells: [12, 12, 2]", "cells: [8, 8, 1]"),
            ("cells: [15, 11, 3]", "cells: [12, 8, 2]"),
            ("end: 1,", "end: 0.42,"),
            ("fields: { every: 6 }", "checkpoint: { every: 3, keep: 1000 }"),
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
            ("end: 0.010, step: 1.0e-4", "end: 0.003, step: 2.0e-4"),
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

/// What one rank and any other number of them must agree on.
struct Answer {
    displacements: Vec<f64>,
    newton: serde_json::Value,
    /// Linear solves that another preset had to end.
    fallbacks: u64,
    /// Of each step and contact: closed, sticking and slipping points.
    points: Vec<String>,
    pairs: BTreeMap<u64, Pairs>,
}

/// Contact points of a step, by contact and number in the input mesh, with the facets that they are paired with, by theirs.
type Pairs = BTreeMap<(String, u64), u64>;

impl Results {
    /// The pairs of the steps that have a checkpoint.
    fn pairs(&self) -> BTreeMap<u64, Pairs> {
        let checkpoints = Store::of(&self.0.join("out")).list();
        checkpoints.into_iter().map(|(step, path)| (step, pairs_of(&path))).collect()
    }
}

/// The column `target` of the contacts in a checkpoint.
fn pairs_of(path: &std::path::Path) -> Pairs {
    let bytes = std::fs::read(path).expect("a checkpoint");
    let mut file = File::open(path).expect("the same");
    let header = examine(path, &mut file, bytes.len() as u64).expect("a whole checkpoint");
    // Sections stand one after the other before the hash of 32 bytes.
    let words: Vec<u64> = bytes[..bytes.len() - 32].rchunks_exact(8).rev().map(word).collect();
    let size = |rows: u64, columns: &[String]| rows as usize * (1 + columns.len());
    let all: usize = header.sections.iter().map(|section| size(section.rows, &section.columns)).sum();
    let (mut left, mut pairs) = (&words[words.len() - all..], Pairs::new());
    for section in &header.sections {
        let (rows, rest) = left.split_at(size(section.rows, &section.columns));
        left = rest;
        let Some(target) = section.columns.iter().position(|name| name == "target") else { continue };
        for row in rows.chunks_exact(1 + section.columns.len()) {
            pairs.insert((section.name.clone(), row[0]), row[1 + target]);
        }
    }
    pairs
}

fn word(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().expect("eight bytes"))
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
            pairs: results.pairs(),
        }
    }

    /// The same points with the same facets in the same steps.
    #[track_caller]
    fn same_pairs(&self, other: &Self, who: &str) {
        assert!(self.pairs.keys().eq(other.pairs.keys()), "{who}: steps whose pairs are kept");
        for (step, pairs) in &self.pairs {
            let others = &other.pairs[step];
            assert!(pairs.keys().eq(others.keys()), "{who}: the contact points of step {step}");
            let differ = pairs.iter().filter(|(point, facet)| others[*point] != **facet);
            let differ: Vec<_> = differ.map(|(point, facet)| (point, facet, others[point])).collect();
            assert!(differ.is_empty(), "{who}: step {step}, point, its facet and the other one: {differ:?}");
        }
    }

    /// How often a point has another facet than it had before, in the steps whose pairs are kept.
    fn changes_of_facet(&self) -> usize {
        let steps: Vec<&Pairs> = self.pairs.values().collect();
        let changes = |(before, after): (&&Pairs, &&Pairs)| {
            let other = after.iter().filter(|(point, facet)| {
                **facet != NO_FACET && before[*point] != NO_FACET && before[*point] != **facet
            });
            other.count()
        };
        steps.iter().zip(steps.iter().skip(1)).map(changes).sum()
    }

    /// Whether anything touched.
    fn touches(&self) -> bool {
        self.points.iter().any(|row| row.split(' ').nth(2).is_some_and(|points| points != "0"))
    }

    /// Largest difference of displacements over the largest of them.
    fn apart(&self, other: &Self) -> f64 {
        let (a, b) = (&self.displacements, &other.displacements);
        assert!(!a.is_empty() && a.len() == b.len(), "{} and {} displacements", a.len(), b.len());
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, u| most.max(u.abs()));
        largest(&mut a.iter().zip(b).map(|(a, b)| a - b)) / largest(&mut a.iter().copied())
    }
}

/// Each scene with a factorisation, so that the ranks differ by rounding alone. How often points changed their facets in
/// each of them.
#[track_caller]
fn invariant(scenes: &[Scene]) -> Vec<usize> {
    scenes.iter().map(|scene| invariant_by(scene, "linear: direct", &RANKS)).collect()
}

/// A scene solved as `solver` says: solves are exact, or to the tolerance of the Krylov method, in every iteration.
#[track_caller]
fn invariant_by(Scene { case, changes }: &Scene, solver: &str, ranks: &[usize]) -> usize {
    let text = shipped(case, changes);
    let others = text.lines().filter(|line| !line.starts_with("solver:"));
    let line = format!("solver: {{ {solver}, newton: {{ inexact: false }} }}");
    let text: String = others.chain([line.as_str()]).map(|line| format!("{line}\n")).collect();
    let keep = format!("output:\n  checkpoint: {{ every: {EVERY}, keep: 1000 }}\n");
    let text = if text.contains("checkpoint:") { text } else { text.replacen("output:\n", &keep, 1) };
    let what = format!("{case} by {solver}");
    let alone = Answer::of(&text, 1);
    assert!(alone.touches(), "{what}: nothing touches");
    let paired = alone.pairs.values().flat_map(Pairs::values).filter(|facet| **facet != NO_FACET).count();
    assert!(paired > 0, "{what}: no point has a facet");
    for &ranks in ranks {
        let together = Answer::of(&text, ranks);
        alone.same_pairs(&together, &format!("{what} on {ranks} ranks"));
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
    let changes = alone.changes_of_facet();
    println!("{what}: {paired} pairs at {} steps, {changes} changes of facet", alone.pairs.len());
    changes
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
    let changes = invariant(IRONING);
    assert!(changes.iter().all(|changes| *changes > 10), "the points slide over facets: {changes:?}");
}

#[test]
fn collisions_on_1_2_3_4_8_ranks() {
    let changes = invariant(COLLISIONS);
    assert!(changes.iter().sum::<usize>() > 0, "the points change their facets: {changes:?}");
}

#[test]
fn two_cubes_on_1_2_3_4_8_ranks() {
    invariant(CUBES);
}
