//! Conjugate gradients with the preconditioner of `filtered_amg`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BOTH, CG, Implementation, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "conjugate gradients with the preconditioner of `filtered_amg`: large, symmetric, with contact",
    formats: BOTH,
    multigrid: true,
    implementation: Implementation::FilteredAmg,
    // On several ranks the preconditioner iterates, so the method has to be flexible.
    options: &[("ksp_type", "fcg"), CG[1], ("pc_type", "shell")],
    alone: &[CG[0]],
    ..Preset::CG
};

/// Parameters of the symmetric filtered multigrid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CgFilteredAmg {
    /// Element layers around the nodes in contact that are factorised with them. Two take fewer
    /// iterations, but more time and memory.
    pub layers: u32,
}
