//! Figures of a study, one set per quantity: error over cost, convergence, and the
//! Time-Accuracy-Size spectrum.

use super::advice::StudyFindings;
use super::front::{digits, pareto};
use super::row::{MemberState, StudyRow};
use crate::error::Result;
use crate::plot::{AxisQuantity, Curve, Figure, Panel, Scale, Stroke};

/// Function that returns a size of a member, such as unknowns or steps.
type Size = fn(&StudyRow) -> u64;

/// Members that differ in one axis only: their other labels, their colour, and the size and point
/// of each member.
struct Family {
    labels: Vec<String>,
    colour: usize,
    points: Vec<(u64, [f64; 2])>,
}

/// Half the size of the mark of a member.
const MARK: f64 = 3.5;

impl StudyFindings<'_> {
    /// The positions of the members on the Pareto front of a quantity, by increasing cost.
    pub fn front(&self, quantity: usize) -> Vec<usize> {
        let point = |row: &StudyRow| match row.errors[quantity] {
            Some(error) if row.state == MemberState::Completed && !row.is_measure[quantity] => {
                [row.cost.cpu, error]
            }
            _ => [f64::NAN; 2],
        };
        pareto(&self.rows.iter().map(point).collect::<Vec<_>>())
    }

    /// All figures as SVG, with their file names without the extension.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn figures(&self) -> Result<Vec<(String, String)>> {
        let mut drawn = Vec::new();
        for (index, name) in self.quantities.iter().enumerate() {
            if self.drawn(index).next().is_none() {
                continue;
            }
            let file: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
            drawn.push((format!("work-precision-{file}"), self.work_precision(index).svg()?));
            drawn.push((format!("convergence-{file}"), self.convergence(index).svg()?));
            drawn.push((format!("time-accuracy-size-{file}"), self.spectrum(index).svg()?));
        }
        Ok(drawn)
    }

    /// Members that can be shown on logarithmic axes, with their positions.
    fn drawn(&self, quantity: usize) -> impl Iterator<Item = (usize, &StudyRow, f64)> {
        let judged = move |row: &'_ StudyRow| {
            let counts =
                row.state == MemberState::Completed && !row.is_measure[quantity] && row.cost.cpu > 0.0;
            row.errors[quantity].filter(|error| counts && *error > 0.0 && error.is_finite())
        };
        let rows = self.rows.iter().enumerate();
        rows.filter_map(move |(index, row)| judged(row).map(|error| (index, row, error)))
    }

    /// The words of the first axis, which the colours represent.
    fn colours(&self) -> Vec<&str> {
        let mut words: Vec<&str> = Vec::new();
        for word in self.rows.iter().filter_map(|row| row.labels.first()) {
            if !words.contains(&word.as_str()) {
                words.push(word);
            }
        }
        words
    }

    fn legend(&self) -> Vec<(String, Stroke)> {
        let named = |word: &str| match word {
            "" => "outside of the grid".to_owned(),
            word if self.axes == ["member"] => word.to_owned(),
            word => format!("{} = {word}", self.axes[0]),
        };
        let colours = self.colours().into_iter().enumerate();
        colours.map(|(k, word)| (named(word), Stroke { width: 1.0, mark: MARK, ..Stroke::of(k) })).collect()
    }

    /// Error over CPU seconds: marks for members, a line along the best of each colour, and a broad
    /// line along the best of all.
    fn work_precision(&self, quantity: usize) -> Figure {
        let front = self.front(quantity);
        let at = |index: &usize| {
            [self.rows[*index].cost.cpu, self.rows[*index].errors[quantity].unwrap_or(f64::NAN)]
        };
        let broad = Stroke::band();
        let mut curves = vec![Curve { points: front.iter().map(at).collect(), stroke: broad }];
        let mut legend = self.legend();
        for (colour, word) in self.colours().into_iter().enumerate() {
            let own: Vec<[f64; 2]> = self
                .drawn(quantity)
                .filter(|(_, row, _)| row.labels.first().is_some_and(|label| label == word))
                .map(|(_, row, error)| [row.cost.cpu, error])
                .collect();
            let best = pareto(&own).into_iter().map(|k| own[k]).collect();
            curves.push(Curve { points: best, stroke: Stroke { width: 1.0, ..Stroke::of(colour) } });
            curves
                .push(Curve { points: own, stroke: Stroke { width: 0.0, mark: MARK, ..Stroke::of(colour) } });
        }
        legend.push(("Pareto front".into(), broad));
        let labels =
            front.iter().enumerate().map(|(number, index)| (at(index), (number + 1).to_string())).collect();
        let panel = Panel {
            x: logarithmic("CPU time, user, all ranks [s]"),
            y: logarithmic(format!("relative error of {}", self.quantities[quantity])),
            curves,
            at_least: Vec::new(),
            labels,
        };
        let title = format!("Work and precision: {}", self.quantities[quantity]);
        Figure { title, legend, panels: vec![panel], columns: 1 }
    }

    /// Error over unknowns and over steps, with a panel for each of them that is varied. Members
    /// that differ in one axis are joined.
    fn convergence(&self, quantity: usize) -> Figure {
        let error = format!("relative error of {}", self.quantities[quantity]);
        let sizes: [(&str, Size); 2] =
            [("unknowns per step", |row| row.cost.unknowns), ("steps", |row| row.cost.steps)];
        let mut panels = Vec::new();
        for (name, size) in sizes {
            let mut counts: Vec<u64> = self.drawn(quantity).map(|(_, row, _)| size(row)).collect();
            counts.sort_unstable();
            counts.dedup();
            if counts.len() > 1 {
                let curves = self.joined(quantity, size, |row, error| [size(row) as f64, error]);
                panels.push(Panel {
                    x: logarithmic(name),
                    y: logarithmic(error.clone()),
                    curves,
                    at_least: vec![],
                    labels: vec![],
                });
            }
        }
        if panels.is_empty() {
            let curves =
                self.joined(quantity, |row| row.cost.unknowns, |row, error| [row.cost.size(), error]);
            let x = logarithmic("unknowns of all steps");
            panels.push(Panel { x, y: logarithmic(error), curves, at_least: vec![], labels: vec![] });
        }
        let title = format!("Convergence: {}", self.quantities[quantity]);
        let columns = panels.len();
        Figure { title, legend: self.legend(), panels, columns }
    }

    /// The three panels of the Time-Accuracy-Size spectrum.
    fn spectrum(&self, quantity: usize) -> Figure {
        let size: Size = |row| row.cost.unknowns * row.cost.steps.max(1);
        let plain = |name: &str| AxisQuantity::new(name, "");
        let panel = |x: AxisQuantity, y: AxisQuantity, point: &dyn Fn(&StudyRow, f64) -> [f64; 2]| Panel {
            x,
            y,
            curves: self.joined(quantity, size, point),
            at_least: vec![],
            labels: vec![],
        };
        let of = |row: &StudyRow, error: f64| digits(error, row.cost.size(), row.cost.cpu);
        let panels = vec![
            panel(plain("digits of size"), plain("digits of accuracy"), &|row, error| {
                let digits = of(row, error);
                [digits.size, digits.accuracy]
            }),
            panel(logarithmic("CPU time [s]"), logarithmic("unknowns of all steps per second"), &|row, _| {
                [row.cost.cpu, row.cost.size() / row.cost.cpu]
            }),
            panel(logarithmic("CPU time [s]"), plain("digits of efficacy"), &|row, error| {
                [row.cost.cpu, of(row, error).efficacy]
            }),
        ];
        let title = format!("Time, accuracy, size: {}", self.quantities[quantity]);
        Figure { title, legend: self.legend(), panels, columns: 1 }
    }

    /// Curves by colour through members that differ only in the axis along which the size grows
    /// most.
    fn joined(
        &self,
        quantity: usize,
        size: impl Fn(&StudyRow) -> u64,
        point: impl Fn(&StudyRow, f64) -> [f64; 2],
    ) -> Vec<Curve> {
        let along = self.refined(&size);
        let key = |row: &StudyRow| -> Vec<String> {
            let labels = row.labels.iter().enumerate();
            labels.map(|(k, label)| if Some(k) == along { String::new() } else { label.clone() }).collect()
        };
        let colours = self.colours();
        let mut families: Vec<Family> = Vec::new();
        for (_, row, error) in self.drawn(quantity) {
            let labels = key(row);
            let is_its = |word: &&str| row.labels.first().is_some_and(|label| label == word);
            let colour = colours.iter().position(is_its).unwrap_or(0);
            let entry = (size(row), point(row, error));
            match families.iter_mut().find(|family| family.labels == labels && family.colour == colour) {
                Some(family) => family.points.push(entry),
                None => families.push(Family { labels, colour, points: vec![entry] }),
            }
        }
        let curve = |mut family: Family| {
            family.points.sort_by_key(|(size, _)| *size);
            let stroke = Stroke { width: 1.2, mark: MARK, ..Stroke::of(family.colour) };
            Curve { points: family.points.into_iter().map(|(_, point)| point).collect(), stroke }
        };
        families.into_iter().map(curve).collect()
    }

    /// The axis along which the size grows most. The first axis, which the colours show, is used
    /// only if the size grows along no other.
    fn refined(&self, size: &impl Fn(&StudyRow) -> u64) -> Option<usize> {
        let done = || self.rows.iter().filter(|row| row.state == MemberState::Completed && size(row) > 0);
        let growth = |axis: usize| {
            let mut most: f64 = 1.0;
            for row in done() {
                let alike = |other: &&StudyRow| {
                    let labels = || row.labels.iter().zip(&other.labels).enumerate();
                    labels().all(|(k, (a, b))| (k == axis) != (a == b))
                };
                for other in done().filter(alike) {
                    most = most.max(size(other) as f64 / size(row) as f64);
                }
            }
            most
        };
        let growths =
            (1..self.axes.len()).map(|axis| (axis, growth(axis))).filter(|(_, growth)| *growth > 1.0);
        growths.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(axis, _)| axis).or((growth(0) > 1.0).then_some(0))
    }
}

fn logarithmic(name: impl Into<String>) -> AxisQuantity {
    AxisQuantity { scale: Scale::Logarithmic, ..AxisQuantity::new(name, "") }
}
