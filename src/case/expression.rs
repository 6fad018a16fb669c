//! Expressions in x, y, z, t: a small grammar, parsed with positions, evaluated in numbers or in time derivatives.

use super::diagnostics::Complaint;
use super::dual::{Motion, Scalar};

/// Parsed expression; bounded in depth and size, so that neither parsing nor evaluation can exhaust the stack.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression {
    root: Node,
    variables: [bool; 4],
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    /// Index in `VARIABLES`.
    Variable(usize),
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

const VARIABLES: [&str; 4] = ["x", "y", "z", "t"];

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

/// Longer symbols first, so that `<=` is not read as `<`.
const COMPARISONS: [(&str, Operator); 6] = [
    ("<=", Operator::LessEqual),
    (">=", Operator::GreaterEqual),
    ("==", Operator::Equal),
    ("!=", Operator::NotEqual),
    ("<", Operator::Less),
    (">", Operator::Greater),
];

const SUMS: [(&str, Operator); 2] = [("+", Operator::Add), ("-", Operator::Subtract)];
const PRODUCTS: [(&str, Operator); 2] = [("*", Operator::Multiply), ("/", Operator::Divide)];

const MAX_DEPTH: usize = 64;
const MAX_OPERATIONS: usize = 1000;

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// What stands where it should not, with the number of characters before it.
    pub(super) fn parse(text: &str) -> Result<Self, Complaint> {
        let mut parser = Parser { text, at: 0, depth: 0, operations: 0, variables: [false; 4] };
        let root = parser.comparison()?;
        parser.skip_space();
        match parser.rest().chars().next() {
            None => Ok(Self { root, variables: parser.variables }),
            Some(c) => Err(parser.wrong(format!("unexpected '{c}' in the expression"))),
        }
    }

    /// Whether x, y or z occurs.
    pub(super) fn varies_in_space(&self) -> bool {
        self.variables[..3].iter().any(|used| *used)
    }

    /// Whether t occurs.
    pub(super) fn varies_in_time(&self) -> bool {
        self.variables[3]
    }

    pub(super) fn value(&self, point: [f64; 3], t: f64) -> f64 {
        self.root.evaluate(&[point[0], point[1], point[2], t])
    }

    pub(super) fn motion(&self, point: [f64; 3], t: f64) -> Motion {
        let [x, y, z] = point.map(Motion::constant);
        self.root.evaluate(&[x, y, z, Motion::time(t)])
    }
}

impl Node {
    fn evaluate<T: Scalar>(&self, variables: &[T; 4]) -> T {
        match self {
            Self::Number(value) => T::constant(*value),
            Self::Variable(index) => variables[*index],
            Self::Negate(node) => -node.evaluate(variables),
            Self::Binary(operator, a, b) => operator.apply(a.evaluate(variables), b.evaluate(variables)),
            Self::Call(Function::If, arguments) => {
                let chosen = if arguments[0].evaluate(variables).real() != 0.0 { 1 } else { 2 };
                arguments[chosen].evaluate(variables)
            }
            Self::Call(Function::Min, arguments) => {
                let (a, b) = (arguments[0].evaluate(variables), arguments[1].evaluate(variables));
                if a.real() <= b.real() { a } else { b }
            }
            Self::Call(Function::Max, arguments) => {
                let (a, b) = (arguments[0].evaluate(variables), arguments[1].evaluate(variables));
                if a.real() >= b.real() { a } else { b }
            }
            Self::Call(function, arguments) => function.apply(arguments[0].evaluate(variables)),
        }
    }
}

impl Operator {
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
    /// Functions of one argument with their first and second derivatives.
    fn apply<T: Scalar>(self, argument: T) -> T {
        let x = argument.real();
        let (f, first, second) = match self {
            Self::Sin => (x.sin(), x.cos(), -x.sin()),
            Self::Cos => (x.cos(), -x.sin(), -x.cos()),
            Self::Exp => (x.exp(), x.exp(), x.exp()),
            Self::Log => (x.ln(), 1.0 / x, -1.0 / (x * x)),
            Self::Sqrt => (x.sqrt(), 0.5 / x.sqrt(), -0.25 / (x * x.sqrt())),
            Self::Abs => (x.abs(), if x < 0.0 { -1.0 } else { 1.0 }, 0.0),
            Self::Min | Self::Max | Self::If => unreachable!("evaluated by the node"),
        };
        argument.chain(f, first, second)
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    operations: usize,
    variables: [bool; 4],
}

impl<'a> Parser<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn skip_space(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    fn wrong(&self, message: String) -> Complaint {
        Complaint::new(message)
            .hint("known: x y z t pi, + - * / ^, < <= > >= == !=, sin cos exp log sqrt abs min max if(condition, a, b)")
            .offset(self.text[..self.at].chars().count())
    }

    fn take(&mut self, symbol: &str) -> bool {
        self.skip_space();
        let found = self.rest().starts_with(symbol);
        self.at += if found { symbol.len() } else { 0 };
        found
    }

    fn expect(&mut self, symbol: &str) -> Result<(), Complaint> {
        if self.take(symbol) {
            Ok(())
        } else {
            Err(self.wrong(format!("expected '{symbol}' in the expression")))
        }
    }

    fn one_of(&mut self, symbols: &[(&str, Operator)]) -> Option<Operator> {
        symbols.iter().find(|(symbol, _)| self.take(symbol)).map(|(_, operator)| *operator)
    }

    fn join(&mut self, operator: Operator, a: Node, b: Node) -> Result<Node, Complaint> {
        self.operations += 1;
        if self.operations > MAX_OPERATIONS {
            return Err(self.wrong(format!("the expression has more than {MAX_OPERATIONS} operations")));
        }
        Ok(Node::Binary(operator, Box::new(a), Box::new(b)))
    }

    fn deeper<R>(&mut self, read: impl FnOnce(&mut Self) -> Result<R, Complaint>) -> Result<R, Complaint> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.wrong(format!("the expression is nested more than {MAX_DEPTH} deep")));
        }
        let result = read(self);
        self.depth -= 1;
        result
    }

    fn comparison(&mut self) -> Result<Node, Complaint> {
        let left = self.chain(&SUMS, |p| p.chain(&PRODUCTS, Self::signed))?;
        match self.one_of(&COMPARISONS) {
            None => Ok(left),
            Some(operator) => {
                let right = self.chain(&SUMS, |p| p.chain(&PRODUCTS, Self::signed))?;
                self.join(operator, left, right)
            }
        }
    }

    /// Operands joined by operators of one precedence, from the left.
    fn chain(
        &mut self,
        symbols: &[(&str, Operator)],
        operand: impl Fn(&mut Self) -> Result<Node, Complaint>,
    ) -> Result<Node, Complaint> {
        let mut left = operand(self)?;
        while let Some(operator) = self.one_of(symbols) {
            let right = operand(self)?;
            left = self.join(operator, left, right)?;
        }
        Ok(left)
    }

    /// A sign binds weaker than a power: -x^2 is -(x^2).
    fn signed(&mut self) -> Result<Node, Complaint> {
        if self.take("-") {
            return Ok(Node::Negate(Box::new(self.deeper(Self::signed)?)));
        }
        if self.take("+") {
            return self.deeper(Self::signed);
        }
        let base = self.atom()?;
        if !self.take("^") {
            return Ok(base);
        }
        let exponent = self.deeper(Self::signed)?;
        self.join(Operator::Power, base, exponent)
    }

    fn atom(&mut self) -> Result<Node, Complaint> {
        if self.take("(") {
            let inner = self.deeper(Self::comparison)?;
            self.expect(")")?;
            return Ok(inner);
        }
        let digits = super::unit::number_length(self.rest());
        if let (true, Ok(value)) = (self.starts_number(), self.rest()[..digits].parse()) {
            self.at += digits;
            return Ok(Node::Number(value));
        }
        let length =
            self.rest().find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest().len());
        let name = &self.rest()[..length];
        if name.is_empty() {
            return Err(match self.rest().chars().next() {
                None => self.wrong("the expression ends where a value should follow".into()),
                Some(c) => self.wrong(format!("unexpected '{c}' in the expression")),
            });
        }
        self.word(name)
    }

    fn starts_number(&self) -> bool {
        self.rest().starts_with(|c: char| c.is_ascii_digit() || c == '.')
    }

    fn word(&mut self, name: &str) -> Result<Node, Complaint> {
        if let Some(index) = VARIABLES.iter().position(|variable| *variable == name) {
            self.variables[index] = true;
            self.at += name.len();
            return Ok(Node::Variable(index));
        }
        if name == "pi" {
            self.at += name.len();
            return Ok(Node::Number(std::f64::consts::PI));
        }
        let Some((_, function, count)) = FUNCTIONS.iter().find(|entry| entry.0 == name) else {
            return Err(self.wrong(format!("unknown name '{name}' in the expression")));
        };
        self.at += name.len();
        self.operations += 1;
        self.expect("(")?;
        let mut arguments = vec![self.deeper(Self::comparison)?];
        while arguments.len() < *count {
            self.expect(",")?;
            arguments.push(self.deeper(Self::comparison)?);
        }
        self.expect(")")?;
        Ok(Node::Call(*function, arguments))
    }
}
