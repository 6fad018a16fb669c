//! Fields along segments: a linear displacement and its stress are exact, on any number of ranks and after
//! a restart.

mod common;

use common::{Folder, Results, assert_says, near, run};
use nalgebra::{Matrix3, matrix};

/// A body with a linear displacement that grows with time, and two segments through it.
fn stretched(element: &str) -> String {
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0, 0], max: [1, 0.5, 0.4], cells: [3, 2, 2], element: {element} }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
boundary:
  all: {{ on: block, displacement: {{ x: 't * (0.1 * x + 0.02 * y)', y: '-0.03 * t * y', z: '0.05 * t * x' }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 4 }} }} }}
output:
  lines:
    cut: {{ from: [0, 0, 0], to: [1, 0.5, 0.4], points: 8 }}
    edge: {{ from: [0, 0.5, 0.4], to: [1, 0.5, 0.4], points: 3, on: block }}
    spot: {{ from: [0.35, 0.21, 0.13] }}
  checkpoint: {{ every: 2 }}
"
    )
}

/// A linear displacement is reproduced at all points, with the same text on 1 to 4 ranks.
#[test]
fn a_linear_displacement_is_exact_along_lines() {
    for element in ["hex8", "tet10", "wedge6", "pyramid5"] {
        let results = Results::of(&stretched(element), 1);
        let lines = results.table("lines.csv");
        let cut = lines.only("line", "cut");
        let [time, x, y] = ["time", "reference_x", "reference_y"].map(|name| cut.numbers(name));
        assert_eq!(time.len(), 5 * 8);
        let [point, distance] = ["point", "distance"].map(|name| cut.numbers(name));
        for row in 0..time.len() {
            let part = (point[row] - 1.0) / 7.0;
            assert!((x[row] - part).abs() < 1e-15 && (y[row] - 0.5 * part).abs() < 1e-15);
            assert!((distance[row] - part * 1.41_f64.sqrt()).abs() < 1e-14);
            let expected = [0.1 * x[row] + 0.02 * y[row], -0.03 * y[row], 0.05 * x[row]];
            for (axis, rate) in ["x", "y", "z"].into_iter().zip(expected) {
                let u = cut.numbers(&format!("u_{axis}"))[row];
                assert!((u - rate * time[row]).abs() < 1e-15, "u_{axis} of {element}: {u}");
            }
        }
        assert_eq!(lines.only("line", "edge").numbers("time").len(), 5 * 3);
        let spot = lines.only("line", "spot");
        assert_eq!(spot.numbers("time").len(), 5);
        assert!((spot.last("u_x") - 0.0392).abs() < 1e-15 && spot.last("distance") == 0.0, "{element}");
        let text = std::fs::read_to_string(results.0.join("out/lines.csv")).expect("a table");
        for ranks in [2, 3, 4] {
            let other = Results::of(&stretched(element), ranks);
            let other = std::fs::read_to_string(other.0.join("out/lines.csv")).expect("a table");
            assert_eq!(text, other, "{element} on {ranks} ranks");
        }
    }
}

/// Cauchy stress of the Saint Venant-Kirchhoff law (2.18) in the body of [`stretched`] at a time \[Pa\].
fn stress_at(time: f64, young: f64) -> Matrix3<f64> {
    let gradient = matrix![0.1, 0.02, 0.0; 0.0, -0.03, 0.0; 0.05, 0.0, 0.0] * time;
    let (mu, lambda) = (young / 2.6, young * 0.3 / (1.3 * 0.4));
    let f = Matrix3::identity() + gradient;
    let strain = (f.transpose() * f - Matrix3::identity()) * 0.5;
    let second_piola = Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * mu);
    f * second_piola * f.transpose() / f.determinant()
}

/// The stress of a linear displacement is reproduced in each of two materials, also next to and on their
/// interface. A segment that does not ask for stresses has empty fields.
#[test]
fn stresses_along_lines_are_those_of_the_material() {
    let law = |young: &str| {
        format!("material: {{ saint_venant_kirchhoff: {{ young_modulus: {young}, poisson_ratio: 0.3 }} }}")
    };
    let regions = format!(
        "sets: {{ hard: {{ of: elements, where: 'x > 0.6' }} }}\n    regions: {{ hard: {{ {} }} }}\n    {}",
        law("5.0e6"),
        law("1.0e6")
    );
    for element in ["hex8", "hex20", "tet10", "pyramid5"] {
        let text = stretched(element)
            .replace(&law("1.0e6"), &regions)
            .replace("points: 8", "points: 8, stresses: true");
        assert!(text.contains("hard"), "{text}");
        for ranks in 1..=4 {
            let lines = Results::of(&text, ranks).table("lines.csv");
            let cut = lines.only("line", "cut");
            let [time, x] = ["time", "reference_x"].map(|name| cut.numbers(name));
            let names = [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("yz", 1, 2), ("xz", 0, 2)];
            for (name, i, j) in names {
                let young = |x: f64| if x > 0.667 { 5.0e6 } else { 1.0e6 };
                let known = time.iter().zip(&x).map(|(&time, &x)| stress_at(time, young(x))[(i, j)]);
                let known: Vec<f64> = known.collect();
                near(&cut.numbers(&format!("stress_{name}")), &known, 1e-11);
            }
            let von_mises = |time: f64| {
                let stress = stress_at(time, 1.0e6);
                let deviator = stress - Matrix3::identity() * (stress.trace() / 3.0);
                (1.5 * deviator.norm_squared()).sqrt()
            };
            near(&[cut.numbers("von_mises")[4 * 8]], &[von_mises(1.0)], 1e-11);
            assert!(lines.only("line", "edge").texts("stress_xx").iter().all(|text| text.is_empty()));
        }
    }
}

/// A restart continues the table.
#[test]
fn lines_continue_after_a_restart() {
    let results = Results::of(&stretched("hex8"), 1);
    let whole = std::fs::read_to_string(results.0.join("out/lines.csv")).expect("a table");
    let restart = "--restart=out/checkpoints/step-000002.ckpt";
    run(2, &["case.yml", "-q", restart, "-o", "out"], &results.0).success();
    let resumed = std::fs::read_to_string(results.0.join("out/lines.csv")).expect("a table");
    assert_eq!(whole, resumed);
}

/// Mistakes are reported with line, cause and cure.
#[test]
fn wrong_lines_are_refused() {
    let good = stretched("hex8");
    let rows = [
        (
            good.replace("to: [1, 0.5, 0.4], points: 8", "to: [2, 0.5, 0.4], points: 5"),
            "2 of 5 points are in no element: 4 at [1.5, 0.375",
        ),
        (good.replace("points: 8", "points: 1"), "'points' must be from 2 to 10000"),
        (good.replace("to: [1, 0.5, 0.4], points: 8", "to: [0, 0, 0], points: 8"), "the same point"),
        (good.replace("from: [0, 0, 0]", "from: [0, 0]"), "3 entries"),
        (good.replace("points: 3, on: block", "points: 3, on: block.top"), "not in one of its sets"),
        (good.replace("points: 3, on: block", "points: 3, on: blok"), "blok"),
        (good.replace("points: 8", "number: 8"), "number"),
        (good.replace(", points: 8", ""), "number of points of the line is missing"),
        (good.replace("to: [1, 0.5, 0.4], points: 8", "points: 8"), "last point of the line is missing"),
    ];
    for (text, words) in rows {
        let folder = Folder::new("lines");
        folder.write("case.yml", &text);
        let output = run(0, &["case.yml", "-q"], &folder);
        assert_eq!(output.code, Some(3), "{words}: {}", output.text());
        assert_says(&output.stderr, &["case.yml:", words]);
    }
}
