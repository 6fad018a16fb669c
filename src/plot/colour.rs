//! A colour scale that is perceptually uniform, also in grey and for the colour-blind: viridis,
//! interpolated between nine of its colours.

use plotters::style::RGBColor;

use crate::error::Result;

use super::axis::Axis;
use super::canvas::{Canvas, TextAnchor};
use super::chart::Frame;
use super::style::{INK, LABEL, NUMBER, Stroke, text_width};

const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// The colour of a value on an axis. Values beyond its ends have the colour of the end; NaN is
/// white.
pub fn colour(axis: &Axis, value: f64) -> RGBColor {
    if value.is_nan() {
        return RGBColor(255, 255, 255);
    }
    of_share(axis.share(value))
}

/// The colour at a position on the scale from 0 to 1.
fn of_share(share: f64) -> RGBColor {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let index = (place as usize).min(VIRIDIS.len() - 2);
    let share = place - index as f64;
    let [r, g, b] = [0, 1, 2].map(|i| {
        let [from, to] = [VIRIDIS[index][i], VIRIDIS[index + 1][i]];
        (from + share * (to - from)).round() as u8
    });
    RGBColor(r, g, b)
}

/// Width that [`draw_bar`] needs.
pub fn bar_width(axis: &Axis) -> f64 {
    58.0 + axis.ticks.iter().map(|(_, text)| text_width(text, NUMBER)).fold(0.0, f64::max)
}

/// Draws a vertical colour bar at the left of `frame`, with its label to the right of the numbers.
pub fn draw_bar(canvas: &Canvas, frame: Frame, axis: &Axis) -> Result<()> {
    const STRIPES: usize = 128;
    let [left, top, _, bottom] = frame;
    let right = left + 16.0;
    let height = |share: f64| bottom - share * (bottom - top);
    for stripe in 0..STRIPES {
        let from = stripe as f64 / STRIPES as f64;
        let fill = of_share(from + 0.5 / STRIPES as f64);
        // Each stripe reaches to the top and is covered by the next, so that no gap shows between
        // them.
        let [y0, y1] = [height(from), top];
        canvas.polygon(&[[left, y0], [right, y0], [right, y1], [left, y1]], fill, None)?;
    }
    canvas.line(
        &[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]],
        Stroke::thin(INK),
    )?;
    for (at, text) in &axis.ticks {
        let y = height(axis.share(*at));
        canvas.line(&[[right, y], [right + 4.0, y]], Stroke::thin(INK))?;
        canvas.text(text, [right + 7.0, y], NUMBER, TextAnchor::Start)?;
    }
    let across = left + bar_width(axis) - 12.0;
    canvas.text(&axis.label, [across, (top + bottom) / 2.0], LABEL, TextAnchor::Upward)
}

#[cfg(test)]
mod tests {
    use super::super::axis::{AxisEnds, AxisQuantity};
    use super::*;

    /// Brightness increases along the scale, so that it is readable in grey. Values beyond the ends
    /// are clamped.
    #[test]
    fn brightness_grows() {
        let axis = Axis::covering(&AxisQuantity::new("q", ""), [0.0, 1.0], AxisEnds::Ticks, 5.0);
        let grey = |value: f64| {
            let RGBColor(r, g, b) = colour(&axis, value);
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        assert!((0..100).all(|i| grey(f64::from(i + 1) / 100.0) > grey(f64::from(i) / 100.0) - 0.6));
        assert_eq!((colour(&axis, -5.0), colour(&axis, 9.0)), (colour(&axis, 0.0), colour(&axis, 1.0)));
        assert_eq!(colour(&axis, f64::NAN), RGBColor(255, 255, 255));
    }
}
