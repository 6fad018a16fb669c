//! The scenes of the parameter sweeps as case files, with their closed-form results.

/// Two constants of an isotropic solid and the law.
#[derive(Debug, Clone, Copy)]
pub struct Solid {
    /// Name of the law in case files.
    pub law: &'static str,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl Solid {
    /// Rubber with the neo-Hookean law.
    pub const RUBBER: Self = Self { law: "neo_hookean", young: 5e6, poisson: 0.45 };

    fn text(&self) -> String {
        format!("{{ {}: {{ young_modulus: {:e}, poisson_ratio: {} }} }}", self.law, self.young, self.poisson)
    }

    /// `lambda` and `mu` [Pa].
    fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young, self.poisson);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }

    /// `lambda + 2 mu` [Pa].
    pub fn confined(&self) -> f64 {
        let (lambda, mu) = self.lame();
        lambda + 2.0 * mu
    }

    /// Pressure [Pa] on the ends of a bar with fixed sides that is pressed to the stretch `1 + h`.
    pub fn pressure(&self, h: f64) -> f64 {
        let (lambda, mu) = self.lame();
        let f = 1.0 + h;
        match self.law {
            "neo_hookean" => -(mu * h * (1.0 + f) + lambda * h.ln_1p()) / f,
            _ => -f * (lambda + 2.0 * mu) * (h + 0.5 * h * h),
        }
    }
}

/// The root of an increasing function between two bounds, by bisection, independent of the
/// tolerances of the program.
pub fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A square of side `size` with fixed sides, pressed by its top onto a rigid plane: statics,
/// uniform strain.
#[derive(Debug, Clone, Copy)]
pub struct Bar {
    /// The material.
    pub solid: Solid,
    /// Side [m].
    pub size: f64,
    /// Position of the lower left corner [m].
    pub origin: [f64; 2],
    /// Compliance of the contact [m/Pa].
    pub compliance: f64,
    /// Downward displacement of the top [m].
    pub press: f64,
    /// Number of cells in height.
    pub cells: u32,
    /// Locking treatment.
    pub locking: &'static str,
    /// Increments of the load.
    pub increments: u32,
}

impl Bar {
    /// A metre of rubber pressed by two hundredths.
    pub const BASE: Self = Self {
        solid: Solid::RUBBER,
        size: 1.0,
        origin: [0.0; 2],
        compliance: 2e-10,
        press: 0.02,
        cells: 4,
        locking: "none",
        increments: 2,
    };

    /// The case file.
    pub fn case(&self) -> String {
        let Self { solid, size, origin: [x, y], compliance, press, cells, locking, increments } = self;
        format!(
            "title: Confined bar on a plane\ndimension: 2\n\
             bodies:\n  bar:\n    mesh: {{ box: {{ min: [{x:e}, {y:e}], max: [{:e}, {:e}], cells: [2, {cells}], element: quad4 }} }}\n    \
             material: {}\n    locking: {locking}\n\
             obstacles:\n  floor: {{ plane: {{ point: [{x:e}, {y:e}], normal: [0, 1] }} }}\n\
             contact:\n  sole: {{ contactor: bar.bottom, target: floor, normal: {{ penalty: {{ compliance: {compliance:e} }} }}, friction: none }}\n\
             boundary:\n  left: {{ on: bar.left, displacement: {{ x: 0 }} }}\n  right: {{ on: bar.right, displacement: {{ x: 0 }} }}\n  \
             top: {{ on: bar.top, displacement: {{ y: \"-{press:e} * t\" }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: {increments} }} }} }}\n\
             solver: {{ newton: {{ tolerance: 1e-10 }} }}\n",
            x + size,
            y + size,
            solid.text(),
        )
    }

    /// Exact force on the plane [N].
    pub fn force(&self) -> f64 {
        let pressure = |depth: f64| self.solid.pressure((depth - self.press) / self.size);
        let depth = root(0.0, self.press, |depth| depth / self.compliance - pressure(depth));
        // The smaller of two equal figures that differ in rounding alone is the better known one.
        if depth < 0.5 * self.press {
            self.size * pressure(depth)
        } else {
            self.size * depth / self.compliance
        }
    }
}

/// Two squares of a metre with fixed sides, one on the other: pair of stiffnesses, uniform
/// pressure.
pub fn pair(upper: f64, lower: f64, compliance: f64, press: f64) -> (String, f64) {
    let solid = |young| Solid { law: "neo_hookean", young, poisson: 0.3 };
    let (up, low) = (solid(upper), solid(lower));
    let case = format!(
        "title: Two confined bars\ndimension: 2\n\
         bodies:\n  lower:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 1], cells: [2, 3], element: quad4 }} }}\n    material: {}\n  \
         upper:\n    mesh: {{ box: {{ min: [0, 1], max: [1, 2], cells: [4, 3], element: quad4 }} }}\n    material: {}\n\
         contact:\n  sole: {{ contactor: upper.bottom, target: lower.top, normal: {{ penalty: {{ compliance: {compliance:e} }} }}, friction: none }}\n\
         boundary:\n  ground: {{ on: lower.bottom, displacement: {{ x: 0, y: 0 }} }}\n  \
         a: {{ on: lower.left, displacement: {{ x: 0 }} }}\n  b: {{ on: lower.right, displacement: {{ x: 0 }} }}\n  \
         c: {{ on: upper.left, displacement: {{ x: 0 }} }}\n  d: {{ on: upper.right, displacement: {{ x: 0 }} }}\n  \
         clamp: {{ on: upper.top, displacement: {{ y: \"-{press:e} * t\" }} }}\n\
         time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}\n",
        low.text(),
        up.text(),
    );
    // Of a pressure the shortenings of both bars and the depth of the contact make up the press.
    let shortening = |solid: Solid, p: f64| root(0.0, 0.999, |d| solid.pressure(-d) - p);
    let most = up.pressure(-press).min(low.pressure(-press));
    let total = |p: f64| shortening(up, p) + shortening(low, p) + p * compliance - press;
    (case, root(0.0, most, total))
}

/// A square whose motion along x is fully prescribed, pressed onto a plane by a traction on its
/// top.
#[derive(Debug, Clone, Copy)]
pub struct Slider {
    /// Coefficient of friction.
    pub friction: f64,
    /// Stick velocity [m/s].
    pub stick_velocity: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Traction [Pa].
    pub load: f64,
    /// End [s].
    pub end: f64,
    /// Step [s].
    pub step: f64,
}

impl Slider {
    /// The scene slips at a metre per second.
    pub const BASE: Self =
        Self { friction: 0.5, stick_velocity: 1e-3, speed: 1.0, load: 1e4, end: 0.02, step: 2e-3 };

    /// The case file.
    pub fn case(&self) -> String {
        let Self { friction, stick_velocity, speed, load, end, step } = self;
        format!(
            "title: Square that slides as prescribed\ndimension: 2\n\
             bodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 1], cells: [2, 2], element: quad4 }} }}\n    \
             material: {}\n    density: 1000\n\
             obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
             contact:\n  sole:\n    contactor: block.bottom\n    target: floor\n    normal: {{ penalty: {{ compliance: 1e-9 }} }}\n    \
             friction: {{ coulomb: {{ coefficient: {friction:e}, regularization: {{ stick_velocity: {stick_velocity:e} }} }} }}\n\
             boundary:\n  drag: {{ on: block, displacement: {{ x: \"{speed:e} * t\" }} }}\n  press: {{ on: block.top, traction: {{ y: -{load:e} }} }}\n\
             start: {{ equilibrium: {{ friction: false, increments: 1 }} }}\n\
             time: {{ end: {end:e}, step: {step:e}, scheme: backward_euler }}\n",
            Solid::RUBBER.text(),
        )
    }

    /// Friction force over normal force.
    pub fn ratio(&self) -> f64 {
        self.friction * (self.speed / self.stick_velocity).min(1.0)
    }
}

/// A block pressed onto a plane, or onto another block, and dragged by its top. The scene contains
/// every quantity that a unit can change.
#[derive(Debug, Clone, Copy)]
pub struct Drag {
    /// Length of the block [m]. The height is half of it.
    pub size: f64,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Position of the lower left corner, divided by the size.
    pub origin: [f64; 2],
    /// Poisson's ratio.
    pub poisson: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Whether the target is a second block, twice as stiff.
    pub onto_block: bool,
    /// Number of dimensions.
    pub dimension: usize,
    /// Tolerance of Newton's method.
    pub tolerance: f64,
}

impl Drag {
    /// A metre of rubber.
    pub const BASE: Self = Self {
        size: 1.0,
        young: 5e6,
        density: 1700.0,
        origin: [0.0; 2],
        poisson: 0.4,
        friction: 0.5,
        onto_block: false,
        dimension: 2,
        tolerance: 1e-11,
    };

    /// Unit of time [s]: the time in which a wave crosses the length.
    pub fn time(&self) -> f64 {
        self.size * (self.density / self.young).sqrt()
    }

    fn box_of(&self, low: [f64; 3], high: [f64; 3], cells: [u32; 3]) -> String {
        let d = self.dimension;
        // Up is the last axis.
        let pick = |p: [f64; 3]| if d == 2 { vec![p[0], p[2]] } else { p.to_vec() };
        let at = |p: [f64; 3]| {
            let shift = if d == 2 { self.origin.to_vec() } else { vec![self.origin[0], 0.0, self.origin[1]] };
            let list = pick(p)
                .iter()
                .zip(shift)
                .map(|(x, o)| format!("{:e}", self.size * (x + o)))
                .collect::<Vec<_>>();
            format!("[{}]", list.join(", "))
        };
        let cells = if d == 2 { format!("[{}, {}]", cells[0], cells[2]) } else { format!("{cells:?}") };
        let element = if d == 2 { "quad4" } else { "hex8" };
        format!("{{ box: {{ min: {}, max: {}, cells: {cells}, element: {element} }} }}", at(low), at(high))
    }

    fn body(&self, mesh: &str, young: f64) -> String {
        format!(
            "    mesh: {mesh}\n    material: {{ neo_hookean: {{ young_modulus: {young:e}, poisson_ratio: {} }} }}\n    \
             density: {:e}\n    locking: selective_reduced\n",
            self.poisson, self.density
        )
    }

    /// The case file.
    pub fn case(&self) -> String {
        let (l, time) = (self.size, self.time());
        let up = if self.dimension == 2 { "y" } else { "z" };
        let block = self.body(&self.box_of([0.0; 3], [1.0, 0.5, 0.5], [6, 2, 3]), self.young);
        let (target, lower, ground, floor) = match self.onto_block {
            true => (
                "base.top",
                format!(
                    "  base:\n{}",
                    self.body(
                        &self.box_of([-0.25, -0.25, -0.5], [1.25, 0.75, 0.0], [7, 3, 2]),
                        2.0 * self.young
                    )
                ),
                format!(
                    "  ground: {{ on: base.bottom, displacement: {{ x: 0, {}{up}: 0 }} }}\n",
                    if self.dimension == 3 { "y: 0, " } else { "" }
                ),
                String::new(),
            ),
            false => {
                let list = |a: f64, b: f64| {
                    if self.dimension == 2 { format!("[{a:e}, {b:e}]") } else { format!("[{a:e}, 0, {b:e}]") }
                };
                let point = list(l * self.origin[0], l * self.origin[1]);
                (
                    "floor",
                    String::new(),
                    String::new(),
                    format!(
                        "obstacles:\n  floor: {{ plane: {{ point: {point}, normal: {} }} }}\n",
                        list(0.0, 1.0)
                    ),
                )
            }
        };
        let (compliance, slow) = (1e-3 * l / self.young, 1e-3 * l / time);
        let (press, speed) = (0.02 * l, 0.05 * l / time);
        let aside = if self.dimension == 3 { "y: 0, " } else { "" };
        format!(
            "title: Block dragged\ndimension: {}\nbodies:\n  block:\n{block}{lower}{floor}\
             contact:\n  sole:\n    contactor: block.bottom\n    target: {target}\n    normal: {{ penalty: {{ compliance: {compliance:e} }} }}\n    \
             friction: {{ coulomb: {{ coefficient: {:e}, regularization: {{ stick_velocity: {slow:e} }} }} }}\n    initial_overclosure: accept\n\
             boundary:\n{ground}  clamp: {{ on: block.top, displacement: {{ x: \"{speed:e} * t\", {aside}{up}: -{press:e} }} }}\n\
             start: {{ equilibrium: {{ friction: false, increments: 2 }} }}\n\
             time: {{ end: {:e}, step: {:e}, scheme: {{ generalized_alpha: {{ spectral_radius: 0.8 }} }} }}\n\
             solver: {{ newton: {{ tolerance: {:e} }} }}\n",
            self.dimension,
            self.friction,
            2.0 * time,
            0.2 * time,
            self.tolerance,
        )
    }
}
