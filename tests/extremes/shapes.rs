//! Wedges, spikes, cliffs and internal edges, after K. Erleben's set of scenes that break contact algorithms (2018).

use crate::row::{Results, Row, Verdict};

/// A body of rubber: `cells` of the box from `low` to `high`, bent by `map`.
fn body(name: &str, low: [f64; 2], high: [f64; 2], cells: [u32; 2], map: &str) -> String {
    let map = if map.is_empty() { String::new() } else { format!(", map: {{ {map} }}") };
    format!(
        "  {name}:\n    mesh: {{ box: {{ min: {low:?}, max: {high:?}, cells: {cells:?}, element: quad4{map} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    density: 1000\n"
    )
}

/// `upper` falls onto `lower`, which stands on its bottom; surfaces of the upper one meet those of the lower one.
fn scene(title: &str, upper: &str, lower: &str, pairs: &[(&str, &str)], friction: &str, end: f64) -> String {
    let contacts: String = pairs
        .iter()
        .enumerate()
        .map(|(number, (upper, lower))| {
            format!(
                "  c{number}: {{ contactor: {upper}, target: {lower}, normal: {{ penalty: {{ compliance: 1e-8 }} }}, \
                 friction: {friction}, quadrature: gauss, initial_overclosure: accept }}\n"
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

/// The weight of the upper body is what the contacts carry when it has come to rest.
fn carries(contacts: usize, weight: f64) -> impl Fn(&[Results]) -> Verdict {
    move |results| {
        let up: f64 = (0..contacts).map(|number| results[0].contact(&format!("c{number}")).last("force_y")).sum();
        Verdict::close(up, weight, 0.02)
    }
}

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let group = "shapes";
    let ground = body("lower", [-0.6, -0.3], [0.6, 0.0], [12, 3], "");
    let mut rows = Vec::new();
    // A wedge of a right angle sinks into a groove of the same angle: 0.5 m2 less the corner cut off.
    let groove = body("lower", [-0.6, -0.6], [0.6, 0.0], [12, 4], "y: \"y + (y + 0.6) / 0.6 * abs(x)\"");
    let wedge = body("upper", [-0.4, 0.0], [0.4, 0.4], [8, 4], "y: \"y + (0.4 - y) / 0.4 * abs(x) + 0.001\"");
    let case = scene("Wedge in a groove", &wedge, &groove, &[("upper.bottom", "lower.top")], RUBBED, 1.0);
    rows.push(Row::new(group, "wedge in a groove of its angle", vec![case], carries(1, 1600.0)).quick());
    // A spike of 2 cm width at its tip, on flat ground: it stands, or falls over and lies.
    let taper = "x: \"x * (0.025 + 0.975 * y / 0.4)\", y: \"y + 0.001\"";
    let spike = body("upper", [-0.4, 0.0], [0.4, 0.4], [8, 8], taper);
    let sides = [("upper.bottom", "lower.top"), ("upper.left", "lower.top"), ("upper.right", "lower.top")];
    let case = scene("Spike on a plane", &spike, &ground, &sides, RUBBED, 0.3);
    rows.push(Row::new(group, "spike on flat ground", vec![case], carries(3, 1640.0)));
    // Tip on tip, exactly and a little aside: it may slide off, and not through.
    let flanks = [
        ("upper.bottom", "lower.top"),
        ("upper.left", "lower.right"),
        ("upper.right", "lower.left"),
        ("upper.bottom", "lower.left"),
        ("upper.bottom", "lower.right"),
        ("upper.left", "lower.top"),
        ("upper.right", "lower.top"),
    ];
    let stake = body("lower", [-0.4, -0.4], [0.4, 0.0], [8, 8], "x: \"x * (0.025 + 0.975 * (-y) / 0.4)\"");
    for aside in [0.0, 0.012, 0.05] {
        let taper = format!("x: \"{aside} + x * (0.025 + 0.975 * y / 0.4)\", y: \"y + 0.001\"");
        let spike = body("upper", [-0.4, 0.0], [0.4, 0.4], [8, 8], &taper);
        let case = scene("Spike on spike", &spike, &stake, &flanks, "none", 0.2);
        let row = Row::new(group, format!("spike on spike, {aside} m aside"), vec![case], |results| {
            let carried: f64 = (0..7)
                .map(|number| results[0].contact(&format!("c{number}")).numbers("force_y").iter().sum::<f64>())
                .sum();
            let fall = results[0].table("probes.csv").last("upper.u_y");
            // Freely it would fall by 0.2 m.
            Verdict::says(format!("falls by {:.4} m", -fall), "less than freely, 0.2 m, by a tenth", fall > -0.18 && carried > 0.0)
        });
        rows.push(row.or_refused(&[5, 6]));
    }
    // A block that stands with two fifths of its length over a cliff.
    let cliff = body("lower", [-1.0, -0.3], [0.08, 0.0], [9, 3], "");
    let block = body("upper", [-0.4, 0.0], [0.4, 0.4], [8, 4], "");
    let pairs = [("upper.bottom", "lower.top"), ("upper.bottom", "lower.right")];
    let case = scene("Block on a cliff", &block, &cliff, &pairs, RUBBED, 0.6);
    rows.push(Row::new(group, "block over the edge of a cliff", vec![case], carries(2, 3200.0)));
    // Over internal edges nothing snags: without friction a block that is pushed feels no force along the ground.
    let case = scene("Internal edges", &block, &ground, &[("upper.bottom", "lower.top")], "none", 0.3)
        .replace("    density: 1000\n  lower", "    density: 1000\n    initial_velocity: [0.5, 0]\n  lower");
    rows.push(Row::new(group, "slides over internal edges", vec![case], |results| {
        let table = results[0].contact("c0");
        let (along, up) = (table.numbers("force_x"), table.numbers("force_y"));
        let most = along.iter().fold(0.0, |most: f64, force| most.max(force.abs()));
        let weight = up.iter().copied().fold(0.0, f64::max);
        Verdict::says(format!("{:.1e} of the weight along", most / weight), "at most 0.02", most <= 0.02 * weight)
    }));
    rows
}
