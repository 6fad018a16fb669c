//! What takes the place of a value that could not be read: data of any kind is read from it.

use std::marker::PhantomData;

use serde::de::value::MapDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess, VariantAccess,
    Visitor,
};
use serde::forward_to_deserialize_any;

use super::context::CHOICE;
use super::context::{PLACED, set_place};
use super::place::Place;

/// Stands for anything.
pub(super) struct StandIn<E> {
    number: f64,
    place: Place,
    /// Something was written here; what was not is left to its default.
    is_written: bool,
    error: PhantomData<E>,
}

impl<E> Clone for StandIn<E> {
    fn clone(&self) -> Self {
        Self { number: self.number, place: self.place, is_written: self.is_written, error: PhantomData }
    }
}

impl<E: Error> StandIn<E> {
    /// A stand-in for what is written at a place.
    pub(super) fn new(number: f64, place: Place) -> Self {
        Self { number, place, is_written: true, error: PhantomData }
    }

    fn implied(&self) -> Self {
        Self { is_written: false, ..self.clone() }
    }

    /// A mapping of these keys to stand-ins that are not written. Every mapping is of this type, so
    /// that a visitor is compiled once for all of them.
    fn mapping<'de>(&self, keys: &'static [&'static str]) -> impl MapAccess<'de, Error = E> + use<'de, E> {
        let value = self.implied();
        MapDeserializer::new(keys.iter().map(move |key| (*key, value.clone())))
    }
}

/// A mapping without entries.
pub(super) fn empty_mapping<'de, E: Error>() -> impl MapAccess<'de, Error = E> {
    StandIn::new(0.0, Place::default()).mapping(&[])
}

macro_rules! read_as {
    ($($visit:ident($value:expr): $($method:ident)*;)*) => {
        $($(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
            visitor.$visit($value)
        })*)*
    };
}

impl<'de, E: Error> Deserializer<'de> for StandIn<E> {
    type Error = E;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        visitor.visit_f64(self.number)
    }
    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        visitor.visit_f64(self.number)
    }
    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        visitor.visit_f64(self.number)
    }
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        if self.is_written { visitor.visit_some(self) } else { visitor.visit_none() }
    }
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, E> {
        match name {
            // Whatever laws there are; no YAML has bytes.
            CHOICE => return visitor.visit_bytes(&[]),
            PLACED => set_place(self.place),
            _ => {}
        }
        visitor.visit_newtype_struct(self)
    }
    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        visitor.visit_seq(Entries { each: self, left: 0 })
    }
    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, E> {
        visitor.visit_seq(Entries { each: self, left: length })
    }
    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, E> {
        self.deserialize_tuple(length, visitor)
    }
    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        visitor.visit_map(empty_mapping())
    }
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, E> {
        visitor.visit_map(self.mapping(keys))
    }
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, E> {
        visitor.visit_enum(AnyOf { name: names.first().copied().unwrap_or_default(), inner: self })
    }
    read_as! {
        visit_bool(false): deserialize_bool;
        visit_u64(1): deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_u8
            deserialize_u16 deserialize_u32 deserialize_u64;
        visit_str("-"): deserialize_str deserialize_string deserialize_char deserialize_identifier;
    }
    forward_to_deserialize_any! { unit ignored_any bytes byte_buf }
    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, E> {
        visitor.visit_unit()
    }
}

impl<'de, E: Error> IntoDeserializer<'de, E> for StandIn<E> {
    type Deserializer = Self;
    fn into_deserializer(self) -> Self {
        self
    }
}

/// So many entries of a list.
struct Entries<E> {
    each: StandIn<E>,
    left: usize,
}

impl<'de, E: Error> SeqAccess<'de> for Entries<E> {
    type Error = E;
    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, E> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(self.each.clone()).map(Some)
    }
}

/// A law of that name with any parameters.
pub(super) struct AnyOf<E> {
    name: &'static str,
    inner: StandIn<E>,
}

impl<E: Error> AnyOf<E> {
    /// The first of the laws that there are.
    pub(super) fn first(names: &'static [&'static str]) -> Self {
        let inner = StandIn::new(1.0, Place::default()).implied();
        Self { name: names.first().copied().unwrap_or_default(), inner }
    }
}

impl<'de, E: Error> EnumAccess<'de> for AnyOf<E> {
    type Error = E;
    type Variant = Self;
    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), E> {
        Ok((seed.deserialize(self.name.into_deserializer())?, self))
    }
}

impl<'de, E: Error> VariantAccess<'de> for AnyOf<E> {
    type Error = E;
    fn unit_variant(self) -> Result<(), E> {
        Ok(())
    }
    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, E> {
        seed.deserialize(self.inner)
    }
    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, E> {
        self.inner.deserialize_tuple(length, visitor)
    }
    fn struct_variant<V: Visitor<'de>>(
        self,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, E> {
        self.inner.deserialize_struct("parameters", keys, visitor)
    }
}
