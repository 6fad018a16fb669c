//! Units: what `"5 MPa"` or `"1e-10 m/Pa"` means in SI.

use super::complaint::Complaint;

/// Exponents of kg, m and s; fractions occur in power laws.
#[derive(Debug, Clone, Copy)]
pub struct Dimension(pub [f64; 3]);

impl PartialEq for Dimension {
    fn eq(&self, other: &Self) -> bool {
        self.0.iter().zip(other.0).all(|(a, b)| (a - b).abs() < 1e-6)
    }
}

/// Name, exponents of kg, m, s, and a way to write it; what errors say of a dimension.
const NAMES: [(&str, [i8; 3], &str); 19] = [
    ("a pure number", [0, 0, 0], "0.45"),
    ("a length", [0, 1, 0], "0.5 mm"),
    ("an area", [0, 2, 0], "2 cm2"),
    ("a time", [0, 0, 1], "10 ms"),
    ("a frequency", [0, 0, -1], "50 Hz"),
    ("a mass", [1, 0, 0], "2 t"),
    ("a velocity", [0, 1, -1], "1 mm/s"),
    ("an inverse velocity", [0, -1, 1], "0.3 s/m"),
    ("an acceleration", [0, 1, -2], "9.81 m/s2"),
    ("a density", [1, -3, 0], "1700 kg/m3"),
    ("a force", [1, 1, -2], "2 kN"),
    ("a force per length", [1, 0, -2], "300 kN/m"),
    ("a pressure", [1, -1, -2], "5 MPa"),
    ("a compliance", [-1, 2, 2], "1e-10 m/Pa"),
    ("a stiffness per area", [1, -2, -2], "1 GPa/m"),
    ("a damping coefficient", [1, 0, -1], "50 N s/m"),
    ("a damping coefficient per area", [1, -2, -1], "2 MPa s/m"),
    ("an energy or a torque", [1, 2, -2], "3 kJ"),
    ("a power", [1, 2, -3], "3 kW"),
];

impl Dimension {
    /// Of a pure number.
    pub const NONE: Self = Self([0.0; 3]);

    fn entry(self) -> Option<&'static (&'static str, [i8; 3], &'static str)> {
        NAMES.iter().find(|(_, exponents, _)| Self(exponents.map(f64::from)) == self)
    }

    /// What it is called, if it has a name.
    pub fn name(self) -> Option<&'static str> {
        self.entry().map(|(name, ..)| *name)
    }

    /// A value of this dimension as one may write it, where it has a name.
    pub fn example(self) -> Option<&'static str> {
        self.entry().map(|(.., example)| *example)
    }
}

/// Units and their SI value; `true` where prefixes apply. A whole symbol goes before prefix and unit (`min`, `ft`, `Pa`).
const UNITS: [(&str, f64, [i8; 3], bool); 21] = [
    ("m", 1.0, [0, 1, 0], true),
    ("g", 1e-3, [1, 0, 0], true),
    ("s", 1.0, [0, 0, 1], true),
    ("N", 1.0, [1, 1, -2], true),
    ("Pa", 1.0, [1, -1, -2], true),
    ("J", 1.0, [1, 2, -2], true),
    ("W", 1.0, [1, 2, -3], true),
    ("Hz", 1.0, [0, 0, -1], true),
    ("bar", 1e5, [1, -1, -2], true),
    ("t", 1e3, [1, 0, 0], false),
    ("min", 60.0, [0, 0, 1], false),
    ("h", 3600.0, [0, 0, 1], false),
    ("in", 0.0254, [0, 1, 0], false),
    ("ft", 0.3048, [0, 1, 0], false),
    ("lb", 0.453_592_37, [1, 0, 0], false),
    ("slug", 14.593_902_937_206_364, [1, 0, 0], false),
    ("slinch", 175.126_835_246_476_36, [1, 0, 0], false),
    ("lbf", 4.448_221_615_260_5, [1, 1, -2], false),
    ("psi", 6_894.757_293_168, [1, -1, -2], false),
    ("ksi", 6.894_757_293_168e6, [1, -1, -2], false),
    ("1", 1.0, [0, 0, 0], false),
];

const PREFIXES: [(&str, f64); 11] = [
    ("p", 1e-12),
    ("n", 1e-9),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("μ", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];

/// A unit with its prefix: prefix, symbol, value in SI, exponents of kg, m, s.
pub(super) fn symbol(text: &str) -> Option<(&'static str, &'static str, f64, [i8; 3])> {
    if let Some((name, value, exponents, _)) = UNITS.iter().find(|unit| unit.0 == text) {
        return Some(("", name, *value, *exponents));
    }
    PREFIXES.iter().find_map(|(prefix, factor)| {
        let rest = text.strip_prefix(prefix)?;
        let (name, value, exponents, _) = UNITS.iter().find(|unit| unit.0 == rest && unit.3)?;
        Some((*prefix, *name, factor * value, *exponents))
    })
}

/// The complaint about a unit that is not known.
pub(super) fn unknown(name: &str) -> Complaint {
    let known: Vec<&str> = UNITS.iter().map(|unit| unit.0).filter(|unit| *unit != "1").collect();
    let angle = if name.starts_with("deg") || name.starts_with("rad") {
        "angles are numbers in radians, such as \"70 * pi / 180\"; "
    } else {
        ""
    };
    Complaint::new(format!("unknown unit '{name}'"))
        .hint(format!("{angle}known: {}, with the prefixes p n u m c d k M G", known.join(", ")))
}

/// Length of the number at the start of a text; no number that a user means is longer than 64 characters.
pub(super) fn number_length(text: &str) -> usize {
    let mut longest = 0;
    for (at, c) in text.char_indices().take(64) {
        if !(c.is_ascii_digit() || "+-.eE".contains(c)) {
            break;
        }
        if text[..=at].parse::<f64>().is_ok() {
            longest = at + 1;
        }
    }
    longest
}

/// Whether a text begins with a number that a word follows, as in `5 mm`.
pub(super) fn follows_number(text: &str) -> bool {
    let bare = text.trim_start();
    let after = bare[number_length(bare)..].trim_start();
    after.len() < bare.len() && after.starts_with(char::is_alphabetic)
}

/// Value in SI and dimension of a number with a unit, as `"300 kN/m"`, `"1700 kg/m^3"`, `"2 N*s/m"`.
///
/// # Errors
/// The text has no number or an unknown unit. The error has its position.
pub fn parse(text: &str) -> Result<(f64, Dimension), Complaint> {
    let digits = number_length(text.trim_start());
    let indent = text.len() - text.trim_start().len();
    let number = text[indent..indent + digits].parse::<f64>();
    let Ok(mut si) = number else {
        return Err(Complaint::new(format!("'{text}' is not a number with a unit")));
    };
    let mut exponents = [0.0; 3];
    let mut start = indent + digits;
    let mut sign = 1.0;
    while let Some((name, power, end)) = factor(text, start)? {
        match text[start..].trim_start().chars().next() {
            Some('/') => sign = -1.0,
            Some('*' | '·') => sign = 1.0,
            // After a bare space the sign stays: "J/kg K" divides by both.
            _ => {}
        }
        let (_, _, value, dimension) = symbol(name).ok_or_else(|| unknown(name))?;
        si *= value.powf(sign * power);
        for (sum, exponent) in exponents.iter_mut().zip(dimension) {
            *sum += sign * power * f64::from(exponent);
        }
        start = end;
    }
    if si.is_finite() {
        Ok((si, Dimension(exponents)))
    } else {
        Err(Complaint::new(format!("'{text}' is not a finite number")))
    }
}

/// The next unit in a product: its symbol, its exponent, where it ends.
fn factor(text: &str, start: usize) -> Result<Option<(&str, f64, usize)>, Complaint> {
    let rest = text[start..].trim_start_matches([' ', '*', '·', '/']);
    if rest.is_empty() {
        let dangling = !text[start..].trim().is_empty();
        return if dangling {
            Err(Complaint::new(format!("'{text}' ends where a unit is expected")))
        } else {
            Ok(None)
        };
    }
    let from = text.len() - rest.len();
    let length = match rest.strip_prefix('1') {
        Some(_) => 1,
        None => rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len()),
    };
    if length == 0 {
        return Err(Complaint::new(format!("'{text}' is not a number with a unit")));
    }
    let (name, tail) = rest.split_at(length);
    let written = tail.strip_prefix('^').unwrap_or(tail);
    let digits = number_length(written);
    let power = if digits == 0 { 1.0 } else { written[..digits].parse().unwrap_or(1.0) };
    let end = from + length + if digits == 0 { 0 } else { tail.len() - written.len() + digits };
    Ok(Some((name, power, end)))
}
