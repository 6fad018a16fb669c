//! Rows in which the swept parameter changes the result, with closed forms: waves in a bar, a
//! sheared stack, a sliding block, a cylinder on a block.

use std::f64::consts::PI;

use crate::row::{Results, Row, Verdict};
use crate::scenes::Solid;

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    settling(&mut rows);
    sheared(&mut rows);
    slides(&mut rows);
    cylinders(&mut rows);
    rows
}

/// A bar as wide as long that stands on a plane, with fixed sides, when its weight begins to act. A
/// wave runs up from the foot and back. The force grows to twice the weight in `2 L / c`, and
/// decreases to zero in the same time.
#[derive(Debug, Clone, Copy)]
struct Settling {
    /// Length [m].
    size: f64,
    /// Young's modulus [Pa].
    young: f64,
    /// Density [kg/m3].
    density: f64,
    /// Step and end [s].
    times: [f64; 2],
    /// Time integration scheme.
    scheme: &'static str,
}

impl Settling {
    const ALPHA: &'static str = "{ generalized_alpha: { spectral_radius: 0.8 } }";

    /// A period in 160 steps.
    fn period(size: f64, young: f64, density: f64) -> Self {
        let bar = Self { size, young, density, times: [0.0; 2], scheme: Self::ALPHA };
        Self { times: [bar.up() / 40.0, 4.0 * bar.up()], ..bar }
    }

    fn solid(&self) -> Solid {
        Solid { law: "neo_hookean", young: self.young, poisson: 0.3 }
    }

    /// Time in which a wave crosses the length [s].
    fn up(&self) -> f64 {
        self.size * (self.density / self.solid().confined()).sqrt()
    }

    /// Weight that causes a mean strain of 1e-4 at the foot.
    fn weight(&self) -> f64 {
        1e-4 * self.solid().confined() * self.size
    }

    /// Force on the plane at a time [N].
    fn force(&self, time: f64) -> f64 {
        let part = (time / self.up()) % 4.0;
        self.weight() * part.min(4.0 - part)
    }

    fn case(&self) -> String {
        let Self { size, young, density, times: [step, end], scheme } = self;
        let gravity = self.weight() / (density * size * size);
        format!(
            "title: Bar whose weight begins to pull\ndimension: 2\n\
             bodies:\n  bar:\n    mesh: {{ box: {{ min: [0, 0], max: [{size:e}, {size:e}], cells: [1, 40], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: {young:e}, poisson_ratio: 0.3 }} }}\n    density: {density:e}\n\
             obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  sole: {{ contactor: bar.bottom, target: floor, normal: {{ penalty: {{ compliance: {:e} }} }}, friction: none }}\n\
             boundary:\n  sides: {{ on: bar, displacement: {{ x: 0 }} }}\n  weight: {{ on: bar, gravity: [0, -{gravity:e}] }}\n\
             time: {{ end: {end:e}, step: {step:e}, scheme: {scheme} }}\noutput: {{ fields: {{ every: 1000000 }} }}\n",
            1e-3 * size / self.solid().confined(),
        )
    }

    /// Root mean square error of the forces of all steps, divided by the largest force.
    fn follows(self, group: &'static str, name: String, tolerance: f64) -> Row {
        Row::new(group, name, vec![self.case()], move |results| {
            let sole = results[0].contact("sole");
            let expected: Vec<f64> = sole.numbers("time").iter().map(|time| self.force(*time)).collect();
            let squares = sole.numbers("force_n").into_iter().zip(&expected).map(|(f, e)| (f - e).powi(2));
            let most = expected.iter().copied().fold(0.0, f64::max);
            let off = (squares.sum::<f64>() / expected.len() as f64).sqrt() / most;
            let asked = format!("the triangles of a wave up and down, to {tolerance:.0e}");
            Verdict::says(format!("off by {off:.1e} of the largest force"), &asked, off <= tolerance)
        })
    }

    /// The force of the last step equals the weight.
    fn rests(self, group: &'static str, name: String, tolerance: f64) -> Row {
        Row::new(group, name, vec![self.case()], move |results| {
            Verdict::close(results[0].contact("sole").last("force_n"), self.weight(), tolerance)
        })
    }
}

fn settling(rows: &mut Vec<Row>) {
    let wave = "its weight begins to pull";
    for size in [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
        let row = Settling::period(size, 1e7, 1e3).follows("size [m]", format!("{size:.0e}, {wave}"), 0.02);
        rows.push(if size == 1e-9 || size == 1e6 { row.quick() } else { row });
    }
    for young in [1e2, 1e7, 1e12] {
        let row = Settling::period(1.0, young, 1e3);
        rows.push(row.follows("stiffness [Pa]", format!("{young:.0e}, {wave}"), 0.02));
    }
    // All in the same 160 steps: in what is heavy the wave has not come back, what is light has come to rest.
    for density in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        let times = [6.25e-5, 1e-2];
        let bar = Settling { size: 1.0, young: 1e9, density, times, scheme: Settling::ALPHA };
        let (group, name) = ("density [kg/m3]", format!("{density:.0e}, {wave}"));
        let row = match density > 10.0 {
            true => bar.follows(group, name, 0.03),
            false => Settling { scheme: "backward_euler", ..bar }.rests(group, name, 1e-6),
        };
        rows.push(if density == 1e-6 || density == 1e6 { row.quick() } else { row });
    }
    // One period in 160 and in 4000 steps; one step of two thousand periods sees nothing of the wave.
    let stiff = Settling::period(1.0, 1e7, 1e3);
    let period = stiff.times[1];
    for (name, steps, tolerance) in
        [("160 steps a period", 160.0, 0.02), ("4000 steps a period", 4000.0, 0.02)]
    {
        let bar = Settling { times: [period / steps, period], ..stiff };
        rows.push(bar.follows("step [s]", format!("{name}, {wave}"), tolerance));
    }
    let bar = Settling { times: [2000.0 * period, 2000.0 * period], scheme: "backward_euler", ..stiff };
    rows.push(bar.rests("step [s]", format!("the whole run, {wave}"), 1e-6).quick());
}

/// Two blocks, one on the other, dragged by the top, with all vertical motion prescribed. This is
/// simple shear, in which neo-Hookean solids carry `G w / h` and exert no other force. Friction
/// sticks in the first half of the path, and slips at the end.
#[derive(Debug, Clone, Copy)]
struct Sheared {
    size: f64,
    /// Young's moduli of the upper and of the lower block [Pa].
    young: [f64; 2],
    friction: f64,
}

impl Sheared {
    fn shear(young: f64) -> f64 {
        young / 2.6
    }

    /// Compliances of normal contact and of stick, relative to the softer block [m/Pa].
    fn compliances(&self) -> [f64; 2] {
        let soft = Self::shear(self.young[0].min(self.young[1]));
        [1e-3 * self.size / soft, 2e-3 * self.size / soft]
    }

    /// Shear caused by the displacements `w` of the top while all points stick [Pa].
    fn stuck(&self, way: f64) -> f64 {
        let layers: f64 = self.young.iter().map(|young| self.size / Self::shear(*young)).sum();
        way / (layers + self.compliances()[1])
    }

    /// Depth of the contact, small enough that the displacement is a small part of the length [m].
    fn press(&self) -> f64 {
        1e-5 * self.size * (0.5 / self.friction).min(1.0)
    }

    fn pressure(&self) -> f64 {
        self.press() / self.compliances()[0]
    }

    /// Displacement of the top until the friction bound is reached [m].
    fn way(&self) -> f64 {
        self.friction * self.pressure() / self.stuck(1.0)
    }

    fn case(&self) -> String {
        let Self { size, young: [upper, lower], friction } = self;
        let ([normal, stick], press, way) = (self.compliances(), self.press(), self.way());
        let body = |name: &str, low: f64, cells: &str, young: f64| {
            format!(
                "  {name}:\n    mesh: {{ box: {{ min: [0, {:e}], max: [{size:e}, {:e}], cells: {cells}, element: quad4 }} }}\n    \
                 material: {{ neo_hookean: {{ young_modulus: {young:e}, poisson_ratio: 0.3 }} }}\n",
                low * size,
                (low + 1.0) * size,
            )
        };
        format!(
            "title: Stack sheared\ndimension: 2\nbodies:\n{}{}\
             contact:\n  sole:\n    contactor: upper.bottom\n    target: lower.top\n    normal: {{ penalty: {{ compliance: {normal:e} }} }}\n    \
             friction: {{ coulomb: {{ coefficient: {friction:e}, regularization: {{ stick_stiffness: {:e} }} }} }}\n\
             boundary:\n  lower: {{ on: lower, displacement: {{ y: 0 }} }}\n  ground: {{ on: lower.bottom, displacement: {{ x: 0 }} }}\n  \
             upper: {{ on: upper, displacement: {{ y: \"-{press:e} * min(4 * t, 1)\" }} }}\n  \
             top: {{ on: upper.top, displacement: {{ x: \"{way:e} * max(4 * t - 1, 0)\" }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 8 }} }} }}\n",
            body("upper", 0.0, "[4, 3]", *upper),
            body("lower", -1.0, "[2, 3]", *lower),
            1.0 / stick,
        )
    }

    fn row(self, group: &'static str, name: &str) -> Row {
        let name = format!("{name}, sheared");
        Row::new(group, name, vec![self.case()], move |results| {
            let sole = results[0].contact("sole");
            let friction = sole.numbers("force_t");
            // Step 3 of 8: half of the way to the bound.
            let stuck = Verdict::close(friction[3].abs(), self.stuck(0.5 * self.way()) * self.size, 1e-6);
            // What slid beyond the end of the lower block carries nothing, and the blocks are not sheared evenly any more.
            let bound = self.friction * self.pressure();
            let covered = self.size - 2.0 * self.way() - bound * self.compliances()[1];
            let bound = Verdict::close(sole.last("force_t").abs(), bound * covered, 3e-4);
            stuck.and(bound)
        })
    }
}

fn sheared(rows: &mut Vec<Row>) {
    let base = Sheared { size: 1.0, young: [5e6; 2], friction: 0.5 };
    for young in [1e2, 1e4, 1e7, 1e10, 1e12] {
        let row = Sheared { young: [young; 2], ..base }.row("stiffness [Pa]", &format!("{young:.0e}"));
        rows.push(if young == 1e2 || young == 1e12 { row.quick() } else { row });
    }
    for size in [1e-9, 1e-6, 1e-3, 1e3, 1e6] {
        let row = Sheared { size, ..base }.row("size [m]", &format!("{size:.0e}"));
        rows.push(if size == 1e-9 || size == 1e6 { row.quick() } else { row });
    }
    for ratio in [1.0, 1e3, 1e6, 1e9] {
        for (name, young) in
            [("harder on softer", [1e3 * ratio, 1e3]), ("softer on harder", [1e3, 1e3 * ratio])]
        {
            let row = Sheared { young, ..base }.row("pair ratio", &format!("{ratio:.0e}, {name}"));
            rows.push(if ratio == 1e9 { row.quick() } else { row });
        }
    }
    for friction in [1e-6, 10.0] {
        rows.push(Sheared { friction, ..base }.row("friction", &format!("{friction:.0e}, a stack")));
    }
}

/// A block pressed onto a plane by prescribed displacements slides freely along it. The normal
/// force is known, and friction removes the corresponding momentum for every step length.
fn slides(rows: &mut Vec<Row>) {
    for (name, step) in
        [("1e-2, the whole run", 1e-2), ("1e-3", 1e-3), ("1e-4", 1e-4), ("1e-5", 1e-5), ("1e-6", 1e-6)]
    {
        let case = format!(
            "title: Block that slides\ndimension: 2\n\
             bodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 0.25], cells: [2, 1], element: quad4 }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e9, poisson_ratio: 0.3 }} }}\n    density: 1000\n    initial_velocity: [1, 0]\n\
             obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  sole:\n    contactor: block.bottom\n    target: floor\n    normal: {{ penalty: {{ compliance: 1e-9 }} }}\n    \
             friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_velocity: 1e-3 }} }} }}\n    initial_overclosure: accept\n\
             boundary:\n  pressed: {{ on: block, displacement: {{ y: -1e-5 }} }}\n\
             time: {{ end: 1e-2, step: {step:e}, scheme: {{ generalized_alpha: {{ spectral_radius: 0.5 }} }} }}\n\
             output: {{ fields: {{ every: 100000 }} }}\n"
        );
        let row = Row::new("step [s]", format!("{name}, a block slides"), vec![case], |results| {
            let momentum = results[0].table("momentum.csv").last("linear_x");
            // 250 kg at 1 m/s, and 5000 N for 10 ms.
            Verdict::close(250.0 - momentum, 50.0, 1e-8)
        });
        rows.push(if step >= 1e-3 { row.quick() } else { row });
    }
}

/// A cylinder pressed into a block, with contact points on the softer side. The pressure is that of
/// Hertz for the measured force and the effective stiffness, which is the same in all rows. The
/// finite block and the mesh, with eighteen elements over the half-width, cause an error of 5 %.
fn cylinders(rows: &mut Vec<Row>) {
    let (radius, reduced) = (0.05, 1.0 / (0.91 / 70e9 + 0.91 / 210e9));
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/hertz/case.yml");
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let load = text.lines().find(|line| line.starts_with("  load:")).unwrap_or_default();
    let pressed = "  load: { on: cylinder.top, displacement: { y: \"-1.5e-3 * t\" } }";
    let text = text.replace(load, pressed).replace("increments: 5", "increments: 4");
    for ratio in [1.0, 1e3, 1e6, 1e9] {
        let soft = 0.91 * (1.0 + 1.0 / ratio) * reduced;
        for (name, cylinder, block) in
            [("hard in soft", ratio * soft, soft), ("soft on hard", soft, ratio * soft)]
        {
            let case = text
                .replace("\"70 GPa\"", &format!("{cylinder:e}"))
                .replace("\"210 GPa\"", &format!("{block:e}"));
            let case = match name {
                "hard in soft" => case
                    .replace("contactor: cylinder.bottom", "contactor: block.top")
                    .replace("target: block.top", "target: cylinder.bottom"),
                _ => case,
            };
            let name = format!("{ratio:.0e}, a cylinder, {name}");
            let row = Row::new("pair ratio", name, vec![case], move |results: &[Results]| {
                let face = results[0].contact("face");
                let force = 2.0 * face.last("force_y").abs();
                Verdict::close(face.last("max_pressure"), f64::sqrt(force * reduced / (PI * radius)), 0.05)
            });
            rows.push(if ratio == 1e9 { row.quick() } else { row });
        }
    }
}
