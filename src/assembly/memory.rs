//! State of the system that outlives a step, in the form in which a checkpoint stores it.
//!
//! Rows are keyed by the nodes' numbers in the input mesh. Contact points are vertices, which are
//! at nodes. The branches of viscous bodies are keyed by the elements' numbers in the input mesh and by
//! their points.

use std::rc::Rc;

use serde::{Deserialize, Serialize};

use super::bodies::{Bodies, ViscousBody};
use super::contact::LocalContact;
use super::solid::SolidElements;
use super::stages::MatrixTarget;
use super::system::ContactSystem;
use crate::checkpoint::StoredTable;
use crate::collective::Collective;
use crate::contact::friction::Regularization;
use crate::contact::history::History;
use crate::contact::state::{Branches, ContactState};
use crate::dynamics::{
    ChangedLaw, ContactSource, MatrixSource, OverStep, SearchSource, Sources, Stage, StageSettings,
};
use crate::element::{ViscousHistory, components};
use crate::error::{Error, Result};
use crate::lanes::WIDTH;
use crate::material::Overstress;
use crate::petsc::{Session, Vector};
use crate::terms::Terms;

/// Number of nodes that are written at a time.
const NODES: u64 = 1 << 16;

/// Number of keys of an element in the table of a viscous body, one for each point of its rule. hex27
/// has the most points, 27.
const POINTS: u64 = 32;

/// Number of keys of a node in the table of a contact, one for each smooth part of the surface around
/// it. More sharp edges do not meet in one node.
const PARTS: u64 = 256;

/// Fields of the nodes with their names and with as many components as dimensions, or one.
pub type NamedFields = Vec<(String, Vec<f64>)>;

/// State of the system, except for its fields. The numbers are those of [`Sources`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SystemState {
    laws: Vec<ChangedLaw>,
    /// Load factor of the state.
    factor: f64,
    /// Rotations of the free rigid bodies, as quaternions.
    orientations: Vec<[f64; 4]>,
    matrix: Option<usize>,
    search: Option<usize>,
    pattern: Option<usize>,
}

/// What a checkpoint stores of [`Sources`] besides fields.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StoredSources {
    matrices: Vec<StoredMatrix>,
    searches: Vec<StoredSearch>,
    marks: usize,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct StoredMatrix {
    terms: u16,
    settings: StageSettings,
    orientations: Vec<[f64; 4]>,
    laws: Vec<ChangedLaw>,
    /// Whether the pressure was linearised at displacements that are stored.
    linearised: bool,
    /// Whether the bodies had viscous stress that is stored.
    viscous: bool,
    search: Option<usize>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct StoredSearch {
    undeformed: bool,
    over_step: OverStep,
    ahead: bool,
    /// Depths of each rank, as bits because they may be infinite.
    below: Vec<Vec<u64>>,
}

/// The tables of a checkpoint on this rank: that of the nodes, then those of the contacts, then those
/// of the viscous bodies.
pub struct StoredState {
    tables: Vec<StoredTable>,
    contacts: usize,
    dimension: usize,
}

impl StoredSources {
    /// What a checkpoint stores of these sources besides fields. Collective.
    pub fn of(session: &Session, sources: &Sources) -> Self {
        let matrix = |source: &Rc<MatrixSource>| StoredMatrix {
            terms: source.terms.bits(),
            settings: source.settings,
            orientations: source.orientations.clone(),
            laws: source.contacts.iter().map(|contact| contact.law).collect(),
            linearised: source.linearised_at.is_some(),
            viscous: source.viscous.is_some(),
            search: source
                .search
                .as_ref()
                .and_then(|search| sources.searches.iter().position(|known| known.is(search))),
        };
        let world = session.world();
        let search = |source: &Rc<SearchSource>| {
            let own: Vec<u64> = source.below.iter().map(|below| below.to_bits()).collect();
            let mut all = vec![0; own.len() * session.size() as usize];
            world.gather_all(&own[..], &mut all[..]);
            let below = all.chunks(own.len().max(1)).map(<[u64]>::to_vec).collect();
            StoredSearch {
                undeformed: source.undeformed,
                over_step: source.over_step,
                ahead: source.ahead,
                below,
            }
        };
        Self {
            matrices: sources.matrices.iter().map(matrix).collect(),
            searches: sources.searches.iter().map(search).collect(),
            marks: sources.marks.len(),
        }
    }

    /// The sources in these tables.
    ///
    /// # Errors
    /// A column is missing.
    pub fn sources<const D: usize>(
        &self,
        system: &ContactSystem<D>,
        tables: &StoredState,
    ) -> Result<Sources> {
        let session = system.session();
        let rank = session.rank() as usize;
        let mut sources = Sources::default();
        for (k, search) in self.searches.iter().enumerate() {
            let field = |name| tables.field(&of_search(k, name));
            let over = search.over_step == OverStep::Middle;
            sources.searches.push(Rc::new(SearchSource {
                undeformed: search.undeformed,
                over_step: search.over_step,
                ahead: search.ahead,
                u: if search.undeformed { Vec::new() } else { field("u")? },
                u_start: if over && !search.undeformed { field("u_start")? } else { Vec::new() },
                below: depths(&search.below, rank, session.size() as usize),
            }));
        }
        for (k, matrix) in self.matrices.iter().enumerate() {
            let field = |name| tables.field(&of_matrix(k, name));
            let points = |contact| tables.contact_block(contact, &point_names::<D>(k));
            let viscous = matrix.viscous.then(|| {
                let names = stress_names::<D>(k);
                let of_group = |solid: &SolidElements<D>, body: &ViscousBody| {
                    let values = tables.viscous_block(&system.bodies, body, solid, &names)?;
                    let factor = body.series.factor(matrix.settings.elapsed());
                    Ok(Rc::new(Overstress { factor, predicted: packed::<D>(solid, &values) }))
                };
                system.bodies.viscous_groups().map(|(solid, body)| of_group(solid, body)).collect()
            });
            let contact = |(number, law): (usize, &ChangedLaw)| {
                points(number).map(|points| ContactSource { law: *law, points })
            };
            sources.matrices.push(Rc::new(MatrixSource {
                terms: Terms::from_bits_truncate(matrix.terms),
                settings: matrix.settings,
                orientations: matrix.orientations.clone(),
                u: field("u")?,
                v: field("v")?,
                u_start: field("u_start")?,
                linearised_at: matrix.linearised.then(|| field("linearised_at")).transpose()?,
                contacts: matrix.laws.iter().enumerate().map(contact).collect::<Result<_>>()?,
                viscous: viscous.transpose()?,
                search: matrix.search.and_then(|number| sources.searches.get(number).cloned()),
            }));
        }
        for k in 0..self.marks {
            let marks = tables.node_block(&[of_marks(k)])?;
            sources.marks.push(marks.iter().map(|mark| *mark > 0.0).collect());
        }
        Ok(sources)
    }
}

impl StoredState {
    /// Creates empty tables for the sections of a checkpoint, given by names and columns.
    ///
    /// # Errors
    /// The checkpoint has other sections than the nodes, the contacts and the viscous bodies.
    pub fn wanted<'a, const D: usize>(
        system: &ContactSystem<D>,
        sections: impl Iterator<Item = (&'a str, &'a [String])>,
    ) -> Result<Self> {
        let mut keys = vec![("nodes".to_owned(), node_keys(&system.bodies))];
        keys.extend(
            system.contacts.iter().map(|contact| (table_of(contact), point_keys(&system.bodies, contact))),
        );
        let viscous = system.bodies.viscous.iter();
        let all = |_: &SolidElements<D>, _: usize| true;
        keys.extend(viscous.map(|body| (body.table(), element_keys(&system.bodies, body, all))));
        let sections: Vec<_> = sections.collect();
        let known = keys.iter().map(|(name, _)| name.as_str());
        if !known.eq(sections.iter().map(|(name, _)| *name)) {
            return Err(Error::file("a checkpoint with other tables than the case has"));
        }
        let mut tables = Vec::with_capacity(keys.len());
        for ((name, keys), (_, columns)) in keys.into_iter().zip(&sections) {
            tables.push(StoredTable::keyed(&name, columns.to_vec(), keys, NODES));
        }
        Ok(Self { tables, contacts: system.contacts.len(), dimension: D })
    }

    /// A field of the nodes.
    ///
    /// # Errors
    /// The checkpoint does not have it.
    pub fn field(&self, name: &str) -> Result<Vec<f64>> {
        self.node_block(&axes(name, self.dimension))
    }

    /// Fills a vector with a field of the nodes. Collective.
    ///
    /// # Errors
    /// The checkpoint does not have it, or a PETSc call fails.
    pub fn fill(&self, name: &str, vector: &mut Vector) -> Result<()> {
        let field = self.field(name)?;
        vector.owned_mut().copy_from_slice(&field);
        vector.update_ghosts()
    }

    /// The tables, to be read.
    pub fn tables_mut(&mut self) -> &mut [StoredTable] {
        &mut self.tables
    }

    fn node_block(&self, columns: &[String]) -> Result<Vec<f64>> {
        let nodes = self.tables.first().ok_or_else(|| Error::internal("a checkpoint without nodes"))?;
        nodes.block(columns)
    }

    fn contact_block(&self, contact: usize, columns: &[String]) -> Result<Vec<f64>> {
        let points = self.tables.get(1 + contact);
        points.ok_or_else(|| Error::internal("a checkpoint without a contact"))?.block(columns)
    }

    /// The columns of the elements of a group, element by element and point by point.
    fn viscous_block<const D: usize>(
        &self,
        bodies: &Bodies<D>,
        body: &ViscousBody,
        solid: &SolidElements<D>,
        columns: &[String],
    ) -> Result<Vec<f64>> {
        let table = self.tables.get(1 + self.contacts + body.number);
        let table = table.ok_or_else(|| Error::internal("a checkpoint without a viscous body"))?;
        let values = table.block(columns)?;
        // The rows are those of all groups of the material.
        let before = bodies.solids.iter().take_while(|other| !std::ptr::eq(*other, solid));
        let rows = |solid: &SolidElements<D>| solid.group.elements().len() * solid.group.full_points();
        let first: usize = before
            .filter(|other| (other.body, other.material) == (solid.body, solid.material))
            .map(rows)
            .sum();
        let width = columns.len();
        Ok(values[first * width..(first + rows(solid)) * width].to_vec())
    }
}

impl<const D: usize> LocalContact<D> {
    fn changed_law(&self) -> ChangedLaw {
        let regularization = self.law().friction.map(|friction| friction.regularization.numbered());
        ChangedLaw { stiffening: self.stiffening, regularization }
    }

    fn change_law(&mut self, law: &ChangedLaw) {
        self.stiffen(law.stiffening / self.stiffening);
        let regularization =
            law.regularization.and_then(|(number, parameter)| Regularization::from_number(number, parameter));
        if let (Some(friction), Some(regularization)) = (&mut self.law_mut().friction, regularization) {
            friction.regularization = regularization;
        }
    }
}

impl<const D: usize> ContactSystem<D> {
    /// State of the system, except for its fields.
    pub fn state(&self, sources: &mut Sources) -> SystemState {
        SystemState {
            laws: self.contacts.iter().map(LocalContact::changed_law).collect(),
            factor: self.continuation.start_factor,
            orientations: self.bodies.free.orientations(),
            matrix: self.matrix_source.as_ref().map(|source| sources.matrix(source)),
            search: self.search.as_ref().map(|source| sources.search(source)),
            pattern: self.pattern_search.as_ref().map(|source| sources.search(source)),
        }
    }

    /// Restores the pattern of the matrix. Call it before any matrix is assembled. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn resume_pattern(&mut self, state: &SystemState, sources: &Sources) -> Result<()> {
        let pattern = state.pattern.and_then(|number| sources.searches.get(number));
        pattern.map_or(Ok(()), |source| self.rebuild_pattern(source))
    }

    /// Restores matrix, search, laws and contact points of the last accepted step. Call it after
    /// all other matrices have been assembled. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, or the tables are incomplete.
    pub fn resume(&mut self, state: &SystemState, sources: &Sources, tables: &StoredState) -> Result<()> {
        if let Some(source) = state.matrix.and_then(|number| sources.matrices.get(number)) {
            self.assemble_source(source)?;
        }
        if let Some(source) = state.search.and_then(|number| sources.searches.get(number)) {
            self.search_again(source)?;
        }
        self.linearised_at = None;
        self.continuation.start_factor = state.factor;
        self.bodies.free.set_orientations(&state.orientations);
        let names = History::<D>::names();
        for (number, (contact, law)) in self.contacts.iter_mut().zip(&state.laws).enumerate() {
            let columns = tables.contact_block(number, &names)?;
            for (p, point) in columns.chunks_exact(names.len()).enumerate() {
                let history = History::from_columns(point);
                let history = history.ok_or_else(|| Error::internal("a checkpoint with short rows"))?;
                contact.state.resume(p, history);
            }
            contact.state.forget_linear_gaps();
            contact.change_law(law);
            if let Some(compliance) = contact.law().normal.law().linear_compliance() {
                contact.state.resume_multipliers(1.0 / compliance);
            }
            contact.state.note_gaps();
        }
        self.resume_branches(tables)
    }

    /// Restores the branches of viscous bodies.
    fn resume_branches(&mut self, tables: &StoredState) -> Result<()> {
        let mut histories = Vec::new();
        for (solid, body) in self.bodies.viscous_groups() {
            let names = history_names::<D>(body.series.branches().len());
            let values = tables.viscous_block(&self.bodies, body, solid, &names)?;
            let points = solid.group.full_points();
            let mut history = ViscousHistory::zero(&body.series, solid.group.points_of_batches(), D);
            for (row, values) in values.chunks_exact(names.len()).enumerate() {
                history.set(row / points, points, row % points, values);
            }
            histories.push(history);
        }
        self.bodies.resume_viscous(histories);
        Ok(())
    }

    /// Source of a matrix of these `terms` at the trial state.
    pub(super) fn source_of(&self, stage: &Stage, terms: Terms) -> MatrixSource {
        let contact = |contact: &LocalContact<D>| ContactSource {
            law: contact.changed_law(),
            points: contact.state.evaluated_from(),
        };
        let linearised_at = self.linearised_at.as_ref().filter(|_| stage.over_step == OverStep::No);
        let rows = self.bodies.local.index.owned * D;
        MatrixSource {
            terms,
            settings: StageSettings::of(stage, self.continuation, self.split),
            u: stage.trial.u.owned().to_vec(),
            v: stage.trial.v.owned().to_vec(),
            u_start: stage.start.u.owned().to_vec(),
            linearised_at: linearised_at.map(|u| u[..rows].to_vec()),
            orientations: self.bodies.free.orientations(),
            contacts: self.contacts.iter().map(contact).collect(),
            viscous: self.bodies.viscous_sources(),
            search: self.search.clone(),
        }
    }

    /// Assembles the matrix again from its source, and returns the stage at which it was assembled.
    /// The equations, and the state at which the pressure is linearised, stay those of the source.
    pub(super) fn assemble_source(&mut self, source: &Rc<MatrixSource>) -> Result<Stage> {
        if let Some(search) = &source.search {
            self.search_again(search)?;
        }
        for (contact, source) in self.contacts.iter_mut().zip(&source.contacts) {
            contact.change_law(&source.law);
            if !contact.state.evaluate_from(&source.points) {
                return Err(Error::internal("a checkpoint that does not fit the points of a contact"));
            }
        }
        self.bodies.free.set_orientations(&source.orientations);
        self.bodies.use_viscous(source.viscous.as_deref());
        let mut stage = Stage::new(self.pattern_vector(), self.bodies.is_dynamic())?;
        source.settings.apply_to(&mut stage);
        self.continuation = source.settings.continuation;
        self.split = source.settings.split;
        let fields = [
            (&mut stage.trial.u, &source.u),
            (&mut stage.trial.v, &source.v),
            (&mut stage.start.u, &source.u_start),
        ];
        for (field, values) in fields {
            field.owned_mut().copy_from_slice(values);
            field.update_ghosts()?;
        }
        self.linearised_at = match &source.linearised_at {
            None => None,
            Some(values) => {
                self.work.owned_mut().copy_from_slice(values);
                self.work.update_ghosts()?;
                Some(self.work.local().to_vec())
            }
        };
        // The assembly reads what the evaluation of the forces brings and finds.
        self.sweep(&stage, Branches::Actual);
        self.assemble(&stage, source.terms, MatrixTarget::Own, None)?;
        self.matrix_source = Some(Rc::clone(source));
        Ok(stage)
    }
}

/// Tables of these fields, of the sources, and of the history of the contact points that this
/// rank reports.
pub fn state_tables<const D: usize>(
    system: &ContactSystem<D>,
    fields: NamedFields,
    sources: &Sources,
) -> Vec<StoredTable> {
    let nodes = system.bodies.local.index.owned;
    let mut blocks: Vec<(Vec<String>, Vec<f64>)> = Vec::new();
    let mut add = |name: &str, field: Vec<f64>| blocks.push((axes(name, D), field));
    fields.into_iter().for_each(|(name, field)| add(&name, field));
    for (k, source) in sources.matrices.iter().enumerate() {
        add(&of_matrix(k, "u"), source.u.clone());
        add(&of_matrix(k, "v"), source.v.clone());
        add(&of_matrix(k, "u_start"), source.u_start.clone());
        if let Some(u) = &source.linearised_at {
            add(&of_matrix(k, "linearised_at"), u.clone());
        }
    }
    for (k, source) in sources.searches.iter().enumerate().filter(|(_, search)| !search.undeformed) {
        add(&of_search(k, "u"), source.u.clone());
        if source.over_step == OverStep::Middle {
            add(&of_search(k, "u_start"), source.u_start.clone());
        }
    }
    for (k, marks) in sources.marks.iter().enumerate() {
        let mut field: Vec<f64> = marks.iter().map(|mark| f64::from(u8::from(*mark))).collect();
        field.resize(nodes, 0.0);
        blocks.push((vec![of_marks(k)], field));
    }
    let mut tables = vec![StoredTable::of_blocks("nodes", node_keys(&system.bodies), NODES, &blocks)];
    for (number, contact) in system.contacts.iter().enumerate() {
        let mut columns = Vec::new();
        contact.state.history.iter().for_each(|history| history.columns(&mut columns));
        let mut blocks = vec![(History::<D>::names(), columns)];
        for (k, source) in sources.matrices.iter().enumerate() {
            blocks.push((point_names::<D>(k), source.contacts[number].points.clone()));
        }
        let keys = point_keys(&system.bodies, contact);
        tables.push(StoredTable::of_blocks(&table_of(contact), keys, NODES * PARTS, &blocks));
    }
    tables.extend(system.bodies.viscous.iter().map(|body| branch_table(system, body, sources)));
    tables
}

/// Table of the branches of a body, and of the stress of kept matrices.
fn branch_table<const D: usize>(
    system: &ContactSystem<D>,
    body: &ViscousBody,
    sources: &Sources,
) -> StoredTable {
    let bodies = &system.bodies;
    let own =
        |solid: &SolidElements<D>, index: usize| bodies.local.mine[solid.group.elements()[index] as usize];
    let mut histories = Vec::new();
    let mut stresses: Vec<Vec<f64>> = vec![Vec::new(); sources.matrices.len()];
    let width = components(D);
    for (number, (solid, _)) in
        bodies.viscous_groups().enumerate().filter(|(_, (_, other))| other.number == body.number)
    {
        let points = solid.group.full_points();
        let history = solid.viscous.as_ref().and_then(|viscous| viscous.history());
        for index in (0..solid.group.elements().len()).filter(|&index| own(solid, index)) {
            for point in 0..points {
                histories.extend(history.iter().flat_map(|history| history.at(index, points, point)));
                for (source, values) in sources.matrices.iter().zip(&mut stresses) {
                    let first = (index / WIDTH * points + point) * width;
                    let stress = source
                        .viscous
                        .iter()
                        .flat_map(|groups| &groups[number].predicted[first..first + width]);
                    values.extend(stress.map(|pack| pack[index % WIDTH]));
                }
            }
        }
    }
    let mut blocks = vec![(history_names::<D>(body.series.branches().len()), histories)];
    for (k, values) in
        stresses.into_iter().enumerate().filter(|(k, _)| sources.matrices[*k].viscous.is_some())
    {
        blocks.push((stress_names::<D>(k), values));
    }
    StoredTable::of_blocks(&body.table(), element_keys(bodies, body, own), NODES, &blocks)
}

/// Keys of the points of a body's elements on this rank that are `wanted`.
fn element_keys<const D: usize>(
    bodies: &Bodies<D>,
    body: &ViscousBody,
    wanted: impl Fn(&SolidElements<D>, usize) -> bool,
) -> Vec<u64> {
    let mut keys = Vec::new();
    for (solid, _) in bodies.viscous_groups().filter(|(_, other)| other.number == body.number) {
        for (index, &element) in solid.group.elements().iter().enumerate() {
            if wanted(solid, index) {
                let first = POINTS * u64::from(bodies.local.input_element[element as usize]);
                keys.extend((0..solid.group.full_points() as u64).map(|point| first + point));
            }
        }
    }
    keys
}

/// Values of all points of a group, element by element, in lanes.
fn packed<const D: usize>(solid: &SolidElements<D>, values: &[f64]) -> Vec<[f64; WIDTH]> {
    let points = solid.group.full_points();
    let width = components(D);
    let mut out = vec![[0.0; WIDTH]; solid.group.points_of_batches() * width];
    for (row, values) in values.chunks_exact(width).enumerate() {
        let (index, point) = (row / points, row % points);
        let first = (index / WIDTH * points + point) * width;
        for (pack, value) in out[first..first + width].iter_mut().zip(values) {
            pack[index % WIDTH] = *value;
        }
    }
    out
}

/// Names of the components of the tensors of a history.
fn history_names<const D: usize>(branches: usize) -> Vec<String> {
    let tensors =
        std::iter::once("isochoric".to_owned()).chain((1..=branches).map(|k| format!("branch {k}")));
    tensors.flat_map(|name| tensor_names::<D>(&name)).collect()
}

/// Names of the components of the stress of a kept matrix.
fn stress_names<const D: usize>(number: usize) -> Vec<String> {
    tensor_names::<D>(&of_matrix(number, "viscous"))
}

fn tensor_names<const D: usize>(name: &str) -> Vec<String> {
    let components = ["xx", "yy", "zz", "xy", "yz", "xz"].iter().take(components(D));
    components.map(|component| format!("{name}_{component}")).collect()
}

fn node_keys<const D: usize>(bodies: &Bodies<D>) -> Vec<u64> {
    let nodes = bodies.local.input_node[..bodies.local.index.owned].iter();
    nodes.map(|&node| u64::from(node)).collect()
}

/// Keys of the vertices of a contact: number of the node, and the part of the surface around it.
fn point_keys<const D: usize>(bodies: &Bodies<D>, contact: &LocalContact<D>) -> Vec<u64> {
    let key = |(&node, &part): (&u32, &u32)| {
        PARTS * u64::from(bodies.local.input_node[node as usize]) + u64::from(part)
    };
    contact.vertices().iter().zip(contact.parts()).map(key).collect()
}

/// Depths of the contacts on a rank. On another number of ranks they are the largest ones.
fn depths(of_ranks: &[Vec<u64>], rank: usize, ranks: usize) -> Vec<f64> {
    let value = |bits: &u64| f64::from_bits(*bits);
    if of_ranks.len() == ranks {
        return of_ranks[rank].iter().map(value).collect();
    }
    let contacts = of_ranks.first().map_or(0, Vec::len);
    let deepest = |contact: usize| of_ranks.iter().map(|own| value(&own[contact])).fold(0.0, f64::max);
    (0..contacts).map(deepest).collect()
}

fn table_of<const D: usize>(contact: &LocalContact<D>) -> String {
    format!("contact {}", contact.name)
}

fn point_names<const D: usize>(number: usize) -> Vec<String> {
    ContactState::<D>::evaluation_names().iter().map(|name| of_matrix(number, name)).collect()
}

fn of_matrix(number: usize, name: &str) -> String {
    format!("matrix {number} {name}")
}

fn of_search(number: usize, name: &str) -> String {
    format!("search {number} {name}")
}

fn of_marks(number: usize) -> String {
    format!("marks {number}")
}

fn axes(name: &str, dimension: usize) -> Vec<String> {
    ["x", "y", "z"].iter().take(dimension).map(|axis| format!("{name}_{axis}")).collect()
}
