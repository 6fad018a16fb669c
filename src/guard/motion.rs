//! Limits the motion of surfaces in contact to about one facet per step. If surfaces slide farther
//! with friction, or the contact zone rolls farther, the step converges to a different equilibrium.

use serde::{Deserialize, Serialize};

use super::slide::Slide;
use crate::case::Units;

/// Default limit in facets per step: one, with a margin for steps that are meant to be one facet
/// long. The error of the friction of a wheel that rolls on a slab is 8 % at one facet, 20 % at 1.6
/// and 45 % at three; at six its sign is wrong.
const FACETS: f64 = 1.25;

/// Fraction that detects a jump of a centre of contact, for example to another corner. If halving
/// the step leaves more than this fraction of the distance, the centre has jumped, and a shorter
/// step does not help.
const JUMP: f64 = 0.75;

/// The largest motion of any contact in a step, in facets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionGuard {
    contact: String,
    facets: f64,
    /// Distance \[m\].
    way: f64,
    rolls: bool,
}

impl MotionGuard {
    fn describe(&self, units: Units) -> String {
        let verb = if self.rolls { "rolled" } else { "slid" };
        format!(
            "the surfaces of contact '{}' {verb} by {:.3e} {}, {:.1} facets",
            self.contact,
            self.way,
            units.of("m"),
            self.facets
        )
    }
}

/// Monitors the motion of contacts from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionWatch {
    limit: f64,
    /// Centres of contact at the end of the last accepted step \[m\].
    centres: Vec<Option<[f64; 3]>>,
    /// Facets per second in that step.
    rate: f64,
    /// Number of facets by which each contact zone rolled when this exceeded the limit, in the last
    /// rejected attempt at the present step.
    rejected: Vec<Option<f64>>,
    /// Number of accepted steps beyond the limit, and the one farthest beyond it: its number and
    /// its motion.
    beyond: u64,
    worst: Option<(u64, MotionGuard)>,
}

impl MotionWatch {
    /// A monitor that allows `limit` facets per step, or the default.
    pub fn new(limit: Option<f64>) -> Self {
        let limit = limit.unwrap_or(FACETS);
        Self { limit, centres: Vec::new(), rate: 0.0, rejected: Vec::new(), beyond: 0, worst: None }
    }

    /// Whether a step of `dt` \[s\] would exceed the limit if surfaces continue to move as in the
    /// last step.
    pub fn foresees(&self, dt: f64) -> bool {
        self.rate * dt > self.limit
    }

    /// Why a solved step exceeds the limit; `None` if a shorter step would not help.
    pub fn objection(&mut self, slides: &[Slide], units: Units) -> Option<String> {
        let motion = self.largest(slides).filter(|motion| motion.facets > self.limit)?;
        let mut rejected = vec![None; slides.len()];
        for (k, rolled) in self.motions(slides).filter(|(_, motion)| motion.rolls) {
            rejected[k] = (rolled.facets > self.limit).then_some(rolled.facets);
        }
        self.rejected = rejected;
        Some(format!("{}; {:.2} are allowed per step", motion.describe(units), self.limit))
    }

    /// Records an accepted step: its number and its length \[s\].
    pub fn accept(&mut self, slides: &[Slide], step: u64, dt: f64) {
        let largest = self.largest(slides);
        self.rate = largest.as_ref().map_or(0.0, |motion| motion.facets / dt);
        self.rejected.clear();
        self.centres = slides.iter().map(|slide| slide.centre).collect();
        let Some(motion) = largest.filter(|motion| motion.facets > self.limit) else { return };
        self.beyond += 1;
        if self.worst.as_ref().is_none_or(|(_, worst)| worst.facets < motion.facets) {
            self.worst = Some((step, motion));
        }
    }

    /// The warning at the end of a run, if steps exceeded the limit and could not be cut.
    pub fn warning(&self, units: Units) -> Option<String> {
        let (step, motion) = self.worst.as_ref()?;
        Some(format!(
            "warning: {} in step {step}, and by more than {:.2} facets in {} steps that could not be cut \
             further: their friction depends on the step length\n\
             hint: use a shorter step, or a larger `time.cuts`",
            motion.describe(units),
            self.limit,
            self.beyond
        ))
    }

    /// The contact that moved by the most facets. Jumps are excluded: they do not predict shorter
    /// steps or the next step.
    fn largest(&self, slides: &[Slide]) -> Option<MotionGuard> {
        let motions =
            self.motions(slides).filter(|(k, motion)| motion.way > 0.0 && !self.is_jump(*k, motion));
        motions.map(|(_, motion)| motion).max_by(|a, b| a.facets.total_cmp(&b.facets))
    }

    /// Whether the zone of the contact `k` moves nearly as far as in the longer attempt before.
    fn is_jump(&self, k: usize, motion: &MotionGuard) -> bool {
        let before = self.rejected.get(k).copied().flatten();
        motion.rolls && before.is_some_and(|before| motion.facets > JUMP * before)
    }

    /// How far each contact slid and rolled, with its number. A zone rolls by at most the motion of
    /// its surfaces, because in chattering contact the centre moves without them.
    fn motions(&self, slides: &[Slide]) -> impl Iterator<Item = (usize, MotionGuard)> {
        slides.iter().enumerate().flat_map(|(k, slide)| {
            let before = self.centres.get(k).copied().flatten();
            let rolled = before.zip(slide.centre).map_or(0.0, |(before, now)| {
                before.iter().zip(now).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            });
            let motion = |way: f64, rolls: bool| MotionGuard {
                contact: slide.contact.clone(),
                facets: way / slide.facet,
                way,
                rolls,
            };
            [(k, motion(slide.slid, false)), (k, motion(rolled.min(slide.motion), true))]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slide(slid: f64, centre: f64, motion: f64) -> Slide {
        Slide { contact: "sole".into(), facet: 0.1, motion, slid, centre: Some([centre, 0.0, 0.0]) }
    }

    /// Sliding beyond the limit is rejected in a step of any length. If the step is accepted
    /// nevertheless, it appears in the warning and predicts the motion of the next step.
    #[test]
    fn sliding_is_kept_to_a_facet() {
        let mut watch = MotionWatch::new(None);
        assert_eq!(watch.objection(&[slide(0.1, 0.0, 0.1)], Units::default()), None);
        watch.accept(&[slide(0.1, 0.0, 0.1)], 1, 0.5);
        assert!(!watch.foresees(0.5) && watch.foresees(1.0));
        for _ in 0..3 {
            let why = watch.objection(&[slide(0.5, 0.0, 0.5)], Units::default()).expect("an objection");
            assert!(why.contains("slid by 5.000e-1 m, 5.0 facets; 1.25 are allowed"), "{why}");
        }
        assert_eq!(watch.warning(Units::default()), None);
        watch.accept(&[slide(0.3, 0.0, 0.3)], 2, 0.5);
        watch.accept(&[slide(0.5, 0.0, 0.5)], 3, 0.5);
        let text = watch.warning(Units::default()).expect("a warning");
        assert!(text.contains("5.0 facets in step 3, and by more than 1.25 facets in 2 steps"), "{text}");
        assert_eq!(MotionWatch::new(Some(6.0)).objection(&[slide(0.5, 0.0, 0.5)], Units::default()), None);
    }

    /// The motion of a rolling zone is limited to a facet. A zone is not rejected if it jumps after
    /// one shorter attempt, if its bodies hardly move, or if it has just closed.
    #[test]
    fn rolling_is_kept_to_a_facet_and_jumps_are_not() {
        let mut watch = MotionWatch::new(None);
        assert_eq!(watch.objection(&[slide(0.0, 3.0, 1.0)], Units::default()), None, "just closed");
        watch.accept(&[slide(0.0, 0.0, 1.0)], 1, 1.0);
        assert!(
            watch
                .objection(&[slide(0.0, 0.4, 1.0)], Units::default())
                .is_some_and(|why| why.contains("rolled by 4.000e-1 m"))
        );
        assert!(
            watch.objection(&[slide(0.0, 0.2, 1.0)], Units::default()).is_some(),
            "half of it in half of the step"
        );
        assert_eq!(watch.objection(&[slide(0.0, 0.1, 1.0)], Units::default()), None);
        watch.accept(&[slide(0.0, 0.1, 1.0)], 2, 0.25);
        assert!(watch.objection(&[slide(0.0, 1.0, 1.0)], Units::default()).is_some());
        assert_eq!(watch.objection(&[slide(0.0, 1.0, 1.0)], Units::default()), None, "a jump");
        watch.accept(&[slide(0.0, 1.0, 1.0)], 3, 0.1);
        assert!(!watch.foresees(10.0) && watch.warning(Units::default()).is_none());
        assert_eq!(watch.objection(&[slide(0.0, 3.0, 0.01)], Units::default()), None, "rattles");
    }

    /// A contact that jumps does not exempt another that slides or rolls too far, before or after
    /// the step is accepted.
    #[test]
    fn a_jump_exempts_its_own_contact_only() {
        let other = |slid: f64, centre: f64| Slide { contact: "heel".into(), ..slide(slid, centre, 1.0) };
        let mut watch = MotionWatch::new(None);
        watch.accept(&[slide(0.0, 0.0, 1.0), other(0.0, 0.0)], 1, 1.0);
        let mut objection = |slides: [Slide; 2]| watch.objection(&slides, Units::default());
        assert!(objection([slide(0.0, 1.0, 1.0), other(0.4, 0.0)]).is_some_and(|why| why.contains("sole")));
        let why = objection([slide(0.0, 1.0, 1.0), other(0.2, 0.0)]).expect("heel slides");
        assert!(why.contains("'heel' slid by 2.000e-1"), "{why}");
        assert_eq!(objection([slide(0.0, 1.0, 1.0), other(0.1, 0.0)]), None);
        assert!(objection([slide(0.0, 1.0, 1.0), other(0.0, 0.3)]).is_some_and(|why| why.contains("heel")));
        assert!(objection([slide(0.0, 1.0, 1.0), other(0.0, 0.15)]).is_some_and(|why| why.contains("heel")));
        watch.accept(&[slide(0.0, 1.0, 1.0), other(0.0, 0.1)], 2, 0.25);
        assert!(!watch.foresees(0.25) && watch.foresees(0.5));
    }
}
