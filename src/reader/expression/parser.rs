//! Recursive descent: or < and < not < comparison < sum < product < sign < power < atom.

use super::super::complaint::{Complaint, listed, nearest};
use super::super::context::{parameter, parameter_names};
use super::super::unit::number_length;
use super::{Comparison, FUNCTIONS, Function, Node, Operator, Test, VARIABLES, Variable};

/// Longer symbols first, so that `<=` is not read as `<`.
const COMPARISONS: [(&str, Comparison); 6] = [
    ("<=", Comparison::LessEqual),
    (">=", Comparison::GreaterEqual),
    ("==", Comparison::Equal),
    ("!=", Comparison::NotEqual),
    ("<", Comparison::Less),
    (">", Comparison::Greater),
];

const SUMS: [(&str, Operator); 2] = [("+", Operator::Add), ("-", Operator::Subtract)];
const PRODUCTS: [(&str, Operator); 2] = [("*", Operator::Multiply), ("/", Operator::Divide)];

/// Words that are neither variables nor functions of numbers.
const WORDS: [&str; 5] = ["pi", "if", "and", "or", "not"];

const MAX_DEPTH: usize = 64;
const MAX_OPERATIONS: usize = 1000;

/// Whether a name is a variable or a function, so that no parameter may have it.
pub(in super::super) fn is_reserved(name: &str) -> bool {
    own_names().any(|own| own == name)
}

/// The names of the grammar.
fn own_names() -> impl Iterator<Item = &'static str> {
    let variables = VARIABLES.iter().map(|entry| entry.0);
    variables.chain(WORDS).chain(FUNCTIONS.iter().map(|entry| entry.0))
}

/// The tree of an expression whose value is a number, and whether a parameter occurs in it.
pub(super) fn parse_number(text: &str) -> Result<(Node, bool), Complaint> {
    let mut parser = Parser::new(text);
    let root = parser.whole(|parser| parser.number(Parser::any))?;
    Ok((root, parser.uses_parameters))
}

/// The tree of an expression in columns of tables, and the columns that occur in it, each once, with the
/// number of characters before it.
pub(super) fn parse_of_columns(text: &str) -> Result<(Node, Vec<(String, usize)>), Complaint> {
    let mut parser = Parser { columns: Some(Vec::new()), ..Parser::new(text) };
    let root = parser.whole(|parser| parser.number(Parser::any))?;
    Ok((root, parser.columns.unwrap_or_default()))
}

/// The tree of a condition.
pub(super) fn parse_condition(text: &str) -> Result<Test, Complaint> {
    Parser::new(text).whole(|parser| parser.condition(Parser::any))
}

/// Part of an expression.
enum Part {
    Number(Node),
    Condition(Test),
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    operations: usize,
    uses_parameters: bool,
    /// Columns of tables that occur, if they may.
    columns: Option<Vec<(String, usize)>>,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Self {
        Self { text, at: 0, depth: 0, operations: 0, uses_parameters: false, columns: None }
    }

    /// Parses the whole text.
    fn whole<R>(&mut self, read: impl FnOnce(&mut Self) -> Result<R, Complaint>) -> Result<R, Complaint> {
        let root = read(self)?;
        self.skip_space();
        match self.rest().chars().next() {
            None => Ok(root),
            Some(c) => Err(self.wrong(format!("unexpected '{c}' in the expression"))),
        }
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn skip_space(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    fn wrong(&self, message: String) -> Complaint {
        self.wrong_at(self.at, message)
    }

    fn wrong_at(&self, at: usize, message: String) -> Complaint {
        let functions: Vec<&str> = FUNCTIONS.iter().map(|entry| entry.0).collect();
        let variables = if self.columns.is_some() { "TABLE.NAME.COLUMN t" } else { "x y z t" };
        let hint = format!(
            "known: {variables} pi, + - * / ^, < <= > >= == !=, and or not, {} if(condition, a, b)",
            functions.join(" ")
        );
        Complaint::new(message).hint(hint).offset(self.text[..at].chars().count())
    }

    /// The complaint about an unknown name.
    fn unknown(&self, name: &str) -> Complaint {
        let mut complaint = self.wrong(format!("unknown name '{name}' in the expression"));
        let parameters = parameter_names();
        let mut known: Vec<&str> = parameters.iter().map(String::as_str).collect();
        if !known.is_empty() {
            complaint.hint.push_str(&format!("; parameters: {}", listed(&known)));
        }
        own_names().for_each(|own| known.push(own));
        if let Some(meant) = nearest(name, &known).filter(|_| name.chars().count() > 1) {
            complaint.hint.push_str(&format!("; did you mean '{meant}'?"));
        }
        complaint
    }

    fn take(&mut self, symbol: &str) -> bool {
        self.skip_space();
        let found = self.rest().starts_with(symbol);
        self.at += if found { symbol.len() } else { 0 };
        found
    }

    /// The name at this position; empty if another token follows.
    fn name(&self) -> &'a str {
        let rest = self.rest();
        &rest[..rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len())]
    }

    /// The column of a table at this position, such as `contact.sole.force_n`, or in backticks if
    /// a name in it has a `-`. `None` if the text is something else, or if columns are not allowed here.
    fn column(&mut self) -> Option<Node> {
        let columns = self.columns.as_mut()?;
        let rest = &self.text[self.at..];
        let (name, length) = match rest.strip_prefix('`') {
            Some(quoted) => {
                let end = quoted.find('`')?;
                (&quoted[..end], end + 2)
            }
            None => {
                let inside = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
                let end = rest.find(|c: char| !inside(c)).unwrap_or(rest.len());
                (&rest[..end], end)
            }
        };
        if !name.contains('.') || name.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return None;
        }
        let known = columns.iter().position(|(known, _)| known == name);
        let number = known.unwrap_or_else(|| {
            columns.push((name.to_owned(), self.text[..self.at].chars().count()));
            columns.len() - 1
        });
        self.at += length;
        Some(Node::Variable(Variable::Column(number)))
    }

    fn take_word(&mut self, word: &str) -> bool {
        self.skip_space();
        let found = self.name() == word;
        self.at += if found { word.len() } else { 0 };
        found
    }

    fn expect(&mut self, symbol: &str) -> Result<(), Complaint> {
        if self.take(symbol) {
            Ok(())
        } else {
            Err(self.wrong(format!("expected '{symbol}' in the expression")))
        }
    }

    fn one_of<O: Copy>(&mut self, symbols: &[(&str, O)]) -> Option<O> {
        symbols.iter().find(|(symbol, _)| self.take(symbol)).map(|(_, operator)| *operator)
    }

    fn count(&mut self) -> Result<(), Complaint> {
        self.operations += 1;
        if self.operations > MAX_OPERATIONS {
            return Err(self.wrong(format!("the expression has more than {MAX_OPERATIONS} operations")));
        }
        Ok(())
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

    /// A part that must be a number.
    fn number(&mut self, read: impl FnOnce(&mut Self) -> Result<Part, Complaint>) -> Result<Node, Complaint> {
        self.skip_space();
        let start = self.at;
        let part = read(self)?;
        self.as_number(start, part)
    }

    /// The number that a part from `start` on must be.
    fn as_number(&self, start: usize, part: Part) -> Result<Node, Complaint> {
        match part {
            Part::Number(node) => Ok(node),
            Part::Condition(_) => Err(self
                .wrong_at(start, "a number is expected here, but this is a condition".into())
                .hint("if(condition, a, b) is a number that depends on a condition")),
        }
    }

    /// A part that must be a condition.
    fn condition(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<Part, Complaint>,
    ) -> Result<Test, Complaint> {
        self.skip_space();
        let start = self.at;
        let part = read(self)?;
        self.as_condition(start, part)
    }

    /// The condition that a part from `start` on must be.
    fn as_condition(&self, start: usize, part: Part) -> Result<Test, Complaint> {
        match part {
            Part::Condition(test) => Ok(test),
            Part::Number(_) => Err(self
                .wrong_at(start, "a condition is expected here, but this is a number".into())
                .hint("compare it, for example x > 0.3 and z < 1e-6")),
        }
    }

    /// A number or a condition.
    fn any(&mut self) -> Result<Part, Complaint> {
        self.joined("or", |p| p.joined("and", Self::negated, Test::And), Test::Or)
    }

    /// Conditions joined by a word, from the left; or a single part of any kind.
    fn joined(
        &mut self,
        word: &str,
        operand: impl Fn(&mut Self) -> Result<Part, Complaint>,
        join: impl Fn(Box<Test>, Box<Test>) -> Test,
    ) -> Result<Part, Complaint> {
        self.skip_space();
        let start = self.at;
        let mut left = operand(self)?;
        while self.take_word(word) {
            self.count()?;
            let first = self.as_condition(start, left)?;
            let second = self.condition(&operand)?;
            left = Part::Condition(join(Box::new(first), Box::new(second)));
        }
        Ok(left)
    }

    /// A comparison, perhaps with `not` before it.
    fn negated(&mut self) -> Result<Part, Complaint> {
        if self.take_word("not") {
            self.count()?;
            let inner = self.deeper(|p| p.condition(Self::negated))?;
            return Ok(Part::Condition(Test::Not(Box::new(inner))));
        }
        self.comparison()
    }

    fn comparison(&mut self) -> Result<Part, Complaint> {
        self.skip_space();
        let start = self.at;
        let left = self.sum()?;
        let Some(comparison) = self.one_of(&COMPARISONS) else { return Ok(left) };
        self.count()?;
        let left = self.as_number(start, left)?;
        let right = self.number(Self::sum)?;
        self.skip_space();
        let symbol = self.at;
        if self.one_of(&COMPARISONS).is_some() {
            let message = "a comparison has two sides, and a third follows here".to_owned();
            return Err(self.wrong_at(symbol, message).hint("join two comparisons: 0 < x and x < 1"));
        }
        Ok(Part::Condition(Test::Compare(comparison, Box::new(left), Box::new(right))))
    }

    fn sum(&mut self) -> Result<Part, Complaint> {
        self.chain(&SUMS, |p| p.chain(&PRODUCTS, Self::signed))
    }

    /// Operands joined by operators of one precedence, from the left.
    fn chain(
        &mut self,
        symbols: &[(&str, Operator)],
        operand: impl Fn(&mut Self) -> Result<Part, Complaint>,
    ) -> Result<Part, Complaint> {
        self.skip_space();
        let start = self.at;
        let mut left = operand(self)?;
        while let Some(operator) = self.one_of(symbols) {
            self.count()?;
            let first = self.as_number(start, left)?;
            let second = self.number(&operand)?;
            left = Part::Number(Node::Binary(operator, Box::new(first), Box::new(second)));
        }
        Ok(left)
    }

    /// A sign binds weaker than a power: -x^2 is -(x^2).
    fn signed(&mut self) -> Result<Part, Complaint> {
        if self.take("-") {
            let inner = self.deeper(|p| p.number(Self::signed))?;
            return Ok(Part::Number(Node::Negate(Box::new(inner))));
        }
        if self.take("+") {
            return Ok(Part::Number(self.deeper(|p| p.number(Self::signed))?));
        }
        let start = self.at;
        let base = self.atom()?;
        if !self.take("^") {
            return Ok(base);
        }
        self.count()?;
        let base = self.as_number(start, base)?;
        let exponent = self.deeper(|p| p.number(Self::signed))?;
        Ok(Part::Number(Node::Binary(Operator::Power, Box::new(base), Box::new(exponent))))
    }

    fn atom(&mut self) -> Result<Part, Complaint> {
        if self.take("(") {
            let inner = self.deeper(Self::any)?;
            self.expect(")")?;
            return Ok(inner);
        }
        if let Some(column) = self.column() {
            return Ok(Part::Number(column));
        }
        let digits = number_length(self.rest());
        if let (true, Ok(value)) = (self.starts_number(), self.rest()[..digits].parse()) {
            self.at += digits;
            return Ok(Part::Number(Node::Number(value)));
        }
        let name = self.name();
        if name.is_empty() {
            return Err(match self.rest().chars().next() {
                None => self.wrong("the expression ends where a value should follow".into()),
                Some(c) => self.wrong(format!("unexpected '{c}' in the expression")),
            });
        }
        self.word(name).map(Part::Number)
    }

    fn starts_number(&self) -> bool {
        self.rest().starts_with(|c: char| c.is_ascii_digit() || c == '.')
    }

    fn word(&mut self, name: &str) -> Result<Node, Complaint> {
        let start = self.at;
        self.at += name.len();
        let variable = VARIABLES.iter().find(|entry| entry.0 == name);
        let exists = |variable: Variable| self.columns.is_none() || variable == Variable::Time;
        if let Some((_, variable)) = variable.filter(|entry| exists(entry.1)) {
            return Ok(Node::Variable(*variable));
        }
        if name == "pi" {
            return Ok(Node::Number(std::f64::consts::PI));
        }
        if name == "if" {
            return self.choice();
        }
        if let Some((_, function, least, most)) = FUNCTIONS.iter().find(|entry| entry.0 == name) {
            return self.call(*function, *least, *most);
        }
        if let Some(value) = parameter(name) {
            self.uses_parameters = true;
            return Ok(Node::Number(value));
        }
        self.at = start;
        Err(self.unknown(name))
    }

    fn call(&mut self, function: Function, least: usize, most: usize) -> Result<Node, Complaint> {
        self.expect("(")?;
        let mut arguments = Vec::new();
        loop {
            self.count()?;
            arguments.push(self.deeper(|p| p.number(Self::any))?);
            if arguments.len() < least {
                self.expect(",")?;
            } else if arguments.len() == most || !self.take(",") {
                break;
            }
        }
        self.expect(")")?;
        Ok(Node::Call(function, arguments))
    }

    fn choice(&mut self) -> Result<Node, Complaint> {
        self.count()?;
        self.expect("(")?;
        let test = self.deeper(|p| p.condition(Self::any))?;
        self.expect(",")?;
        let one = self.deeper(|p| p.number(Self::any))?;
        self.expect(",")?;
        let other = self.deeper(|p| p.number(Self::any))?;
        self.expect(")")?;
        Ok(Node::If(Box::new(test), Box::new(one), Box::new(other)))
    }
}
