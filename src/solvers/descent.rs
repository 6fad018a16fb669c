//! Whether the residual of a Newton solve still falls, and whether to give up after failed line
//! searches.

/// History of the residual over the iterates of one solve.
#[derive(Debug)]
pub(super) struct Descent {
    /// Smallest residual of the iterates so far \[N\].
    least: f64,
    /// Searches without descent since then, and the number of consecutive ones.
    failed: u32,
    in_a_row: u32,
}

/// A correction with a line search for the smallest residual.
#[derive(Debug, Clone, Copy)]
pub(super) struct Searched {
    /// Norm by which the correction is judged, before and after it \[N\].
    pub norms: [f64; 2],
    /// Residual before and after it, relative to the largest force of each iterate, as in the
    /// convergence criterion.
    pub relative: [f64; 2],
    /// Whether the shortest of all lengths was the best.
    pub shortest: bool,
}

impl Default for Descent {
    fn default() -> Self {
        Self { least: f64::INFINITY, failed: 0, in_a_row: 0 }
    }
}

impl Descent {
    /// A correction that leaves more than this part of the smallest residual has not reduced it.
    /// Newton's method leaves far less, unless rounding or status changes prevent it.
    const FALL: f64 = 0.5;
    /// Maximum number of consecutive searches that end at the shortest length without a smaller
    /// residual. The direction is then not one of descent; a single such search may be a change of
    /// status.
    ///
    /// The residual must also fall relative to the largest force. Past a critical load both fall,
    /// but the forces fall faster, and the iteration diverges from the balance.
    const IN_A_ROW: u32 = 2;
    /// Maximum total number of searches without descent since the smallest residual. After that the
    /// iterates form a cycle.
    const IN_ALL: u32 = 4;

    /// Whether the residual of size `norm` is no smaller than those of the previous iterates.
    pub fn has_stopped(&self, norm: f64) -> bool {
        norm > Self::FALL * self.least
    }

    /// Records the residual of an iterate.
    pub fn reach(&mut self, norm: f64) {
        if norm < self.least {
            self.least = norm;
            self.failed = 0;
        }
    }

    /// Records the correction to the next iterate, if a search was made along it. Returns whether
    /// to give up the solve.
    pub fn is_lost(&mut self, searched: Option<Searched>) -> bool {
        let Some(Searched { norms: [before, after], relative, shortest }) = searched else {
            self.in_a_row = 0;
            return false;
        };
        let fails = shortest && (after >= before || relative[1] >= relative[0]);
        self.in_a_row = if fails { self.in_a_row + 1 } else { 0 };
        self.failed += u32::from(fails);
        self.in_a_row >= Self::IN_A_ROW || self.failed >= Self::IN_ALL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the solve is given up at each of the searches, given a residual and whether the
    /// length was 1/512.
    fn judge(start: f64, steps: &[(f64, Option<bool>)]) -> Vec<bool> {
        let mut descent = Descent::default();
        let mut before = start;
        let mut lost = Vec::new();
        for &(after, searched) in steps {
            descent.reach(before);
            let norms = [before, after];
            let searched = searched.map(|shortest| Searched { norms, relative: norms, shortest });
            lost.push(descent.is_lost(searched));
            before = after;
        }
        lost
    }

    /// The solve is given up if the residual rises slowly under the shortest steps, or rises and
    /// falls in a cycle. A single failure between descents is accepted.
    #[test]
    fn a_direction_that_is_no_descent_is_not_followed() {
        assert_eq!(judge(0.1, &[(0.101, Some(true)), (0.102, Some(true))]), [false, true]);
        assert_eq!(judge(0.1, &[(0.101, Some(false)), (0.102, Some(false))]), [false, false]);
        let circle = [(0.9, Some(true)), (0.66, Some(false))].repeat(4);
        let lost = judge(0.66, &circle);
        assert_eq!(lost.iter().position(|lost| *lost), Some(6));
        let falls = [
            (0.9, Some(true)),
            (0.6, Some(false)),
            (0.8, Some(true)),
            (0.5, Some(false)),
            (0.7, Some(true)),
            (0.4, Some(false)),
        ];
        assert!(
            judge(0.66, &[&falls[..], &[(0.6, Some(true)), (0.3, None)]].concat()).iter().all(|lost| !lost)
        );
    }

    /// The solve is given up if the residual falls more slowly than the forces.
    #[test]
    fn a_balance_that_moves_away_is_not_followed() {
        let lost = |relative| {
            let mut descent = Descent::default();
            let searched = Searched { norms: [0.1, 0.099], relative, shortest: true };
            [descent.is_lost(Some(searched)), descent.is_lost(Some(searched))]
        };
        assert_eq!(lost([0.2, 0.201]), [false, true]);
        assert_eq!(lost([0.2, 0.199]), [false, false]);
    }

    /// A residual that is halved still falls.
    #[test]
    fn a_residual_that_is_halved_falls() {
        let mut descent = Descent::default();
        assert!(!descent.has_stopped(1.0), "the first one");
        descent.reach(1.0);
        descent.reach(3.0);
        assert!(!descent.has_stopped(0.4) && descent.has_stopped(0.6));
    }
}
