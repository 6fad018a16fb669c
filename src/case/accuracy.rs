//! `accuracy`: tolerances of the answer, from which steps, multipliers and tolerances of solvers follow.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::reader::at::At;
use crate::reader::complaint::Complaint;
use crate::reader::context::CHOICE;
use crate::reader::place::Place;
use crate::reader::quantity::{Length, Number, Scalar};

/// Tolerances of the answer. A part that is `none` is not controlled: the rest of the case determines it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Largest penetration, and largest gap under pressure.
    pub penetration: Option<Penetration>,
    /// Creep of points that stick until the end, over the largest displacement.
    pub slip: Option<Number>,
    /// Sum of the errors of all steps, over the largest displacement; both are root mean squares weighted by mass.
    pub time: Option<Number>,
    /// Unexplained energy that is gained or lost, relative to the largest energy.
    pub energy: Option<Number>,
}

/// Largest penetration that is acceptable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Penetration {
    /// As a length \[m\].
    Length(Length),
    /// Over the mean size of the contactor's facets.
    Relative(Number),
}

/// A level of accuracy that has a name.
pub struct Level {
    /// Name in the case file.
    pub name: &'static str,
    /// Penetration over the size of a facet, slip, time, energy.
    pub values: [f64; 4],
    /// One line for `contact-petsc list`.
    pub about: &'static str,
}

/// All levels; what a case leaves out of a mapping is that of the second, `balanced`.
pub const LEVELS: [Level; 3] = [
    Level {
        name: "fast",
        values: [1e-2, 1e-2, 1e-2, 5e-2],
        about: "1 % of displacements and facets, 5 % of energy",
    },
    Level {
        name: "balanced",
        values: [1e-3, 1e-3, 1e-3, 2e-2],
        about: "0.1 % of displacements and facets, 2 % of energy",
    },
    Level {
        name: "tight",
        values: [1e-4, 1e-4, 1e-4, 5e-3],
        about: "0.01 % of displacements and facets, 0.5 % of energy",
    },
];

const KEYS: [&str; 4] = ["penetration", "slip", "time", "energy"];

impl Accuracy {
    fn of(level: &Level) -> Self {
        let [penetration, slip, time, energy] = level.values.map(Number::new);
        let penetration = Some(Penetration::Relative(penetration));
        Self { penetration, slip: Some(slip), time: Some(time), energy: Some(energy) }
    }

    fn named(name: &str) -> Result<Self, Complaint> {
        let level = LEVELS.iter().find(|level| level.name == name);
        let unknown = || Complaint::unknown("accuracy", name, LEVELS.iter().map(|level| level.name));
        level.map(Self::of).ok_or_else(unknown)
    }
}

impl Penetration {
    /// Its number, for ranges.
    pub fn value(&self) -> (f64, Place) {
        match self {
            Self::Length(length) => (length.value, length.place),
            Self::Relative(number) => (number.value, number.place),
        }
    }
}

/// A tolerance in transit: a quantity, or none.
struct Part<T>(Option<T>);

impl<'de> Deserialize<'de> for Part<Number> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = At::<Scalar>::deserialize(deserializer)?;
        let place = raw.place;
        if is_none(&raw.value) {
            return Ok(Self(None));
        }
        let value = raw.value.in_dimension(Number::DIMENSION).map_err(|c| D::Error::custom(c.at(place)))?;
        Ok(Self(Some(Number { value, place })))
    }
}

impl<'de> Deserialize<'de> for Part<Penetration> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = At::<Written>::deserialize(deserializer)?;
        let place = raw.place;
        match raw.value {
            Written::Relative(number) => Ok(Self(Some(Penetration::Relative(number)))),
            Written::Scalar(scalar) if is_none(&scalar) => Ok(Self(None)),
            Written::Scalar(scalar) => {
                let value =
                    scalar.in_dimension(Length::DIMENSION).map_err(|c| D::Error::custom(c.at(place)))?;
                Ok(Self(Some(Penetration::Length(Length { value, place }))))
            }
        }
    }
}

fn is_none(scalar: &Scalar) -> bool {
    matches!(scalar, Scalar::Text(text) if text == "none")
}

enum Written {
    Scalar(Scalar),
    Relative(Number),
}

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyPenetration)
    }
}

struct AnyPenetration;

impl<'de> Visitor<'de> for AnyPenetration {
    type Value = Written;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a length [m], { relative: part of a facet }, or none")
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Written, E> {
        Ok(Written::Scalar(Scalar::Number(value)))
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Written, E> {
        Ok(Written::Scalar(Scalar::Number(value as f64)))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Written, E> {
        Ok(Written::Scalar(Scalar::Number(value as f64)))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Written, E> {
        Ok(Written::Scalar(Scalar::Text(value.to_string())))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Written, A::Error> {
        let mut relative = None;
        while let Some(key) = map.next_key::<At<String>>()? {
            if key.value != "relative" {
                let complaint = Complaint::unknown("key", &key, ["relative"].into_iter());
                return Err(A::Error::custom(complaint.at(key.place)));
            }
            relative = Some(map.next_value()?);
        }
        let none = || Complaint::new("expected { relative: ... }, found an empty mapping".into());
        Ok(Written::Relative(relative.ok_or_else(|| A::Error::custom(none()))?))
    }
}

impl<'de> Deserialize<'de> for Accuracy {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(CHOICE, AnyAccuracy)
    }
}

struct AnyAccuracy;

impl<'de> Visitor<'de> for AnyAccuracy {
    type Value = Accuracy;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an accuracy: fast, balanced, tight, or a mapping of tolerances")
    }
    fn visit_str<E: Error>(self, name: &str) -> Result<Accuracy, E> {
        Accuracy::named(name).map_err(E::custom)
    }
    fn visit_f64<E: Error>(self, number: f64) -> Result<Accuracy, E> {
        let text = format!("the number {number:e} alone does not specify which tolerance it is");
        Err(E::custom(Complaint::new(text).hint(format!(
            "write `accuracy: {{ time: {number:e} }}`, or a tolerance for one of {}; or one of the levels fast, balanced, tight",
            KEYS.join(", ")
        ))))
    }
    fn visit_i64<E: Error>(self, number: i64) -> Result<Accuracy, E> {
        self.visit_f64(number as f64)
    }
    fn visit_u64<E: Error>(self, number: u64) -> Result<Accuracy, E> {
        self.visit_f64(number as f64)
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<Accuracy, D::Error> {
        inner.deserialize_any(self)
    }
    /// Bytes mark a placeholder for any value.
    fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<Accuracy, E> {
        Ok(Accuracy::of(&LEVELS[1]))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Accuracy, A::Error> {
        let mut accuracy = Accuracy::of(&LEVELS[1]);
        let mut seen: Vec<String> = Vec::new();
        while let Some(key) = map.next_key::<At<String>>()? {
            if seen.contains(&key.value) {
                let twice = Complaint::new(format!("the key '{}' occurs twice", key.value));
                return Err(A::Error::custom(twice.at(key.place)));
            }
            match key.as_str() {
                "penetration" => accuracy.penetration = map.next_value::<Part<Penetration>>()?.0,
                "slip" => accuracy.slip = map.next_value::<Part<Number>>()?.0,
                "time" => accuracy.time = map.next_value::<Part<Number>>()?.0,
                "energy" => accuracy.energy = map.next_value::<Part<Number>>()?.0,
                _ => {
                    let complaint = Complaint::unknown("key", &key, KEYS.into_iter());
                    return Err(A::Error::custom(complaint.at(key.place)));
                }
            }
            seen.push(key.value);
        }
        Ok(accuracy)
    }
}

impl Serialize for Penetration {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        match self {
            Self::Length(length) => length.serialize(serializer),
            Self::Relative(number) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("relative", number)?;
                map.end()
            }
        }
    }
}

impl Serialize for Accuracy {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        fn entry<M: SerializeMap, T: Serialize>(
            map: &mut M,
            key: &str,
            part: &Option<T>,
        ) -> Result<(), M::Error> {
            match part {
                Some(value) => map.serialize_entry(key, value),
                None => map.serialize_entry(key, "none"),
            }
        }
        let mut map = serializer.serialize_map(Some(KEYS.len()))?;
        entry(&mut map, KEYS[0], &self.penetration)?;
        entry(&mut map, KEYS[1], &self.slip)?;
        entry(&mut map, KEYS[2], &self.time)?;
        entry(&mut map, KEYS[3], &self.energy)?;
        map.end()
    }
}

impl JsonSchema for Accuracy {
    fn schema_name() -> Cow<'static, str> {
        "Accuracy".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names = LEVELS.each_ref().map(|level| level.name);
        let number = |what: &str| json!({ "type": ["number", "string"], "description": what });
        let relative = json!({
            "type": "object", "properties": { "relative": number("Over the mean size of the contactor's facets, > 0.") },
            "required": ["relative"], "additionalProperties": false
        });
        schemars::json_schema!({
            "description": "Requested accuracy. An omitted part has its value of `balanced`. For a part \
                            that is `none`, the other settings of the case apply.",
            "anyOf": [
                { "type": "string", "enum": names },
                {
                    "type": "object",
                    "properties": {
                        "penetration": {
                            "description": "Largest penetration, and largest gap under pressure: a length \
                                            [m], > 0, or relative to the contactor's facets. Enforced by \
                                            multipliers, independently of the penalty.",
                            "anyOf": [number("[m]"), relative]
                        },
                        "slip": number("Creep of points that stick until the end, relative to the largest \
                                        displacement, between 0 and 1."),
                        "time": number("Sum of the errors of all steps, relative to the largest \
                                        displacement, between 0 and 1."),
                        "energy": number("Unexplained energy that is gained or lost, relative to the \
                                          largest energy, between 0 and 1.")
                    },
                    "additionalProperties": false
                }
            ]
        })
    }
}
