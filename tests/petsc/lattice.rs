//! A lattice of nodes joined by springs: the simplest mesh, with rigid-body modes like those of a
//! solid.

use contact_petsc::petsc::{BlockPattern, BlockValues, NO_SLOT, Session, Vector};
use std::ops::Range;
use std::rc::Rc;

/// Unit spacing, `counts` nodes per direction (the last is 1 in 2D), neighbours also along
/// diagonals.
#[derive(Clone, Copy)]
pub struct Lattice {
    pub counts: [usize; 3],
    pub dimension: usize,
    /// Fraction of a non-symmetric part in every spring.
    pub skew: f64,
    /// Nodes with smaller x form one body, the others another. The pattern has entries between
    /// them, but there are no springs. 0 for one body.
    pub cut: usize,
}

impl Lattice {
    pub fn total(&self) -> usize {
        self.counts.iter().product()
    }

    pub fn point(&self, node: usize) -> [f64; 3] {
        let [nx, ny, _] = self.counts;
        [(node % nx) as f64, (node / nx % ny) as f64, (node / nx / ny) as f64]
    }

    /// Nodes of the bottom layer are fixed.
    pub fn held(&self, node: usize) -> bool {
        self.point(node)[self.dimension - 1] == 0.0
    }

    /// The body of a node.
    pub fn body(&self, node: usize) -> usize {
        usize::from(self.cut > 0 && self.point(node)[0] >= self.cut as f64)
    }

    /// The node itself and its neighbours in ascending order.
    pub fn neighbours(&self, node: usize) -> Vec<usize> {
        let here = self.point(node);
        let near = |k: usize| {
            let at = here[k] as usize;
            at.saturating_sub(1)..(at + 2).min(self.counts[k])
        };
        let mut found = Vec::new();
        for z in near(2) {
            for y in near(1) {
                found.extend(near(0).map(|x| (z * self.counts[1] + y) * self.counts[0] + x));
            }
        }
        found
    }

    /// The four blocks aa, ab, ba, bb of the spring between two nodes, row-major, without fixed
    /// rows and columns.
    pub fn spring(&self, a: usize, b: usize) -> Vec<f64> {
        let d = self.dimension;
        let (p, q) = (self.point(a), self.point(b));
        let along: Vec<f64> = (0..d).map(|k| q[k] - p[k]).collect();
        let length2: f64 = along.iter().map(|x| x * x).sum();
        let mut blocks = Vec::new();
        for (row, column) in [(a, a), (a, b), (b, a), (b, b)] {
            let sign = if row == column { 1.0 } else { -1.0 };
            let free = !self.held(row) && !self.held(column) && self.body(a) == self.body(b);
            for i in 0..d {
                for j in 0..d {
                    let value = along[i] * along[j] / length2 + self.skew * along[j] * (1.0 + i as f64);
                    blocks.push(if free { sign * value } else { 0.0 });
                }
            }
        }
        blocks
    }

    /// All springs, each once.
    pub fn springs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.total())
            .flat_map(|a| self.neighbours(a).into_iter().filter(move |&b| b > a).map(move |b| (a, b)))
    }
}

/// A lattice distributed over the ranks in slabs of consecutive nodes.
pub struct Local {
    pub lattice: Lattice,
    pub pattern: Rc<BlockPattern>,
    pub ghosts: Vec<i32>,
}

impl Local {
    /// `shares`: the number of node parts of each rank, which may be zero.
    pub fn new(session: &Session, lattice: Lattice, shares: &[usize]) -> Self {
        let (rank, total) = (session.rank() as usize, lattice.total());
        let parts: usize = shares.iter().sum();
        let bound = |rank: usize| shares[..rank].iter().sum::<usize>() * total / parts;
        let owned = bound(rank)..bound(rank + 1);
        let (mut row_offsets, mut columns) = (vec![0], Vec::new());
        for node in owned.clone() {
            columns.extend(lattice.neighbours(node).into_iter().map(|column| column as i32));
            row_offsets.push(columns.len() as u32);
        }
        let mut ghosts: Vec<i32> =
            columns.iter().copied().filter(|&column| !owned.contains(&(column as usize))).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let first_row = owned.start as i32;
        let places = owned.map(|node| node as u32).collect();
        let pattern = BlockPattern { block_size: lattice.dimension, first_row, row_offsets, columns, places };
        Self { lattice, pattern: Rc::new(pattern), ghosts }
    }

    /// A lattice with another skewness whose nodes are on the same ranks.
    pub fn with_skew(&self, skew: f64) -> Self {
        let lattice = Lattice { skew, ..self.lattice };
        Self { lattice, pattern: Rc::clone(&self.pattern), ghosts: self.ghosts.clone() }
    }

    pub fn owned(&self) -> Range<usize> {
        let owned = self.pattern.owned();
        owned.start as usize..owned.end as usize
    }

    /// Adds every spring that touches an owned node. Fixed nodes get ones on the diagonal.
    pub fn fill(&self, values: &mut BlockValues) {
        let owned = self.owned();
        values.zero();
        for (a, b) in self.lattice.springs().filter(|(a, b)| owned.contains(a) || owned.contains(b)) {
            let slot = |row: usize, column: usize| match owned.contains(&row) {
                true => self
                    .pattern
                    .slot(row - owned.start, column as i32)
                    .expect("neighbours are in the pattern"),
                false => NO_SLOT,
            };
            values.add_blocks(&[slot(a, a), slot(a, b), slot(b, a), slot(b, b)], &self.lattice.spring(a, b));
        }
        let d = self.lattice.dimension;
        for node in owned.clone().filter(|&node| self.lattice.held(node)) {
            (0..d).for_each(|k| values.add_diagonal((node - owned.start) * d + k, 1.0));
        }
    }

    /// The reference matrix, dense and whole, assembled without the code under test.
    pub fn dense(&self) -> Vec<Vec<f64>> {
        let d = self.lattice.dimension;
        let size = self.lattice.total() * d;
        let mut dense = vec![vec![0.0; size]; size];
        for (a, b) in self.lattice.springs() {
            let blocks = self.lattice.spring(a, b);
            for (block, (row, column)) in blocks.chunks(d * d).zip([(a, a), (a, b), (b, a), (b, b)]) {
                for k in 0..d * d {
                    dense[row * d + k / d][column * d + k % d] += block[k];
                }
            }
        }
        for dof in (0..size).filter(|dof| self.lattice.held(dof / d)) {
            dense[dof][dof] += 1.0;
        }
        dense
    }

    /// A vector whose owned values are a function of the global number of the unknown.
    pub fn vector(&self, session: &Rc<Session>, value: impl Fn(usize) -> f64) -> Vector {
        let d = self.lattice.dimension;
        let mut vector = Vector::ghosted(session, self.owned().len(), d, &self.ghosts).expect("a vector");
        let first = self.owned().start * d;
        vector.owned_mut().iter_mut().enumerate().for_each(|(i, slot)| *slot = value(first + i));
        vector
    }

    /// Positions of the owned nodes.
    pub fn coordinates(&self, session: &Rc<Session>) -> Vector {
        let d = self.lattice.dimension;
        self.vector(session, |dof| self.lattice.point(dof / d)[dof % d])
    }
}
