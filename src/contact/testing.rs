//! What the tests of this room share.

/// Observed order of `|f(x + h d) - f(x) - h df(d)|` in `h`; 2 where `df` is the derivative, 1 where it is not.
///
/// A derivative that is exact for a linear `f` counts as 2.
pub(crate) fn taylor_rate(
    f: impl Fn(&[f64]) -> Vec<f64>,
    df: impl Fn(&[f64]) -> Vec<f64>,
    x: &[f64],
    d: &[f64],
) -> f64 {
    let (base, slope) = (f(x), df(d));
    let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let remainder = |h: f64| {
        let moved: Vec<f64> = x.iter().zip(d).map(|(x, d)| x + h * d).collect();
        let difference: Vec<f64> =
            f(&moved).iter().zip(&base).zip(&slope).map(|((a, b), s)| a - b - h * s).collect();
        norm(&difference)
    };
    let steps: Vec<f64> = (2..8).map(|k| 0.5f64.powi(k)).collect();
    let remainders: Vec<f64> = steps.iter().map(|h| remainder(*h)).collect();
    let scale = norm(&base).max(norm(&slope));
    let floor = 1e-13 * scale;
    if remainders[0] <= floor * 10.0 {
        return 2.0;
    }
    let usable: Vec<f64> = remainders.into_iter().take_while(|r| *r > floor).collect();
    let last = usable.len() - 1;
    if last == 0 { 2.0 } else { (usable[last - 1] / usable[last]).log2() }
}
