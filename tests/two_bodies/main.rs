//! The scenes of two deformable bodies at reduced size: statements of the paper, and conserved
//! quantities.

#[path = "../common/mod.rs"]
mod common;
mod rolling;
mod starts;
mod strategies;

use common::{Results, shipped};

impl Results {
    /// Columns of `probes.csv` whose names contain `part`.
    fn probes(&self, part: &str) -> Vec<Vec<f64>> {
        let table = self.table("probes.csv");
        let names: Vec<&str> = table.names().filter(|name| name.contains(part)).collect();
        names.iter().map(|name| table.numbers(name)).collect()
    }
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// Largest difference of displacements of all probes at all steps, divided by the largest
/// displacement.
#[track_caller]
fn apart(one: &Results, other: &Results) -> f64 {
    let [a, b] = [one, other].map(|results| results.probes(".u_").concat());
    assert!(!a.is_empty() && a.len() == b.len(), "{} and {} displacements", a.len(), b.len());
    largest(a.iter().zip(&b).map(|(a, b)| a - b)) / largest(a)
}

const COARSE_BLOCK: [(&str, &str); 3] = [
    ("cells: [20, 10]", "cells: [10, 5]"),
    ("cells: [50, 16]", "cells: [25, 8]"),
    ("end: 0.094", "end: 0.03"),
];

/// Weight of the block and P_y \[N\].
const BURDEN: f64 = 2200.0 * 0.5 * 9.81 + 3.0e5;

/// Sum of the reactions at the start.
fn supports_at_rest(results: &Results) -> [f64; 2] {
    let table = results.table("reactions.csv");
    let steps = table.numbers("step");
    ["force_x", "force_y"].map(|column| {
        steps.iter().zip(table.numbers(column)).filter(|(step, _)| **step == 0.0).map(|row| row.1).sum()
    })
}

/// The static start is in equilibrium, no force had to restrain the block along x, and the block
/// stays at rest until it is pushed.
#[test]
fn the_concrete_block_rests_on_its_base() {
    for case in ["concrete-block/case.yml", "concrete-block/as-printed.yml"] {
        let results = Results::of(&shipped(case, &COARSE_BLOCK).replace("end: 0.03", "end: 5.0e-4"), 1);
        let [x, y] = supports_at_rest(&results);
        assert!((y / BURDEN - 1.0).abs() < 1e-8, "{case}: base {y}, burden {BURDEN}");
        assert!(x.abs() < 1e-8 * BURDEN, "{case}: {x} N along x");
        // A, C, B come in this order; symmetry holds C in place.
        let [along, down] =
            ["u_x", "u_y"].map(|u| results.probes(u).iter().map(|u| u[0]).collect::<Vec<_>>());
        assert!(along[1].abs() < 1e-9 * down[1].abs(), "{case}: {along:?}");
        assert!((down[0] - down[2]).abs() < 1e-9 * down[1].abs() && down[1] < 0.0, "{case}: {down:?}");
    }
}

/// "An evident swaying process of the block evoked by the short-time load. The middle point C
/// demonstrates a stable vertical displacement with a value which results from the initial state."
#[test]
fn the_concrete_block_sways_about_its_middle() {
    let results = Results::of(&shipped("concrete-block/case.yml", &COARSE_BLOCK), 1);
    let [a, c, b] =
        <[Vec<f64>; 4]>::try_from(results.probes("u_y")).map(|[a, c, b, _]| [a, c, b]).expect("probes");
    let settled = c[0].abs();
    let strayed = largest(c.iter().map(|u| u - c[0]));
    assert!(strayed < 0.02 * settled, "C strays by {strayed} of {settled}");
    let tilt: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    assert!(largest(tilt.iter().copied()) > 0.2 * settled, "no sway");
    let times = results.table("probes.csv").numbers("time");
    let swings: Vec<f64> =
        (1..tilt.len()).filter(|&i| tilt[i - 1] * tilt[i] < 0.0).map(|i| times[i]).collect();
    let after: Vec<f64> = swings.into_iter().filter(|time| *time > 0.01).collect();
    assert!(after.len() >= 2, "{after:?}");
    let period = 2.0 * (after[after.len() - 1] - after[0]) / (after.len() - 1) as f64;
    // 18 ms on the whole, between crossings of the two oscillations that take part 16 to 21.
    assert!((0.014..0.022).contains(&period), "period {period}");
}

/// Both strategies find the same motion, during the push and after it.
#[test]
fn the_concrete_block_by_stages() {
    let text = shipped("concrete-block/case.yml", &COARSE_BLOCK).replace("end: 0.03", "end: 0.0125");
    let solver = |text: &str, solver: &str| Results::of(&format!("{text}\nsolver: {solver}\n"), 1);
    let monolithic = solver(&text, "{ linear: direct }");
    let staggered = solver(&text, "{ strategy: { staggered: { tolerance: 1.0e-8 } } }");
    let apart = apart(&monolithic, &staggered);
    assert!(apart < 1e-6, "{apart:.1e}");
}

/// Largest change of columns of `momentum.csv`, divided by the initial momentum of one body.
fn change(results: &Results, columns: &[&str], scale: f64) -> f64 {
    let table = results.table("momentum.csv");
    let changes = columns.iter().flat_map(|column| {
        let values = table.numbers(column);
        let start = values[0];
        values.into_iter().map(move |value| value - start).collect::<Vec<_>>()
    });
    largest(changes) / scale
}

const DISCS: [(&str, &str); 3] = [
    ("cells: [12, 12]", "cells: [6, 6]"),
    ("cells: [14, 14]", "cells: [7, 7]"),
    ("step: 5.0e-5", "step: 1.0e-4"),
];

/// Without friction both momenta are conserved to rounding.
#[test]
fn colliding_discs_keep_their_momentum() {
    let results = Results::of(&shipped("collision/case.yml", &DISCS), 1);
    let pressed = results.table("contact.csv").numbers("force_n");
    assert!(pressed[0] == 0.0 && largest(pressed.iter().copied()) > 1e4 && pressed[pressed.len() - 1] == 0.0);
    // A disc of 1000 kg/m3 and 0.1 m at 3 m/s, passing the origin at up to 0.09 m.
    let linear = 1000.0 * std::f64::consts::PI * 0.01 * 3.0;
    assert!(change(&results, &["linear_x", "linear_y"], linear) < 1e-10);
    assert!(change(&results, &["angular_z"], 0.09 * linear) < 1e-10);
    let momentum = results.table("momentum.csv");
    assert!((momentum.numbers("linear_x")[0] / linear - 1.0 / 3.0).abs() < 0.02, "of 3 and - 2 m/s");
    let ledger = results.table("energy.csv");
    let unexplained = largest(ledger.numbers("numerical")) / ledger.numbers("total")[0];
    assert!(unexplained < 1e-6, "energy: {unexplained}");
}

/// With friction both momenta are conserved to rounding, and so is the energy including the heat.
/// Friction makes the discs spin. With the midpoint rule, friction acts with the lever of the
/// penetration and changes the angular momentum.
#[test]
fn colliding_discs_with_friction() {
    let case = shipped("collision/friction.yml", &DISCS);
    let results = Results::of(&case, 1);
    let linear = 1000.0 * std::f64::consts::PI * 0.01 * 3.0;
    assert!(change(&results, &["linear_x", "linear_y"], linear) < 1e-10);
    assert!(change(&results, &["angular_z"], 0.09 * linear) < 1e-10);
    let ledger = results.table("energy.csv");
    assert!(ledger.last("friction_dissipated") > 1.0);
    assert!(largest(ledger.numbers("numerical")) < 1e-3 * ledger.numbers("total")[0]);
    let heat = ledger.numbers("friction_dissipated");
    assert!(heat.windows(2).all(|pair| pair[1] >= pair[0] - 1e-12 * heat[heat.len() - 1]), "friction heats");
    let plain = Results::of(&case.replace("scheme: conserving", "scheme: midpoint"), 1);
    assert!(change(&plain, &["linear_x", "linear_y"], linear) < 1e-10);
    assert!(change(&plain, &["angular_z"], 0.09 * linear) > 1e-6);
}

/// Faces with zero gap rebound like any others.
#[test]
fn touching_blocks_bounce() {
    let changes =
        [("cells: [8, 8]", "cells: [4, 4]"), ("cells: [7, 7]", "cells: [3, 3]"), ("5.0e-5", "1.0e-4")];
    let results = Results::of(&shipped("collision/touching.yml", &changes), 1);
    // 10 kg at 2 m/s.
    assert!(change(&results, &["linear_x", "linear_y"], 20.0) < 1e-10);
    assert!(change(&results, &["angular_z"], 1.0) < 1e-10);
    let contact = results.table("contact.csv");
    assert_eq!(contact.numbers("force_n")[0], 0.0, "touching, not pressed");
    assert!(largest(contact.numbers("force_n")) > 1e4 && contact.last("force_n") == 0.0);
    // Over the second half of the time, in which they ring about their means.
    let probes = results.table("probes.csv");
    let way = |name: &str| probes.last(name) - probes.numbers(name)[probes.len() / 2];
    let [left, right] = ["left.u_x", "right.u_x"].map(way);
    assert!(left < -0.004 && right > 0.004 && left > -0.012 && right < 0.012, "{left}, {right}");
    assert!(largest(results.probes(".u_").concat()) < 0.05, "nothing is thrown away");
}

const BALLS: [(&str, &str); 4] = [
    ("cells: [6, 6, 6]", "cells: [3, 3, 3]"),
    ("cells: [7, 7, 7]", "cells: [4, 4, 4]"),
    ("step: 1.0e-4", "step: 2.0e-4"),
    ("compliance: 1.0e-10", "compliance: 1.0e-9"),
];

#[test]
fn colliding_balls_keep_their_momentum() {
    let case =
        shipped("collision/solid.yml", &BALLS).replace("stick_stiffness: 5.0e9", "stick_stiffness: 5.0e8");
    let (linear, angular) = (["linear_x", "linear_y", "linear_z"], ["angular_x", "angular_y", "angular_z"]);
    let scale = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3 * 3.0;
    let rubbing = Results::of(&case, 1);
    assert!(change(&rubbing, &linear, scale) < 1e-10);
    assert!(change(&rubbing, &angular, 0.09 * scale) < 1e-10);
    let ledger = rubbing.table("energy.csv");
    assert!(largest(ledger.numbers("numerical")) < 1e-3 * ledger.numbers("total")[0]);
    let friction = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 5.0e8 } } }";
    assert!(case.contains(friction));
    let smooth = Results::of(&case.replace(friction, "none"), 1);
    assert!(largest(smooth.table("contact.csv").numbers("force_n")) > 1e3);
    assert!(change(&smooth, &linear, scale) < 1e-10);
    assert!(change(&smooth, &angular, 0.09 * scale) < 1e-10);
}

/// Pairs of curved facets whose points are partly open need few iterations, because their matrix over a step
/// is derived at fixed places, as that of all pairs. Otherwise these steps take up to 25 and are cut.
#[test]
fn balls_without_friction_converge_quickly() {
    let friction = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 5.0e9 } } }";
    let case = shipped("collision/solid.yml", &[(friction, "none"), ("end: 0.010", "end: 0.0025")]);
    let results = Results::of(&case, 1);
    assert!(largest(results.table("contact.csv").numbers("force_n")) > 500.0);
    assert_eq!(results.record()["cut_steps"], 0);
    let iterations = results.table("iterations.csv").numbers("iteration").into_iter().fold(0.0, f64::max);
    assert!(iterations <= 9.0, "{iterations}");
}

/// A box bounces on a softer one with which it shares the middle line of its mesh, so that edges of both
/// cross at angles of rounding. With derivatives by the motion of the segment points, which is the
/// inverse of these angles, steps are cut until the run fails.
#[test]
fn boxes_with_aligned_meshes_bounce() {
    let case = "
dimension: 3
bodies:
  base:
    mesh: { box: { min: [0.1, 0.15, 0.5], max: [0.9, 0.85, 0.9], cells: [4, 2, 2], element: hex8 } }
    material: { neo_hookean: { young_modulus: 5.0e+5, poisson_ratio: 0.3 } }
    density: 1000
  box:
    mesh: { box: { min: [0.3, 0.3, 0.9], max: [0.75, 0.7, 1.2], cells: [2, 2, 2], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e+6, poisson_ratio: 0.3 } }
    density: 1000
contact:
  sole: { contactor: box.bottom, target: base.top, friction: FRICTION }
boundary:
  weight: { on: [base, box], gravity: [0, 0, -9.81] }
  ground: { on: base.bottom, displacement: { x: 0, y: 0, z: 0 } }
time: { end: 0.1, step: 0.01, scheme: conserving }
output: { fields: { every: 0 } }
";
    for friction in ["none", "{ coulomb: { coefficient: 0.4, regularization: { stick_stiffness: 1.0e7 } } }"]
    {
        let results = Results::of(&case.replace("FRICTION", friction), 1);
        let record = results.record();
        assert_eq!(record["cut_steps"], 0, "{friction}");
        let iterations = record["newton_iterations"].as_u64().expect("a count");
        assert!(iterations <= 60, "{friction}: {iterations} iterations in 10 steps");
        let contact = results.table("contact.csv");
        // Its weight is 530 N.
        assert!(largest(contact.numbers("force_n")) > 600.0);
        assert!(friction != "none" || largest(contact.numbers("force_y")) < 1e-5, "symmetric");
        let ledger = results.table("energy.csv");
        assert!(largest(ledger.numbers("numerical")) < 1e-7 * largest(ledger.numbers("total")));
        let shared = Results::of(&case.replace("FRICTION", friction), 3);
        assert_eq!(shared.record()["newton_iterations"].as_u64(), Some(iterations), "{friction}");
        let strain = |results: &Results| results.table("energy.csv").last("strain");
        assert!((strain(&shared) / strain(&results) - 1.0).abs() < 1e-8, "{friction}");
    }
}

/// The mesh is as fine as shipped along the surfaces, where it matters.
const SHALLOW_IRON: [(&str, &str); 2] =
    [("cells: [48, 6]", "cells: [48, 2]"), ("cells: [40, 10]", "cells: [40, 5]")];

/// Pressed with eight facets in contact and dragged over fifteen, half a facet per step. No step
/// fails, the indenter's reaction equals the contact force, the whole base slips, and the force
/// changes little along the path.
#[test]
fn ironing_is_smooth() {
    let results = Results::of(&shipped("ironing/case.yml", &SHALLOW_IRON), 1);
    let record = results.record();
    assert_eq!(record["cut_steps"], 0);
    let contact = results.table("contact.csv");
    let grip = results.table("reactions.csv").only("boundary", "grip");
    let scale = largest(contact.numbers("force_n"));
    for column in ["force_x", "force_y"] {
        // The contactor is the slab: what the grip does to the indenter, the contact does to the slab.
        let pairs = contact.numbers(column).into_iter().zip(grip.numbers(column));
        assert!(largest(pairs.map(|(slab, grip)| slab - grip)) < 1e-6 * scale, "{column}");
    }
    let times = contact.numbers("time");
    let sliding = |column: &str| -> Vec<f64> {
        let rows = times.iter().zip(contact.numbers(column));
        rows.filter(|(time, _)| **time > 0.5).map(|(_, force)| force).collect()
    };
    assert_eq!(sliding("slip"), sliding("points"));
    for (across, along) in sliding("force_n").iter().zip(sliding("force_t")) {
        assert!((along.abs() / across - 0.3).abs() < 0.01, "{along} of {across}");
    }
    let pressed = sliding("force_y");
    for three in pressed.windows(3) {
        let bend = three[1] - 0.5 * (three[0] + three[2]);
        assert!(bend.abs() < 0.01 * three[1].abs(), "jitter {bend} of {}", three[1]);
    }
}

/// With three and a half to six facets of the slab under the indenter, half a facet per step, no
/// step is cut. The force is close to that on fine meshes.
#[test]
fn ironing_on_a_coarse_slab_is_not_cut() {
    for (cells, bottom, bound) in [(20, 24, 0.025), (24, 29, 0.015), (28, 34, 0.01)] {
        let [slab, indenter] = [format!("cells: [{cells}, {}]", cells / 4), format!("cells: [{bottom}, 6]")];
        let step = format!("step: {}", 1.0 / f64::from(cells));
        let coarse = [("cells: [40, 10]", &*slab), ("cells: [48, 6]", &*indenter), ("step: 2.5e-2", &*step)];
        let results = Results::of(&shipped("ironing/case.yml", &coarse), 1);
        let record = results.record();
        let steps = (record["cut_steps"].as_u64(), record["steps"].as_u64());
        assert_eq!(steps, (Some(0), Some(cells as u64)), "{cells} cells");
        let last = results.table("contact.csv").last("force_n");
        assert!((last / 10.48e6 - 1.0).abs() < bound, "{cells} cells: {last}");
    }
}

/// Ironing with quadratic facets, as long on the indenter as on the slab. No step is cut. The
/// pressing force is the limit that linear facets approach from above (10.656, 10.516, 10.481 MN,
/// see the scene).
#[test]
fn ironing_on_quadratic_facets() {
    for element in ["quad8", "quad9", "tri6"] {
        let quadratic = [("cells: [48, 6]", "cells: [12, 3]"), ("quad4", element)];
        let results = Results::of(&shipped("ironing/case.yml", &quadratic), 1);
        assert_eq!(results.record()["cut_steps"], 0, "{element}");
        let pressed = results.table("contact.csv").numbers("force_n");
        let last = pressed.last().copied().unwrap_or(0.0);
        assert!((last / 10.48e6 - 1.0).abs() < 2e-3, "{element}: {last}");
    }
}

/// If the facets of the target are a quarter as long as the contactor's, no step is cut. The force
/// is that of matched meshes.
#[test]
fn a_finer_target_is_ironed_on_1_3_ranks() {
    let rows = [
        ("quad9", "cells: [24, 3]", "cells: [20, 5]", 1),
        ("quad9", "cells: [24, 3]", "cells: [20, 5]", 3),
        ("quad4", "cells: [144, 6]", "cells: [40, 10]", 1),
    ];
    for (element, indenter, slab, ranks) in rows {
        let step = if element == "quad9" { "step: 5.0e-2, cuts: 0" } else { "step: 2.5e-2, cuts: 0" };
        let fine = [
            ("cells: [48, 6]", indenter),
            ("cells: [40, 10]", slab),
            ("quad4", element),
            ("step: 2.5e-2", step),
            ("end: 1,", "end: 0.6,"),
        ];
        let results = Results::of(&shipped("ironing/case.yml", &fine), ranks);
        let last = results.table("contact.csv").last("force_n");
        assert!((last / 10.6e6 - 1.0).abs() < 0.02, "{element}, {ranks} ranks: {last}");
    }
}

/// The shipped 3D scene. Points that slide out under the rim of the indenter pass through its edge
/// slightly within a step, which is not a missed contact.
#[test]
fn ironing_in_space_is_not_cut() {
    let record = Results::of(&shipped("ironing/solid.yml", &[]), 1).record();
    assert_eq!((record["cut_steps"].as_u64(), record["steps"].as_u64()), (Some(0), Some(12)));
}

/// A block that starts 1 mm inside another one. The adjusted overlap neither causes pressure nor
/// counts as penetration. Further pressing has the response of a block that started on the surface.
#[test]
fn an_adjusted_overclosure_does_not_press() {
    let case = |overlap: f64, treatment: &str, push: f64| {
        format!(
            "
dimension: 2
bodies:
  lower:
    mesh: {{ box: {{ min: [-0.05, 0], max: [0.45, 0.2], cells: [7, 3] }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
  upper:
    mesh: {{ box: {{ min: [0, {low}], max: [0.4, {high}], cells: [4, 2] }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
contact:
  face:
    contactor: upper.bottom
    target: lower.top
    normal: {{ penalty: {{ compliance: 1.0e-9 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 1.0e8 }} }} }}
    initial_overclosure: {treatment}
boundary:
  top: {{ on: upper.top, displacement: {{ x: 0, y: {push} }} }}
  base: {{ on: lower.bottom, displacement: {{ x: 0, y: 0 }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}
",
            low = 0.2 - overlap,
            high = 0.4 - overlap,
        )
    };
    let last = |overlap, treatment, push, ranks| {
        let table = Results::of(&case(overlap, treatment, push), ranks).table("contact.csv");
        ["force_y", "max_penetration"].map(|column| table.last(column))
    };
    let [pressed, _] = last(1e-3, "accept", 0.0, 1);
    assert!(pressed > 100.0, "the overlap presses where it is accepted: {pressed}");
    let [at_rest, depth] = last(1e-3, "adjust", 0.0, 1);
    assert!(at_rest.abs() < 1e-6 && depth < 1e-12, "{at_rest} N, {depth} m");
    let touching = last(0.0, "error", -5e-3, 1);
    for ranks in [1, 3] {
        let adjusted = last(1e-3, "adjust", -5e-3, ranks);
        for (adjusted, touching) in adjusted.iter().zip(touching) {
            assert!(
                (adjusted - touching).abs() < 1e-3 * touching,
                "{ranks} ranks: {adjusted} for {touching}"
            );
        }
    }
}
