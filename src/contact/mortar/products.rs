//! Sums of products of rows, `sum_q left_q right_q^T`, computed in lanes.
//!
//! Derivatives of contact integrals and their stiffness are sums of such products over the segment
//! points: few rows per point, each with one entry for each coordinate of the nodes.

use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};

/// Rows of equal length. Each one is padded with zeros to full lanes.
#[derive(Debug, Default)]
pub(super) struct PaddedRows {
    length: usize,
    stride: usize,
    values: Vec<f64>,
}

impl PaddedRows {
    /// Removes all rows. The next ones have this length.
    pub fn clear(&mut self, length: usize) {
        self.length = length;
        self.stride = length.next_multiple_of(WIDTH);
        self.values.clear();
    }

    /// Appends a row of zeros.
    pub fn push(&mut self) -> &mut [f64] {
        let first = self.values.len();
        self.values.resize(first + self.stride, 0.0);
        &mut self.values[first..][..self.length]
    }

    /// Appends a copy of a row.
    pub fn push_copy(&mut self, row: &[f64]) {
        debug_assert_eq!(row.len(), self.length);
        self.values.extend_from_slice(row);
        self.pad();
    }

    /// Appends a multiple of a row.
    pub fn push_multiple(&mut self, row: &[f64], factor: f64) {
        debug_assert_eq!(row.len(), self.length);
        self.values.extend(row.iter().map(|value| value * factor));
        self.pad();
    }

    fn pad(&mut self) {
        if self.length < self.stride {
            let full = self.values.len() + self.stride - self.length;
            self.values.resize(full, 0.0);
        }
    }

    fn count(&self) -> usize {
        self.values.len() / self.stride.max(1)
    }
}

/// Pairs of rows, and the sum of the products of those that were added up.
#[derive(Debug, Default)]
pub(super) struct Products {
    /// The left factors.
    pub left: PaddedRows,
    /// The right factors.
    pub right: PaddedRows,
    sums: Vec<f64>,
    any: bool,
}

/// Number of pairs that are added up at once. For quadrilaterals their rows take 22 kB, which fits
/// into the first-level cache. Another value changes results only by rounding.
const AT_ONCE: usize = 64;

impl Products {
    /// Clears the sum, for left and right rows of these lengths.
    pub fn clear(&mut self, left: usize, right: usize) {
        self.left.clear(left);
        self.right.clear(right);
        self.sums.clear();
        self.sums.resize(self.left.stride * self.right.stride, 0.0);
        self.any = false;
    }

    /// Adds up the pairs if there are many.
    pub fn flush(&mut self) {
        if self.left.count() >= AT_ONCE {
            self.add_up();
        }
    }

    /// The sum of the products of all pairs.
    pub fn sums(&mut self) -> Sums<'_> {
        self.add_up();
        Sums { values: &self.sums, stride: self.right.stride, any: self.any }
    }

    fn add_up(&mut self) {
        debug_assert_eq!(self.left.count(), self.right.count());
        if self.left.count() > 0 {
            dispatch(AddUp { left: &self.left, right: &self.right, sums: &mut self.sums });
            self.left.values.clear();
            self.right.values.clear();
            self.any = true;
        }
    }
}

/// The sum of products, a matrix.
pub(super) struct Sums<'a> {
    values: &'a [f64],
    stride: usize,
    /// Whether there were any pairs.
    pub any: bool,
}

impl Sums<'_> {
    /// Row of the matrix that belongs to this entry of the left rows.
    pub fn row(&self, left: usize) -> &[f64] {
        &self.values[left * self.stride..][..self.stride]
    }
}

struct AddUp<'a> {
    left: &'a PaddedRows,
    right: &'a PaddedRows,
    sums: &'a mut [f64],
}

impl LaneTask for AddUp<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(mut self, unit: L) {
        let columns = self.right.stride;
        for row in (0..self.left.stride).step_by(WIDTH) {
            let mut column = 0;
            while column + 3 * WIDTH <= columns {
                self.block::<L, 3>(unit, row, column);
                column += 3 * WIDTH;
            }
            while column < columns {
                self.block::<L, 1>(unit, row, column);
                column += WIDTH;
            }
        }
    }
}

impl AddUp<'_> {
    /// Adds to a block of [`WIDTH`] rows and `N` lanes of columns.
    #[inline(always)]
    fn block<L: Lane, const N: usize>(&mut self, unit: L, row: usize, column: usize) {
        let stride = self.right.stride;
        let mut sums = [[unit.constant(0.0); N]; WIDTH];
        let lefts = self.left.values.chunks_exact(self.left.stride);
        for (left, right) in lefts.zip(self.right.values.chunks_exact(stride)) {
            let left = load(&left[row..]);
            let right = &right[column..][..N * WIDTH];
            let right: [L; N] = std::array::from_fn(|n| unit.load(load(&right[n * WIDTH..])));
            for i in 0..WIDTH {
                let factor = unit.constant(left[i]);
                for n in 0..N {
                    sums[i][n] = factor.mul_add(right[n], sums[i][n]);
                }
            }
        }
        for i in 0..WIDTH {
            for n in 0..N {
                let entries = &mut self.sums[(row + i) * stride + column + n * WIDTH..][..WIDTH];
                let sum = unit.load(load(entries)) + sums[i][n];
                entries.copy_from_slice(&sum.lanes());
            }
        }
    }
}

#[inline(always)]
fn load(values: &[f64]) -> [f64; WIDTH] {
    let mut lanes = [0.0; WIDTH];
    lanes.copy_from_slice(&values[..WIDTH]);
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::scatter;

    /// The sums equal those of plain loops, for lengths with and without a remainder, before and
    /// after many pairs were added up.
    #[test]
    fn sums_are_those_of_plain_loops() {
        let mut products = Products::default();
        for (left, right, count) in [(20, 24, 72), (8, 24, 7), (3, 5, 130), (54, 54, 65), (4, 8, 0)] {
            products.clear(left, right);
            let mut expected = vec![0.0; left * right];
            for q in 0..count {
                let rows = [scatter(left, q), scatter(right, q + 1000)];
                products.left.push_copy(&rows[0]);
                products.right.push_multiple(&rows[1], 2.0);
                products.flush();
                for (i, a) in rows[0].iter().enumerate() {
                    for (j, b) in rows[1].iter().enumerate() {
                        expected[i * right + j] += 2.0 * a * b;
                    }
                }
            }
            let sums = products.sums();
            for (i, expected) in expected.chunks_exact(right).enumerate() {
                for (sum, expected) in sums.row(i).iter().zip(expected) {
                    assert!((sum - expected).abs() < 1e-12, "{left} {right} {count}");
                }
            }
        }
    }
}
