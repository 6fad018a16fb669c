//! One scene in SI units and in other systems gives the same results, in the units of the headers.

use crate::common::{Folder, Table, run};

/// The unit system of a scene.
struct System {
    head: &'static str,
    /// SI values of its units of length, mass and time.
    length: f64,
    mass: f64,
    time: f64,
    /// The units in the headers, with the SI value of each.
    units: &'static [(&'static str, f64)],
}

const SI: System = System {
    head: "",
    length: 1.0,
    mass: 1.0,
    time: 1.0,
    units: &[
        ("s", 1.0),
        ("m", 1.0),
        ("m/s", 1.0),
        ("m2", 1.0),
        ("N", 1.0),
        ("Pa", 1.0),
        ("J", 1.0),
        ("W", 1.0),
        ("N s", 1.0),
        ("N m s", 1.0),
        ("N m", 1.0),
    ],
};

const TONNES: System = System {
    head: "units: { length: mm, mass: t, time: s }\n",
    length: 1e-3,
    mass: 1e3,
    time: 1.0,
    units: &[
        ("s", 1.0),
        ("mm", 1e-3),
        ("mm/s", 1e-3),
        ("mm2", 1e-6),
        ("N", 1.0),
        ("MPa", 1e6),
        ("mJ", 1e-3),
        ("mW", 1e-3),
        ("N s", 1.0),
        ("N mm s", 1e-3),
        ("N mm", 1e-3),
    ],
};

const MILLISECONDS: System = System {
    head: "units: { length: mm, mass: kg, time: ms }\n",
    length: 1e-3,
    mass: 1.0,
    time: 1e-3,
    units: &[
        ("ms", 1e-3),
        ("mm", 1e-3),
        ("mm/ms", 1.0),
        ("mm2", 1e-6),
        ("kN", 1e3),
        ("GPa", 1e9),
        ("J", 1.0),
        ("kW", 1e3),
        ("kN ms", 1.0),
        ("kN mm ms", 1e-3),
        ("kN mm", 1.0),
    ],
};

impl System {
    /// A number of the scene: its SI value, and the exponents of its mass, length and time.
    fn number(&self, si: f64, [mass, length, time]: [i32; 3]) -> String {
        let unit = self.mass.powi(mass) * self.length.powi(length) * self.time.powi(time);
        format!("{:e}", si / unit)
    }

    /// Two blocks. The upper one is pressed, pulled and thrown over the lower one.
    fn case(&self, dimension: usize) -> String {
        let length = |si: f64| self.number(si, [0, 1, 0]);
        let at = |x: f64, depth: f64, height: f64| match dimension {
            2 => format!("[{}, {}]", length(x), length(height)),
            _ => format!("[{}, {}, {}]", length(x), length(depth), length(height)),
        };
        let (point, far) =
            (|x: f64, height: f64| at(x, 0.0, height), |x: f64, height: f64| at(x, 0.1, height));
        let (cells, up, zero) = if dimension == 2 { ("", "y", "") } else { (", 1", "z", ", 0") };
        let pressure = |si: f64| self.number(si, [1, -1, -2]);
        let velocity = |si: f64| self.number(si, [0, 1, -1]);
        let (head, time) = (self.head, |si: f64| self.number(si, [0, 0, 1]));
        format!(
            "{head}dimension: {dimension}
bodies:
  lower:
    mesh: {{ box: {{ min: {}, max: {}, cells: [6{cells}, 2] }} }}
    material: {{ neo_hookean: {{ young_modulus: \"5 MPa\", poisson_ratio: 0.3 }} }}
    density: \"1700 kg/m3\"
  upper:
    mesh: {{ box: {{ min: {}, max: {}, cells: [4{cells}, 2] }} }}
    material: {{ neo_hookean: {{ young_modulus: {}, poisson_ratio: 0.3 }} }}
    density: {}
    initial_velocity: [\"{} + {} * x\"{zero}, 0]
contact:
  pair:
    contactor: upper.bottom
    target: lower.top
    normal: {{ penalty: {{ compliance: {} }} }}
    friction: {{ coulomb: {{ coefficient: 0.4, regularization: {{ stick_stiffness: {} }} }} }}
boundary:
  floor: {{ on: lower.bottom, displacement: {{ x: 0, {up}: 0 }} }}
  weight: {{ on: upper, gravity: [0{zero}, {}] }}
  push: {{ on: upper.top, pressure: \"{} * t / {} * (1 + x / {})\" }}
  pull: {{ on: upper.right, traction: {{ x: {{ table: [[0, 0], [\"1 ms\", {}], [\"2 ms\", \"5 kPa\"]] }} }} }}
time: {{ end: \"2 ms\", step: {}, scheme: {{ newmark: {{}} }} }}
solver: {{ newton: {{ tolerance: 1.0e-12 }} }}
output: {{ probes: {{ corner: {{ at: {}, on: upper }} }}, fields: {{ every: 0 }}, checkpoint: {{ every: 2 }} }}
",
            point(0.0, 0.0),
            far(0.4, 0.1),
            point(0.1, 0.1),
            far(0.3, 0.2),
            pressure(4e6),
            self.number(1500.0, [1, -3, 0]),
            velocity(0.1),
            self.number(0.5, [0, 0, -1]),
            self.number(1e-9, [-1, 2, 2]),
            self.number(1e9, [1, -2, -2]),
            self.number(-9.81, [0, 1, -2]),
            pressure(1e5),
            time(0.002),
            length(1.0),
            pressure(4e3),
            time(5e-4),
            point(0.1, 0.1),
        )
    }
}

/// The numbers of a results folder in SI units, table by table. In 2D the thickness is 1 m.
fn results(folder: &std::path::Path, system: &System, dimension: usize) -> Vec<(String, Vec<f64>)> {
    let mut columns = Vec::new();
    for name in ["probes.csv", "contact.csv", "reactions.csv", "energy.csv", "momentum.csv"] {
        let table = Table::read(&folder.join(name));
        for heading in table.names() {
            let Some((quantity, unit)) = heading.strip_suffix(']').and_then(|text| text.split_once(" ["))
            else {
                continue;
            };
            let known = system.units.iter().find(|(symbol, _)| *symbol == unit);
            let mut factor =
                known.unwrap_or_else(|| panic!("{name}: '{heading}' is not in {}", system.head)).1;
            let is_whole = ["s", "m", "m/s", "Pa"]
                .iter()
                .any(|si| SI.units.iter().zip(system.units).any(|(a, b)| a.0 == *si && b.0 == unit));
            if dimension == 2 && !is_whole {
                factor /= system.length;
            }
            let values = table.numbers(heading).into_iter().map(|value| factor * value).collect();
            columns.push((format!("{name}: {quantity}"), values));
        }
    }
    columns
}

fn compare(one: &[(String, Vec<f64>)], other: &[(String, Vec<f64>)], what: &str) {
    assert_eq!(one.len(), other.len(), "{what}");
    for ((name, a), (_, b)) in one.iter().zip(other) {
        // Components that vanish are compared with those that do not.
        let family = name.trim_end_matches(['x', 'y', 'z', 'n', 't']);
        let alike = one.iter().filter(|(other, _)| {
            other.starts_with(family) || name.contains("energy.csv") && other.contains("energy.csv: total")
        });
        let size = alike
            .flat_map(|(_, values)| values)
            .filter(|v| v.is_finite())
            .fold(0.0_f64, |most, v| most.max(v.abs()));
        assert_eq!(a.len(), b.len(), "{what}: {name}");
        for (a, b) in a.iter().zip(b) {
            assert!(
                (a - b).abs() <= 1e-9 * size || a.is_nan() && b.is_nan(),
                "{what}: {name}: {a:e} and {b:e} of {size:e}"
            );
        }
    }
}

/// In 2D and 3D, on one rank and on two, the results in mm, t, s and in mm, kg, ms equal those in
/// SI. The headers have the corresponding units. If a conversion of a string with a unit or a
/// factor of a header is omitted, the test fails.
#[test]
fn a_system_of_units_changes_nothing_but_the_units() {
    let folder = Folder::new("units");
    for dimension in [2, 3] {
        let solved = |system: &System, name: &str, ranks: usize| {
            folder.write(&format!("{name}.yml"), &system.case(dimension));
            run(ranks, &[&format!("{name}.yml"), "-o", name, "--anew"], &folder).success();
            results(&folder.join(name), system, dimension)
        };
        let si = solved(&SI, "si", 0);
        compare(&si, &solved(&TONNES, "tonnes", 0), "mm, t, s");
        compare(&si, &solved(&TONNES, "tonnes-2", 2), "mm, t, s on 2 ranks");
        compare(&si, &solved(&MILLISECONDS, "milliseconds", 0), "mm, kg, ms");
    }
}

/// Messages have the units of the case. A case in mm, t, s is asked whether its units are correct
/// only if it does not state them. A checkpoint in other units is refused.
#[test]
fn the_units_of_a_case_are_said_and_kept() {
    let folder = Folder::new("units-said");
    folder.write("case.yml", &TONNES.case(2));
    let said = run(0, &["case.yml", "-o", "results"], &folder).success().text();
    for words in ["units: mm, t, s", "N, MPa, mJ", "plane strain, thickness 1 mm", "smallest gap 0.000e0 mm"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    let deepest = said.lines().find(|line| line.contains("deepest penetration"));
    assert!(deepest.is_some_and(|line| line.ends_with(" mm")), "{said}");
    assert!(!said.contains("check the units"), "{said}");
    let checked = run(0, &["check", "case.yml"], &folder).success().text();
    for words in ["units: mm, t, s", "mm/s, c_s", "MPa/mm at a pressure of"] {
        assert!(checked.contains(words), "{words}: {checked}");
    }
    let record = std::fs::read_to_string(folder.join("results/run.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    assert_eq!(record["units"], serde_json::json!({ "length": "mm", "mass": "t", "time": "s" }));
    run(0, &["plot", "results"], &folder).success();
    let svg =
        std::fs::read_to_string(folder.join("results/figures/displacement_corner.svg")).expect("a figure");
    assert!(svg.contains("time (ms)") && svg.contains("horizontal displacement (mm)"), "{svg}");
    // The same numbers, said to be in SI.
    let unsaid =
        TONNES.case(2).replace(TONNES.head, "").replace("\"5 MPa\"", "5").replace("\"1700 kg/m3\"", "1.7e-9");
    folder.write("unsaid.yml", &unsaid);
    let said = run(0, &["check", "unsaid.yml"], &folder).success().text();
    assert!(
        said.contains("check the units") && said.contains("units: { length: mm, mass: t, time: s }"),
        "{said}"
    );
    folder.write("case.yml", &TONNES.case(2).replace(TONNES.head, ""));
    let refused = run(0, &["case.yml", "-o", "results", "--restart"], &folder);
    assert_eq!(refused.code, Some(3), "{}", refused.text());
    assert!(
        refused.text().contains("in mm, t, s") && refused.text().contains("in m, kg, s"),
        "{}",
        refused.text()
    );
}
