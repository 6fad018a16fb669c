//! Units and quantities.

use super::super::{Case, Units};
use super::with;
use crate::reader::unit::{Dimension, parse};

/// Units, prefixes and exponents come out in SI.
#[test]
fn units_convert_to_si() {
    for (text, si, exponents) in [
        ("5 MPa", 5e6, [1.0, -1.0, -2.0]),
        ("5MPa", 5e6, [1.0, -1.0, -2.0]),
        ("0.5 mm", 5e-4, [0.0, 1.0, 0.0]),
        ("1 m/s", 1.0, [0.0, 1.0, -1.0]),
        ("1e-10 m/Pa", 1e-10, [-1.0, 2.0, 2.0]),
        ("1700 kg/m3", 1700.0, [1.0, -3.0, 0.0]),
        ("1700 kg/m^3", 1700.0, [1.0, -3.0, 0.0]),
        ("1.7 t/m3", 1700.0, [1.0, -3.0, 0.0]),
        ("10 ms", 0.01, [0.0, 0.0, 1.0]),
        ("300 kN/m", 3e5, [1.0, 0.0, -2.0]),
        ("2 N*s/m", 2.0, [1.0, 0.0, -1.0]),
        ("2 N s/m", 2.0, [1.0, 0.0, -1.0]),
        ("3 µm", 3e-6, [0.0, 1.0, 0.0]),
        ("3 um", 3e-6, [0.0, 1.0, 0.0]),
        ("2 min", 120.0, [0.0, 0.0, 1.0]),
        ("9.81 m/s^2", 9.81, [0.0, 1.0, -2.0]),
        ("9.81 m s^-2", 9.81, [0.0, 1.0, -2.0]),
        ("50 Hz", 50.0, [0.0, 0.0, -1.0]),
        ("50 1/s", 50.0, [0.0, 0.0, -1.0]),
        ("50 /s", 50.0, [0.0, 0.0, -1.0]),
        ("1 bar", 1e5, [1.0, -1.0, -2.0]),
        ("1 psi", 6894.757293168, [1.0, -1.0, -2.0]),
        ("1 in", 0.0254, [0.0, 1.0, 0.0]),
        ("2 cm2", 2e-4, [0.0, 2.0, 0.0]),
        ("1 MN/m^3.5", 1e6, [1.0, -2.5, -2.0]),
        ("-3 kg", -3.0, [1.0, 0.0, 0.0]),
        ("3", 3.0, [0.0, 0.0, 0.0]),
    ] {
        let (value, dimension) = parse(text).unwrap();
        assert!((value / si - 1.0).abs() < 1e-12, "{text}: {value}");
        assert_eq!(dimension, Dimension(exponents), "{text}");
    }
}

/// What is no unit is refused.
#[test]
fn nonsense_is_no_unit() {
    for text in
        ["", "MPa", "5 MPz", "5 /", "5 m*", "5 m 3", "five m", "5 m^", "1e400 m", "5 °", "5 -m", "nan m"]
    {
        assert!(parse(text).is_err(), "{text}");
    }
}

/// The same case in millimetres, tonnes and kilonewtons is the same case.
#[test]
fn units_do_not_change_the_case() {
    let metres = Case::parse(super::GOOD, "case.yml").unwrap();
    let text = with("\"5 MPa\"", "5e6").replace("\"1700 kg/m3\"", "\"1.7e-9 t/mm3\"");
    let text = text.replace("\"70 ms\"", "0.07").replace("y: -0.05", "y: \"-50 mm\"");
    let text = text.replace("max: [1, 1]", "max: [\"1000 mm\", \"100 cm\"]");
    let others = Case::parse(&text, "case.yml").unwrap();
    let density = |case: &Case| case.bodies.get("block").unwrap().density.unwrap().value;
    assert!((density(&metres) / density(&others) - 1.0).abs() < 1e-15);
    let json = |case: &Case| case.to_json().unwrap().to_string().replace(&density(case).to_string(), "1700");
    assert_eq!(json(&metres).replace("1700.0", "1700"), json(&others));
}

fn system(length: &str, mass: &str, time: &str) -> Units {
    serde_json::from_value(serde_json::json!({ "length": length, "mass": mass, "time": time })).unwrap()
}

/// Derived units have the names that one would use, and otherwise are written in base units.
#[test]
fn derived_units_have_their_names() {
    let units =
        ["m", "m/s", "m2", "kg/m3", "N", "Pa", "J", "W", "m/Pa", "Pa/m", "N/m", "N s", "N m s", "1/s"];
    for ([length, mass, time], names) in [
        (["m", "kg", "s"], units),
        (
            ["mm", "t", "s"],
            [
                "mm", "mm/s", "mm2", "t/mm3", "N", "MPa", "mJ", "mW", "mm/MPa", "MPa/mm", "N/mm", "N s",
                "N mm s", "1/s",
            ],
        ),
        (
            ["mm", "kg", "ms"],
            [
                "mm", "mm/ms", "mm2", "kg/mm3", "kN", "GPa", "J", "kW", "mm/GPa", "GPa/mm", "kN/mm", "kN ms",
                "kN mm ms", "1/ms",
            ],
        ),
        (
            ["in", "slinch", "s"],
            [
                "in",
                "in/s",
                "in2",
                "slinch/in3",
                "lbf",
                "psi",
                "slinch in2/s2",
                "slinch in2/s3",
                "in/psi",
                "psi/in",
                "lbf/in",
                "lbf s",
                "lbf in s",
                "1/s",
            ],
        ),
        (
            ["in", "lb", "s"],
            [
                "in",
                "in/s",
                "in2",
                "lb/in3",
                "lb in/s2",
                "lb/in/s2",
                "lb in2/s2",
                "lb in2/s3",
                "in2 s2/lb",
                "lb/in2/s2",
                "lb/s2",
                "lb in/s",
                "lb in2/s",
                "1/s",
            ],
        ),
    ] {
        let system = system(length, mass, time);
        assert_eq!(units.map(|unit| system.of(unit)), names, "{length}, {mass}, {time}");
        // What is printed means what was computed.
        for unit in units {
            let (si, dimension) = parse(&format!("1 {}", system.of(unit))).unwrap();
            assert!(
                (si / system.factor(dimension) - 1.0).abs() < 1e-12,
                "{unit} in {length}, {mass}, {time}: {si}"
            );
            assert_eq!(dimension, parse(&format!("1 {unit}")).unwrap().1, "{unit}");
        }
    }
    assert_eq!(system("mm", "t", "s").moment(), "N mm");
    assert_eq!(system("mm", "t", "s").of("N m"), "N mm");
    assert_eq!(system("mm", "t", "s").symbol(Dimension([1.0, -1.5, -2.0])), "MPa/mm^0.5");
    assert_eq!(system("mm", "t", "s").heading("tip.u_x [m]"), "tip.u_x [mm]");
    assert_eq!(Units::SI.heading("angular_z [N m s]"), "angular_z [N m s]");
    assert_eq!(system("mm", "t", "s").heading("status"), "status");
}

/// In mm, t and s plain numbers are in MPa, t/mm3 and so on, strings keep their meaning, and the clock's seconds are seconds.
#[test]
fn a_case_may_be_in_other_units() {
    let head = "units: { length: mm, mass: t, time: ms }\n";
    let text = format!("{head}{}", with("fields: { every: 10 }", "checkpoint: { wall_time: 60 }"));
    let case = Case::parse(&text, "case.yml").unwrap();
    let body = case.bodies.get("block").unwrap();
    let close =
        |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    // t/(mm ms2) is a TPa.
    close(body.material.moduli().young_modulus(), 5e-6);
    close(body.density.unwrap().value, 1.7e-9);
    close(case.time.end.value, 70.0);
    close(case.time.step.unwrap().value, 5e-4);
    close(case.output.checkpoint.as_ref().unwrap().wall_time.unwrap().value, 60.0);
    assert!(case.to_json().unwrap()["units"]["time"] == "ms");
    let again = Case::parse(&case.to_yaml().unwrap(), "again.yml").unwrap();
    assert_eq!(again.to_json().unwrap(), case.to_json().unwrap());
    assert_eq!(again, case);
}

/// A wrong unit is reported in the units of the case, a wrong system at its place.
#[test]
fn wrong_units_are_told_in_the_system() {
    let head = "units: { length: mm, mass: t }\n";
    let message = |text: String| Case::parse(&text, "case.yml").unwrap_err().message;
    let text = message(format!("{head}{}", with("\"5 MPa\"", "5 mm")));
    assert!(text.contains("'5 mm' is a length [mm]; expected a pressure [MPa]"), "{text}");
    assert!(text.contains("write a number in MPa"), "{text}");
    for (units, place, words) in [
        ("{ length: kg }", "1:18", "'kg' is a unit of a mass, but a unit of a length"),
        ("{ time: sec }", "1:16", "unknown unit 'sec'"),
        ("{ length: furlong, mass: t, time: ms }", "1:18", "unknown unit 'furlong'"),
        ("{ force: N }", "1:10", "unknown key 'force'"),
        ("{ mass: MPa }", "1:16", "'MPa' is a unit of a pressure"),
        ("mm", "1:8", "expected a mapping"),
    ] {
        let text = message(format!("units: {units}\n{}", super::GOOD));
        assert!(text.contains(&format!("case.yml:{place}: ")) && text.contains(words), "{units}: {text}");
        assert_eq!(text.matches("case.yml:").count(), 1, "{units}: {text}");
    }
}
