//! Expressions in x, y, z, t: a small grammar, parsed with positions, evaluated in numbers or in time derivatives.

mod parser;

use super::complaint::Complaint;
use super::dual::{Motion, Scalar};

/// Parsed expression; bounded in depth and size, so that neither parsing nor evaluation can exhaust the stack.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression {
    root: Node,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Variable(Variable),
    Negate(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Call(Function, Vec<Node>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
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
    Exp,
    Log,
    Sqrt,
    Abs,
    Min,
    Max,
    If,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variable {
    X,
    Y,
    Z,
    Time,
}

const VARIABLES: [(&str, Variable); 4] =
    [("x", Variable::X), ("y", Variable::Y), ("z", Variable::Z), ("t", Variable::Time)];

/// Values of the variables.
#[derive(Clone, Copy)]
struct Values<T> {
    x: T,
    y: T,
    z: T,
    time: T,
}

const FUNCTIONS: [(&str, Function, usize); 9] = [
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("exp", Function::Exp, 1),
    ("log", Function::Log, 1),
    ("sqrt", Function::Sqrt, 1),
    ("abs", Function::Abs, 1),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
    ("if", Function::If, 3),
];

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// The unexpected part, with the number of characters before it.
    pub(super) fn parse(text: &str) -> Result<Self, Complaint> {
        Ok(Self { root: parser::parse(text)? })
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
        self.root.evaluate(&Values { x, y, z, time: t })
    }

    /// Instants at which `t` passes a number that it is compared with.
    pub(super) fn kinks(&self) -> Vec<f64> {
        let mut kinks = Vec::new();
        self.root.collect_kinks(&mut kinks);
        kinks
    }

    pub(super) fn motion(&self, point: [f64; 3], t: f64) -> Motion {
        let [x, y, z] = point.map(Motion::constant);
        self.root.evaluate(&Values { x, y, z, time: Motion::time(t) })
    }
}

impl Node {
    fn evaluate<T: Scalar>(&self, at: &Values<T>) -> T {
        match self {
            Self::Number(value) => T::constant(*value),
            Self::Variable(Variable::X) => at.x,
            Self::Variable(Variable::Y) => at.y,
            Self::Variable(Variable::Z) => at.z,
            Self::Variable(Variable::Time) => at.time,
            Self::Negate(node) => -node.evaluate(at),
            Self::Binary(operator, a, b) => operator.apply(a.evaluate(at), b.evaluate(at)),
            Self::Call(function, arguments) => function.evaluate(arguments, at),
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
        }
    }
}

impl Node {
    fn collect_kinks(&self, kinks: &mut Vec<f64>) {
        match self {
            Self::Number(_) | Self::Variable(_) => {}
            Self::Negate(node) => node.collect_kinks(kinks),
            Self::Binary(operator, a, b) => {
                let sides = [(a.as_ref(), b.as_ref()), (b.as_ref(), a.as_ref())];
                let time = sides.into_iter().find(|(side, _)| matches!(side, Self::Variable(Variable::Time)));
                if let Some((_, other)) = time.filter(|_| operator.compares())
                    && other.is_a_number()
                {
                    kinks.push(other.evaluate(&Values { x: 0.0, y: 0.0, z: 0.0, time: 0.0 }));
                }
                [a, b].iter().for_each(|side| side.collect_kinks(kinks));
            }
            Self::Call(function, arguments) => {
                if let (
                    Function::Min | Function::Max,
                    [Self::Variable(Variable::Time), other] | [other, Self::Variable(Variable::Time)],
                ) = (function, arguments.as_slice())
                    && other.is_a_number()
                {
                    kinks.push(other.evaluate(&Values { x: 0.0, y: 0.0, z: 0.0, time: 0.0 }));
                }
                arguments.iter().for_each(|node| node.collect_kinks(kinks));
            }
        }
    }

    fn is_a_number(&self) -> bool {
        match self {
            Self::Number(_) => true,
            Self::Variable(_) => false,
            Self::Negate(node) => node.is_a_number(),
            Self::Binary(_, a, b) => a.is_a_number() && b.is_a_number(),
            Self::Call(_, arguments) => arguments.iter().all(Self::is_a_number),
        }
    }
}

impl Operator {
    fn compares(self) -> bool {
        use Operator::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
        matches!(self, Less | LessEqual | Greater | GreaterEqual | Equal | NotEqual)
    }

    fn apply<T: Scalar>(self, a: T, b: T) -> T {
        let (x, y) = (a.real(), b.real());
        let truth = |holds: bool| T::constant(f64::from(u8::from(holds)));
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Power => a.power(b),
            Self::Less => truth(x < y),
            Self::LessEqual => truth(x <= y),
            Self::Greater => truth(x > y),
            Self::GreaterEqual => truth(x >= y),
            Self::Equal => truth(x == y),
            Self::NotEqual => truth(x != y),
        }
    }
}

impl Function {
    /// The value for arguments of which the parser has seen to it that there are enough; a function of one argument goes
    /// by its first and second derivatives, the others choose one of theirs.
    fn evaluate<T: Scalar>(self, arguments: &[Node], at: &Values<T>) -> T {
        let value = |number: usize| arguments[number].evaluate(at);
        let argument = value(0);
        let x = argument.real();
        let (f, first, second) = match self {
            Self::If => return if x != 0.0 { value(1) } else { value(2) },
            Self::Min => {
                let other = value(1);
                return if x <= other.real() { argument } else { other };
            }
            Self::Max => {
                let other = value(1);
                return if x >= other.real() { argument } else { other };
            }
            Self::Sin => (x.sin(), x.cos(), -x.sin()),
            Self::Cos => (x.cos(), -x.sin(), -x.cos()),
            Self::Exp => (x.exp(), x.exp(), x.exp()),
            Self::Log => (x.ln(), 1.0 / x, -1.0 / (x * x)),
            Self::Sqrt => (x.sqrt(), 0.5 / x.sqrt(), -0.25 / (x * x.sqrt())),
            Self::Abs => (x.abs(), if x < 0.0 { -1.0 } else { 1.0 }, 0.0),
        };
        argument.chain(f, first, second)
    }
}
