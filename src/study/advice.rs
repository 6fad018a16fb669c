//! What a study comes to, in sentences: the cheapest member for each quantity and accuracy, and what others need.

use super::row::{Row, State};

/// A table of rows with the names that sentences need.
pub struct Findings<'a> {
    /// Names of the axes.
    pub axes: &'a [String],
    /// Names of the quantities.
    pub quantities: &'a [String],
    /// All members.
    pub rows: &'a [Row],
}

impl Findings<'_> {
    /// A sentence for each quantity and target.
    pub fn advice(&self, targets: &[f64]) -> Vec<String> {
        let each = |quantity: usize| targets.iter().map(move |&target| self.sentence(quantity, target));
        (0..self.quantities.len()).flat_map(each).collect()
    }

    /// Completed members with an error in the quantity, the reference left out.
    pub fn judged(&self, quantity: usize) -> impl Iterator<Item = (&Row, f64)> {
        let judged = move |row: &'_ Row| {
            let counts = row.state == State::Completed && !row.is_measure[quantity];
            row.errors[quantity].filter(|error| counts && error.is_finite())
        };
        self.rows.iter().filter_map(move |row| judged(row).map(|error| (row, error)))
    }

    fn sentence(&self, quantity: usize, target: f64) -> String {
        let name = &self.quantities[quantity];
        let asked = percent(target);
        let Some((row, error)) = cheapest(self.judged(quantity), target) else {
            return match self.judged(quantity).min_by(|a, b| a.1.total_cmp(&b.1)) {
                None => format!(
                    "for {asked} in {name} there is nothing to say: no member has an error to judge by"
                ),
                Some((row, error)) => format!(
                    "for {asked} in {name} no member suffices; the nearest is {} with {} after {}",
                    self.described(row),
                    percent(error),
                    seconds(row.cost.cpu)
                ),
            };
        };
        let mut text = format!(
            "for {asked} in {name} use {}: {} of CPU time, error {}",
            self.described(row),
            seconds(row.cost.cpu),
            percent(error)
        );
        for other in self.others(row) {
            text.push_str(&self.compared(quantity, target, other));
        }
        text
    }

    /// The values of the first axis other than that of the member.
    fn others(&self, row: &Row) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        if self.axes.len() < 2 {
            return labels;
        }
        let first = row.labels.first().map(String::as_str);
        for label in self.rows.iter().filter_map(|row| row.labels.first().map(String::as_str)) {
            if !label.is_empty() && Some(label) != first && !labels.contains(&label) {
                labels.push(label);
            }
        }
        labels
    }

    fn compared(&self, quantity: usize, target: f64, label: &str) -> String {
        let of =
            || self.judged(quantity).filter(|(row, _)| row.labels.first().is_some_and(|own| own == label));
        let who = format!("{} = {label}", self.axes[0]);
        match cheapest(of(), target) {
            Some((row, _)) => format!("; the cheapest with {who} needs {}", seconds(row.cost.cpu)),
            None => match of().map(|(_, error)| error).min_by(f64::total_cmp) {
                Some(best) => format!("; with {who} none suffices, {} at best", percent(best)),
                None => format!("; with {who} none completed"),
            },
        }
    }

    /// A member by its values, or by its name where it stands outside of the grid.
    pub fn described(&self, row: &Row) -> String {
        if row.labels.iter().all(String::is_empty) || self.axes == ["member"] {
            return row.name.clone();
        }
        let parts = self.axes.iter().zip(&row.labels).map(|(axis, label)| format!("{axis} = {label}"));
        parts.collect::<Vec<_>>().join(", ")
    }
}

fn cheapest<'a>(rows: impl Iterator<Item = (&'a Row, f64)>, target: f64) -> Option<(&'a Row, f64)> {
    rows.filter(|(_, error)| *error <= target).min_by(|a, b| a.0.cost.cpu.total_cmp(&b.0.cost.cpu))
}

/// A share in per cent, two figures.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value {
        0.0 => "0 %".into(),
        v if v < 1e-4 => format!("{v:.1e} %"),
        v => format!("{} %", figures(v)),
    }
}

/// A time with two figures.
pub fn seconds(time: f64) -> String {
    format!("{} s", figures(time))
}

/// A positive number with two figures, the whole part whole.
fn figures(value: f64) -> String {
    if value <= 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (1 - value.log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::super::row::Cost;
    use super::super::tests::row;
    use super::*;

    fn of(name: [&str; 2], cpu: f64, error: f64) -> Row {
        let mut row = row(&name.join("-"), &name, State::Completed);
        row.cost = Cost { cpu, ..Cost::default() };
        row.errors = vec![Some(error)];
        row
    }

    /// The cheapest member that suffices is named, with what each other value of the first axis needs; members that
    /// failed, or that all are measured by, are not advised.
    #[test]
    fn the_cheapest_that_suffices_is_advised() {
        let mut rows = vec![
            of(["quad4", "0.1"], 0.1, 0.2),
            of(["quad4", "0.01"], 2.123, 0.009),
            of(["quad9", "0.1"], 0.4, 0.0062),
            of(["quad9", "0.01"], 9.0, 0.0),
            of(["tri3", "0.1"], 0.05, 0.5),
            of(["tri6", "0.1"], 0.01, 1e-9),
        ];
        rows[3].is_measure = vec![true];
        rows[5].state = State::Failed;
        let names = ["element", "h"].map(str::to_owned);
        let findings = Findings { axes: &names, quantities: &["reaction".into()], rows: &rows };
        let advice = findings.advice(&[0.01, 1e-4]);
        assert_eq!(
            advice[0],
            "for 1 % in reaction use element = quad9, h = 0.1: 0.4 s of CPU time, error 0.62 %; the cheapest with \
             element = quad4 needs 2.1 s; with element = tri3 none suffices, 50 % at best; with element = tri6 none completed"
        );
        assert!(
            advice[1].contains(
                "no member suffices; the nearest is element = quad9, h = 0.1 with 0.62 % after 0.4 s"
            )
        );
        let nothing = Findings { rows: &rows[3..4], ..findings };
        assert!(nothing.advice(&[0.1])[0].contains("nothing to say"));
    }

    /// Numbers have two figures.
    #[test]
    fn numbers_read_well() {
        assert_eq!([0.1, 0.0123, 1.5e-7, 0.0].map(percent), ["10 %", "1.2 %", "1.5e-5 %", "0 %"]);
        assert_eq!([0.0421, 12.34, 123.4].map(seconds), ["0.042 s", "12 s", "123 s"]);
    }
}
