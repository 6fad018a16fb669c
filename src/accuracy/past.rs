//! Displacements before the present step, from which its error is estimated and the next first
//! guess is extrapolated.

use serde::{Deserialize, Serialize};

use crate::assembly::{NamedFields, StoredState, named};
use crate::dynamics::{Stage, State};
use crate::error::Result;
use crate::petsc::Vector;
use crate::time::Scheme;
use crate::time::estimate::{FIELDS, extrapolation, weights};
use crate::time::saturation::{SECTIONS, Section};

/// Names of the fields of a history in a checkpoint: two displacements, and the filtered rates.
const NAMES: [&str; 2 + SECTIONS] = ["u_near", "u_far", "rate_1", "rate_2", "rate_3"];

/// The numbers of a history.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Known {
    instants: [f64; 2],
    known: usize,
    curved: bool,
}

/// Displacements before the start of the step, and errors of the steps that were accepted.
pub struct StepHistory {
    u: [Vector; 2],
    instants: [f64; 2],
    known: usize,
    /// Estimated error of the step that was evaluated last, divided by the power of the step length
    /// with which it decreases.
    rate: Vector,
    /// The rates of earlier steps, smoothed by a filter; one vector per section of the filter.
    smooth: [Vector; SECTIONS],
    work: Vector,
    /// Whether a parabola through the earlier displacements predicted the last displacement better
    /// than the velocity at the start of its step.
    curved: bool,
}

impl StepHistory {
    /// The history at the start of a motion, with the layout of `pattern`.
    ///
    /// # Errors
    /// PETSc can not allocate.
    pub fn new(pattern: &Vector) -> Result<Self> {
        Ok(Self {
            u: [pattern.like()?, pattern.like()?],
            instants: [0.0; 2],
            known: 0,
            rate: pattern.like()?,
            smooth: [pattern.like()?, pattern.like()?, pattern.like()?],
            work: pattern.like()?,
            curved: false,
        })
    }

    /// Records a jump of the velocity: displacements before the start belong to a different smooth
    /// motion.
    pub fn jump(&mut self) {
        self.known = 0;
    }

    /// The numbers of the history.
    pub fn known(&self) -> Known {
        Known { instants: self.instants, known: self.known, curved: self.curved }
    }

    /// The fields of the history. The rate of the last step is not among them, because it is
    /// computed anew in every step.
    pub fn fields(&self) -> NamedFields {
        let fields = self.u.iter().chain(&self.smooth);
        NAMES.iter().zip(fields).map(|(name, field)| named(name, field)).collect()
    }

    /// Restores the history. Collective.
    ///
    /// # Errors
    /// A field is missing, or PETSc reports an error.
    pub fn resume(&mut self, known: Known, fields: &StoredState) -> Result<()> {
        let Known { instants, known, curved } = known;
        self.instants = instants;
        self.known = known;
        self.curved = curved;
        let own = self.u.iter_mut().chain(&mut self.smooth);
        NAMES.iter().zip(own).try_for_each(|(name, field)| fields.fill(name, field))
    }

    /// Extrapolates the first guess from the last displacements if they belong to one smooth
    /// motion.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn predict(&self, stage: &mut Stage) -> Result<()> {
        if self.known == 2 && self.curved {
            self.extrapolate(&stage.start, stage.trial.time, &mut stage.trial.u)?;
        }
        Ok(())
    }

    /// Extrapolates the parabola through the last two displacements and that of `start` to the
    /// instant `at` \[s\].
    fn extrapolate(&self, start: &State, at: f64, out: &mut Vector) -> Result<()> {
        let [far, near, last] = extrapolation([self.instants[1], self.instants[0], start.time], at);
        out.copy_from(&start.u)?;
        out.scale(last)?;
        out.axpy(near, &self.u[0])?;
        out.axpy(far, &self.u[1])
    }

    /// Estimated error of the step in `stage`, divided by the power of the step length with which
    /// it decreases, `dt^(p + 1)`. The result is a derivative of the motion \[m/s^(p + 1)\].
    /// `clear` removes the components that do not count.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn rate(
        &mut self,
        scheme: Scheme,
        stage: &Stage,
        clear: impl FnOnce(&mut Vector) -> Result<()>,
    ) -> Result<&Vector> {
        let instants = [self.instants[1], self.instants[0], stage.start.time, stage.trial.time];
        let weights = weights(scheme.local_error().unwrap_or_default(), &instants, self.known);
        let [near, far] = &self.u;
        let fields: [&Vector; FIELDS] =
            [far, near, &stage.start.u, &stage.trial.u, &stage.start.v, &stage.start.a];
        self.rate.set(0.0);
        for (weight, field) in weights.iter().zip(fields).filter(|(weight, _)| **weight != 0.0) {
            self.rate.axpy(*weight / stage.dt.powf(scheme.order() + 1.0), field)?;
        }
        clear(&mut self.rate)?;
        Ok(&self.rate)
    }

    /// The last rate after the filter. The state of the filter does not change.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn smooth_rate(&mut self, section: &Section) -> Result<&Vector> {
        let Self { rate, smooth, work, .. } = self;
        combine(&section.weights(section.count - 1), smooth, rate, work)?;
        Ok(work)
    }

    /// Updates the filter with the last rate.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn settle(&mut self, section: &Section) -> Result<()> {
        // The last section is updated first, because it needs the previous values of the others.
        for last in (0..SECTIONS).rev() {
            combine(&section.weights(last), &self.smooth, &self.rate, &mut self.work)?;
            self.smooth[last].copy_from(&self.work)?;
        }
        Ok(())
    }

    /// Stores the displacement at the start of an accepted step, and records which first guess
    /// would have been better.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn push(&mut self, stage: &Stage, restart: bool) -> Result<()> {
        if self.known == 2 {
            self.work.waxpy(-1.0, &stage.start.u, &stage.trial.u)?;
            self.work.axpy(-stage.dt, &stage.start.v)?;
            let straight = self.work.norm()?;
            let mut guess = self.work.like()?;
            self.extrapolate(&stage.start, stage.trial.time, &mut guess)?;
            guess.axpy(-1.0, &stage.trial.u)?;
            self.curved = is_curved([guess.norm()?, straight], stage.trial.u.norm()?);
        }
        self.u.swap(0, 1);
        self.u[0].copy_from(&stage.start.u)?;
        self.instants = [stage.start.time, self.instants[0]];
        self.known = if restart { 0 } else { (self.known + 1).min(2) };
        Ok(())
    }
}

/// Whether a parabola predicts a motion better than a straight line, given the errors of both and
/// the size of the displacements \[m\]. If both are exact to rounding, the line is chosen, so that
/// the choice does not depend on rounding.
fn is_curved([parabola, line]: [f64; 2], size: f64) -> bool {
    /// Relative size of errors that are attributed to rounding. In free flight the error is about
    /// 1e-15 after a few hundred steps.
    const ROUNDING: f64 = 1e-12;
    line > ROUNDING * size && parabola < line
}

/// The weighted sum of the sections of a filter and its input.
fn combine(
    weights: &[f64; SECTIONS + 1],
    sections: &[Vector; SECTIONS],
    input: &Vector,
    out: &mut Vector,
) -> Result<()> {
    let [one, two, three] = sections;
    out.set(0.0);
    for (weight, field) in weights.iter().zip([one, two, three, input]).filter(|(weight, _)| **weight != 0.0)
    {
        out.axpy(*weight, field)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parabola with the smaller error is chosen, unless both errors are rounding, as for a
    /// body at rest or in flight.
    #[test]
    fn rounding_does_not_choose_the_first_guess() {
        assert!(is_curved([1e-6, 2e-6], 1.0) && !is_curved([2e-6, 1e-6], 1.0));
        assert!(!is_curved([1e-15, 2e-15], 1.0) && !is_curved([2e-15, 1e-15], 1.0));
        assert!(!is_curved([0.0, 0.0], 0.0));
    }
}
