//! Impact at reduced size: conservation of energy and momentum, the plateau of the force, the guard
//! that ends a run and the warning before it.

mod common;

use common::{Folder, Results, Table, shipped};

impl Results {
    /// Largest unexplained energy, divided by the largest energy.
    fn unexplained(&self) -> f64 {
        let ledger = self.table("energy.csv");
        let largest = |column| ledger.numbers(column).into_iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        largest("numerical") / largest("total").max(largest("kinetic"))
    }

    /// Largest change of a component of the linear or the angular momentum.
    fn lost_momentum(&self) -> f64 {
        let momentum = self.table("momentum.csv");
        let columns: Vec<&str> = momentum
            .names()
            .filter(|name| name.starts_with("linear") || name.starts_with("angular"))
            .filter_map(|name| name.split(' ').next())
            .collect();
        assert!(columns.len() >= 3);
        let change = |column: &&str| {
            let values = momentum.numbers(column);
            values.iter().fold(0.0_f64, |most, p| most.max((p - values[0]).abs()))
        };
        columns.iter().map(change).fold(0.0, f64::max)
    }

    /// Relative root mean square deviation of the force from its plateau `force`.
    fn ripple(&self, force: f64) -> f64 {
        let contact = self.table("contact.csv");
        let rows = contact.numbers("time").into_iter().zip(contact.numbers("force_n"));
        let plateau: Vec<f64> = rows.filter(|row| row.0 > 0.55 && row.0 < 1.1).map(|row| row.1).collect();
        assert!(plateau.len() > 20);
        (plateau.iter().map(|f| (f / force - 1.0).powi(2)).sum::<f64>() / plateau.len() as f64).sqrt()
    }
}

/// For every law, step and penalty the energy is conserved, the force is on its plateau, and the
/// velocity is fully recovered.
#[test]
fn the_bar_keeps_its_energy_and_its_force_is_smooth() {
    for (case, force, speed, kept) in [
        ("conserving", 300.0, 10.0, 1e-8),
        ("conserving-saint-venant-kirchhoff", 9.0, 0.3, 1e-8),
        ("conserving-neo-hookean", 9.0, 0.3, 1e-6),
    ] {
        for (step, compliance) in [("1.0e-2", "1.0e-5"), ("5.0e-3", "1.0e-4"), ("2.5e-3", "1.0e-4")] {
            // 50 elements: 1.5, 0.75 and 0.375 h / c.
            let changes = [("cells: [1, 100]", "cells: [1, 50]"), ("2.5e-3", step), ("1.0e-5", compliance)];
            let bar = Results::of(&shipped(&format!("bar-impact/{case}.yml"), &changes), 1);
            let (drift, ripple) = (bar.unexplained(), bar.ripple(force));
            assert!(drift < kept, "{case}, {step}, {compliance}: {drift}");
            // The finite laws have their own plateau, within a hundredth of the linear one.
            assert!(ripple < 0.01, "{case}, {step}, {compliance}: {ripple}");
            let momentum = bar.table("momentum.csv");
            assert!((momentum.last("linear_y") / (10.0 * speed) - 1.0).abs() < 0.05, "{case}: it flies back");
        }
    }
}

/// Force over `E` that stops a bar with Saint Venant-Kirchhoff's law at `v0 / c = v`. The law
/// softens, so the wave is a rarefaction fan with `v = int sqrt((3 F^2 - 1) / 2) dF` from the
/// stretch behind it to 1.
fn fan(v: f64) -> f64 {
    let (mut stretch, mut sum, step) = (1.0, 0.0, 1e-6);
    while sum < v {
        sum += step * ((3.0 * f64::powi(stretch - 0.5 * step, 2) - 1.0) / 2.0).sqrt();
        stretch -= step;
    }
    0.5 * (stretch - stretch.powi(3))
}

/// Force over `E` that stops a bar with the neo-Hookean law, which stiffens. The wave is a shock:
/// `v^2 / (1 - F) = (1 / F - F) / 2`.
fn shock(v: f64) -> f64 {
    let (mut low, mut high) = (0.05, 1.0 - 1e-9);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if v * v / (1.0 - middle) < 0.5 * (1.0 / middle - middle) { low = middle } else { high = middle }
    }
    0.5 * (1.0 / low - low)
}

/// At strains of a tenth and a fifth, where the laws are strongly nonlinear, the energy is
/// conserved as well. The plateau is that of the wave of each law.
#[test]
fn large_strains_keep_the_energy_and_the_plateau() {
    for (case, strain, force, kept) in [
        ("conserving-saint-venant-kirchhoff", 0.1, fan(0.1), 1e-8),
        ("conserving-saint-venant-kirchhoff", 0.2, fan(0.2), 1e-8),
        ("conserving-neo-hookean", 0.1, shock(0.1), 1e-6),
        ("conserving-neo-hookean", 0.2, shock(0.2), 1e-6),
    ] {
        let (speed, gap) = (30.0 * strain, 15.0 * strain);
        let box_of = format!("min: [0, {gap}], max: [1, {}], cells: [1, 50]", gap + 10.0);
        let velocity = format!("[0, -{speed}]");
        let changes = [
            ("min: [0, 0.15], max: [1, 10.15], cells: [1, 100]", &box_of[..]),
            ("[0, -0.3]", &velocity),
            ("step: 2.5e-3", "step: 5.0e-3"),
            ("end: 1.5", "end: 1.1"),
            ("    tip: { at: [0, 0.15] }\n", ""),
            ("    end: { at: [0, 10.15] }", "    tip: { at: [0, 5] }"),
        ];
        let bar = Results::of(&shipped(&format!("bar-impact/{case}.yml"), &changes), 1);
        let (drift, ripple) = (bar.unexplained(), bar.ripple(900.0 * force));
        assert!(drift < kept && ripple < 0.01, "{case} at {strain}: {drift} {ripple}");
    }
}

/// Energy is conserved except for the frictional heat, and so are both momenta: for every facet
/// that the points touch, over edges and corners, opening and closing within a step, with and
/// without friction, in 2D and 3D.
#[test]
fn collisions_keep_energy_and_momentum() {
    let coarse = [("step: 5.0e-5", "step: 1.0e-4")];
    let solid = [("step: 1.0e-4", "step: 2.0e-4")];
    for (case, changes, rubs) in [
        ("touching", &[][..], true),
        (
            "touching",
            &[(
                "friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 5.0e9 } } }",
                "friction: none",
            )][..],
            false,
        ),
        ("case", &coarse[..], false),
        ("friction", &coarse[..], true),
        ("solid", &solid[..], true),
    ] {
        let run = Results::of(&shipped(&format!("collision/{case}.yml"), changes), 1);
        let ledger = run.table("energy.csv");
        assert!(run.unexplained() < 1e-10, "{case}: {}", run.unexplained());
        let heat = ledger.numbers("friction_dissipated");
        assert!(
            heat.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9) && (heat[heat.len() - 1] > 0.05) == rubs
        );
        assert!(run.lost_momentum() < 1e-10 * 5.0, "{case}: {}", run.lost_momentum());
    }
}

/// The motion of massless nodes does not decrease with the step. The steps are solved nevertheless,
/// hardly one is cut, and energy and momenta are conserved.
#[test]
fn discs_without_mass_find_their_balance() {
    let text = shipped("collision/case.yml", &[("step: 5.0e-5", "step: 1.0e-4")]);
    let text = text.replace("cells: [12, 12]", "cells: [9, 9]").replace("cells: [14, 14]", "cells: [16, 16]");
    let (left, right) = text.split_at(text.find("  right:").expect("a disc"));
    let softer = right.replacen("young_modulus: 5.0e6", "young_modulus: 1.5e6", 1);
    let text = format!("{left}{softer}").replace("density: 1000", "density: 1000\n    mass: redistributed");
    let run = Results::of(&text, 1);
    let steps = run.table("energy.csv").numbers("time").len();
    assert!(steps <= 123, "{steps} steps");
    assert!(run.unexplained() < 1e-10 && run.lost_momentum() < 5e-10, "{}", run.unexplained());
}

/// If an error in time is requested, the tip of a bar that strikes a wall is massless unless the
/// case sets its mass. The error is below the requested one.
#[test]
fn an_error_in_time_takes_the_mass_off_the_tip() {
    let bar = |mass: &str| {
        let changes =
            [("    mass: redistributed", mass), ("end: 1.5", "end: 0.6"), ("guard: { energy: 1.0e-6 }", "")];
        let text = shipped("bar-impact/conserving.yml", &changes);
        Results::of(&(text + "accuracy: { time: 1e-2, penetration: none }\n"), 1).record()
    };
    let [auto, consistent] = ["    mass: auto", "    mass: consistent"].map(bar);
    assert_eq!(auto["accuracy"]["mass_redistributed"][0], "bar");
    assert!(consistent["accuracy"].get("mass_redistributed").is_none());
    let warned =
        |record: &serde_json::Value| record["warnings"].to_string().contains("oscillate on the penalty");
    assert!(!warned(&auto) && warned(&consistent));
    assert!(auto["accuracy"]["achieved"]["time"].as_f64().is_some_and(|error| error < 1e-2));
}

/// The conserving scheme only reports the penetration and slip that `accuracy` requests, because
/// its energy depends on its contact laws, and it announces this before the run. It conserves
/// energy in steps of any length.
#[test]
fn what_is_asked_of_the_laws_is_told() {
    let friction = |accuracy: &str| {
        let changes = [("end: 0.012", "end: 0.001"), ("step: 5.0e-5", "step: 1.0e-4")];
        Results::of(&(shipped("collision/friction.yml", &changes) + &format!("accuracy: {accuracy}\n")), 1)
    };
    let record = friction("balanced").record();
    let [asked, achieved] = ["asked", "achieved"].map(|which| record["accuracy"][which].clone());
    for part in ["penetration [m]", "slip"] {
        let [asked, achieved] = [&asked, &achieved].map(|errors| errors[part].as_f64().unwrap_or(0.0));
        assert!(asked > 0.0 && achieved > asked, "{part}: {achieved:e} of {asked:e}");
    }
    let told = record["warnings"].to_string();
    assert!(told.contains("accuracy.penetration and accuracy.slip"), "{told}");
    assert!(told.contains("not reached: penetration"), "{told}");
    let equal = friction("{ energy: 1e-3, time: none, penetration: none, slip: none }");
    let record = equal.record()["accuracy"].clone();
    assert!(record["achieved"]["energy"].as_f64().is_some_and(|energy| energy < 1e-10), "{record}");
    assert_eq!(equal.table("energy.csv").numbers("time").len(), 11);
    assert!(!equal.record()["warnings"].to_string().contains("does not modify the contact laws"));
}

/// Tumbling cubes collide with faces, edges and corners. Both momenta are conserved to 1e-10 of
/// their size, with and without friction.
#[test]
fn tumbling_cubes_keep_their_momentum() {
    let friction = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e9 } } }";
    for (changes, rubs) in [(&[][..], true), (&[(friction, "none")][..], false)] {
        let cubes = Results::of(&shipped("collision/cubes.yml", changes), 1);
        assert!(cubes.unexplained() < 1e-12, "{}", cubes.unexplained());
        assert_eq!(cubes.table("energy.csv").last("friction_dissipated") > 1.0, rubs);
        let pressed = cubes.table("contact.csv").numbers("force_n");
        assert!(
            pressed.iter().fold(0.0_f64, |most, f| most.max(*f)) > 500.0 && pressed[pressed.len() - 1] == 0.0
        );
        let momentum = cubes.table("momentum.csv");
        for what in ["linear", "angular"] {
            let parts = ["x", "y", "z"].map(|axis| momentum.numbers(&format!("{what}_{axis}")));
            let size = parts.iter().map(|part| part[0] * part[0]).sum::<f64>().sqrt();
            let drift = |part: &Vec<f64>| part.iter().fold(0.0_f64, |most, p| most.max((p - part[0]).abs()));
            let drift = parts.iter().map(drift).fold(0.0, f64::max);
            assert!(size > 0.1 && drift < 1e-10 * size, "{what}, friction {rubs}: {drift} of {size}");
        }
    }
}

/// With mass at its tip the bar also conserves its energy, but its force rings.
#[test]
fn mass_at_the_tip_rings() {
    let changes = [("cells: [1, 100]", "cells: [1, 50]"), ("mass: redistributed", "mass: consistent")];
    let bar = Results::of(&shipped("bar-impact/conserving.yml", &changes), 1);
    assert!(bar.unexplained() < 1e-8 && bar.ripple(300.0) > 0.05, "{}", bar.ripple(300.0));
}

/// Energy is conserved over several bounces.
#[test]
fn ten_bounces_keep_the_energy() {
    let coarse = [("cells: [1, 50]", "cells: [1, 20]"), ("step: 1.0e-2", "step: 2.5e-2")];
    let bar = Results::of(&shipped("bar-impact/ten-bounces.yml", &coarse), 1);
    assert!(bar.unexplained() < 1e-6, "{}", bar.unexplained());
    let contact = bar.table("contact.csv").numbers("force_n");
    let touches: Vec<usize> = (0..contact.len()).filter(|&i| contact[i] > 0.0).collect();
    let bounces = 1 + touches.windows(2).filter(|pair| pair[1] - pair[0] > 40).count();
    assert!(bounces >= 10, "{bounces}");
}

/// A 3D bar, and a bar that hits another bar: energy and momentum are conserved, and the force is
/// on its plateau.
#[test]
fn solid_and_deformable_targets_keep_the_energy() {
    let solid = [
        ("dimension: 2", "dimension: 3"),
        (
            "min: [0, 5], max: [1, 15], cells: [1, 100], element: quad4",
            "min: [0, 0, 5], max: [1, 1, 15], cells: [1, 1, 60], element: hex8",
        ),
        ("[0, -10]", "[0, 0, -10]"),
        ("point: [0, 0], normal: [0, 1]", "point: [0, 0, 0], normal: [0, 0, 1]"),
        ("tip: { at: [0, 5] }", "tip: { at: [0, 0, 5] }"),
        ("end: { at: [0, 15] }", "end: { at: [0, 0, 15] }"),
        ("step: 2.5e-3", "step: 1.0e-2"),
    ];
    let bar = Results::of(&shipped("bar-impact/conserving.yml", &solid), 1);
    assert!(
        bar.unexplained() < 1e-8 && bar.ripple(300.0) < 0.01,
        "{} {}",
        bar.unexplained(),
        bar.ripple(300.0)
    );
    let coarse = [("cells: [1, 100]", "cells: [1, 50]"), ("step: 2.5e-3", "step: 5.0e-3")];
    let bars = Results::of(&shipped("bar-impact/two-bars.yml", &coarse), 1);
    assert!(
        bars.unexplained() < 1e-8 && bars.ripple(150.0) < 0.01,
        "{} {}",
        bars.unexplained(),
        bars.ripple(150.0)
    );
    let momentum = bars.table("momentum.csv").numbers("linear_y");
    assert!(momentum.iter().all(|p| (p + 100.0).abs() < 1e-8), "{momentum:?}");
    let probes = bars.table("probes.csv");
    assert!((probes.last("second.u_y") + 10.0 * (1.5 - 5.0 / 6.0)).abs() < 0.1, "the second bar flies on");
}

/// The bar with a massless tip gives the same results on several ranks, some of which own no part
/// of the tip.
#[test]
fn redistributed_mass_on_2_3_ranks() {
    let coarse =
        [("cells: [1, 100]", "cells: [1, 30]"), ("step: 2.5e-3", "step: 1.0e-2"), ("end: 1.5", "end: 0.8")];
    let text = shipped("bar-impact/conserving-neo-hookean.yml", &coarse);
    let alone = Results::of(&text, 1).table("probes.csv").numbers("tip.u_y");
    for ranks in [2, 3] {
        let together = Results::of(&text, ranks).table("probes.csv").numbers("tip.u_y");
        let apart = alone.iter().zip(&together).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(alone.len() == together.len() && apart < 1e-9, "{ranks} ranks: {apart}");
    }
}

/// Mass redistribution away from the contact nodes preserves momentum and energy of any rigid
/// motion, for every element.
#[test]
fn redistributed_mass_moves_like_the_body() {
    for (dimension, element) in [
        (2, "tri3"),
        (2, "tri6"),
        (2, "quad4"),
        (2, "quad8"),
        (2, "quad9"),
        (3, "tet4"),
        (3, "tet10"),
        (3, "hex8"),
        (3, "hex20"),
        (3, "hex27"),
    ] {
        let (zeros, ones, cells, up, speed) = match dimension {
            2 => ("[0, 0]", "[1, 0.8]", "[6, 6]", "[0, 1]", "[\"1 - 2 * y\", \"0.5 + 2 * x\"]"),
            _ => (
                "[0, 0, 0]",
                "[1, 0.8, 0.9]",
                "[5, 5, 5]",
                "[0, 0, 1]",
                "[\"1 - 2 * y\", \"2 * x - z\", \"y\"]",
            ),
        };
        let below = zeros.replacen("[0", "[-1", 1).replace(", 0", ", -1");
        let case = |mass: &str| {
            format!(
                "title: A\ndimension: {dimension}\nbodies:\n  box:\n    mesh: {{ box: {{ min: {zeros}, max: {ones}, cells: {cells}, element: {element} }} }}\n    \
                 material: {{ neo_hookean: {{ young_modulus: 1.0e+3, poisson_ratio: 0.3 }} }}\n    density: 2\n    mass: {mass}\n    initial_velocity: {speed}\n\
                 obstacles:\n  floor: {{ plane: {{ point: {below}, normal: {up} }} }}\n\
                 contact:\n  foot: {{ contactor: box.bottom, target: floor, normal: {{ penalty: {{ compliance: 1.0e-5 }} }}, friction: none }}\n\
                 time: {{ end: 1.0e-4, step: 1.0e-4, scheme: conserving }}\n"
            )
        };
        let [moved, still] = ["redistributed", "consistent"].map(|mass| Results::of(&case(mass), 1));
        let first = |results: &Results, table: &str, column: &str| results.table(table).numbers(column)[0];
        let mut columns = vec![
            ("energy.csv", "kinetic"),
            ("momentum.csv", "linear_x"),
            ("momentum.csv", "linear_y"),
            ("momentum.csv", "angular_z"),
        ];
        if dimension == 3 {
            columns.extend([
                ("momentum.csv", "linear_z"),
                ("momentum.csv", "angular_x"),
                ("momentum.csv", "angular_y"),
            ]);
        }
        for (table, column) in columns {
            let [a, b] = [&moved, &still].map(|results| first(results, table, column));
            assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{element}: {column} {a} {b}");
        }
    }
}

/// A body with contact at all of its nodes has no other nodes for its mass. The error reports this.
#[test]
fn a_body_of_one_layer_can_not_redistribute_its_mass() {
    let thin =
        [("bar.bottom", "bar.left"), ("point: [0, 0], normal: [0, 1]", "point: [-1, 0], normal: [1, 0]")];
    let folder = Folder::new("impact");
    folder.write("case.yml", &shipped("bar-impact/conserving.yml", &thin));
    let output = common::run(1, &["case.yml", "--output", "out", "--quiet"], &folder);
    assert_eq!(output.code, Some(3), "{}", output.stderr);
    assert!(
        output.stderr.contains("bodies.bar: mass: redistributed") && output.stderr.contains("hint"),
        "{}",
        output.stderr
    );
}

/// The paper's Newmark scheme generates energy at the wall. A warning is printed first. The guard
/// then ends the run with exit code 6 and the growing term, and results are kept. The conserving
/// scheme passes a much tighter guard.
#[test]
fn the_guard_ends_a_run_that_makes_energy() {
    let guarded = [("output:", "guard: { energy: 0.05 }\noutput:")];
    let folder = Folder::new("impact");
    folder.write("case.yml", &shipped("bar-impact/newmark.yml", &guarded));
    let output = common::run(1, &["case.yml", "--output", "out"], &folder);
    assert_eq!(output.code, Some(6), "{}", output.stderr);
    assert!(
        output.stderr.contains("J was gained, ") && output.stderr.contains("energy grew by"),
        "{}",
        output.stderr
    );
    let said = format!("{}{}", output.stdout, output.stderr);
    assert!(said.contains("impact at t = 5.0") && said.contains("scheme: conserving"), "{said}");
    let record: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("out/run.json")).expect("a record"))
            .expect("JSON");
    assert_eq!((&record["exit_code"], &record["verdict"]), (&6.into(), &"failed".into()));
    let warnings = record["warnings"].as_array().expect("warnings");
    let seen = |text: &serde_json::Value| text.as_str().is_some_and(|text| text.contains("impact at t = "));
    assert!(warnings.iter().any(seen), "{warnings:?}");
    let ledger = Table::read(&folder.join("out/energy.csv"));
    assert!(
        ledger.last("numerical") < -0.05 * 500.0 && ledger.last("time") > 0.5,
        "the step that did it is written"
    );
    let calm = Results::of(&shipped("bar-impact/conserving.yml", &[("energy: 1.0e-6", "energy: 1.0e-9")]), 1);
    let warnings = calm.record()["warnings"].clone();
    assert!(!warnings.as_array().is_some_and(|texts| texts.iter().any(seen)), "{warnings}");
}
