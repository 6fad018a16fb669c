//! A displacement with closed-form stresses: a homogeneous deformation and a wave superposed on it.
//!
//! `x = G X + d sin(k . X)`: `F = G + c d k^T` with `c = cos(k . X)` depends only on the number
//! `c`, so `Div P = -sin(k . X) dP/dc k`.

use contact_petsc::element::Kinematics;
use contact_petsc::model::{LoadKind, Model};
use contact_petsc::tensor::{Tensor, Vector, det_minus_one};

use super::scene::{DENSITY, Solid, function, lame, load, support};

/// The wave.
pub struct Wave<const D: usize> {
    background: Tensor<D>,
    direction: Vector<D>,
    wave: Vector<D>,
}

impl<const D: usize> Wave<D> {
    /// A wave on a rotated and stretched background.
    pub fn new() -> Self {
        let tilt = |i: usize, j: usize| [[0.05, -0.10, 0.04], [0.12, -0.04, 0.06], [-0.03, 0.05, 0.03]][i][j];
        Self {
            background: Tensor::from_fn(|i, j| if i == j { 1.0 } else { 0.0 } + tilt(i, j)),
            direction: Vector::from_fn(|i, _| [0.08, 0.05, -0.06][i]),
            wave: Vector::from_fn(|i, _| [1.7, 1.3, 1.1][i]),
        }
    }

    /// Displacement [m].
    pub fn displacement(&self, at: &Vector<D>) -> Vector<D> {
        (self.background - Tensor::identity()) * at + self.direction * self.wave.dot(at).sin()
    }

    fn phase(&self) -> String {
        let terms: Vec<String> =
            (0..D).map(|i| format!("({:?}) * {}", self.wave[i], ["x", "y", "z"][i])).collect();
        terms.join(" + ")
    }

    /// Prescribes the motion of the whole surface and loads the volume of the model such that the
    /// wave is the solution.
    pub fn impose(&self, solid: &Solid, model: &mut Model<D>) {
        let h = self.background - Tensor::identity();
        let components: Vec<String> = (0..D)
            .map(|i| {
                let linear = (0..D)
                    .map(|j| format!("({:?}) * {} + ", h[(i, j)], ["x", "y", "z"][j]))
                    .collect::<String>();
                format!("{linear}({:?}) * sin({})", self.direction[i], self.phase())
            })
            .collect();
        model.supports.push(support("block.surface", std::array::from_fn(|i| components[i].as_str())));
        let force = match (solid.kinematics, solid.law) {
            (Kinematics::Linear, _) => self.hooke(),
            (Kinematics::Finite, "neo_hookean") => self.neo_hookean(),
            _ => self.saint_venant_kirchhoff(),
        };
        // rho b = -Div P = sin(k . X) dP/dc k
        let body_force =
            force.map(|slope| function(&format!("sin({}) * ({slope}) / {DENSITY:?}", self.phase())));
        model.loads.push(load("block", LoadKind::BodyForce(body_force)));
    }

    /// `dP/dc k` of `P = lambda tr(eps) 1 + 2 mu eps`.
    fn hooke(&self) -> [String; D] {
        let ((lambda, mu), d, k) = (lame(), self.direction, self.wave);
        let slope = k * (lambda * d.dot(&k)) + (d * k.norm_squared() + k * d.dot(&k)) * mu;
        std::array::from_fn(|i| format!("{:?}", slope[i]))
    }

    /// `dP/dc k` of `P = F S`, a polynomial in c.
    fn saint_venant_kirchhoff(&self) -> [String; D] {
        let (lambda, mu) = lame();
        let stress = |e: Tensor<D>| Tensor::<D>::identity() * (lambda * e.trace()) + e * (2.0 * mu);
        let (g, d, k) = (self.background, self.direction, self.wave);
        let mixed = g.transpose() * d * k.transpose();
        let s0 = stress((g.transpose() * g - Tensor::identity()) * 0.5) * k;
        let s1 = stress((mixed + mixed.transpose()) * 0.5) * k;
        let s2 = stress(k * k.transpose() * (0.5 * d.norm_squared())) * k;
        let first = g * s1 + d * k.dot(&s0);
        let second = (g * s2 + d * k.dot(&s1)) * 2.0;
        let third = d * (3.0 * k.dot(&s2));
        let c = format!("cos({})", self.phase());
        std::array::from_fn(|i| {
            format!("{:?} + ({:?}) * {c} + ({:?}) * {c}^2", first[i], second[i], third[i])
        })
    }

    /// `dP/dc k` of `P = mu (F - F^-T) + lambda ln J F^-T`, where `F^-T k = G^-T k / (1 + c s)`,
    /// `s = k . G^-1 d`.
    fn neo_hookean(&self) -> [String; D] {
        let (lambda, mu) = lame();
        let (d, k) = (self.direction, self.wave);
        let det = 1.0 + det_minus_one(&(self.background - Tensor::identity()));
        let inverse = inverse(&self.background, det);
        let s = k.dot(&(inverse * d));
        let (first, normal) = (d * (mu * k.norm_squared()), inverse.transpose() * k * s);
        let stretch = format!("(1 + ({s:?}) * cos({}))", self.phase());
        std::array::from_fn(|i| {
            let (first, normal) = (first[i], normal[i]);
            format!(
                "{first:?} + ({normal:?}) * ({mu:?} + {lambda:?} * (1 - log({det:?} * {stretch}))) / {stretch}^2"
            )
        })
    }
}

/// Cayley and Hamilton: `A^-1 = (tr(A) 1 - A) / det` in 2D, `(A^2 - tr(A) A + I_2 1) / det` in 3D.
fn inverse<const D: usize>(a: &Tensor<D>, det: f64) -> Tensor<D> {
    let trace = a.trace();
    let adjugate = if D == 2 {
        Tensor::identity() * trace - a
    } else {
        let second = 0.5 * (trace * trace - (a * a).trace());
        a * a - a * trace + Tensor::identity() * second
    };
    adjugate / det
}
