//! Named parameters, in functions, in quantities and by studies.

use std::path::Path;

use super::super::{Action, Case, Named};
use super::{GOOD, message, with};
use crate::contact::friction::FrictionLaw;
use crate::error::Result;
use crate::reader::document::{Document, read_as};
use crate::reader::node::Node;
use crate::reader::source::Source;

const PARAMETERS: &str =
    "parameters: { mu: 0.3, speed: \"2 * mu + 0.4\", depth: \"-50 mm\" }\ndimension: 2\n";

fn parametric() -> String {
    with("dimension: 2\n", PARAMETERS)
        .replace("x: \"1.0 * t\", y: -0.05", "x: \"speed * t\", y: depth")
        .replace("coefficient: 1.0", "coefficient: mu")
        .replace("max: [1, 1]", "max: [\"speed\", \"2 * speed - 1\"]")
}

/// A case with parameters equals the case with their values.
#[test]
fn parameters_stand_for_their_values() {
    let case = Case::parse(&parametric(), "case.yml").unwrap();
    let plain = Case::parse(&with("coefficient: 1.0", "coefficient: 0.3"), "case.yml").unwrap();
    assert_eq!((&case.contact, &case.bodies), (&plain.contact, &plain.bodies));
    let on_clamp = |case: &Case| {
        let clamp = case.boundary.get("clamp").unwrap();
        let actions: Vec<Action> = clamp.actions().collect();
        let [Action::Displacement([Some(x), Some(y), None])] = actions[..] else { panic!("{actions:?}") };
        (x.motion([0.0; 3], 0.7), y.motion([0.0; 3], 0.7))
    };
    assert_eq!(on_clamp(&case), on_clamp(&plain));
    assert_eq!(Case::parse(&case.to_yaml().unwrap(), "again.yml").unwrap(), case);
    // A number with a unit is converted into the units of the case.
    let tonnes = parametric().replace("dimension: 2", "units: { length: mm, mass: t }\ndimension: 2");
    let case = Case::parse(&tonnes, "case.yml").unwrap();
    assert!(case.to_yaml().unwrap().contains("depth: -50"), "{}", case.to_yaml().unwrap());
    // A number with a unit means the same beside parameters of any name.
    let named = with("dimension: 2\n", "parameters: { MPa: 3, mm: 4, s: 5 }\ndimension: 2\n");
    let plain = Case::parse(GOOD, "case.yml").unwrap();
    let named = Case::parse(&named, "case.yml").unwrap();
    assert_eq!((named.bodies, named.contact, named.time), (plain.bodies, plain.contact, plain.time));
}

/// A study changes a parameter, and every number that uses it changes too. A parameter that the
/// case lacks is an error.
#[test]
fn studies_change_parameters() {
    let changed = |overrides: &str| -> Result<Case> {
        let source = Source::new(overrides, Path::new("study.yml"));
        let overrides: Named<Node> = read_as(1, &source, None, |_| Vec::new())?;
        let mut document = Document::read(&parametric(), Path::new("case.yml"), source)?;
        document.put(&overrides)?;
        Case::from_document(&document)
    };
    let case = changed("parameters.mu: 0.4").unwrap();
    let FrictionLaw::Coulomb(coulomb) = case.contact.get("sole").unwrap().friction else { panic!() };
    assert_eq!(serde_json::to_value(coulomb.coefficient).unwrap(), serde_json::json!({ "constant": 0.4 }));
    let clamp = case.boundary.get("clamp").unwrap().displacement.as_ref().unwrap();
    assert!((clamp.x.as_ref().unwrap().value([0.0; 3], 1.0) - 1.2).abs() < 1e-15);
    let text = changed("parameters.mue: 0.4").unwrap_err().message;
    assert!(text.contains("study.yml:1:12: unknown parameter 'mue'") && text.contains("'mu'"), "{text}");
}

/// A misspelt parameter is reported where it is used, with the parameters of the case and the nearest of them.
#[test]
fn misspelt_parameters_are_reported() {
    for (right, wrong, place) in [
        ("speed * t", "sped * t", "24:46"),
        ("y: depth", "y: depht", "24:62"),
        ("[\"speed\"", "[\"sped\"", "6:39"),
    ] {
        assert!(parametric().contains(right));
        let text = message(&parametric().replacen(right, wrong, 1));
        assert!(text.starts_with(&format!("case.yml:{place}: unknown name '")), "{text}");
        assert!(text.contains("parameters: mu, speed, depth; did you mean '"), "{text}");
    }
    // A wrong parameter is reported once, not at every use.
    let text = message(&parametric().replacen("mu: 0.3", "mu: \"log(-1)\"", 1));
    assert!(text.contains("not finite") && !text.contains("unknown name"), "{text}");
    let text = message(&parametric().replacen("\"speed\"", "\"speed * t\"", 1));
    assert!(text.contains("case.yml:6:39") && text.contains("one number is expected"), "{text}");
}
