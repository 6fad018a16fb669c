//! Figures of curves: a title, a legend in a separate band, and panels below it. The legend can not
//! overlap the data.

use crate::error::Result;

use super::axis::{Axis, AxisEnds, AxisQuantity};
use super::canvas::{Canvas, TextAnchor, sheet};
use super::style::{GREY, INK, LABEL, NUMBER, Stroke, TITLE, fitted, text_width};

/// A line of a panel, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The points; a point that is not finite is a gap.
    pub points: Vec<[f64; 2]>,
    /// Its colour, dashes and marks.
    pub stroke: Stroke,
}

/// A pair of axes with curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// The horizontal axis.
    pub x: AxisQuantity,
    /// The vertical axis.
    pub y: AxisQuantity,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Values that the vertical axis always includes.
    pub at_least: Vec<f64>,
    /// Text labels next to points.
    pub labels: Vec<([f64; 2], String)>,
}

/// A figure: panels of equal width, arranged in rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The title above the figure.
    pub title: String,
    /// The labels of the strokes; there is no legend if it is empty.
    pub legend: Vec<(String, Stroke)>,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// Number of panels per row.
    pub columns: usize,
}

/// Rectangle of a sheet: left, top, right, bottom.
pub(super) type Frame = [f64; 4];

const WIDTH: f64 = 760.0;
const LEGEND_ROW: f64 = 22.0;
const SAMPLE: f64 = 38.0;
/// Width of the marks of a curve that has no line.
const MARK_WIDTH: f64 = 1.8;

impl Figure {
    /// The figure as SVG.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn svg(&self) -> Result<String> {
        let rows = self.panels.len().div_ceil(self.columns);
        let panel_height = if rows == 1 { 400.0 } else { 270.0 };
        let head = head_height(&self.legend);
        let margin =
            self.panels.iter().map(|panel| panel.number_width(panel_height)).fold(0.0, f64::max) + 44.0;
        sheet([WIDTH, head + panel_height * rows as f64 + 8.0], |canvas| {
            draw_head(canvas, &self.title, &self.legend, WIDTH)?;
            let width = (WIDTH - 12.0) / self.columns as f64;
            for (index, panel) in self.panels.iter().enumerate() {
                let left = (index % self.columns) as f64 * width;
                let top = head + (index / self.columns) as f64 * panel_height;
                panel.draw(canvas, [left, top, left + width, top + panel_height], margin)?;
            }
            Ok(())
        })
    }
}

impl Panel {
    fn all(&self, i: usize) -> impl Iterator<Item = f64> {
        self.curves.iter().flat_map(move |curve| curve.points.iter().map(move |point| point[i]))
    }

    fn upward(&self, height: f64) -> Axis {
        let values = self.all(1).chain(self.at_least.iter().copied());
        Axis::covering(&self.y, values, AxisEnds::Padded, height / 50.0)
    }

    fn number_width(&self, height: f64) -> f64 {
        let widths = self.upward(height).ticks.into_iter().map(|(_, text)| text_width(&text, NUMBER));
        widths.fold(0.0, f64::max)
    }

    fn draw(&self, canvas: &Canvas, place: Frame, margin: f64) -> Result<()> {
        let [left, top, right, bottom] = place;
        let frame = [left + margin, top + 10.0, right - 8.0, bottom - 48.0];
        // The time axis ends at the data. Curves over other quantities should not run along the
        // frame.
        let ends = if self.x.name == "time" { AxisEnds::Data } else { AxisEnds::Padded };
        let x = Axis::covering(&self.x, self.all(0), ends, (frame[2] - frame[0]) / 70.0);
        let y = self.upward(bottom - top);
        draw_axes(canvas, frame, &x, &y)?;
        canvas.text(&y.label, [left + 16.0, (frame[1] + frame[3]) / 2.0], LABEL, TextAnchor::Upward)?;
        for curve in &self.curves {
            let points: Vec<_> = curve.points.iter().map(|&point| place_in(frame, [&x, &y], point)).collect();
            if curve.stroke.width > 0.0 {
                canvas.line(&points, curve.stroke)?;
            }
            points.iter().try_for_each(|&point| draw_mark(canvas, point, curve.stroke))?;
        }
        for (point, text) in &self.labels {
            let [across, up] = place_in(frame, [&x, &y], *point);
            canvas.text(text, [across + 6.0, up - 8.0], NUMBER, TextAnchor::Start)?;
        }
        Ok(())
    }
}

/// A diamond at a point, for curves of few points.
fn draw_mark(canvas: &Canvas, [x, y]: [f64; 2], stroke: Stroke) -> Result<()> {
    let size = stroke.mark;
    if size <= 0.0 {
        return Ok(());
    }
    let corners = [[x - size, y], [x, y - size], [x + size, y], [x, y + size], [x - size, y]];
    let width = if stroke.width > 0.0 { stroke.width } else { MARK_WIDTH };
    canvas.line(&corners, Stroke { dash: &[], width, ..stroke })
}

/// Position of a point in SI units in a frame.
pub(super) fn place_in(frame: Frame, axes: [&Axis; 2], point: [f64; 2]) -> [f64; 2] {
    let share = |i: usize| axes[i].share(point[i]);
    [frame[0] + share(0) * (frame[2] - frame[0]), frame[3] - share(1) * (frame[3] - frame[1])]
}

/// Draws frame, grid, numbers, and the label below.
pub(super) fn draw_axes(canvas: &Canvas, frame: Frame, x: &Axis, y: &Axis) -> Result<()> {
    let [left, top, right, bottom] = frame;
    for (at, text) in &x.ticks {
        let across = place_in(frame, [x, y], [*at, y.range[0]])[0];
        canvas.line(&[[across, top], [across, bottom + 4.0]], Stroke::thin(GREY))?;
        canvas.text(text, [across, bottom + 14.0], NUMBER, TextAnchor::Middle)?;
    }
    for (at, text) in &y.ticks {
        let up = place_in(frame, [x, y], [x.range[0], *at])[1];
        let stroke = Stroke::thin(if *at == 0.0 { INK } else { GREY });
        canvas.line(&[[left - 4.0, up], [right, up]], stroke)?;
        canvas.text(text, [left - 8.0, up], NUMBER, TextAnchor::End)?;
    }
    let corners = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
    canvas.line(&corners, Stroke::thin(INK))?;
    canvas.text(&x.label, [(left + right) / 2.0, bottom + 34.0], LABEL, TextAnchor::Middle)
}

/// Height of title and legend together.
pub(super) fn head_height(legend: &[(String, Stroke)]) -> f64 {
    38.0 + legend_places(legend, WIDTH).last().map_or(0.0, |place| place[1] + LEGEND_ROW)
}

/// Draws title and legend at the top of the sheet.
pub(super) fn draw_head(canvas: &Canvas, title: &str, legend: &[(String, Stroke)], width: f64) -> Result<()> {
    canvas.text(&fitted(title, TITLE, width - 32.0), [16.0, 22.0], TITLE, TextAnchor::Start)?;
    for ((text, stroke), [left, top]) in legend.iter().zip(legend_places(legend, width)) {
        let middle = 38.0 + top + LEGEND_ROW / 2.0;
        if stroke.width > 0.0 {
            canvas.line(&[[left, middle], [left + SAMPLE, middle]], *stroke)?;
        }
        draw_mark(canvas, [left + SAMPLE / 2.0, middle], *stroke)?;
        let text = fitted(text, LABEL, width - 48.0 - SAMPLE);
        canvas.text(&text, [left + SAMPLE + 6.0, middle], LABEL, TextAnchor::Start)?;
    }
    Ok(())
}

/// Left end and top of each entry of the legend, filled row by row.
fn legend_places(legend: &[(String, Stroke)], width: f64) -> Vec<[f64; 2]> {
    let (mut left, mut top) = (16.0, 0.0);
    let mut places = Vec::new();
    for (text, _) in legend {
        let needed = SAMPLE + 6.0 + text_width(text, LABEL);
        if left > 16.0 && left + needed > width - 16.0 {
            left = 16.0;
            top += LEGEND_ROW;
        }
        places.push([left, top]);
        left += needed + 18.0;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries of a legend do not overlap and stay on the sheet, however many and long they are.
    #[test]
    fn legends_wrap() {
        let entry = |i: usize| ("x".repeat(5 + 7 * (i % 5)), Stroke::of(i));
        let legend: Vec<_> = (0..12).map(entry).collect();
        let places = legend_places(&legend, WIDTH);
        for (index, pair) in places.windows(2).enumerate() {
            let end = pair[0][0] + SAMPLE + text_width(&legend[index].0, LABEL);
            assert!(end <= WIDTH && (pair[1][1] > pair[0][1] || pair[1][0] > end));
        }
        assert_eq!(head_height(&[]), 38.0);
    }

    /// The corners of the axes are the corners of the frame, with y upward.
    #[test]
    fn points_land_in_the_frame() {
        let axis = Axis::covering(&AxisQuantity::new("q", ""), [0.0, 10.0], AxisEnds::Ticks, 5.0);
        let frame = [100.0, 10.0, 200.0, 60.0];
        assert_eq!(place_in(frame, [&axis, &axis], [0.0, 0.0]), [100.0, 60.0]);
        assert_eq!(place_in(frame, [&axis, &axis], [10.0, 5.0]), [200.0, 35.0]);
    }
}
