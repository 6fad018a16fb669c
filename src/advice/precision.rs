//! Precision of positions. Coordinates are rounded, and element sizes and contact depths are
//! differences of coordinates.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::{Equations, Stage};
use crate::error::{Error, Result};
use crate::output::record::PenetrationRecord;

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

/// Lengths with which coordinates are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Precision {
    /// Largest coordinate, or largest displacement if [`moved`](Self::moved) \[m\].
    pub farthest: f64,
    /// Whether bodies have moved to the largest coordinate. Otherwise they start there.
    pub moved: bool,
    /// Distance between adjacent floating-point numbers at `farthest` \[m\].
    pub spacing: f64,
    /// Shortest distance between two corners of an element \[m\].
    pub edge: f64,
    /// Name of each contact, and its depth at a high pressure (a tenth of the softer modulus)
    /// \[m\].
    pub depths: Vec<(String, f64)>,
    /// Unit of these lengths.
    pub unit: String,
}

impl Precision {
    /// Precision of the positions of this system. Collective.
    pub fn of<const D: usize>(system: &ContactSystem<D>) -> Self {
        let mesh = &system.bodies().local().mesh;
        let edge = |element: usize| {
            let corners = &mesh.element_nodes(element)[..mesh.kinds[element].corners()];
            let pairs =
                corners.iter().enumerate().flat_map(|(k, a)| corners[k + 1..].iter().map(move |b| (a, b)));
            let square = |(a, b): (&u32, &u32)| -> f64 {
                let [a, b] = [a, b].map(|&node| mesh.points[node as usize]);
                (0..D).map(|k| (a[k] - b[k]).powi(2)).sum()
            };
            pairs.map(square).fold(f64::INFINITY, f64::min)
        };
        let own = (0..mesh.element_count()).map(edge).fold(f64::INFINITY, f64::min);
        let mut shortest = 0.0_f64;
        system.session().world().reduce_all(&own, &mut shortest, SystemOperation::min());
        let depth = |contact: &LocalContact<D>| {
            let modulus = contact.beneath * contact.facet_size;
            (contact.name.clone(), contact.law().normal.penetration(0.1 * modulus))
        };
        Self {
            farthest: system.extent(),
            moved: false,
            spacing: f64::EPSILON * system.extent(),
            edge: shortest.sqrt(),
            depths: system.contacts().iter().map(depth).collect(),
            unit: system.units().of("m"),
        }
    }

    /// Returns the precision of bodies that have moved as far as `farthest` \[m\], if that is
    /// farther than before.
    #[must_use]
    pub fn at(&self, farthest: f64) -> Self {
        if farthest <= self.farthest {
            return self.clone();
        }
        Self { farthest, moved: true, spacing: f64::EPSILON * farthest, ..self.clone() }
    }
}

/// Displacements that [`farthest_motion`] covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motions {
    /// All displacements.
    All,
    /// Prescribed displacements.
    Prescribed,
}

/// Largest component of a displacement, or of a displaced position, at the trial state \[m\].
/// Collective.
///
/// Strains are differences of displacements, gaps are differences of positions.
pub fn farthest_motion<const D: usize>(system: &ContactSystem<D>, stage: &Stage, motions: Motions) -> f64 {
    let u = stage.trial.u.owned();
    let places = system.bodies().local().mesh.points.as_flattened();
    let held = system.bodies().held();
    let is_held = |dof: usize| held.axes()[dof] || held.inclination(dof / D).is_some();
    let wanted = u.iter().zip(places).enumerate();
    let own = wanted
        .filter(|(dof, _)| motions == Motions::All || is_held(*dof))
        .map(|(_, (u, x))| u.abs().max((x + u).abs()))
        .fold(0.0, f64::max);
    let mut most = 0.0_f64;
    system.session().world().reduce_all(&own, &mut most, SystemOperation::max());
    most
}

/// Hint for coordinates that are too large.
const NEARER: &str = "move all bodies and obstacles closer to the origin: coordinates are stored with \
                      sixteen digits";

/// Hint for displacements that are too large.
const CLOSER: &str = "prescribe smaller motions, or end the run earlier: displacements are stored with \
                      sixteen digits";

/// Describes the precision of coordinates or displacements, with a hint.
fn described(precision: &Precision) -> (String, &'static str) {
    let Precision { farthest, moved, spacing, unit, .. } = precision;
    let (what, cure) = if *moved { ("displacements", CLOSER) } else { ("coordinates", NEARER) };
    (format!("{what} of {farthest:.1e} {unit} are known only to {spacing:.1e} {unit}"), cure)
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
    pub fn new(start: Precision) -> Self {
        let warned = if remark(&start).is_some() { start.spacing } else { 0.0 };
        Self { start, warned }
    }

    /// Spacing at the last warning \[m\].
    pub fn warned(&self) -> f64 {
        self.warned
    }

    /// Resumes after a warning at this spacing \[m\].
    pub fn resume(&mut self, warned: f64) {
        self.warned = warned;
    }

    /// A warning for a step in which bodies have moved as far as `farthest` \[m\]. It is repeated
    /// when the spacing has grown tenfold.
    ///
    /// # Errors
    /// Rounding is no longer small compared with the elements or the penetration of a contact; the
    /// error is the same on all ranks.
    pub fn accept(&mut self, farthest: f64, place: &str) -> Result<Option<String>> {
        let now = self.start.at(farthest);
        if !now.moved {
            return Ok(None);
        }
        require(&now).map_err(|error| error.within(place))?;
        if now.spacing < 10.0 * self.warned {
            return Ok(None);
        }
        let remark = remark(&now);
        self.warned = if remark.is_some() { now.spacing } else { self.warned };
        Ok(remark.map(|remark| format!("{place}: {remark}")))
    }

    /// The precision when bodies have moved as far as `farthest` \[m\].
    pub fn at(&self, farthest: f64) -> Precision {
        self.start.at(farthest)
    }
}

/// Checks that elements and penetrations are larger than the rounding of coordinates.
///
/// # Errors
/// They are not; the error is the same on all ranks.
pub fn require(precision: &Precision) -> Result<()> {
    let Precision { spacing, edge, depths, unit, .. } = precision;
    let (words, cure) = described(precision);
    if *spacing > COARSE[1] * edge {
        let message = format!("{words}, but the shortest element edge is {edge:.1e} {unit}");
        return Err(Error::case(message).hint(cure));
    }
    match depths.iter().find(|(_, depth)| *spacing > SHALLOW[1] * depth) {
        Some((name, depth)) => {
            let message =
                format!("{words}, but contact '{name}' penetrates by {depth:.1e} {unit} at a high pressure");
            Err(Error::case(message).hint(&format!("{cure}, or use a larger compliance")))
        }
        None => Ok(()),
    }
}

/// A remark if the rounding of coordinates reduces the number of correct digits in the results.
pub fn remark(precision: &Precision) -> Option<String> {
    let Precision { spacing, edge, depths, unit, .. } = precision;
    let (words, cure) = described(precision);
    let least = depths.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let shallow = least.filter(|(_, depth)| *spacing > SHALLOW[0] * depth);
    match shallow {
        Some((name, depth)) => Some(format!(
            "{words}, but contact '{name}' penetrates by {depth:.1e} {unit} at a high pressure: forces may \
             balance only to {:.0e}; {cure}",
            (spacing / depth).min(1.0)
        )),
        None if *spacing > COARSE[0] * edge => Some(format!(
            "{words}, but the shortest element edge is {edge:.1e} {unit}: strains are known only to {:.0e}; \
             {cure}",
            spacing / edge
        )),
        None => None,
    }
}

/// A warning for each contact whose penetration stayed so small that the rounding of coordinates or
/// displacements affects its forces.
pub fn blurred(contacts: &[PenetrationRecord], precision: &Precision) -> Vec<String> {
    let Precision { spacing, unit, .. } = precision;
    let (_, cure) = described(precision);
    let what = if precision.moved { "displacements" } else { "coordinates" };
    let shallow = |contact: &&PenetrationRecord| contact.force > 0.0 && contact.deepest > 0.0;
    let blurred = contacts.iter().filter(shallow).filter(|contact| *spacing > BLURRED * contact.deepest);
    let words = |contact: &PenetrationRecord| {
        format!(
            "warning: contact '{}' penetrated by {:.1e} {unit}, but {what} are known only to {spacing:.1e} \
             {unit}: its forces are known only to {:.0} %\n\
             hint: {cure}",
            contact.contact,
            contact.deepest,
            (100.0 * spacing / contact.deepest).clamp(1.0, 100.0)
        )
    };
    blurred.map(words).collect()
}
