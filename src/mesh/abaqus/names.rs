//! Names of sets. Upper and lower case are not distinguished.

use std::collections::HashMap;

use super::lines::key;

/// Where a set is defined. Names are unique within a part, and within the assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub(super) enum Scope {
    /// A part or an instance, or a file without parts.
    #[default]
    Part,
    /// The assembly.
    Assembly,
}

/// A set or surface.
#[derive(Debug, Clone)]
pub(super) struct SetName {
    /// Name as the file spells it first.
    pub name: String,
    pub scope: Scope,
    /// Whether it exists only for other sets and surfaces (`INTERNAL`).
    pub is_internal: bool,
}

/// All sets of one type, in the order of their definition.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    pub list: Vec<SetName>,
    index: HashMap<(Scope, String), u32>,
}

impl Names {
    /// Number of the set with this name. A set that does not exist yet is created.
    pub fn declare(&mut self, name: &str, scope: Scope, is_internal: bool) -> u32 {
        let next = self.list.len() as u32;
        let number = *self.index.entry((scope, key(name))).or_insert(next);
        match self.list.get_mut(number as usize) {
            Some(known) => known.is_internal &= is_internal,
            None => self.list.push(SetName { name: name.to_owned(), scope, is_internal }),
        }
        number
    }

    /// The cure for the name of a set that does not exist: the first of the names that do.
    pub fn cure(&self) -> String {
        const SHOWN: usize = 20;
        let shown: Vec<&str> = self.list.iter().take(SHOWN).map(|set| set.name.as_str()).collect();
        match self.list.len() {
            0 => "the file defines no such set up to here".to_owned(),
            1..=SHOWN => format!("known: {}", shown.join(", ")),
            more => format!("known: {} and {} more", shown.join(", "), more - SHOWN),
        }
    }

    /// Number of a set that is named in `scope`. In an assembly `instance` may precede the name.
    pub fn find(&self, name: &str, scope: Scope, instance: Option<&str>) -> Option<u32> {
        let name = key(name);
        let find = |scope, name: &str| self.index.get(&(scope, name.to_owned())).copied();
        let of_instance = || find(Scope::Part, without_instance(&name, instance)?);
        let outer = if scope == Scope::Assembly { find(Scope::Assembly, &name) } else { None };
        outer.or_else(|| find(Scope::Part, &name)).or_else(of_instance)
    }
}

/// The part of a name in upper case after `instance.`; `None` if it does not begin with it.
pub(super) fn without_instance<'a>(name: &'a str, instance: Option<&str>) -> Option<&'a str> {
    name.strip_prefix(key(instance?).as_str())?.strip_prefix('.')
}
