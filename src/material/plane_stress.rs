//! Laws under plane stress (theory, section 3.19).
//!
//! The stress across the plane is zero, and the thickness follows from it: with the displacement gradient in
//! the plane and an unknown `H_33`, the law in space gives `S_33 = 0` (3.32). What remains is a law in the plane whose
//! energy is the minimum over `H_33`. Its stress is that of the law in space, and its tangent
//!
//! `C_abcd - C_ab33 C_33cd / C_3333` (3.33).
//!
//! Over a step the law in space does work against its mean stress across the plane as well. That work is given
//! to the stress in the plane along the change of the strain, so that the energy of the plane law is conserved (3.35).
//!
//! Kernels see all laws as one type, [`PlaneStress`], and are compiled once for them.

use super::{
    IsotropicLaw, Law, LawPart, LawTask, Material, Part, PointEnergy, PointLaw, Response, StepMotion,
};
use crate::composed::LaneWise;
use crate::lanes::{Lane, LaneKind, LaneTask, Pack, RatioSlope, Real, WIDTH};
use crate::square::{
    Square, det_minus_one, double_dot, plus_one, product, scale_all, small_strain, sum, trace, transpose,
};

/// Components of a symmetric tensor in the plane: `11, 22, 12`.
const COMPONENTS: usize = 3;

/// Displacement gradients in the plane of four states.
type PackedGradient = [[Pack; 2]; 2];

/// Quantities of a plane law that can be evaluated.
#[derive(Debug, Clone, Copy)]
enum Wanted<'a> {
    /// `H_33`.
    Thickness,
    /// The energy.
    Energy,
    /// What is left to the limit of the law.
    Reserve,
    /// Stress and tangent.
    Stress,
    /// Stress and tangent over a step with these gradients at its start and in its middle.
    Step { start: &'a PackedGradient, middle: &'a PackedGradient },
}

/// Results at four states. Everything that was not wanted is zero.
#[derive(Debug, Clone, Copy, Default)]
struct PackedResponse {
    /// `H_33`, the energy \[Pa\], or what is left to the limit.
    value: Pack,
    /// Second Piola stress \[Pa\].
    stress: [Pack; COMPONENTS],
    /// Its derivatives by `E_11`, `E_22` and `2 E_12` \[Pa\].
    tangent: [[Pack; COMPONENTS]; COMPONENTS],
}

/// A law in space that is reduced to the plane.
trait ReducedLaw {
    /// Evaluates it in lanes of that kind.
    fn evaluate(&self, kind: LaneKind, wanted: Wanted<'_>, at: &PackedGradient) -> PackedResponse;

    /// Whether the law in space ends at some stretch.
    fn is_limited(&self) -> bool;
}

/// A law in the plane under plane stress. As a [`PointLaw`] it is for two dimensions only.
pub struct PlaneStress(Box<dyn ReducedLaw>);

/// The tangent of a law under plane stress.
#[derive(Debug, Clone, Copy)]
pub struct PlaneTangent<T> {
    /// Derivatives of the stress by `E_11`, `E_22` and `2 E_12` \[Pa\].
    by_strain: [[T; COMPONENTS]; COMPONENTS],
}

impl PlaneStress {
    /// This law under plane stress.
    pub fn new(material: &Material) -> Self {
        material.accept(Reduce)
    }

    /// `H_33` at a displacement gradient in the plane; NaN if no thickness makes `S_33` zero.
    pub fn thickness(&self, grad_u: &Square<f64, 2>) -> f64 {
        self.0.evaluate(grad_u[0][0].kind(), Wanted::Thickness, &pack(grad_u)).value[0]
    }
}

/// Reduces a law to the plane.
struct Reduce;

impl LawTask for Reduce {
    type Output = PlaneStress;

    fn run<P: Law>(self, law: &P) -> PlaneStress {
        let point = Box::new(LawPart::<P>(law.constants(Part::Whole)));
        PlaneStress(Box::new(InSpace { law: point, ratio: law.moduli().thickness_ratio() }))
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> PlaneStress {
        let ratio = law.moduli().thickness_ratio();
        PlaneStress(Box::new(InSpace { law: law.energy_of_part(Part::Whole), ratio }))
    }
}

/// A law in space, with the ratio of its strain across the plane to that in the plane at small strain.
struct InSpace<K: ?Sized> {
    law: Box<K>,
    ratio: f64,
}

impl<K: PointLaw + ?Sized> ReducedLaw for InSpace<K> {
    fn evaluate(&self, kind: LaneKind, wanted: Wanted<'_>, at: &PackedGradient) -> PackedResponse {
        let mut out = PackedResponse::default();
        kind.run(Evaluation { law: self, wanted, at, out: &mut out });
        out
    }

    fn is_limited(&self) -> bool {
        let rest = [[0.0; 3]; 3];
        self.law.reserve(&rest, &rest).is_some()
    }
}

/// An evaluation in lanes of any kind.
struct Evaluation<'a, K: ?Sized> {
    law: &'a InSpace<K>,
    wanted: Wanted<'a>,
    at: &'a PackedGradient,
    out: &'a mut PackedResponse,
}

impl<K: PointLaw + ?Sized> LaneTask for Evaluation<'_, K> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { law, wanted, at, out } = self;
        let end = law.with_thickness(unit, at);
        match wanted {
            Wanted::Thickness => out.value = end[2][2].lanes(),
            Wanted::Energy => out.value = law.law.energy(&end).lanes(),
            Wanted::Reserve => {
                if let Some(reserve) = law.law.reserve(&end, &end) {
                    out.value = reserve.lanes();
                }
            }
            Wanted::Stress => law.respond(unit, &end, out),
            Wanted::Step { start, middle } => {
                let start = law.with_thickness(unit, start);
                let mut middle = load(unit, middle);
                middle[2][2] = (start[2][2] + end[2][2]).scale(0.5);
                law.respond_step(unit, &StepMotion { start, middle, end }, out);
            }
        }
    }
}

/// Largest number of iterations for the thickness. Newton's method takes 3 on average at strains of 10 % and 4 at
/// stretches of 0.2 to 5, where it took 8 at most. At half of this number a bisection of an interval of length one, which
/// takes 27 to the square root of rounding, would be cut short. Twice the number costs time only in states without
/// a solution, which are rejected.
const ITERATIONS: usize = 60;

/// Largest change of `ln(1 + H_33)` in one iteration. Of 16 000 states with stretches of 0.2 to 5, neo-Hookean and
/// Mooney-Rivlin with Poisson's ratios of 0.1 to 0.4999, the farthest solution was 2.5 from the start. It was found
/// in 8 iterations, with twice this value as well, and in 9 with half of it.
const LONGEST: f64 = 1.0;

/// Square of the change of the strain below which a step does no work against the stress across the plane. That
/// stress is of second order in the change, so that the work is below 1e-36 of the modulus. Half and twice the value
/// make no difference; without a limit there would be a division by zero in a step without motion.
const STILL: f64 = 1e-24;

impl<K: PointLaw + ?Sized> InSpace<K> {
    /// The displacement gradient in space whose `S_33` is zero; NaN if no thickness makes it zero.
    ///
    /// The unknown is the logarithm `x` of the thickness, and the function `(1 + H_33)^2 S_33`, which grows with
    /// `x`. The start is the solution at small logarithmic strain.
    #[inline(always)]
    fn with_thickness<L: Lane>(&self, unit: L, plane: &PackedGradient) -> Square<L, 3> {
        let mut grad_u = load(unit, plane);
        // Flat, det F is that in the plane, and the trace of the strain half of the first invariant.
        let start = det_minus_one(&grad_u).ln_1p().scale(-self.ratio);
        let strain = crate::square::green_strain(&grad_u);
        let centre = trace(&strain).ln_1p().scale(0.5).lanes();
        let mut search = Search::new(start.lanes());
        for _ in 0..ITERATIONS {
            if !search.is_open.contains(&true) {
                break;
            }
            grad_u[2][2] = unit.load(search.logarithm).exp_m1();
            let Response { second_piola, tangent } = self.law.respond(&grad_u);
            let stiffness = K::contract(&tangent, &unit_strain(unit, COMPONENTS))[2][2];
            let stretch = grad_u[2][2] + unit;
            let square = stretch * stretch;
            let stress = square * second_piola[2][2];
            let slope = (square * square).mul_add(stiffness, stress + stress).lanes();
            let reserve = self.law.reserve(&grad_u, &second_piola);
            let reserve = reserve.map_or([1.0; WIDTH], |reserve| reserve.lanes());
            let stress = stress.lanes();
            for lane in 0..WIDTH {
                search.advance(lane, stress[lane], slope[lane], reserve[lane] > 0.0, centre[lane]);
            }
        }
        grad_u[2][2] = unit.load(search.found()).exp_m1();
        grad_u
    }

    /// Stress and tangent. What rounding leaves of `S_33` is eliminated like the strain across the plane.
    #[inline(always)]
    fn respond<L: Lane>(&self, unit: L, grad_u: &Square<L, 3>, out: &mut PackedResponse) {
        let Response { second_piola, tangent } = self.law.respond(grad_u);
        let column = K::contract(&tangent, &unit_strain(unit, COMPONENTS));
        let inverse = column[2][2].recip();
        let rest = second_piola[2][2] * inverse;
        let (stress, coupling) = (components(&second_piola), components(&column));
        for m in 0..COMPONENTS {
            out.stress[m] = (stress[m] - coupling[m] * rest).lanes();
        }
        for n in 0..COMPONENTS {
            let change = K::contract(&tangent, &unit_strain(unit, n));
            let across = change[2][2] * inverse;
            let change = components(&change);
            for m in 0..COMPONENTS {
                out.tangent[m][n] = (change[m] - coupling[m] * across).lanes();
            }
        }
    }

    /// Stress over a step and its tangent.
    #[inline(always)]
    fn respond_step<L: Lane + RatioSlope>(
        &self,
        unit: L,
        motion: &StepMotion<L, 3>,
        out: &mut PackedResponse,
    ) {
        let StepMotion { start, middle, end } = motion;
        let moved = sum(end, &scale_all(start, -unit));
        let change = small_strain(&product(&transpose(&plus_one(middle)), &moved));
        let across = change[2][2];
        let mut plane = change;
        plane[2][2] = unit.constant(0.0);
        let inverse = inverse_unless_still(double_dot(&plane, &plane));
        let Response { second_piola, tangent } = self.law.respond_step(motion);
        let shared = second_piola[2][2] * across * inverse;
        let (stress, direction) = (components(&second_piola), components(&plane));
        for m in 0..COMPONENTS {
            out.stress[m] = shared.mul_add(direction[m], stress[m]).lanes();
        }
        // The strain across the plane at the end of the step follows from the point law there.
        let at_end = self.law.respond(end).tangent;
        let column = K::contract(&at_end, &unit_strain(unit, COMPONENTS));
        let thinning = column[2][2].recip();
        let coupling = components(&column);
        for n in 0..COMPONENTS {
            let mut strain = unit_strain(unit, n);
            let along = double_dot(&plane, &strain);
            let own = components(&strain);
            strain[2][2] = -(coupling[n] * thinning);
            let changed = K::contract_step(&tangent, &strain);
            let work = changed[2][2] * across + second_piola[2][2] * strain[2][2];
            let share = (work - (shared + shared) * along) * inverse;
            let changed = components(&changed);
            for m in 0..COMPONENTS {
                let turned = shared.mul_add(own[m], changed[m]);
                out.tangent[m][n] = share.mul_add(direction[m], turned).lanes();
            }
        }
    }
}

/// `1 / square`, and zero up to [`STILL`].
#[inline(always)]
fn inverse_unless_still<L: LaneWise>(square: L) -> L {
    let [inverse] = L::lane_wise([square], |[square]| [if square > STILL { 1.0 / square } else { 0.0 }]);
    inverse
}

/// Newton's method for the logarithm of the thickness of four states, each within a bracket.
///
/// A lane that is done does not change, so that its result does not depend on the others.
struct Search {
    logarithm: Pack,
    low: Pack,
    high: Pack,
    is_open: [bool; WIDTH],
}

impl Search {
    fn new(start: Pack) -> Self {
        let infinite = [f64::INFINITY; WIDTH];
        // There is no start in an element that is inverted.
        let is_open = start.map(f64::is_finite);
        Self { logarithm: start, low: infinite.map(|x| -x), high: infinite, is_open }
    }

    /// One iteration with a stress across the plane and its slope by the logarithm. Beyond the limit of a law
    /// the search turns to `centre`, where the first invariant of the isochoric stretch is smallest.
    fn advance(&mut self, lane: usize, stress: f64, slope: f64, is_within_law: bool, centre: f64) {
        if !self.is_open[lane] {
            return;
        }
        let at = self.logarithm[lane];
        if !is_within_law || !stress.is_finite() {
            if at > centre {
                self.high[lane] = at;
            } else {
                self.low[lane] = at;
            }
            let middle = 0.5 * (self.low[lane] + self.high[lane]);
            self.logarithm[lane] = if middle.is_finite() { middle } else { 0.5 * (at + centre) };
            return;
        }
        if stress > 0.0 {
            self.high[lane] = at;
        } else {
            self.low[lane] = at;
        }
        let newton = if slope > 0.0 { -stress / slope } else { -LONGEST.copysign(stress) };
        let step = newton.clamp(-LONGEST, LONGEST);
        let mut next = at + step;
        // The error of the next value is of second order.
        if step * step <= f64::EPSILON * next.abs() {
            self.is_open[lane] = false;
        } else if next <= self.low[lane] || next >= self.high[lane] {
            next = 0.5 * (self.low[lane] + self.high[lane]);
        }
        self.logarithm[lane] = next;
    }

    /// The logarithms; NaN where the search failed.
    fn found(&self) -> Pack {
        let mut out = self.logarithm;
        for lane in 0..WIDTH {
            if self.is_open[lane] || !out[lane].is_finite() {
                out[lane] = f64::NAN;
            }
        }
        out
    }
}

/// The strain of one component, `11, 22, 2 12, 33`, in space.
#[inline(always)]
pub(super) fn unit_strain<L: Lane>(unit: L, component: usize) -> Square<L, 3> {
    let mut strain = [[unit.constant(0.0); 3]; 3];
    match component {
        0 => strain[0][0] = unit,
        1 => strain[1][1] = unit,
        2 => {
            strain[0][1] = unit.constant(0.5);
            strain[1][0] = strain[0][1];
        }
        _ => strain[2][2] = unit,
    }
    strain
}

/// `11, 22, 12` of a symmetric tensor.
#[inline(always)]
fn components<T: Copy, const D: usize>(a: &Square<T, D>) -> [T; COMPONENTS] {
    [a[0][0], a[1][1], a[0][1]]
}

/// A flat displacement gradient in space.
#[inline(always)]
fn load<L: Lane>(unit: L, plane: &PackedGradient) -> Square<L, 3> {
    let mut out = [[unit.constant(0.0); 3]; 3];
    for i in 0..2 {
        for j in 0..2 {
            out[i][j] = unit.load(plane[i][j]);
        }
    }
    out
}

#[inline(always)]
fn pack<T: LaneWise, const D: usize>(grad_u: &Square<T, D>) -> PackedGradient {
    debug_assert_eq!(D, 2, "plane stress in space");
    let mut out = PackedGradient::default();
    for i in 0..2 {
        for j in 0..2 {
            out[i][j] = grad_u[i][j].pack();
        }
    }
    out
}

/// The symmetric tensor with these components.
#[inline(always)]
fn tensor<T: Real, const D: usize>(of: &[T; COMPONENTS]) -> Square<T, D> {
    let mut out = [[of[0].constant(0.0); D]; D];
    out[0][0] = of[0];
    out[1][1] = of[1];
    out[0][1] = of[2];
    out[1][0] = of[2];
    out
}

#[inline(always)]
fn unpack<T: LaneWise, const D: usize>(unit: T, found: &PackedResponse) -> Response<T, PlaneTangent<T>, D> {
    let mut stress = [unit; COMPONENTS];
    let mut by_strain = [[unit; COMPONENTS]; COMPONENTS];
    for m in 0..COMPONENTS {
        stress[m] = unit.unpack(&found.stress[m]);
        for n in 0..COMPONENTS {
            by_strain[m][n] = unit.unpack(&found.tangent[m][n]);
        }
    }
    Response { second_piola: tensor(&stress), tangent: PlaneTangent { by_strain } }
}

impl<T: Real> PlaneTangent<T> {
    #[inline(always)]
    fn contract<const D: usize>(&self, strain: &Square<T, D>) -> Square<T, D> {
        let [one, two, shear] = components(strain);
        let shear = shear + shear;
        let mut out = [one; COMPONENTS];
        for m in 0..COMPONENTS {
            let row = &self.by_strain[m];
            out[m] = row[0].mul_add(one, row[1].mul_add(two, row[2] * shear));
        }
        tensor(&out)
    }
}

impl PointEnergy for PlaneStress {
    #[inline(always)]
    fn energy<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> T {
        let unit = grad_u[0][0];
        unit.unpack(&self.0.evaluate(unit.kind(), Wanted::Energy, &pack(grad_u)).value)
    }
}

impl PointLaw for PlaneStress {
    type Tangent<T: Real, const D: usize> = PlaneTangent<T>;
    type StepTangent<T: Real, const D: usize> = PlaneTangent<T>;

    #[inline(always)]
    fn reserve<T: LaneWise, const D: usize>(
        &self,
        grad_u: &Square<T, D>,
        second_piola: &Square<T, D>,
    ) -> Option<T> {
        let unit = grad_u[0][0];
        if !self.0.is_limited() {
            // There is no stress where no thickness balances it.
            return Some(trace(second_piola).scale(0.0) + unit.constant(1.0));
        }
        Some(unit.unpack(&self.0.evaluate(unit.kind(), Wanted::Reserve, &pack(grad_u)).value))
    }

    #[inline(always)]
    fn stress<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> Square<T, D> {
        self.respond(grad_u).second_piola
    }

    #[inline(always)]
    fn respond<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> Response<T, PlaneTangent<T>, D> {
        let unit = grad_u[0][0];
        unpack(unit, &self.0.evaluate(unit.kind(), Wanted::Stress, &pack(grad_u)))
    }

    #[inline(always)]
    fn contract<T: Real, const D: usize>(tangent: &PlaneTangent<T>, strain: &Square<T, D>) -> Square<T, D> {
        tangent.contract(strain)
    }

    #[inline(always)]
    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D> {
        self.respond_step(motion).second_piola
    }

    #[inline(always)]
    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Response<T, PlaneTangent<T>, D> {
        let unit = motion.start[0][0];
        let wanted = Wanted::Step { start: &pack(&motion.start), middle: &pack(&motion.middle) };
        unpack(unit, &self.0.evaluate(unit.kind(), wanted, &pack(&motion.end)))
    }

    #[inline(always)]
    fn contract_step<T: Real, const D: usize>(
        tangent: &PlaneTangent<T>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }
}
