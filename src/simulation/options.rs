//! Translates the time and solver sections of the case into settings.

use crate::assembly::ContactSystem;
use crate::case::{self, Case};
use crate::dynamics::{Equations, KnownFriction};
use crate::error::Result;
use crate::partition::LocalMesh;
use crate::petsc::{Format, Session};
use crate::presets::{Linear, TwoStage};
use crate::solvers::{
    Augmented, LinearChoice, LinearSolver, Monolithic, NewtonSettings, Problem, StageMatrix, Staggered,
    StaggeredSettings, Strategy, TwoStageSettings, ladder, storage,
};
use crate::terms::Terms;
use crate::time::Scheme;

/// Number of unknowns from which on early Newton iterations use loose linear tolerances, unless the
/// case decides.
const LARGE: usize = 20_000;
/// Small problems use linear tolerances that are tighter by this factor, so that no iterate is
/// limited by a linear solve.
const FIRM: f64 = 0.1;
/// Loosest tolerance of a linear solve in the inexact Newton method.
const LOOSEST: f64 = 1e-4;

/// Smallest tolerance of Newton's method that the program chooses. Below it, rounding may decide.
const TIGHTEST: f64 = 1e-9;

/// Loosest tolerance of Newton's method that the program chooses, whatever `accuracy` is requested.
const LOOSEST_NEWTON: f64 = 1e-3;

/// The time integration scheme.
pub fn scheme(time: &case::Time) -> Scheme {
    time.scheme.method()
}

/// The linear solver of the case. The stages of a staggered step use one for symmetric matrices.
pub fn linear(case: &Case) -> LinearChoice {
    let asked = case.solver.linear.value;
    let Some(preset) = asked.preset() else { return LinearChoice::Auto };
    match asked {
        Linear::TwoStage(TwoStage { second, inner }) => {
            let inner = inner.linear().and_then(Linear::preset).map(|preset| preset.name);
            LinearChoice::TwoStage(TwoStageSettings { second, inner })
        }
        Linear::Direct if has_symmetric_stages(case) => LinearChoice::Named("cholesky"),
        _ => LinearChoice::Named(preset.name),
    }
}

fn has_friction(case: &Case) -> bool {
    case.contact.values().any(|contact| contact.friction.rubs())
}

/// The settings of the staggered strategy; `None` for the monolithic one, and if there is no
/// friction.
pub fn staggered(case: &Case) -> Option<StaggeredSettings> {
    match &case.solver.strategy.value {
        case::Strategy::Staggered { tolerance, max_sweeps, variant, matrix } if has_friction(case) => {
            let known = match variant {
                case::Variant::FrozenBound => KnownFriction::Bound,
                case::Variant::FrozenTraction => KnownFriction::Traction,
            };
            let matrix = match matrix {
                case::StageMatrix::Symmetric => StageMatrix::Symmetric,
                case::StageMatrix::Complete => StageMatrix::Complete,
            };
            let (tolerance, max_sweeps) = (tolerance.value, max_sweeps.value);
            Some(StaggeredSettings { tolerance, max_sweeps, known, matrix })
        }
        _ => None,
    }
}

/// Whether the steps are solved in stages with symmetric matrices.
pub fn has_symmetric_stages(case: &Case) -> bool {
    staggered(case).is_some_and(|settings| settings.matrix == StageMatrix::Symmetric)
}

/// Remarks on the choices of the case.
pub fn remarks(case: &Case) -> Vec<String> {
    let asked = case.solver.strategy.value != case::Strategy::Monolithic;
    let idle = asked && staggered(case).is_none();
    let remark = "no contact has friction: `strategy: staggered` has no second stage, and the steps are solved by the monolithic strategy";
    let massless = case.bodies.iter().filter(|(_, body)| !case.is_static() && body.is_massless());
    let massless = massless.map(|(name, _)| {
        format!("'{}' has no mass: it follows supports, loads and contacts instantaneously", name.value)
    });
    idle.then(|| remark.to_owned())
        .into_iter()
        .chain(massless)
        .chain(oscillating_nodes(case))
        .chain(large_tolerances(case))
        .chain(unenforced_accuracy(case))
        .chain(multipliers_on_both_sides(case))
        .collect()
}

/// Remarks on tolerances so large that they affect the results.
fn large_tolerances(case: &Case) -> impl Iterator<Item = String> {
    let newton = ("newton", newton_tolerance(case), "unbalanced forces", "the largest force");
    let staggered = match &case.solver.strategy.value {
        case::Strategy::Staggered { tolerance, .. } => Some((
            "strategy.staggered",
            tolerance.value,
            "a difference of the stages",
            "the displacement of a step",
        )),
        case::Strategy::Monolithic => None,
    };
    let given = [Some(newton), staggered].into_iter().flatten();
    given.filter(|(_, tolerance, ..)| *tolerance > LOOSEST_NEWTON).map(|(name, tolerance, what, of)| {
        format!(
            "solver.{name}: {{ tolerance: {tolerance} }} allows {what} of up to {:.2} % of {of}, which \
             limits the accuracy of the results: use {LOOSEST_NEWTON:e} or less",
            100.0 * tolerance
        )
    })
}

/// Remark on multipliers where a surface meets itself: both of its sides have them.
fn multipliers_on_both_sides(case: &Case) -> Option<String> {
    let enforced = case.accuracy.as_ref().is_some_and(|accuracy| accuracy.penetration.is_some());
    let itself = |contact: &&case::Contact| contact.contactor.value == contact.target.value;
    let found = case
        .contact
        .iter()
        .find(|(_, contact)| enforced && itself(contact) && !crate::accuracy::keeps_laws(case));
    found.map(|(name, _)| {
        format!(
            "contact '{}': in self-contact both sides have multipliers for accuracy.penetration, and a \
             small penetration may not be reached; name the two surfaces if they are known, or request a \
             relative penetration of 1e-3 or more",
            name.value
        )
    })
}

/// Remarks on parts of `accuracy` without effect: under the conserving scheme the laws of contact
/// stay as they are.
fn unenforced_accuracy(case: &Case) -> Option<String> {
    let accuracy = case.accuracy.as_ref().filter(|_| crate::accuracy::keeps_laws(case))?;
    let stiff = case.contact.values().any(|contact| contact.normal.is_penalty());
    let penetration = (accuracy.penetration.is_some() && stiff).then_some("penetration");
    let slip = (accuracy.slip.is_some() && has_friction(case)).then_some("slip");
    let parts: Vec<&str> = penetration.into_iter().chain(slip).collect();
    (!parts.is_empty()).then(|| {
        format!(
            "`scheme: conserving` does not modify the contact laws: accuracy.{} is reported but not \
             enforced; a smaller compliance or a larger stick stiffness reduces the error",
            parts.join(" and accuracy.")
        )
    })
}

/// Remark on stiff penalties: under the conserving scheme nothing damps oscillations that no
/// reasonable step resolves.
fn oscillating_nodes(case: &Case) -> Option<String> {
    let conserves = case.time.scheme.value.conserves();
    case.accuracy.as_ref().and_then(|accuracy| accuracy.time.as_ref()).filter(|_| conserves)?;
    let stiff = |contact: &&case::Contact| contact.normal.is_penalty();
    let meets = |name: &str| case.contact.values().filter(stiff).any(|contact| contact.is_on(name));
    let swings = case.bodies.iter().filter(|(name, body)| {
        let calm = body.mass == case::Mass::Redistributed
            || body.mass == case::Mass::Auto && case.calms_contact_of(&name.value);
        meets(&name.value) && !calm
    });
    let swings: Vec<String> = swings.map(|(name, _)| format!("'{}'", name.value)).collect();
    (!swings.is_empty()).then(|| {
        format!(
            "nodes with mass oscillate on the penalty while in contact: the error in time may be twice the \
             reported one; `mass: redistributed` in {} avoids this, in fewer iterations if the steps \
             converge",
            swings.join(", ")
        )
    })
}

/// The strategy that solves the steps.
///
/// # Errors
/// When a linear solver does not fit the problem.
pub fn strategy<const D: usize>(
    case: &Case,
    system: &ContactSystem<D>,
    prefix: &str,
) -> Result<Box<dyn Strategy>> {
    let pattern = system.pattern_vector();
    let linear = linear(case);
    let problem = step_problem(case, system);
    let solver = || LinearSolver::new(pattern, prefix, &linear, &problem);
    let newton = newton(case, terms(case, system), system.bodies().unknowns());
    Ok(augmented(
        system,
        match staggered(case) {
            Some(settings) => Box::new(Staggered::new(settings, &newton, solver, pattern)?),
            None => Box::new(Monolithic::new(newton, solver()?, pattern)?),
        },
    ))
}

/// The strategy, with multipliers if the case requests a tolerance of penetration or slip that they
/// have to meet.
pub fn augmented<const D: usize>(system: &ContactSystem<D>, inner: Box<dyn Strategy>) -> Box<dyn Strategy> {
    match crate::accuracy::corrects_contact(system) {
        true => Box::new(Augmented::new(inner)),
        false => inner,
    }
}

/// The properties of the linear problem of a step. The stages of a staggered step are symmetric by default.
pub fn step_problem<const D: usize>(case: &Case, system: &ContactSystem<D>) -> Problem {
    let scheme = scheme(&case.time);
    let problem = problem(case, system, scheme.has_inertia());
    let symmetric = problem.symmetric && (scheme != Scheme::Conserving || system.has_symmetric_steps());
    Problem { symmetric: symmetric || has_symmetric_stages(case), ..problem }
}

/// The properties of a linear problem.
pub fn problem<const D: usize>(case: &Case, system: &ContactSystem<D>, dynamic: bool) -> Problem {
    Problem {
        unknowns: system.bodies().unknowns(),
        dimension: D,
        dynamic,
        symmetric: terms(case, system) != Terms::ALL && !system.has_following_loads(),
        contact: !system.contacts().is_empty(),
        joins_bodies: case.joins_bodies(),
        tied: system.bodies().has_ties(),
        nearly_incompressible: is_nearly_incompressible(case),
        format: Some(system.matrix().format()),
    }
}

/// Whether a body has a Poisson's ratio of [`Problem::STIFF`] or more.
fn is_nearly_incompressible(case: &Case) -> bool {
    /// Rounding error of a Poisson's ratio that is recomputed from moduli.
    const ROUNDING: f64 = 1e-9;
    let materials = case.bodies.values().flat_map(|body| {
        let of_regions = body.regions.values().map(|region| region.material);
        std::iter::once(body.material).chain(of_regions)
    });
    !case.is_plane_stress()
        && materials.into_iter().any(|law| law.moduli().poisson_ratio() >= Problem::STIFF - ROUNDING)
}

/// Matrix format that the linear solvers require. It has scalar rows if the user names a
/// preconditioner by PETSc's options, because every preconditioner accepts scalar rows.
///
/// # Errors
/// The case names a linear solver that does not fit.
pub fn format<const D: usize>(
    session: &Session,
    case: &Case,
    local: &LocalMesh<D>,
    choice: &LinearChoice,
) -> Result<Format> {
    let problem = Problem {
        unknowns: local.index.total as usize * D,
        dimension: D,
        dynamic: !case.is_static(),
        symmetric: !(has_friction(case) || case.has_unsymmetric_steps() || case.has_unsymmetric_contact())
            || has_symmetric_stages(case),
        contact: !case.contact.is_empty(),
        joins_bodies: case.joins_bodies(),
        tied: !case.tied.is_empty(),
        nearly_incompressible: is_nearly_incompressible(case),
        format: None,
    };
    let presets = ladder(choice, &problem)?;
    Ok(if session.is_given("pc_type") { Format::Aij } else { storage(&presets) })
}

/// Terms of the tangent. All of them with friction, between bodies and over round obstacles.
/// Without friction on planes the small change of the contact area is the only non-symmetric term.
/// It is dropped, so that the matrix is symmetric.
pub fn terms<const D: usize>(case: &Case, system: &ContactSystem<D>) -> Terms {
    let all = system.has_friction() || case.has_unsymmetric_contact();
    if all { Terms::ALL } else { Terms::ALL - Terms::ZONE_CHANGE }
}

/// Settings of Newton's method for the static start. It is solved once, and the whole run begins with
/// its errors: forces of a body that only contact holds may be a millionth of the largest force.
/// Without a request its tolerance is therefore smaller than that of the steps.
pub fn start_newton(case: &Case, terms: Terms, unknowns: usize) -> NewtonSettings {
    let newton = newton(case, terms, unknowns);
    let requested = case.solver.newton.tolerance.is_some() || case.accuracy.is_some();
    let tolerance = if requested { newton.tolerance } else { newton.tolerance.min(TIGHTEST) };
    NewtonSettings { tolerance, ..newton }
}

/// The settings of Newton's method for this number of unknowns.
pub fn newton(case: &Case, terms: Terms, unknowns: usize) -> NewtonSettings {
    let (newton, krylov) = (&case.solver.newton, &case.solver.krylov);
    let tightest = krylov.tolerance.value;
    let inexact = newton.inexact.or((unknowns >= LARGE || case.accuracy.is_some()).then_some(true));
    NewtonSettings {
        tolerance: newton_tolerance(case),
        max_iterations: newton.max_iterations.value,
        linear: match inexact {
            Some(true) => [tightest.max(LOOSEST), tightest],
            Some(false) => [tightest; 2],
            None => [tightest, FIRM * tightest],
        },
        line_search: newton.line_search,
        terms,
        keep_tangent: inexact == Some(true) && follows_time(case),
    }
}

/// Whether the step length follows the error in time.
fn follows_time(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.time.is_some())
}

/// Newton's tolerance: the user's, or one that is negligible beside the requested accuracy. In
/// statics this is the slip, which is relative to the displacements too.
fn newton_tolerance(case: &Case) -> f64 {
    /// Newton tolerance (residual over the largest force) divided by the allowed error in time.
    const RATIO: f64 = 1e-1;
    /// Tolerance without a request. Errors of forces and displacements are then below 2e-7 in the
    /// shipped scenes, a thousandth of those of their meshes
    /// (docs/performance/speed-versus-accuracy.md). 1e-9 costs an eighth more. 1e-6 saves
    /// nothing more, and has errors up to 1e-5.
    const USUAL: f64 = 1e-7;
    /// Tolerance of the conserving scheme, whose energy is as exact as the balance, and of the
    /// staggered strategy, whose sweeps leave errors of the same sign in each step.
    const TIGHT: f64 = TIGHTEST;
    let accuracy = case.accuracy.as_ref();
    let requested =
        accuracy.and_then(|accuracy| if case.is_static() { accuracy.slip } else { accuracy.time });
    match (case.solver.newton.tolerance, requested) {
        (Some(given), _) => given.value,
        (None, Some(requested)) => (RATIO * requested.value).clamp(TIGHTEST, LOOSEST_NEWTON),
        (None, None) if case.time.scheme.value.conserves() || staggered(case).is_some() => TIGHT,
        (None, None) => USUAL,
    }
}

#[cfg(test)]
mod tests {
    use super::newton_tolerance;
    use crate::case::Case;

    /// The Newton tolerance of the case `text` with the lines `more` added.
    fn tolerance(text: &str, more: &str) -> f64 {
        newton_tolerance(&Case::parse(&format!("{text}{more}"), "case.yml").expect("a case"))
    }

    /// A tolerance that shows in the results is reported. One that the program would choose is not.
    #[test]
    fn loose_tolerances_are_reported() {
        let text = include_str!("../../meshes/sliding-block/case.yml");
        let told = |solver: &str| {
            let text = format!("{text}solver: {solver}\n");
            super::remarks(&Case::parse(&text, "case.yml").expect("a case")).join("; ")
        };
        assert!(told("{ newton: { tolerance: 0.9 } }").contains("of up to 90.00 % of the largest force"));
        assert_eq!(told("{ newton: { tolerance: 1e-3 } }"), "");
        assert!(
            told("{ strategy: { staggered: { tolerance: 0.5 } } }")
                .contains("a difference of the stages of up to 50.00 %")
        );
    }

    /// Newton's tolerance is a tenth of the requested error in time, and at most a thousandth,
    /// unless it is given.
    #[test]
    fn newton_follows_the_error_in_time() {
        let text = include_str!("../../meshes/sliding-block/case.yml");
        let tolerance = |more: &str| tolerance(text, more);
        let asked = |time: &str| tolerance(&format!("accuracy: {{ time: {time} }}\n"));
        for (time, expected) in
            [("1e-1", 1e-3), ("1e-2", 1e-3), ("1e-3", 1e-4), ("1e-7", 1e-8), ("1e-12", 1e-9), ("none", 1e-7)]
        {
            assert!((asked(time) / expected - 1.0).abs() < 1e-12, "{time}: {:e}", asked(time));
        }
        assert_eq!(tolerance(""), 1e-7);
        let conserving = include_str!("../../meshes/pile/case.yml");
        assert_eq!(super::newton_tolerance(&Case::parse(conserving, "case.yml").expect("a case")), 1e-9);
        let given = "solver: { newton: { tolerance: 1e-8 } }\naccuracy: { time: 1e-3 }\n";
        assert_eq!(tolerance(given), 1e-8);
    }

    /// Statics have no error in time. Newton's tolerance is then a tenth of the requested slip,
    /// whatever `time` says.
    #[test]
    fn newton_follows_slip_in_statics() {
        let text = include_str!("../../meshes/ironing/case.yml");
        let tolerance = |asked: &str| tolerance(text, &format!("accuracy: {asked}\n"));
        for (asked, expected) in [
            ("tight", 1e-5),
            ("{ slip: 1e-5 }", 1e-6),
            ("{ slip: 1e-5, time: none }", 1e-6),
            ("{ slip: none }", 1e-7),
            ("{ time: none }", 1e-4),
        ] {
            assert!((tolerance(asked) / expected - 1.0).abs() < 1e-12, "{asked}: {:e}", tolerance(asked));
        }
    }
}
