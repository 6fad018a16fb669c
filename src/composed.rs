//! Functions of two numbers that are too long to be compiled for lanes.
//!
//! The energy of a law is compiled for each kind of lanes with each kind of number that carries
//! derivatives by the three invariants. A function like the series of Ogden's law is long, and
//! iterates until it converges. It is compiled for plain numbers only, with its derivatives by two
//! variables, and is evaluated lane by lane. The chain rule gives the rest.

use crate::derivatives::{Dual, Jet, Secant};
use crate::lanes::isochoric::Logarithmic;
use crate::lanes::{Lane, LaneKind, Pack, Ratio, Real, WIDTH};

/// A function of two numbers.
pub trait PairFunction {
    /// Its value. Write it like [`Isotropic::energy_of`](crate::material::Isotropic::energy_of), so
    /// that no digits are lost.
    fn of<T: Logarithmic>(&self, pair: [T; 2]) -> T;
}

/// Numbers that functions of plain numbers can be applied to: `f64` and lanes.
pub trait LaneWise: Real {
    /// Applies a function to each lane.
    #[must_use]
    fn lane_wise<const I: usize, const O: usize>(
        inputs: [Self; I],
        function: impl Fn([f64; I]) -> [f64; O],
    ) -> [Self; O];

    /// The kind of lanes for functions of packs.
    fn kind(self) -> LaneKind;

    /// The value of each lane; a single number in every place.
    fn pack(self) -> Pack;

    /// A number of this kind from the value of each lane.
    #[must_use]
    fn unpack(self, pack: &Pack) -> Self;
}

impl LaneWise for f64 {
    #[inline(always)]
    fn lane_wise<const I: usize, const O: usize>(
        inputs: [f64; I],
        function: impl Fn([f64; I]) -> [f64; O],
    ) -> [f64; O] {
        function(inputs)
    }
    #[inline(always)]
    fn kind(self) -> LaneKind {
        LaneKind::Portable
    }
    #[inline(always)]
    fn pack(self) -> Pack {
        [self; WIDTH]
    }
    #[inline(always)]
    fn unpack(self, pack: &Pack) -> f64 {
        pack[0]
    }
}

impl<L: Lane> LaneWise for L {
    #[inline(always)]
    fn lane_wise<const I: usize, const O: usize>(
        inputs: [L; I],
        function: impl Fn([f64; I]) -> [f64; O],
    ) -> [L; O] {
        let mut columns = [[0.0; WIDTH]; I];
        for i in 0..I {
            columns[i] = inputs[i].lanes();
        }
        let mut found = [[0.0; WIDTH]; O];
        for lane in 0..WIDTH {
            let mut values = [0.0; I];
            for i in 0..I {
                values[i] = columns[i][lane];
            }
            let values = function(values);
            for o in 0..O {
                found[o][lane] = values[o];
            }
        }
        let mut out = [inputs[0]; O];
        for o in 0..O {
            out[o] = inputs[0].load(found[o]);
        }
        out
    }
    #[inline(always)]
    fn kind(self) -> LaneKind {
        Lane::kind(self)
    }
    #[inline(always)]
    fn pack(self) -> Pack {
        self.lanes()
    }
    #[inline(always)]
    fn unpack(self, pack: &Pack) -> L {
        self.load(*pack)
    }
}

/// Numbers of which a [`PairFunction`] can be taken: those that kernels evaluate energies with.
pub trait Composed: Real {
    /// The function of two numbers of this kind.
    #[must_use]
    fn composed<F: PairFunction>(function: &F, pair: [Self; 2]) -> Self;
}

impl<T: LaneWise> Composed for T {
    #[inline(always)]
    fn composed<F: PairFunction>(function: &F, pair: [T; 2]) -> T {
        let [value] = T::lane_wise(pair, |pair| value(function, pair));
        value
    }
}

impl<T: LaneWise, const N: usize> Composed for Dual<T, N> {
    #[inline(always)]
    fn composed<F: PairFunction>(function: &F, [a, b]: [Self; 2]) -> Self {
        let [value, by_a, by_b] = T::lane_wise([a.value, b.value], |pair| gradient(function, pair));
        Self { value, partial: chained([by_a, by_b], [a.partial, b.partial]) }
    }
}

impl<T: LaneWise> Composed for Jet<T> {
    #[inline(always)]
    fn composed<F: PairFunction>(function: &F, [a, b]: [Self; 2]) -> Self {
        let [value, by_a, by_b, by_aa, by_ab, by_bb] =
            T::lane_wise([a.value, b.value], |pair| second_derivatives(function, pair));
        let by_a_slopes = chained([by_aa, by_ab], [a.first, b.first]);
        let by_b_slopes = chained([by_ab, by_bb], [a.first, b.first]);
        let mut second = chained([by_a, by_b], [a.second, b.second]);
        for (second, [k, l]) in second.iter_mut().zip(Self::PAIRS) {
            let of_slopes = by_a_slopes[k].mul_add(a.first[l], by_b_slopes[k] * b.first[l]);
            *second = *second + of_slopes;
        }
        Self { value, first: chained([by_a, by_b], [a.first, b.first]), second }
    }
}

impl<T: LaneWise + Ratio, const N: usize> Composed for Secant<T, N> {
    #[inline(always)]
    fn composed<F: PairFunction>(function: &F, [a, b]: [Self; 2]) -> Self {
        let [start, end, by_a, by_b] =
            T::lane_wise([a.start, b.start, a.end, b.end], |ends| slopes(function, ends));
        Self { start, end, slope: chained([by_a, by_b], [a.slope, b.slope]) }
    }
}

/// The start of the step must not depend on the variables.
impl<T: LaneWise, const N: usize> Composed for Secant<Dual<T, N>, N>
where
    Dual<T, N>: Ratio,
{
    #[inline(always)]
    fn composed<F: PairFunction>(function: &F, [a, b]: [Self; 2]) -> Self {
        let ends = [a.start.value, b.start.value, a.end.value, b.end.value];
        let [start, end, end_by_a, end_by_b, by_a, by_aa, by_ab, by_b, by_ba, by_bb] =
            T::lane_wise(ends, |ends| slopes_and_derivatives(function, ends));
        let inner = [a.end.partial, b.end.partial];
        let end = Dual { value: end, partial: chained([end_by_a, end_by_b], inner) };
        let by_a = Dual { value: by_a, partial: chained([by_aa, by_ab], inner) };
        let by_b = Dual { value: by_b, partial: chained([by_ba, by_bb], inner) };
        Self { start: Dual::fixed(start), end, slope: chained([by_a, by_b], [a.slope, b.slope]) }
    }
}

/// Derivatives by `N` variables from those by two numbers.
#[inline(always)]
fn chained<T: Real, const N: usize>([by_a, by_b]: [T; 2], [a, b]: [[T; N]; 2]) -> [T; N] {
    let mut out = a;
    for k in 0..N {
        out[k] = by_a.mul_add(a[k], by_b * b[k]);
    }
    out
}

#[inline(never)]
fn value<F: PairFunction>(function: &F, pair: [f64; 2]) -> [f64; 1] {
    [function.of(pair)]
}

/// The value and the derivatives.
#[inline(never)]
fn gradient<F: PairFunction>(function: &F, [a, b]: [f64; 2]) -> [f64; 3] {
    let found = function.of([Dual::<f64, 2>::variable(a, 0), Dual::variable(b, 1)]);
    [found.value, found.partial[0], found.partial[1]]
}

/// The value, the derivatives, and the second derivatives by `aa`, `ab`, `bb`.
#[inline(never)]
fn second_derivatives<F: PairFunction>(function: &F, [a, b]: [f64; 2]) -> [f64; 6] {
    let variable =
        |value: f64, number: usize| Dual::<_, 2>::variable(Dual::<f64, 2>::variable(value, number), number);
    let Dual { value, partial: [by_a, by_b] } = function.of([variable(a, 0), variable(b, 1)]);
    [value.value, by_a.value, by_b.value, by_a.partial[0], by_a.partial[1], by_b.partial[1]]
}

/// The values at the start and at the end, and the slopes.
#[inline(never)]
fn slopes<F: PairFunction>(function: &F, [a, b, a_end, b_end]: [f64; 4]) -> [f64; 4] {
    let found = function.of([Secant::<f64, 2>::variable(a, a_end, 0), Secant::variable(b, b_end, 1)]);
    [found.start, found.end, found.slope[0], found.slope[1]]
}

/// The value at the start; the value at the end and each slope, followed by its derivatives by the end.
#[inline(never)]
fn slopes_and_derivatives<F: PairFunction>(function: &F, [a, b, a_end, b_end]: [f64; 4]) -> [f64; 10] {
    let variable = |start: f64, end: f64, number: usize| {
        Secant::<_, 2>::variable(Dual::<f64, 2>::fixed(start), Dual::variable(end, number), number)
    };
    let Secant { start, end, slope: [by_a, by_b] } =
        function.of([variable(a, a_end, 0), variable(b, b_end, 1)]);
    let [[a, aa, ab], [b, ba, bb]] = [by_a, by_b].map(|by| [by.value, by.partial[0], by.partial[1]]);
    [start.value, end.value, end.partial[0], end.partial[1], a, aa, ab, b, ba, bb]
}
