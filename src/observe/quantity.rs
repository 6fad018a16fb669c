//! What a quantity is called, its unit and its components; columns and cells of tables.

/// The last part of a column name for each component: `x`, `y`, `z`.
const AXES: [&str; 3] = ["x", "y", "z"];

/// QuantityShape of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuantityShape {
    /// A number, a count or a word.
    One,
    /// A vector, with as many components as dimensions.
    Axes,
    /// A rotation: about `z` in 2D, about all axes in 3D.
    Rotations,
    /// A symmetric tensor: xx, yy, zz, xy, yz, xz.
    SymmetricTensor,
    /// The three principal values of a symmetric tensor, also in 2D.
    Principal,
}

impl QuantityShape {
    /// QuantityShape of the three axes that exist in `D` dimensions.
    pub fn axes<const D: usize>(self) -> std::ops::Range<usize> {
        match self {
            Self::Rotations if D == 2 => 2..3,
            Self::Rotations | Self::Principal => 0..3,
            _ => 0..D,
        }
    }
}

/// Name, unit and meaning of a reported quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportedQuantity {
    /// Name in files.
    pub name: &'static str,
    /// SI unit as in headings; empty if there is no unit.
    pub unit: &'static str,
    /// Meaning, in one sentence without a full stop.
    pub about: &'static str,
    /// Its components.
    pub components: QuantityShape,
}

impl ReportedQuantity {
    /// A quantity with one component.
    pub const fn number(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, components: QuantityShape::One }
    }

    /// A vector.
    pub const fn vector(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, components: QuantityShape::Axes }
    }

    /// A rotation.
    pub const fn rotation(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, components: QuantityShape::Rotations }
    }

    /// A symmetric tensor.
    pub const fn symmetric_tensor(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, components: QuantityShape::SymmetricTensor }
    }

    /// The principal values of a symmetric tensor.
    pub const fn principal(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, components: QuantityShape::Principal }
    }

    /// Headings of its columns in `D` dimensions, such as `force_x [N]`.
    pub fn headings<const D: usize>(&self) -> Vec<String> {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" [{}]", self.unit) };
        match self.components {
            QuantityShape::One => vec![format!("{}{unit}", self.name)],
            components => {
                let axes = AXES[components.axes::<D>()].iter();
                axes.map(|axis| format!("{}_{axis}{unit}", self.name)).collect()
            }
        }
    }
}

/// A table of the results folder.
#[derive(Debug, Clone, Copy)]
pub struct TableFile {
    /// Name of the file.
    pub name: &'static str,
    /// When a row is written.
    pub rows: &'static str,
    /// Columns that say what a row belongs to. They precede all others.
    pub keys: &'static [ReportedQuantity],
}

impl TableFile {
    /// Headings of the whole table, given those after the keys.
    pub fn headings(&self, others: impl IntoIterator<Item = String>) -> Vec<String> {
        headings::<3>(self.keys).into_iter().chain(others).collect()
    }
}

/// Number of the step; 0 is the start.
pub const STEP: ReportedQuantity = ReportedQuantity::number("step", "", "number of the step; 0 is the start");

/// Time at the end of the step.
pub const TIME: ReportedQuantity = ReportedQuantity::number("time", "s", "time at its end");

/// Length of the step.
pub const LENGTH: ReportedQuantity = ReportedQuantity::number("dt", "s", "its length");

/// The table of the quantities that the case derives.
pub const DERIVED_FILE: TableFile = TableFile {
    name: "derived.csv",
    rows: "one per step; the file exists only with `output: { derived: ... }`",
    keys: &[STEP, TIME],
};

/// The columns of the derived quantities, of which the case gives the names.
pub const DERIVED: ReportedQuantity = ReportedQuantity::number(
    "NAME",
    "",
    "value of the expression `output.derived.NAME`, in the units of the case; empty if it is not finite or depends on \
     an empty field",
);

/// One entry of a row of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// A count or a step number.
    Count(u64),
    /// A quantity; must be finite.
    Number(f64),
    /// A name.
    Text(&'a str),
    /// No value, such as the gap of a point with no target opposite. It is written as an empty
    /// field.
    Absent,
}

impl From<Option<f64>> for Cell<'_> {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Cell::Absent, Cell::Number)
    }
}

/// Function that gives the value of a column from a source `S`.
#[derive(Debug, Clone, Copy)]
pub enum Value<S> {
    /// A number of things.
    Count(fn(&S) -> u64),
    /// A number.
    Number(fn(&S) -> f64),
    /// A number that may be absent.
    Optional(fn(&S) -> Option<f64>),
    /// A vector or a rotation. Components that do not exist in 2D are ignored.
    Vector(fn(&S) -> [f64; 3]),
    /// A vector that may be absent.
    OptionalVector(fn(&S) -> Option<[f64; 3]>),
    /// A word.
    Word(fn(&S) -> &str),
}

/// A column of a table whose rows are evaluated from a source `S`.
#[derive(Debug, Clone, Copy)]
pub struct Column<S> {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value.
    pub value: Value<S>,
}

impl<S> Column<S> {
    /// The cells of this column in `D` dimensions.
    pub fn cells<'a, const D: usize>(&self, source: &'a S) -> Vec<Cell<'a>> {
        match self.value {
            Value::Count(value) => vec![Cell::Count(value(source))],
            Value::Number(value) => vec![Cell::Number(value(source))],
            Value::Optional(value) => vec![value(source).into()],
            Value::Word(value) => vec![Cell::Text(value(source))],
            Value::Vector(value) => value(source)[self.quantity.components.axes::<D>()]
                .iter()
                .copied()
                .map(Cell::Number)
                .collect(),
            Value::OptionalVector(value) => {
                let vector = value(source);
                let axes = self.quantity.components.axes::<D>();
                axes.map(|axis| vector.map(|vector| vector[axis]).into()).collect()
            }
        }
    }
}

/// Headings of some quantities in `D` dimensions.
pub fn headings<'a, const D: usize>(
    quantities: impl IntoIterator<Item = &'a ReportedQuantity>,
) -> Vec<String> {
    quantities.into_iter().flat_map(|quantity| quantity.headings::<D>()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vector has a column for each dimension. A rotation has one in 2D and three in 3D.
    #[test]
    fn components_depend_on_the_dimension() {
        let force = ReportedQuantity::vector("force", "N", "a force");
        let spin = ReportedQuantity::rotation("spin", "N m s", "a rotation");
        let points = ReportedQuantity::number("points", "", "a count");
        let both = [&force, &spin, &points];
        assert_eq!(headings::<2>(both), ["force_x [N]", "force_y [N]", "spin_z [N m s]", "points"]);
        assert_eq!(headings::<3>(both).len(), 7);
        let column = Column { quantity: spin, value: Value::Vector(|v: &[f64; 3]| *v) };
        assert_eq!(column.cells::<2>(&[1.0, 2.0, 3.0]), [Cell::Number(3.0)]);
    }
}
