//! Monitors of a running simulation: unexplained energy, and impacts under a scheme that may gain
//! energy from them.

use serde::{Deserialize, Serialize};

use super::closing::{ClosingContact, closings};
use super::motion::MotionWatch;
use super::unexplained::{KnownError, Unexplained};
use crate::assembly::ContactSystem;
use crate::case::{Case, Units};
use crate::dynamics::{Equations, Stage};
use crate::error::{Error, Result};
use crate::model::{BodyMaterial, Model};
use crate::observe::energy::{Energies, EnergyLedger};
use crate::time::Scheme;

/// Ratio of closing speed to wave speed above which contact counts as an impact. Below it, waves
/// carry the shock away within the time that a scheme resolves.
const SUDDEN: f64 = 5e-4;

/// Fraction of the contact points that must close in one step of an impact when other points were
/// closed before.
const MANY: f64 = 0.1;

/// Steps whose unexplained energy is below this fraction of the largest energy are not checked for
/// rounding.
const NOTABLE: f64 = 1e-3;

/// Monitors energy and impact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunGuard {
    limit: Option<f64>,
    /// Largest energy or work so far \[J\].
    scale: f64,
    /// Energies when the unexplained energy was last below half of the limit.
    calm: Energies,
    /// Largest wave speed in the contactor of each contact \[m/s\]. It is empty if impact is not
    /// monitored or was already reported.
    speeds: Vec<f64>,
    /// Energy that the steps left unexplained.
    unexplained: Unexplained,
    /// Whether a gain of energy was reported.
    gain_reported: bool,
    /// Whether the scheme `conserving` accepts the bodies.
    may_conserve: bool,
    /// How far surfaces in contact move in a step.
    pub motion: MotionWatch,
}

impl RunGuard {
    /// A guard for the case, which starts with the energies `start`.
    pub fn new<const D: usize>(case: &Case, model: &Model<D>, scheme: Scheme, start: &Energies) -> Self {
        let speed = |contact: &crate::model::ContactModel<D>| {
            let of_body = |&body: &usize| {
                let speed = |material: &BodyMaterial| {
                    let stiffness = material.wave_modulus();
                    (stiffness / material.formulation.density.max(f64::MIN_POSITIVE)).sqrt()
                };
                model.bodies[body].materials.iter().map(speed).fold(0.0, f64::max)
            };
            contact.bodies.iter().map(of_body).fold(0.0, f64::max)
        };
        let watches = matches!(scheme, Scheme::Newmark { .. });
        let speeds = if watches { model.contacts.iter().map(speed).collect() } else { Vec::new() };
        let limit = case.guard.energy.map(|energy| energy.value);
        let motion = MotionWatch::new(case.guard.motion.map(|motion| motion.value));
        let unexplained = Unexplained::default();
        let may_conserve = model.may_conserve();
        let gain_reported = false;
        Self { limit, scale: 0.0, calm: *start, speeds, unexplained, gain_reported, may_conserve, motion }
            .with(start)
    }

    fn with(mut self, energies: &Energies) -> Self {
        self.grow(energies);
        self
    }

    fn grow(&mut self, e: &Energies) {
        let stored = [e.kinetic, e.strain, e.contact, e.springs, e.total()];
        let sizes = stored.into_iter().chain([e.friction_dissipated, e.external_work]);
        self.scale = sizes.fold(self.scale, |scale, size| scale.max(size.abs()));
    }

    /// Warns once of an impact in the step in `stage`. Call it before the step is accepted.
    /// Collective.
    pub fn impact<const D: usize>(&mut self, system: &ContactSystem<D>, stage: &Stage) -> Option<String> {
        if self.speeds.is_empty() {
            return None;
        }
        let closings = closings(system, stage);
        let sudden = |(closing, speed): (&ClosingContact, &f64)| {
            let many = closing.before == 0 || closing.now as f64 >= MANY * closing.points as f64;
            closing.now > 0 && many && closing.speed > SUDDEN * speed
        };
        let (closing, _) = closings.iter().zip(&self.speeds).find(|pair| sudden(*pair))?;
        let spared = !system.bodies().redistributed()[0].is_empty();
        let cure = match (self.may_conserve, spared) {
            (false, _) => "use a shorter step, and",
            (true, true) => "use `scheme: conserving`, or",
            (true, false) => {
                "use `scheme: conserving`, with `mass: redistributed` for the bodies in contact, and"
            }
        };
        let text = format!(
            "warning: impact at t = {:.4e} {}: contact '{}' closed at {:.2e} {}; this scheme may gain or \
             lose energy in an impact\n\
             hint: {cure} monitor `numerical` in energy.csv",
            stage.trial.time,
            system.units().of("s"),
            closing.contact,
            closing.speed,
            system.units().of("m/s")
        );
        self.speeds.clear();
        Some(text)
    }

    /// Evaluates the ledger at the end of the accepted step `step` of `scheme` in `stage`. Returns a
    /// warning, once, if much energy has been gained and no limit is given. Collective.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn record<const D: usize>(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        step: u64,
        scheme: Scheme,
        ledger: &EnergyLedger,
    ) -> Result<Option<String>> {
        let energies = ledger.now();
        self.grow(energies);
        let rounding = match self.unexplained.left(energies).abs() > NOTABLE * self.scale {
            true => system.rounding(stage)? * stage.trial.u.norm()?,
            false => 0.0,
        };
        let known = KnownError { rounding, work: ledger.work_error() };
        self.unexplained.record(step, stage.trial.time, stage.dt, energies, known);
        if self.gain_reported || self.limit.is_some() {
            return Ok(None);
        }
        let gain = self.unexplained.gain(scheme, self.may_conserve, self.scale, system.units());
        self.gain_reported = gain.is_some();
        Ok(gain)
    }

    /// Warnings at the end of a run by `scheme`, with or without contact.
    pub fn warnings(&self, scheme: Scheme, contact: bool, units: Units) -> Vec<String> {
        let unexplained = self.unexplained.warning(scheme, contact, self.may_conserve, self.scale, units);
        unexplained.into_iter().chain(self.motion.warning(units)).collect()
    }

    /// Checks that the energies of an accepted step are explained.
    ///
    /// # Errors
    /// The unexplained energy exceeds the limit; the error is the same on all ranks.
    pub fn energy(&mut self, ledger: &EnergyLedger, time: f64, units: Units) -> Result<()> {
        self.judge(ledger.now(), ledger.work_error(), time, units)
    }

    /// Checks that these energies are explained when the work may be off by `work_error` \[J\].
    fn judge(&mut self, energies: &Energies, work_error: f64, time: f64, units: Units) -> Result<()> {
        self.grow(energies);
        let Some(limit) = self.limit else { return Ok(()) };
        let excess = (energies.numerical.abs() - work_error).max(0.0);
        let unexplained = excess / self.scale.max(f64::MIN_POSITIVE);
        if unexplained <= 0.5 * limit {
            self.calm = *energies;
        }
        if unexplained <= limit {
            return Ok(());
        }
        let made = energies.numerical < 0.0;
        let (term, change) = culprit(&self.calm, energies, made);
        let (verb, moved) = if made { ("gained", "grew") } else { ("lost", "fell") };
        let (s, joule) = (units.of("s"), units.of("J"));
        let message = format!(
            "t = {time:.6e} {s}: unexplained energy of {:.4e} {joule} was {verb}, {:.2} % of the largest \
             energy so far ({:.2} % allowed); meanwhile the {term} {moved} by {:.4e} {joule}",
            excess,
            100.0 * unexplained,
            100.0 * limit,
            change.abs()
        );
        let scheme = if self.may_conserve { "`scheme: conserving`, " } else { "" };
        Err(Error::guard(message).hint(&format!(
            "results up to this time are kept; use a smaller step, {scheme}or a larger guard: {{ energy: ... }}"
        )))
    }
}

/// The term of the ledger that changed most in the direction of the unexplained energy, and its
/// change \[J\].
fn culprit(before: &Energies, now: &Energies, made: bool) -> (&'static str, f64) {
    let changes = [
        ("kinetic energy", now.kinetic - before.kinetic),
        ("strain energy", now.strain - before.strain),
        ("contact energy", now.contact - before.contact),
        ("energy of springs", now.springs - before.springs),
        ("frictional heat", now.friction_dissipated - before.friction_dissipated),
        ("heat of damping", now.damping_dissipated - before.damping_dissipated),
        ("work of loads and supports", before.external_work - now.external_work),
    ];
    let sign = if made { 1.0 } else { -1.0 };
    changes.into_iter().max_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).unwrap_or(("", 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn energies(kinetic: f64, strain: f64, numerical: f64) -> Energies {
        Energies { kinetic, strain, numerical, ..Energies::default() }
    }

    fn guard(limit: f64) -> RunGuard {
        let unexplained = Unexplained::default();
        let motion = MotionWatch::new(None);
        let calm = energies(100.0, 0.0, 0.0);
        RunGuard {
            limit: Some(limit),
            scale: 0.0,
            calm,
            speeds: Vec::new(),
            unexplained,
            gain_reported: false,
            may_conserve: true,
            motion,
        }
        .with(&calm)
    }

    /// Energy that is gained or lost without a cause ends the run and names the term responsible.
    /// Explained changes do not end the run, nor does any change without a limit.
    #[test]
    fn unexplained_energy_ends_a_run() {
        let mut gains = guard(0.05);
        assert!(gains.judge(&energies(60.0, 42.0, -2.0), 0.0, 0.1, Units::SI).is_ok());
        assert!(gains.judge(&energies(50.0, 54.0, -4.0), 0.0, 0.2, Units::SI).is_ok());
        let error = gains.judge(&energies(48.0, 58.0, -6.0), 0.0, 0.3, Units::SI).unwrap_err();
        assert_eq!(error.exit_code(), 6);
        assert!(
            error.message.contains("strain energy grew by 1.6") && error.message.contains("gained"),
            "{error}"
        );
        let mut loses = guard(0.05);
        let error = loses.judge(&energies(90.0, 4.0, 6.0), 0.0, 0.1, Units::SI).unwrap_err();
        assert!(
            error.message.contains("kinetic energy fell by 1.0") && error.message.contains("lost"),
            "{error}"
        );
        assert!(
            RunGuard { limit: None, ..guard(1.0) }
                .judge(&energies(1e9, 0.0, -1e9), 0.0, 0.1, Units::SI)
                .is_ok()
        );
    }

    /// The limit is relative to the largest energy so far, not to what is left.
    #[test]
    fn scale_is_the_largest_so_far() {
        let mut guard = guard(0.05);
        assert!(guard.judge(&energies(0.5, 0.1, 4.9), 0.0, 0.1, Units::SI).is_ok());
        assert!(guard.judge(&energies(0.5, 0.1, 5.1), 0.0, 0.2, Units::SI).is_err());
    }
}
