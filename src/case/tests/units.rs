//! Units and quantities.

use super::super::Case;
use super::super::unit::{Dimension, parse};
use super::with;

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
    let density = |case: &Case| case.bodies.get("block").unwrap().density.unwrap().si;
    assert!((density(&metres) / density(&others) - 1.0).abs() < 1e-15);
    let json = |case: &Case| case.to_json().unwrap().to_string().replace(&density(case).to_string(), "1700");
    assert_eq!(json(&metres).replace("1700.0", "1700"), json(&others));
}
