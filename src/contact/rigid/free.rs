//! A rigid body whose degrees of freedom are solved for (theory, section 1.13).
//!
//! Its unknowns are the displacement `d` of the centre of mass and the vector `s` \[m\] with
//! `ds_i = L_i dpsi_i`. Here `psi` is the rotation vector of a step in the body frame, `R = R_n exp(psi)`,
//! and `L_i = sqrt(J_i / m)` are the radii of gyration about the principal axes, which are the axes
//! `Q e_i` of the reference configuration: `dpsi = Q (ds_i / L_i)`. The mass of every unknown is then
//! `m`, and all unknowns are lengths. In 2D the first component of `s` belongs to
//! the rotation about z, and the second one is zero.

use nalgebra::{UnitQuaternion, Vector3};

use super::placement::{Placement, rotation_about};
use crate::tensor::{Tensor, Vector, cross};

/// Mass and tensor of inertia of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass [kg, per metre of depth in 2D].
    pub mass: f64,
    /// Tensor of inertia about the centre of mass in the reference configuration [kg m2, per metre of
    /// depth in 2D]. In 2D only the last entry is used.
    pub inertia: Tensor<3>,
}

/// The kinematics of a free rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeRigid<const D: usize> {
    /// Centre of mass in the reference configuration \[m\], which is the reference point.
    pub centre: Vector<D>,
    /// Lengths `L_i` of the rotations \[m\]. In 2D the second one is not used.
    pub lengths: [f64; D],
    /// Axes of the rotations in the reference configuration, as columns; the unit matrix in 2D.
    pub axes: Tensor<3>,
}

/// How the rotation of a free body varies with its unknowns, as skew tensors in the body frame
/// \[1/m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseVariations<const D: usize> {
    /// Axis of each unknown divided by its length: the work of a moment along `ds_i`, and the
    /// derivative of the angular velocity by the rate of `s_i`.
    pub axes: [Tensor<D>; D],
    /// `R^T dR/ds_i` at the iterate.
    pub turns: [Tensor<D>; D],
}

impl<const D: usize> FreeRigid<D> {
    /// Number of rotations: one in the plane, three in space.
    pub const ROTATIONS: usize = if D == 2 { 1 } else { 3 };

    /// The radii of gyration about these axes of rotations \[m\].
    pub fn radii_of_gyration(mass: &MassProperties, axes: &Tensor<3>) -> [f64; D] {
        std::array::from_fn(|i| {
            let axis = axes.column(Self::axis(i));
            (axis.dot(&(mass.inertia * axis)) / mass.mass).sqrt()
        })
    }

    /// Axis of rotation number `i`: x, y or z.
    pub fn axis(i: usize) -> usize {
        if D == 2 { 2 } else { i }
    }

    /// The vector about the axes with these components.
    fn about(&self, components: impl Fn(usize) -> f64) -> Vector3<f64> {
        let mut vector = Vector3::zeros();
        (0..Self::ROTATIONS).for_each(|i| vector += self.axes.column(Self::axis(i)) * components(i));
        vector
    }

    /// Component of a vector in the body frame along the axis of rotation number `i`.
    fn along(&self, i: usize, vector: &Vector3<f64>) -> f64 {
        self.axes.column(Self::axis(i)).dot(vector)
    }

    /// Change of `s` \[m\] for a rotation vector in the body frame \[rad\].
    pub fn change(&self, turn: &Vector3<f64>) -> Vector<D> {
        let mut change = Vector::zeros();
        (0..Self::ROTATIONS).for_each(|i| change[i] = self.along(i, turn) * self.lengths[i]);
        change
    }

    /// Rotation vector of a step \[rad\] whose `s` changes by this \[m\].
    pub fn step_vector(&self, change: &Vector<D>) -> [f64; 3] {
        self.about(|i| change[i] / self.lengths[i]).into()
    }

    /// Angular velocity in the body frame \[rad/s\] for this rate of `s` \[m/s\].
    pub fn angular_velocity(&self, rate: &Vector<D>) -> [f64; 3] {
        self.step_vector(rate)
    }

    /// Orientation at the end of a step that begins with `orientation`.
    pub fn turned(&self, orientation: &UnitQuaternion<f64>, change: &Vector<D>) -> UnitQuaternion<f64> {
        let step = UnitQuaternion::from_scaled_axis(Vector3::from(self.step_vector(change)));
        let mut turned = orientation * step;
        turned.renormalize();
        turned
    }

    /// Position and velocity. `s` is the rotation unknown, of which 2D uses the total value, and
    /// `orientation` the rotation of a body in space.
    pub fn placement(
        &self,
        orientation: &UnitQuaternion<f64>,
        translation: Vector<D>,
        s: &Vector<D>,
        velocity: Vector<D>,
        rate: &Vector<D>,
    ) -> Placement<D> {
        let rotation = if D == 2 {
            rotation_about(&skew(&Vector3::z()), s[0] / self.lengths[0])
        } else {
            let matrix = orientation.to_rotation_matrix();
            Tensor::from_fn(|i, j| matrix[(i, j)])
        };
        let spin = skew(&Vector3::from(self.angular_velocity(rate)));
        Placement { translation, rotation, velocity, spin }
    }

    /// Variations of the rotation at the end of a step whose `s` has changed by this \[m\].
    ///
    /// `exp(-psi) d exp(psi) = (J dpsi)` as a skew tensor, with `J = 1 - (1 - cos a) / a^2 psi + (a - sin
    /// a) / a^3 psi psi` for the angle `a = |psi|` and `psi` as a skew tensor.
    pub fn variations(&self, change: &Vector<D>) -> PoseVariations<D> {
        let step = Vector3::from(self.step_vector(change));
        let jacobian = right_jacobian(&step);
        let mut variations = PoseVariations { axes: [Tensor::zeros(); D], turns: [Tensor::zeros(); D] };
        for i in 0..Self::ROTATIONS {
            let axis = self.about(|k| if k == i { 1.0 / self.lengths[i] } else { 0.0 });
            variations.axes[i] = skew(&axis);
            variations.turns[i] = skew(&(jacobian * axis));
        }
        variations
    }

    /// Components along `s` of a moment in the body frame \[N m\] as forces \[N\].
    pub fn components(&self, moment: &[f64; 3]) -> Vector<D> {
        let mut forces = Vector::zeros();
        let moment = Vector3::from(*moment);
        (0..Self::ROTATIONS).for_each(|i| forces[i] = self.along(i, &moment) / self.lengths[i]);
        forces
    }

    /// Gyroscopic moment `W x J W` along `s` \[N\] at the rate of `s` \[m/s\], and its derivative by
    /// that rate [N s/m]. Zero in 2D.
    pub fn gyroscopic(&self, mass: &MassProperties, rate: &Vector<D>) -> (Vector<D>, Tensor<D>) {
        if D == 2 {
            return (Vector::zeros(), Tensor::zeros());
        }
        let inertia = &mass.inertia;
        let spin = Vector3::from(self.angular_velocity(rate));
        let momentum = inertia * spin;
        let mut derivative = Tensor::<D>::zeros();
        for j in 0..Self::ROTATIONS {
            let axis = self.about(|k| if k == j { 1.0 / self.lengths[j] } else { 0.0 });
            let by = cross(&axis, &momentum) + cross(&spin, &(inertia * axis));
            derivative.set_column(j, &self.components(&by.into()));
        }
        (self.components(&cross(&spin, &momentum).into()), derivative)
    }
}

/// Axes for which a tensor of inertia has no products: the principal axes, as columns. A rotation about
/// an axis x, y or z that is fixed keeps this axis, and the two others are turned about it. Axes of a
/// tensor without products, and axes in pairs of equal moments, are not turned.
///
/// Jacobi's method: each pair of axes is turned until its product is zero. nalgebra's `SymmetricEigen`
/// would also permute and mirror the axes of a diagonal tensor, and cannot keep a fixed axis.
pub fn principal_axes(inertia: &Tensor<3>, fixed: [bool; 3]) -> Tensor<3> {
    /// Sweeps over all pairs. The method converges quadratically: four are enough for rounding.
    const SWEEPS: usize = 12;
    let mut axes = Tensor::<3>::identity();
    for _ in 0..SWEEPS {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if fixed[i] || fixed[j] {
                continue;
            }
            let (one, other) = (axes.column(i).into_owned(), axes.column(j).into_owned());
            let product = one.dot(&(inertia * other));
            if product.abs() <= f64::EPSILON * inertia.norm() {
                continue;
            }
            let difference = other.dot(&(inertia * other)) - one.dot(&(inertia * one));
            let angle = 0.5 * (2.0 * product).atan2(difference);
            // The smaller of both angles that remove the product.
            let quarter = std::f64::consts::FRAC_PI_2;
            let angle = angle - quarter * (angle / quarter).round();
            let (sine, cosine) = angle.sin_cos();
            axes.set_column(i, &(one * cosine - other * sine));
            axes.set_column(j, &(one * sine + other * cosine));
        }
    }
    axes
}

/// The skew tensor `w x`. In 2D only the last component acts.
fn skew<const D: usize>(w: &Vector3<f64>) -> Tensor<D> {
    let full = w.cross_matrix();
    Tensor::from_fn(|i, j| full[(i, j)])
}

/// `J` with `exp(-psi) d exp(psi) = J dpsi`.
fn right_jacobian(psi: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    /// Angle \[rad\] below which the series are exact to rounding: their first omitted terms are the
    /// angle to the fourth power over 720 and 5040.
    const SMALL: f64 = 1e-3;
    let angle = psi.norm();
    let square = angle * angle;
    let [first, second] = if angle < SMALL {
        [0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0]
    } else {
        let half = (0.5 * angle).sin();
        [2.0 * half * half / square, (angle - angle.sin()) / (square * angle)]
    };
    let matrix = psi.cross_matrix();
    nalgebra::Matrix3::identity() - matrix * first + matrix * matrix * second
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body<const D: usize>() -> FreeRigid<D> {
        FreeRigid {
            centre: Vector::zeros(),
            lengths: std::array::from_fn(|i| 0.5 + 0.3 * i as f64),
            axes: if D == 2 { Tensor::<3>::identity() } else { principal_axes(&skewed(), [false; 3]) },
        }
    }

    /// A tensor of inertia with products.
    fn skewed() -> Tensor<3> {
        Tensor::<3>::new(0.6, 0.1, -0.05, 0.1, 0.8, 0.2, -0.05, 0.2, 0.9)
    }

    /// Principal axes are a rotation that removes the products. A fixed axis stays, and so does a
    /// diagonal tensor.
    #[test]
    fn principal_axes_remove_products() {
        let off = |axes: &Tensor<3>, i: usize, j: usize| (axes.transpose() * skewed() * axes)[(i, j)].abs();
        for (fixed, pairs) in [
            ([false; 3], &[(0, 1), (0, 2), (1, 2)][..]),
            ([true, false, false], &[(1, 2)]),
            ([false, true, false], &[(0, 2)]),
            ([true, false, true], &[]),
        ] {
            let axes = principal_axes(&skewed(), fixed);
            assert!((axes.transpose() * axes - Tensor::<3>::identity()).norm() < 1e-15);
            assert!((axes.determinant() - 1.0).abs() < 1e-15);
            assert!(pairs.iter().all(|&(i, j)| off(&axes, i, j) < 1e-15), "{axes}");
            (0..3).filter(|&i| fixed[i]).for_each(|i| assert_eq!(axes[(i, i)], 1.0));
        }
        let plain = Tensor::<3>::from_diagonal(&Vector::<3>::new(3.0, 1.0, 1.0));
        assert_eq!(principal_axes(&plain, [false; 3]), Tensor::<3>::identity());
    }

    /// `R^T dR` is the sum of the turns, for small and large rotations of a step.
    #[test]
    fn turns_are_derivatives_of_the_rotation() {
        fn check<const D: usize>() {
            let body = body::<D>();
            let start = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.5, 0.4));
            for size in [1e-5, 0.3, 1.9] {
                let change = Vector::<D>::from_fn(|i, _| size * (0.4 - 0.3 * i as f64));
                let rotation = |change: &Vector<D>| {
                    let zero = Vector::zeros();
                    body.placement(&body.turned(&start, change), zero, change, zero, &zero).rotation
                };
                let turns = body.variations(&change).turns;
                for (k, turn) in turns.iter().enumerate().take(FreeRigid::<D>::ROTATIONS) {
                    let h = 1e-5;
                    let mut ends = [change; 2];
                    ends[0][k] -= h;
                    ends[1][k] += h;
                    let by = (rotation(&ends[1]) - rotation(&ends[0])) / (2.0 * h);
                    let apart = rotation(&change).transpose() * by - turn;
                    assert!(apart.norm() < 1e-8, "{D} {size} {k}: {apart}");
                }
            }
        }
        check::<2>();
        check::<3>();
    }

    /// The derivative of the gyroscopic moment has order two in a Taylor test. The moment does no
    /// work and vanishes for rotations about a principal axis.
    #[test]
    fn the_gyroscopic_moment_does_no_work() {
        let mass = MassProperties { mass: 2.0, inertia: skewed() };
        let axes = principal_axes(&mass.inertia, [false; 3]);
        let lengths = FreeRigid::<3>::radii_of_gyration(&mass, &axes);
        let body = FreeRigid::<3> { centre: Vector::zeros(), lengths, axes };
        let rate = Vector::<3>::new(0.3, -0.8, 0.5);
        let way = Vector::<3>::new(-0.2, 0.4, 0.7);
        let (force, derivative) = body.gyroscopic(&mass, &rate);
        assert!(force.norm() > 1e-2 && force.dot(&rate).abs() < 1e-15);
        let errors = [1e-2, 1e-3]
            .map(|h| (body.gyroscopic(&mass, &(rate + way * h)).0 - force - derivative * way * h).norm());
        let order = (errors[0] / errors[1]).log10();
        assert!((order - 2.0).abs() < 1e-3, "{order}");
        assert!(body.gyroscopic(&mass, &Vector::<3>::y()).0.norm() < 1e-15);
    }
}
