//! The command `contact-petsc`.
fn main() {}
