//! What serde's data model cannot carry: places of values, and requests for a value with its place, a choice, or a node.

use std::cell::Cell;

use super::place::Place;

/// Name of the type under which serde asks for a value with its place, see [`super::at::At`].
pub const PLACED: &str = "place and value";
/// Name under which a law asks for its name or mapping, see [`super::tagged`].
pub const CHOICE: &str = "choice";
/// Name under which it asks for the node itself.
pub const NODE: &str = "node";

thread_local! {
    /// serde's data model has no places: that of the value which is read next goes by this way.
    static PLACE: Cell<Option<Place>> = const { Cell::new(None) };
}

/// The place of the value that follows, if it is read from a tree.
pub(super) fn place_of_next() -> Place {
    PLACE.take().unwrap_or_default()
}

/// Says where the value is written that is read next.
pub(super) fn set_place(place: Place) {
    PLACE.set(Some(place));
}
