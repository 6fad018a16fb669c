//! `contact`: who may touch whom, and by which laws.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::sets::SetNames;
use crate::contact::damping::ContactDamping;
use crate::contact::friction::FrictionLaw;
use crate::contact::normal::NormalLaw;
use crate::reader::at::{At, Named};
use crate::reader::context::CHOICE;
use crate::reader::tagged::tagged;

/// A pair of surfaces that may touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Facets that carry the contact points, as body.set; a list of sets is one surface.
    pub contactor: SetNames,
    /// An obstacle, a body of `rigid`, or facets as body.set: of another body, of the same one, or
    /// the contactor itself for self-contact. With `contactor: all`, the whole surface of all
    /// bodies: an obstacle, a body of `rigid`, or `all` for all of these and all surfaces. A list of
    /// sets is one surface.
    pub target: SetNames,
    /// Normal traction as a function of the gap.
    #[serde(default)]
    pub normal: NormalLaw,
    /// Friction traction as a function of normal traction and slip.
    #[serde(default)]
    pub friction: FrictionLaw,
    /// Damping along the normal and along the surface; none if absent. It needs a dynamic scheme.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<At<ContactDamping>>,
    /// Was a key until bodies met obstacles at vertices. It is read so that the error can say why.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub quadrature: Option<At<IgnoredAny>>,
    /// Area on which the tractions act.
    #[serde(default)]
    pub area: Area,
    /// Treatment of contact points that penetrate in the initial configuration.
    #[serde(default)]
    pub initial_overclosure: InitialOverclosure,
}

/// In the place of `body.set`: the whole surface of all bodies.
pub const ALL: &str = "all";

impl Contact {
    /// A contact of all surfaces with this target, with the laws of a given contact or the default ones.
    fn general(target: &str, of: Option<&Self>) -> Self {
        let name = |name: &str| SetNames::from(At::from(name.to_owned()));
        let (contactor, target) = (name(ALL), name(target));
        match of {
            Some(contact) => Self { contactor, target, ..contact.clone() },
            None => Self {
                contactor,
                target,
                normal: NormalLaw::default(),
                friction: FrictionLaw::default(),
                damping: None,
                quadrature: None,
                area: Area::default(),
                initial_overclosure: InitialOverclosure::default(),
            },
        }
    }

    /// Whether the contactor, or the target, is the whole surface of all bodies.
    pub fn is_general(&self) -> bool {
        self.contactor.value == ALL
    }

    /// Whether a side of the contact is on that body.
    pub fn is_on(&self, body: &str) -> bool {
        let of_body = |side: &SetNames| side.value == ALL || side.bodies().any(|name| name == body);
        of_body(&self.contactor) || of_body(&self.target)
    }
}

/// Contacts by name, or the word `all`.
pub(super) fn contacts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Named<Contact>, D::Error> {
    struct Contacts;
    impl<'de> Visitor<'de> for Contacts {
        type Value = Named<Contact>;
        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("contacts by name, or `all`")
        }
        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            if text != ALL {
                return Err(E::custom(format!(
                    "contact: '{text}' is neither `all` nor a mapping from names"
                )));
            }
            Ok([(ALL.to_owned().into(), Contact::general(ALL, None))].into_iter().collect())
        }
        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            Named::deserialize(MapAccessDeserializer::new(map))
        }
        // What could not be read; no YAML has bytes.
        fn visit_bytes<E: serde::de::Error>(self, _: &[u8]) -> Result<Self::Value, E> {
            Ok(Named::default())
        }
    }
    deserializer.deserialize_newtype_struct(CHOICE, Contacts)
}

/// The contacts with obstacles that a contact of `all` with `all` includes and the case does not list.
pub(super) fn with_obstacles<'a>(
    contacts: &Named<Contact>,
    obstacles: impl Iterator<Item = &'a str>,
) -> Vec<(At<String>, Contact)> {
    let general = contacts.iter().find(|(_, contact)| contact.is_general() && contact.target.value == ALL);
    let Some((name, general)) = general else { return Vec::new() };
    let known = |obstacle: &str| {
        contacts.values().any(|contact| contact.is_general() && contact.target.value == obstacle)
    };
    let missing = obstacles.filter(|obstacle| !known(obstacle));
    missing
        .map(|obstacle| {
            let mut value = format!("{}-{obstacle}", name.value);
            while contacts.get(&value).is_some() {
                value.push('-');
            }
            (At { value, place: name.place }, Contact::general(obstacle, Some(general)))
        })
        .collect()
}

/// The schema of [`contacts`].
pub(super) fn contacts_schema(generator: &mut SchemaGenerator) -> Schema {
    let named = generator.subschema_for::<Named<Contact>>();
    json_schema!({ "anyOf": [named, { "const": ALL }] })
}

/// Area on which contact tractions act.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Area")]
pub enum Area {
    /// Deformed: tractions are Cauchy tractions.
    #[default]
    Current,
    /// Undeformed: tractions are nominal.
    Reference,
}
tagged!(Area, "area");

/// Treatment of initial penetration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "InitialOverclosure")]
pub enum InitialOverclosure {
    /// Refuse the case with the location of the largest overclosure.
    #[default]
    Error,
    /// Remove it without stress: nodes behind an obstacle are moved onto it; between bodies, and of
    /// straight facets on a round obstacle, the gap is measured from its initial value.
    Adjust,
    /// For surfaces that are meant to touch: removes overclosure like `adjust`, and closes gaps of
    /// up to an eighth of a facet, which meshes leave between curved faces.
    Conform,
    /// Keep it: it causes pressure from the start.
    Accept,
}
tagged!(InitialOverclosure, "initial overclosure");

impl InitialOverclosure {
    /// Whether overlaps count as gaps of zero.
    pub fn is_removed(self) -> bool {
        matches!(self, Self::Adjust | Self::Conform)
    }
}
