//! Every law of the table: energy, stress and tangent against each other and against dual numbers.

use super::*;
use crate::square::{diagonal, inner_gram, outer_gram, plus_one, product, transpose};
use crate::taylor::{scatter, taylor_rate};
use num_dual::{DualNum, HyperDual64};

impl Real for HyperDual64 {
    fn constant(self, x: f64) -> Self {
        Self::from_re(x)
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    fn recip(self) -> Self {
        DualNum::recip(&self)
    }
    fn ln_1p(self) -> Self {
        DualNum::ln_1p(&self)
    }
    fn ln_1p_ratio(self) -> [Self; 2] {
        let ratio = DualNum::ln_1p(&self) / self;
        [ratio - 1.0, (DualNum::recip(&(self + 1.0)) - ratio) / self]
    }
}

const MODULI: Moduli<f64> = Moduli { lambda: 1.7, mu: 0.6 };

fn square<const D: usize>(numbers: &[f64]) -> Square<f64, D> {
    std::array::from_fn(|i| std::array::from_fn(|j| numbers[i * D + j]))
}

fn flat<const D: usize>(a: &Square<f64, D>) -> Vec<f64> {
    a.iter().flatten().copied().collect()
}

/// A moderate gradient, det F well above zero.
fn gradient<const D: usize>(seed: u32) -> Square<f64, D> {
    square(&scatter(D * D, seed).iter().map(|x| 0.25 * x).collect::<Vec<_>>())
}

/// `dP` for the change `d` of the gradient, from the tangent in the form that the kernel uses.
fn piola_change<L: Law, const D: usize>(h: &Square<f64, D>, d: &Square<f64, D>) -> Square<f64, D> {
    let response = L::respond(&MODULI, h);
    let a = response.gradient_map;
    let (metric, pushed) = match L::METRIC {
        Metric::Reference => (diagonal(1.0), outer_gram(&a)),
        Metric::Current => (inner_gram(&a), diagonal(1.0)),
        Metric::Linear => (diagonal(1.0), diagonal(1.0)),
    };
    let volume: f64 = flat(&a).iter().zip(flat(d)).map(|(a, d)| a * d).sum();
    let twist = product(&product(&a, &transpose(d)), &a);
    let shear = product(&product(&pushed, d), &metric);
    let stress = product(d, &response.second_piola);
    let geometric = if L::METRIC == Metric::Linear { 0.0 } else { 1.0 };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            response.lam * volume * a[i][j]
                + response.q * (shear[i][j] + twist[i][j])
                + geometric * stress[i][j]
        })
    })
}

fn derivatives<L: Law, const D: usize>(name: &str) {
    let (x, d) = (flat(&gradient::<D>(3)), flat(&gradient::<D>(4)));
    let energy = |h: &[f64]| vec![L::energy(&MODULI, &square::<D>(h))];
    let work = |h: &[f64], d: &[f64]| {
        vec![flat(&L::respond(&MODULI, &square::<D>(h)).first_piola).iter().zip(d).map(|(p, d)| p * d).sum()]
    };
    let rate = taylor_rate(energy, work, &x, &d);
    assert!(rate > 1.9, "{name}: the stress is not the derivative of the energy in {D}D: order {rate}");
    let piola = |h: &[f64]| flat(&L::respond(&MODULI, &square::<D>(h)).first_piola);
    let change = |h: &[f64], d: &[f64]| flat(&piola_change::<L, D>(&square(h), &square(d)));
    let rate = taylor_rate(piola, change, &x, &d);
    assert!(rate > 1.9, "{name}: the tangent is not the derivative of the stress in {D}D: order {rate}");
}

/// Second derivatives of the energy by hyper-dual numbers against stress and tangent, all components.
fn oracle<L: Law, const D: usize>(name: &str) {
    let h = gradient::<D>(5);
    let response = L::respond(&MODULI, &h);
    for (first, second) in (0..D * D).flat_map(|p| (0..D * D).map(move |q| (p, q))) {
        let mut dual: Square<HyperDual64, D> = h.map(|row| row.map(HyperDual64::from_re));
        dual[first / D][first % D].eps1 = 1.0;
        dual[second / D][second % D].eps2 = 1.0;
        let moduli =
            Moduli { lambda: HyperDual64::from_re(MODULI.lambda), mu: HyperDual64::from_re(MODULI.mu) };
        let energy = L::energy(&moduli, &dual);
        assert!((energy.eps1 - response.first_piola[first / D][first % D]).abs() < 1e-14, "{name}: stress");
        let mut unit = [[0.0; D]; D];
        unit[second / D][second % D] = 1.0;
        let change = piola_change::<L, D>(&h, &unit)[first / D][first % D];
        assert!(
            (energy.eps1eps2 - change).abs() < 1e-13,
            "{name}: tangent {first} {second}: {energy:?} {change}"
        );
    }
}

fn rotation<const D: usize>(angle: f64) -> Square<f64, D> {
    let mut r = diagonal(1.0);
    (r[0][0], r[0][1], r[1][0], r[1][1]) = (angle.cos(), -angle.sin(), angle.sin(), angle.cos());
    if D == 3 {
        let mut tilt = diagonal(1.0);
        (tilt[1][1], tilt[1][2], tilt[2][1], tilt[2][2]) = (0.6, -0.8, 0.8, 0.6);
        r = product(&tilt, &r);
    }
    r
}

fn minus_one<const D: usize>(mut f: Square<f64, D>) -> Square<f64, D> {
    for i in 0..D {
        f[i][i] -= 1.0;
    }
    f
}

fn rotations<L: Law, const D: usize>(name: &str) {
    let r = rotation::<D>(2.0);
    let still = L::respond(&MODULI, &minus_one(r));
    assert!(flat(&still.second_piola).iter().all(|s| s.abs() < 1e-15), "{name}: {still:?}");
    assert!(L::energy(&MODULI, &minus_one(r)).abs() < 1e-15, "{name}");
    let h = gradient::<D>(6);
    let turned = L::respond(&MODULI, &minus_one(product(&r, &plus_one(&h))));
    let plain = L::respond(&MODULI, &h);
    for (a, b) in flat(&turned.second_piola).iter().zip(flat(&plain.second_piola)) {
        assert!((a - b).abs() < 1e-14, "{name}: a rotation changes the stress");
    }
}

fn small_strains<L: Law, const D: usize>(name: &str) {
    let h: Square<f64, D> = gradient::<D>(7).map(|row| row.map(|x| 1e-12 * x));
    let exact = Hooke::respond(&MODULI, &h);
    for (a, b) in flat(&L::respond(&MODULI, &h).second_piola).iter().zip(flat(&exact.second_piola)) {
        assert!((a - b).abs() < 1e-11 * b.abs(), "{name}: lost digits at small strain: {a} {b}");
    }
    let h: Square<f64, D> = gradient::<D>(7).map(|row| row.map(|x| 1e-7 * x));
    let (energy, hooke) = (L::energy(&MODULI, &h), Hooke::energy(&MODULI, &h));
    assert!((energy - hooke).abs() < 1e-5 * hooke, "{name}: {energy} {hooke}");
}

macro_rules! for_every_law {
    ($test:ident) => {
        for entry in MATERIALS {
            match entry.model {
                Model::SaintVenantKirchhoff => {
                    $test::<SaintVenantKirchhoff, 2>(entry.name);
                    $test::<SaintVenantKirchhoff, 3>(entry.name);
                }
                Model::NeoHookean => {
                    $test::<NeoHookean, 2>(entry.name);
                    $test::<NeoHookean, 3>(entry.name);
                }
            }
        }
    };
}

/// Energy, stress and tangent of every law are derivatives of one another, to second order.
#[test]
fn stress_and_tangent_have_order_two() {
    for_every_law!(derivatives);
    derivatives::<Hooke, 2>("hooke");
    derivatives::<Hooke, 3>("hooke");
}

/// Automatic second derivatives of the energy give the same stress and tangent, every component.
#[test]
fn dual_numbers_agree() {
    for_every_law!(oracle);
}

/// A rigid rotation gives no stress and no energy, and turns with the body otherwise.
#[test]
fn laws_are_objective() {
    for_every_law!(rotations);
}

/// At strains of 1e-12 every law is Hooke's with all its digits.
#[test]
fn small_strains_keep_their_digits() {
    for_every_law!(small_strains);
}

/// Plane strain is the solid with a zero third direction, stress components included.
#[test]
fn plane_strain_is_the_solid_held_flat() {
    fn compare<L: Law>(h: &Square<f64, 2>) {
        let solid = [[h[0][0], h[0][1], 0.0], [h[1][0], h[1][1], 0.0], [0.0; 3]];
        let (flat, full) = (L::respond(&MODULI, h), L::respond(&MODULI, &solid));
        for i in 0..2 {
            for j in 0..2 {
                assert!((flat.second_piola[i][j] - full.second_piola[i][j]).abs() < 1e-14);
            }
        }
        assert!((L::energy(&MODULI, h) - L::energy(&MODULI, &solid)).abs() < 1e-14);
    }
    compare::<SaintVenantKirchhoff>(&gradient(8));
    compare::<NeoHookean>(&gradient(8));
}

/// Parameters out of range and unknown names are refused with a cure.
#[test]
fn wrong_parameters_are_refused() {
    for (young, poisson) in [
        (0.0, 0.3),
        (-1.0, 0.3),
        (f64::NAN, 0.3),
        (f64::INFINITY, 0.3),
        (1.0, 0.5),
        (1.0, -1.0),
        (1.0, f64::NAN),
    ] {
        assert!(Material::named("neo_hookean", young, poisson).is_err(), "{young} {poisson}");
    }
    let unknown = Material::named("rubber", 1.0, 0.3).unwrap_err();
    assert!(unknown.message.contains("known: saint_venant_kirchhoff, neo_hookean"), "{unknown}");
    let rubber = Material::named("neo_hookean", 5e6, 0.45).unwrap().moduli;
    assert!((rubber.mu - 1.724e6).abs() < 1e3 && (rubber.lambda - 15.517e6).abs() < 1e3);
}
