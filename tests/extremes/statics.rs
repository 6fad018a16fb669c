//! Static rows with a closed form: stiffness, compliance, Poisson's ratio, snap-through, remote
//! positions.

use crate::row::{Results, Row, Verdict};
use crate::scenes::{Bar, Solid, pair};

fn force(results: &[Results]) -> f64 {
    results[0].contact("sole").last("force_n")
}

fn bar(group: &'static str, name: String, bar: Bar, tolerance: f64) -> Row {
    let expected = bar.force();
    Row::new(group, name, vec![bar.case()], move |results| {
        Verdict::close(force(results), expected, tolerance)
    })
}

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    stiffness(&mut rows);
    poisson(&mut rows);
    snap(&mut rows);
    far(&mut rows);
    rows
}

fn stiffness(rows: &mut Vec<Row>) {
    for law in ["neo_hookean", "saint_venant_kirchhoff"] {
        for young in [1e2, 1e4, 1e6, 1e8, 1e10, 1e12] {
            let solid = Solid { law, young, poisson: 0.3 };
            let scene = Bar { solid, compliance: 1e-3 / young, ..Bar::BASE };
            let row = bar("stiffness [Pa]", format!("{young:.0e}, {law}"), scene, 1e-9);
            rows.push(if young == 1e2 || young == 1e12 { row.quick() } else { row });
        }
    }
    for ratio in [1.0, 1e3, 1e6, 1e9] {
        for (name, upper, lower) in [("harder on softer", ratio, 1.0), ("softer on harder", 1.0, ratio)] {
            let (case, pressure) = pair(1e3 * upper, 1e3 * lower, 1e-6, 0.02);
            let row = Row::new("pair ratio", format!("{ratio:.0e}, {name}"), vec![case], move |results| {
                Verdict::close(force(results), pressure, 1e-7)
            });
            rows.push(if ratio == 1e9 { row.quick() } else { row });
        }
    }
    for exponent in 6..=16 {
        let compliance = format!("1e-{exponent}").parse().unwrap_or(f64::NAN);
        let row = bar("compliance [m/Pa]", format!("1e-{exponent}"), Bar { compliance, ..Bar::BASE }, 1e-9);
        rows.push(if exponent % 10 == 6 { row.quick() } else { row });
    }
}

fn poisson(rows: &mut Vec<Row>) {
    for locking in ["none", "selective_reduced"] {
        for poisson in [0.45, 0.49, 0.499, 0.4999] {
            let solid = Solid { poisson, ..Solid::RUBBER };
            let scene = Bar { solid, locking, ..Bar::BASE };
            let row = bar("Poisson's ratio", format!("{poisson}, locking {locking}"), scene, 1e-9);
            rows.push(if poisson == 0.4999 { row.quick() } else { row });
            rows.push(free_sides(poisson, locking));
        }
    }
}

/// Pressed between a clamp and a rough plane with free sides, compared with biquadratic elements
/// with the locking treatment.
fn free_sides(poisson: f64, locking: &'static str) -> Row {
    let case = |element: &str, locking: &str| {
        format!(
            "title: Pad pressed\ndimension: 2\n\
             bodies:\n  pad:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [12, 6], element: {element} }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: {poisson} }} }}\n    locking: {locking}\n\
             obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  sole: {{ contactor: pad.bottom, target: floor, normal: {{ penalty: {{ compliance: 1e-10 }} }}, friction: none }}\n\
             boundary:\n  clamp: {{ on: pad.top, displacement: {{ x: 0, y: \"-0.02 * t\" }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}\n"
        )
    };
    let cases = vec![case("quad4", locking), case("quad9", "selective_reduced")];
    let name = format!("{poisson}, free sides, locking {locking}");
    Row::new("Poisson's ratio", name, cases, move |results| {
        let [found, reference] =
            [&results[0], &results[1]].map(|result| result.contact("sole").last("force_n"));
        match locking {
            "none" => Verdict::says(
                format!("{:.3} of the reference", found / reference),
                "no softer than the reference: it locks",
                found > reference,
            ),
            _ => Verdict::close(found, reference, 0.05),
        }
    })
}

fn snap(rows: &mut Vec<Row>) {
    let solid = Solid { law: "saint_venant_kirchhoff", young: 5e6, poisson: 0.3 };
    // One row of cells: the strain stays uniform, also where the stiffness has gone.
    for press in [0.4, 0.4226, 0.43, 0.5, 0.7] {
        let scene = Bar { solid, press, cells: 1, increments: 16, compliance: 1e-12, ..Bar::BASE };
        let row = bar("snap-through", format!("pressed to F = {}", 1.0 - press), scene, 1e-6);
        rows.push(if press == 0.5 { row.quick() } else { row });
    }
    // Four rows of cells: beyond the limit the strain gathers in one of them, which has no closed form.
    let scene = Bar { solid, press: 0.6, increments: 16, compliance: 1e-12, ..Bar::BASE };
    let most = solid.confined() / 27f64.sqrt();
    let bounded = move |results: &[Results]| {
        let found = force(results);
        Verdict::says(format!("{:.4} of the limit", found / most), "at most the limit", found <= most)
    };
    let row = Row::new("snap-through", "pressed to F = 0.4, four rows", vec![scene.case()], bounded);
    rows.push(row.or_refused(&[5, 6]));
    // No stress beyond (lambda + 2 mu) / sqrt(27) can be carried: there is no equilibrium.
    for part in [0.9, 0.999, 1.001, 1.5] {
        let load = part * most;
        let clamp = "top: { on: bar.top, displacement: { y: \"-2e-2 * t\" } }";
        let text = scene.case();
        assert!(text.contains(clamp) || scene.press != 0.02);
        let prescribed = format!("displacement: {{ y: \"-{:e} * t\" }}", scene.press);
        let case = text.replace(&prescribed, &format!("traction: {{ y: \"-{load:e} * t\" }}"));
        let name = format!("traction of {part} of the limit");
        rows.push(match part < 1.0 {
            true => Row::new("snap-through", name, vec![case], move |results| {
                Verdict::close(force(results), load, 1e-8)
            }),
            false => {
                let row = Row::refused("snap-through", name, case, &[5, 6], "");
                if part == 1.5 { row.quick() } else { row }
            }
        });
    }
}

/// A coordinate of 1e6 m has a resolution of 1.2e-10 m, and no depth is more accurate.
fn far(rows: &mut Vec<Row>) {
    for (size, away) in [(1.0, 1e3), (1.0, 1e6), (0.01, 1e6), (1.0, 1e9)] {
        let origin = [away + 0.01 * size, -away];
        let scene = Bar { origin, size, press: 0.02 * size, compliance: 1e-9 * size, ..Bar::BASE };
        let depth = scene.force() / size * scene.compliance;
        let known = away * f64::EPSILON / depth.min(scene.press);
        let tolerance = (4.0 * known).max(1e-9);
        let row = bar("far away [m]", format!("{away:.0e}, size {size}"), scene, tolerance);
        rows.push(if size == 0.01 { row.quick() } else { row });
    }
}
