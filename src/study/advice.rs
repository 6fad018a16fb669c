//! The conclusions of a study in sentences: the cheapest member for each quantity and accuracy, and
//! the cost of the alternatives.

use super::row::{MemberState, StudyRow};

/// The rows of a study, with the names that the sentences use.
pub struct StudyFindings<'a> {
    /// Names of the axes.
    pub axes: &'a [String],
    /// Names of the quantities.
    pub quantities: &'a [String],
    /// All members.
    pub rows: &'a [StudyRow],
}

impl StudyFindings<'_> {
    /// A sentence for each quantity and target.
    pub fn advice(&self, targets: &[f64]) -> Vec<String> {
        let each = |quantity: usize| targets.iter().map(move |&target| self.sentence(quantity, target));
        (0..self.quantities.len()).flat_map(each).collect()
    }

    /// Completed members with an error in the quantity, without the reference.
    pub fn judged(&self, quantity: usize) -> impl Iterator<Item = (&StudyRow, f64)> {
        let judged = move |row: &'_ StudyRow| {
            let counts = row.state == MemberState::Completed && !row.is_measure[quantity];
            row.errors[quantity].filter(|error| counts && error.is_finite())
        };
        self.rows.iter().filter_map(move |row| judged(row).map(|error| (row, error)))
    }

    fn sentence(&self, quantity: usize, target: f64) -> String {
        let name = &self.quantities[quantity];
        let asked = percent(target);
        let all: Vec<(&StudyRow, f64)> = self.judged(quantity).collect();
        let Some((row, error)) = self.cheapest(&all, &all, target) else {
            return match self.judged(quantity).min_by(|a, b| a.1.total_cmp(&b.1)) {
                None => {
                    format!("for {asked} in {name} there is no advice: no member has an error to compare")
                }
                Some((row, error)) if error <= target => format!(
                    "for {asked} in {name} no member suffices except by accident: {} has {} after {}, and \
                     more when refined",
                    self.described(row),
                    percent(error),
                    seconds(row.cost.cpu)
                ),
                Some((_, error)) if !self.has_order() => {
                    format!("for {asked} in {name} no member suffices: {} at best", percent(error))
                }
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
        let lucky =
            all.iter().filter(|(other, error)| *error <= target && other.cost.cpu < row.cost.cpu).count();
        if lucky > 0 {
            text.push_str(&format!(
                "; {lucky} cheaper only by accident: their error exceeds it when refined"
            ));
        }
        for other in self.others(row) {
            text.push_str(&self.compared(quantity, target, other));
        }
        text
    }

    /// The values of the first axis except that of the member.
    fn others(&self, row: &StudyRow) -> Vec<&str> {
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
        let all: Vec<(&StudyRow, f64)> = self.judged(quantity).collect();
        let of = |row: &StudyRow| row.labels.first().is_some_and(|own| own == label);
        let own: Vec<(&StudyRow, f64)> = all.iter().copied().filter(|(row, _)| of(row)).collect();
        let who = format!("{} = {label}", self.axes[0]);
        match self.cheapest(&own, &all, target) {
            Some((row, _)) => format!("; the cheapest with {who} needs {}", seconds(row.cost.cpu)),
            None if own.iter().any(|(_, error)| *error <= target) => {
                format!("; with {who} some suffice only by accident")
            }
            None => match own.iter().map(|(_, error)| *error).min_by(f64::total_cmp) {
                Some(best) => format!("; with {who} none suffices, {} at best", percent(best)),
                None => format!("; with {who} none completed"),
            },
        }
    }

    /// Describes a member by its values, or by its name if it is outside the grid.
    pub fn described(&self, row: &StudyRow) -> String {
        if row.labels.iter().all(String::is_empty) || self.axes == ["member"] {
            return row.name.clone();
        }
        let parts = self.axes.iter().zip(&row.labels).map(|(axis, label)| format!("{axis} = {label}"));
        parts.collect::<Vec<_>>().join(", ")
    }

    /// The cheapest of `rows` that is accurate enough, and not accidentally: it must stay accurate
    /// enough when it is refined along any one axis.
    fn cheapest<'a>(
        &self,
        rows: &[(&'a StudyRow, f64)],
        all: &[(&StudyRow, f64)],
        target: f64,
    ) -> Option<(&'a StudyRow, f64)> {
        let is_lucky = |row: &StudyRow| {
            all.iter().any(|(other, error)| *error > target && self.is_refinement(other, row))
        };
        let suffices = rows.iter().filter(|(row, error)| *error <= target && !is_lucky(row));
        suffices.copied().min_by(|a, b| a.0.cost.cpu.total_cmp(&b.0.cost.cpu))
    }

    /// Whether a member has more unknowns or steps than another and differs from it along one
    /// ordered axis. If there are several axes, the first one is excluded, because it holds the
    /// compared alternatives.
    fn is_refinement(&self, finer: &StudyRow, row: &StudyRow) -> bool {
        let labels = || row.labels.iter().zip(&finer.labels).enumerate();
        let first = usize::from(row.labels.len() > 1);
        let differences = labels().filter(|(_, (own, other))| own != other).count();
        let varied = labels().skip(first).any(|(axis, (own, other))| own != other && self.is_ordered(axis));
        differences == 1 && varied && finer.cost.size() > row.cost.size()
    }

    /// Whether the values of an axis are numbers, with or without a unit, so that one is finer than
    /// another. Elements, schemes and lists of changes have no order.
    fn is_ordered(&self, axis: usize) -> bool {
        let labels =
            self.rows.iter().filter_map(|row| row.labels.get(axis)).filter(|label| !label.is_empty());
        let number =
            |label: &String| label.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok());
        labels.clone().count() > 0 && labels.clone().all(number)
    }

    /// Whether any axis is ordered, so that a nearest member shows in which direction to refine.
    fn has_order(&self) -> bool {
        (0..self.axes.len()).any(|axis| self.is_ordered(axis))
    }
}

/// A fraction in per cent with two digits.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value {
        0.0 => "0 %".into(),
        v if v < 1e-4 => format!("{v:.1e} %"),
        v => format!("{} %", figures(v)),
    }
}

/// A time with two digits.
pub fn seconds(time: f64) -> String {
    format!("{} s", figures(time))
}

/// A positive number with two digits; the integer part is not rounded.
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

    fn of(name: [&str; 2], cpu: f64, error: f64) -> StudyRow {
        let mut row = row(&name.join("-"), &name, MemberState::Completed);
        row.cost = Cost { cpu, ..Cost::default() };
        row.errors = vec![Some(error)];
        row
    }

    /// The cheapest sufficient member is named, with the cost of each other value of the first
    /// axis. Failed members and references are not suggested.
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
        rows[5].state = MemberState::Failed;
        let names = ["element", "h"].map(str::to_owned);
        let findings = StudyFindings { axes: &names, quantities: &["reaction".into()], rows: &rows };
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
        let nothing = StudyFindings { rows: &rows[3..4], ..findings };
        assert!(nothing.advice(&[0.1])[0].contains("no advice"));
    }

    /// A member whose accuracy is accidental, because the same member with a finer mesh is not
    /// accurate enough, is not suggested, and the sentence says so.
    #[test]
    fn luck_is_not_advised() {
        let mut rows = vec![
            of(["a", "1"], 0.1, 0.001),
            of(["a", "2"], 0.2, 0.3),
            of(["a", "3"], 0.4, 0.005),
            of(["b", "1"], 9.0, 0.2),
        ];
        for (row, unknowns) in rows.iter_mut().zip([1, 2, 3, 1]) {
            row.cost = Cost { unknowns, steps: 1, ..row.cost.clone() };
        }
        let names = ["scheme", "h"].map(str::to_owned);
        let findings = StudyFindings { axes: &names, quantities: &["force".into()], rows: &rows };
        let advice = findings.advice(&[0.01]);
        assert!(advice[0].contains("use scheme = a, h = 3: 0.4 s"), "{advice:?}");
        assert!(
            advice[0].contains("1 cheaper only by accident") && advice[0].contains("b none suffices"),
            "{advice:?}"
        );
    }

    /// Settings that were changed one at a time have no order. None of them counts as accidental,
    /// and none is the nearest.
    #[test]
    fn changes_have_no_order() {
        let mut rows = vec![
            of(["", "as-shipped"], 0.1, 0.001),
            of(["", "step-1-ms"], 0.05, 0.3),
            of(["", "stick-1e-4"], 0.4, 0.005),
        ];
        for (row, steps) in rows.iter_mut().zip([2, 1, 3]) {
            row.labels.remove(0);
            row.cost = Cost { unknowns: 1, steps, ..row.cost.clone() };
        }
        rows[2].errors = vec![Some(0.02)];
        let names = ["change".to_owned()];
        let findings = StudyFindings { axes: &names, quantities: &["force".into()], rows: &rows };
        let advice = findings.advice(&[0.01, 1e-4]);
        assert!(
            advice[0].contains("use change = as-shipped") && !advice[0].contains("accident"),
            "{advice:?}"
        );
        assert_eq!(advice[1], "for 0.01 % in force no member suffices: 0.1 % at best");
    }

    /// Numbers have two digits.
    #[test]
    fn numbers_read_well() {
        assert_eq!([0.1, 0.0123, 1.5e-7, 0.0].map(percent), ["10 %", "1.2 %", "1.5e-5 %", "0 %"]);
        assert_eq!([0.0421, 12.34, 123.4].map(seconds), ["0.042 s", "12 s", "123 s"]);
    }
}
