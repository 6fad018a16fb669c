//! State from which a matrix is assembled again.
//!
//! Matrices and preconditioners outlive the step that made them. A checkpoint does not contain
//! them. It contains their sources, from which a restarted run makes them again, bit by bit.

use std::rc::Rc;

use serde::{Deserialize, Serialize};

use super::{Balance, Continuation, Equations, OverStep, RigidInstant, Shifts, Split, Stage};
use crate::error::{Error, Result};
use crate::material::Overstress;
use crate::terms::Terms;

/// The settings of a [`Stage`] and of the equations that an assembly reads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StageSettings {
    /// Time of the trial state \[s\].
    pub time: f64,
    /// Time of the start of the step \[s\].
    start_time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
    shifts: Shifts,
    balance: Balance,
    inertia: bool,
    over_step: OverStep,
    rigid_at: RigidInstant,
    /// How the equations differed from those of the scene.
    pub continuation: Continuation,
    /// Which quantities a staggered solve held fixed.
    pub split: Split,
}

impl StageSettings {
    /// The settings of this stage and of the equations.
    pub fn of(stage: &Stage, continuation: Continuation, split: Split) -> Self {
        Self {
            time: stage.trial.time,
            start_time: stage.start.time,
            dt: stage.dt,
            shifts: stage.shifts,
            balance: stage.balance,
            inertia: stage.inertia,
            over_step: stage.over_step,
            rigid_at: stage.rigid_at,
            continuation,
            split,
        }
    }

    /// Time from the start of the step to the trial state \[s\].
    pub fn elapsed(&self) -> f64 {
        self.time - self.start_time
    }

    /// Gives the stage these settings.
    pub fn apply_to(&self, stage: &mut Stage) {
        stage.trial.time = self.time;
        stage.start.time = self.start_time;
        stage.dt = self.dt;
        stage.shifts = self.shifts;
        stage.balance = self.balance;
        stage.inertia = self.inertia;
        stage.over_step = self.over_step;
        stage.rigid_at = self.rigid_at;
    }
}

/// Assembling matrices again after a restart. By default nothing can be, and a restarted run begins
/// with new matrices.
pub trait Resumption: Equations {
    /// Source of [`Equations::matrix`]. It is `None` before the first assembly with its pattern.
    fn matrix_source(&self) -> Option<Rc<MatrixSource>> {
        None
    }

    /// Source of a matrix of these `terms` at the trial state.
    fn source_at(&self, stage: &Stage, terms: Terms) -> Rc<MatrixSource> {
        Rc::new(MatrixSource {
            terms,
            settings: StageSettings::of(stage, *self.continuation(), Split::Monolithic),
            u: stage.trial.u.owned().to_vec(),
            v: stage.trial.v.owned().to_vec(),
            u_start: stage.start.u.owned().to_vec(),
            linearised_at: None,
            orientations: Vec::new(),
            contacts: Vec::new(),
            viscous: None,
            search: None,
        })
    }

    /// Assembles [`Equations::matrix`] again from its source, and returns the stage at which it was
    /// assembled. The contact points have the state that they had there. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn assemble_again(&mut self, _source: &Rc<MatrixSource>) -> Result<Stage> {
        Err(Error::internal("this system can not assemble a matrix again"))
    }
}

/// State at which contacts searched for facets.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSource {
    /// Whether it is the search of the undeformed bodies, which precedes every run. Its
    /// displacements are not stored.
    pub undeformed: bool,
    /// Whether forces acted over the step.
    pub over_step: OverStep,
    /// Displacements of the owned unknowns \[m\].
    pub u: Vec<f64>,
    /// Displacements at the start of the step \[m\]. They are not stored unless forces acted over
    /// the step.
    pub u_start: Vec<f64>,
    /// Depth of the deepest point of each contact on this rank \[m\].
    pub below: Vec<f64>,
    /// Whether couplings were found far ahead, because the pattern of the matrix was rebuilt.
    pub ahead: bool,
}

/// Parameters of the laws of a contact that change during a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ChangedLaw {
    /// Factor by which the contact is stiffer than its normal law.
    pub stiffening: f64,
    /// Number of the friction regularisation in their list, and its parameter.
    pub regularization: Option<(usize, f64)>,
}

/// State of a contact that an assembly reads.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSource {
    /// The laws.
    pub law: ChangedLaw,
    /// State of the points, point by point.
    pub points: Vec<f64>,
}

/// Everything that the assembly of a matrix reads, except for the model.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixSource {
    /// Terms of the matrix.
    pub terms: Terms,
    /// Settings of the stage.
    pub settings: StageSettings,
    /// Displacements of the owned unknowns \[m\].
    pub u: Vec<f64>,
    /// Velocities of the owned unknowns \[m/s\].
    pub v: Vec<f64>,
    /// Displacements of the owned unknowns at the start of the step \[m\].
    pub u_start: Vec<f64>,
    /// Displacements at which the pressure of nearly incompressible bodies was linearised \[m\]; `None` if it
    /// was not.
    pub linearised_at: Option<Vec<f64>>,
    /// Rotations of the free rigid bodies at the start of the step, as quaternions.
    pub orientations: Vec<[f64; 4]>,
    /// The contacts.
    pub contacts: Vec<ContactSource>,
    /// Stress of the Prony series of each group of viscous elements. It is `None` if no body is
    /// viscous, or if all are relaxed.
    pub viscous: Option<Vec<Rc<Overstress>>>,
    /// The search that found the facets of the contacts. It is `None` without contact.
    pub search: Option<Rc<SearchSource>>,
}

/// The sources that the parts of a run's state name by their numbers, each once.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// Sources of matrices.
    pub matrices: Vec<Rc<MatrixSource>>,
    /// Sources of searches. Those of the matrices are among them.
    pub searches: Vec<Rc<SearchSource>>,
    /// Marked nodes among the owned ones.
    pub marks: Vec<Vec<bool>>,
}

impl Sources {
    /// Number of this source of a matrix.
    pub fn matrix(&mut self, source: &Rc<MatrixSource>) -> usize {
        if let Some(search) = &source.search {
            self.search(search);
        }
        number(&mut self.matrices, source, Rc::ptr_eq)
    }

    /// Number of this source of a search.
    pub fn search(&mut self, source: &Rc<SearchSource>) -> usize {
        number(&mut self.searches, source, SearchSource::is)
    }

    /// Number of these marks.
    pub fn mark(&mut self, marks: &[bool]) -> usize {
        self.marks.push(marks.to_vec());
        self.marks.len() - 1
    }
}

impl SearchSource {
    /// Whether the other source gives the same search.
    pub fn is(self: &Rc<Self>, other: &Rc<Self>) -> bool {
        Rc::ptr_eq(self, other) || self.undeformed && other.undeformed
    }
}

/// Position of an element among the known ones. It is appended if it is new.
fn number<T>(all: &mut Vec<Rc<T>>, one: &Rc<T>, same: impl Fn(&Rc<T>, &Rc<T>) -> bool) -> usize {
    all.iter().position(|known| same(known, one)).unwrap_or_else(|| {
        all.push(Rc::clone(one));
        all.len() - 1
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each source is listed once. All searches of the undeformed bodies are the same one.
    #[test]
    fn sources_are_listed_once() {
        let search = |undeformed| {
            Rc::new(SearchSource {
                undeformed,
                over_step: OverStep::No,
                u: Vec::new(),
                u_start: Vec::new(),
                below: Vec::new(),
                ahead: false,
            })
        };
        let (first, moved) = (search(true), search(false));
        let mut sources = Sources::default();
        let numbers = [&first, &moved, &search(true), &moved, &search(false)].map(|one| sources.search(one));
        assert_eq!(numbers, [0, 1, 0, 1, 2]);
    }
}
