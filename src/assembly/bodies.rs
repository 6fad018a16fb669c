//! Names and kinematics of the bodies.

use crate::element::Kinematics;
use crate::model::{Body, Model};

/// Name and kinematics of a body.
pub(super) struct NamedBody {
    name: String,
    /// Strain measure of the body.
    pub kinematics: Kinematics,
}

impl NamedBody {
    /// Name in the case file.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Names and kinematics of the bodies of the model.
pub(super) fn named_bodies<const D: usize>(model: &Model<D>) -> Vec<NamedBody> {
    let named = |body: &Body| NamedBody { name: body.name.clone(), kinematics: body.formulation.kinematics };
    model.bodies.iter().map(named).collect()
}
