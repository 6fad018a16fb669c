//! Obstacles smaller than the spacing of contact points are detected. Mortar segments detect
//! contact with bodies smaller than a facet.

use crate::row::{Results, Row, Verdict};

const GROUP: &str = "between points";

/// A block with a side of 1 m and facets of 0.25 m that moves down towards the objects below it,
/// with `more` of the case.
fn block(title: &str, dimension: usize, speed: f64, bodies: &str, more: &str) -> String {
    let (low, high, cells, velocity) = match dimension {
        2 => ("[0, 0]", "[1, 0.5]", "[4, 2]", format!("[0, -{speed}]")),
        _ => ("[0, 0, 0]", "[1, 1, 0.5]", "[4, 4, 2]", format!("[0, 0, -{speed}]")),
    };
    format!(
        "title: {title}\ndimension: {dimension}\nbodies:\n  block:\n    mesh: {{ box: {{ min: {low}, max: {high}, cells: {cells} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e7, poisson_ratio: 0.3 }} }}\n    density: 1000\n    initial_velocity: {velocity}\n\
         {bodies}{more}time: {{ end: 0.2, step: 2e-3, scheme: backward_euler, cuts: 3 }}\n"
    )
}

fn contact(contactor: &str, target: &str) -> String {
    format!(
        "contact:\n  hit: {{ contactor: {contactor}, target: {target}, normal: {{ penalty: {{ compliance: 1e-10 }} }}, friction: none }}\n"
    )
}

/// The block above a body `pin`, which is fixed at its foot and ends 0.05 m below the block.
fn pin(dimension: usize, speed: f64, mesh: &str, (contactor, target): (&str, &str)) -> String {
    let held = if dimension == 2 { "x: 0, y: 0" } else { "x: 0, y: 0, z: 0" };
    let bodies = format!(
        "  pin:\n    mesh: {{ box: {{ {mesh} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e8, poisson_ratio: 0.3 }} }}\n    density: 1000\n"
    );
    let foot = format!("boundary:\n  foot: {{ on: pin.bottom, displacement: {{ {held} }} }}\n");
    block("Pin between points", dimension, speed, &bodies, &format!("{}{foot}", contact(contactor, target)))
}

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    obstacles(&mut rows);
    bodies(&mut rows);
    pressed(&mut rows);
    seen(&mut rows);
    rows
}

/// A disc or cylinder smaller than the spacing of the contact points is not missed.
fn obstacles(rows: &mut Vec<Row>) {
    let hit = contact("block.bottom", "pin");
    for (name, radius, speed) in
        [("disc, radius 0.01 m", 0.01, 1.0), ("disc, radius 1e-4 m, swept over in a step", 1e-4, 100.0)]
    {
        let pin =
            format!("obstacles:\n  pin: {{ sphere: {{ center: [0.375, -0.05], radius: {radius:e} }} }}\n");
        let case = block("Disc between points", 2, speed, "", &format!("{pin}{hit}"));
        rows.push(Row::refused(GROUP, name, case, &[5], "points of 1 facets").quick());
    }
    for (name, axis, facets) in [
        ("cylinder, radius 1e-3 m, swept over in a step", "[0, 1, 0]", "points of 4 facets"),
        ("cylinder aslant, swept over in a step, on 3 ranks", "[1, 1, 0.01]", "contact points of"),
    ] {
        let pin = format!(
            "obstacles:\n  pin: {{ cylinder: {{ point: [0.375, 0.375, -0.05], axis: {axis}, radius: 1e-3 }} }}\n"
        );
        let case = block("Cylinder between points", 3, 100.0, "", &format!("{pin}{hit}"));
        let row = Row::refused(GROUP, name, case, &[5], facets).quick();
        rows.push(if name.ends_with("ranks") { row.on(3) } else { row });
    }
}

/// The bodies touched in any step.
fn touched(results: &[Results]) -> Verdict {
    let most =
        results[0].contact("hit").numbers("points").iter().fold(0.0_f64, |most, points| most.max(*points));
    Verdict::says(format!("{most} points"), "met", most > 0.0)
}

/// Contact with a body, a tip or an edge between two vertices is found, on any number of ranks. A
/// body that would be passed within one step is not missed.
fn bodies(rows: &mut Vec<Row>) {
    let plane = "min: [0.365, -0.35], max: [0.385, -0.05], cells: [2, 6]";
    let spike = "min: [0.225, -0.35], max: [0.525, -0.05], cells: [6, 6], map: { y: \"y - (y + 0.35) / 0.3 * 1.5 * abs(x - 0.375)\" }";
    let solid = "min: [0.36, 0.36, -0.35], max: [0.38, 0.38, -0.05], cells: [1, 1, 6]";
    let blade = "min: [0.36, -0.5, -0.35], max: [0.38, 1.5, -0.05], cells: [1, 1, 6]";
    let roles = ("block.bottom", "pin.top");
    for (name, dimension, speed, mesh, ranks) in [
        ("pin of 0.02 m", 2, 1.0, plane, &[0, 3][..]),
        ("pin of 0.02 m, passed in a step", 2, 300.0, plane, &[0, 2]),
        ("spike of 67 degrees", 2, 1.0, spike, &[0]),
        ("pin in space", 3, 2.0, solid, &[0, 4]),
        ("pin in space, passed in a step", 3, 300.0, solid, &[0]),
        ("edge of a blade, no node of which is near", 3, 1.0, blade, &[0, 2]),
    ] {
        for &ranks in ranks {
            let name = if ranks == 0 { name.to_owned() } else { format!("{name}, on {ranks} ranks") };
            let case = pin(dimension, speed, mesh, roles);
            let row = match speed > 100.0 {
                true => Row::refused(GROUP, name, case, &[5], "would pass through"),
                false => Row::new(GROUP, name, vec![case], touched),
            };
            rows.push(row.on(ranks).quick());
        }
    }
}

/// Contact with a pin that fits between vertices, and is pressed in by less than their spacing, is
/// also found in statics, where no velocity carries it further. A disc, which has no mesh, is
/// refused.
fn pressed(rows: &mut Vec<Row>) {
    let held = |dimension: usize| if dimension == 2 { "x: 0, y: 0" } else { "x: 0, y: 0, z: 0" };
    let press = |case: String, dimension: usize, depth: f64| {
        let (up, aside) = if dimension == 2 { ("y", "x: 0") } else { ("z", "x: 0, y: 0") };
        let push = format!(
            "  push: {{ on: block.top, displacement: {{ {aside}, {up}: \"-{:e} * t\" }} }}\n",
            0.05 + depth
        );
        let (_, rest) = case.split_once("initial_velocity: ").unwrap_or_default();
        let velocity = format!("    initial_velocity: {}\n", rest.lines().next().unwrap_or_default());
        let time = case.lines().last().unwrap_or_default().to_owned();
        let boundary = if case.contains("boundary:") { "" } else { "boundary:\n" };
        case.replace(&velocity, "").replace(
            &time,
            &format!("{boundary}{push}time: {{ end: 1, scheme: {{ static: {{ increments: 10 }} }} }}"),
        )
    };
    let roles = ("block.bottom", "pin.top");
    let blunt = "min: [0.315, -0.35], max: [0.435, -0.05], cells: [1, 6]";
    let post = "min: [0.315, 0.315, -0.35], max: [0.435, 0.435, -0.05], cells: [1, 1, 4]";
    for (name, dimension, mesh) in [("blunt pin", 2, blunt), ("blunt pin in space", 3, post)] {
        let case = press(pin(dimension, 1.0, mesh, roles), dimension, 0.012);
        assert!(case.contains(held(dimension)));
        let row = |name: String| Row::new(GROUP, name, vec![case.clone()], touched).quick();
        rows.push(row(format!("{name}, pressed in by a twentieth of a facet")));
        if dimension == 3 {
            rows.push(row(format!("{name}, pressed in, on 3 ranks")).on(3));
        }
    }
    let disc = "obstacles:\n  pin: { sphere: { center: [0.375, -0.1], radius: 0.05 } }\n";
    let hit = contact("block.bottom", "pin");
    let case = press(block("Disc pressed", 2, 1.0, "", &format!("{disc}{hit}")), 2, 0.02);
    let words = "points of 1 facets";
    rows.push(
        Row::refused(GROUP, "disc, pressed in by less than half of its radius", case, &[5], words).quick(),
    );
    // Tips that points meet in time, and what is wider than their distance.
    let met = |results: &[Results]| {
        let (most, cuts) =
            (results[0].contact("hit").last("points"), results[0].record()["cut_steps"].as_u64());
        Verdict::says(format!("{most} points, {cuts:?} cuts"), "met, none cut", most > 0.0 && cuts == Some(0))
    };
    let wedge = |slope: &str| {
        format!(
            "min: [0.225, -0.35], max: [0.525, -0.05], cells: [6, 6], map: {{ y: \"y - (y + 0.35) / 0.3 * {slope}\" }}"
        )
    };
    let pyramid = "min: [0.125, 0.125, -0.35], max: [0.625, 0.625, -0.05], cells: [8, 8, 4], map: { z: \"z - (z + 0.35) / 0.3 * 0.5 * (abs(x - 0.375) + abs(y - 0.375))\" }";
    let slab = "min: [0.24, -0.35], max: [0.51, -0.05], cells: [9, 6]";
    for (name, dimension, mesh) in [
        ("wedge of a right angle", 2, wedge("abs(x - 0.375)")),
        ("wedge of a right angle that leans", 2, wedge("max(0.55 * (x - 0.375), -1.8 * (x - 0.375))")),
        ("pin wider than the points are apart", 2, slab.to_owned()),
    ] {
        let depth = if name.starts_with("pin") { 0.01 } else { 0.08 };
        let case = press(pin(dimension, 1.0, &mesh, roles), dimension, depth);
        rows.push(Row::new(GROUP, format!("{name}, pressed in"), vec![case], met).quick());
    }
    // The mean gap over the facets around a tip may stay open. The run warns of it.
    let warned = |results: &[Results]| {
        let warnings = results[0].record()["warnings"].to_string();
        Verdict::says(warnings.clone(), "a warning", warnings.contains("facets) between two vertices"))
    };
    let case = press(pin(3, 1.0, pyramid, roles), 3, 0.08);
    rows.push(Row::new(GROUP, "pyramid, pressed in", vec![case], warned).quick());
}

/// Contact found by points is not cut, also near an end, at a corner, or with the roles exchanged.
fn seen(rows: &mut Vec<Row>) {
    let met = |results: &[Results]| {
        let most = results[0].contact("hit").numbers("points").iter().fold(0.0_f64, |m, p| m.max(*p));
        let cuts = results[0].record()["cut_steps"].as_u64();
        Verdict::says(format!("{most} points, {cuts:?} cuts"), "met, none cut", most > 0.0 && cuts == Some(0))
    };
    let plane = "min: [0.365, -0.35], max: [0.385, -0.05], cells: [2, 6]";
    let slab = |low: f64, high: f64, cells: u32| {
        format!("min: [{low}, -0.35], max: [{high}, -0.05], cells: [{cells}, 3]")
    };
    let both = contact("block.bottom", "pin.top")
        + "  back: { contactor: pin.top, target: block.bottom, normal: { penalty: { compliance: 1e-10 } }, friction: none }\n";
    for (name, case) in [
        ("pin of 0.02 m, as the contactor", pin(2, 1.0, plane, ("pin.top", "block.bottom"))),
        (
            "pin of 0.02 m, in both roles, sunk in by the penalty",
            pin(2, 1.0, plane, ("pin.top", "block.bottom"))
                .replace(
                    &contact("pin.top", "block.bottom"),
                    &both.replace("hit:", "fro:").replace("back:", "hit:"),
                )
                .replace("compliance: 1e-10", "compliance: 5e-9")
                .replace("young_modulus: 1e8", "young_modulus: 1e10"),
        ),
        ("slab that ends before a point", pin(2, 1.0, &slab(-1.0, 0.52, 40), ("block.bottom", "pin.top"))),
        (
            "slab that ends before a point, sunk in by the penalty",
            pin(2, 1.0, &slab(-1.0, 0.52, 40), ("block.bottom", "pin.top"))
                .replace("compliance: 1e-10", "compliance: 6e-6"),
        ),
        ("slab of coarser facets", pin(2, 1.0, &slab(-0.7, 1.6, 5), ("block.bottom", "pin.top"))),
        ("round and fine", {
            let arc = "min: [-0.375, -0.35], max: [1.125, -0.05], cells: [60, 3], map: { y: \"y - (y + 0.35) / 0.3 * 0.25 * (x - 0.375)^2\" }";
            pin(2, 1.0, arc, ("block.bottom", "pin.top"))
        }),
    ] {
        rows.push(Row::new(GROUP, name, vec![case], met).quick());
    }
    // Over the end of the slab and off it: the corner of the slab passes along all facets of the block.
    let off = pin(2, 0.5, &slab(-1.0, 0.77, 30), ("block.bottom", "pin.top"))
        .replace("initial_velocity: [0, -0.5]", "initial_velocity: [6, -0.5]")
        .replace("-0.05]", "-0.002]")
        .replace("boundary:\n", "boundary:\n  weight: { on: block, gravity: [0, -10] }\n");
    rows.push(Row::new(GROUP, "block that slides off an end", vec![off], met).quick());
}
