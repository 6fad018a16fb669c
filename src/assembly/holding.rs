//! What supports leave free: bodies, or pieces of them, that can still move.

use super::build::UnsupportedBody;
use super::pieces::Pieces;

/// How supports hold a group of pieces.
struct Group {
    /// Name, for messages.
    name: String,
    /// Number of strain-free motions that supports allow, including rotations only.
    motions: usize,
    /// Whether a contact uses a surface of the group.
    touched: bool,
}

/// How supports hold the bodies, with the same values on all ranks.
#[derive(Default)]
pub struct Holding {
    free: Vec<UnsupportedBody>,
    groups: Vec<Group>,
}

impl Holding {
    /// Combines the bodies that lack a support with the number of motions of each group of pieces.
    pub(super) fn new<const D: usize>(
        free: Vec<UnsupportedBody>,
        pieces: &Pieces<D>,
        motions: &[usize],
    ) -> Self {
        let group = |(group, &motions): (usize, &usize)| Group {
            name: pieces.group_name(group),
            motions,
            touched: pieces.touched[group],
        };
        Self { free, groups: motions.iter().enumerate().map(group).collect() }
    }

    /// Adds a free rigid body with this number of free directions. `touched` is whether a contact
    /// may hold it, and `words` are its name and directions.
    pub(super) fn add_rigid(&mut self, name: &str, motions: usize, touched: bool, words: String) {
        if motions > 0 {
            self.free.push(UnsupportedBody { bodies: Vec::new(), group: self.groups.len(), words });
        }
        self.groups.push(Group { name: format!("'{name}'"), motions, touched });
    }

    /// Whether supports hold every body against every rigid motion.
    pub fn is_complete(&self) -> bool {
        self.groups.iter().all(|group| group.motions == 0)
    }

    /// Whether no support holds the body with this index in some direction.
    pub fn leaves_free(&self, body: usize) -> bool {
        self.free.iter().any(|free| free.bodies.contains(&body))
    }

    /// Bodies that no support holds in some direction, as `body (along x, y)`.
    pub fn free_bodies(&self) -> Vec<String> {
        self.free.iter().map(|free| free.words.clone()).collect()
    }

    /// Bodies that neither a support nor a contact can hold.
    pub fn lost_bodies(&self) -> Vec<String> {
        let lost = self.free.iter().filter(|free| !self.groups[free.group].touched);
        lost.map(|free| free.words.clone()).collect()
    }

    /// Bodies, or pieces of them, that are supported along all axes and touched by no contact, but
    /// can still move, for example about a single held point. Returns the number of such motions
    /// for each.
    pub fn hinged_bodies(&self) -> Vec<(String, usize)> {
        let hinged = |(index, group): &(usize, &Group)| {
            let free = self.free.iter().any(|free| free.group == *index);
            group.motions > 0 && !free && !group.touched
        };
        let groups = self.groups.iter().enumerate().filter(hinged);
        groups.map(|(_, group)| (group.name.clone(), group.motions)).collect()
    }
}
