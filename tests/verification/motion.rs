//! Order in time of every scheme and every element, on a motion that the mesh represents exactly.
//!
//! `u = a(t) B X` has the same deformation gradient everywhere. The mesh therefore causes no error,
//! and the remaining error is that of the time integration. Two sides follow the motion, the others
//! carry the tractions `P N`, and the inner points are free.

use std::rc::Rc;

use contact_petsc::petsc::Session;
use contact_petsc::tensor::{Tensor, Vector};

use super::march::run;
use super::scene::{DENSITY, POISSON, YOUNG, lame};

/// `a(t)` with value 0, but non-zero rate and acceleration at the start, and its derivatives.
const GROWTH: &str = "(0.08 * (sin(5*t) + 1 - cos(5*t)))";
const GROWTH_SECOND: &str = "(0.08 * 25 * (cos(5*t) - sin(5*t)))";
const END: f64 = 0.6;

fn growth(t: f64) -> [f64; 2] {
    let (sin, cos) = (5.0 * t).sin_cos();
    [0.08 * (sin + 1.0 - cos), 0.4 * (cos + sin)]
}

const PLANE: [&str; 5] = ["quad4", "quad8", "quad9", "tri3", "tri6"];
const SOLID: [&str; 5] = ["hex8", "hex20", "hex27", "tet4", "tet10"];

pub fn schemes(session: &Rc<Session>) {
    for (scheme, order, step) in [
        ("hht: { spectral_radius: 0.7 }", 2.0, 0.03),
        ("generalized_alpha: { spectral_radius: 0.6 }", 2.0, 0.03),
        ("backward_euler: {}", 1.0, 0.004),
    ] {
        converges::<2>(session, scheme, "quad4", (order, step));
    }
    let paper = "newmark: { beta: 0.25, gamma: 0.5 }";
    PLANE.iter().for_each(|element| converges::<2>(session, paper, element, (2.0, 0.03)));
    SOLID.iter().for_each(|element| converges::<3>(session, paper, element, (2.0, 0.03)));
}

/// The direction `B` of the motion.
fn direction<const D: usize>() -> Tensor<D> {
    Tensor::from_fn(|i, j| [[0.9, -0.7, 0.3], [0.8, -0.5, 0.4], [-0.2, 0.6, 0.7]][i][j])
}

/// Entry `i` of `B X` as an expression.
fn along<const D: usize>(i: usize) -> String {
    let terms: Vec<String> =
        (0..D).map(|j| format!("({:?}) * {}", direction::<D>()[(i, j)], ["x", "y", "z"][j])).collect();
    format!("({})", terms.join(" + "))
}

/// The tractions `P N` of Saint Venant and Kirchhoff's law, a polynomial in `a`.
fn traction<const D: usize>(normal: Vector<D>) -> String {
    let ((lambda, mu), b) = (lame(), direction::<D>());
    let stress = |e: Tensor<D>| Tensor::<D>::identity() * (lambda * e.trace()) + e * (2.0 * mu);
    let (s1, s2) = (stress((b + b.transpose()) * 0.5), stress(b.transpose() * b * 0.5));
    let (p1, p2, p3) = (s1 * normal, (s2 + b * s1) * normal, b * s2 * normal);
    let term = |i: usize| {
        let (p1, p2, p3) = (p1[i], p2[i], p3[i]);
        format!(
            "{}: \"({p1:?}) * {GROWTH} + ({p2:?}) * {GROWTH}^2 + ({p3:?}) * {GROWTH}^3\"",
            ["x", "y", "z"][i]
        )
    };
    (0..D).map(term).collect::<Vec<_>>().join(", ")
}

fn case<const D: usize>(scheme: &str, element: &str, step: f64) -> String {
    let list = |entry: &dyn Fn(usize) -> String| (0..D).map(entry).collect::<Vec<_>>().join(", ");
    let motion = list(&|i| format!("{}: \"{GROWTH} * {}\"", ["x", "y", "z"][i], along::<D>(i)));
    let velocity = list(&|i| format!("\"0.4 * {}\"", along::<D>(i)));
    let weight = list(&|i| format!("\"{GROWTH_SECOND} * {}\"", along::<D>(i)));
    let row = |value: &str| vec![value; D].join(", ");
    let mut loads = String::new();
    for (axis, sets) in [["front", "back"], ["bottom", "top"]].into_iter().skip(3 - D).enumerate() {
        let axis = axis + 1;
        for (set, sign) in sets.into_iter().zip([-1.0, 1.0]) {
            let normal = Vector::<D>::from_fn(|i, _| if i == axis { sign } else { 0.0 });
            loads += &format!("  {set}: {{ on: block.{set}, traction: {{ {} }} }}\n", traction(normal));
        }
    }
    let probe = |x: f64, last: f64| {
        let mut at = vec![0.5; D];
        (at[0], at[D - 1]) = (x, last);
        format!("{{ at: {at:?} }}")
    };
    format!(
        "dimension: {D}
bodies:
  block:
    mesh: {{ box: {{ min: [{}], max: [{}], cells: [{}], element: {element} }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: {YOUNG}, poisson_ratio: {POISSON} }} }}
    density: {DENSITY}
    initial_velocity: [{velocity}]
boundary:
  left: {{ on: block.left, displacement: {{ {motion} }} }}
  right: {{ on: block.right, displacement: {{ {motion} }} }}
  weight: {{ on: block, gravity: [{weight}] }}
{loads}time: {{ end: {END}, step: {step:?}, scheme: {{ {scheme} }} }}
output:
  fields: {{ every: 1000000 }}
  probes:
    middle: {}
    top: {}
    held: {}
",
        row("0"),
        row("1"),
        row("2"),
        probe(0.5, 0.5),
        probe(0.5, 1.0),
        probe(1.0, 0.5),
    )
}

/// Root mean squares of the errors of displacement and velocity at a probe.
fn errors<const D: usize>(table: &super::march::Table, name: &str, at: Vector<D>) -> [f64; 2] {
    let exact = direction::<D>() * at;
    let time = table.column("time");
    let mut sums = [0.0; 2];
    for i in 0..D {
        for (k, letter) in ["u", "v"].into_iter().enumerate() {
            let column = table.column(&format!("{name}.{letter}_{}", ["x", "y", "z"][i]));
            let squares =
                column.iter().zip(&time).map(|(value, &t)| (value - growth(t)[k] * exact[i]).powi(2));
            sums[k] += squares.sum::<f64>();
        }
    }
    sums.map(|sum| (sum / time.len() as f64).sqrt())
}

fn converges<const D: usize>(session: &Rc<Session>, scheme: &str, element: &str, (order, step): (f64, f64)) {
    let middle = Vector::<D>::repeat(0.5);
    let (mut top, mut held) = (middle, middle);
    (top[D - 1], held[0]) = (1.0, 1.0);
    let found = [step, 0.5 * step].map(|step| {
        let results = run(session, &case::<D>(scheme, element, step))?;
        let probes = results.table("probes.csv");
        let driven = errors(&probes, "held", held);
        assert!(driven.iter().all(|error| *error < 1e-12), "{scheme} {element}: driven points {driven:?}");
        let (a, b) = (errors(&probes, "middle", middle), errors(&probes, "top", top));
        Some([a[0] + b[0], a[1] + b[1]])
    });
    let [Some(coarse), Some(fine)] = found else { return };
    let rates = [0, 1].map(|k| (coarse[k] / fine[k]).log2());
    println!("{scheme} {element}: errors {fine:?} rates {rates:.2?}");
    assert!(rates.iter().all(|rate| (rate - order).abs() < 0.1), "{scheme} {element}: rates {rates:?}");
}

/// At the start of the motion inertia balances the loads row by row: the support reactions are
/// zero.
pub fn start(session: &Rc<Session>) {
    for element in ["quad4", "tri6"] {
        let Some(results) = run(session, &case::<2>("newmark: {}", element, 0.3)) else { continue };
        let reactions = results.table("reactions.csv");
        for name in ["force_x", "force_y"] {
            let column = reactions.column(name);
            let scale = column.iter().fold(0.0f64, |most, force| most.max(force.abs()));
            assert!(column[..2].iter().all(|force| force.abs() < 1e-9 * scale), "{element}: {column:?}");
        }
    }
}
