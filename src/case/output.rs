//! `output`: what is written, and how often.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::{At, Named};
use crate::reader::derived::Derived;
use crate::reader::quantity::{Duration, Length};
use crate::reader::tagged::tagged;

/// Output in addition to the histories, which are always written every step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Fields for ParaView.
    pub fields: Fields,
    /// Material points whose history is written, by name.
    pub probes: Named<Probe>,
    /// Segments along which `lines.csv` has displacement, velocity and stress at equal distances, by name.
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub lines: Named<Line>,
    /// Quantities derived from columns of the tables, by name, which `derived.csv` gets. An expression
    /// names a column as `TABLE.NAME.COLUMN`, such as `contact.drag.force_x / contact.sole.force_n`, and
    /// one of `energy.csv` and `momentum.csv` as `energy.total`. A reference with a `-` in a name is written
    /// in backticks. `t` is the time. The columns are those of the results reference, without units.
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub derived: Named<At<Derived>>,
    /// Whether `bodies.csv` is written: mass, centre of mass, momentum and energies of each deformable
    /// body. Each row integrates the mass over all elements, which costs about as much as one evaluation
    /// of the forces.
    #[serde(skip_serializing_if = "is_false")]
    pub bodies: bool,
    /// Whether `loads.csv` is written: force, moment and centre of each load of `boundary`.
    #[serde(skip_serializing_if = "is_false")]
    pub loads: bool,
    /// Checkpoints, from which `--restart` resumes a run. Without this key only a signal writes one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<Checkpoint>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde expects")]
fn is_false(value: &bool) -> bool {
    !*value
}

/// Checkpoints, from which a run can be resumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Checkpoint {
    /// Number of steps between two checkpoints, >= 1. One is written at the end as well.
    pub every: At<u32>,
    /// Number of most recent checkpoints that are kept, >= 1.
    pub keep: At<u32>,
    /// Wall time limit of this process \[s\] in every system of units, > 0: the run stops before it
    /// with a checkpoint and exit code 7. `--wall-time` overrides it.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::reader::quantity::wall_time"
    )]
    pub wall_time: Option<Duration>,
}

impl Default for Checkpoint {
    fn default() -> Self {
        Self { every: 100.into(), keep: 2.into(), wall_time: None }
    }
}

/// Fields for ParaView.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fields {
    /// Number of steps between two outputs; start and end are always written. 0: no fields.
    pub every: At<u32>,
    /// Whether `fields.pvd` also has von Mises stress, pressure, principal stresses and principal
    /// stretches of the elements, and Cauchy and von Mises stress at the nodes. The files of the bodies
    /// are then about twice as large.
    #[serde(skip_serializing_if = "is_false")]
    pub stresses: bool,
    /// Format of the files.
    #[serde(skip_serializing_if = "is_pieces")]
    pub format: At<FieldFormat>,
}

fn is_pieces(format: &At<FieldFormat>) -> bool {
    format.value == FieldFormat::Vtu
}

impl Default for Fields {
    fn default() -> Self {
        Self { every: 10.into(), stresses: false, format: FieldFormat::Vtu.into() }
    }
}

/// Format of the files with the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "FieldFormat")]
pub enum FieldFormat {
    /// `fields.pvd` with a file per rank, grid and output.
    #[default]
    Vtu,
    /// One file for all ranks and outputs, `fields.vtkhdf`, and `contact.vtkhdf` and `rigid.vtkhdf` if
    /// there are contacts and rigid bodies.
    /// PETSc must be linked with parallel HDF5, as that of Debian is.
    Vtkhdf,
}
tagged!(FieldFormat, "format of fields");

/// A segment along which fields are written, or a single point without `to` and `points`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Reference position of the first point \[m\].
    pub from: At<Vec<Length>>,
    /// Reference position of the last point \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<At<Vec<Length>>>,
    /// Number of points, both ends included, from 2 to 10000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<At<u32>>,
    /// Body that contains the points, if bodies meet there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<At<String>>,
    /// Whether the rows have the Cauchy stress as well. It is evaluated in all elements at each step, which
    /// costs about as much as one evaluation of the forces.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stresses: bool,
}

impl Line {
    /// Its last point, which is the first one of a single point \[m\].
    pub fn end(&self) -> &At<Vec<Length>> {
        self.to.as_ref().unwrap_or(&self.from)
    }

    /// Number of points.
    pub fn count(&self) -> u32 {
        self.points.map_or(1, |points| points.value)
    }
}

/// A node whose history is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Reference position \[m\]; the nearest node is used.
    pub at: At<Vec<Length>>,
    /// Body of the node, if two bodies meet there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<At<String>>,
}
