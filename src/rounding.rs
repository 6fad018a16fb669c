//! Rounding that is perturbed on purpose, to find results that depend on it: `scripts/perturb`.
//!
//! Processors, libraries and numbers of ranks round differently. The environment variable [`VARIABLE`] makes one processor
//! round as others might: it names any of the [`WAYS`], joined by commas. Results then differ by rounding, and nothing else
//! may differ. A run says in `run.json` that it was perturbed.

use std::sync::OnceLock;

use crate::error::{Error, Result};

/// Name of the environment variable.
pub const VARIABLE: &str = "CONTACT_PETSC_ROUNDING";

/// What it may name, and what that does.
pub const WAYS: [(&str, &str); 3] = [
    ("scalar", "element kernels and sums of contact without AVX2 and fused multiply-add"),
    (
        "points",
        "pairs of contact facets, and the points of a facet over an obstacle, are summed from the last to the first",
    ),
    ("places", "about half of the coordinates of the meshes are farther from zero by a rounding error"),
];

/// What is perturbed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Perturbation {
    scalar: bool,
    points: bool,
    places: bool,
}

impl Perturbation {
    fn parse(text: &str) -> Result<Self> {
        let mut perturbation = Self::default();
        for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            match word {
                "scalar" => perturbation.scalar = true,
                "points" => perturbation.points = true,
                "places" => perturbation.places = true,
                other => {
                    let known = WAYS.map(|(name, _)| name).join(", ");
                    let message = format!("the environment variable {VARIABLE} names '{other}'");
                    return Err(Error::usage(message).hint(&format!("known: {known}; or unset it")));
                }
            }
        }
        Ok(perturbation)
    }
}

fn text() -> String {
    std::env::var(VARIABLE).unwrap_or_default()
}

fn active() -> Perturbation {
    static ACTIVE: OnceLock<Perturbation> = OnceLock::new();
    *ACTIVE.get_or_init(|| Perturbation::parse(&text()).unwrap_or_default())
}

/// Reads the environment variable.
///
/// # Errors
/// When it names something unknown.
pub fn check() -> Result<()> {
    Perturbation::parse(&text()).map(drop)
}

/// What is perturbed, as the environment variable names it; `None` where nothing is.
pub fn perturbed() -> Option<String> {
    (active() != Perturbation::default()).then(text)
}

/// Whether element kernels use the vector instructions of the processor.
pub fn vectors() -> bool {
    !active().scalar
}

/// The indices `0..count`, in the order in which contact facets and their points are evaluated.
pub fn order(count: usize) -> impl Iterator<Item = usize> {
    let reversed = active().points;
    (0..count).map(move |index| if reversed { count - 1 - index } else { index })
}

/// Perturbs coordinate number `index` of a mesh.
pub fn place(index: usize, x: f64) -> f64 {
    if active().places && is_chosen(index) { larger(x) } else { x }
}

/// Chooses about half of all numbers, without a pattern that a mesh may have as well.
fn is_chosen(index: usize) -> bool {
    /// 2^64 over the golden ratio: the leading bits of its multiples look random.
    const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;
    (index as u64).wrapping_mul(SPREAD) >> 63 == 1
}

/// A number one or two rounding errors away from zero; zero stays.
fn larger(x: f64) -> f64 {
    x * (1.0 + f64::EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every way that is listed is known, in any number, and nothing else is.
    #[test]
    fn ways_are_known() {
        let all = WAYS.map(|(name, _)| name).join(", ");
        assert_eq!(
            Perturbation::parse(&all).unwrap(),
            Perturbation { scalar: true, points: true, places: true }
        );
        assert_eq!(Perturbation::parse("").unwrap(), Perturbation::default());
        let error = Perturbation::parse("scalar,avx").unwrap_err();
        assert!(error.to_string().contains("'avx'"), "{error}");
        assert_eq!(error.exit_code(), 2);
    }

    /// A perturbed coordinate differs by rounding.
    #[test]
    fn places_differ_by_rounding() {
        for x in [1.0, -0.3, 1e9, 5.0] {
            let apart = (larger(x) - x).abs() / x.abs();
            assert!(apart > 0.0 && apart <= 2.0 * f64::EPSILON, "{x}: {apart:e}");
        }
        assert_eq!(larger(0.0), 0.0);
        for stride in [1, 2, 3] {
            let chosen = (0..1000).filter(|k| is_chosen(k * stride)).count();
            assert!((400..600).contains(&chosen), "{chosen} of 1000, every {stride}");
        }
    }
}
