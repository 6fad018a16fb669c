//! Meshes written by Gmsh are read in every format, with selection of regions.

mod binary;
mod text;

use std::path::PathBuf;

use super::{parse, read};
use crate::mesh::{ElementKind, Mesh, SetKind, measure};

const FORMATS: [&str; 4] = ["22a", "22b", "41a", "41b"];
const PLANE: [&str; 5] = ["tri3", "quad4", "tri6", "quad8", "quad9"];
const SOLID: [&str; 5] = ["tet4", "hex8", "tet10", "hex20", "hex27"];

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .join("tests/fixtures/gmsh")
        .join(format!("{name}.msh"))
}

fn bytes(kind: &str, format: &str) -> Vec<u8> {
    std::fs::read(fixture(&format!("{kind}-{format}"))).unwrap()
}

fn all_kinds(mesh_kinds: &[ElementKind], name: &str) {
    assert!(mesh_kinds.iter().all(|kind| kind.name() == name), "{mesh_kinds:?}");
}

fn check_area<const D: usize>(mesh: &Mesh<D>, set: &str, area: [f64; D]) {
    let found = measure::area(mesh, &mesh.facet_sets[set]);
    for k in 0..D {
        assert!((found[k] - area[k]).abs() < 1e-10, "{set}: {found:?}");
    }
}

/// Plane meshes written by Gmsh, in all formats: area, outward sides, midside nodes between their
/// corners, sets.
#[test]
fn plane_meshes_of_gmsh() {
    for kind in PLANE {
        for format in FORMATS {
            let mesh: Mesh<2> = parse(&bytes(kind, format), None).unwrap();
            all_kinds(&mesh.kinds, kind);
            measure::assert_straight(&mesh);
            assert!((measure::volume(&mesh) - 0.9).abs() < 1e-10);
            check_area(&mesh, "bottom", [0.0, -1.5]);
            check_area(&mesh, "top", [0.0, 1.5]);
            check_area(&mesh, "left", [-0.6, 0.0]);
            check_area(&mesh, "right", [0.6, 0.0]);
            let tip = mesh.set_nodes("tip").unwrap();
            assert_eq!(tip.iter().map(|&n| mesh.points[n as usize]).collect::<Vec<_>>(), [[1.5, 0.6]]);
            assert_eq!(mesh.element_sets["all"].len(), mesh.element_count());
            let regions = mesh.element_sets["rubber"].len() + mesh.element_sets["steel"].len();
            assert_eq!(regions, mesh.element_count());
        }
    }
}

/// Solid meshes written by Gmsh, in all formats: volume, outward sides, midside nodes between their
/// corners, sets.
#[test]
fn solid_meshes_of_gmsh() {
    for kind in SOLID {
        for format in FORMATS {
            let mesh: Mesh<3> = parse(&bytes(kind, format), None).unwrap();
            all_kinds(&mesh.kinds, kind);
            measure::assert_straight(&mesh);
            assert!((measure::volume(&mesh) - 0.525).abs() < 1e-10);
            check_area(&mesh, "bottom", [0.0, 0.0, -1.05]);
            check_area(&mesh, "top", [0.0, 0.0, 1.05]);
            check_area(&mesh, "left", [-0.35, 0.0, 0.0]);
            check_area(&mesh, "right", [0.35, 0.0, 0.0]);
            let edge = mesh.set_nodes("edge").unwrap();
            assert_eq!(edge.len(), if mesh.kinds[0].order() == 1 { 3 } else { 5 });
            assert!(edge.iter().all(|&n| mesh.points[n as usize][1..] == [0.0, 0.0]));
            assert_eq!(mesh.set_nodes("tip").unwrap().len(), 1);
            assert_eq!(mesh.element_sets["all"].len(), mesh.element_count());
        }
    }
}

/// Text and binary files of one mesh give identical numbers; text has 16 digits.
#[test]
fn text_and_binary_agree() {
    for version in ["22", "41"] {
        for kind in PLANE {
            check_formats::<2>(kind, version);
        }
        for kind in SOLID {
            check_formats::<3>(kind, version);
        }
    }
}

fn check_formats<const D: usize>(kind: &str, version: &str) {
    let text: Mesh<D> = parse(&bytes(kind, &format!("{version}a")), None).unwrap();
    let mut binary: Mesh<D> = parse(&bytes(kind, &format!("{version}b")), None).unwrap();
    for (a, b) in text.points.iter().zip(&mut binary.points) {
        assert!((0..D).all(|k| (a[k] - b[k]).abs() < 1e-15), "{kind}: {a:?} {b:?}");
        *b = *a;
    }
    assert_eq!(text, binary, "{kind}");
}

/// A region keeps its elements, their nodes and its part of each set. Its border becomes its
/// surface.
#[test]
fn region_keeps_its_elements_and_nodes() {
    for format in FORMATS {
        let rubber: Mesh<2> = parse(&bytes("ring", format), Some("rubber")).unwrap();
        assert_eq!((rubber.element_count(), rubber.points.len()), (2, 6));
        measure::assert_straight(&rubber);
        check_area(&rubber, "interface", [0.6, 0.0]);
        check_area(&rubber, "bottom", [0.0, -1.0]);
        let names: Vec<&str> = rubber.sets().into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["all", "bottom", "interface", "left", "rubber", "top"]);
        let steel: Mesh<2> = parse(&bytes("ring", format), Some("steel")).unwrap();
        assert_eq!((steel.element_count(), steel.points.len()), (1, 4));
        check_area(&steel, "interface", [-0.6, 0.0]);
        assert_eq!(steel.set_nodes("tip").map(|tip| steel.points[tip[0] as usize]), Some([1.5, 0.6]));
        assert!(steel.sets().contains(&("right", SetKind::Facets)));
    }
}

/// A facet set between two elements of the body is rejected with its location and a remedy.
#[test]
fn set_inside_the_mesh_is_refused() {
    let error = parse::<2>(&bytes("ring", "22a"), None).unwrap_err().message;
    assert!(error.starts_with("line ") && error.contains("of set 'interface' lies inside"), "{error}");
    assert!(error.contains("hint: ") && error.contains("`region`"), "{error}");
    let error = parse::<2>(&bytes("ring", "41b"), None).unwrap_err().message;
    assert!(error.starts_with("byte ") && error.contains("'interface'"), "{error}");
}

/// Errors contain the name of the file. A missing file has exit code 4.
#[test]
fn errors_carry_the_name_of_the_file() {
    let error = read::<2>(&fixture("none"), None).unwrap_err();
    assert!(error.message.contains("none.msh: the mesh can not be read"), "{error}");
    assert_eq!(error.exit_code(), 4);
    let error = read::<2>(&fixture("tri6-22a"), Some("robber")).unwrap_err();
    assert!(error.message.contains("tri6-22a.msh: the mesh has no region 'robber'"), "{error}");
    assert!(error.message.contains("hint: known regions: all, rubber, steel"), "{error}");
    assert_eq!(error.exit_code(), 4);
}

/// If a name belongs to another dimension, the message states this dimension.
#[test]
fn region_of_another_dimension_is_refused() {
    let error = parse::<2>(&bytes("tri6", "41a"), Some("bottom")).unwrap_err().message;
    assert!(error.contains("'bottom' is a physical group of dimension 1"), "{error}");
}

/// Meshes of the other dimension are rejected, and the message states both dimensions.
#[test]
fn mesh_of_another_dimension_is_refused() {
    let error = parse::<2>(&bytes("hex20", "22a"), None).unwrap_err().message;
    assert!(error.contains("(hex20) has dimension 3, but the case has dimension 2"), "{error}");
    let error = parse::<3>(&bytes("tri6", "22a"), None).unwrap_err().message;
    assert!(error.contains("no elements of dimension 3"), "{error}");
}
