//! The deformed bodies at the end (Figs 4 and 10), coloured by von Mises stress or by contact
//! pressure. Several runs share one colour scale.

use crate::error::Result;

use super::axis::{Axis, AxisEnds, Display, Prefix};
use super::canvas::{Canvas, TextAnchor, sheet};
use super::chart::{Frame, draw_axes, place_in};
use super::colour::{bar_width, colour, draw_bar};
use super::grid::Shot;
use super::scene::{Face, Scene, Shown};
use super::style::{FAINT, INK, LABEL, PALE, Stroke, TITLE, wrapped};

const WIDTH: f64 = 860.0;
const HEAD: f64 = 40.0;
/// Width that the colour bar and the margins of the panel take from a caption.
const CAPTION_MARGIN: f64 = 115.0;
/// Height of a line of a caption.
const LINE: f64 = 16.0;
/// Maximum number of faces on a panel for which edges are drawn. With more, the edges would hide
/// the colours.
const MOST_RIMS: usize = 6000;

/// The figure of the runs' snapshots as SVG, each under its title; `None` if no snapshot has the
/// requested values.
///
/// # Errors
/// The drawing library fails.
pub fn figure(shots: &[(String, Shot)], shown: Shown, display: &Display) -> Result<Option<String>> {
    let factor = magnification(shots.iter().map(|(_, shot)| shot));
    let scene = |shot: &Shot| match factor {
        1.0 => Scene::of(shot, shown),
        _ => Scene::of(&magnified(shot, factor), shown),
    };
    let columns = if shots.len() == 1 { 1 } else { 2 };
    let caption_width = WIDTH / columns as f64 - CAPTION_MARGIN;
    let lines = |title: &str, shot: &Shot| wrapped(&caption(title, shot, display), LABEL, caption_width, 3);
    let scenes: Vec<(Vec<String>, Scene)> =
        shots.iter().map(|(title, shot)| (lines(title, shot), scene(shot))).collect();
    let values = || scenes.iter().flat_map(|(_, scene)| scene.faces.iter().filter_map(|face| face.value));
    if values().next().is_none() {
        return Ok(None);
    }
    let (name, title) = match shown {
        Shown::VonMises => ("von Mises stress", "Deformed mesh, von Mises stress"),
        Shown::Pressure => {
            ("contact pressure", "Deformed mesh, contact pressure (mean of the nodes of each facet)")
        }
    };
    let title = match factor {
        1.0 => title.to_string(),
        _ => format!("{title}, displacements scaled by {factor}"),
    };
    let scale = Axis::covering(&display.quantity(name, "Pa"), values(), AxisEnds::Ticks, 5.0);
    let width = (WIDTH - bar_width(&scale) - 24.0) / columns as f64;
    let height = panel_height(&scenes, width);
    let rows = scenes.len().div_ceil(columns);
    let total = HEAD + height * rows as f64 + 8.0;
    let svg = sheet([WIDTH, total], |canvas| {
        canvas.text(&title, [16.0, 22.0], TITLE, TextAnchor::Start)?;
        for (index, (caption, scene)) in scenes.iter().enumerate() {
            let left = 8.0 + (index % columns) as f64 * width;
            let top = HEAD + (index / columns) as f64 * height;
            draw_panel(canvas, [left, top, left + width, top + height], caption, scene, &scale, display)?;
        }
        let left = WIDTH - bar_width(&scale) - 4.0;
        draw_bar(canvas, [left, HEAD + 30.0, WIDTH, (HEAD + height - 48.0).min(HEAD + 430.0)], &scale)
    });
    svg.map(Some)
}

/// Fraction of the bodies' size below which displacements are not visible, and the fraction to
/// which they are then magnified.
const UNSEEN: [f64; 2] = [0.01, 0.04];

/// Fraction of the bodies' size below which displacements are what a solver leaves after an unloading:
/// 1e-292 at the end of the scene `indenter`. A bar of steel of 1 m under its own weight is far above,
/// with `rho g L / (2 E)` of 2e-7.
const RESIDUE: f64 = 1e-12;

/// Magnification of displacements: 1, 2 or 5 times a power of ten, the same for all snapshots.
fn magnification<'a>(shots: impl Iterator<Item = &'a Shot>) -> f64 {
    let share = shots.map(|shot| shot.bodies.largest_displacement() / shot.bodies.diagonal());
    let share = share.filter(|share| share.is_finite()).fold(0.0, f64::max);
    if !(RESIDUE..UNSEEN[0]).contains(&share) {
        return 1.0;
    }
    let wanted = UNSEEN[1] / share;
    let power = 10f64.powf(wanted.log10().floor());
    let round = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= wanted);
    round.unwrap_or(1.0) * power
}

fn magnified(shot: &Shot, factor: f64) -> Shot {
    let mut shot = shot.clone();
    let others = shot.surfaces.iter_mut().chain(&mut shot.rigid);
    let grids = std::iter::once(&mut shot.bodies).chain(others);
    grids.flat_map(|grid| &mut grid.displacement).flatten().for_each(|u| *u *= factor);
    shot
}

fn caption(title: &str, shot: &Shot, display: &Display) -> String {
    let time = Prefix::applied(&display.quantity("t", "s"), shot.time);
    let comma = if title.is_empty() { "" } else { ", " };
    format!("{title}{comma}t = {time}")
}

/// Height of a panel of the given width that the flattest scene fills, within bounds.
fn panel_height(scenes: &[(Vec<String>, Scene)], width: f64) -> f64 {
    let slimness = scenes.iter().map(|(_, scene)| {
        let [x, y] = scene.extent();
        (y[1] - y[0]) / (x[1] - x[0]).max(f64::MIN_POSITIVE)
    });
    let tallest = slimness.fold(0.0, f64::max);
    let lines = scenes.iter().map(|(caption, _)| caption.len()).max().unwrap_or(1);
    ((width - 80.0) * tallest + 90.0).clamp(230.0, 620.0) + LINE * (lines - 1) as f64
}

fn draw_panel(
    canvas: &Canvas,
    [left, top, right, bottom]: Frame,
    caption: &[String],
    scene: &Scene,
    scale: &Axis,
    display: &Display,
) -> Result<()> {
    for (number, line) in caption.iter().enumerate() {
        let at = [(left + right) / 2.0 + 20.0, top + 10.0 + LINE * number as f64];
        canvas.text(line, at, LABEL, TextAnchor::Middle)?;
    }
    let top = top + LINE * (caption.len() - 1) as f64;
    let is_plane = !scene.outline.is_empty();
    let frame = if is_plane {
        [left + 60.0, top + 26.0, right - 12.0, bottom - 50.0]
    } else {
        [left, top + 26.0, right - 12.0, bottom - 8.0]
    };
    let [x, y] = equal_axes(frame, scene.extent(), display);
    if is_plane {
        draw_axes(canvas, frame, &x, &y)?;
        canvas.text(&y.label, [left + 14.0, (frame[1] + frame[3]) / 2.0], LABEL, TextAnchor::Upward)?;
    }
    let rim = (scene.faces.len() < MOST_RIMS).then_some(Stroke { width: 0.35, ..Stroke::thin(INK) });
    for ends in &scene.outline {
        canvas.line(&ends.map(|point| place_in(frame, [&x, &y], point)), Stroke::thin(INK))?;
    }
    let place = |point| place_in(frame, [&x, &y], point);
    scene.faces.iter().try_for_each(|face| draw_face(canvas, face, place, scale, rim))?;
    scene.rigid.iter().try_for_each(|line| canvas.line(&line.map(place), RIGID))
}

/// Lines of obstacles and rigid bodies.
const RIGID: Stroke = Stroke { width: 1.4, ..Stroke::thin(INK) };

fn draw_face(
    canvas: &Canvas,
    face: &Face,
    place: impl Fn([f64; 2]) -> [f64; 2],
    scale: &Axis,
    rim: Option<Stroke>,
) -> Result<()> {
    let corners: Vec<_> = face.corners.iter().map(|&point| place(point)).collect();
    let fill = face.value.map_or(PALE, |value| colour(scale, value));
    if face.is_line {
        return canvas.line(&corners, Stroke { width: 6.0, ..Stroke::thin(fill) });
    }
    let rim = match face.value {
        Some(_) => rim,
        None => rim.map(|rim| Stroke { colour: FAINT, ..rim }),
    };
    canvas.polygon(&corners, fill, rim)
}

/// Axes of equal scale that show the whole extent, centred in the frame with a small margin.
fn equal_axes(frame: Frame, extent: [[f64; 2]; 2], display: &Display) -> [Axis; 2] {
    let size = [frame[2] - frame[0], frame[3] - frame[1]];
    let span = |i: usize| (extent[i][1] - extent[i][0]) * 1.06;
    let metres = (span(0) / size[0]).max(span(1) / size[1]).max(f64::MIN_POSITIVE);
    let axis = |i: usize, name: &str| {
        let middle = (extent[i][0] + extent[i][1]) / 2.0;
        let half = metres * size[i] / 2.0;
        Axis::covering(
            &display.quantity(name, "m"),
            [middle - half, middle + half],
            AxisEnds::Data,
            size[i] / 70.0,
        )
    };
    [axis(0, "x"), axis(1, "y")]
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;
    use crate::case::Units;
    use crate::plot::grid::Grid;

    /// Invisible displacements are magnified by a round factor; visible ones are not.
    #[test]
    fn small_displacements_are_enlarged() {
        let shot = |u: f64| {
            let points = vec![[0.0; 3], [3.0, 4.0, 0.0]];
            let bodies = Grid { points, displacement: vec![[0.0, u, 0.0]; 2], ..Grid::default() };
            Shot { time: 0.0, surfaces: Some(bodies.clone()), rigid: None, bodies }
        };
        for (u, factor) in
            [(0.0, 1.0), (0.06, 1.0), (0.01, 20.0), (8e-4, 200.0), (6e-6, 20_000.0), (6e-14, 1.0)]
        {
            assert_eq!(magnification([&shot(u), &shot(0.0)].into_iter()), factor, "{u}");
        }
        let large = magnified(&shot(0.01), 20.0);
        assert_eq!(large.bodies.displacement, large.surfaces.unwrap().displacement);
        assert!((large.bodies.displacement[1][1] - 0.2).abs() < 1e-15);
    }

    /// The time in a caption has a prefix only in metric units. The unit of time of other results
    /// may itself have the name of a second with a prefix.
    #[test]
    fn captions_have_the_time_in_its_unit() {
        let units = serde_json::json!({ "length": "in", "mass": "slinch", "time": "ms" });
        let milliseconds = Units::deserialize(&units).unwrap();
        let shot = |time: f64| Shot { time, bodies: Grid::default(), surfaces: None, rigid: None };
        for (units, time, text) in [
            (Units::SI, 0.07, "a, t = 70 ms"),
            (Units::SI, 0.0, "a, t = 0 s"),
            (Units::SI, 3e6, "a, t = 3 Ms"),
            (milliseconds, 100.0, "a, t = 100 ms"),
            (milliseconds, 2e-6, "a, t = 0.000002 ms"),
        ] {
            assert_eq!(caption("a", &shot(time), &Display::of(&[units])), text);
        }
    }

    /// Both axes have the same scale.
    #[test]
    fn scales_are_equal() {
        let frame = [10.0, 20.0, 410.0, 220.0];
        for extent in [[[0.0, 1.0], [0.0, 0.1]], [[-1.0, 1.0], [0.0, 9.0]]] {
            let [x, y] = equal_axes(frame, extent, &Display::of(&[]));
            let scale = [400.0 / (x.range[1] - x.range[0]), 200.0 / (y.range[1] - y.range[0])];
            assert!((scale[0] - scale[1]).abs() < 1e-9 * scale[0]);
            assert!(x.range[0] < extent[0][0] && y.range[1] > extent[1][1]);
        }
    }
}
