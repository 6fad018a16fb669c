//! What is wrong with values that were read, collected so that all of it is shown at once.

use super::at::At;
use super::complaint::Complaint;
use super::place::Place;
use super::quantity::Quantity;
use super::units::Units;

/// Everything that is wrong with a case, in no particular order.
#[derive(Debug, Clone)]
pub struct Findings {
    /// Units of the case, for messages that name a unit.
    pub units: Units,
    found: Vec<Complaint>,
}

impl Findings {
    /// Nothing yet, in a case with these units.
    pub fn new(units: Units) -> Self {
        Self { units, found: Vec::new() }
    }

    /// All complaints.
    pub fn into_complaints(self) -> Vec<Complaint> {
        self.found
    }

    /// Whether nothing is wrong.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Adds a complaint.
    pub fn push(&mut self, complaint: Complaint) {
        self.found.push(complaint);
    }

    /// Adds a sentence about the value at a place.
    pub fn say(&mut self, place: Place, message: impl Into<String>) {
        self.push(Complaint::new(message.into()).at(place));
    }

    /// Gives the last complaint a cure.
    pub fn cure(&mut self, hint: &str) {
        if let Some(complaint) = self.found.last_mut() {
            complaint.hint = hint.to_string();
        }
    }

    /// Adds a sentence about the value at a place unless the condition holds.
    pub fn require(&mut self, holds: bool, place: Place, message: impl Into<String>) {
        if !holds {
            self.say(place, message);
        }
    }

    /// Requires a positive, finite quantity.
    pub fn positive<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        what: &str,
        quantity: Quantity<KG, M, S>,
    ) {
        let value = quantity.value;
        let fits = value > 0.0 && value.is_finite();
        self.require(fits, quantity.place, format!("{what} must be > 0, found {value}"));
    }

    /// Requires a list of so many entries: as many as dimensions, or one number about z in 2D.
    pub fn entries<T>(&mut self, what: &str, list: &At<Vec<T>>, wanted: usize) {
        let found = list.len();
        let message = match wanted {
            1 => format!("{what} needs 1 entry in 2D, found {found}"),
            _ => format!("{what} needs {wanted} entries in {wanted}D, found {found}"),
        };
        self.require(found == wanted, list.place, message);
    }

    /// Requires a finite value that is not negative.
    pub fn not_negative(&mut self, what: &str, value: f64, place: Place) {
        let fits = value >= 0.0 && value.is_finite();
        self.require(fits, place, format!("{what} must be >= 0, found {value}"));
    }
}
