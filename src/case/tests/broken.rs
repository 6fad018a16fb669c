//! Broken cases: each is refused with the position of the fault, the words that explain it, and never a panic.

use super::{message, with};

/// What replaces what, where the error points, what it says.
type Broken = (&'static str, &'static str, &'static str, &'static [&'static str]);

const TIME: &str = "time: { end: \"70 ms\", step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }";
const FRICTION: &str =
    "friction: { coulomb: { coefficient: 1.0, regularization: { stick_velocity: \"1 mm/s\" } } }";
const RUBBER: &str = "neo_hookean: { young_modulus: \"5 MPa\", poisson_ratio: 0.45 }";
const MESH: &str = "mesh: { box: { min: [0, 0], max: [1, 1], cells: [4, 4], element: quad4 } }";

const BROKEN: &[Broken] = &[
    // Keys and laws.
    ("title: A", "tittle: A", "1:1", &["unknown key 'tittle'", "did you mean 'title'?"]),
    ("density:", "densty:", "7:5", &["unknown key 'densty'", "'density'"]),
    (
        "coulomb:",
        "coulumb:",
        "18:17",
        &["unknown friction law 'coulumb'", "known: none, coulomb, power_law", "did you mean 'coulomb'?"],
    ),
    (
        "friction: { coulomb:",
        "friction: coulumb #",
        "18:15",
        &["unknown friction law 'coulumb'", "did you mean 'coulomb'?"],
    ),
    (FRICTION, "friction: coulomb", "18:15", &["'coefficient' is missing"]),
    (FRICTION, "friction: 0.3", "18:15", &["expected a friction law", "number 0.3", "coulomb"]),
    (
        "coefficient: 1.0",
        "coefficient: \"0.5 m\"",
        "18:41",
        &["'0.5 m' is a length [m]; expected a pure number"],
    ),
    ("floor: {", "floor: 3 # {", "12:10", &["expected an obstacle, found the number 3", "plane"]),
    (FRICTION, "friction: {}", "18:15", &["friction law", "empty", "power_law"]),
    (
        FRICTION,
        "friction: { none: {}, coulomb: {} }",
        "18:27",
        &["only one friction law", "'none' and 'coulomb'"],
    ),
    (FRICTION, "friction: { none: { coefficient: 1 } }", "18:25", &["coefficient"]),
    (
        "coefficient: 1.0",
        "coefficient: { stribek: 1 }",
        "18:43",
        &["unknown coefficient of friction 'stribek'", "'stribeck'"],
    ),
    (
        "stick_velocity: \"1 mm/s\"",
        "stick_velocity: 1, stick_stiffness: 1",
        "18:83",
        &["only one regularization", "'stick_velocity' and 'stick_stiffness'"],
    ),
    ("beta: 0.25", "spectral_radius: 0.8", "25:58", &["unknown key 'spectral_radius'", "belongs to hht"]),
    ("newmark: { beta", "newmrk: { beta", "25:47", &["unknown scheme 'newmrk'", "'newmark'"]),
    (
        "strategy: monolithic",
        "strategy: segregated",
        "26:21",
        &["unknown strategy 'segregated'", "known: monolithic, staggered"],
    ),
    (
        "strategy: monolithic",
        "strategy: { staggered: { sweeps: 5 } }",
        "26:36",
        &["unknown key 'sweeps'", "max_sweeps"],
    ),
    (
        "strategy: monolithic",
        "strategy: { staggered: { tolerance: 2 } }",
        "26:47",
        &["tolerance of the sweeps must be > 0 and < 1"],
    ),
    (
        "strategy: monolithic",
        "strategy: { staggered: { max_sweeps: 0 } }",
        "26:48",
        &["'max_sweeps' must be >= 1"],
    ),
    (
        "strategy: monolithic",
        "strategy: { staggered: { variant: frozen_friction } }",
        "26:45",
        &["unknown variant 'frozen_friction'", "frozen_bound"],
    ),
    (
        "monolithic, linear: auto",
        "staggered, linear: two_stage",
        "26:40",
        &["two_stage", "staggered", "monolithic"],
    ),
    (
        "linear: auto",
        "linear: { two_stage: { inner: gmres_amg } }",
        "26:63",
        &["unknown inner solver", "cg_amg"],
    ),
    (
        "linear: auto",
        "linear: { filtered_amg: { layers: 2 } }",
        "26:59",
        &["unknown key 'layers'", "nothing can be set here; remove the key"],
    ),
    ("linear: auto", "linear: gmres_agm", "26:41", &["unknown linear solver", "'gmres_amg'"]),
    ("element: quad4", "element: quad5", "5:70", &["unknown element 'quad5'", "'quad4'"]),
    ("finite", "nonlinear", "8:17", &["unknown kinematics 'nonlinear'", "finite, linear"]),
    ("area: current", "area: current\n    area: reference", "21:5", &["'area' occurs twice"]),
    (
        "  floor:",
        "  floor: { plane: { point: [0, 0], normal: [0, 1] } }\n  floor:",
        "13:3",
        &["'floor' occurs twice"],
    ),
    ("dimension: 2\n", "", "1:1", &["'dimension' is missing"]),
    (", poisson_ratio: 0.45", "", "6:30", &["'poisson_ratio' is missing"]),
    (MESH, "mesh: { region: rubber }", "5:11", &["a mesh needs 'box' or 'file'"]),
    (
        MESH,
        "mesh: { file: b.msh, box: { min: [0, 0], max: [1, 1], cells: [4, 4] } }",
        "5:19",
        &["box or a file"],
    ),
    // Types and units.
    ("dimension: 2", "dimension: two", "2:12", &["2, 3 or axisymmetric, not 'two'"]),
    ("dimension: 2", "dimension: 2.5", "2:12", &["2, 3 or axisymmetric, not 2.5"]),
    ("dimension: 2", "dimension: 4", "2:12", &["2, 3 or axisymmetric, not 4"]),
    ("\"5 MPa\"", "\"5\"", "6:47", &["missing unit: '5'", "a pressure [Pa]", "\"5 MPa\""]),
    ("\"5 MPa\"", "5 mm", "6:47", &["'5 mm' is a length [m]", "expected a pressure [Pa]"]),
    ("\"5 MPa\"", "\"5 MPz\"", "6:47", &["unknown unit 'MPz'", "known: m, g, s"]),
    ("\"5 MPa\"", "five", "6:47", &["'five' is not a number with a unit"]),
    ("\"5 MPa\"", "[5]", "6:47", &["expected a pressure [Pa], found a list"]),
    ("\"5 MPa\"", "yes", "6:47", &["'yes'", "a pressure [Pa]"]),
    ("\"5 MPa\"", "true", "6:47", &["expected a pressure [Pa], found true or false"]),
    ("\"5 MPa\"", ".nan", "6:47", &["finite number", ".nan"]),
    ("\"5 MPa\"", "1e999", "6:47", &["finite number", "1e999"]),
    ("\"5 MPa\"", "\"1e300 GPa\"", "6:47", &["not a finite number"]),
    ("0.45", "\"0.45 m\"", "6:71", &["'0.45 m' is a length [m]; expected a pure number"]),
    ("friction: false", "friction: 3", "24:35", &["true or false"]),
    ("[0, 0], max", "7, max", "5:25", &["expected a list"]),
    ("cells: [4, 4]", "cells: [4, -4]", "5:57", &["whole number, zero or more"]),
    ("{ every: 10 }", "10", "28:11", &["expected a mapping"]),
    // Ranges.
    ("\"1700 kg/m3\"", "-1700", "7:14", &["the density must be >= 0, found -1700"]),
    ("    density: \"1700 kg/m3\"\n", "", "4:3", &["'block' needs a density"]),
    (
        RUBBER,
        "mooney_rivlin: { c10: 4e5, c01: -5e5, bulk_modulus: 1e9 }",
        "6:39",
        &["c10 + c01 must be > 0", "-100000", "shear modulus"],
    ),
    (
        RUBBER,
        "mooney_rivlin: { c10: 4e5, c01: 1e5 }",
        "6:39",
        &["needs bulk_modulus or poisson_ratio", "small strain"],
    ),
    (
        RUBBER,
        "mooney_rivlin: { c10: 4e5, c01: 1e5, bulk_modulus: 1e9, poisson_ratio: 0.4 }",
        "6:88",
        &["bulk_modulus", "poisson_ratio", "only one"],
    ),
    (RUBBER, "mooney_rivlin: { c10: 4e5 }", "6:32", &["'c01' is missing"]),
    (
        RUBBER,
        "mooney_rivlin: { c10: \"4 m\", c01: 1e5, poisson_ratio: 0.4 }",
        "6:39",
        &["'4 m' is a length [m]; expected a pressure"],
    ),
    (
        RUBBER,
        "mooney_rivlin: { c10: 4e5, c01: 1e5, poisson_ratio: 0.5 }",
        "6:69",
        &["Poisson's ratio", "< 0.5"],
    ),
    (
        RUBBER,
        "yeoh: { c1: -1e5, c2: 0, c3: 0, bulk_modulus: 1e9 }",
        "6:29",
        &["c1 must be > 0, found -100000", "shear modulus"],
    ),
    (
        RUBBER,
        "arruda_boyce: { mu: 1e5, lambda_m: 0.9, poisson_ratio: 0.49 }",
        "6:52",
        &["lambda_m must be > 1, found 0.9", "usually"],
    ),
    (
        RUBBER,
        "gent: { mu: 1e5, j_m: -2, poisson_ratio: 0.49 }",
        "6:39",
        &["j_m must be > 0, found -2", "uniaxial stretch"],
    ),
    (
        RUBBER,
        "ogden: { terms: [{ mu: 1e5, alpha: -2 }], poisson_ratio: 0.49 }",
        "6:40",
        &["the sum of mu alpha must be > 0", "negative mu"],
    ),
    (
        RUBBER,
        "ogden: { terms: [{ mu: 1e5, alpha: 0 }, { mu: 1e5, alpha: 2 }], poisson_ratio: 0.49 }",
        "6:52",
        &["alpha must not be 0", "remove it"],
    ),
    (RUBBER, "ogden: { terms: [], poisson_ratio: 0.49 }", "6:33", &["a list of 1 to 3 entries, found 0"]),
    (
        RUBBER,
        "ogden: { terms: [{ mu: 1, alpha: 1 }, { mu: 1, alpha: 1 }, { mu: 1, alpha: 1 }, { mu: 1, alpha: 1 }] }",
        "6:33",
        &["a list of 1 to 3 entries, found 4"],
    ),
    ("0.45", "0.5", "6:71", &["Poisson's ratio", "< 0.5", "0.49"]),
    ("0.45", "-1", "6:71", &["Poisson's ratio", "> -1"]),
    ("\"5 MPa\"", "0", "6:47", &["Young's modulus must be > 0"]),
    ("step: 5.0e-4", "step: 0", "25:29", &["the step must be > 0, found 0"]),
    ("step: 5.0e-4, ", "", "25:14", &["'step' is missing"]),
    ("end: \"70 ms\"", "end: 1e-4", "25:26", &["0.0005", "longer", "0.0001"]),
    ("end: \"70 ms\"", "end: -1", "25:14", &["the end must be > 0"]),
    ("beta: 0.25", "beta: 0", "25:64", &["explicit"]),
    ("gamma: 0.5", "gamma: 0.4", "25:77", &["gamma must be between 0.5 and 1, found 0.4"]),
    (
        "newmark: { beta: 0.25, gamma: 0.5 }",
        "hht: { spectral_radius: 0.3 }",
        "25:71",
        &["hht must be between 0.5 and 1"],
    ),
    (
        "newmark: { beta: 0.25, gamma: 0.5 }",
        "generalized_alpha: { spectral_radius: 1.1 }",
        "25:85",
        &["between 0 and 1, found 1.1"],
    ),
    ("coefficient: 1.0", "coefficient: -0.1", "18:41", &["coefficient of friction must be >= 0, found -0.1"]),
    ("\"1 mm/s\"", "0", "18:80", &["stick velocity must be > 0"]),
    ("\"1e-10 m/Pa\"", "-1e-10", "17:38", &["compliance must be > 0"]),
    ("compliance: \"1e-10 m/Pa\"", "compliance: 1e-10, penetration: 1e-4", "17:58", &["not by both"]),
    (
        "penalty: { compliance: \"1e-10 m/Pa\" }",
        "power_law: { stiffness: 1e14, exponent: 0 }",
        "17:55",
        &["the exponent must be > 0"],
    ),
    (
        "penalty: { compliance: \"1e-10 m/Pa\" }",
        "power_law: { stiffness: \"1 MPa/m\", exponent: 2 }",
        "17:39",
        &["a stiffness per area [Pa/m]", "Pa/m2"],
    ),
    ("max: [1, 1]", "max: [1, 0]", "5:42", &["no extent along y: max 0 <= min 0"]),
    ("cells: [4, 4]", "cells: [4, 0]", "5:53", &["at least one cell"]),
    ("cells: [4, 4]", "cells: [100000, 100000]", "5:53", &["10000000000 cells"]),
    ("fields: { every: 10 }", "checkpoint: { every: 0 }", "28:24", &["'every' must be >= 1"]),
    ("fields: { every: 10 }", "checkpoint: { keep: 0 }", "28:23", &["'keep' must be >= 1"]),
    ("fields: { every: 10 }", "checkpoint: { evry: 5 }", "28:17", &["unknown key 'evry'", "'every'"]),
    ("fields: { every: 10 }", "checkpoint: { wall_time: 0 }", "28:28", &["the wall time must be > 0"]),
    ("fields: { every: 10 }", "checkpoint: { wall_time: \"1 km\" }", "28:28", &["km"]),
    ("every: 10", "every: -1", "28:20", &[]),
    ("increments: 4", "increments: 0", "24:8", &["at least one increment"]),
    ("linear: auto", "newton: { tolerance: 2 }", "26:54", &["Newton tolerance must be > 0 and < 1, found 2"]),
    ("scheme: {", "cuts: 99, scheme: {", "25:43", &["halved 30 times"]),
    ("scheme: {", "growth: 0.5, scheme: {", "25:37", &["unknown key 'growth'"]),
    // Dimensions and names.
    ("element: quad4", "element: hex8", "5:70", &["hex8 is an element of 3D, the case has 2D"]),
    ("element: quad4", "element: tri3", "5:70", &["tri3", "selective_reduced", "quadrilaterals"]),
    ("min: [0, 0]", "min: [0, 0, 0]", "5:25", &["2 entries in 2D, found 3"]),
    ("normal: [0, 1]", "normal: [0, 0]", "12:44", &["normal of a plane is zero"]),
    (
        "plane: { point: [0, 0], normal: [0, 1] }",
        "cylinder: { point: [0, 0], axis: [0, 1], radius: 1 }",
        "12:31",
        &["3D", "use a `sphere`"],
    ),
    (
        "plane: { point: [0, 0], normal: [0, 1] }",
        "sphere: { center: [0, 0], radius: -1 }",
        "12:46",
        &["radius must be > 0"],
    ),
    (
        "plane: { point: [0, 0], normal: [0, 1] }",
        "sphere: { center: [0, 0], radius: 1, side: inner }",
        "12:55",
        &["unknown side 'inner'", "outside, inside"],
    ),
    ("target: floor", "target: flor", "16:13", &["unknown target 'flor'", "did you mean 'floor'?"]),
    ("target: floor", "target: block", "16:13", &["a surface", "whole body", "block.bottom"]),
    ("target: floor", "target: all", "15:16", &["`all` is the whole surface of all bodies", "both sides"]),
    ("  floor:", "  all:", "12:3", &["`all`", "reserved", "another name"]),
    ("area: current", "quadrature: nodal", "20:17", &["`quadrature` is not a key of a contact", "remove it"]),
    ("contactor: block.bottom", "contactor: blok.bottom", "15:16", &["unknown body 'blok'", "'block'"]),
    (
        "contactor: block.bottom",
        "contactor: block.botom",
        "15:16",
        &["the box 'block' has no set 'botom'", "did you mean 'bottom'"],
    ),
    (
        "contactor: block.bottom",
        "contactor: block.front",
        "15:16",
        &["no set 'front'", "left, right, bottom, top"],
    ),
    ("contactor: block.bottom", "contactor: floor", "15:16", &["'floor' is an obstacle", "exchange"]),
    ("on: block.top", "on: block.tip", "23:16", &["'tip'", "'top'"]),
    ("on: block.top", "on: floor", "23:16", &["expected a body", "'floor' is an obstacle"]),
    ("on: block }", "on: floor }", "30:31", &["is an obstacle"]),
    ("at: [0, 0]", "at: [0]", "30:19", &["2 entries in 2D, found 1"]),
    ("floor: {", "block: {", "12:3", &["'block' names both a body and an obstacle"]),
    ("  floor:", "  \"the.floor\":", "12:3", &["'the.floor'", "`obstacles`", "letters, digits"]),
    ("ksp_monitor", "-ksp_monitor", "31:10", &["PETSc option", "leading dash"]),
    // Boundaries and functions.
    (
        ", displacement: { x: \"1.0 * t\", y: -0.05 }",
        "",
        "23:3",
        &["'clamp' has no action", "displacement, motion, roller, gravity, traction, pressure"],
    ),
    (
        "displacement: {",
        "pressure: 1, displacement: {",
        "23:3",
        &["'clamp' has more than one action", "exactly one"],
    ),
    (
        "displacement: { x: \"1.0 * t\", y: -0.05 }",
        "displacement: {}",
        "23:3",
        &["'clamp' has no components", "{ x: 0, y:"],
    ),
    ("y: -0.05", "z: -0.05", "23:60", &["2D case", "no z"]),
    (
        "displacement: { x: \"1.0 * t\", y: -0.05 }",
        "gravity: [0, -9.81]",
        "23:16",
        &["gravity acts on a whole body"],
    ),
    (
        "on: block.top, displacement: { x: \"1.0 * t\", y: -0.05 }",
        "on: block, gravity: [0]",
        "23:32",
        &["gravity needs 2 entries"],
    ),
    (
        "on: block.top, displacement: { x: \"1.0 * t\", y: -0.05 }",
        "on: block, pressure: 1",
        "23:16",
        &["acts on a surface"],
    ),
    (
        "  clamp:",
        "  other: { on: block.top, displacement: { x: 0 } }\n  clamp:",
        "24:46",
        &["displacement x of 'block.top'", "twice"],
    ),
    ("\"1.0 * t\"", "\"1.0 * q\"", "23:53", &["unknown name 'q'", "known: x y z t"]),
    ("\"1.0 * t\"", "\"tnah(t)\"", "23:46", &["unknown name 'tnah'", "did you mean 'tanh'?"]),
    (
        "\"1.0 * t\"",
        "\"(t < 1) * 2\"",
        "23:46",
        &["a number is expected", "a condition", "if(condition, a, b)"],
    ),
    ("\"1.0 * t\"", "\"1 + (t < 1) * 2\"", "23:51", &["a number is expected", "a condition"]),
    ("\"1.0 * t\"", "\"if(t < 1, t > 2, 2)\"", "23:57", &["a number is expected", "a condition"]),
    ("\"1.0 * t\"", "\"t < 1\"", "23:46", &["a number is expected", "a condition"]),
    ("\"1.0 * t\"", "\"if(t, 1, 2)\"", "23:50", &["a condition is expected", "a number", "compare it"]),
    ("\"1.0 * t\"", "\"if(not t, 1, 2)\"", "23:54", &["a condition is expected", "a number"]),
    ("\"1.0 * t\"", "\"if(t < 1 and 2, 1, 2)\"", "23:60", &["a condition is expected", "a number"]),
    ("\"1.0 * t\"", "\"if(t or t < 2, 1, 2)\"", "23:50", &["a condition is expected", "a number"]),
    ("\"1.0 * t\"", "\"if(0 < t < 1, 1, 2)\"", "23:56", &["two sides", "0 < x and x < 1"]),
    ("\"1.0 * t\"", "\"atan2(t)\"", "23:54", &["expected ','"]),
    ("\"1.0 * t\"", "\"min(t)\"", "23:52", &["expected ','"]),
    ("\"1.0 * t\"", "\"sin(t, 1)\"", "23:52", &["expected ')'"]),
    ("\"1.0 * t\"", "\"mod(1, 0) * t\"", "23:46", &["the value is not finite"]),
    // Sets.
    (
        "kinematics: finite",
        "sets: { pad: \"x\" }\n    kinematics: finite",
        "8:18",
        &["a condition is expected", "compare it"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: \"t < 1\" }\n    kinematics: finite",
        "8:18",
        &["can not depend on t"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: \"x > 0.3 and\" }\n    kinematics: finite",
        "8:30",
        &["the expression ends"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: \"q > 0.3\" }\n    kinematics: finite",
        "8:18",
        &["unknown name 'q'"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: \"z < 1\" }\n    kinematics: finite",
        "8:13",
        &["a 2D case has no z"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: {} }\n    kinematics: finite",
        "8:18",
        &["exactly one of where, box"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { where: \"x > 1\", box: { min: [0, 0], max: [1, 1] } } }\n    kinematics: finite",
        "8:18",
        &["exactly one of where, box"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { where: \"x + 1\" } }\n    kinematics: finite",
        "8:27",
        &["a condition is expected"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { box: { min: [0], max: [1, 1] } } }\n    kinematics: finite",
        "8:32",
        &["the corner 'min' needs 2 entries"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { box: { min: [0, 0], max: [1, -1] } } }\n    kinematics: finite",
        "8:49",
        &["the box is empty: max -1 < min 0"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { sphere: { center: [0, 0], radius: 0 } } }\n    kinematics: finite",
        "8:54",
        &["the radius must be > 0"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { of: nods, where: \"x > 1\" } }\n    kinematics: finite",
        "8:24",
        &["unknown kind of set 'nods'", "did you mean 'nodes'"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { union: [left] } }\n    kinematics: finite",
        "8:27",
        &["two or more sets"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { of: nodes, union: [left, right] } }\n    kinematics: finite",
        "8:24",
        &["`of` has no meaning", "remove `of`"],
    ),
    (
        "kinematics: finite",
        "sets: { pad: { unoin: [left, right] } }\n    kinematics: finite",
        "8:20",
        &["unknown key 'unoin'", "'union'"],
    ),
    ("kinematics: finite", "sets: { pad: [1] }\n    kinematics: finite", "8:18", &["a condition such as"]),
    (
        "kinematics: finite",
        "sets: { \"a b\": \"x > 1\" }\n    kinematics: finite",
        "8:13",
        &["not a valid name in `sets`"],
    ),
    // Lists of sets.
    ("contactor: block.bottom", "contactor: [block.bottom, block.botom]", "15:31", &["has no set 'botom'"]),
    (
        "contactor: block.bottom",
        "contactor: [block.bottom, block.bottom]",
        "15:31",
        &["'block.bottom' occurs twice"],
    ),
    (
        "contactor: block.bottom",
        "contactor: []",
        "15:16",
        &["the list has no name", "[block.left, block.right]"],
    ),
    (
        "contactor: block.bottom",
        "contactor: [block.bottom, all]",
        "15:31",
        &["`all` contains every other surface"],
    ),
    (
        "contactor: block.bottom",
        "contactor: [block.bottom, floor]",
        "15:31",
        &["'floor' is an obstacle; the contactor"],
    ),
    ("contactor: block.bottom", "contactor: { a: 1 }", "15:16", &["a list of names"]),
    (
        "target: floor",
        "target: [floor, block.top]",
        "16:14",
        &["can not be one of several targets", "a contact of its own"],
    ),
    ("on: block.top", "on: [block.top, blok]", "23:28", &["unknown body 'blok'"]),
    ("on: block.top", "on: [block.top, block.left, block.tpo]", "23:40", &["has no set 'tpo'"]),
    // Parameters.
    (
        "dimension: 2",
        "parameters: { x: 1 }\ndimension: 2",
        "2:15",
        &["'x' is a variable or function", "another name"],
    ),
    ("dimension: 2", "parameters: { tanh: 1 }\ndimension: 2", "2:15", &["'tanh' is a variable or function"]),
    (
        "dimension: 2",
        "parameters: { a-b: 1 }\ndimension: 2",
        "2:15",
        &["'a-b' is not a valid name", "letter"],
    ),
    ("dimension: 2", "parameters: { a: \"b\", b: 1 }\ndimension: 2", "2:18", &["unknown name 'b'"]),
    ("dimension: 2", "parameters: { aa: 1, b: \"1 + aaa\" }\ndimension: 2", "2:30", &["did you mean 'aa'?"]),
    ("dimension: 2", "parameters: { a: \"2 * t\" }\ndimension: 2", "2:18", &["depends on x, y, z or t"]),
    ("dimension: 2", "parameters: { a: \"log(0)\" }\ndimension: 2", "2:18", &["not finite"]),
    ("dimension: 2", "parameters: { a: \"5 mmm\" }\ndimension: 2", "2:18", &["unknown unit 'mmm'"]),
    ("dimension: 2", "parameters: { a: [1] }\ndimension: 2", "2:18", &["expected a number", "found a list"]),
    ("dimension: 2", "parameters: 3\ndimension: 2", "2:13", &["expected a mapping"]),
    ("\"1.0 * t\"", "\"1.0 * (t\"", "23:55", &["expected ')'"]),
    ("\"1.0 * t\"", "\"1.0 * \"", "23:53", &["ends where a value should follow"]),
    ("\"1.0 * t\"", "1.0 * t 2", "23:54", &["unexpected '2'"]),
    ("\"1.0 * t\"", "5 MPa", "23:46", &["'5 MPa' is a pressure [Pa]", "expected a length"]),
    ("\"1.0 * t\"", "sin(t, 2)", "23:51", &["expected ')'"]),
    ("\"1.0 * t\"", "log(t)", "23:46", &["the value is not finite at t = 0"]),
    ("\"1.0 * t\"", "sqrt(t)", "23:46", &["the derivative is not finite at t = 0"]),
    ("\"1.0 * t\"", "{ table: [[0, 0], [0, 1]] }", "23:46", &["times of a table must increase: 0 after 0"]),
    ("\"1.0 * t\"", "{ table: [[0, 0], [1, .nan]] }", "23:68", &["finite number"]),
    ("\"1.0 * t\"", "{ table: [] }", "23:46", &["at least one row"]),
    ("\"1.0 * t\"", "{ tabel: [[0, 0]] }", "23:48", &["unknown key 'tabel'", "'table'"]),
    ("\"0.1 * y\"", "\"0.1 * t\"", "10:24", &["can not depend on t"]),
    // Statics.
    ("petsc:", "guard: { energy: 0 }\npetsc:", "31:18", &["energy guard must be > 0, found 0"]),
    ("petsc:", "guard: { energy: -0.1 }\npetsc:", "31:18", &["energy guard must be > 0"]),
    ("petsc:", "guard: { enegy: 0.1 }\npetsc:", "31:10", &["unknown key 'enegy'", "'energy'"]),
    (
        "density:",
        "mass: redistribted\n    density:",
        "7:11",
        &["unknown mass matrix 'redistribted'", "'redistributed'"],
    ),
    (
        TIME,
        "time: { end: 1, step: 0.1, scheme: conservng }",
        "25:36",
        &["unknown scheme 'conservng'", "'conserving'"],
    ),
    (TIME, "time: { end: 1, step: 0.1, scheme: static }", "24:8", &["static case", "remove `start`"]),
    (TIME, "time: { end: 1, scheme: { static: {} } }", "25:25", &["needs 'increments'"]),
    (
        TIME,
        "time: { end: 1, step: 1, scheme: { static: { increments: 4 } } }",
        "25:58",
        &["'step' or 'increments', not both"],
    ),
    (
        TIME,
        "time: { end: 1, step: 1, scheme: static }",
        "18:80",
        &["no slip velocity", "use `stick_stiffness`"],
    ),
    (TIME, "time: { end: 1, step: 1, scheme: static }", "10:23", &["initial velocity", "static scheme"]),
    ("friction: false", "friction: true", "18:80", &["no slip velocity"]),
    ("linear: auto", "linear: cg_icc", "26:41", &["friction makes it non-symmetric", "staggered"]),
    // YAML itself.
    ("[0, 0], max", "[0, 0, max", "5:25", &["bracket"]),
    ("density:", "\tdensity:", "7:6", &["begins with a tab"]),
    ("title: A", "title: 'A", "2:1", &["quoted"]),
    ("dimension: 2", "dimension: *two", "2:12", &["anchor"]),
    ("petsc:", "---\npetsc:", "32:1", &["a second document begins here", "one case"]),
];

/// Each broken case is refused with position, key words, and the line that is wrong.
#[test]
fn broken_cases_are_refused_with_position_and_reason() {
    let mut failures = Vec::new();
    for (from, to, position, words) in BROKEN {
        let text = with(from, to);
        let message = message(&text);
        let pointed = message.contains(&format!("case.yml:{position}: "));
        let missing: Vec<&&str> = words.iter().filter(|word| !message.contains(**word)).collect();
        if !pointed || !missing.is_empty() || !message.contains('^') {
            failures.push(format!("{to}\n  expected at {position}: {words:?}\n  got: {message}"));
        }
    }
    assert!(failures.is_empty(), "{} of {}:\n{}", failures.len(), BROKEN.len(), failures.join("\n\n"));
}

/// The error of the contract, to the letter.
#[test]
fn the_message_shows_place_line_and_cure() {
    let text = with("coulomb:", "coulumb:");
    let expected = "\
case.yml:18:17: unknown friction law 'coulumb'
   |
18 |     friction: { coulumb: { coefficient: 1.0, regularization: { stick_velocity: \"1 mm/s\" } } }
   |                 ^^^^^^^
hint: known: none, coulomb, power_law; did you mean 'coulomb'?";
    assert_eq!(message(&text), expected);
}

/// Several faults are shown together, in the order of the file.
#[test]
fn all_semantic_faults_are_shown() {
    let text = with("\"1700 kg/m3\"", "-1").replace("fields: { every: 10 }", "checkpoint: { every: 0 }");
    let message = message(&text);
    let (first, second) = (message.find(":7:14:"), message.find(":28:24:"));
    assert!(first.is_some() && first < second, "{message}");
}

/// Blocks that several keys share are named by these keys, not by their types.
#[test]
fn keys_belong_to_keys() {
    let message = message(&with("density:", "x: 1\n    density:"));
    assert!(message.contains("unknown key 'x'") && message.contains("displacement"), "{message}");
    assert!(!message.contains("components"), "{message}");
}
