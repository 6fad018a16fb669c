//! Bodies in contact with both strategies: the end of contact, and slip that reverses.

use super::*;

/// A body of quad4 elements.
fn body(name: &str, lower: [f64; 2], upper: [f64; 2], cells: [u32; 2], modulus: f64, more: &str) -> String {
    format!(
        "  {name}:\n    mesh: {{ box: {{ min: {lower:?}, max: {upper:?}, cells: {cells:?}, element: quad4 }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: {modulus}, poisson_ratio: 0.3 }} }}\n    density: 1000\n{more}"
    )
}

/// A block that is dragged along a slab and beyond its end, after which both are free of stress.
fn off_the_end() -> String {
    let slab = body("slab", [0.0, 0.0], [1.0, 0.3], [8, 2], 1e7, "");
    let block = body("block", [0.6, 0.3], [0.9, 0.5], [3, 2], 3e7, "");
    format!(
        "dimension: 2
bodies:
{slab}{block}contact:
  sole:
    contactor: block.bottom
    target: slab.top
    normal: {{ penalty: {{ compliance: 1.0e-9 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 1.0e8 }} }} }}
boundary:
  clamp: {{ on: slab.bottom, displacement: {{ x: 0, y: 0 }} }}
  grip: {{ on: block.top, displacement: {{ x: '0.6 * t', y: '-0.005 * min(1, 10 * t)' }} }}
time: {{ end: 1, step: 0.05, cuts: 0, scheme: {{ static: {{}} }} }}
output: {{ fields: {{ every: 100 }}, probes: {{ block: {{ at: [0.9, 0.3], on: block }}, slab: {{ at: [1, 0.3], on: slab }} }} }}
"
    )
}

/// Two blocks that approach each other, collide and separate.
fn flight() -> String {
    let left = body("left", [0.0, 0.0], [0.1, 0.1], [3, 3], 5e6, "    initial_velocity: [2.0, 0.5]\n");
    let right = body("right", [0.105, 0.03], [0.205, 0.13], [2, 2], 5e6, "");
    format!(
        "dimension: 2
bodies:
{left}{right}contact:
  meeting:
    contactor: left.right
    target: right.left
    normal: {{ penalty: {{ compliance: 1.0e-9 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_velocity: 1.0e-2 }} }} }}
time: {{ end: 0.012, step: 2.0e-4, cuts: 0, scheme: {{ backward_euler: {{}} }} }}
output: {{ fields: {{ every: 100 }}, probes: {{ left: {{ at: [0, 0], on: left }}, right: {{ at: [0.205, 0.13], on: right }} }} }}
"
    )
}

fn by(text: &str, solver: &str, ranks: usize) -> Results {
    Results::of(&format!("{text}solver: {solver}\n"), ranks)
}

/// Bodies without load, before or after contact, have forces of rounding size only. The staggered
/// strategy ends its sweeps there as Newton's method ends its corrections. It finds the results of
/// the monolithic strategy at every step.
#[test]
fn stages_end_where_no_force_is_left_on_1_2_ranks() {
    for text in [off_the_end(), flight()] {
        let monolithic = by(&text, "{ linear: direct }", 1);
        let closed = monolithic.table("contact.csv").numbers("points");
        assert!(closed.iter().any(|points| *points > 0.0) && closed.last() == Some(&0.0), "{closed:?}");
        for ranks in [1, 2] {
            let apart = apart(&monolithic, &by(&text, "{ strategy: staggered }", ranks));
            assert!(apart < 1e-7, "{ranks} ranks: {apart:.1e}");
        }
    }
}

/// Three blocks in a stack, the top one pushed back and forth.
fn stack() -> String {
    let base = body("base", [0.0, 0.0], [1.0, 0.3], [10, 3], 2e7, "");
    let middle = body("middle", [0.2, 0.3], [0.8, 0.5], [7, 3], 1e7, "");
    let top = body("top", [0.3, 0.5], [0.7, 0.7], [5, 2], 5e6, "");
    let contact = |contactor: &str, target: &str| {
        format!(
            "{{ contactor: {contactor}, target: {target}, normal: {{ penalty: {{ compliance: 1.0e-9 }} }}, \
             friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_velocity: 1.0e-4 }} }} }}, initial_overclosure: accept }}"
        )
    };
    let (lower, upper) = (contact("middle.bottom", "base.top"), contact("top.bottom", "middle.top"));
    format!(
        "dimension: 2
bodies:
{base}{middle}{top}contact:
  lower: {lower}
  upper: {upper}
boundary:
  clamp: {{ on: base.bottom, displacement: {{ x: 0, y: 0 }} }}
  weight_of_middle: {{ on: middle, gravity: [0, -9.81] }}
  weight_of_top: {{ on: top, gravity: [0, -9.81] }}
  press: {{ on: top.top, traction: {{ y: -2.0e4 }} }}
  push: {{ on: top.top, traction: {{ x: 'if(t < 0.02, 6.0e3 * sin(50 * pi * t), 0)' }} }}
start: {{ equilibrium: {{ friction: false, increments: 1 }} }}
time: {{ end: END, step: 5.0e-4, cuts: 0, scheme: {{ generalized_alpha: {{ spectral_radius: 0.8 }} }} }}
output: {{ fields: {{ every: 100 }}, probes: {{ top: {{ at: [0.3, 0.7], on: top }}, middle: {{ at: [0.8, 0.5], on: middle }} }} }}
"
    )
}

/// Blocks that are pushed back and forth on each other, whose points slip and reverse in turn. Both
/// strategies find the same result in the same steps, and no step has to be cut.
#[test]
fn slip_back_and_forth_needs_no_cut_on_1_2_ranks() {
    let monolithic = by(&stack().replace("END", "0.03"), "{ linear: direct }", 1);
    let end = ("END", "0.016");
    let ahead = by(&stack().replace(end.0, end.1), "{ linear: direct }", 1);
    for ranks in [1, 2] {
        let staggered =
            by(&stack().replace(end.0, end.1), "{ strategy: staggered, linear: cholesky }", ranks);
        let apart = apart(&ahead, &staggered);
        assert!(apart < 1e-7, "{ranks} ranks: {apart:.1e}");
    }
    assert_eq!(monolithic.record()["steps"].as_u64(), Some(60));
}

/// A box of hexahedra pressed onto another with a different mesh and dragged until all points slip, in
/// one increment. Facets turn under a penalty of a thousand times E / h, whose pressures change by far
/// more than their first-order part. With the pressures of the iterate in the tangent it takes 58
/// corrections and a cut step, with the linearised ones 5.
#[test]
fn slip_under_a_stiff_penalty_takes_few_corrections_on_1_2_3_ranks() {
    let text = "
dimension: 3
bodies:
  lower:
    mesh: { box: { min: [0, 0, 0], max: [1, 1, 0.5], cells: [6, 6, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    kinematics: finite
  upper:
    mesh: { box: { min: [0, 0, 0.5], max: [1, 1, 1], cells: [5, 5, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    kinematics: finite
contact:
  joint:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.6667e-11 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 6.0e10 } } }
boundary:
  base: { on: lower.bottom, displacement: { x: 0, y: 0, z: 0 } }
  press: { on: upper.top, displacement: { x: \"0.02 * t\", y: 0, z: \"-0.005 * t\" } }
time: { end: 1, scheme: { static: { increments: 1 } } }
solver: { linear: direct, newton: { inexact: false, tolerance: 1.0e-8 } }
output: { probes: { corner: { at: [1, 1, 1], on: upper } } }
";
    let alone = Results::of(text, 1);
    let iterations = alone.table("iterations.csv");
    let counts = iterations.numbers("iteration");
    assert!(counts.last().is_some_and(|count| *count <= 8.0) && counts.len() <= 9, "{counts:?}");
    for ranks in [2, 3] {
        let apart = apart(&alone, &Results::of(text, ranks));
        assert!(apart < 1e-7, "{ranks} ranks: {apart}");
    }
}
