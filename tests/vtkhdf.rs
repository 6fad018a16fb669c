//! `output: { fields: { format: vtkhdf } }`: one file for all ranks and steps. It holds what the VTU
//! pieces hold, as `h5dump` reads it, on any number of ranks, also if one owns nothing, and after a
//! restart.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use common::{ENVIRONMENT, Folder, Running, SMALL_BLOCK, assert_says, run};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;
use contact_petsc::output::{pvd, pvtu};

/// The small block with fields at each step. Two runs on the same ranks have the same bits, which MUMPS on
/// several ranks does not give.
fn case(fields: &str) -> String {
    let output = format!(
        "output: {{ fields: {{ every: 1, {fields} }}, checkpoint: {{ every: 2, keep: 9 }} }}\n\
         solver: {{ linear: gmres_asm_ilu }}"
    );
    SMALL_BLOCK.replace("output: { probes: { corner: { at: [0, 0] } } }", &output)
}

/// Runs the case on some ranks.
#[track_caller]
fn results(text: &str, ranks: usize) -> Folder {
    let folder = Folder::new("vtkhdf");
    folder.write("case.yml", text);
    run(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).success();
    folder
}

/// A file, read by `h5dump`.
struct Dump(PathBuf);

impl Dump {
    fn of(folder: &Folder, name: &str) -> Self {
        Self(folder.join("out").join(name))
    }

    #[track_caller]
    fn call(&self, arguments: &[&str]) -> String {
        let mut command = Command::new("h5dump");
        let output = command.args(arguments).arg(&self.0).envs(ENVIRONMENT).output();
        let output = output.expect("h5dump of the Debian package hdf5-tools");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success(),
            "{arguments:?}: {text}\n{}",
            String::from_utf8_lossy(&output.stderr)
        );
        text
    }

    /// All numbers of a dataset, as little-endian bytes of the type in the file.
    #[track_caller]
    fn bytes(&self, dataset: &str) -> Vec<u8> {
        let into = Folder::new("dump");
        let target = into.join("raw");
        let dataset = format!("/VTKHDF/{dataset}");
        self.call(&["-d", &dataset, "-b", "LE", "-o", target.to_str().expect("UTF-8")]);
        // Nothing is written for a dataset without rows.
        fs::read(target).unwrap_or_default()
    }

    #[track_caller]
    fn integers(&self, dataset: &str) -> Vec<i64> {
        let bytes = self.bytes(dataset);
        bytes.as_chunks::<8>().0.iter().map(|&number| i64::from_le_bytes(number)).collect()
    }

    #[track_caller]
    fn floats(&self, dataset: &str) -> Vec<f64> {
        let bytes = self.bytes(dataset);
        bytes.as_chunks::<8>().0.iter().map(|&number| f64::from_le_bytes(number)).collect()
    }

    fn steps(&self) -> usize {
        let header = self.call(&["-a", "/VTKHDF/Steps/NSteps"]);
        let value = header.split("(0): ").nth(1).and_then(|rest| rest.split_whitespace().next());
        value.and_then(|value| value.parse().ok()).expect("NSteps")
    }
}

/// The values of an array in the order of the file, as numbers.
type Values = Vec<f64>;

/// A grid at one step: the mesh by parts, and all arrays.
#[derive(Debug, Default, PartialEq)]
struct Snapshot {
    time: f64,
    /// Numbers of points and cells of the parts.
    parts: Vec<[usize; 2]>,
    points: Values,
    /// Of all parts, which count their own points.
    connectivity: Vec<i64>,
    offsets: Vec<i64>,
    types: Vec<u8>,
    /// Number of components and values of the arrays on points and on cells.
    data: BTreeMap<String, (usize, Values)>,
}

impl Snapshot {
    /// The rows of an array by the number of the node, which does not depend on the ranks.
    fn by_node(&self, name: &str) -> BTreeMap<i64, Values> {
        let numbers = &self.data["PointData/node"].1;
        let (components, values) = &self.data[&format!("PointData/{name}")];
        let rows = values.chunks_exact(*components).map(<[f64]>::to_vec);
        numbers.iter().map(|&number| number as i64).zip(rows).collect()
    }
}

/// The number of components and the numbers of arrays of the VTU pieces.
fn numbers(values: &VtuValues) -> Values {
    match values {
        VtuValues::Float64(values) => values.clone(),
        VtuValues::Int32(values) => values.iter().map(|&value| f64::from(value)).collect(),
        VtuValues::UInt8(values) => values.iter().map(|&value| f64::from(value)).collect(),
    }
}

/// The files of all grids, and the series of their pieces.
const GRIDS: [(&str, &str); 3] =
    [("fields.vtkhdf", "fields.pvd"), ("contact.vtkhdf", "contact.pvd"), ("rigid.vtkhdf", "rigid.pvd")];

/// All steps of a grid from its VTU pieces of this many ranks. Those without a piece have empty parts.
fn of_pieces(folder: &Folder, series: &str, ranks: usize) -> Vec<Snapshot> {
    let out = folder.join("out");
    let entries = pvd::read(&out.join(series)).expect("a series");
    let mut snapshots = Vec::new();
    for entry in entries.iter().filter(|entry| entry.part == 0) {
        let index = out.join(&entry.file);
        let mut all = Snapshot { time: entry.time, ..Snapshot::default() };
        for source in pvtu::read(&index).expect("an index") {
            let piece = read_piece(&index.parent().expect("a folder").join(source)).expect("a piece");
            all.parts.push([piece.points.len(), piece.types.len()]);
            all.points.extend(piece.points.iter().flatten());
            all.connectivity.extend(piece.connectivity.iter().map(|&point| i64::from(point)));
            all.offsets.extend(std::iter::once(0).chain(piece.offsets.iter().map(|&end| i64::from(end))));
            all.types.extend(&piece.types);
            for (place, fields) in [("PointData", &piece.point_data), ("CellData", &piece.cell_data)] {
                for (name, field) in fields {
                    let array = all.data.entry(format!("{place}/{name}")).or_default();
                    array.0 = field.components;
                    array.1.extend(numbers(&field.values));
                }
            }
        }
        let without = ranks - all.parts.len();
        all.parts.extend(vec![[0, 0]; without]);
        all.offsets.extend(vec![0; without]);
        snapshots.push(all);
    }
    snapshots
}

/// All steps of a grid from its VTKHDF file. The arrays to read are those of `like`.
fn of_file(file: &Dump, like: &Snapshot) -> Vec<Snapshot> {
    let list = |name: &str| file.integers(name).into_iter().map(|n| n as usize).collect::<Vec<_>>();
    let step_list = |name: &str| list(&format!("Steps/{name}"));
    let [points_of, cells_of, ids_of] =
        ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"].map(list);
    let [part, parts, point, cell, id] =
        ["PartOffsets", "NumberOfParts", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"]
            .map(step_list);
    let points = file.floats("Points");
    let [connectivity, offsets] = ["Connectivity", "Offsets"].map(|name| file.integers(name));
    let types = file.bytes("Types");
    let times = file.floats("Steps/Values");
    let arrays: BTreeMap<&String, (Values, Vec<usize>)> = like
        .data
        .keys()
        .map(|name| {
            let values = match name.as_str() {
                "PointData/node" | "CellData/body" | "CellData/rank" | "CellData/contact"
                | "CellData/rigid" => {
                    let bytes = file.bytes(name);
                    bytes.as_chunks::<4>().0.iter().map(|&n| f64::from(i32::from_le_bytes(n))).collect()
                }
                "PointData/status" => file.bytes(name).into_iter().map(f64::from).collect(),
                _ => file.floats(name),
            };
            let (place, own) = name.split_once('/').expect("a group and a name");
            (name, (values, step_list(&format!("{place}Offsets/{own}"))))
        })
        .collect();
    let snapshot = |step: usize| {
        let own = part[step]..part[step] + parts[step];
        let [all_points, all_cells, all_ids] =
            [&points_of, &cells_of, &ids_of].map(|counts| counts[own.clone()].iter().sum::<usize>());
        let ends = cell[step] + part[step];
        let data = arrays.iter().map(|(name, (values, starts))| {
            let components = like.data[*name].0;
            let count = if name.starts_with("Point") { all_points } else { all_cells };
            let rows = components * starts[step]..components * (starts[step] + count);
            ((*name).clone(), (components, values[rows].to_vec()))
        });
        Snapshot {
            time: times[step],
            parts: own.clone().map(|part| [points_of[part], cells_of[part]]).collect(),
            points: points[3 * point[step]..3 * (point[step] + all_points)].to_vec(),
            connectivity: connectivity[id[step]..id[step] + all_ids].to_vec(),
            offsets: offsets[ends..ends + all_cells + parts[step]].to_vec(),
            types: types[cell[step]..cell[step] + all_cells].to_vec(),
            data: data.collect(),
        }
    };
    let steps = file.steps();
    assert!(times.len() == steps && part.len() == steps, "{steps} steps, {} instants", times.len());
    (0..steps).map(snapshot).collect()
}

/// All grids of a run in both formats are equal, number by number.
#[track_caller]
fn compare(text: impl Fn(&str) -> String, ranks: usize) -> Vec<Snapshot> {
    let pieces = results(&text("vtu"), ranks);
    let one = results(&text("vtkhdf"), ranks);
    let mut bodies = Vec::new();
    for (name, series) in GRIDS {
        let known = of_pieces(&pieces, series, ranks);
        let found = of_file(&Dump::of(&one, name), &known[0]);
        assert_eq!(known.len(), 5);
        if let Some((known, found)) = known.iter().zip(&found).find(|(known, found)| known != found) {
            panic!("{name} on {ranks} ranks:\n{known:?}\n{found:?}");
        }
        assert_eq!(known.len(), found.len());
        if series == "fields.pvd" {
            bodies = found;
        }
    }
    bodies
}

/// The file holds the fields of the pieces on one to three ranks, also with nodal stresses.
#[test]
fn the_fields_are_those_of_the_pieces() {
    for ranks in [1, 2, 3] {
        let more = if ranks == 2 { ", stresses: true" } else { "" };
        let found = compare(|format| case(&format!("format: {format}{more}")), ranks);
        assert_eq!(found[4].parts.len(), ranks);
        assert!(found.iter().any(|step| step.data["PointData/displacement"].1.iter().any(|&u| u != 0.0)));
    }
}

/// A rank that owns nothing has an empty part.
#[test]
fn a_rank_may_own_nothing() {
    let text = |format: &str| case(&format!("format: {format}")).replace("[4, 4]", "[1, 2]");
    let found = compare(text, 3);
    assert!(found[4].parts.contains(&[0, 0]), "{:?}", found[4].parts);
}

/// The attributes and types are those of the format, and the number of files does not depend on steps
/// and ranks.
#[test]
fn the_file_follows_the_format() {
    let folder = results(&case("format: vtkhdf"), 2);
    let names = fs::read_dir(folder.join("out")).expect("results").flatten();
    let files = names.filter(|entry| entry.path().extension().is_some_and(|end| end == "vtkhdf"));
    assert_eq!(files.count(), GRIDS.len());
    assert!(!folder.join("out/fields").exists() && !folder.join("out/fields.pvd").exists());
    for (name, _) in GRIDS {
        let file = Dump::of(&folder, name);
        let kind = file.call(&["-a", "/VTKHDF/Type"]);
        assert_says(&kind, &["STRSIZE 16;", "H5T_CSET_ASCII", "SCALAR", "\"UnstructuredGrid\""]);
        assert_says(&file.call(&["-a", "/VTKHDF/Version"]), &["H5T_STD_I64LE", "( 2 )", "(0): 2, 0"]);
        assert_says(&file.call(&["-a", "/VTKHDF/Steps/NSteps"]), &["H5T_STD_I64LE", "SCALAR", "(0): 5"]);
        for (dataset, kind, size) in [
            ("NumberOfPoints", "H5T_STD_I64LE", "( 2 )"),
            ("NumberOfCells", "H5T_STD_I64LE", "( 2 )"),
            ("NumberOfConnectivityIds", "H5T_STD_I64LE", "( 2 )"),
            ("Points", "H5T_IEEE_F64LE", ", 3 )"),
            ("Connectivity", "H5T_STD_I64LE", "( "),
            ("Offsets", "H5T_STD_I64LE", "( "),
            ("Types", "H5T_STD_U8LE", "( "),
            ("PointData/displacement", "H5T_IEEE_F64LE", ", 3 )"),
            ("Steps/Values", "H5T_IEEE_F64LE", "( 5 )"),
            ("Steps/PartOffsets", "H5T_STD_I64LE", "( 5 )"),
            ("Steps/NumberOfParts", "H5T_STD_I64LE", "( 5 )"),
            ("Steps/PointOffsets", "H5T_STD_I64LE", "( 5 )"),
            ("Steps/CellOffsets", "H5T_STD_I64LE", "( 5, 1 )"),
            ("Steps/ConnectivityIdOffsets", "H5T_STD_I64LE", "( 5, 1 )"),
            ("Steps/PointDataOffsets/displacement", "H5T_STD_I64LE", "( 5 )"),
        ] {
            let header = file.call(&["-H", "-d", &format!("/VTKHDF/{dataset}")]);
            assert_says(&header, &[&format!("DATATYPE  {kind}"), size]);
        }
        // The mesh is written once, although there are five steps.
        assert_eq!(file.integers("Steps/PointOffsets"), [0; 5]);
    }
}

/// A run that is resumed on the same or another number of ranks continues the file. Steps after the
/// checkpoint are replaced.
#[test]
fn a_restart_continues_the_file() {
    let text = case("format: vtkhdf");
    let whole = results(&text, 2);
    let pieces = results(&case("format: vtu"), 2);
    for ranks in [2, 3] {
        let folder = Folder::new("resumed");
        folder.write("case.yml", &text);
        run(2, &["case.yml", "--output", "out", "--quiet"], &folder).success();
        let checkpoint = "out/checkpoints/step-000002.ckpt";
        let from = format!("--restart={checkpoint}");
        run(ranks, &["case.yml", "--output", "out", "--quiet", &from], &folder).success();
        for (name, series) in GRIDS {
            let like = &of_pieces(&pieces, series, 2)[0];
            let known = of_file(&Dump::of(&whole, name), like);
            let found = of_file(&Dump::of(&folder, name), like);
            assert_eq!(found.len(), 5);
            for (known, found) in known.iter().zip(&found) {
                assert_eq!(known.time, found.time);
                if ranks == 2 {
                    assert!(known == found, "{name} at {}", known.time);
                }
                for (node, u) in known.by_node("displacement") {
                    let other = &found.by_node("displacement")[&node];
                    assert!(u.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-10), "{u:?} {other:?}");
                }
            }
            // The process that resumed wrote its mesh behind that of the first one.
            let parts = Dump::of(&folder, name).integers("Steps/NumberOfParts");
            assert_eq!(parts, [2, 2, 2, ranks as i64, ranks as i64]);
            let size = |name: &Path| fs::metadata(name).expect("a file").len();
            assert!(size(&folder.join("out").join(name)) < 2 * size(&whole.join("out").join(name)));
        }
    }
}

/// Another format at a restart is refused, and so is a file that is damaged.
#[test]
fn a_restart_needs_the_file() {
    let folder = results(&case("format: vtkhdf"), 1);
    folder.write("case.yml", &case("format: vtu"));
    let refused = run(1, &["case.yml", "--output", "out", "--restart"], &folder);
    assert_eq!(refused.code, Some(3), "{}", refused.text());
    assert_says(&refused.stderr, &["differs", "fields", "format vtkhdf"]);
    folder.write("case.yml", &case("format: vtkhdf"));
    fs::write(folder.join("out/fields.vtkhdf"), "no HDF5").expect("a damaged file");
    let from = "--restart=out/checkpoints/step-000002.ckpt";
    let refused = run(2, &["case.yml", "--output", "out", from], &folder);
    assert_eq!(refused.code, Some(4), "{}", refused.text());
    assert_says(&refused.stderr, &["fields.vtkhdf", "remove this file"]);
}

/// A run that is killed between two outputs leaves a file with all steps that it counts, from which a
/// restart continues.
#[test]
fn a_killed_run_leaves_its_steps() {
    let folder = Folder::new("killed");
    folder.write("case.yml", &case("format: vtkhdf").replace("end: 0.002", "end: 0.5"));
    let mut running = Running::start(2, &["case.yml", "--output", "out", "--quiet"], &folder);
    let deadline = Instant::now() + Duration::from_secs(120);
    while !folder.join("out/checkpoints/step-000010.ckpt").exists() {
        assert!(running.goes_on() && Instant::now() < deadline, "no checkpoint appears");
        std::thread::sleep(Duration::from_millis(5));
    }
    // Kills the run.
    drop(running);
    let file = Dump::of(&folder, "fields.vtkhdf");
    let steps = file.steps();
    assert!(steps > 5, "{steps}");
    assert!(file.floats("Steps/Values").len() >= steps);
    let u = file.floats("PointData/displacement");
    let node = file.integers("NumberOfPoints").iter().sum::<i64>() as usize;
    assert!(u.len() >= 3 * node * steps && u.iter().all(|value| value.is_finite()));
}

/// A run that finds too little space ends with an error on all ranks, and the file keeps all steps.
#[test]
fn a_full_disk_leaves_the_steps() {
    for ranks in [1, 3] {
        let folder = Folder::new("full");
        let text = case("format: vtkhdf").replace("[4, 4]", "[30, 30]").replace("end: 0.002", "end: 0.5");
        folder.write("case.yml", &text);
        // MPI needs 4 MiB.
        let script = format!("ulimit -f 5000; mpirun -n {ranks} contact-petsc case.yml --output out --quiet");
        let full = Running::script(ranks, &script, &folder).wait(Duration::from_secs(240));
        assert_eq!(full.code, Some(4), "{}", full.text());
        assert_says(&full.text(), &["fields.vtkhdf: can not write", "ulimit -f unlimited"]);
        let file = Dump::of(&folder, "fields.vtkhdf");
        let steps = file.steps();
        assert!(steps > 10, "{steps}");
        assert_eq!(file.floats("Steps/Values").len(), steps);
        let points: i64 = file.integers("NumberOfPoints").iter().sum();
        assert_eq!(file.floats("PointData/displacement").len(), 3 * points as usize * steps);
    }
}

/// Unknown formats are refused with their position.
#[test]
fn an_unknown_format_is_refused() {
    let folder = Folder::new("unknown");
    folder.write("case.yml", &case("format: vtkhd"));
    let refused = run(0, &["check", "case.yml"], &folder);
    assert_eq!(refused.code, Some(3));
    assert_says(&refused.stderr, &["case.yml:20:", "'vtkhd'", "vtu, vtkhdf", "did you mean 'vtkhdf'"]);
}
