//! Implementation of the system's interfaces to solvers and integrators.

use std::rc::Rc;

use super::augmentation;
use super::contact::LocalContact;
use super::patches::solid_terms;
use super::scatter::ForceSink;
use super::soundness::unsound_force;
use super::stages::{self, MatrixTarget};
use super::system::ContactSystem;
use crate::case::Units;
use crate::contact::point::Status;
use crate::contact::state::{Branches, Changes};
use crate::dynamics::{
    Augmentation, BodyNodes, ContactCounts, ContactMonitor, Continuation, Equations, FloatingBodies,
    ForceChange, Freeze, Lift, MatrixSource, MultigridHints, OverStep, PressureLinearisation, Residual,
    Resumption, RigidMotion, Shortfall, Sides, Split, Stage, Staging,
};
use crate::error::{Error, Result, agree};
use crate::petsc::{Matrix, Vector, sum_over_ranks};
use crate::space::PrescribedFields;
use crate::terms::Terms;

impl<const D: usize> Equations for ContactSystem<D> {
    fn prescribe(&mut self, stage: &mut Stage) -> Result<()> {
        let factor = self.continuation.load_factor;
        let filled = {
            let (mut u, mut v, mut a) =
                (stage.trial.u.local_mut(), stage.trial.v.local_mut(), stage.trial.a.local_mut());
            let fields = PrescribedFields { u: &mut u, v: &mut v, a: &mut a };
            // Prescribed motion is evaluated only at the end of a step. Its midpoint value is the
            // mean; otherwise work would be lost.
            let time = if stage.over_step == OverStep::Middle {
                stage.start.time + stage.dt
            } else {
                stage.trial.time
            };
            let rigid = PrescribedFields { u: &mut *fields.u, v: &mut *fields.v, a: &mut *fields.a };
            let rigid = self.bodies.free.prescribe(time, factor, rigid);
            self.bodies.supports.fill(&self.bodies.local.mesh.points, time, factor, fields).and(rigid)
        };
        self.trouble = filled.err();
        if stage.over_step == OverStep::Middle {
            self.prescribe_middle(stage);
        }
        stage.trial.u.update_ghosts()?;
        stage.trial.v.update_ghosts()
    }

    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        self.balance(stage, Branches::Actual, out)
    }

    fn jacobian(&mut self, stage: &Stage, terms: Terms, lift: Option<Lift>) -> Result<()> {
        self.assemble(stage, terms, MatrixTarget::Own, lift)?;
        self.matrix_source = Some(self.source_at(stage, terms));
        Ok(())
    }

    fn jacobian_into(&mut self, stage: &Stage, terms: Terms, matrix: &mut Matrix) -> Result<()> {
        self.assemble(stage, terms, MatrixTarget::Other(matrix), None)
    }

    fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    fn fault(&mut self) -> Option<Error> {
        let told = |own: Option<Error>| agree(self.bodies.session.world(), own.map_or(Ok(()), Err)).err();
        // An inverted element causes non-finite values on any rank.
        let inverted = self.fault.map(|inverted| self.bodies.describe(&inverted));
        told(inverted).or_else(|| told(unsound_force(self)))
    }

    fn rounding(&self, stage: &Stage) -> Result<f64> {
        self.rounding_of_forces(stage)
    }

    fn continuation(&self) -> &Continuation {
        &self.continuation
    }

    fn units(&self) -> Units {
        self.bodies.units
    }

    fn extent(&self) -> f64 {
        self.bodies.extent.farthest
    }
}

impl<const D: usize> Resumption for ContactSystem<D> {
    fn matrix_source(&self) -> Option<Rc<MatrixSource>> {
        self.matrix_source.clone()
    }

    fn source_at(&self, stage: &Stage, terms: Terms) -> Rc<MatrixSource> {
        Rc::new(self.source_of(stage, terms))
    }

    fn assemble_again(&mut self, source: &Rc<MatrixSource>) -> Result<Stage> {
        self.assemble_source(source)
    }
}

impl<const D: usize> ContactMonitor for ContactSystem<D> {
    fn observe(&mut self) -> Result<ContactCounts> {
        let mut own = Changes::default();
        let (mut stick, mut slip) = (0, 0);
        for contact in &mut self.contacts {
            own += contact.iterate();
            stick += contact.count(Status::Stick);
            slip += contact.count(Status::Slip);
        }
        // A stop request on one rank is communicated here, so that all ranks leave the step at the
        // same iterate.
        let mut asked = usize::from(self.bodies.session.is_asked_to_stop());
        let Changes { closed, pressing, changed, flipped, departed } = &mut own;
        let counts = [closed, pressing, changed, flipped, departed, &mut stick, &mut slip, &mut asked];
        sum_over_ranks(self.bodies.session.world(), counts);
        if asked > 0 {
            return Err(Error::stopped("stop requested within a step"));
        }
        self.changes = own;
        let count = |number: usize| number as u64;
        Ok(ContactCounts {
            closed: count(own.closed),
            pressing: count(own.pressing),
            stick: count(stick),
            slip: count(slip),
            changed: count(own.changed),
            flipped: count(own.flipped),
        })
    }

    fn rewind(&mut self) {
        self.contacts.iter_mut().for_each(LocalContact::begin_solve);
    }

    fn predicts(&self) -> bool {
        self.changes.flipped + self.changes.departed > 0
    }

    fn predicted_residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        self.balance(stage, Branches::Predicted, out)
    }

    fn stride(&self) -> f64 {
        self.contacts.iter().map(|contact| contact.pair.stride()).fold(f64::INFINITY, f64::min)
    }

    fn restless_points(&self) -> String {
        match self.changes.changed {
            0 => String::new(),
            1 => "1 contact point still changes its status".to_owned(),
            n => format!("{n} contact points still change their status"),
        }
    }
}

impl<const D: usize> PressureLinearisation for ContactSystem<D> {
    fn linearise_pressure(&mut self, at: Option<&Vector>) {
        for contact in &mut self.contacts {
            match at {
                Some(_) => contact.state.linearise_gaps(),
                None => contact.state.forget_linear_gaps(),
            }
        }
        let at = at.filter(|_| self.bodies.linearises_pressure());
        self.linearised_at = at.map(|u| u.local().to_vec());
    }

    fn linearised_norm(&mut self, stage: &Stage, residual: &Vector) -> Result<Option<f64>> {
        let Some(earlier) = self.linearised_at.as_deref().filter(|_| stage.over_step == OverStep::No) else {
            return Ok(None);
        };
        self.work.copy_from(residual)?;
        {
            let u = stage.trial.u.local();
            let mut force = self.work.owned_mut();
            for solid in solid_terms(&self.bodies.solids, &self.bodies.patches) {
                let mut sink = ForceSink::<D> { map: solid.map(), force: &mut force };
                solid.pressure_change(&u, earlier, &mut sink);
            }
            self.bodies.held().clear(&mut force);
        }
        self.work.norm().map(Some)
    }
}

impl<const D: usize> Staging for ContactSystem<D> {
    fn set_split(&mut self, split: Split) {
        self.split = split;
    }

    fn freeze(&mut self, what: Freeze) {
        stages::freeze(&mut self.contacts, what);
    }

    fn force_change(&self) -> ForceChange {
        stages::force_change(self.bodies.session.world(), &self.contacts)
    }
}

impl<const D: usize> Augmentation for ContactSystem<D> {
    fn reset_multipliers(&mut self) {
        self.contacts.iter_mut().for_each(LocalContact::reset_multipliers);
    }

    fn shortfall(&self, stage: &Stage) -> Result<Option<Shortfall>> {
        self.missed(stage)
    }

    fn improve(&mut self) {
        augmentation::improve(self.bodies.session.world(), &mut self.contacts);
    }
}

impl<const D: usize> FloatingBodies for ContactSystem<D> {
    fn rigid_motions(&self, stage: &Stage) -> Result<Vec<RigidMotion>> {
        let mut motions = self.bodies.free_motions(&stage.trial.u.local())?;
        motions.extend(self.bodies.free.motions(&self.forces, self.bodies.pieces.groups.len())?);
        Ok(motions)
    }

    fn weigh_motion(&self, motion: &Vector, out: &mut Vector) -> Result<()> {
        match &self.bodies.mass {
            Some(mass) => mass.multiply(motion, out)?,
            None => out.copy_from(motion)?,
        }
        self.bodies.held().clear(&mut out.owned_mut());
        Ok(())
    }

    fn unit(&self) -> f64 {
        self.unit
    }
}

impl<const D: usize> MultigridHints for ContactSystem<D> {
    fn joined_bodies_into(&mut self, stage: &Stage, matrix: &mut Matrix) -> Result<()> {
        self.assemble(stage, Terms::BODIES, MatrixTarget::Joined(matrix), None)
    }

    fn contact_nodes(&mut self, sides: Sides) -> Vec<bool> {
        let world = self.bodies.session.world();
        let owned = self.bodies.local.index.owned;
        let mut nodes = stages::contact_nodes(world, &self.contacts, self.interface.as_mut(), sides, owned);
        self.bodies.ties.mark(sides, &mut nodes);
        nodes
    }

    fn body_nodes(&self) -> Option<BodyNodes> {
        let local = &self.bodies.local;
        let mut coordinates = vec![0.0; local.index.owned * D];
        coordinates.iter_mut().zip(local.mesh.points.iter().flatten()).for_each(|(to, from)| *to = *from);
        Some(BodyNodes { pattern: Rc::clone(&self.bodies.pattern), coordinates })
    }

    fn floating_nodes(&self) -> Vec<bool> {
        let mesh = &self.bodies.local.mesh;
        let mut floats = vec![false; self.bodies.local.index.owned];
        for element in 0..mesh.element_count() {
            let body = usize::from(mesh.body[element]);
            if !self.bodies.holding().leaves_free(body) {
                continue;
            }
            for &node in mesh.element_nodes(element) {
                if let Some(floats) = floats.get_mut(node as usize) {
                    *floats = true;
                }
            }
        }
        floats
    }

    fn contact_normals(&mut self, out: &mut Vector) -> Result<()> {
        stages::contact_normals(self.bodies.session.world(), &self.contacts, self.interface.as_mut(), out);
        Ok(())
    }
}

impl<const D: usize> ContactSystem<D> {
    /// Moves the prescribed unknowns from the end of the step, where they were set, to its
    /// midpoint.
    fn prescribe_middle(&self, stage: &mut Stage) {
        let Stage { start, trial, dt, .. } = stage;
        let (mut u, mut v, mut a) = (trial.u.local_mut(), trial.v.local_mut(), trial.a.local_mut());
        let (u_start, v_start) = (start.u.local(), start.v.local());
        let held = self.bodies.held();
        held.replace_held(&mut a, |dof, _| (v[dof] - v_start[dof]) / *dt);
        held.replace_held(&mut v, |dof, _| (u[dof] - u_start[dof]) / *dt);
        held.replace_held(&mut u, |dof, end| 0.5 * (end + u_start[dof]));
    }
}
