//! A wheel on a slab: friction that does not depend on the rotation per step.

use crate::common::{Folder, Results, run};

/// A wheel that is pressed on a slab until t = 0.1, and then rolls by 18 degrees in each tenth of a
/// second.
fn wheel(step: f64, more: &str) -> String {
    let turn = "3.141592653589793 * max(t - 0.1, 0)";
    format!(
        "title: A wheel rolls on a slab\ndimension: 2\nbodies:\n  wheel:\n    \
         mesh: {{ box: {{ min: [0.5, 0], max: [1.0, 1.0], cells: [2, 40], map: {{ x: \"1.5 + x * cos(3.141592653589793 * (y - 1))\", \
         y: \"2 + x * sin(3.141592653589793 * (y - 1))\" }} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1.0e9, poisson_ratio: 0.3 }} }}\n    kinematics: finite\n  slab:\n    \
         mesh: {{ box: {{ min: [0.5, 0.5], max: [2.0, 1], cells: [24, 5] }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}\n    kinematics: finite\n\
         contact:\n  tread:\n    contactor: slab.top\n    target: wheel.right\n    normal: {{ penalty: {{ compliance: 1.0e-10 }} }}\n    \
         friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 5.0e9 }} }} }}\n    initial_overclosure: accept\n\
         boundary:\n  bed: {{ on: slab.bottom, displacement: {{ x: 0, y: 0 }} }}\n  \
         hub:\n    on: wheel.left\n    displacement:\n      \
         x: \"(x - 1.5) * (cos({turn}) - 1) - (y - 2) * sin({turn}) - {turn}\"\n      \
         y: \"(x - 1.5) * sin({turn}) + (y - 2) * (cos({turn}) - 1) - 0.3 * min(t, 0.1)\"\n\
         time: {{ end: 0.4, step: {step}, scheme: {{ static: {{}} }}{more} }}\n"
    )
}

/// A step of 18 degrees, four facets, is cut until the wheel rolls by one facet at a time. Its
/// friction is within a fifth of that of short steps. Without cuts it would be less than half of
/// that. If no further cuts are permitted, the run reports by how much the steps are too long.
#[test]
fn a_wheel_rolls_by_a_facet_a_step() {
    let friction = |step: f64, more: &str| {
        let results = Results::of(&wheel(step, more), 1);
        let record = results.record();
        assert!(
            !record["warnings"].to_string().contains("could not be cut further"),
            "{}",
            record["warnings"]
        );
        (record["cut_steps"].as_u64().expect("cuts"), results.table("contact.csv").last("force_x"))
    };
    let ((cuts, long), (none, short)) = (friction(0.1, ""), friction(0.01, ""));
    assert!(cuts > 3 && none == 0, "{cuts}, {none} cuts");
    assert!((long / short - 1.0).abs() < 0.2, "{long} and {short} N");
    let (_, unwatched) = friction(0.1, " }\nguard: { motion: 100");
    assert!(unwatched < 0.6 * short, "{unwatched} and {short} N");
    let folder = Folder::new("wheel");
    folder.write("case.yml", &wheel(0.1, ", cuts: 1"));
    let output = run(2, &["case.yml", "-o", "out", "-q"], &folder).success();
    let words = "the surfaces of contact 'tread' rolled by";
    assert!(
        output.stderr.contains(words) && output.stderr.contains("2.0 facets in step"),
        "{}",
        output.stderr
    );
}
