//! Sections of MSH 4.1.

use std::collections::HashMap;

use super::input::{GmshInput, Least};
use super::raw::{Raw, kind_of};
use crate::error::Result;

const LABEL: Least = Least { words: 1, bytes: 4 };
const BLOCK: Least = Least { words: 4, bytes: 20 };

/// Physical groups of each entity by dimension and tag, as a list of [`Raw`].
pub(super) type Entities = HashMap<(i32, i32), u32>;

pub(super) fn entities(input: &mut GmshInput, raw: &mut Raw) -> Result<Entities> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = input.size("a number of entities")?;
    }
    let mut entities = Entities::new();
    for (dimension, count) in (0..).zip(counts) {
        let least =
            if dimension == 0 { Least { words: 5, bytes: 36 } } else { Least { words: 9, bytes: 68 } };
        input.afford(count, &least, "entities")?;
        for _ in 0..count {
            let tag = input.int("the tag of an entity")?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                input.real("a coordinate of an entity")?;
            }
            let physical = labels(input, "physical groups")?;
            if dimension > 0 {
                labels(input, "bounding entities")?;
            }
            let list = raw.group_list(physical);
            entities.insert((dimension, tag), list);
        }
    }
    Ok(entities)
}

fn labels(input: &mut GmshInput, what: &str) -> Result<Vec<i32>> {
    let count = input.size(what)?;
    input.afford(count, &LABEL, what)?;
    (0..count).map(|_| input.int(what)).collect()
}

pub(super) fn nodes(input: &mut GmshInput, raw: &mut Raw) -> Result<()> {
    let (blocks, count) = header(input)?;
    let before = raw.points.len();
    for _ in 0..blocks {
        let dimension = input.int("the dimension of an entity")?;
        input.int("the tag of an entity")?;
        let parametric = input.int("0 or 1 for parameters")?;
        let size = input.size("the number of nodes of an entity")?;
        input.afford(size, &Least { words: 4, bytes: 32 }, "nodes")?;
        let ids = (0..size).map(|_| input.size("a node number")).collect::<Result<Vec<u64>>>()?;
        for id in ids {
            let begin = input.begin_entry();
            let mut point = [0.0; 3];
            for x in &mut point {
                *x = input.real("a coordinate")?;
            }
            if parametric != 0 {
                for _ in 0..dimension {
                    input.real("a parameter of a node")?;
                }
            }
            input.end_entry(begin, "the node")?;
            raw.add_node(input, id, point)?;
        }
    }
    total(input, raw.points.len() - before, count, "nodes")
}

pub(super) fn elements(input: &mut GmshInput, raw: &mut Raw, entities: &Entities) -> Result<()> {
    let (blocks, count) = header(input)?;
    let before = raw.elements.len();
    for _ in 0..blocks {
        let dimension = input.int("the dimension of an entity")?;
        let tag = input.int("the tag of an entity")?;
        let code = input.int("an element type")?;
        let kind = kind_of(input, format_args!("elements of entity {tag}"), code)?;
        if kind.map_or(0, |kind| kind.dimension()) as i32 != dimension {
            let message =
                format!("elements of Gmsh type {code} do not have the dimension {dimension} of their entity");
            return Err(input.error(message));
        }
        let size = input.size("the number of elements of an entity")?;
        let nodes = kind.map_or(1, |kind| kind.nodes());
        let words = nodes as u64 + 1;
        input.afford(size, &Least { words, bytes: 8 * words }, "elements")?;
        let groups = match entities.get(&(dimension, tag)) {
            Some(list) => *list,
            None if entities.is_empty() => raw.group_list([]),
            None => {
                let message = format!("entity {tag} of dimension {dimension} is not among the $Entities");
                return Err(input.error(message));
            }
        };
        for _ in 0..size {
            let begin = input.begin_entry();
            let id = input.size("an element number")?;
            raw.add_element(input, id, kind, groups);
            for _ in 0..nodes {
                let node = input.size("a node number")?;
                raw.element_nodes.push(node);
            }
            input.end_entry(begin, "the element")?;
        }
    }
    total(input, raw.elements.len() - before, count, "elements")
}

/// Numbers of blocks and of entries in the header of the nodes and of the elements.
fn header(input: &mut GmshInput) -> Result<(u64, u64)> {
    let blocks = input.size("the number of blocks")?;
    input.afford(blocks, &BLOCK, "blocks")?;
    let count = input.size("the number of entries")?;
    input.afford(count, &Least { words: 2, bytes: 16 }, "entries")?;
    input.size("the lowest number")?;
    input.size("the highest number")?;
    Ok((blocks, count))
}

fn total(input: &GmshInput, found: usize, announced: u64, what: &str) -> Result<()> {
    if found as u64 == announced {
        return Ok(());
    }
    Err(input.error(format!("{announced} {what} are declared, but the blocks hold {found}")))
}
