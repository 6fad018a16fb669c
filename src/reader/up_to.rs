//! Short lists that are copied like numbers.

use std::borrow::Cow;
use std::ops::Deref;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;

/// A list of one to `N` entries; behaves as their slice.
#[derive(Debug, Clone, Copy)]
pub struct UpTo<T, const N: usize> {
    entries: [T; N],
    count: usize,
}

impl<T: Copy + Default, const N: usize> UpTo<T, N> {
    /// The first `N` of these entries.
    pub fn first_of(given: &[T]) -> Self {
        let count = given.len().min(N);
        let mut entries = [T::default(); N];
        entries[..count].copy_from_slice(&given[..count]);
        Self { entries, count }
    }

    /// The list of what `f` makes of each entry.
    pub fn map<U: Copy + Default>(&self, f: impl Fn(&T) -> U) -> UpTo<U, N> {
        let mut entries = [U::default(); N];
        for (made, entry) in entries.iter_mut().zip(self.iter()) {
            *made = f(entry);
        }
        UpTo { entries, count: self.count }
    }
}

impl<T, const N: usize> Deref for UpTo<T, N> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.entries[..self.count]
    }
}

impl<T: PartialEq, const N: usize> PartialEq for UpTo<T, N> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<'de, T: Copy + Default + Deserialize<'de>, const N: usize> Deserialize<'de> for UpTo<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let list = At::<Vec<T>>::deserialize(deserializer)?;
        let found = list.len();
        if !(1..=N).contains(&found) {
            let message = format!("expected a list of 1 to {N} entries, found {found}");
            return Err(D::Error::custom(Complaint::new(message).at(list.place)));
        }
        Ok(Self::first_of(&list))
    }
}

impl<T: Serialize, const N: usize> Serialize for UpTo<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self[..].serialize(serializer)
    }
}

impl<T: JsonSchema, const N: usize> JsonSchema for UpTo<T, N> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("UpTo{N}{}", T::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let entry = generator.subschema_for::<T>();
        schemars::json_schema!({ "type": "array", "items": entry, "minItems": 1, "maxItems": N })
    }
}
