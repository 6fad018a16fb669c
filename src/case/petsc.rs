//! `petsc`: options that go to PETSc as they are.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

/// Value of a PETSc option; empty for an option without a value, as `ksp_monitor:`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PetscValue(pub Option<String>);

impl<'de> Deserialize<'de> for PetscValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyValue)
    }
}

struct AnyValue;

impl Visitor<'_> for AnyValue {
    type Value = PetscValue;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the value of a PETSc option: a word, a number, or nothing")
    }
    fn visit_unit<E: Error>(self) -> Result<PetscValue, E> {
        Ok(PetscValue(None))
    }
    fn visit_bool<E: Error>(self, value: bool) -> Result<PetscValue, E> {
        Ok(PetscValue(Some(value.to_string())))
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<PetscValue, E> {
        Ok(PetscValue(Some(value.to_string())))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<PetscValue, E> {
        Ok(PetscValue(Some(value.to_string())))
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<PetscValue, E> {
        Ok(PetscValue(Some(format!("{value:e}"))))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<PetscValue, E> {
        Ok(PetscValue(Some(value.to_string()).filter(|text| !text.is_empty())))
    }
}

impl Serialize for PetscValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl JsonSchema for PetscValue {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "PetscValue".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "type": ["string", "number", "boolean", "null"] })
    }
}
