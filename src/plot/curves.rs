//! Figures of the tables: contact stresses, motion, phase planes, energy, iterations; of one run,
//! or of several compared.

use crate::error::Result;

use super::axis::Display;
use super::chart::{Curve, Figure, Panel};
use super::csv::Csv;
use super::results::Run;
use super::style::Stroke;

/// A figure and its file name without the extension.
pub type NamedCurve = (String, Figure);

/// All figures over time that the tables of the runs allow.
///
/// # Errors
/// A numeric column of a table holds something other than numbers.
pub fn figures(runs: &[Run]) -> Result<Vec<NamedCurve>> {
    let mut probes: Vec<String> = Vec::new();
    for name in runs.iter().flat_map(Run::probe_names) {
        if !probes.contains(&name) {
            probes.push(name);
        }
    }
    let display = Display::of(&runs.iter().map(|run| run.units).collect::<Vec<_>>());
    let mut figures = Vec::new();
    for probe in &probes {
        figures.extend(contact_stresses(runs, probe, &display)?);
        figures.extend(displacement(runs, probe, &display)?);
        figures.extend(phase_plane(runs, probe, &display)?);
    }
    figures.extend(vertical_motion(runs, &probes, &display)?);
    figures.extend(normal_stresses(runs, &probes, &display)?);
    figures.extend(energy(runs, &display)?);
    figures.extend(iterations(runs, &display)?);
    Ok(figures)
}

/// Normal and tangential contact stress at a probe (Figs 5 and 6): in one panel for one run, in two
/// if several runs are compared.
fn contact_stresses(runs: &[Run], probe: &str, display: &Display) -> Result<Option<NamedCurve>> {
    let columns = [format!("{probe}.contact_pressure [Pa]"), format!("{probe}.traction_t [Pa]")];
    let normal = over_time(runs, display, |run| run.probes.as_ref(), &columns[0])?;
    let tangential = over_time(runs, display, |run| run.probes.as_ref(), &columns[1])?;
    if is_blank(&normal) {
        return Ok(None);
    }
    let file = format!("contact_stresses_{}", file_name(probe));
    let [only] = runs else {
        let panels = vec![
            panel(display, "normal stress", "Pa", normal),
            panel(display, "tangential stress", "Pa", tangential),
        ];
        let title = format!("Contact stresses at {probe}");
        return Ok(Some((file, Figure { title, legend: legend(runs), panels, columns: 1 })));
    };
    let strokes = [0, 1].map(Stroke::of);
    let curves = normal.into_iter().chain(tangential).zip(strokes);
    let curves = curves.map(|(curve, stroke)| Curve { stroke, ..curve }).collect();
    let legend = vec![("normal (pressure)".to_string(), strokes[0]), ("tangential".to_string(), strokes[1])];
    let title = format!("Contact stresses at {probe}: {}", only.title);
    Ok(Some((
        file,
        Figure { title, legend, panels: vec![panel(display, "contact stress", "Pa", curves)], columns: 1 },
    )))
}

/// Horizontal displacement of a probe (Fig. 7).
fn displacement(runs: &[Run], probe: &str, display: &Display) -> Result<Option<NamedCurve>> {
    let curves = over_time(runs, display, |run| run.probes.as_ref(), &format!("{probe}.u_x [m]"))?;
    // The axis does not include zero, because the sliding of a point is small compared with its
    // displacement at the start.
    let panels =
        vec![Panel { at_least: Vec::new(), ..panel(display, "horizontal displacement", "m", curves) }];
    let title = titled(runs, &format!("Horizontal displacement of {probe}"));
    Ok(filled((
        format!("displacement_{}", file_name(probe)),
        Figure { title, legend: legend(runs), panels, columns: 1 },
    )))
}

/// Horizontal velocity of a probe over its horizontal displacement (Fig. 13), if it has a velocity.
fn phase_plane(runs: &[Run], probe: &str, display: &Display) -> Result<Option<NamedCurve>> {
    let [u, v] = ["u_x [m]", "v_x [m/s]"].map(|column| format!("{probe}.{column}"));
    let mut curves = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let Some(csv) = &run.probes else { continue };
        if let (Some(u), Some(v)) = (run.column(csv, &u, display)?, run.column(csv, &v, display)?) {
            // A loop with many turns is readable only with thin lines.
            let stroke = Stroke { width: 1.1, ..Stroke::of(index) };
            curves.push(Curve { points: u.into_iter().zip(v).map(|(u, v)| [u, v]).collect(), stroke });
        }
    }
    if curves.iter().flat_map(|curve| &curve.points).all(|point| point[1] == 0.0) {
        return Ok(None);
    }
    let [x, y] = [("horizontal displacement", "m"), ("horizontal velocity", "m/s")]
        .map(|(name, unit)| display.quantity(name, unit));
    let panels = vec![Panel { x, y, curves, at_least: vec![0.0], labels: Vec::new() }];
    let title = titled(runs, &format!("Phase plane of {probe}"));
    Ok(filled((
        format!("phase_plane_{}", file_name(probe)),
        Figure { title, legend: legend(runs), panels, columns: 1 },
    )))
}

/// Vertical displacement of all probes (Fig. 11).
fn vertical_motion(runs: &[Run], probes: &[String], display: &Display) -> Result<Option<NamedCurve>> {
    let has = |axis: &str| {
        let is_in = |run: &Run, probe: &str| {
            let column = run.units.heading(&format!("{probe}.{axis} [m]"));
            run.probes.iter().flat_map(Csv::columns).any(|name| *name == column)
        };
        probes.iter().any(|probe| runs.iter().any(|run| is_in(run, probe)))
    };
    let axis = if has("u_z") { "u_z" } else { "u_y" };
    let name = ["Vertical motion", "vertical displacement", "m"];
    together(runs, probes, display, &format!("{axis} [m]"), name).map(|figure| {
        figure.map(|mut figure| {
            figure.panels.iter_mut().for_each(|panel| panel.at_least.clear());
            ("vertical_motion".into(), figure)
        })
    })
}

/// Normal contact stress of all probes (Fig. 12).
fn normal_stresses(runs: &[Run], probes: &[String], display: &Display) -> Result<Option<NamedCurve>> {
    let name = ["Normal contact stresses at the nodes of the probes", "normal stress", "Pa"];
    let figure = together(runs, probes, display, "contact_pressure [Pa]", name)?;
    Ok(figure.map(|figure| ("normal_stresses".into(), figure)))
}

/// One quantity of all probes that have it: in one panel for one run, in a panel per probe if
/// several runs are compared.
fn together(
    runs: &[Run],
    probes: &[String],
    display: &Display,
    column: &str,
    [title, name, unit]: [&'static str; 3],
) -> Result<Option<Figure>> {
    let mut shown = Vec::new();
    for probe in probes {
        let curves = over_time(runs, display, |run| run.probes.as_ref(), &format!("{probe}.{column}"))?;
        if !is_blank(&curves) {
            shown.push((probe, curves));
        }
    }
    if shown.is_empty() {
        return Ok(None);
    }
    let title = titled(runs, title);
    if runs.len() > 1 {
        let panels = shown
            .into_iter()
            .map(|(probe, curves)| panel(display, &format!("{name}, {probe}"), unit, curves));
        return Ok(Some(Figure { title, legend: legend(runs), panels: panels.collect(), columns: 2 }));
    }
    let legend = shown.iter().enumerate().map(|(k, (probe, _))| (probe.to_string(), Stroke::of(k))).collect();
    let curves = shown.into_iter().enumerate().flat_map(|(k, (_, curves))| {
        curves.into_iter().map(move |curve| Curve { stroke: Stroke::of(k), ..curve })
    });
    let panels = vec![panel(display, name, unit, curves.collect())];
    Ok(Some(Figure { title, legend, panels, columns: 1 }))
}

const ENERGIES: [&str; 11] = [
    "kinetic",
    "strain",
    "viscous_stored",
    "contact",
    "springs",
    "friction_dissipated",
    "damping_dissipated",
    "viscous_dissipated",
    "external_work",
    "numerical",
    "total",
];

/// The energy balance: all energies of one run in one panel, or a panel per energy if several runs
/// are compared.
///
/// An energy that is zero throughout in all runs, such as the dissipation of a damping that no case
/// uses, is left out.
fn energy(runs: &[Run], display: &Display) -> Result<Option<NamedCurve>> {
    let mut shown = Vec::new();
    for name in ENERGIES {
        let curves = over_time(runs, display, |run| run.energy.as_ref(), &format!("{name} [J]"))?;
        if curves.iter().flat_map(|curve| &curve.points).any(|point| point[1] != 0.0) {
            shown.push((name.replace('_', " "), curves));
        }
    }
    let title = titled(runs, "Energy");
    if runs.len() > 1 {
        let panels =
            shown.into_iter().map(|(name, curves)| panel(display, &format!("{name} energy"), "J", curves));
        let panels = panels.map(|mut panel| {
            panel.at_least.clear();
            panel.y.name =
                panel.y.name.replace("dissipated energy", "dissipation").replace("work energy", "work");
            panel
        });
        return Ok(filled((
            "energy".into(),
            Figure { title, legend: legend(runs), panels: panels.collect(), columns: 2 },
        )));
    }
    let strokes = (0..).map(Stroke::of);
    let names: Vec<_> = shown.iter().map(|(name, _)| name.clone()).zip(strokes).collect();
    let curves = shown.into_iter().zip(&names).flat_map(|((_, curves), (_, stroke))| {
        curves.into_iter().map(|curve| Curve { stroke: *stroke, ..curve })
    });
    let panels = vec![panel(display, "energy", "J", curves.collect())];
    Ok(filled(("energy".into(), Figure { title, legend: names, panels, columns: 1 })))
}

/// Newton iterations of each step, including failed attempts, with a panel for each run, and their
/// sums.
fn iterations(runs: &[Run], display: &Display) -> Result<Option<NamedCurve>> {
    let (mut each, mut sums) = (Vec::new(), Vec::new());
    for (index, run) in runs.iter().enumerate() {
        let Some(counts) = run.iterations.as_ref().map(|csv| count_by_step(run, csv, display)).transpose()?
        else {
            continue;
        };
        let stroke = Stroke::of(index);
        let stairs = counts
            .windows(2)
            .flat_map(|pair| [pair[0], [pair[1][0], pair[0][1]]])
            .chain(counts.last().copied());
        each.push(Curve { points: stairs.collect(), stroke: Stroke { dash: &[], width: 1.2, ..stroke } });
        let sum = counts.iter().scan(0.0, |sum, [time, count]| {
            *sum += count;
            Some([*time, *sum])
        });
        sums.push(Curve { points: sum.collect(), stroke });
    }
    let most = each.iter().flat_map(|curve| &curve.points).map(|point| point[1]).fold(0.0, f64::max);
    let mut panels: Vec<Panel> =
        each.into_iter().map(|curve| panel(display, "iterations per step", "", vec![curve])).collect();
    panels.iter_mut().for_each(|panel| panel.at_least = vec![0.0, most]);
    panels.push(panel(display, "cumulative iterations", "", sums));
    let title = titled(runs, "Newton iterations");
    let columns = if runs.len() == 1 { 1 } else { 2 };
    Ok(filled(("iterations".into(), Figure { title, legend: legend(runs), panels, columns })))
}

/// Time and number of iterations of each step. Iteration 0 is the prediction and needs no solve.
fn count_by_step(run: &Run, csv: &Csv, display: &Display) -> Result<Vec<[f64; 2]>> {
    let column = |name| Ok::<_, crate::error::Error>(run.column(csv, name, display)?.unwrap_or_default());
    let (steps, times, iterations) = (column("step")?, column("time [s]")?, column("iteration")?);
    let mut counts: Vec<(f64, [f64; 2])> = Vec::new();
    for ((step, time), iteration) in steps.into_iter().zip(times).zip(iterations) {
        match counts.last_mut() {
            Some((last, count)) if *last == step => *count = [time, count[1] + f64::from(iteration > 0.0)],
            _ => counts.push((step, [time, f64::from(iteration > 0.0)])),
        }
    }
    Ok(counts.into_iter().map(|(_, count)| count).collect())
}

/// A column of each run against its time. A run without the column has no curve but still reserves
/// its stroke.
fn over_time<'a>(
    runs: &'a [Run],
    display: &Display,
    table: impl Fn(&'a Run) -> Option<&'a Csv>,
    column: &str,
) -> Result<Vec<Curve>> {
    let mut curves = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let Some(csv) = table(run) else { continue };
        if let (Some(times), Some(values)) =
            (run.column(csv, "time [s]", display)?, run.column(csv, column, display)?)
        {
            let points = times.into_iter().zip(values).map(|(time, value)| [time, value]).collect();
            curves.push(Curve { points, stroke: Stroke::of(index) });
        }
    }
    Ok(curves)
}

fn panel(display: &Display, name: &str, unit: &str, curves: Vec<Curve>) -> Panel {
    Panel {
        x: display.quantity("time", "s"),
        y: display.quantity(name, unit),
        curves,
        at_least: vec![0.0],
        labels: Vec::new(),
    }
}

fn legend(runs: &[Run]) -> Vec<(String, Stroke)> {
    match runs {
        [_] => Vec::new(),
        _ => runs.iter().enumerate().map(|(index, run)| (run.title.clone(), Stroke::of(index))).collect(),
    }
}

fn titled(runs: &[Run], what: &str) -> String {
    match runs {
        [only] => format!("{what}: {}", only.title),
        _ => what.to_string(),
    }
}

fn filled(named: NamedCurve) -> Option<NamedCurve> {
    let is_empty = named.1.panels.iter().all(|panel| is_blank(&panel.curves));
    (!is_empty).then_some(named)
}

fn is_blank(curves: &[Curve]) -> bool {
    !curves.iter().flat_map(|curve| &curve.points).any(|point| point[1].is_finite())
}

/// Converts a probe's name to a valid file name.
fn file_name(probe: &str) -> String {
    probe.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::Scratch;

    /// Iterations are counted per step over all attempts, without the prediction.
    #[test]
    fn counts_iterations_by_step() {
        let scratch = Scratch::new("count");
        let path = scratch.0.join("iterations.csv");
        let text = "step,time [ms],attempt,iteration\n1,100,1,0\n1,100,1,1\n1,50,2,0\n1,50,2,1\n1,50,2,2\n2,200,1,0\n2,200,1,1\n";
        std::fs::write(&path, text).unwrap();
        let record = r#"{"program": "contact-petsc", "units": {"time": "ms"}}"#;
        std::fs::write(scratch.0.join("run.json"), record).unwrap();
        let run = Run::read(&scratch.0, &mut Vec::new()).unwrap();
        let csv = Csv::read(&path).unwrap().unwrap();
        assert_eq!(count_by_step(&run, &csv, &Display::of(&[run.units])).unwrap(), [[0.05, 3.0], [0.2, 1.0]]);
    }

    /// A name that contains a path can not leave the folder.
    #[test]
    fn file_names_are_tame() {
        assert_eq!(file_name("../a b/c"), "___a_b_c");
        assert_eq!(file_name("node_50"), "node_50");
    }
}
