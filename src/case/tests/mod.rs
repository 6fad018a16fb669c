//! Tests of reading cases: what is wrong is shown where it stands, what is right comes through unchanged.

mod accuracy;
mod broken;
mod document;
mod functions;
mod hostile;
mod parameters;
mod rigid;
mod several;
mod shipped;
mod units;

use super::Case;

/// A case that is right; tests replace a piece of it.
pub(super) const GOOD: &str = r#"title: A block on a plane
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [4, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: "5 MPa", poisson_ratio: 0.45 } }
    density: "1700 kg/m3"
    kinematics: finite
    locking: selective_reduced
    initial_velocity: ["0.1 * y", 0]
obstacles:
  floor: { plane: { point: [0, 0], normal: [0, 1] } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: "1e-10 m/Pa" } }
    friction: { coulomb: { coefficient: 1.0, regularization: { stick_velocity: "1 mm/s" } } }
    # tractions act on the deformed area
    area: current
    initial_overclosure: accept
boundary:
  clamp: { on: block.top, displacement: { x: "1.0 * t", y: -0.05 } }
start: { equilibrium: { friction: false, increments: 4 } }
time: { end: "70 ms", step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }
solver: { strategy: monolithic, linear: auto }
output:
  fields: { every: 10 }
  probes:
    corner: { at: [0, 0], on: block }
petsc: { ksp_monitor: }
"#;

/// The good case with one piece replaced; the piece must be there, so that a test can not miss what it breaks.
pub(super) fn with(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "not in the good case: {from}");
    GOOD.replacen(from, to, 1)
}

/// Message of the error, which there must be.
pub(super) fn message(text: &str) -> String {
    match Case::parse(text, "case.yml") {
        Ok(_) => panic!("no error in\n{text}"),
        Err(error) => error.message,
    }
}

/// `contact: all` stands for a contact of all surfaces with each other and one with each obstacle; so does such a contact of the user's own,
/// whose laws the others get, except where it is there already.
#[test]
fn contact_of_all_with_all_has_one_for_each_obstacle() {
    let (before, rest) = GOOD.split_once("contact:\n").unwrap();
    let (_, after) = rest.split_once("boundary:\n").unwrap();
    let two = before.replace("  floor:", "  disc: { sphere: { center: [0, -9], radius: 2 } }\n  floor:");
    let read =
        |contact: &str| Case::parse(&format!("{two}{contact}\nboundary:\n{after}"), "case.yml").unwrap();
    let short = read("contact: all");
    let sides = |case: &Case| -> Vec<[String; 3]> {
        let entry = |(name, contact): (&super::At<String>, &super::Contact)| {
            [name.value.clone(), contact.contactor.value.clone(), contact.target.value.clone()]
        };
        case.contact.iter().map(entry).collect()
    };
    let all = [["all", "all", "all"], ["all-disc", "all", "disc"], ["all-floor", "all", "floor"]];
    assert_eq!(sides(&short), all);
    assert_eq!(Case::parse(&short.to_yaml().unwrap(), "again.yml").unwrap(), short);
    let own = read(
        "contact:\n  ground: { contactor: all, target: floor }\n  rest: { contactor: all, target: all, area: reference }",
    );
    assert_eq!(
        sides(&own),
        [["ground", "all", "floor"], ["rest", "all", "all"], ["rest-disc", "all", "disc"]]
    );
    assert_eq!(own.contact.get("rest-disc").unwrap().area, super::Area::Reference);
}
