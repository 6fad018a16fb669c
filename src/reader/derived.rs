//! Expressions in columns of tables, such as `contact.drag.force_x / contact.sole.force_n`.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::complaint::Complaint;
use super::context::CHOICE;
use super::expression::Expression;

/// An expression in columns of tables and the time, in the units of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    text: String,
    parsed: Expression,
    columns: Vec<(String, usize)>,
}

impl Derived {
    /// Reads an expression.
    ///
    /// # Errors
    /// What is wrong with it, with the number of characters before the fault.
    pub fn parse(text: &str) -> Result<Self, Complaint> {
        let (parsed, columns) = Expression::parse_of_columns(text)?;
        Ok(Self { text: text.to_owned(), parsed, columns })
    }

    /// The columns that occur, each once, with the number of characters before it.
    pub fn columns(&self) -> &[(String, usize)] {
        &self.columns
    }

    /// The value with these values of [`columns`](Self::columns) at the time `t` \[s\].
    pub fn value(&self, columns: &[f64], t: f64) -> f64 {
        self.parsed.value_of_columns(columns, t)
    }
}

impl<'de> Deserialize<'de> for Derived {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl<'de> Visitor<'de> for Text {
            type Value = Derived;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an expression such as \"contact.drag.force_x / contact.sole.force_n\"")
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<Derived, D::Error> {
                inner.deserialize_any(self)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Derived, E> {
                Derived::parse(text).map_err(E::custom)
            }
            // Marks a value that could not be read: YAML never produces bytes.
            fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<Derived, E> {
                self.visit_str("t")
            }
        }
        deserializer.deserialize_newtype_struct(CHOICE, Text)
    }
}

impl Serialize for Derived {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl JsonSchema for Derived {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Derived".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns are found once each, in quotation marks if a name has a dash, and enter as numbers.
    #[test]
    fn columns_are_numbers() {
        let text =
            "2 * abs(contact.a.force_x) / contact.b2.force_n + `contact.a-b.force_n` - contact.a.force_x * t";
        let derived = Derived::parse(text).expect("an expression");
        let names: Vec<&str> = derived.columns().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["contact.a.force_x", "contact.b2.force_n", "contact.a-b.force_n"]);
        assert_eq!(derived.columns()[1].1, 29);
        assert_eq!(derived.value(&[-3.0, 4.0, 10.0], 2.0), 1.5 + 10.0 + 6.0);
        assert!(derived.value(&[1.0, 0.0, f64::NAN], 0.0).is_nan());
    }

    /// A position means nothing here, and faults have their place in the text.
    #[test]
    fn faults_have_their_place() {
        for (text, fault) in
            [("1 + x", 4), ("energy.total +", 14), ("1.5.2", 3), ("energy.total energy.kinetic", 13)]
        {
            assert_eq!(Derived::parse(text).expect_err(text).offset, fault, "{text}");
        }
        let hint = Derived::parse("foo").expect_err("an unknown name").hint;
        assert!(hint.contains("TABLE.NAME.COLUMN"), "{hint}");
    }
}
