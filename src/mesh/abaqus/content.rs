//! Reading of the keywords that describe a mesh, in the order of the file.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use super::lines::{self, Card, Deck, Item};
use super::names::{Names, Scope, without_instance};
use super::types::{self, Class};
use crate::error::{Result, shown};
use crate::mesh::numbering::{FileNumbers, MAX_NODES};
use crate::mesh::{ElementKind, PlaneState};

/// Index of an element that is not solid.
pub(super) const LEFT_OUT: u32 = u32::MAX;

/// Cure for input that refers to more than one part or to a moved one.
const FLAT: &str = "write the input without parts (in Abaqus/CAE: `mdb.models['Model-1'].setValues(\
                    noPartsInputFile=ON)`), or each part to its own file";

/// What the members of a set are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SetContent {
    Nodes,
    Elements,
}

/// Content of a file, with the numbers used in the file.
#[derive(Default)]
pub(super) struct Content {
    /// State of plane elements.
    plane: PlaneState,
    pub nodes: FileNumbers,
    pub points: Vec<[f64; 3]>,
    pub node_places: Vec<usize>,
    /// All elements, also those that are not solid.
    pub elements: FileNumbers,
    /// Index of the solid element, or [`LEFT_OUT`].
    pub solid: Vec<u32>,
    pub solids: Vec<SolidElement>,
    /// Node numbers of all solid elements.
    pub element_nodes: Vec<u64>,
    pub node_sets: Names,
    pub element_sets: Names,
    pub surfaces: Names,
    /// Parts of sets, in the order of the file.
    pub parts: Vec<SetPart>,
    pub listed: Vec<u64>,
    /// Location of each line of `listed`, with the index of its first number.
    pub listed_lines: Vec<(usize, usize)>,
    pub ranges: Vec<NumberRange>,
    /// Sets that are members of other sets.
    pub members: Vec<u32>,
    pub faces: Vec<SurfaceLine>,
    /// Kinds of the types whose formulation differs.
    pub variants: BTreeMap<String, ElementKind>,
    /// Numbers of elements of each type that is left out.
    pub left_out: BTreeMap<String, usize>,
    /// Keywords that are not about the mesh.
    pub skipped: Vec<String>,
    skipped_before: HashSet<String>,
    instance: Option<String>,
    /// Number of the current part or instance; zero outside of all.
    part: usize,
    /// Number of the part or instance that has the mesh.
    meshed_part: Option<usize>,
    scope: Scope,
}

/// A solid element.
pub(super) struct SolidElement {
    pub id: u64,
    pub kind: ElementKind,
    /// Index of its first node in [`Content::element_nodes`].
    pub first: usize,
    pub place: usize,
}

/// Part of a set.
pub(super) struct SetPart {
    pub target: SetContent,
    pub set: u32,
    pub what: PartMembers,
    /// Location of its last line.
    pub place: usize,
}

/// Members of a part of a set.
pub(super) enum PartMembers {
    /// Nodes or elements by their index in the file.
    Block(Range<u32>),
    /// Numbers, ranges of numbers, and names of sets.
    Listed { numbers: Range<usize>, ranges: Range<usize>, sets: Range<usize> },
    /// The nodes of a set of elements.
    NodesOf(u32),
}

/// Numbers `first`, `first + step`, ... up to `last`.
pub(super) struct NumberRange {
    pub first: u64,
    pub last: u64,
    pub step: u64,
    pub place: usize,
}

/// A line of an element surface or node surface.
pub(super) struct SurfaceLine {
    pub surface: u32,
    pub member: SetMember,
    pub kind: FaceKind,
    pub place: usize,
    pub scope: Scope,
}

/// A number, or the name of a set.
pub(super) enum SetMember {
    Number(u64),
    Set(String),
}

/// Which facets of the elements belong to a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FaceKind {
    /// Face `S1`, `S2`, ...
    Number(usize),
    /// All faces on the boundary of the body.
    Free,
    /// The surface consists of nodes.
    Nodes,
}

/// What the lines of data mean.
enum Block {
    Skipped,
    Nodes(Option<u32>, u32),
    Elements(ElementBlock),
    Set(SetBlock),
    Surface(u32, SurfaceKind),
    /// Position of an instance.
    Instance,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum SurfaceKind {
    Elements,
    Nodes,
}

struct ElementBlock {
    set: Option<u32>,
    begin: u32,
    /// Type in the file.
    name: String,
    /// `None` if the elements are left out.
    kind: Option<ElementKind>,
    /// Number of nodes that the last element still needs.
    missing: usize,
    /// Whether the next line continues an element that is left out.
    continues: bool,
}

struct SetBlock {
    target: SetContent,
    set: u32,
    form: SetForm,
    numbers: usize,
    ranges: usize,
    members: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum SetForm {
    List,
    Generate,
    /// Numbers are those of nodes and elements of the assembly, which are left out.
    NamesOnly,
}

/// Reads a file for a mesh of dimension `dimension`, whose plane elements must be of the state `plane`.
pub(super) fn read(deck: &mut Deck, dimension: usize, plane: PlaneState) -> Result<Content> {
    let mut content = Content { plane, ..Content::default() };
    let mut block = Block::Skipped;
    loop {
        match deck.next(!matches!(block, Block::Skipped))? {
            Item::Keyword(card) if card.name == "INCLUDE" => deck.include(&card)?,
            Item::Keyword(card) => {
                content.finish(deck, &block)?;
                block = content.begin(deck, &card, dimension)?;
            }
            Item::Data => content.data(deck, &mut block)?,
            Item::End => {
                content.finish(deck, &block)?;
                return Ok(content);
            }
        }
    }
}

impl Content {
    /// The instance, if there is one.
    pub fn instance(&self) -> Option<&str> {
        self.instance.as_deref()
    }

    /// Begins the block of a keyword.
    fn begin(&mut self, deck: &Deck, card: &Card, dimension: usize) -> Result<Block> {
        let refused = |message: &str, cure: &str| {
            Err(deck.error_at(card.place, format!("*{}: {message}", shown(&card.name))).hint(cure))
        };
        let of_mesh = ["NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"].contains(&card.name.as_str());
        if of_mesh && card.has("INPUT") {
            return refused("data in another file is not read", "use `*INCLUDE, INPUT=...` in its place");
        }
        if card.name == "NODE" || card.name == "ELEMENT" {
            if self.scope == Scope::Assembly {
                // Reference points, and springs between them, have numbers of their own.
                self.skip(&format!("{} of the assembly", card.name));
                return Ok(Block::Skipped);
            }
            if *self.meshed_part.get_or_insert(self.part) != self.part {
                return refused("the file has a mesh in more than one part", FLAT);
            }
        }
        match card.name.as_str() {
            "NODE" => {
                if card.value("SYSTEM").is_some_and(|system| !system.eq_ignore_ascii_case("R")) {
                    return refused("cylindrical and spherical coordinates are not read", CARTESIAN);
                }
                let set = match card.has("NSET") {
                    true => Some(self.named(deck, card, "NSET", SetContent::Nodes)?),
                    false => None,
                };
                return Ok(Block::Nodes(set, self.points.len() as u32));
            }
            "ELEMENT" => return self.element_block(deck, card, dimension).map(Block::Elements),
            "NSET" => return self.set_block(deck, card, SetContent::Nodes).map(Block::Set),
            "ELSET" => return self.set_block(deck, card, SetContent::Elements).map(Block::Set),
            "SURFACE" => return self.surface_block(deck, card),
            "PART" => self.part += 1,
            "INSTANCE" => {
                if self.instance.is_some() {
                    return refused("the file has more than one instance", FLAT);
                }
                self.instance = Some(card.value("NAME").unwrap_or_default().to_owned());
                self.part += usize::from(self.meshed_part.is_none());
                self.scope = Scope::Part;
                return Ok(Block::Instance);
            }
            "ASSEMBLY" | "END INSTANCE" => self.scope = Scope::Assembly,
            "END ASSEMBLY" => self.scope = Scope::Part,
            "END PART" | "END STEP" | "HEADING" => {}
            "SYSTEM" => return refused("nodes in a local system are not read", CARTESIAN),
            "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" => {
                return refused("a mesh that keywords generate is not read", GENERATED);
            }
            other => self.skip(other),
        }
        Ok(Block::Skipped)
    }

    /// Notes that a keyword is skipped.
    fn skip(&mut self, name: &str) {
        if self.skipped_before.insert(name.to_owned()) {
            self.skipped.push(name.to_owned());
        }
    }

    /// The set that a parameter names.
    fn named(&mut self, deck: &Deck, card: &Card, parameter: &str, target: SetContent) -> Result<u32> {
        let name = card.value(parameter).filter(|name| !name.is_empty()).ok_or_else(|| {
            let message = format!("*{} has no name: {parameter}=... is missing", card.name);
            deck.error_at(card.place, message)
        })?;
        let sets = match target {
            SetContent::Nodes => &mut self.node_sets,
            SetContent::Elements => &mut self.element_sets,
        };
        Ok(sets.declare(name, self.scope, card.has("INTERNAL")))
    }

    fn element_block(&mut self, deck: &Deck, card: &Card, dimension: usize) -> Result<ElementBlock> {
        let name = card.value("TYPE").unwrap_or_default().to_uppercase();
        let refused = |message: String| deck.error_at(card.place, format!("*ELEMENT: {message}"));
        let is = |what: &str| format!("the elements of type {} are {what}", shown(&name));
        let kind = match types::classify(&name, self.plane) {
            _ if name.is_empty() => return Err(refused("the type of the elements is missing".to_owned())),
            Class::Solid { kind, is_variant } if kind.dimension() == dimension => {
                if is_variant {
                    self.variants.insert(name.clone(), kind);
                }
                Some(kind)
            }
            Class::Solid { kind, .. } if kind.dimension() > dimension => {
                let cure = "set `dimension: 3` in the case, or give a plane mesh";
                return Err(refused(is("solid, but the case has dimension 2")).hint(cure));
            }
            Class::Plane(what) if dimension == 2 => {
                let cure = match (self.plane, what) {
                    (_, "axisymmetry") => {
                        "write `dimension: axisymmetric` in the case; if a plane body is meant, rename the type \
                         to CPE3, CPE4, CPE6 or CPE8 in the file"
                    }
                    (PlaneState::Axisymmetric, _) => {
                        "the case has `dimension: axisymmetric`; if that is meant, rename the type to CAX3, CAX4, \
                         CAX6 or CAX8 in the file"
                    }
                    (PlaneState::Strain, "plane stress") => {
                        "write `plane: stress` in the case; if plane strain is meant, rename the type to CPE3, \
                         CPE4, CPE6 or CPE8 in the file"
                    }
                    (PlaneState::Strain, _) => {
                        "a case of dimension 2 is plane strain; if that is meant, rename the type to CPE3, CPE4, \
                         CPE6 or CPE8 in the file"
                    }
                    (PlaneState::Stress, _) => {
                        "the case has `plane: stress`; if that is meant, rename the type to CPS3, CPS4, CPS6 or \
                         CPS8 in the file"
                    }
                };
                return Err(refused(is(&format!("{what}, not {}", self.plane.name()))).hint(cure));
            }
            Class::Unknown(what) => {
                let known = format!("known: {}, with the suffixes R, H, I, M, S and T", types::known());
                return Err(refused(format!("unknown type {}{what}", shown(&name))).hint(&known));
            }
            Class::Solid { .. } | Class::Plane(_) | Class::Other => None,
        };
        let set = match card.has("ELSET") {
            true => Some(self.named(deck, card, "ELSET", SetContent::Elements)?),
            false => None,
        };
        let begin = self.solid.len() as u32;
        Ok(ElementBlock { set, begin, name, kind, missing: 0, continues: false })
    }

    fn set_block(&mut self, deck: &Deck, card: &Card, target: SetContent) -> Result<SetBlock> {
        let set = self.named(deck, card, &card.name, target)?;
        let form = match () {
            () if self.scope == Scope::Assembly && !card.has("INSTANCE") => SetForm::NamesOnly,
            () if card.has("GENERATE") => SetForm::Generate,
            () => SetForm::List,
        };
        if let (SetContent::Nodes, Some(elements)) = (target, card.value("ELSET")) {
            let elements = self.member(deck, elements, SetContent::Elements)?;
            self.parts.push(SetPart { target, set, what: PartMembers::NodesOf(elements), place: card.place });
        }
        Ok(SetBlock {
            target,
            set,
            form,
            numbers: self.listed.len(),
            ranges: self.ranges.len(),
            members: self.members.len(),
        })
    }

    fn surface_block(&mut self, deck: &Deck, card: &Card) -> Result<Block> {
        let name = card
            .value("NAME")
            .filter(|name| !name.is_empty())
            .ok_or_else(|| deck.error_at(card.place, "*SURFACE has no name: NAME=... is missing"))?;
        let kind = card.value("TYPE").unwrap_or("ELEMENT").to_uppercase();
        if card.has("COMBINE") {
            let message =
                format!("*SURFACE: '{}' is a combination of surfaces, which is not read", shown(name));
            let cure = "combine the surfaces in the case: sets of the body, or a list of sets";
            return Err(deck.error_at(card.place, message).hint(cure));
        }
        let kind = match kind.as_str() {
            "ELEMENT" => SurfaceKind::Elements,
            "NODE" => SurfaceKind::Nodes,
            other => {
                // Analytical and Eulerian surfaces.
                self.skip(&format!("SURFACE, TYPE={}", shown(other)));
                return Ok(Block::Skipped);
            }
        };
        Ok(Block::Surface(self.surfaces.declare(name, self.scope, card.has("INTERNAL")), kind))
    }

    /// A set that is a member of another one, or gives its nodes.
    fn member(&self, deck: &Deck, field: &str, target: SetContent) -> Result<u32> {
        let sets = match target {
            SetContent::Nodes => &self.node_sets,
            SetContent::Elements => &self.element_sets,
        };
        sets.find(field, self.scope, self.instance()).ok_or_else(|| {
            let of = if target == SetContent::Nodes { "node" } else { "element" };
            let message = format!("there is no {of} set '{}' above this line", shown(lines::name(field)));
            let cure = format!("define a set before the sets that contain it; {}", sets.cure());
            deck.error(message).hint(&cure)
        })
    }

    /// Reads a line of data.
    fn data(&mut self, deck: &Deck, block: &mut Block) -> Result<()> {
        match block {
            Block::Skipped => Ok(()),
            Block::Nodes(..) => self.node(deck),
            Block::Elements(block) => self.element(deck, block),
            Block::Set(block) if block.form == SetForm::Generate => self.range(deck),
            Block::Set(block) => self.set_line(deck, block),
            Block::Surface(surface, kind) => self.surface_line(deck, *surface, *kind),
            Block::Instance => {
                let moved = fields(deck.data()).any(|field| real(field).is_none_or(|number| number != 0.0));
                let error = || deck.error("*INSTANCE: the instance is moved or rotated").hint(FLAT);
                if moved { Err(error()) } else { Ok(()) }
            }
        }
    }

    fn node(&mut self, deck: &Deck) -> Result<()> {
        let mut fields = fields(deck.data());
        let id = number(deck, fields.next().unwrap_or_default(), "a node number")?;
        let mut point = [0.0; 3];
        for (x, axis) in point.iter_mut().zip(["x", "y", "z"]) {
            let field = match fields.next() {
                None | Some("") => continue,
                Some(field) => field,
            };
            *x = real(field).filter(|x| x.is_finite()).ok_or_else(|| {
                deck.error(format!("node {id}: {axis} is '{}', not a finite number", shown(field)))
            })?;
        }
        // Three direction cosines of a normal may follow.
        if fields.nth(3).is_some_and(|field| !field.is_empty()) {
            return Err(deck.error(format!("node {id} has too many numbers")));
        }
        if self.points.len() >= MAX_NODES {
            return Err(deck.error(format!("the mesh has more than {MAX_NODES} nodes")));
        }
        if let Some(first) = self.nodes.index(id) {
            let first = self.node_places.get(first as usize).map(|&place| deck.segments.line(place));
            let message = format!("node {id} is defined twice, first in line {}", first.unwrap_or_default());
            return Err(deck.error(message).hint("give each node a number of its own"));
        }
        self.nodes.push(id);
        self.points.push(point);
        self.node_places.push(deck.place());
        Ok(())
    }

    fn element(&mut self, deck: &Deck, block: &mut ElementBlock) -> Result<()> {
        let line = deck.data();
        let mut fields = fields(line);
        if block.missing == 0 && !block.continues {
            let id = number(deck, fields.next().unwrap_or_default(), "an element number")?;
            if self.elements.index(id).is_some() {
                let cure = "give each element a number of its own";
                return Err(deck.error(format!("element {id} is defined twice")).hint(cure));
            }
            self.elements.push(id);
            self.solid.push(match block.kind {
                None => LEFT_OUT,
                Some(kind) => {
                    block.missing = kind.nodes();
                    let first = self.element_nodes.len();
                    self.solids.push(SolidElement { id, kind, first, place: deck.place() });
                    (self.solids.len() - 1) as u32
                }
            });
            if block.kind.is_none() {
                *self.left_out.entry(block.name.clone()).or_default() += 1;
            }
        }
        let continues = line.ends_with(',');
        let Some(kind) = block.kind else {
            block.continues = continues;
            return Ok(());
        };
        let id = self.solids.last().map_or(0, |solid| solid.id);
        let wrong = |few_or_many: &str| {
            let nodes = kind.nodes();
            let message =
                format!("element {id} has too {few_or_many} nodes: {} has {nodes}", shown(&block.name));
            deck.error(message).hint("a comma at the end of a line continues an element on the next line")
        };
        for field in fields.filter(|field| !field.is_empty()) {
            if block.missing == 0 {
                return Err(wrong("many"));
            }
            self.element_nodes.push(number(deck, field, "a node number")?);
            block.missing -= 1;
        }
        if block.missing > 0 && !continues { Err(wrong("few")) } else { Ok(()) }
    }

    fn set_line(&mut self, deck: &Deck, block: &SetBlock) -> Result<()> {
        let lists_numbers = block.form == SetForm::List;
        if lists_numbers {
            self.listed_lines.push((self.listed.len(), deck.place()));
        }
        for field in fields(deck.data()).filter(|field| !field.is_empty()) {
            match self.member_number(field) {
                Some(id) if lists_numbers => self.listed.push(id),
                Some(_) => {}
                None => self.members.push(self.member(deck, field, block.target)?),
            }
        }
        Ok(())
    }

    /// A number, which the instance may precede.
    fn member_number(&self, field: &str) -> Option<u64> {
        field.parse().ok().or_else(|| without_instance(&lines::key(field), self.instance())?.parse().ok())
    }

    fn range(&mut self, deck: &Deck) -> Result<()> {
        let mut fields = fields(deck.data());
        let first = number(deck, fields.next().unwrap_or_default(), "the first number of a range")?;
        let last = match fields.next() {
            None | Some("") => first,
            Some(field) => number(deck, field, "the last number of a range")?,
        };
        let step = match fields.next() {
            None | Some("") => 1,
            // Programs write it for ranges of one number.
            Some("0") if first == last => 1,
            Some(field) => number(deck, field, "the step of a range")?,
        };
        if last < first || step == 0 || fields.any(|field| !field.is_empty()) {
            return Err(deck.error("expected a range: first, last, step").hint("for example 1, 100, 1"));
        }
        self.ranges.push(NumberRange { first, last, step, place: deck.place() });
        Ok(())
    }

    fn surface_line(&mut self, deck: &Deck, surface: u32, kind: SurfaceKind) -> Result<()> {
        let mut fields = fields(deck.data());
        let field = fields.next().unwrap_or_default();
        let label = fields.next().unwrap_or_default();
        let face = match (kind, label) {
            (SurfaceKind::Nodes, _) => FaceKind::Nodes,
            (SurfaceKind::Elements, "") => FaceKind::Free,
            (SurfaceKind::Elements, _) => {
                let face = label.strip_prefix(['S', 's']).and_then(|face| face.parse().ok());
                let expected = format!("expected a face S1 to S6, found '{}'", shown(label));
                FaceKind::Number(face.ok_or_else(|| deck.error(expected))?)
            }
        };
        let member = match self.member_number(field) {
            Some(_) if self.scope == Scope::Assembly && !field.contains('.') => {
                let cure = "name a set, or write `instance.number`";
                return Err(deck.error("a number in a surface of the assembly").hint(cure));
            }
            Some(id) => SetMember::Number(id),
            None if field.is_empty() => return Err(deck.error("expected a set or a number, found nothing")),
            None => SetMember::Set(field.to_owned()),
        };
        self.faces.push(SurfaceLine { surface, member, kind: face, place: deck.place(), scope: self.scope });
        Ok(())
    }

    /// Ends a block.
    fn finish(&mut self, deck: &Deck, block: &Block) -> Result<()> {
        let place = deck.place();
        match block {
            Block::Nodes(Some(set), begin) => {
                let what = PartMembers::Block(*begin..self.points.len() as u32);
                self.parts.push(SetPart { target: SetContent::Nodes, set: *set, what, place });
            }
            Block::Elements(block) => {
                if block.missing > 0 {
                    let solid = self.solids.last();
                    let (id, place) = solid.map_or((0, place), |solid| (solid.id, solid.place));
                    let message = format!("element {id} lacks {} of its nodes", block.missing);
                    return Err(deck.error_at(place, message).hint("save or copy the mesh again"));
                }
                if let Some(set) = block.set {
                    let what = PartMembers::Block(block.begin..self.solid.len() as u32);
                    self.parts.push(SetPart { target: SetContent::Elements, set, what, place });
                }
            }
            Block::Set(block) => {
                let what = PartMembers::Listed {
                    numbers: block.numbers..self.listed.len(),
                    ranges: block.ranges..self.ranges.len(),
                    sets: block.members..self.members.len(),
                };
                self.parts.push(SetPart { target: block.target, set: block.set, what, place });
            }
            Block::Skipped | Block::Nodes(None, _) | Block::Surface(..) | Block::Instance => {}
        }
        Ok(())
    }
}

const CARTESIAN: &str = "write the nodes in the global Cartesian system";
const GENERATED: &str = "write all nodes and elements out; a preprocessor does when it exports the mesh";

/// The fields of a line of data.
fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(str::trim)
}

fn number(deck: &Deck, field: &str, what: &str) -> Result<u64> {
    let error = || deck.error(format!("expected {what}, found '{}'", shown(field)));
    field.parse().map_err(|_| error().hint("numbers are separated by commas, and are positive integers"))
}

/// A number as Fortran writes it: the exponent may begin with D.
fn real(field: &str) -> Option<f64> {
    field.parse().ok().or_else(|| field.replace(['d', 'D'], "e").parse().ok())
}
