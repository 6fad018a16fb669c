//! Choice of the first linear solver and of those that follow when it fails.

use super::two_stage::TwoStageSettings;
use crate::error::{Error, Result};
use crate::petsc::Format;
use crate::presets::Preset;

/// Linear solver that the case requests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinearChoice {
    /// Chosen from size, dimension, inertia and symmetry.
    Auto,
    /// A preset by name.
    Named(&'static str),
    /// The two-stage scheme as preconditioner.
    TwoStage(TwoStageSettings),
}

impl LinearChoice {
    /// Settings of the two-stage preconditioner, with the inner solver chosen.
    pub(super) fn stages(&self, problem: &Problem) -> TwoStageSettings {
        let asked = match self {
            Self::TwoStage(settings) => *settings,
            _ => TwoStageSettings::default(),
        };
        TwoStageSettings { inner: asked.inner.or(Some(problem.inner())), ..asked }
    }
}

/// Properties of the problem that determine the choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Problem {
    /// Number of unknowns of the whole problem.
    pub unknowns: usize,
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Whether the problem includes inertia.
    pub dynamic: bool,
    /// Whether the matrix is symmetric.
    pub symmetric: bool,
    /// Whether the problem includes contact.
    pub contact: bool,
    /// Whether elastic bodies touch each other or themselves. Incomplete factors have no fill for them.
    pub joins_bodies: bool,
    /// Whether it includes tied surfaces. Incomplete factors do not converge on their stiffness.
    pub tied: bool,
    /// Whether a body has a Poisson's ratio of [`STIFF`](Self::STIFF) or more. Incomplete factors of its
    /// matrix fail.
    pub nearly_incompressible: bool,
    /// Format of the matrix; `None` if it is still to be chosen.
    pub format: Option<Format>,
}

impl Problem {
    /// Poisson's ratio from which on incomplete factors of the matrix itself fail.
    ///
    /// A block of hex8 on a plane, 14 553 unknowns, takes 43 iterations of `gmres_asm_ilu` in statics at
    /// 0.48, half the time of `filtered_ilu`. At 0.49 it fails (docs/performance/large-problems.md).
    pub const STIFF: f64 = 0.49;

    /// Whether the problem is small enough to use a factorisation first.
    ///
    /// In 3D statics a factorisation of fewer unknowns takes little longer than the iterations after which
    /// incomplete factors count as failed: with MUMPS a cube on a plane took 21 ms for 2187 unknowns, 39 ms
    /// for 3993 and 340 ms for 14 739, and 200 iterations 17, 30 and 140 ms.
    fn is_small(&self) -> bool {
        self.unknowns
            < match (self.dimension, self.dynamic) {
                (_, true) => 600,
                (2, false) => 500_000,
                (_, false) => 4_000,
            }
    }

    /// Whether a factorisation takes little enough time to replace a solver that needs 200 iterations.
    ///
    /// In 3D two boxes of 27 753 unknowns with a Poisson's ratio of 0.499 take 94 iterations of
    /// `filtered_ilu` and 2.2 s per solve, and 5.1 s with MUMPS. In 2D a factorisation also follows
    /// incomplete factors that fail. A pad of 40 602 unknowns on a plane, in two time
    /// steps, took 1.5 s with MUMPS and 1.3 s with `filtered_amg`. At a Poisson's ratio of 0.49 a block of
    /// 26 082 unknowns took 0.14 s per solve with MUMPS in statics, 0.18 s at CFL 50 and 0.10 s at CFL 5, with
    /// `filtered_ilu` 0.58, 0.43 and 0.14 s (docs/performance/large-problems.md).
    pub(super) fn prefers_factors(&self) -> bool {
        let most = if self.dimension == 2 && self.nearly_incompressible { 500_000 } else { 50_000 };
        !self.tied && self.unknowns < most
    }

    fn names(&self) -> &'static [&'static str] {
        // Factorisations and preconditioners that exploit symmetry need scalar rows.
        let symmetric = self.symmetric && self.format != Some(Format::Baij);
        if self.is_small() {
            return if symmetric { &["cholesky", "direct"] } else { &["direct"] };
        }
        match (self.dimension, symmetric, self.dynamic) {
            _ if self.tied => &["filtered_ilu", "direct"],
            // Incomplete factors of the matrix itself fail, unless inertia dominates.
            (3, _, false) if self.nearly_incompressible => &["filtered_ilu", "direct"],
            (3, ..) => &["gmres_asm_ilu", "filtered_ilu", "direct"],
            (_, true, true) if self.prefers_factors() => &["cg_icc", "cholesky", "direct"],
            (_, false, true) if self.prefers_factors() => &["gmres_asm_ilu", "direct"],
            (_, true, true) if self.contact => &["cg_icc", "filtered_ilu", "direct"],
            (_, true, true) => &["cg_icc", "cholesky", "direct"],
            (_, _, false) if self.contact => &["filtered_ilu", "direct"],
            (_, true, false) => &["cg_amg", "cg_icc", "cholesky", "direct"],
            // The nodes in contact are those of a line, so their factors take little time.
            (_, false, true) if self.joins_bodies => &["filtered_ilu", "direct"],
            (_, false, true) if self.contact => &["gmres_asm_ilu", "filtered_ilu", "direct"],
            (_, false, _) => &["gmres_asm_ilu", "gmres_asm_ilu1", "direct"],
        }
    }

    /// Inner solver for the symmetric matrices of the two-stage preconditioner, unless the case
    /// sets one.
    fn inner(&self) -> &'static str {
        let symmetric = Self { symmetric: true, format: Some(Format::Aij), ..*self };
        let names = symmetric.names().iter();
        // A preconditioner with its own matrices cannot be nested.
        let plain =
            |name: &&&str| Preset::named(name).is_some_and(|preset| preset.symmetric && !preset.is_own());
        let fails = self.nearly_incompressible && self.prefers_factors();
        names.copied().find(|name| plain(&name)).unwrap_or(if fails { "cholesky" } else { "cg_icc" })
    }

    fn stores(&self, preset: &Preset) -> bool {
        self.format.is_none_or(|format| preset.formats.contains(&format))
    }
}

/// Returns the solvers to try in turn, all for the matrix format of the problem.
///
/// # Errors
/// [`Cause::Case`](crate::error::Cause) if the user names a solver for symmetric matrices and the
/// matrix is not symmetric.
pub fn ladder(choice: &LinearChoice, problem: &Problem) -> Result<Vec<&'static Preset>> {
    let names: Vec<&str> = match choice {
        LinearChoice::Auto => problem.names().to_vec(),
        LinearChoice::Named("direct") => vec!["direct"],
        LinearChoice::TwoStage(_) => vec!["two_stage", "gmres_asm_ilu", "direct"],
        LinearChoice::Named(name @ "filtered_amg") if !problem.symmetric => {
            vec![name, "filtered_ilu", "direct"]
        }
        LinearChoice::Named(name) => vec![name, "direct"],
    };
    let known = names.iter().filter_map(|name| Preset::named(name));
    let presets: Vec<&Preset> = known.filter(|preset| problem.stores(preset)).collect();
    let Some(first) = presets.first() else {
        return Err(Error::internal("unknown linear solver"));
    };
    if first.symmetric && !problem.symmetric {
        return Err(Error::case(format!(
            "linear solver '{}' needs a symmetric matrix, but friction or a follower load makes this one \
             non-symmetric",
            first.name
        ))
        .hint("use gmres_asm_ilu, gmres_amg, direct or auto, or strategy: staggered"));
    }
    Ok(presets)
}

/// Returns the format that is best for the first solver among those that all of them support.
pub fn storage(presets: &[&Preset]) -> Format {
    let fits = |format: &&Format| presets.iter().all(|preset| preset.formats.contains(format));
    presets.first().and_then(|first| first.formats.iter().find(fits)).copied().unwrap_or(Format::Aij)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Problem = Problem {
        unknowns: 50_000,
        dimension: 2,
        dynamic: true,
        symmetric: false,
        contact: true,
        joins_bodies: false,
        tied: false,
        nearly_incompressible: false,
        format: None,
    };

    fn all_problems() -> impl Iterator<Item = Problem> {
        let sizes = [100, 50_000, 5_000_000].into_iter().flat_map(|unknowns| [2, 3].map(|d| (unknowns, d)));
        sizes.flat_map(|(unknowns, dimension)| {
            (0..64u8).map(move |flags| Problem {
                unknowns,
                dimension,
                dynamic: flags & 1 != 0,
                symmetric: flags & 2 != 0,
                contact: flags & 36 != 0,
                joins_bodies: flags & 32 != 0,
                tied: flags & 8 != 0,
                nearly_incompressible: flags & 16 != 0,
                format: None,
            })
        })
    }

    /// A solver for symmetric matrices is rejected if friction makes the matrix non-symmetric.
    #[test]
    fn conjugate_gradients_need_symmetry() {
        let refused = ladder(&LinearChoice::Named("cg_icc"), &SCENE);
        assert!(refused.is_err_and(|e| e.message.contains("symmetric")));
        assert!(ladder(&LinearChoice::Named("cg_icc"), &Problem { symmetric: true, ..SCENE }).is_ok());
        for problem in all_problems().filter(|problem| !problem.symmetric) {
            assert!(ladder(&LinearChoice::Auto, &problem).unwrap().iter().all(|preset| !preset.symmetric));
        }
    }

    /// Every ladder ends with a factorisation for any matrix.
    #[test]
    fn ladders_end_with_a_factorisation() {
        for problem in all_problems() {
            let steps = ladder(&LinearChoice::Auto, &problem).unwrap();
            assert_eq!(steps.last().map(|p| p.name), Some("direct"));
        }
    }

    fn names(problem: Problem) -> Vec<&'static str> {
        ladder(&LinearChoice::Auto, &problem).unwrap().iter().map(|preset| preset.name).collect()
    }

    /// In 3D statics the first solver is a factorisation below 4000 unknowns, else GMRES with
    /// incomplete factors, and filtered ones take over. The ladder is that for the format that a run chooses
    /// for it.
    #[test]
    fn statics_in_3d_begins_with_incomplete_factors() {
        let solid = Problem { dimension: 3, dynamic: false, ..SCENE };
        let names = |problem: Problem| {
            let format = Some(storage(&ladder(&LinearChoice::Auto, &problem).unwrap()));
            names(Problem { format, ..problem })
        };
        assert_eq!(names(Problem { unknowns: 3_999, ..solid }), ["direct"]);
        for (unknowns, symmetric) in [(4_000, false), (4_000, true), (5_000_000, false), (5_000_000, true)] {
            let first = names(Problem { unknowns, symmetric, ..solid });
            assert_eq!(first, ["gmres_asm_ilu", "filtered_ilu", "direct"]);
        }
    }

    /// A factorisation takes over from incomplete factors in small plane problems.
    #[test]
    fn factors_follow_incomplete_factors_in_2d() {
        let plane = Problem { unknowns: 49_999, ..SCENE };
        assert_eq!(names(plane), ["gmres_asm_ilu", "direct"]);
        assert_eq!(names(Problem { symmetric: true, ..plane }), ["cg_icc", "cholesky", "direct"]);
        assert_eq!(names(SCENE), ["gmres_asm_ilu", "filtered_ilu", "direct"]);
        let rubber = Problem { nearly_incompressible: true, ..SCENE };
        assert_eq!(names(Problem { unknowns: 499_999, ..rubber }), ["gmres_asm_ilu", "direct"]);
        assert_eq!(
            names(Problem { dynamic: false, unknowns: 500_000, ..rubber }),
            ["filtered_ilu", "direct"]
        );
    }

    /// Filtered factors come first where incomplete factors fail or take longer: in large plane problems between
    /// bodies, in statics of nearly incompressible bodies, and with tied surfaces.
    #[test]
    fn filtered_factors_come_first_where_incomplete_ones_fail() {
        let filtered = ["filtered_ilu", "direct"];
        let plane = Problem { joins_bodies: true, ..SCENE };
        assert_eq!(names(plane), filtered);
        assert_eq!(names(Problem { unknowns: 49_999, ..plane }), ["gmres_asm_ilu", "direct"]);
        let solid = Problem { dimension: 3, ..plane };
        assert_eq!(names(solid), ["gmres_asm_ilu", "filtered_ilu", "direct"]);
        let rubber = Problem { nearly_incompressible: true, ..solid };
        assert_eq!(names(rubber), names(solid));
        let pressed = Problem { dynamic: false, unknowns: 49_999, ..rubber };
        assert_eq!(names(pressed), filtered);
        assert_eq!(LinearChoice::Auto.stages(&pressed).inner, Some("cholesky"));
        for problem in all_problems().filter(|problem| problem.tied && !problem.is_small()) {
            assert_eq!(names(problem), filtered, "{problem:?}");
        }
    }

    /// A ladder keeps the given format, and a format chosen for a ladder suits every rung of it.
    #[test]
    fn ladders_respect_the_storage() {
        for problem in all_problems() {
            for format in [Format::Aij, Format::Baij] {
                let fixed = Problem { format: Some(format), ..problem };
                let steps = ladder(&LinearChoice::Auto, &fixed).unwrap();
                assert!(steps.iter().all(|preset| preset.formats.contains(&format)), "{fixed:?}");
            }
            let steps = ladder(&LinearChoice::Auto, &problem).unwrap();
            let format = storage(&steps);
            assert!(steps.iter().all(|preset| preset.formats.contains(&format)), "{problem:?}");
        }
    }
}
