//! Named linear solvers. Each is a set of PETSc options that the user's own options override.

use crate::petsc::Format;

/// A linear solver that a user can name.
#[derive(Debug, PartialEq)]
pub struct Preset {
    /// Key in the case file.
    pub name: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
    /// Whether it needs a symmetric matrix.
    pub symmetric: bool,
    /// Whether it iterates. A factorisation meets any tolerance in one solve.
    pub iterative: bool,
    /// Matrix formats that its preconditioner supports, the better one first.
    pub formats: &'static [Format],
    /// Whether it is a multigrid that uses the rigid-body modes.
    pub multigrid: bool,
    /// Options without prefix, for any number of ranks.
    pub options: &'static [(&'static str, &'static str)],
    /// Options that replace some of `options` on one rank.
    pub alone: &'static [(&'static str, &'static str)],
}

/// Block storage makes products and incomplete factors twice as fast.
const BOTH: &[Format] = &[Format::Baij, Format::Aij];

/// PETSc's multigrid and MUMPS's Cholesky do not support blocks. PETSc's ICC crashes on a rank
/// without blocks.
const AIJ: &[Format] = &[Format::Aij];

const GMRES: [(&str, &str); 3] =
    [("ksp_type", "gmres"), ("ksp_pc_side", "right"), ("ksp_gmres_restart", "100")];

/// Name of the preset whose preconditioner is the two-stage scheme.
pub const TWO_STAGE: &str = "two_stage";

/// Name of the preset that combines multigrid with a factorisation of the unknowns in contact.
pub const FILTERED_AMG: &str = "filtered_amg";
/// Name of the preset that combines multigrid with a factorisation of the unknowns in contact, for
/// symmetric matrices.
pub const CG_FILTERED_AMG: &str = "cg_filtered_amg";

/// Name of the preset with ILU(0) on overlapping subdomains.
const OVERLAPPING: &str = "gmres_asm_ilu";

/// All presets, for `contact-petsc list`, hints and the ladder.
///
/// GMRES always uses right preconditioning, because its residual is then the true one. The overlap
/// is at least 1: block Jacobi needs an order of magnitude more iterations if a partition boundary
/// meets the contact zone. The options of [overlapping](Preset::is_overlapping) subdomains apply
/// when the user sets some of them.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "direct",
        about: "LU factorisation by MUMPS: any matrix, memory grows faster than the problem",
        symmetric: false,
        iterative: false,
        formats: BOTH,
        multigrid: false,
        options: &[
            ("ksp_type", "preonly"),
            ("pc_type", "lu"),
            ("pc_factor_mat_solver_type", "mumps"),
            ("mat_mumps_icntl_7", "5"),
            ("mat_mumps_icntl_14", "50"),
        ],
        alone: &[],
    },
    Preset {
        name: "cholesky",
        about: "symmetric factorisation by MUMPS: half the work of `direct`",
        symmetric: true,
        iterative: false,
        formats: AIJ,
        multigrid: false,
        options: &[
            ("ksp_type", "preonly"),
            ("pc_type", "cholesky"),
            ("pc_factor_mat_solver_type", "mumps"),
            ("mat_mumps_icntl_7", "5"),
            ("mat_mumps_icntl_14", "50"),
        ],
        alone: &[],
    },
    Preset {
        name: OVERLAPPING,
        about: "GMRES with ILU(0) on overlapping subdomains: best with inertia, also with contact",
        symmetric: false,
        iterative: true,
        formats: BOTH,
        multigrid: false,
        options: &[
            GMRES[0],
            GMRES[1],
            GMRES[2],
            ("pc_type", "asm"),
            ("pc_asm_overlap", "1"),
            ("sub_pc_type", "ilu"),
        ],
        alone: &[("pc_type", "ilu")],
    },
    Preset {
        name: "gmres_asm_ilu1",
        about: "GMRES with ILU(1) on wider overlaps: half the iterations of `gmres_asm_ilu`, twice the memory",
        symmetric: false,
        iterative: true,
        formats: BOTH,
        multigrid: false,
        options: &[
            GMRES[0],
            GMRES[1],
            GMRES[2],
            ("pc_type", "asm"),
            ("pc_asm_overlap", "2"),
            ("sub_pc_type", "ilu"),
            ("sub_pc_factor_levels", "1"),
        ],
        alone: &[("pc_type", "ilu"), ("pc_factor_levels", "1")],
    },
    Preset {
        name: "cg_jacobi",
        about: "conjugate gradients scaled by the diagonal: the mass matrix",
        symmetric: true,
        iterative: true,
        formats: BOTH,
        multigrid: false,
        options: &[("ksp_type", "cg"), ("ksp_norm_type", "unpreconditioned"), ("pc_type", "jacobi")],
        alone: &[],
    },
    Preset {
        name: "cg_icc",
        about: "conjugate gradients with incomplete Cholesky: symmetric problems with inertia",
        symmetric: true,
        iterative: true,
        formats: AIJ,
        multigrid: false,
        options: &[
            ("ksp_type", "cg"),
            ("ksp_norm_type", "unpreconditioned"),
            ("pc_type", "asm"),
            ("pc_asm_type", "basic"),
            ("pc_asm_overlap", "1"),
            ("sub_pc_type", "icc"),
        ],
        alone: &[("pc_type", "icc")],
    },
    Preset {
        name: "cg_amg",
        about: "conjugate gradients with algebraic multigrid and rigid-body modes: large, symmetric, static",
        symmetric: true,
        iterative: true,
        formats: AIJ,
        multigrid: true,
        options: &[("ksp_type", "cg"), ("ksp_norm_type", "unpreconditioned"), ("pc_type", "gamg")],
        alone: &[],
    },
    Preset {
        name: TWO_STAGE,
        about: "FGMRES with normal contact and friction in turn, each with a symmetric solver",
        symmetric: false,
        iterative: true,
        formats: AIJ,
        multigrid: false,
        options: &[("ksp_type", "fgmres"), ("ksp_gmres_restart", "100"), ("pc_type", "shell")],
        alone: &[],
    },
    Preset {
        name: FILTERED_AMG,
        about: "GMRES with multigrid for the bodies and a factorisation of the nodes in contact: large \
                problems",
        symmetric: false,
        iterative: true,
        formats: BOTH,
        multigrid: true,
        options: &[GMRES[0], GMRES[1], GMRES[2], ("pc_type", "shell")],
        alone: &[],
    },
    Preset {
        name: CG_FILTERED_AMG,
        about: "conjugate gradients with the preconditioner of `filtered_amg`: large, symmetric, with \
                contact",
        symmetric: true,
        iterative: true,
        formats: BOTH,
        multigrid: true,
        options: &[("ksp_type", "cg"), ("ksp_norm_type", "unpreconditioned"), ("pc_type", "shell")],
        alone: &[],
    },
    Preset {
        name: "gmres_amg",
        about: "GMRES with multigrid and ILU in turn: large and static, without stiff contact",
        symmetric: false,
        iterative: true,
        formats: AIJ,
        multigrid: true,
        options: &[
            ("ksp_type", "fgmres"),
            ("ksp_gmres_restart", "100"),
            ("pc_type", "composite"),
            ("pc_composite_type", "multiplicative"),
            ("pc_composite_pcs", "gamg,asm"),
            ("sub_1_pc_asm_overlap", "1"),
            ("sub_1_sub_pc_type", "ilu"),
        ],
        alone: &[("pc_composite_pcs", "gamg,ilu")],
    },
];

impl Preset {
    /// Whether its preconditioner is the two-stage scheme.
    pub fn is_two_stage(&self) -> bool {
        self.name == TWO_STAGE
    }

    /// Whether the program implements its preconditioner, with separate matrices.
    pub fn is_own(&self) -> bool {
        self.is_two_stage() || [FILTERED_AMG, CG_FILTERED_AMG].contains(&self.name)
    }

    /// Whether its preconditioner is ILU(0) on overlapping subdomains. The program implements it,
    /// unless the user has options for it.
    pub fn is_overlapping(&self) -> bool {
        self.name == OVERLAPPING
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

/// Options of a factorisation on all ranks, and the corresponding options for a factorisation on
/// one of several ranks.
const ON_ONE_RANK: [(&str, &str); 4] = [
    ("pc_type", "telescope_pc_type"),
    ("pc_factor_mat_solver_type", "telescope_pc_factor_mat_solver_type"),
    ("mat_mumps_icntl_7", "telescope_mat_mumps_icntl_7"),
    ("mat_mumps_icntl_14", "telescope_mat_mumps_icntl_14"),
];

/// Returns the options of a factorisation that runs on one of `ranks` ranks. They do not apply if
/// the user chose a preconditioner.
///
/// On several ranks MUMPS rounds differently in each run, and it is not faster on small problems.
pub fn on_one_rank<'a>(options: &[(&'a str, &'a str)], ranks: &'a str) -> Vec<(&'a str, &'a str)> {
    let there = |(key, value): &(&'a str, &'a str)| {
        let known = ON_ONE_RANK.iter().find(|(own, _)| own == key);
        (known.map_or(*key, |(_, there)| there), *value)
    };
    let method = [
        ("pc_type", "telescope"),
        ("pc_telescope_reduction_factor", ranks),
        ("telescope_ksp_type", "preonly"),
    ];
    options.iter().map(there).chain(method).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names are unique and can be found. On one rank, a plain preconditioner gets no subdomain
    /// options.
    #[test]
    fn presets_are_found_by_name() {
        for preset in PRESETS {
            assert_eq!(Preset::named(preset.name), Some(preset));
        }
        let alone = Preset::named("gmres_asm_ilu").map(|p| p.options_on(1)).unwrap_or_default();
        assert!(alone.contains(&("pc_type", "ilu")));
        assert!(alone.iter().all(|(key, _)| !key.contains("asm") && !key.starts_with("sub_")));
    }
}
