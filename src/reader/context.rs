//! What serde's data model cannot carry: places of values, requests for a value with its place, a choice, or a node, and the
//! parameters of the case.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::place::Place;

/// Name of the type under which serde asks for a value with its place, see [`super::at::At`].
pub const PLACED: &str = "place and value";
/// Name under which a law asks for its name or mapping, see [`super::tagged`].
pub const CHOICE: &str = "choice";
/// Name under which it asks for the node itself.
pub const NODE: &str = "node";

/// Names and values of parameters, in the order of the file.
pub(super) type NamedNumbers = Vec<(String, f64)>;

thread_local! {
    /// Parameters of the case that is being read.
    static PARAMETERS: RefCell<Rc<NamedNumbers>> = RefCell::default();
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

/// The value of a parameter of the case that is being read on this thread.
pub(super) fn parameter(name: &str) -> Option<f64> {
    PARAMETERS.with_borrow(|all| all.iter().find(|(own, _)| own == name).map(|(_, value)| *value))
}

/// The names of these parameters.
pub(super) fn parameter_names() -> Vec<String> {
    PARAMETERS.with_borrow(|all| all.iter().map(|(name, _)| name.clone()).collect())
}

/// Reads something whose expressions may use these parameters.
pub(super) fn with_parameters<T>(values: NamedNumbers, read: impl FnOnce() -> T) -> T {
    struct Restore(Rc<NamedNumbers>);
    impl Drop for Restore {
        fn drop(&mut self) {
            PARAMETERS.set(std::mem::take(&mut self.0));
        }
    }
    let _restore = Restore(PARAMETERS.replace(Rc::new(values)));
    read()
}
