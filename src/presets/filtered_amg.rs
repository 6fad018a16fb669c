//! GMRES preconditioned by a multigrid cycle for the bodies and a factorisation of the nodes in
//! contact before and after it.
//!
//! `src/solvers/filtered_amg.rs` implements the preconditioner.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BOTH, GMRES, Implementation, Preset};
use crate::reader::tagged::tagged;

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with multigrid for the bodies and a factorisation of the nodes in contact: large \
            problems",
    formats: BOTH,
    multigrid: true,
    implementation: Implementation::FilteredAmg,
    // On several ranks the preconditioner iterates, so the method has to be flexible.
    options: &[("ksp_type", "fgmres"), GMRES[1], GMRES[2], ("pc_type", "shell")],
    alone: &[GMRES[0]],
    ..Preset::GMRES
};

/// Parameters of the filtered multigrid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilteredAmg {
    /// Element layers around the facets in contact that are factorised with them.
    pub layers: u32,
    /// When the factorisation is used.
    pub passes: Passes,
}

impl Default for FilteredAmg {
    fn default() -> Self {
        Self { layers: 2, passes: Passes::Around }
    }
}

/// When the filtered multigrid solves on the nodes in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Passes")]
pub enum Passes {
    /// Before the cycle of multigrid and after it.
    #[default]
    Around,
    /// Only before it, to measure the benefit of the second solve.
    Before,
}
tagged!(Passes, "order of passes");
