//! serde reads data from a tree of nodes: every error that has no place of its own gets that of the innermost node.

use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{DeserializeSeed, Deserializer, Error as _, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

use super::at::At;
use super::complaint::Complaint;
use super::context::{CHOICE, NODE, PLACED, set_place};
use super::node::{Node, Tree, keep_node};
use super::stand_in::StandIn;

/// Characters of a text that an error repeats.
const SHORT: usize = 60;

type Read<T> = Result<T, Complaint>;

impl Node {
    /// What is wrong here without saying where is wrong at this node.
    fn placed<T>(&self, read: Read<T>) -> Read<T> {
        read.map_err(|complaint| complaint.or_at(self.place))
    }

    fn expected<T>(&self, what: &str) -> Read<T> {
        Err(Complaint::new(format!("expected {what}, found {}", self.noun())).at(self.place))
    }

    fn stand_in(&self) -> Option<StandIn<Complaint>> {
        match self.tree {
            Tree::Anything(number) => Some(StandIn::new(number, self.place)),
            _ => None,
        }
    }

    fn noun(&self) -> String {
        match &self.tree {
            Tree::Null => "nothing".into(),
            Tree::Truth(_) => "true or false".into(),
            Tree::Text(text) if text.chars().count() > SHORT => {
                format!("'{} ...'", text.chars().take(SHORT).collect::<String>())
            }
            Tree::Text(text) => format!("'{text}'"),
            Tree::List(_) => "a list".into(),
            Tree::Map(_) => "a mapping".into(),
            Tree::Whole(_) | Tree::Number(_) | Tree::Anything(_) => self.label(),
        }
    }

    fn list<'de, V: Visitor<'de>>(&'de self, visitor: V) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_seq(visitor));
        }
        let Tree::List(entries) = &self.tree else { return self.expected("a list, `[a, b]`") };
        let mut left = entries.iter();
        let value = self.placed(visitor.visit_seq(List(&mut left)))?;
        match left.len() {
            0 => Ok(value),
            more => {
                let count = entries.len();
                let wanted = entries.len() - more;
                let message = format!("expected {wanted} entries, found {count}");
                Err(Complaint::new(message).at(self.place))
            }
        }
    }

    /// Nothing is a mapping without entries, as in `output:`.
    fn mapping<'de, V: Visitor<'de>>(&'de self, visitor: V) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_map(visitor));
        }
        let entries = match &self.tree {
            Tree::Map(entries) => entries.as_slice(),
            Tree::Null => &[],
            _ => return self.expected("a mapping, `key: value`"),
        };
        self.placed(visitor.visit_map(Map { entries: entries.iter(), value: None }))
    }

    fn whole<'de, V: Visitor<'de>>(&'de self, visitor: V) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_i64(visitor));
        }
        match self.tree {
            Tree::Whole(number) => self.placed(visitor.visit_i64(number)),
            _ => self.expected("a whole number"),
        }
    }

    fn count<'de, V: Visitor<'de>>(&'de self, visitor: V) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_u64(visitor));
        }
        match self.tree {
            Tree::Whole(number) if number >= 0 => self.placed(visitor.visit_u64(number as u64)),
            _ => self.expected("a whole number, zero or more"),
        }
    }

    fn word<'de, V: Visitor<'de>>(&'de self, visitor: V) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_str(visitor));
        }
        match &self.tree {
            Tree::Text(text) => self.placed(visitor.visit_borrowed_str(text)),
            Tree::Whole(_) | Tree::Number(_) => self.placed(visitor.visit_string(self.label())),
            _ => self.expected("a word"),
        }
    }
}

macro_rules! read_by {
    ($($by:ident: $($method:ident)*;)*) => {
        $($(fn $method<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
            self.$by(visitor)
        })*)*
    };
}

impl<'de> Deserializer<'de> for &'de Node {
    type Error = Complaint;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.placed(match &self.tree {
            Tree::Null => visitor.visit_unit(),
            Tree::Truth(truth) => visitor.visit_bool(*truth),
            Tree::Whole(number) => visitor.visit_i64(*number),
            Tree::Number(number) => visitor.visit_f64(*number),
            Tree::Text(text) => visitor.visit_borrowed_str(text),
            Tree::List(_) => self.list(visitor),
            Tree::Map(_) => self.mapping(visitor),
            Tree::Anything(number) => visitor.visit_f64(*number),
        })
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match self.tree {
            Tree::Truth(truth) => visitor.visit_bool(truth),
            Tree::Anything(_) => visitor.visit_bool(false),
            _ => self.expected("true or false"),
        }
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match self.tree {
            Tree::Whole(number) => visitor.visit_f64(number as f64),
            Tree::Number(number) | Tree::Anything(number) => visitor.visit_f64(number),
            _ => self.expected("a number"),
        }
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_f64(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        if self.tree == Tree::Null { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        match name {
            PLACED => set_place(self.place),
            CHOICE if self.stand_in().is_none() => return self.deserialize_any(visitor),
            CHOICE => return self.placed(visitor.visit_bytes(&[])),
            NODE => keep_node(self),
            _ => {}
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Read<V::Value> {
        match self.stand_in() {
            Some(anything) => self.placed(anything.deserialize_tuple(length, visitor)),
            None => self.list(visitor),
        }
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Read<V::Value> {
        self.deserialize_tuple(length, visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        match self.stand_in() {
            Some(anything) => self.placed(anything.deserialize_struct(name, keys, visitor)),
            None => self.mapping(visitor),
        }
    }

    /// `name` or `{ name: content }`.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        if let Some(anything) = self.stand_in() {
            return self.placed(anything.deserialize_enum(name, variants, visitor));
        }
        self.placed(match &self.tree {
            Tree::Text(text) => visitor.visit_enum(StrDeserializer::new(text)),
            Tree::Map(entries) => {
                let map = Map { entries: entries.iter(), value: None };
                visitor.visit_enum(MapAccessDeserializer::new(map))
            }
            _ => self.expected("a word"),
        })
    }

    read_by! {
        whole: deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64;
        count: deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64;
        word: deserialize_str deserialize_string deserialize_char deserialize_identifier;
        list: deserialize_seq;
        mapping: deserialize_map;
        deserialize_any: deserialize_bytes deserialize_byte_buf deserialize_unit deserialize_ignored_any;
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Read<V::Value> {
        self.deserialize_any(visitor)
    }
}

/// The entries of a list that are left.
struct List<'a, 'de>(&'a mut std::slice::Iter<'de, Node>);

impl<'de> SeqAccess<'de> for List<'_, 'de> {
    type Error = Complaint;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<Option<S::Value>> {
        let read = |node: &'de Node| node.placed(seed.deserialize(node));
        self.0.next().map(read).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

/// The entries of a mapping that are left, and the value whose key was read.
struct Map<'de> {
    entries: std::slice::Iter<'de, (At<String>, Node)>,
    value: Option<&'de Node>,
}

impl<'de> MapAccess<'de> for Map<'de> {
    type Error = Complaint;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<Option<S::Value>> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.value = Some(value);
        seed.deserialize(Key(key)).map(Some).map_err(|complaint| complaint.or_at(key.place))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<S::Value> {
        let value = self.value.take().ok_or_else(|| Complaint::custom("a value without a key"))?;
        value.placed(seed.deserialize(value))
    }
}

/// A key of a mapping.
struct Key<'de>(&'de At<String>);

impl<'de> Deserializer<'de> for Key<'de> {
    type Error = Complaint;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_borrowed_str(&self.0.value)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        if name == PLACED {
            set_place(self.0.place);
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        self.0.as_str().into_deserializer().deserialize_enum(name, variants, visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}
