//! Foundations of surfaces, springs and dashpots at nodes (3.19): forces, tangent, stored energy, and what
//! they hold.

use super::contact::facets_of;
use super::free_bodies::FreeRotation;
use super::scatter::{LiftTarget, MatrixSink, ScatterMap};
use crate::element::{ElementSink, LoadedSurface};
use crate::error::{Error, Result};
use crate::mesh::Facet;
use crate::model::{ElasticSupport, Grounded, SupportCoefficients};
use crate::partition::{IndexMap, LocalMesh};
use crate::petsc::{BlockPattern, BlockValues};
use crate::space::Held;
use crate::tensor::Vector;
use crate::terms::Terms;

/// A row of another rank.
const ELSEWHERE: u32 = u32::MAX;

/// Facets with equal numbers of nodes, or single nodes, of one support.
struct Patch {
    map: ScatterMap,
    /// Index of each node of each piece among the nodes of the support; [`ELSEWHERE`] for ghosts.
    rows: Vec<u32>,
    /// Stiffness matrices of the pieces \[N/m\].
    stiffness: Vec<f64>,
    /// Damping matrices of the pieces [N s/m]; empty without dashpots.
    damping: Vec<f64>,
    /// Matrices of the pieces with coefficients of 1 wherever there is stiffness, per area of a facet.
    felt: Vec<f64>,
    /// Element of each facet; empty for nodes.
    elements: Vec<u32>,
    /// Whether this rank counts the piece in sums over all ranks.
    counted: Vec<bool>,
}

impl Patch {
    fn len(&self) -> usize {
        self.counted.len()
    }

    /// The matrix of a piece; `None` if the support has no such coefficients.
    fn matrix<'a>(&self, all: &'a [f64], piece: usize) -> Option<&'a [f64]> {
        let size = all.len() / self.len().max(1);
        (size > 0).then(|| &all[piece * size..(piece + 1) * size])
    }
}

/// A support on this rank.
struct LocalElastic {
    name: String,
    patches: Vec<Patch>,
    /// Owned nodes.
    nodes: Vec<u32>,
    /// `K u` at these nodes at the last evaluation \[N\].
    springs: Vec<f64>,
    /// `C v` at these nodes at the last evaluation \[N\].
    dashpots: Vec<f64>,
    /// The unknown of a torsion spring.
    rotation: Option<FreeRotation>,
}

/// A piece of a support and the motions that it resists.
pub(super) struct FeltPiece<'a> {
    /// Local nodes.
    pub nodes: &'a [u32],
    /// Element of a facet; `None` for a node.
    pub element: Option<u32>,
    /// Matrix of the squares of the motions that it resists, a block for each pair of nodes.
    pub matrix: &'a [f64],
    /// Whether this rank counts it in sums over all ranks.
    pub counted: bool,
}

/// All foundations, springs and dashpots of a rank.
pub struct ElasticSupports<const D: usize> {
    supports: Vec<LocalElastic>,
    /// Whether any of them has dashpots, on any rank.
    damped: bool,
}

impl<const D: usize> ElasticSupports<D> {
    /// Resolves the supports on the rank's mesh. Without `inertia` there are no dashpots. `free_nodes` are
    /// the nodes of the free rigid bodies on the rank that owns them, and `rotations` their first free rotations.
    ///
    /// # Errors
    /// A set does not exist, or a coefficient is not finite or negative at a point.
    pub(super) fn new(
        given: &[ElasticSupport<D>],
        free_nodes: &[Option<[u32; 2]>],
        rotations: &[Option<FreeRotation>],
        local: &LocalMesh<D>,
        pattern: &BlockPattern,
        held: &Held<D>,
        inertia: bool,
    ) -> Result<Self> {
        let supports = given.iter().map(|support| {
            let none = SupportCoefficients::NONE;
            let damping = if inertia { &support.damping } else { &none };
            let coefficients = [&support.stiffness, damping];
            let mut rotation = None;
            let patches = match support.on {
                Grounded::Surface => facets(local, support, coefficients, pattern, held)?,
                Grounded::Nodes => {
                    let nodes = owned_nodes(local, support)?;
                    vec![springs_at(local, nodes, coefficients, pattern, held)?]
                }
                Grounded::FreeBody(index) => {
                    let centre = free_nodes[index].map(|[centre, _]| centre);
                    vec![springs_at(local, centre.into_iter().collect(), coefficients, pattern, held)?]
                }
                Grounded::FreeRotation(index, [k, c]) => {
                    rotation = rotations[index];
                    let coefficients = [k, if inertia { c } else { 0.0 }];
                    vec![torsion_spring(local, rotation, coefficients, pattern, held)]
                }
            };
            Ok(LocalElastic::new::<D>(support.name.clone(), patches, rotation, &local.index))
        });
        let is_damped = |support: &ElasticSupport<D>| match support.on {
            Grounded::FreeRotation(_, [_, c]) => c > 0.0,
            _ => support.damping.is_given(),
        };
        Ok(Self {
            supports: supports.collect::<Result<_>>()?,
            damped: inertia && given.iter().any(is_damped),
        })
    }

    /// Whether there are no foundations, springs and dashpots.
    pub fn is_empty(&self) -> bool {
        self.supports.is_empty()
    }

    /// Whether any of them has dashpots, on any rank.
    pub fn is_damped(&self) -> bool {
        self.damped
    }

    /// Recomputes the positions of all entries for another pattern.
    pub(super) fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        let patches = self.supports.iter_mut().flat_map(|support| &mut support.patches);
        patches.for_each(|patch| patch.map.relocate(pattern, index));
    }

    /// Evaluates the forces of all springs at the local displacement `u` \[m\], and those of dashpots at the
    /// local velocity `v` \[m/s\]; they are zero if it is `None`.
    pub(super) fn evaluate(&mut self, u: &[f64], v: Option<&[f64]>) {
        for support in &mut self.supports {
            let LocalElastic { patches, springs, dashpots, .. } = support;
            springs.fill(0.0);
            dashpots.fill(0.0);
            for patch in patches {
                add_products::<D>(patch, &patch.stiffness, u, springs);
                if let Some(v) = v {
                    add_products::<D>(patch, &patch.damping, v, dashpots);
                }
            }
        }
    }

    /// Adds the forces of the springs at the last evaluation, `K u`, to owned rows \[N\].
    pub(super) fn add_springs(&self, force: &mut [f64]) {
        self.supports.iter().for_each(|support| support.spread::<D>(&support.springs, force));
    }

    /// Adds the forces of the dashpots at the last evaluation, `C v`, to owned rows \[N\].
    pub(super) fn add_dashpots(&self, force: &mut [f64]) {
        self.supports.iter().for_each(|support| support.spread::<D>(&support.dashpots, force));
    }

    /// Adds `K` and `shift C`, restricted to `terms`, to the matrix.
    pub(super) fn add_stiffness(
        &self,
        terms: Terms,
        shift: f64,
        held: &Held<D>,
        values: &mut BlockValues,
        mut lift: Option<LiftTarget>,
    ) {
        let mut sum = Vec::new();
        for patch in self.supports.iter().flat_map(|support| &support.patches) {
            let lift = lift.as_mut().map(LiftTarget::reborrow);
            let mut sink = MatrixSink::<D>::new(&patch.map, held, values, lift);
            for piece in 0..patch.len() {
                sum.clear();
                sum.resize(patch.map.width.pow(2) * D * D, 0.0);
                let parts =
                    [(Terms::SPRINGS, &patch.stiffness, 1.0), (Terms::DAMPING, &patch.damping, shift)];
                for (term, matrices, factor) in parts {
                    let Some(matrix) = patch.matrix(matrices, piece).filter(|_| terms.contains(term)) else {
                        continue;
                    };
                    sum.iter_mut().zip(matrix).for_each(|(sum, entry)| *sum += factor * entry);
                }
                sink.element(piece, &[], Some(&sum));
            }
        }
    }

    /// Energy of this rank's springs at the local displacement `u`, `u K u / 2` \[J\].
    pub fn stored_energy(&self, u: &[f64]) -> f64 {
        let mut energy = 0.0;
        for support in &self.supports {
            let mut force = vec![0.0; support.springs.len()];
            for patch in &support.patches {
                add_products::<D>(patch, &patch.stiffness, u, &mut force);
            }
            let at = |node: &u32| &u[*node as usize * D..][..D];
            energy += 0.5 * support.nodes.iter().flat_map(at).zip(&force).map(|(u, f)| u * f).sum::<f64>();
        }
        energy
    }

    /// For each support except torsion springs its name, and `receive(node, force)` for each owned node with
    /// the force that springs and dashpots exert on the bodies at the last evaluation \[N\].
    pub fn forces<'a>(
        &'a self,
    ) -> impl Iterator<Item = (&'a str, impl Iterator<Item = (usize, [f64; D])> + 'a)> {
        self.supports.iter().filter(|support| support.rotation.is_none()).map(|support| {
            let force = |(k, node): (usize, &u32)| (*node as usize, support.force_at(k));
            (support.name.as_str(), support.nodes.iter().enumerate().map(force))
        })
    }

    /// For each torsion spring its name and the torque that it exerts on its body at the last evaluation
    /// [N m]; zero on ranks that do not own the body.
    pub fn torques(&self) -> impl Iterator<Item = (&str, [f64; 3])> {
        self.supports.iter().filter_map(|support| {
            let FreeRotation { component, turn, .. } = support.rotation?;
            let force = if support.nodes.is_empty() { 0.0 } else { support.force_at::<D>(0)[component] };
            let square: f64 = turn.iter().map(|x| x * x).sum();
            Some((support.name.as_str(), turn.map(|x| force * x / square)))
        })
    }

    /// The pieces with stiffness.
    pub(super) fn felt(&self) -> impl Iterator<Item = FeltPiece<'_>> {
        self.supports.iter().flat_map(|support| &support.patches).flat_map(|patch| {
            (0..patch.len()).filter_map(|piece| {
                Some(FeltPiece {
                    nodes: patch.map.nodes(piece),
                    element: patch.elements.get(piece).copied(),
                    matrix: patch.matrix(&patch.felt, piece)?,
                    counted: patch.counted[piece],
                })
            })
        })
    }

    /// Local unknowns at pieces that resist a translation along the axis of the unknown.
    pub(super) fn resisted(&self, unknowns: usize) -> Vec<bool> {
        let mut resisted = vec![false; unknowns];
        for piece in self.felt() {
            for i in 0..D {
                let blocks = piece.matrix.chunks_exact(D * D);
                if blocks.map(|block| block[i * D + i]).sum::<f64>() > UNFELT {
                    piece.nodes.iter().for_each(|&node| resisted[node as usize * D + i] = true);
                }
            }
        }
        resisted
    }
}

/// Square of the component of a unit vector below which it is rounding.
const UNFELT: f64 = 1e-12;

impl LocalElastic {
    fn new<const D: usize>(
        name: String,
        mut patches: Vec<Patch>,
        rotation: Option<FreeRotation>,
        index: &IndexMap,
    ) -> Self {
        let of_patch = |patch: &Patch| -> Vec<u32> {
            let pieces = 0..patch.len();
            pieces
                .flat_map(|piece| patch.map.nodes(piece))
                .copied()
                .filter(|&node| index.owns(node))
                .collect()
        };
        let mut nodes: Vec<u32> = patches.iter().flat_map(of_patch).collect();
        nodes.sort_unstable();
        nodes.dedup();
        for patch in &mut patches {
            let row = |node: &u32| nodes.binary_search(node).map_or(ELSEWHERE, |row| row as u32);
            patch.rows = (0..patch.len()).flat_map(|piece| patch.map.nodes(piece)).map(row).collect();
        }
        let rows = nodes.len() * D;
        Self { name, patches, nodes, springs: vec![0.0; rows], dashpots: vec![0.0; rows], rotation }
    }

    /// Force that springs and dashpots exert on node `k` of the support \[N\].
    fn force_at<const D: usize>(&self, k: usize) -> [f64; D] {
        std::array::from_fn(|i| -self.springs[k * D + i] - self.dashpots[k * D + i])
    }

    /// Adds forces at the nodes of the support to owned rows \[N\].
    fn spread<const D: usize>(&self, own: &[f64], force: &mut [f64]) {
        for (node, own) in self.nodes.iter().zip(own.chunks_exact(D)) {
            let entries = &mut force[*node as usize * D..][..D];
            entries.iter_mut().zip(own).for_each(|(entry, own)| *entry += own);
        }
    }
}

/// Adds the products of the matrices of all pieces with a local field to the rows of a support.
fn add_products<const D: usize>(patch: &Patch, matrices: &[f64], field: &[f64], out: &mut [f64]) {
    let width = patch.map.width;
    for piece in 0..patch.len() {
        let Some(matrix) = patch.matrix(matrices, piece) else { return };
        let nodes = patch.map.nodes(piece);
        for (pair, block) in matrix.chunks_exact(D * D).enumerate() {
            let row = patch.rows[piece * width + pair / width];
            if row == ELSEWHERE {
                continue;
            }
            let value = &field[nodes[pair % width] as usize * D..][..D];
            let out = &mut out[row as usize * D..][..D];
            for (out, row) in out.iter_mut().zip(block.chunks_exact(D)) {
                *out += row.iter().zip(value).map(|(entry, value)| entry * value).sum::<f64>();
            }
        }
    }
}

/// The facets of a foundation, by their number of nodes.
fn facets<const D: usize>(
    local: &LocalMesh<D>,
    support: &ElasticSupport<D>,
    [stiffness, damping]: [&SupportCoefficients<D>; 2],
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Result<Vec<Patch>> {
    let mesh = &local.mesh;
    let facets = facets_of(local, &support.set)?;
    let width = |facet: &Facet| mesh.facet_kind(*facet).nodes();
    let mut widths: Vec<usize> = facets.iter().map(width).collect();
    widths.sort_unstable();
    widths.dedup();
    let patch = |wanted: usize| {
        let facets: Vec<Facet> = facets.iter().filter(|facet| width(facet) == wanted).copied().collect();
        let surface = LoadedSurface::new(mesh, &facets);
        let nodes = (0..surface.len()).flat_map(|index| surface.nodes(index)).copied().collect();
        let map = ScatterMap::new::<D>(wanted, nodes, pattern, &local.index, held);
        let [mut of_springs, mut of_dashpots, mut felt] = [const { Vec::new() }; 3];
        for index in 0..surface.len() {
            let area = surface.area(index);
            if stiffness.is_given() {
                surface.resistance(
                    index,
                    |point, normal| stiffness.matrix(point, normal),
                    &mut of_springs,
                )?;
                let per_area =
                    |point: &[f64; D], normal: &Vector<D>| Ok(stiffness.directions(point, normal)? / area);
                surface.resistance(index, per_area, &mut felt)?;
            }
            if damping.is_given() {
                surface.resistance(index, |point, normal| damping.matrix(point, normal), &mut of_dashpots)?;
            }
        }
        Ok(Patch {
            map,
            rows: Vec::new(),
            stiffness: of_springs,
            damping: of_dashpots,
            felt,
            elements: facets.iter().map(|facet| facet.element).collect(),
            counted: facets.iter().map(|facet| local.mine[facet.element as usize]).collect(),
        })
    };
    widths.into_iter().map(patch).collect()
}

/// The owned nodes of the set of a support.
fn owned_nodes<const D: usize>(local: &LocalMesh<D>, support: &ElasticSupport<D>) -> Result<Vec<u32>> {
    let Some(nodes) = local.mesh.set_nodes(&support.set) else {
        let message = format!("boundary '{}': there is no set '{}'", support.name, support.set);
        return Err(Error::case(message));
    };
    Ok(nodes.into_iter().filter(|&node| local.index.owns(node)).collect())
}

/// A spring and a dashpot at each of these owned nodes.
fn springs_at<const D: usize>(
    local: &LocalMesh<D>,
    nodes: Vec<u32>,
    [stiffness, damping]: [&SupportCoefficients<D>; 2],
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Result<Patch> {
    let [mut of_springs, mut of_dashpots, mut felt] = [const { Vec::new() }; 3];
    for &node in &nodes {
        let point = &local.mesh.points[node as usize];
        let none = Vector::zeros();
        if stiffness.is_given() {
            of_springs.extend_from_slice(stiffness.matrix(point, &none)?.as_slice());
            felt.extend_from_slice(stiffness.directions(point, &none)?.as_slice());
        }
        if damping.is_given() {
            of_dashpots.extend_from_slice(damping.matrix(point, &none)?.as_slice());
        }
    }
    let counted = vec![true; nodes.len()];
    Ok(Patch {
        map: ScatterMap::new::<D>(1, nodes, pattern, &local.index, held),
        rows: Vec::new(),
        stiffness: of_springs,
        damping: of_dashpots,
        felt,
        elements: Vec::new(),
        counted,
    })
}

/// A spring and a dashpot at the only free rotation of a rigid body. The unknown is an angle times a length,
/// so that both coefficients are those of the angle over the square of that length.
fn torsion_spring<const D: usize>(
    local: &LocalMesh<D>,
    rotation: Option<FreeRotation>,
    coefficients: [f64; 2],
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Patch {
    let owned = rotation.and_then(|rotation| Some((rotation.node?, rotation)));
    let matrix = |coefficient: f64| {
        let entries = owned.iter().flat_map(|(_, rotation)| {
            let square: f64 = rotation.turn.iter().map(|x| x * x).sum();
            let at = rotation.component * (D + 1);
            (0..D * D).map(move |entry| if entry == at { coefficient * square } else { 0.0 })
        });
        if coefficient > 0.0 { entries.collect() } else { Vec::new() }
    };
    let [stiffness, damping] = coefficients.map(matrix);
    let felt = stiffness.iter().map(|&entry| if entry > 0.0 { 1.0 } else { 0.0 }).collect();
    let nodes: Vec<u32> = owned.iter().map(|(node, _)| *node).collect();
    Patch {
        counted: vec![true; nodes.len()],
        map: ScatterMap::new::<D>(1, nodes, pattern, &local.index, held),
        rows: Vec::new(),
        stiffness,
        damping,
        felt,
        elements: Vec::new(),
    }
}
