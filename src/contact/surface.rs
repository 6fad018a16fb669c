//! The contactor side of one contact on this rank: its facets with their quadrature points.

use std::collections::BTreeMap;
use std::ops::Range;

use super::geometry::FacetPoint;
use crate::error::{Error, Result};
use crate::mesh::{ElementKind, Facet, Mesh};
use crate::space::{Table, facet_normal, facet_tangents, reference};
use crate::tensor::Vector;

/// Where the points of a contactor facet lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quadrature {
    /// At the nodes: tractions at nodes, best on a flat rigid target. Not on tri6 and quad8 facets.
    #[default]
    Nodal,
    /// At Gauss points.
    Gauss,
}

/// What a rank knows of the distribution of the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Ownership<'a> {
    /// Local nodes below this are the rank's own; it holds every facet that touches them.
    pub owned_nodes: usize,
    /// For each local element whether this rank reports it; each element is one rank's.
    pub mine: &'a [bool],
    /// For each local element its number in the whole mesh, by which facets are ordered alike on every rank.
    pub global_element: &'a [u32],
}

/// A facet of the contactor.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFacet {
    /// Which side of which local element.
    pub facet: Facet,
    /// Kind of the facet.
    pub kind: ElementKind,
    /// Whether this rank reports its forces, areas and energies.
    pub mine: bool,
    /// Its quadrature points, in the numbering of the surface.
    pub points: Range<usize>,
    nodes: Range<usize>,
    table: usize,
}

/// Facets of one contactor on this rank, with quadrature.
#[derive(Debug, Clone)]
pub struct ContactSurface<const D: usize> {
    facets: Vec<SurfaceFacet>,
    nodes: Vec<u32>,
    reference_points: Vec<Vector<D>>,
    tables: Vec<Table>,
    reference_area: Vec<f64>,
    representative: Vec<bool>,
    quadrature: Quadrature,
}

impl<const D: usize> ContactSurface<D> {
    /// The surface of local `facets`; also without any.
    ///
    /// # Errors
    /// When nodal quadrature is asked on facets that have none (tri6, quad8).
    pub fn new(
        mesh: &Mesh<D>,
        facets: &[Facet],
        ownership: &Ownership<'_>,
        quadrature: Quadrature,
    ) -> Result<Self> {
        let mut surface = Self {
            facets: Vec::with_capacity(facets.len()),
            nodes: Vec::new(),
            reference_points: Vec::new(),
            tables: Vec::new(),
            reference_area: Vec::new(),
            representative: Vec::new(),
            quadrature,
        };
        let mut table_of = BTreeMap::new();
        for facet in facets {
            let kind = mesh.facet_kind(*facet);
            let table = match table_of.get(&kind) {
                Some(table) => *table,
                None => {
                    surface.tables.push(tabulate(kind, quadrature)?);
                    *table_of.entry(kind).or_insert(surface.tables.len() - 1)
                }
            };
            surface.push(mesh, *facet, table, ownership.mine[facet.element as usize]);
        }
        surface.choose_representatives(ownership);
        Ok(surface)
    }

    /// Of local `facets` those that this rank reports, with Gauss points.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_mine(mesh: &Mesh<D>, facets: &[Facet], ownership: &Ownership<'_>) -> Result<Self> {
        let mine = |facet: &Facet| ownership.mine[facet.element as usize];
        let facets: Vec<Facet> = facets.iter().copied().filter(mine).collect();
        Self::new(mesh, &facets, ownership, Quadrature::Gauss)
    }

    fn push(&mut self, mesh: &Mesh<D>, facet: Facet, table: usize, mine: bool) {
        let mut nodes = Vec::new();
        mesh.facet_nodes(facet, &mut nodes);
        let first = self.nodes.len();
        self.reference_points.extend(nodes.iter().map(|n| Vector::from(mesh.points[*n as usize])));
        self.nodes.extend(nodes);
        let range = first..self.nodes.len();
        let rule = &self.tables[table];
        let start = self.reference_area.len();
        for q in 0..rule.points {
            let point = row::<D>(rule, q);
            let area =
                facet_normal(&facet_tangents(&self.reference_points[range.clone()], point.gradient)).norm();
            self.reference_area.push(point.weight * area);
        }
        let points = start..self.reference_area.len();
        let kind = mesh.facet_kind(facet);
        self.facets.push(SurfaceFacet { facet, kind, mine, points, nodes: range, table });
    }

    /// Under nodal quadrature several facets have a point at one node; the lowest facet's is counted, by the
    /// owner of the node, who is sure to know it.
    fn choose_representatives(&mut self, ownership: &Ownership<'_>) {
        self.representative = vec![false; self.reference_area.len()];
        let mut lowest: BTreeMap<u32, ((u32, u8), usize)> = BTreeMap::new();
        for surface_facet in &self.facets {
            if self.quadrature == Quadrature::Gauss {
                self.representative[surface_facet.points.clone()].fill(surface_facet.mine);
                continue;
            }
            let Facet { element, side } = surface_facet.facet;
            let order = (ownership.global_element[element as usize], side);
            for (node, point) in
                self.nodes[surface_facet.nodes.clone()].iter().zip(surface_facet.points.clone())
            {
                let entry = lowest.entry(*node).or_insert((order, point));
                *entry = (*entry).min((order, point));
            }
        }
        for (_, (_, point)) in lowest.range(..ownership.owned_nodes as u32) {
            self.representative[*point] = true;
        }
    }

    /// Number of quadrature points.
    pub fn point_count(&self) -> usize {
        self.reference_area.len()
    }

    /// All facets.
    pub fn facets(&self) -> &[SurfaceFacet] {
        &self.facets
    }

    /// Local nodes of a facet, in the order of its kind.
    pub fn facet_nodes(&self, facet: &SurfaceFacet) -> &[u32] {
        &self.nodes[facet.nodes.clone()]
    }

    /// Reference positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: &SurfaceFacet) -> &[Vector<D>] {
        &self.reference_points[facet.nodes.clone()]
    }

    /// Shape functions of point `q` of a facet, counted within it.
    pub fn facet_point(&self, facet: &SurfaceFacet, q: usize) -> FacetPoint<'_> {
        row::<D>(&self.tables[facet.table], q)
    }

    /// Area of a point on the undeformed facet, its share of it \[m, m^2\].
    pub fn reference_area(&self, point: usize) -> f64 {
        self.reference_area[point]
    }

    /// For each point whether this rank counts it; every node (nodal) or point (Gauss) is counted on one rank, once.
    pub fn representative(&self) -> &[bool] {
        &self.representative
    }
}

fn row<const D: usize>(table: &Table, q: usize) -> FacetPoint<'_> {
    let (nodes, width) = (table.nodes, table.nodes * (D - 1));
    FacetPoint {
        shape: &table.n[q * nodes..(q + 1) * nodes],
        gradient: &table.dn[q * width..(q + 1) * width],
        weight: table.weights[q],
    }
}

fn tabulate(kind: ElementKind, quadrature: Quadrature) -> Result<Table> {
    let element = reference(kind);
    let rule = match quadrature {
        Quadrature::Gauss => Some(element.gauss_contact_rule()),
        Quadrature::Nodal => element.nodal_rule(),
    };
    let rule = rule.ok_or_else(|| {
        Error::case(format!("nodal contact quadrature does not exist on {} facets", kind.name()))
            .hint("write `quadrature: gauss` for this contact")
    })?;
    Ok(element.tabulate(rule))
}
