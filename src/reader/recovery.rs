//! All errors of a file at once: a value that can not be read is replaced by a stand-in, and the file is read again.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::at::At;
use super::complaint::{Complaint, Repair};
use super::context::with_parameters;
use super::node::{Node, Tree};
use super::parameters::parameters_of;
use super::place::Place;
use super::schema::{owners_of, schema_of};
use super::source::{MOST_SHOWN, Source};
use super::units::{Units, reading_in};
use crate::error::Result;

/// Length up to which a file is read again after each error \[bytes\]: 128 KiB.
///
/// In a longer file only the first value that can not be read is reported. Each error costs another reading of the whole file, and
/// there may be 20, so that the answer to a wrong file of the largest permitted length would take 20 times as long as its reading.
/// The cases of the scenes are shorter than 6 KB; files beyond the limit hold tables that a program wrote.
const LONGEST: usize = 1 << 17;

/// Number that takes the place of a value that can not be read, first with one sign and then with the other: a check whose
/// outcome depends on the sign says nothing about the file.
///
/// Its size is far above every upper limit of the checks and, with a negative sign, below every lower one. Its square is finite,
/// so that checks that multiply two values do not meet infinity.
const STAND_IN: f64 = 1e30;

/// Reads data whose plain numbers are in `units`, and checks it.
///
/// # Errors
/// All that is wrong, in the order of the file.
pub(super) fn read_checked<T: DeserializeOwned + JsonSchema>(
    root: &Node,
    source: &Source,
    units: Units,
    check: impl Fn(&T) -> Vec<Complaint>,
) -> Result<T> {
    let parameters = reading_in(units, || parameters_of(root));
    reading_in(units, || with_parameters(parameters, || read_in_context(root, source, check)))
}

/// Reads and checks data in units and with parameters that are known.
fn read_in_context<T: DeserializeOwned + JsonSchema>(
    root: &Node,
    source: &Source,
    check: impl Fn(&T) -> Vec<Complaint>,
) -> Result<T> {
    let found = match T::deserialize(root) {
        Ok(data) => match check(&data) {
            none if none.is_empty() => return Ok(data),
            found => found,
        },
        Err(first) => {
            let first = first.or_at(root.place);
            let is_long = source.text.len() > LONGEST;
            if is_long { vec![first] } else { all(root, first, check) }
        }
    };
    Err(source.errors(name_owners::<T>(found)))
}

/// Says of keys that are in the wrong place which blocks know them.
fn name_owners<T: JsonSchema>(mut found: Vec<Complaint>) -> Vec<Complaint> {
    let mut schema = None;
    for complaint in &mut found {
        let Repair::RemoveStray(key) = &complaint.repair else { continue };
        let owners = owners_of(schema.get_or_insert_with(schema_of::<T>), key);
        if !owners.is_empty() {
            complaint.hint.push_str(&format!("; '{key}' belongs to {}", owners.join(", ")));
        }
    }
    found
}

/// The units of a case, before it is read; SI where they can not be read, which reading it reports.
pub(super) fn units_of(root: &Node) -> Units {
    let Tree::Map(entries) = &root.tree else { return Units::SI };
    let units = entries.iter().find(|(key, _)| key.value == "units");
    units.and_then(|(_, node)| serde::Deserialize::deserialize(node).ok()).unwrap_or_default()
}

/// The first complaint and those that follow when it is mended.
fn all<T: DeserializeOwned>(
    root: &Node,
    first: Complaint,
    check: impl Fn(&T) -> Vec<Complaint>,
) -> Vec<Complaint> {
    let mut tree = root.clone();
    let mut found: Vec<Complaint> = Vec::new();
    // Others refer to an entry that was dropped: what the checks say of a case without it follows from that.
    let mut is_whole = true;
    let mut next = first;
    // A value that was replaced by a stand-in is not judged a second time.
    let is_known = |found: &[Complaint], next: &Complaint| {
        let is_same = |known: &Complaint| known.message == next.message || known.repair == Repair::Replace;
        found.iter().any(|known| known.place.is(next.place) && is_same(known))
    };
    loop {
        let again = is_known(&found, &next);
        let mended = if again { tree.drop_entry(next.place) } else { tree.mend(&next) };
        is_whole &= !again;
        if !again {
            found.push(next);
        }
        if !mended || found.len() > MOST_SHOWN {
            return without_consequences(found);
        }
        match T::deserialize(&tree) {
            Ok(_) => break,
            Err(complaint) => next = complaint.or_at(root.place),
        }
        if again && is_known(&found, &next) {
            return without_consequences(found);
        }
    }
    found = without_consequences(found);
    if !is_whole {
        return found;
    }
    let with = |number: f64| {
        let mut tree = tree.clone();
        tree.fill(number);
        T::deserialize(&tree).map_or_else(|_| Vec::new(), |data| check(&data))
    };
    let low = with(-STAND_IN);
    let high = with(STAND_IN);
    let is_in = |all: &[Complaint], one: &Complaint| {
        all.iter().any(|other| other.place.is(one.place) && other.message == one.message)
    };
    // What has no place is a value of a stand-in; what is at the key of a stand-in is about it as a whole.
    let mut replaced: Vec<Place> = found.iter().map(|complaint| complaint.place).collect();
    tree.keys_of_stand_ins(&mut replaced);
    let depends = |place: Place| place.line == 0 || replaced.iter().any(|other| other.is(place));
    found.extend(low.into_iter().filter(|one| is_in(&high, one) && !depends(one.place)));
    found
}

/// Without what is wrong with a value that is missing: that was said of the value inserted for it.
fn without_consequences(mut found: Vec<Complaint>) -> Vec<Complaint> {
    let mut inserted: Vec<Place> = Vec::new();
    found.retain(|one| {
        if matches!(one.repair, Repair::Insert(_)) {
            inserted.push(one.place);
            return true;
        }
        !inserted.iter().any(|place| place.is(one.place))
    });
    found
}

impl Node {
    /// Changes the tree so that reading gets past a complaint; `false` where there is nothing to change.
    fn mend(&mut self, complaint: &Complaint) -> bool {
        let place = complaint.place;
        match &complaint.repair {
            Repair::Insert(key) => {
                let insert = |node: &mut Self| match &mut node.tree {
                    Tree::Map(entries) => {
                        let key = At { value: (*key).to_owned(), place };
                        entries.push((key, Self { tree: Tree::Anything(STAND_IN), place }));
                    }
                    other => *other = Tree::Anything(STAND_IN),
                };
                self.at_value(place, true, &insert)
            }
            Repair::Rename(name) => {
                let rename = |node: &mut Self| node.tree = Tree::Text(name.clone());
                self.rename_key(place, Some(name)) || self.at_value(place, false, &rename)
            }
            Repair::Remove | Repair::RemoveStray(_) => self.rename_key(place, None),
            Repair::Replace => {
                let replace = |node: &mut Self| node.tree = Tree::Anything(STAND_IN);
                self.at_value(place, false, &replace)
                    || self.at_value(place, true, &replace)
                    || self.at_key(place)
            }
        }
    }

    /// Changes the nodes at a place: mappings, or all others.
    fn at_value(&mut self, place: Place, mappings: bool, change: &impl Fn(&mut Self)) -> bool {
        if self.place.is(place) && matches!(self.tree, Tree::Map(_)) == mappings {
            change(self);
            return true;
        }
        let mut is_changed = false;
        self.inner().for_each(|node| is_changed |= node.at_value(place, mappings, change));
        is_changed
    }

    /// Replaces the mappings that have a key at a place.
    fn at_key(&mut self, place: Place) -> bool {
        if let Tree::Map(entries) = &self.tree
            && entries.iter().any(|(key, _)| key.place.is(place))
        {
            self.tree = Tree::Anything(STAND_IN);
            return true;
        }
        let mut is_changed = false;
        self.inner().for_each(|node| is_changed |= node.at_key(place));
        is_changed
    }

    /// Gives the key at a place another name. Removes its entry if there is no other name, or if that name is taken.
    fn rename_key(&mut self, place: Place, name: Option<&String>) -> bool {
        let mut is_changed = false;
        if let Tree::Map(entries) = &mut self.tree
            && let Some(at) = entries.iter().position(|(key, _)| key.place.is(place))
        {
            let free = name.filter(|name| entries.iter().all(|(key, _)| key.value != **name));
            match free {
                Some(name) => entries[at].0.value.clone_from(name),
                None => drop(entries.remove(at)),
            }
            is_changed = true;
        }
        self.inner().for_each(|node| is_changed |= node.rename_key(place, name));
        is_changed
    }

    /// Takes the entries out whose value is at a place.
    fn drop_entry(&mut self, place: Place) -> bool {
        let mut is_changed = false;
        if let Tree::Map(entries) = &mut self.tree {
            let before = entries.len();
            entries.retain(|(_, value)| !value.place.is(place));
            is_changed = entries.len() < before;
        }
        self.inner().for_each(|node| is_changed |= node.drop_entry(place));
        is_changed
    }

    /// Appends the places of the keys whose values are stand-ins.
    fn keys_of_stand_ins(&mut self, places: &mut Vec<Place>) {
        if let Tree::Map(entries) = &self.tree {
            let stand_ins = entries.iter().filter(|(_, value)| matches!(value.tree, Tree::Anything(_)));
            places.extend(stand_ins.map(|(key, _)| key.place));
        }
        self.inner().for_each(|node| node.keys_of_stand_ins(places));
    }

    /// Gives all stand-ins this number.
    fn fill(&mut self, number: f64) {
        if let Tree::Anything(old) = &mut self.tree {
            *old = number;
        }
        self.inner().for_each(|node| node.fill(number));
    }

    fn inner(&mut self) -> Box<dyn Iterator<Item = &mut Self> + '_> {
        match &mut self.tree {
            Tree::List(entries) => Box::new(entries.iter_mut()),
            Tree::Map(entries) => Box::new(entries.iter_mut().map(|(_, value)| value)),
            _ => Box::new(std::iter::empty()),
        }
    }
}
