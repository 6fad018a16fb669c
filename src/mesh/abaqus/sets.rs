//! Members of the sets of a file.

use super::content::{Content, LEFT_OUT, NumberRange, PartMembers, SetContent, SetPart};
use super::lines::Deck;
use crate::error::{Error, Result};

/// All sets together have at most this number of members per node and element of the file, in
/// addition to those that are listed one by one. Otherwise a short file with sets of sets could
/// fill the memory.
///
/// The sets of preprocessors have less than ten. With half the value these still pass; with twice
/// the value a hostile file takes twice the memory.
const MEMBERS_EACH: usize = 64;

/// Nodes, or solid elements, of each set.
pub(super) struct SetMembers {
    pub nodes: Vec<Vec<u32>>,
    pub elements: Vec<Vec<u32>>,
}

/// Indices in ascending order of their numbers.
fn sorted(ids: &[u64]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..ids.len() as u32).collect();
    order.sort_by_key(|&index| ids[index as usize]);
    order
}

/// The members of all sets, each sorted and unique.
///
/// # Errors
/// A set lists a number that does not exist. The sets have too many members together.
pub(super) fn resolve(deck: &Deck, content: &Content) -> Result<SetMembers> {
    let mut budget = MEMBERS_EACH * (content.points.len() + content.solid.len()) + content.listed.len();
    let mut elements = vec![Vec::new(); content.element_sets.list.len()];
    for part in content.parts.iter().filter(|part| part.target == SetContent::Elements) {
        let mut found = members(deck, content, part, &elements, &[], &mut budget)?;
        elements[part.set as usize].append(&mut found);
    }
    for set in &mut elements {
        set.sort_unstable();
        set.dedup();
    }
    let mut nodes = vec![Vec::new(); content.node_sets.list.len()];
    for part in content.parts.iter().filter(|part| part.target == SetContent::Nodes) {
        let mut found = members(deck, content, part, &nodes, &elements, &mut budget)?;
        nodes[part.set as usize].append(&mut found);
    }
    for set in &mut nodes {
        set.sort_unstable();
        set.dedup();
    }
    // Until here the sets of elements also hold those that are not solid.
    for set in &mut elements {
        set.iter_mut().for_each(|element| *element = content.solid[*element as usize]);
        set.retain(|&element| element != LEFT_OUT);
        set.sort_unstable();
    }
    Ok(SetMembers { nodes, elements })
}

/// The members of one part of a set of `same` type, not sorted. Takes them from the budget.
fn members(
    deck: &Deck,
    content: &Content,
    part: &SetPart,
    same: &[Vec<u32>],
    elements: &[Vec<u32>],
    budget: &mut usize,
) -> Result<Vec<u32>> {
    let mut spend = |count: usize| -> Result<()> {
        *budget = budget.checked_sub(count).ok_or_else(|| {
            let message = format!(
                "the sets up to here have more than {MEMBERS_EACH} members for each node and element of the mesh"
            );
            deck.error_at(part.place, message).hint("remove sets that the case does not use")
        })?;
        Ok(())
    };
    let (numbering, what) = match part.target {
        SetContent::Nodes => (&content.nodes, "node"),
        SetContent::Elements => (&content.elements, "element"),
    };
    let mut found = Vec::new();
    match &part.what {
        PartMembers::Block(block) => {
            spend(block.len())?;
            found.extend(block.clone());
        }
        PartMembers::NodesOf(set) => {
            for &element in &elements[*set as usize] {
                let Some(solid) = content.solids.get(content.solid[element as usize] as usize) else {
                    continue;
                };
                spend(solid.kind.nodes())?;
                found.extend(content.nodes_of(deck, solid)?);
            }
        }
        PartMembers::Listed { numbers, ranges, sets } => {
            spend(numbers.len())?;
            for at in numbers.clone() {
                let id = content.listed[at];
                found.push(numbering.index(id).ok_or_else(|| undefined(deck, content, at, what))?);
            }
            let order = if ranges.is_empty() { Vec::new() } else { sorted(numbering.ids()) };
            for range in &content.ranges[ranges.clone()] {
                let within = in_range(numbering.ids(), &order, range);
                spend(within.len())?;
                let id = |index: u32| numbering.ids()[index as usize];
                let before = found.len();
                found.extend(within.iter().filter(|&&index| (id(index) - range.first) % range.step == 0));
                if found.len() == before {
                    let message = format!("there is no {what} from {} to {}", range.first, range.last);
                    return Err(deck.error_at(range.place, message).hint(REMOVED));
                }
            }
            for &set in &content.members[sets.clone()] {
                spend(same[set as usize].len())?;
                found.extend_from_slice(&same[set as usize]);
            }
        }
    }
    Ok(found)
}

const REMOVED: &str = "write the input again; sets may refer to what was removed";

/// Indices of the numbers between the ends of a range.
fn in_range<'a>(ids: &[u64], order: &'a [u32], range: &NumberRange) -> &'a [u32] {
    let begin = order.partition_point(|&index| ids[index as usize] < range.first);
    let end = order.partition_point(|&index| ids[index as usize] <= range.last);
    &order[begin..end.max(begin)]
}

fn undefined(deck: &Deck, content: &Content, at: usize, what: &str) -> Error {
    let line = content.listed_lines.partition_point(|(first, _)| *first <= at);
    let place = line.checked_sub(1).map_or(0, |line| content.listed_lines[line].1);
    let message = format!("the set contains {what} {}, which is not defined", content.listed[at]);
    deck.error_at(place, message).hint(REMOVED)
}
