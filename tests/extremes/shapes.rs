//! Wedges, spikes, cliffs and internal edges, after K. Erleben's set of scenes that break contact
//! algorithms (2018).

use crate::row::{Results, Row, Verdict};

/// A body of rubber: `cells` of the box from `low` to `high`, mapped by `map`.
fn body(name: &str, low: [f64; 2], high: [f64; 2], cells: [u32; 2], map: &str) -> String {
    let map = if map.is_empty() { String::new() } else { format!(", map: {{ {map} }}") };
    format!(
        "  {name}:\n    mesh: {{ box: {{ min: {low:?}, max: {high:?}, cells: {cells:?}, element: quad4{map} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    density: 1000\n"
    )
}

/// `upper` falls onto `lower`, which stands on its bottom. Surfaces of the upper body touch those
/// of the lower one.
fn scene(title: &str, upper: &str, lower: &str, pairs: &[(&str, &str)], friction: &str, end: f64) -> String {
    let contacts: String = pairs
        .iter()
        .enumerate()
        .map(|(number, (upper, lower))| {
            format!(
                "  c{number}: {{ contactor: {upper}, target: {lower}, normal: {{ penalty: {{ compliance: 1e-8 }} }}, \
                 friction: {friction}, initial_overclosure: accept }}\n"
            )
        })
        .collect();
    format!(
        "title: {title}\ndimension: 2\nbodies:\n{upper}{lower}contact:\n{contacts}\
         boundary:\n  ground: {{ on: lower.bottom, displacement: {{ x: 0, y: 0 }} }}\n  weight: {{ on: upper, gravity: [0, -10] }}\n\
         time: {{ end: {end}, step: 2e-3, scheme: backward_euler }}\n\
         output: {{ fields: {{ every: 100 }}, probes: {{ upper: {{ at: [0, 0.4], on: upper }} }} }}\n"
    )
}

const RUBBED: &str = "{ coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1e7 } } }";

/// The mean contact force of the second half of the run equals the weight of the upper body.
fn carries(weight: f64) -> impl Fn(&[Results]) -> Verdict {
    move |results| {
        let up = results[0].contact("c0").numbers("force_y");
        let late = &up[up.len() / 2..];
        Verdict::close(late.iter().sum::<f64>() / late.len() as f64, weight, 0.02)
    }
}

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let group = "shapes";
    let ground = body("lower", [-0.6, -0.3], [0.6, 0.0], [12, 3], "");
    let mut rows = Vec::new();
    // A wedge of a right angle sinks into a groove of the same angle: 0.48 m2.
    let groove = body("lower", [-0.6, -0.6], [0.6, 0.0], [12, 4], "y: \"y + (y + 0.6) / 0.6 * abs(x)\"");
    let wedge = body("upper", [-0.4, 0.0], [0.4, 0.8], [8, 6], "y: \"y + (0.8 - y) / 0.8 * abs(x) + 0.001\"");
    let case = scene("Wedge in a groove", &wedge, &groove, &[("upper.bottom", "lower.top")], RUBBED, 1.0);
    rows.push(Row::new(group, "wedge in a groove of its angle", vec![case], carries(4800.0)).quick());
    // Spikes of 28 degrees: a block of 0.2 m width whose bottom, or top, is drawn out to a tip.
    let drawn = |aside: f64| format!("x: \"x + {aside}\", y: \"y + (0.6 - y) / 0.6 * 4 * abs(x) + 0.001\"");
    let spike = |aside| body("upper", [-0.1, 0.0], [0.1, 0.6], [8, 8], &drawn(aside));
    let stake = body("lower", [-0.1, -0.6], [0.1, 0.0], [8, 8], "y: \"y - (y + 0.6) / 0.6 * 4 * abs(x)\"");
    let onto = [("upper.bottom", "lower.top")];
    // 0.12 m2 less the 0.04 m2 beside the tip.
    let case = scene("Spike on a plane", &spike(0.0), &ground, &onto, RUBBED, 1.0);
    rows.push(Row::new(group, "spike on flat ground", vec![case], carries(800.0)).or_refused(&[5, 6]));
    for aside in [0.0, 0.004, 0.02] {
        let case = scene("Spike on spike", &spike(aside), &stake, &onto, "none", 0.2);
        let row = Row::new(group, format!("spike on spike, {aside} m aside"), vec![case], |results| {
            let met = results[0].contact("c0").numbers("force_y").iter().any(|force| *force > 0.0);
            let fall = results[0].table("probes.csv").last("upper.u_y");
            Verdict::says(
                format!("met, falls by {:.4} m", -fall),
                "met, less than freely, 0.2 m",
                met && fall > -0.199,
            )
        });
        let row = row.or_refused(&[5, 6]);
        rows.push(if aside == 0.004 { row.quick() } else { row });
    }
    // A block that stands with two fifths of its length over a cliff.
    let cliff = body("lower", [-1.0, -0.3], [0.08, 0.0], [9, 3], "");
    let block = body("upper", [-0.4, 0.0], [0.4, 0.4], [8, 4], "");
    let case = scene("Block on a cliff", &block, &cliff, &onto, RUBBED, 1.5);
    rows.push(Row::new(group, "block over the edge of a cliff", vec![case], carries(3200.0)));
    // Over internal edges nothing snags: without friction a block that is pushed feels no force along the ground.
    let case = scene("Internal edges", &block, &ground, &[("upper.bottom", "lower.top")], "none", 0.3)
        .replace("    density: 1000\n  lower", "    density: 1000\n    initial_velocity: [0.5, 0]\n  lower");
    rows.push(Row::new(group, "slides over internal edges", vec![case], |results| {
        let table = results[0].contact("c0");
        let (along, up) = (table.numbers("force_x"), table.numbers("force_y"));
        let most = along.iter().fold(0.0, |most: f64, force| most.max(force.abs()));
        let weight = up.iter().copied().fold(0.0, f64::max);
        Verdict::says(
            format!("{:.1e} of the weight along", most / weight),
            "at most 0.02",
            most <= 0.02 * weight,
        )
    }));
    rows
}
