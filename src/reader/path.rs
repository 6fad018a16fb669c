//! Paths into a case, as `contact.sole.normal.penalty.compliance` or `bodies.block.mesh.box.cells[0]`.

use super::at::At;
use super::complaint::Complaint;
use super::node::{Node, Tree};
use super::place::Place;

/// Mappings whose keys are names that the user chose: a path may not make an entry by the way.
const NAMES: [&str; 6] = ["bodies", "obstacles", "rigid", "contact", "boundary", "output.probes"];

/// A step of a path: a key or a position, with its first character within the path.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String, usize),
    Entry(usize, usize),
}

fn steps(path: &At<String>) -> std::result::Result<Vec<Step>, Complaint> {
    let wrong = |offset: usize, message: String| {
        Err(Complaint::new(message)
            .at(path.place)
            .offset(offset)
            .hint("a path has the form `key.key[0].key`, for example bodies.block.mesh.box.cells[0]"))
    };
    let mut steps = Vec::new();
    let mut offset = 0;
    for part in path.value.split('.') {
        let (key, rest) = part.find('[').map_or((part, ""), |at| part.split_at(at));
        if key.is_empty() {
            return wrong(offset, format!("a key is missing in the path '{}'", path.value));
        }
        steps.push(Step::Key(key.to_owned(), offset));
        let mut inner = offset + key.chars().count();
        for entry in rest.split_inclusive(']').filter(|entry| !entry.is_empty()) {
            let number =
                entry.strip_prefix('[').and_then(|e| e.strip_suffix(']')).and_then(|e| e.parse().ok());
            let Some(number) = number else {
                return wrong(inner, format!("'{entry}' is not a position in a list"));
            };
            steps.push(Step::Entry(number, inner));
            inner += entry.chars().count();
        }
        offset += part.chars().count() + 1;
    }
    Ok(steps)
}

/// Puts a value at a path of a tree.
pub(super) fn put(root: &mut Node, path: &At<String>, value: &Node) -> std::result::Result<(), Complaint> {
    let steps = steps(path)?;
    let takes_away = value.tree == Tree::Null;
    let mut node = root;
    let mut so_far = String::new();
    for (index, step) in steps.iter().enumerate() {
        let is_last = index + 1 == steps.len();
        let at = |offset: usize, length: usize| Place {
            column: path.place.column + offset + quotes(path),
            length,
            ..path.place
        };
        node = match step {
            Step::Key(key, offset) => {
                let place = at(*offset, key.chars().count());
                let entry = Entry { key, parent: &so_far, place, is_last };
                if is_last && takes_away {
                    return entry.take_away(node);
                }
                let inner = entry.find(node)?;
                so_far = if so_far.is_empty() { key.clone() } else { format!("{so_far}.{key}") };
                inner
            }
            Step::Entry(position, offset) => {
                let place = at(*offset, 1);
                so_far.push_str(&format!("[{position}]"));
                let Tree::List(entries) = &mut node.tree else {
                    return Err(Complaint::new(format!("'{so_far}' is not a list in the case")).at(place));
                };
                let count = entries.len();
                entries.get_mut(*position).ok_or_else(|| {
                    let message = format!("'{so_far}': the list in the case has {count} entries");
                    Complaint::new(message).at(place).hint("the first entry is [0]")
                })?
            }
        };
    }
    *node = value.clone();
    Ok(())
}

/// A key on the way of a path.
struct Entry<'a> {
    key: &'a str,
    /// The path before it.
    parent: &'a str,
    place: Place,
    is_last: bool,
}

impl Entry<'_> {
    /// The node under the key, made where the case leaves it to a default.
    fn find<'n>(&self, node: &'n mut Node) -> std::result::Result<&'n mut Node, Complaint> {
        let entries = self.entries(node)?;
        let at = match entries.iter().position(|(name, _)| name.value == self.key) {
            Some(found) => found,
            // An entry that no expression of the case uses would change nothing.
            None if self.parent == "parameters" => {
                return Err(self.unknown("parameter", entries));
            }
            None if !self.is_last && NAMES.contains(&self.parent) => {
                let noun = format!("name under {}", self.parent);
                return Err(self.unknown(&noun, entries));
            }
            None => {
                let key = At { value: self.key.to_owned(), place: self.place };
                entries.push((key, Node { tree: Tree::Map(Vec::new()), place: self.place }));
                entries.len() - 1
            }
        };
        let (key, inner) = &mut entries[at];
        if self.is_last {
            key.place = self.place;
        }
        Ok(inner)
    }

    fn take_away(&self, node: &mut Node) -> std::result::Result<(), Complaint> {
        let entries = self.entries(node)?;
        let before = entries.len();
        entries.retain(|(name, _)| name.value != self.key);
        if entries.len() == before { Err(self.unknown("key to remove", entries)) } else { Ok(()) }
    }

    fn entries<'n>(
        &self,
        node: &'n mut Node,
    ) -> std::result::Result<&'n mut Vec<(At<String>, Node)>, Complaint> {
        if node.tree == Tree::Null {
            node.tree = Tree::Map(Vec::new());
        }
        let label = node.label();
        match &mut node.tree {
            Tree::Map(entries) => Ok(entries),
            _ => Err(no_mapping(self.parent, self.key, &label).at(self.place)),
        }
    }

    fn unknown(&self, noun: &str, entries: &[(At<String>, Node)]) -> Complaint {
        let names = entries.iter().map(|(name, _)| name.value.as_str());
        Complaint::unknown(noun, self.key, names).at(self.place)
    }
}

/// A quoted path begins a character later than its place.
fn quotes(path: &At<String>) -> usize {
    usize::from(path.place.length == path.value.chars().count() + 2)
}

fn no_mapping(parent: &str, key: &str, label: &str) -> Complaint {
    Complaint::new(format!("'{parent}' is '{label}' in the case, not a mapping with '{key}'"))
        .hint(format!("set the whole entry, for example `{parent}: {{ {key}: ... }}`"))
}
