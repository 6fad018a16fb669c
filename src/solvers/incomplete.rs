//! Incomplete LU factors without fill, ILU(0), of a matrix of D by D blocks.
//!
//! `(1 + L) D (1 + U)` agrees with the matrix wherever that has a block. Both triangles are stored
//! in the order in which the solves traverse them. They are scaled so that only one block product
//! leads from one unknown to the next.
//!
//! A solve reads the triangles once, so its time is that of the memory traffic. The triangles are
//! therefore stored in single precision. Their entries are ratios of entries of the matrix and thus
//! do not depend on its units. Pivots keep double precision for two reasons: they have the
//! units of the matrix, and a stiff direction of a node would vanish in the rounding of a soft one.
//! The arithmetic is in double precision, so that the preconditioner is linear to double precision.
//! Otherwise a Krylov method would not reach small residuals.

use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};

/// A block in column order: `block[j][i]` with `i` the row.
pub type Block<const D: usize> = [[f64; D]; D];

/// A block as lanes: the rows of each column, and padding.
type Columns<const D: usize> = [[f64; WIDTH]; D];

/// Block pattern of the matrix. Row `i` has the columns `columns[offsets[i]..offsets[i + 1]]`, in
/// ascending order and including `i`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FactorPattern {
    /// Start of each row in `columns`, and the end of the last one.
    pub offsets: Vec<u32>,
    /// Columns of all rows.
    pub columns: Vec<u32>,
}

/// One triangle, with rows in the order of its solve. In each row, the unknown that was solved last
/// comes last.
#[derive(Debug, Clone, Default)]
struct Triangle<const D: usize> {
    ends: Vec<u32>,
    columns: Vec<u32>,
    /// Blocks in column order.
    values: Vec<f32>,
}

/// The factors.
#[derive(Debug, Clone)]
pub struct Incomplete<const D: usize> {
    lower: Triangle<D>,
    /// Rows and their columns are in descending order.
    upper: Triangle<D>,
    /// Inverses of the blocks of D.
    inverses: Vec<Block<D>>,
}

/// Marks a missing position.
const NOWHERE: u32 = u32::MAX;

/// Distance in values between a block that is multiplied and one that is fetched from memory.
///
/// A solve with blocks of 3 on a lattice of 44^3 nodes took 8.4 ms without this, 7.1 with 256, 6.4
/// with 512 and 6.9 with 1024 (`benches/traffic.rs`).
const AHEAD: usize = 512;

/// Replacement for a pivot that is exactly zero, as in PETSc.
const TINY: f64 = 100.0 * f64::EPSILON;

impl FactorPattern {
    /// Number of rows.
    pub fn count(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.offsets[row] as usize..self.offsets[row + 1] as usize
    }
}

impl<const D: usize> Triangle<D> {
    /// Number of values of a block.
    const SIZE: usize = D * D;
    /// Number of columns that are multiplied together.
    const TOGETHER: usize = if D == 2 { 2 } else { 1 };

    /// Creates a triangle with the columns of each row, in the order of the solve. The blocks are
    /// still zero.
    fn new<'a>(rows: impl Iterator<Item = &'a [u32]> + Clone, descending: bool) -> Self {
        let blocks = rows.clone().map(<[u32]>::len).sum();
        let mut triangle = Self {
            ends: Vec::new(),
            columns: Vec::with_capacity(blocks),
            values: vec![0.0; blocks * Self::SIZE],
        };
        for row in rows {
            triangle.columns.extend_from_slice(row);
            if descending {
                let start = triangle.columns.len() - row.len();
                triangle.columns[start..].reverse();
            }
            triangle.ends.push(triangle.columns.len() as u32);
        }
        triangle
    }

    /// Blocks of the row at position `at` of the solve.
    fn row(&self, at: usize) -> std::ops::Range<usize> {
        at.checked_sub(1).map_or(0, |before| self.ends[before] as usize)..self.ends[at] as usize
    }

    /// Stores a block, rounded.
    #[inline(always)]
    fn store(&mut self, at: usize, block: &Columns<D>) {
        let values = &mut self.values[at * Self::SIZE..][..Self::SIZE];
        for j in 0..D {
            for i in 0..D {
                values[j * D + i] = block[j][i] as f32;
            }
        }
    }

    /// `value` minus the products of a row's blocks with their unknowns.
    #[inline(always)]
    fn less<L: Lane>(
        &self,
        unit: L,
        value: [f64; D],
        row: std::ops::Range<usize>,
        x: &[[f64; D]],
    ) -> [f64; D] {
        // One sum for each group of columns: the sums are independent of each other. Explicit loops: iterators
        // and closures of the standard library may be compiled without the lane instructions.
        let mut sums = [unit.scale(0.0); D];
        unit.prefetch(&self.columns, row.start + AHEAD / Self::SIZE);
        for at in row {
            let block = &self.values[at * Self::SIZE..][..Self::SIZE];
            unit.prefetch(block, AHEAD);
            let factor = &x[self.columns[at] as usize];
            let mut j = 0;
            while j < D {
                let start = Self::lanes_of(j);
                let values = match block[start..].first_chunk::<WIDTH>() {
                    Some(values) => unit.load_single(*values),
                    None => unit.load(followed_by_zeros(block)),
                };
                let factors = match Self::TOGETHER {
                    1 => unit.constant(factor[j]),
                    _ => unit.load([factor[j], factor[j], factor[D - 1], factor[D - 1]]),
                };
                sums[j] = values.mul_add(factors, sums[j]);
                j += Self::TOGETHER;
            }
        }
        let mut value = value;
        let mut j = 0;
        while j < D {
            let sum = sums[j].lanes();
            for column in j..j + Self::TOGETHER {
                for i in 0..D {
                    value[i] -= sum[column * D + i - Self::lanes_of(j)];
                }
            }
            j += Self::TOGETHER;
        }
        value
    }

    /// First of the values of a block that are read as lanes for column `j`. Lanes that would end
    /// behind the block begin in the column before.
    #[inline(always)]
    const fn lanes_of(j: usize) -> usize {
        let last = Self::SIZE.saturating_sub(WIDTH);
        if j * D < last { j * D } else { last }
    }
}

impl<const D: usize> Incomplete<D> {
    /// Creates factors of a matrix with such rows, to be [filled](Self::factorise).
    pub fn new(rows: &FactorPattern) -> Self {
        let count = rows.count();
        let part = |row: usize, above: bool| {
            let columns = &rows.columns[rows.range(row)];
            let diagonal = columns.partition_point(|&column| (column as usize) < row);
            if above { columns.get(diagonal + 1..).unwrap_or_default() } else { &columns[..diagonal] }
        };
        let lower = Triangle::new((0..count).map(|row| part(row, false)), false);
        let upper = Triangle::new((0..count).rev().map(|row| part(row, true)), true);
        Self { lower, upper, inverses: vec![[[0.0; D]; D]; count] }
    }

    /// Factorises the matrix with the blocks `block(k)`, `k` as in [`FactorPattern::columns`] of the rows
    /// for which the factors were created.
    pub fn factorise(&mut self, block: impl Fn(usize) -> Block<D>) {
        dispatch(Factorise { factors: self, block });
    }

    /// Solves with the factors. `x` is the right side on entry and the solution on return.
    pub fn solve(&self, x: &mut [[f64; D]]) {
        dispatch(Solve { factors: self, x });
    }
}

struct Solve<'a, const D: usize> {
    factors: &'a Incomplete<D>,
    x: &'a mut [[f64; D]],
}

impl<const D: usize> LaneTask for Solve<'_, D> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { factors: Incomplete { lower, upper, inverses }, x } = self;
        let mut start = 0;
        for (row, &end) in lower.ends.iter().enumerate() {
            x[row] = lower.less(unit, x[row], start..end as usize, x);
            start = end as usize;
        }
        start = 0;
        for (row, &end) in (0..x.len()).rev().zip(&upper.ends) {
            let scaled = times(&inverses[row], &x[row]);
            x[row] = upper.less(unit, scaled, start..end as usize, x);
            start = end as usize;
        }
    }
}

struct Factorise<'a, F, const D: usize> {
    factors: &'a mut Incomplete<D>,
    block: F,
}

impl<F: Fn(usize) -> Block<D>, const D: usize> LaneTask for Factorise<'_, F, D> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { factors: Incomplete { lower, upper, inverses }, block } = self;
        let count = inverses.len();
        // Position in `work` of each column of the row that is eliminated.
        let mut places = vec![NOWHERE; count];
        let mut work: Vec<Columns<D>> = Vec::new();
        let mut first = 0;
        for row in 0..count {
            let below = lower.row(row);
            let above = upper.row(count - 1 - row);
            let (less, more) = (below.len(), above.len());
            work.clear();
            work.extend((first..first + less + 1 + more).map(|k| padded(&block(k))));
            first += work.len();
            (0..).zip(&lower.columns[below.clone()]).for_each(|(at, &column)| places[column as usize] = at);
            places[row] = less as u32;
            (less as u32 + 1..)
                .zip(upper.columns[above.clone()].iter().rev())
                .for_each(|(at, &column)| places[column as usize] = at);
            for (at, to) in below.clone().enumerate() {
                let mut factor = [unit; D];
                for (lanes, column) in factor.iter_mut().zip(&work[at]) {
                    *lanes = unit.load(*column);
                }
                let pivot = lower.columns[to] as usize;
                for k in upper.row(count - 1 - pivot) {
                    let place = places[upper.columns[k] as usize];
                    if place != NOWHERE {
                        subtract(&mut work[place as usize], &factor, &upper.values[k * D * D..][..D * D]);
                    }
                }
                lower.store(to, &product(unit, &work[at], &inverses[pivot]));
            }
            inverses[row] = inverse(unpadded(&work[less]));
            let inverse = padded(&inverses[row]);
            for (to, from) in above.clone().zip(work[less + 1..].iter().rev()) {
                upper.store(to, &product(unit, &inverse, &unpadded(from)));
            }
            let columns = lower.columns[below].iter().chain(&upper.columns[above]);
            columns.for_each(|&column| places[column as usize] = NOWHERE);
            places[row] = NOWHERE;
        }
    }
}

/// A block that does not fill the lanes.
#[inline(always)]
fn followed_by_zeros(block: &[f32]) -> [f64; WIDTH] {
    let mut values = [0.0; WIDTH];
    for (value, entry) in values.iter_mut().zip(block) {
        *value = f64::from(*entry);
    }
    values
}

/// A block as lanes.
#[inline(always)]
fn padded<const D: usize>(block: &Block<D>) -> Columns<D> {
    std::array::from_fn(|j| std::array::from_fn(|i| if i < D { block[j][i] } else { 0.0 }))
}

/// The block in such lanes.
#[inline(always)]
fn unpadded<const D: usize>(block: &Columns<D>) -> Block<D> {
    std::array::from_fn(|j| std::array::from_fn(|i| block[j][i]))
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
fn product<L: Lane, const D: usize>(unit: L, a: &Columns<D>, b: &Block<D>) -> Columns<D> {
    // Explicit loops: closures passed to the standard library may be compiled without the lane instructions.
    let mut out = [[0.0; WIDTH]; D];
    for j in 0..D {
        let mut sum = unit.scale(0.0);
        for k in 0..D {
            sum = unit.load(a[k]).mul_add(unit.constant(b[j][k]), sum);
        }
        out[j] = sum.lanes();
    }
    out
}

/// `from -= a b`.
#[inline(always)]
fn subtract<L: Lane, const D: usize>(from: &mut Columns<D>, a: &[L; D], b: &[f32]) {
    for j in 0..D {
        let mut sum = a[0].load(from[j]);
        for k in 0..D {
            sum = a[k].mul_add(a[k].constant(-f64::from(b[j * D + k])), sum);
        }
        from[j] = sum.lanes();
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
    use crate::lanes::dispatch_portable;

    /// A matrix of blocks on a lattice of `n` by `n` nodes, each coupled with the eight around it.
    /// Rows have different sizes.
    fn lattice<const D: usize>(n: i32) -> (FactorPattern, Vec<Block<D>>) {
        let mut rows = FactorPattern { offsets: vec![0], columns: vec![] };
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

    fn multiply<const D: usize>(rows: &FactorPattern, blocks: &[Block<D>], x: &[[f64; D]]) -> Vec<[f64; D]> {
        let row = |row: usize| {
            rows.range(row).fold([0.0; D], |sum, k| {
                let part = times(&blocks[k], &x[rows.columns[k] as usize]);
                std::array::from_fn(|i| sum[i] + part[i])
            })
        };
        (0..rows.count()).map(row).collect()
    }

    /// `a b`.
    fn product<const D: usize>(a: &Block<D>, b: &Block<D>) -> Block<D> {
        std::array::from_fn(|j| times(a, &b[j]))
    }

    /// The matrix that the factors represent, `(1 + L) D (1 + U)`, at the block of a row and a
    /// column.
    fn restored<const D: usize>(factors: &Incomplete<D>, row: usize, column: usize) -> Block<D> {
        let count = factors.inverses.len();
        let find = |triangle: &Triangle<D>, at: usize, column: usize| {
            let k = triangle.row(at).find(|&k| triangle.columns[k] as usize == column)?;
            let value = |j: usize, i: usize| f64::from(triangle.values[(k * D + j) * D + i]);
            Some(std::array::from_fn(|j| std::array::from_fn(|i| value(j, i))))
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
        let mut factors = Incomplete::new(&rows);
        // The second factorisation must not depend on the first.
        factors.factorise(|k| std::array::from_fn(|j| blocks[k][(j + 1) % D]));
        factors.factorise(|k| blocks[k]);
        for row in 0..rows.count() {
            for k in rows.range(row) {
                let found = restored(&factors, row, rows.columns[k] as usize);
                let apart = found.as_flattened().iter().zip(blocks[k].as_flattened());
                let apart = apart.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
                assert!(apart < 3e-6, "{D}: {row} {}: {apart:.1e}", rows.columns[k]);
            }
        }
    }

    /// Definition of ILU(0): the product of the factors equals the matrix wherever that has a
    /// block, to single precision and for blocks of any size.
    #[test]
    fn factors_agree_with_the_matrix_on_its_pattern() {
        agrees_on_the_pattern::<1>();
        agrees_on_the_pattern::<2>();
        agrees_on_the_pattern::<3>();
    }

    /// If nothing is dropped, as in a chain, the solve is exact to single precision.
    #[test]
    fn solves_a_chain_exactly() {
        solves_a_chain::<1>();
        solves_a_chain::<2>();
        solves_a_chain::<3>();
    }

    fn solves_a_chain<const D: usize>() {
        let count = 40_u32;
        let mut rows = FactorPattern { offsets: vec![0], columns: vec![] };
        for row in 0..count {
            rows.columns.extend(row.saturating_sub(1)..(row + 2).min(count));
            rows.offsets.push(rows.columns.len() as u32);
        }
        let entry = |k: usize, i: usize, j: usize| ((k * 17 + 5 * i + j) % 7) as f64 - 3.0;
        let diagonal = |k: usize| {
            (0..count as usize)
                .any(|row| rows.range(row).any(|at| at == k && rows.columns[at] as usize == row))
        };
        let blocks: Vec<Block<D>> = (0..rows.columns.len())
            .map(|k| {
                let heavy = if diagonal(k) { 20.0 } else { 0.0 };
                std::array::from_fn(|j| {
                    std::array::from_fn(|i| entry(k, i, j) + if i == j { heavy } else { 0.0 })
                })
            })
            .collect();
        let value = |row: u32, i: usize| [f64::from(row).sin(), 1.0, -2.0][i];
        let expected: Vec<[f64; D]> = (0..count).map(|row| std::array::from_fn(|i| value(row, i))).collect();
        let mut x = multiply(&rows, &blocks, &expected);
        let mut factors = Incomplete::new(&rows);
        factors.factorise(|k| blocks[k]);
        factors.solve(&mut x);
        let apart = x.as_flattened().iter().zip(expected.as_flattened());
        let apart = apart.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(apart < 1e-6, "{D}: {apart:.1e}");
    }

    fn solution<const D: usize>(factors: &Incomplete<D>, rhs: impl Fn(usize) -> [f64; D]) -> Vec<[f64; D]> {
        let mut x: Vec<[f64; D]> = (0..factors.inverses.len()).map(rhs).collect();
        factors.solve(&mut x);
        x
    }

    /// The range of single precision does not limit the units: a matrix with entries of 1e-60 or
    /// 1e60 has the solution of one with entries of 1, scaled, to the bit.
    #[test]
    fn units_do_not_matter() {
        let (rows, blocks) = lattice::<3>(6);
        let rhs = |row: usize| [1.0, row as f64, -2.0];
        let [plain, tiny, huge] = [0, -200, 200].map(|power| {
            let scale = 2.0_f64.powi(power);
            let mut factors = Incomplete::<3>::new(&rows);
            factors.factorise(|k| blocks[k].map(|column| column.map(|value| value * scale)));
            solution(&factors, rhs).into_iter().map(|x| x.map(|x| x * scale)).collect::<Vec<_>>()
        });
        assert!(plain.as_flattened().iter().all(|x| x.is_finite()));
        assert!(plain == tiny && plain == huge);
    }

    /// A solve is linear to double precision, although the factors are rounded to single. Krylov
    /// methods need this to reach residuals below single precision.
    #[test]
    fn solves_are_linear_to_double_precision() {
        let (rows, blocks) = lattice::<3>(6);
        let mut factors = Incomplete::<3>::new(&rows);
        factors.factorise(|k| blocks[k]);
        let wave = |row: usize, f: f64| [1, 2, 3].map(|i| (f * row as f64 + f64::from(i)).sin());
        let first = solution(&factors, |row| wave(row, 0.7));
        let second = solution(&factors, |row| wave(row, 1.9));
        let sum = solution(&factors, |row| {
            std::array::from_fn(|i| wave(row, 0.7)[i] / 3.0 - 0.3 * wave(row, 1.9)[i])
        });
        let parts = first.as_flattened().iter().zip(second.as_flattened());
        for (sum, (first, second)) in sum.as_flattened().iter().zip(parts) {
            let expected = first / 3.0 - 0.3 * second;
            assert!((sum - expected).abs() < 1e-14, "{sum} {expected}");
        }
    }

    /// A penalty of 1e9 in an oblique direction of a node leaves the inverse of its block accurate in
    /// this direction.
    #[test]
    fn stiff_directions_keep_their_stiffness() {
        let normal = [0.6, 0.48, 0.64];
        let one = |i: usize, j: usize| f64::from(u8::from(i == j));
        let block: Block<3> =
            std::array::from_fn(|j| std::array::from_fn(|i| one(i, j) + 1e9 * normal[i] * normal[j]));
        let mut factors = Incomplete::<3>::new(&FactorPattern { offsets: vec![0, 1], columns: vec![0] });
        factors.factorise(|_| block);
        let x = solution(&factors, |_| times(&block, &normal))[0];
        assert!((0..3).all(|i| (x[i] - normal[i]).abs() < 1e-5), "{x:?}");
    }

    /// Plain lanes give the factors and solutions of the fastest ones to rounding.
    #[test]
    fn lanes_do_not_matter() {
        let (rows, blocks) = lattice::<2>(6);
        let mut factors = Incomplete::<2>::new(&rows);
        factors.factorise(|k| blocks[k]);
        let fast = solution(&factors, |row| [1.0, row as f64]);
        let mut plain = Incomplete::<2>::new(&rows);
        dispatch_portable(Factorise { factors: &mut plain, block: |k: usize| blocks[k] });
        let mut x: Vec<[f64; 2]> = (0..rows.count()).map(|row| [1.0, row as f64]).collect();
        dispatch_portable(Solve { factors: &plain, x: &mut x });
        for (x, fast) in x.as_flattened().iter().zip(fast.as_flattened()) {
            assert!((x - fast).abs() < 1e-5 * (1.0 + fast.abs()), "{x} {fast}");
        }
    }

    /// A singular block gives large numbers, not a panic. A matrix without rows is accepted.
    #[test]
    fn takes_any_matrix() {
        let rows = FactorPattern { offsets: vec![0, 1, 2], columns: vec![0, 1] };
        let mut factors = Incomplete::<2>::new(&rows);
        factors.factorise(|k| if k == 0 { [[1.0, 1.0]; 2] } else { [[f64::NAN; 2]; 2] });
        let mut x = [[1.0, 2.0], [1.0, 1.0]];
        factors.solve(&mut x);
        assert!(
            x[0].iter().all(|value| value.abs() > 1e6) && x[1].iter().all(|value| value.is_nan()),
            "{x:?}"
        );
        let mut none = Incomplete::<2>::new(&FactorPattern { offsets: vec![0], columns: vec![] });
        none.factorise(|_| [[0.0; 2]; 2]);
        none.solve(&mut []);
    }
}
