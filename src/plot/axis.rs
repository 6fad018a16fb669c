//! Axes: ranges, round ticks, units with the prefix that suits.

/// A quantity along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its SI unit without a prefix; empty for a count, whose ticks are whole.
    pub unit: &'static str,
}

impl Quantity {
    /// A quantity of that name and unit.
    pub fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit }
    }
}

/// An axis ready to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Ends, in SI.
    pub range: [f64; 2],
    /// Positions in SI with what stands there.
    pub ticks: Vec<(f64, String)>,
    /// Name and unit.
    pub label: String,
}

impl Axis {
    /// An axis that holds all finite `values`, with about as many ticks as there is `room` for.
    pub fn covering(
        quantity: &Quantity,
        values: impl IntoIterator<Item = f64>,
        ends: Ends,
        room: f64,
    ) -> Self {
        let [low, high] = spread(values);
        let step = round_step((high - low) / room.clamp(2.0, 8.0));
        let step = if quantity.unit.is_empty() { round_step(step.max(1.0).ceil()) } else { step };
        let range = match ends {
            Ends::Data => [low, high],
            Ends::Padded => [low - 0.04 * (high - low), high + 0.04 * (high - low)],
            Ends::Ticks => [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step],
        };
        let [first, last] = [(range[0] / step - 1e-9).ceil(), (range[1] / step + 1e-9).floor()];
        let positions = (0..=(last - first) as usize).map(|index| (first + index as f64) * step);
        let prefix = Prefix::suiting(quantity.unit, range[0].abs().max(range[1].abs()));
        let shown = step / prefix.factor;
        let ticks = positions.map(|at| (at, number(at / prefix.factor, shown))).collect();
        Self { range, ticks, label: prefix.label(quantity) }
    }
}

/// Where an axis ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// At the outermost data.
    Data,
    /// A little beyond them, so that no curve runs along the frame.
    Padded,
    /// At the ticks beyond them.
    Ticks,
}

/// A prefix of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prefix {
    name: &'static str,
    factor: f64,
}

impl Prefix {
    const ALL: [Self; 8] = [
        Self { name: "n", factor: 1e-9 },
        Self { name: "µ", factor: 1e-6 },
        Self { name: "m", factor: 1e-3 },
        Self { name: "", factor: 1.0 },
        Self { name: "k", factor: 1e3 },
        Self { name: "M", factor: 1e6 },
        Self { name: "G", factor: 1e9 },
        Self { name: "T", factor: 1e12 },
    ];

    /// The prefix with which `largest` is shown as 0.2 to 200; none for pure numbers.
    fn suiting(unit: &str, largest: f64) -> Self {
        let plain = Self { name: "", factor: 1.0 };
        if unit.is_empty() || largest == 0.0 {
            return plain;
        }
        let fits = |prefix: &&Self| largest < 200.0 * prefix.factor * (1.0 + 1e-9);
        *Self::ALL.iter().find(fits).unwrap_or(&Self::ALL[Self::ALL.len() - 1])
    }

    fn label(self, quantity: &Quantity) -> String {
        match quantity.unit {
            "" => quantity.name.clone(),
            unit => format!("{} ({}{unit})", quantity.name, self.name),
        }
    }
}

/// Smallest and largest finite value, opened where they coincide; `[0, 1]` where there is none.
fn spread(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if low > high {
        return [0.0, 1.0];
    }
    let size = low.abs().max(high.abs());
    match high - low > 1e-9 * size {
        true => [low, high],
        false if size == 0.0 => [-1.0, 1.0],
        false => [low - 0.1 * size, high + 0.1 * size],
    }
}

/// The next of 1, 2, 2.5, 5 times a power of ten.
fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A tick's number, with the decimals that its step needs and a true minus sign.
fn number(value: f64, step: f64) -> String {
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    let decimals = (0..9).find(|&d| is_whole(step * 10f64.powi(d))).unwrap_or(9) as usize;
    let text = match value.abs() < 1e6 && decimals < 9 {
        true => format!("{value:.decimals$}"),
        false => format!("{value:.2e}"),
    };
    text.replace('-', "−")
}

fn is_whole(value: f64) -> bool {
    value > 0.5 && (value - value.round()).abs() < 1e-6 * value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(unit: &'static str, values: &[f64], ends: Ends) -> (Axis, Vec<String>) {
        let axis = Axis::covering(&Quantity::new("q", unit), values.iter().copied(), ends, 5.0);
        let texts = axis.ticks.iter().map(|(_, text)| text.clone()).collect();
        (axis, texts)
    }

    /// The paper's time and stress axes come out as one would draw them.
    #[test]
    fn ticks_are_round_and_units_suit() {
        let (time, texts) = axis("s", &[0.0, 0.07], Ends::Data);
        assert_eq!(time.label, "q (ms)");
        assert_eq!(texts, ["0", "20", "40", "60"]);
        let (stress, texts) = axis("Pa", &[-1.2e5, 4.1e5], Ends::Ticks);
        assert_eq!((stress.label.as_str(), stress.range), ("q (MPa)", [-2e5, 6e5]));
        assert_eq!(texts, ["−0.2", "0.0", "0.2", "0.4", "0.6"]);
        assert_eq!(axis("m", &[0.0, 0.5], Ends::Ticks).1, ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(axis("Pa", &[0.0, 12.0], Ends::Ticks).1, ["0.0", "2.5", "5.0", "7.5", "10.0", "12.5"]);
        assert_eq!(axis("", &[0.0, 3.0], Ends::Ticks).1, ["0", "1", "2", "3"]);
        assert_eq!(axis("m", &[0.0, 0.5], Ends::Padded).0.range, [-0.02, 0.52]);
    }

    /// Constant, absent and tiny data give an axis all the same, and all data lie within it.
    #[test]
    fn degenerate_data_have_an_axis() {
        for values in [
            &[][..],
            &[0.0],
            &[3.0, 3.0],
            &[f64::NAN],
            &[1e-300, 2e-300],
            &[1.0, 1.0 + 1e-12],
            &[-1e20, 1e20],
        ] {
            let (axis, texts) = axis("Pa", values, Ends::Ticks);
            assert!(
                axis.range[0] < axis.range[1] && texts.len() >= 2 && texts.len() < 20,
                "{values:?}: {axis:?}"
            );
            assert!(
                values.iter().all(|v| !v.is_finite() || (axis.range[0]..=axis.range[1]).contains(v)),
                "{values:?}"
            );
        }
    }
}
