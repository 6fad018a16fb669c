//! Recursive descent: comparison < sum < product < sign < power < atom.

use super::super::complaint::Complaint;
use super::super::unit::number_length;
use super::{FUNCTIONS, Node, Operator, VARIABLES};

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

/// The tree of an expression.
pub(super) fn parse(text: &str) -> Result<Node, Complaint> {
    let mut parser = Parser { text, at: 0, depth: 0, operations: 0 };
    let root = parser.comparison()?;
    parser.skip_space();
    match parser.rest().chars().next() {
        None => Ok(root),
        Some(c) => Err(parser.wrong(format!("unexpected '{c}' in the expression"))),
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    operations: usize,
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
        let digits = number_length(self.rest());
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
        if let Some((_, variable)) = VARIABLES.iter().find(|entry| entry.0 == name) {
            self.at += name.len();
            return Ok(Node::Variable(*variable));
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
