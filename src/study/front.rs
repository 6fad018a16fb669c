//! The Pareto front of members, which no other member beats in both error and cost, and the digits
//! of the Time-Accuracy-Size spectrum.

/// Positions of the Pareto-optimal points, by increasing cost. No other point is at most as large
/// in both coordinates and smaller in one. Points that are not finite and positive are ignored.
///
/// Points are \[cost, error\].
pub fn pareto(points: &[[f64; 2]]) -> Vec<usize> {
    let counts = |point: &[f64; 2]| point.iter().all(|x| x.is_finite() && *x > 0.0);
    let mut order: Vec<usize> = (0..points.len()).filter(|&k| counts(&points[k])).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1])));
    let mut least = f64::INFINITY;
    order.retain(|&k| {
        let is_better = points[k][1] < least;
        least = least.min(points[k][1]);
        is_better
    });
    order
}

/// Digits of accuracy, size and efficacy after J. Chang, M. Fabien, M. Knepley and R. Mills,
/// *Comparative study of finite element methods using the Time-Accuracy-Size spectrum analysis*
/// (2018).
///
/// The size of a time-dependent problem is the number of unknowns per step times the number of
/// steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Digits {
    /// -log10(error).
    pub accuracy: f64,
    /// log10(size).
    pub size: f64,
    /// -log10(error times seconds): the accuracy per second of computing time.
    pub efficacy: f64,
}

/// The digits of an error, a size and a time \[s\].
pub fn digits(error: f64, size: f64, seconds: f64) -> Digits {
    Digits { accuracy: -error.log10(), size: size.log10(), efficacy: -(error * seconds).log10() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the front beat every other point in one coordinate. Equal points count once, and
    /// failures are ignored.
    #[test]
    fn the_front_is_beaten_by_none() {
        let points = [
            [1.0, 0.5],
            [2.0, 0.1],
            [2.0, 0.3],
            [3.0, 0.1],
            [4.0, 0.05],
            [0.5, f64::NAN],
            [0.1, 0.0],
            [1.0, 0.5],
            [9.0, 0.04],
        ];
        let front = pareto(&points);
        assert_eq!(front, [0, 1, 4, 8]);
        for (k, point) in points.iter().enumerate().filter(|(_, p)| p[1] > 0.0) {
            let beaten = front.iter().any(|&f| points[f][0] <= point[0] && points[f][1] <= point[1]);
            assert!(beaten, "{k} is beaten by the front or on it");
        }
        assert!(pareto(&[]).is_empty());
    }

    /// An error of one per cent after ten seconds with a million unknowns.
    #[test]
    fn digits_are_logarithms() {
        let Digits { accuracy, size, efficacy } = digits(0.01, 1e6, 10.0);
        assert!(
            (accuracy - 2.0).abs() < 1e-12 && (size - 6.0).abs() < 1e-12 && (efficacy - 1.0).abs() < 1e-12
        );
    }
}
