//! Formats and parses wall times, and estimates the wall time that a run still needs.

use std::time::Duration;

use crate::reader::{quantity, unit};

/// Formats a duration: `0.53 s`, `12.3 s`, `3 min 20 s`, `2 h 05 min`.
pub fn duration(length: Duration) -> String {
    let seconds = length.as_secs_f64();
    let whole = seconds.round() as u64;
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        _ if whole < 3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
    }
}

/// Parses a wall time > 0 as users and batch systems write it: seconds, a number with a unit of
/// time, or hours, minutes and seconds as in `0:55:00`.
///
/// # Errors
/// A message that explains the accepted formats.
pub fn wall_time(text: &str) -> Result<Duration, String> {
    let clock = || {
        let parts: Option<Vec<f64>> = text.split(':').map(|part| part.parse().ok()).collect();
        let parts = parts.filter(|parts| parts.len() == 3)?;
        Some(parts.iter().fold(0.0, |sum, part| 60.0 * sum + part))
    };
    let with_unit = || {
        let (si, dimension) = unit::parse(text).ok()?;
        (dimension == quantity::Duration::DIMENSION).then_some(si)
    };
    let seconds = text.parse().ok().or_else(clock).or_else(with_unit).filter(|seconds| *seconds > 0.0);
    let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    length.ok_or_else(|| "expected a duration > 0, such as 3300, \"55 min\" or 0:55:00".to_owned())
}

/// Wall time per simulated time. The last twenty steps or so have the largest weight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PaceDisplay {
    wall: f64,
    simulated: f64,
}

impl PaceDisplay {
    const MEMORY: f64 = 0.95;

    /// Records a step that took `wall` for a `simulated` time \[s\].
    pub(super) fn advance(&mut self, wall: Duration, simulated: f64) {
        self.wall = Self::MEMORY * self.wall + wall.as_secs_f64();
        self.simulated = Self::MEMORY * self.simulated + simulated;
    }

    /// Wall time for what is `left` of the simulated time \[s\]; `None` before the first step.
    pub(super) fn time_left(&self, left: f64) -> Option<Duration> {
        Duration::try_from_secs_f64(self.wall / self.simulated * left.max(0.0)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wall times are parsed as batch systems and users write them.
    #[test]
    fn wall_times_are_read() {
        for (text, seconds) in [("90", 90), ("2 min", 120), ("0:55:00", 3300), ("1.5 h", 5400)] {
            assert_eq!(wall_time(text), Ok(Duration::from_secs(seconds)), "{text}");
        }
        for text in ["0", "-5", "5 m/s", "soon", "1:2", "nan", ""] {
            assert!(wall_time(text).is_err(), "{text}");
        }
    }

    /// The remaining time follows the pace of recent steps, and is absent before the first.
    #[test]
    fn time_to_go_follows_the_pace() {
        let mut pace = PaceDisplay::default();
        assert_eq!(pace.time_left(1.0), None);
        (0..200).for_each(|_| pace.advance(Duration::from_secs(1), 0.1));
        assert!((pace.time_left(1.0).unwrap().as_secs_f64() - 10.0).abs() < 1e-9);
        (0..200).for_each(|_| pace.advance(Duration::from_secs(2), 0.1));
        assert!((pace.time_left(1.0).unwrap().as_secs_f64() - 20.0).abs() < 0.01);
    }

    /// Durations are formatted readably at every size.
    #[test]
    fn durations_read_well() {
        let texts =
            [0.534, 9.999, 12.34, 59.96, 200.0, 3599.7, 7500.0].map(|s| duration(Duration::from_secs_f64(s)));
        assert_eq!(
            texts,
            ["0.53 s", "10.0 s", "12.3 s", "1 min 00 s", "3 min 20 s", "1 h 00 min", "2 h 05 min"]
        );
    }
}
