//! Estimates the cost of a case on more ranks than this machine has. The parts are counted; nothing
//! is solved.

use std::fmt::Write as _;

use super::couples;
use super::input::surface_file;
use crate::case::Case;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::model::{Model, read_mesh};
use crate::partition::{Halo, Plan, Quality};

const HEADER: &str = "parts,unknowns,elements,element imbalance,node imbalance,assembled elements max,nodes max,ghosts mean,ghosts max,\
    contact ghosts max,neighbours mean,neighbours max,sent nodes max,contact facets,contact imbalance,sides cut,pairs,pairs cut,\
    plain sides cut,plain pairs cut,plain contact imbalance";

/// A table of the case in `D` dimensions, one row for each number of parts: balance, halos and
/// neighbours of the parts, and the result of METIS when it ignores contact (`plain`). Not
/// collective.
///
/// # Errors
/// The case or mesh is invalid, or the mesh can not be partitioned.
pub fn parts<const D: usize>(case: &Case, counts: &[u32]) -> Result<String> {
    case.load_surfaces(surface_file)?;
    let model = Model::<D>::new(case)?;
    let mesh: Mesh<D> = read_mesh(case)?;
    let couples = couples(&model);
    let plan = Plan::for_contact(Some(&mesh), &couples)?;
    let mut meets = vec![false; mesh.points.len()];
    for set in couples.iter().flat_map(|couple| [couple.contactor, couple.target]) {
        let nodes = mesh.set_nodes(set).ok_or_else(|| Error::internal(format!("no set {set}")))?;
        nodes.iter().for_each(|&node| meets[node as usize] = true);
    }
    let mut text = format!("{HEADER}\n");
    for &count in counts {
        let (halo, quality) = Halo::of_plan(&mesh, &plan, &meets, count as usize)?;
        let plain = Quality::of_plain(&mesh, &plan, count as usize)?;
        row(&mut text, mesh.points.len() * D, mesh.element_count(), &halo, [&quality, &plain]);
    }
    Ok(text)
}

fn row(text: &mut String, unknowns: usize, elements: usize, halo: &Halo, [quality, plain]: [&Quality; 2]) {
    let most = |counts: &[u64]| counts.iter().max().copied().unwrap_or(0);
    let mean = |counts: &[u64]| counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    let _ = write!(text, "{},{unknowns},{elements},", halo.owned.len());
    let nodes = most(&halo.owned);
    let _ = write!(text, "{:.4},{:.4},", quality.element_imbalance(), nodes as f64 / mean(&halo.owned));
    let _ = write!(text, "{},{nodes},", most(&halo.assembled));
    let _ = write!(text, "{:.1},{},{},", mean(&halo.ghosts), most(&halo.ghosts), most(&halo.contact_ghosts));
    let _ = write!(text, "{:.2},{},", mean(&halo.neighbours), most(&halo.neighbours));
    let _ = write!(text, "{},{},", most(&halo.sent), quality.contact.iter().sum::<u64>());
    let _ = write!(text, "{:.4},{},", quality.contact_imbalance(), quality.edge_cut);
    let _ = write!(text, "{},{},", quality.pairs, quality.pairs_cut);
    let _ = writeln!(text, "{},{},{:.4}", plain.edge_cut, plain.pairs_cut, plain.contact_imbalance());
}
