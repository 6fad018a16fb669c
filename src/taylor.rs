//! The Taylor test: one helper for every derivative of the program.

/// Order with which `f(x + h d) - f(x) - h df(x, d)` vanishes: 2 for a right derivative, 1 for a wrong one.
///
/// `df(x, d)` is the derivative of `f` at `x` in the direction `d`. The step is halved until rounding would
/// show (so that a small missing term shows first), and the last clean ratio counts. A function that is
/// affine along `d` and has the right derivative gives infinity; compare with `> 1.9`.
/// Choose `x`, `d` such that `x + d / 4` stays within one smooth branch.
pub fn taylor_rate(
    f: impl Fn(&[f64]) -> Vec<f64>,
    df: impl Fn(&[f64], &[f64]) -> Vec<f64>,
    x: &[f64],
    d: &[f64],
) -> f64 {
    let value = f(x);
    let slope = df(x, d);
    assert_eq!(value.len(), slope.len(), "value and derivative have different lengths");
    let scale = norm(&value).max(norm(&slope));
    let remainder = |h: f64| {
        let moved: Vec<f64> = x.iter().zip(d).map(|(x, d)| x + h * d).collect();
        let rest: Vec<f64> = f(&moved)
            .iter()
            .zip(&value)
            .zip(&slope)
            .map(|((new, old), slope)| new - old - h * slope)
            .collect();
        norm(&rest)
    };
    let mut rate = f64::INFINITY;
    let mut coarse = remainder(0.25);
    assert!(coarse.is_finite(), "the function or its derivative is not finite");
    let floor = 1e-13 * scale;
    for halving in 3..40 {
        let fine = remainder(0.5_f64.powi(halving));
        if fine < 50.0 * floor {
            // Nothing but rounding from here on; an affine function never leaves this branch.
            break;
        }
        rate = (coarse / fine).log2();
        coarse = fine;
    }
    rate
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Numbers in (-1, 1) that look random and are the same in every run.
pub fn scatter(count: usize, seed: u32) -> Vec<f64> {
    let mut state = u64::from(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1);
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64) / (1_u64 << 52) as f64 - 1.0
    };
    next();
    (0..count).map(|_| next()).collect()
}

/// The right derivative has order 2, one that lacks a part in a million has order 1, an affine one is exact.
#[test]
fn tells_right_from_almost_right() {
    let f = |x: &[f64]| vec![x[0].sin() * x[1], x[0] * x[0]];
    let df = |x: &[f64], d: &[f64]| vec![x[0].cos() * x[1] * d[0] + x[0].sin() * d[1], 2.0 * x[0] * d[0]];
    let almost = |x: &[f64], d: &[f64]| df(x, d).iter().map(|v| v * (1.0 + 1e-5)).collect();
    let (x, d) = (scatter(2, 1), scatter(2, 2));
    assert!((taylor_rate(f, df, &x, &d) - 2.0).abs() < 0.1);
    assert!(taylor_rate(f, almost, &x, &d) < 1.3);
    let affine = |x: &[f64]| vec![3.0 * x[0] - x[1] + 1.0];
    assert_eq!(taylor_rate(affine, |_, d| vec![3.0 * d[0] - d[1]], &x, &d), f64::INFINITY);
}
