//! History of a contact point from step to step.

use super::point::PointState;
use crate::tensor::Vector;

/// History of a point. It changes only when a step is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History<const D: usize> {
    /// `t_T` at the end of the last step \[Pa\]; zero if the point was open.
    pub friction_traction: Vector<D>,
    /// Friction bound at the end of the last step \[Pa\]; zero if the point was open.
    pub bound: f64,
    /// Normal at the end of the last step; `friction_traction` is tangential to it.
    pub normal: Vector<D>,
    /// Accumulated slip path in contact \[m\].
    pub slip: f64,
    /// Accumulated frictional heat per area \[J/m^2\]; it never decreases.
    pub friction_work: f64,
    /// Gap at the end of the last step \[m\]; infinite if there was no gap.
    pub gap: f64,
    /// `-t_T . v_T` at the end of the last step \[W/m^2\].
    pub friction_power: f64,
    /// Elastic slip at the end of the last step \[m\], tangential to `normal`; zero if the point was
    /// open.
    pub elastic_slip: Vector<D>,
    /// Traction of damping at the end of the last step \[Pa\]; zero if the point was open.
    pub damping_traction: Vector<D>,
    /// Multiplier of the augmented normal law at the end of the last step \[Pa\]; zero if the law
    /// is not augmented.
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
            elastic_slip: Vector::zeros(),
            damping_traction: Vector::zeros(),
            multiplier: 0.0,
        }
    }
}

impl<const D: usize> History<D> {
    /// Frictional heat per area over a step of length `dt` \[s\] that ends in `state` \[J/m^2\], >=
    /// 0.
    ///
    /// - Velocity form: trapezoidal rule for the power. It is exact for constant friction and
    ///   deceleration.
    /// - Return map: plastic slip times the mean of the tractions at which it began and ended,
    ///   because elastic stick stores energy.
    /// - A point that opens: its slip times half of its traction before.
    pub fn work_of_step(&self, state: &PointState<D>, dt: f64) -> f64 {
        if heat_is_known(state) {
            return state.plastic_work * self.mean_of_bounds(state);
        }
        if !state.is_closed() && self.friction_power == 0.0 {
            return 0.5 * (-self.friction_traction.dot(&state.slip_increment)).max(0.0);
        }
        0.5 * dt * (self.friction_power + state.friction_power().max(0.0))
    }

    /// Mean bound during slip in the step that ends in `state`, divided by the bound at its end. It
    /// is 1 if the two bounds are equal, and if the heat is that of the whole step.
    fn mean_of_bounds(&self, state: &PointState<D>) -> f64 {
        if state.over_step || state.bound <= 0.0 {
            return 1.0;
        }
        // Slip begins at the previous bound at the latest. It does not begin before the traction of
        // a stuck point reaches its bound.
        let first = self.bound.min(self.friction_traction.norm().max(state.bound));
        0.5 * (1.0 + first / state.bound)
    }

    /// The history after a step of length `dt` \[s\] that ended in `state`. Pure function.
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
            elastic_slip: state.elastic_slip,
            damping_traction: state.damping_traction(),
            multiplier: self.multiplier,
        }
    }

    /// The history at a start in `state`: it has the tractions but no work yet.
    #[must_use]
    pub fn start(state: &PointState<D>) -> Self {
        let begun = Self::default().advance(state, 0.0);
        Self { slip: 0.0, friction_work: 0.0, ..begun }
    }
}

/// Per-point contents of a checkpoint: a fixed list of named numbers.
impl<const D: usize> History<D> {
    /// Number of columns.
    pub const COLUMNS: usize = 4 * D + 6;

    /// The names, in the order of [`columns`](Self::columns).
    pub fn names() -> Vec<String> {
        let axes =
            |name: &'static str| ["x", "y", "z"].iter().take(D).map(move |axis| format!("{name}_{axis}"));
        let one = |name: &str| std::iter::once(name.to_owned());
        let traction = axes("friction_traction").chain(one("bound")).chain(axes("normal"));
        traction
            .chain(["slip", "friction_work", "gap", "friction_power", "multiplier"].into_iter().flat_map(one))
            .chain(axes("damping_traction"))
            .chain(axes("elastic_slip"))
            .collect()
    }

    /// Appends the values.
    pub fn columns(&self, into: &mut Vec<f64>) {
        let Self {
            friction_traction,
            bound,
            normal,
            slip,
            friction_work,
            gap,
            friction_power,
            elastic_slip,
            damping_traction,
            multiplier,
        } = self;
        into.extend(friction_traction.iter());
        into.push(*bound);
        into.extend(normal.iter());
        into.extend([*slip, *friction_work, *gap, *friction_power, *multiplier]);
        into.extend(damping_traction.iter());
        into.extend(elastic_slip.iter());
    }

    /// The history with these values; `None` if there are too few.
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
        let &[slip, friction_work, gap, friction_power, multiplier] = take(5)? else { return None };
        let damping_traction = Vector::from_column_slice(take(D)?);
        let elastic_slip = Vector::from_column_slice(take(D)?);
        left.is_empty().then_some(Self {
            friction_traction,
            bound,
            normal,
            slip,
            friction_work,
            gap,
            friction_power,
            elastic_slip,
            damping_traction,
            multiplier,
        })
    }
}

/// Whether the heat of the step is known directly. The power of the return map is not heat, because
/// elastic stick is recoverable. For a step in the conserving scheme the total work of the
/// tractions is known.
fn heat_is_known<const D: usize>(state: &PointState<D>) -> bool {
    state.over_step || state.sticks_elastically
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
            elastic_slip: vector(17.0),
            damping_traction: vector(13.0),
            multiplier: 12.0,
        };
        let mut columns = Vec::new();
        history.columns(&mut columns);
        assert_eq!(columns.len(), History::<D>::COLUMNS);
        assert_eq!(columns.len(), History::<D>::names().len());
        assert_eq!(History::from_columns(&columns), Some(history));
        assert_eq!(History::<D>::from_columns(&columns[1..]), None);
    }

    /// The columns of a checkpoint contain the whole history of a point, each under a name.
    #[test]
    fn columns_hold_everything() {
        comes_back::<2>();
        comes_back::<3>();
    }

    /// For a bound that varies, heat by the mean of its end values is second-order accurate in the
    /// step. Heat by the final bound alone is only first-order accurate. For a constant bound the
    /// heat is the bound times the slip.
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
                    sticks_elastically: true,
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
        // A point that stuck before the bound dropped did not slip under the previous bound.
        let stuck =
            History { bound: 10.0, friction_traction: Vector::<2>::x() * 2.0, ..History::<2>::default() };
        let state =
            PointState { bound: 1.0, plastic_work: 1.0, sticks_elastically: true, ..PointState::default() };
        assert!((stuck.work_of_step(&state, 0.1) - 1.5).abs() < 1e-15);
        // A point that opens slides against half of its previous traction.
        let open = PointState { slip_increment: Vector::<2>::x() * -0.25, ..PointState::default() };
        assert!((stuck.work_of_step(&open, 0.1) - 0.25).abs() < 1e-15);
    }
}
