//! The shipped scenes at reduced size, compared with closed-form results. A wrong coefficient, law,
//! sign or scheme fails.

mod common;

use std::path::PathBuf;

use common::{Results, Table, shipped, stretch};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

impl Results {
    fn probes(&self) -> Table {
        self.table("probes.csv")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join("out").join(name)
    }
}

/// Runs a case on one rank, which must succeed.
#[track_caller]
fn run(text: &str) -> Results {
    Results::of(text, 1)
}

/// The value of a column in the row of a given time.
#[track_caller]
fn at(table: &Table, column: &str, time: f64) -> f64 {
    let times = table.numbers("time");
    let row =
        times.iter().position(|t| (t - time).abs() < 1e-9).unwrap_or_else(|| panic!("no row at {time}"));
    table.numbers(column)[row]
}

#[track_caller]
fn close(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected} within {tolerance}");
}

/// Comparison with another program on the same mesh, `scripts/peer.py` (FEniCSx, forms and tangents
/// derived by UFL). The static start, which is frictionless, agrees to 1e-5. The forces of the
/// whole motion agree to 1 % of the largest. The other program uses the smooth friction law.
#[test]
fn rubber_block_agrees_with_another_program() {
    let coarse = [("cells: [48, 50]", "cells: [16, 16]"), ("locking: selective_reduced", "locking: none")];
    let contact = run(&shipped("rubber-block/case.yml", &coarse)).table("contact.csv");
    let peer = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/peer/rubber-block-16.csv");
    let peer = Table::read(std::path::Path::new(peer));
    for (ours, theirs) in [("force_n", "f_n"), ("force_x", "f_t")] {
        let theirs = peer.numbers(theirs);
        let scale = theirs.iter().fold(0.0_f64, |largest, force| largest.max(force.abs()));
        for (row, (time, expected)) in peer.numbers("t").into_iter().zip(theirs).enumerate() {
            let tolerance = if row == 0 { 1e-5 } else { 1e-2 };
            close(&format!("{ours} at {time} s"), at(&contact, ours, time), expected, tolerance * scale);
        }
    }
}

const GRAVITY: f64 = 9.81;

/// tan = 0.5: sin = 1 / sqrt 5, cos = 2 / sqrt 5.
fn slope(mu: f64) -> f64 {
    GRAVITY * (1.0 - 2.0 * mu) / 5.0f64.sqrt()
}

const COARSE_INCLINE: [(&str, &str); 2] = [("cells: [16, 8]", "cells: [8, 4]"), ("end: 0.5", "end: 0.3")];

/// Mean acceleration of the block after the load ramp.
fn acceleration(results: &Results) -> f64 {
    let probes = results.probes();
    (at(&probes, "centre.v_x", 0.3) - at(&probes, "centre.v_x", 0.25)) / 0.05
}

/// mu = 0.49 on tan = 0.5: a = g (sin - mu cos). Another coefficient gives another acceleration.
#[test]
fn the_block_on_the_incline_slides() {
    let text = shipped("incline/case.yml", &COARSE_INCLINE);
    close("mu = 0.49", acceleration(&run(&text)), slope(0.49), 1e-5);
    let text = text.replace("coefficient: 0.49", "coefficient: 0.4");
    close("mu = 0.4", acceleration(&run(&text)), slope(0.4), 1e-4);
}

/// mu = 0.5 on tan = 0.5 is just enough. With the velocity law the block creeps, more slowly than
/// the stick velocity.
#[test]
fn the_block_on_the_incline_creeps() {
    let probes = run(&shipped("incline/creep.yml", &COARSE_INCLINE)).probes();
    let crept = probes.last("heel.u_x");
    assert!(crept > 0.5 * 1e-3 * 0.3 && crept < 1e-3 * 0.3, "crept {crept}");
}

/// mu = 0.51 on tan = 0.5 is enough. With the return map the block slips elastically and then
/// sticks.
#[test]
fn the_block_on_the_incline_stays() {
    let probes = run(&shipped("incline/stick.yml", &COARSE_INCLINE)).probes();
    let settled = at(&probes, "heel.u_x", 0.2);
    close("creep", probes.last("heel.u_x"), settled, 1e-11);
    close("elastic slip", settled, 0.0, 2e-6);
}

/// A block with 1 m/s and friction mu stops after v0 / (mu g) and v0^2 / (2 mu g), and friction has
/// dissipated its energy.
fn stops(case: &str, mu: f64, slack: f64) {
    let coarse = [("cells: [16, 4]", "cells: [8, 2]"), ("coefficient: 0.5", &*format!("coefficient: {mu}"))];
    let results = run(&shipped(case, &coarse));
    let (probes, energy) = (results.probes(), results.table("energy.csv"));
    let (time, way) = (1.0 / (mu * GRAVITY), 0.5 / (mu * GRAVITY));
    close("way", probes.last("centre.u_x"), way, slack);
    let speeds = probes.numbers("centre.v_x");
    let stop = speeds.iter().position(|v| *v < 1e-3).expect("it stops");
    close("time", probes.numbers("time")[stop], time, 2e-3);
    assert!(probes.last("centre.v_x").abs() < 1e-4, "rests");
    let kinetic = energy.numbers("kinetic")[0];
    close("kinetic energy", kinetic, 125.0, 1e-9);
    close("friction work", energy.last("friction_dissipated"), kinetic, 10.0 * slack * kinetic);
    let books =
        kinetic + energy.last("external_work") + energy.numbers("strain")[0] + energy.numbers("contact")[0];
    let spent = energy.last("total") + energy.last("friction_dissipated") + energy.last("numerical");
    close("ledger", spent, books, 1e-9 * books);
}

#[test]
fn the_sliding_block_stops() {
    stops("sliding-block/case.yml", 0.5, 5e-5);
    stops("sliding-block/case.yml", 0.6, 5e-5);
}

#[test]
fn the_sliding_block_stops_under_the_return_map() {
    // What slides at the start has its whole friction from there on, as the velocity law has.
    stops("sliding-block/return-map.yml", 0.5, 5e-5);
    stops("sliding-block/return-map.yml", 0.6, 5e-5);
}

/// The contact history of the bar at the wall.
struct Rebound {
    begins: f64,
    ends: f64,
    force: f64,
    /// Total energy at the end, divided by that at the start.
    kept: f64,
}

fn rebound(case: &str) -> Rebound {
    let results = run(&shipped(case, &[("end: 1.5", "end: 1.25")]));
    let (contact, energy) = (results.table("contact.csv"), results.table("energy.csv"));
    let rows: Vec<(f64, f64)> = contact.numbers("time").into_iter().zip(contact.numbers("force_n")).collect();
    let touching: Vec<f64> = rows.iter().filter(|row| row.1 > 0.0).map(|row| row.0).collect();
    let plateau: Vec<f64> = rows.iter().filter(|row| row.0 > 0.55 && row.0 < 1.1).map(|row| row.1).collect();
    Rebound {
        begins: touching[0],
        ends: touching[touching.len() - 1],
        force: plateau.iter().sum::<f64>() / plateau.len() as f64,
        kept: energy.last("total") / energy.numbers("total")[0],
    }
}

/// The bar is in contact from 0.5 s to 7/6 s under rho c v0, and each scheme conserves as much
/// energy as it can.
#[test]
fn the_bar_rebounds() {
    for (case, force, kept) in [
        ("case", 300.0, 0.98..1.001),
        ("finite-strain", 9.0, 0.98..1.001),
        ("newmark", 300.0, 1.01..1.2),
        ("generalized-alpha-0.5", 300.0, 0.97..1.001),
        ("hht", 300.0, 0.97..1.001),
        ("backward-euler", 300.0, 0.5..0.97),
    ] {
        let bar = rebound(&format!("bar-impact/{case}.yml"));
        close(&format!("{case}: first touch"), bar.begins, 0.5, 0.005);
        close(&format!("{case}: release"), bar.ends, 7.0 / 6.0, 0.03);
        close(&format!("{case}: force"), bar.force, force, 0.01 * force);
        assert!(kept.contains(&bar.kept), "{case}: {} of the energy is left", bar.kept);
    }
}

/// Cauchy stress of all cells of the last step \[Pa\], component by component.
fn stresses(results: &Results, step: &str) -> (usize, Vec<f64>) {
    let folder = results.file("fields").join(step);
    let names = std::fs::read_dir(&folder).expect("fields").map(|entry| entry.expect("a file").path());
    let mut pieces = names.filter(|path| path.extension().is_some_and(|e| e == "vtu"));
    let piece = pieces
        .find_map(|path| read_piece(&path).ok().filter(|piece| piece.cell_data.contains_key("cauchy_stress")))
        .expect("a piece with stresses");
    let field = &piece.cell_data["cauchy_stress"];
    let VtuValues::Float64(values) = &field.values else { panic!("stresses are numbers") };
    (field.components, values.clone())
}

/// For every element, stress and pressure are uniform, and the contact force is correct, to
/// rounding.
#[test]
fn patches_are_uniform() {
    for (case, free, width) in [("plane", 1, 0.4), ("solid", 2, 0.16)] {
        let results = run(&shipped(&format!("patch/{case}.yml"), &[]));
        let area = width * stretch(free).powi(free);
        let (contact, probes) = (results.table("contact.csv"), results.probes());
        let mut names = contact.texts("contact");
        names.sort_unstable();
        names.dedup();
        for name in &names {
            let own = contact.only("contact", name);
            close(&format!("{name}: area"), own.last("area"), area, 1e-9 * area);
            close(&format!("{name}: force"), own.last("force_n"), 1e5 * area, 1e-9 * 1e5 * area);
            close(&format!("{name}: peak"), own.last("max_pressure"), 1e5, 1e-4);
            close(name, probes.last(&format!("{name}.contact_pressure")), 1e5, 1e-4);
        }
        let (components, stress) = stresses(&results, "step_000002");
        assert!(components == 6 || components == 9, "{components} components");
        let axial = free as usize; // y in the plane, z in space: the diagonal entries come first in both forms
        let axial = if components == 6 { axial } else { axial * 4 };
        for (i, value) in stress.iter().enumerate() {
            let k = i % components;
            let plane_strain = free == 1 && k == if components == 6 { 2 } else { 8 };
            if !plane_strain {
                close(&format!("{case}: stress {k}"), *value, if k == axial { -1e5 } else { 0.0 }, 1e-4);
            }
        }
    }
}

/// Largest difference of a column, divided by the largest value of its kind.
#[track_caller]
fn apart(one: &Table, other: &Table, columns: &[&str]) -> f64 {
    let mut worst = 0.0f64;
    for column in columns {
        let (a, b) = (one.numbers(column), other.numbers(column));
        assert_eq!(a.len(), b.len());
        let largest = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let difference = a.iter().zip(&b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        worst = worst.max(difference / largest);
    }
    worst
}

const BLOCK: &str = "cells: [48, 50]";
const TIGHT: (&str, &str) = (
    "solver: { strategy: monolithic }",
    "solver: { linear: direct, newton: { tolerance: 1.0e-13, inexact: false } }",
);

/// With m_N = 1 and c_N = 1 / compliance the power law equals Grosch-Schallamach's at -1/9: the
/// histories agree.
#[test]
fn the_power_law_is_grosch_schallamach() {
    let coarse = [(BLOCK, "cells: [8, 8]"), ("end: 0.07", "end: 0.05"), TIGHT];
    let columns = |contact: &Results| (contact.table("contact.csv"), contact.probes());
    let (power, power_probes) = columns(&run(&shipped("rubber-block/power-law-1.yml", &coarse)));
    let (grosch, grosch_probes) = columns(&run(&shipped("rubber-block/grosch-schallamach.yml", &coarse)));
    let (coulomb, _) = columns(&run(&shipped("rubber-block/case.yml", &coarse)));
    let forces = ["force_n", "force_t", "area", "max_pressure"];
    let motion =
        ["node_50.u_x", "node_50.u_y", "node_98.u_x", "node_98.contact_pressure", "node_98.traction_t"];
    assert!(power.numbers("slip").iter().any(|n| *n > 0.0), "the slip branch takes part");
    let difference = apart(&power, &grosch, &forces).max(apart(&power_probes, &grosch_probes, &motion));
    assert!(difference < 1e-10, "{difference}");
    assert!(apart(&power, &coulomb, &forces) > 1e-5, "the coefficient takes part");
}

/// All shipped friction models drag a coarse block. It is pressed, sheared in the correct
/// direction, and unloaded at the trailing corner.
#[test]
fn every_rubber_block_runs() {
    let coarse = [(BLOCK, "cells: [12, 12]"), ("end: 0.07", "end: 0.03")];
    for (case, pressure) in [
        ("case", 0.7e6),
        ("grosch-schallamach", 0.7e6),
        ("power-law-1", 0.7e6),
        ("power-law-2", 0.7e6),
        ("power-law-3", 0.7e6),
        ("power-law-1-kn", 0.29e6),
        ("power-law-2-kn", 0.67e6),
        ("power-law-3-kn", 0.69e6),
        ("smooth-start", 0.7e6),
    ] {
        let step = if case == "smooth-start" { "step: 1.25e-4" } else { "step: 5.0e-4" };
        let results =
            run(&shipped(&format!("rubber-block/{case}.yml"), &coarse).replace(step, "step: 1.0e-3"));
        let (contact, probes) = (results.table("contact.csv"), results.probes());
        let start = at(&contact, "force_n", 0.0) / at(&contact, "area", 0.0);
        close(&format!("{case}: mean pressure"), start, pressure, 0.05 * pressure);
        close(&format!("{case}: friction at the start"), at(&contact, "force_t", 0.0), 0.0, 1.0);
        assert!(
            contact.last("force_t") < 0.0 && contact.last("force_y") > 0.0,
            "{case}: forces on the block"
        );
        let [trailing, leading] =
            ["node_50", "node_98"].map(|n| probes.last(&format!("{n}.contact_pressure")));
        assert!(trailing < 0.7 * pressure && leading > 1.2 * pressure, "{case}: {trailing}, {leading}");
        let ledger = results.table("energy.csv");
        let numerical = ledger.last("numerical").abs() / ledger.last("external_work").abs();
        assert!(numerical < 0.02, "{case}: numerical {numerical}");
    }
}

/// The rubber cube over a plane, over a ball and in a tube. It is in equilibrium with its support
/// and symmetric if the scene is. In full slip, friction is mu t_n against the motion.
#[test]
fn the_rubber_cube_is_dragged() {
    let coarse = [("cells: [10, 10, 10]", "cells: [4, 4, 4]"), ("end: 0.03", "end: 0.02")];
    for case in ["case", "sphere", "cylinder"] {
        let results = run(
            &shipped(&format!("rubber-cube/{case}.yml"), &coarse).replace("step: 5.0e-4", "step: 1.0e-3")
        );
        let (contact, reactions) = (results.table("contact.csv"), results.table("reactions.csv"));
        let [x, y, z] = ["force_x", "force_y", "force_z"].map(|c| contact.last(c));
        let (pressed, friction) = (contact.last("force_n"), contact.last("force_t"));
        assert!(x < 0.0 && z > 0.0, "{case}: {x}, {y}, {z}");
        assert!(friction <= 0.5 * pressed * (1.0 + 1e-9), "{case}: {friction} of {pressed}");
        assert!(contact.last("slip") > 0.0, "{case}: slip");
        let start = at(&contact, "force_z", 0.0);
        close(&format!("{case}: support at the start"), at(&reactions, "force_z", 0.0), -start, 1e-6 * start);
        if case == "case" {
            // The drag is at tan = 0.5 to x, and so is the friction, nearly.
            assert!((y / x - 0.5).abs() < 0.05, "{y} / {x}");
        } else {
            assert!(y.abs() < 1e-6 * z, "{case}: {y}");
        }
    }
}

/// One cell whose left side is accelerated from rest. The support reaction is m a / 4 immediately,
/// because the right side accelerates backwards with a / 2 (consistent mass m / 6 of 2, 1, 1, 2).
#[test]
fn the_support_feels_the_inertia_at_the_start() {
    let results = run("
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [1, 1], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0 } }
    density: 1000
boundary:
  shaker: { on: block.left, displacement: { x: \"5 * t^2\", y: 0 } }
time: { end: 1.0e-3, step: 1.0e-3 }
");
    close("reaction", at(&results.table("reactions.csv"), "force_x", 0.0), 2500.0, 1e-6);
}

/// The reaction of a support has the force and the moment that balance the weight of the block on it.
#[test]
fn reactions_balance_forces_and_moments() {
    let case = |dimension: usize, shape: &str, gravity: &str| {
        format!(
            "dimension: {dimension}
bodies:
  block:
    mesh: {{ box: {{ {shape} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e13, poisson_ratio: 0.3 }} }}
    density: 2000
boundary:
  floor: {{ on: block.bottom, displacement: {{ x: 0, y: 0{} }} }}
  weight: {{ on: block, gravity: [{gravity}] }}
time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}
output: {{ fields: {{ every: 100 }} }}
",
            if dimension == 3 { ", z: 0" } else { "" }
        )
    };
    for ranks in [1, 3] {
        let plane = Results::of(&case(2, "min: [1, 2], max: [1.4, 2.2], cells: [4, 3]", "3, -10"), ranks);
        let of = |column: &str| plane.table("reactions.csv").last(column);
        // Mass 160 kg/m at (1.2, 2.1), weight (480, -1600) N/m.
        for (column, expected) in [("force_x", -480.0), ("force_y", 1600.0), ("moment_z", 2928.0)] {
            assert!(
                (of(column) / expected - 1.0).abs() < 1e-6,
                "{column}: {}, expected {expected}",
                of(column)
            );
        }
        let space = "min: [1, 2, 3], max: [1.4, 2.2, 3.5], cells: [2, 2, 2]";
        let space = Results::of(&case(3, space, "3, -10, 7"), ranks);
        let of = |column: &str| space.table("reactions.csv").last(column);
        // Mass 80 kg at c = (1.2, 2.1, 3.25), weight (240, -800, 560) N, moment -c x weight.
        let expected = [
            ("force_x", -240.0),
            ("force_y", 800.0),
            ("force_z", -560.0),
            ("moment_x", -(2.1 * 560.0 + 3.25 * 800.0)),
            ("moment_y", -(3.25 * 240.0 - 1.2 * 560.0)),
            ("moment_z", 1.2 * 800.0 + 2.1 * 240.0),
        ];
        for (column, expected) in expected {
            assert!(
                (of(column) / expected - 1.0).abs() < 1e-6,
                "{column}: {}, expected {expected}",
                of(column)
            );
        }
    }
}

/// A pin with an overlap has Lame's pressure without friction. Pushed out, it loses force like long rods
/// whose transverse strain changes the pressure. At the ends of the contact the pressure is higher, which
/// does not depend on the engaged length, so that the lost force is compared.
#[test]
fn a_pressed_pin_is_pushed_out() {
    let slice = 4.0_f64.to_radians();
    let smooth =
        [("coefficient: 0.2", "coefficient: 0"), ("push: 4", "push: 0"), ("increments: 40", "increments: 1")];
    let contact = run(&shipped("press-fit/case.yml", &smooth)).table("contact.csv");
    close("pressure", at(&contact, "force_n", 1.0) / at(&contact, "area", 1.0) / 7.5e5, 1.0, 1e-2);
    let results = run(&shipped("press-fit/case.yml", &[("increments: 40", "increments: 20")]));
    let reactions = results.table("reactions.csv").only("boundary", "push");
    let force = |time: f64| at(&reactions, "force_z", time) / (0.2 * 7.5e5 * slice);
    let of_rods = |engaged: f64| {
        let k = 0.3 * 0.2;
        let lost = 1.0 - (-k * engaged).exp();
        lost / k / (1.0 - 0.75 * lost)
    };
    close("lost force", (force(0.15) - force(1.0)) / (of_rods(7.4) - of_rods(4.0)), 1.0, 1e-2);
    let ends = force(0.15) - of_rods(7.4);
    assert!(ends > 0.0 && ends < 0.3, "{ends}");
}
