//! The units of a case: three base units, from which the units of everything else follow.
//!
//! A solver that is handed consistent numbers needs no conversion. So the numbers of a case stay as they are written,
//! strings with a unit are converted into the units of the case as they are read, and the results have the units of the
//! case in their headers.

use std::borrow::Cow;
use std::cell::Cell;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;
use super::unit::{self, Dimension};

/// A unit of length, mass or time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Base {
    prefix: &'static str,
    name: &'static str,
    /// Its value in SI units.
    si: f64,
}

/// A consistent system of units, by default m, kg, s. Plain numbers of a case are in these units and in those that follow
/// from them: with mm, t and s a force is in N, a pressure in MPa, an energy in mJ. A string with a unit, such as "5 MPa",
/// means the same in every system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    length: Base,
    mass: Base,
    time: Base,
}

thread_local! {
    /// Units of the case that is being read: serde carries no context.
    static READING: Cell<Units> = const { Cell::new(Units::SI) };
}

/// What a derived unit is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    Length,
    Mass,
    Time,
    Force,
    Pressure,
    Energy,
    Power,
}

/// Units that have a name of their own: part, symbol in SI, exponents of kg, m and s.
const NAMED: [(Part, &str, [i8; 3]); 4] = [
    (Part::Force, "N", [1, 1, -2]),
    (Part::Pressure, "Pa", [1, -1, -2]),
    (Part::Energy, "J", [1, 2, -2]),
    (Part::Power, "W", [1, 2, -3]),
];

/// Names of derived units that are no SI units, with their SI values.
const CUSTOMARY: [(Part, &str, f64); 2] =
    [(Part::Force, "lbf", 4.448_221_615_260_5), (Part::Pressure, "psi", 6_894.757_293_168)];

/// The exponents of mass, length and time of a unit, and the parts that it is written in with theirs.
type Writing = ([i8; 3], &'static [(Part, i8)]);

/// How derived units are written, by the exponents of mass, length and time; what is not listed is written in base units.
const WRITTEN: [Writing; 20] = [
    ([0, 1, 0], &[(Part::Length, 1)]),
    ([0, 2, 0], &[(Part::Length, 2)]),
    ([0, 3, 0], &[(Part::Length, 3)]),
    ([1, 0, 0], &[(Part::Mass, 1)]),
    ([0, 0, 1], &[(Part::Time, 1)]),
    ([0, 0, -1], &[(Part::Time, -1)]),
    ([0, 1, -1], &[(Part::Length, 1), (Part::Time, -1)]),
    ([0, 1, -2], &[(Part::Length, 1), (Part::Time, -2)]),
    ([1, -3, 0], &[(Part::Mass, 1), (Part::Length, -3)]),
    ([1, 1, -2], &[(Part::Force, 1)]),
    ([1, 0, -2], &[(Part::Force, 1), (Part::Length, -1)]),
    ([1, -1, -2], &[(Part::Pressure, 1)]),
    ([-1, 2, 2], &[(Part::Length, 1), (Part::Pressure, -1)]),
    ([1, -2, -2], &[(Part::Pressure, 1), (Part::Length, -1)]),
    ([1, 0, -1], &[(Part::Force, 1), (Part::Time, 1), (Part::Length, -1)]),
    ([1, -2, -1], &[(Part::Pressure, 1), (Part::Time, 1), (Part::Length, -1)]),
    ([1, 2, -2], &[(Part::Energy, 1)]),
    ([1, 2, -3], &[(Part::Power, 1)]),
    ([1, 1, -1], &[(Part::Force, 1), (Part::Time, 1)]),
    ([1, 2, -1], &[(Part::Force, 1), (Part::Length, 1), (Part::Time, 1)]),
];

/// Prefixes that a named unit may get.
const SCALES: [(&str, f64); 8] =
    [("", 1.0), ("m", 1e-3), ("k", 1e3), ("M", 1e6), ("G", 1e9), ("µ", 1e-6), ("n", 1e-9), ("p", 1e-12)];

/// The SI unit of a moment.
const MOMENT: &str = "N m";

impl Units {
    /// Metre, kilogram, second.
    pub const SI: Self = Self {
        length: Base { prefix: "", name: "m", si: 1.0 },
        mass: Base { prefix: "k", name: "g", si: 1.0 },
        time: Base { prefix: "", name: "s", si: 1.0 },
    };

    /// Whether these are m, kg and s.
    pub fn is_si(&self) -> bool {
        *self == Self::SI
    }

    /// Whether every base unit is a metre, a gram or tonne, or a second with a prefix, so that figures may choose another.
    pub fn is_metric(&self) -> bool {
        self.length.name == "m" && ["g", "t"].contains(&self.mass.name) && self.time.name == "s"
    }

    /// The units in which the result of a run is, as its `run.json` says; SI where it says nothing.
    pub fn of_record(record: &serde_json::Value) -> Self {
        Self::deserialize(&record["units"]).unwrap_or_default()
    }

    /// The base units, such as `mm, t, s`.
    pub fn bases(&self) -> String {
        [self.length, self.mass, self.time].map(Base::symbol).join(", ")
    }

    /// One unit of a dimension in SI units.
    pub fn factor(&self, dimension: Dimension) -> f64 {
        let Dimension(exponents) = dimension;
        let power = |base: Base, exponent: f64| match exponent.fract() == 0.0 {
            true => base.si.powi(exponent as i32),
            false => base.si.powf(exponent),
        };
        let bases = [self.mass, self.length, self.time];
        bases.into_iter().zip(exponents).map(|(base, exponent)| power(base, exponent)).product()
    }

    /// A value in SI units as a number in these units.
    pub fn number(&self, si: f64, dimension: Dimension) -> f64 {
        si / self.factor(dimension)
    }

    /// How many SI units one unit of the same kind is, given the SI unit, such as `m/s`.
    pub fn si_value(&self, si: &str) -> f64 {
        dimension_of(si).map_or(1.0, |dimension| self.factor(dimension))
    }

    /// The unit of the same kind as an SI unit, such as `mm/s` for `m/s`.
    pub fn of(&self, si: &str) -> String {
        if si == MOMENT {
            return self.moment();
        }
        dimension_of(si).map_or_else(|| si.to_owned(), |dimension| self.symbol(dimension))
    }

    /// The unit of a moment. It has the dimension of an energy, but is not written in joules.
    pub fn moment(&self) -> String {
        self.written(&[(Part::Force, 1), (Part::Length, 1)]).unwrap_or_else(|| self.of("J"))
    }

    /// A heading with its SI unit in brackets, such as `time [s]`, with the unit of these in its place.
    pub fn heading(&self, si: &str) -> String {
        let parts = si.strip_suffix(']').and_then(|text| text.rsplit_once('['));
        match parts {
            Some((name, "N m")) => format!("{name}[{}]", self.moment()),
            Some((name, unit)) => format!("{name}[{}]", self.of(unit)),
            None => si.to_owned(),
        }
    }

    /// The headings of a table.
    pub fn headings<S: AsRef<str>>(&self, si: impl IntoIterator<Item = S>) -> Vec<String> {
        si.into_iter().map(|heading| self.heading(heading.as_ref())).collect()
    }

    /// The unit of a dimension.
    pub fn symbol(&self, dimension: Dimension) -> String {
        let Dimension([mass, length, time]) = dimension;
        let is = |exponents: &[i8; 3]| Dimension(exponents.map(f64::from)) == dimension;
        let listed = WRITTEN.iter().find(|(exponents, _)| is(exponents)).map(|(_, parts)| *parts);
        if let Some(text) = listed.and_then(|parts| self.written(parts)) {
            return text;
        }
        let is_stiffness = mass == 1.0 && time == -2.0 && length < -1.0;
        if let (true, Some(pressure)) = (is_stiffness, self.part(Part::Pressure)) {
            return product(&[(pressure, 1.0), (self.length.symbol(), length + 1.0)]);
        }
        let bases = [(self.mass, mass), (self.length, length), (self.time, time)];
        product(&bases.map(|(base, exponent)| (base.symbol(), exponent)))
    }

    /// A dimension in words with its unit, such as `a pressure [MPa]`.
    pub fn describe(&self, dimension: Dimension) -> String {
        match (dimension.name(), self.symbol(dimension)) {
            (Some(name), unit) if unit.is_empty() => name.to_owned(),
            (Some(name), unit) => format!("{name} [{unit}]"),
            (None, unit) => format!("a quantity in {unit}"),
        }
    }

    /// How a value of a dimension may be written.
    pub fn examples(&self, dimension: Dimension) -> String {
        match (self.symbol(dimension), dimension.example()) {
            (unit, Some(example)) if unit.is_empty() => format!("write a number, for example {example}"),
            (unit, Some(example)) => {
                format!("write a number in {unit}, or a string with a unit, for example \"{example}\"")
            }
            (unit, None) => format!("write a number in {unit}"),
        }
    }

    fn written(&self, parts: &[(Part, i8)]) -> Option<String> {
        let part = |&(part, exponent): &(Part, i8)| Some((self.part(part)?, f64::from(exponent)));
        Some(product(&parts.iter().map(part).collect::<Option<Vec<_>>>()?))
    }

    /// The symbol of a part; `None` where a named unit would need a factor that no prefix has.
    fn part(&self, part: Part) -> Option<String> {
        match part {
            Part::Length => return Some(self.length.symbol()),
            Part::Mass => return Some(self.mass.symbol()),
            Part::Time => return Some(self.time.symbol()),
            _ => {}
        }
        let (_, name, exponents) = NAMED.iter().find(|named| named.0 == part)?;
        let value = self.factor(Dimension(exponents.map(f64::from)));
        let is = |unit: &f64| (value / unit - 1.0).abs() < 1e-9;
        if let Some((_, name, _)) = CUSTOMARY.iter().find(|(of, _, unit)| *of == part && is(unit)) {
            return Some((*name).to_owned());
        }
        let (prefix, _) = SCALES.iter().find(|(_, factor)| is(factor))?;
        Some(format!("{prefix}{name}"))
    }
}

impl Default for Units {
    fn default() -> Self {
        Self::SI
    }
}

impl Base {
    fn symbol(self) -> String {
        format!("{}{}", self.prefix, self.name)
    }

    /// The unit of that name, which must be one of the kind that `which` counts among mass, length and time.
    fn read(text: &At<String>, which: usize) -> Result<Self, Complaint> {
        let (prefix, name, si, exponents) = unit::symbol(text).ok_or_else(|| unit::unknown(text))?;
        let mut wanted = [0; 3];
        wanted[which] = 1;
        if exponents == wanted {
            return Ok(Self { prefix, name, si });
        }
        let [found, wanted] = [exponents, wanted].map(|exponents| Dimension(exponents.map(f64::from)));
        let [found, wanted] = [found, wanted].map(|dimension| dimension.name().unwrap_or("a derived unit"));
        let cure =
            ["for example kg, t, g or slinch", "for example m, mm or in", "for example s or ms"][which];
        Err(Complaint::new(format!(
            "'{}' is a unit of {found}, but a unit of {wanted} is expected",
            text.value
        ))
        .hint(cure))
    }
}

fn dimension_of(si: &str) -> Option<Dimension> {
    unit::parse(&format!("1 {si}")).ok().map(|(_, dimension)| dimension)
}

/// A product of units as one writes it, and as [`unit::parse`] reads it: `N mm s`, `t/mm3`, `g/cm/s2`.
fn product(factors: &[(String, f64)]) -> String {
    let with_power = |symbol: &str, exponent: f64| match exponent {
        1.0 => symbol.to_owned(),
        whole if whole.fract() == 0.0 => format!("{symbol}{whole}"),
        other => format!("{symbol}^{other}"),
    };
    let above = factors.iter().filter(|(_, exponent)| *exponent > 0.0);
    let mut text =
        above.map(|(symbol, exponent)| with_power(symbol, *exponent)).collect::<Vec<_>>().join(" ");
    let below: Vec<_> = factors.iter().filter(|(_, exponent)| *exponent < 0.0).collect();
    if text.is_empty() && !below.is_empty() {
        text.push('1');
    }
    below.iter().for_each(|(symbol, exponent)| text.push_str(&format!("/{}", with_power(symbol, -exponent))));
    text
}

/// The units of the case that is being read on this thread.
pub(super) fn reading() -> Units {
    READING.get()
}

/// Reads something whose plain numbers are in these units.
pub(super) fn reading_in<T>(units: Units, read: impl FnOnce() -> T) -> T {
    struct Restore(Units);
    impl Drop for Restore {
        fn drop(&mut self) {
            READING.set(self.0);
        }
    }
    let _restore = Restore(READING.replace(units));
    read()
}

/// The keys of `units`; what is left out is SI.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default)]
    length: Option<At<String>>,
    #[serde(default)]
    mass: Option<At<String>>,
    #[serde(default)]
    time: Option<At<String>>,
}

impl<'de> Deserialize<'de> for Units {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let keys = Keys::deserialize(deserializer)?;
        let base = |written: Option<At<String>>, which: usize, default: Base| match written {
            Some(text) => {
                Base::read(&text, which).map_err(|complaint| D::Error::custom(complaint.at(text.place)))
            }
            None => Ok(default),
        };
        Ok(Self {
            mass: base(keys.mass, 0, Self::SI.mass)?,
            length: base(keys.length, 1, Self::SI.length)?,
            time: base(keys.time, 2, Self::SI.time)?,
        })
    }
}

impl Serialize for Units {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        let mut map = serializer.serialize_map(Some(3))?;
        map.serialize_entry("length", &self.length.symbol())?;
        map.serialize_entry("mass", &self.mass.symbol())?;
        map.serialize_entry("time", &self.time.symbol())?;
        map.end()
    }
}

impl JsonSchema for Units {
    fn schema_name() -> Cow<'static, str> {
        "Units".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let unit = |what: &str| serde_json::json!({ "type": "string", "description": what });
        schemars::json_schema!({
            "description": "A consistent system of units. Plain numbers of the case are in these units and \
                            in those that follow from them: with mm, t and s a force is in N, a pressure in \
                            MPa, an energy in mJ. A string with a unit, such as \"5 MPa\", means the same \
                            in every system.",
            "type": "object",
            "properties": {
                "length": unit("Unit of length, as m, mm or in; m if absent. Coordinates of mesh files are in it."),
                "mass": unit("Unit of mass, as kg, t, g or slinch; kg if absent."),
                "time": unit("Unit of time, as s or ms; s if absent.")
            },
            "additionalProperties": false
        })
    }
}
