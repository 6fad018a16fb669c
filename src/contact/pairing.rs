//! Which target facet each contactor point is paired with.

use super::target::TargetSurface;

/// Times that a point may go back to the facet it came from before it is frozen for the rest of the step.
const TOGGLES: u8 = 10;
/// Times after which a point that holds energy keeps its facet for as long as it is near it.
const SETTLED: u8 = 2;
/// Written in the place of no facet.
const NONE: u64 = u64::MAX;

/// Facets of one point in the iterations of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Choice {
    facet: Option<u32>,
    /// The one before the last change.
    before: Option<u32>,
    toggles: u8,
    held: bool,
}

/// What a search changed. Sum it over contacts and ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairChanges {
    /// Points with another facet than before.
    pub changed: usize,
    /// Points whose facet is frozen, since it went to and fro.
    pub frozen: usize,
}

impl std::ops::AddAssign for PairChanges {
    fn add_assign(&mut self, other: Self) {
        self.changed += other.changed;
        self.frozen += other.frozen;
    }
}

/// The target facet of each point of a contactor on this rank. Clone it to roll back.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    choices: Vec<Choice>,
}

impl Pairing {
    /// As many points, none with a facet.
    pub fn new(points: usize) -> Self {
        Self { choices: vec![Choice::default(); points] }
    }

    /// The facet of a point; None where the point is open for want of one.
    pub fn facet(&self, point: usize) -> Option<u32> {
        self.choices[point].facet
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.choices.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.choices.is_empty()
    }

    /// Forgets how often points changed; call it where a step begins.
    pub fn begin_step(&mut self) {
        for choice in &mut self.choices {
            *choice = Choice { before: choice.facet, toggles: 0, ..*choice };
        }
    }

    /// From now on a point has a facet, until it is let go: it holds energy that only a facet can take.
    pub fn hold(&mut self, point: usize, hold: bool) {
        self.choices[point].held = hold;
    }

    /// Points that went back to the facet they came from more than once in this step.
    pub fn restless(&self) -> usize {
        self.choices.iter().filter(|choice| choice.toggles > 1).count()
    }

    /// Whether the point keeps its facet for the rest of the step.
    pub fn is_frozen(&self, point: usize) -> bool {
        self.choices[point].toggles >= TOGGLES
    }

    /// Whether the point keeps its facet for as long as it is near it: it holds energy and went to and fro. Where a surface is
    /// concave a point may be in balance on neither of two facets as they end, and on either as it goes on: a node without mass
    /// does not move less in a shorter step.
    pub fn is_settled(&self, point: usize) -> bool {
        let choice = &self.choices[point];
        choice.held && choice.toggles >= SETTLED
    }

    /// Takes the facet that the search found for a point; whether it changed. At the last toggle, and while it is
    /// held, a facet is kept rather than none: the gap on it still opens the point.
    pub fn take(&mut self, point: usize, found: Option<u32>) -> bool {
        let choice = &mut self.choices[point];
        if choice.toggles >= TOGGLES || found == choice.facet || choice.held && found.is_none() {
            return false;
        }
        choice.toggles += u8::from(found == choice.before);
        if choice.toggles >= TOGGLES && found.is_none() {
            return false;
        }
        choice.before = choice.facet;
        choice.facet = found;
        true
    }

    /// For each point the global name of its facet, `u64::MAX` without: what a checkpoint keeps.
    pub fn identities<const D: usize>(&self, target: &TargetSurface<D>) -> Vec<u64> {
        let name = |choice: &Choice| choice.facet.map_or(NONE, |facet| target.identity(facet));
        self.choices.iter().map(name).collect()
    }

    /// Gives the points the facets of these names again, as [`identities`](Self::identities) told them: what an attempt
    /// that led nowhere found is forgotten.
    pub fn take_back<const D: usize>(&mut self, identities: &[u64], target: &TargetSurface<D>) {
        let known = Self::from_identities(identities, target);
        for (choice, known) in self.choices.iter_mut().zip(known.choices) {
            *choice = Choice { held: choice.held, ..known };
        }
    }

    /// The pairing of a checkpoint; a facet that the rank no longer knows is none.
    pub fn from_identities<const D: usize>(identities: &[u64], target: &TargetSurface<D>) -> Self {
        let facet = |&identity: &u64| (identity != NONE).then(|| target.find(identity)).flatten();
        let choice = |facet: Option<u32>| Choice { facet, before: facet, toggles: 0, held: false };
        Self { choices: identities.iter().map(facet).map(choice).collect() }
    }

    /// The same pairing in the numbering of another surface of the same target, counts of toggles kept: what a renewed
    /// list of known facets asks for.
    #[must_use]
    pub fn renumbered<const D: usize>(&self, old: &TargetSurface<D>, new: &TargetSurface<D>) -> Self {
        let moved = |facet: Option<u32>| facet.and_then(|facet| new.find(old.identity(facet)));
        let choice = |c: &Choice| Choice { facet: moved(c.facet), before: moved(c.before), ..*c };
        Self { choices: self.choices.iter().map(choice).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pair_scene::{block, target};
    use super::*;
    use crate::mesh::ElementKind;

    /// Sliding on from facet to facet is no unrest, going to and fro is, until the step is over.
    #[test]
    fn points_that_go_to_and_fro_are_counted() {
        let mut pairing = Pairing::new(2);
        for facet in 0..5 {
            pairing.take(0, Some(facet));
            pairing.take(1, Some(facet % 2));
        }
        assert_eq!(pairing.restless(), 1);
        pairing.begin_step();
        assert_eq!(pairing.restless(), 0);
    }

    /// What was found after the names were told is forgotten, that a point is held is not.
    #[test]
    fn an_attempt_that_led_nowhere_is_forgotten() {
        let mesh = block::<2>(ElementKind::Quad4, [0.0, 1.0], [0.0, 1.0], 4);
        let target = &target(&mesh, &["top"]);
        let mut pairing = Pairing::new(2);
        pairing.take(0, Some(1));
        let names = pairing.identities(target);
        pairing.hold(0, true);
        for facet in 0..3 {
            pairing.take(0, Some(facet));
            pairing.take(1, Some(facet));
        }
        pairing.take_back(&names, target);
        assert_eq!((pairing.facet(0), pairing.facet(1)), (Some(1), None));
        assert!(!pairing.take(0, None) && pairing.restless() == 0);
    }

    /// A point that holds energy settles after it went to and fro twice, in this step; others go on until they are frozen.
    #[test]
    fn points_that_hold_energy_settle() {
        let mut pairing = Pairing::new(2);
        pairing.hold(0, true);
        for facet in [0, 1, 0, 1] {
            assert!(!pairing.is_settled(0));
            [0, 1].into_iter().for_each(|point| assert!(pairing.take(point, Some(facet))));
        }
        assert!(pairing.is_settled(0) && !pairing.is_settled(1) && !pairing.is_frozen(0));
        pairing.begin_step();
        assert!(!pairing.is_settled(0));
    }

    /// A point that is held goes from facet to facet but not off the last one, until it is let go.
    #[test]
    fn a_held_point_keeps_a_facet() {
        let mut pairing = Pairing::new(1);
        assert!(pairing.take(0, Some(3)));
        pairing.begin_step();
        pairing.hold(0, true);
        assert!(!pairing.take(0, None) && pairing.facet(0) == Some(3));
        assert!(pairing.take(0, Some(4)) && pairing.facet(0) == Some(4));
        pairing.hold(0, false);
        assert!(pairing.take(0, None) && pairing.facet(0).is_none());
    }
}
