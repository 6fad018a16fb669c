//! Newton iterates that come back to where they were.

use crate::dynamics::Split;

/// Along which corrections the least residual is searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Those alone that lead too far.
    Never,
    /// Those that do not reduce it, but across a turn of the slip.
    Slow,
    /// Whatever they do: whole ones lead round in a circle.
    Always,
}

/// Watches the residuals of a solve for one that was there before.
///
/// Points that open, slip or turn by turns may lead the corrections round in a circle of any length: the same few iterates again
/// and again, each of which is one of the exceptions that take the correction whole. The next ones are then searched along
/// without exception, which leads off the circle.
#[derive(Debug)]
pub struct Cycle {
    seen: Vec<f64>,
    left: u32,
    searched: u32,
}

impl Cycle {
    /// Residuals that agree to this part are those of one iterate; linear solves that end early leave as much.
    const SAME: f64 = 1e-6;
    /// Corrections that are searched along after a cycle: one of the full system, where whole ones across a turn of the slip are mostly
    /// right (with two, the rubber block at a coefficient of 16 has 104 steps cut for 25), and more of a stage, whose forces have a potential.
    const SEARCHED: [u32; 2] = [1, 3];

    /// For a solve of the full system or of a stage.
    pub fn of(split: Split) -> Self {
        let of_stage = usize::from(split != Split::Monolithic);
        Self { seen: Vec::new(), left: 0, searched: Self::SEARCHED[of_stage] }
    }

    /// How the correction at a residual of size `norm` is searched along, where it may be: once there were `many` before it, or where
    /// points `alternate`, if it does not help; in a circle only after `many`, since rounding repeats itself as well.
    pub fn search(&mut self, norm: f64, [many, alternate]: [bool; 2], may: bool) -> Search {
        match self.closes(norm) {
            _ if !may => Search::Never,
            true if many => Search::Always,
            _ if many || alternate => Search::Slow,
            _ => Search::Never,
        }
    }

    /// Takes the residual `norm` of an iterate into account; whether the next correction is to lead off a cycle.
    fn closes(&mut self, norm: f64) -> bool {
        self.left = self.left.saturating_sub(1);
        if self.seen.iter().any(|seen| (seen - norm).abs() <= Self::SAME * norm) {
            self.seen.clear();
            self.left = self.searched;
        }
        self.seen.push(norm);
        self.left > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four iterates in turn are seen when the first comes back, and for a few corrections from there.
    #[test]
    fn what_comes_back_is_seen() {
        let mut cycle = Cycle::of(Split::FrictionStage);
        let told: Vec<bool> =
            [0.098, 0.026, 0.160, 0.195, 0.098, 0.03, 0.02, 0.01].map(|norm| cycle.closes(norm)).into();
        assert_eq!(told, [false, false, false, false, true, true, true, false]);
    }

    /// Along all corrections where they lead round in a circle, along those that do not help, or not at all.
    #[test]
    fn what_is_searched_along() {
        let mut cycle = Cycle::of(Split::Monolithic);
        assert_eq!(cycle.search(1.0, [false; 2], true), Search::Never);
        assert_eq!(cycle.search(0.5, [false, true], true), Search::Slow);
        assert_eq!(cycle.search(0.5, [false; 2], true), Search::Never);
        assert_eq!(cycle.search(0.5, [true, false], true), Search::Always);
        assert_eq!(cycle.search(0.4, [true, false], true), Search::Slow);
        assert_eq!(cycle.search(0.4, [true; 2], false), Search::Never);
    }

    /// What converges, fast or slowly, is let be.
    #[test]
    fn what_converges_is_no_cycle() {
        for factor in [0.99, 0.5, 1e-4] {
            let mut cycle = Cycle::of(Split::Monolithic);
            let mut norm = 1.0;
            for _ in 0..40 {
                assert!(!cycle.closes(norm));
                norm *= factor;
            }
        }
    }
}
