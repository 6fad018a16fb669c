//! Several things wrong at once: each is reported, and nothing that only follows from another.

use super::super::Case;
use super::{message, with};

/// Lines and columns that a message points at.
fn places(message: &str) -> Vec<(usize, usize)> {
    let of_line = |line: &str| {
        let mut numbers = line.strip_prefix("case.yml:")?.split(':').map(|number| number.parse().ok());
        Some((numbers.next()??, numbers.next()??))
    };
    message.lines().filter_map(of_line).collect()
}

const CASE: &str = r#"dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: ["1 kg", 1], cells: [4, x] } }
    material: { neo_hokean: { young_modulus: "5 MPx", poisson_ratio: 0.6 } }
    densty: 1700
    initial_velocity: ["1/(", 0]
    colour: red
  other:
    mesh: { box: { min: [0, 0], max: [-1, 1], cells: [4, 4] } }
    material: { neo_hookean: { poisson_ratio: 0.3 } }
    density: 1
boundary:
  clamp: { on: blokc.top, displacement: { x: 0, y: "1 s" } }
  push: { on: block.lid, pressure: { tabel: [[0, 1]] } }
  hold: { on: block.top }
time: { end: -1, step: 1.0e-3, scheme: newmrk, cuts: -3 }
accuracy: fats
"#;

/// What can not be read, what is misspelt, what is missing and what the checks find come together, in the order of the file.
#[test]
fn all_faults_are_shown() {
    let message = message(CASE);
    let expected = [
        (4, 39),
        (4, 62),
        (5, 17),
        (5, 46),
        (5, 70),
        (6, 5),
        (7, 28),
        (8, 5),
        (10, 39),
        (11, 30),
        (14, 16),
        (14, 52),
        (15, 15),
        (15, 38),
        (16, 3),
        (17, 14),
        (17, 40),
        (17, 54),
        (18, 11),
    ];
    assert_eq!(places(&message), expected, "{message}");
    for words in
        ["did you mean 'density'", "'young_modulus' is missing", "hint: give it exactly one of displacement"]
    {
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// One fault is one error: nothing is said of what stands for the wrong value, whatever it would be compared with.
#[test]
fn one_fault_is_one_error() {
    for (from, to) in [
        ("max: [1, 1]", "max: [\"1 kg\", 1]"),
        ("min: [0, 0]", "min: [\"1 kg\", 0]"),
        ("dimension: 2", "dimension: two"),
        ("dimension: 2", "dimension: 5"),
        ("coulomb:", "coulumb:"),
        ("end: \"70 ms\"", "end: 5 MPa"),
        ("step: 5.0e-4", "step: soon"),
        ("contactor: block.bottom", "contactor: { a: block.bottom }"),
        ("material: { neo_hookean:", "material: { neo_hokean:"),
        ("\"1700 kg/m3\"", "\"1700 kg\""),
        ("density: \"1700 kg/m3\"", "densty: \"1700 kg/m3\""),
        ("cells: [4, 4]", "cells: 4"),
        ("equilibrium: { friction: false, increments: 4 }", "equilibrium: { friction: 2, increments: 4 }"),
        ("scheme: { newmark:", "scheme: { newmrk:"),
        ("scheme: { newmark: { beta: 0.25, gamma: 0.5 } }", "scheme: \"\\x01\""),
        ("\n  block:", "\n  \"blo\\nck\":"),
        ("petsc: {", "accuracy: 5\npetsc: {"),
        (
            "time: { end: \"70 ms\", step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }",
            "time: 5",
        ),
        ("time: { end: \"70 ms\", step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }", ""),
        ("scheme: { newmark: { beta: 0.25, gamma: 0.5 } }", "scheme: 5"),
        ("material: { neo_hookean: { young_modulus: \"5 MPa\", poisson_ratio: 0.45 } }", "material: 5"),
        ("    material: { neo_hookean: { young_modulus: \"5 MPa\", poisson_ratio: 0.45 } }\n", ""),
        ("floor: { plane: { point: [0, 0], normal: [0, 1] } }", "floor: 5"),
        ("    mesh: { box: { min: [0, 0], max: [1, 1], cells: [4, 4], element: quad4 } }\n", ""),
    ] {
        let message = message(&with(from, to));
        assert_eq!(places(&message).len(), 1, "{to}: {message}");
    }
}

/// A wrong dimension hides only what depends on it.
#[test]
fn other_faults_are_shown_beside_a_wrong_dimension() {
    for dimension in ["5", "two"] {
        let text = with("density: \"1700 kg/m3\"", "density: -1")
            .replace("at: [0, 0], on: block", "at: [0], on: blok");
        let message = message(&text.replace("dimension: 2", &format!("dimension: {dimension}")));
        for words in ["case.yml:2:12: ", "the density must be >= 0, found -1", "unknown body 'blok'"] {
            assert!(message.contains(words), "{words}: {message}");
        }
        assert_eq!(places(&message).len(), 3, "{message}");
    }
}

/// No more than twenty are shown, and it is said that there are more.
#[test]
fn there_is_an_end_to_them() {
    let probes: String = (0..50).map(|k| format!("    p{k}: {{ at: [0, x{k}] }}\n")).collect();
    let text = with("    corner: { at: [0, 0], on: block }\n", &probes);
    let message = Case::parse(&text, "case.yml").unwrap_err().message;
    assert_eq!(places(&message).len(), 20, "{message}");
    assert!(message.ends_with("further errors of case.yml are not shown"), "{message}");
}
