//! Internal forces and stiffness of the solids, swept group by group.

use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use super::solid::SolidElements;
use super::viscous::ViscousState;
use crate::dynamics::{OverStep, Stage};
use crate::element::{ElementSink, Inverted, Request};
use crate::model::RayleighFactors;
use crate::petsc::BlockValues;
use crate::space::Held;
use crate::terms::Terms;

/// Displacements at which solids are evaluated, local nodes \[m\].
#[derive(Debug, Clone, Copy)]
pub struct SolidFields<'a> {
    /// The trial state.
    pub u: &'a [f64],
    /// The state at the start of the step, if forces conserve over a step and the trial state is
    /// its midpoint.
    pub start: Option<&'a [f64]>,
    /// Displacements at which the tangent has its pressure linearised, see [`Request::linearised_at`].
    pub linearised_at: Option<&'a [f64]>,
    /// Stress of Prony series to include.
    pub viscous: ViscousState,
    /// Whether nearly incompressible bodies have the bulk modulus of joined bodies.
    pub softened: bool,
}

impl<'a> SolidFields<'a> {
    /// Uses the trial state `u` of `stage`, whose start is `start`.
    pub fn of(stage: &Stage, u: &'a [f64], start: &'a [f64]) -> Self {
        Self {
            u,
            start: (stage.over_step == OverStep::Middle).then_some(start),
            linearised_at: None,
            viscous: ViscousState::Present,
            softened: false,
        }
    }
}

/// Terms of the solids that are evaluated piece by piece: elements, or patches of elements.
pub trait SolidTerms<const D: usize> {
    /// Positions of the entries of each piece.
    fn map(&self) -> &ScatterMap;

    /// Damping of the body.
    fn damping(&self) -> Option<RayleighFactors>;

    /// Evaluates all pieces.
    ///
    /// # Errors
    /// The first inverted element.
    fn evaluate(
        &self,
        at: &SolidFields,
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> std::result::Result<(), Inverted>;

    /// Force of the difference between the pressure linearised at the displacements `earlier` and that at `u`,
    /// see [`ElementGroup::pressure_change`](crate::element::ElementGroup::pressure_change).
    fn pressure_change(&self, u: &[f64], earlier: &[f64], sink: &mut dyn ElementSink);

    /// Adds `Q` to the owned rows of `force` \[N\].
    ///
    /// # Errors
    /// The first inverted element.
    fn add_force(&self, at: &SolidFields, force: &mut [f64]) -> std::result::Result<(), Inverted> {
        self.evaluate(at, Request::FORCE, &mut ForceSink::<D> { map: self.map(), force })
    }

    /// Adds the requested stiffness terms to the matrix.
    ///
    /// # Errors
    /// The first inverted element.
    fn add_stiffness(
        &self,
        at: &SolidFields,
        terms: Terms,
        held: &Held<D>,
        values: &mut BlockValues,
        lift: Option<LiftTarget>,
    ) -> std::result::Result<(), Inverted> {
        let mut sink = MatrixSink::<D>::new(self.map(), held, values, lift);
        self.evaluate(at, Request { stiffness: Some(terms), linearised_at: at.linearised_at }, &mut sink)
    }
}

impl<const D: usize> SolidTerms<D> for SolidElements<D> {
    fn map(&self) -> &ScatterMap {
        &self.map
    }

    fn damping(&self) -> Option<RayleighFactors> {
        self.damping
    }

    fn evaluate(
        &self,
        at: &SolidFields,
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> std::result::Result<(), Inverted> {
        let group = self.softened.as_ref().filter(|_| at.softened).unwrap_or(&self.group);
        match at.start {
            Some(start) => group.evaluate_step(start, at.u, request, sink),
            None => {
                let viscous = self.viscous.as_ref().and_then(|viscous| viscous.overstress(at.viscous));
                group.evaluate_viscous(at.u, viscous, request, sink)
            }
        }
    }

    fn pressure_change(&self, u: &[f64], earlier: &[f64], sink: &mut dyn ElementSink) {
        self.group.pressure_change(u, earlier, sink);
    }
}
