//! Quantities that are derived from a case before anything is solved: sizes, speeds, stiffnesses,
//! and what the run would use.

use std::fmt::Write as _;
use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::input::share_surfaces;
use super::remarks::{contact_starts, remarks};
use super::unit_note::unit_note;
use super::{Share, derived, field_output, needs, options, share_out, start};
use crate::accuracy::{self, limits_slip};
use crate::advice::precision::Precision;
use crate::advice::{locking, magnitudes, precision, self_contact};
use crate::assembly::{ContactSystem, SystemOptions};
use crate::case::Case;
use crate::collective::Collective;
use crate::contact::point::ContactLaw;
use crate::dynamics::Stage;
use crate::element::Kinematics;
use crate::error::{Result, agree};
use crate::material::PronySeries;
use crate::mesh::ElementKind;
use crate::model::{Body, BodyMaterial, ContactModel, Model, RayleighFactors};
use crate::observe::probes::watch;
use crate::partition::LocalMesh;
use crate::petsc::Session;
use crate::solvers::ladder;

/// Fraction of the modulus that is taken as a high contact pressure.
const HIGH_PRESSURE: f64 = 0.1;

/// Performs everything that a run does before its first solve and returns its findings, one fact
/// per line. Collective.
///
/// # Errors
/// Returns the error that a run would return, the same on all ranks.
pub fn check<const D: usize>(session: &Rc<Session>, case: &Case) -> Result<String> {
    let world = session.world();
    share_surfaces(session, case)?;
    let mut model = Model::<D>::new(case)?;
    derived::require_columns(case, &model, None)?;
    agree(world, field_output::require_format(case))?;
    let Share { local, partition, remarks: of_meshes } = share_out(session, case, &mut model)?;
    let themselves = if session.size() == 1 { self_contact::remarks(&local, &model) } else { Vec::new() };
    let sizes = sizes(world, &local, model.bodies.len());
    let scheme = options::scheme(&case.time);
    let linear = options::linear(case);
    let format = options::format(session, case, &local, &linear)?;
    let wanted = SystemOptions { inertia: scheme.has_inertia(), format };
    let mut system = ContactSystem::new(session, local, &model, wanted)?;
    let precision = Precision::of(&system);
    precision::require(&precision)?;
    derived::require_derived(&system, case, &model)?;
    start::require_reach(&mut system, &model, case)?;
    accuracy::limit_penetration(&mut system, case, &precision)?;
    accuracy::limit_slip(&mut system, case);
    if case.is_static() {
        start::require_supports(&system)?;
    }
    let solvers = ladder(&linear, &options::step_problem(case, &system))?;
    let watched = watch(&system, &model.probes)?;

    let mut text = String::new();
    let (elements, nodes): (u64, u64) = (partition.elements.iter().sum(), partition.owned.iter().sum());
    let (unknowns, prescribed) = (system.bodies().unknowns(), system.bodies().prescribed());
    let _ = writeln!(
        text,
        "mesh: {elements} elements, {nodes} nodes, {unknowns} unknowns, {prescribed} of them prescribed"
    );
    let _ = writeln!(text, "ranks: {partition}");
    let names: Vec<&str> = solvers.iter().map(|preset| preset.name).collect();
    let strategy = if options::staggered(case).is_some() { "staggered" } else { "monolithic" };
    let _ = writeln!(text, "strategy: {strategy}");
    let _ = writeln!(text, "linear solver: {}", names.join(", then "));
    let _ = writeln!(text, "{}", steps(case));
    if let Some(units) = unit_note(case) {
        let _ = writeln!(text, "{units}");
    }
    if case.is_plane_stress() {
        let m = case.units.of("m");
        let _ = writeln!(
            text,
            "plane stress: the thickness is free, forces are for a thickness of 1 {m} at rest"
        );
    }
    if case.is_axisymmetric() {
        let _ = writeln!(text, "axisymmetric: forces and energies are those of the whole revolution");
    }
    for ((body, size), cures) in model.bodies.iter().zip(&sizes).zip(locking::cures(&system, &model)) {
        describe_body(&mut text, body, size, case);
        let mut cures: Vec<String> =
            cures.iter().map(|used| format!("{} of {}", used.cure.name(), used.kind)).collect();
        cures.sort_unstable();
        cures.dedup();
        let _ = writeln!(text, "  locking: {}", cures.join(", "));
        if system.bodies().redistributed()[0].contains(&body.name) {
            let _ = writeln!(text, "  mass: redistributed, the nodes of contact surfaces are massless");
        }
    }
    let starts = contact_starts(&system);
    let laws = system.contacts().iter().map(|contact| (contact.law(), contact.softer));
    for ((contact, (law, softer)), start) in model.contacts.iter().zip(laws).zip(&starts) {
        let _ = writeln!(text, "contact {start}");
        describe_contact(&mut text, contact, law, softer, &model.bodies, &sizes, case);
    }
    let stage = Stage::new(system.pattern_vector(), scheme.has_inertia())?;
    let past = accuracy::kept(case, system.pattern_vector())?;
    let needs = needs::needs(case, &model, &system, &solvers, past.is_some());
    text.push_str(&needs::table(&needs));
    text.push_str(&needs::held(world, &system));
    drop((stage, past));
    let notes = remarks(&system, &watched).into_iter().chain(magnitudes::remarks(&system, &model));
    let notes = notes
        .chain(precision::remark(&precision))
        .chain(locking::remarks(&system, &model))
        .chain(options::remarks(case))
        .chain(of_meshes)
        .chain(themselves);
    notes.for_each(|remark| text.push_str(&format!("note: {remark}\n")));
    Ok(text)
}

/// Element sizes of a body.
#[derive(Debug, Clone, PartialEq)]
struct Size {
    elements: u64,
    kinds: Vec<ElementKind>,
    /// Smallest distance between two corners of an element \[m\].
    smallest_edge: f64,
}

/// Element sizes of all bodies, over all ranks. Collective.
fn sizes<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    bodies: usize,
) -> Vec<Size> {
    let kinds = ElementKind::ALL.len();
    let mut counts = vec![0u64; bodies * kinds];
    let mut edges = vec![f64::INFINITY; bodies];
    for element in (0..local.mesh.element_count()).filter(|&element| local.mine[element]) {
        let body = usize::from(local.mesh.body[element]);
        counts[body * kinds + local.mesh.kinds[element] as usize] += 1;
        edges[body] = edges[body].min(smallest_edge(local, element));
    }
    let mut totals = vec![0; counts.len()];
    let mut least = vec![0.0; bodies];
    world.reduce_all(&counts[..], &mut totals[..], SystemOperation::sum());
    world.reduce_all(&edges[..], &mut least[..], SystemOperation::min());
    let size = |(counts, &smallest_edge): (&[u64], &f64)| Size {
        elements: counts.iter().sum(),
        kinds: ElementKind::ALL.into_iter().filter(|&kind| counts[kind as usize] > 0).collect(),
        smallest_edge,
    };
    totals.chunks(kinds).zip(&least).map(size).collect()
}

fn smallest_edge<const D: usize>(local: &LocalMesh<D>, element: usize) -> f64 {
    let corners = &local.mesh.element_nodes(element)[..local.mesh.kinds[element].corners()];
    let point = |node: u32| &local.mesh.points[node as usize];
    let distance = |a: u32, b: u32| -> f64 {
        point(a).iter().zip(point(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let pairs = corners.iter().enumerate().flat_map(|(k, &a)| corners[k + 1..].iter().map(move |&b| (a, b)));
    pairs.map(|(a, b)| distance(a, b)).fold(f64::INFINITY, f64::min)
}

fn steps(case: &Case) -> String {
    let end = case.time.end.value;
    let step = case.time.step();
    let count = (end / step * (1.0 - 1e-12)).ceil().max(1.0);
    let kind = if case.is_static() { "load increments" } else { "steps" };
    let step = end / count;
    let s = case.units.of("s");
    let cuts = case.time.cuts.value;
    format!("time: {count} {kind} of {step:.4e} {s}, each cut at most {cuts} times")
}

fn describe_body(text: &mut String, body: &Body, size: &Size, case: &Case) {
    let Size { elements, kinds, smallest_edge } = size;
    let kinds: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
    let _ = writeln!(text, "body {}: {elements} {}", body.name, kinds.join(" and "));
    let m = case.units.of("m");
    let _ = writeln!(text, "  smallest element edge: {smallest_edge:.4e} {m}");
    for material in &body.materials {
        if let Some(set) = &material.set {
            let _ = writeln!(text, "  region {set}:");
        }
        describe_properties(text, material, *smallest_edge, case);
    }
}

/// Describes a material of a body: moduli, relaxation, damping and wave speeds.
fn describe_properties(text: &mut String, material: &BodyMaterial, smallest_edge: f64, case: &Case) {
    let (s, speed) = (case.units.of("s"), case.units.of("m/s"));
    let moduli = material.sudden_moduli();
    let _ = writeln!(text, "  {}", describe_material(material, &case.units.of("Pa")));
    if let Some(series) = &material.series {
        let _ = writeln!(text, "  {}", describe_relaxation(material, series, case));
    }
    let density = material.formulation.density;
    if density <= 0.0 {
        if !case.is_static() {
            let _ = writeln!(
                text,
                "  no mass, hence no inertia and no waves: it follows supports, loads and contacts \
                 instantaneously"
            );
        }
        return;
    }
    if let Some(RayleighFactors { mass, stiffness }) = material.damping {
        let _ = writeln!(
            text,
            "  Rayleigh damping: {mass:.4e} {} times the mass, {stiffness:.4e} {s} times the stiffness",
            case.units.of("1/s")
        );
    }
    let pressure_wave = (material.wave_modulus() / density).sqrt();
    let shear_wave = (moduli.mu / density).sqrt();
    let _ = writeln!(text, "  wave speeds: c_p {pressure_wave:.4e} {speed}, c_s {shear_wave:.4e} {speed}");
    if case.is_static() {
        return;
    }
    let crossing = smallest_edge / pressure_wave;
    let cfl = case.time.step() / crossing;
    let _ = writeln!(
        text,
        "  crossing time: {crossing:.4e} {s}, the step is {cfl:.3} times as long (CFL number)"
    );
}

/// Describes how far and how fast a body relaxes.
fn describe_relaxation(material: &BodyMaterial, series: &PronySeries, case: &Case) -> String {
    let (pascal, s) = (case.units.of("Pa"), case.units.of("s"));
    let mu = material.formulation.moduli().mu;
    let times = series.branches().iter().map(|branch| branch.time);
    let shortest = times.clone().fold(f64::INFINITY, f64::min);
    let longest = times.fold(0.0, f64::max);
    format!(
        "viscoelastic: the shear modulus relaxes from {:.4e} to {:.4e} {pascal}, with times from {shortest:.4e} to \
         {longest:.4e} {s}; the step is {:.3} times the shortest",
        mu * series.relaxation(0.0),
        mu * series.relaxation(f64::INFINITY),
        case.time.step() / shortest
    )
}

/// Describes the moduli at small strain and the range in which the law keeps its stiffness.
fn describe_material(material: &BodyMaterial, pascal: &str) -> String {
    let moduli = material.formulation.moduli();
    let small = format!(
        "at small strain: Young's modulus {:.4e} {pascal}, Poisson's ratio {:.6}, shear modulus {:.4e} {pascal}, bulk modulus {:.4e} {pascal}",
        moduli.young_modulus(),
        moduli.poisson_ratio(),
        moduli.mu,
        moduli.bulk()
    );
    if material.formulation.kinematics == Kinematics::Linear {
        return small;
    }
    let stable = material.formulation.material.stable_stretches();
    format!("{small}\n  a uniaxial test is stable at stretches from {:.2} to {:.2}", stable.start, stable.end)
}

fn describe_contact<const D: usize>(
    text: &mut String,
    contact: &ContactModel<D>,
    law: &ContactLaw,
    softer: f64,
    bodies: &[Body],
    sizes: &[Size],
    case: &Case,
) {
    // The softest material beneath the surfaces defines which pressure is high and which stiffness is
    // large.
    let has_it = |&body: &usize| bodies[body].softest_modulus() <= softer;
    let Some(body) = contact.all_bodies().into_iter().find(has_it) else { return };
    let smallest = sizes[body].smallest_edge;
    let high = HIGH_PRESSURE * softer;
    let penetration = law.normal.penetration(high);
    let stiffness = -law.normal.evaluate(-penetration).derivative;
    let layer = softer / smallest;
    let [m, pa, slope] = ["m", "Pa", "Pa/m"].map(|unit| case.units.of(unit));
    let _ = writeln!(
        text,
        "  normal stiffness: {stiffness:.4e} {slope} at a pressure of {high:.3e} {pa}, {:.3} times E/h = {layer:.4e} {slope}",
        stiffness / layer
    );
    let _ = writeln!(
        text,
        "  expected penetration: {penetration:.3e} {m} at that pressure, {:.2e} of the smallest edge",
        penetration / smallest
    );
    if let Some(asked) = contact.penetration {
        let _ = writeln!(text, "  requested penetration: {asked:.3e} {m}");
    }
    let Some(friction) = law.friction else { return };
    if limits_slip(case) {
        let means = if case.is_static() { "multipliers" } else { "the stiffness" };
        let _ = writeln!(text, "  stick: by the return map, with {means} that accuracy.slip requires");
        return;
    }
    if let Some(velocity) = friction.regularization.slip_velocity() {
        let creep = velocity.value * case.time.end.value;
        let _ = writeln!(text, "  stick: a sticking point creeps by at most {creep:.3e} {m} until the end");
    }
    if let Some(stiffness) = friction.regularization.stiffness() {
        let slip = high / stiffness.value;
        let _ = writeln!(text, "  stick: elastic, {slip:.3e} {m} at a friction traction of {high:.3e} {pa}");
    }
}
