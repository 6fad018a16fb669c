//! Curves over time: values at instants, extremes, and the L2 norm of differences.

use std::path::Path;

use crate::case::Units;
use crate::error::{Error, Result};
use crate::plot::Csv;
use crate::study::file::Measure;

/// Tolerance, as a fraction of the length of a curve, by which an instant may lie outside of it.
const ROUNDING: f64 = 1e-9;

/// A curve over time, linear between its points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeSeries {
    /// Time \[s\], increasing, and value.
    points: Vec<[f64; 2]>,
}

/// First and last instant of the evaluated interval \[s\].
pub type Interval = Option<[f64; 2]>;

impl TimeSeries {
    /// Creates a curve from its points. Points that are not finite are left out. Of two points at
    /// one instant, the later one is used.
    pub fn new(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut kept: Vec<[f64; 2]> = Vec::new();
        for point in points.into_iter().filter(|point| point.iter().all(|x| x.is_finite())) {
            match kept.last_mut() {
                Some(last) if point[0] <= last[0] => *last = point,
                _ => kept.push(point),
            }
        }
        Self { points: kept }
    }

    /// Reads a column of a table in the rows that have the given words; `None` if the table does
    /// not exist yet.
    ///
    /// # Errors
    /// There is no such column, and the message names the most similar one; or a number can not be
    /// read.
    pub fn read(path: &Path, column: &str, only: &[(&str, &str)], units: Units) -> Result<Option<Self>> {
        let Some(csv) = Csv::read(path)? else { return Ok(None) };
        let absent = |column: &str| {
            let known: Vec<&str> = csv.columns().iter().map(String::as_str).collect();
            let near = crate::reader::complaint::nearest(column, &known);
            let near = near.map_or(String::new(), |near| format!("; did you mean '{near}'?"));
            Error::case(format!("{}: there is no column '{column}'", path.display()))
                .hint(&format!("known: {}{near}", known.join(", ")))
        };
        let numbers = |column: &str| csv.numbers(column)?.ok_or_else(|| absent(column));
        let times = numbers(&units.heading("time [s]"))?;
        let values = numbers(column)?;
        let mut is_meant = vec![true; times.len()];
        for (column, word) in only {
            let words = csv.words(column).ok_or_else(|| absent(column))?;
            is_meant.iter_mut().zip(words).for_each(|(meant, found)| *meant &= found == *word);
        }
        let points = times.into_iter().zip(values).zip(is_meant).filter(|(_, meant)| *meant);
        Ok(Some(Self::new(points.map(|((time, value), _)| [time, value]))))
    }

    /// Whether the curve has no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The value at an instant \[s\], linear between two points; `None` outside of the curve.
    pub fn at(&self, time: f64) -> Option<f64> {
        let ([first, _], [last, _]) = (self.points.first()?, self.points.last()?);
        let slack = ROUNDING * (last - first).max(last.abs());
        if time < first - slack || time > last + slack {
            return None;
        }
        let behind = self.points.partition_point(|point| point[0] < time);
        let [from, to] =
            [behind.saturating_sub(1), behind.min(self.points.len() - 1)].map(|k| self.points[k]);
        let length = to[0] - from[0];
        Some(if length > 0.0 { from[1] + (time - from[0]) / length * (to[1] - from[1]) } else { to[1] })
    }

    /// The part of the curve within the interval. The ends of the interval are included if the
    /// curve reaches them.
    fn within(&self, interval: Interval) -> Self {
        let Some(ends) = interval else { return self.clone() };
        let end = |time: f64| self.at(time).map(|value| [time, value]);
        let inner = self.points.iter().copied().filter(|point| ends[0] < point[0] && point[0] < ends[1]);
        Self { points: end(ends[0]).into_iter().chain(inner).chain(end(ends[1])).collect() }
    }

    /// The measure of the curve; for [`Measure::L2`] its root mean square. `None` if the curve has
    /// no value in the interval.
    pub fn measured(&self, measure: Measure, interval: Interval) -> Option<f64> {
        let part = self.within(interval);
        let values = || part.points.iter().map(|point| point[1]);
        match measure {
            Measure::At(time) => self.at(time.value),
            Measure::Last => part.points.last().map(|point| point[1]),
            Measure::Maximum => values().reduce(f64::max),
            Measure::Minimum => values().reduce(f64::min),
            Measure::L2 => {
                let length = part.points.last()?[0] - part.points.first()?[0];
                (length > 0.0).then(|| (square_integral(&part.points) / length).sqrt())
            }
        }
    }

    /// L2 norm over time of the difference between this curve and another, relative to the norm of
    /// the other. It is evaluated at the instants of both.
    ///
    /// `None` if they have no time in common, or if the other is zero. `scale` replaces the root
    /// mean square of the other as the reference size.
    pub fn distance(&self, other: &Self, interval: Interval, scale: Option<f64>) -> Option<f64> {
        let ([mine, yours], [my_end, your_end]) = (
            [self, other].map(|curve| curve.points.first().map(|point| point[0])),
            [self, other].map(|curve| curve.points.last().map(|point| point[0])),
        );
        let whole = [mine?.max(yours?), my_end?.min(your_end?)];
        let ends = interval.map_or(whole, |[from, to]| [from.max(whole[0]), to.min(whole[1])]);
        let mut times: Vec<f64> = self.points.iter().chain(&other.points).map(|point| point[0]).collect();
        times.retain(|time| ends[0] < *time && *time < ends[1]);
        times.extend(ends);
        times.sort_by(f64::total_cmp);
        times.dedup();
        let sample =
            |curve: &Self| -> Option<Vec<f64>> { times.iter().map(|&time| curve.at(time)).collect() };
        let (own, others) = (sample(self)?, sample(other)?);
        let curve = |value: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            times.iter().enumerate().map(|(k, &time)| [time, value(k)]).collect()
        };
        let length = ends[1] - ends[0];
        let difference = square_integral(&curve(&|k| own[k] - others[k]));
        let size =
            scale.map_or_else(|| square_integral(&curve(&|k| others[k])), |scale| scale * scale * length);
        (length > 0.0 && size > 0.0).then(|| (difference / size).sqrt())
    }
}

/// Exact integral of the square of a curve that is linear between its points.
fn square_integral(points: &[[f64; 2]]) -> f64 {
    let piece = |pair: &[[f64; 2]]| {
        let [[from, a], [to, b]] = [pair[0], pair[1]];
        (to - from) * (a * a + a * b + b * b) / 3.0
    };
    points.windows(2).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::Scratch;
    use crate::reader::quantity::Duration;

    fn line(slope: f64, times: &[f64]) -> TimeSeries {
        TimeSeries::new(times.iter().map(|&time| [time, slope * time]))
    }

    /// Values are linear between points and absent outside. Of two points at one instant, the last
    /// one is used.
    #[test]
    fn values_are_interpolated() {
        let curve = TimeSeries::new([[0.0, 1.0], [1.0, 3.0], [1.0, 5.0], [f64::NAN, 2.0], [3.0, 9.0]]);
        assert_eq!([0.0, 0.5, 1.0, 2.0, 3.0].map(|t| curve.at(t)), [1.0, 3.0, 5.0, 7.0, 9.0].map(Some));
        assert_eq!([-0.1, 3.1].map(|t| curve.at(t)), [None, None]);
        assert_eq!(curve.at(3.0 * (1.0 + 1e-13)), Some(9.0));
        assert_eq!(TimeSeries::default().at(0.0), None);
        assert_eq!(curve.measured(Measure::At(Duration::new(0.5)), None), Some(3.0));
        assert_eq!(curve.measured(Measure::Maximum, Some([0.0, 2.0])), Some(7.0));
        assert_eq!(curve.measured(Measure::Minimum, Some([0.5, 9.0])), Some(3.0));
        assert_eq!(curve.measured(Measure::Last, None), Some(9.0));
    }

    /// The norm is that of the continuous curves: it does not depend on how finely a straight line
    /// is sampled. The relative distance of t from 2 t over [0, 3] is a half.
    #[test]
    fn norms_are_exact_for_lines() {
        let coarse = line(1.0, &[0.0, 3.0]);
        let fine = line(2.0, &[0.0, 0.1, 0.7, 2.0, 3.0]);
        assert!((coarse.distance(&fine, None, None).unwrap() - 0.5).abs() < 1e-15);
        assert!(line(2.0, &[0.0, 3.0]).distance(&fine, None, None).unwrap() < 1e-15);
        // Root mean square of t over [0, 3] is the square root of 3.
        assert!((coarse.measured(Measure::L2, None).unwrap() - 3f64.sqrt()).abs() < 1e-15);
        let scaled = coarse.distance(&fine, None, Some(3f64.sqrt())).unwrap();
        assert!((scaled - 1.0).abs() < 1e-15);
        // Only the common time interval counts.
        let short = line(1.0, &[1.0, 2.0]);
        assert!((short.distance(&fine, Some([0.0, 1.5]), None).unwrap() - 0.5).abs() < 1e-15);
        assert_eq!(short.distance(&line(1.0, &[2.0, 3.0]), None, None), None);
        assert_eq!(short.distance(&line(0.0, &[0.0, 3.0]), None, None), None);
    }

    /// Rows are selected by their words. The error for an unknown column names the most similar
    /// one.
    #[test]
    fn rows_are_chosen_by_words() {
        let scratch = Scratch::new("series");
        let path = scratch.0.join("reactions.csv");
        std::fs::write(&path, "step,time [s],boundary,force_x [N]\n0,0,a,1\n0,0,b,2\n1,1,a,3\n1,1,b,4\n")
            .unwrap();
        let read =
            |column: &str, word: &str| TimeSeries::read(&path, column, &[("boundary", word)], Units::SI);
        assert_eq!(read("force_x [N]", "b").unwrap().unwrap().points, [[0.0, 2.0], [1.0, 4.0]]);
        assert!(read("force_x [N]", "c").unwrap().unwrap().is_empty());
        let text = read("force_x", "b").unwrap_err().message;
        assert!(text.contains("'force_x'") && text.contains("did you mean 'force_x [N]'"), "{text}");
        assert!(TimeSeries::read(&scratch.0.join("no.csv"), "a", &[], Units::SI).unwrap().is_none());
    }
}
