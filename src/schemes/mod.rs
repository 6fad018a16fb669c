//! Time integration schemes that a case can name. Each has its own file and one line in the table
//! below.
//!
//! The file says what a case writes, which values are valid, and which method with which
//! coefficients results. The table feeds the reading of cases, the schema, `contact-petsc list`,
//! hints and tests. `time` advances a stage by the method.

use crate::reader::findings::Findings;
use crate::reader::laws::laws;
use crate::reader::quantity::Number;

laws! {
    /// Time integration.
    Scheme ("scheme", schema "Scheme", table SCHEMES) implements IntegrationScheme:
    "newmark": newmark::Newmark,
    "hht": hht::Hht,
    "generalized_alpha": generalized_alpha::GeneralizedAlpha,
    "midpoint": midpoint::Midpoint,
    "conserving": conserving::Conserving,
    "backward_euler": backward_euler::BackwardEuler,
    "static": quasi_static::Static,
}

impl Default for Scheme {
    fn default() -> Self {
        Self::GeneralizedAlpha(GeneralizedAlpha::default())
    }
}

/// A scheme as a case writes it.
pub trait IntegrationScheme {
    /// The method with its coefficients.
    fn method(&self) -> Method;

    /// Reports invalid parameters.
    fn check(&self, _found: &mut Findings) {}
}

impl Scheme {
    /// The method with its coefficients.
    pub fn method(&self) -> Method {
        self.law().method()
    }

    /// Whether the forces over a step conserve energy.
    pub fn conserves(&self) -> bool {
        self.method() == Method::Conserving
    }

    /// Whether there is no inertia.
    pub fn is_static(&self) -> bool {
        self.method() == Method::Static
    }
}

impl Method {
    /// Whether the scheme has inertia.
    pub fn has_inertia(self) -> bool {
        self != Self::Static
    }

    /// Whether the forces are balanced at the midpoint of the step.
    pub fn is_midpoint(self) -> bool {
        matches!(self, Self::Midpoint | Self::Conserving)
    }

    /// Factors of `dt^2 u''` and `dt^3 u'''` in the error of a step. `None` in statics.
    pub fn local_error(self) -> Option<[f64; 2]> {
        match self {
            Self::Newmark { beta, gamma, alpha_m, alpha_f } => {
                let lag = alpha_f - alpha_m;
                let turn = (0.5 * (beta - lag * alpha_f - 1.0 / 12.0)).abs().max(1.0 / 48.0);
                Some([0.5 * (gamma - 0.5 - lag).abs(), turn])
            }
            Self::Midpoint | Self::Conserving => Some([0.0, 1.0 / 12.0]),
            Self::BackwardEuler => Some([0.5, 0.0]),
            Self::Static => None,
        }
    }

    /// Order of the scheme.
    pub fn order(self) -> f64 {
        match self.local_error() {
            Some([damping, _]) if damping < 1e-9 => 2.0,
            _ => 1.0,
        }
    }
}

/// Requires a parameter in an interval.
fn within(found: &mut Findings, what: &str, value: &Number, [low, high]: [f64; 2]) {
    let message = format!("{what} must be between {low} and {high}, found {}", value.value);
    found.require((low..=high).contains(&value.value), value.place, message);
}

/// A one-step scheme. Its only unknown is the displacement at the end of the step or at its
/// midpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Displacement and velocity follow from Newmark's formulas. Inertia and forces are weighted
    /// between start and end.
    ///
    /// `a_end = (u_end - u_start - dt v_start) / (beta dt^2) - (1 - 2 beta) / (2 beta) a_start`,
    /// `v_end = v_start + dt ((1 - gamma) a_start + gamma a_end)`.
    Newmark {
        /// Alpha of the paper.
        beta: f64,
        /// Beta of the paper.
        gamma: f64,
        /// Weight of the inertia at the start.
        alpha_m: f64,
        /// Weight of the forces at the start.
        alpha_f: f64,
    },
    /// `v = du/dt`, `a = dv/dt`. First order, with strong damping.
    BackwardEuler,
    /// Balance at the midpoint of the step, with the mean displacement and the mean velocity.
    /// Conserves linear and angular momentum.
    ///
    /// It is backward Euler over half of the step, extrapolated linearly by its last stage.
    Midpoint,
    /// The midpoint rule with forces in the bulk and in contact that change the energy by exactly
    /// the work they do over the step.
    ///
    /// Conserves energy, less the heat from friction. Without supports it also conserves linear and
    /// angular momentum.
    Conserving,
    /// No inertia. The velocity `du/dt` is used for friction only.
    Static,
}

impl Method {
    /// Newmark's method; second order at `gamma = 1/2`.
    pub fn newmark(beta: f64, gamma: f64) -> Self {
        Self::Newmark { beta, gamma, alpha_m: 0.0, alpha_f: 0.0 }
    }

    /// Hilber, Hughes, Taylor scheme, given the spectral radius at infinity, in `[1/2, 1]`.
    pub fn hht(spectral_radius: f64) -> Self {
        let alpha_f = (1.0 - spectral_radius) / (1.0 + spectral_radius);
        Self::Newmark { beta: 0.25 * (1.0 + alpha_f).powi(2), gamma: 0.5 + alpha_f, alpha_m: 0.0, alpha_f }
    }

    /// Chung, Hulbert scheme, given the spectral radius at infinity, in `[0, 1]`.
    pub fn generalized_alpha(spectral_radius: f64) -> Self {
        let alpha_m = (2.0 * spectral_radius - 1.0) / (spectral_radius + 1.0);
        let alpha_f = spectral_radius / (spectral_radius + 1.0);
        let shift = alpha_f - alpha_m;
        Self::Newmark { beta: 0.25 * (1.0 + shift).powi(2), gamma: 0.5 + shift, alpha_m, alpha_f }
    }
}
