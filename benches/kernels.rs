//! Time of the element kernels on one core, in microseconds an element: every element, law and kind of request,
//! the tangent also over a step that conserves, in the plane also under plane stress.
//!
//! `cargo bench --bench kernels [-- FILTER]`. Deliberately not measured: insertion into a matrix.

use std::hint::black_box;
use std::time::Instant;

use contact_petsc::element::{
    ElementGroup, ElementSink, Formulation, Inverted, Kinematics, Locking, Request,
};
use contact_petsc::material::Material;
use contact_petsc::mesh::{BoxShape, ElementKind, PlaneState};

/// Looks at what arrives, as little as possible.
struct Look(f64);

impl ElementSink for Look {
    fn element(&mut self, _: usize, force: &[f64], stiffness: Option<&[f64]>) {
        self.0 += force[0] + stiffness.map_or(0.0, |k| k[1]);
    }
}

fn main() {
    let filter: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<7} {:<23} {:<18} {:>10} {:>10} {:>10}",
        "element", "law", "treatment", "force us", "tangent us", "step us"
    );
    for kind in ElementKind::SOLIDS {
        if filter.is_empty() || filter.iter().any(|f| kind.name().contains(f.as_str())) {
            match kind.dimension() {
                2 => variants::<2>(kind),
                _ => variants::<3>(kind),
            }
        }
    }
}

fn variants<const D: usize>(kind: ElementKind) {
    let laws = [
        ("saint_venant_kirchhoff", Kinematics::Finite),
        ("neo_hookean", Kinematics::Finite),
        ("mooney_rivlin", Kinematics::Finite),
        ("neo_hookean", Kinematics::Linear),
    ];
    let treatments = [
        ("none", Locking::None, PlaneState::Strain),
        ("selective_reduced", Locking::SelectiveReduced, PlaneState::Strain),
        ("mean_dilatation", Locking::MeanDilatation, PlaneState::Strain),
        ("plane stress", Locking::None, PlaneState::Stress),
    ];
    for ((law, kinematics), (treatment, locking, plane)) in
        laws.into_iter().flat_map(|law| treatments.map(|treatment| (law, treatment)))
    {
        if !locking.offered(kind) || (D == 3 && plane == PlaneState::Stress) {
            continue;
        }
        let material = Material::named(law, 1.0, 0.3).expect("a law of the table");
        let formulation = Formulation { material, kinematics, plane, locking, density: 1.0 };
        let (group, u) = block::<D>(kind, formulation);
        let [force, tangent] = [Request::FORCE, Request::TANGENT]
            .map(|request| time(&group, |sink| group.evaluate(&u, request, sink)));
        let start: Vec<f64> = u.iter().map(|u| 0.9 * u).collect();
        let step = time(&group, |sink| group.evaluate_step(&start, &u, Request::TANGENT, sink));
        let name = if kinematics == Kinematics::Linear { "linear" } else { law };
        println!("{:<7} {name:<23} {treatment:<18} {force:>10.4} {tangent:>10.4} {step:>10.4}", kind.name());
    }
}

/// A block in moderate smooth deformation.
fn block<const D: usize>(kind: ElementKind, formulation: Formulation) -> (ElementGroup<D>, Vec<f64>) {
    let cells = if D == 2 { 64 } else { 12 };
    let shape = BoxShape { min: [0.0; D], max: [1.0; D], cells: [cells; D], element: kind };
    let mesh = shape.mesh().expect("a box");
    let wave = |p: &[f64; D], i: usize| 0.05 * (2.0 * p[i] + 3.0 * p[(i + 1) % D]).sin();
    let u = mesh.points.iter().flat_map(|p| (0..D).map(move |i| wave(p, i))).collect();
    let elements = (0..mesh.element_count() as u32).collect();
    (ElementGroup::new(&mesh, elements, formulation).expect("a sound group"), u)
}

/// Best of several runs [us an element].
fn time<const D: usize>(
    group: &ElementGroup<D>,
    evaluate: impl Fn(&mut Look) -> Result<(), Inverted>,
) -> f64 {
    let mut best = f64::INFINITY;
    let start = Instant::now();
    while start.elapsed().as_millis() < 150 {
        let mut sink = Look(0.0);
        let run = Instant::now();
        evaluate(&mut sink).expect("a sound deformation");
        black_box(sink.0);
        best = best.min(run.elapsed().as_secs_f64());
    }
    best * 1e6 / group.elements().len() as f64
}
