//! The stress over a step: its work, its limit, its tangent.

use super::*;
use crate::square::{double_dot, product, scale_all, small_strain, sum, transpose};
use crate::taylor::{scatter, taylor_rate};

const MODULI: Moduli<f64> = Moduli { lambda: 1.7, mu: 0.6 };

fn gradient<const D: usize>(size: f64, seed: u32) -> Square<f64, D> {
    let numbers = scatter(D * D, seed);
    std::array::from_fn(|i| std::array::from_fn(|j| size * numbers[i * D + j]))
}

fn between<const D: usize>(start: &Square<f64, D>, end: &Square<f64, D>) -> Square<f64, D> {
    scale_all(&sum(start, end), 0.5)
}

fn first_piola<L: StepLaw, const D: usize>(
    start: &Square<f64, D>,
    middle: &Square<f64, D>,
) -> Square<f64, D> {
    let response = L::step(&MODULI, start, middle);
    product(&response.middle, &response.second_piola)
}

fn works<L: StepLaw, const D: usize>(name: &str) {
    for (seed, size) in [(1, 0.3), (2, 0.25), (3, 1e-3), (4, 1e-8)] {
        for step in [1.0, 1e-3, 1e-9, 0.0] {
            let start = gradient::<D>(size, seed);
            let moved = gradient::<D>(size * step, seed + 10);
            let end = sum(&start, &moved);
            let piola = first_piola::<L, D>(&start, &between(&start, &end));
            let work = double_dot(&piola, &moved);
            let gained = L::energy(&MODULI, &end) - L::energy(&MODULI, &start);
            // The energies have the rounding of the growth of volume, of which they are the second-order part.
            let digits = 1e-14 * L::energy(&MODULI, &start).max(L::energy(&MODULI, &end)) + 1e-16 * size;
            assert!((work - gained).abs() < digits, "{name} {D}D, {size}, {step}: {work} {gained}");
            if step == 0.0 {
                let exact = L::respond(&MODULI, &start).first_piola;
                let apart = sum(&piola, &scale_all(&exact, -1.0));
                let rest = double_dot(&apart, &apart).sqrt();
                assert!(rest < 1e-14 * double_dot(&exact, &exact).sqrt().max(size), "{name}: {rest}");
            }
        }
    }
}

fn tangents<L: StepLaw, const D: usize>(name: &str) {
    let start = gradient::<D>(0.2, 5);
    let middle = sum(&start, &gradient::<D>(0.1, 6));
    let square =
        |x: &[f64]| -> Square<f64, D> { std::array::from_fn(|i| std::array::from_fn(|j| x[i * D + j])) };
    let flat = |a: Square<f64, D>| a.as_flattened().to_vec();
    let stress = |x: &[f64]| flat(L::step(&MODULI, &start, &square(x)).second_piola);
    let change = |x: &[f64], d: &[f64]| {
        let response = L::step(&MODULI, &start, &square(x));
        let strain = small_strain(&product(&transpose(&response.end), &scale_all(&square(d), 2.0)));
        flat(L::change(&response.tangent, &strain))
    };
    let rate = taylor_rate(stress, change, &flat(middle), &flat(gradient::<D>(0.2, 7)));
    assert!(rate > 1.9, "{name} {D}D: {rate}");
}

/// Over steps of any size, none included, the work of the stress is the change of the energy to rounding; without a step
/// the stress is the law's own.
#[test]
fn stress_over_a_step_does_the_work_of_the_energy() {
    works::<SaintVenantKirchhoff, 2>("saint_venant_kirchhoff");
    works::<SaintVenantKirchhoff, 3>("saint_venant_kirchhoff");
    works::<NeoHookean, 2>("neo_hookean");
    works::<NeoHookean, 3>("neo_hookean");
}

/// The tangent of the stress over a step is its derivative by the end of the step, to second order.
#[test]
fn tangent_over_a_step_has_order_two() {
    tangents::<SaintVenantKirchhoff, 2>("saint_venant_kirchhoff");
    tangents::<SaintVenantKirchhoff, 3>("saint_venant_kirchhoff");
    tangents::<NeoHookean, 2>("neo_hookean");
    tangents::<NeoHookean, 3>("neo_hookean");
}
