//! What the user writes: plain data with units and ranges, read with positions, checked as far as no mesh is needed.
//!
//! The doc comments of the fields are the descriptions in the schema (`contact-petsc schema`), and the defaults stand
//! here and nowhere else. A physical constant has none.

mod accuracy;
mod body;
mod boundary;
mod check;
mod components;
mod contact;
mod damping;
mod dimension;
mod elastic;
mod guard;
mod output;
mod partition;
mod petsc;
mod reference;
mod region;
mod rigid;
mod roller;
mod sets;
mod solver;
mod start;
mod tied;
mod time;
mod viscoelasticity;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

pub use crate::presets::Linear;
pub use crate::schemes::Scheme;
use crate::schemes::Static;
pub use accuracy::{Accuracy, LEVELS, Level, Penetration as PenetrationTolerance};
pub use body::{
    Body, BoxMap, BoxMesh, Element, FileMesh, Kinematics, Locking, Mass, Merge, Mesh, PlaneAssumption,
};
pub use boundary::{Action, Boundary};
pub use components::{Components, Force, Torque};
pub use contact::{ALL, Area, Contact, InitialOverclosure};
pub use damping::{Damping, Rayleigh};
pub use dimension::SpaceDimension;
pub use elastic::{Directional, Foundation, Spring};
pub use guard::Guard;
pub use output::{Checkpoint, FieldFormat, Fields, Line, Output, Probe};
pub use partition::Partitioner;
pub use petsc::PetscValue;
pub use reference::{case_reference, study_reference};
pub use region::Region;
pub use rigid::{Degree, FreeMotion, PrescribedMotion, Rigid, Rotation, TorsionSpring, inertia_tensor};
pub use roller::Roller;
pub use sets::{BodySet, Combination, Members, Selection, SetNames};
pub use solver::{Krylov, Newton, Solver, StageMatrix, Strategy, Variant};
pub use start::Start;
pub use tied::Tied;
pub use time::Time;
pub use viscoelasticity::{PronyTerm, Viscoelasticity, ViscousModuli};

use crate::contact::obstacle::{Obstacle, SurfaceObstacle};
use crate::error::{Error, Result};
use crate::mesh::stl;
pub use crate::reader::at::{At, Named};
use crate::reader::complaint::Complaint;
pub use crate::reader::derived::Derived;
use crate::reader::document::{self, Document};
pub use crate::reader::function::{Function, Motion, PlacedFunction, Varying};
pub use crate::reader::parameters::CaseParameters;
pub use crate::reader::place::Place;
use crate::reader::quantity;
use crate::reader::schema::schema_of;
use crate::reader::source::Source;
pub use crate::reader::units::Units;

/// Longest case file \[bytes\]: 2 MiB.
///
/// A table over time of 50 000 rows with ten digits a number fits, with room to spare. At half of the limit it would not. Twice the
/// limit gains nothing: the reader accepts no more than 250 000 values, which a file of this length can hold.
const LONGEST: u64 = 1 << 21;

/// A case as written in `case.yml`, completed with the defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Description of the case.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Units of the numbers of the case and of its results; m, kg, s if absent.
    #[serde(default, skip_serializing_if = "Units::is_si")]
    pub units: Units,
    /// Numbers with names, for use in all other functions and numbers of the case, except whole
    /// numbers. Each is a number, a number with a unit, or an expression of parameters above it.
    #[serde(default, skip_serializing_if = "CaseParameters::is_empty")]
    pub parameters: CaseParameters,
    /// 2: plane strain or plane stress, with a thickness of one unit of length; 3: solid;
    /// `axisymmetric`: bodies of revolution about the y axis, with x as the radius.
    pub dimension: At<SpaceDimension>,
    /// State across the plane, in 2D; `strain` if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<At<PlaneAssumption>>,
    /// Deformable bodies by name.
    pub bodies: At<Named<Body>>,
    /// Rigid targets at rest by name.
    #[serde(default)]
    pub obstacles: Named<Obstacle>,
    /// Rigid bodies by name, whose motion is prescribed or follows from forces.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub rigid: Named<Rigid>,
    /// Pairs of surfaces that may touch, by name. `all` instead of names: all surfaces may touch
    /// each other and all obstacles and rigid bodies, without friction.
    #[serde(default, deserialize_with = "contact::contacts")]
    #[schemars(schema_with = "contact::contacts_schema")]
    pub contact: Named<Contact>,
    /// Pairs of surfaces that are bonded to each other, by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub tied: Named<Tied>,
    /// Supports and loads by name.
    #[serde(default)]
    pub boundary: Named<Boundary>,
    /// State at t = 0, in dynamics; rest if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<At<Start>>,
    /// Time and its discretisation.
    pub time: Time,
    /// Requested accuracy, from which step lengths, contact multipliers and tolerances of Newton's
    /// method follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<At<Accuracy>>,
    /// How the equations of a step are solved.
    #[serde(default)]
    pub solver: Solver,
    /// Library that assigns the elements to ranks; `metis` if absent.
    #[serde(default, skip_serializing_if = "is_metis")]
    pub partition: At<Partitioner>,
    /// Physical limits at which a run ends or cuts a step.
    #[serde(default)]
    pub guard: Guard,
    /// Output and its frequency.
    #[serde(default)]
    pub output: Output,
    /// PETSc options, without the leading dash; those of the command line override them.
    #[serde(default)]
    pub petsc: Named<PetscValue>,
    /// The text, for errors that later checks find.
    #[serde(skip)]
    source: Rc<Source>,
}

fn is_metis(partition: &At<Partitioner>) -> bool {
    partition.value == Partitioner::Metis
}

/// Draft-07 schema of a case file.
pub fn schema() -> serde_json::Value {
    schema_of::<Case>()
}

impl Case {
    /// Reads, checks and completes a case file.
    ///
    /// # Errors
    /// [`crate::error::Cause::File`] if it can not be read, [`crate::error::Cause::Case`] if it is wrong.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(&Self::load(path)?, &path.display().to_string())
    }

    /// The text of a case file.
    ///
    /// # Errors
    /// [`crate::error::Cause::File`] if it can not be read, [`crate::error::Cause::Case`] if it is no text.
    pub fn load(path: &Path) -> Result<String> {
        let name = path.display();
        let mut bytes = Vec::new();
        let read = File::open(path).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes));
        read.map_err(|error| Error::file(format!("{name}: the case file can not be read: {error}")))?;
        if bytes.len() as u64 > LONGEST {
            let text = format!("{name}: longer than {LONGEST} bytes, the limit of case files");
            return Err(Error::case(text).hint("store meshes in separate files"));
        }
        String::from_utf8(bytes)
            .map_err(|error| Error::case(format!("{name}: the case is not text (UTF-8): {error}")))
    }

    /// Reads, checks and completes the text of a case; errors show the name, and its folder is the
    /// base of relative paths.
    ///
    /// # Errors
    /// What is wrong, as `name:line:column: message`, with the line itself and a hint.
    pub fn parse(text: &str, name: &str) -> Result<Self> {
        let source = Source::new(text, Path::new(name));
        Ok(document::read_as(0, &source, None, check::complaints)?.completed(source))
    }

    /// Reads, checks and completes a case whose keys a study has changed.
    ///
    /// # Errors
    /// What is wrong, at its place in the case or in the study.
    pub fn from_document(document: &Document) -> Result<Self> {
        Ok(document.read_as(check::complaints)?.completed(document.source().clone()))
    }

    fn completed(mut self, source: Source) -> Self {
        self.source = Rc::new(source);
        self.complete();
        self
    }

    /// Fills in the defaults that depend on other keys.
    fn complete(&mut self) {
        let element = if self.dimension.value.coordinates() == 2 { Element::Quad4 } else { Element::Hex8 };
        for body in self.bodies.value.values_mut() {
            if let Mesh::Box(cuboid) = &mut body.mesh {
                cuboid.element.get_or_insert(element.into());
            }
        }
        for (name, contact) in
            contact::with_obstacles(&self.contact, self.shapes().map(|(name, _)| name.as_str()))
        {
            self.contact.push(name, contact);
        }
        match &self.time.scheme.value {
            Scheme::Static(Static { increments: Some(increments) }) => {
                let step = self.time.end.value / f64::from(increments.value);
                self.time.step = Some(quantity::Duration::new(step));
                self.time.scheme.value = Scheme::Static(Static { increments: None });
            }
            Scheme::Static(_) => {}
            _ => {
                self.start.get_or_insert_with(At::default);
            }
        }
    }

    /// An error of the case whose place and cure are in the complaint.
    pub fn complain(&self, complaint: &Complaint) -> Error {
        self.source.error(complaint)
    }

    /// The error that points at a place of the case file, for what only a mesh or a model can find.
    pub fn error(&self, place: Place, message: impl Into<String>) -> Error {
        self.source.error(&Complaint::new(message.into()).at(place))
    }

    /// The error at a name that only a mesh knows to be wrong, with the names that there are and the nearest of them.
    pub fn unknown<'a>(
        &self,
        name: &At<String>,
        message: String,
        known: impl Iterator<Item = &'a str>,
    ) -> Error {
        let complaint = Complaint::unknown("name", name, known).at(name.place);
        self.source.error(&complaint.saying(message))
    }

    /// A function that knows where in the case it is written.
    pub fn function<const KG: i8, const M: i8, const S: i8>(
        &self,
        varying: &Varying<KG, M, S>,
    ) -> PlacedFunction {
        PlacedFunction::new(varying, &self.source)
    }

    /// A path of the case, made relative to the working directory.
    pub fn resolve(&self, path: &str) -> PathBuf {
        self.source.directory.join(path)
    }

    /// The text of the case file.
    pub fn text(&self) -> &str {
        &self.source.text
    }

    /// Whether the scheme conserves over steps that are not linear: its matrix is then not symmetric.
    pub fn has_unsymmetric_steps(&self) -> bool {
        self.time.scheme.value.conserves()
            && (self.bodies.values().any(|body| body.kinematics == Kinematics::Finite)
                || !self.meets_planes_only()
                || self.rigid.values().any(Rigid::rotates))
    }

    /// Whether elastic bodies touch each other or themselves.
    pub fn joins_bodies(&self) -> bool {
        self.contact.values().any(|contact| self.shape(&contact.target).is_none())
    }

    /// Whether the target of every contact is a plane.
    fn meets_planes_only(&self) -> bool {
        let is_plane = |contact: &Contact| self.shape(&contact.target).is_some_and(Obstacle::is_plane);
        self.contact.values().all(is_plane)
    }

    /// Whether contact without friction makes the matrix non-symmetric: between bodies, over round
    /// obstacles and with free rigid bodies. A linear solver that needs symmetry gets the symmetric
    /// part, for more iterations of Newton's method.
    pub fn has_unsymmetric_contact(&self) -> bool {
        let free = self.rigid.values().any(|body| body.free.is_some());
        !self.solver.linear.needs_symmetry() && (free || !self.meets_planes_only())
    }

    /// The shape of the rigid body with this name.
    pub fn shape(&self, name: &str) -> Option<&Obstacle> {
        self.obstacles.get(name).or_else(|| self.rigid.get(name).map(|body| &body.shape))
    }

    /// What messages call the rigid body with this name.
    pub fn noun(&self, name: &str) -> &'static str {
        if self.obstacles.get(name).is_some() { "obstacle" } else { "rigid body" }
    }

    /// Names and shapes of all rigid bodies.
    pub fn shapes(&self) -> impl Iterator<Item = (&At<String>, &Obstacle)> {
        self.obstacles.iter().chain(self.rigid.iter().map(|(name, body)| (name, &body.shape)))
    }

    /// Paths of all files that the case names: meshes, then surfaces of rigid bodies.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        let meshes = self.bodies.values().filter_map(|body| match &body.mesh {
            Mesh::File(file) => Some(&file.file),
            Mesh::Box(_) => None,
        });
        meshes.chain(self.surfaces().map(|surface| &surface.file)).map(|file| self.resolve(&file.value))
    }

    /// Surfaces of rigid bodies that are read from files.
    pub fn surfaces(&self) -> impl Iterator<Item = &SurfaceObstacle> {
        self.shapes().filter_map(|(_, shape)| shape.surface())
    }

    /// Takes the surfaces of rigid bodies from their files, unless they are loaded already.
    /// `bytes` gets the path of a file, and returns its content.
    ///
    /// # Errors
    /// A file can not be read or bounds no solid. The message has its name.
    pub fn load_surfaces(&self, mut bytes: impl FnMut(&Path) -> Result<Vec<u8>>) -> Result<()> {
        for surface in self.surfaces().filter(|surface| !surface.is_loaded()) {
            let path = self.resolve(&surface.file.value);
            let bytes = bytes(&path)?;
            let mesh = stl::surface(&bytes).and_then(|mesh| surface.load(mesh));
            mesh.map_err(|error| error.within(&path.display().to_string()))?;
        }
        Ok(())
    }

    /// Whether there is no stress across the plane.
    pub fn is_plane_stress(&self) -> bool {
        self.plane.as_ref().is_some_and(|plane| plane.value == PlaneAssumption::Stress)
    }

    /// Whether all bodies are bodies of revolution about the y axis.
    pub fn is_axisymmetric(&self) -> bool {
        self.dimension.value == SpaceDimension::Axisymmetric
    }

    /// Whether the case has no inertia.
    pub fn is_static(&self) -> bool {
        self.time.scheme.value.is_static()
    }

    /// Whether `accuracy` takes the mass off the contact surfaces of this body in motion.
    ///
    /// It does in steps that follow their errors, if a penetration is requested as well: the penalty may then become stiffer.
    /// In equal steps a node without mass that friction leaves without a balance has too few ways out. Under the conserving
    /// scheme nothing damps oscillations on the penalty, which are faster than any reasonable step, so that an error in time is
    /// enough. There a body that meets another one keeps its mass, because vertices without mass may find no balance.
    pub fn calms_contact_of(&self, body: &str) -> bool {
        let conserves = self.time.scheme.value.conserves();
        let asked = self
            .accuracy
            .as_ref()
            .is_some_and(|accuracy| accuracy.time.is_some() && (conserves || accuracy.penetration.is_some()));
        let moves = !self.is_static();
        let has_penalty = |contact: &Contact| contact.normal.is_penalty() && contact.is_on(body);
        let mut penalties = self.contact.values().filter(|contact| has_penalty(contact)).peekable();
        asked
            && moves
            && penalties.peek().is_some()
            && penalties.all(|contact| !conserves || self.shape(&contact.target).is_some())
    }

    /// The completed case as YAML.
    ///
    /// # Errors
    /// A fault of the program.
    pub fn to_yaml(&self) -> Result<String> {
        serde_saphyr::to_string(&self.to_json()?)
            .map_err(|error| Error::internal(format!("case to YAML: {error}")))
    }

    /// SHA-256 of the completed case, by which a study knows a member that is done.
    ///
    /// # Errors
    /// A fault of the program.
    pub fn digest(&self) -> Result<String> {
        let text = self.to_json()?.to_string();
        Ok(Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// The completed case as JSON.
    ///
    /// # Errors
    /// A fault of the program.
    pub fn to_json(&self) -> Result<serde_json::Value> {
        serde_json::to_value(self).map_err(|error| Error::internal(format!("case to JSON: {error}")))
    }
}

#[cfg(test)]
mod tests;
