//! `rigid`: what is read and what is refused.

use crate::case::Case;

/// A case with a rigid body of this content.
fn case(dimension: usize, body: &str) -> String {
    let (corners, set) = match dimension {
        2 => ("min: [0, 0], max: [1, 1], cells: [2, 2]", "bottom"),
        _ => ("min: [0, 0, 0], max: [1, 1, 1], cells: [2, 2, 2]", "bottom"),
    };
    format!(
        "dimension: {dimension}
bodies:
  block:
    mesh: {{ box: {{ {corners} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}
rigid:
  tool: {body}
contact: {{ pair: {{ contactor: block.{set}, target: tool }} }}
time: {{ end: 1, step: 0.1, scheme: static }}
"
    )
}

const FLAT: &str = "shape: { plane: { point: [0, 0], normal: [0, 1] } }";
const SPACE: &str = "shape: { plane: { point: [0, 0, 0], normal: [0, 1, 0] } }";

/// A body with every kind of motion is read, written again, and read the same.
#[test]
fn motions_are_read() {
    for (dimension, motion) in [
        (2, ""),
        (2, ", motion: { translation: { x: \"0.2 * t\", y: { table: [[0, 0], [0.1, 5 mm]] } } }"),
        (2, ", motion: { rotation: { about: [0, 0.6], angle: \"3 * t\" } }"),
        (3, ", motion: { translation: { z: 1 }, rotation: { axis: [0, 0, 2], angle: 0.5 } }"),
    ] {
        let shape = if dimension == 2 { FLAT } else { SPACE };
        let text = case(dimension, &format!("{{ {shape}{motion} }}"));
        let read = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        let again = Case::parse(&read.to_yaml().unwrap(), "case.yml").unwrap();
        assert_eq!(read.rigid, again.rigid);
        assert_eq!(read.rigid.values().any(|body| body.rotates()), motion.contains("rotation"));
    }
}

/// Invalid input is reported with line, column, cause and cure.
#[test]
fn what_is_wrong_is_reported() {
    let flat = |motion: &str| case(2, &format!("{{ {FLAT}, motion: {motion} }}"));
    let space = |motion: &str| case(3, &format!("{{ {SPACE}, motion: {motion} }}"));
    let swapped = flat("{ translation: { x: 1 } }")
        .replace("contactor: block.bottom, target: tool", "contactor: tool, target: block.bottom");
    let both = flat("{ translation: { x: 1 } }").replace(
        "contact: { pair: { contactor: block.bottom, target: tool } }",
        "obstacles: { floor: { plane: { point: [0, -1], normal: [0, 1] } } }\n\
         contact: { pair: { contactor: tool, target: floor } }",
    );
    let named = |name: &str, more: &str| {
        flat("{ translation: { x: 1 } }")
            .replace("  tool: {", &format!("  {name}: {{"))
            .replace("\ncontact:", &format!("\n{more}contact:"))
    };
    let rows: Vec<(String, &[&str])> = vec![
        (flat("{}"), &["case.yml:7:", "the motion of 'tool' is empty", "translation"]),
        (flat("{ translation: {} }"), &["case.yml:7:", "no components", "0.2 * t"]),
        (flat("{ translation: { x: \"y * t\" } }"), &["case.yml:7:", "depends on t only", "expression in t"]),
        (flat("{ translation: { z: 1 } }"), &["case.yml:7:", "a 2D case has no z"]),
        (flat("{ translation: { x: \"1 / t\" } }"), &["case.yml:7:", "at t = 0"]),
        (flat("{ rotation: { angle: \"x\" } }"), &["case.yml:7:", "depends on t only"]),
        (flat("{ rotation: { angle: 1, axis: [0, 0, 1] } }"), &["case.yml:7:", "no axis", "remove `axis`"]),
        (flat("{ rotation: { angle: 1, about: [0, 0, 1] } }"), &["case.yml:7:", "2 entries"]),
        (flat("{ rotation: { about: [0, 0] } }"), &["case.yml:7:", "angle"]),
        (flat("{ rotation: { angle: 5 mm } }"), &["case.yml:7:"]),
        (flat("{ spin: 1 }"), &["case.yml:7:", "unknown key 'spin'", "translation"]),
        (space("{ rotation: { angle: 1 } }"), &["case.yml:7:", "needs an axis", "axis: [0, 0, 1]"]),
        (space("{ rotation: { angle: 1, axis: [0, 0, 0] } }"), &["case.yml:7:", "not zero"]),
        (space("{ rotation: { angle: 1, axis: [0, 1] } }"), &["case.yml:7:", "3 entries"]),
        (case(2, "{ motion: { translation: { x: 1 } } }"), &["case.yml:7:", "shape"]),
        (swapped, &["case.yml:8:", "'tool' is a rigid body", "exchange contactor and target"]),
        (both, &["case.yml:9:", "'tool' and 'floor' are both rigid", "remove the contact"]),
        (named("block", ""), &["case.yml:7:", "both a rigid body and a body", "another name"]),
        (named("all", ""), &["case.yml:7:", "reserved"]),
        (
            named("tool", "obstacles: { tool: { plane: { point: [0, 0], normal: [0, 1] } } }\n"),
            &["case.yml:7:", "both a rigid body and an obstacle"],
        ),
        (
            named("tool", "boundary: { push: { on: tool, displacement: { x: 1 } } }\n"),
            &["case.yml:8:", "'tool' is a rigid body", "motion"],
        ),
    ];
    for (text, fragments) in rows {
        let error = match Case::parse(&text, "case.yml") {
            Err(error) => error.to_string(),
            Ok(_) => panic!("read without complaint:\n{text}"),
        };
        for fragment in fragments {
            assert!(error.contains(fragment), "no '{fragment}' in:\n{error}\nof:\n{text}");
        }
    }
}
