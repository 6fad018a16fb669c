//! Physical quantities: a number in the units of the case, or a string with a unit.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;
use super::context::parameter_names;
use super::expression::Expression;
use super::place::Place;
use super::unit::{self, Dimension};
use super::units::{self, Units};

/// A finite number of dimension kg^`KG` m^`M` s^`S` in the units of the case, with its place.
///
/// Written as a number or as a string with a unit (`"5 MPa"`) of that dimension, which is converted as it is read.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quantity<const KG: i8, const M: i8, const S: i8> {
    /// Value in the units of the case, which are SI units unless the case has `units`.
    pub value: f64,
    /// Where it is written.
    pub place: Place,
}

/// A pure number.
pub type Number = Quantity<0, 0, 0>;
/// \[m\]
pub type Length = Quantity<0, 1, 0>;
/// \[s\]
pub type Duration = Quantity<0, 0, 1>;
/// [1/s]
pub type Rate = Quantity<0, 0, -1>;
/// \[m/s\]
pub type Velocity = Quantity<0, 1, -1>;
/// \[kg/m3\]
pub type Density = Quantity<1, -3, 0>;
/// \[Pa\]
pub type Pressure = Quantity<1, -1, -2>;
/// \[m/Pa\]
pub type Compliance = Quantity<-1, 2, 2>;
/// \[Pa/m\]
pub type Stiffness = Quantity<1, -2, -2>;
/// [Pa s/m]
pub type AreaViscosity = Quantity<1, -2, -1>;
/// \[s/m\]
pub type InverseVelocity = Quantity<0, -1, 1>;

impl<const KG: i8, const M: i8, const S: i8> Quantity<KG, M, S> {
    /// The dimension of this type.
    pub const DIMENSION: Dimension = Dimension([KG as f64, M as f64, S as f64]);

    /// A value of the program's own, such as a default.
    pub fn new(value: f64) -> Self {
        Self { value, place: Place::default() }
    }
}

impl<'de, const KG: i8, const M: i8, const S: i8> Deserialize<'de> for Quantity<KG, M, S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = At::<Scalar>::deserialize(deserializer)?;
        let place = raw.place;
        let value = raw.value.in_dimension(Self::DIMENSION).map_err(|c| D::Error::custom(c.at(place)))?;
        Ok(Self { value, place })
    }
}

impl<const KG: i8, const M: i8, const S: i8> Serialize for Quantity<KG, M, S> {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        serializer.serialize_f64(self.value)
    }
}

impl<const KG: i8, const M: i8, const S: i8> JsonSchema for Quantity<KG, M, S> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "type": ["number", "string"] })
    }
}

/// Reads a time on the clock of the machine, whose plain numbers are seconds in every system of units.
pub fn wall_time<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
    units::reading_in(Units::SI, || Option::deserialize(deserializer))
}

/// A value that was read in place of a number.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar {
    /// A number.
    Number(f64),
    /// A text, perhaps a number with a unit.
    Text(String),
    /// What is neither, in words.
    Other(&'static str),
}

impl Scalar {
    /// The value of an expression in which a parameter of the case occurs; `None` if this is no such expression.
    pub fn parameter_expression(&self) -> Option<Result<f64, Complaint>> {
        let Self::Text(text) = self else { return None };
        let expression = Expression::parse(text).ok().filter(Expression::uses_parameters)?;
        if expression.varies_in_space() || expression.varies_in_time() {
            let message = format!("'{text}' depends on x, y, z or t, but one number is expected");
            return Some(Err(Complaint::new(message)));
        }
        let value = expression.value([0.0; 3], 0.0);
        let message = || Complaint::new(format!("the value of '{text}' is not finite"));
        Some(if value.is_finite() { Ok(value) } else { Err(message()) })
    }

    /// Returns what is wrong with an expression of parameters. It is `None` if the case has no
    /// parameters, or if the text is a number with a unit.
    fn misspelt_parameter(&self) -> Option<Complaint> {
        let Self::Text(text) = self else { return None };
        if parameter_names().is_empty() || unit::follows_number(text) {
            return None;
        }
        Expression::parse(text).err()
    }

    /// The value in the units of the case, if this is a number or a string with a unit of that dimension.
    pub fn in_dimension(&self, dimension: Dimension) -> Result<f64, Complaint> {
        let units = units::reading();
        let expected = units.describe(dimension);
        let examples = || units.examples(dimension);
        let (text, found) = match self {
            Self::Number(value) => return Ok(*value),
            Self::Text(text) => match self.parameter_expression() {
                Some(value) => return value,
                None => (text, unit::parse(text)),
            },
            Self::Other(found) => {
                return Err(Complaint::new(format!("expected {expected}, found {found}")).hint(examples()));
            }
        };
        let (si, written) = found.map_err(|c| {
            self.misspelt_parameter().unwrap_or(Complaint {
                message: format!("{}; expected {expected}", c.message),
                hint: if c.hint.is_empty() { examples() } else { c.hint.clone() },
                ..c
            })
        })?;
        if written == dimension {
            return Ok(units.number(si, dimension));
        }
        let message = if written == Dimension::NONE {
            format!("missing unit: '{text}'; expected {expected}")
        } else {
            format!("'{text}' is {}; expected {expected}", units.describe(written))
        };
        Err(Complaint::new(message).hint(examples()))
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyScalar)
    }
}

struct AnyScalar;

impl<'de> Visitor<'de> for AnyScalar {
    type Value = Scalar;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or a string with a unit")
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Scalar, E> {
        Ok(if value.is_finite() {
            Scalar::Number(value)
        } else {
            Scalar::Other("a number that is not finite")
        })
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Scalar, E> {
        Ok(Scalar::Number(value as f64))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Scalar, E> {
        Ok(Scalar::Number(value as f64))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Scalar, E> {
        Ok(Scalar::Text(value.to_string()))
    }
    fn visit_bool<E: Error>(self, _: bool) -> Result<Scalar, E> {
        Ok(Scalar::Other("true or false"))
    }
    fn visit_unit<E: Error>(self) -> Result<Scalar, E> {
        Ok(Scalar::Other("nothing"))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Scalar, A::Error> {
        while seq.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Scalar::Other("a list"))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Scalar, A::Error> {
        while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Scalar::Other("a mapping"))
    }
}
