//! Statics: order of convergence of every element to a manufactured solution, and patches under
//! pressure.

use std::rc::Rc;

use contact_petsc::mesh::ElementKind::{self, *};
use contact_petsc::model::LoadKind;
use contact_petsc::petsc::Session;

use super::scene::{Scene, Solid, function, lame, load, support};
use super::wave::Wave;

const NH: &str = "neo_hookean";
const SVK: &str = "saint_venant_kirchhoff";

/// Two meshes, the second twice as fine.
type Row = (Solid, u32);

pub fn plane_elements(session: &Rc<Session>) {
    const ROWS: [Row; 14] = [
        (Solid::new(Quad4, NH), 10),
        (Solid::new(Quad4, SVK), 10),
        (Solid::new(Quad4, SVK).linear(), 10),
        (Solid::new(Quad4, NH).reduced(), 10),
        (Solid::new(Quad4, SVK).reduced(), 10),
        (Solid::new(Quad4, SVK).linear().reduced(), 10),
        (Solid::new(Tri3, NH), 12),
        (Solid::new(Tri3, SVK), 12),
        (Solid::new(Quad8, NH), 6),
        (Solid::new(Quad8, SVK), 6),
        (Solid::new(Quad9, NH), 6),
        (Solid::new(Quad9, SVK).linear(), 6),
        (Solid::new(Tri6, NH), 6),
        (Solid::new(Tri6, SVK), 6),
    ];
    ROWS.iter().for_each(|row| converges::<2>(session, row));
}

pub fn solid_elements(session: &Rc<Session>) {
    const ROWS: [Row; 12] = [
        (Solid::new(Pyramid5, NH), 4),
        (Solid::new(Pyramid5, SVK).linear(), 4),
        (Solid::new(Wedge6, NH), 5),
        (Solid::new(Wedge6, SVK).linear(), 5),
        (Solid::new(Hex8, NH), 5),
        (Solid::new(Hex8, NH).reduced(), 5),
        (Solid::new(Hex8, SVK).linear(), 5),
        (Solid::new(Tet4, SVK), 5),
        (Solid::new(Hex20, NH), 7),
        (Solid::new(Hex27, SVK), 3),
        (Solid::new(Tet10, NH), 3),
        (Solid::new(Tet10, SVK).linear(), 3),
    ];
    ROWS.iter().for_each(|row| converges::<3>(session, row));
}

/// Bends the mesh smoothly, so that no element has right angles or parallel sides.
fn bend<const D: usize>(point: &mut [f64; D]) {
    let old = *point;
    for i in 0..D {
        let (next, last) = (old[(i + 1) % D], old[(i + 2) % D]);
        point[i] += 0.06 * (2.0 * next + 1.5 * old[i] + 0.5 * last).sin();
    }
}

fn converges<const D: usize>(session: &Rc<Session>, (solid, cells): &Row) {
    let [coarse, fine] = [*cells, 2 * cells].map(|cells| error::<D>(session, solid, cells));
    let rate = (coarse / fine).log2();
    let order = if matches!(solid.kind, Quad4 | Tri3 | Hex8 | Tet4 | Wedge6 | Pyramid5) { 2.0 } else { 3.0 };
    if session.rank() == 0 {
        let Solid { kind, law, kinematics, locking } = solid;
        println!("{kind} {law} {kinematics:?} {locking:?}: {coarse:.2e} {fine:.2e} rate {rate:.2}");
    }
    // Serendipity elements fall from a higher order to theirs: hex20 needs a finer pair.
    assert!((rate - order).abs() < 0.1, "{solid:?}: rate {rate}");
}

/// Error of the displacement in the L2 norm.
fn error<const D: usize>(session: &Rc<Session>, solid: &Solid, cells: u32) -> f64 {
    let wave = Wave::<D>::new();
    let mut model = solid.model();
    wave.impose(solid, &mut model);
    let scene = Scene::equilibrium(session, solid.mesh(cells, bend), &model);
    let u = scene.stage.trial.u.local();
    let [square] = scene.integrate([&u[..]], |x, [u]| [(u - wave.displacement(x)).norm_squared()]);
    square.sqrt()
}

/// A homogeneous stretch under a follower pressure is exact on distorted meshes of every element.
pub fn patches(session: &Rc<Session>) {
    for kind in [Quad4, Quad8, Quad9, Tri3, Tri6] {
        patch::<2>(session, &Solid::new(kind, NH));
        patch::<2>(session, &Solid::new(kind, SVK));
    }
    for kind in [Hex8, Hex20, Hex27, Tet4, Tet10, Wedge6, Pyramid5] {
        patch::<3>(session, &Solid::new(kind, NH));
    }
    for solid in [Solid::new(Quad4, SVK), Solid::new(Quad4, SVK).linear(), Solid::new(Quad4, NH)] {
        patch::<2>(session, &solid.reduced());
    }
    patch::<3>(session, &Solid::new(Hex8, NH).reduced());
    patch::<3>(session, &Solid::new(Hex8, SVK).linear());
}

/// Pressure that causes the stretch `s` in all `D` directions [Pa].
fn pressure<const D: usize>(solid: &Solid, s: f64) -> f64 {
    use contact_petsc::element::Kinematics::Linear;
    let ((lambda, mu), d) = (lame(), D as f64);
    // First Piola-Kirchhoff stress.
    let p = match (solid.kinematics, solid.law) {
        (Linear, _) => (lambda * d + 2.0 * mu) * (s - 1.0),
        (_, NH) => mu * (s - 1.0 / s) + lambda * d * s.ln() / s,
        _ => s * (lambda * d + 2.0 * mu) * 0.5 * (s * s - 1.0),
    };
    let area = if solid.kinematics == Linear { 1.0 } else { s.powi(D as i32 - 1) };
    -p / area
}

/// Moves inner points only. The quadrature does not integrate a curved tet10 exactly.
fn shift<const D: usize>(kind: ElementKind) -> impl Fn(&mut [f64; D]) {
    let size = if kind == Tet10 { 0.0 } else { 0.8 };
    move |point| {
        let bubble: f64 = point.iter().map(|x| x * (1.0 - x)).product();
        let old = *point;
        (0..D).for_each(|i| point[i] += size * bubble * (0.5 - old[(i + 1) % D] + 0.3 * old[i]));
    }
}

fn patch<const D: usize>(session: &Rc<Session>, solid: &Solid) {
    let stretch = 0.93;
    let mut model = solid.model::<D>();
    for (axis, set) in ["block.left", if D == 2 { "block.bottom" } else { "block.front" }, "block.bottom"]
        .into_iter()
        .enumerate()
        .take(D)
    {
        model.supports.push(support(set, std::array::from_fn(|i| if i == axis { "0" } else { "" })));
    }
    let value = pressure::<D>(solid, stretch);
    for set in ["block.right", "block.top", "block.back"].into_iter().take(D) {
        model.loads.push(load(set, LoadKind::Pressure(function(&format!("{value:?}")))));
    }
    let scene = Scene::equilibrium(session, solid.mesh(3, shift(solid.kind)), &model);
    let u = scene.stage.trial.u.local();
    let local = scene.local();
    let exact = local.mesh.points.iter().flatten().map(|x| (stretch - 1.0) * x);
    let worst = u.iter().zip(exact).map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-9, "{solid:?}: {worst:.1e}");
}
