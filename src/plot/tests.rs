//! End-to-end tests: results are written by the program's writers, drawn, and inspected. Set
//! `FIGURES` to a folder to keep the pictures.

use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Deserialize;

use crate::contact::point::Status;
use crate::error::Cause;
use crate::observe::energy::{ENERGY_COLUMNS, ENERGY_FILE, Energies};
use crate::observe::fields::{Field, FieldValues, Location};
use crate::observe::probes::{PROBE_FILE, Watched, word};
use crate::observe::quantity::{ReportedQuantity, TableFile, headings};
use crate::output::fields::{Cells, FieldWriter, Ranks};
use crate::output::folder::ResultsFolder;
use crate::output::folder::tests::Scratch;
use crate::output::grids::{GridCells, GridFields};
use crate::output::iterations::{IterationRow, IterationTable};
use crate::output::record::{Record, Totals, Verdict};
use crate::output::table::{Cell, Table};

use super::plot;
use crate::case::Units;

/// Writes an artificial run in `D` dimensions on two ranks, complete with all files; `friction`
/// changes its curves.
fn write_run<const D: usize>(path: &Path, title: &str, friction: f64) {
    let (folder, _lock) = ResultsFolder::create(path).unwrap();
    let probe = |name: &str| Watched::<D> {
        name: name.into(),
        line: 0,
        rank: 0,
        node: 0,
        place: [0.0; D],
        distance: 0.0,
        contact: Some(0),
    };
    let open = |file: &TableFile, columns: Vec<String>| {
        Table::create(&path.join(file.name), file.headings(columns)).unwrap()
    };
    let columns = ["node_50", "node_98"].iter().flat_map(|name| probe(name).headings()).collect();
    let mut probe_table = open(&PROBE_FILE, columns);
    let columns = headings::<D>(ENERGY_COLUMNS.iter().map(|column| &column.quantity));
    let mut energy = open(&ENERGY_FILE, columns);
    let mut iterations = IterationTable::open(path, Units::SI, None).unwrap();
    for step in 0..=140 {
        let time = f64::from(step) * 5e-4;
        let head = [Cell::Count(step.into()), Cell::Number(time)];
        let mut cells = head.to_vec();
        cells.push(Cell::Number(5e-4));
        cells.extend([0.3, 1.0].iter().flat_map(|share| probe_row::<D>(time, share * friction)));
        probe_table.row(&cells).unwrap();
        let energies = ledger(time, friction);
        let cells = ENERGY_COLUMNS.iter().flat_map(|column| column.cells::<D>(&energies));
        energy.row(&head.into_iter().chain(cells).collect::<Vec<_>>()).unwrap();
        for iteration in 0..(3 + (step * 7 % 5) / 2) {
            iterations.row(&iteration_row(step, time, iteration)).unwrap();
        }
    }
    for rank in [1, 0] {
        write_fields::<D>(path, rank, &[(140, 0.07)]);
    }
    record(title, Verdict::Completed).write(folder.path()).unwrap();
}

fn record(title: &str, verdict: Verdict) -> Record {
    Record {
        units: Units::SI,
        case: serde_json::json!({"title": title}),
        inputs: vec![],
        versions: vec![],
        petsc_options: String::new(),
        ranks: 2,
        blas_threads: None,
        unknowns: 1,
        start: SystemTime::now(),
        totals: Totals::default(),
        simulated_time: 0.07,
        wall_seconds: 1.0,
        phases: vec![],
        start_phases: vec![],
        peak_memory: vec![],
        held: None,
        accuracy: None,
        digest: String::new(),
        balance: Default::default(),
        tables: Default::default(),
        warnings: vec![],
        penetrations: vec![],
        verdict,
    }
}

/// The cells of a probe in the order of its headings.
fn probe_row<const D: usize>(time: f64, friction: f64) -> Vec<Cell<'static>> {
    let contact_pressure =
        (3.6e5 * (1.0 - time / 0.05 * (1.2 - friction)) + 4e4 * (900.0 * time).sin()).max(0.0);
    let status = if contact_pressure == 0.0 { Status::Open } else { Status::Slip };
    let traction_t = -contact_pressure * friction * (1.0 - (-time / 0.004).exp());
    let mut u = [0.0; D];
    u[0] = 0.012 * (1.0 - friction * 0.5) * (1.0 - (PI * time / 0.05).cos());
    u[D - 1] = -0.05 - 0.002 * (900.0 * time).sin();
    let mut v = [0.0; D];
    v[0] = 0.012 * (1.0 - friction * 0.5) * PI / 0.05 * (PI * time / 0.05).sin();
    let motion = u.into_iter().chain(v).map(Cell::Number);
    let contact = [contact_pressure, traction_t].map(Cell::Number);
    let last = [Cell::Absent, Cell::Number(0.1), Cell::Text(word(status))];
    motion.chain(contact).chain(last).collect()
}

fn ledger(time: f64, friction: f64) -> Energies {
    let s = time / 0.07;
    let (kinetic, strain) = (40.0 + 60.0 * s * (1.0 - friction * s).abs(), 3000.0 + 900.0 * s * friction);
    Energies {
        kinetic,
        strain,
        viscous_stored: 0.0,
        contact: 15.0,
        springs: 0.0,
        friction_dissipated: 700.0 * s * s * friction,
        damping_dissipated: 0.0,
        viscous_dissipated: 0.0,
        external_work: 1500.0 * s,
        numerical: -3.0 * s,
    }
}

fn iteration_row(step: u32, time: f64, iteration: u32) -> IterationRow {
    IterationRow {
        step: step.into(),
        time,
        dt: 5e-4,
        attempt: 1,
        stage: "monolithic",
        iteration: iteration.into(),
        residual: Some(1.0),
        increment: None,
        krylov_iterations: 8,
        points: 49,
        changed: 0,
        line_search: None,
        contraction: None,
    }
}

/// Writes the fields of a box of `cells` cells per side (the last twice as many along x), with its
/// right half on rank 1. The bottom is in contact. The fields are the same at all `steps`, which
/// are step numbers with their times.
fn write_fields<const D: usize>(path: &Path, rank: usize, steps: &[(u64, f64)]) {
    let cells = if D == 2 { 24 } else { 8 };
    let side: usize = cells + 1;
    let count = side.pow(D as u32);
    let place = |node: usize, axis: usize| (node / side.pow(axis as u32) % side) as f64 / cells as f64 * 0.5;
    let points: Vec<[f64; D]> =
        (0..count).map(|node| std::array::from_fn(|axis| place(node, axis))).collect();
    let corners: Vec<usize> = (0..1 << D).map(|c| [0, 1, 3, 2, 4, 5, 7, 6][c]).collect();
    let grid = |dimension: usize| -> Vec<u32> {
        let starts =
            (0..count).filter(|&node| (0..dimension).all(|a| node / side.pow(a as u32) % side < cells));
        let starts = starts.filter(|&node| dimension == D || node < side.pow(dimension as u32));
        let step = |c: usize| (0..dimension).map(|a| (c >> a & 1) * side.pow(a as u32)).sum::<usize>();
        starts
            .flat_map(|node| corners[..1 << dimension].iter().map(move |&c| (node + step(c)) as u32))
            .collect()
    };
    let (volume, surface) = (grid(D), grid(D - 1));
    let per_cell = 1 << D;
    let centre = |nodes: &[u32]| points[nodes[0] as usize];
    let is_mine = |nodes: &[u32]| (centre(nodes)[0] >= 0.25) == (rank == 1);
    let u: Vec<f64> = points.iter().flat_map(bend).collect();
    let stress: Vec<f64> = volume.chunks(per_cell).flat_map(|nodes| stress(&centre(nodes))).collect();
    let pressure: Vec<f64> = points.iter().map(|x| 4e5 * x[0] * (0.6 - x[0]) / 0.09).collect();
    let numbers: Vec<u32> = (0..count as u32).collect();
    let mine = [&volume, &surface].map(|nodes| {
        let size = if std::ptr::eq(nodes, &volume) { per_cell } else { per_cell / 2 };
        nodes.chunks(size).map(is_mine).collect::<Vec<bool>>()
    });
    let ends = |count: usize, size: usize| (0..=count).map(|i| (i * size) as u32).collect::<Vec<_>>();
    let offsets = [ends(mine[0].len(), per_cell), ends(mine[1].len(), per_cell / 2)];
    let types = [if D == 2 { 9 } else { 12 }, if D == 2 { 3 } else { 9 }];
    let types: [Vec<u8>; 2] = [0, 1].map(|i| vec![types[i]; mine[i].len()]);
    let group = [0, 1].map(|i| vec![0; mine[i].len()]);
    let cells = |i: usize| Cells {
        points: &points,
        node_number: &numbers,
        offsets: &offsets[i],
        nodes: [&volume, &surface][i],
        vtk_types: &types[i],
        mine: &mine[i],
        group: &group[i],
        materials: None,
    };
    let grids = GridCells { volume: cells(0), surface: Some(cells(1)), rigid: None };
    let mut writer = FieldWriter::new(path, Ranks { rank, size: 2 }, &grids).unwrap();
    let det_f = vec![0.95; mine[0].len()];
    let field = |quantity: ReportedQuantity, location: Location, values: &[f64]| Field {
        quantity,
        location,
        values: FieldValues::Numbers(values.to_vec()),
    };
    let at_nodes = |quantity: ReportedQuantity, values: &[f64]| field(quantity, Location::Nodes, values);
    let displacement = at_nodes(ReportedQuantity::vector("displacement", "m", ""), &u);
    let fields = [
        displacement.clone(),
        field(ReportedQuantity::symmetric_tensor("cauchy_stress", "Pa", ""), Location::Elements, &stress),
        field(ReportedQuantity::number("det_f", "", ""), Location::Elements, &det_f),
    ];
    let surface = [displacement, at_nodes(ReportedQuantity::number("contact_pressure", "Pa", ""), &pressure)];
    for &(step, time) in steps {
        let fields = GridFields { volume: &fields, surface: Some(&surface), rigid: None };
        writer.write(step, &fields).unwrap();
        if rank == 0 {
            writer.publish(step, time).unwrap();
        }
    }
}

fn bend<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let mut u = [0.0; D];
    let height = x[D - 1] / 0.5;
    u[0] = 0.15 * height * height + 0.01;
    u[D - 1] = -0.05 * height + 0.08 * height * (0.5 - x[0]) * (1.0 - height);
    u
}

fn stress<const D: usize>(x: &[f64; D]) -> [f64; 6] {
    let share = (x[0] / 0.5 + 1.0 - x[D - 1] / 0.5) / 2.0;
    [0.0, -1.2e6 * share * share, 0.0, 3e5 * (PI * x[0]).sin(), 0.0, 0.0]
}

fn figures_in(folder: &Path, files: &[PathBuf]) -> Vec<String> {
    assert!(files.iter().all(|file| file.parent() == Some(folder)));
    if let Some(kept) = std::env::var_os("FIGURES") {
        let kept = PathBuf::from(kept).join(folder.file_name().unwrap());
        fs::create_dir_all(&kept).unwrap();
        files.iter().for_each(|file| _ = fs::copy(file, kept.join(file.file_name().unwrap())).unwrap());
    }
    files.iter().map(|file| file.file_stem().unwrap().to_string_lossy().into_owned()).collect()
}

const ALL: [&str; 12] = [
    "contact_stresses_node_50",
    "displacement_node_50",
    "phase_plane_node_50",
    "contact_stresses_node_98",
    "displacement_node_98",
    "phase_plane_node_98",
    "vertical_motion",
    "normal_stresses",
    "energy",
    "iterations",
    "deformed_von_mises",
    "deformed_pressure",
];

/// One run in 2D gives every figure. Figures over time have the strokes that they need.
#[test]
fn one_run_gives_every_figure() {
    let scratch = Scratch::new("plot-one");
    let path = scratch.0.join("rubber-block");
    write_run::<2>(&path, "Rubber block dragged over a rigid foundation", 1.0);
    let figures = scratch.0.join("one");
    let plotted = plot(std::slice::from_ref(&path), Some(&figures)).unwrap();
    assert_eq!(figures_in(&figures, &plotted.files), ALL);
    assert_eq!(plotted.notes, [""; 0]);
    let svg = fs::read_to_string(figures.join("contact_stresses_node_98.svg")).unwrap();
    assert!(
        svg.contains("Contact stresses at node_98: Rubber block")
            && svg.contains("contact stress (MPa)")
            && svg.contains("time (ms)")
    );
    let normal = svg.matches("stroke=\"#0072B2\"").count();
    let tangential = svg.matches("stroke=\"#D55E00\"").count();
    assert!(normal == 2 && tangential > 10, "solid {normal}, dashed {tangential}");
    let together = fs::read_to_string(figures.join("normal_stresses.svg")).unwrap();
    assert!(["node_50", "node_98", "normal stress (MPa)"].iter().all(|text| together.contains(text)));
    let plane = fs::read_to_string(figures.join("phase_plane_node_50.svg")).unwrap();
    assert!(plane.contains("horizontal velocity (m/s)") && !plane.contains("time ("));
    let deformed = fs::read_to_string(figures.join("deformed_von_mises.svg")).unwrap();
    assert!(deformed.matches("<polygon").count() >= 24 * 24, "the cells of both ranks");
    let inside = plot(std::slice::from_ref(&path), None).unwrap();
    assert!(inside.files.iter().all(|file| file.starts_with(path.join("figures"))));
}

/// Several runs are drawn in the same figures, with each title in the legend.
#[test]
fn several_runs_are_compared() {
    let scratch = Scratch::new("plot-many");
    let titles = ["Coulomb, µ = 1", "Grosch–Schallamach, µ₀ = 1", "Power law, m_N = 2 <a>", "Coulomb, µ = 1"];
    let paths: Vec<PathBuf> = (0..4).map(|i| scratch.0.join(format!("run-{i}"))).collect();
    for (index, (path, title)) in paths.iter().zip(titles).enumerate() {
        write_run::<2>(path, title, 1.0 - 0.2 * index as f64);
    }
    let figures = scratch.0.join("many");
    let plotted = plot(&paths, Some(&figures)).unwrap();
    assert_eq!(figures_in(&figures, &plotted.files), ALL);
    for file in &plotted.files {
        let svg = fs::read_to_string(file).unwrap();
        for title in ["Coulomb, µ = 1 (run-0)", "Coulomb, µ = 1 (run-3)", "Power law, m_N = 2 &lt;a&gt;"] {
            assert!(svg.contains(title), "{title} in {}", file.display());
        }
    }
}

/// A run in 3D gives the same figures as one in 2D.
#[test]
fn a_run_in_space_gives_every_figure() {
    let scratch = Scratch::new("plot-space");
    let path = scratch.0.join("cube");
    write_run::<3>(&path, "Rubber cube, pressed and dragged", 0.7);
    let figures = scratch.0.join("space");
    let plotted = plot(&[path], Some(&figures)).unwrap();
    assert_eq!(figures_in(&figures, &plotted.files), ALL);
}

/// The times of a report are in seconds, whatever the unit of time of the results.
#[test]
fn times_of_a_report_are_in_seconds() {
    let scratch = Scratch::new("report-times");
    write_run::<2>(&scratch.0, "Milliseconds", 1.0);
    let units = serde_json::json!({ "length": "m", "mass": "kg", "time": "ms" });
    let units = Units::deserialize(&units).unwrap();
    Record { units, ..record("Milliseconds", Verdict::Completed) }.write(&scratch.0).unwrap();
    for rank in [1, 0] {
        write_fields::<2>(&scratch.0, rank, &[(0, 0.0), (70, 35.0), (140, 70.0)]);
    }
    let album = super::album(&scratch.0, &[0.035]).unwrap();
    let (_, bodies) = &album.bodies[0];
    assert!(bodies.contains("t = 35 ms") && !bodies.contains("t = 0"), "{:?}", album.notes);
}

/// A killed run is drawn up to its last complete data. A truncated row and a missing piece are left
/// out with a note each.
#[test]
fn a_killed_run_is_drawn_as_far_as_it_goes() {
    let scratch = Scratch::new("plot-killed");
    let path = scratch.0.join("killed");
    write_run::<2>(&path, "Killed", 1.0);
    record("Killed", Verdict::Running).write(&path).unwrap();
    let energy = fs::read(path.join("energy.csv")).unwrap();
    fs::write(path.join("energy.csv"), &energy[..energy.len() / 2 + 3]).unwrap();
    let piece = path.join("fields/step_000140/volume_0001.vtu");
    let bytes = fs::read(&piece).unwrap();
    fs::write(&piece, &bytes[..bytes.len() / 2]).unwrap();
    fs::remove_file(path.join("iterations.csv")).unwrap();
    let plotted = plot(std::slice::from_ref(&path), None).unwrap();
    assert_eq!(figures_in(&path.join("figures"), &plotted.files), ALL[..9]);
    let notes = plotted.notes.join("\n");
    for part in [
        "has not completed",
        "energy.csv: the last row is truncated",
        "iterations.csv: file not found",
        "volume_0001.vtu",
    ] {
        assert!(notes.contains(part), "{part} in {notes}");
    }
}

/// A folder that is not a results folder, and an empty results folder, are errors of cause `File`.
#[test]
fn other_folders_are_refused() {
    let scratch = Scratch::new("plot-none");
    for path in [scratch.0.clone(), scratch.0.join("absent")] {
        assert_eq!(plot(&[path], None).unwrap_err().cause, Cause::File);
    }
    let fresh = scratch.0.join("fresh");
    ResultsFolder::create(&fresh).unwrap();
    let error = plot(&[fresh], None).unwrap_err();
    assert!(error.cause == Cause::File && error.message.contains("nothing to draw yet"), "{error}");
    assert_eq!(plot(&[], None).unwrap_err().cause, Cause::Usage);
}
