//! Checks that need no mesh: ranges, names, dimensions, options that exclude each other.

mod accuracy;
mod axisymmetric;
mod body;
mod boundary;
mod contact;
mod rigid;
mod run;
mod tied;

use super::{At, Case, Mesh, SpaceDimension};
use crate::reader::complaint::Complaint;
use crate::reader::findings::Findings;
use crate::reader::function::{Function, Varying};

/// All that is wrong with the case, in no particular order.
pub(super) fn complaints(case: &Case) -> Vec<Complaint> {
    let At { value: dimension, place } = case.dimension;
    let known = dimension.is_known().then_some(dimension.coordinates() as usize);
    let mut check = Check { case, dimension: known, found: Findings::new(case.units) };
    let number = dimension.coordinates();
    let message = format!("the dimension is 2, 3 or axisymmetric, not {number}");
    check.found.require(known.is_some(), place, message);
    check.plane();
    check.axisymmetric();
    check.names();
    case.parameters.check(&mut check.found);
    for (name, body) in case.bodies.iter() {
        check.body(name, body);
    }
    case.obstacles.values().for_each(|obstacle| check.obstacle(obstacle));
    case.rigid.iter().for_each(|(name, body)| check.rigid(name, body));
    case.contact.iter().for_each(|(_, contact)| check.contact(contact));
    case.tied.iter().for_each(|(name, tied)| check.tied(name, tied));
    check.pairs();
    case.boundary.iter().for_each(|(name, boundary)| check.boundary(name, boundary));
    check.doubly_prescribed();
    check.time();
    check.start();
    check.solver();
    check.accuracy();
    check.guard();
    check.output();
    check.found.into_complaints()
}

struct Check<'a> {
    case: &'a Case,
    /// Nothing where it is neither 2 nor 3: what depends on it is then not checked.
    dimension: Option<usize>,
    found: Findings,
}

impl Check<'_> {
    fn at_least_one(&mut self, what: &str, value: &At<u32>) {
        self.found.require(value.value >= 1, value.place, format!("{what} must be >= 1, found 0"));
    }

    fn size<T>(&mut self, what: &str, list: &At<Vec<T>>) {
        let Some(wanted) = self.dimension else { return };
        self.found.entries(what, list, wanted);
    }

    fn plane(&mut self) {
        let Some(plane) = &self.case.plane else { return };
        let dimension = match self.case.dimension.value {
            SpaceDimension::Number(3) => "3",
            SpaceDimension::Axisymmetric => "axisymmetric",
            SpaceDimension::Number(_) => return,
        };
        self.found.say(plane.place, format!("`plane` is for 2D, but `dimension` is {dimension}"));
        self.found.cure("remove it, or set `dimension: 2`");
    }

    fn names(&mut self) {
        let case = self.case;
        if case.bodies.is_empty() {
            self.found.say(case.bodies.place, "a case needs at least one body");
        }
        let mut all: Vec<(&str, &At<String>)> = Vec::new();
        all.extend(case.bodies.iter().map(|(name, _)| ("bodies", name)));
        all.extend(case.bodies.values().flat_map(|body| body.sets.iter().map(|(name, _)| ("sets", name))));
        all.extend(case.obstacles.iter().map(|(name, _)| ("obstacles", name)));
        all.extend(case.rigid.iter().map(|(name, _)| ("rigid", name)));
        all.extend(case.contact.iter().map(|(name, _)| ("contact", name)));
        all.extend(case.tied.iter().map(|(name, _)| ("tied", name)));
        all.extend(case.boundary.iter().map(|(name, _)| ("boundary", name)));
        all.extend(case.output.probes.iter().map(|(name, _)| ("probes", name)));
        all.extend(case.output.derived.iter().map(|(name, _)| ("derived", name)));
        for (block, name) in all {
            let fits = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || !name.chars().all(fits) {
                self.found.say(name.place, format!("'{}' is not a valid name in `{block}`", name.value));
                self.found.cure("names consist of letters, digits, '_' and '-'");
            }
        }
        for (name, _) in
            case.output.derived.iter().filter(|(name, _)| ["step", "time"].contains(&name.as_str()))
        {
            self.found.say(name.place, format!("'{}' is a column of every table", name.value));
            self.found.cure("choose another name");
        }
        let places = case.bodies.iter().map(|(name, _)| name).chain(case.shapes().map(|(name, _)| name));
        for name in places.filter(|name| name.value == super::ALL) {
            self.found.say(name.place, "the name `all` is reserved for the whole surface of all bodies");
            self.found.cure("choose another name");
        }
        for (name, _) in case.obstacles.iter().filter(|(name, _)| case.bodies.get(name).is_some()) {
            self.found.say(name.place, format!("'{}' names both a body and an obstacle", name.value));
        }
        for (name, _) in case.rigid.iter() {
            let other = match (case.bodies.get(name), case.obstacles.get(name)) {
                (Some(_), _) => "a body",
                (None, Some(_)) => "an obstacle",
                (None, None) => continue,
            };
            self.found.say(name.place, format!("'{}' names both a rigid body and {other}", name.value));
            self.found.cure("choose another name");
        }
        for (name, _) in case.petsc.iter() {
            let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || name.starts_with('-') || !name.chars().all(fits) {
                self.found.say(name.place, format!("'{}' is not a valid PETSc option", name.value));
                self.found.cure("write the name without the leading dash, for example ksp_monitor");
            }
        }
    }

    /// Whether `body` or `body.set` names a body that exists, and a set that can exist; says so where not.
    fn body_of(&mut self, on: &At<String>) -> bool {
        let (name, set) = on.split_once('.').map_or((on.as_str(), None), |(name, set)| (name, Some(set)));
        let Some(body) = self.case.bodies.get(name) else {
            let complaint = if self.case.obstacles.get(name).is_some() {
                Complaint::new(format!("expected a body, but '{name}' is an obstacle"))
            } else if self.case.rigid.get(name).is_some() {
                Complaint::new(format!("expected a deformable body, but '{name}' is a rigid body"))
                    .hint("a rigid body moves by `rigid: NAME: motion`")
            } else {
                Complaint::unknown("body", name, self.case.bodies.names())
            };
            self.found.push(complaint.at(on.place));
            return false;
        };
        let Some(set) = set else { return true };
        let sets = ["left", "right", "bottom", "top", "front", "back"];
        let sets = &sets[..2 * self.dimension.unwrap_or(3)];
        let known = || sets.iter().copied().chain(body.sets.names());
        if matches!(body.mesh, Mesh::Box(_)) && !known().any(|name| name == set) {
            let mut complaint = Complaint::unknown("set", set, known()).at(on.place);
            complaint.message = format!("the box '{name}' has no set '{set}'");
            self.found.push(complaint);
        }
        true
    }

    /// A function of time alone can be tried: it must be finite at the start and at the end.
    fn finite<const KG: i8, const M: i8, const S: i8>(&mut self, varying: &Varying<KG, M, S>) {
        let function: &Function = varying;
        if !function.is_constant_in_space() {
            return;
        }
        for t in [0.0, self.case.time.end.value] {
            let motion = function.motion([0.0; 3], t);
            if let Some(words) = motion.trouble() {
                self.found.say(varying.place, format!("{words} at t = {t}"));
                return;
            }
        }
    }
}
