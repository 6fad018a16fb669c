//! Expressions in x, y, z, t: a small grammar, parsed with positions, evaluated in numbers or in time derivatives.

mod parser;

use super::complaint::Complaint;
use super::dual::{ExpressionNumber, Motion};
pub(super) use parser::is_reserved;

/// Parsed expression; bounded in depth and size, so that neither parsing nor evaluation can exhaust the stack.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression {
    root: Node,
    uses_parameters: bool,
}

/// Parsed condition, such as `x > 0.3 and z < 1e-6`; bounded as an expression is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParsedCondition {
    root: Test,
}

/// A numeric expression.
#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Variable(Variable),
    Negate(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Call(Function, Vec<Node>),
    If(Box<Test>, Box<Node>, Box<Node>),
}

/// A condition: an expression that is true or false.
#[derive(Debug, Clone, PartialEq)]
enum Test {
    Compare(Comparison, Box<Node>, Box<Node>),
    And(Box<Test>, Box<Test>),
    Or(Box<Test>, Box<Test>),
    Not(Box<Test>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Comparison {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Sin,
    Cos,
    Tanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    Atan2,
    Pow,
    Mod,
    Min,
    Max,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variable {
    X,
    Y,
    Z,
    Time,
    /// A column of a table, by its number in the expression.
    Column(usize),
}

const VARIABLES: [(&str, Variable); 4] =
    [("x", Variable::X), ("y", Variable::Y), ("z", Variable::Z), ("t", Variable::Time)];

/// Values of the variables.
#[derive(Clone, Copy)]
struct Values<'a, T> {
    x: T,
    y: T,
    z: T,
    time: T,
    columns: &'a [f64],
}

/// The functions, with the smallest and the largest number of their arguments.
const FUNCTIONS: [(&str, Function, usize, usize); 12] = [
    ("sin", Function::Sin, 1, 1),
    ("cos", Function::Cos, 1, 1),
    ("tanh", Function::Tanh, 1, 1),
    ("exp", Function::Exp, 1, 1),
    ("log", Function::Log, 1, 1),
    ("sqrt", Function::Sqrt, 1, 1),
    ("abs", Function::Abs, 1, 1),
    ("atan2", Function::Atan2, 2, 2),
    ("pow", Function::Pow, 2, 2),
    ("mod", Function::Mod, 2, 2),
    ("min", Function::Min, 2, usize::MAX),
    ("max", Function::Max, 2, usize::MAX),
];

impl Expression {
    /// Reads an expression, in which the parameters of the case that is being read are known.
    ///
    /// # Errors
    /// The unexpected part, with the number of characters before it.
    pub(super) fn parse(text: &str) -> Result<Self, Complaint> {
        let (root, uses_parameters) = parser::parse_number(text)?;
        Ok(Self { root, uses_parameters })
    }

    /// Reads an expression in columns of tables, and returns the columns, each with the number of
    /// characters before it.
    ///
    /// # Errors
    /// The unexpected part, with the number of characters before it.
    pub(super) fn parse_of_columns(text: &str) -> Result<(Self, Vec<(String, usize)>), Complaint> {
        let (root, columns) = parser::parse_of_columns(text)?;
        Ok((Self { root, uses_parameters: false }, columns))
    }

    /// The value with these columns at the time `t`.
    pub(super) fn value_of_columns(&self, columns: &[f64], t: f64) -> f64 {
        self.root.evaluate(&Values { x: 0.0, y: 0.0, z: 0.0, time: t, columns })
    }

    /// Whether a parameter of the case occurs.
    pub(super) fn uses_parameters(&self) -> bool {
        self.uses_parameters
    }

    /// Whether x, y or z occurs.
    pub(super) fn varies_in_space(&self) -> bool {
        self.root.uses(&|variable| variable != Variable::Time)
    }

    /// Whether t occurs.
    pub(super) fn varies_in_time(&self) -> bool {
        self.root.uses(&|variable| variable == Variable::Time)
    }

    pub(super) fn value(&self, point: [f64; 3], t: f64) -> f64 {
        let [x, y, z] = point;
        self.root.evaluate(&Values { x, y, z, time: t, columns: &[] })
    }

    /// Instants at which `t` passes a number that it is compared with.
    pub(super) fn kinks(&self) -> Vec<f64> {
        let mut kinks = Vec::new();
        self.root.collect_kinks(&mut kinks);
        kinks
    }

    pub(super) fn motion(&self, point: [f64; 3], t: f64) -> Motion {
        let [x, y, z] = point.map(Motion::constant);
        self.root.evaluate(&Values { x, y, z, time: Motion::time(t), columns: &[] })
    }
}

impl ParsedCondition {
    /// Reads a condition, in which the parameters of the case that is being read are known.
    ///
    /// # Errors
    /// The unexpected part, with the number of characters before it.
    pub(super) fn parse(text: &str) -> Result<Self, Complaint> {
        Ok(Self { root: parser::parse_condition(text)? })
    }

    /// Whether t occurs.
    pub(super) fn varies_in_time(&self) -> bool {
        self.root.uses(&|variable| variable == Variable::Time)
    }

    /// Whether z occurs.
    pub(super) fn uses_z(&self) -> bool {
        self.root.uses(&|variable| variable == Variable::Z)
    }

    /// Whether the condition holds at a point.
    pub(super) fn holds(&self, point: [f64; 3]) -> bool {
        let [x, y, z] = point;
        self.root.holds(&Values { x, y, z, time: 0.0, columns: &[] })
    }
}

impl Node {
    fn evaluate<T: ExpressionNumber>(&self, at: &Values<'_, T>) -> T {
        match self {
            Self::Number(value) => T::constant(*value),
            Self::Variable(Variable::X) => at.x,
            Self::Variable(Variable::Y) => at.y,
            Self::Variable(Variable::Z) => at.z,
            Self::Variable(Variable::Time) => at.time,
            Self::Variable(Variable::Column(number)) => {
                T::constant(at.columns.get(*number).copied().unwrap_or(f64::NAN))
            }
            Self::Negate(node) => -node.evaluate(at),
            Self::Binary(operator, a, b) => operator.apply(a.evaluate(at), b.evaluate(at)),
            Self::Call(function, arguments) => function.evaluate(arguments, at),
            Self::If(test, one, other) => if test.holds(at) { one } else { other }.evaluate(at),
        }
    }

    /// Whether a variable that satisfies `wanted` occurs.
    fn uses(&self, wanted: &impl Fn(Variable) -> bool) -> bool {
        match self {
            Self::Number(_) => false,
            Self::Variable(variable) => wanted(*variable),
            Self::Negate(node) => node.uses(wanted),
            Self::Binary(_, a, b) => a.uses(wanted) || b.uses(wanted),
            Self::Call(_, arguments) => arguments.iter().any(|node| node.uses(wanted)),
            Self::If(test, one, other) => test.uses(wanted) || one.uses(wanted) || other.uses(wanted),
        }
    }

    fn collect_kinks(&self, kinks: &mut Vec<f64>) {
        match self {
            Self::Number(_) | Self::Variable(_) => {}
            Self::Negate(node) => node.collect_kinks(kinks),
            Self::Binary(_, a, b) => [a, b].iter().for_each(|side| side.collect_kinks(kinks)),
            Self::Call(function, arguments) => {
                let chooses = matches!(function, Function::Min | Function::Max);
                if chooses && arguments.iter().any(Self::is_time) {
                    kinks.extend(arguments.iter().filter_map(Self::number));
                }
                arguments.iter().for_each(|node| node.collect_kinks(kinks));
            }
            Self::If(test, one, other) => {
                test.collect_kinks(kinks);
                [one, other].iter().for_each(|branch| branch.collect_kinks(kinks));
            }
        }
    }

    fn is_time(&self) -> bool {
        matches!(self, Self::Variable(Variable::Time))
    }

    /// The value, if no variable occurs.
    fn number(&self) -> Option<f64> {
        let constant = !self.uses(&|_| true);
        constant.then(|| self.evaluate(&Values { x: 0.0, y: 0.0, z: 0.0, time: 0.0, columns: &[] }))
    }
}

impl Test {
    fn holds<T: ExpressionNumber>(&self, at: &Values<'_, T>) -> bool {
        match self {
            Self::Compare(comparison, a, b) => comparison.holds(a.evaluate(at).real(), b.evaluate(at).real()),
            Self::And(a, b) => a.holds(at) && b.holds(at),
            Self::Or(a, b) => a.holds(at) || b.holds(at),
            Self::Not(test) => !test.holds(at),
        }
    }

    /// Whether a variable that satisfies `wanted` occurs.
    fn uses(&self, wanted: &impl Fn(Variable) -> bool) -> bool {
        match self {
            Self::Compare(_, a, b) => a.uses(wanted) || b.uses(wanted),
            Self::And(a, b) | Self::Or(a, b) => a.uses(wanted) || b.uses(wanted),
            Self::Not(test) => test.uses(wanted),
        }
    }

    fn collect_kinks(&self, kinks: &mut Vec<f64>) {
        match self {
            Self::Compare(_, a, b) => {
                if a.is_time() {
                    kinks.extend(b.number());
                }
                if b.is_time() {
                    kinks.extend(a.number());
                }
                [a, b].iter().for_each(|side| side.collect_kinks(kinks));
            }
            Self::And(a, b) | Self::Or(a, b) => [a, b].iter().for_each(|test| test.collect_kinks(kinks)),
            Self::Not(test) => test.collect_kinks(kinks),
        }
    }
}

impl Operator {
    fn apply<T: ExpressionNumber>(self, a: T, b: T) -> T {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Power => a.power(b),
        }
    }
}

impl Comparison {
    fn holds(self, x: f64, y: f64) -> bool {
        match self {
            Self::Less => x < y,
            Self::LessEqual => x <= y,
            Self::Greater => x > y,
            Self::GreaterEqual => x >= y,
            Self::Equal => x == y,
            Self::NotEqual => x != y,
        }
    }
}

impl Function {
    /// The value for arguments of which the parser has seen to it that there are enough; a function of one argument goes
    /// by its first and second derivatives, the others are made of operations that have them.
    fn evaluate<T: ExpressionNumber>(self, arguments: &[Node], at: &Values<'_, T>) -> T {
        let value = |number: usize| arguments[number].evaluate(at);
        let argument = value(0);
        let others = || arguments[1..].iter().map(|node| node.evaluate(at));
        let x = argument.real();
        let (f, first, second) = match self {
            Self::Min => return others().fold(argument, |a, b| if a.real() <= b.real() { a } else { b }),
            Self::Max => return others().fold(argument, |a, b| if a.real() >= b.real() { a } else { b }),
            Self::Atan2 => return argument.angle_over(value(1)),
            Self::Pow => return argument.power(value(1)),
            Self::Mod => return argument.modulo(value(1)),
            Self::Sin => (x.sin(), x.cos(), -x.sin()),
            Self::Cos => (x.cos(), -x.sin(), -x.cos()),
            Self::Tanh => {
                let slope = 1.0 / x.cosh().powi(2);
                (x.tanh(), slope, -2.0 * x.tanh() * slope)
            }
            Self::Exp => (x.exp(), x.exp(), x.exp()),
            Self::Log => (x.ln(), 1.0 / x, -1.0 / (x * x)),
            Self::Sqrt => (x.sqrt(), 0.5 / x.sqrt(), -0.25 / (x * x.sqrt())),
            Self::Abs => (x.abs(), if x < 0.0 { -1.0 } else { 1.0 }, 0.0),
        };
        argument.chain(f, first, second)
    }
}
