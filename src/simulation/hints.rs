//! Hints for the user when a run ends early.

use nalgebra::DVector;

use super::options;
use crate::advice::lifting::{contact_resists, loads_along};
use crate::assembly::ContactSystem;
use crate::case::{self, Case};
use crate::dynamics::{Equations, FloatingBodies, MovingPart, RigidMotion, Stage};
use crate::error::{Cause, Error, Result};
use crate::observe::unbalanced_place;
use crate::schemes::{Newmark, Scheme};
use crate::solvers::{Driven, SolveReport, Trouble, describe};

/// Hint for values that are too large or not finite.
pub(super) const TOO_LARGE: &str =
    "computed values are far too large: check the units of moduli, density, penalty and stick velocity";

/// Adds a hint to `error`, which ended the last step. Resets the trial state to the start of the
/// step. Collective.
///
/// # Errors
/// PETSc reports an error.
pub(super) fn with_hint<const D: usize>(
    error: Error,
    report: &SolveReport,
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    case: &Case,
) -> Result<Error> {
    let unbalanced = error.cause != Cause::Guard && report.trouble == Trouble::Balance;
    if unbalanced
        && !system.bodies().is_dynamic()
        && let Some(hinge) = hinge(system, stage)?
    {
        let held = match case.contact.is_empty() {
            true => "",
            false => "; if a contact holds it, try more load steps",
        };
        return Ok(error.hint(&format!("{hinge}{held}")));
    }
    if unbalanced
        && !system.bodies().is_dynamic()
        && let Some(lifted) = lifted(system, stage)?
    {
        return Ok(error.hint(&lifted));
    }
    Ok(with_hint_on_supports(error, report, system, case))
}

/// Adds the node with the largest unbalanced force to the `reason` why a solve failed, which is at the
/// trial state of `stage`. A motion along which a force acts, or that is held, has no such node.
/// Collective.
///
/// # Errors
/// PETSc reports an error.
pub(super) fn with_place<const D: usize>(
    reason: String,
    report: &SolveReport,
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
) -> Result<String> {
    let is_held = report.held.motions > 0 || system.continuation().free_resistance > 0.0;
    if report.driven || is_held {
        return Ok(reason);
    }
    Ok(match unbalanced_place(system, stage)? {
        Some(place) => format!("{reason}; {place}"),
        None => reason,
    })
}

/// Describes a body that the loads of the step lift off the contacts that held it, with a hint.
/// Returns `None` if contacts resist the loads. Sets the trial state to the start of the step, at
/// the time of its end. Collective.
///
/// # Errors
/// PETSc reports an error.
pub(super) fn lifted<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
) -> Result<Option<String>> {
    /// Fraction of all loads below which they do not drive a motion. It is well above rounding.
    const IDLE: f64 = 1e-9;
    if system.bodies().holding().is_complete() || system.contacts().is_empty() {
        return Ok(None);
    }
    stage.trial.u.copy_from(&stage.start.u)?;
    stage.trial.u.update_ghosts()?;
    let mut residual = system.pattern_vector().like()?;
    system.residual(stage, &mut residual)?;
    let rigid = system.rigid_motions(stage)?;
    let (loads, all) = loads_along(system, &rigid);
    let mut groups: Vec<usize> = rigid.iter().map(|motion| motion.group).collect();
    groups.dedup();
    for group in groups {
        let own =
            rigid.iter().zip(&loads).map(|(motion, load)| if motion.group == group { *load } else { 0.0 });
        let loads = DVector::from_iterator(rigid.len(), own);
        let size = loads.norm();
        if !size.is_finite() || size <= IDLE * all {
            continue;
        }
        let way = &loads / size;
        residual.set(0.0);
        rigid.iter().zip(way.iter()).try_for_each(|(motion, part)| residual.axpy(*part, &motion.field))?;
        if !contact_resists(system, &residual, &stage.trial.u) {
            let Driven { words, force, unit } = describe(&rigid, &way, &loads, system.units());
            return Ok(Some(format!(
                "contact can only push: once it opens, nothing resists {words}, which the loads drive with \
                 {force:.3e} {unit}; let the body touch at the start, support it there, or change the loads"
            )));
        }
    }
    Ok(None)
}

/// Describes a piece that is hinged to the rest of its body, with a hint. Returns `None` if there
/// is no such piece. Sets the trial state to the start of the step, at the time of its end.
/// Collective.
///
/// # Errors
/// PETSc reports an error.
pub(super) fn hinge<const D: usize>(system: &ContactSystem<D>, stage: &mut Stage) -> Result<Option<String>> {
    let time = stage.trial.time;
    stage.trial.copy_from(&stage.start)?;
    stage.trial.time = time;
    let name = system.rigid_motions(stage)?.iter().find_map(turning_piece).map(str::to_owned);
    Ok(name.map(|name| {
        format!(
            "{name} is joined to the rest of its body at single nodes only, and can rotate about them \
             without resistance: connect its elements to the others by common sides, or support it"
        )
    }))
}

/// The piece with the largest rotation. Returns `None` if all pieces of the motion rotate equally.
fn turning_piece(motion: &RigidMotion) -> Option<&str> {
    /// Fraction of the largest rotation below which two rotations are equal. It is well above
    /// rounding.
    const SAME: f64 = 1e-6;
    let turn = |spin: &[f64; 3]| spin.iter().map(|s| s * s).sum::<f64>().sqrt();
    let by_turn = |a: &&MovingPart, b: &&MovingPart| turn(&a.spin).total_cmp(&turn(&b.spin));
    let most = motion.parts.iter().max_by(by_turn)?;
    let least = motion.parts.iter().min_by(by_turn)?;
    let apart = turn(&std::array::from_fn(|i| most.spin[i] - least.spin[i]));
    (apart > SAME * turn(&most.spin)).then_some(&most.name)
}

fn with_hint_on_supports<const D: usize>(
    error: Error,
    report: &SolveReport,
    system: &ContactSystem<D>,
    case: &Case,
) -> Error {
    if let (false, Some((name, _))) =
        (system.bodies().is_dynamic(), system.bodies().holding().hinged_bodies().first())
    {
        return error.hint(&format!(
            "{name} can move without strain, and no support or contact resists this motion: support it, or \
             remove the loads that drive it"
        ));
    }
    let free = system.bodies().holding().free_bodies();
    if report.driven && !free.is_empty() {
        return error.hint(&format!(
            "no support holds {}: its loads must balance along every free direction, or friction must hold it",
            free.join("; ")
        ));
    }
    let cure = cure(error.cause, report.trouble, case);
    error.hint(&format!("results up to this time are kept; {cure}"))
}

/// The hint for `trouble`. No two kinds of trouble have contradicting hints.
fn cure(cause: Cause, trouble: Trouble, case: &Case) -> String {
    let shorter = if case.is_static() { "more load steps" } else { "a shorter step" };
    let augmented = asks_for_penetration(case);
    let complete = if options::has_symmetric_stages(case) { COMPLETE_STAGES } else { "" };
    match trouble {
        _ if cause == Cause::Guard => format!(
            "try {complete}{shorter}; where elements are crushed, reduce the load or use a coarser mesh"
        ),
        Trouble::Numbers => TOO_LARGE.to_owned(),
        Trouble::Motion => format!("try {shorter}, or a larger `time.cuts`"),
        Trouble::Multipliers => format!(
            "allow more there, give that contact a larger stick_stiffness or a smaller compliance, or try \
             {shorter}"
        ),
        Trouble::Sweeps => format!(
            "try strategy: monolithic, which does not depend on the coefficient of friction, or {shorter}"
        ),
        Trouble::Linear => format!("try `linear: direct`, or {shorter}"),
        Trouble::Balance => {
            let softer = if augmented || case.contact.is_empty() { "" } else { ", a softer penalty" };
            let damped = if swings(case) { " or a dissipative scheme such as generalized_alpha" } else { "" };
            let more = if softer.is_empty() && damped.is_empty() { " or a larger `time.cuts`" } else { "" };
            let limit = if is_loaded(case) { BEYOND_A_LIMIT_LOAD } else { "" };
            format!("try {complete}{shorter}{softer}{damped}{more}{limit}")
        }
    }
}

/// Hint for stages whose symmetric matrix is not the derivative of their balance.
const COMPLETE_STAGES: &str = "`matrix: complete` in `staggered`, ";

/// Hint for a load beyond what a body can carry: there is no equilibrium nearby, whatever the step
/// length.
const BEYOND_A_LIMIT_LOAD: &str = "; if the body buckles or snaps through under its load, prescribe a \
                                   displacement instead of the load, or use a dynamic scheme";

/// Whether forces are prescribed in statics.
fn is_loaded(case: &Case) -> bool {
    let loads = |boundary: &case::Boundary| {
        boundary.traction.is_some() || boundary.pressure.is_some() || boundary.gravity.is_some()
    };
    case.is_static() && case.boundary.values().any(loads)
}

/// Whether the penetration tolerance is enforced by multipliers or by increasing the penalty. The
/// penalty of the case is then only the initial value.
fn asks_for_penetration(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.penetration.is_some())
}

/// Whether the scheme does not damp oscillations on the contact stiffness.
fn swings(case: &Case) -> bool {
    let undamped = match case.time.scheme.value {
        Scheme::Newmark(Newmark { gamma, .. }) => gamma.value <= 0.5,
        Scheme::Midpoint(_) => true,
        _ => false,
    };
    undamped && !case.contact.is_empty() && options::scheme(&case.time).has_inertia()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TROUBLES: [Trouble; 6] = [
        Trouble::Balance,
        Trouble::Multipliers,
        Trouble::Sweeps,
        Trouble::Linear,
        Trouble::Motion,
        Trouble::Numbers,
    ];

    /// All hints that a case can get.
    fn hints(text: &str) -> Vec<String> {
        let case = Case::parse(text, "case.yml").expect("a case");
        let causes = [Cause::NotConverged, Cause::Guard];
        causes.into_iter().flat_map(|cause| TROUBLES.map(|trouble| cure(cause, trouble, &case))).collect()
    }

    /// No case gets one hint for a softer and another for a stiffer penalty. With a penetration
    /// tolerance, neither is suggested.
    #[test]
    fn hints_do_not_contradict_each_other() {
        let plain = include_str!("../../meshes/ironing/case.yml");
        let augmented = format!("{plain}accuracy: {{ penetration: 1e-4 }}\n");
        for (text, softer) in [(plain, true), (augmented.as_str(), false)] {
            let hints = hints(text);
            assert!(!hints.iter().any(|hint| hint.contains("stiffer")), "{hints:?}");
            assert_eq!(hints.iter().any(|hint| hint.contains("softer")), softer, "{hints:?}");
        }
    }

    /// In statics the hint mentions limit loads; in dynamics it does not. Without contact it does
    /// not mention the penalty.
    #[test]
    fn a_limit_load_is_named_where_there_is_a_load() {
        let limit = |text: &str| hints(text).iter().any(|hint| hint.contains("snaps through"));
        assert!(limit(include_str!("../../meshes/hertz/case.yml")));
        assert!(!limit(include_str!("../../meshes/ironing/case.yml")));
        assert!(!limit(include_str!("../../meshes/rubber-block/case.yml")));
        let hertz = include_str!("../../meshes/hertz/case.yml");
        let (before, contact) = hertz.split_once("contact:").expect("a contact");
        let (_, after) = contact.split_once("boundary:").expect("a boundary");
        assert!(!hints(&format!("{before}boundary:{after}")).iter().any(|hint| hint.contains("softer")));
    }

    /// A damping scheme is not suggested in statics, nor when the scheme already damps.
    #[test]
    fn a_scheme_that_damps_is_for_motion_without_damping() {
        let statics = include_str!("../../meshes/ironing/case.yml");
        assert!(
            !hints(statics)
                .iter()
                .any(|hint| hint.contains("generalized_alpha") || hint.contains("a shorter step"))
        );
        let newmark = include_str!("../../meshes/rubber-block/case.yml");
        assert!(hints(newmark).iter().any(|hint| hint.contains("generalized_alpha")));
        let scheme = "newmark: { beta: 0.25, gamma: 0.5 }";
        let damps = newmark.replace(scheme, "generalized_alpha: { spectral_radius: 0.8 }");
        assert!(damps != newmark && !hints(&damps).iter().any(|hint| hint.contains("generalized_alpha")));
    }
}
