//! The energy of a law of the invariants behind one interface.
//!
//! Kernels that evaluate laws by this interface are compiled once for all laws of the invariants. Only
//! [`Isotropic::energy_of`] is compiled for each law, with each kind of number that carries derivatives.
//! Four states are evaluated at once, in lanes.

use super::{Invariants, Isotropic};
use crate::derivatives::{Dual, Jet, Secant};
use crate::lanes::{Lane, LaneKind, LaneTask, Pack};

/// Number of invariants.
pub const INVARIANTS: usize = 3;

/// The invariants `i_1`, `i_2`, `i_3` of four states.
pub type PackedInvariants = [Pack; INVARIANTS];

/// Derivatives to evaluate besides the energy.
#[derive(Debug, Clone, Copy)]
pub enum Wanted<'a> {
    /// Nothing.
    Energy,
    /// The first derivatives.
    First,
    /// The first and second derivatives.
    Second,
    /// The slopes over a step from these invariants, in place of the first derivatives.
    Slopes(&'a PackedInvariants),
    /// The slopes over a step from these invariants, and their derivatives by the invariants at the end of the step.
    SlopeDerivatives(&'a PackedInvariants),
}

/// The energies of four states and what was wanted of them; everything else is zero.
#[derive(Debug, Clone, Copy, Default)]
pub struct PackedEnergy {
    /// The energy \[Pa\].
    pub value: Pack,
    /// The derivatives or slopes by each invariant.
    pub first: [Pack; INVARIANTS],
    /// The derivatives of `first` by each invariant.
    pub second: [[Pack; INVARIANTS]; INVARIANTS],
}

/// The energy per reference volume of (a part of) a law, as a function of the invariants.
pub trait InvariantEnergy {
    /// Evaluates it in lanes of that kind.
    fn evaluate(&self, kind: LaneKind, wanted: Wanted<'_>, at: &PackedInvariants) -> PackedEnergy;

    /// Whether the law ends at some stretch.
    fn is_limited(&self) -> bool;

    /// What is left to the limit, see [`Law::reserve`](super::Law::reserve); `None` for a law without limit.
    fn left_to_limit(&self, kind: LaneKind, at: &PackedInvariants) -> Option<Pack>;
}

/// The energy of a law that is known at compile time.
#[derive(Debug, Clone, Copy)]
pub struct EnergyOf<P: Isotropic>(pub P::Coefficients);

impl<P: Isotropic> InvariantEnergy for EnergyOf<P> {
    fn evaluate(&self, kind: LaneKind, wanted: Wanted<'_>, at: &PackedInvariants) -> PackedEnergy {
        let mut out = PackedEnergy::default();
        kind.run(Evaluation { energy: self, wanted, at, out: &mut out });
        out
    }

    fn is_limited(&self) -> bool {
        P::reserve_of(&self.0, &Invariants::new(0.0, 0.0, 0.0)).is_some()
    }

    fn left_to_limit(&self, kind: LaneKind, at: &PackedInvariants) -> Option<Pack> {
        kind.run(Reserve { energy: self, at })
    }
}

/// An evaluation in lanes of any kind.
struct Evaluation<'a, P: Isotropic> {
    energy: &'a EnergyOf<P>,
    wanted: Wanted<'a>,
    at: &'a PackedInvariants,
    out: &'a mut PackedEnergy,
}

impl<P: Isotropic> LaneTask for Evaluation<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { energy: EnergyOf(coefficients), wanted, at, out } = self;
        let at = load(unit, at);
        match wanted {
            Wanted::Energy => {
                out.value = P::energy_of(coefficients, &Invariants::new(at[0], at[1], at[2])).lanes();
            }
            Wanted::First => {
                let variable = |k: usize| Dual::<L, INVARIANTS>::variable(at[k], k);
                let found =
                    P::energy_of(coefficients, &Invariants::new(variable(0), variable(1), variable(2)));
                out.value = found.value.lanes();
                for k in 0..INVARIANTS {
                    out.first[k] = found.partial[k].lanes();
                }
            }
            Wanted::Second => {
                let variable = |k: usize| Jet::variable(at[k], k);
                let found =
                    P::energy_of(coefficients, &Invariants::new(variable(0), variable(1), variable(2)));
                out.value = found.value.lanes();
                for k in 0..INVARIANTS {
                    out.first[k] = found.first[k].lanes();
                }
                for ([k, l], second) in Jet::<L>::PAIRS.into_iter().zip(found.second) {
                    out.second[k][l] = second.lanes();
                    out.second[l][k] = second.lanes();
                }
            }
            Wanted::Slopes(start) => {
                let start = load(unit, start);
                let variable = |k: usize| Secant::<L, INVARIANTS>::variable(start[k], at[k], k);
                let found =
                    P::energy_of(coefficients, &Invariants::new(variable(0), variable(1), variable(2)));
                out.value = found.end.lanes();
                for k in 0..INVARIANTS {
                    out.first[k] = found.slope[k].lanes();
                }
            }
            Wanted::SlopeDerivatives(start) => {
                let start = load(unit, start);
                let variable = |k: usize| {
                    let start = Dual::<L, INVARIANTS>::fixed(start[k]);
                    Secant::<_, INVARIANTS>::variable(start, Dual::variable(at[k], k), k)
                };
                let found =
                    P::energy_of(coefficients, &Invariants::new(variable(0), variable(1), variable(2)));
                out.value = found.end.value.lanes();
                for k in 0..INVARIANTS {
                    out.first[k] = found.slope[k].value.lanes();
                    for l in 0..INVARIANTS {
                        out.second[k][l] = found.slope[k].partial[l].lanes();
                    }
                }
            }
        }
    }
}

/// The reserve to the limit in lanes of any kind.
struct Reserve<'a, P: Isotropic> {
    energy: &'a EnergyOf<P>,
    at: &'a PackedInvariants,
}

impl<P: Isotropic> LaneTask for Reserve<'_, P> {
    type Output = Option<Pack>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Option<Pack> {
        let [first, second, third] = load(unit, self.at);
        let reserve = P::reserve_of(&self.energy.0, &Invariants::new(first, second, third))?;
        Some(reserve.lanes())
    }
}

#[inline(always)]
fn load<L: Lane>(unit: L, at: &PackedInvariants) -> [L; INVARIANTS] {
    [unit.load(at[0]), unit.load(at[1]), unit.load(at[2])]
}
