//! Memory traffic of the incomplete factors on one core: time of a solve beside the time that the
//! memory needs for the bytes that it reads and writes.
//!
//! `cargo bench --bench traffic [-- NODES]`, with the number of nodes in each direction (44). The
//! bandwidth is that of a sum over an array that does not fit into the caches. Both are measured in
//! turn, and all times are the least CPU seconds of thirty.

use std::hint::black_box;

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;

use contact_petsc::solvers::incomplete::{Block, FactorPattern, Incomplete};

/// How often each time is measured.
const ROUNDS: usize = 30;

fn main() {
    let nodes = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(44);
    println!(
        "{:>5} {:>10} {:>12} {:>10} {:>10} {:>12} {:>10} {:>6}",
        "block", "unknowns", "factorise ms", "read GB/s", "solve ms", "B/unknown", "memory ms", "ratio"
    );
    compare::<3>(&lattice(nodes, nodes));
    compare::<2>(&lattice(nodes * nodes / 4, 1));
}

/// CPU seconds of a call.
fn time(call: impl FnOnce()) -> f64 {
    let now = || {
        let usage = getrusage(UsageWho::RUSAGE_SELF).expect("every system counts its seconds");
        let parts = [usage.user_time(), usage.system_time()];
        parts.iter().map(|part| part.num_microseconds() as f64 * 1e-6).sum::<f64>()
    };
    let start = now();
    call();
    now() - start
}

/// CPU seconds of a sum over `values`.
fn sum(values: &[f64]) -> f64 {
    time(|| {
        let mut sums = [0.0; 16];
        for values in values.as_chunks::<16>().0 {
            for i in 0..16 {
                sums[i] += values[i];
            }
        }
        black_box(sums);
    })
}

/// Nodes of `n` by `n` by `height`, each coupled with all around it.
fn lattice(n: i32, height: i32) -> FactorPattern {
    let mut rows = FactorPattern { offsets: vec![0], columns: vec![] };
    for (z, y, x) in (0..height).flat_map(|z| (0..n).flat_map(move |y| (0..n).map(move |x| (z, y, x)))) {
        for (r, q, p) in (z - 1..=z + 1)
            .flat_map(|r| (y - 1..=y + 1).flat_map(move |q| (x - 1..=x + 1).map(move |p| (r, q, p))))
        {
            if (0..height).contains(&r) && (0..n).contains(&q) && (0..n).contains(&p) {
                rows.columns.push((p + n * (q + n * r)) as u32);
            }
        }
        rows.offsets.push(rows.columns.len() as u32);
    }
    rows
}

/// Measures solve and bandwidth, and prints them.
fn compare<const D: usize>(rows: &FactorPattern) {
    let count = rows.count();
    let mut is_diagonal = vec![false; rows.columns.len()];
    for row in 0..count {
        for k in rows.offsets[row]..rows.offsets[row + 1] {
            is_diagonal[k as usize] = rows.columns[k as usize] as usize == row;
        }
    }
    let block = |k: usize| -> Block<D> {
        let entry = |i: usize, j: usize| ((k * 7 + 3 * i + j) % 11) as f64 / 11.0 - 0.45;
        let heavy = |i: usize, j: usize| if is_diagonal[k] && i == j { 12.0 } else { 0.0 };
        std::array::from_fn(|j| std::array::from_fn(|i| entry(i, j) + heavy(i, j)))
    };
    let mut factors = Incomplete::<D>::new(rows);
    let rhs: Vec<[f64; D]> = (0..count).map(|row| [(row as f64).sin(); D]).collect();
    let mut x = rhs.clone();
    let values = vec![1.0; 20_000_000];
    let mut factorise = f64::INFINITY;
    let mut solve = f64::INFINITY;
    let mut read = f64::INFINITY;
    for _ in 0..ROUNDS {
        factorise = factorise.min(time(|| factors.factorise(block)));
        read = read.min(sum(&values));
        x.copy_from_slice(&rhs);
        solve = solve.min(time(|| factors.solve(&mut x)));
    }
    black_box(&x);
    let bandwidth = size_of_val(&values[..]) as f64 / read;
    // Off-diagonal blocks and their columns, pivots, and both sweeps over the vector.
    let entry = D * D * size_of::<f32>() + size_of::<u32>();
    let bytes = (rows.columns.len() - count) * entry + count * (D * D + 4 * D) * size_of::<f64>();
    let bound = bytes as f64 / bandwidth;
    println!(
        "{D:>5} {:>10} {:>12.1} {:>10.1} {:>10.2} {:>12.0} {:>10.2} {:>6.2}",
        count * D,
        factorise * 1e3,
        bandwidth / 1e9,
        solve * 1e3,
        bytes as f64 / (count * D) as f64,
        bound * 1e3,
        solve / bound
    );
}
