//! `dimension`: of the space in which a case is set.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

/// Spelling of [`SpaceDimension::Axisymmetric`].
const AXISYMMETRIC: &str = "axisymmetric";

/// The dimension as a case writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpaceDimension {
    /// 2 or 3. Other numbers are refused by the checks.
    Number(i64),
    /// Bodies of revolution about the y axis, in the meridian plane with x as the radius.
    Axisymmetric,
}

impl SpaceDimension {
    /// Number of coordinates of a node.
    pub fn coordinates(self) -> i64 {
        match self {
            Self::Number(number) => number,
            Self::Axisymmetric => 2,
        }
    }

    /// Whether it is one of the known ones.
    pub fn is_known(self) -> bool {
        (2..=3).contains(&self.coordinates())
    }
}

impl<'de> Deserialize<'de> for SpaceDimension {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyDimension)
    }
}

struct AnyDimension;

impl Visitor<'_> for AnyDimension {
    type Value = SpaceDimension;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("2, 3 or axisymmetric")
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<SpaceDimension, E> {
        Ok(SpaceDimension::Number(value))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<SpaceDimension, E> {
        Ok(SpaceDimension::Number(i64::try_from(value).unwrap_or(i64::MAX)))
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<SpaceDimension, E> {
        // The reader replaces an unreadable value by a number.
        if value.fract() == 0.0 {
            return Ok(SpaceDimension::Number(value as i64));
        }
        Err(E::custom(format!("the dimension is 2, 3 or axisymmetric, not {value}")))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<SpaceDimension, E> {
        if value == AXISYMMETRIC {
            return Ok(SpaceDimension::Axisymmetric);
        }
        Err(E::custom(format!("the dimension is 2, 3 or axisymmetric, not '{value}'")))
    }
}

impl Serialize for SpaceDimension {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => number.serialize(serializer),
            Self::Axisymmetric => AXISYMMETRIC.serialize(serializer),
        }
    }
}

impl JsonSchema for SpaceDimension {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "SpaceDimension".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "enum": [2, 3, AXISYMMETRIC] })
    }
}
