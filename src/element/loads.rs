//! Forces on elements and surfaces: body force, dead traction, follower pressure, and foundation.

use super::ElementSink;
use super::group::ElementGroup;
use super::kinematics::reference_gradients;
use crate::error::Result;
use crate::mesh::{Edge, ElementKind, Facet, Mesh, PlaneState};
use crate::space::{ShapeTable, area_variation, facet_normal, facet_tangents, reference};
use crate::tensor::{Tensor, Vector};

impl<const D: usize> ElementGroup<D> {
    /// `F_ext = int rho N^T b dV` of each element \[N\] for a force `b` per mass [m/s^2] at a
    /// reference point \[m\].
    pub fn body_force(&self, per_mass: impl Fn(&[f64; D]) -> [f64; D], sink: &mut dyn ElementSink) {
        let element = reference(self.kind);
        let table = element.tabulate(element.mass_rule());
        let n = table.nodes;
        let size = table.nodes * D;
        let mut points = Vec::new();
        let mut gradients = vec![[0.0; D]; n];
        let mut force = vec![0.0; size];
        for index in 0..self.elements.len() {
            self.points_of(index, &mut points);
            force.fill(0.0);
            for q in 0..table.points {
                let det = reference_gradients(&points, &table.dn[q * size..(q + 1) * size], &mut gradients);
                let shape = &table.n[q * n..(q + 1) * n];
                let density = per_mass(&interpolate(&points, shape));
                let depth = self.depth_at(&points, shape);
                let weight = self.formulation.density * det * table.weights[q] * depth;
                add_density(&mut force, shape, &density.map(|b| b * weight));
            }
            sink.element(index, &force, None);
        }
    }
}

fn interpolate<const D: usize>(points: &[[f64; D]], shape: &[f64]) -> [f64; D] {
    std::array::from_fn(|i| points.iter().zip(shape).map(|(point, n)| point[i] * n).sum())
}

fn add_density<const D: usize>(force: &mut [f64], shape: &[f64], density: &[f64; D]) {
    for (force, n) in force.chunks_exact_mut(D).zip(shape) {
        for (force, density) in force.iter_mut().zip(density) {
            *force += n * density;
        }
    }
}

/// Configuration in which a pressure acts.
#[derive(Debug, Clone, Copy)]
pub enum Configuration<'a> {
    /// On the reference area along the reference normal (linear kinematics); its derivative is
    /// zero.
    Reference,
    /// On the area deformed by these nodal displacements \[m\], along its normal.
    Current(&'a [f64]),
}

/// Index of the shape functions of a kind, which are added if they are new.
fn table_of(tables: &mut Vec<(ElementKind, ShapeTable)>, kind: ElementKind) -> usize {
    tables.iter().position(|(known, _)| *known == kind).unwrap_or_else(|| {
        let element = reference(kind);
        tables.push((kind, element.tabulate(element.mass_rule())));
        tables.len() - 1
    })
}

/// A loaded part of the boundary.
#[derive(Debug)]
pub struct LoadedSurface<const D: usize> {
    facets: Vec<LoadedFacet<D>>,
    tables: Vec<(ElementKind, ShapeTable)>,
    plane: PlaneState,
}

#[derive(Debug)]
struct LoadedFacet<const D: usize> {
    table: usize,
    nodes: Vec<u32>,
    points: Vec<Vector<D>>,
}

impl<const D: usize> LoadedSurface<D> {
    /// The facets `facets` of `mesh`, which may be of several kinds. In axisymmetry areas and forces are
    /// those of the whole revolution.
    pub fn new(mesh: &Mesh<D>, facets: &[Facet]) -> Self {
        let mut tables: Vec<(ElementKind, ShapeTable)> = Vec::new();
        let mut loaded = Vec::with_capacity(facets.len());
        for &facet in facets {
            let kind = mesh.facet_kind(facet);
            let table = table_of(&mut tables, kind);
            let mut nodes = Vec::new();
            mesh.facet_nodes(facet, &mut nodes);
            let points = nodes.iter().map(|&node| mesh.points[node as usize].into()).collect();
            loaded.push(LoadedFacet { table, nodes, points });
        }
        Self { facets: loaded, tables, plane: mesh.plane }
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.facets.len()
    }

    /// Whether there are no facets.
    pub fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// Nodes of the facet at `index`, in the order of the forces.
    pub fn nodes(&self, index: usize) -> &[u32] {
        &self.facets[index].nodes
    }

    /// `F_ext = int N^T p_R dS` of each facet \[N\] for a traction `p_R` per reference area \[Pa\]
    /// at a reference point \[m\].
    pub fn traction(&self, traction: impl Fn(&[f64; D]) -> [f64; D], sink: &mut dyn ElementSink) {
        let mut force = Vec::new();
        for (index, facet) in self.facets.iter().enumerate() {
            force.clear();
            force.resize(facet.nodes.len() * D, 0.0);
            for point in self.quadrature(facet) {
                let area = self.area_of(facet, &point);
                let density = traction(&facet.place(point.n)).map(|t| t * area);
                add_density(&mut force, point.n, &density);
            }
            sink.element(index, &force, None);
        }
    }

    /// Passes the reference position \[m\] of each quadrature point of all facets and its part of the
    /// reference area \[m^(D - 1)\] to `receive`. These are the points of [`traction`](Self::traction).
    pub fn points(&self, mut receive: impl FnMut(&[f64; D], f64)) {
        for facet in &self.facets {
            for point in self.quadrature(facet) {
                receive(&facet.place(point.n), self.area_of(facet, &point));
            }
        }
    }

    /// Reference area of the facet at `index` \[m^(D - 1)\].
    pub fn area(&self, index: usize) -> f64 {
        let facet = &self.facets[index];
        self.quadrature(facet).map(|point| self.area_of(facet, &point)).sum()
    }

    /// Appends `K_ab = int N_a N_b k dS` (3.19) of the facet at `index` to `matrix`: a block for each pair
    /// of nodes, all row-major. The symmetric matrix `k` of coefficients per area is given at a
    /// reference point \[m\] with its outward unit normal.
    ///
    /// # Errors
    /// The first error of `coefficients`.
    pub fn resistance(
        &self,
        index: usize,
        coefficients: impl Fn(&[f64; D], &Vector<D>) -> Result<Tensor<D>>,
        matrix: &mut Vec<f64>,
    ) -> Result<()> {
        let facet = &self.facets[index];
        let m = facet.nodes.len();
        let start = matrix.len();
        matrix.resize(start + m * m * D * D, 0.0);
        let matrix = &mut matrix[start..];
        for point in self.quadrature(facet) {
            let normal = facet_normal(&facet_tangents(&facet.points, point.dn));
            let k = coefficients(&facet.place(point.n), &normal.normalize())? * self.area_of(facet, &point);
            for (pair, block) in matrix.chunks_exact_mut(D * D).enumerate() {
                let weight = point.n[pair / m] * point.n[pair % m];
                for (ij, entry) in block.iter_mut().enumerate() {
                    *entry += weight * k[(ij / D, ij % D)];
                }
            }
        }
        Ok(())
    }

    /// `F_ext = -int p N^T n ds` (3.16) of each facet \[N\] for a pressure `p` \[Pa\], positive
    /// against the outward normal, given at a reference point \[m\]. In the current configuration
    /// the stiffness `-dF_ext/du` \[N/m\] is included, which is non-symmetric at the rim of the
    /// surface.
    pub fn pressure(
        &self,
        on: Configuration<'_>,
        pressure: impl Fn(&[f64; D]) -> f64,
        sink: &mut dyn ElementSink,
    ) {
        let (mut force, mut stiffness) = (Vec::new(), Vec::new());
        for (index, facet) in self.facets.iter().enumerate() {
            let m = facet.nodes.len();
            force.clear();
            force.resize(m * D, 0.0);
            stiffness.clear();
            stiffness.resize(m * m * D * D, 0.0);
            let place = facet.displaced(on);
            for point in self.quadrature(facet) {
                let radius: f64 = place.iter().zip(point.n).map(|(x, n)| x[0] * n).sum();
                let per_depth = pressure(&facet.place(point.n)) * point.weight;
                let strength = per_depth * self.plane.depth(radius);
                let tangents = facet_tangents(&place, point.dn);
                let normal = facet_normal(&tangents);
                add_density(&mut force, point.n, &(normal * -strength).into());
                if matches!(on, Configuration::Reference) {
                    continue;
                }
                let by_radius = normal * (per_depth * self.plane.depth_slope());
                for (b, dn) in point.dn.chunks_exact(D - 1).enumerate() {
                    let mut variation = area_variation(&tangents, dn) * strength;
                    for i in 0..D {
                        variation[(i, 0)] += by_radius[i] * point.n[b];
                    }
                    for (a, n) in point.n.iter().enumerate() {
                        let block = &mut stiffness[(a * m + b) * D * D..][..D * D];
                        for (ij, entry) in block.iter_mut().enumerate() {
                            *entry += n * variation[(ij / D, ij % D)];
                        }
                    }
                }
            }
            sink.element(index, &force, matches!(on, Configuration::Current(_)).then_some(&stiffness));
        }
    }

    /// Part of the reference area of a facet at a quadrature point \[m^(D - 1)\].
    fn area_of(&self, facet: &LoadedFacet<D>, point: &FacetPoint<'_>) -> f64 {
        let depth = self.plane.depth(facet.place(point.n)[0]);
        facet_normal(&facet_tangents(&facet.points, point.dn)).norm() * point.weight * depth
    }

    fn quadrature(&self, facet: &LoadedFacet<D>) -> impl Iterator<Item = FacetPoint<'_>> {
        let table = &self.tables[facet.table].1;
        let shapes = table.n.chunks_exact(table.nodes).zip(table.dn.chunks_exact(table.nodes * (D - 1)));
        shapes.zip(&table.weights).map(|((n, dn), &weight)| FacetPoint { n, dn, weight })
    }
}

/// Loaded edges of elements in space.
#[derive(Debug)]
pub struct LoadedLine<const D: usize> {
    edges: Vec<LoadedFacet<D>>,
    tables: Vec<(ElementKind, ShapeTable)>,
}

impl<const D: usize> LoadedLine<D> {
    /// These edges of `mesh`, of one or two orders.
    pub fn new(mesh: &Mesh<D>, edges: &[Edge]) -> Self {
        let mut tables: Vec<(ElementKind, ShapeTable)> = Vec::new();
        let loaded = edges.iter().map(|edge| {
            let table = table_of(&mut tables, edge.kind);
            let points = edge.nodes.iter().map(|&node| mesh.points[node as usize].into()).collect();
            LoadedFacet { table, nodes: edge.nodes.clone(), points }
        });
        Self { edges: loaded.collect(), tables }
    }

    /// Nodes of all edges, in the order of the forces.
    pub fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.edges.iter().flat_map(|edge| edge.nodes.iter().copied())
    }

    /// `F_ext = int N^T q dl` of each edge \[N\] for a force `q` per reference length \[N/m\] at a
    /// reference point \[m\].
    pub fn force(&self, density: impl Fn(&[f64; D]) -> [f64; D], sink: &mut dyn ElementSink) {
        let mut force = Vec::new();
        for (index, edge) in self.edges.iter().enumerate() {
            force.clear();
            force.resize(edge.nodes.len() * D, 0.0);
            let table = &self.tables[edge.table].1;
            let shapes = table.n.chunks_exact(table.nodes).zip(table.dn.chunks_exact(table.nodes));
            for ((n, dn), weight) in shapes.zip(&table.weights) {
                let tangent: Vector<D> = edge.points.iter().zip(dn).map(|(point, dn)| point * *dn).sum();
                let part = density(&edge.place(n)).map(|q| q * tangent.norm() * weight);
                add_density(&mut force, n, &part);
            }
            sink.element(index, &force, None);
        }
    }
}

struct FacetPoint<'a> {
    n: &'a [f64],
    dn: &'a [f64],
    weight: f64,
}

impl<const D: usize> LoadedFacet<D> {
    /// Reference position \[m\] at which the shape functions have the values `n`.
    fn place(&self, n: &[f64]) -> [f64; D] {
        self.points.iter().zip(n).map(|(point, n)| point * *n).sum::<Vector<D>>().into()
    }

    fn displaced(&self, on: Configuration<'_>) -> Vec<Vector<D>> {
        let Configuration::Current(u) = on else {
            return self.points.clone();
        };
        let moved =
            |(point, &node): (&Vector<D>, &u32)| point + Vector::from_fn(|i, _| u[node as usize * D + i]);
        self.points.iter().zip(&self.nodes).map(moved).collect()
    }
}
