//! Console output of a run. Only rank 0 prints: the start-up report and the summary on standard
//! output, progress on standard error.
//!
//! Output that cannot be printed does not stop a run. Failed writes to standard output are reported
//! as an error at the end, except when the reader has closed the pipe. Failed writes to standard
//! error are ignored.

use std::io::{Error as IoError, ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::case::Units;
use crate::error::{Error, Result};

use super::iterations::IterationRow;
use super::pace::{PaceDisplay, duration};
use super::record::Record;
use super::summary::{StartUp, summary};

/// Amount of console output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Only errors. Used for ranks other than the first and for members of studies.
    Silent,
    /// `-q`: errors and warnings.
    Warnings,
    /// Also reports, and one line per step.
    Normal,
    /// `-v`: also the Newton table.
    Verbose,
}

/// Data of the line that is printed for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLine {
    /// Number of the step.
    pub step: u64,
    /// Time at its end \[s\].
    pub time: f64,
    /// Its length \[s\].
    pub dt: f64,
    /// Newton iterations.
    pub iterations: u64,
    /// Krylov iterations, summed over the Newton iterations.
    pub krylov_iterations: u64,
    /// Number of sticking contact points.
    pub stick: u64,
    /// Number of slipping contact points.
    pub slip: u64,
}

/// Identifies a nonlinear solve, for the header of its Newton table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attempt {
    /// Number of the step.
    pub step: u64,
    /// Time at its end \[s\].
    pub time: f64,
    /// Its length \[s\].
    pub dt: f64,
    /// Number of the attempt, from 1.
    pub attempt: u64,
}

/// The first failure to print on standard output.
static LOST: OnceLock<IoError> = OnceLock::new();

/// Prints a text on standard output. A failure is reported by [`require_printed`].
pub fn say(text: &str) {
    print(&mut std::io::stdout(), text);
}

fn print(out: &mut dyn Write, text: &str) {
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => drop(LOST.set(error)),
        _ => {}
    }
}

/// Checks that everything was written to standard output.
///
/// # Errors
/// A write failed, for example on a full device.
pub fn require_printed() -> Result<()> {
    LOST.get().map_or(Ok(()), |error| {
        let text = format!("standard output can not be written: {error}");
        Err(Error::file(text)
            .hint("the results are complete; redirect standard output to another file or device"))
    })
}

/// The console of a rank. It prints only on rank 0.
pub struct Console {
    verbosity: Verbosity,
    out: Box<dyn Write>,
    err: Box<dyn Write>,
    bar: Option<ProgressBar>,
    pace: PaceDisplay,
    last: Instant,
    span: [f64; 2],
    /// Unit of time.
    unit: String,
}

impl Console {
    /// The console of a rank.
    pub fn new(rank: usize, verbosity: Verbosity, units: Units) -> Self {
        let verbosity = if rank == 0 { verbosity } else { Verbosity::Silent };
        let console = Self::writing_to(verbosity, Box::new(std::io::stdout()), Box::new(std::io::stderr()));
        Self { unit: units.of("s"), ..console }
    }

    fn writing_to(verbosity: Verbosity, out: Box<dyn Write>, err: Box<dyn Write>) -> Self {
        let (pace, last) = (PaceDisplay::default(), Instant::now());
        Self { verbosity, out, err, bar: None, pace, last, span: [0.0, 0.0], unit: "s".to_owned() }
    }

    /// Prints the start-up report, and the warnings that it contains.
    pub fn start_up(&mut self, report: &StartUp, warnings: &[String]) {
        if self.verbosity > Verbosity::Warnings {
            print(&mut self.out, &report.to_string());
        } else {
            warnings.iter().for_each(|text| self.warn(text));
        }
    }

    /// Starts the time stepping from `start` to `end` \[s\]. A progress bar appears if standard
    /// error is a terminal.
    pub fn begin(&mut self, start: f64, end: f64) {
        self.span = [start, end];
        self.last = Instant::now();
        if self.verbosity > Verbosity::Warnings && std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:40.cyan/blue} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            self.bar = Some(bar);
        }
    }

    /// Prints the line of an accepted step.
    pub fn step(&mut self, line: &StepLine) {
        let wall = self.last.elapsed();
        self.last = Instant::now();
        self.pace.advance(wall, line.dt);
        let to_go = self.pace.time_left(self.span[1] - line.time);
        self.progress(&step_text(line, &self.unit, to_go));
        if let Some(bar) = &self.bar {
            let [start, end] = self.span;
            bar.set_position(((line.time - start) / (end - start).max(f64::MIN_POSITIVE) * 1000.0) as u64);
            bar.set_message(to_go.map_or(String::new(), |left| format!("{} to go", duration(left))));
        }
    }

    /// Prints a remark, for example that a step was cut and why.
    pub fn note(&mut self, text: &str) {
        self.progress(text);
    }

    /// Prints a warning, which also appears with `-q`.
    pub fn warn(&mut self, text: &str) {
        match self.verbosity {
            Verbosity::Silent => {}
            Verbosity::Warnings if !text.starts_with("warning:") => self.print(&format!("warning: {text}")),
            _ => self.print(text),
        }
    }

    /// Prints the header of the Newton table of a load level of the static start, at `factor` of
    /// all loads.
    pub fn start_header(&mut self, factor: f64) {
        let is_full = factor == 1.0;
        let place = match is_full {
            true => "static start at full load".to_owned(),
            false => format!("static start at {:.4} % of the loads", 100.0 * factor),
        };
        if self.verbosity >= Verbosity::Verbose {
            self.progress(&format!("{place}\n{NEWTON_COLUMNS}"));
        } else if is_full {
            self.progress(&place);
        }
    }

    /// Prints the header of the Newton table of one attempt.
    pub fn newton_header(&mut self, attempt: &Attempt) {
        if self.verbosity >= Verbosity::Verbose {
            let Attempt { step, time, dt, attempt } = attempt;
            let s = &self.unit;
            let place = format!("step {step}, t = {time:.6e} {s}, dt = {dt:.3e} {s}, attempt {attempt}");
            self.progress(&format!("{place}\n{NEWTON_COLUMNS}"));
        }
    }

    /// Prints one row of the Newton table.
    pub fn newton_row(&mut self, row: &IterationRow) {
        if self.verbosity >= Verbosity::Verbose {
            self.progress(&newton_text(row));
        }
    }

    /// Removes the progress bar and prints the summary.
    pub fn finish(&mut self, record: &Record) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if self.verbosity > Verbosity::Warnings {
            print(&mut self.out, &summary(record));
        }
    }

    fn progress(&mut self, text: &str) {
        if self.verbosity > Verbosity::Warnings {
            self.print(text);
        }
    }

    fn print(&mut self, text: &str) {
        let err = &mut self.err;
        let mut write = || {
            let _ = writeln!(err, "{text}");
            let _ = err.flush();
        };
        match &self.bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}

const NEWTON_COLUMNS: &str =
    "       stage   it   residual  increment  krylov  points  changed  line search  contraction";

fn newton_text(row: &IterationRow) -> String {
    let number = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{value:.3e}"));
    let factor = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{value:.3}"));
    let (search, contraction) = (factor(row.line_search), factor(row.contraction));
    let IterationRow { stage, iteration, krylov_iterations, points, changed, .. } = row;
    let norms = format!("{:>10} {:>10}", number(row.residual), number(row.increment));
    let counts = format!("{krylov_iterations:>7} {points:>7} {changed:>8}");
    format!("  {stage:>10}  {iteration:>3} {norms} {counts} {search:>12} {contraction:>12}")
}

fn step_text(line: &StepLine, s: &str, to_go: Option<Duration>) -> String {
    let StepLine { step, time, dt, iterations, krylov_iterations, stick, slip } = line;
    let contact = format!("contact {} (stick {stick}, slip {slip})", stick + slip);
    let solve = format!("newton {iterations:>2}  krylov {krylov_iterations:>4}");
    let left = to_go.map_or(String::new(), |left| format!("  to go {}", duration(left)));
    format!("step {step:>5}  t {time:.6e} {s}  dt {dt:.3e} {s}  {solve}  {contact}{left}")
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    #[derive(Clone, Default)]
    struct Heard(Arc<Mutex<Vec<u8>>>);

    impl Write for Heard {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Heard {
        fn text(&self) -> String {
            String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
        }
    }

    const LINE: StepLine = StepLine {
        step: 41,
        time: 0.0205,
        dt: 5e-4,
        iterations: 4,
        krylov_iterations: 31,
        stick: 40,
        slip: 9,
    };

    const ROW: IterationRow = IterationRow {
        step: 41,
        time: 0.0205,
        dt: 5e-4,
        attempt: 1,
        stage: "monolithic",
        iteration: 0,
        residual: Some(123.4),
        increment: None,
        krylov_iterations: 0,
        points: 49,
        changed: 3,
        line_search: None,
        contraction: None,
    };

    fn run(verbosity: Verbosity) -> (String, String) {
        let (out, err) = (Heard::default(), Heard::default());
        let mut console = Console::writing_to(verbosity, Box::new(out.clone()), Box::new(err.clone()));
        console.span = [0.0, 0.07];
        console.newton_header(&Attempt { step: 41, time: 0.0205, dt: 5e-4, attempt: 1 });
        console.newton_row(&ROW);
        console.step(&LINE);
        console.note("step 42 cut");
        console.warn("energy grows");
        (out.text(), err.text())
    }

    /// Silent prints nothing, quiet the warnings, normal one line per step, verbose the Newton
    /// table as well. All of it goes to standard error.
    #[test]
    fn speaks_as_much_as_asked() {
        assert_eq!(run(Verbosity::Silent), (String::new(), String::new()));
        assert_eq!(run(Verbosity::Warnings), (String::new(), "warning: energy grows\n".to_owned()));
        let (out, normal) = run(Verbosity::Normal);
        assert!(out.is_empty());
        assert_eq!(normal.lines().count(), 3);
        assert!(normal.starts_with("step    41  t 2.050000e-2 s  dt 5.000e-4 s  newton  4  krylov   31  contact 49 (stick 40, slip 9)  to go "));
        let (_, verbose) = run(Verbosity::Verbose);
        assert_eq!(verbose.lines().count(), 6);
    }

    /// Ranks other than the first print nothing, whatever the verbosity.
    #[test]
    fn other_ranks_are_mute() {
        assert_eq!(Console::new(1, Verbosity::Verbose, Units::SI).verbosity, Verbosity::Silent);
        assert_eq!(Console::new(0, Verbosity::Verbose, Units::SI).verbosity, Verbosity::Verbose);
    }

    /// The rows of the Newton table are aligned with their headings.
    #[test]
    fn newton_rows_are_aligned() {
        let full = IterationRow { iteration: 12, increment: Some(1e-9), line_search: Some(0.5), ..ROW };
        for row in [ROW, full] {
            assert_eq!(newton_text(&row).len(), NEWTON_COLUMNS.len(), "{}", newton_text(&row));
        }
    }
}
