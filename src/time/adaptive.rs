//! Time steps controlled by error estimates, which end at given instants.
//!
//! The error that a step adds is compared with its share of the error that may still be added until
//! the end ([`Budget`](super::Budget)). The next step is the one at which the mean of the last
//! errors would be nine tenths of that share. The mean is used because the error of an oscillation
//! rises and falls within each period, and steps need not follow it.
//!
//! Step lengths are taken from a grid, by rounding to the nearest one. Small changes of the error
//! therefore leave the step unchanged.
//!
//! A contact that opens or closes makes the velocity jump. Such a step is an event, which may spend
//! a fixed part of the budget. The estimate restarts after the event, so that the jump does not
//! reduce the step without limit.

use serde::{Deserialize, Serialize};

use super::retry::Retry;

/// Assessment of a step that was solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// Largest ratio of an error of the step to its allowed value.
    pub ratio: f64,
    /// Power of the step length with which that ratio falls.
    pub order: f64,
    /// Whether the velocity jumps in this step, or jumped just before it.
    pub event: bool,
    /// Largest growth factor of the next step that the solver allows.
    pub ease: f64,
}

/// Advances from start to end in steps of varying length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adaptive {
    start: f64,
    now: f64,
    /// Instants at which a step must end, in increasing order. The last one is the end.
    instants: Vec<f64>,
    largest: f64,
    smallest: f64,
    /// Desired step length, independent of the next instant.
    wish: f64,
    /// Shortest step after failures.
    floor: f64,
    /// Mean of the last error ratios, each divided by the power of the step with which it falls.
    density: Option<f64>,
    /// End of the step that was judged.
    landing: Option<f64>,
    /// Number of further steps that must not grow.
    hold: u32,
    cuts: u64,
    rejected: u64,
}

impl Adaptive {
    /// Errors shorten a step at most to this fraction of the largest step.
    const SMALLEST: f64 = 1.0 / 1024.0;
    /// Fraction of the allowed error that steps aim at, because errors are more likely to grow
    /// suddenly than to fall.
    const AIM: f64 = 0.9;
    /// A step is repeated if its error exceeds the allowed value by this factor. Later steps
    /// compensate a smaller excess.
    const PATIENCE: f64 = 2.0;
    /// Weight of the newest error in the mean.
    const NEWEST: f64 = 0.3;
    const GROWTH: f64 = 2.0;
    const SHRINKAGE: f64 = 0.2;
    /// Number of step lengths in an octave of the grid. The grid prevents rounding from giving
    /// different steps on different ranks.
    const GRAIN: f64 = 16.0;

    /// Creates steps of at most `largest` from `start` to `end` \[s\] that end at each of
    /// `instants`. A step that fails is halved up to `max_cuts` times below the smallest step that
    /// errors can request.
    pub fn new([start, end]: [f64; 2], largest: f64, instants: &[f64], max_cuts: u32) -> Self {
        let close = 1e-9 * (end - start);
        let mut instants: Vec<f64> =
            instants.iter().copied().filter(|&t| t > start + close && t < end - close).chain([end]).collect();
        instants.sort_by(f64::total_cmp);
        instants.dedup_by(|b, a| *b - *a < close);
        let largest = largest.min(end - start);
        let smallest = largest * Self::SMALLEST;
        Self {
            start,
            now: start,
            instants,
            largest,
            smallest,
            wish: largest,
            floor: smallest * 0.5f64.powi(max_cuts.min(30) as i32),
            density: None,
            landing: None,
            hold: 0,
            cuts: 0,
            rejected: 0,
        }
    }

    /// The end \[s\].
    pub fn end(&self) -> f64 {
        self.instants.last().copied().unwrap_or(self.now)
    }

    /// Whether the end is reached.
    pub fn finished(&self) -> bool {
        self.now >= self.end()
    }

    /// Current time \[s\].
    pub fn time(&self) -> f64 {
        self.now
    }

    /// Completed fraction of the interval.
    pub fn fraction(&self) -> f64 {
        (self.now - self.start) / (self.end() - self.start)
    }

    /// End of the next step \[s\]: the next given instant if it is near. If one step would leave a
    /// very short remainder, the step covers half of the distance.
    pub fn end_of_step(&self) -> f64 {
        let Some(&target) = self.instants.iter().find(|&&t| t > self.now) else { return self.now };
        let left = target - self.now;
        match self.wish {
            wish if wish >= left * (1.0 - 1e-6) => target,
            wish if wish > 0.5 * left => self.now + 0.5 * left,
            wish => self.now + wish,
        }
    }

    /// Length of the next step \[s\].
    pub fn dt(&self) -> f64 {
        self.end_of_step() - self.now
    }

    /// Whether the next step is at most the shortest step that errors can request.
    pub fn is_shortest(&self) -> bool {
        self.wish <= self.smallest * (1.0 + 1e-9)
    }

    /// Number of steps that were cut because they could not be solved.
    pub fn cuts(&self) -> u64 {
        self.cuts
    }

    /// Number of steps that were solved and repeated because their errors were too large.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Decides whether the step is accepted, and sets the length of the next step from its errors.
    pub fn judge(&mut self, judgement: &Judgement) -> bool {
        let dt = self.dt();
        let Judgement { ratio, order, event, ease } = *judgement;
        let ratio = ratio.max(1e-6);
        if ratio > Self::PATIENCE && dt > self.smallest * (1.0 + 1e-9) {
            self.rejected += 1;
            self.wish = self.grained(dt * (Self::AIM / ratio).powf(1.0 / order).clamp(Self::SHRINKAGE, 0.7));
            self.density = None;
            self.hold = 1;
            return false;
        }
        self.landing = Some(self.end_of_step());
        let held = event || self.hold > 0;
        let newest = ratio / Self::AIM / dt.powf(order);
        let density = self.density.map_or(newest, |mean| mean + Self::NEWEST * (newest - mean));
        let control = density.powf(-1.0 / order) / dt;
        // The error after an event is compared with the event's part of the budget. It does not
        // predict later errors.
        self.density = (!held).then_some(density);
        // A step that was shortened to end at an instant is weak evidence against the longer one.
        let longest = Self::GROWTH.max(self.wish / dt).min(ease.max(0.5));
        let factor = control.clamp(Self::SHRINKAGE, if held { 1.0f64.min(longest) } else { longest });
        self.hold = if event { 2 } else { self.hold.saturating_sub(1) };
        self.wish = match held && factor == 1.0 {
            true => self.wish.min(self.largest),
            false => self.grained(dt * factor),
        };
        true
    }

    /// Returns the length on the grid that is nearest to `wish`.
    fn grained(&self, wish: f64) -> f64 {
        let octaves = (Self::GRAIN * (wish / self.largest).log2()).round() / Self::GRAIN;
        (self.largest * octaves.exp2()).clamp(self.smallest, self.largest)
    }

    /// Accepts the step that was judged.
    pub fn succeed(&mut self) {
        self.now = self.landing.take().unwrap_or_else(|| self.end_of_step());
    }

    /// Whether half of the step can be tried.
    pub fn can_cut(&self) -> bool {
        0.5 * self.dt() >= self.floor
    }

    /// Records that the step could not be solved.
    pub fn fail(&mut self) -> Retry {
        if !self.can_cut() {
            return Retry::GiveUp;
        }
        let dt = self.dt();
        self.wish = 0.5 * dt;
        self.hold = 2;
        self.cuts += 1;
        Retry::Cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(ratio: f64) -> Judgement {
        Judgement { ratio, order: 2.0, event: false, ease: f64::INFINITY }
    }

    /// Whether the next step has this length, up to rounding.
    fn is_as_long(control: &Adaptive, step: f64) -> bool {
        (control.dt() / step - 1.0).abs() < 1e-12
    }

    /// Every requested instant is exactly the end of a step, and no step is very short.
    #[test]
    fn lands_on_instants() {
        let instants = [0.3, 0.301, 0.7];
        let mut control = Adaptive::new([0.0, 1.0], 0.1, &instants, 5);
        let mut ends = Vec::new();
        while !control.finished() {
            assert!(control.dt() > 9e-4 && control.dt() <= 0.1 + 1e-15, "{}", control.dt());
            assert!(control.judge(&judged(0.6 * (control.dt() / 0.1).powi(2))));
            control.succeed();
            ends.push(control.time());
        }
        assert!(instants.iter().all(|instant| ends.contains(instant)), "{ends:?}");
        assert_eq!(ends.last(), Some(&1.0));
    }

    /// With an error equal to the squared ratio of the step to a time scale, the steps approach
    /// that time scale.
    #[test]
    fn follows_the_error() {
        let allowed = |t: f64| if t < 0.5 { 0.02 } else { 0.005 };
        let mut control = Adaptive::new([0.0, 1.0], 0.05, &[], 5);
        let mut last = [0.0; 2];
        while !control.finished() {
            let scale = allowed(control.time());
            if control.judge(&judged((control.dt() / scale).powi(2))) {
                control.succeed();
                let settled = control.time() < 0.45 || (0.7..0.9).contains(&control.time());
                if settled {
                    last[usize::from(control.time() > 0.5)] = control.dt() / scale;
                }
            }
        }
        assert!(last.iter().all(|ratio| (ratio - Adaptive::AIM.sqrt()).abs() < 0.03), "{last:?}");
        assert!(control.rejected() >= 1 && control.rejected() < 4, "{}", control.rejected());
    }

    /// The error of an oscillation rises and falls within eight steps. The steps hardly follow it,
    /// and use the error that they aim at.
    #[test]
    fn an_error_that_comes_and_goes_leaves_the_step() {
        let mut control = Adaptive::new([0.0, 1.0], 0.05, &[], 5);
        let scale = 1e-3;
        let (mut longest, mut shortest, mut used, mut steps) = (0.0f64, 1.0f64, 0.0, 0);
        while !control.finished() {
            let ratio = (control.dt() / scale).powi(2)
                * (1.0 + 0.7 * (std::f64::consts::TAU * control.time() / (8.0 * scale)).sin());
            let dt = control.dt();
            if control.judge(&judged(ratio)) {
                control.succeed();
                if (0.1..0.99).contains(&control.time()) {
                    (longest, shortest) = (longest.max(dt), shortest.min(dt));
                    (used, steps) = (used + ratio, steps + 1);
                }
            }
        }
        assert!(longest < 1.5 * shortest, "{longest:e}, {shortest:e}");
        let used = used / f64::from(steps);
        assert!((used / Adaptive::AIM - 1.0).abs() < 0.1, "{used}");
    }

    /// Small changes of the error leave the step unchanged.
    #[test]
    fn small_changes_leave_the_step() {
        let mut control = Adaptive::new([0.0, 1.0], 1e-2, &[], 5);
        for step in 0..50 {
            let ratio = Adaptive::AIM * (control.dt() / 2.5e-3).powi(2) * (1.0 + 0.02 * f64::from(step % 3));
            if control.judge(&judged(ratio)) {
                control.succeed();
            }
            assert!(step < 3 || is_as_long(&control, 2.5e-3), "{step}: {}", control.dt());
        }
    }

    /// The error after an event is small relative to the event's part of the budget. The next step
    /// depends on its own error.
    #[test]
    fn what_an_event_leaves_behind_says_nothing() {
        let mut control = Adaptive::new([0.0, 1.0], 0.1, &[], 5);
        control.judge(&judged(100.0));
        let step = control.dt();
        for ratio in [0.2, 1e-3, 1e-3, Adaptive::AIM] {
            assert!(is_as_long(&control, step), "{ratio}: {}", control.dt());
            assert!(control.judge(&Judgement { event: ratio == 0.2, ..judged(ratio) }));
            control.succeed();
        }
        assert!(is_as_long(&control, step), "{}", control.dt());
    }

    /// After an event the step neither grows nor falls to zero. If no step is small enough, the run
    /// continues.
    #[test]
    fn events_do_not_stop_the_run() {
        let mut control = Adaptive::new([0.0, 1.0], 0.1, &[], 5);
        control.judge(&judged(100.0));
        let step = control.dt();
        assert!(control.judge(&Judgement { event: true, ..judged(1e-3) }));
        control.succeed();
        assert!(control.judge(&judged(1e-3)));
        control.succeed();
        assert!(is_as_long(&control, step), "{}", control.dt());
        let mut tries = 0;
        while !control.judge(&judged(1e9)) {
            tries += 1;
        }
        assert!(control.is_shortest() && tries < 10 && control.dt() >= 0.1 / 1024.0 * 0.999);
    }

    /// Steps that cannot be solved are halved down to the floor. The control survives
    /// serialization.
    #[test]
    fn gives_up_at_the_floor() {
        let mut control = Adaptive::new([0.0, 1.0], 0.1, &[0.25], 2);
        let cuts = (0..).take_while(|_| control.fail() == Retry::Cut).count();
        assert_eq!(cuts, 12);
        let text = serde_json::to_string(&control).unwrap();
        assert_eq!(serde_json::from_str::<Adaptive>(&text).unwrap(), control);
    }
}
