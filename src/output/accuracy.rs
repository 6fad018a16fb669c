//! Requested and achieved accuracy, for `run.json` and the console.

use serde::Serialize;

use crate::case::Units;

/// Four errors. An error that plays no role in the run is absent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Largest penetration, and largest gap under pressure, at the end of a step \[m\].
    #[serde(rename = "penetration [m]", skip_serializing_if = "Option::is_none")]
    pub penetration: Option<f64>,
    /// Creep of sticking points extrapolated to the end at its largest rate, over the largest
    /// displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<f64>,
    /// Sum of the estimated errors of all steps, over the largest displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Largest unexplained energy, over the largest energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
}

/// Requested and achieved accuracy.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AccuracyRecord {
    /// The tolerances that the case requests.
    pub asked: Errors,
    /// The errors so far.
    pub achieved: Errors,
    /// Number of steps that were solved and repeated because their errors were too large.
    pub repeated_steps: u64,
    /// Bodies whose contact surfaces are massless, which permits a stiff penalty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mass_redistributed: Vec<String>,
}

impl AccuracyRecord {
    /// Name, achieved error and tolerance of each requested part.
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

    /// A warning that lists the parts that exceed their tolerance.
    pub fn warning(&self, units: Units) -> Option<String> {
        let missed: Vec<String> = self
            .parts()
            .filter(|(_, achieved, asked)| *achieved > asked * (1.0 + 1e-9))
            .map(|(name, achieved, asked)| {
                format!("{} {achieved:.1e}, requested {asked:.1e}", units.heading(name))
            })
            .collect();
        (!missed.is_empty())
            .then(|| format!("warning: the requested accuracy was not reached: {}", missed.join("; ")))
    }

    /// The accuracy as text for the console.
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

    /// Only requested parts are compared, and those that exceed their tolerance are named.
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
            Some("warning: the requested accuracy was not reached: energy 2.0e-2, requested 1.0e-2")
        );
        let json = serde_json::to_value(&record).unwrap();
        assert_eq!((json["asked"]["time"].as_f64(), json["asked"].get("slip")), (Some(1e-3), None));
    }
}
