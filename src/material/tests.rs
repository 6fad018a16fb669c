//! Every law of the table: energy, stress and tangent against each other, against dual numbers and against closed forms.

use super::*;
use crate::composed::{Composed, PairFunction};
use crate::lanes::isochoric::{Logarithm, Logarithmic, Traces, solve};
use crate::lanes::{RatioSlope, Real};
use crate::square::{
    Square, diagonal, double_dot, green_strain, plus_one, product, scale_all, small_strain, sum, transpose,
};
use crate::taylor::{scatter, taylor_rate};
use num_dual::{DualNum, HyperDual64};

mod deviator;
mod mooney_rivlin;
mod plane_stress;
mod rubber;
mod step;

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
    fn ln_1p_remainder(self) -> Self {
        self - DualNum::ln_1p(&self)
    }
    fn exp_m1(self) -> Self {
        DualNum::exp_m1(&self)
    }
    fn exp_m1_remainder(self) -> Self {
        DualNum::exp_m1(&self) - self
    }
}

impl Logarithmic for HyperDual64 {
    /// Newton's method from the solution in plain numbers; every step doubles the order of the derivatives.
    fn isochoric_logarithm(traces: Traces<Self>) -> Logarithm<Self> {
        let plain = f64::isochoric_logarithm(Traces { even: traces.even.re, odd: traces.odd.re });
        let mut found = Logarithm { second: Self::from_re(plain.second), third: Self::from_re(plain.third) };
        for _ in 0..2 {
            let reached = found.traces();
            let rest = [traces.even - reached.even, traces.odd - reached.odd];
            let [second, third] = solve(&found.slopes(), rest);
            found.second += second;
            found.third += third;
        }
        found
    }
}

impl Composed for HyperDual64 {
    fn composed<F: PairFunction>(function: &F, pair: [Self; 2]) -> Self {
        function.of(pair)
    }
}

fn square<const D: usize>(numbers: &[f64]) -> Square<f64, D> {
    std::array::from_fn(|i| std::array::from_fn(|j| numbers[i * D + j]))
}

fn flat<const D: usize>(a: &Square<f64, D>) -> Vec<f64> {
    a.iter().flatten().copied().collect()
}

/// A gradient of that size.
fn gradient<const D: usize>(size: f64, seed: u32) -> Square<f64, D> {
    square(&scatter(D * D, seed).iter().map(|x| size * x).collect::<Vec<_>>())
}

fn first_piola<const D: usize>(grad_u: &Square<f64, D>, second_piola: &Square<f64, D>) -> Square<f64, D> {
    product(&plus_one(grad_u), second_piola)
}

/// A test of a law in two or three dimensions, with its name and its constants.
trait LawTest {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, moduli: Moduli<f64>);
}

struct Both<'a, K> {
    name: &'a str,
    test: std::marker::PhantomData<K>,
}

impl<K: LawTest> LawTask for Both<'_, K> {
    type Output = ();
    fn run<P: Law>(self, law: &P) {
        for part in Part::ALL {
            let name = format!("{} ({part:?})", self.name);
            let moduli = law.moduli().part(part);
            K::check::<P, 2>(&format!("{name} 2D"), &law.constants(part), moduli);
            K::check::<P, 3>(&format!("{name} 3D"), &law.constants(part), moduli);
        }
    }
}

/// Runs a test with every law of the table, whole and in parts, in the plane and in space.
fn for_every_law<K: LawTest>(_: K) {
    for entry in MATERIALS {
        for law in (entry.samples)() {
            law.accept(Both::<K> { name: entry.name, test: std::marker::PhantomData });
        }
    }
}

/// `dP` for the change `d` of the gradient.
fn piola_change<P: Law, const D: usize>(
    constants: &P::Constants,
    h: &Square<f64, D>,
    d: &Square<f64, D>,
) -> Square<f64, D> {
    let response = P::respond(constants, h);
    let strain = small_strain(&product(&transpose(&plus_one(h)), d));
    let material = first_piola(h, &P::contract(&response.tangent, &strain));
    sum(&material, &product(d, &response.second_piola))
}

struct Derivatives;
impl LawTest for Derivatives {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let (x, d) = (flat(&gradient::<D>(0.25, 3)), flat(&gradient::<D>(0.25, 4)));
        let energy = |h: &[f64]| vec![P::energy(constants, &square::<D>(h))];
        let piola = |h: &[f64]| flat(&first_piola(&square::<D>(h), &P::stress(constants, &square::<D>(h))));
        let work = |h: &[f64], d: &[f64]| vec![piola(h).iter().zip(d).map(|(p, d)| p * d).sum()];
        let rate = taylor_rate(energy, work, &x, &d);
        assert!(rate > 1.9, "{name}: the stress is not the derivative of the energy: order {rate}");
        let change = |h: &[f64], d: &[f64]| flat(&piola_change::<P, D>(constants, &square(h), &square(d)));
        let rate = taylor_rate(piola, change, &x, &d);
        assert!(rate > 1.9, "{name}: the tangent is not the derivative of the stress: order {rate}");
    }
}

/// Energy, stress and tangent of every law are derivatives of one another, to second order.
#[test]
fn stress_and_tangent_have_order_two() {
    for_every_law(Derivatives);
}

struct Oracle;
impl LawTest for Oracle {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let h = gradient::<D>(0.25, 5);
        let response = P::respond(constants, &h);
        let piola = first_piola(&h, &response.second_piola);
        let alone = P::stress(constants, &h);
        for (first, second) in (0..D * D).flat_map(|p| (0..D * D).map(move |q| (p, q))) {
            let mut dual: Square<HyperDual64, D> = h.map(|row| row.map(HyperDual64::from_re));
            dual[first / D][first % D].eps1 = 1.0;
            dual[second / D][second % D].eps2 = 1.0;
            let energy = P::energy(constants, &dual);
            let (i, j) = (first / D, first % D);
            assert!((energy.eps1 - piola[i][j]).abs() < 1e-14, "{name}: stress");
            assert!((alone[i][j] - response.second_piola[i][j]).abs() < 1e-14, "{name}: stress alone");
            let mut unit = [[0.0; D]; D];
            unit[second / D][second % D] = 1.0;
            let change = piola_change::<P, D>(constants, &h, &unit)[i][j];
            assert!(
                (energy.eps1eps2 - change).abs() < 1e-13,
                "{name}: tangent {first} {second}: {energy:?} {change}"
            );
        }
    }
}

/// Automatic second derivatives of the energy give the same stress and tangent, every component.
#[test]
fn dual_numbers_agree() {
    for_every_law(Oracle);
}

struct MetricForm<'a>(&'a str);

impl LawTask for MetricForm<'_> {
    type Output = ();
    fn run<P: Law>(self, _: &P) {}
    fn run_metric<P: Law + MetricLaw>(self, law: &P) {
        let h = gradient::<3>(0.25, 9);
        let moduli = law.constants(Part::Whole);
        let response = P::respond_with_metric(&moduli, &h);
        let general = P::respond(&moduli, &h);
        let a = response.gradient_map;
        let (metric, pushed) = match P::METRIC {
            Metric::Reference => (diagonal(1.0), product(&a, &transpose(&a))),
            _ => (product(&transpose(&a), &a), diagonal(1.0)),
        };
        let d = gradient::<3>(0.25, 10);
        let expected = piola_change::<P, 3>(&moduli, &h, &d);
        let volume = double_dot(&a, &d);
        let twist = product(&product(&a, &transpose(&d)), &a);
        let shear = product(&product(&pushed, &d), &metric);
        let stress = product(&d, &response.second_piola);
        for i in 0..3 {
            for j in 0..3 {
                assert!((response.second_piola[i][j] - general.second_piola[i][j]).abs() < 1e-15);
                let found =
                    response.lam * volume * a[i][j] + response.q * (shear[i][j] + twist[i][j]) + stress[i][j];
                assert!((found - expected[i][j]).abs() < 1e-14, "{}: {found} {expected:?}", self.0);
            }
        }
    }
}

/// The fast form of the tangent is the same tangent.
#[test]
fn the_metric_form_is_the_tangent() {
    for entry in MATERIALS {
        (entry.samples)().iter().for_each(|law| law.accept(MetricForm(entry.name)));
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

struct Rotations;
impl LawTest for Rotations {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let r = rotation::<D>(2.0);
        let still = P::stress(constants, &minus_one(r));
        assert!(flat(&still).iter().all(|s| s.abs() < 2e-15), "{name}: {still:?}");
        assert!(P::energy(constants, &minus_one(r)).abs() < 1e-15, "{name}");
        let h = gradient::<D>(0.25, 6);
        let turned = P::stress(constants, &minus_one(product(&r, &plus_one(&h))));
        let plain = P::stress(constants, &h);
        for (a, b) in flat(&turned).iter().zip(flat(&plain)) {
            assert!((a - b).abs() < 1e-14, "{name}: a rotation changes the stress");
        }
    }
}

/// A rigid rotation gives no stress and no energy, and turns with the body otherwise.
#[test]
fn laws_are_objective() {
    for_every_law(Rotations);
}

struct SmallStrains;
impl LawTest for SmallStrains {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, moduli: Moduli<f64>) {
        for size in [1e-12, 1e-15, 1e-100] {
            let h = gradient::<D>(size, 7);
            let exact = flat(&Hooke::respond_with_metric(&moduli, &h).second_piola);
            let largest = exact.iter().fold(0.0_f64, |largest, s| largest.max(s.abs()));
            for (a, b) in flat(&P::stress(constants, &h)).iter().zip(exact) {
                assert!((a - b).abs() < 1e-11 * largest, "{name}: lost digits at small strain: {a} {b}");
            }
        }
        let h = gradient::<D>(1e-7, 7);
        let energy = P::energy(constants, &h);
        let hooke: f64 = Hooke::energy(&moduli, &h);
        assert!((energy - hooke).abs() < 1e-5 * hooke, "{name}: {energy} {hooke}");
        let strain = green_strain(&gradient::<D>(1.0, 8));
        let tangent = P::respond(constants, &[[0.0; D]; D]).tangent;
        let hooke = Hooke::respond_with_metric(&moduli, &small_strain(&strain)).second_piola;
        for (a, b) in flat(&P::contract(&tangent, &strain)).iter().zip(flat(&hooke)) {
            assert!((a - b).abs() < 1e-14, "{name}: the tangent at rest is not Hooke's: {a} {b}");
        }
    }
}

/// At small strain every law, and each part of it, is Hooke's law with its moduli, with all digits.
#[test]
fn small_strains_keep_their_digits() {
    for_every_law(SmallStrains);
}

struct Flat;
impl LawTest for Flat {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, _: Moduli<f64>) {
        let h = gradient::<2>(0.25, 8);
        let solid = [[h[0][0], h[0][1], 0.0], [h[1][0], h[1][1], 0.0], [0.0; 3]];
        let plane = P::stress(constants, &h);
        let full = P::stress(constants, &solid);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert!((plane[i][j] - full[i][j]).abs() < 1e-14, "{name}");
        }
        assert!((P::energy(constants, &h) - P::energy(constants, &solid)).abs() < 1e-14, "{name}");
    }
}

/// Plane strain is the solid with a zero third direction, stress components included.
#[test]
fn plane_strain_is_the_solid_held_flat() {
    for_every_law(Flat);
}

struct Sum;
impl LawTask for Sum {
    type Output = ();
    fn run<P: Law>(self, law: &P) {
        let h = gradient::<3>(0.25, 12);
        let [whole, shear, volume] = Part::ALL.map(|part| P::energy(&law.constants(part), &h));
        assert!((whole - shear - volume).abs() < 1e-15, "{whole} {shear} {volume}");
        assert!(shear > 0.0 && volume > 0.0);
        let moduli = law.moduli();
        assert!((moduli.mu - SAMPLE.mu).abs() < 1e-14 && (moduli.lambda - SAMPLE.lambda).abs() < 1e-14);
    }
}

/// The parts of a law sum up to the whole, and a law made from moduli has them.
#[test]
fn parts_sum_up_to_the_whole() {
    MATERIALS.iter().flat_map(|entry| (entry.samples)()).for_each(|law| law.accept(Sum));
}

/// Moduli that are computed from each other agree.
#[test]
fn moduli_convert() {
    let moduli = Moduli::from_engineering(5e6, 0.45).unwrap();
    assert!((moduli.mu - 1.724e6).abs() < 1e3 && (moduli.lambda - 15.517e6).abs() < 1e3);
    assert!((moduli.young_modulus() / 5e6 - 1.0).abs() < 1e-14);
    assert!((moduli.poisson_ratio() - 0.45).abs() < 1e-14);
    let again = Moduli::of_shear_and_bulk(moduli.mu, moduli.bulk());
    assert!((again.lambda / moduli.lambda - 1.0).abs() < 1e-14);
    for (young, poisson) in [
        (0.0, 0.3),
        (-1.0, 0.3),
        (f64::NAN, 0.3),
        (f64::INFINITY, 0.3),
        (1.0, 0.5),
        (1.0, -1.0),
        (1.0, f64::NAN),
    ] {
        assert!(Moduli::from_engineering(young, poisson).is_err(), "{young} {poisson}");
    }
}

/// Every law is listed with a sentence, and an unknown name is refused with the known ones.
#[test]
fn the_table_names_the_laws() {
    for entry in MATERIALS {
        let about = entry.about();
        assert!(about.len() > 20 && !about.contains('\n'), "{}: {about}", entry.name);
    }
    let unknown = Material::named("rubber", 1.0, 0.3).unwrap_err();
    assert!(unknown.message.contains("known: neo_hookean, saint_venant_kirchhoff"), "{unknown}");
}

struct VolumeEnergy;
impl LawTest for VolumeEnergy {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, moduli: Moduli<f64>) {
        if moduli.mu > 0.0 {
            return;
        }
        let law = VolumeLaw { form: P::VOLUMETRIC, lambda: moduli.lambda };
        let (h, d) = (gradient::<D>(0.25, 31), gradient::<D>(0.1, 32));
        let same = P::energy(constants, &h) - law.energy(law.dilatation(&h));
        assert!(same.abs() < 1e-14, "{name}: {same}");
        // The gradient of the dilatation, and both derivatives of the energy.
        let moved = |x: &[f64]| sum(&h, &scale_all(&d, x[0]));
        let dilatation = |x: &[f64]| vec![law.dilatation(&moved(x))];
        let by_gradient = |x: &[f64], y: &[f64]| vec![y[0] * double_dot(&law.gradient(&moved(x)), &d)];
        assert!(taylor_rate(dilatation, by_gradient, &[0.0], &[1.0]) > 1.9, "{name}");
        let energy = |x: &[f64]| vec![law.energy(x[0])];
        let slope = |x: &[f64]| law.slope_and_curvature(x[0])[0];
        assert!(taylor_rate(energy, |x, y| vec![slope(x) * y[0]], &[0.3], &[0.5]) > 1.9, "{name}");
        let curvature = |x: &[f64], y: &[f64]| vec![law.slope_and_curvature(x[0])[1] * y[0]];
        assert!(taylor_rate(|x| vec![slope(x)], curvature, &[0.3], &[0.5]) > 1.9, "{name}");
        // Over a step.
        let motion = StepMotion::new(h, sum(&h, &d));
        let [start, end] = [&motion.start, &motion.end].map(|h| law.dilatation(h));
        let change = law.slope_over_step(start, end)[0] * (end - start);
        assert!((change - (law.energy(end) - law.energy(start))).abs() < 1e-15, "{name}: {change}");
        let strain = |h| green_strain::<f64, D>(h);
        let strained = sum(&strain(&motion.end), &scale_all(&strain(&motion.start), -1.0));
        let gradient = law.over_step(&motion).gradient;
        assert!((double_dot(&gradient, &strained) - (end - start)).abs() < 1e-15, "{name}");
        let over_step = |x: &[f64]| vec![law.slope_over_step(start, x[0])[0]];
        let by_end = |x: &[f64], y: &[f64]| vec![law.slope_over_step(start, x[0])[1] * y[0]];
        assert!(taylor_rate(over_step, by_end, &[end], &[0.3]) > 1.9, "{name}");
    }
}

/// The volumetric energy is a function of the dilatation in every law, and its derivatives and slopes
/// over a step are consistent.
#[test]
fn the_volume_part_is_a_function_of_the_dilatation() {
    for_every_law(VolumeEnergy);
}
