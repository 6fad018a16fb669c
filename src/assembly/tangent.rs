//! The matrix of (3.5), (3.6) or (3.7): the requested terms of the derivative of the residual.

use std::rc::Rc;

use super::contact::LocalContact;
use super::external::External;
use super::forces::SolidFields;
use super::interface::Opening;
use super::patches::solid_terms;
use super::scatter::LiftTarget;
use super::stages::{MatrixTarget, active_damping, hold};
use super::system::ContactSystem;
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::point::TermSelection;
use crate::contact::state::Branches;
use crate::dynamics::{Continuation, FrictionMode, Lift, OverStep, Stage};
use crate::error::Result;
use crate::petsc::{BlockValues, Symmetry};
use crate::space::Held;
use crate::terms::Terms;

impl<const D: usize> ContactSystem<D> {
    /// Assembles the derivative of the residual, restricted to `terms`.
    pub(super) fn assemble(
        &mut self,
        stage: &Stage,
        terms: Terms,
        target: MatrixTarget,
        mut lift: Option<Lift>,
    ) -> Result<()> {
        self.place_targets(stage);
        self.bodies.prepare_viscous(stage);
        let damping = self.bodies.damping.as_ref();
        let damping = damping.filter(|_| terms.contains(Terms::DAMPING) && self.continuation.damped);
        if let (Some(damping), Some(Lift { change, rhs })) = (damping, &mut lift) {
            damping.multiply(change, &mut self.work)?;
            self.bodies.held().clear(&mut self.work.owned_mut());
            for (rhs, force) in rhs.owned_mut().iter_mut().zip(self.work.owned().iter()) {
                *rhs -= stage.shifts.velocity * force;
            }
        }
        let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
        let inertia = stage.inertia && terms.contains(Terms::MASS);
        let mass = self.bodies.mass.as_ref().filter(|_| inertia);
        let (change, mut rhs) = match lift {
            Some(Lift { change, rhs }) => (Some(change.local()), Some(rhs.owned_mut())),
            None => (None, None),
        };
        let mut lifted = change.as_ref().zip(rhs.as_mut()).map(|(change, rhs)| LiftTarget { change, rhs });
        let held = self.bodies.held();
        let solids = &self.bodies.solids;
        let patches = &self.bodies.patches;
        let linearised_at = self.linearised_at.as_deref();
        let elastic = &self.bodies.elastic;
        let ties = &self.bodies.ties;
        let of_dashpots = if self.continuation.damped { Terms::DAMPING } else { Terms::empty() };
        let of_elastic = terms & (Terms::SPRINGS | of_dashpots);
        let contacts = &mut self.contacts;
        let external = &self.external;
        let shifts = stage.shifts;
        let weight = stage.balance.mass[1];
        let unit = self.unit;
        let rows = self.bodies.local.index.owned * D;
        let Continuation { spring, friction, load_factor, damped, .. } = self.continuation;
        let hold = hold(friction, self.split);
        let phases = &self.phases;
        let interface = self.interface.as_mut();
        let world = self.bodies.session.world();
        let symmetric = (self.bodies.free.is_empty() || !terms.contains(Terms::ZONE_CHANGE))
            && symmetric(contacts, external, friction, terms)
            && (stage.over_step == OverStep::No || self.symmetric_steps);
        let symmetry = if symmetric { Symmetry::Symmetric } else { Symmetry::None };
        let free = &self.bodies.free;
        let pattern = Rc::clone(self.matrix.pattern());
        let pattern = &*pattern;
        let (matrix, joined) = match target {
            MatrixTarget::Own => (&mut self.matrix, false),
            MatrixTarget::Other(matrix) => (matrix, false),
            MatrixTarget::Joined(matrix) => (matrix, true),
        };
        let inverted = matrix.fill(|values| {
            let tangent = phases.tangent.begin();
            match mass {
                Some(mass) => mass.write_to(weight * shifts.acceleration, held, values),
                None => values.zero(),
            }
            let rigid = match joined {
                // The matrix of joined bodies stays symmetric.
                true => Ok(()),
                false => free.add_stiffness(stage, terms, load_factor, pattern, values),
            };
            let damping = damping.map(|damping| match &self.bodies.joined_damping {
                Some(softened) if joined => softened,
                _ => damping,
            });
            let of_bodies = damping.map_or(Ok(()), |damping| damping.add_to(shifts.velocity, held, values));
            if let Some(mass) = mass.filter(|_| terms == Terms::MASS) {
                // The mass alone is singular at nodes without mass.
                let massless = mass.massless().iter().map(|&node| node as usize);
                massless.for_each(|node| values.add_diagonal_block(node, &free_unit(held, node, unit)));
            }
            for (dof, held) in held.axes()[..rows].iter().enumerate() {
                if *held || spring > 0.0 {
                    values.add_diagonal(dof, if *held { unit } else { spring * unit });
                }
            }
            for &(node, _) in held.inclined().iter().take_while(|(node, _)| (*node as usize) * D < rows) {
                // The diagonal has the spring of all directions already.
                let mut block = free_unit(held, node as usize, (spring - 1.0) * unit);
                (0..D).for_each(|i| block[i * D + i] += (1.0 - spring) * unit);
                values.add_diagonal_block(node as usize, &block[..D * D]);
            }
            drop(tangent);
            let mut inverted = Ok(());
            let mut bodies = |values: &mut BlockValues, mut lift: Option<LiftTarget>| {
                let _running = phases.tangent.begin();
                for solid in solid_terms(solids, patches) {
                    let at = SolidFields {
                        linearised_at,
                        softened: joined,
                        ..SolidFields::of(stage, &u, &u_start)
                    };
                    let lift = lift.as_mut().map(LiftTarget::reborrow);
                    let done = solid.add_stiffness(&at, terms, held, values, lift);
                    inverted = inverted.and(done);
                }
                if !of_elastic.is_empty() && !elastic.is_empty() {
                    let lift = lift.as_mut().map(LiftTarget::reborrow);
                    elastic.add_stiffness(of_elastic, shifts.velocity, held, values, lift);
                }
                if joined || terms.contains(Terms::TIES) {
                    ties.add_stiffness(joined, held, values, lift.as_mut().map(LiftTarget::reborrow));
                }
                if terms.contains(Terms::FOLLOWING_LOAD) {
                    external.add_stiffness(&Self::moment(stage, load_factor, &u), held, values, lift);
                }
            };
            let fields = ContactFields { u: &u, v: &v, u_start: &u_start };
            let request = |contact: &LocalContact<D>| ContactRequest {
                stiffness: Some(TermSelection {
                    terms,
                    velocity_shift: shifts.velocity,
                    joint: joined.then_some(contact.beneath),
                }),
                hold,
                branches: Branches::Linearised,
                over_step: stage.over_step == OverStep::Middle,
                step: stage.dt,
                damping: active_damping(damped),
            };
            let lift = lifted.as_mut().map(LiftTarget::reborrow);
            match interface {
                None => bodies(values, lift),
                // Contact comes first, so that its blocks have arrived when the elements are
                // finished.
                Some(interface) => {
                    let evaluate = |fields: &ContactFields, opening: &mut Opening<D>| {
                        let _running = phases.contact.begin();
                        for contact in contacts.iter_mut() {
                            let request = request(contact);
                            contact.add_stiffness(fields, &request, opening);
                        }
                    };
                    interface.add_stiffness((world, &fields), (values, symmetry), lift, evaluate, bodies);
                }
            }
            rigid.and(of_bodies).map(|()| inverted)
        })??;
        self.fault = inverted.err();
        matrix.set_symmetry(symmetry)?;
        Ok(())
    }
}

/// `unit` times the projection of a node onto its free directions, row-major.
fn free_unit<const D: usize>(held: &Held<D>, node: usize, unit: f64) -> Vec<f64> {
    held.projection(node).as_flattened().iter().map(|entry| unit * entry).collect()
}

/// Whether the matrix is symmetric. Friction, a changing area or a following load make it
/// non-symmetric.
fn symmetric<const D: usize>(
    contacts: &[LocalContact<D>],
    external: &External<D>,
    friction: FrictionMode,
    terms: Terms,
) -> bool {
    let friction = friction == FrictionMode::AsGiven;
    let coupled = Terms::FRICTION_NORMAL_COUPLING | Terms::FRICTION_GEOMETRY;
    let contact = |contact: &LocalContact<D>| {
        (friction && contact.law().friction.is_some() && terms.intersects(coupled))
            || (!contact.is_symmetric() && terms.contains(Terms::ZONE_CHANGE))
    };
    let follows = external.follows() && terms.contains(Terms::FOLLOWING_LOAD);
    !follows && !contacts.iter().any(contact)
}
