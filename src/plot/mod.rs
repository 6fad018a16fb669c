//! Figures from results folders: `contact-petsc plot RESULTS... [--output DIR]`.
//!
//! | File | What it shows |
//! |---|---|
//! | `contact_stresses_PROBE.svg` | normal and tangential stress (Figs 5 and 6) |
//! | `displacement_PROBE.svg` | horizontal displacement (Fig. 7) |
//! | `vertical_motion.svg`, `normal_stresses.svg` | all probes together (Figs 11 and 12) |
//! | `phase_plane_PROBE.svg` | horizontal velocity over horizontal displacement (Fig. 13) |
//! | `deformed_von_mises.svg`, `deformed_pressure.svg` | the bodies at the last field step (Figs 4 and 10) |
//! | `energy.svg`, `iterations.svg` | the energy balance; Newton iterations per step |
//!
//! Several folders are drawn in the same figures, with a legend of the runs' titles. Missing data
//! are left out with a note, so that a run can be plotted while it is running.

mod axis;
mod canvas;
mod chart;
mod colour;
mod csv;
mod curves;
mod deformed;
mod grid;
mod results;
mod scene;
mod shapes;
mod style;
mod table;

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::output::folder::write_whole;
use crate::output::io_error::unwritable;

use results::{Run, distinguish};
use scene::Shown;

use axis::Display;
pub use axis::{AxisQuantity, Scale};
pub use chart::{Curve, Figure, Panel};
pub use csv::Csv;
pub use style::Stroke;
pub use table::{TableFigure, draw_table};

/// Result of plotting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plotted {
    /// The figures that were written.
    pub files: Vec<PathBuf>,
    /// What was missing or left out, one line each.
    pub notes: Vec<String>,
}

/// Draws all figures that the results allow into `output`. The default is `RESULTS/figures` for one
/// folder, and `figures` in the working directory for several.
///
/// # Errors
/// A folder is not a result of this program, a table is broken, nothing can be drawn, or the
/// figures can not be written.
pub fn plot(results: &[PathBuf], output: Option<&Path>) -> Result<Plotted> {
    let mut notes = Vec::new();
    let mut runs = results.iter().map(|path| Run::read(path, &mut notes)).collect::<Result<Vec<_>>>()?;
    distinguish(&mut runs);
    let folder = match (output, runs.as_slice()) {
        (_, []) => return Err(Error::usage("no results folder given")),
        (Some(folder), _) => folder.to_path_buf(),
        (None, [only]) => only.folder.join("figures"),
        (None, _) => PathBuf::from("figures"),
    };
    let display = Display::of(&runs.iter().map(|run| run.units).collect::<Vec<_>>());
    let mut drawings = Vec::new();
    for (name, figure) in curves::figures(&runs)? {
        drawings.push((name, figure.svg()?));
    }
    let shots: Vec<_> = runs
        .iter()
        .filter_map(|run| {
            let shot = grid::last_shot(run.folder.path(), &mut notes)?;
            Some((run.title.clone(), shot.shown(run.units, &display)))
        })
        .collect();
    for (name, shown) in [("deformed_von_mises", Shown::VonMises), ("deformed_pressure", Shown::Pressure)] {
        drawings.extend(deformed::figure(&shots, shown, &display)?.map(|svg| (name.to_string(), svg)));
    }
    if drawings.is_empty() {
        let text = format!("{}: nothing to draw yet\n{}", results[0].display(), notes.join("\n"));
        return Err(Error::file(text).hint("wait until the run has written its first steps"));
    }
    std::fs::create_dir_all(&folder).map_err(|e| unwritable(&folder, &e))?;
    let mut files = Vec::new();
    for (name, svg) in drawings {
        let path = folder.join(format!("{name}.svg"));
        write_whole(&path, svg.as_bytes())?;
        files.push(path);
    }
    Ok(Plotted { files, notes })
}

/// Figures as SVG with their names.
pub type Drawings = Vec<(String, String)>;

/// The figures of one result, for its report page.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Album {
    /// The deformed bodies.
    pub bodies: Drawings,
    /// Histories, energies, iterations.
    pub curves: Drawings,
    /// What was missing or left out, one line each.
    pub notes: Vec<String>,
}

/// Draws the figures that a result allows. The bodies are shown at the steps nearest to `times`
/// \[s\], or at the first, the middle and the last.
///
/// # Errors
/// The folder is not a result of this program, or a table is broken.
pub fn album(folder: &Path, times: &[f64]) -> Result<Album> {
    let mut notes = Vec::new();
    let run = Run::read(folder, &mut notes)?;
    let display = Display::of(&[run.units]);
    let times: Vec<f64> = times.iter().map(|time| time / run.units.si_value("s")).collect();
    let shots = grid::shots(folder, &times, &mut notes).into_iter();
    let shots: Vec<_> = shots.map(|shot| (String::new(), shot.shown(run.units, &display))).collect();
    let mut bodies = Vec::new();
    for (name, shown) in [("deformed_pressure", Shown::Pressure), ("deformed_von_mises", Shown::VonMises)] {
        bodies.extend(deformed::figure(&shots, shown, &display)?.map(|svg| (name.to_string(), svg)));
    }
    let mut drawn = Vec::new();
    for (name, figure) in curves::figures(&[run])? {
        drawn.push((name, figure.svg()?));
    }
    Ok(Album { bodies, curves: drawn, notes })
}

#[cfg(test)]
mod tests;
