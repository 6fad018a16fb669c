//! The key `accuracy`: levels, tolerances one by one, and what is wrong with them.

use super::super::{Case, PenetrationTolerance};
use super::{GOOD, message, with};

const AT: &str = "petsc: { ksp_monitor: }";

fn case(accuracy: &str) -> Case {
    let text = with(AT, &format!("accuracy: {accuracy}"));
    Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"))
}

fn values(accuracy: &str) -> [Option<f64>; 4] {
    let read = case(accuracy).accuracy.unwrap().value;
    let number = |part: Option<crate::reader::quantity::Number>| part.map(|part| part.value);
    [
        read.penetration.map(|penetration| penetration.value().0),
        number(read.slip),
        number(read.time),
        number(read.energy),
    ]
}

/// Levels have names; what a mapping leaves out is that of balanced, and `none` leaves a part alone.
#[test]
fn levels_and_tolerances_are_read() {
    assert_eq!(values("fast"), [Some(1e-2), Some(1e-2), Some(1e-2), Some(5e-2)]);
    assert_eq!(values("{}"), values("balanced"));
    assert_eq!(values("{ time: 2e-3, slip: none }"), [Some(1e-3), None, Some(2e-3), Some(2e-2)]);
    let relative = |text: &str| match case(text).accuracy.unwrap().penetration {
        Some(PenetrationTolerance::Relative(part)) => Some(part.value),
        _ => None,
    };
    assert_eq!(relative("{ penetration: { relative: 0.02 } }"), Some(0.02));
    assert_eq!(relative("{ penetration: \"0.01 mm\" }"), None);
    assert_eq!(values("{ penetration: \"0.01 mm\" }")[0], Some(1e-5));
}

/// Without the key nothing is asked, and the completed case does not mention it; with it the completed case reads back as
/// the same.
#[test]
fn the_completed_case_says_the_same() {
    assert!(!Case::parse(GOOD, "case.yml").unwrap().to_yaml().unwrap().contains("accuracy"));
    for text in ["tight", "{ penetration: none, time: 0.5 }", "{ penetration: { relative: 1e-2 } }"] {
        let first = case(text);
        let again = Case::parse(&first.to_yaml().unwrap(), "case.yml").unwrap();
        assert_eq!(first, again);
    }
}

/// A penalty in motion wants no mass on it where it may become stiffer for a penetration, and where nothing damps what swings on it.
#[test]
fn penalties_in_motion_want_no_mass() {
    let calms = |accuracy: &str, from: &str, to: &str| {
        let text = with(AT, &format!("accuracy: {accuracy}")).replacen(from, to, 1);
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        [case.calms_contact_of("block"), case.calms_contact_of("floor"), case.calms_contact_of("bloc")]
    };
    let newmark = "{ newmark: { beta: 0.25, gamma: 0.5 } }";
    assert_eq!(calms("fast", "", ""), [true, true, false]);
    assert_eq!(calms("{ penetration: none }", "", ""), [false; 3]);
    assert_eq!(calms("{ time: none }", "", ""), [false; 3]);
    for accuracy in ["fast", "{ time: 1e-3, penetration: none }"] {
        assert_eq!(calms(accuracy, newmark, "conserving"), [true, true, false]);
    }
    assert_eq!(calms("{ time: none }", newmark, "conserving"), [false; 3]);
    // Between the facets of another body a node without mass may find no balance.
    let discs = include_str!("../../../meshes/collision/case.yml").to_owned() + "accuracy: fast\n";
    for (scheme, expected) in [("conserving", false), ("midpoint", true)] {
        let text = discs.replace("scheme: conserving", &format!("scheme: {scheme}"));
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(["left", "right"].map(|body| case.calms_contact_of(body)), [expected; 2]);
    }
    let power = "{ power_law: { stiffness: 1e14, exponent: 2 } }";
    assert_eq!(calms("fast", "{ penalty: { compliance: \"1e-10 m/Pa\" } }", power), [false; 3]);
}

/// What can not be is refused with its place and a cure.
#[test]
fn broken_accuracies_are_refused() {
    let power = "normal: { penalty: { compliance: \"1e-10 m/Pa\" } }";
    for (text, words) in [
        ("fats", "did you mean 'fast'?"),
        ("0.1", "accuracy"),
        ("{ tmie: 1 }", "unknown key 'tmie'"),
        ("{ time: 0 }", "must be > 0 and < 1"),
        ("{ energy: 1.5 }", "the energy must be > 0 and < 1"),
        ("{ slip: \"1 mm\" }", "expected a pure number"),
        ("{ penetration: -1e-3 }", "the penetration must be > 0"),
        ("{ penetration: \"1 s\" }", "expected a length"),
        ("{ penetration: { relative: 1e-300 } }", "1e-300 is below the rounding errors"),
        ("{ penetration: { part: 1 } }", "unknown key 'part'"),
        ("{ penetration: {} }", "expected { relative: ... }"),
        ("{ time: 1e-3, time: 1e-3 }", "twice"),
    ] {
        let said = message(&with(AT, &format!("accuracy: {text}")));
        assert!(said.contains(words) && said.contains("case.yml:31"), "{text}: {said}");
    }
    let rough = with(power, "normal: { power_law: { stiffness: 1e14, exponent: 2 } }");
    let rough = rough.replace(AT, "accuracy: { penetration: 1e-5 }");
    assert!(message(&rough).contains("penetration: none"));
    let still = with("start: { equilibrium: { friction: false, increments: 4 } }\n", "");
    let still = still.replace("newmark: { beta: 0.25, gamma: 0.5 }", "static: {}");
    let still = still.replace("stick_velocity: \"1 mm/s\"", "stick_stiffness: 1e9");
    assert!(message(&still.replace(AT, "accuracy: { time: 1e-3 }")).contains("statics has no error in time"));
    assert!(!message(&still.replace(AT, "accuracy: { slip: 2 }")).contains("statics has no error in time"));
}

/// Rows of tables, comparisons of the time with a number, and its minima and maxima are kinks.
#[test]
fn kinks_are_found() {
    use super::super::Function;
    let kinks = |text: &str| Function::expression(text).unwrap().kinks();
    assert_eq!(kinks("if(t < 0.01, 8e4 * sin(100 * pi * t), 0)"), [0.01]);
    assert_eq!(kinks("x * if(2 * 0.1 >= t, 1, min(t, 0.5))"), [0.2, 0.5]);
    assert!(kinks("if(x < 0.3, t, 2 * t)").is_empty());
    assert_eq!(
        kinks("min(t, 0.5, 2 * 0.1) * if(t > 1 and not (3 < t or x < 1), 1, 2)"),
        [0.5, 0.2, 1.0, 3.0]
    );
    assert_eq!(Function::table(vec![[0.0, 1.0], [0.3, 2.0]]).unwrap().kinks(), [0.0, 0.3]);
}
