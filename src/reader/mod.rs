//! How files of YAML are read: values with their places, quantities with units, functions of space and time, and errors that show
//! line, column and cure. What a case or a study consists of is elsewhere.

pub mod at;
pub mod complaint;
pub mod condition;
pub mod context;
pub mod derived;
mod deserializer;
pub mod document;
mod dual;
mod expression;
pub mod findings;
pub mod function;
pub mod laws;
pub mod node;
pub mod parameters;
mod path;
pub mod place;
pub mod power_stiffness;
pub mod quantity;
mod recovery;
pub mod schema;
pub mod source;
mod stand_in;
pub mod tagged;
pub mod turn;
pub mod unit;
pub mod units;
pub mod up_to;
