//! Balance of the distributed mesh.

use std::fmt;

use crate::collective::Collective;
use mpi::traits::{CommunicatorCollectives, Root};

use super::quality::imbalance;
use super::{LocalMesh, Quality};

/// Share of each rank, the same on all ranks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// Elements that belong to each rank.
    pub elements: Vec<u64>,
    /// Elements that each rank assembles: its own and those that it shares with others.
    pub assembled: Vec<u64>,
    /// Nodes that each rank owns.
    pub owned: Vec<u64>,
    /// Ghost nodes of each rank.
    pub ghosts: Vec<u64>,
    /// Sides between elements of different ranks.
    pub edge_cut: i64,
    /// Contactor facets of each rank's elements, if they are a load to balance.
    pub contact: Vec<u64>,
    /// Pairs of elements that are tied because they may touch.
    pub pairs: u64,
    /// Pairs whose elements belong to different ranks.
    pub pairs_cut: u64,
}

impl Report {
    /// Collects the report. Collective. `quality` is used on rank 0 only.
    pub(super) fn gather<const D: usize>(
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        quality: &Quality,
    ) -> Self {
        let mut told = vec![quality.edge_cut as u64, quality.pairs, quality.pairs_cut];
        told.extend(&quality.contact);
        told.resize(3 + world.size() as usize, 0);
        world.process_at_rank(0).broadcast_into(&mut told[..]);
        let own = local.mine.iter().filter(|&&mine| mine).count();
        let counts = [own, local.assembled, local.index.owned, local.index.ghosts.len()].map(|n| n as u64);
        let mut all = vec![0; counts.len() * world.size() as usize];
        world.gather_all(&counts[..], &mut all[..]);
        let column = |k| all.iter().skip(k).step_by(counts.len()).copied().collect();
        Self {
            elements: column(0),
            assembled: column(1),
            owned: column(2),
            ghosts: column(3),
            edge_cut: told[0] as i64,
            contact: told[3..].to_vec(),
            pairs: told[1],
            pairs_cut: told[2],
        }
    }

    /// Largest number of nodes of a rank divided by the mean; 1 is perfect.
    pub fn imbalance(&self) -> f64 {
        imbalance(&self.owned)
    }

    /// Largest number of elements of a rank divided by the mean; 1 is perfect.
    pub fn element_imbalance(&self) -> f64 {
        imbalance(&self.elements)
    }

    /// Largest number of contactor facets of a rank divided by the mean; 1 is perfect.
    pub fn contact_imbalance(&self) -> f64 {
        imbalance(&self.contact)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let span = |values: &[u64]| {
            let (low, high) = values.iter().fold((u64::MAX, 0), |(l, h), &v| (l.min(v), h.max(v)));
            if low == high { format!("{low}") } else { format!("{low} to {high}") }
        };
        write!(
            f,
            "each of {} ranks: {} elements, {} nodes and {} ghosts; imbalance {:.1} %, {} sides cut",
            self.owned.len(),
            span(&self.elements),
            span(&self.owned),
            span(&self.ghosts),
            100.0 * (self.imbalance() - 1.0),
            self.edge_cut
        )?;
        if self.pairs > 0 {
            let uneven = 100.0 * (self.contact_imbalance() - 1.0);
            let (cut, pairs) = (self.pairs_cut, self.pairs);
            write!(f, "; contact: imbalance {uneven:.1} %, {cut} of {pairs} pairs across ranks")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The report gives the imbalance of the largest rank, also for an empty mesh.
    #[test]
    fn imbalance_is_that_of_the_fullest_rank() {
        let report = |owned: &[u64]| Report {
            elements: vec![2; owned.len()],
            assembled: vec![2; owned.len()],
            owned: owned.to_vec(),
            ghosts: vec![1; owned.len()],
            edge_cut: 3,
            contact: vec![],
            pairs: 0,
            pairs_cut: 0,
        };
        assert_eq!(report(&[6, 4, 2]).imbalance(), 1.5);
        assert_eq!(report(&[0, 0]).imbalance(), 1.0);
        let text = report(&[6, 4, 2]).to_string();
        assert_eq!(
            text,
            "each of 3 ranks: 2 elements, 2 to 6 nodes and 1 ghosts; imbalance 50.0 %, 3 sides cut"
        );
        let tied = Report { contact: vec![3, 1], pairs: 9, pairs_cut: 2, ..report(&[1, 1]) }.to_string();
        assert!(
            tied.ends_with("3 sides cut; contact: imbalance 50.0 %, 2 of 9 pairs across ranks"),
            "{tied}"
        );
    }
}
