//! Merging of several bodies into one mesh.

use super::Mesh;
use crate::error::{Error, Result};

/// PETSc numbers unknowns with 32-bit integers.
const MAX_UNKNOWNS: usize = i32::MAX as usize;

/// Merges bodies in the given order; they share no nodes.
///
/// Set `top` of body `block` becomes `block.top`. The element set `block` contains the whole body.
///
/// # Errors
/// The total number of unknowns exceeds 32 bits.
pub fn merge<const D: usize>(bodies: Vec<(String, Mesh<D>)>) -> Result<Mesh<D>> {
    let unknowns = D * bodies.iter().map(|(_, mesh)| mesh.points.len()).sum::<usize>();
    let entries: usize = bodies.iter().map(|(_, mesh)| mesh.nodes.len()).sum();
    if unknowns > MAX_UNKNOWNS || entries > u32::MAX as usize || bodies.len() > usize::from(u16::MAX) {
        let size = format!("the bodies together have {unknowns} unknowns, more than {MAX_UNKNOWNS}");
        return Err(Error::case(size).hint("use coarser meshes"));
    }
    let mut all = Mesh::with_points(Vec::new());
    for (number, (name, mesh)) in bodies.into_iter().enumerate() {
        append(&mut all, number as u16, &name, mesh);
    }
    Ok(all)
}

fn append<const D: usize>(all: &mut Mesh<D>, number: u16, name: &str, mesh: Mesh<D>) {
    let (node, element, entry) =
        (all.points.len() as u32, all.element_count() as u32, all.nodes.len() as u32);
    let elements = mesh.element_count() as u32;
    let piece = all.piece.iter().max().map_or(0, |last| last + 1);
    all.points.extend(mesh.points);
    all.kinds.extend(mesh.kinds);
    all.offsets.extend(mesh.offsets.iter().skip(1).map(|offset| offset + entry));
    all.nodes.extend(mesh.nodes.iter().map(|n| n + node));
    all.body.extend(std::iter::repeat_n(number, elements as usize));
    all.piece.extend(mesh.piece.iter().map(|own| own + piece));
    for (set, mut facets) in mesh.facet_sets {
        facets.iter_mut().for_each(|facet| facet.element += element);
        all.facet_sets.insert(format!("{name}.{set}"), facets);
    }
    for (set, points) in mesh.point_sets {
        all.point_sets.insert(format!("{name}.{set}"), points.iter().map(|n| n + node).collect());
    }
    for (set, members) in mesh.element_sets {
        all.element_sets.insert(format!("{name}.{set}"), members.iter().map(|e| e + element).collect());
    }
    all.element_sets.insert(name.to_owned(), (element..element + elements).collect());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BoxShape, ElementKind, Facet, SetKind, measure};

    fn block(min: [f64; 2], max: [f64; 2], element: ElementKind) -> Mesh<2> {
        BoxShape { min, max, cells: [2, 1], element }.mesh().unwrap()
    }

    /// Bodies keep their elements and sets, with their own names and shifted numbers.
    #[test]
    fn bodies_keep_their_sets_under_their_names() {
        let mut lower = block([0.0, 0.0], [2.0, 1.0], ElementKind::Quad4);
        lower.point_sets.insert("tip".to_owned(), vec![2]);
        let mut upper = block([0.0, 1.0], [2.0, 2.0], ElementKind::Tri6);
        upper.point_sets.insert("tip".to_owned(), vec![0]);
        upper.element_sets.insert("half".to_owned(), vec![1, 2]);
        let all =
            merge(vec![("lower".to_owned(), lower.clone()), ("upper".to_owned(), upper.clone())]).unwrap();

        assert_eq!(all.points.len(), lower.points.len() + upper.points.len());
        assert_eq!(all.body, [0, 0, 1, 1, 1, 1]);
        assert_eq!(all.piece, [0, 0, 1, 1, 1, 1]);
        assert!((measure::volume(&all) - 4.0).abs() < 1e-14);
        measure::assert_straight(&all);
        assert_eq!(all.element_sets["lower"], [0, 1]);
        assert_eq!(all.element_sets["upper"], [2, 3, 4, 5]);
        assert_eq!(all.element_sets["upper.half"], [3, 4]);
        assert_eq!(all.point_sets["upper.tip"], [lower.points.len() as u32]);
        for (name, at) in [("lower.top", 1.0), ("upper.bottom", 1.0), ("upper.top", 2.0)] {
            let nodes = all.set_nodes(name).unwrap();
            assert!(nodes.iter().all(|&n| all.points[n as usize][1] == at), "{name}");
        }
        assert_eq!(all.facet_sets["upper.bottom"][0].element, upper.facet_sets["bottom"][0].element + 2);
        assert!(all.sets().contains(&("lower.tip", SetKind::Points)));
        assert!(all.sets().contains(&("upper", SetKind::Elements)));
    }

    /// Nodes of a set are sorted and unique, for sets of elements, facets or points.
    #[test]
    fn nodes_of_a_set_come_once() {
        let mesh = merge(vec![("a".to_owned(), block([0.0, 0.0], [1.0, 1.0], ElementKind::Quad9))]).unwrap();
        assert_eq!(mesh.set_nodes("a").unwrap(), (0..15).collect::<Vec<u32>>());
        assert_eq!(mesh.set_nodes("a.top").unwrap(), [10, 11, 12, 13, 14]);
        assert_eq!(mesh.set_nodes("a.left").unwrap(), [0, 5, 10]);
        assert_eq!(mesh.set_nodes("a.none"), None);
        let mut nodes = Vec::new();
        mesh.facet_nodes(Facet { element: 1, side: 1 }, &mut nodes);
        assert_eq!(nodes, [4, 14, 9]);
        assert_eq!(mesh.facet_corners(Facet { element: 1, side: 1 }).collect::<Vec<_>>(), [4, 14]);
    }

    /// Bodies without elements, and an empty list of bodies, can be merged.
    #[test]
    fn nothing_is_merged_to_nothing() {
        assert_eq!(merge::<2>(Vec::new()).unwrap(), Mesh::default());
        let all = merge(vec![("void".to_owned(), Mesh::<3>::default())]).unwrap();
        assert_eq!((all.element_count(), all.element_sets["void"].len()), (0, 0));
        assert_eq!(all.bounding_box(), None);
    }
}
