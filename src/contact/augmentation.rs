//! The augmented laws. Uzawa's method finds the multipliers of the pressure and of friction, or those
//! of the pressure carry tractions over an increase of the penalty.

use super::multipliers::{MultiplierSource, Multipliers};
use super::state::ContactState;

impl<const D: usize> ContactState<D> {
    /// Augments the normal law with multipliers from this source.
    pub fn augment(&mut self, way: MultiplierSource) {
        self.multipliers.offsets = vec![0.0; self.current.len()];
        self.multipliers.gaps = vec![f64::INFINITY; self.current.len()];
        self.multipliers.way = way;
    }

    /// Augments friction: Uzawa's method takes elastic slip away.
    pub fn augment_friction(&mut self) {
        self.multipliers.friction = self.history.iter().map(|history| history.friction_traction).collect();
    }

    /// Memory of the multipliers \[bytes\]; 0 if no law is augmented.
    pub fn multiplier_bytes(&self) -> usize {
        let Multipliers { offsets, gaps, friction, way: _ } = &self.multipliers;
        size_of_val(&offsets[..]) + size_of_val(&gaps[..]) + size_of_val(&friction[..])
    }

    /// Whether Uzawa's method determines the multipliers.
    pub fn seeks_multipliers(&self) -> bool {
        !self.multipliers.offsets.is_empty() && self.multipliers.way == MultiplierSource::Sought
    }

    /// Whether Uzawa's method takes elastic slip away.
    pub fn seeks_stick(&self) -> bool {
        !self.multipliers.friction.is_empty()
    }

    /// Restores the multipliers that Uzawa's method determines to those of the last accepted step.
    /// `penetration` is the inverse of the normal law.
    pub fn reset_multipliers(&mut self, penetration: impl Fn(f64) -> f64) {
        self.resume_friction();
        if !self.seeks_multipliers() {
            return;
        }
        for (offset, history) in self.multipliers.offsets.iter_mut().zip(&self.history) {
            *offset = penetration(history.multiplier);
        }
    }

    /// Takes the current tractions as multipliers (Uzawa). At the same gap and slip the tractions then
    /// need no penetration and no elastic slip.
    pub fn take_multipliers(&mut self, penetration: impl Fn(f64) -> f64) {
        for (multiplier, point) in self.multipliers.friction.iter_mut().zip(&self.current) {
            *multiplier = point.traction_at_start;
        }
        if !self.seeks_multipliers() {
            return;
        }
        for (offset, point) in self.multipliers.offsets.iter_mut().zip(&self.current) {
            *offset = penetration(point.normal_traction - point.normal_damping);
        }
    }

    /// Starts with the friction of the last accepted step as multiplier.
    pub fn resume_friction(&mut self) {
        for (multiplier, history) in self.multipliers.friction.iter_mut().zip(&self.history) {
            *multiplier = history.friction_traction;
        }
    }

    /// Restores carried multipliers from the history of the points. `stiffness` is that of the
    /// penalty \[Pa/m\].
    pub fn resume_multipliers(&mut self, stiffness: f64) {
        if self.multipliers.way == MultiplierSource::Carried {
            for (offset, history) in self.multipliers.offsets.iter_mut().zip(&self.history) {
                *offset = history.multiplier / stiffness;
            }
        }
    }

    /// Records the gaps of an accepted step.
    pub fn note_gaps(&mut self) {
        self.multipliers.gaps.iter_mut().zip(&self.current).for_each(|(gap, point)| *gap = point.gap);
    }

    /// Accounts for a penalty that is stiffer by `factor`. Points that were closed at the end of
    /// the last accepted step keep their tractions.
    pub fn stiffen(&mut self, factor: f64) {
        for (offset, gap) in self
            .multipliers
            .offsets
            .iter_mut()
            .zip(&self.multipliers.gaps)
            .filter(|(offset, gap)| **gap < **offset)
        {
            *offset = gap + (*offset - gap) / factor;
        }
    }

    /// Stores the multipliers with which the next step begins. Multipliers from Uzawa's method are
    /// the current pressures. Carried multipliers are dropped at points that have opened.
    /// `stiffness` is that of the penalty \[Pa/m\].
    pub fn remember_multipliers(&mut self, stiffness: f64) {
        self.note_gaps();
        let points = self.multipliers.offsets.iter_mut().zip(&self.current).zip(&mut self.history);
        for ((offset, point), history) in points {
            history.multiplier = match self.multipliers.way {
                MultiplierSource::Sought => point.normal_traction - point.normal_damping,
                MultiplierSource::Carried => {
                    let multiplier = if point.gap > 0.0 { 0.0 } else { *offset * stiffness };
                    // Bitwise equal to the value in a resumed run.
                    *offset = multiplier / stiffness;
                    multiplier
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::point::{PointState, Status};
    use crate::contact::state::{Branches, Hold};

    fn closed(gap: f64) -> PointState<2> {
        PointState { status: Status::Slip, gap, ..PointState::default() }
    }

    /// Multipliers from Uzawa's method equal the pressures, and the next step begins with them.
    #[test]
    fn sought_multipliers_are_warm() {
        let mut state = ContactState::<2>::new(1);
        state.augment(MultiplierSource::Sought);
        state.current[0] = PointState { normal_traction: 3.0, ..closed(-0.3) };
        state.take_multipliers(|pressure| 0.1 * pressure);
        assert!((state.manner(0, Hold::Nothing, Branches::Actual).offset - 0.3).abs() < 1e-15);
        state.remember_multipliers(10.0);
        state.current[0] = PointState::default();
        state.take_multipliers(|pressure| 0.1 * pressure);
        assert_eq!(state.manner(0, Hold::Nothing, Branches::Actual).offset, 0.0);
        state.reset_multipliers(|pressure| 0.1 * pressure);
        assert!((state.manner(0, Hold::Nothing, Branches::Actual).offset - 0.3).abs() < 1e-15);
    }

    /// If the penalty is stiffened during a run, a closed point keeps its traction; an open point
    /// loses its multiplier.
    #[test]
    fn stiffening_leaves_tractions() {
        let mut state = ContactState::<2>::new(2);
        state.augment(MultiplierSource::Carried);
        state.current[0] = closed(-0.4);
        state.remember_multipliers(10.0);
        state.stiffen(4.0);
        let offset = |state: &ContactState<2>, p| state.manner(p, Hold::Nothing, Branches::Actual).offset;
        let traction = |stiffness: f64, offset: f64| stiffness * (offset + 0.4);
        assert!((traction(40.0, offset(&state, 0)) - traction(10.0, 0.0)).abs() < 1e-12);
        assert_eq!(offset(&state, 1), 0.0);
        state.remember_multipliers(40.0);
        assert!((state.history[0].multiplier - 40.0 * offset(&state, 0)).abs() < 1e-12);
        state.current[0] = PointState { gap: 0.1, ..PointState::default() };
        state.remember_multipliers(40.0);
        assert_eq!((offset(&state, 0), state.history[0].multiplier), (0.0, 0.0));
    }
}
