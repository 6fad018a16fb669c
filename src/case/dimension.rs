//! `dimension`: of the space in which a case is set.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

/// Spelling of [`Dimension::Axisymmetric`].
const AXISYMMETRIC: &str = "axisymmetric";

/// The dimension as a case writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// 2 or 3. Other numbers are refused by the checks.
    Number(u32),
    /// Bodies of revolution about the y axis, in the meridian plane with x as the radius.
    Axisymmetric,
}

impl Dimension {
    /// Number of coordinates of a node.
    pub fn coordinates(self) -> u32 {
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

impl<'de> Deserialize<'de> for Dimension {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyDimension)
    }
}

struct AnyDimension;

impl Visitor<'_> for AnyDimension {
    type Value = Dimension;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("2, 3 or axisymmetric")
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Dimension, E> {
        u32::try_from(value)
            .map(Dimension::Number)
            .map_err(|_| E::custom(format!("the dimension is 2, 3 or axisymmetric, not {value}")))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Dimension, E> {
        Ok(Dimension::Number(u32::try_from(value).unwrap_or(u32::MAX)))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Dimension, E> {
        if value == AXISYMMETRIC {
            return Ok(Dimension::Axisymmetric);
        }
        Err(E::custom(format!("the dimension is 2, 3 or axisymmetric, not '{value}'")))
    }
}

impl Serialize for Dimension {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => number.serialize(serializer),
            Self::Axisymmetric => AXISYMMETRIC.serialize(serializer),
        }
    }
}

impl JsonSchema for Dimension {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Dimension".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "enum": [2, 3, AXISYMMETRIC] })
    }
}
