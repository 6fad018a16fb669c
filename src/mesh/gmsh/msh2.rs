//! Sections of MSH 2.2.

use super::input::{Encoding, GmshInput, Least};
use super::raw::{Raw, kind_of};
use crate::error::Result;

pub(super) fn nodes(input: &mut GmshInput, raw: &mut Raw) -> Result<()> {
    let count = input.line_size("the number of nodes")?;
    input.afford(count, &Least { words: 4, bytes: 28 }, "nodes")?;
    for _ in 0..count {
        let begin = input.begin_entry();
        let id = input.label("a node number")?;
        let mut point = [0.0; 3];
        for x in &mut point {
            *x = input.real("a coordinate")?;
        }
        input.end_entry(begin, "the node")?;
        raw.add_node(input, id, point)?;
    }
    Ok(())
}

pub(super) fn elements(input: &mut GmshInput, raw: &mut Raw) -> Result<()> {
    let count = input.line_size("the number of elements")?;
    input.afford(count, &Least { words: 4, bytes: 8 }, "elements")?;
    if input.encoding == Encoding::Text {
        for _ in 0..count {
            let begin = input.begin_entry();
            let id = input.label("an element number")?;
            let code = input.int("an element type")?;
            let tags = input.label("the number of tags")?;
            element(input, raw, Head { id, code, tags })?;
            input.end_entry(begin, "the element")?;
        }
        return Ok(());
    }
    let mut left = count;
    while left > 0 {
        left -= block(input, raw, left)?;
    }
    Ok(())
}

/// Reads one block of equal elements of a binary file. Returns the number of elements.
fn block(input: &mut GmshInput, raw: &mut Raw, most: u64) -> Result<u64> {
    let code = input.int("an element type")?;
    let count = input.label("the number of elements in a block")?;
    if count == 0 || count > most {
        return Err(input.error(format!("a block of {count} elements, but only {most} remain")));
    }
    let tags = input.label("the number of tags")?;
    for _ in 0..count {
        let id = input.label("an element number")?;
        element(input, raw, Head { id, code, tags })?;
    }
    Ok(count)
}

struct Head {
    id: u64,
    code: i32,
    tags: u64,
}

/// The tags and nodes of an element. The first tag is its physical group.
fn element(input: &mut GmshInput, raw: &mut Raw, head: Head) -> Result<()> {
    let kind = kind_of(input, format_args!("element {}", head.id), head.code)?;
    input.afford(head.tags, &Least { words: 1, bytes: 4 }, "tags")?;
    let mut physical = 0;
    for index in 0..head.tags {
        let tag = input.int("a tag")?;
        if index == 0 {
            physical = tag;
        }
    }
    let groups = raw.group_list([physical]);
    raw.add_element(input, head.id, kind, groups);
    for _ in 0..kind.map_or(1, |kind| kind.nodes()) {
        let node = input.label("a node number")?;
        raw.element_nodes.push(node);
    }
    Ok(())
}
