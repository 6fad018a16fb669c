//! `parameters` of a case: numbers with names, which its expressions may use.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;
use super::context::{NamedNumbers, with_parameters};
use super::expression::{self, Expression};
use super::findings::Findings;
use super::node::{Node, Tree};
use super::quantity::Scalar;
use super::{unit, units};

/// Numbers with names. Each is a number, a number with a unit, or an expression of those before it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CaseParameters(Vec<(At<String>, f64)>);

impl CaseParameters {
    /// Whether the case has no parameters.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds complaints about names that expressions could not use.
    pub fn check(&self, found: &mut Findings) {
        for (name, _) in &self.0 {
            let fits = |c: char| c.is_alphanumeric() || c == '_';
            if expression::is_reserved(name) {
                let message = format!(
                    "'{}' is a variable or function of expressions and can not be a parameter",
                    name.value
                );
                found.say(name.place, message);
                found.cure("choose another name");
            } else if !name.starts_with(char::is_alphabetic) || !name.chars().all(fits) {
                found.say(name.place, format!("'{}' is not a valid name of a parameter", name.value));
                found.cure("a name begins with a letter and consists of letters, digits and '_'");
            }
        }
    }
}

/// The parameters of a case, before it is read. One whose value is wrong is 1, because reading the case reports it.
pub(super) fn parameters_of(root: &Node) -> NamedNumbers {
    let Tree::Map(keys) = &root.tree else { return NamedNumbers::new() };
    let Some((_, node)) = keys.iter().find(|(key, _)| key.value == "parameters") else {
        return NamedNumbers::new();
    };
    let Tree::Map(entries) = &node.tree else { return NamedNumbers::new() };
    let mut values = NamedNumbers::new();
    for (name, written) in entries {
        let number = Scalar::deserialize(written).and_then(|scalar| evaluate(&scalar, &values));
        values.push((name.value.clone(), number.unwrap_or(1.0)));
    }
    values
}

/// The value of a parameter in the units of the case, given those before it.
fn evaluate(written: &Scalar, before: &NamedNumbers) -> Result<f64, Complaint> {
    const EXPECTED: &str = "expected a number, a number with a unit, or an expression";
    let text = match written {
        Scalar::Number(value) => return Ok(*value),
        Scalar::Other(found) => return Err(Complaint::new(format!("{EXPECTED}, found {found}"))),
        Scalar::Text(text) => text,
    };
    let value = match with_parameters(before.clone(), || Expression::parse(text)) {
        Ok(expression) if expression.varies_in_space() || expression.varies_in_time() => {
            let message = format!("'{text}' depends on x, y, z or t, but a parameter is one number");
            return Err(Complaint::new(message).hint("write the variables where the parameter is used"));
        }
        Ok(expression) => expression.value([0.0; 3], 0.0),
        Err(complaint) if !unit::follows_number(text) => return Err(complaint),
        Err(_) => unit::parse(text).map(|(si, dimension)| units::reading().number(si, dimension))?,
    };
    if value.is_finite() {
        return Ok(value);
    }
    Err(Complaint::new(format!("the value of '{text}' is not finite")))
}

impl<'de> Deserialize<'de> for CaseParameters {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = CaseParameters;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a mapping from names to numbers")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<CaseParameters, A::Error> {
                let mut entries = Vec::new();
                let mut values = NamedNumbers::new();
                while let Some((name, written)) = map.next_entry::<At<String>, At<Scalar>>()? {
                    let complain = |complaint: Complaint| A::Error::custom(complaint.at(written.place));
                    let value = evaluate(&written, &values).map_err(complain)?;
                    values.push((name.value.clone(), value));
                    entries.push((name, value));
                }
                Ok(CaseParameters(entries))
            }
        }
        deserializer.deserialize_map(Entries)
    }
}

impl Serialize for CaseParameters {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(&name.value, value)?;
        }
        map.end()
    }
}

impl JsonSchema for CaseParameters {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Parameters".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "type": "object",
            "additionalProperties": { "type": ["number", "string"] }
        })
    }
}
