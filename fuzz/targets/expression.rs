//! Any text is an expression or an error; what is one has a value and derivatives everywhere, finite or not.
#![no_main]

use contact_petsc::case::Function;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    contact_petsc_fuzz::watch();
    let Ok(function) = Function::expression(text) else { return };
    for point in [[0.0; 3], [1.0, -2.0, 1e300], [f64::NAN, f64::INFINITY, 5e-324]] {
        for t in [0.0, 1.5, f64::MAX] {
            let (value, motion) = (function.value(point, t), function.motion(point, t));
            assert!(value == motion.value || value.is_nan() && motion.value.is_nan(), "{value} {motion:?}");
        }
    }
});
