//! Functions of space and time, and their exact time derivatives.

use super::super::{Action, Case, Function};
use super::with;

const SPACE: [f64; 3] = [0.3, -0.7, 1.1];

/// Expressions evaluate with the usual precedence.
#[test]
fn expressions_evaluate() {
    let [x, y, z] = SPACE;
    let t = 0.9_f64;
    for (text, value) in [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("2 - 3 - 4", -5.0),
        ("16 / 4 / 2", 2.0),
        ("2 ^ 3 ^ 2", 512.0),
        ("-2 ^ 2", -4.0),
        ("2 ^ -1", 0.5),
        ("-x * -y", x * y),
        ("x + y * z - t", x + y * z - t),
        ("sin(t) + cos(t) * exp(-t)", t.sin() + t.cos() * (-t).exp()),
        ("log(t) + sqrt(t) + abs(y)", t.ln() + t.sqrt() + y.abs()),
        ("min(x, y) + 10 * max(x, y)", y + 10.0 * x),
        ("2 * pi", std::f64::consts::TAU),
        ("1.5e-3 * t", 1.5e-3 * t),
        ("if(t < 1, 5, 6)", 5.0),
        ("if(t >= 1, 5, 6)", 6.0),
        ("if(x <= x and x > y and x != y, 1, 0)", 1.0),
        ("if(x == y or x < y, 1, 0)", 0.0),
        ("if(x == y or x < y and x == x or 1 >= 1, 1, 0)", 1.0),
        ("if(not x == y and not (x < y or y > x), 1, 0)", 1.0),
        ("if((x > y) or (not x > y), (1), 0)", 1.0),
        ("min(3, x, 2, y, 4) + 10 * max(y, x, -1)", y + 10.0 * x),
        ("tanh(t) + tanh(1000)", t.tanh() + 1.0),
        ("atan2(y, x) + atan2(x, y)", y.atan2(x) + x.atan2(y)),
        ("pow(t, 3) - t^3", 0.0),
        ("mod(7.5, 2)", 1.5),
        ("mod(-7.5, 2)", 0.5),
        ("mod(7.5, -2)", -0.5),
        ("mod(6, 2)", 0.0),
        ("if(t < 1, t, log(0 - 1))", t),
    ] {
        let found = Function::expression(text).unwrap().value(SPACE, t);
        assert!((found - value).abs() <= 1e-14 * value.abs(), "{text}: {found} for {value}");
    }
}

/// The value with derivatives is the value, also where those are none: a negative number to a power that varies.
#[test]
fn values_do_not_depend_on_how_they_are_asked_for() {
    for text in [
        "(-1) ^ (-t)",
        "0 ^ t",
        "(x - 0.3) ^ t",
        "-(- 1+++++++1)^-t",
        "--(- +t)/-t",
        "x / (49 * t)",
        "atan2(t, x - 0.3)",
        "mod(t, x - 0.3)",
        "mod(x, t - 1)",
        "tanh(1 / t)",
    ] {
        for t in [0.0, 1.0, 2.0, f64::MAX] {
            let function = Function::expression(text).unwrap();
            let (value, motion) = (function.value(SPACE, t), function.motion(SPACE, t).value);
            assert!(value == motion || value.is_nan() && motion.is_nan(), "{text} at {t}: {value}, {motion}");
        }
    }
}

/// Rate and second derivative are those of the value: the Taylor remainders fall with orders 2 and 3.
#[test]
fn motion_passes_the_taylor_test() {
    for text in [
        "1.0 * t",
        "t^2 - 3 * t^3",
        "t^0.5 + t^-1.5",
        "2^t + t^t",
        "sin(10 * t) * cos(x + t)",
        "exp(-t) / (1 + t^2)",
        "log(1 + t) * sqrt(t + x)",
        "abs(0 - t) + abs(y * t)",
        "min(t^2, 5 * t) + max(t^3, 0 - t)",
        "if(t < 2, 0.5 * t - 0.1 * sin(3 * t), t)",
        "-(t * x) ^ 2",
        "tanh(3 * t - 2)",
        "atan2(sin(3 * t), cos(3 * t))",
        "atan2(t^2, -3 - t) + atan2(-1 - t, t^3)",
        "pow(t, 2.5) + pow(1 + t, t)",
        "mod(3 * t^2, 0.7) + mod(-t, 1 + t)",
        "min(5, t^2, 2 * t) + max(t^3, t^2, 0 - t)",
        "if(t > 0.5 and not t > 2, t^2, 0)",
        "y / t",
    ] {
        let function = Function::expression(text).unwrap();
        let t = 0.8;
        let motion = function.motion(SPACE, t);
        assert!((motion.value - function.value(SPACE, t)).abs() <= 1e-14, "{text}");
        let remainder = |h: f64| {
            let exact = function.value(SPACE, t + h);
            let first = exact - motion.value - h * motion.rate;
            (first.abs(), (first - 0.5 * h * h * motion.second).abs())
        };
        let (coarse, fine) = (remainder(2e-3), remainder(1e-3));
        let order = |coarse: f64, fine: f64| if coarse < 1e-13 { 9.0 } else { (coarse / fine).log2() };
        assert!(order(coarse.0, fine.0) > 1.9, "{text}: rate {coarse:?} {fine:?}");
        assert!(order(coarse.1, fine.1) > 2.7, "{text}: second {coarse:?} {fine:?}");
    }
}

/// Powers are differentiable where x^1 and x^2 are, also at zero.
#[test]
fn powers_have_derivatives_at_zero() {
    for (text, rate, second) in [("t^1", 1.0, 0.0), ("t^2", 0.0, 2.0), ("t^3", 0.0, 0.0), ("t^0", 0.0, 0.0)] {
        let motion = Function::expression(text).unwrap().motion([0.0; 3], 0.0);
        assert_eq!((motion.rate, motion.second), (rate, second), "{text}");
    }
}

/// A table is linear between its rows and constant outside.
#[test]
fn tables_interpolate() {
    let table = Function::table(vec![[0.0, 0.0], [0.01, 8.0e4], [0.02, 0.0]]).unwrap();
    for (t, value, rate) in [
        (-1.0, 0.0, 0.0),
        (0.0, 0.0, 8.0e6),
        (0.005, 4.0e4, 8.0e6),
        (0.01, 8.0e4, -8.0e6),
        (0.015, 4.0e4, -8.0e6),
        (0.02, 0.0, 0.0),
        (1.0, 0.0, 0.0),
    ] {
        let motion = table.motion([0.0; 3], t);
        assert!((motion.value - value).abs() < 1e-9 && (motion.rate - rate).abs() < 1e-6, "{t}: {motion:?}");
        assert_eq!(motion.second, 0.0);
    }
}

/// The queries by which a caller saves work tell the truth.
#[test]
fn queries_tell_what_varies() {
    let f = |text: &str| Function::expression(text).unwrap();
    assert!(
        f("2 * 3").is_constant_in_time() && f("x").is_constant_in_time() && !f("x * t").is_constant_in_time()
    );
    assert!(f("t").is_constant_in_space() && !f("x * t").is_constant_in_space());
    assert!(f("1 - 1").is_zero() && !f("x").is_zero() && !Function::constant(1.0).is_zero());
    let table = |value: f64| Function::table(vec![[0.0, 0.0], [1.0, value]]).unwrap();
    assert!(table(0.0).is_zero() && table(0.0).is_constant_in_time() && !table(1.0).is_constant_in_time());
}

/// A value with a unit, an expression and a table with units stand where a value varies.
#[test]
fn varying_values_take_units() {
    for (written, value) in [
        ("\"-50 mm\"", -0.05),
        ("-50 mm", -0.05),
        ("-0.05", -0.05),
        ("\"-0.1 * t\"", -0.05),
        ("{ table: [[\"0 ms\", 0], [\"1000 ms\", \"-100 mm\"]] }", -0.05),
        ("{ table: [[0.5, -0.05]] }", -0.05),
    ] {
        let case = Case::parse(&with("y: -0.05", &format!("y: {written}")), "case.yml").unwrap();
        let clamp = case.boundary.get("clamp").unwrap();
        let actions: Vec<Action> = clamp.actions().collect();
        let [Action::Displacement([_, Some(y), None])] = actions[..] else { panic!("{actions:?}") };
        assert!((y.value(SPACE, 0.5) - value).abs() < 1e-15, "{written}");
    }
}
