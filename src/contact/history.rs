//! What a contact point remembers between steps.

use super::point::PointState;
use crate::tensor::Vector;

/// Memory of a point, changed only when a step is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History<const D: usize> {
    /// `t_T` at the end of the last step \[Pa\]; zero where the point was open.
    pub friction_traction: Vector<D>,
    /// Friction bound at the end of the last step \[Pa\]; zero where the point was open.
    pub bound: f64,
    /// Normal at the end of the last step, to which that traction is tangential.
    pub normal: Vector<D>,
    /// Length of the path slid in contact \[m\].
    pub slip: f64,
    /// Work per area that friction turned into heat \[J/m^2\], never falling.
    pub friction_work: f64,
    /// Gap at the end of the last step \[m\]; infinite where there was none.
    pub gap: f64,
    /// `-t_T . v_T` at the end of the last step \[W/m^2\].
    pub friction_power: f64,
    /// Multiplier of the augmented normal law at the end of the last step \[Pa\]; zero where the law is not augmented.
    pub multiplier: f64,
}

impl<const D: usize> Default for History<D> {
    fn default() -> Self {
        Self {
            friction_traction: Vector::zeros(),
            bound: 0.0,
            normal: Vector::zeros(),
            slip: 0.0,
            friction_work: 0.0,
            gap: f64::INFINITY,
            friction_power: 0.0,
            multiplier: 0.0,
        }
    }
}

impl<const D: usize> History<D> {
    /// Work per area that friction turns into heat over a step of length `dt` \[s\] that ends in `state` \[J/m^2\], >= 0.
    ///
    /// Velocity form: power by the trapezoidal rule, exact where friction and deceleration are constant.
    /// Return map: plastic slip times the mean of the tractions at which it began and ended, as elastic stick stores energy;
    /// a point that opens slid under the mean of the traction that it had and none.
    pub fn work_of_step(&self, state: &PointState<D>, dt: f64) -> f64 {
        if heat_is_known(state) {
            return state.plastic_work * self.mean_of_bounds(state);
        }
        if !state.is_closed() && self.friction_power == 0.0 {
            return 0.5 * (-self.friction_traction.dot(&state.slip_increment)).max(0.0);
        }
        0.5 * dt * (self.friction_power + state.friction_power().max(0.0))
    }

    /// Mean of the bounds under which the point slipped in the step that ends in `state`, over that at its end: 1 where they
    /// are equal, and where the heat is that of the whole step.
    fn mean_of_bounds(&self, state: &PointState<D>) -> f64 {
        if state.over_step || state.bound <= 0.0 {
            return 1.0;
        }
        // Slip began no later than at the bound of before, and no earlier than what stuck had reached its own.
        let first = self.bound.min(self.friction_traction.norm().max(state.bound));
        0.5 * (1.0 + first / state.bound)
    }

    /// The memory after a step of length `dt` \[s\] that ended in `state`. Pure.
    #[must_use]
    pub fn advance(&self, state: &PointState<D>, dt: f64) -> Self {
        let power = if heat_is_known(state) { 0.0 } else { state.friction_power().max(0.0) };
        let path = if state.is_closed() { state.slip_increment.norm() } else { 0.0 };
        Self {
            friction_traction: state.friction_traction,
            bound: state.bound,
            normal: state.normal,
            slip: self.slip + path,
            friction_work: self.friction_work + self.work_of_step(state, dt),
            gap: state.gap,
            friction_power: power,
            multiplier: self.multiplier,
        }
    }

    /// The memory of a start in `state`: its tractions, no work yet.
    #[must_use]
    pub fn start(state: &PointState<D>) -> Self {
        let begun = Self::default().advance(state, 0.0);
        Self { slip: 0.0, friction_work: 0.0, ..begun }
    }
}

/// What a checkpoint keeps of a point: a fixed list of named numbers.
impl<const D: usize> History<D> {
    /// The names, in the order of [`columns`](Self::columns).
    pub fn names() -> Vec<String> {
        let axes =
            |name: &'static str| ["x", "y", "z"].iter().take(D).map(move |axis| format!("{name}_{axis}"));
        let one = |name: &str| std::iter::once(name.to_owned());
        let traction = axes("friction_traction").chain(one("bound")).chain(axes("normal"));
        traction
            .chain(["slip", "friction_work", "gap", "friction_power", "multiplier"].into_iter().flat_map(one))
            .collect()
    }

    /// Appends the numbers.
    pub fn columns(&self, into: &mut Vec<f64>) {
        let Self { friction_traction, bound, normal, slip, friction_work, gap, friction_power, multiplier } =
            self;
        into.extend(friction_traction.iter());
        into.push(*bound);
        into.extend(normal.iter());
        into.extend([*slip, *friction_work, *gap, *friction_power, *multiplier]);
    }

    /// The memory that gave these numbers; `None` where they are too few.
    pub fn from_columns(columns: &[f64]) -> Option<Self> {
        let mut left = columns;
        let mut take = |count: usize| {
            let (taken, rest) = left.split_at_checked(count)?;
            left = rest;
            Some(taken)
        };
        let friction_traction = Vector::from_column_slice(take(D)?);
        let bound = take(1)?[0];
        let normal = Vector::from_column_slice(take(D)?);
        let &[slip, friction_work, gap, friction_power, multiplier] = left else { return None };
        Some(Self { friction_traction, bound, normal, slip, friction_work, gap, friction_power, multiplier })
    }
}

/// Whether the heat of the step is known: the return map's power is not heat, since elastic stick gives it back, and over
/// a step the work of the tractions is known as a whole.
fn heat_is_known<const D: usize>(state: &PointState<D>) -> bool {
    state.over_step || state.recoverable > 0.0 || state.plastic_work > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comes_back<const D: usize>() {
        let vector = |first: f64| Vector::<D>::from_fn(|i, _| first + i as f64);
        let history = History {
            friction_traction: vector(1.0),
            bound: 4.0,
            normal: vector(5.0),
            slip: 8.0,
            friction_work: 9.0,
            gap: 10.0,
            friction_power: 11.0,
            multiplier: 12.0,
        };
        let mut columns = Vec::new();
        history.columns(&mut columns);
        assert_eq!(columns.len(), History::<D>::names().len());
        assert_eq!(History::from_columns(&columns), Some(history));
        assert_eq!(History::<D>::from_columns(&columns[1..]), None);
    }

    /// The columns of a checkpoint hold all that a point remembers, each under a name.
    #[test]
    fn columns_hold_everything() {
        comes_back::<2>();
        comes_back::<3>();
    }

    /// Slip under a bound that grows and falls is heat by the mean of its ends: to second order of the step that of the integral,
    /// where the bound at the ends alone errs to first; under a constant bound it is the bound times the slip.
    #[test]
    fn slip_under_a_bound_that_varies_is_heat_to_second_order() {
        let bound = |t: f64| 2.0 + (3.0 * t).sin();
        let heat = |steps: u32, bound: &dyn Fn(f64) -> f64| {
            let dt = 1.0 / f64::from(steps);
            let begun = History { bound: bound(0.0), ..History::<2>::default() };
            let mut history = History { friction_traction: Vector::<2>::x() * bound(0.0), ..begun };
            for step in 1..=steps {
                let now = bound(f64::from(step) * dt);
                let traction = Vector::<2>::x() * now;
                let state = PointState {
                    gap: -1.0,
                    bound: now,
                    friction_traction: traction,
                    ..PointState::default()
                };
                history = history.advance(&PointState { plastic_work: now * dt, ..state }, dt);
            }
            history.friction_work
        };
        let exact = 2.0 + (1.0 - 3.0f64.cos()) / 3.0;
        let [coarse, fine] = [20, 40].map(|steps| (heat(steps, &bound) - exact).abs());
        assert!(coarse < 2e-3 && (3.8..4.2).contains(&(coarse / fine)), "{coarse:e}, {fine:e}");
        assert!((heat(20, &|_| 2.0) - 2.0).abs() < 1e-14);
        // What stuck under a bound that has dropped since did not slip under the one of before.
        let stuck =
            History { bound: 10.0, friction_traction: Vector::<2>::x() * 2.0, ..History::<2>::default() };
        let state = PointState { bound: 1.0, plastic_work: 1.0, ..PointState::default() };
        assert!((stuck.work_of_step(&state, 0.1) - 1.5).abs() < 1e-15);
        // What opens slid under half of what it carried, against it.
        let open = PointState { slip_increment: Vector::<2>::x() * -0.25, ..PointState::default() };
        assert!((stuck.work_of_step(&open, 0.1) - 0.25).abs() < 1e-15);
    }
}
