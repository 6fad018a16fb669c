//! Shared parts of the tests that run the whole program: a run on several ranks with a time limit,
//! a temporary folder, and columns of tables by name.

#![allow(dead_code, reason = "each test file uses its part of this")]

mod cores;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use cores::Share;

/// The program under test.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_contact-petsc");

/// Default time limit of a run, generous for a loaded machine. A hang is a failure, too.
pub const LIMIT: Duration = Duration::from_secs(300);

/// Settings of `scripts/environment`, which Open MPI needs for root, in containers and on few
/// cores.
pub const ENVIRONMENT: [(&str, &str); 9] = [
    ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
    ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
    ("PRTE_MCA_hwloc_default_binding_policy", "none"),
    ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ("OPENBLAS_NUM_THREADS", "1"),
    ("OMP_NUM_THREADS", "1"),
];

/// Seconds between SIGTERM and SIGKILL that `mpirun` leaves to ranks when it must end or another
/// rank ended with an error.
const PATIENCE: &str = "OMPI_MCA_odls_base_sigkill_timeout";

/// The end of a run and its output.
#[derive(Debug, Clone)]
pub struct Output {
    /// Exit code. `None` if the run was killed by its time limit or by a signal.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
    /// Duration.
    pub took: Duration,
}

impl Output {
    /// Returns this run, which must have succeeded.
    #[track_caller]
    pub fn success(self) -> Self {
        assert_eq!(self.code, Some(0), "the run failed:\n{}\n{}", self.stdout, self.stderr);
        self
    }

    /// The complete output.
    pub fn text(&self) -> String {
        format!("{}{}", self.stdout, self.stderr)
    }
}

/// Checks that a message contains all of these fragments: its location, its values and the remedy.
#[track_caller]
pub fn assert_says(message: &str, fragments: &[&str]) {
    let missing: Vec<&&str> = fragments.iter().filter(|fragment| !message.contains(**fragment)).collect();
    assert!(missing.is_empty(), "{missing:?} missing in:\n{message}");
}

/// Checks numbers against known ones, relative to the largest of those.
#[track_caller]
pub fn near(found: &[f64], known: &[f64], tolerance: f64) {
    let scale = known.iter().fold(f64::MIN_POSITIVE, |most: f64, value| most.max(value.abs()));
    assert_eq!(found.len(), known.len());
    let fits = found.iter().zip(known).all(|(a, b)| (a - b).abs() <= tolerance * scale);
    assert!(fits, "{found:?}, expected {known:?}");
}

/// Runs the program on `ranks` ranks (at most one: without `mpirun`) in `folder`.
pub fn run(ranks: usize, args: &[&str], folder: &Path) -> Output {
    run_within(LIMIT, ranks, args, folder)
}

/// Runs the program on `ranks` ranks in `folder`. Kills it and all its ranks after `limit`.
pub fn run_within(limit: Duration, ranks: usize, args: &[&str], folder: &Path) -> Output {
    Running::start(ranks, args, folder).wait(limit)
}

/// Sends a signal to a process, or to its group for a negative id, and returns whether it existed.
/// Uses the shell, because small systems lack the program `kill`.
pub fn send(signal: &str, process: &str) -> bool {
    let mut shell = Command::new("bash");
    shell.args(["-c", "kill -s \"$0\" -- \"$1\"", signal, process]).stderr(Stdio::null());
    shell.status().is_ok_and(|status| status.success())
}

/// The command that starts a program on `ranks` ranks. At most one rank runs without `mpirun`, which
/// halves the time of its start.
fn on_ranks(ranks: usize, program: impl AsRef<OsStr>) -> Command {
    let mut command = match ranks {
        0 | 1 => Command::new(program),
        _ => {
            let mut mpirun = Command::new("mpirun");
            mpirun.args(["-n", &ranks.to_string()]).arg(program);
            mpirun
        }
    };
    command.envs(ENVIRONMENT).env(PATIENCE, "0");
    command
}

/// A run in progress.
pub struct Running {
    child: Child,
    began: Instant,
    log: Folder,
    _cores: Share,
}

impl Running {
    /// Starts the program on `ranks` ranks (at most one: without `mpirun`) in `folder`.
    pub fn start(ranks: usize, args: &[&str], folder: &Path) -> Self {
        let mut command = on_ranks(ranks, PROGRAM);
        command.args(args).current_dir(folder);
        Self::of(command, ranks)
    }

    /// Starts the program with the default time of `mpirun` for an orderly end.
    pub fn start_patient(ranks: usize, args: &[&str], folder: &Path) -> Self {
        let mut command = on_ranks(ranks, PROGRAM);
        command.env_remove(PATIENCE).args(args).current_dir(folder);
        Self::of(command, ranks)
    }

    /// Starts this test program itself on `ranks` ranks (at most one: without `mpirun`). The environment
    /// selects its task.
    pub fn of_this_test(ranks: usize, told: &[(&str, &OsStr)]) -> Self {
        let mut command = on_ranks(ranks, std::env::current_exe().expect("the path of this program"));
        command.envs(told.iter().copied());
        Self::of(command, ranks)
    }

    /// Starts a shell script in `folder`, in which `contact-petsc` is the program under test. At
    /// most `ranks` ranks run at once.
    pub fn script(ranks: usize, script: &str, folder: &Path) -> Self {
        let mut command = on_ranks(0, "bash");
        let programs = Path::new(PROGRAM).parent().expect("a folder of programs").to_owned();
        let path = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(programs).chain(std::env::split_paths(&path));
        command.env("PATH", std::env::join_paths(paths).expect("folders without a colon"));
        command.args(["-c", script]).current_dir(folder);
        Self::of(command, ranks)
    }

    fn of(mut command: Command, ranks: usize) -> Self {
        let cores = Share::of(ranks);
        let log = Folder::new("log");
        let file = |name: &str| File::create(log.join(name)).expect("a file for the output");
        command.stdin(Stdio::null()).stdout(file("stdout")).stderr(file("stderr"));
        // A group of its own, which is killed as a whole.
        let child = command.process_group(0).spawn().expect("the program or mpirun starts");
        Self { child, began: Instant::now(), log, _cores: cores }
    }

    /// The process id: that of the program if it runs without `mpirun`.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether the run is still in progress.
    pub fn goes_on(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Waits for the end, for at most `limit` from the start.
    pub fn wait(mut self, limit: Duration) -> Output {
        let code = loop {
            match self.child.try_wait().expect("the state of the run") {
                Some(status) => break status.code(),
                None if self.began.elapsed() > limit => {
                    self.kill();
                    break None;
                }
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        let took = self.began.elapsed();
        let read =
            |name: &str| String::from_utf8_lossy(&fs::read(self.log.join(name)).unwrap_or_default()).into();
        Output { code, stdout: read("stdout"), stderr: read("stderr"), took }
    }

    /// Kills the run and all its ranks. Signals `mpirun` first, because its ranks have their own
    /// groups.
    fn kill(&mut self) {
        self.signal("TERM");
        let deadline = Instant::now() + Duration::from_secs(5);
        while Instant::now() < deadline && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(20));
        }
        self.signal("KILL");
        let _ = self.child.wait();
    }

    /// Sends a signal to the group.
    pub fn signal(&self, name: &str) {
        send(name, &format!("-{}", self.child.id()));
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.kill();
        }
    }
}

/// A separate folder, removed at the end.
pub struct Folder(PathBuf);

impl Folder {
    /// A new, empty folder. The name is only for readability.
    pub fn new(name: &str) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("contact-petsc-{}-{number}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    /// Writes a file into the folder and returns its path.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).expect("a file in the temporary folder");
        path
    }
}

impl std::ops::Deref for Folder {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The cells of a line. Commas in quotes do not separate cells.
fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut is_quoted = false;
    for letter in line.chars() {
        let end = cells.len() - 1;
        match letter {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            _ => cells[end].push(letter),
        }
    }
    cells
}

/// A table of a results folder, as text.
#[derive(Debug, Clone)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a CSV file. An incomplete last line is ignored.
    #[track_caller]
    pub fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
        let cells =
            |line: &str| cells(line).into_iter().map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let mut lines = whole.lines().map(cells);
        let header = lines.next().unwrap_or_else(|| panic!("{}: no header", path.display()));
        let rows: Vec<_> = lines.collect();
        for row in &rows {
            assert_eq!(row.len(), header.len(), "{}: {row:?}", path.display());
        }
        Self { header, rows }
    }

    /// The columns, with their units.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.header.iter().map(String::as_str)
    }

    /// Number of rows below the header.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether the table has only the header.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The rows in which a column has a given text, such as the rows of one contact.
    #[track_caller]
    pub fn only(&self, column: &str, text: &str) -> Self {
        let at = self.position(column);
        let rows = self.rows.iter().filter(|row| row[at] == text).cloned().collect();
        Self { header: self.header.clone(), rows }
    }

    /// A column as text, by its name in the header, with or without the unit.
    #[track_caller]
    pub fn texts(&self, column: &str) -> Vec<&str> {
        let at = self.position(column);
        self.rows.iter().map(|row| row[at].as_str()).collect()
    }

    /// A column as numbers. An empty cell is not a number.
    #[track_caller]
    pub fn numbers(&self, column: &str) -> Vec<f64> {
        self.texts(column).into_iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    }

    /// The last number of a column.
    #[track_caller]
    pub fn last(&self, column: &str) -> f64 {
        *self.numbers(column).last().expect("a row")
    }

    #[track_caller]
    fn position(&self, column: &str) -> usize {
        let named = |header: &String| header == column || header.split(" [").next() == Some(column);
        let found = self.header.iter().position(named);
        found.unwrap_or_else(|| panic!("no column '{column}' among {:?}", self.header))
    }
}

/// A case: a small block is dragged over a floor in four steps.
pub const SMALL_BLOCK: &str = r#"title: Small block
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.4], cells: [4, 4] } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
obstacles:
  floor: { plane: { point: [0, 0], normal: [0, 1] } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } }
boundary:
  clamp: { on: block.top, displacement: { x: "1.0 * t", y: -0.01 } }
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 0.002, step: 5.0e-4 }
output: { probes: { corner: { at: [0, 0] } } }
"#;

/// A rubber pad of these cells and Poisson's ratio, in which a rigid disc presses and drags.
pub fn rubber_pad(cells: &str, ratio: f64, increments: u32) -> String {
    format!(
        "dimension: 2
bodies:
  pad:
    mesh: {{ box: {{ min: [-0.1, 0], max: [0.1, 0.06], cells: {cells}, element: quad4 }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: {ratio} }} }}
rigid:
  tool:
    shape: {{ sphere: {{ center: [0, 0.1001], radius: 0.04 }} }}
    motion:
      translation:
        x: {{ table: [[0, 0], [0.5, 0], [1, 0.03]] }}
        y: {{ table: [[0, 0], [0.5, -0.015], [1, -0.015]] }}
contact:
  press:
    contactor: pad.top
    target: tool
    normal: {{ penalty: {{ compliance: 2.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 5.0e+9 }} }} }}
boundary: {{ clamp: {{ on: pad.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: {increments} }} }} }}
output: {{ fields: {{ every: 0 }} }}
"
    )
}

/// A shipped case with some of its text replaced. Each replaced text must exist.
#[track_caller]
pub fn shipped(case: &str, changes: &[(&str, &str)]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(case);
    let mut text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    for (from, to) in changes {
        assert!(text.contains(from), "{case} has no '{from}'");
        text = text.replace(from, to);
    }
    text
}

/// Results of one successful run, in the folder `out`.
pub struct Results(pub Folder);

impl Results {
    /// Runs the case `text` on the given number of ranks.
    #[track_caller]
    pub fn of(text: &str, ranks: usize) -> Self {
        let folder = Folder::new("results");
        folder.write("case.yml", text);
        run(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).success();
        Self(folder)
    }

    /// A table by name.
    pub fn table(&self, name: &str) -> Table {
        Table::read(&self.0.join("out").join(name))
    }

    /// `run.json`.
    pub fn record(&self) -> serde_json::Value {
        let text = fs::read_to_string(self.0.join("out/run.json")).expect("a run record");
        serde_json::from_str(&text).expect("JSON")
    }
}

/// Stretch transverse to the load of a neo-Hookean block (E = 1 MPa, nu = 0.3) under 0.1 MPa, with
/// `free` free directions.
pub fn stretch(free: i32) -> f64 {
    let (shear, lambda, pressure) = (1e6 / 2.6, 0.3e6 / (1.3 * 0.4), 1e5);
    let across = |j: f64| 1.0 - lambda / shear * f64::ln(j);
    let volume = |j: f64| (across(j) - pressure * j / shear).sqrt() * across(j).sqrt().powi(free);
    let (mut low, mut high) = (0.8, 1.0);
    for _ in 0..200 {
        let j = 0.5 * (low + high);
        if volume(j) > j { low = j } else { high = j }
    }
    across(low).sqrt()
}

/// Two pairs of bodies far from each other. The points of one pair slip, those of the other stick.
pub fn two_pairs() -> String {
    let pair = |name: &str, left: f64, cells: u32| {
        format!(
            "  {name}_lower:
    mesh: {{ box: {{ min: [{left}, 0], max: [{right}, 0.5], cells: [{cells}, 6], element: quad4 }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}
    density: 1000
  {name}_upper:
    mesh: {{ box: {{ min: [{left}, 0.5], max: [{right}, 1], cells: [{upper}, 6], element: quad4 }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}
    density: 1000
",
            right = left + 1.0,
            upper = cells - 1,
        )
    };
    let contact = |name: &str| {
        format!(
            "  {name}: {{ contactor: {name}_upper.bottom, target: {name}_lower.top, normal: {{ penalty: {{ \
             compliance: 1.0e-10 }} }}, friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ \
             stick_stiffness: 1.0e10 }} }} }}, initial_overclosure: accept }}\n"
        )
    };
    format!(
        "dimension: 2
bodies:
{}{}contact:
{}{}boundary:
  base_a: {{ on: a_lower.bottom, displacement: {{ x: 0, y: 0 }} }}
  base_b: {{ on: b_lower.bottom, displacement: {{ x: 0, y: 0 }} }}
  stuck: {{ on: a_upper.top, displacement: {{ x: '2e-5 * t', y: '-5e-4 - 1e-4 * t' }} }}
  dragged: {{ on: b_upper.top, displacement: {{ x: '0.02 * t', y: '-0.001 - 0.001 * t' }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 4 }} }} }}
output:
  fields: {{ every: 1000 }}
  probes: {{ corner: {{ at: [3, 0.5], on: b_lower }} }}
",
        pair("a", 0.0, 12),
        pair("b", 2.0, 12),
        contact("a"),
        contact("b"),
    )
}
