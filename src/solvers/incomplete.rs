//! Incomplete LU factors without fill, ILU(0), of a matrix of D by D blocks.
//!
//! `(1 + L) D (1 + U)` agrees with the matrix wherever that has a block. Both triangles are stored
//! in the order in which the solves traverse them. They are scaled so that only one block product
//! leads from one unknown to the next. These dependency chains, not the number of products,
//! determine the time of a solve.

/// A block in column order: `block[j][i]` with `i` the row.
pub(super) type Block<const D: usize> = [[f64; D]; D];

/// Block pattern of the matrix. Row `i` has the columns `columns[offsets[i]..offsets[i + 1]]`, in
/// ascending order and including `i`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Rows {
    pub offsets: Vec<u32>,
    pub columns: Vec<u32>,
}

/// One triangle, with rows in the order of its solve. In each row, the unknown that was solved last
/// comes last.
#[derive(Debug, Clone, Default)]
struct Triangle<const D: usize> {
    ends: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Block<D>>,
}

/// The factors.
#[derive(Debug, Clone)]
pub(super) struct Incomplete<const D: usize> {
    lower: Triangle<D>,
    /// Rows and their columns are in descending order.
    upper: Triangle<D>,
    /// Inverses of the blocks of D.
    inverses: Vec<Block<D>>,
    /// Pattern of the matrix, and the position in `work` of each column of the row that is
    /// eliminated.
    rows: Rows,
    places: Vec<u32>,
    work: Vec<Block<D>>,
}

/// Marks a missing position.
const NOWHERE: u32 = u32::MAX;

/// Replacement for a pivot that is exactly zero, as in PETSc.
const TINY: f64 = 100.0 * f64::EPSILON;

impl Rows {
    /// Number of rows.
    pub fn count(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.offsets[row] as usize..self.offsets[row + 1] as usize
    }
}

impl<const D: usize> Triangle<D> {
    /// Creates a triangle with the columns of each row, in the order of the solve. The blocks are
    /// still zero.
    fn new<'a>(rows: impl Iterator<Item = &'a [u32]>, descending: bool) -> Self {
        let mut triangle = Self::default();
        for row in rows {
            triangle.columns.extend_from_slice(row);
            if descending {
                let start = triangle.columns.len() - row.len();
                triangle.columns[start..].reverse();
            }
            triangle.ends.push(triangle.columns.len() as u32);
        }
        triangle.blocks = vec![[[0.0; D]; D]; triangle.columns.len()];
        triangle
    }

    /// Blocks of the row at position `at` of the solve.
    fn row(&self, at: usize) -> std::ops::Range<usize> {
        at.checked_sub(1).map_or(0, |before| self.ends[before] as usize)..self.ends[at] as usize
    }
}

impl<const D: usize> Incomplete<D> {
    /// Creates factors of a matrix with such rows, to be [filled](Self::factorise).
    pub fn new(rows: Rows) -> Self {
        let count = rows.count();
        let part = |row: usize, above: bool| {
            let columns = &rows.columns[rows.range(row)];
            let diagonal = columns.partition_point(|&column| (column as usize) < row);
            if above { columns.get(diagonal + 1..).unwrap_or_default() } else { &columns[..diagonal] }
        };
        let lower = Triangle::new((0..count).map(|row| part(row, false)), false);
        let upper = Triangle::new((0..count).rev().map(|row| part(row, true)), true);
        let inverses = vec![[[0.0; D]; D]; count];
        let places = vec![NOWHERE; count];
        Self { lower, upper, inverses, rows, places, work: Vec::new() }
    }

    /// Factorises the matrix with the blocks `block(k)`, `k` as in [`Rows::columns`].
    pub fn factorise(&mut self, block: impl Fn(usize) -> Block<D>) {
        let count = self.rows.count();
        for row in 0..count {
            let range = self.rows.range(row);
            let columns = &self.rows.columns[range.clone()];
            self.work.clear();
            self.work.extend(range.map(&block));
            (0..).zip(columns).for_each(|(at, &column)| self.places[column as usize] = at);
            let below = self.lower.row(row);
            for (at, to) in below.clone().enumerate() {
                let factor = self.work[at];
                let pivot = columns[at] as usize;
                for k in self.upper.row(count - 1 - pivot) {
                    let place = self.places[self.upper.columns[k] as usize];
                    if place != NOWHERE {
                        subtract(&mut self.work[place as usize], &factor, &self.upper.blocks[k]);
                    }
                }
                self.lower.blocks[to] = product(&factor, &self.inverses[pivot]);
            }
            let inverse = inverse(self.work[below.len()]);
            self.inverses[row] = inverse;
            let above = self.upper.row(count - 1 - row);
            for (to, from) in above.zip(self.work[below.len() + 1..].iter().rev()) {
                self.upper.blocks[to] = product(&inverse, from);
            }
            columns.iter().for_each(|&column| self.places[column as usize] = NOWHERE);
        }
    }

    /// Solves with the factors. `x` is the right side on entry and the solution on return.
    pub fn solve(&self, x: &mut [[f64; D]]) {
        let mut start = 0;
        for (row, &end) in self.lower.ends.iter().enumerate() {
            x[row] = self.lower.less(x[row], start..end as usize, x);
            start = end as usize;
        }
        start = 0;
        for (row, &end) in (0..x.len()).rev().zip(&self.upper.ends) {
            let scaled = times(&self.inverses[row], &x[row]);
            x[row] = self.upper.less(scaled, start..end as usize, x);
            start = end as usize;
        }
    }
}

impl<const D: usize> Triangle<D> {
    /// `value` minus the products of a row's blocks with their unknowns.
    #[inline(always)]
    fn less(&self, value: [f64; D], row: std::ops::Range<usize>, x: &[[f64; D]]) -> [f64; D] {
        let mut value = value;
        for (block, &column) in self.blocks[row.clone()].iter().zip(&self.columns[row]) {
            let factor = &x[column as usize];
            for j in 0..D {
                for i in 0..D {
                    value[i] -= block[j][i] * factor[j];
                }
            }
        }
        value
    }
}

/// `a x`.
#[inline(always)]
fn times<const D: usize>(a: &Block<D>, x: &[f64; D]) -> [f64; D] {
    let mut out = [0.0; D];
    for j in 0..D {
        for i in 0..D {
            out[i] += a[j][i] * x[j];
        }
    }
    out
}

/// `a b`.
#[inline(always)]
fn product<const D: usize>(a: &Block<D>, b: &Block<D>) -> Block<D> {
    std::array::from_fn(|j| times(a, &b[j]))
}

/// `from -= a b`.
#[inline(always)]
fn subtract<const D: usize>(from: &mut Block<D>, a: &Block<D>, b: &Block<D>) {
    for j in 0..D {
        for k in 0..D {
            for i in 0..D {
                from[j][i] -= a[k][i] * b[j][k];
            }
        }
    }
}

/// Inverts a block by elimination with the largest pivot of each column. A zero pivot is replaced
/// by a tiny one.
fn inverse<const D: usize>(block: Block<D>) -> Block<D> {
    // Rows of the transpose are the columns, and the inverse of the transpose is the transpose of
    // the inverse.
    let mut a = block;
    let mut out = [[0.0; D]; D];
    (0..D).for_each(|i| out[i][i] = 1.0);
    for k in 0..D {
        let largest = (k..D).fold(k, |best, i| if a[i][k].abs() > a[best][k].abs() { i } else { best });
        a.swap(k, largest);
        out.swap(k, largest);
        let pivot = if a[k][k] == 0.0 { TINY } else { a[k][k] };
        for j in 0..D {
            a[k][j] /= pivot;
            out[k][j] /= pivot;
        }
        for i in (0..D).filter(|&i| i != k) {
            let factor = a[i][k];
            for j in 0..D {
                a[i][j] -= factor * a[k][j];
                out[i][j] -= factor * out[k][j];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix of blocks on a lattice of `n` by `n` nodes, each coupled with the eight around it.
    /// Rows have different sizes.
    fn lattice<const D: usize>(n: i32) -> (Rows, Vec<Block<D>>) {
        let mut rows = Rows { offsets: vec![0], columns: vec![] };
        let mut blocks = vec![];
        for node in 0..n * n {
            for (x, y) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (node % n + dx, node / n + dy))) {
                if !(0..n).contains(&x) || !(0..n).contains(&y) {
                    continue;
                }
                let other = x + n * y;
                rows.columns.push(other as u32);
                blocks.push(std::array::from_fn(|j| {
                    std::array::from_fn(|i| {
                        let noise = f64::from((node * 7 + other * 13 + (3 * i + j) as i32) % 11) / 11.0 - 0.4;
                        // The largest entry of a column of a diagonal block is not the diagonal
                        // one.
                        noise + if node == other && (i + 1) % D == j { 12.0 } else { 0.0 }
                    })
                }));
            }
            rows.offsets.push(rows.columns.len() as u32);
        }
        (rows, blocks)
    }

    fn multiply<const D: usize>(rows: &Rows, blocks: &[Block<D>], x: &[[f64; D]]) -> Vec<[f64; D]> {
        let row = |row: usize| {
            rows.range(row).fold([0.0; D], |sum, k| {
                let part = times(&blocks[k], &x[rows.columns[k] as usize]);
                std::array::from_fn(|i| sum[i] + part[i])
            })
        };
        (0..rows.count()).map(row).collect()
    }

    /// The matrix that the factors represent, `(1 + L) D (1 + U)`, at the block of a row and a
    /// column.
    fn restored<const D: usize>(factors: &Incomplete<D>, row: usize, column: usize) -> Block<D> {
        let count = factors.rows.count();
        let find = |triangle: &Triangle<D>, at: usize, column: usize| {
            triangle.row(at).find(|&k| triangle.columns[k] as usize == column).map(|k| triangle.blocks[k])
        };
        let one: Block<D> = std::array::from_fn(|j| std::array::from_fn(|i| f64::from(u8::from(i == j))));
        let mut sum = [[0.0; D]; D];
        for k in 0..=row.min(column) {
            let left = if k == row { Some(one) } else { find(&factors.lower, row, k) };
            let right = if k == column { Some(one) } else { find(&factors.upper, count - 1 - k, column) };
            if let (Some(left), Some(right)) = (left, right) {
                let term = product(&product(&left, &inverse(factors.inverses[k])), &right);
                (0..D).for_each(|j| (0..D).for_each(|i| sum[j][i] += term[j][i]));
            }
        }
        sum
    }

    fn agrees_on_the_pattern<const D: usize>() {
        let (rows, blocks) = lattice::<D>(5);
        let mut factors = Incomplete::new(rows.clone());
        // The second factorisation must not depend on the first.
        factors.factorise(|k| std::array::from_fn(|j| blocks[k][(j + 1) % D]));
        factors.factorise(|k| blocks[k]);
        for row in 0..rows.count() {
            for k in rows.range(row) {
                let found = restored(&factors, row, rows.columns[k] as usize);
                let apart = found.as_flattened().iter().zip(blocks[k].as_flattened());
                let apart = apart.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
                assert!(apart < 1e-12, "{D}: {row} {}: {apart:.1e}", rows.columns[k]);
            }
        }
    }

    /// Definition of ILU(0): the product of the factors equals the matrix wherever that has a
    /// block, for blocks of any size.
    #[test]
    fn factors_agree_with_the_matrix_on_its_pattern() {
        agrees_on_the_pattern::<1>();
        agrees_on_the_pattern::<2>();
        agrees_on_the_pattern::<3>();
    }

    /// If nothing is dropped, as in a chain, the solve is exact.
    #[test]
    fn solves_a_chain_exactly() {
        let count = 40_u32;
        let mut rows = Rows { offsets: vec![0], columns: vec![] };
        for row in 0..count {
            rows.columns.extend(row.saturating_sub(1)..(row + 2).min(count));
            rows.offsets.push(rows.columns.len() as u32);
        }
        let entry = |k: usize, i: usize, j: usize| ((k * 17 + 5 * i + j) % 7) as f64 - 3.0;
        let diagonal = |k: usize| {
            (0..count as usize)
                .any(|row| rows.range(row).any(|at| at == k && rows.columns[at] as usize == row))
        };
        let blocks: Vec<Block<3>> = (0..rows.columns.len())
            .map(|k| {
                let heavy = if diagonal(k) { 20.0 } else { 0.0 };
                std::array::from_fn(|j| {
                    std::array::from_fn(|i| entry(k, i, j) + if i == j { heavy } else { 0.0 })
                })
            })
            .collect();
        let expected: Vec<[f64; 3]> = (0..count).map(|row| [1.0, f64::from(row).sin(), -2.0]).collect();
        let mut x = multiply(&rows, &blocks, &expected);
        let mut factors = Incomplete::new(rows.clone());
        factors.factorise(|k| blocks[k]);
        factors.solve(&mut x);
        let apart = x.as_flattened().iter().zip(expected.as_flattened());
        let apart = apart.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(apart < 1e-12, "{apart:.1e}");
    }

    /// A singular block gives large numbers, not a panic. A matrix without rows is accepted.
    #[test]
    fn takes_any_matrix() {
        let rows = Rows { offsets: vec![0, 1, 2], columns: vec![0, 1] };
        let mut factors = Incomplete::<2>::new(rows);
        factors.factorise(|k| if k == 0 { [[1.0, 1.0]; 2] } else { [[f64::NAN; 2]; 2] });
        let mut x = [[1.0, 2.0], [1.0, 1.0]];
        factors.solve(&mut x);
        assert!(
            x[0].iter().all(|value| value.abs() > 1e6) && x[1].iter().all(|value| value.is_nan()),
            "{x:?}"
        );
        let mut none = Incomplete::<2>::new(Rows { offsets: vec![0], columns: vec![] });
        none.factorise(|_| [[0.0; 2]; 2]);
        none.solve(&mut []);
    }
}
