//! Lists what a case needs and what it does not: terms of the matrix, matrices, memory and fields,
//! each with the reason.

use std::fmt::Write as _;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::options;
use crate::accuracy::{limits_slip, smallest_tolerance};
use crate::assembly::ContactSystem;
use crate::case::Case;
use crate::collective::Collective;
use crate::dynamics::Equations;
use crate::element::Kinematics;
use crate::model::Model;
use crate::petsc::{Format, Kind, census};
use crate::solvers::Preset;

/// One thing that a case may need.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Need {
    /// Its name.
    pub name: &'static str,
    /// Whether the case uses it.
    pub used: bool,
    /// The reason.
    pub why: String,
}

/// The properties of a case on which its needs depend.
struct Traits {
    dynamic: bool,
    finite: bool,
    contact: bool,
    curved: bool,
    deformable: bool,
    friction: bool,
    pressure: bool,
    speed: bool,
    memory: bool,
    area: bool,
    follows: bool,
    staggered: bool,
}

impl Traits {
    fn new<const D: usize>(case: &Case, model: &Model<D>, system: &ContactSystem<D>) -> Self {
        let contacts = &model.contacts;
        let frictions = || contacts.iter().filter_map(|contact| contact.friction);
        Self {
            dynamic: !case.is_static(),
            finite: model.bodies.iter().any(|body| body.kinematics() == Kinematics::Finite),
            contact: !contacts.is_empty(),
            curved: contacts.iter().any(|contact| !contact.target.is_plane()),
            deformable: contacts.iter().any(|contact| contact.target.set().is_some()),
            friction: frictions().next().is_some(),
            pressure: frictions().any(|friction| friction.law.law().coefficient_depends_on_pressure()),
            speed: frictions().any(|friction| friction.law.law().depends_on_speed()),
            memory: frictions()
                .any(|friction| friction.regularization.stiffness().is_some() || limits_slip(case)),
            area: contacts.iter().any(|contact| contact.current_area),
            follows: system.has_following_loads(),
            staggered: options::staggered(case).is_some(),
        }
    }
}

/// All that a case may need, in the order of (3.5), followed by the storage. `estimates` is set if
/// the error in time is estimated.
pub fn needs<const D: usize>(
    case: &Case,
    model: &Model<D>,
    system: &ContactSystem<D>,
    solvers: &[&Preset],
    estimates: bool,
) -> Vec<Need> {
    let t = Traits::new(case, model, system);
    let every = case.output.fields.every.value;
    let symmetric = options::step_problem(case, system).symmetric;
    let either = |used: bool, yes: &str, no: &str| (used, if used { yes.to_owned() } else { no.to_owned() });
    let friction = |used: bool, yes: &str| match (t.contact, t.friction) {
        (false, _) => (false, "no contact".to_owned()),
        (_, false) => (false, "no friction".to_owned()),
        _ => either(used, yes, "the law has no such dependence"),
    };
    let names: Vec<&str> = solvers.iter().map(|preset| preset.name).collect();
    let format = match system.matrix().format() {
        Format::Aij => "scalar rows (AIJ)",
        Format::Baij => "blocks of a node (BAIJ)",
    };
    let inertia = || either(t.dynamic, "a dynamic scheme", "the static scheme");
    let rows = [
        ("K_0 (linear material stiffness)", (true, "always".to_owned())),
        (
            "K_NL (displacement-dependent part of it)",
            either(t.finite, "finite kinematics", "linear kinematics"),
        ),
        ("K_S (geometric stiffness)", either(t.finite, "finite kinematics", "linear kinematics")),
        ("K_CN (normal contact)", either(t.contact, "contact", "no contact")),
        (
            "K_CG (change of the contact normal and position)",
            match t.contact {
                true => either(t.curved, "a curved or deformable target", "all targets are planes"),
                false => (false, "no contact".to_owned()),
            },
        ),
        ("K_T (friction damping)", friction(true, "friction")),
        ("K_nT (friction-normal coupling, non-symmetric)", friction(true, "friction")),
        ("K_mu (change of the coefficient with the slip speed)", friction(t.speed, "the Stribeck law")),
        (
            "change of the coefficient with the pressure",
            friction(t.pressure, "the law of Grosch and Schallamach"),
        ),
        (
            "zone terms (change of the contact area, non-symmetric)",
            match (t.contact, t.friction) {
                (false, _) => (false, "no contact".to_owned()),
                (_, false) if !case.has_unsymmetric_contact() => {
                    (false, "omitted without friction: the matrix stays symmetric".to_owned())
                }
                _ => either(t.area, "area: current", "area: reference"),
            },
        ),
        ("follower loads (non-symmetric)", either(t.follows, "a follower pressure", "no such load")),
        ("M (mass) in the matrix", inertia()),
        ("mass matrix", inertia()),
        (
            "C (damping) and its matrix",
            either(system.bodies().is_damped(), "damping of a body", "no body is damped"),
        ),
        (
            "K_CD (damping of contact along the normal)",
            either(
                system.contacts().iter().any(|contact| contact.law().damping.normal.is_some()),
                "damping of a contact",
                "no contact is damped along the normal",
            ),
        ),
        (
            "K_s, C_s (foundations, springs, dashpots, ties)",
            either(
                !system.bodies().elastic_supports().is_empty() || system.bodies().has_ties(),
                "a foundation, spring or tie of the case",
                "no foundation, spring or tie",
            ),
        ),
        ("accelerations", inertia()),
        (
            "history of viscous branches",
            either(system.bodies().is_viscous(), "viscoelasticity of a body", "no body is viscoelastic"),
        ),
        (
            "symmetric matrix: half the factors, CG",
            either(symmetric, "all terms are symmetric", "friction, a follower load or a non-planar target"),
        ),
        (
            "stick memory (tractions of the last step)",
            friction(t.memory || t.staggered, "elastic stick, or the staggered strategy"),
        ),
        ("multipliers of contact points", multipliers(case, &t, system)),
        ("massless nodes of contact surfaces", massless(&t, system)),
        (
            "displacements and errors of earlier steps",
            match case.accuracy.as_ref().is_some_and(|accuracy| accuracy.time.is_some()) {
                true => either(estimates, "accuracy.time", "the scheme makes no error in time"),
                false => (false, "no accuracy.time".to_owned()),
            },
        ),
        ("second stage (3.7)", either(t.staggered, "strategy: staggered", "strategy: monolithic")),
        (
            "search and exchange of facets",
            either(t.deformable, "a deformable target", "no deformable target"),
        ),
        (
            "fields: stress, contact",
            (every > 0, if every > 0 { format!("every {every} steps") } else { "every: 0".to_owned() }),
        ),
        ("checkpoints", either(case.output.checkpoint.is_some(), "output: checkpoint", "only on a signal")),
        ("matrix", (true, format!("{format}, for {}", names.join(", then ")))),
    ];
    rows.into_iter().map(|(name, (used, why))| Need { name, used, why }).collect()
}

/// Whether contact points have multipliers.
fn multipliers<const D: usize>(case: &Case, t: &Traits, system: &ContactSystem<D>) -> (bool, String) {
    let asked = case.accuracy.as_ref().is_some_and(|accuracy| accuracy.penetration.is_some());
    let limited = smallest_tolerance(system).is_some();
    let why = match (t.contact, asked, limited) {
        (false, ..) => "no contact",
        _ if system.limits_elastic_slip() && limited => "accuracy.penetration and accuracy.slip",
        _ if system.limits_elastic_slip() => "accuracy.slip",
        (_, false, _) => "no accuracy.penetration",
        (.., false) => "laws and scheme define the penetration, which is reported",
        _ if t.dynamic => "accuracy.penetration, with an increased penalty",
        _ => "accuracy.penetration",
    };
    (limited || system.limits_elastic_slip(), why.to_owned())
}

/// Whether nodes in contact have no mass.
fn massless<const D: usize>(t: &Traits, system: &ContactSystem<D>) -> (bool, String) {
    let [bodies, _] = system.bodies().redistributed();
    let why = match (bodies.is_empty(), t.dynamic) {
        (false, _) => format!("of {}", bodies.join(", ")),
        (_, true) => "no body has its mass redistributed".to_owned(),
        (_, false) => "the static scheme".to_owned(),
    };
    (!bodies.is_empty(), why)
}

/// The needs as lines of a table.
pub fn table(needs: &[Need]) -> String {
    let mut text = String::from("needs:\n");
    for Need { name, used, why } in needs {
        let used = if *used { "used" } else { "not used" };
        let _ = writeln!(text, "  {name:<54} {used:<9} {why}");
    }
    text
}

/// Storage that the program holds at present for the case, over all ranks: matrices, vectors, and
/// optional data of contact points and nodes. Collective.
pub fn held<const D: usize>(world: &impl CommunicatorCollectives, system: &ContactSystem<D>) -> String {
    let (matrices, vectors) = (census(Kind::Matrix), census(Kind::Vector));
    let [multipliers, masses, branches] = system.bytes().map(|bytes| bytes as u64);
    let own = [matrices.count, matrices.bytes, vectors.count, vectors.bytes, multipliers, masses, branches];
    let (mut most, mut sum) = ([0u64; 7], [0u64; 7]);
    world.reduce_all(&own[..], &mut most[..], SystemOperation::max());
    world.reduce_all(&own[..], &mut sum[..], SystemOperation::sum());
    let mut text = format!(
        "storage before the first solve: {} matrices of {} bytes, {} vectors of {} bytes",
        most[0], sum[1], most[2], sum[3]
    );
    for (name, bytes) in
        [("multipliers", sum[4]), ("flags and factors of masses", sum[5]), ("viscous branches", sum[6])]
    {
        if bytes > 0 {
            let _ = write!(text, ", {name} of {bytes} bytes");
        }
    }
    text + ", without PETSc's internal storage\n"
}
