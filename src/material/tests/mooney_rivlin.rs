//! Mooney-Rivlin against closed forms of nearly incompressible and of isochoric states.

use super::*;
use crate::material::MooneyRivlin;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};
use crate::reader::units::Units;

const C10: f64 = 0.4;
const C01: f64 = 0.15;
const BULK: f64 = 50.0;

fn rubber(bulk: f64) -> MooneyRivlin {
    MooneyRivlin {
        c10: Pressure::new(C10),
        c01: Pressure::new(C01),
        bulk_modulus: Some(Pressure::new(bulk)),
        poisson_ratio: None,
    }
}

/// Cauchy stress [Pa].
fn cauchy(law: &MooneyRivlin, f: Square<f64, 3>) -> Square<f64, 3> {
    let grad_u = minus_one(f);
    let second_piola = MooneyRivlin::stress(&law.constants(Part::Whole), &grad_u);
    let det = 1.0 + crate::square::det_minus_one(&grad_u);
    scale_all(&product(&product(&f, &second_piola), &transpose(&f)), 1.0 / det)
}

fn stretches(values: [f64; 3]) -> Square<f64, 3> {
    let mut f = [[0.0; 3]; 3];
    for (i, value) in values.into_iter().enumerate() {
        f[i][i] = value;
    }
    f
}

/// With `det F = 1` the differences of principal stresses are `2 (l_i^2 - l_j^2) (c10 + c01 l_k^2)`: uniaxial, equibiaxial and
/// general stretches. The pressure is zero there.
#[test]
fn isochoric_stretches_have_the_closed_form() {
    let uniaxial = |l: f64| [l, l.powf(-0.5), l.powf(-0.5)];
    let equibiaxial = |l: f64| [l, l, l.powi(-2)];
    let cases = [uniaxial(3.0), uniaxial(0.4), equibiaxial(1.8), equibiaxial(0.7), [2.0, 0.8, 0.625]];
    for values in cases {
        let stress = cauchy(&rubber(BULK), stretches(values));
        let square = values.map(|l| l * l);
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let exact = 2.0 * (square[i] - square[j]) * (C10 + C01 * square[k]);
            let found = stress[i][i] - stress[j][j];
            assert!((found - exact).abs() < 1e-13 * exact.abs().max(1.0), "{values:?}: {found} {exact}");
        }
        assert!(crate::square::trace(&stress).abs() < 1e-12, "{values:?}: {stress:?}");
    }
}

/// Simple shear of amount `g`: `tau = 2 (c10 + c01) g`, `s_11 - s_22 = tau g`, `s_11 - s_33 = 2 c10 g^2`.
#[test]
fn simple_shear_has_the_closed_form() {
    for amount in [1e-12, 1e-3, 0.5, 2.0] {
        let mut f = diagonal(1.0);
        f[0][1] = amount;
        let stress = cauchy(&rubber(BULK), f);
        let tau = 2.0 * (C10 + C01) * amount;
        assert!((stress[0][1] / tau - 1.0).abs() < 1e-13, "{amount}: {} {tau}", stress[0][1]);
        assert!((stress[0][0] - stress[1][1] - tau * amount).abs() < 1e-14 * (1.0 + amount.powi(4)));
        assert!(
            (stress[0][0] - stress[2][2] - 2.0 * C10 * amount * amount).abs()
                < 1e-14 * (1.0 + amount.powi(4))
        );
    }
}

/// A pure change of volume has the pressure `-K (J - 1/J) / 2` and no shear stress.
#[test]
fn volume_has_the_closed_form() {
    for stretch in [0.5, 0.9, 1.0 + 1e-9, 1.2, 2.0_f64] {
        let stress = cauchy(&rubber(BULK), stretches([stretch; 3]));
        let det = stretch.powi(3);
        let exact = 0.5 * BULK * (det - 1.0 / det);
        for i in 0..3 {
            assert!(
                (stress[i][i] - exact).abs() < 1e-7 * 1e-6 * BULK.max(exact.abs()),
                "{stretch}: {stress:?} {exact}"
            );
        }
    }
}

/// With `c01 = 0` and a large bulk modulus a uniaxial test gives the neo-Hookean nominal stress `mu (l - 1/l^2)`; the response that
/// `uniaxial` finds is that of a stress-free side.
#[test]
fn uniaxial_response_is_found() {
    let law = MooneyRivlin { c01: Pressure::new(0.0), c10: Pressure::new(0.5), ..rubber(1e6) };
    for stretch in [0.5_f64, 0.9, 1.5, 3.0] {
        let found = Material::MooneyRivlin(law).uniaxial(stretch).unwrap();
        let exact = stretch - stretch.powi(-2);
        assert!((found.nominal_stress / exact - 1.0).abs() < 1e-5, "{stretch}: {found:?} {exact}");
        assert!((found.lateral_stretch * stretch.sqrt() - 1.0).abs() < 1e-5, "{stretch}: {found:?}");
    }
    for law in MATERIALS.iter().flat_map(|entry| (entry.samples)()) {
        let found = law.uniaxial(1.0 + 1e-6).unwrap();
        assert!((found.nominal_stress / (1e-6 * SAMPLE.young_modulus()) - 1.0).abs() < 1e-5, "{law:?}");
        let lateral = 1.0 - 1e-6 * SAMPLE.poisson_ratio();
        assert!((found.lateral_stretch - lateral).abs() < 1e-11, "{law:?}: {found:?}");
    }
}

/// Saint Venant-Kirchhoff loses its stiffness in compression, neo-Hookean and Mooney-Rivlin with positive coefficients nowhere;
/// Mooney-Rivlin with a negative coefficient does.
#[test]
fn loss_of_stiffness_is_found() {
    let named = |name: &str| Material::named(name, 1.0, 0.3).unwrap();
    let loses = named("saint_venant_kirchhoff").stable_stretches();
    assert!((0.55..0.62).contains(&loses.start) && loses.end > 2.0, "{loses:?}");
    for law in [named("neo_hookean"), Material::MooneyRivlin(rubber(BULK))] {
        let stable = law.stable_stretches();
        assert!(stable.start < 0.27 && stable.end > 3.9, "{stable:?}");
    }
    let unstable = MooneyRivlin { c01: Pressure::new(-0.3), ..rubber(BULK) };
    let stable = Material::MooneyRivlin(unstable).stable_stretches();
    assert!(stable.start > 0.5, "{stable:?}");
}

/// What is wrong with the parameters.
fn complaints(law: &MooneyRivlin) -> Vec<String> {
    let mut findings = Findings::new(Units::SI);
    law.check(&mut findings);
    findings.into_complaints().into_iter().map(|complaint| complaint.message).collect()
}

/// Parameters that make no law are refused, with a cure.
#[test]
fn wrong_parameters_are_refused() {
    let good = rubber(1.0);
    assert!(complaints(&good).is_empty());
    let by_ratio = MooneyRivlin { bulk_modulus: None, poisson_ratio: Some(Number::new(0.49)), ..good };
    assert!(complaints(&by_ratio).is_empty());
    assert!((by_ratio.moduli().poisson_ratio() - 0.49).abs() < 1e-13);
    assert!((by_ratio.moduli().mu - 2.0 * (C10 + C01)).abs() < 1e-15);
    let bad = [
        MooneyRivlin { c10: Pressure::new(-0.2), ..good },
        MooneyRivlin { c10: Pressure::new(f64::NAN), ..good },
        MooneyRivlin { bulk_modulus: Some(Pressure::new(0.0)), ..good },
        MooneyRivlin { poisson_ratio: Some(Number::new(0.5)), ..by_ratio },
        MooneyRivlin { poisson_ratio: Some(Number::new(0.4)), ..good },
        MooneyRivlin { poisson_ratio: None, ..by_ratio },
    ];
    for law in bad {
        assert_eq!(complaints(&law).len(), 1, "{law:?}");
    }
}
