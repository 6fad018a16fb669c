//! Viscous branches of the elements of a group: their history, and the stress that follows from it in
//! the present step.
//!
//! Before the motion starts, a body is relaxed. From then on the history is that of the last accepted
//! state. Trial states read it and do not change it.

use std::rc::Rc;

use crate::element::{ElementGroup, ViscousEnergies, ViscousHistory, components};
use crate::lanes::Pack;
use crate::material::{Overstress, PronySeries};

/// Which stress of Prony series acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViscousState {
    /// That of the relaxed body.
    Relaxed,
    /// That of the present step.
    Present,
}

/// Branches of the elements of a group.
pub struct ViscousElements {
    series: Rc<PronySeries>,
    /// Stress of the relaxed body; `None` if it is that of the law.
    relaxed: Option<Rc<Overstress>>,
    /// State at the start of the step; `None` before the motion starts.
    history: Option<ViscousHistory>,
    /// Stress of the present step, and the time since its start for which it was computed \[s\].
    present: Option<Prepared>,
}

struct Prepared {
    /// Time since the start of the step \[s\]; `None` if the stress is that of a kept matrix.
    elapsed: Option<f64>,
    overstress: Rc<Overstress>,
}

impl ViscousElements {
    /// Relaxed branches.
    pub fn new(series: Rc<PronySeries>) -> Self {
        let base = series.base();
        let relaxed = (base != 0.0).then(|| Rc::new(Overstress { factor: base, predicted: Vec::new() }));
        Self { series, relaxed, history: None, present: None }
    }

    /// The Prony series.
    pub fn series(&self) -> &PronySeries {
        &self.series
    }

    /// The state at the start of the step; `None` before the motion starts.
    pub fn history(&self) -> Option<&ViscousHistory> {
        self.history.as_ref()
    }

    /// The stress for an evaluation; `None` if it is that of the law.
    pub fn overstress(&self, state: ViscousState) -> Option<&Overstress> {
        match (&self.present, state) {
            (Some(present), ViscousState::Present) => Some(&*present.overstress),
            _ => self.relaxed.as_deref(),
        }
    }

    /// The stress of the present step, for a source; `None` before the motion starts.
    pub fn source(&self) -> Option<Rc<Overstress>> {
        self.present.as_ref().map(|present| Rc::clone(&present.overstress))
    }

    /// Prepares the stress `elapsed` \[s\] after the start of the step.
    pub fn prepare(&mut self, elapsed: f64) {
        let Some(history) = &self.history else { return };
        let is_known = |present: &Prepared| present.elapsed.is_none_or(|known| known == elapsed);
        if self.present.as_ref().is_some_and(is_known) {
            return;
        }
        // The buffer of the last stress is used again, unless a kept matrix needs that stress.
        let last = self.present.take().and_then(|present| Rc::try_unwrap(present.overstress).ok());
        let mut overstress = last.unwrap_or_else(|| Overstress { factor: 0.0, predicted: Vec::new() });
        history.predict(&self.series, elapsed, &mut overstress);
        self.present = Some(Prepared { elapsed: Some(elapsed), overstress: Rc::new(overstress) });
    }

    /// The stress `elapsed` \[s\] after the start of the step; `None` if it is that of the law.
    pub fn at(&self, elapsed: f64) -> Option<Rc<Overstress>> {
        let Some(history) = &self.history else { return self.relaxed.clone() };
        let known = self.present.as_ref().filter(|present| present.elapsed == Some(elapsed));
        Some(known.map_or_else(
            || {
                let mut overstress = Overstress { factor: 0.0, predicted: Vec::new() };
                history.predict(&self.series, elapsed, &mut overstress);
                Rc::new(overstress)
            },
            |present| Rc::clone(&present.overstress),
        ))
    }

    /// Starts the motion from a relaxed state with these isochoric stresses \[Pa\].
    pub fn begin(&mut self, isochoric: &[Pack], dimension: usize) {
        self.history = Some(ViscousHistory::relaxed(&self.series, isochoric, dimension));
        self.present = None;
    }

    /// Advances the history to the displacements `u`, `elapsed` \[s\] after the start of the step. Before
    /// the motion starts, the body stays relaxed.
    pub fn advance<const D: usize>(&mut self, group: &ElementGroup<D>, elapsed: f64, u: &[f64]) {
        if let Some(history) = &mut self.history {
            history.advance(&self.series, elapsed, &group.isochoric_stress(u));
            self.forget();
        }
    }

    /// Energies in a step, see [`ElementGroup::viscous_energies`].
    pub fn energies<const D: usize>(
        &self,
        group: &ElementGroup<D>,
        elapsed: f64,
        u: [&[f64]; 2],
        mine: &[bool],
    ) -> ViscousEnergies {
        let of = |history| group.viscous_energies(&self.series, history, elapsed, u, mine);
        self.history.as_ref().map_or_else(ViscousEnergies::default, of)
    }

    /// Uses the stress with which a kept matrix was assembled, until [`resume`](Self::resume).
    pub fn use_source(&mut self, overstress: Option<Rc<Overstress>>) {
        self.present = overstress.map(|overstress| Prepared { elapsed: None, overstress });
        self.history = None;
    }

    /// Resumes from the history of a checkpoint.
    pub fn resume(&mut self, history: ViscousHistory) {
        self.history = Some(history);
        self.present = None;
    }

    /// Memory for the history of a group and for its stress in a step \[bytes\].
    pub fn bytes<const D: usize>(&self, group: &ElementGroup<D>) -> usize {
        let tensors = self.series.branches().len() + 2;
        group.points_of_batches() * tensors * components(D) * size_of::<Pack>()
    }

    /// Forgets the stress of the step that was accepted. Its buffer is kept.
    fn forget(&mut self) {
        if let Some(present) = &mut self.present {
            present.elapsed = Some(f64::NAN);
        }
    }
}
