//! Laws under plane stress: their thickness, energy, stress and tangent, at a point and over a step.

use super::*;

/// The second Piola stress of a law in space.
struct StressInSpace(Square<f64, 3>);

impl LawTask for StressInSpace {
    type Output = Square<f64, 3>;
    fn run<P: Law>(self, law: &P) -> Square<f64, 3> {
        P::stress(&law.constants(Part::Whole), &self.0)
    }
}

/// All samples of all laws, and nearly incompressible ones.
fn laws() -> Vec<(String, Material)> {
    let mut all = Vec::new();
    for entry in MATERIALS {
        all.extend((entry.samples)().into_iter().map(|law| (entry.name.to_owned(), law)));
        let nearly = Material::with_moduli(entry.name, Moduli::of(1.8, 0.4999)).unwrap();
        all.push((format!("{} at 0.4999", entry.name), nearly));
        let negative = Material::with_moduli(entry.name, Moduli::of(1.8, -0.3)).unwrap();
        all.push((format!("{} at -0.3", entry.name), negative));
    }
    all
}

/// The gradient in space with the thickness of the law.
fn in_space(law: &PlaneStress, plane: &Square<f64, 2>) -> Square<f64, 3> {
    let mut out = [[0.0; 3]; 3];
    for i in 0..2 {
        out[i][..2].copy_from_slice(&plane[i]);
    }
    out[2][2] = law.thickness(plane);
    out
}

/// The stress in the plane is that of the law in space, whose stress across the plane is zero, from strains of
/// 1e-12 up to stretches of five.
#[test]
fn the_thickness_leaves_no_stress_across_the_plane() {
    let diagonal = |a: f64, b: f64| [[a - 1.0, 0.0], [0.0, b - 1.0]];
    let mut gradients = vec![[[0.0; 2]; 2], diagonal(1.4, 1.0), diagonal(0.7, 1.3)];
    gradients.extend([1e-12, 1e-6, 0.02, 0.25].map(|size| gradient::<2>(size, 5)));
    let large = [
        [[0.1, 0.6], [-0.2, 0.2]],
        diagonal(5.0, 0.45),
        diagonal(0.2, 0.3),
        diagonal(3.0, 3.0),
        diagonal(0.3, 2.0),
    ];
    for (name, material) in laws() {
        let law = PlaneStress::new(&material);
        let quadratic = matches!(material, Material::SaintVenantKirchhoff(_));
        // Without Poisson's effect of its sign a thickness need not exist.
        let is_limited = quadratic || name.starts_with("gent") || name.ends_with("at -0.3");
        let more = if is_limited { &large[..0] } else { &large };
        for plane in gradients.iter().chain(more) {
            let h = in_space(&law, plane);
            let exact = material.accept(StressInSpace(h));
            let found = law.stress(plane);
            let size = double_dot(&exact, &exact).sqrt();
            // Rounding of the invariants times the stiffness.
            let square = double_dot(&h, &h);
            let digits = 1e-12 * size + 1e-14 * material.moduli().bulk() * (square.sqrt() + square);
            // The stress of the current thickness: the second Piola stress divides it by the square of the stretch.
            let across = exact[2][2] * (1.0 + h[2][2]).powi(2);
            assert!(across.abs() <= digits, "{name}: {plane:?} {exact:?}");
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                assert!((found[i][j] - exact[i][j]).abs() <= digits, "{name}: {plane:?} {found:?} {exact:?}");
            }
        }
    }
}

/// Energy, stress and tangent are derivatives of one another, to second order.
#[test]
fn derivatives_have_order_two_under_plane_stress() {
    for (name, material) in laws() {
        let law = PlaneStress::new(&material);
        let (x, d) = (flat(&gradient::<2>(0.2, 3)), flat(&gradient::<2>(0.2, 4)));
        let energy = |h: &[f64]| vec![law.energy(&square::<2>(h))];
        let piola = |h: &[f64]| flat(&first_piola(&square::<2>(h), &law.stress(&square::<2>(h))));
        let work = |h: &[f64], d: &[f64]| vec![piola(h).iter().zip(d).map(|(p, d)| p * d).sum()];
        let rate = taylor_rate(energy, work, &x, &d);
        assert!(rate > 1.9, "{name}: the stress is not the derivative of the energy: order {rate}");
        let change = |h: &[f64], d: &[f64]| {
            let (h, d) = (square::<2>(h), square::<2>(d));
            let response = law.respond(&h);
            let strain = small_strain(&product(&transpose(&plus_one(&h)), &d));
            let material = first_piola(&h, &PlaneStress::contract(&response.tangent, &strain));
            flat(&sum(&material, &product(&d, &response.second_piola)))
        };
        let rate = taylor_rate(piola, change, &x, &d);
        assert!(rate > 1.9, "{name}: the tangent is not the derivative of the stress: order {rate}");
    }
}

/// Over steps of any size the work is the change of the energy to rounding. The tangent is the derivative by the
/// middle of the step.
#[test]
fn a_step_conserves_under_plane_stress() {
    for (name, material) in laws() {
        let law = PlaneStress::new(&material);
        for (seed, size) in [(1, 0.25), (2, 0.2), (3, 1e-3), (4, 1e-8)] {
            for step in [1.0, 1e-3, 1e-9, 0.0] {
                let start = gradient::<2>(size, seed);
                let moved = gradient::<2>(size * step, seed + 10);
                let middle = sum(&start, &scale_all(&moved, 0.5));
                let motion = StepMotion::new(start, middle);
                let piola = first_piola(&middle, &law.stress_over_step(&motion));
                let work = double_dot(&piola, &moved);
                let [before, after]: [f64; 2] = [motion.start, motion.end].map(|h| law.energy(&h));
                let stiff = (material.moduli().bulk() / material.moduli().mu).max(1.0);
                let digits = 1e-14 * before.max(after) + 1e-15 * size * stiff;
                assert!(
                    (work - (after - before)).abs() < digits,
                    "{name}, {size}, {step}: {work} {}",
                    after - before
                );
            }
        }
        let start = gradient::<2>(0.15, 6);
        let (x, d) = (flat(&gradient::<2>(0.15, 7)), flat(&gradient::<2>(0.1, 8)));
        let stress = |h: &[f64]| flat(&law.stress_over_step(&StepMotion::new(start, square::<2>(h))));
        let change = |h: &[f64], d: &[f64]| {
            let motion = StepMotion::new(start, square::<2>(h));
            // The end moves twice as far as the middle.
            let moved = scale_all(&square::<2>(d), 2.0);
            let strain = small_strain(&product(&transpose(&plus_one(&motion.end)), &moved));
            flat(&PlaneStress::contract_step(&law.respond_step(&motion).tangent, &strain))
        };
        let rate = taylor_rate(stress, change, &x, &d);
        assert!(rate > 1.9, "{name}: the tangent over a step has order {rate}");
    }
}

/// Saint Venant-Kirchhoff under plane stress is the law in the plane with the modulus `lambda*`.
#[test]
fn saint_venant_kirchhoff_has_a_closed_form() {
    let moduli = Moduli { lambda: 1.7, mu: 0.6 };
    let law = PlaneStress::new(&Material::with_moduli("saint_venant_kirchhoff", moduli).unwrap());
    let closed = moduli.plane_stress();
    for size in [1e-10, 1e-3, 0.3] {
        let h = gradient::<2>(size, 9);
        let [found, exact] = [law.stress(&h), SaintVenantKirchhoff::stress(&closed, &h)];
        let apart = sum(&found, &scale_all(&exact, -1.0));
        assert!(double_dot(&apart, &apart) < 1e-28 * double_dot(&exact, &exact), "{found:?} {exact:?}");
        let energy = SaintVenantKirchhoff::energy(&closed, &h);
        assert!((law.energy(&h) / energy - 1.0).abs() < 1e-13);
    }
}

/// A state that no thickness balances has no stress, and nothing is left to its limit: Saint Venant-Kirchhoff that
/// is stretched until its thickness vanishes, Gent beyond its limit, and an inverted element. A state near the
/// limit of Gent's law is found although the start is beyond it.
#[test]
fn a_state_without_thickness_is_refused() {
    let refuses = |law: &PlaneStress, h: &Square<f64, 2>| {
        let left: Option<f64> = law.reserve(h, &law.stress(h));
        !left.is_some_and(|left| left > 0.0)
    };
    let quadratic = PlaneStress::new(&Material::with_moduli("saint_venant_kirchhoff", SAMPLE).unwrap());
    assert!(refuses(&quadratic, &[[1.5, 0.0], [0.0, 1.5]]));
    assert!(!refuses(&quadratic, &[[0.2, 0.0], [0.0, 0.2]]));
    let gent = PlaneStress::new(&Material::with_moduli("gent", Moduli::of(3.0, 0.4)).unwrap());
    assert!(refuses(&gent, &[[15.0, 0.0], [0.0, -0.9]]));
    assert!(!refuses(&gent, &[[3.4, 0.0], [0.0, -0.5]]));
    assert!(refuses(&gent, &[[-1.5, 0.0], [0.0, 0.0]]));
    for stretch in 1..200 {
        let stretch = 0.1 * f64::from(stretch);
        let h = [[stretch - 1.0, 0.0], [0.0, stretch - 1.0]];
        assert!(!refuses(&gent, &h), "{stretch}");
    }
}
