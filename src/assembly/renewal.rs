//! Updates after surfaces have moved: target facets are gathered again, and the pattern of the
//! matrix is extended if it lacks a coupling.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use super::contact::LocalContact;
use super::interface::{Couplings, Interface};
use super::pair::CandidateHorizon;
use super::system::ContactSystem;
use crate::collective::Collective;
use crate::contact::evaluation::ContactFields;
use crate::dynamics::{OverStep, SearchSource, Stage};
use crate::error::Result;
use crate::petsc::{BlockPattern, Matrix};
use crate::tensor::Vector;

impl<const D: usize> ContactSystem<D> {
    /// Whether a contact of this rank has to search again.
    pub(super) fn is_stale(&self, stage: &Stage) -> bool {
        let (u, u_start) = (stage.trial.u.local(), stage.start.u.local());
        let step = half_step::<D>([&u, &u_start], stage.over_step);
        let points = &self.bodies.local.mesh.points;
        let position = |node: u32| {
            let node = node as usize;
            std::array::from_fn(|i| points[node][i] + u[node * D + i])
        };
        self.contacts.iter().any(|contact| contact.pair.is_stale(position, (stage.over_step, &step)))
    }

    /// Notes that the present search is the one of the undeformed bodies, which every run makes.
    pub(super) fn note_undeformed(&mut self) {
        let Some(search) = self.search.take() else { return };
        let (u, u_start) = (Vec::new(), Vec::new());
        let undeformed = Rc::new(SearchSource { undeformed: true, u, u_start, ..(*search).clone() });
        self.pattern_search = self.pattern_search.take().map(|_| Rc::clone(&undeformed));
        self.search = Some(undeformed);
    }

    /// Searches again as at this source. Collective.
    ///
    /// # Errors
    /// As for [`renew`](Self::renew).
    pub(super) fn search_again(&mut self, source: &Rc<SearchSource>) -> Result<()> {
        if self.search.as_ref().is_some_and(|search| search.is(source)) {
            return Ok(());
        }
        let (u, u_start) = (self.spread(&source.u)?, self.spread(&source.u_start)?);
        let horizon = if source.ahead { CandidateHorizon::Ahead } else { CandidateHorizon::Now };
        let fields = ContactFields { u: &u, v: &u, u_start: &u_start };
        let mut interface = self.gather(&fields, source.over_step, &source.below)?;
        self.find_couplings(&mut interface, horizon)?;
        self.locate(interface);
        self.search = Some(Rc::clone(source));
        Ok(())
    }

    /// Rebuilds the pattern of the matrix as at this source. Collective.
    ///
    /// # Errors
    /// As for [`renew`](Self::renew).
    pub(super) fn rebuild_pattern(&mut self, source: &Rc<SearchSource>) -> Result<()> {
        if self.pattern_search.as_ref().is_some_and(|search| search.is(source)) {
            return Ok(());
        }
        self.search_again(source)?;
        if let Some(mut interface) = self.interface.take() {
            self.adopt_pattern(self.bodies.pattern.widened(interface.blocks().iter().copied()))?;
            let places = self.contacts.iter_mut().map(|contact| &mut contact.pair.couplings);
            interface.locate(&self.bodies.local.index, self.matrix.pattern(), places);
            self.interface = Some(interface);
        }
        self.pattern_search = Some(Rc::clone(source));
        Ok(())
    }

    /// Field of all local nodes with these values of the owned unknowns, or zero. Collective.
    fn spread(&self, owned: &[f64]) -> Result<Vec<f64>> {
        let mut field = self.forces.like()?;
        field.owned_mut().iter_mut().zip(owned).for_each(|(entry, value)| *entry = *value);
        field.update_ghosts()?;
        let all = field.local().to_vec();
        Ok(all)
    }

    /// Gathers target facets at these fields and finds the couplings. The pattern is extended if it
    /// lacks one. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, the same on all ranks.
    pub(super) fn renew(&mut self, fields: &ContactFields, over_step: OverStep) -> Result<()> {
        let _running = self.phases.search.begin();
        let below: Vec<f64> =
            self.contacts.iter().map(|contact| contact.pair.depth_of(&contact.state)).collect();
        let mut interface = self.gather(fields, over_step, &below)?;
        self.find_couplings(&mut interface, CandidateHorizon::Now)?;
        let ahead = !self.pattern_holds(&interface);
        if ahead {
            self.find_couplings(&mut interface, CandidateHorizon::Ahead)?;
            self.adopt_pattern(self.bodies.pattern.widened(interface.blocks().iter().copied()))?;
        }
        self.locate(interface);
        let owned = |field: &[f64]| field[..self.bodies.local.index.owned * D].to_vec();
        let u_start = if over_step == OverStep::Middle { owned(fields.u_start) } else { Vec::new() };
        let u = owned(fields.u);
        let search = Rc::new(SearchSource { undeformed: false, over_step, u, u_start, below, ahead });
        if ahead {
            self.pattern_search = Some(Rc::clone(&search));
        }
        self.search = Some(search);
        Ok(())
    }

    /// Gathers the target facets of all contacts at these fields. Collective.
    fn gather(&mut self, fields: &ContactFields, over_step: OverStep, below: &[f64]) -> Result<Interface<D>> {
        let session = self.bodies.session.clone();
        let world = session.world();
        let points = self.bodies.local.mesh.points.as_flattened();
        let positions: Vec<f64> = points.iter().zip(fields.u).map(|(x, u)| x + u).collect();
        for (contact, below) in self.contacts.iter_mut().zip(below) {
            let step = (over_step, half_step([fields.u, fields.u_start], over_step));
            contact.gather(world, &self.bodies.local, &positions, step, *below)?;
        }
        let mut interface = self.meet()?;
        if let Some(before) = &self.interface {
            let index = &self.bodies.local.index;
            let [before, now] = [before, &interface].map(|interface| interface.numbering(index));
            let new = |node| now.node(before.global(node));
            self.contacts.iter_mut().for_each(|contact| contact.state.renumber(new));
        }
        interface.bring(world, fields);
        Ok(interface)
    }

    /// Finds the couplings of all contacts up to this horizon. Collective.
    fn find_couplings(&mut self, interface: &mut Interface<D>, horizon: CandidateHorizon) -> Result<()> {
        let u = interface.fields().u.to_vec();
        self.contacts.iter_mut().for_each(|contact| contact.pair.find_couplings(&u, horizon));
        interface.agree_on(self.bodies.session.world(), &self.bodies.local.index, couplings(&self.contacts))
    }

    /// Finds the positions of all couplings in the pattern of the matrix.
    fn locate(&mut self, mut interface: Interface<D>) {
        let places = self.contacts.iter_mut().map(|contact| &mut contact.pair.couplings);
        interface.locate(&self.bodies.local.index, self.matrix.pattern(), places);
        self.interface = Some(interface);
    }

    /// Creates a common numbering of the foreign nodes of all contacts. Collective.
    fn meet(&mut self) -> Result<Interface<D>> {
        let index = &self.bodies.local.index;
        let gathered = self.contacts.iter().flat_map(|contact| contact.pair.foreign(index));
        let linearised = self.interface.iter().flat_map(|before| {
            let before = before.numbering(index);
            let nodes = self.contacts.iter().flat_map(|contact| contact.state.gap_nodes());
            nodes.map(move |node| (before.global(node.node), node.reference.into()))
        });
        let linearised = linearised.filter(|(global, _)| index.local(*global).is_none());
        let mut foreign: Vec<(i32, [f64; D])> = gathered.chain(linearised).collect();
        foreign.sort_unstable_by_key(|(global, _)| *global);
        foreign.dedup_by_key(|(global, _)| *global);
        let (globals, points): (Vec<i32>, Vec<[f64; D]>) = foreign.into_iter().unzip();
        let all: Vec<[f64; D]> = self.bodies.local.mesh.points.iter().copied().chain(points).collect();
        self.contacts.iter_mut().for_each(|contact| contact.pair.adopt(index, &globals, &all));
        Interface::new(
            self.bodies.session.world(),
            index,
            self.bodies.held(),
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
        self.bodies.session.world().reduce_all(&u8::from(lacks), &mut any, SystemOperation::max());
        any == 0
    }

    /// Rebuilds the matrix and all positions in it. Collective.
    fn adopt_pattern(&mut self, pattern: BlockPattern) -> Result<()> {
        let pattern = Rc::new(pattern);
        let index = &self.bodies.local.index;
        self.bodies.solids.iter_mut().for_each(|solid| solid.map.relocate(&pattern, index));
        self.bodies.patches.iter_mut().for_each(|patches| patches.map.relocate(&pattern, index));
        self.external.relocate(&pattern, index);
        self.bodies.elastic.relocate(&pattern, index);
        self.bodies.ties.relocate(&pattern, index);
        self.bodies.set_pattern(&pattern)?;
        self.matrix = Matrix::new(&self.bodies.session, &pattern, self.matrix.format())?;
        self.matrix_source = None;
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
