//! Target facets that are sent to another rank, as two flat lists.

use super::Surfaces;
use super::facets::{ArrivedFacet, GatheredFacets};
use crate::contact::target::TargetFacets;
use crate::mesh::{Bounds, ElementKind, Facet};

/// Facets from one rank.
///
/// Integers of a facet: kind, body, element of the input, side, 1 at an edge of its surface, global
/// nodes. Real values: corners of its box, reference points of its nodes.
pub(super) struct Parcel<'a> {
    pub integers: &'a [u32],
    pub reals: &'a [f64],
}

/// Facets to be sent to each rank.
#[derive(Default)]
pub(super) struct Outgoing {
    pub integers: Vec<(i32, Vec<u32>)>,
    pub reals: Vec<(i32, Vec<f64>)>,
}

impl Parcel<'_> {
    /// Packs own facets for all other ranks that have a box in `places` which overlaps theirs.
    pub fn pack_for<const D: usize>(
        this: i32,
        places: &[Vec<Bounds<D>>],
        surfaces: &Surfaces<'_, D>,
        facets: &[Facet],
        boxes: &[Bounds<D>],
    ) -> Outgoing {
        let whole = boxes.iter().fold(Bounds::EMPTY, |sum, one| sum.join(one));
        let mut outgoing = Outgoing::default();
        let mut nodes = Vec::new();
        for (rank, places) in (0..).zip(places).filter(|(rank, _)| *rank != this) {
            let places: Vec<&Bounds<D>> = places.iter().filter(|place| place.meets(&whole)).collect();
            let (mut integers, mut reals) = (Vec::new(), Vec::new());
            let meets = |one: &Bounds<D>| places.iter().any(|place| place.meets(one));
            for (&facet, one) in facets.iter().zip(boxes).filter(|(_, one)| meets(one)) {
                let local = surfaces.local;
                let mesh = &surfaces.local.mesh;
                let element = facet.element as usize;
                mesh.facet_nodes(facet, &mut nodes);
                let kind = mesh.facet_kind(facet);
                let body = mesh.body[element];
                integers.extend([kind as u32, body.into(), local.input_element[element], facet.side.into()]);
                integers.push(surfaces.target_edges.contains(&facet).into());
                integers.extend(nodes.iter().map(|&node| local.index.global(node) as u32));
                reals.extend(one.low.iter().chain(&one.high));
                reals.extend(nodes.iter().flat_map(|&node| mesh.points[node as usize]));
            }
            outgoing.integers.push((rank, integers));
            outgoing.reals.push((rank, reals));
        }
        outgoing
    }

    /// Adds the facets whose boxes are `near`. Returns `None` if the lists are inconsistent.
    pub fn unpack<const D: usize>(
        self,
        near: impl Fn(&Bounds<D>) -> bool,
        into: &mut GatheredFacets<'_, D>,
    ) -> Option<()> {
        let (mut integers, mut reals) = (self.integers, self.reals);
        while let [kind, body, element, side, edge, rest @ ..] = integers {
            let kind = *ElementKind::ALL.get(*kind as usize)?;
            let (globals, after) = rest.split_at_checked(kind.nodes())?;
            let (numbers, later) = reals.split_at_checked((2 + kind.nodes()) * D)?;
            (integers, reals) = (after, later);
            let [low, high, points @ ..] = numbers.as_chunks::<D>().0 else { return None };
            let identity = TargetFacets::identity(*element, u8::try_from(*side).ok()?);
            if near(&Bounds { low: *low, high: *high }) {
                let (body, at_edge) = (*body as u16, *edge == 1);
                into.push(&ArrivedFacet { kind, body, at_edge, identity, globals, points });
            }
        }
        (integers.is_empty() && reals.is_empty()).then_some(())
    }
}
