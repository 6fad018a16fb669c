//! Bodies that overlap at the start. A contact detects surfaces that face each other within a short
//! distance. This module detects bodies that contain each other or coincide, for any orientation of
//! their surfaces.

use super::intrusion::{Intrusion, MergedBody, Neighbours};
use crate::case::{Case, InitialOverclosure};
use crate::error::{Error, Result};
use crate::mesh::{Bounds, BoundsTree, Mesh, spelled};
use crate::space::locate;
use crate::tensor::Vector;

/// Maximum number of elements of one body that are located in another. With 1e5, bodies of a
/// million elements take a second.
const MOST: usize = 100_000;

/// Remarks for the user on bodies that overlap by half an element or more, or by less if no contact
/// acts there.
///
/// # Errors
/// A contact between the two bodies treats an initial overclosure as an error.
pub(super) fn remarks<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Result<Vec<String>> {
    let names: Vec<&str> = case.bodies.names().collect();
    let mut elements = vec![Vec::new(); names.len()];
    let mut around = vec![Bounds::EMPTY; names.len()];
    for (element, &body) in (0_u32..).zip(&mesh.body) {
        elements[usize::from(body)].push(element);
        let all = &mut around[usize::from(body)];
        *all = all.join(&around_element(mesh, element));
    }
    let mut remarks = Vec::new();
    let m = case.units.of("m");
    for one in 0..names.len() {
        for other in one + 1..names.len() {
            let common = common(&around[one], &around[other]);
            if common.is_empty() {
                continue;
            }
            let both = [(one, other), (other, one)];
            let found = both.into_iter().find_map(|(inner, outer)| {
                let place = inside(mesh, &elements[inner], &elements[outer], &common)?;
                Some((inner, outer, place))
            });
            let Some((inner, outer, place)) = found else {
                let bodies =
                    [one, other].map(|k| MergedBody { name: names[k], number: k, elements: &elements[k] });
                let shallow = Neighbours::new(case, mesh, bodies, &common).deepest();
                remarks.extend(shallow.map(|Intrusion { place, depth }| {
                    format!(
                        "bodies '{}' and '{}' overlap at the start by {depth:.3e} {m} at {} {m}, where no contact acts: a contact acts only \
                         between surfaces that face each other",
                        names[one],
                        names[other],
                        spelled(&place)
                    )
                }));
                continue;
            };
            let message = format!(
                "bodies '{}' and '{}' overlap at the start: the centre of an element of '{0}' at {} {m} \
                 lies inside '{1}'",
                names[inner],
                names[outer],
                spelled(&place)
            );
            refuse_or_remark(case, [names[inner], names[outer]], message, &mut remarks)?;
        }
    }
    for (name, obstacle) in case.shapes() {
        for body in 0..names.len() {
            let Some(core) = obstacle.shape::<D>().core() else { continue };
            let centre: [f64; D] = core.nearest(&Vector::from(around[body].centre())).into();
            let at = Bounds::of([centre]);
            if !around[body].meets(&at) {
                continue;
            }
            let near = elements[body].iter().copied().filter(|&e| around_element(mesh, e).meets(&at));
            if locate(mesh, near, &centre).is_some() {
                let noun = case.noun(name);
                let message = format!(
                    "body '{}' and {noun} '{}' overlap at the start: the centre of the {noun} at {} {m} \
                     lies inside the body",
                    names[body],
                    name.value,
                    spelled(&centre)
                );
                refuse_or_remark(case, [names[body], &name.value], message, &mut remarks)?;
            }
        }
    }
    Ok(remarks)
}

/// Returns an error at the contact if a contact between the two bodies treats overclosure as an
/// error; otherwise adds a remark.
fn refuse_or_remark(case: &Case, pair: [&str; 2], message: String, remarks: &mut Vec<String>) -> Result<()> {
    let between = case.contact.iter().filter(|(_, contact)| {
        let on = |side: usize| contact.is_on(pair[side]) || contact.target.value == pair[side];
        on(0) && on(1)
    });
    for (name, contact) in between {
        if contact.initial_overclosure == InitialOverclosure::Error {
            let error: Error = case.error(name.place, message);
            return Err(error.hint("move one of them; a contact acts between surfaces that face each other"));
        }
    }
    remarks.push(format!("{message}; a contact acts only between surfaces that face each other"));
    Ok(())
}

/// The centre of an element of `inner` that lies in an element of `outer`; both are in the box
/// `common`.
fn inside<const D: usize>(
    mesh: &Mesh<D>,
    inner: &[u32],
    outer: &[u32],
    common: &Bounds<D>,
) -> Option<[f64; D]> {
    let centre = |element: u32| mesh.element_centre(element as usize);
    let near: Vec<u32> = outer.iter().copied().filter(|&e| around_element(mesh, e).meets(common)).collect();
    let middles: Vec<[f64; D]> =
        inner.iter().map(|&e| centre(e)).filter(|&at| common.meets(&Bounds::of([at]))).collect();
    if near.is_empty() || middles.is_empty() {
        return None;
    }
    let boxes: Vec<Bounds<D>> = near.iter().map(|&element| around_element(mesh, element)).collect();
    let tree = BoundsTree::new(&boxes);
    let stride = middles.len().div_ceil(MOST);
    middles.into_iter().step_by(stride).find(|middle| {
        let candidates = tree.meeting(&Bounds::of([*middle])).map(|number| near[number as usize]);
        locate(mesh, candidates, middle).is_some()
    })
}

fn around_element<const D: usize>(mesh: &Mesh<D>, element: u32) -> Bounds<D> {
    Bounds::of(mesh.element_nodes(element as usize).iter().map(|&node| mesh.points[node as usize]))
}

/// The intersection of two boxes.
fn common<const D: usize>(one: &Bounds<D>, other: &Bounds<D>) -> Bounds<D> {
    Bounds {
        low: std::array::from_fn(|k| one.low[k].max(other.low[k])),
        high: std::array::from_fn(|k| one.high[k].min(other.high[k])),
    }
}

#[cfg(test)]
mod tests {
    use crate::case::Case;
    use crate::error::Result;
    use crate::model::read_meshes;

    /// The overlaps found between two boxes with these corners, with these contact options.
    fn found(one: &str, other: &str, contact: &str) -> Result<Vec<String>> {
        let body = |mesh: &str| {
            format!(
                "{{ mesh: {{ box: {{ {mesh} }} }}, material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}, density: 1 }}"
            )
        };
        let text = format!(
            "dimension: 2\nbodies:\n  one: {}\n  other: {}\nobstacles: {{ ball: {{ sphere: {{ center: [9, 9], radius: 0.1 }} }} }}\n\
             contact: {{ face: {{ {contact}, friction: none }} }}\ntime: {{ end: 1, step: 0.1 }}\n",
            body(one),
            body(other)
        );
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        read_meshes::<2>(&case).map(|(_, remarks)| remarks)
    }

    const UNIT: &str = "min: [0, 0], max: [1, 1], cells: [4, 4]";
    const CONTACT: &str = "contactor: one.top, target: other.bottom";

    /// Bodies that coincide or contain each other are rejected at their contact, or reported if the
    /// contact accepts an overlap.
    #[test]
    fn bodies_that_coincide_or_contain_each_other_are_found() {
        for other in [
            UNIT,
            "min: [0.3, 0.3], max: [0.6, 0.6], cells: [2, 2]",
            "min: [-1, -1], max: [2, 2], cells: [3, 3]",
        ] {
            let error = found(UNIT, other, CONTACT).expect_err("an overlap").message;
            assert!(error.contains("case.yml:6:") && error.contains("'one' and 'other' overlap"), "{error}");
            let accepted =
                found(UNIT, other, &format!("{CONTACT}, initial_overclosure: accept")).expect("a remark");
            assert!(accepted.len() == 1 && accepted[0].contains("overlap at the start"), "{accepted:?}");
        }
    }

    const AWAY: &str = "contactor: other.top, target: one.bottom";

    /// An overlap of less than half an element is reported with its depth and position, for any
    /// orientation of the surfaces. This includes contacts on other surfaces, or on surfaces with
    /// the same orientation. An overlap that a contact covers is left to the contact, together with
    /// the adjacent sides. Bodies that touch do not overlap.
    #[test]
    fn shallow_overlaps_are_reported_where_no_contact_acts() {
        let reported = |other: &str, contact: &str| found(UNIT, other, contact).expect("good bodies");
        for (low, contact) in [("0.95", CONTACT), ("0.9", CONTACT), ("1", CONTACT), ("1", AWAY)] {
            for (left, right) in [(0.0, 1.0), (-0.05, 1.07)] {
                let other = format!("min: [{left}, {low}], max: [{right}, 1.9], cells: [3, 3]");
                assert_eq!(reported(&other, contact), Vec::<String>::new(), "{other}");
            }
        }
        for (other, contact, depth) in [
            ("min: [0, 0.9], max: [1, 1.9], cells: [3, 3]", AWAY, "1.000e-1 m at"),
            ("min: [0.2, 0.99], max: [0.7, 1.9], cells: [1, 1]", AWAY, "1.000e-2 m at"),
            ("min: [0.9, 0.9], max: [1.9, 1.9], cells: [2, 2]", AWAY, "1.000e-1 m at [1, 1] m"),
            (
                "min: [0, 0.92], max: [1, 1.12], cells: [3, 1]",
                "contactor: other.top, target: one.top",
                "8.000e-2 m",
            ),
        ] {
            let told = reported(other, contact);
            assert!(told.len() == 1 && told[0].contains(depth), "{other}: {told:?}");
            assert!(told[0].contains("'one' and 'other' overlap"), "{told:?}");
        }
    }

    /// Polygons on one circle fit into each other for any numbers of corners. A disc that is too
    /// large does not.
    #[test]
    fn polygons_on_one_circle_do_not_overlap() {
        let ring = |cells: u32, inner: f64, outer: f64| {
            let radius = format!("({inner} + {} * y)", outer - inner);
            format!(
                "min: [0, 0], max: [1, 1], cells: [{cells}, 2], \
                 map: {{ x: \"-{radius} * cos(3.14159265 * x)\", y: \"{radius} * sin(3.14159265 * x)\" }}"
            )
        };
        for (one, other) in [(17, 12), (12, 17), (12, 12), (30, 7)] {
            let told = found(&ring(one, 0.5, 1.0), &ring(other, 1.0, 2.0), AWAY).expect("good bodies");
            assert_eq!(told, Vec::<String>::new(), "{one} {other}");
        }
        let told = found(&ring(17, 0.5, 1.1), &ring(12, 1.0, 2.0), AWAY).expect("good bodies");
        assert!(told.len() == 1 && told[0].contains("overlap at the start by"), "{told:?}");
    }

    /// A ball inside a body is found as well.
    #[test]
    fn an_obstacle_inside_a_body_is_found() {
        let far = "min: [20, 20], max: [21, 21], cells: [1, 1]";
        let around = "min: [8, 8], max: [10, 10], cells: [2, 2]";
        let error =
            found(around, far, "contactor: one.top, target: ball").expect_err("a ball inside").message;
        assert!(error.contains("body 'one' and obstacle 'ball' overlap"), "{error}");
        assert!(found(far, UNIT, "contactor: one.top, target: ball").expect("apart").is_empty());
    }
}
