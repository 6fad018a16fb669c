//! The isochoric part of every law: derivatives, what it does not depend on, and small strain.

use super::*;

/// Whether a part of a law has an isochoric stress.
fn has_deviator(moduli: Moduli<f64>) -> bool {
    moduli.mu > 0.0
}

struct Consistency;
impl LawTest for Consistency {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, moduli: Moduli<f64>) {
        if D == 2 || !has_deviator(moduli) {
            return;
        }
        let part = LawPart::<P>(*constants);
        let deviator = FiniteDeviator(&part);
        let (x, d) = (flat(&gradient::<3>(0.25, 3)), flat(&gradient::<3>(0.25, 4)));
        let energy = |h: &[f64]| vec![deviator.energy(&square(h))];
        let piola = |h: &[f64]| flat(&first_piola::<3>(&square(h), &deviator.stress(&square(h))));
        let work = |h: &[f64], d: &[f64]| vec![piola(h).iter().zip(d).map(|(p, d)| p * d).sum()];
        let rate = taylor_rate(energy, work, &x, &d);
        assert!(rate > 1.9, "{name}: the isochoric stress is not the derivative of its energy: order {rate}");
        let change = |h: &[f64], d: &[f64]| {
            let (h, d): (Square<f64, 3>, Square<f64, 3>) = (square(h), square(d));
            let response = deviator.respond(&h);
            let strain = small_strain(&product(&transpose(&plus_one(&h)), &d));
            let stress = FiniteDeviator::<LawPart<P>>::contract(&response.tangent, &strain);
            flat(&sum(&first_piola(&h, &stress), &product(&d, &response.second_piola)))
        };
        let rate = taylor_rate(piola, change, &x, &d);
        assert!(
            rate > 1.9,
            "{name}: the tangent is not the derivative of the isochoric stress: order {rate}"
        );
    }
}

/// Energy, stress and tangent of the isochoric part are derivatives of one another, to second order.
#[test]
fn isochoric_parts_have_order_two() {
    for_every_law(Consistency);
}

struct Independence;
impl LawTest for Independence {
    fn check<P: Law, const D: usize>(name: &str, constants: &P::Constants, moduli: Moduli<f64>) {
        if D == 2 || !has_deviator(moduli) {
            return;
        }
        let part = LawPart::<P>(*constants);
        let deviator = FiniteDeviator(&part);
        let h = gradient::<3>(0.25, 5);
        let (energy, stress): (f64, Square<f64, 3>) = (deviator.energy(&h), deviator.stress(&h));
        let stretch = plus_one(&scale_all(&green_strain(&h), 2.0));
        let pressure = double_dot(&stress, &stretch);
        let size = double_dot(&stress, &stress).sqrt();
        assert!(energy > 0.0 && pressure.abs() < 1e-14 * size, "{name}: a pressure of {pressure} of {size}");
        // 1.3 F has the same isochoric part.
        let grown = sum(&scale_all(&h, 1.3), &diagonal(0.3));
        let apart: f64 = deviator.energy(&grown) - energy;
        assert!(apart.abs() < 1e-13 * energy, "{name}: the energy changes with the volume by {apart}");
        for size in [1e-3, 1e-6, 1e-12] {
            let h = gradient::<3>(size, 6);
            let hooke: Square<f64, 3> = LinearDeviator { mu: moduli.mu }.stress(&h);
            let difference = sum(&deviator.stress(&h), &scale_all(&hooke, -1.0));
            let error: f64 = (double_dot(&difference, &difference) / double_dot(&hooke, &hooke)).sqrt();
            assert!(error < 30.0 * size + 1e-14, "{name}: {error} at a strain of {size}");
            let branch: [f64; 2] = [
                deviator.branch_energy(&scale_all(&hooke, 1.0 / moduli.mu), &h),
                LinearDeviator { mu: 1.0 }.branch_energy(&scale_all(&hooke, 1.0 / moduli.mu), &h),
            ];
            assert!((branch[0] / branch[1] - 1.0).abs() < 30.0 * size + 1e-13, "{name}: {branch:?}");
        }
    }
}

/// The isochoric part has no pressure, does not depend on the volume, and is Hooke's deviator at small
/// strain, without loss of digits.
#[test]
fn isochoric_parts_do_not_depend_on_the_volume() {
    for_every_law(Independence);
}

/// The spring of a branch that is deformed suddenly holds the isochoric energy of a neo-Hookean law, at
/// any strain.
#[test]
fn a_sudden_branch_holds_the_energy_of_a_neo_hookean_law() {
    let moduli = Moduli { lambda: 0.0, mu: 0.7 };
    let part = LawPart::<NeoHookean>(moduli);
    let deviator = FiniteDeviator(&part);
    for size in [1e-6, 0.1, 0.4] {
        let h = gradient::<3>(size, 7);
        let ratio = scale_all(&deviator.stress(&h), 1.0 / moduli.mu);
        let (held, energy): (f64, f64) =
            (moduli.mu * deviator.branch_energy(&ratio, &h), deviator.energy(&h));
        assert!((held / energy - 1.0).abs() < 1e-12, "{size}: {held} {energy}");
    }
}

/// The isochoric part of a law that is the sum of an isochoric and a volumetric energy is that of its
/// energy: the whole stress less the isochoric stress is a pressure.
#[test]
fn the_rest_of_a_split_law_is_a_pressure() {
    let law = MooneyRivlin::from_moduli(SAMPLE);
    let whole = LawPart::<MooneyRivlin>(law.constants(Part::Whole));
    let shear = LawPart::<MooneyRivlin>(law.constants(Part::Shear));
    let h = gradient::<3>(0.3, 8);
    let rest = sum(&whole.stress(&h), &scale_all(&FiniteDeviator(&shear).stress(&h), -1.0));
    let f = plus_one(&h);
    let kirchhoff: Square<f64, 3> = product(&product(&f, &rest), &transpose(&f));
    let mean = kirchhoff[0][0];
    for (i, row) in kirchhoff.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            let expected = if i == j { mean } else { 0.0 };
            assert!((entry - expected).abs() < 1e-13 * mean.abs(), "{kirchhoff:?}");
        }
    }
}
