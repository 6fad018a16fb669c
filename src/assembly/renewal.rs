//! Updates after surfaces have moved: target facets are gathered again, and the pattern of the
//! matrix is extended if it lacks a coupling.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::interface::{Couplings, Interface};
use super::mass::{MassMatrix, Supported};
use super::pair::CandidateHorizon;
use super::system::ContactSystem;
use crate::contact::evaluation::ContactFields;
use crate::dynamics::{OverStep, Stage};
use crate::error::Result;
use crate::petsc::{BlockPattern, Matrix};
use crate::tensor::Vector;

/// Starting point of a new search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    /// The current pattern, which may be sufficient.
    Pattern,
    /// No existing pattern.
    Nothing,
}

impl<const D: usize> ContactSystem<D> {
    /// Whether a contact of this rank has to search again.
    pub(super) fn is_stale(&self, stage: &Stage) -> bool {
        let (u, u_start) = (stage.trial.u.local(), stage.start.u.local());
        let step = half_step::<D>([&u, &u_start], stage.over_step);
        let points = &self.local.mesh.points;
        let position = |node: u32| {
            let node = node as usize;
            std::array::from_fn(|i| points[node][i] + u[node * D + i])
        };
        self.contacts.iter().any(|contact| contact.pair.is_stale(position, &step))
    }

    /// Gathers target facets at these fields and finds the couplings. The pattern is extended if it
    /// lacks one. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, the same on all ranks.
    pub(super) fn renew(&mut self, fields: &ContactFields, over_step: OverStep) -> Result<()> {
        self.look_around(fields, over_step, Known::Pattern)
    }

    /// Gathers target facets at these fields and rebuilds the pattern from the current couplings,
    /// independent of earlier ones. Collective.
    ///
    /// # Errors
    /// As for [`renew`](Self::renew).
    pub(super) fn renew_all(&mut self, fields: &ContactFields) -> Result<()> {
        self.look_around(fields, OverStep::No, Known::Nothing)?;
        self.contacts.iter_mut().for_each(LocalContact::begin_step);
        Ok(())
    }

    fn look_around(&mut self, fields: &ContactFields, over_step: OverStep, known: Known) -> Result<()> {
        let _running = self.phases.search.begin();
        let session = self.session.clone();
        let world = session.world();
        let points = self.local.mesh.points.as_flattened();
        let positions: Vec<f64> = points.iter().zip(fields.u).map(|(x, u)| x + u).collect();
        for contact in &mut self.contacts {
            contact.gather(
                world,
                &self.local,
                &positions,
                half_step([fields.u, fields.u_start], over_step),
            )?;
        }
        let mut interface = self.meet()?;
        interface.bring(world, fields);
        let u = interface.fields().u.to_vec();
        if known == Known::Pattern {
            self.contacts
                .iter_mut()
                .for_each(|contact| contact.pair.find_couplings(&u, CandidateHorizon::Now));
            interface.agree_on(world, &self.local.index, couplings(&self.contacts))?;
        }
        if known == Known::Nothing || !self.pattern_holds(&interface) {
            self.contacts
                .iter_mut()
                .for_each(|contact| contact.pair.find_couplings(&u, CandidateHorizon::Ahead));
            interface.agree_on(world, &self.local.index, couplings(&self.contacts))?;
            self.adopt_pattern(self.elements.widened(interface.blocks().iter().copied()))?;
        }
        let places = self.contacts.iter_mut().map(|contact| &mut contact.pair.couplings);
        interface.locate(&self.local.index, self.matrix.pattern(), places);
        self.interface = Some(interface);
        Ok(())
    }

    /// Creates a common numbering of the foreign nodes of all contacts. Collective.
    fn meet(&mut self) -> Result<Interface<D>> {
        let mut foreign: Vec<(i32, [f64; D])> =
            self.contacts.iter().flat_map(|contact| contact.pair.foreign()).collect();
        foreign.sort_unstable_by_key(|(global, _)| *global);
        foreign.dedup_by_key(|(global, _)| *global);
        let (globals, points): (Vec<i32>, Vec<[f64; D]>) = foreign.into_iter().unzip();
        let all: Vec<[f64; D]> = self.local.mesh.points.iter().copied().chain(points).collect();
        let index = &self.local.index;
        self.contacts.iter_mut().for_each(|contact| contact.pair.adopt(index, &globals, &all));
        Interface::new(
            self.session.world(),
            index,
            &self.supports.dofs.constrained,
            globals,
            self.phases.exchange.clone(),
        )
    }

    /// Whether the pattern contains every required block, on all ranks. Collective.
    fn pattern_holds(&self, interface: &Interface<D>) -> bool {
        let pattern = self.matrix.pattern();
        let lacks =
            interface.blocks().iter().any(|&(row, column)| pattern.slot(row as usize, column).is_none());
        let mut any = 0u8;
        self.session.world().all_reduce_into(&u8::from(lacks), &mut any, SystemOperation::max());
        any == 0
    }

    /// Rebuilds the matrix and all positions in it. Collective.
    fn adopt_pattern(&mut self, pattern: BlockPattern) -> Result<()> {
        let pattern = Rc::new(pattern);
        let index = &self.local.index;
        self.solids.iter_mut().for_each(|solid| solid.map.relocate(&pattern, index));
        self.external.relocate(&pattern, index);
        if self.mass.is_some() {
            let supported = Supported { constrained: &self.supports.dofs.constrained, index };
            self.mass = Some(MassMatrix::new(
                &self.session,
                &pattern,
                &self.solids,
                &supported,
                self.redistribution.as_ref(),
            )?);
        }
        self.matrix = Matrix::new(&self.session, &pattern, self.matrix.format())?;
        if self.has_modes { self.set_rigid_body_modes() } else { Ok(()) }
    }
}

/// Motion of a node from the start of the step to its midpoint \[m\], if forces act over the step;
/// otherwise zero.
fn half_step<const D: usize>(
    [u, u_start]: [&[f64]; 2],
    over_step: OverStep,
) -> impl Fn(u32) -> Vector<D> + '_ {
    move |node| match over_step {
        OverStep::Middle => {
            let first = node as usize * D;
            Vector::from_fn(|i, _| u[first + i] - u_start[first + i])
        }
        OverStep::No | OverStep::End => Vector::zeros(),
    }
}

fn couplings<const D: usize>(contacts: &[LocalContact<D>]) -> impl Iterator<Item = &Couplings> {
    contacts.iter().filter_map(|contact| contact.pair.wider_couplings())
}
