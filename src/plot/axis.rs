//! Axes: ranges, round ticks, and units with a suitable prefix.

use crate::case::Units;

/// A quantity along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisQuantity {
    /// Its name.
    pub name: String,
    /// Its unit. It is empty for a pure number, whose ticks are integers if all values are.
    pub unit: String,
    /// Whether the unit gets a prefix that suits the values.
    pub takes_prefix: bool,
    /// Linear or logarithmic scale.
    pub scale: Scale,
}

/// The units of a figure: SI with suitable prefixes if all results are metric, otherwise those of
/// the first result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Display {
    units: Units,
    takes_prefixes: bool,
}

impl Display {
    /// The units in which results with the units `results` are shown together.
    pub fn of(results: &[Units]) -> Self {
        let takes_prefixes = results.iter().all(Units::is_metric);
        let first = results.first().copied().unwrap_or_default();
        Self { units: if takes_prefixes { Units::SI } else { first }, takes_prefixes }
    }

    /// A quantity, given by its SI unit.
    pub fn quantity(&self, name: impl Into<String>, si: &str) -> AxisQuantity {
        AxisQuantity { takes_prefix: self.takes_prefixes, ..AxisQuantity::new(name, self.units.of(si)) }
    }

    /// Factor that converts numbers of a result to the units of the figure, given the SI unit of
    /// their kind.
    pub fn factor(&self, result: Units, si: &str) -> f64 {
        result.si_value(si) / self.units.si_value(si)
    }
}

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Logarithmic; values that are not positive are not shown.
    Logarithmic,
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => value.log10(),
        }
    }
}

impl AxisQuantity {
    /// A quantity with a name and a unit. The unit is an SI unit without a prefix, or empty.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), takes_prefix: true, scale: Scale::Linear }
    }
}

/// An axis ready to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Ends, in the unit without a prefix.
    pub range: [f64; 2],
    /// Positions in that unit, with their labels.
    pub ticks: Vec<(f64, String)>,
    /// Name and unit.
    pub label: String,
    /// The scale between the ends.
    pub scale: Scale,
}

impl Axis {
    /// An axis that contains all finite `values`, with about `room` ticks.
    pub fn covering(
        quantity: &AxisQuantity,
        values: impl IntoIterator<Item = f64>,
        ends: AxisEnds,
        room: f64,
    ) -> Self {
        if quantity.scale == Scale::Logarithmic {
            return Self::of_decades(quantity, values, ends);
        }
        let values: Vec<f64> = values.into_iter().collect();
        let counts = quantity.unit.is_empty() && values.iter().all(|v| !v.is_finite() || v.fract() == 0.0);
        let [low, high] = spread(values);
        // The difference of the two ends may be infinite, but fractions of the ends are finite.
        let room = room.clamp(2.0, 8.0);
        let step = round_step(high / room - low / room);
        let step = if counts { round_step(step.max(1.0).ceil()) } else { step };
        let range = match ends {
            AxisEnds::Data => [low, high],
            AxisEnds::Padded => {
                let beyond = 0.04 * high - 0.04 * low;
                [low - beyond, high + beyond]
            }
            AxisEnds::Ticks => [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step],
        };
        let range = range.map(|end| end.clamp(f64::MIN, f64::MAX));
        let [first, last] = [(range[0] / step - 1e-9).ceil(), (range[1] / step + 1e-9).floor()];
        let positions = (0..=(last - first) as usize).map(|index| (first + index as f64) * step);
        let prefix = Prefix::suiting(quantity, range[0].abs().max(range[1].abs()));
        let shown = step / prefix.factor;
        let ticks = positions.map(|at| (at, number(at / prefix.factor, shown))).collect();
        Self { range, ticks, label: prefix.label(quantity), scale: Scale::Linear }
    }

    /// A logarithmic axis that contains all positive `values`.
    fn of_decades(quantity: &AxisQuantity, values: impl IntoIterator<Item = f64>, ends: AxisEnds) -> Self {
        let positive = values.into_iter().filter(|value| *value > 0.0 && value.is_finite());
        let [low, high] = spread(positive.map(f64::log10));
        let beyond = if ends == AxisEnds::Data { 0.0 } else { 0.04 * (high - low) };
        let [low, high] = [low - beyond, high + beyond];
        // The fewest round numbers that still identify positions on the axis.
        let rounds: [&[u8]; 4] = [&[1], &[1, 3], &[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]];
        let ticks = rounds.map(|leading| decade_ticks(leading, low, high));
        let ticks = ticks.iter().find(|ticks| ticks.len() > 2).unwrap_or(&ticks[3]).clone();
        let plain = Prefix { name: "", factor: 1.0 };
        let range = [low, high].map(|end| 10f64.powf(end).clamp(SMALLEST, f64::MAX));
        Self { range, ticks, label: plain.label(quantity), scale: Scale::Logarithmic }
    }

    /// Relative position of a value: 0 at the first end, 1 at the last.
    pub fn share(&self, value: f64) -> f64 {
        // The values are halved so that their difference is finite.
        let [first, last, value] = [self.range[0], self.range[1], value].map(|end| 0.5 * self.scale.of(end));
        (value - first) / (last - first)
    }
}

/// The numbers between two powers of ten whose leading digits are the given ones.
fn decade_ticks(leading: &[u8], low: f64, high: f64) -> Vec<(f64, String)> {
    let powers = low.floor() as i32..=high.ceil() as i32;
    let all = powers.flat_map(|power| leading.iter().map(move |&figure| (figure, power)));
    let ticks = all
        .map(|(figure, power)| (f64::from(figure) * 10f64.powf(f64::from(power)), power_text(figure, power)));
    ticks.filter(|(at, _)| (low - 1e-9..=high + 1e-9).contains(&at.log10())).collect()
}

/// Formats a digit times a power of ten.
fn power_text(figure: u8, power: i32) -> String {
    match power {
        0..5 => format!("{figure}{}", "0".repeat(power as usize)),
        -3..0 => format!("0.{}{figure}", "0".repeat((-power - 1) as usize)),
        _ => {
            let raised = power.to_string().chars().map(raised).collect::<String>();
            if figure == 1 { format!("10{raised}") } else { format!("{figure}·10{raised}") }
        }
    }
}

fn raised(letter: char) -> char {
    match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or('⁰'),
    }
}

/// Position of the ends of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisEnds {
    /// At the outermost data.
    Data,
    /// Slightly beyond the data, so that no curve runs along the frame.
    Padded,
    /// At the ticks beyond the data.
    Ticks,
}

/// A prefix of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prefix {
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

    /// The prefix with which `largest` is shown as 0.2 to 200; no prefix for pure numbers.
    fn suiting(quantity: &AxisQuantity, largest: f64) -> Self {
        let plain = Self { name: "", factor: 1.0 };
        if quantity.unit.is_empty() || !quantity.takes_prefix || largest == 0.0 {
            return plain;
        }
        let fits = |prefix: &&Self| largest < 200.0 * prefix.factor * (1.0 + 1e-9);
        *Self::ALL.iter().find(fits).unwrap_or(&Self::ALL[Self::ALL.len() - 1])
    }

    /// A value of a quantity with seven digits, its prefix and its unit.
    pub(super) fn applied(quantity: &AxisQuantity, value: f64) -> String {
        let prefix = Self::suiting(quantity, value.abs());
        let digits = format!("{:.6e}", value / prefix.factor);
        let number = digits.parse::<f64>().unwrap_or(value / prefix.factor);
        format!("{number} {}{}", prefix.name, quantity.unit)
    }

    fn label(self, quantity: &AxisQuantity) -> String {
        match quantity.unit.as_str() {
            "" => quantity.name.clone(),
            unit => format!("{} ({}{unit})", quantity.name, self.name),
        }
    }
}

/// The smallest positive number.
const SMALLEST: f64 = f64::from_bits(1);

/// Magnitudes below this count as zero, so that steps and ticks keep their digits.
const NOTHING: f64 = 1e-300;

/// Smallest and largest finite value, widened if they coincide; `[0, 1]` if there is no value.
fn spread(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if low > high {
        return [0.0, 1.0];
    }
    let size = low.abs().max(high.abs());
    match high - low > 1e-9 * size {
        _ if size < NOTHING => [-1.0, 1.0],
        true => [low, high],
        false => [low - 0.1 * size, high + 0.1 * size].map(|end| end.clamp(f64::MIN, f64::MAX)),
    }
}

/// The next of 1, 2, 2.5, 5 times a power of ten.
fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough * (1.0 - 1e-9));
    (factor.unwrap_or(10.0) * power).min(f64::MAX)
}

/// The label of a tick, with the decimals that its step needs and a true minus sign.
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

    fn axis(unit: &'static str, values: &[f64], ends: AxisEnds) -> (Axis, Vec<String>) {
        let axis = Axis::covering(&AxisQuantity::new("q", unit), values.iter().copied(), ends, 5.0);
        let texts = axis.ticks.iter().map(|(_, text)| text.clone()).collect();
        (axis, texts)
    }

    /// The time and stress axes of the paper get the expected ticks.
    #[test]
    fn ticks_are_round_and_units_suit() {
        let (time, texts) = axis("s", &[0.0, 0.07], AxisEnds::Data);
        assert_eq!(time.label, "q (ms)");
        assert_eq!(texts, ["0", "20", "40", "60"]);
        let (stress, texts) = axis("Pa", &[-1.2e5, 4.1e5], AxisEnds::Ticks);
        assert_eq!((stress.label.as_str(), stress.range), ("q (MPa)", [-2e5, 6e5]));
        assert_eq!(texts, ["−0.2", "0.0", "0.2", "0.4", "0.6"]);
        assert_eq!(axis("m", &[0.0, 0.5], AxisEnds::Ticks).1, ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(axis("Pa", &[0.0, 12.0], AxisEnds::Ticks).1, ["0.0", "2.5", "5.0", "7.5", "10.0", "12.5"]);
        assert_eq!(axis("", &[0.0, 3.0], AxisEnds::Ticks).1, ["0", "1", "2", "3"]);
        assert_eq!(axis("m", &[0.0, 0.5], AxisEnds::Padded).0.range, [-0.02, 0.52]);
    }

    /// Logarithmic axes have a tick per decade over many decades and finer ones over few. Only
    /// positive values count.
    #[test]
    fn decades_have_ticks() {
        let texts = |values: &[f64]| -> Vec<String> {
            let quantity = AxisQuantity { scale: Scale::Logarithmic, ..AxisQuantity::new("q [s]", "") };
            let axis = Axis::covering(&quantity, values.iter().copied(), AxisEnds::Padded, 5.0);
            assert_eq!(axis.label, "q [s]");
            let inside = |at: f64| (0.0..=1.0).contains(&axis.share(at));
            assert!(values.iter().all(|&v| v.is_nan() || v <= 0.0 || inside(v)), "{axis:?}");
            assert!(axis.ticks.iter().all(|&(at, _)| inside(at)), "{axis:?}");
            axis.ticks.into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts(&[1e-12, -1.0, 1e-8, f64::NAN]), ["10⁻¹²", "10⁻¹¹", "10⁻¹⁰", "10⁻⁹", "10⁻⁸"]);
        assert_eq!(texts(&[0.1, 4.0]), ["0.1", "0.3", "1", "3"]);
        assert_eq!(texts(&[2e-5, 4.5e-5]), ["2·10⁻⁵", "3·10⁻⁵", "4·10⁻⁵"]);
        assert!(texts(&[7.0]).len() >= 2 && texts(&[]).len() >= 2);
        assert!(texts(&[f64::from_bits(1), f64::MAX]).len() > 20 && texts(&[f64::MAX]).len() >= 2);
    }

    /// Constant, absent and tiny data still give an axis, and all data lie within it.
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
            &[-1e308, 1e308],
            &[f64::MIN, f64::MAX],
            &[f64::MAX],
            &[f64::from_bits(1), f64::from_bits(2)],
        ] {
            for ends in [AxisEnds::Ticks, AxisEnds::Padded, AxisEnds::Data] {
                let (axis, texts) = axis("Pa", values, ends);
                let is_number = |text: &String| !text.contains("NaN") && !text.contains("inf");
                assert!(
                    texts.iter().all(is_number) && axis.range.iter().all(|end| end.is_finite()),
                    "{axis:?}"
                );
                assert!(
                    values.iter().all(|&v| !v.is_finite() || (0.0..=1.0).contains(&axis.share(v))),
                    "{axis:?}"
                );
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
        assert!(round_step(f64::MAX).is_finite());
    }

    /// Results in metric units are shown in SI with prefixes, whatever their units. Other results
    /// are shown in the units of the first.
    #[test]
    fn figures_have_one_system_of_units() {
        let system = |length: &str, mass: &str| -> Units {
            serde_json::from_value(serde_json::json!({ "length": length, "mass": mass })).unwrap()
        };
        let (mm, inch) = (system("mm", "t"), system("in", "lb"));
        let shown = Display::of(&[mm, Units::SI]);
        assert!((shown.factor(mm, "Pa") / 1e6 - 1.0).abs() < 1e-12 && shown.factor(Units::SI, "Pa") == 1.0);
        let axis = Axis::covering(&shown.quantity("stress", "Pa"), [0.0, 4e6], AxisEnds::Ticks, 5.0);
        assert_eq!(axis.label, "stress (MPa)");
        let shown = Display::of(&[inch, Units::SI]);
        assert!((shown.factor(Units::SI, "m") * 0.0254 - 1.0).abs() < 1e-12);
        let axis = Axis::covering(&shown.quantity("x", "m"), [0.0, 4e6], AxisEnds::Ticks, 5.0);
        assert_eq!(axis.label, "x (in)");
    }
}
