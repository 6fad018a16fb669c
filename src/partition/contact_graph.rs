//! Contact in the partitioning graph: ties between elements that may touch, and contact as a
//! separate load.

use std::collections::BTreeMap;

use super::graph::{ElementWeights, Pair, Weights};
use crate::error::{Error, Result};
use crate::mesh::{Bounds, BoundsTree, Facet, Mesh};

/// Two surfaces that may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Couple<'a> {
    /// Set of facets of the contactor.
    pub contactor: &'a str,
    /// Set of facets of the target.
    pub target: &'a str,
    /// Known travel of the surfaces over or towards each other \[m\]; 0 if it is unknown.
    pub travel: f64,
    /// Whether the facets of the contactor count as load. Ties cost next to nothing.
    pub load: bool,
}

/// Search radius of a facet, relative to its size.
const SIGHT: f64 = 1.5;

/// Number of nearest elements within the search radius of a contactor facet that are tied strongly
/// to its element.
const NEAREST: usize = 4;

/// Number of further elements that are tied weakly, chosen evenly from all that the facet meets on
/// its path.
const ON_THE_WAY: usize = 4;

/// Weights of cuts between touching elements, nearest first, relative to a cut of a shared side.
/// Their values and rows are sent in each iteration, and the facet is sent when the search is
/// renewed.
const FAST: [i32; NEAREST] = [12, 6, 4, 4];

/// Weight of cuts between elements that may touch later, relative to a cut of a shared side.
const LOOSE: i32 = 1;

/// Ties of elements whose facets may touch, and two loads: that of the elements, and the number of
/// contactor facets of each element.
///
/// A contactor element has a bounded number of ties for any search radius, so the graph stays
/// sparse. Without contactors there are no ties and no second load, and the partition is that of a
/// mesh without contact.
///
/// # Errors
/// A set does not exist.
pub fn contact_weights<const D: usize>(mesh: &Mesh<D>, couples: &[Couple<'_>]) -> Result<Weights> {
    let mut ties = BTreeMap::new();
    let mut facets = vec![0; mesh.element_count()];
    for couple in couples {
        let contactor = facet_set(mesh, couple.contactor)?;
        let target = facet_set(mesh, couple.target)?;
        if couple.load {
            contactor.iter().for_each(|facet| facets[facet.element as usize] += 1);
        }
        tie(mesh, contactor, target, couple.travel, &mut ties);
    }
    let pairs = ties.into_iter().map(|(elements, weight)| Pair { elements, weight }).collect();
    if facets.iter().all(|&count| count == 0) {
        return Ok(Weights { elements: None, pairs });
    }
    let uniform = mesh.kinds.windows(2).all(|pair| pair[0] == pair[1]);
    let size = |element: usize| if uniform { 1 } else { mesh.kinds[element].nodes() as i32 };
    let loads = facets.iter().enumerate().flat_map(|(element, &count)| [size(element), count]).collect();
    Ok(Weights { elements: Some(ElementWeights { constraints: 2, loads }), pairs })
}

fn facet_set<'a, const D: usize>(mesh: &'a Mesh<D>, name: &str) -> Result<&'a [Facet]> {
    let set = mesh.facet_sets.get(name).map(Vec::as_slice);
    set.ok_or_else(|| Error::case(format!("contact: the mesh has no set of facets '{name}'")))
}

/// Adds the ties of one couple. An existing pair keeps the larger weight.
fn tie<const D: usize>(
    mesh: &Mesh<D>,
    contactor: &[Facet],
    target: &[Facet],
    travel: f64,
    ties: &mut BTreeMap<[u32; 2], i32>,
) {
    let boxes: Vec<Bounds<D>> = target.iter().map(|&facet| around(mesh, facet)).collect();
    let tree = BoundsTree::new(&boxes);
    let mut seen: Vec<(f64, u32)> = Vec::new();
    for &facet in contactor {
        let own = around(mesh, facet);
        let distance = |other: u32| square(&own.centre(), &boxes[other as usize].centre());
        let near = tree.meeting(&own.inflate(SIGHT * own.extent() + travel));
        let apart = near.filter(|&other| !touch(mesh, facet, target[other as usize]));
        seen.clear();
        seen.extend(apart.map(|other| (distance(other), target[other as usize].element)));
        seen.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (element, weight) in chosen(&seen) {
            let pair = [facet.element.min(element), facet.element.max(element)];
            let tie = ties.entry(pair).or_insert(weight);
            *tie = weight.max(*tie);
        }
    }
}

/// Chosen elements from a list with ascending distance: the nearest, and some of the others, with
/// the weights of their ties.
fn chosen(seen: &[(f64, u32)]) -> impl Iterator<Item = (u32, i32)> + '_ {
    let (nearest, others) = seen.split_at(seen.len().min(NEAREST));
    let stride = others.len().div_ceil(ON_THE_WAY).max(1);
    let fast = nearest.iter().zip(FAST);
    let loose = others.iter().skip(stride - 1).step_by(stride).map(|other| (other, LOOSE));
    fast.chain(loose).map(|(&(_, element), weight)| (element, weight))
}

fn around<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> Bounds<D> {
    Bounds::of(mesh.facet_corners(facet).map(|node| mesh.points[node as usize]))
}

/// Whether facets share a corner, as neighbours do on a surface with self-contact.
fn touch<const D: usize>(mesh: &Mesh<D>, one: Facet, other: Facet) -> bool {
    one.element == other.element
        || mesh.facet_corners(one).any(|corner| mesh.facet_corners(other).any(|node| node == corner))
}

fn square<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BoxShape, ElementKind, merge};
    use crate::partition::{Plan, Quality};

    /// Two stacked boxes with nonmatching meshes.
    fn stacked<const D: usize>(lower: [u32; D], upper: [u32; D]) -> Mesh<D> {
        let element = if D == 2 { ElementKind::Quad4 } else { ElementKind::Hex8 };
        let (mut max, mut min) = ([1.0; D], [0.0; D]);
        let below = BoxShape { min, max, cells: lower, element }.mesh().expect("a box");
        (min[D - 1], max[D - 1]) = (1.0, 2.0);
        let above = BoxShape { min, max, cells: upper, element }.mesh().expect("a box");
        merge(vec![("lower".into(), below), ("upper".into(), above)]).expect("small")
    }

    const COUPLE: Couple<'static> =
        Couple { contactor: "upper.bottom", target: "lower.top", travel: 0.0, load: true };

    fn plan<const D: usize>(mesh: &Mesh<D>, couple: Couple<'_>) -> Plan {
        Plan { weights: contact_weights(mesh, &[couple]).expect("both sets exist"), ..Plan::default() }
    }

    /// Ties join only facing elements of the two surfaces. The nearest have the largest weight, and
    /// the number of ties is small.
    #[test]
    fn ties_join_facing_elements() {
        let mesh = stacked([20, 10], [24, 8]);
        for travel in [0.0, 0.3, 10.0] {
            let weights = contact_weights(&mesh, &[Couple { travel, ..COUPLE }]).expect("sets");
            let faces = |set: &str| mesh.facet_sets[set].iter().map(|f| f.element).collect::<Vec<_>>();
            let (contactor, target) = (faces("upper.bottom"), faces("lower.top"));
            for pair in &weights.pairs {
                assert!(
                    target.contains(&pair.elements[0]) && contactor.contains(&pair.elements[1]),
                    "{pair:?}"
                );
            }
            for &element in &contactor {
                let own: Vec<_> = weights.pairs.iter().filter(|pair| pair.elements[1] == element).collect();
                assert!((2..=NEAREST + ON_THE_WAY).contains(&own.len()), "{} ties", own.len());
                let x = |element: u32| mesh.element_centre(element as usize)[0];
                let offset = |pair: &Pair| (x(pair.elements[0]) - x(pair.elements[1])).abs();
                let strongest = own.iter().max_by_key(|pair| pair.weight).expect("ties");
                assert!(own.iter().all(|pair| offset(pair) >= offset(strongest) - 1e-12));
                let widest = own.iter().map(|pair| offset(pair)).fold(0.0, f64::max);
                assert!(travel < 1.0 || widest > 0.25, "{widest}");
            }
            let loads = weights.elements.expect("two loads").loads;
            let contact: Vec<u32> =
                (0..).zip(loads.chunks(2)).filter(|(_, two)| two[1] == 1).map(|(e, _)| e).collect();
            assert_eq!(contact, contactor);
        }
    }

    /// A surface may be its own target. Neighbours on it are not tied; facets that face each other
    /// across a gap are.
    #[test]
    fn surface_that_meets_itself() {
        let mut mesh = stacked([6, 3], [6, 3]);
        let mut all = mesh.facet_sets["upper.bottom"].clone();
        all.extend(&mesh.facet_sets["lower.top"]);
        all.sort_unstable();
        mesh.facet_sets.insert("all".into(), all);
        let weights =
            contact_weights(&mesh, &[Couple { contactor: "all", target: "all", travel: 0.0, load: true }]);
        let pairs = weights.expect("the set").pairs;
        let body = |element: u32| mesh.body[element as usize];
        let facing = pairs.iter().filter(|pair| pair.weight == FAST[0]);
        assert!(facing.clone().all(|pair| body(pair.elements[0]) != body(pair.elements[1])));
        assert_eq!(facing.count(), 6);
    }

    /// Without contact there are no weights; an unknown set is an error.
    #[test]
    fn nothing_touches() {
        let mesh = stacked([4, 4], [4, 4]);
        assert_eq!(contact_weights(&mesh, &[]).expect("nothing"), Weights::default());
        assert!(contact_weights(&mesh, &[Couple { target: "lower.tip", ..COUPLE }]).is_err());
    }

    /// Far fewer contact pairs are split between ranks than without contact in the graph, and all
    /// loads stay balanced.
    #[test]
    fn parts_keep_pairs_together() {
        let flat = stacked([40, 20], [48, 16]);
        let solid = stacked([12, 12, 8], [10, 10, 9]);
        let (for_flat, for_solid) = (plan(&flat, COUPLE), plan(&solid, COUPLE));
        for parts in [2, 3, 4, 8] {
            let aware = [
                Quality::of_plan(&flat, &for_flat, parts).expect("a cut"),
                Quality::of_plan(&solid, &for_solid, parts).expect("a cut"),
            ];
            let plain = [
                Quality::of_plain(&flat, &for_flat, parts).expect("a cut"),
                Quality::of_plain(&solid, &for_solid, parts).expect("a cut"),
            ];
            for (aware, plain) in aware.iter().zip(&plain) {
                let fewer = if parts <= 4 { 6 } else { 3 };
                assert!(fewer * aware.pairs_cut < plain.pairs_cut, "{parts}: {aware:?} {plain:?}");
                assert!(aware.element_imbalance() < 1.08, "{parts}: {aware:?}");
                assert!(aware.contact_imbalance() < 1.06, "{parts}: {aware:?}");
                assert!(plain.contact_imbalance() > 1.9, "{parts}: {plain:?}");
                assert_eq!(aware.contact.iter().sum::<u64>(), plain.contact.iter().sum::<u64>());
            }
        }
    }
}
