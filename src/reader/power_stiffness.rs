//! The constant of a power law, whose unit depends on the exponent.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;
use super::findings::Findings;
use super::place::Place;
use super::quantity::{Number, Scalar};
use super::unit::{self, Dimension};
use super::units;

/// Constant of a power law, whose unit depends on the exponent of the law: Pa/m^exponent.
///
/// Its dimension is checked once the exponent is known, see [`PowerStiffness::dimension_for`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerStiffness {
    /// Value [Pa/m^exponent] in the units of the case.
    pub value: f64,
    /// Dimension of the unit, if one was written.
    pub dimension: Option<Dimension>,
    /// Where it is written.
    pub place: Place,
}

impl PowerStiffness {
    /// A value of the program's own.
    pub fn new(value: f64) -> Self {
        Self { value, dimension: None, place: Place::default() }
    }

    /// Says what is wrong with the constant and the exponent of a power law.
    pub fn check(&self, exponent: Number, findings: &mut Findings) {
        let fits = self.value > 0.0 && self.value.is_finite();
        findings.require(fits, self.place, format!("the stiffness must be > 0, found {}", self.value));
        findings.positive("the exponent", exponent);
        let expected = Self::dimension_for(exponent.value);
        if let Some(found) = self.dimension.filter(|found| *found != expected) {
            let (found, unit) = (findings.units.describe(found), findings.units.symbol(expected));
            findings.say(self.place, format!("the stiffness is {found}; expected one in {unit}"));
            findings.cure(&format!("write a number in {unit}, or for example \"1 {unit}\""));
        }
    }

    /// Pa/m^exponent.
    pub fn dimension_for(exponent: f64) -> Dimension {
        Dimension([1.0, -1.0 - exponent, -2.0])
    }
}

impl<'de> Deserialize<'de> for PowerStiffness {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = At::<Scalar>::deserialize(deserializer)?;
        let place = raw.place;
        let read = match &raw.value {
            Scalar::Number(value) => Ok((*value, None)),
            Scalar::Text(text) => unit::parse(text)
                .map(|(si, dimension)| (units::reading().number(si, dimension), Some(dimension))),
            Scalar::Other(found) => {
                Err(Complaint::new(format!("expected a stiffness, pressure/length^exponent, found {found}")))
            }
        };
        let (value, dimension) = read.map_err(|c| D::Error::custom(c.at(place)))?;
        Ok(Self { value, dimension, place })
    }
}

impl Serialize for PowerStiffness {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.value)
    }
}

impl JsonSchema for PowerStiffness {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "PowerStiffness".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "type": ["number", "string"] })
    }
}
