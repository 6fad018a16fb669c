//! Hostile input: deep nesting, endless aliases, counts of 10^12 in a file of a kilobyte, lines of
//! a gigabyte. Each is refused within 20 seconds of CPU and within 100 MB, measured in a separate
//! process.
//!
//! The findings of the fuzz targets (`fixtures/fuzz`, see `fuzz/README.md`) are read here too.

mod common;

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use common::Folder;
use contact_petsc::case::{Case, Function};
use contact_petsc::checkpoint;
use contact_petsc::error::Error;
use contact_petsc::mesh::{PlaneState, abaqus, gmsh, read_file};
use contact_petsc::model::read_mesh;
use contact_petsc::output::vtu_reader;
use contact_petsc::plot::Csv;
use nix::sys::resource::{Resource, UsageWho, getrusage, setrlimit};

/// CPU seconds that an input may take. The slowest input takes one second in the profile of the tests,
/// so this finds work without end or with the square of the input, also on a slow or busy machine.
const LIMIT: u64 = 20;
/// Limit of memory above that of the process before the input.
const MEMORY: u64 = 100 << 20;

const TRILLION: u64 = 1_000_000_000_000;

const CASE: &str = "dimension: 2\nbodies:\n  a:\n    mesh: { box: { min: [0, 0], max: [1, 1], cells: [CELLS] } }\n    \
    material: { neo_hookean: { young_modulus: 1, poisson_ratio: 0.3 } }\nboundary:\n  \
    hold: { on: a.top, displacement: { x: 0, y: VALUE } }\ntime: { end: 1, scheme: { static: { increments: 1 } } }\n";

/// The input: bytes, or a file that is mostly a hole.
enum Input {
    Case(String),
    /// A case whose mesh is read as well.
    Box(String),
    Mesh(Vec<u8>),
    /// A mesh as an input file of Abaqus.
    Deck(String),
    Checkpoint(Vec<u8>),
    Field(Vec<u8>),
    Table(Vec<u8>),
    Expression(String),
    /// A file that begins with these bytes and continues with zeros for a gigabyte. Its name
    /// determines its kind.
    Gigabyte(&'static str, &'static [u8]),
}

fn value(value: &str) -> String {
    CASE.replace("CELLS", "1, 1").replace("VALUE", value)
}

fn cells(cells: &str) -> Input {
    Input::Box(CASE.replace("CELLS", cells).replace("VALUE", "0"))
}

/// A case that is valid except for `text` in its `title`.
fn title(text: &str) -> Input {
    Input::Case(format!("title: {text}\n{}", value("0")))
}

fn laughs() -> String {
    let mut text = String::from("petsc:\n  a0: &a0 [x, x, x, x, x, x, x, x, x]\n");
    for level in 1..40 {
        let last = format!("*a{}", level - 1);
        let _ = writeln!(text, "  a{level}: &a{level} [{}]", [last.as_str(); 9].join(", "));
    }
    text + &value("0")
}

fn ascii(version: &str, section: &str, counts: &str) -> Input {
    Input::Mesh(
        format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n${section}\n{counts}\n1 0 0 0\n").into_bytes(),
    )
}

fn binary(version: &str, section: &str, counts: &[u64]) -> Input {
    let mut bytes = format!("$MeshFormat\n{version} 1 8\n").into_bytes();
    bytes.extend(1i32.to_le_bytes());
    bytes.extend(format!("\n$EndMeshFormat\n${section}\n").bytes());
    counts.iter().for_each(|count| bytes.extend(count.to_le_bytes()));
    bytes.resize(1024, 0);
    Input::Mesh(bytes)
}

fn header(length: u64, text: &str) -> Input {
    let mut bytes = b"contact-petsc checkpoint\n\x01\0\0\0".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(text.bytes());
    Input::Checkpoint(bytes)
}

/// An input file of Abaqus with one element in set `all`, and its nodes in set `a`.
fn deck(rest: &str) -> String {
    format!(
        "*NODE, NSET=a\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n*ELEMENT, TYPE=CPE4, ELSET=all\n1, 1, 2, 3, 4\n{rest}"
    )
}

/// An input by name, created on demand, because some are long.
type Entry = (&'static str, Box<dyn Fn() -> Input>);

fn entry(name: &'static str, make: impl Fn() -> Input + 'static) -> Entry {
    (name, Box::new(make))
}

fn inputs() -> Vec<Entry> {
    let deep = 100_000;
    vec![
        entry("brackets", move || title(&"[".repeat(deep))),
        entry("closed brackets", move || title(&("[".repeat(deep) + &"]".repeat(deep)))),
        entry("braces", move || title(&"{a: ".repeat(deep))),
        entry("dashes", move || Input::Case("- ".repeat(deep))),
        entry("keys in keys", || {
            Input::Case((0..1500).map(|depth| format!("{}a:\n", " ".repeat(depth))).collect())
        }),
        entry("question marks", move || Input::Case("? ".repeat(deep))),
        entry("billion laughs", || Input::Case(laughs())),
        entry("an anchor in itself", || Input::Case(format!("petsc: &a {{ b: *a }}\n{}", value("0")))),
        entry("a body in itself", || {
            Input::Case(value("0").replace("bodies:", "bodies: &all").replace("  a:\n", "  b: *all\n  a:\n"))
        }),
        entry("anchors that merge", || {
            let merged = (1..200).fold("x: &a0 {y: 1}\n".to_owned(), |text, k| {
                text + &format!("x{k}: &a{k} {{<<: [*a{0}, *a{0}]}}\n", k - 1)
            });
            Input::Case(merged + &value("0"))
        }),
        entry("nul bytes", || Input::Case(value("0").replace("dimension", "dimen\0sion"))),
        entry("only nul bytes", || Input::Case("\0".repeat(1 << 20))),
        entry("a line of a megabyte", || Input::Case("x".repeat(1 << 20))),
        entry("a number of a megabyte", || Input::Case(value(&("1".repeat(1 << 20) + "e")))),
        entry("many words", || Input::Case("a: b\n".repeat(200_000))),
        entry("many bodies", || {
            Input::Case((0..100_000).fold("bodies:\n".to_owned(), |text, k| text + &format!("  b{k}: 1\n")))
        }),
        entry("a table backwards", || {
            let rows: String = (0..30_000).map(|k| format!("[{}, 0], ", 1e6 - f64::from(k))).collect();
            Input::Case(value(&format!("{{ table: [{rows}] }}")))
        }),
        entry("parentheses", move || Input::Case(value(&format!("\"{}\"", "(".repeat(deep))))),
        entry("parentheses alone", move || Input::Expression("(".repeat(deep))),
        entry("signs", move || Input::Expression("-".repeat(deep) + "x")),
        entry("powers", move || Input::Expression("x^".repeat(deep) + "x")),
        entry("sums", move || Input::Expression("x+".repeat(deep) + "x")),
        entry("calls", move || Input::Expression("sin(".repeat(deep))),
        entry("10^12 nodes, 2.2", || ascii("2.2", "Nodes", &TRILLION.to_string())),
        entry("10^12 elements, 2.2", || ascii("2.2", "Elements", &TRILLION.to_string())),
        entry("10^12 names, 2.2", || ascii("2.2", "PhysicalNames", &TRILLION.to_string())),
        entry("10^12 nodes, 4.1", || {
            ascii("4.1", "Nodes", &format!("1 {TRILLION} 1 {TRILLION}\n2 1 0 {TRILLION}"))
        }),
        entry("10^12 blocks, 4.1", || ascii("4.1", "Nodes", &format!("{TRILLION} 1 1 1"))),
        entry("10^12 elements, 4.1", || ascii("4.1", "Elements", &format!("1 {TRILLION} 1 1"))),
        entry("10^12 entities, 4.1", || ascii("4.1", "Entities", &format!("0 0 {TRILLION} 0"))),
        entry("10^12 nodes, binary 4.1", || binary("4.1", "Nodes", &[1, TRILLION, 1, TRILLION])),
        entry("10^19 blocks, binary 4.1", || binary("4.1", "Nodes", &[u64::MAX, u64::MAX, 1, 1])),
        entry("10^12 entities, binary 4.1", || binary("4.1", "Entities", &[TRILLION, 0, 0, 0])),
        entry("10^12 elements, binary 4.1", || binary("4.1", "Elements", &[1, TRILLION, 1, 1])),
        entry("a mesh without end", || Input::Mesh(b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes".to_vec())),
        entry("a section with an endless name", || {
            let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$".to_owned();
            let (name, body) = ("$End".repeat(250_000) + "x", "$End".repeat(500_000));
            Input::Mesh(format!("{text}{name}\n{body}").into_bytes())
        }),
        entry("sets that contain themselves", || Input::Deck(deck(&"*NSET, NSET=a\na, a\n".repeat(10_000)))),
        entry("sets of all sets before", || {
            let line = |k: usize| format!("*NSET, NSET=s{k}\ns{}, s{}\n", k - 1, k.saturating_sub(2).max(1));
            Input::Deck(deck(
                &("*NSET, NSET=s1\na\n".to_owned() + &(2..30_000).map(line).collect::<String>()),
            ))
        }),
        entry("ranges of 10^12 nodes", || {
            Input::Deck(deck(&format!(
                "*NSET, NSET=b, GENERATE\n{}9, 8\n",
                format!("1, {TRILLION}\n").repeat(10_000)
            )))
        }),
        entry("surfaces of everything", || {
            let surfaces = "*SURFACE, NAME=a\nall\n".repeat(50_000);
            Input::Deck(deck(&(surfaces + "*SURFACE, NAME=a\nall, S9\n")))
        }),
        entry("keywords without end", || Input::Deck("*NODE, a,\n".to_owned() + &"b,\n".repeat(300_000))),
        entry("an element without end", || {
            Input::Deck("*ELEMENT, TYPE=CPE4\n1,\n".to_owned() + &",\n".repeat(300_000))
        }),
        entry("a name of a megabyte", || {
            Input::Deck(deck(&format!("*NSET, NSET=b\n{}", "n".repeat(1 << 20))))
        }),
        entry("commas of a megabyte", || {
            Input::Deck(deck(&("*NSET, NSET=b\n".to_owned() + &",".repeat(1 << 20) + "x")))
        }),
        entry("many keywords", || Input::Deck((0..100_000).map(|k| format!("*KEY{k}\n")).collect())),
        entry("an input file of a gigabyte", || Input::Gigabyte("a.inp", b"x")),
        entry("a header of 60 MB", || header(60 << 20, "{")),
        entry("a header of 10^19 bytes", || header(u64::MAX, "{")),
        entry("a header of brackets", move || header(deep as u64, &"[".repeat(deep))),
        entry("10^19 rows", || {
            let text =
                format!(r#"{{"state":0,"sections":[{{"name":"n","columns":["u"],"rows":{}}}]}}"#, u64::MAX);
            header(text.len() as u64, &text)
        }),
        entry("a field of 10^18 bytes", || {
            let mut bytes = fs::read(fixture("field/seed-quad.vtu")).unwrap();
            let start = bytes.iter().position(|&byte| byte == b'_').unwrap() + 1;
            bytes[start + 7] = 0x0d;
            Input::Field(bytes)
        }),
        entry("tags of a megabyte", || Input::Field("<a ".repeat(1 << 19).into_bytes())),
        entry("a row of a million fields", || {
            Input::Table(format!("a,b\n{}\n", ",".repeat(1 << 20)).into_bytes())
        }),
        entry("10^8 cells", || cells("10000, 10000")),
        entry("10^9 cells", || cells("100000, 10000")),
        entry("10^19 cells", || cells("4294967295, 4294967295")),
        entry("a case of a gigabyte", || Input::Gigabyte("case.yml", b"title: ")),
        entry("a case of a gigabyte that is no text", || Input::Gigabyte("case.yml", b"\xff\xfe")),
        entry("a mesh of a gigabyte", || Input::Gigabyte("a.msh", b"x")),
        entry("a mesh of a gigabyte in one word", || Input::Gigabyte("a.msh", b"$MeshFormat\n2.2 0 8x")),
        entry("a checkpoint of a gigabyte", || Input::Gigabyte("a.ckpt", b"contact-petsc ")),
    ]
}

/// Reads an input, which must be refused.
fn refuse(input: &Input, folder: &Path) -> Result<(), Error> {
    let text = |complaint: contact_petsc::reader::complaint::Complaint| Error::case(complaint.to_string());
    match input {
        Input::Case(text) => Case::parse(text, "case.yml").map(drop),
        Input::Box(text) => read_mesh::<2>(&Case::parse(text, "case.yml")?).map(drop),
        Input::Mesh(bytes) => gmsh::parse::<2>(bytes, None).map(drop),
        Input::Deck(text) => abaqus::parse::<2>(text.as_bytes(), None).map(drop),
        Input::Checkpoint(bytes) => {
            let (path, length) = (Path::new("a.ckpt"), bytes.len() as u64);
            let mut file = std::io::Cursor::new(bytes);
            let header = checkpoint::examine(path, &mut file, length)?;
            let table = |section: &checkpoint::FileSection| {
                let keys = (0..section.rows.min(9)).collect();
                checkpoint::StoredTable::keyed(&section.name, section.columns.clone(), keys, 4)
            };
            let mut tables: Vec<_> = header.sections.iter().map(table).collect();
            checkpoint::fill(path, &mut file, length, &mut tables)
        }
        Input::Field(bytes) => vtu_reader::parse(bytes).map(drop),
        Input::Table(bytes) => Csv::parse(Path::new("a.csv"), bytes).map(drop),
        Input::Expression(expression) => Function::expression(expression).map(drop).map_err(text),
        Input::Gigabyte(name, _) => {
            let path = folder.join(name);
            match path.extension().and_then(|end| end.to_str()) {
                Some("msh" | "inp") => read_file::<2>(&path, None, PlaneState::Strain).map(drop),
                Some("ckpt") => checkpoint::verify(&path).map(drop),
                _ => Case::read(&path).map(drop),
            }
        }
    }
}

/// Peak memory so far [bytes].
fn peak() -> u64 {
    contact_petsc::petsc::peak_memory()
}

const NAME: &str = "CONTACT_PETSC_TEST_HOSTILE";

/// Reads one input in this process if another process started it for that. Otherwise does nothing.
#[test]
fn one_input() {
    let Ok(name) = std::env::var(NAME) else { return };
    let (_, make) = inputs().into_iter().find(|(known, _)| *known == name).unwrap();
    let input = make();
    let folder = Folder::new(&format!("hostile-{}", std::process::id()));
    if let Input::Gigabyte(file, start) = &input {
        fs::write(folder.join(file), start).unwrap();
        File::options().write(true).open(folder.join(file)).unwrap().set_len(1 << 30).unwrap();
    }
    // The largest memory counts anew from here.
    fs::write("/proc/self/clear_refs", "5").unwrap();
    // Beyond the limit, the system ends this process.
    setrlimit(Resource::RLIMIT_CPU, LIMIT, LIMIT).unwrap();
    let before = peak();
    let began = cpu_seconds();
    let error = refuse(&input, &folder).expect_err("it was taken");
    let took = cpu_seconds() - began;
    let more = peak() - before;
    assert!(error.to_string().len() < 4000, "{} bytes to say it", error.to_string().len());
    println!("refused after {took} s and {more} bytes: {error}");
}

/// CPU time of this thread so far [s].
fn cpu_seconds() -> f64 {
    let usage = getrusage(UsageWho::RUSAGE_THREAD).unwrap();
    let seconds = [usage.user_time(), usage.system_time()];
    seconds.iter().map(|time| time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64).sum()
}

/// Each input is refused with an error, within the limits of time and memory.
#[test]
fn hostile_input_is_refused_quickly_and_in_little_memory() {
    let mut failures = Vec::new();
    for (name, _) in inputs() {
        let mut command = Command::new(std::env::current_exe().unwrap());
        let output = command.args(["--exact", "one_input", "--nocapture"]).env(NAME, name).output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut words = said.split("refused after ").nth(1).unwrap_or_default().split(' ');
        let time = words.next().and_then(|word| word.parse::<f64>().ok());
        let memory = words.nth(2).and_then(|word| word.parse::<u64>().ok());
        let verdict = match (time, memory) {
            (Some(_), Some(memory)) if memory <= MEMORY => "refused",
            (Some(_), Some(_)) => "TOO MUCH",
            _ => "NOT REFUSED",
        };
        println!("{name}: {verdict}, {time:?}, {memory:?} bytes");
        if verdict != "refused" {
            let said: String = said.chars().take(1000).collect();
            let error: String = String::from_utf8_lossy(&output.stderr).chars().take(1000).collect();
            failures.push(format!("{name}: {verdict}, {time:?}, {memory:?} bytes\n{said}{error}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/fuzz").join(name)
}

/// The seeds and findings of the fuzz targets are read quickly and without a panic.
#[test]
fn what_was_found_before_stays_found() {
    let mut count = 0;
    for target in ["case", "expression", "table", "mesh", "deck", "field", "checkpoint"] {
        // No folder: nothing was found, and the shipped cases and meshes are the seeds.
        for entry in fs::read_dir(fixture(target)).into_iter().flatten().flatten() {
            let bytes = fs::read(entry.path()).unwrap();
            let began = cpu_seconds();
            let text = || String::from_utf8_lossy(&bytes).into_owned();
            let input = match target {
                "case" => Input::Case(text()),
                "expression" => Input::Expression(text()),
                "table" => Input::Table(bytes.clone()),
                "mesh" => Input::Mesh(bytes.clone()),
                "deck" => Input::Deck(text()),
                "field" => Input::Field(bytes.clone()),
                _ => Input::Checkpoint(bytes.clone()),
            };
            let is_good = refuse(&input, Path::new(".")).is_ok();
            let name = entry.file_name().to_string_lossy().into_owned();
            assert!(!is_good || !name.starts_with("bad-"), "{target}/{name} was taken");
            let took = cpu_seconds() - began;
            assert!(took < LIMIT as f64, "{target}/{name} took {took} s");
            count += 1;
        }
    }
    assert!(count > 10, "{count} files");
}
