//! The two reports of a run: the start-up report and the summary.

use std::fmt;
use std::time::Duration;

use super::pace::duration;
use super::record::{PenetrationRecord, Record, Verdict};

/// Data of the start-up report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartUp {
    /// Title of the case.
    pub title: String,
    /// The results folder.
    pub folder: String,
    /// Elements and nodes of the whole mesh.
    pub elements: u64,
    /// Nodes of the whole mesh.
    pub nodes: u64,
    /// Degrees of freedom.
    pub unknowns: u64,
    /// MPI ranks.
    pub ranks: usize,
    /// Imbalance: elements of the rank with the most elements, over the mean; 1 if perfect.
    pub imbalance: f64,
    /// Number of face pairs of elements on different ranks.
    pub edge_cut: u64,
    /// For cases with contact: largest contact load of a rank over the mean, number of pairs of
    /// elements that may touch, and number of those on different ranks.
    pub meeting: Option<(f64, u64, u64)>,
    /// Description of the solver.
    pub solver: String,
    /// Contact at the start.
    pub contacts: Vec<ContactStart>,
    /// Remarks, one line each.
    pub remarks: Vec<String>,
}

/// A contact at the start of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactStart {
    /// Name in the case.
    pub name: String,
    /// Unit of length.
    pub unit: String,
    /// Contact points.
    pub points: u64,
    /// Those with a target nearby.
    pub paired: u64,
    /// Those that are closed at the start.
    pub closed: u64,
    /// The smallest gap, negative for an overclosure, and its position \[m\]; `None` if no target
    /// is nearby.
    pub nearest: Option<(f64, Vec<f64>)>,
    /// The largest gap and its position \[m\]; `None` if no point is open.
    pub widest: Option<(f64, Vec<f64>)>,
}

impl fmt::Display for StartUp {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        writeln!(
            f,
            "  mesh      {} elements, {} nodes, {} unknowns",
            self.elements, self.nodes, self.unknowns
        )?;
        match self.ranks {
            1 => writeln!(f, "  ranks     1")?,
            n => writeln!(
                f,
                "  ranks     {n}, imbalance of elements {:.3}, edge cut {}",
                self.imbalance, self.edge_cut
            )?,
        }
        match (self.meeting, self.ranks) {
            (None, _) => {}
            (Some((_, pairs, _)), ..2) => writeln!(f, "            {pairs} candidate pairs of elements")?,
            (Some((imbalance, pairs, cut)), _) => {
                writeln!(
                    f,
                    "            contact imbalance {imbalance:.3}, {cut} of {pairs} pairs across ranks"
                )?;
            }
        }
        writeln!(f, "  solver    {}", self.solver)?;
        for contact in &self.contacts {
            writeln!(f, "  contact   {contact}")?;
        }
        for remark in &self.remarks {
            writeln!(f, "  note      {remark}")?;
        }
        write!(f, "  results   {}", self.folder)
    }
}

impl fmt::Display for ContactStart {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {} of {} points initially closed", self.name, self.closed, self.points)?;
        let Some((gap, at)) = &self.nearest else { return write!(f, ", no target nearby") };
        if self.paired < self.points {
            write!(f, ", {} with a target nearby", self.paired)?;
        }
        let m = &self.unit;
        match *gap < 0.0 {
            true => write!(f, ", deepest overclosure {:.3e} {m} at {}", -gap, place(at))?,
            false => write!(f, ", no overclosure, smallest gap {gap:.3e} {m} at {}", place(at))?,
        }
        let Some((gap, at)) = &self.widest else { return Ok(()) };
        write!(f, ", widest gap {gap:.3e} {m} at {}", place(at))
    }
}

fn place(at: &[f64]) -> String {
    let at: Vec<String> = at.iter().map(|x| format!("{x:.6}")).collect();
    format!("({})", at.join(", "))
}

/// The summary of a run as text, without a final line break.
pub(super) fn summary(record: &Record) -> String {
    let verdict = match &record.verdict {
        Verdict::Running => "still running".to_string(),
        Verdict::Completed => "completed".to_string(),
        Verdict::Stopped { .. } => "stopped on request".to_string(),
        Verdict::Failed { code, .. } => format!("ended early with exit code {code}"),
    };
    let totals = record.totals;
    let wall = duration(Duration::try_from_secs_f64(record.wall_seconds).unwrap_or_default());
    let largest = record.peak_memory.iter().max().copied().unwrap_or(0) as f64 / f64::from(1 << 20);
    let [m, s] = ["m", "s"].map(|unit| record.units.of(unit));
    let mut text = format!("{verdict} at t = {} {s} after {wall}\n", record.simulated_time);
    text.push_str(&format!("  steps     {} ({} cut)\n", totals.steps, totals.cut_steps));
    text.push_str(&format!("  newton    {} iterations\n", totals.newton_iterations));
    text.push_str(&format!("  krylov    {} iterations\n", totals.krylov_iterations));
    if totals.inner_krylov_iterations > 0 {
        text.push_str(&format!(
            "  inner     {} iterations within the preconditioner\n",
            totals.inner_krylov_iterations
        ));
    }
    let told = record.penetrations.iter().map(|contact| contact.describe(&m));
    told.for_each(|contact| text.push_str(&format!("  contact   {contact}\n")));
    let told = record.accuracy.iter().map(|accuracy| accuracy.told(record.units));
    told.for_each(|accuracy| text.push_str(&format!("  accuracy  {accuracy}\n")));
    if totals.linear_fallbacks > 0 {
        let fallbacks = totals.linear_fallbacks;
        text.push_str(&format!("  fallbacks {fallbacks} to a more robust linear solver\n"));
    }
    text.push_str(&format!("  memory    {largest:.0} MiB on the largest of {} ranks", record.ranks));
    text + &phase_table(record)
}

impl PenetrationRecord {
    /// The contact as text for the console; `m` is the unit of length.
    fn describe(&self, m: &str) -> String {
        let Self { contact, deepest, asked, .. } = self;
        match (self.has_closed(), asked) {
            (false, _) => format!("{contact}: never closed"),
            (true, None) => format!("{contact}: deepest penetration {deepest:.3e} {m}"),
            (true, Some(asked)) => {
                format!("{contact}: deepest penetration {deepest:.3e} {m}, requested {asked:.3e} {m}")
            }
        }
    }
}

fn phase_table(record: &Record) -> String {
    if record.phases.is_empty() {
        return String::new();
    }
    let other = record.wall_seconds - record.phases.iter().map(|(_, phase)| phase.seconds).sum::<f64>();
    let width = record.phases.iter().map(|(name, _)| name.len()).max().unwrap_or(0).max("phase".len());
    let share = |seconds: f64| 100.0 * seconds / record.wall_seconds.max(f64::MIN_POSITIVE);
    let mut text = format!("\n  {:<width$}  {:>10}  {:>6}  {:>9}", "phase", "seconds", "share", "calls");
    for (name, phase) in &record.phases {
        let name = name.replace('_', " ");
        let seconds = phase.seconds;
        text.push_str(&format!(
            "\n  {name:<width$}  {seconds:>10.3}  {:>4.0} %  {:>9}",
            share(seconds),
            phase.count
        ));
    }
    if other > 0.0 {
        text.push_str(&format!(
            "\n  {:<width$}  {other:>10.3}  {:>4.0} %  {:>9}",
            "other",
            share(other),
            "-"
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use std::time::UNIX_EPOCH;

    use super::super::record::{PhaseTime, Totals};
    use super::*;
    use crate::case::Units;

    /// The start-up report states unknowns, ranks, imbalance and the overclosure with its position.
    #[test]
    fn start_up_tells_what_matters() {
        let report = StartUp {
            title: "Rubber block".into(),
            folder: "results/rubber-block".into(),
            elements: 2400,
            nodes: 2499,
            unknowns: 4998,
            ranks: 2,
            imbalance: 1.01,
            edge_cut: 48,
            meeting: Some((1.05, 80, 3)),
            solver: "monolithic, GMRES with ILU(0)".into(),
            contacts: vec![ContactStart {
                unit: "m".into(),
                name: "sole".into(),
                points: 49,
                paired: 45,
                closed: 40,
                nearest: Some((-1.5e-5, vec![0.48, 0.0])),
                widest: Some((2e-3, vec![0.0, 0.0])),
            }],
            remarks: vec![],
        };
        let expected = "Rubber block\n  mesh      2400 elements, 2499 nodes, 4998 unknowns\n\
                        \x20 ranks     2, imbalance of elements 1.010, edge cut 48\n\
                        \x20           contact imbalance 1.050, 3 of 80 pairs across ranks\n  solver    \
                        monolithic, GMRES with ILU(0)\n\
                        \x20 contact   sole: 40 of 49 points initially closed, 45 with a target nearby, \
                        deepest overclosure 1.500e-5 m at (0.480000, 0.000000), widest gap 2.000e-3 m at \
                        (0.000000, 0.000000)\n\
                        \x20 results   results/rubber-block";
        assert_eq!(report.to_string(), expected);
        let alone = StartUp { ranks: 1, ..report }.to_string();
        assert!(alone.contains("  ranks     1\n            80 candidate pairs of elements\n"), "{alone}");
    }

    /// The phases are in aligned columns, followed by the remaining time.
    #[test]
    fn phases_are_aligned_and_complete() {
        let record = Record {
            units: Units::SI,
            case: serde_json::Value::Null,
            digest: String::new(),
            inputs: vec![],
            versions: vec![],
            petsc_options: String::new(),
            ranks: 2,
            blas_threads: None,
            unknowns: 10,
            start: UNIX_EPOCH,
            totals: Totals {
                steps: 140,
                cut_steps: 1,
                newton_iterations: 454,
                krylov_iterations: 3000,
                inner_krylov_iterations: 0,
                linear_fallbacks: 2,
                restarts: 0,
            },
            simulated_time: 0.07,
            wall_seconds: 10.0,
            phases: vec![
                ("search".into(), PhaseTime { seconds: 1.0, count: 454 }),
                ("element_kernels".into(), PhaseTime { seconds: 6.5, count: 12345 }),
            ],
            start_phases: vec![],
            peak_memory: vec![1 << 27, 1 << 26],
            held: None,
            accuracy: None,
            balance: Default::default(),
            tables: Default::default(),
            warnings: vec![],
            penetrations: vec![
                PenetrationRecord {
                    contact: "sole".into(),
                    deepest: 4e-5,
                    between: [0.0; 2],
                    force: 7.0,
                    asked: Some(5e-5),
                },
                PenetrationRecord {
                    contact: "heel".into(),
                    deepest: 0.0,
                    between: [0.0; 2],
                    force: 0.0,
                    asked: None,
                },
                PenetrationRecord {
                    contact: "toe".into(),
                    deepest: 0.0,
                    between: [0.0; 2],
                    force: 9.0,
                    asked: Some(1e-6),
                },
            ],
            verdict: Verdict::Failed { reason: "x".into(), code: 5 },
        };
        let text = summary(&record);
        assert!(
            text.starts_with(
                "ended early with exit code 5 at t = 0.07 s after 10.0 s\n  steps     140 (1 cut)\n"
            ),
            "{text}"
        );
        assert!(text.contains("sole: deepest penetration 4.000e-5 m, requested 5.000e-5 m\n"), "{text}");
        assert!(text.contains("heel: never closed\n"), "{text}");
        // Multipliers enforce contact exactly.
        assert!(text.contains("toe: deepest penetration 0.000e0 m, requested 1.000e-6 m\n"), "{text}");
        assert!(text.contains("\n  fallbacks 2 to a more robust linear solver"), "{text}");
        assert!(text.contains("128 MiB on the largest of 2 ranks"));
        let table: Vec<&str> = text.lines().skip_while(|line| !line.contains("phase")).collect();
        assert_eq!(table.len(), 4);
        assert!(table.iter().all(|line| line.len() == table[0].len()), "{text}");
        assert!(table[2].contains("element kernels") && table[2].contains("65 %"));
        assert!(table[3].contains("other") && table[3].contains("2.500"));
    }
}
