//! What accuracy was asked and achieved, for `run.json` and the console.

use serde::Serialize;

use crate::case::Units;

/// Four errors; a part that plays no role in the run is absent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Largest penetration, and largest gap under pressure, at the end of a step \[m\].
    #[serde(rename = "penetration [m]", skip_serializing_if = "Option::is_none")]
    pub penetration: Option<f64>,
    /// Creep of sticking points until the end at the fastest there was, over the largest displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<f64>,
    /// Sum of the estimated errors of all steps, over the largest displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Largest energy without a cause, over the largest energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
}

/// Asked and achieved.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AccuracyRecord {
    /// What the case wants.
    pub asked: Errors,
    /// What came of it so far.
    pub achieved: Errors,
    /// Steps that were solved and repeated since their errors were too large.
    pub repeated_steps: u64,
    /// Bodies whose contact surfaces have no mass, so that a penalty can be stiff.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mass_redistributed: Vec<String>,
}

impl AccuracyRecord {
    /// Name, achieved, asked of each part that was asked for.
    fn parts(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let (asked, achieved) = (&self.asked, &self.achieved);
        [
            ("penetration [m]", achieved.penetration, asked.penetration),
            ("slip", achieved.slip, asked.slip),
            ("time", achieved.time, asked.time),
            ("energy", achieved.energy, asked.energy),
        ]
        .into_iter()
        .filter_map(|(name, achieved, asked)| Some((name, achieved?, asked?)))
    }

    /// The parts that missed what was asked, as a warning.
    pub fn warning(&self, units: Units) -> Option<String> {
        let missed: Vec<String> = self
            .parts()
            .filter(|(_, achieved, asked)| *achieved > asked * (1.0 + 1e-9))
            .map(|(name, achieved, asked)| {
                format!("{} {achieved:.1e}, asked {asked:.1e}", units.heading(name))
            })
            .collect();
        (!missed.is_empty()).then(|| format!("warning: the accuracy was not met: {}", missed.join("; ")))
    }

    /// For people.
    pub fn told(&self, units: Units) -> String {
        let parts: Vec<String> = self
            .parts()
            .map(|(name, achieved, asked)| format!("{} {achieved:.1e} of {asked:.1e}", units.heading(name)))
            .collect();
        format!("{}; {} steps repeated", parts.join(", "), self.repeated_steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Only what was asked is compared, and what misses it is named.
    #[test]
    fn tells_what_was_missed() {
        let asked = Errors { time: Some(1e-3), energy: Some(1e-2), ..Errors::default() };
        let achieved = Errors { time: Some(9e-4), energy: Some(2e-2), slip: Some(1.0), ..Errors::default() };
        let record = AccuracyRecord { asked, achieved, repeated_steps: 3, mass_redistributed: Vec::new() };
        assert_eq!(
            record.told(Units::SI),
            "time 9.0e-4 of 1.0e-3, energy 2.0e-2 of 1.0e-2; 3 steps repeated"
        );
        assert_eq!(
            record.warning(Units::SI).as_deref(),
            Some("warning: the accuracy was not met: energy 2.0e-2, asked 1.0e-2")
        );
        let json = serde_json::to_value(&record).unwrap();
        assert_eq!((json["asked"]["time"].as_f64(), json["asked"].get("slip")), (Some(1e-3), None));
    }
}
