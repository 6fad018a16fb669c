//! Patches of elements that share one pressure near incompressibility (theory, section 3.8).
//!
//! One pressure for each tri3 or tet4 is too many: the elements lock. With one for each quad4 or hex8
//! pressures alternate. A patch of a few elements has one mean dilatation, and one pressure. Patches depend
//! on the mesh alone, not on the number of ranks.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::{ElementKind, Facet, FacetIndex, Mesh};

/// Elements of one material that share a pressure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementPatch {
    /// Index of the body.
    pub body: u16,
    /// Index of the material among those of the body.
    pub material: u32,
    /// Number of each element in the mesh; [`ELSEWHERE`](Self::ELSEWHERE) for elements that the rank does
    /// not have.
    pub elements: Vec<u32>,
    /// Kind of each element.
    pub kinds: Vec<ElementKind>,
    /// Nodes of the elements, one element after the other.
    pub nodes: Vec<u32>,
}

impl ElementPatch {
    /// An element of another rank.
    pub const ELSEWHERE: u32 = u32::MAX;
}

/// Marks elements in no patch.
const NONE: u32 = u32::MAX;

/// Elements of one kind in a patch. With fewer the inf-sup test fails (docs/validation/incompressible.md):
/// patches of two triangles, six pyramids or twelve tetrahedra may be quadrilaterals and cubes, whose
/// pressures alternate.
fn usual(kind: ElementKind) -> u32 {
    match kind {
        ElementKind::Quad4 | ElementKind::Hex20 | ElementKind::Tet10 => 2,
        ElementKind::Tri3 | ElementKind::Hex8 => 3,
        ElementKind::Wedge6 => 5,
        ElementKind::Pyramid5 => 7,
        ElementKind::Tet4 => 11,
        // A single element of the other kinds is stable.
        _ => 1,
    }
}

/// Size of a patch. An element of which `n` make a patch has the `n`-th part, which is a whole number up to
/// twelve.
const FULL: u32 = 27_720;

/// Divides the elements with a label into patches of elements with the same label, which is the body and
/// the material. A patch grows from an element with few neighbours by those that add the fewest nodes.
/// What remains too small joins a patch beside it. So does a patch with all nodes on the surface: if the
/// surface is clamped, its pressure would be arbitrary.
pub fn element_patches<const D: usize>(mesh: &Mesh<D>, labels: &[Option<(u16, u32)>]) -> Vec<ElementPatch> {
    patches_with(mesh, labels, usual)
}

/// Like [`element_patches`], with this number of elements of each kind in a patch.
pub fn patches_with<const D: usize>(
    mesh: &Mesh<D>,
    labels: &[Option<(u16, u32)>],
    number: impl Fn(ElementKind) -> u32,
) -> Vec<ElementPatch> {
    if labels.iter().all(Option::is_none) {
        return Vec::new();
    }
    let sizes = mesh.kinds.iter().map(|&kind| FULL / number(kind)).collect();
    let mut growth = Growth::new(mesh, labels, sizes);
    let members = growth.members();
    let members = growth.joined(members);
    members
        .into_iter()
        .filter_map(|elements| Some(patch(mesh, labels[elements[0] as usize]?, elements)))
        .collect()
}

fn patch<const D: usize>(mesh: &Mesh<D>, (body, material): (u16, u32), elements: Vec<u32>) -> ElementPatch {
    let kinds = elements.iter().map(|&element| mesh.kinds[element as usize]).collect();
    let nodes = elements.iter().flat_map(|&element| mesh.element_nodes(element as usize)).copied().collect();
    ElementPatch { body, material, elements, kinds, nodes }
}

/// Growth of patches over a mesh.
struct Growth<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    /// Part of a patch that each element is.
    sizes: Vec<u32>,
    /// Neighbours of each element with the same label over shared sides, `offsets[e]..offsets[e + 1]`.
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// Patch of each element, or [`NONE`].
    patch_of: Vec<u32>,
    /// Whether each node is on a side that no two of the elements with labels share.
    on_surface: Vec<bool>,
    /// Elements that may begin a patch, by their number of free neighbours. Entries may be out of date.
    seeds: BinaryHeap<Reverse<(usize, u32)>>,
}

impl<'a, const D: usize> Growth<'a, D> {
    fn new(mesh: &'a Mesh<D>, labels: &[Option<(u16, u32)>], sizes: Vec<u32>) -> Self {
        let labelled = (0u32..).zip(labels).filter(|(_, label)| label.is_some()).map(|(element, _)| element);
        let sides = FacetIndex::of(mesh, labelled.clone());
        let label = |facet: &Facet| labels[facet.element as usize];
        let joined = sides.inner().filter(|[a, b]| label(a) == label(b));
        let mut pairs: Vec<[u32; 2]> = joined.map(|both| both.map(|facet| facet.element)).collect();
        pairs.sort_unstable();
        let mut offsets = vec![0; mesh.element_count() + 1];
        pairs.iter().flatten().for_each(|&element| offsets[element as usize + 1] += 1);
        for element in 0..mesh.element_count() {
            offsets[element + 1] += offsets[element];
        }
        let mut next = offsets.clone();
        let mut neighbours = vec![0; 2 * pairs.len()];
        for [a, b] in pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]) {
            neighbours[next[a as usize] as usize] = b;
            next[a as usize] += 1;
        }
        let mut on_surface = vec![false; mesh.points.len()];
        let mut nodes = Vec::new();
        for facet in sides.boundary() {
            mesh.facet_nodes(facet, &mut nodes);
            nodes.iter().for_each(|&node| on_surface[node as usize] = true);
        }
        let mut growth = Self {
            mesh,
            sizes,
            offsets,
            neighbours,
            patch_of: vec![NONE; mesh.element_count()],
            on_surface,
            seeds: BinaryHeap::new(),
        };
        growth.seeds = labelled.map(|element| Reverse((growth.free(element).count(), element))).collect();
        growth
    }

    fn around(&self, element: u32) -> &[u32] {
        let row = self.offsets[element as usize] as usize..self.offsets[element as usize + 1] as usize;
        &self.neighbours[row]
    }

    fn free(&self, element: u32) -> impl Iterator<Item = u32> {
        self.around(element).iter().copied().filter(|&other| self.patch_of[other as usize] == NONE)
    }

    /// Elements of all patches.
    fn members(&mut self) -> Vec<Vec<u32>> {
        let mut patches: Vec<Vec<u32>> = Vec::new();
        while let Some(Reverse((count, seed))) = self.seeds.pop() {
            if self.patch_of[seed as usize] != NONE || self.free(seed).count() != count {
                continue;
            }
            let (members, reached) = self.grow(seed, patches.len() as u32);
            let all = |_| true;
            match (2 * reached <= FULL).then(|| self.beside(&members, &patches, all)).flatten() {
                Some(other) => {
                    members.iter().for_each(|&element| self.patch_of[element as usize] = other);
                    patches[other as usize].extend(members);
                }
                None => patches.push(members),
            }
        }
        patches
    }

    /// Grows a patch; returns its elements and its size.
    fn grow(&mut self, seed: u32, number: u32) -> (Vec<u32>, u32) {
        let mesh = self.mesh;
        let mut members = vec![seed];
        let mut nodes = mesh.element_nodes(seed as usize).to_vec();
        let mut reached = self.sizes[seed as usize];
        self.take(seed, number);
        while reached < FULL {
            let candidates = members.iter().flat_map(|&member| self.free(member));
            let rank = |element: u32| {
                let added = mesh.element_nodes(element as usize).iter().filter(|node| !nodes.contains(node));
                let of_patch = |other: &&u32| self.patch_of[**other as usize] == number;
                let shared = self.around(element).iter().filter(of_patch).count();
                (added.count(), Reverse(shared), self.free(element).count(), element)
            };
            let Some((.., best)) = candidates.map(rank).min() else { break };
            self.take(best, number);
            members.push(best);
            for &node in mesh.element_nodes(best as usize) {
                if !nodes.contains(&node) {
                    nodes.push(node);
                }
            }
            reached += self.sizes[best as usize];
        }
        (members, reached)
    }

    fn take(&mut self, element: u32, number: u32) {
        self.patch_of[element as usize] = number;
        let seeds: Vec<_> =
            self.free(element).map(|other| Reverse((self.free(other).count(), other))).collect();
        self.seeds.extend(seeds);
    }

    /// Joins patches with all nodes on the surface to those beside them that have inner nodes.
    fn joined(&self, mut patches: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
        let is_inner = |node: &u32| !self.on_surface[*node as usize];
        let has_inner = |patch: &Vec<u32>| {
            patch.iter().any(|&element| self.mesh.element_nodes(element as usize).iter().any(is_inner))
        };
        let inner: Vec<bool> = patches.iter().map(has_inner).collect();
        for number in (0..patches.len()).filter(|&number| !inner[number]) {
            let other = self.beside(&patches[number], &patches, |other| inner[other as usize]);
            if let Some(other) = other {
                let members = std::mem::take(&mut patches[number]);
                patches[other as usize].extend(members);
            }
        }
        patches.retain(|patch| !patch.is_empty());
        patches
    }

    /// The patch that `may` be joined with which these elements share the most sides; of several the
    /// smallest.
    fn beside(&self, members: &[u32], patches: &[Vec<u32>], may: impl Fn(u32) -> bool) -> Option<u32> {
        let mut shared: BTreeMap<u32, usize> = BTreeMap::new();
        let others = members.iter().flat_map(|&member| self.around(member));
        for &other in others.filter(|other| !members.contains(other)) {
            *shared.entry(self.patch_of[other as usize]).or_default() += 1;
        }
        let best = shared.into_iter().filter(|(patch, _)| *patch != NONE && may(*patch));
        best.min_by_key(|&(patch, sides)| (Reverse(sides), patches[patch as usize].len(), patch))
            .map(|(patch, _)| patch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::BoxShape;

    fn box_of<const D: usize>(kind: ElementKind, cells: u32) -> Mesh<D> {
        BoxShape { min: [0.0; D], max: [1.0; D], cells: [cells; D], element: kind }.mesh().expect("a box")
    }

    /// Every element with a label is in one patch, and patches are joined over sides, have about the wanted
    /// size, and inner nodes.
    #[test]
    fn patches_cover_the_mesh_and_are_connected() {
        fn check<const D: usize>(kind: ElementKind, cells: u32, wanted: usize) {
            let mesh = box_of::<D>(kind, cells);
            let labels = vec![Some((0, 0)); mesh.element_count()];
            let patches = element_patches(&mesh, &labels);
            let mut seen: Vec<u32> = patches.iter().flat_map(|patch| patch.elements.clone()).collect();
            seen.sort_unstable();
            assert!(seen.iter().copied().eq(0..mesh.element_count() as u32), "{kind}");
            let growth = Growth::new(&mesh, &labels, Vec::new());
            for patch in &patches {
                let mut reached = vec![patch.elements[0]];
                let mut next = 0;
                while next < reached.len() {
                    for other in growth.around(reached[next]) {
                        if patch.elements.contains(other) && !reached.contains(other) {
                            reached.push(*other);
                        }
                    }
                    next += 1;
                }
                assert_eq!(reached.len(), patch.elements.len(), "{kind}");
                let sum: usize = patch.kinds.iter().map(|kind| kind.nodes()).sum();
                assert_eq!(sum, patch.nodes.len());
            }
            let sizes = patches.iter().map(|patch| patch.elements.len());
            assert!(sizes.clone().all(|size| 2 * size > wanted && size < 3 * wanted), "{kind}");
            let mean = mesh.element_count() as f64 / patches.len() as f64;
            assert!((mean / wanted as f64 - 1.0).abs() < 0.25, "{kind}: {mean}");
            let is_inner = |node: &u32| mesh.points[*node as usize].iter().all(|&x| x > 0.0 && x < 1.0);
            assert!(patches.iter().all(|patch| patch.nodes.iter().any(is_inner)), "{kind}");
        }
        check::<2>(ElementKind::Tri3, 8, 3);
        check::<2>(ElementKind::Quad4, 8, 2);
        check::<3>(ElementKind::Hex8, 4, 3);
        check::<3>(ElementKind::Tet10, 4, 2);
        check::<3>(ElementKind::Tet4, 4, 11);
        check::<3>(ElementKind::Wedge6, 4, 5);
        check::<3>(ElementKind::Pyramid5, 4, 7);
    }

    /// Patches do not cross from one material to another, and elements without a label are in none.
    #[test]
    fn patches_keep_to_one_material() {
        let mesh = box_of::<2>(ElementKind::Tri3, 6);
        let label = |element: u32| (!element.is_multiple_of(7)).then_some((0, u32::from(element >= 36)));
        let labels: Vec<_> = (0..mesh.element_count() as u32).map(label).collect();
        let patches = element_patches(&mesh, &labels);
        for patch in &patches {
            let of = |&element: &u32| labels[element as usize] == Some((patch.body, patch.material));
            assert!(patch.elements.iter().all(of));
        }
        let covered: usize = patches.iter().map(|patch| patch.elements.len()).sum();
        assert_eq!(covered, labels.iter().flatten().count());
        assert!(element_patches(&mesh, &vec![None; mesh.element_count()]).is_empty());
    }
}
