//! Values that vary in space and time: a number, an expression in x, y, z, t, or a table over t.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::rc::Rc;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

use super::at::At;
use super::complaint::Complaint;
pub use super::dual::Motion;
use super::expression::Expression;
use super::place::Place;
use super::quantity::{Quantity, Scalar};
use super::source::Source;
use super::turn::Turn;
use super::unit::{self, Dimension};

/// A function of the reference point and of time, in the units of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    form: Form,
}

#[derive(Debug, Clone, PartialEq)]
enum Form {
    Constant(f64),
    Expression { text: String, parsed: Expression },
    Table(Vec<[f64; 2]>),
    Turn(Box<Turn<Function>>),
}

impl Function {
    /// The same value everywhere and always.
    pub fn constant(value: f64) -> Self {
        Self { form: Form::Constant(value) }
    }

    /// An expression in x, y, z \[m\] and t \[s\].
    ///
    /// # Errors
    /// What is wrong with the expression, with the number of characters before the fault.
    pub fn expression(text: &str) -> Result<Self, Complaint> {
        let parsed = Expression::parse(text)?;
        if !parsed.varies_in_space() && !parsed.varies_in_time() {
            return Ok(Self::constant(parsed.value([0.0; 3], 0.0)));
        }
        Ok(Self { form: Form::Expression { text: text.to_string(), parsed } })
    }

    /// Linear between rows `[t, value]`, constant before the first and after the last.
    ///
    /// # Errors
    /// No row, or times that do not increase.
    pub fn table(rows: Vec<[f64; 2]>) -> Result<Self, Complaint> {
        if rows.is_empty() {
            return Err(Complaint::new("a table needs at least one row [t, value]".into()));
        }
        if let Some(pair) = rows.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            let message = format!("the times of a table must increase: {} after {}", pair[1][0], pair[0][0]);
            return Err(Complaint::new(message));
        }
        Ok(Self { form: Form::Table(rows) })
    }

    /// One component of the displacement by a rotation and a translation. It is written in no case as such.
    pub fn turn(turn: Turn<Self>) -> Self {
        Self { form: Form::Turn(Box::new(turn)) }
    }

    /// Value at a reference point \[m\] (zeros beyond the dimension) and a time \[s\].
    pub fn value(&self, point: [f64; 3], t: f64) -> f64 {
        match &self.form {
            Form::Constant(value) => *value,
            Form::Expression { parsed, .. } => parsed.value(point, t),
            Form::Table(rows) => interpolate(rows, t).value,
            Form::Turn(_) => self.motion(point, t).value,
        }
    }

    /// Value and exact first and second time derivatives there.
    ///
    /// At a row of a table, and where an expression switches, the derivative is that of what follows; the jump of the
    /// rate is not in the second derivative.
    pub fn motion(&self, point: [f64; 3], t: f64) -> Motion {
        match &self.form {
            Form::Constant(value) => Motion { value: *value, rate: 0.0, second: 0.0 },
            Form::Expression { parsed, .. } => parsed.motion(point, t),
            Form::Table(rows) => interpolate(rows, t),
            Form::Turn(turn) => {
                turn.motion(point, turn.angle.motion(point, t), turn.translation.motion(point, t))
            }
        }
    }

    /// Whether the value never changes in time.
    pub fn is_constant_in_time(&self) -> bool {
        match &self.form {
            Form::Constant(_) => true,
            Form::Expression { parsed, .. } => !parsed.varies_in_time(),
            Form::Table(rows) => rows.iter().all(|row| row[1] == rows[0][1]),
            Form::Turn(turn) => turn.functions().into_iter().all(Function::is_constant_in_time),
        }
    }

    /// Instants at which the value or its rate may jump: rows of a table, and where an expression compares `t` alone with
    /// a number \[s\].
    pub fn kinks(&self) -> Vec<f64> {
        match &self.form {
            Form::Constant(_) => Vec::new(),
            Form::Expression { parsed, .. } => parsed.kinks(),
            Form::Table(rows) => rows.iter().map(|row| row[0]).collect(),
            Form::Turn(turn) => turn.functions().into_iter().flat_map(Function::kinks).collect(),
        }
    }

    /// Whether the value is linear in time between the [kinks](Self::kinks), as far as that can be seen.
    pub fn is_linear_between_kinks(&self) -> bool {
        matches!(self.form, Form::Table(_)) || self.is_constant_in_time()
    }

    /// Whether the value is the same at every point.
    pub fn is_constant_in_space(&self) -> bool {
        match &self.form {
            Form::Constant(_) | Form::Table(_) => true,
            Form::Expression { parsed, .. } => !parsed.varies_in_space(),
            Form::Turn(_) => false,
        }
    }

    /// Whether the value is zero everywhere and always, as far as that can be seen without evaluating it.
    pub fn is_zero(&self) -> bool {
        match &self.form {
            Form::Constant(value) => *value == 0.0,
            Form::Expression { .. } => false,
            Form::Table(rows) => rows.iter().all(|row| row[1] == 0.0),
            Form::Turn(turn) => turn.functions().into_iter().all(Function::is_zero),
        }
    }
}

fn interpolate(rows: &[[f64; 2]], t: f64) -> Motion {
    let after = rows.partition_point(|row| row[0] <= t);
    if after == 0 || after == rows.len() {
        let value = rows[after.saturating_sub(1)][1];
        return Motion { value, rate: 0.0, second: 0.0 };
    }
    let [t0, v0] = rows[after - 1];
    let [t1, v1] = rows[after];
    let rate = (v1 - v0) / (t1 - t0);
    Motion { value: v0 + rate * (t - t0), rate, second: 0.0 }
}

/// A [`Function`] whose values have the dimension kg^`KG` m^`M` s^`S`, with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Varying<const KG: i8, const M: i8, const S: i8> {
    /// The function, in the units of the case.
    pub function: Function,
    /// Where it is written.
    pub place: Place,
}

/// \[m\]
pub type VaryingLength = Varying<0, 1, 0>;
/// \[m/s\]
pub type VaryingVelocity = Varying<0, 1, -1>;
/// \[m/s2\]
pub type VaryingAcceleration = Varying<0, 1, -2>;
/// \[Pa\]
pub type VaryingPressure = Varying<1, -1, -2>;
/// A number without unit, such as an angle \[rad\].
pub type VaryingNumber = Varying<0, 0, 0>;

impl<const KG: i8, const M: i8, const S: i8> Deref for Varying<KG, M, S> {
    type Target = Function;
    fn deref(&self) -> &Function {
        &self.function
    }
}

impl<'de, const KG: i8, const M: i8, const S: i8> Deserialize<'de> for Varying<KG, M, S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = At::<Written<KG, M, S>>::deserialize(deserializer)?;
        let place = raw.place;
        let complain = |complaint: Complaint| D::Error::custom(complaint.at(place));
        let function = match raw.value {
            Written::Scalar(scalar) => {
                from_scalar(&scalar, Quantity::<KG, M, S>::DIMENSION).map_err(complain)?
            }
            Written::Table(rows) => {
                let rows = rows.iter().map(|(t, value)| [t.value, value.value]).collect();
                Function::table(rows).map_err(complain)?
            }
        };
        Ok(Self { function, place })
    }
}

/// A text is read as an expression first, then as a number with a unit (`5 mm`).
fn from_scalar(scalar: &Scalar, dimension: Dimension) -> Result<Function, Complaint> {
    let Scalar::Text(text) = scalar else {
        return scalar.in_dimension(dimension).map(Function::constant);
    };
    Function::expression(text).or_else(|complaint| {
        if unit::follows_number(text) {
            scalar.in_dimension(dimension).map(Function::constant)
        } else {
            Err(complaint)
        }
    })
}

/// A function of a case and where it is written, for what only its values at the points of a mesh show.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedFunction {
    function: Function,
    place: Place,
    source: Rc<Source>,
}

impl PlacedFunction {
    /// The function, with the file that errors of its values point into.
    pub fn new<const KG: i8, const M: i8, const S: i8>(
        varying: &Varying<KG, M, S>,
        source: &Rc<Source>,
    ) -> Self {
        Self { function: varying.function.clone(), place: varying.place, source: source.clone() }
    }

    /// Another function with the same place in the case.
    #[must_use]
    pub fn replaced(&self, function: Function) -> Self {
        Self { function, place: self.place, source: self.source.clone() }
    }

    /// The error at the place of the function in the case.
    pub fn error(&self, message: String, cure: &str) -> crate::error::Error {
        self.source.error(&Complaint::new(message).hint(cure).at(self.place))
    }

    /// What is wrong with a value or a motion at a point and an instant.
    ///
    /// # Errors
    /// It is not finite, or so large that nothing could be computed with it; at the place of the function in the case.
    pub fn require_sound(&self, motion: &Motion, point: &[f64], t: f64) -> crate::error::Result<()> {
        let Some(words) = motion.trouble() else { return Ok(()) };
        let point = point.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
        let complaint = Complaint::new(format!("{words} at t = {t}, point [{point}]")).at(self.place);
        let cure = "it must be finite wherever it acts: bound its arguments, for example with max(x, 0)";
        Err(self.source.error(&complaint.hint(cure)))
    }

    /// Value of a coefficient that is constant in time, at a point \[m\].
    ///
    /// # Errors
    /// It is not finite, too large, or negative; at the place of the function in the case.
    pub fn coefficient<const D: usize>(&self, point: &[f64; D]) -> crate::error::Result<f64> {
        let place = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        let motion = self.motion(place, 0.0);
        self.require_sound(&motion, point, 0.0)?;
        if motion.value >= 0.0 {
            return Ok(motion.value);
        }
        let point = point.map(|x| x.to_string()).join(", ");
        let message = format!("the coefficient is negative: {} at the point [{point}]", motion.value);
        let cure = "it must be >= 0 wherever it acts; cut it off, for example with max(x, 0)";
        Err(self.source.error(&Complaint::new(message).at(self.place).hint(cure)))
    }
}

/// A function that is written in no case.
impl From<Function> for PlacedFunction {
    fn from(function: Function) -> Self {
        Self { function, place: Place::default(), source: Rc::default() }
    }
}

impl Deref for PlacedFunction {
    type Target = Function;
    fn deref(&self) -> &Function {
        &self.function
    }
}

/// A table's rows: time and value, each a number or with a unit.
type Rows<const KG: i8, const M: i8, const S: i8> = Vec<(Quantity<0, 0, 1>, Quantity<KG, M, S>)>;

enum Written<const KG: i8, const M: i8, const S: i8> {
    Scalar(Scalar),
    Table(Rows<KG, M, S>),
}

impl<'de, const KG: i8, const M: i8, const S: i8> Deserialize<'de> for Written<KG, M, S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyWritten)
    }
}

struct AnyWritten<const KG: i8, const M: i8, const S: i8>;

impl<'de, const KG: i8, const M: i8, const S: i8> Visitor<'de> for AnyWritten<KG, M, S> {
    type Value = Written<KG, M, S>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, an expression in x, y, z, t, or { table: [[t, value], ...] }")
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(Written::Scalar(Scalar::Number(value)))
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Ok(Written::Scalar(Scalar::Number(value as f64)))
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Ok(Written::Scalar(Scalar::Number(value as f64)))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Self::Value, E> {
        Ok(Written::Scalar(Scalar::Text(value.to_string())))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut table = None;
        while let Some(key) = map.next_key::<At<String>>()? {
            if key.value != "table" {
                let complaint = Complaint::unknown("key", &key, ["table"].into_iter());
                return Err(A::Error::custom(complaint.at(key.place)));
            }
            table = Some(map.next_value()?);
        }
        let none = || Complaint::new("expected { table: [[t, value], ...] }, found an empty mapping".into());
        Ok(Written::Table(table.ok_or_else(|| A::Error::custom(none()))?))
    }
}

impl<const KG: i8, const M: i8, const S: i8> Serialize for Varying<KG, M, S> {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        match &self.form {
            Form::Constant(value) => serializer.serialize_f64(*value),
            Form::Expression { text, .. } => serializer.serialize_str(text),
            Form::Table(rows) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("table", rows)?;
                map.end()
            }
            Form::Turn(_) => Err(serde::ser::Error::custom("a rotation is not a value of a case")),
        }
    }
}

impl<const KG: i8, const M: i8, const S: i8> JsonSchema for Varying<KG, M, S> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Varying".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let value = serde_json::json!({ "type": ["number", "string"] });
        let row = serde_json::json!({ "type": "array", "items": value, "minItems": 2, "maxItems": 2 });
        schemars::json_schema!({
            "anyOf": [value, {
                "type": "object",
                "properties": { "table": { "type": "array", "items": row, "minItems": 1 } },
                "required": ["table"],
                "additionalProperties": false
            }]
        })
    }
}
