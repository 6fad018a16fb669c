//! Extraction of the local meshes of all ranks from the whole mesh on rank 0.

use std::collections::BTreeMap;

use super::lists::Lists;
use super::ownership::owners;
use super::{IndexMap, LocalMesh, Plan, Quality};
use crate::error::{Error, Result};
use crate::mesh::{ElementPatch, Facet, Mesh, Tie};

/// The whole mesh with the ownership of nodes and elements; on rank 0 only.
pub(super) struct Cut<const D: usize> {
    mesh: Mesh<D>,
    part: Vec<u32>,
    /// Elements at each node.
    touching: Lists<u32>,
    /// Ties of each node.
    tying: Lists<u32>,
    /// Patch of each element; empty without patches.
    patch_of: Vec<u32>,
    /// Nodes of each rank in their final order.
    owned: Lists<u32>,
    /// Elements of each rank.
    own_elements: Lists<u32>,
    /// Global number of each node.
    global: Vec<i32>,
    sets: Sets,
    /// Local number of each node on the current rank, [`NOWHERE`] between ranks.
    local_of: Vec<u32>,
    /// Quality of the partition.
    pub quality: Quality,
}

/// Sets listed by their members, as indices into the names.
struct Sets {
    facet_names: Vec<String>,
    point_names: Vec<String>,
    element_names: Vec<String>,
    /// For each element: facet sets and sides.
    facets: Lists<(u32, u8)>,
    /// For each node: sets of any kind that contain the node.
    points: Lists<u32>,
    /// For each element: element sets.
    elements: Lists<u32>,
}

/// Marks nodes that are not local, and elements in no patch.
const NOWHERE: u32 = u32::MAX;

impl<const D: usize> Cut<D> {
    /// Determines owners and numbers from the part of each element, and keeps the quality of the partition.
    ///
    /// # Errors
    /// The mesh has nodes without elements.
    pub fn new(mesh: Mesh<D>, plan: &Plan, part: Vec<u32>, quality: Quality) -> Result<Self> {
        let parts = quality.elements.len();
        let touching = Lists::collect(mesh.points.len(), node_element_pairs(&mesh));
        let attached = touching.count() - plan.loose_nodes;
        if let Some(lonely) = (0..attached).find(|&node| touching.get(node as u32).is_empty()) {
            let message = format!("node {lonely} at {:?} belongs to no element", mesh.points[lonely]);
            return Err(Error::file(message).hint("remove it from the mesh"));
        }
        let owner = owners(&touching, &part, parts);
        let mut owned = Lists::collect(parts, (0..).zip(&owner).map(|(node, &rank)| (rank, node)));
        let mut global = vec![0; mesh.points.len()];
        for rank in 0..parts as u32 {
            plan.ordering.arrange(owned.get_mut(rank), &mesh, &touching);
            for (node, number) in owned.get(rank).iter().zip(owned.first(rank)..) {
                global[*node as usize] = number as i32;
            }
        }
        let ties = (0..).zip(&mesh.ties);
        let tied = ties.flat_map(|(number, tie)| tie.nodes.iter().map(move |&node| (node, number)));
        let tying = Lists::collect(mesh.points.len(), tied);
        let patch_of = patch_of_elements(&mesh);
        let own_elements = Lists::collect(parts, (0..).zip(&part).map(|(element, &rank)| (rank, element)));
        let sets = Sets::new(&mesh);
        let local_of = vec![NOWHERE; mesh.points.len()];
        Ok(Self {
            mesh,
            part,
            touching,
            tying,
            patch_of,
            owned,
            own_elements,
            global,
            sets,
            local_of,
            quality,
        })
    }

    /// The local mesh of a rank.
    pub fn local(&mut self, rank: u32) -> LocalMesh<D> {
        let (input_element, assembled) = self.elements_of(rank);
        let ties = self.ties_of(rank);
        let patches = self.patches_of(&input_element);
        let input_node = self.number_nodes(rank, &input_element, &ties, &patches);
        let mut mesh =
            Mesh::with_points(input_node.iter().map(|&node| self.mesh.points[node as usize]).collect());
        mesh.plane = self.mesh.plane;
        for &element in &input_element {
            let nodes = self.mesh.element_nodes(element as usize);
            mesh.push(
                self.mesh.kinds[element as usize],
                nodes.iter().map(|&node| self.local_of[node as usize]),
            );
        }
        mesh.body = input_element.iter().map(|&element| self.mesh.body[element as usize]).collect();
        mesh.piece = input_element.iter().map(|&element| self.mesh.piece[element as usize]).collect();
        let number = |&node: &u32| self.local_of[node as usize];
        let tie = |&tie: &u32| {
            let tie = &self.mesh.ties[tie as usize];
            Tie { nodes: tie.nodes.iter().map(number).collect(), ..tie.clone() }
        };
        mesh.ties = ties.iter().map(tie).collect();
        mesh.patches = self.local_patches(&patches, &input_element);
        self.sets.restrict(&input_node, &input_element, &mut mesh);
        input_node.iter().for_each(|&node| self.local_of[node as usize] = NOWHERE);
        let owned = self.owned.get(rank).len();
        let index = IndexMap {
            first: self.owned.first(rank) as i32,
            owned,
            ghosts: input_node[owned..].iter().map(|&node| self.global[node as usize]).collect(),
            total: self.global.len() as i32,
        };
        let mine = input_element.iter().map(|&element| self.part[element as usize] == rank).collect();
        LocalMesh { mesh, assembled, mine, index, input_node, input_element }
    }

    /// Ties of the rank's nodes, ascending.
    fn ties_of(&self, rank: u32) -> Vec<u32> {
        let at_nodes = self.owned.get(rank).iter().flat_map(|&node| self.tying.get(node)).copied();
        let mut ties: Vec<u32> = at_nodes.collect();
        ties.sort_unstable();
        ties.dedup();
        ties
    }

    /// Patches of local elements, ascending.
    fn patches_of(&self, elements: &[u32]) -> Vec<u32> {
        let known = elements.iter().filter_map(|&element| self.patch_of.get(element as usize));
        let mut patches: Vec<u32> = known.copied().filter(|&patch| patch != NOWHERE).collect();
        patches.sort_unstable();
        patches.dedup();
        patches
    }

    /// Patches in local numbers.
    fn local_patches(&self, patches: &[u32], elements: &[u32]) -> Vec<ElementPatch> {
        if patches.is_empty() {
            return Vec::new();
        }
        let mut sorted: Vec<(u32, u32)> = elements.iter().copied().zip(0..).collect();
        sorted.sort_unstable();
        let element = |wanted: &u32| {
            let found = sorted.binary_search_by_key(wanted, |(input, _)| *input);
            found.map_or(ElementPatch::ELSEWHERE, |place| sorted[place].1)
        };
        let local = |&patch: &u32| {
            let patch = &self.mesh.patches[patch as usize];
            let node = |&node: &u32| self.local_of[node as usize];
            ElementPatch {
                elements: patch.elements.iter().map(element).collect(),
                nodes: patch.nodes.iter().map(node).collect(),
                ..patch.clone()
            }
        };
        patches.iter().map(local).collect()
    }

    /// Numbers the rank's nodes, owned ones first, then the ghosts at its elements, ties and patches.
    /// Returns their input numbers.
    fn number_nodes(&mut self, rank: u32, elements: &[u32], ties: &[u32], patches: &[u32]) -> Vec<u32> {
        let mut nodes = self.owned.get(rank).to_vec();
        nodes.iter().for_each(|&node| self.local_of[node as usize] = 0);
        let owned = nodes.len();
        let at_elements = elements.iter().flat_map(|&element| self.mesh.element_nodes(element as usize));
        let at_ties = ties.iter().flat_map(|&tie| &self.mesh.ties[tie as usize].nodes);
        let in_patches = patches.iter().flat_map(|&patch| &self.mesh.patches[patch as usize].nodes);
        for &node in at_elements.chain(at_ties).chain(in_patches) {
            if std::mem::replace(&mut self.local_of[node as usize], 0) == NOWHERE {
                nodes.push(node);
            }
        }
        nodes[owned..].sort_unstable_by_key(|&node| self.global[node as usize]);
        for (&node, number) in nodes.iter().zip(0..) {
            self.local_of[node as usize] = number;
        }
        nodes
    }

    /// Elements that touch the rank's nodes, then its others, each ascending; and the number of the
    /// former.
    fn elements_of(&self, rank: u32) -> (Vec<u32>, usize) {
        let at_nodes = self.owned.get(rank).iter().flat_map(|&node| self.touching.get(node)).copied();
        let mut elements: Vec<u32> = at_nodes.collect();
        elements.sort_unstable();
        elements.dedup();
        let assembled = elements.len();
        let others = self.own_elements.get(rank).iter().filter(|&own| elements.binary_search(own).is_err());
        let others: Vec<u32> = others.copied().collect();
        elements.extend(others);
        (elements, assembled)
    }
}

impl Sets {
    fn new<const D: usize>(mesh: &Mesh<D>) -> Self {
        let facet_names: Vec<String> = mesh.facet_sets.keys().cloned().collect();
        let element_names: Vec<String> = mesh.element_sets.keys().cloned().collect();
        let mut point_names: Vec<String> = mesh.point_sets.keys().cloned().collect();
        point_names.extend(facet_names.iter().chain(&element_names).cloned());
        point_names.sort_unstable();
        point_names.dedup();
        let nodes: Vec<Vec<u32>> =
            point_names.iter().map(|name| mesh.set_nodes(name).unwrap_or_default()).collect();
        let facets = (0..).zip(mesh.facet_sets.values());
        let facets = facets.flat_map(|(set, facets)| facets.iter().map(move |f| (f.element, (set, f.side))));
        let elements = (0..).zip(mesh.element_sets.values());
        let elements = elements.flat_map(|(set, members)| members.iter().map(move |&element| (element, set)));
        let points = (0..).zip(&nodes);
        let points = points.flat_map(|(set, members)| members.iter().map(move |&node| (node, set)));
        Self {
            facets: Lists::collect(mesh.element_count(), facets),
            points: Lists::collect(mesh.points.len(), points),
            elements: Lists::collect(mesh.element_count(), elements),
            facet_names,
            point_names,
            element_names,
        }
    }

    /// Fills the sets of a local mesh with their local members, ascending.
    fn restrict<const D: usize>(&self, nodes: &[u32], elements: &[u32], mesh: &mut Mesh<D>) {
        let mut facets = vec![Vec::new(); self.facet_names.len()];
        let mut members = vec![Vec::new(); self.element_names.len()];
        for (element, &input) in (0..).zip(elements) {
            for &(set, side) in self.facets.get(input) {
                facets[set as usize].push(Facet { element, side });
            }
            self.elements.get(input).iter().for_each(|&set| members[set as usize].push(element));
        }
        let mut points = vec![Vec::new(); self.point_names.len()];
        for (node, &input) in (0..).zip(nodes) {
            self.points.get(input).iter().for_each(|&set| points[set as usize].push(node));
        }
        mesh.facet_sets = named(&self.facet_names, facets);
        mesh.point_sets = named(&self.point_names, points);
        mesh.element_sets = named(&self.element_names, members);
    }
}

fn named<T>(names: &[String], sets: Vec<Vec<T>>) -> BTreeMap<String, Vec<T>> {
    names.iter().cloned().zip(sets).collect()
}

fn node_element_pairs<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = (u32, u32)> + Clone + '_ {
    let of = |element: u32| mesh.element_nodes(element as usize).iter().map(move |&node| (node, element));
    (0..mesh.element_count() as u32).flat_map(of)
}

/// Patch of each element, [`NOWHERE`] for elements in no patch; empty without patches.
fn patch_of_elements<const D: usize>(mesh: &Mesh<D>) -> Vec<u32> {
    if mesh.patches.is_empty() {
        return Vec::new();
    }
    let mut patch_of = vec![NOWHERE; mesh.element_count()];
    for (number, patch) in (0..).zip(&mesh.patches) {
        patch.elements.iter().for_each(|&element| patch_of[element as usize] = number);
    }
    patch_of
}

pub(super) fn require_numbers<const D: usize>(mesh: &Mesh<D>) -> Result<()> {
    let unknowns = mesh.points.len() * D;
    if unknowns > i32::MAX as usize || mesh.nodes.len() > u32::MAX as usize {
        let message = format!("the mesh has {unknowns} unknowns, more than {}", i32::MAX);
        return Err(Error::case(message).hint("use a coarser mesh"));
    }
    Ok(())
}
