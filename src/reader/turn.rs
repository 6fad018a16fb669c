//! Displacement of a point by a prescribed rotation and translation, with exact derivatives in time.

use super::dual::{ExpressionNumber, Motion};

/// One component of the displacement `d + R(theta) r - r` of a point at the arm `r` from the centre,
/// with `R r - r = sin(theta) k x r + (1 - cos(theta)) k x (k x r)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn<F> {
    /// Index of the component.
    pub component: usize,
    /// Point of the axis in the reference configuration \[m\].
    pub about: [f64; 3],
    /// Unit vector `k` along the axis.
    pub axis: [f64; 3],
    /// Angle `theta` \[rad\], a function of time.
    pub angle: F,
    /// Component of the translation `d` \[m\], a function of time.
    pub translation: F,
}

impl<F> Turn<F> {
    /// Displacement \[m\] of a point of the reference configuration \[m\], with its exact time
    /// derivatives, at this angle and translation.
    pub(super) fn motion(&self, point: [f64; 3], angle: Motion, translation: Motion) -> Motion {
        let arm = std::array::from_fn(|i| point[i] - self.about[i]);
        let once = cross(self.axis, arm);
        let twice = cross(self.axis, once);
        let (sin, cos) = angle.value.sin_cos();
        // The half angle loses no digits in 1 - cos.
        let versine = 2.0 * (0.5 * angle.value).sin().powi(2);
        let turned = angle.chain(sin, cos, -sin) * Motion::constant(once[self.component])
            + angle.chain(versine, sin, cos) * Motion::constant(twice[self.component]);
        turned + translation
    }

    /// The functions of time.
    pub(super) fn functions(&self) -> [&F; 2] {
        [&self.angle, &self.translation]
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::function::Function;

    /// About an axis parallel to z the displacement, its rate and its second derivative are those of
    /// the expressions in x and y, also after several revolutions.
    #[test]
    fn it_is_the_written_rotation() {
        let angle = "9 * t^2 + 0.2 * sin(t)";
        let written = [
            format!("(x - 0.3) * (cos({angle}) - 1) - (y + 0.2) * sin({angle}) + 0.1 * t^3"),
            format!("(x - 0.3) * sin({angle}) + (y + 0.2) * (cos({angle}) - 1) - 0.01"),
            "0".to_owned(),
        ];
        let translation = ["0.1 * t^3", "-0.01", "0"];
        for component in 0..3 {
            let expected = Function::expression(&written[component]).unwrap();
            let turn = Function::turn(Turn {
                component,
                about: [0.3, -0.2, 0.7],
                axis: [0.0, 0.0, 1.0],
                angle: Function::expression(angle).unwrap(),
                translation: Function::expression(translation[component]).unwrap(),
            });
            for t in [0.0, 0.4, 1.7] {
                let point = [1.1, 0.6, -0.4];
                let [a, b] = [turn.motion(point, t), expected.motion(point, t)];
                for (a, b) in [(a.value, b.value), (a.rate, b.rate), (a.second, b.second)] {
                    assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{component} at {t}: {a} {b}");
                }
                assert_eq!(turn.value(point, t), a.value);
            }
        }
    }

    /// About an inclined axis lengths and the distance along the axis are kept, and central
    /// differences approach the derivatives with order 2.
    #[test]
    fn it_is_rigid_about_an_inclined_axis() {
        let third = 1.0 / 3.0_f64.sqrt();
        let about = [0.5, 0.1, -0.3];
        let axis = [third; 3];
        let point = [1.0, -2.0, 0.5];
        let component = |component: usize| {
            let angle = Function::expression("2 * t + t^3").unwrap();
            Function::turn(Turn { component, about, axis, angle, translation: Function::constant(0.0) })
        };
        let arm: [f64; 3] = std::array::from_fn(|i| point[i] - about[i]);
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for t in [0.3, 1.1] {
            let turned: [f64; 3] = std::array::from_fn(|i| arm[i] + component(i).value(point, t));
            assert!((dot(turned, turned) - dot(arm, arm)).abs() < 1e-13);
            assert!((dot(turned, axis) - dot(arm, axis)).abs() < 1e-14);
            let turn = component(1);
            let errors = [1e-2, 5e-3].map(|h| {
                let [a, b] = [t - h, t + h].map(|t| turn.motion(point, t));
                let now = turn.motion(point, t);
                [(b.value - a.value) / (2.0 * h) - now.rate, (b.rate - a.rate) / (2.0 * h) - now.second]
            });
            for k in 0..2 {
                let order = (errors[0][k] / errors[1][k]).log2();
                assert!((order - 2.0).abs() < 0.05, "derivative {}: order {order}", k + 1);
            }
        }
    }

    /// Kinks are those of the angle and of the translation. Nothing that turns is linear in time.
    #[test]
    fn it_has_the_kinks_of_its_functions() {
        let turn = |angle: Function| Turn::<Function> {
            component: 0,
            about: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            angle,
            translation: Function::table(vec![[0.5, 0.0], [0.7, 0.0]]).unwrap(),
        };
        let moving = Function::turn(turn(Function::table(vec![[0.0, 0.0], [2.0, 1.0]]).unwrap()));
        assert_eq!(moving.kinks(), [0.0, 2.0, 0.5, 0.7]);
        assert!(!moving.is_linear_between_kinks() && !moving.is_constant_in_time() && !moving.is_zero());
        assert!(!moving.is_constant_in_space());
        let still = Function::turn(turn(Function::constant(0.5)));
        assert!(still.is_constant_in_time() && !still.is_zero());
        assert!(Function::turn(turn(Function::constant(0.0))).is_zero());
    }
}
