//! The interface of a part of the state of a run to checkpoints.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::memory::{NamedFields, StoredState};
use crate::error::{Error, Result};
use crate::petsc::Vector;

/// A part of the state. Numbers are stored apart from fields because fields are too large to be
/// copied in every step. Fields must not change before a step is accepted.
pub trait StatePart {
    /// The numbers.
    ///
    /// # Errors
    /// An internal error of the program.
    fn numbers(&self) -> Result<Value>;

    /// The fields of the nodes.
    fn fields(&self) -> NamedFields {
        Vec::new()
    }

    /// Restores numbers and fields. Collective.
    ///
    /// # Errors
    /// The numbers are those of another part, a field is missing, or PETSc reports an error.
    fn restore_from(&mut self, numbers: &Value, fields: &StoredState) -> Result<()>;
}

/// Numbers of a part that is stored as a whole.
pub fn numbers_of(part: &impl Serialize) -> Result<Value> {
    serde_json::to_value(part).map_err(|error| Error::internal(format!("checkpoint: {error}")))
}

/// Reads the numbers of a part.
///
/// # Errors
/// They are those of another part.
pub fn from_numbers<T: DeserializeOwned>(numbers: &Value) -> Result<T> {
    T::deserialize(numbers).map_err(|error| Error::file(format!("a checkpoint with another state ({error})")))
}

/// A field for a checkpoint.
pub fn named(name: &str, field: &Vector) -> (String, Vec<f64>) {
    (name.to_owned(), field.owned().to_vec())
}
