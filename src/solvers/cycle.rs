//! Detection of Newton iterates that return to an earlier state.

/// Corrections along which a line search is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Only corrections that lead too far.
    Never,
    /// Corrections that do not reduce the residual, except across a reversal of the slip.
    Slow,
    /// All corrections, because full ones form a cycle.
    Always,
}

/// Signs that an iteration is slow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Slowness {
    /// Many corrections were made.
    pub many: bool,
    /// Contact points alternate between two states.
    pub alternates: bool,
}

impl Slowness {
    /// Whether there is any sign.
    pub fn any(self) -> bool {
        self.many || self.alternates
    }
}

/// Detects residuals of a solve that occurred before.
///
/// Points that open, slip or reverse in turn can make the corrections cycle through the same few
/// iterates. Each iterate may be one of the exceptions that take the full correction. The next
/// corrections are then searched along without exception, which leaves the cycle.
#[derive(Debug)]
pub struct Cycle {
    seen: Vec<f64>,
    left: u32,
    searched: u32,
}

impl Cycle {
    /// Residuals with at most this relative difference belong to the same iterate. Linear solves
    /// that end early cause differences of this size.
    const SAME: f64 = 1e-6;
    /// Number of corrections of the full system that are searched along after a cycle.
    ///
    /// Full corrections across a reversal of the slip are mostly right. With two, the rubber block
    /// at a coefficient of 16 has 104 steps cut instead of 25.
    pub const OF_SYSTEM: u32 = 1;
    /// Number of corrections of a stage that are searched along after a cycle. It is larger,
    /// because the forces of a stage have a potential.
    pub const OF_STAGE: u32 = 3;

    /// Creates the detector for a solve in which `searched` corrections are searched along after a
    /// cycle.
    pub fn new(searched: u32) -> Self {
        Self { seen: Vec::new(), left: 0, searched }
    }

    /// Selects the line search for the correction at a residual of size `norm`, where it `may` be
    /// made.
    ///
    /// A correction that does not help is searched along if the iteration is slow. A cycle counts
    /// only after many corrections, because rounding repeats values as well.
    pub fn search(&mut self, norm: f64, slow: Slowness, may: bool) -> Search {
        match self.closes(norm) {
            _ if !may => Search::Never,
            true if slow.many => Search::Always,
            _ if slow.any() => Search::Slow,
            _ => Search::Never,
        }
    }

    /// Records the residual `norm` of an iterate. Returns whether the next correction must leave a
    /// cycle.
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

    /// A cycle of four iterates is detected when the first one returns, and for a few corrections
    /// after that.
    #[test]
    fn what_comes_back_is_seen() {
        let mut cycle = Cycle::new(Cycle::OF_STAGE);
        let told: Vec<bool> =
            [0.098, 0.026, 0.160, 0.195, 0.098, 0.03, 0.02, 0.01].map(|norm| cycle.closes(norm)).into();
        assert_eq!(told, [false, false, false, false, true, true, true, false]);
    }

    /// The search covers all corrections in a cycle, or those that do not help, or no corrections.
    #[test]
    fn what_is_searched_along() {
        let mut cycle = Cycle::new(Cycle::OF_SYSTEM);
        let fast = Slowness::default();
        let alternates = Slowness { alternates: true, ..fast };
        let many = Slowness { many: true, ..fast };
        assert_eq!(cycle.search(1.0, fast, true), Search::Never);
        assert_eq!(cycle.search(0.5, alternates, true), Search::Slow);
        assert_eq!(cycle.search(0.5, fast, true), Search::Never);
        assert_eq!(cycle.search(0.5, many, true), Search::Always);
        assert_eq!(cycle.search(0.4, many, true), Search::Slow);
        assert_eq!(cycle.search(0.4, Slowness { many: true, alternates: true }, false), Search::Never);
    }

    /// A convergent sequence, fast or slow, is not treated as a cycle.
    #[test]
    fn what_converges_is_no_cycle() {
        for factor in [0.99, 0.5, 1e-4] {
            let mut cycle = Cycle::new(Cycle::OF_SYSTEM);
            let mut norm = 1.0;
            for _ in 0..40 {
                assert!(!cycle.closes(norm));
                norm *= factor;
            }
        }
    }
}
