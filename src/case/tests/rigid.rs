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

/// Free bodies are read, written again, and read the same.
#[test]
fn free_bodies_are_read() {
    let disc = "shape: { sphere: { center: [0.5, -0.5], radius: 0.5 } }";
    for (dimension, body) in [
        (2, format!("{disc}, free: {{ density: 1000, gravity: [0, \"-9.81 m/s2\"] }}")),
        (
            2,
            format!("{FLAT}, free: {{ mass: 2 kg, inertia: [0.3], fixed: [ux], force: {{ y: \"1 - t\" }} }}"),
        ),
        (
            2,
            format!(
                "{FLAT}, motion: {{ rotation: {{ angle: t }} }}, free: {{ mass: 1, inertia: [1], torque: {{ z: 1 }} }}"
            ),
        ),
        (3, format!("{SPACE}, free: {{ mass: 1, fixed: [rx, ry, rz], initial_velocity: [1, 0, 0] }}")),
        (
            3,
            format!("{SPACE}, free: {{ mass: 1, inertia: [1, 2, 2.5], initial_spin: [1, 0, \"60 1/min\"] }}"),
        ),
    ] {
        let body = body.replace("angle: t", "angle: \"t\"");
        let text = case(dimension, &format!("{{ {body} }}")).replace("scheme: static", "scheme: midpoint");
        let text = text.replace("poisson_ratio: 0.3 } }", "poisson_ratio: 0.3 } }\n    density: 1000");
        let read = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        let again = Case::parse(&read.to_yaml().unwrap(), "case.yml").unwrap();
        assert_eq!(read.rigid, again.rigid);
        assert!(read.rigid.values().all(|body| body.rotates() && body.free.is_some()));
    }
}

/// Invalid free bodies are reported with line, cause and cure.
#[test]
fn what_is_wrong_with_a_free_body_is_reported() {
    let flat = |free: &str| case(2, &format!("{{ {FLAT}, free: {free} }}"));
    let dynamic = |free: &str| {
        flat(free)
            .replace("scheme: static", "scheme: midpoint")
            .replace("poisson_ratio: 0.3 } }", "poisson_ratio: 0.3 } }\n    density: 1000")
    };
    let space = |free: &str| case(3, &format!("{{ {SPACE}, free: {free} }}"));
    let moved = |motion: &str, free: &str| case(2, &format!("{{ {FLAT}, motion: {motion}, free: {free} }}"));
    let rows: Vec<(String, &[&str])> = vec![
        (dynamic("{}"), &["case.yml:8:", "'tool' has no mass", "`density`"]),
        (dynamic("{ mass: 1 }"), &["case.yml:8:", "no moment of inertia", "`fixed`"]),
        (dynamic("{ mass: 0, inertia: [1] }"), &["case.yml:8:", "mass", "0"]),
        (flat("{ mass: 1, inertia: [1, 2] }"), &["case.yml:7:", "inertia", "1 entr"]),
        (space("{ mass: 1, inertia: [1, 1, 3] }"), &["case.yml:7:", "sum of the other two"]),
        (space("{ mass: 1, inertia: [1, 1] }"), &["case.yml:7:", "inertia", "3 entr", "six entries xx"]),
        (
            space("{ mass: 1, inertia: [1, 1, 1, 2, 0, 0] }"),
            &["case.yml:7:", "positive principal moments, found -1", "xx, yy, zz, xy, yz, xz"],
        ),
        (
            space("{ mass: 1, inertia: [1, 1, 1, 0.6, 0, 0] }"),
            &["case.yml:7:", "found 4.000e-1, 1.000e0 and 1.600e0", "signs of the products"],
        ),
        (flat("{ density: 1000 }"), &["case.yml:7:", "no volume", "`mass` and `inertia`"]),
        (flat("{ density: 1000, center: [0, 1] }"), &["case.yml:7:", "a density and a centre of mass"]),
        (flat("{ density: 1000, mass: 1 }"), &["case.yml:7:", "both a density and a mass"]),
        (flat("{ fixed: [uz] }"), &["case.yml:7:", "ux, uy and rz"]),
        (flat("{ fixed: [w] }"), &["case.yml:7:", "w"]),
        (flat("{ fixed: [ux, uy, rz] }"), &["case.yml:7:", "nothing is free in 'tool'"]),
        (
            moved("{ translation: { x: 1 } }", "{ fixed: [ux] }"),
            &["case.yml:7:", "both fixed and prescribed"],
        ),
        (
            flat("{ fixed: [ux], initial_velocity: [1, 0] }"),
            &["case.yml:7:", "initial velocity along x, which is held", "write 0 there"],
        ),
        (
            moved("{ translation: { y: 1 } }", "{ initial_velocity: [0, 2] }"),
            &["case.yml:7:", "initial velocity along y, which is held"],
        ),
        (
            space("{ mass: 1, inertia: [1, 1, 1], fixed: [ry], initial_spin: [0, 3, 0] }"),
            &["case.yml:7:", "initial spin about y, which is held"],
        ),
        (
            moved("{ rotation: { about: [0, 0], angle: 1 } }", "{ mass: 1 }"),
            &["case.yml:7:", "about its centre of mass", "`center`"],
        ),
        (flat("{ force: { z: 1 } }"), &["case.yml:7:", "a 2D case has no z"]),
        (flat("{ force: { y: \"x\" } }"), &["case.yml:7:", "depends on t only"]),
        (flat("{ torque: { x: 1 } }"), &["case.yml:7:", "a torque in 2D is about z"]),
        (flat("{ torque: { z: 1 N } }"), &["case.yml:7:", "N"]),
        (flat("{ gravity: [0, 0, 1] }"), &["case.yml:7:", "2 entries"]),
        (flat("{ initial_spin: [0, 0, 1] }"), &["case.yml:7:", "1 entr"]),
        (
            format!("{}solver: {{ strategy: staggered }}\n", flat("{ force: { y: 1 } }")),
            &["case.yml:10:", "no stage of the staggered strategy holds", "`strategy: monolithic`"],
        ),
        (flat("{ initial_velocity: [0, 1] }"), &["case.yml:7:", "not allowed with the static scheme"]),
        (
            flat("{ gravity: [0, 1] }"),
            &["case.yml:7:", "gravity acts on 'tool', which has no mass", "`force`"],
        ),
        (
            dynamic("{ mass: 1, inertia: [1] }").replace("midpoint", "conserving"),
            &["case.yml:8:", "conserving scheme has no free rigid bodies", "midpoint"],
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

/// Shapes are read, written again, and read the same. Wrong ones are refused with a reason and a
/// cure.
#[test]
fn shapes_of_rigid_bodies_are_checked() {
    let cone = |rest: &str| format!("cone: {{ tip: [0, 0], axis: [0, 1], {rest} }}");
    let cuboid = |rest: &str| format!("box: {{ center: [0, 0], {rest} }}");
    let turned =
        |rest: &str| format!("turned: {{ point: [0, 0, 0], axis: [0, 0, 2], profile: [{rest}], radius: 1 }}");
    for (dimension, shape) in [
        (2, cone("half_angle: 1.227, radius: 1 mm")),
        (2, cuboid("size: [1, 2], radius: 0.5, angle: 0.3, side: inside")),
        (2, "polyline: { points: [[0, 0], [1, 0], [1, 1]], closed: true, radius: 0.1 }".to_owned()),
        (3, "surface: { file: a.stl, scale: 0.001, angle: 1, axis: [1, 0, 0], radius: 1 mm }".to_owned()),
        (2, "capsule: { from: [0, 0], to: [1, 0], radius: 0.1 }".to_owned()),
        (3, "torus: { center: [0, 0, 0], axis: [0, 0, 2], ring_radius: 1, tube_radius: 0.5 }".to_owned()),
        (3, "box: { center: [0, 0, 0], size: [1, 2, 3], radius: 0.1, angle: 1, axis: [1, 0, 0] }".to_owned()),
        (3, turned("[0, 0], [100 mm, 0], [0.1, 0.3], [0, 0.3]").replace(" }", ", side: inside }")),
        (3, turned("[1.5, 0], [2.5, 0], [2, 1]")),
    ] {
        let text = case(dimension, &format!("{{ shape: {{ {shape} }} }}"));
        let read = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read, Case::parse(&read.to_yaml().unwrap(), "case.yml").unwrap());
    }
    let rows: Vec<(usize, String, &[&str])> = vec![
        (
            2,
            cuboid("size: [1, 2], radius: 0"),
            &["radius of the edges of a box must be > 0", "sharp edge has no normal"],
        ),
        (
            2,
            cuboid("size: [1, 2], radius: 0.6"),
            &["radius of the edges of a box must be at most 0.5, found 0.6"],
        ),
        (2, cuboid("size: [1], radius: 0.1"), &["the size of a box needs 2 entries"]),
        (
            2,
            cuboid("size: [1, 2], radius: 0.1, angle: 1, axis: [0, 0, 1]"),
            &["rotates about z", "remove `axis`"],
        ),
        (2, cone("half_angle: 70.3, radius: 0.1"), &["between 0 and pi/2, found 70.3", "in radians"]),
        (
            2,
            cone("half_angle: 0.5, radius: 0"),
            &["radius of the tip must be > 0", "sharp tip has no normal"],
        ),
        (
            2,
            "capsule: { from: [1, 0], to: [1, 0], radius: 0.1 }".to_owned(),
            &["the same point", "use a `sphere`"],
        ),
        (
            2,
            "torus: { center: [0, 0], axis: [0, 1], ring_radius: 1, tube_radius: 0.5 }".to_owned(),
            &["a torus is a 3D obstacle", "a `sphere` for each disc"],
        ),
        (
            3,
            "torus: { center: [0, 0, 0], axis: [0, 0, 1], ring_radius: 1, tube_radius: 1 }".to_owned(),
            &["thinner than the ring of radius 1, found 1", "smaller than `ring_radius`"],
        ),
        (
            3,
            "box: { center: [0, 0, 0], size: [1, 2, 3], radius: 0.1, angle: 1 }".to_owned(),
            &["needs an `axis`", "axis: [0, 0, 1]"],
        ),
        (2, "surface: { file: a.stl }".to_owned(), &["a surface is a 3D obstacle", "`polyline`"]),
        (3, "surface: { file: a.stl, scale: 0 }".to_owned(), &["scale of a surface must be > 0"]),
        (3, "surface: { file: a.stl, radius: -1 }".to_owned(), &["radius of a surface must be >= 0"]),
        (3, "surface: { file: a.stl, angle: 1 }".to_owned(), &["needs an `axis`"]),
        (3, "surface: { file: a.stl, position: [1, 2] }".to_owned(), &["needs 3 entries"]),
        (3, "polyline: { points: [[0, 0], [1, 0]], radius: 0.1 }".to_owned(), &["2D obstacle", "`surface`"]),
        (2, "polyline: { points: [[0, 0]], radius: 0.1 }".to_owned(), &["at least 2 points, found 1"]),
        (2, "polyline: { points: [[0, 0], [1]], radius: 0.1 }".to_owned(), &["needs 2 entries"]),
        (2, "polyline: { points: [[0, 0], [1, 0]], radius: 0 }".to_owned(), &["sharp corner has no normal"]),
        (2, "polyline: { points: [[0, 0], [0, 0]], radius: 1 }".to_owned(), &["are the same", "remove one"]),
        (
            2,
            "polyline: { points: [[0, 0], [1, 0], [2, 0]], closed: true, radius: 1 }".to_owned(),
            &["encloses no area", "remove `closed`"],
        ),
        (
            2,
            "polyline: { points: [[0, 2], [2, 3], [2, 2], [0, 3.5]], closed: true, radius: 1 }".to_owned(),
            &["lines from points 1 and 3 of the closed polyline meet", "along the outline"],
        ),
        (
            2,
            "polyline: { points: [[0, 0], [1, 0], [1, 1], [0, 0]], closed: true, radius: 1 }".to_owned(),
            &["points 4 and 1 of a polyline are the same"],
        ),
        (
            3,
            "surface: { file: a.stl, crease_angle: 40 }".to_owned(),
            &["at most pi, found 40", "34 degrees are 0.6"],
        ),
        (
            2,
            "polyline: { points: [[0, 0], [1, 0]], side: inside, radius: 1 }".to_owned(),
            &["an open polyline has no inside", "closed: true"],
        ),
        (2, turned("[0, 0], [1, 0], [0, 1]"), &["a turned solid is a 3D obstacle", "closed `polyline`"]),
        (
            3,
            turned("[0, 0], [0, 1]"),
            &["case.yml:7:74", "needs at least 3 points, found 2", "`capsule`", "`torus`"],
        ),
        (3, turned("[0, 0], [1], [0, 1]"), &["case.yml:7:83", "point 2", "2 entries [r, z], found 1"]),
        (
            3,
            turned("[0, 0], [-1, 0], [0, 1]"),
            &["case.yml:7:83", "point 2", "r >= 0, found -1", "one side of the axis"],
        ),
        (
            3,
            turned("[0, 0], [1, 0], [0, 1], [1, 2], [0, 3]"),
            &["case.yml:7:91", "point 3", "on the axis between the ends", "two obstacles"],
        ),
        (
            3,
            turned("[0, 0], [1, 0], [2, 1]"),
            &["case.yml:7:91", "one end on the axis, and point 3 at r = 2", "both ends have r = 0"],
        ),
        (
            3,
            turned("[2, 0], [2, 1], [0, 1]"),
            &["case.yml:7:75", "one end on the axis, and point 1 at r = 2", "both ends have r = 0"],
        ),
        (
            3,
            turned("[1, 0], [2, 0], [1.5, 1]"),
            &["smaller than the distance 1 of its profile", "found 1", "start and end at r = 0"],
        ),
        (
            3,
            turned("[0, 0], [1, 0], [1, 0], [0, 1]"),
            &["case.yml:7:83", "points 2 and 3 of a profile are the same", "remove one"],
        ),
        (
            3,
            turned("[2, 0], [3, 0], [3, 1], [2, 0]"),
            &["points 4 and 1 of a profile are the same", "the last point is not repeated"],
        ),
        (3, turned("[2, 0], [3, 1], [4, 2]"), &["encloses no area", "along the outline"]),
        (
            3,
            turned("[0, 0], [2, 1], [2, 0], [0, 1.5]"),
            &["case.yml:7:75", "lines from points 1 and 3 of the profile meet", "must not touch itself"],
        ),
        (
            3,
            turned("[0, 0], [1, 0], [0, 1]").replace("radius: 1", "radius: 0"),
            &["radius of a turned solid must be > 0", "a sharp edge has no normal"],
        ),
        (
            3,
            turned("[0, 0], [1, 0], [0, 1]").replace("[0, 0, 2]", "[0, 0, 0]"),
            &["the axis of a turned solid is zero"],
        ),
    ];
    for (dimension, shape, fragments) in rows {
        let error = match Case::parse(&case(dimension, &format!("{{ shape: {{ {shape} }} }}")), "case.yml") {
            Err(error) => error.to_string(),
            Ok(_) => panic!("read without complaint: {shape}"),
        };
        for fragment in ["case.yml:7:"].iter().chain(fragments) {
            assert!(error.contains(fragment), "no '{fragment}' in:\n{error}\nof: {shape}");
        }
    }
}
