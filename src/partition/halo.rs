//! Communication data that each part of a mesh needs from others, counted for any number of parts
//! without that many ranks.

use super::graph::Graph;
use super::lists::Lists;
use super::metis::partition;
use super::ownership::owners;
use super::{Plan, Quality};
use crate::error::Result;
use crate::mesh::Mesh;

/// Sizes of the parts of a mesh and of the data sent between them, for each part.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Halo {
    /// Nodes that the part owns.
    pub owned: Vec<u64>,
    /// Elements that it assembles: those at its nodes.
    pub assembled: Vec<u64>,
    /// Nodes of others in its matrix rows, whose values a multiplication sends to it.
    pub ghosts: Vec<u64>,
    /// Ghosts that only contact requires.
    pub contact_ghosts: Vec<u64>,
    /// Parts that own its ghosts: number of messages to it in a multiplication.
    pub neighbours: Vec<u64>,
    /// Its nodes in messages to others, counted once per message.
    pub sent: Vec<u64>,
}

/// A node that a part needs from another part, ordered by the receiving part and its owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Want {
    by: u32,
    from: u32,
    node: u32,
}

impl Halo {
    /// Halo of the parts into which `plan` divides a mesh, and the quality of these parts. `meets`
    /// marks the nodes of surfaces that may touch: those of tied elements are coupled in the
    /// matrix. Not collective.
    ///
    /// # Errors
    /// The errors of [`partition`].
    pub fn of_plan<const D: usize>(
        mesh: &Mesh<D>,
        plan: &Plan,
        meets: &[bool],
        parts: usize,
    ) -> Result<(Self, Quality)> {
        let graph = Graph::dual(mesh, &plan.weights)?;
        let part = partition(&graph, parts)?;
        let quality = Quality::new(&graph, &plan.weights, &part, parts);
        drop(graph);
        let touching = Lists::collect(mesh.points.len(), node_element_pairs(mesh));
        let owner = owners(&touching, &part, parts);
        drop(touching);
        let mut halo = Self {
            owned: vec![0; parts],
            assembled: vec![0; parts],
            ghosts: vec![0; parts],
            contact_ghosts: vec![0; parts],
            neighbours: vec![0; parts],
            sent: vec![0; parts],
        };
        owner.iter().for_each(|&part| halo.owned[part as usize] += 1);
        let mut wants = halo.by_elements(mesh, &owner);
        let by_contact = by_contact(mesh, plan, meets, &owner);
        halo.add_contact(&mut wants, by_contact);
        halo.count(&wants);
        Ok((halo, quality))
    }

    /// Needs of the parts due to elements; also counts the elements.
    fn by_elements<const D: usize>(&mut self, mesh: &Mesh<D>, owner: &[u32]) -> Vec<Want> {
        let (mut wants, mut around) = (Vec::new(), Vec::new());
        for element in 0..mesh.element_count() {
            let nodes = mesh.element_nodes(element);
            around.clear();
            around.extend(nodes.iter().map(|&node| owner[node as usize]));
            around.sort_unstable();
            around.dedup();
            around.iter().for_each(|&part| self.assembled[part as usize] += 1);
            if around.len() > 1 {
                wants.extend(across(&around, nodes, owner));
            }
        }
        wants.sort_unstable();
        wants.dedup();
        wants
    }

    /// Adds the additional needs of the parts due to contact.
    fn add_contact(&mut self, wants: &mut Vec<Want>, mut by_contact: Vec<Want>) {
        by_contact.sort_unstable();
        by_contact.dedup();
        by_contact.retain(|want| wants.binary_search(want).is_err());
        by_contact.iter().for_each(|want| self.contact_ghosts[want.by as usize] += 1);
        wants.extend(by_contact);
        wants.sort_unstable();
    }

    fn count(&mut self, wants: &[Want]) {
        for want in wants {
            self.ghosts[want.by as usize] += 1;
            self.sent[want.from as usize] += 1;
        }
        let messages = wants.chunk_by(|a, b| (a.by, a.from) == (b.by, b.from));
        messages.for_each(|message| self.neighbours[message[0].by as usize] += 1);
    }
}

/// Needs of the parts `around` an element with respect to each other's nodes of the element.
fn across<'a>(around: &'a [u32], nodes: &'a [u32], owner: &'a [u32]) -> impl Iterator<Item = Want> + 'a {
    around.iter().flat_map(move |&by| {
        let wants = nodes.iter().map(move |&node| Want { by, from: owner[node as usize], node });
        wants.filter(|want| want.by != want.from)
    })
}

/// Needs of the parts due to tied elements: each node of a surface is coupled with those of the
/// surface that it may touch.
fn by_contact<const D: usize>(mesh: &Mesh<D>, plan: &Plan, meets: &[bool], owner: &[u32]) -> Vec<Want> {
    let surface = |element: u32| {
        let nodes = mesh.element_nodes(element as usize).iter().copied();
        nodes.filter(|&node| meets[node as usize]).collect::<Vec<u32>>()
    };
    let mut wants = Vec::new();
    for pair in &plan.weights.pairs {
        let [one, other] = pair.elements.map(surface);
        for (a, b) in [(&one, &other), (&other, &one)] {
            let mut by: Vec<u32> = a.iter().map(|&node| owner[node as usize]).collect();
            by.sort_unstable();
            by.dedup();
            wants.extend(across(&by, b, owner));
        }
    }
    wants
}

fn node_element_pairs<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = (u32, u32)> + Clone + '_ {
    let of = |element: u32| mesh.element_nodes(element as usize).iter().map(move |&node| (node, element));
    (0..mesh.element_count() as u32).flat_map(of)
}

#[cfg(test)]
mod tests {
    use super::super::extract::Cut;
    use super::*;
    use crate::mesh::{BoxShape, ElementKind, merge};
    use crate::partition::Couple;

    fn stacked() -> Mesh<3> {
        let element = ElementKind::Hex8;
        let below =
            BoxShape { min: [0.0; 3], max: [1.0; 3], cells: [7, 6, 5], element }.mesh().expect("a box");
        let above = BoxShape { min: [0.0, 0.0, 1.0], max: [1.0, 1.0, 2.0], cells: [5, 6, 4], element };
        let above = above.mesh().expect("a box");
        merge(vec![("lower".into(), below), ("upper".into(), above)]).expect("small")
    }

    /// The counts without ranks equal those of the distributed parts.
    #[test]
    fn counts_are_those_of_the_pieces() {
        let mesh = stacked();
        let plan = Plan::default();
        let meets = vec![false; mesh.points.len()];
        for parts in [1, 2, 3, 7] {
            let (halo, quality) = Halo::of_plan(&mesh, &plan, &meets, parts).expect("a cut");
            let part = partition(&Graph::dual(&mesh, &plan.weights).expect("small"), parts).expect("a cut");
            let mut cut = Cut::new(mesh.clone(), &plan, part, quality).expect("a cut");
            let mut sent = vec![0; parts];
            for rank in 0..parts {
                let local = cut.local(rank as u32);
                // Elements that touch no owned node contribute ghosts that occur in no row.
                let named = (0..local.assembled).flat_map(|element| local.mesh.element_nodes(element));
                let mut named: Vec<u32> =
                    named.copied().filter(|&node| node as usize >= local.index.owned).collect();
                named.sort_unstable();
                named.dedup();
                assert_eq!(halo.owned[rank], local.index.owned as u64, "{parts}: {rank}");
                assert_eq!(halo.assembled[rank], local.assembled as u64, "{parts}: {rank}");
                assert_eq!(halo.ghosts[rank], named.len() as u64, "{parts}: {rank}");
                sent[rank] = named.len() as u64;
            }
            assert_eq!(halo.sent.iter().sum::<u64>(), sent.iter().sum::<u64>());
            assert!(halo.neighbours.iter().all(|&count| count < parts as u64 && (count > 0) == (parts > 1)));
        }
    }

    /// Contact adds the nodes of the other surface if the surfaces lie on different parts, and
    /// otherwise nothing.
    #[test]
    fn contact_adds_the_other_surface() {
        let mesh = stacked();
        let couple = Couple { contactor: "upper.bottom", target: "lower.top", travel: 0.0, load: true };
        let plan = Plan::for_contact(Some(&mesh), &[couple]).expect("the sets");
        let mut meets = vec![false; mesh.points.len()];
        for set in [couple.contactor, couple.target] {
            mesh.set_nodes(set).expect("nodes").iter().for_each(|&node| meets[node as usize] = true);
        }
        let (whole, _) = Halo::of_plan(&mesh, &plan, &meets, 1).expect("a cut");
        assert_eq!((whole.ghosts[0], whole.contact_ghosts[0], whole.neighbours[0]), (0, 0, 0));
        let (halo, quality) = Halo::of_plan(&mesh, &plan, &meets, 6).expect("a cut");
        let (blind, _) = Halo::of_plan(&mesh, &plan, &vec![false; mesh.points.len()], 6).expect("a cut");
        assert!(quality.pairs_cut > 0 && halo.contact_ghosts.iter().any(|&count| count > 0));
        for part in 0..6 {
            assert_eq!(halo.ghosts[part], blind.ghosts[part] + halo.contact_ghosts[part]);
        }
    }
}
