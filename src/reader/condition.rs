//! Conditions on the reference position, such as `x > 0.3 and z < 1e-6`.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::complaint::Complaint;
use super::context::CHOICE;
use super::expression;

/// A condition on the reference position, in the units of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    text: String,
    parsed: expression::ParsedCondition,
}

impl Condition {
    /// Reads a condition.
    ///
    /// # Errors
    /// What is wrong with it, with the number of characters before the fault; or it depends on t.
    pub fn parse(text: &str) -> Result<Self, Complaint> {
        let parsed = expression::ParsedCondition::parse(text)?;
        if parsed.varies_in_time() {
            let message = "a set can not depend on t".to_owned();
            return Err(Complaint::new(message).hint("write a condition on the reference position x, y, z"));
        }
        Ok(Self { text: text.to_owned(), parsed })
    }

    /// Whether the condition holds at a reference point \[m\] (zeros beyond the dimension).
    pub fn holds(&self, point: [f64; 3]) -> bool {
        self.parsed.holds(point)
    }

    /// Whether z occurs.
    pub fn uses_z(&self) -> bool {
        self.parsed.uses_z()
    }
}

impl<'de> Deserialize<'de> for Condition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl<'de> Visitor<'de> for Text {
            type Value = Condition;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a condition such as \"x > 0.3 and z < 1e-6\"")
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<Condition, D::Error> {
                inner.deserialize_any(self)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Condition, E> {
                Condition::parse(text).map_err(E::custom)
            }
            // Marks a value that could not be read: YAML never produces bytes.
            fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<Condition, E> {
                self.visit_str("x == x")
            }
        }
        deserializer.deserialize_newtype_struct(CHOICE, Text)
    }
}

impl Serialize for Condition {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl JsonSchema for Condition {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Condition".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string" })
    }
}
