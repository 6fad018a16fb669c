//! Conjugate gradients with the preconditioner of `filtered_amg`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BOTH, CG, FilteredAmg, Implementation, Preset};

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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CgFilteredAmg {
    /// Element layers around the facets in contact that are factorised with them.
    pub layers: u32,
}

impl Default for CgFilteredAmg {
    fn default() -> Self {
        Self { layers: FilteredAmg::default().layers }
    }
}
