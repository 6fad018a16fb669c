//! Elastic slip under the return map, and the multiplier that takes it away.

use super::{ContactLaw, Manner};
use crate::contact::friction::traction::{Slip, rotate};
use crate::contact::history::History;
use crate::tensor::Vector;

/// Stick by the return map, whose elastic slip a multiplier may take away:
/// `t = R (lambda - k e_old) - k ds` (2.41).
pub(super) struct ElasticStick<const D: usize> {
    /// `1 / k` \[m/Pa\]; zero in the velocity form and without friction.
    pub compliance: f64,
    /// `lambda` at the start of the step \[Pa\]; `None` if friction is not augmented.
    multiplier: Option<Vector<D>>,
    /// Elastic slip at the start of the step \[m\].
    slip: Vector<D>,
}

impl<const D: usize> ElasticStick<D> {
    pub fn new(law: &ContactLaw, history: &History<D>, manner: &Manner<D>) -> Self {
        let stiffness = law.friction.and_then(|friction| friction.regularization.stiffness());
        let compliance = stiffness.map_or(0.0, |stiffness| 1.0 / stiffness.value);
        let multiplier = manner.multiplier.filter(|_| compliance > 0.0);
        Self { compliance, multiplier, slip: history.elastic_slip }
    }

    /// Traction from which the return map starts: that at the end of the last step, or the
    /// multiplier without what the elastic slip takes away.
    pub fn old_traction(&self, history: &History<D>) -> Vector<D> {
        self.multiplier
            .map_or(history.friction_traction, |multiplier| multiplier - self.slip / self.compliance)
    }

    /// Elastic slip at the end, and the traction at the end carried back to the start.
    pub fn ends(&self, traction: &Vector<D>, slip: &Slip<'_, D>) -> [Vector<D>; 2] {
        match self.multiplier {
            Some(multiplier) => {
                let held = rotate(&multiplier, slip.old_normal, slip.normal).0;
                let back = rotate(traction, slip.normal, slip.old_normal).0;
                [(held - traction) * self.compliance, back]
            }
            None => [traction * -self.compliance, Vector::zeros()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::friction::traction::{Branch, FrictionTraction};
    use crate::contact::friction::{Bound, Regularization};
    use crate::taylor::scatter;
    use crate::tensor::tangential_projector;

    const STIFFNESS: f64 = 4.0;

    fn vector<const D: usize>(seed: u32) -> Vector<D> {
        Vector::from_column_slice(&scatter(D, seed))
    }

    fn across<const D: usize>(seed: u32, normal: &Vector<D>) -> Vector<D> {
        tangential_projector(normal) * vector::<D>(seed)
    }

    /// A point that sticks or slips at this bound, from a state with elastic slip and a multiplier.
    fn answer<const D: usize>(
        bound: f64,
    ) -> (ElasticStick<D>, [Vector<D>; 3], FrictionTraction<D>, [Vector<D>; 2]) {
        let old_normal = vector::<D>(1).normalize();
        let normal = (old_normal + vector::<D>(2) * 0.3).normalize();
        let increment = vector::<D>(3) * 0.1;
        let stick = ElasticStick {
            compliance: 1.0 / STIFFNESS,
            multiplier: Some(across(4, &old_normal)),
            slip: across(5, &old_normal) * 0.1,
        };
        let old = stick.old_traction(&History::default());
        let slip = Slip {
            normal: &normal,
            velocity: &increment,
            increment: &increment,
            old_traction: &old,
            old_normal: &old_normal,
        };
        let bound = Bound { value: bound, ..Bound::default() };
        let answer = Regularization::stick_stiffness(STIFFNESS).traction(&bound, &slip, Branch::Actual);
        let ends = stick.ends(&answer.traction, &slip);
        (stick, [old_normal, normal, increment], answer, ends)
    }

    fn follows_the_slip<const D: usize>() {
        let (stick, [old_normal, normal, increment], sticks, [elastic, back]) = answer::<D>(1e3);
        let rotated = rotate(&stick.slip, &old_normal, &normal).0;
        let slipped = tangential_projector(&normal) * increment;
        assert!(!sticks.slips && (elastic - rotated - slipped).norm() < 1e-14);
        assert!((rotate(&back, &old_normal, &normal).0 - sticks.traction).norm() < 1e-14);
        assert!(back.dot(&old_normal).abs() < 1e-14);
        // What does not become elastic slip becomes heat at the bound.
        let bound = 0.3 * sticks.traction.norm();
        let (_, _, slips, [elastic, _]) = answer::<D>(bound);
        let plastic = rotated + slipped - elastic;
        assert!(slips.slips && (-slips.traction.dot(&plastic) - slips.plastic_work).abs() < 1e-14);
    }

    /// In stick the elastic slip grows by the slip of the step. In slip the rest of it is the plastic
    /// slip, whose work is the heat. The traction at the end is carried back as the multiplier is
    /// carried forward.
    #[test]
    fn elastic_slip_is_what_unloading_gives_back() {
        follows_the_slip::<2>();
        follows_the_slip::<3>();
    }

    /// Without a multiplier the return map starts from the traction of the last step.
    #[test]
    fn without_a_multiplier_the_last_traction_is_continued() {
        let stick = ElasticStick { compliance: 0.25, multiplier: None, slip: Vector::<2>::new(1.0, 2.0) };
        let last = Vector::<2>::new(3.0, -1.0);
        let history = History { friction_traction: last, ..History::default() };
        assert_eq!(stick.old_traction(&history), last);
    }
}
