//! Studies: a case, what is varied in it, what is looked at; every member run, its error set against its cost, and what
//! to use for which accuracy said in a sentence.
//!
//! | File | What it holds |
//! |---|---|
//! | [`mod@file`] | `study.yml` as written |
//! | [`plan`] | its members: cases with keys changed by their paths, all read before the first is run |
//! | [`mod@run`] | one after the other on all ranks; what is done already is not done again |
//! | [`row`], [`series`] | values and errors out of the tables of a member |
//! | [`front`], [`advice`], [`figures`], [`table`], [`folder`] | what the study comes to, and where it is written |

pub mod advice;
mod columns;
pub mod figures;
pub mod file;
pub mod folder;
pub mod front;
pub mod plan;
pub mod row;
pub mod run;
pub mod series;
pub mod table;

pub use file::Study;
pub use folder::default_place;
pub use run::{Planned, StudyOptions, run};

/// The JSON schema (draft-07) of a study file.
pub fn schema() -> serde_json::Value {
    crate::reader::schema::schema_of::<Study>()
}

#[cfg(test)]
mod tests;
