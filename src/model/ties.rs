//! Ties of surfaces, found on the whole mesh.

use std::fmt::Write as _;

use super::Model;
use super::regions::softest_beneath;
use crate::case::{Case, PlacedFunction};
use crate::contact::mortar::tied::{SurfaceTies, TiedSurfaces};
use crate::error::{Error, Result};
use crate::mesh::{DisjointSets, Facet, Mesh, Tie};
use crate::tensor::Vector;

/// Two surfaces that stay together.
#[derive(Debug, Clone, PartialEq)]
pub struct TieModel {
    /// Name in the case file.
    pub name: String,
    /// Set of facets whose vertices carry the ties.
    pub contactor: String,
    /// Set of facets of the other side.
    pub target: String,
    /// Stiffness per reference area [Pa/m]; `None` for the default.
    pub stiffness: Option<f64>,
    /// Distance up to which points are tied \[m\]; `None` for the default.
    pub within: Option<f64>,
    /// Vector from the contactor to the target in the reference configuration \[m\]; `None` if they touch.
    pub offset: Option<[f64; 3]>,
    /// Prescribed displacement of the target minus that of the contactor \[m\].
    pub jump: [Option<PlacedFunction>; 3],
}

/// Default stiffness of a tie, in units of Young's modulus of the softer side over the size of a
/// facet. The bond then adds a hundredth of the elongation of one element. The stresses of a patch
/// test do not depend on it. For five steps of a tied cube of 16 cells a side (`scripts/tied-cube`),
/// `filtered_ilu` takes 167 iterations with a tenth of the stiffness, and 171 with this one and with
/// ten times as much. `cg_icc` takes 219, 3860 and more than 500 in one solve, which ends it.
const STIFFNESS: f64 = 100.0;

/// Default stiffness of periodic sides, in the same units. A cell of `n` facets then deforms by a
/// relative 1 / (10000 n) less than prescribed. The shear modulus of a cell of four by four quad4 is
/// wrong by 2e-3 with a hundredth of this stiffness, by 2e-5 with it, and by 2e-7 with a hundred times
/// as much. Beyond, rounding takes over: 5e-8 with ten thousand and 3e-6 with a million times as much
/// (direct solver; iterative ones need more iterations).
const PERIODIC_STIFFNESS: f64 = 1e4;

/// Default distance up to which points are tied, in units of the size of a facet. Meshes of a circle
/// with facets of a third of the radius have gaps of at most a twentieth of a facet.
const WITHIN: f64 = 0.1;

/// Part of the area of the contactor that may lack a target without a remark. It covers rounding at
/// the edge of the surface.
const UNTIED: f64 = 1e-6;

impl<const D: usize> Model<D> {
    /// Finds the ties on the whole mesh and adds them. The tied pieces of the bodies become one.
    /// Returns remarks for the user.
    ///
    /// # Errors
    /// Two surfaces have no common part within reach. The error gives the location in the case.
    pub fn add_ties(&self, case: &Case, mesh: &mut Mesh<D>) -> Result<Vec<String>> {
        let mut remarks = Vec::new();
        let mut faults = Vec::new();
        for (pair, model) in (0..).zip(&self.ties) {
            let none = || Error::internal(format!("the mesh lacks a set of the tie '{}'", model.name));
            let contactor = mesh.facet_sets.get(&model.contactor).ok_or_else(none)?;
            let target = mesh.facet_sets.get(&model.target).ok_or_else(none)?;
            let size = mean_size(mesh, contactor);
            let within = model.within.unwrap_or(WITHIN * size);
            let softer = [contactor, target].map(|facets| softest_beneath(&self.bodies, mesh, facets));
            let element_stiffness = softer[0].min(softer[1]) / size;
            let default = if model.offset.is_some() { PERIODIC_STIFFNESS } else { STIFFNESS };
            let stiffness = model.stiffness.unwrap_or(default * element_stiffness);
            let offset = Vector::from_fn(|i, _| model.offset.map_or(0.0, |offset| offset[i]));
            let surfaces =
                TiedSurfaces { pair, contactor, target, within, offset, stiffness, element_stiffness };
            let found = surfaces.ties(mesh);
            if found.ties.is_empty() {
                let place = case.tied.get(&model.name).map(|tied| tied.contactor.place).unwrap_or_default();
                let m = case.units.of("m");
                let message = format!(
                    "tied '{}': '{}' and '{}' have no facets that face each other within {within:.3e} {m}",
                    model.name, model.contactor, model.target
                );
                let cure = match model.offset {
                    Some(_) => "`offset` is the vector from the contactor to the target in the mesh",
                    None => {
                        "the surfaces must touch in the mesh; `within` sets the distance up to which they are tied, \
                         and periodic sides need `offset`"
                    }
                };
                faults.push(case.error(place, message).hint(cure));
                continue;
            }
            remarks.extend(self.untied(model, &found));
            mesh.ties.extend(found.ties);
        }
        Error::together(faults)?;
        self.join_pieces(case, mesh)?;
        Ok(remarks)
    }

    /// A remark if a part of the contactor has no target.
    fn untied(&self, model: &TieModel, found: &SurfaceTies) -> Option<String> {
        let part = 1.0 - found.area / found.whole;
        if part <= UNTIED {
            return None;
        }
        let mut text = format!(
            "tied '{}': {:.3} % of '{}' has no target within reach and stays free",
            model.name,
            100.0 * part,
            model.contactor
        );
        if model.within.is_none() {
            let _ = write!(text, "; `within` sets the distance up to which points are tied");
        }
        Some(text)
    }

    /// Gives tied pieces one number. Numbers stay without gaps and ascend with the elements. Periodic
    /// sides do not join pieces, because a piece that rotates strains them.
    ///
    /// # Errors
    /// Periodic sides belong to different pieces.
    fn join_pieces(&self, case: &Case, mesh: &mut Mesh<D>) -> Result<()> {
        if mesh.ties.is_empty() {
            return Ok(());
        }
        let count = mesh.piece.iter().max().map_or(0, |last| *last as usize + 1);
        let mut piece_of = vec![u32::MAX; mesh.points.len()];
        for element in 0..mesh.element_count() {
            mesh.element_nodes(element)
                .iter()
                .for_each(|&node| piece_of[node as usize] = mesh.piece[element]);
        }
        let mut sets = DisjointSets::new(count);
        let is_periodic = |tie: &Tie| self.ties[tie.pair as usize].offset.is_some();
        for tie in mesh.ties.iter().filter(|tie| !is_periodic(tie)) {
            let held = tie.nodes.iter().zip(&tie.weights).filter(|(_, weight)| **weight != 0.0);
            let mut pieces = held.map(|(node, _)| piece_of[*node as usize]);
            let Some(first) = pieces.next() else { continue };
            pieces.for_each(|other| {
                sets.join(first, other);
            });
        }
        let labels = sets.labels();
        mesh.piece.iter_mut().for_each(|piece| *piece = labels[*piece as usize]);
        let apart = |tie: &&Tie| {
            let labels = || tie.nodes.iter().map(|node| labels[piece_of[*node as usize] as usize]);
            is_periodic(tie) && labels().any(|label| Some(label) != labels().next())
        };
        let Some(tie) = mesh.ties.iter().find(apart) else { return Ok(()) };
        let model = &self.ties[tie.pair as usize];
        let place = case.tied.get(&model.name).map(|tied| tied.contactor.place).unwrap_or_default();
        let message = format!("tied '{}': the periodic sides are on parts that are not joined", model.name);
        let cure = "join them: one body, or bodies that are tied to each other without `offset`";
        Err(case.error(place, message).hint(cure))
    }
}

/// Mean size of facets \[m\].
fn mean_size<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> f64 {
    let mut nodes = Vec::new();
    let mut size = |&facet: &Facet| {
        mesh.facet_nodes(facet, &mut nodes);
        let corners = &nodes[..mesh.facet_kind(facet).corners()];
        let at = |k: usize| Vector::<D>::from(mesh.points[corners[k % corners.len()] as usize]);
        let edges = if corners.len() == 2 { 1 } else { corners.len() };
        (0..edges).map(|k| (at(k + 1) - at(k)).norm()).sum::<f64>() / edges as f64
    };
    facets.iter().map(&mut size).sum::<f64>() / facets.len().max(1) as f64
}
