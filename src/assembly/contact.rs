//! Contacts of a rank: surfaces with the places of their entries, evaluated into the system.

use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use crate::contact::obstacle::Obstacle;
use crate::contact::point::{ContactLaw, Selection};
use crate::contact::rigid::{AreaKind, ContactFields, ContactRequest, ContactSink, RigidContact};
use crate::contact::state::{Branches, Changes, ContactState, ForceChange, Hold};
use crate::contact::surface::{ContactSurface, Ownership, Quadrature};
use crate::element::ElementSink;
use crate::error::{Error, Result};
use crate::mesh::Facet;
use crate::model::{self, Model};
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, BlockValues};

/// One contact of the case on this rank.
pub struct Contact<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Surface, target, laws.
    pub pair: RigidContact<D>,
    /// What its points remember.
    pub state: ContactState<D>,
    maps: FacetMaps,
}

/// Facets may differ in kind: one map for each number of nodes.
struct FacetMaps {
    maps: Vec<ScatterMap>,
    /// Map and piece of each facet.
    places: Vec<(usize, usize)>,
}

/// Where contacts are resolved.
pub struct Place<'a, const D: usize> {
    /// The rank's mesh.
    pub local: &'a LocalMesh<D>,
    /// Pattern of the matrix.
    pub pattern: &'a BlockPattern,
    /// Prescribed unknowns.
    pub constrained: &'a [bool],
    /// Every facet of the contactor, on whichever rank, has a rule of points at its nodes.
    pub nodal: bool,
}

fn flat<const D: usize>(contact: &model::Contact<D>) -> bool {
    matches!(contact.obstacle, Obstacle::Plane(_))
}

/// Facets of a named set.
///
/// # Errors
/// When there is no such set, with the names of those there are.
pub fn facets_of<'a, const D: usize>(local: &'a LocalMesh<D>, set: &str) -> Result<&'a [Facet]> {
    local.mesh.facet_sets.get(set).map(Vec::as_slice).ok_or_else(|| {
        let known: Vec<&str> = local.mesh.facet_sets.keys().map(String::as_str).collect();
        Error::case(format!("there is no surface '{set}'")).hint(&format!("known: {}", known.join(", ")))
    })
}

/// Whether all these facets have points at their nodes.
pub fn have_nodal_rule<const D: usize>(local: &LocalMesh<D>, facets: &[Facet]) -> bool {
    facets.iter().all(|&facet| crate::space::reference(local.mesh.facet_kind(facet)).nodal_rule().is_some())
}

/// Undeformed area and number of the facets that this rank reports.
pub fn size_of<const D: usize>(local: &LocalMesh<D>, facets: &[Facet]) -> [f64; 2] {
    let mine = facets.iter().filter(|facet| local.mine[facet.element as usize]);
    mine.fold([0.0; 2], |[area, count], &facet| [area + facet_area(local, facet), count + 1.0])
}

fn facet_area<const D: usize>(local: &LocalMesh<D>, facet: Facet) -> f64 {
    let kind = local.mesh.facet_kind(facet);
    let mut nodes = Vec::new();
    local.mesh.facet_nodes(facet, &mut nodes);
    let points: Vec<_> = nodes.iter().map(|&n| local.mesh.points[n as usize].into()).collect();
    let element = crate::space::reference(kind);
    let table = element.tabulate(element.full_rule());
    let width = table.nodes * (D - 1);
    let at = |q: usize| {
        let tangents = crate::space::facet_tangents::<D>(&points, &table.dn[q * width..(q + 1) * width]);
        table.weights[q] * crate::space::facet_normal(&tangents).norm()
    };
    (0..table.points).map(at).sum()
}

impl<const D: usize> Contact<D> {
    /// The contact of the model on this rank; `facet_size` is the mean size of its facets over all ranks [m].
    ///
    /// # Errors
    /// When the set, the quadrature or a derived law is no good.
    pub fn new(
        model: &Model<D>,
        contact: &model::Contact<D>,
        facet_size: f64,
        place: &Place<D>,
    ) -> Result<Self> {
        let local = place.local;
        let ownership = Ownership {
            owned_nodes: local.index.owned,
            mine: &local.mine,
            global_element: &local.input_element,
        };
        let quadrature = match contact.quadrature {
            model::Quadrature::Nodal => Quadrature::Nodal,
            model::Quadrature::Auto if flat(contact) && place.nodal => Quadrature::Nodal,
            model::Quadrature::Gauss | model::Quadrature::Auto => Quadrature::Gauss,
        };
        let facets = facets_of(local, &contact.contactor)?;
        let surface = ContactSurface::new(&local.mesh, facets, &ownership, quadrature)?;
        let maps = FacetMaps::new(&surface, place);
        let state = ContactState::new(surface.point_count());
        let law = ContactLaw {
            normal: contact.normal.law(model.bodies[contact.body].young_modulus, facet_size)?,
            friction: contact.friction,
        };
        let area = if contact.current_area { AreaKind::Current } else { AreaKind::Reference };
        let pair = RigidContact { surface, obstacle: contact.obstacle, law, area };
        Ok(Self { name: contact.name.clone(), pair, state, maps })
    }

    /// Adds the contact forces to the owned rows of `force` [N].
    pub fn add_force(
        &mut self,
        fields: &ContactFields,
        (hold, branches): (Hold, Branches),
        force: &mut [f64],
    ) {
        let request = ContactRequest { stiffness: None, hold, branches };
        let mut sink = Forces::<D> { maps: &self.maps, force };
        self.pair.evaluate(fields, &request, &mut self.state, &mut sink);
    }

    /// Adds the wanted terms to the matrix.
    pub fn add_stiffness(
        &mut self,
        fields: &ContactFields,
        wanted: (Selection, Hold),
        constrained: &[bool],
        values: &mut BlockValues,
        lift: Option<LiftTarget>,
    ) {
        let request =
            ContactRequest { stiffness: Some(wanted.0), hold: wanted.1, branches: Branches::Predicted };
        let mut sink = Stiffness::<D> { maps: &self.maps, constrained, values, lift };
        self.pair.evaluate(fields, &request, &mut self.state, &mut sink);
    }

    /// How the forces of the facets that this rank reports differ from the frozen ones.
    pub fn force_change(&self) -> ForceChange {
        let mut sum = ForceChange::default();
        for facet in self.pair.surface.facets().iter().filter(|facet| facet.mine) {
            sum += self.state.force_change(facet.points.clone());
        }
        sum
    }

    /// Takes the current points as the new iterate.
    pub fn iterate(&mut self) -> Changes {
        self.state.iterate(self.pair.surface.representative())
    }
}

impl FacetMaps {
    fn new<const D: usize>(surface: &ContactSurface<D>, place: &Place<D>) -> Self {
        let width = |facet: &_| surface.facet_nodes(facet).len();
        let mut widths: Vec<usize> = surface.facets().iter().map(width).collect();
        widths.sort_unstable();
        widths.dedup();
        let mut pieces = vec![Vec::new(); widths.len()];
        let mut places = Vec::with_capacity(surface.facets().len());
        for facet in surface.facets() {
            let map = widths.iter().position(|&w| w == width(facet)).unwrap_or(0);
            places.push((map, pieces[map].len() / widths[map]));
            pieces[map].extend_from_slice(surface.facet_nodes(facet));
        }
        let map = |(&width, nodes)| {
            ScatterMap::new::<D>(width, nodes, place.pattern, &place.local.index, place.constrained)
        };
        Self { maps: widths.iter().zip(pieces).map(map).collect(), places }
    }

    fn get(&self, facet: usize) -> (&ScatterMap, usize) {
        let (map, piece) = self.places[facet];
        (&self.maps[map], piece)
    }
}

struct Forces<'a, const D: usize> {
    maps: &'a FacetMaps,
    force: &'a mut [f64],
}

impl<const D: usize> ContactSink for Forces<'_, D> {
    fn facet(&mut self, index: usize, _: &[u32], force: &[f64], _: Option<&[f64]>) {
        let (map, piece) = self.maps.get(index);
        ForceSink::<D> { map, force: &mut *self.force }.element(piece, force, None);
    }
}

struct Stiffness<'a, 'm, const D: usize> {
    maps: &'a FacetMaps,
    constrained: &'a [bool],
    values: &'a mut BlockValues<'m>,
    lift: Option<LiftTarget<'a>>,
}

impl<const D: usize> ContactSink for Stiffness<'_, '_, D> {
    fn facet(&mut self, index: usize, _: &[u32], force: &[f64], stiffness: Option<&[f64]>) {
        let (map, piece) = self.maps.get(index);
        let lift = self.lift.as_mut().map(LiftTarget::reborrow);
        let mut sink = MatrixSink::<D> {
            map,
            constrained: self.constrained,
            values: &mut *self.values,
            lift,
            scratch: Vec::new(),
        };
        sink.element(piece, force, stiffness);
    }
}
