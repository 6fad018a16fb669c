//! Prony series of a linear viscoelastic deviator (theory, section 3.15).
//!
//! The isochoric stress `S_iso` of a law drives branches, each a spring and a dashpot in series:
//! `dH_i/dt + H_i / tau_i = gamma_i dS_iso/dt`. The series adds `base S_iso + sum H_i` to the stress of
//! the law. Within a step `S_iso` is taken as linear in time, for which the recurrence is exact:
//!
//! `H_i(t + h) = d_i H_i(t) + gamma_i m_i (S_iso(t + h) - S_iso(t))` with `d_i = exp(-h / tau_i)` and
//! `m_i = (1 - d_i) tau_i / h`.

use crate::lanes::Pack;

/// Which state of the body the parameters of its law describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GivenModuli {
    /// The relaxed state, after an infinitely slow loading.
    LongTerm,
    /// The state right after a sudden loading.
    Instantaneous,
}

/// A spring and a dashpot in series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxwellBranch {
    /// `gamma_i`: stiffness of the branch relative to the isochoric part of the law.
    pub weight: f64,
    /// `tau_i`: relaxation time \[s\].
    pub time: f64,
}

impl MaxwellBranch {
    /// `d_i = exp(-h / tau_i)`: the part of a stress that is left after `elapsed` \[s\].
    pub fn decay(&self, elapsed: f64) -> f64 {
        (-elapsed / self.time).exp()
    }

    /// `m_i = (1 - d_i) tau_i / h`: the mean of the decay over `elapsed` \[s\], 1 for no time.
    pub fn mean_decay(&self, elapsed: f64) -> f64 {
        let ratio = elapsed / self.time;
        if ratio > 0.0 { -(-ratio).exp_m1() / ratio } else { 1.0 }
    }
}

/// The branches of a body and the change of its elastic isochoric stress.
#[derive(Debug, Clone, PartialEq)]
pub struct PronySeries {
    branches: Vec<MaxwellBranch>,
    /// Multiple of the isochoric stress of the law that is added besides the branches, not positive.
    base: f64,
}

impl PronySeries {
    /// From pairs of a share of the instantaneous shear modulus and a relaxation time \[s\]. The
    /// shares are positive, and their sum is below 1.
    pub fn new(shares: &[(f64, f64)], moduli: GivenModuli) -> Self {
        let relaxing: f64 = shares.iter().map(|(share, _)| share).sum();
        let (base, scale) = match moduli {
            GivenModuli::LongTerm => (0.0, 1.0 / (1.0 - relaxing)),
            GivenModuli::Instantaneous => (-relaxing, 1.0),
        };
        let branch = |&(share, time): &(f64, f64)| MaxwellBranch { weight: scale * share, time };
        Self { branches: shares.iter().map(branch).collect(), base }
    }

    /// The branches.
    pub fn branches(&self) -> &[MaxwellBranch] {
        &self.branches
    }

    /// Multiple of the isochoric stress of the law that is added in the relaxed state: 0 for
    /// long-term moduli, minus the sum of the shares for instantaneous ones.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// The derivative of the added stress by the isochoric stress at the end of `elapsed` \[s\].
    pub fn factor(&self, elapsed: f64) -> f64 {
        let of_branch = |branch: &MaxwellBranch| branch.weight * branch.mean_decay(elapsed);
        self.base + self.branches.iter().map(of_branch).sum::<f64>()
    }

    /// Shear modulus `age` \[s\] after a sudden shear, relative to that of the law.
    pub fn relaxation(&self, age: f64) -> f64 {
        let of_branch = |branch: &MaxwellBranch| branch.weight * branch.decay(age);
        1.0 + self.base + self.branches.iter().map(of_branch).sum::<f64>()
    }
}

/// Stress that a Prony series adds to that of the law at the points of a group:
/// `factor S_iso + predicted`.
#[derive(Debug, Clone, PartialEq)]
pub struct Overstress {
    /// Multiple of the isochoric stress at the state.
    pub factor: f64,
    /// What the history adds \[Pa\]: the components of each point, four elements at a time; empty for
    /// zero.
    pub predicted: Vec<Pack>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With long-term moduli the relaxed law is the one given, with instantaneous moduli the sudden
    /// one. Both conventions describe the same relaxation.
    #[test]
    fn conventions_differ_by_a_factor() {
        let shares = [(0.3, 0.1), (0.2, 2.0)];
        let slow = PronySeries::new(&shares, GivenModuli::LongTerm);
        let sudden = PronySeries::new(&shares, GivenModuli::Instantaneous);
        assert!((slow.relaxation(0.0) - 2.0).abs() < 1e-15 && (slow.relaxation(1e9) - 1.0).abs() < 1e-15);
        assert!((sudden.relaxation(0.0) - 1.0).abs() < 1e-15 && (sudden.relaxation(1e9) - 0.5).abs() < 1e-15);
        for age in [0.0, 0.01, 0.3, 5.0] {
            assert!((slow.relaxation(age) / sudden.relaxation(age) - 2.0).abs() < 1e-14);
        }
        assert_eq!(slow.factor(0.0), slow.relaxation(0.0) - 1.0);
    }

    /// The mean of the decay is the integral of the decay over the time, for steps of any length.
    #[test]
    fn the_mean_decay_is_a_mean() {
        let branch = MaxwellBranch { weight: 1.0, time: 0.7 };
        assert_eq!(branch.mean_decay(0.0), 1.0);
        for elapsed in [1e-14, 1e-6, 0.1, 3.0] {
            let count = 2000;
            let middle = |k: i32| branch.decay(elapsed * (f64::from(k) + 0.5) / f64::from(count));
            let mean = (0..count).map(middle).sum::<f64>() / f64::from(count);
            assert!((branch.mean_decay(elapsed) / mean - 1.0).abs() < 1e-5, "{elapsed}");
        }
        assert!((branch.mean_decay(7e9) * 1e10 - 1.0).abs() < 1e-15);
    }
}
