//! Yeoh, Arruda-Boyce, Gent and Ogden against closed forms of incompressible rubber, and their limits.

use super::*;
use crate::material::ogden::OgdenTerm;
use crate::material::{ArrudaBoyce, Gent, MooneyRivlin, Ogden, Yeoh};
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};
use crate::reader::units::Units;
use crate::reader::up_to::UpTo;

const MU: f64 = 0.4;
const LIMIT: f64 = 40.0;
const LAMBDA_M: f64 = 3.5;
/// Exponents and coefficients of Ogden's fit (1972) to Treloar's data [MPa].
const TERMS: [[f64; 2]; 3] = [[0.63, 1.3], [0.0012, 5.0], [-0.01, -2.0]];

fn bulk() -> Option<Pressure> {
    Some(Pressure::new(1e6))
}

fn yeoh() -> Yeoh {
    let [c1, c2, c3] = [0.2, -0.003, 0.0002].map(Pressure::new);
    Yeoh { c1, c2, c3, bulk_modulus: bulk(), poisson_ratio: None }
}

fn arruda_boyce() -> ArrudaBoyce {
    let lambda_m = Number::new(LAMBDA_M);
    ArrudaBoyce { mu: Pressure::new(MU), lambda_m, bulk_modulus: bulk(), poisson_ratio: None }
}

fn gent() -> Gent {
    Gent { mu: Pressure::new(MU), j_m: Number::new(LIMIT), bulk_modulus: bulk(), poisson_ratio: None }
}

fn ogden(terms: &[[f64; 2]]) -> Ogden {
    let term = |[mu, alpha]: &[f64; 2]| OgdenTerm { mu: Pressure::new(*mu), alpha: Number::new(*alpha) };
    let terms: Vec<_> = terms.iter().map(term).collect();
    Ogden { terms: UpTo::first_of(&terms), bulk_modulus: bulk(), poisson_ratio: None }
}

/// A law, and `dW/dl` of its incompressible form by a principal stretch `l`, at a first invariant.
type Rubber = (Material, fn(f64, f64) -> f64);

fn rubbers() -> [Rubber; 4] {
    [
        (yeoh().into(), |l, first| {
            let x = first - 3.0;
            2.0 * l * (0.2 - 0.006 * x + 0.0006 * x * x)
        }),
        (arruda_boyce().into(), |l, first| {
            let x = first / (LAMBDA_M * LAMBDA_M);
            let series = 0.5
                + x / 10.0
                + 11.0 / 350.0 * x * x
                + 19.0 / 1750.0 * x.powi(3)
                + 519.0 / 134_750.0 * x.powi(4);
            2.0 * l * MU * series
        }),
        (gent().into(), |l, first| l * MU * LIMIT / (LIMIT - (first - 3.0))),
        (ogden(&TERMS).into(), |l, _| TERMS.iter().map(|[mu, alpha]| mu * l.powf(alpha - 1.0)).sum()),
    ]
}

struct Nominal([f64; 3]);

impl LawTask for Nominal {
    type Output = [f64; 3];
    /// Principal nominal stresses.
    fn run<P: Law>(self, law: &P) -> [f64; 3] {
        let mut grad_u = [[0.0; 3]; 3];
        for (i, stretch) in self.0.iter().enumerate() {
            grad_u[i][i] = stretch - 1.0;
        }
        let stress = first_piola(&grad_u, &P::stress(&law.constants(Part::Whole), &grad_u));
        [stress[0][0], stress[1][1], stress[2][2]]
    }
}

/// Nominal stress of an incompressible solid in the first direction, with the last direction free. At a constant volume the pressure
/// of the compressible law is zero, so the difference of the principal Cauchy stresses is exact.
fn nominal(law: &Material, stretches: [f64; 3]) -> f64 {
    let [first, _, free] = law.accept(Nominal(stretches));
    first - free * stretches[2] / stretches[0]
}

/// Uniaxial, equibiaxial and pure shear nominal stress from compression to large stretches.
#[test]
fn incompressible_tests_have_the_closed_form() {
    for (law, slope) in rubbers() {
        for l in [0.4_f64, 0.8, 1.0001, 1.5, 3.0, 4.5] {
            let uniaxial = [l, l.powf(-0.5), l.powf(-0.5)];
            let equibiaxial = [l.sqrt(), l.sqrt(), l.recip()];
            let pure_shear = [l, 1.0, l.recip()];
            for stretches in [uniaxial, equibiaxial, pure_shear] {
                let first = stretches.iter().map(|l| l * l).sum();
                let free = stretches[2] / stretches[0] * slope(stretches[2], first);
                let exact = slope(stretches[0], first) - free;
                let found = nominal(&law, stretches);
                // The volume of the given stretches is one to rounding only; the bulk modulus multiplies it.
                let digits = 1e-12 * exact.abs() + 4e-16 * 1e6 * 3.0;
                assert!((found - exact).abs() < digits, "{law:?} {stretches:?}: {found} {exact}");
            }
        }
    }
}

/// A nearly incompressible bar with free sides follows the incompressible closed form.
#[test]
fn free_bars_have_the_closed_form() {
    for (law, slope) in rubbers() {
        for l in [0.5_f64, 0.9, 1.5, 3.0] {
            let across = l.powf(-0.5);
            let first = l * l + 2.0 / l;
            let exact = slope(l, first) - across / l * slope(across, first);
            let found = law.uniaxial(l).unwrap();
            assert!((found.nominal_stress / exact - 1.0).abs() < 1e-5, "{law:?} {l}: {found:?} {exact}");
        }
    }
}

/// Shear moduli at small strain.
#[test]
fn shear_moduli_have_the_closed_form() {
    let square = LAMBDA_M * LAMBDA_M;
    let series = 1.0
        + 3.0 / (5.0 * square)
        + 99.0 / (175.0 * square.powi(2))
        + 513.0 / (875.0 * square.powi(3))
        + 42039.0 / (67375.0 * square.powi(4));
    let ogden_modulus = 0.5 * (0.63 * 1.3 + 0.0012 * 5.0 + 0.01 * 2.0);
    for ((law, _), mu) in rubbers().into_iter().zip([0.4, MU * series, MU, ogden_modulus]) {
        assert!((law.moduli().mu / mu - 1.0).abs() < 1e-14, "{law:?}: {} {mu}", law.moduli().mu);
        assert!((law.moduli().bulk() / 1e6 - 1.0).abs() < 1e-14);
    }
}

/// Ogden's law with the exponents 2 and -2 is the law of Mooney and Rivlin: energy, stress and tangent at random states.
#[test]
fn ogden_contains_mooney_rivlin() {
    let few = Some(Pressure::new(3.0));
    let ogden = Ogden { bulk_modulus: few, ..ogden(&[[0.8, 2.0], [-0.3, -2.0]]) };
    let [c10, c01] = [0.4, 0.15].map(Pressure::new);
    let mooney = MooneyRivlin { c10, c01, bulk_modulus: few, poisson_ratio: None };
    for seed in 0..20 {
        let h = gradient::<3>(0.4, seed);
        let strain = small_strain(&gradient::<3>(1.0, seed + 50));
        let one = Ogden::respond(&ogden.constants(Part::Whole), &h);
        let other = MooneyRivlin::respond(&mooney.constants(Part::Whole), &h);
        let changes =
            [Ogden::contract(&one.tangent, &strain), MooneyRivlin::contract(&other.tangent, &strain)];
        for ([a, b], digits) in [([one.second_piola, other.second_piola], 1e-13), (changes, 1e-12)] {
            let size = double_dot(&b, &b).sqrt().max(1.0);
            let apart = sum(&a, &scale_all(&b, -1.0));
            assert!(double_dot(&apart, &apart).sqrt() < digits * size, "{seed}: {a:?} {b:?}");
        }
    }
}

/// Derivatives of Ogden's law have order two where principal stretches coincide, and next to it.
#[test]
fn ogden_is_smooth_at_equal_stretches() {
    let law = Ogden { bulk_modulus: Some(Pressure::new(3.0)), ..ogden(&TERMS) };
    let constants = law.constants(Part::Whole);
    let turn = rotation::<3>(0.7);
    for values in
        [[0.0; 3], [0.4; 3], [0.5, 0.5, -0.2], [-0.3, -0.3, 0.9], [0.5, 0.5 + 1e-9, -0.2], [1e-9, 0.0, -1e-9]]
    {
        let mut f = diagonal(1.0);
        for i in 0..3 {
            f[i][i] += values[i];
        }
        let h = minus_one(product(&turn, &product(&f, &transpose(&turn))));
        let d = gradient::<3>(0.2, 31);
        let energy = |h: &[f64]| vec![Ogden::energy(&constants, &square::<3>(h))];
        let piola =
            |h: &[f64]| flat(&first_piola(&square::<3>(h), &Ogden::stress(&constants, &square::<3>(h))));
        let work = |h: &[f64], d: &[f64]| vec![piola(h).iter().zip(d).map(|(p, d)| p * d).sum()];
        let change =
            |h: &[f64], d: &[f64]| flat(&piola_change::<Ogden, 3>(&constants, &square(h), &square(d)));
        let rate = taylor_rate(energy, work, &flat(&h), &flat(&d));
        assert!(rate > 1.9, "{values:?}: stress {rate}");
        let rate = taylor_rate(piola, change, &flat(&h), &flat(&d));
        assert!(rate > 1.9, "{values:?}: tangent {rate}");
    }
}

/// The principal stresses of Ogden's law are those of its closed form next to, and at, equal stretches.
#[test]
fn ogden_has_its_principal_stresses() {
    let law: Material = Ogden { bulk_modulus: Some(Pressure::new(3.0)), ..ogden(&TERMS) }.into();
    for [a, b] in [[1.0, 1.0], [2.0, 2.0], [2.0, 2.0 + 1e-8], [0.3, 0.3], [3.0, 0.4], [6.0, 0.3]] {
        let stretches: [f64; 3] = [a, b, 1.0 / (a * b)];
        let found = law.accept(Nominal(stretches));
        let kirchhoff = stretches.map(|l| TERMS.iter().map(|[mu, alpha]| mu * l.powf(*alpha)).sum::<f64>());
        let mean = kirchhoff.iter().sum::<f64>() / 3.0;
        let largest = kirchhoff.iter().fold(0.0_f64, |largest, k| largest.max(k.abs()));
        for i in 0..3 {
            let error = found[i] * stretches[i] - (kirchhoff[i] - mean);
            assert!(error.abs() < 1e-12 * largest, "{stretches:?} {i}: {error}");
        }
    }
}

struct Reserve(f64);

impl LawTask for Reserve {
    type Output = Option<f64>;
    fn run<P: Law>(self, law: &P) -> Option<f64> {
        let [l, across] = [self.0, self.0.powf(-0.5)];
        let grad_u = [[l - 1.0, 0.0, 0.0], [0.0, across - 1.0, 0.0], [0.0, 0.0, across - 1.0]];
        let volume: Option<f64> = P::reserve(&law.constants(Part::Volume), &grad_u);
        assert!(volume.is_none_or(|reserve| reserve == 1.0), "the volume has no limit");
        P::reserve(&law.constants(Part::Whole), &grad_u)
    }
}

/// Gent's law ends where `I1 - 3 = J_m`; the other laws have no limit.
#[test]
fn only_gent_has_a_limit() {
    let [yeoh, arruda_boyce, gent, ogden] = rubbers().map(|(law, _)| law);
    for law in [yeoh, arruda_boyce, ogden] {
        assert_eq!(law.accept(Reserve(3.0)), None, "{law:?}");
    }
    // l^2 + 2/l - 3 = 40
    let limit = 6.533_6;
    let [below, above] = [limit - 0.01, limit + 0.01].map(|l| gent.accept(Reserve(l)).unwrap());
    assert!(below > 0.0 && below < 0.01 && above < 0.0 && above > -0.01, "{below} {above}");
    // A bar near the limit; beyond it the bar gives way by its volume, at a stress of the bulk modulus.
    let l: f64 = 6.4;
    let exact = MU * LIMIT / (LIMIT - (l * l + 2.0 / l - 3.0)) * (l - l.powi(-2));
    let stiff = Gent { bulk_modulus: Some(Pressure::new(1e9)), ..self::gent() };
    let near = Material::Gent(stiff).uniaxial(l).unwrap().nominal_stress;
    assert!((near / exact - 1.0).abs() < 1e-5, "{near} {exact}");
    assert!(gent.uniaxial(6.6).unwrap().nominal_stress > 1e3);
}

/// What is wrong with the parameters.
fn complaints(law: &Material) -> Vec<String> {
    let mut findings = Findings::new(Units::SI);
    law.check(&mut findings);
    findings.into_complaints().into_iter().map(|complaint| complaint.message).collect()
}

/// Invalid parameters are refused, each with one complaint.
#[test]
fn wrong_rubbers_are_refused() {
    for (law, _) in rubbers() {
        assert!(complaints(&law).is_empty(), "{law:?}");
    }
    let none = None;
    let bad: [(Material, &str); 12] = [
        (Yeoh { c1: Pressure::new(0.0), ..yeoh() }.into(), "c1 must be > 0"),
        (Yeoh { bulk_modulus: none, ..yeoh() }.into(), "yeoh needs bulk_modulus or poisson_ratio"),
        (Yeoh { poisson_ratio: Some(Number::new(0.4)), ..yeoh() }.into(), "redundant"),
        (ArrudaBoyce { mu: Pressure::new(-1.0), ..arruda_boyce() }.into(), "mu must be > 0"),
        (ArrudaBoyce { lambda_m: Number::new(1.0), ..arruda_boyce() }.into(), "lambda_m must be > 1"),
        (ArrudaBoyce { bulk_modulus: none, ..arruda_boyce() }.into(), "arruda_boyce needs"),
        (Gent { mu: Pressure::new(0.0), ..gent() }.into(), "mu must be > 0"),
        (Gent { j_m: Number::new(0.0), ..gent() }.into(), "j_m must be > 0"),
        (Gent { j_m: Number::new(f64::NAN), ..gent() }.into(), "j_m must be > 0"),
        (ogden(&[[0.5, 2.0], [1.0, 0.0]]).into(), "alpha must not be 0"),
        (ogden(&[[0.5, 2.0], [1.0, -2.0]]).into(), "the sum of mu alpha must be > 0"),
        (Ogden { bulk_modulus: Some(Pressure::new(-1.0)), ..ogden(&TERMS) }.into(), "the bulk modulus"),
    ];
    for (law, expected) in bad {
        let found = complaints(&law);
        assert!(found.len() == 1 && found[0].contains(expected), "{law:?}: {found:?}");
    }
}

struct ShearEnergy(Square<f64, 3>);

impl LawTask for ShearEnergy {
    type Output = f64;
    fn run<P: Law>(self, law: &P) -> f64 {
        P::energy(&law.constants(Part::Shear), &self.0)
    }
}

/// Another bulk modulus leaves the shear energy of every law as it is, also at large strain.
#[test]
fn bulk_moduli_can_be_exchanged() {
    let grad_u = gradient::<3>(0.25, 3);
    let of_table =
        MATERIALS.iter().map(|entry| Material::with_moduli(entry.name, SAMPLE).expect("a law of the table"));
    for law in of_table.chain(rubbers().into_iter().map(|(law, _)| law)) {
        let softer = law.with_bulk_modulus(0.3 * law.moduli().bulk());
        assert!((softer.moduli().bulk() / law.moduli().bulk() - 0.3).abs() < 1e-14, "{law:?}");
        let [before, after] = [law, softer].map(|law| law.accept(ShearEnergy(grad_u)));
        assert!((after / before - 1.0).abs() < 1e-13, "{law:?}: {before} and {after}");
    }
}
