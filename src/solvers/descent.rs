//! Whether the residual of a Newton solve still falls, and whether a line search that failed is reason to give up.

/// What the iterates of one solve did to the residual.
#[derive(Debug)]
pub(super) struct Descent {
    /// Least residual of the iterates so far \[N\].
    least: f64,
    /// Searches without descent since then, and those in a row.
    failed: u32,
    in_a_row: u32,
}

/// A correction along which the least residual was searched for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Searched {
    /// Residual before it and after it \[N\].
    pub norms: [f64; 2],
    /// The same over the largest force of each iterate, by which convergence is judged.
    pub relative: [f64; 2],
    /// Whether the shortest length of all was the best.
    pub shortest: bool,
}

impl Default for Descent {
    fn default() -> Self {
        Self { least: f64::INFINITY, failed: 0, in_a_row: 0 }
    }
}

impl Descent {
    /// A correction that leaves more than this part of the least residual has not made it smaller. Newton's method leaves
    /// far less unless rounding, or points that change their state, keep it up.
    const FALL: f64 = 0.5;
    /// Searches in a row that end at the shortest length without a smaller residual: the direction is no descent. One of
    /// them may be a change of state. The residual must also become smaller beside the largest force: past a critical load
    /// both fall, the forces faster, and the balance moves away.
    const IN_A_ROW: u32 = 2;
    /// The same, in all, since the residual was least: from there on the iterates go round in a circle. Ironing comes off
    /// such a circle after three.
    const IN_ALL: u32 = 4;

    /// Whether the residual of size `norm` is no smaller than those of the iterates before.
    pub fn has_stopped(&self, norm: f64) -> bool {
        norm > Self::FALL * self.least
    }

    /// Takes the residual of an iterate into account.
    pub fn reach(&mut self, norm: f64) {
        if norm < self.least {
            self.least = norm;
            self.failed = 0;
        }
    }

    /// Takes the correction to the next iterate into account, if it was searched along; whether the solve is to be given up.
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

    /// Whether the solve is given up at each of the searches; a residual, then length 1/512 or not.
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

    /// A residual that rises slowly under the shortest steps is not followed, nor a circle of rises and falls; one failure
    /// between descents is.
    #[test]
    fn a_direction_that_is_no_descent_is_not_followed() {
        assert_eq!(judge(0.1, &[(0.101, Some(true)), (0.102, Some(true))]), [false, true]);
        assert_eq!(judge(0.1, &[(0.101, Some(false)), (0.102, Some(false))]), [false, false]);
        let circle = [(0.9, Some(true)), (0.66, None)].repeat(4);
        let lost = judge(0.66, &circle);
        assert_eq!(lost.iter().position(|lost| *lost), Some(6));
        let falls =
            [(0.9, Some(true)), (0.6, None), (0.8, Some(true)), (0.5, None), (0.7, Some(true)), (0.4, None)];
        assert!(
            judge(0.66, &[&falls[..], &[(0.6, Some(true)), (0.3, None)]].concat()).iter().all(|lost| !lost)
        );
    }

    /// A residual that falls more slowly than the forces is not followed.
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

    /// What is halved still falls.
    #[test]
    fn a_residual_that_is_halved_falls() {
        let mut descent = Descent::default();
        assert!(!descent.has_stopped(1.0), "the first one");
        descent.reach(1.0);
        descent.reach(3.0);
        assert!(!descent.has_stopped(0.4) && descent.has_stopped(0.6));
    }
}
