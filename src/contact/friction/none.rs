//! No friction.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Bound, FrictionBound, Pressed, Regularization};
use crate::reader::findings::Findings;

/// Frictionless: symmetric matrix.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Frictionless {}

impl Frictionless {
    pub(super) fn samples() -> Vec<Self> {
        Vec::new()
    }
}

impl FrictionBound for Frictionless {
    fn bound(&self, _at: Pressed) -> Bound {
        Bound::default()
    }

    fn regularization(&self) -> Option<Regularization> {
        None
    }

    fn check(&self, _findings: &mut Findings) {}
}
