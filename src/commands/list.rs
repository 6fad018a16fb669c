//! `contact-petsc list`: the names that a case can use, taken from the tables of the implemented
//! laws.

use crate::case::LEVELS;
use crate::contact::damping::NORMAL_DAMPINGS;
use crate::contact::friction::FRICTION_LAWS;
use crate::contact::friction::coefficient::COEFFICIENTS;
use crate::contact::friction::regularization::REGULARIZATIONS;
use crate::contact::normal::NORMAL_LAWS;
use crate::contact::obstacle::OBSTACLES;
use crate::element::Locking;
use crate::material::MATERIALS;
use crate::mesh::ElementKind;
use crate::schemes::SCHEMES;
use crate::solvers::{PRESETS, STRATEGIES};

/// A heading, the key of the case file to which the names belong, and the names with a sentence
/// each.
type Group = (&'static str, &'static str, Vec<(&'static str, String)>);

fn groups() -> Vec<Group> {
    let element = |kind: &ElementKind| {
        let mut facets: Vec<&str> = (0..kind.sides().len()).map(|side| kind.side_kind(side).name()).collect();
        facets.dedup();
        let facet = facets.join(" and ");
        (kind.name(), format!("{}D, {} nodes, facets for contact: {facet}", kind.dimension(), kind.nodes()))
    };
    let own = |name, summary: &str| (name, summary.to_owned());
    let auto = own(
        "auto",
        "chosen by size, dimension, inertia and symmetry; if it fails, a more robust one is used",
    );
    let presets = PRESETS.iter().map(|preset| own(preset.name, preset.about));
    vec![
        ("Elements", "bodies: mesh: box: element", ElementKind::SOLIDS.iter().map(element).collect()),
        ("Materials", "bodies: material", MATERIALS.iter().map(|e| (e.name, e.about())).collect()),
        ("Treatments of locking", "bodies: locking", Locking::ALL.iter().map(|e| own(e.1, e.2)).collect()),
        ("Obstacles", "obstacles", OBSTACLES.iter().map(|e| (e.name, e.about())).collect()),
        ("Normal laws", "contact: normal", NORMAL_LAWS.iter().map(|e| (e.name, e.about())).collect()),
        (
            "Normal dampings",
            "contact: damping: normal",
            NORMAL_DAMPINGS.iter().map(|e| (e.name, e.about())).collect(),
        ),
        ("Friction laws", "contact: friction", FRICTION_LAWS.iter().map(|e| (e.name, e.about())).collect()),
        (
            "Coefficients of friction",
            "contact: friction: coulomb: coefficient",
            COEFFICIENTS.iter().map(|e| (e.name, e.about())).collect(),
        ),
        (
            "Regularisations",
            "contact: friction: ...: regularization",
            REGULARIZATIONS.iter().map(|e| own(e.name, e.about)).collect(),
        ),
        ("Schemes", "time: scheme", SCHEMES.iter().map(|e| (e.name, e.about())).collect()),
        ("Accuracies", "accuracy", LEVELS.iter().map(|e| own(e.name, e.about)).collect()),
        ("Strategies", "solver: strategy", STRATEGIES.iter().map(|e| own(e.name, e.about)).collect()),
        ("Linear solvers", "solver: linear", std::iter::once(auto).chain(presets).collect()),
    ]
}

/// The whole list as text.
pub fn list() -> String {
    let mut text = String::new();
    for (heading, key, entries) in groups() {
        let width = entries.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        text.push_str(&format!("{heading} ({key})\n"));
        entries.iter().for_each(|(name, about)| text.push_str(&format!("  {name:<width$}  {about}\n")));
        text.push('\n');
    }
    text.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every listed name is known to the schema, so that a case can use it.
    #[test]
    fn a_case_can_name_what_is_listed() {
        let schema = crate::case::schema().to_string();
        for (heading, _, entries) in groups() {
            assert!(entries.len() >= 2, "{heading}");
            for (name, about) in entries {
                assert!(schema.contains(&format!("\"{name}\"")), "{heading}: no case can name {name}");
                assert!(!about.is_empty(), "{heading}: {name} has no description");
            }
        }
    }
}
