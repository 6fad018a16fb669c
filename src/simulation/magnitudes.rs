//! Detects implausible magnitudes. Their usual cause is a wrong unit, such as `mPa` for `MPa`.

use std::ops::RangeInclusive;

use crate::assembly::{ContactSystem, Precision};
use crate::element::LOCKS;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::output::record::PenetrationRecord;

/// Plausible speeds of pressure waves \[m/s\], from the softest gels to beyond diamond.
const WAVE_SPEEDS: RangeInclusive<f64> = 0.1..=3e4;

/// Plausible ratios of contact stiffness to the stiffness of the elements beneath, from cushions to
/// what rounding still resolves.
const STIFFNESSES: RangeInclusive<f64> = 1e-4..=1e6;

/// Ratios of the spacing of coordinates to the shortest element edge. Above the first, strains lose
/// their sixth digit. Above the second, element shapes are lost.
const COARSE: [f64; 2] = [1e-6, 1e-3];
/// Ratios of the spacing of coordinates to the penetration at a high pressure. Above the first,
/// forces may lose their third digit. Above the second, no digit is left. Penetrations in a run are
/// often a thousandth of the one at a high pressure.
const SHALLOW: [f64; 2] = [1e-6, 1e-2];
/// Ratio of the spacing of coordinates to the largest penetration in a run, above which forces are
/// wrong by a thousandth.
const BLURRED: f64 = 1e-3;

/// Hint for coordinates that are too large.
const NEARER: &str = "move all bodies and obstacles nearer to the origin: coordinates have sixteen digits";

/// Hint for displacements that are too large.
const CLOSER: &str = "prescribe smaller motions, or end the run earlier: displacements have sixteen digits";

/// Describes the precision of coordinates or displacements, with a hint.
fn known(precision: &Precision) -> (String, &'static str) {
    let Precision { farthest, moved, spacing, unit, .. } = precision;
    let (what, cure) = if *moved { ("displacements", CLOSER) } else { ("coordinates", NEARER) };
    (format!("{what} of {farthest:.1e} {unit} are known to {spacing:.1e} {unit} only"), cure)
}

/// In every accepted step, compares the rounding of displacements with element sizes and
/// penetrations.
pub struct MotionPrecision {
    start: Precision,
    /// Spacing at the last warning \[m\].
    warned: f64,
}

impl MotionPrecision {
    /// A monitor that starts with the precision of the start, which was already reported.
    pub(super) fn new(start: Precision) -> Self {
        let warned = if precision(&start).is_some() { start.spacing } else { 0.0 };
        Self { start, warned }
    }

    /// Spacing at the last warning \[m\].
    pub(super) fn warned(&self) -> f64 {
        self.warned
    }

    /// Resumes after a warning at this spacing \[m\].
    pub(super) fn resume(&mut self, warned: f64) {
        self.warned = warned;
    }

    /// A warning for a step in which bodies have moved as far as `farthest` \[m\]. It is repeated
    /// when the spacing has grown tenfold.
    ///
    /// # Errors
    /// Rounding is no longer small compared with the elements or the penetration of a contact; the
    /// error is the same on all ranks.
    pub(super) fn accept(&mut self, farthest: f64, place: &str) -> Result<Option<String>> {
        let now = self.start.at(farthest);
        if !now.moved {
            return Ok(None);
        }
        require_precision(&now).map_err(|error| error.within(place))?;
        if now.spacing < 10.0 * self.warned {
            return Ok(None);
        }
        let remark = precision(&now);
        self.warned = if remark.is_some() { now.spacing } else { self.warned };
        Ok(remark.map(|remark| format!("{place}: {remark}")))
    }

    /// The precision when bodies have moved as far as `farthest` \[m\].
    pub(super) fn at(&self, farthest: f64) -> Precision {
        self.start.at(farthest)
    }
}

/// Checks that elements and penetrations are larger than the rounding of coordinates.
///
/// # Errors
/// They are not; the error is the same on all ranks.
pub(super) fn require_precision(precision: &Precision) -> Result<()> {
    let Precision { spacing, edge, depths, unit, .. } = precision;
    let (words, cure) = known(precision);
    if *spacing > COARSE[1] * edge {
        let message = format!("{words}, and the shortest edge of an element has {edge:.1e} {unit}");
        return Err(Error::case(message).hint(cure));
    }
    match depths.iter().find(|(_, depth)| *spacing > SHALLOW[1] * depth) {
        Some((name, depth)) => {
            let message =
                format!("{words}, and contact '{name}' is {depth:.1e} {unit} deep at a high pressure");
            Err(Error::case(message).hint(&format!("{cure}, or give a larger compliance")))
        }
        None => Ok(()),
    }
}

/// A remark if the rounding of coordinates reduces the number of correct digits in the results.
pub(super) fn precision(precision: &Precision) -> Option<String> {
    let Precision { spacing, edge, depths, unit, .. } = precision;
    let (words, cure) = known(precision);
    let least = depths.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let shallow = least.filter(|(_, depth)| *spacing > SHALLOW[0] * depth);
    match shallow {
        Some((name, depth)) => Some(format!(
            "{words}, and contact '{name}' is {depth:.1e} {unit} deep at a high pressure: forces may balance to {:.0e} only; {cure}",
            (spacing / depth).min(1.0)
        )),
        None if *spacing > COARSE[0] * edge => Some(format!(
            "{words}, and the shortest edge of an element has {edge:.1e} {unit}: strains are known to {:.0e} only; {cure}",
            spacing / edge
        )),
        None => None,
    }
}

/// A warning for each contact whose penetration stayed so small that the rounding of coordinates or
/// displacements affects its forces.
pub(super) fn blurred(contacts: &[PenetrationRecord], precision: &Precision) -> Vec<String> {
    let Precision { spacing, unit, .. } = precision;
    let (_, cure) = known(precision);
    let what = if precision.moved { "displacements" } else { "coordinates" };
    let shallow = |contact: &&PenetrationRecord| contact.force > 0.0 && contact.deepest > 0.0;
    let blurred = contacts.iter().filter(shallow).filter(|contact| *spacing > BLURRED * contact.deepest);
    let words = |contact: &PenetrationRecord| {
        format!(
            "warning: contact '{}' went {:.1e} {unit} deep, and {what} are known to {spacing:.1e} {unit} only: its forces are known to \
             {:.0} %\nhint: {cure}",
            contact.contact,
            contact.deepest,
            (100.0 * spacing / contact.deepest).clamp(1.0, 100.0)
        )
    };
    blurred.map(words).collect()
}

/// A remark for each body whose elements lock and have no formulation that avoids it. Collective.
pub(super) fn locking<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let locked = system.locked_bodies(model).into_iter().map(|(name, kinds)| {
        let kinds: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        let better = if D == 2 { "quad4, quad8, quad9 or tri6" } else { "hex8, hex20, hex27 or tet10" };
        format!(
            "'{name}' locks: {} elements have no cure and are too stiff at a Poisson's ratio of {LOCKS} or more: mesh it with {better}",
            kinds.join(" and ")
        )
    });
    locked.collect()
}

/// Hint for numbers that are consistent in mm, t and s.
const TONNES: &str = " A case in mm, t, s says `units: { length: mm, mass: t, time: s }`";

/// A remark for each implausible number.
pub(super) fn remarks<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let is_dynamic = system.is_dynamic();
    let heavy = model.bodies.iter().filter(|body| is_dynamic && body.formulation.density > 0.0);
    let waves = heavy.filter_map(|body| {
        let formulation = &body.formulation;
        let speed = (formulation.moduli().uniaxial_strain() / formulation.density).sqrt();
        let in_si = speed * model.units.si_value("m/s");
        let name = &body.name;
        (!WAVE_SPEEDS.contains(&in_si)).then(|| {
            let unit = model.units.of("m/s");
            let in_mm = model.units.is_si() && WAVE_SPEEDS.contains(&(1e-3 * speed));
            let cure = if in_mm { TONNES } else { "" };
            format!(
                "pressure waves run through '{name}' at {speed:.1e} {unit}: are the units of its moduli and its density right?{cure}"
            )
        })
    });
    let far_off = system.relative_stiffnesses().filter(|(_, ratio)| !STIFFNESSES.contains(ratio));
    let contacts = far_off.map(|(name, ratio)| {
        format!(
            "contact '{name}' is {ratio:.1e} times as stiff as the elements beneath it: are the units of its normal law and of \
             the moduli right?"
        )
    });
    waves.chain(contacts).collect()
}
