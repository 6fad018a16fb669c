//! `bodies.NAME.sets`: sets of a body by the reference position, and lists of sets as one surface.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::reader::at::At;
use crate::reader::complaint::Complaint;
use crate::reader::condition::Condition;
use crate::reader::context::CHOICE;
use crate::reader::quantity::Length;
use crate::reader::tagged::tagged;

/// What a set consists of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Members")]
pub enum Members {
    /// Sides of elements on the outer surface of the body.
    #[default]
    Facets,
    /// Nodes of the body, also inside it.
    Nodes,
    /// Elements of the body.
    Elements,
}
tagged!(Members, "kind of set");

/// A set of a body: a condition on the reference position, or one of the keys below.
///
/// A facet or an element belongs to the set if all of its nodes fulfil the condition or lie in the box or sphere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "BodySetKeys")]
struct Keys {
    /// What the set consists of, with `where`, `box` and `sphere`; facets if absent. The other keys
    /// keep the kind of the sets that they combine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    of: Option<At<Members>>,
    /// Condition on the reference position, such as `"x > 0.3 and z < 1e-6"`, without t. Its
    /// tolerance is that of the numbers in it.
    #[serde(default, rename = "where", skip_serializing_if = "Option::is_none")]
    condition: Option<At<Condition>>,
    /// An axis-parallel box that contains the members, with its boundary.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    cuboid: Option<BoxRegion>,
    /// A sphere (in 2D a circle) that contains the members, with its boundary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sphere: Option<SphereRegion>,
    /// Members of any of these sets of the body: sets of the mesh and sets that are defined above,
    /// without the name of the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    union: Option<At<Vec<At<String>>>>,
    /// Members of the first of these sets that are in none of the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    difference: Option<At<Vec<At<String>>>>,
    /// Members that are in all of these sets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    intersection: Option<At<Vec<At<String>>>>,
}

/// Points between two corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRegion {
    /// Smallest coordinates \[m\].
    pub min: At<Vec<Length>>,
    /// Largest coordinates \[m\].
    pub max: At<Vec<Length>>,
}

/// Points within a distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereRegion {
    /// Centre \[m\].
    pub center: At<Vec<Length>>,
    /// Radius \[m\], > 0.
    pub radius: Length,
}

/// How sets are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Combination {
    /// Members of any of them.
    Union,
    /// Members of the first that are in no other.
    Difference,
    /// Members of all of them.
    Intersection,
}

/// Which members a set has.
#[derive(Debug, Clone, PartialEq)]
pub enum Selection {
    /// Those at positions that fulfil a condition.
    Where(At<Condition>),
    /// Those in a box.
    Box(BoxRegion),
    /// Those in a sphere.
    Sphere(SphereRegion),
    /// Those of other sets.
    Of(Combination, At<Vec<At<String>>>),
}

/// A set of a body that the case defines.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySet {
    /// What it consists of; for a combination of sets it is what they consist of.
    pub members: Members,
    /// Which of them.
    pub selection: Selection,
}

impl BodySet {
    /// Names of the sets that it combines.
    pub fn combined(&self) -> impl Iterator<Item = &str> {
        let names = match &self.selection {
            Selection::Of(_, names) => names.as_slice(),
            _ => &[],
        };
        names.iter().map(|name| name.value.as_str())
    }

    fn of_keys(keys: Keys) -> Result<Self, Complaint> {
        let place = keys.of.as_ref().map(|of| of.place);
        let combined = |how: Combination| move |names| Selection::Of(how, names);
        let selections = [
            keys.condition.map(Selection::Where),
            keys.cuboid.map(Selection::Box),
            keys.sphere.map(Selection::Sphere),
            keys.union.map(combined(Combination::Union)),
            keys.difference.map(combined(Combination::Difference)),
            keys.intersection.map(combined(Combination::Intersection)),
        ];
        let mut given = selections.into_iter().flatten();
        let (Some(selection), None) = (given.next(), given.next()) else {
            let message = "a set needs exactly one of where, box, sphere, union, difference, intersection";
            return Err(Complaint::new(message.into())
                .hint("write for example { of: nodes, where: \"x > 0.3\" }, and combine sets with union"));
        };
        if let (Selection::Of(..), Some(place)) = (&selection, place) {
            let message = "`of` has no meaning here: a combination is of the kind of its sets";
            return Err(Complaint::new(message.into()).at(place).hint("remove `of`"));
        }
        Ok(Self { members: keys.of.map(|of| of.value).unwrap_or_default(), selection })
    }

    fn keys(&self) -> Keys {
        let is_combined = matches!(self.selection, Selection::Of(..));
        let of = (!is_combined && self.members != Members::Facets).then(|| self.members.into());
        let mut keys = Keys { of, ..Keys::default() };
        match self.selection.clone() {
            Selection::Where(condition) => keys.condition = Some(condition),
            Selection::Box(region) => keys.cuboid = Some(region),
            Selection::Sphere(region) => keys.sphere = Some(region),
            Selection::Of(Combination::Union, names) => keys.union = Some(names),
            Selection::Of(Combination::Difference, names) => keys.difference = Some(names),
            Selection::Of(Combination::Intersection, names) => keys.intersection = Some(names),
        }
        keys
    }
}

impl<'de> Deserialize<'de> for BodySet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnySet;
        impl<'de> Visitor<'de> for AnySet {
            type Value = BodySet;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a condition such as \"x > 0.3\", or a mapping with where, box, sphere or union")
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<BodySet, D::Error> {
                inner.deserialize_any(self)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<BodySet, E> {
                let condition = Condition::parse(text).map_err(E::custom)?;
                Ok(BodySet { members: Members::Facets, selection: Selection::Where(condition.into()) })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<BodySet, A::Error> {
                let keys = Keys::deserialize(MapAccessDeserializer::new(map))?;
                BodySet::of_keys(keys).map_err(A::Error::custom)
            }
            // Marks a value that could not be read: YAML never produces bytes.
            fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<BodySet, E> {
                self.visit_str("x == x")
            }
        }
        deserializer.deserialize_newtype_struct(CHOICE, AnySet)
    }
}

impl Serialize for BodySet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.selection {
            Selection::Where(condition) if self.members == Members::Facets => condition.serialize(serializer),
            _ => self.keys().serialize(serializer),
        }
    }
}

impl JsonSchema for BodySet {
    fn schema_name() -> Cow<'static, str> {
        "BodySet".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let keys = generator.subschema_for::<Keys>();
        json_schema!({ "anyOf": [keys, { "type": "string" }] })
    }
}

/// One or more names of bodies or their sets, which act as one.
///
/// It behaves as the name of a set: the only one, or for several sets their names in ascending order joined by ` + `.
#[derive(Debug, Clone, PartialEq)]
pub struct SetNames {
    names: Vec<At<String>>,
    joined: At<String>,
}

impl SetNames {
    /// The names.
    pub fn names(&self) -> &[At<String>] {
        &self.names
    }

    /// Whether there are several names.
    pub fn is_list(&self) -> bool {
        self.names.len() > 1
    }

    /// The body of each name.
    pub fn bodies(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|name| name.split('.').next().unwrap_or_default())
    }

    fn of(names: Vec<At<String>>) -> Self {
        let mut sorted: Vec<&str> = names.iter().map(|name| name.value.as_str()).collect();
        sorted.sort_unstable();
        let place = names.first().map(|name| name.place).unwrap_or_default();
        let joined = At { value: sorted.join(" + "), place };
        Self { names, joined }
    }
}

impl From<At<String>> for SetNames {
    fn from(name: At<String>) -> Self {
        Self::of(vec![name])
    }
}

impl Deref for SetNames {
    type Target = At<String>;
    fn deref(&self) -> &At<String> {
        &self.joined
    }
}

/// What is written: a name or several.
enum Written {
    One(String),
    List(Vec<At<String>>),
}

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnyNames;
        impl<'de> Visitor<'de> for AnyNames {
            type Value = Written;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a name such as block.bottom, or a list of names")
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<Written, D::Error> {
                inner.deserialize_any(self)
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<Written, E> {
                Ok(Written::One(name.to_owned()))
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<Written, E> {
                Ok(Written::One(number.to_string()))
            }
            fn visit_f64<E: Error>(self, number: f64) -> Result<Written, E> {
                Ok(Written::One(number.to_string()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Written, A::Error> {
                let mut names: Vec<At<String>> = Vec::new();
                while let Some(name) = list.next_element::<At<String>>()? {
                    if names.iter().any(|other| other.value == name.value) {
                        let twice = Complaint::new(format!("'{}' occurs twice in the list", name.value));
                        return Err(A::Error::custom(twice.at(name.place).hint("keep one of the two")));
                    }
                    names.push(name);
                }
                if names.is_empty() {
                    let empty = Complaint::new("the list has no name".into());
                    return Err(A::Error::custom(empty.hint("write for example [block.left, block.right]")));
                }
                Ok(Written::List(names))
            }
            // Marks a value that could not be read: YAML never produces bytes.
            fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<Written, E> {
                Ok(Written::One("-".to_owned()))
            }
        }
        deserializer.deserialize_newtype_struct(CHOICE, AnyNames)
    }
}

impl<'de> Deserialize<'de> for SetNames {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let At { value, place } = At::<Written>::deserialize(deserializer)?;
        let mut names = match value {
            Written::One(name) => Self::of(vec![At { value: name, place }]),
            Written::List(names) => Self::of(names),
        };
        names.joined.place = place;
        Ok(names)
    }
}

impl Serialize for SetNames {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.names.as_slice() {
            [name] => name.serialize(serializer),
            names => names.serialize(serializer),
        }
    }
}

impl JsonSchema for SetNames {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "SetNames".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let name = serde_json::json!({ "type": "string" });
        json_schema!({ "anyOf": [name, { "type": "array", "items": name, "minItems": 1 }] })
    }
}
