//! Named linear solvers. Each has its own file and one line in the table below.
//!
//! The file says what the solver is, what it needs, and which PETSc options it sets. The user's own
//! options override them. The table feeds the reading of cases, the schema, `contact-petsc list`,
//! hints, and the ladder of solvers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::matrix_format::Format;
use crate::reader::tagged::tagged;

pub use two_stage::{Inner, Second};

/// A linear solver that a user can name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preset {
    /// Key in the case file.
    pub name: &'static str,
    /// Description in one sentence, with a remark on the cost.
    pub about: &'static str,
    /// Whether it needs a symmetric matrix.
    pub symmetric: bool,
    /// Whether it iterates. A factorisation meets any tolerance in one solve.
    pub iterative: bool,
    /// Matrix formats that its preconditioner supports, the better one first.
    pub formats: &'static [Format],
    /// Whether it is a multigrid that uses the rigid-body modes.
    pub multigrid: bool,
    /// Who implements the preconditioner.
    pub implementation: Implementation,
    /// Options without prefix, for any number of ranks.
    pub options: &'static [(&'static str, &'static str)],
    /// Options that replace some of `options` on one rank.
    pub alone: &'static [(&'static str, &'static str)],
}

/// Who implements a preconditioner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Implementation {
    /// PETSc, or a package that PETSc calls.
    Petsc,
    /// The program: ILU(0) on overlapping subdomains, unless the user has options for it.
    Overlapping,
    /// The program: the two-stage scheme, with separate matrices.
    TwoStage,
    /// The program: ILU(0) and a coarse space with a factorisation of the nodes in contact.
    FilteredIlu,
    /// The program: multigrid with a factorisation of the nodes in contact, with separate matrices.
    FilteredAmg,
}

/// Block storage makes products and incomplete factors twice as fast.
const BOTH: &[Format] = &[Format::Baij, Format::Aij];

/// PETSc's multigrid and MUMPS's Cholesky do not support blocks. PETSc's ICC crashes on a rank
/// without blocks.
const AIJ: &[Format] = &[Format::Aij];

/// Options of GMRES. It always uses right preconditioning, because its residual is then the true
/// one.
const GMRES: [(&str, &str); 3] =
    [("ksp_type", "gmres"), ("ksp_pc_side", "right"), ("ksp_gmres_restart", "100")];

/// Options of conjugate gradients, with the true residual.
const CG: [(&str, &str); 2] = [("ksp_type", "cg"), ("ksp_norm_type", "unpreconditioned")];

/// Makes the enum that a case is read into and the table of presets: one line a preset, with its name
/// in cases, its file, its variant, and the struct of its parameters if it has some.
macro_rules! presets {
    ($($name:literal: $file:ident => $variant:ident $(($parameters:ident))?),+ $(,)?) => {
        $(mod $file;)+
        $($(pub use $file::$parameters;)?)+

        /// Linear solver.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(remote = "Self", deny_unknown_fields)]
        #[schemars(rename = "Linear")]
        #[expect(missing_docs, reason = "each preset documents itself")]
        pub enum Linear {
            /// Chosen from size, dimension, inertia and symmetry; if it fails, a more robust solver is
            /// used.
            #[default]
            #[serde(rename = "auto")]
            Auto,
            $(
                #[serde(rename = $name)]
                #[schemars(description = $file::PRESET.about)]
                $variant $(($file::$parameters))?,
            )+
        }
        tagged!(Linear, "linear solver");

        /// All presets.
        pub const PRESETS: &[Preset] = &[$(Preset { name: $name, ..$file::PRESET }),+];

        impl Linear {
            /// The name in the case file.
            pub fn name(self) -> &'static str {
                match self {
                    Self::Auto => "auto",
                    $(Self::$variant { .. } => $name,)+
                }
            }
        }
    };
}

presets! {
    "direct": direct => Direct,
    "gmres_asm_ilu": gmres_asm_ilu => GmresAsmIlu,
    "gmres_asm_ilu1": gmres_asm_ilu1 => GmresAsmIlu1,
    "two_stage": two_stage => TwoStage(TwoStage),
    "filtered_ilu": filtered_ilu => FilteredIlu,
    "filtered_amg": filtered_amg => FilteredAmg,
    "gmres_amg": gmres_amg => GmresAmg,
    "cholesky": cholesky => Cholesky,
    "cg_jacobi": cg_jacobi => CgJacobi,
    "cg_icc": cg_icc => CgIcc,
    "cg_amg": cg_amg => CgAmg,
    "cg_filtered_amg": cg_filtered_amg => CgFilteredAmg,
}

impl Linear {
    /// The preset; `None` if the program chooses.
    pub fn preset(self) -> Option<&'static Preset> {
        Preset::named(self.name())
    }

    /// Whether the method needs a symmetric matrix, hence no friction and no follower load.
    pub fn needs_symmetry(self) -> bool {
        self.preset().is_some_and(|preset| preset.symmetric)
    }
}

impl Preset {
    /// Common properties of GMRES with a preconditioner of PETSc.
    const GMRES: Self = Self {
        name: "",
        about: "",
        symmetric: false,
        iterative: true,
        formats: BOTH,
        multigrid: false,
        implementation: Implementation::Petsc,
        options: &[],
        alone: &[],
    };

    /// Common properties of conjugate gradients with a preconditioner of PETSc.
    const CG: Self = Self { symmetric: true, formats: AIJ, ..Self::GMRES };

    /// Common properties of factorisations.
    const FACTORISATION: Self = Self { iterative: false, formats: AIJ, ..Self::GMRES };

    /// Whether its preconditioner is the two-stage scheme.
    pub fn is_two_stage(&self) -> bool {
        self.implementation == Implementation::TwoStage
    }

    /// Whether the program implements its preconditioner, which needs more than the matrix.
    pub fn is_own(&self) -> bool {
        self.decides_on_renewal() || self.implementation == Implementation::FilteredIlu
    }

    /// Whether its preconditioner decides which of its matrices it makes again.
    pub fn decides_on_renewal(&self) -> bool {
        matches!(self.implementation, Implementation::TwoStage | Implementation::FilteredAmg)
    }

    /// Whether its preconditioner is ILU(0) on overlapping subdomains. The program implements it,
    /// unless the user has options for it.
    pub fn is_overlapping(&self) -> bool {
        self.implementation == Implementation::Overlapping
    }

    /// Finds the preset with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| preset.name == name)
    }

    /// Options of the preset on `ranks` ranks.
    pub fn options_on(&self, ranks: usize) -> Vec<(&'static str, &'static str)> {
        let replaced = if ranks == 1 { self.alone } else { &[] };
        let kept = |key: &str| !replaced.iter().any(|(other, _)| *other == key);
        let unused_alone = |key: &str| {
            ranks == 1
                && !replaced.is_empty()
                && (key.contains("asm") || key.starts_with("sub_pc") || key.contains("sub_1_sub"))
        };
        let shared = self.options.iter().filter(|(key, _)| kept(key) && !unused_alone(key));
        shared.chain(replaced).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names are unique and can be found, and every preset says what it is and sets its method. On
    /// one rank, a plain preconditioner gets no subdomain options.
    #[test]
    fn presets_are_found_by_name() {
        for preset in PRESETS {
            assert_eq!(Preset::named(preset.name), Some(preset));
            assert!(!preset.about.is_empty() && !preset.formats.is_empty(), "{}", preset.name);
            for key in ["ksp_type", "pc_type"] {
                assert!(preset.options.iter().any(|(own, _)| *own == key), "{}: {key}", preset.name);
            }
        }
        let alone = Preset::named("gmres_asm_ilu").map(|p| p.options_on(1)).unwrap_or_default();
        assert!(alone.contains(&("pc_type", "ilu")));
        assert!(alone.iter().all(|(key, _)| !key.contains("asm") && !key.starts_with("sub_")));
        assert!(Linear::CgIcc.needs_symmetry() && !Linear::Auto.needs_symmetry());
    }
}
