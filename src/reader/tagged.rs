//! Laws as tagged mappings: `name`, or `name: { parameters }`, or, where the law has a `constant` variant, a number.
//!
//! serde alone takes `rest` but not `{ rest: {} }`, and `{ equilibrium: {} }` but not `equilibrium`. A user should not
//! have to know which of the two a law without parameters wants, so both are taken for every law.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::{MapAccessDeserializer, MapDeserializer};
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use super::at::At;
use super::complaint::Complaint;
use super::context::CHOICE;
use super::quantity::Scalar;
use super::stand_in::{AnyOf, empty_mapping};
use super::unit::Dimension;

/// Makes a `#[serde(remote = "Self")]` enum readable in both spellings; the noun is what errors call it. With
/// `read` in front it is read only, never written.
#[macro_export]
macro_rules! tagged {
    (read $law:ty, $noun:literal) => {
        impl<'de> serde::Deserialize<'de> for $law {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
                <$law>::deserialize($crate::reader::tagged::Tagged { inner: deserializer, noun: $noun })
            }
        }
    };
    ($law:ty, $noun:literal) => {
        $crate::reader::tagged::tagged!(read $law, $noun);
        impl serde::Serialize for $law {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
                <$law>::serialize(self, serializer)
            }
        }
    };
}
pub use crate::tagged;

/// Deserializer that hands a name or a one-entry mapping to an enum's visitor.
pub struct Tagged<D> {
    /// What the law is read from.
    pub inner: D,
    /// What errors call the law.
    pub noun: &'static str,
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Tagged<D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_any(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.inner.deserialize_newtype_struct(CHOICE, Choice { noun: self.noun, variants, visitor })
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

/// A noun with its indefinite article. Those that `tagged` gets begin with a vowel as they are pronounced if they do as written.
fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

struct Choice<V> {
    noun: &'static str,
    variants: &'static [&'static str],
    visitor: V,
}

impl<V> Choice<V> {
    fn known(&self, name: &str) -> Result<(), Complaint> {
        if self.variants.contains(&name) {
            return Ok(());
        }
        Err(Complaint::unknown(self.noun, name, self.variants.iter().copied()))
    }

    fn constant<'de, E: Error>(self, value: f64) -> Result<V::Value, E>
    where
        V: Visitor<'de>,
    {
        if !self.variants.contains(&"constant") {
            let found =
                Complaint::new(format!("expected {}, found the number {value}", with_article(self.noun)))
                    .hint(format!("known: {}", self.variants.join(", ")));
            return Err(E::custom(found));
        }
        let entry = std::iter::once(("constant", value));
        self.visitor.visit_enum(MapAccessDeserializer::new(MapDeserializer::new(entry)))
    }
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Choice<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: one of {}", with_article(self.noun), self.variants.join(", "))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<Self::Value, D::Error> {
        inner.deserialize_any(self)
    }

    /// Bytes mark a placeholder for any value. YAML has no bytes, so no case file can contain this mark.
    fn visit_bytes<E: Error>(self, _: &[u8]) -> Result<Self::Value, E> {
        self.visitor.visit_enum(AnyOf::first(self.variants))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        let is_number = name.trim_start().starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        if self.variants.contains(&"constant") {
            let written = Scalar::Text(name.to_owned());
            if is_number || written.parameter_expression().is_some() {
                let number = written.in_dimension(Dimension::NONE).map_err(E::custom)?;
                return self.constant(number);
            }
        }
        self.known(name).map_err(E::custom)?;
        self.visitor.visit_enum(NameAlone(name, PhantomData))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        self.constant(value)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.constant(value as f64)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        self.constant(value as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let Some(name) = map.next_key::<At<String>>()? else {
            let empty =
                Complaint::new(format!("expected {}, found an empty mapping", with_article(self.noun)))
                    .hint(format!("known: {}", self.variants.join(", ")));
            return Err(A::Error::custom(empty));
        };
        self.known(&name).map_err(|complaint| A::Error::custom(complaint.at(name.place)))?;
        let noun = self.noun;
        let first = name.value.clone();
        let value = self.visitor.visit_enum(NameAndParameters { name: name.value, map: &mut map })?;
        if let Some(second) = map.next_key::<At<String>>()? {
            let both =
                Complaint::new(format!("expected only one {noun}, found '{first}' and '{}'", second.value));
            return Err(A::Error::custom(both.at(second.place)));
        }
        Ok(value)
    }
}

/// `name` without parameters.
struct NameAlone<'a, E>(&'a str, PhantomData<E>);

impl<'de, E: Error> EnumAccess<'de> for NameAlone<'_, E> {
    type Error = E;
    type Variant = NoParameters<E>;
    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self::Variant), E> {
        Ok((seed.deserialize(self.0.into_deserializer())?, NoParameters(PhantomData)))
    }
}

struct NoParameters<E>(PhantomData<E>);

impl<'de, E: Error> VariantAccess<'de> for NoParameters<E> {
    type Error = E;
    fn unit_variant(self) -> Result<(), E> {
        Ok(())
    }
    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, E> {
        seed.deserialize(self)
    }
    fn tuple_variant<V: Visitor<'de>>(self, _len: usize, visitor: V) -> Result<V::Value, E> {
        self.deserialize_any(visitor)
    }
    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, E> {
        self.deserialize_struct("parameters", fields, visitor)
    }
}

impl<'de, E: Error> Deserializer<'de> for NoParameters<E> {
    type Error = E;

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, E> {
        Err(E::custom(Complaint::new("this law needs a value: `name: value`".into())))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, E> {
        visitor.visit_map(empty_mapping())
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

/// `name: { parameters }`.
struct NameAndParameters<'a, A> {
    name: String,
    map: &'a mut A,
}

impl<'de, A: MapAccess<'de>> EnumAccess<'de> for NameAndParameters<'_, A> {
    type Error = A::Error;
    type Variant = Self;
    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), A::Error> {
        let variant = seed.deserialize(self.name.as_str().into_deserializer())?;
        Ok((variant, self))
    }
}

impl<'de, A: MapAccess<'de>> VariantAccess<'de> for NameAndParameters<'_, A> {
    type Error = A::Error;
    fn unit_variant(self) -> Result<(), A::Error> {
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Nothing {}
        self.map.next_value::<Option<Nothing>>().map(drop)
    }
    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
    fn tuple_variant<V: Visitor<'de>>(self, _len: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(Parameters(visitor, &[]))
    }
    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(Parameters(visitor, fields))
    }
}

/// Reads the parameters of a variant as a struct, so that errors keep the format's positions.
struct Parameters<V>(V, &'static [&'static str]);

impl<'de, V: Visitor<'de>> DeserializeSeed<'de> for Parameters<V> {
    type Value = V::Value;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
        deserializer.deserialize_struct("parameters", self.1, self.0)
    }
}
