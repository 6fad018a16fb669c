//! How long a preconditioner serves matrices that came after its own.

/// Whether a preconditioner of an earlier matrix still serves: contact and step change the matrix little, and an
/// incomplete factorisation costs as much as several iterations.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Fatigue {
    /// Digits an iteration gained while the preconditioner was new; 0 before there is one.
    fresh: f64,
    /// Digits an iteration gained last.
    pub last: f64,
}

impl Fatigue {
    /// A preconditioner is made anew when an iteration gains less than this part of what it gained at first.
    const WORTH: f64 = 0.7;

    pub fn is_tired(self) -> bool {
        self.last <= Self::WORTH * self.fresh
    }

    pub fn record(&mut self, renewed: bool, iterations: u32, tolerance: f64) {
        self.last = -tolerance.log10() / f64::from(iterations.max(1));
        if renewed {
            self.fresh = self.last;
        }
    }
}
