//! A sheet for drawing, in units of a CSS pixel. Internally it uses the whole pixels of `plotters`,
//! which are eight times finer.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::{Error, Result};
use crate::output::xml::legal;

use super::style::{INK, Stroke};

const FINE: f64 = 8.0;
/// `plotters` divides font sizes by this before it writes them.
const FONT: f64 = 1.24;

/// Alignment of a text relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextAnchor {
    /// Left-aligned at the position.
    Start,
    /// Centred at the position.
    Middle,
    /// Right-aligned at the position.
    End,
    /// Centred at the position and rotated to read upward.
    Upward,
}

/// An SVG that is being drawn.
pub struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Draws a sheet of the given width and height and returns it as SVG.
///
/// # Errors
/// `paint` fails.
pub fn sheet(size: [f64; 2], paint: impl FnOnce(&Canvas) -> Result<()>) -> Result<String> {
    let fine = size.map(|length| (length * FINE).round() as u32);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (fine[0], fine[1])).into_drawing_area();
        let canvas = Canvas { area };
        canvas.area.fill(&WHITE).map_err(fault)?;
        paint(&canvas)?;
        canvas.area.present().map_err(fault)?;
    }
    let found = format!("<svg width=\"{}\" height=\"{}\"", fine[0], fine[1]);
    let wanted = format!("<svg stroke-linejoin=\"round\" width=\"{}\" height=\"{}\"", size[0], size[1]);
    Ok(svg.replacen(&found, &wanted, 1))
}

impl Canvas<'_> {
    /// A line through points; a point that is not finite interrupts it.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn line(&self, points: &[[f64; 2]], stroke: Stroke) -> Result<()> {
        for part in points.split(|point| !point.iter().all(|x| x.is_finite())) {
            let part = thinned(part);
            match stroke.dash {
                [] => self.solid(&part, stroke)?,
                dash => dashes(&part, dash).iter().try_for_each(|piece| self.solid(piece, stroke))?,
            }
        }
        Ok(())
    }

    fn solid(&self, points: &[[f64; 2]], stroke: Stroke) -> Result<()> {
        let style = stroke.colour.stroke_width((stroke.width * FINE).round() as u32);
        let points: Vec<_> = points.iter().map(fine).collect();
        self.area.draw(&PathElement::new(points, style)).map_err(fault)
    }

    /// A filled polygon. Its rim is drawn in `rim`, or else in the fill colour, so that no
    /// background shows between two polygons.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn polygon(&self, points: &[[f64; 2]], fill: RGBColor, rim: Option<Stroke>) -> Result<()> {
        let corners: Vec<_> = points.iter().map(fine).collect();
        self.area.draw(&Polygon::new(corners, fill.filled())).map_err(fault)?;
        let closed: Vec<_> = points.iter().chain(points.first()).copied().collect();
        self.solid(&closed, rim.unwrap_or(Stroke { width: 0.25, ..Stroke::thin(fill) }))
    }

    /// A text of the given height.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn text(&self, text: &str, at: [f64; 2], size: f64, anchor: TextAnchor) -> Result<()> {
        let font = ("sans-serif", size * FONT * FINE).into_font();
        let (font, across) = match anchor {
            TextAnchor::Start => (font, HPos::Left),
            TextAnchor::Middle => (font, HPos::Center),
            TextAnchor::End => (font, HPos::Right),
            TextAnchor::Upward => (font.transform(FontTransform::Rotate270), HPos::Center),
        };
        let style = font.color(&INK).pos(Pos::new(across, VPos::Center));
        let text: String = text.chars().map(legal).collect();
        self.area.draw(&Text::new(text, fine(&at), style)).map_err(fault)
    }
}

fn fine(point: &[f64; 2]) -> (i32, i32) {
    ((point[0] * FINE).round() as i32, (point[1] * FINE).round() as i32)
}

fn fault<E: std::fmt::Display>(error: E) -> Error {
    Error::internal(format!("drawing failed: {error}"))
}

/// Removes points that are too close to the previous one to be visible.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(points.len());
    for (index, point) in points.iter().enumerate() {
        let is_near = |last: &[f64; 2]| (last[0] - point[0]).hypot(last[1] - point[1]) < 0.2;
        if !kept.last().is_some_and(is_near) || index + 1 == points.len() {
            kept.push(*point);
        }
    }
    kept
}

/// Splits a line into the drawn parts of a dash pattern.
fn dashes(points: &[[f64; 2]], pattern: &[f64]) -> Vec<Vec<[f64; 2]>> {
    let mut parts = Vec::new();
    let Some(&first) = points.first() else { return parts };
    let mut phase = 0;
    let mut left = pattern[0];
    let mut part = vec![first];
    for ends in points.windows(2) {
        let [mut from, to] = [ends[0], ends[1]];
        let mut length = (to[0] - from[0]).hypot(to[1] - from[1]);
        while length > left {
            let share = left / length;
            from = [0, 1].map(|i| from[i] + share * (to[i] - from[i]));
            length -= left;
            part.push(from);
            if phase % 2 == 0 {
                parts.push(std::mem::take(&mut part));
            }
            part = vec![from];
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
        }
        left -= length;
        part.push(to);
    }
    if phase % 2 == 0 && part.len() > 1 {
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length(line: &[[f64; 2]]) -> f64 {
        line.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum()
    }

    /// Dashes follow the corners of the line and have the lengths of the pattern.
    #[test]
    fn dashes_have_their_lengths() {
        let line = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        let parts = dashes(&line, &[4.0, 1.0]);
        let lengths: Vec<f64> = parts.iter().map(|part| length(part)).collect();
        assert_eq!(lengths, [4.0; 6]);
        assert_eq!(parts[2], [[10.0, 0.0], [10.0, 4.0]]);
        assert_eq!(dashes(&line, &[16.0, 2.0])[0], [[0.0, 0.0], [10.0, 0.0], [10.0, 6.0]]);
    }

    /// Thinning keeps both ends and every visible turn.
    #[test]
    fn thinning_keeps_what_is_seen() {
        let line: Vec<[f64; 2]> =
            (0..=1000).map(|i| [f64::from(i) * 0.01, f64::from(i % 2) * 0.05]).collect();
        let kept = thinned(&line);
        assert!(kept.len() < 60 && kept[0] == line[0] && kept.last() == line.last());
    }

    /// The sheet has its size in pixels, and gaps in the data interrupt the line.
    #[test]
    fn writes_svg() {
        let stroke = Stroke { dash: &[], ..Stroke::of(0) };
        let svg = sheet([100.0, 50.0], |canvas| {
            let gap = [f64::NAN, 1.0];
            canvas.line(&[[0.0, 0.0], [5.0, 5.0], gap, [10.0, 1.0], [20.0, 1.0]], stroke)?;
            canvas.text("a < b", [1.0, 1.0], 10.0, TextAnchor::Start)
        });
        let svg = svg.unwrap();
        assert!(svg.contains("width=\"100\" height=\"50\" viewBox=\"0 0 800 400\""), "{svg}");
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(svg.contains("a &lt; b") && svg.trim_end().ends_with("</svg>"));
    }
}
