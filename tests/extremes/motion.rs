//! Dynamic rows: friction, stick velocity, steps, speeds, densities, thin targets.

use crate::row::{Results, Row, Verdict};
use crate::scenes::{Drag, Slider};

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    friction(&mut rows);
    steps(&mut rows);
    speeds(&mut rows);
    thin(&mut rows);
    zero_density(&mut rows);
    rows
}

/// Friction over normal force is `mu min(v / eps, 1)`, and the normal force equals the load.
fn slides(group: &'static str, name: String, slider: Slider) -> Row {
    Row::new(group, name, vec![slider.case()], move |results| {
        let table = results[0].contact("sole");
        let (normal, tangential) = (table.last("force_n"), table.last("force_t").abs());
        let load = Verdict::close(normal, slider.load, 1e-3);
        let friction = match slider.friction {
            0.0 => Verdict::near(tangential, 0.0, 0.0),
            _ => Verdict::close(tangential / normal, slider.ratio(), 1e-7),
        };
        friction.and(load)
    })
}

fn friction(rows: &mut Vec<Row>) {
    for friction in [0.0, 1e-6, 1.0, 10.0, 1e3] {
        let row = slides("friction", format!("{friction:.0e}, slips"), Slider { friction, ..Slider::BASE });
        rows.push(if friction == 0.0 || friction == 1e3 { row.quick() } else { row });
    }
    for friction in [1.0, 10.0, 1e3] {
        let case = Drag { friction, ..Drag::BASE }.case();
        let row =
            Row::new("friction", format!("{friction:.0e}, dragged block"), vec![case], move |results| {
                let table = results[0].contact("sole");
                let (normal, tangential) = (table.last("force_n"), table.last("force_t").abs());
                let (points, stick) = (table.last("points"), table.last("stick"));
                let below = tangential <= friction * normal * (1.0 + 1e-9) && points > 0.0;
                let told =
                    format!("{:.4} of mu N, {stick} of {points} stick", tangential / (friction * normal));
                Verdict::says(told, "at most mu N", below)
            });
        rows.push(if friction == 1e3 { row.quick() } else { row });
    }
    for exponent in 0..=9 {
        let stick_velocity = format!("1e-{exponent}").parse().unwrap_or(f64::NAN);
        let name = format!("1e-{exponent}");
        let slider = Slider { stick_velocity, speed: 1e-2, ..Slider::BASE };
        let row = slides("stick velocity [m/s]", format!("{name}, at 0.01 m/s"), slider);
        rows.push(if exponent == 9 { row.quick() } else { row });
        rows.push(creeps(name, stick_velocity));
    }
}

/// A block that sticks on an incline of half of its coefficient creeps with half of the stick
/// velocity.
fn creeps(name: String, stick_velocity: f64) -> Row {
    let case = format!(
        "title: Block that creeps\ndimension: 2\n\
         bodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [4, 2], element: quad4 }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e9, poisson_ratio: 0.3 }} }}\n    density: 1000\n\
         obstacles:\n  incline: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
         contact:\n  base:\n    contactor: block.bottom\n    target: incline\n    normal: {{ penalty: {{ compliance: 1e-11 }} }}\n    \
         friction: {{ coulomb: {{ coefficient: 1, regularization: {{ stick_velocity: {stick_velocity:e} }} }} }}\n    initial_overclosure: accept\n\
         boundary:\n  weight: {{ on: block, gravity: [\"if(t < 0.1, 2.5 * (1 - cos(10*pi*t)), 5)\", -10] }}\n\
         start: {{ equilibrium: {{ friction: false, increments: 1 }} }}\n\
         time: {{ end: 1, step: 0.02, scheme: backward_euler }}\n\
         output: {{ probes: {{ centre: {{ at: [0.5, 0.25] }} }} }}\n"
    );
    Row::new("stick velocity [m/s]", format!("{name}, creeps on an incline"), vec![case], move |results| {
        let (probes, base) = (results[0].table("probes.csv"), results[0].contact("base"));
        let speed = probes.last("centre.v_x");
        let ratio = Verdict::close(base.last("force_t").abs() / base.last("force_n"), 0.5, 1e-2);
        if stick_velocity >= 1e-4 {
            return ratio.and(Verdict::close(speed, 0.5 * stick_velocity, 1e-3));
        }
        // The shear at the base is elastic first, and levels out over lengths of stick_velocity times the time: the
        // points do not creep alike yet.
        let holds =
            (0.2..1.0).contains(&(speed / stick_velocity)) && base.last("stick") == base.last("points");
        ratio.and(Verdict::says(
            format!("creeps with {:.3}", speed / stick_velocity),
            "0.2 to 1, all stick",
            holds,
        ))
    })
}

/// A block that slides and may bounce loses about `mu g` of its speed per second. It loses `mu`
/// times the impulse from below exactly, for every number of steps.
fn steps(rows: &mut Vec<Row>) {
    for (name, step) in
        [("1e-2, the whole run", 1e-2), ("1e-3", 1e-3), ("1e-4", 1e-4), ("1e-5", 1e-5), ("1e-6", 1e-6)]
    {
        let case = format!(
            "title: Block that slides\ndimension: 2\n\
             bodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.25], cells: [2, 1], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e9, poisson_ratio: 0.3 }} }}\n    density: 1000\n    initial_velocity: [1, 0]\n\
             obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  sole:\n    contactor: block.bottom\n    target: floor\n    normal: {{ penalty: {{ compliance: 1e-11 }} }}\n    \
             friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_velocity: 1e-3 }} }} }}\n    initial_overclosure: accept\n\
             boundary:\n  weight: {{ on: block, gravity: [0, -10] }}\n\
             start: {{ equilibrium: {{ friction: false, increments: 1 }} }}\n\
             time: {{ end: 1e-2, step: {step:e}, scheme: {{ generalized_alpha: {{ spectral_radius: 0.5 }} }} }}\n\
             output: {{ fields: {{ every: 100000 }} }}\n"
        );
        // 250 kg: the impulse of friction is what the momentum has lost.
        let row = Row::new("step [s]", format!("{name}, free to bounce"), vec![case], |results| {
            let momentum = results[0].table("momentum.csv");
            let [x, y] =
                ["linear_x", "linear_y"].map(|column| momentum.last(column) - momentum.numbers(column)[0]);
            // Of 2500 N of weight for 10 ms; and of what the block has bounced.
            Verdict::close(-x, 12.5, 0.1).and(Verdict::close(-x, 0.5 * (25.0 + y), 1e-6))
        });
        rows.push(if step >= 1e-3 { row.quick() } else { row });
    }
}

/// A bar thrown against a plane carries `rho c v` until its wave has returned, and rebounds with
/// its initial speed.
fn speeds(rows: &mut Vec<Row>) {
    for exponent in -6..=3 {
        let speed = 10f64.powi(exponent);
        // As soft as rubber at 1 m/s and as stiff as needs be beyond: the wave takes 100 m/s at least, and 0.01 s back and forth.
        let (young, density, length) = (1e7f64, 1000.0f64, 1.0);
        let wave = (young / density).sqrt();
        let (step, end) = (5e-4, 0.03);
        let gap = 0.5 * speed * step;
        let case = |scheme: &str| {
            format!(
                "title: Bar thrown at a plane\ndimension: 2\n\
             bodies:\n  bar:\n    mesh: {{ box: {{ min: [0, {gap:e}], max: [0.1, {:e}], cells: [1, 20], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: {young:e}, poisson_ratio: 0 }} }}\n    density: {density}\n    initial_velocity: [0, -{speed:e}]\n\
             obstacles:\n  wall: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  tip: {{ contactor: bar.bottom, target: wall, normal: {{ penalty: {{ compliance: 1e-9 }} }}, friction: none }}\n\
             time: {{ end: {end}, step: {step:e}, scheme: {scheme}, cuts: 8 }}\n",
                gap + length,
            )
        };
        let alpha = "{ generalized_alpha: { spectral_radius: 0.8 } }";
        let name = format!("1e{exponent}, onto a plane");
        let judge = move |results: &[Results]| {
            let (tip, momentum) = (results[0].contact("tip"), results[0].table("momentum.csv"));
            let (before, after) = (momentum.numbers("linear_y")[0], momentum.last("linear_y"));
            let forces = tip.numbers("force_n");
            let impulse = forces.iter().sum::<f64>() * step / (2.0 * before.abs());
            if speed > 5.0 {
                // No closed form at such strains: it must have been met, and thrown back without what it did not have.
                let holds = after > 0.0 && after <= -before;
                return Verdict::says(
                    format!("flies back with {:.3}", -after / before),
                    "between 0 and 1",
                    holds,
                );
            }
            let mean = forces.iter().filter(|f| **f > 0.0).sum::<f64>()
                / forces.iter().filter(|f| **f > 0.0).count().max(1) as f64;
            let plateau = Verdict::close(mean, density * wave * speed * 0.1, 0.12);
            plateau.and(Verdict::close(-after / before, 1.0, 0.05)).and(Verdict::close(impulse, 1.0, 0.05))
        };
        // At ten times the wave speed the bar is pressed to 1 / 200 of its length: only a scheme that damps carries that.
        if exponent == 3 {
            let name = format!("1e{exponent}, onto a plane, backward Euler");
            rows.push(Row::new("speed [m/s]", name, vec![case("backward_euler")], judge).quick());
        }
        let row = Row::new("speed [m/s]", name, vec![case(alpha)], judge);
        let row = if exponent >= 2 { row.or_refused(&[5, 6]) } else { row };
        rows.push(if exponent == -6 || exponent == 3 { row.quick() } else { row });
    }
}

/// A bullet that would be on the other side of a thin target after one step.
fn thin(rows: &mut Vec<Row>) {
    let scene = |speed: f64, step: f64, target: &str, bodies: &str, boundary: &str| {
        let probe = if bodies.is_empty() { "" } else { ", plate: { at: [0, 0], on: plate }" };
        format!(
            "title: Bullet and thin target\ndimension: 2\n\
             bodies:\n{bodies}  bullet:\n    mesh: {{ box: {{ min: [-0.05, 0.15], max: [0.05, 0.25], cells: [6, 6], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e9, poisson_ratio: 0.3 }} }}\n    density: 1000\n    initial_velocity: [0, -{speed:e}]\n\
             {target}normal: {{ penalty: {{ compliance: 1e-11 }} }}, friction: none }}\n{boundary}\
             time: {{ end: {:e}, step: {step:e}, scheme: backward_euler, cuts: 6 }}\n\
             output: {{ probes: {{ bullet: {{ at: [0, 0.2], on: bullet }}{probe} }} }}\n",
            (4.0 * step).max(0.3 / speed),
        )
    };
    let plate = "  plate:\n    mesh: { box: { min: [-0.5, -0.01], max: [0.5, 0], cells: [20, 1], element: quad4 } }\n    \
                 material: { neo_hookean: { young_modulus: 1e9, poisson_ratio: 0.3 } }\n    density: 1000\n";
    let held = "boundary:\n  left: { on: plate.left, displacement: { x: 0, y: 0 } }\n  right: { on: plate.right, displacement: { x: 0, y: 0 } }\n";
    let onto_plate = "contact:\n  hit: { contactor: bullet.bottom, target: plate.top, ";
    let ball = "obstacles:\n  ball: { sphere: { center: [0, 0], radius: 0.05 } }\ncontact:\n  hit: { contactor: bullet.bottom, target: ball, ";
    let met = |results: &[Results]| {
        let probes = results[0].table("probes.csv");
        let up = if probes.names().any(|name| name.starts_with("bullet.u_z")) { "z" } else { "y" };
        let bullet = probes.numbers(&format!("bullet.u_{up}"));
        let plate = if probes.names().any(|name| name.starts_with("plate")) {
            probes.numbers(&format!("plate.u_{up}"))
        } else {
            vec![0.0; bullet.len()]
        };
        let nearest = bullet
            .iter()
            .zip(&plate)
            .map(|(bullet, plate)| 0.2 + bullet - plate)
            .fold(f64::INFINITY, f64::min);
        let momentum = results[0].table("momentum.csv").numbers(&format!("linear_{up}"));
        let most = momentum.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let part = (most - momentum[0]) / momentum[0].abs();
        let told = format!("no nearer than {nearest:.3} m, {part:.3} of the momentum given back");
        Verdict::says(told, "on its own side, 0.05 to 2", nearest > 0.0 && (0.05..=2.001).contains(&part))
    };
    for (speed, step) in [(1.0, 1e-2), (10.0, 1e-2), (1e2, 1e-2), (1e3, 1e-3), (1e3, 1e-4)] {
        let name = format!("{speed:.0e}, thin plate, {step:.0e} s a step");
        let row = Row::new("speed [m/s]", name, vec![scene(speed, step, onto_plate, plate, held)], met)
            .or_refused(&[5, 6]);
        // In steps of its own thickness a slow bullet comes to lie where points lose their weight; a fast one gets there in short steps.
        rows.push(if step != 1e-2 || speed == 1.0 { row.quick() } else { row });
        let name = format!("{speed:.0e}, rigid disc, {step:.0e} s a step");
        let row =
            Row::new("speed [m/s]", name, vec![scene(speed, step, ball, "", "")], met).or_refused(&[5, 6]);
        rows.push(if step == 1e-3 { row.quick() } else { row });
    }
    let solid = scene(1e3, 1e-3, onto_plate, plate, held)
        .replace("dimension: 2", "dimension: 3")
        .replace(
            "min: [-0.05, 0.15], max: [0.05, 0.25], cells: [6, 6], element: quad4",
            "min: [-0.05, -0.05, 0.15], max: [0.05, 0.05, 0.25], cells: [2, 2, 2]",
        )
        .replace(
            "min: [-0.5, -0.01], max: [0.5, 0], cells: [20, 1], element: quad4",
            "min: [-0.2, -0.2, -0.01], max: [0.2, 0.2, 0], cells: [8, 8, 1]",
        )
        .replace("initial_velocity: [0, -1e3]", "initial_velocity: [0, 0, -1e3]")
        .replace("{ x: 0, y: 0 }", "{ x: 0, y: 0, z: 0 }")
        .replace("bullet: { at: [0, 0.2]", "bullet: { at: [0, 0, 0.2]")
        .replace("plate: { at: [0, 0]", "plate: { at: [0, 0, 0]");
    for ranks in [0, 3] {
        let name =
            format!("1e3, thin plate in space, 1e-3 s a step{}", if ranks > 0 { ", on 3 ranks" } else { "" });
        rows.push(Row::new("speed [m/s]", name, vec![solid.clone()], met).or_refused(&[5, 6]).on(ranks));
    }
    let name = "1e+03, thin plate, 1e-3 s a step, on 3 ranks";
    let row = Row::new("speed [m/s]", name, vec![scene(1e3, 1e-3, onto_plate, plate, held)], met)
        .or_refused(&[5, 6]);
    rows.push(row.on(3).quick());
}

/// A dynamic run without mass equals the static one, step by step. With mass in only one of two
/// bodies it is the limit of small densities of the other.
fn zero_density(rows: &mut Vec<Row>) {
    let case = |[block, base]: [f64; 2], scheme: &str| {
        format!(
            "title: Block without mass\ndimension: 2\nbodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [6, 3], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.4 }} }}\n    density: {block:e}\n    locking: selective_reduced\n  \
             base:\n    mesh: {{ box: {{ min: [-0.25, -0.5], max: [1.25, 0], cells: [7, 2], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e7, poisson_ratio: 0.4 }} }}\n    density: {base:e}\n    locking: selective_reduced\n\
             contact:\n  sole:\n    contactor: block.bottom\n    target: base.top\n    normal: {{ penalty: {{ compliance: 2e-10 }} }}\n    \
             friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_stiffness: 5e9 }} }} }}\n    initial_overclosure: accept\n\
             boundary:\n  ground: {{ on: base.bottom, displacement: {{ x: 0, y: 0 }} }}\n  \
             clamp: {{ on: block.top, displacement: {{ x: \"0.05 * t\", y: \"-0.02 * t\" }} }}\n\
             time: {{ end: 2, step: 0.1, scheme: {scheme} }}\nsolver: {{ newton: {{ tolerance: 1e-11 }} }}\n"
        )
    };
    let newmark = "{ newmark: { beta: 0.25, gamma: 0.5 } }";
    let alpha = "{ generalized_alpha: { spectral_radius: 0.8 } }";
    // Forces by time, on the scale of the largest.
    let forces = |results: &Results| {
        let sole = results.contact("sole");
        let (time, n, t) = (sole.numbers("time"), sole.numbers("force_n"), sole.numbers("force_t"));
        let most = n.iter().fold(0.0_f64, |m, f| m.max(*f));
        let later = time.iter().zip(n.iter().zip(&t)).filter(|(time, _)| **time > 0.0);
        later.flat_map(|(_, (n, t))| [1.0 + n / most, 1.0 + t / most]).collect::<Vec<f64>>()
    };
    let mut row = |name: &str, cases: Vec<String>, tolerance: f64| {
        let judge =
            move |results: &[Results]| Verdict::same(&forces(&results[1]), &forces(&results[0]), tolerance);
        rows.push(Row::new("density [kg/m3]", name, cases, judge).quick());
    };
    let free = case([0.0; 2], newmark);
    let start = free.find("boundary:").unwrap_or(0);
    let end = free.find("time:").unwrap_or(0);
    let free = format!("{}{}", &free[..start], &free[end..])
        .replace("contactor: block.bottom", "contactor: base.top")
        .replace("target: base.top", "target: plane")
        .replace(
            "contact:\n",
            "obstacles:\n  plane: { plane: { point: [0, 9], normal: [0, -1] } }\ncontact:\n",
        );
    let fixed = case([0.0; 2], "{ static: {} }");
    for (name, scheme) in
        [("0, Newmark, as in statics", newmark), ("0, generalised-alpha, as in statics", alpha)]
    {
        row(name, vec![fixed.clone(), case([0.0; 2], scheme)], 1e-9);
    }
    row(
        "0, the base alone, generalised-alpha",
        vec![case([1700.0, 1e-8], alpha), case([1700.0, 0.0], alpha)],
        1e-6,
    );
    let reason = "holds the body 'block', and it has no mass";
    rows.push(Row::refused("density [kg/m3]", "0, nothing holds it", free, &[3], reason).quick());
}
