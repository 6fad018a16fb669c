//! The stress over a step: its work, its limit, its tangent.

use super::*;

fn between<const D: usize>(start: &Square<f64, D>, end: &Square<f64, D>) -> Square<f64, D> {
    scale_all(&sum(start, end), 0.5)
}

fn over_step<P: Law, const D: usize>(
    constants: &P::Constants,
    start: &Square<f64, D>,
    middle: &Square<f64, D>,
) -> Square<f64, D> {
    let motion = StepMotion::new(*start, *middle);
    let stress = P::respond_step(constants, &motion).second_piola;
    let alone = P::stress_over_step(constants, &motion);
    let apart = flat(&stress).iter().zip(flat(&alone)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart <= 1e-15 * double_dot(&stress, &stress).sqrt(), "{stress:?} {alone:?}");
    stress
}

struct Works;
impl LawTest for Works {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        for (seed, size) in [(1, 0.3), (2, 0.25), (3, 1e-3), (4, 1e-8)] {
            for step in [1.0, 1e-3, 1e-9, 0.0] {
                let start = gradient::<D>(size, seed);
                let moved = gradient::<D>(size * step, seed + 10);
                let end = sum(&start, &moved);
                let middle = between(&start, &end);
                let piola = first_piola(&middle, &over_step::<P, D>(constants, &start, &middle));
                let work = double_dot(&piola, &moved);
                let [before, after]: [f64; 2] = [&start, &end].map(|h| P::energy(constants, h));
                // The energies have the rounding of the growth of volume, of which they are the second-order part.
                let digits = 1e-14 * before.max(after) + 1e-16 * size;
                assert!(
                    (work - (after - before)).abs() < digits,
                    "{name}, {size}, {step}: {work} {after} {before}"
                );
                if step == 0.0 {
                    let exact = first_piola(&start, &P::stress(constants, &start));
                    let apart = sum(&piola, &scale_all(&exact, -1.0));
                    let rest = double_dot(&apart, &apart).sqrt();
                    assert!(rest < 1e-14 * double_dot(&exact, &exact).sqrt().max(size), "{name}: {rest}");
                }
            }
        }
    }
}

/// Over steps of any size, none included, the work of the stress is the change of the energy to rounding; without a step
/// the stress is the law's own.
#[test]
fn stress_over_a_step_does_the_work_of_the_energy() {
    for_every_law(Works);
}

struct LargeSteps;
impl LawTest for LargeSteps {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        // From a third of the volume to five times as much, with shear: all functions leave their series.
        let mut start = scale_all(&diagonal(1.0), -0.3);
        let mut end = scale_all(&diagonal(1.0), 0.7);
        start[0][1] = 0.2;
        end[1][0] = -0.4;
        let middle = between(&start, &end);
        let moved = sum(&end, &scale_all(&start, -1.0));
        let piola = first_piola(&middle, &over_step::<P, D>(constants, &start, &middle));
        let gained: f64 = P::energy(constants, &end) - P::energy(constants, &start);
        assert!(
            (double_dot(&piola, &moved) - gained).abs() < 1e-14 * gained.abs().max(1.0),
            "{name}: {gained}"
        );
    }
}

/// The work is the change of the energy over a step of 500 % of the volume as well.
#[test]
fn stress_over_a_large_step_does_the_work_of_the_energy() {
    for_every_law(LargeSteps);
}

struct Reversals;
impl LawTest for Reversals {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let start = gradient::<D>(0.25, 21);
        let end = sum(&start, &gradient::<D>(0.2, 22));
        let middle = between(&start, &end);
        let forth = over_step::<P, D>(constants, &start, &middle);
        let back = over_step::<P, D>(constants, &end, &middle);
        for i in 0..D {
            for j in 0..D {
                assert!((forth[i][j] - back[i][j]).abs() < 4e-15, "{name}: {forth:?} {back:?}");
                assert!((forth[i][j] - forth[j][i]).abs() < 1e-15, "{name}: not symmetric");
            }
        }
    }
}

/// The stress over a step is a symmetric matrix, and the same for the reverse step.
#[test]
fn stress_over_a_step_is_symmetric() {
    for_every_law(Reversals);
}

struct Tangents;
impl LawTest for Tangents {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let start = gradient::<D>(0.2, 5);
        for size in [0.1, 0.0] {
            let middle = sum(&start, &gradient::<D>(size, 6));
            let motion = |x: &[f64]| StepMotion::new(start, square(x));
            let stress = |x: &[f64]| flat(&P::stress_over_step(constants, &motion(x)));
            let change = |x: &[f64], d: &[f64]| {
                let motion = motion(x);
                let response = P::respond_step(constants, &motion);
                let f_end = plus_one(&motion.end);
                let strain = small_strain(&product(&transpose(&f_end), &scale_all(&square(d), 2.0)));
                flat(&P::contract_step(&response.tangent, &strain))
            };
            let rate = taylor_rate(stress, change, &flat(&middle), &flat(&gradient::<D>(0.2, 7)));
            assert!(rate > 1.9, "{name}: {rate}");
        }
    }
}

/// The tangent of the stress over a step is its derivative by the end of the step, to second order, also where the end is the
/// start.
#[test]
fn tangent_over_a_step_has_order_two() {
    for_every_law(Tangents);
}

/// Lanes and plain numbers may be used alike in a law over a step.
#[test]
fn steps_take_any_number_with_ratios() {
    fn accepts<T: RatioSlope>() {}
    accepts::<f64>();
}
