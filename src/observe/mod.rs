//! Quantities that a run reports: tables of columns and fields, and the functions that evaluate
//! them.
//!
//! Each table has one entry per column or field. The entry holds the name, the unit, one sentence
//! of documentation, how values are reduced over points, nodes and ranks, and a function that gives
//! the value. The table feeds the headings and rows of the CSV files, the arrays of the ParaView
//! files, and the reference of the results (`docs/results-reference.md`).
//!
//! | Table | Feeds |
//! |---|---|
//! | [`contact::ContactColumn::TABLE`] | `contact.csv` |
//! | [`probes::ProbeColumn::TABLE`] | `probes.csv` |
//! | [`reactions::REACTION_COLUMNS`] | `reactions.csv` |
//! | [`rigid::RIGID_COLUMNS`] | `rigid.csv` |
//! | [`bodies::BODY_COLUMNS`] | `bodies.csv` |
//! | [`loads::LOAD_COLUMNS`] | `loads.csv` |
//! | [`lines::LINE_COLUMNS`] | `lines.csv` |
//! | [`energy::ENERGY_COLUMNS`] | `energy.csv` |
//! | [`energy::MOMENTUM_COLUMNS`] | `momentum.csv` |
//! | [`fields::NODE_FIELDS`], [`fields::ELEMENT_FIELDS`], [`fields::STRESS_FIELDS`], [`fields::NODAL_STRESS_FIELDS`], [`fields::ContactField::TABLE`] | `fields.pvd`, `contact.pvd` |
//! | [`rigid_surfaces::RIGID_DISPLACEMENT`] | `rigid.pvd` |
//!
//! Observers read a [`ContactSystem`](crate::assembly::ContactSystem) through its public methods
//! and change nothing in it that a solver sees.

pub mod bodies;
pub mod contact;
pub mod energy;
pub mod fields;
pub mod lines;
pub mod loads;
pub mod nodal;
mod nodal_stress;
pub mod probes;
pub mod quantity;
pub mod reactions;
pub mod rigid;
pub mod rigid_surfaces;
mod unbalanced;

pub use unbalanced::unbalanced_place;
