//! Cases that are right: those that ship, both spellings of laws, the round trip, the schema.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::super::{Case, Element, Mesh, Scheme, Start, schema};
use super::{GOOD, with};
use crate::contact::friction::coefficient::Constant;
use crate::contact::friction::{Coulomb, FrictionLaw, FrictionPowerLaw, Regularization};
use crate::contact::normal::{NormalLaw, NormalPowerLaw};
use crate::schemes::Static;

/// The folder of the repository; the manifest of this crate is one below it.
fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn shipped() -> Vec<PathBuf> {
    let meshes = repository().join("meshes");
    let folders =
        std::fs::read_dir(meshes).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    let files =
        folders.flat_map(|folder| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
    // A study is no case; those that ship are read by the tests of studies.
    let is_case = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "yml")
            && !path.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("study"))
    };
    let cases: Vec<PathBuf> = files.filter(is_case).collect();
    assert!(cases.len() >= 9, "{cases:?}");
    cases
}

/// Every shipped case is right, survives the round trip through YAML and JSON, and names the schema.
#[test]
fn shipped_cases_are_right() {
    for path in shipped() {
        let case = Case::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(case.text().starts_with("# yaml-language-server: $schema=../case.schema.json\n"), "{path:?}");
        let again =
            Case::parse(&case.to_yaml().unwrap(), "again.yml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(case, again, "{path:?}");
        assert_eq!(case.to_json().unwrap(), again.to_json().unwrap());
    }
}

/// The schema that ships is the one that the types make; `contact-petsc schema > meshes/case.schema.json` renews it.
#[test]
fn shipped_schema_is_current() {
    let path = repository().join("meshes/case.schema.json");
    let text = std::fs::read_to_string(path).unwrap();
    assert_eq!(text, serde_json::to_string_pretty(&schema()).unwrap() + "\n");
}

/// Every key of the schema has a description, every property of numbers has units or a range in it.
#[test]
fn every_key_is_described() {
    fn visit(value: &Value, at: &str, bare: &mut Vec<String>) {
        let Some(object) = value.as_object() else {
            value.as_array().into_iter().flatten().for_each(|inner| visit(inner, at, bare));
            return;
        };
        if let Some(properties) = object.get("properties").and_then(|p| p.as_object()) {
            for (name, property) in properties {
                let described = property.get("description").is_some() || object.get("description").is_some();
                let variant = properties.len() == 1;
                if !described && !variant {
                    bare.push(format!("{at}.{name}"));
                }
            }
        }
        object.iter().for_each(|(key, inner)| visit(inner, &format!("{at}/{key}"), bare));
    }
    let mut bare = Vec::new();
    visit(&schema(), "", &mut bare);
    assert!(bare.is_empty(), "{bare:?}");
}

/// Whether a value is valid by a schema, as far as the keywords that schemars writes go.
fn valid(root: &Value, schema: &Value, value: &Value) -> bool {
    let Some(schema) = schema.as_object() else { return schema.as_bool().unwrap_or(false) };
    let list = |key: &str| schema.get(key).and_then(Value::as_array);
    let matching =
        |key: &str| list(key).map(|all| all.iter().filter(|inner| valid(root, inner, value)).count());
    let kind = |name: &str| match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "integer" => value.is_i64() || value.is_u64(),
        _ => value.is_number(),
    };
    let typed = match schema.get("type") {
        Some(Value::String(name)) => kind(name),
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).any(kind),
        _ => true,
    };
    let referred = schema
        .get("$ref")
        .and_then(Value::as_str)
        .is_none_or(|path| valid(root, root.pointer(path.trim_start_matches('#')).unwrap(), value));
    let entries = value.as_object().into_iter().flatten().all(|(key, inner)| {
        let property = schema.get("properties").and_then(|properties| properties.get(key));
        property.or(schema.get("additionalProperties")).is_none_or(|schema| valid(root, schema, inner))
    });
    let mut required = list("required").into_iter().flatten().filter_map(Value::as_str);
    let limit = schema.get("maxProperties").and_then(Value::as_u64);
    let items = schema.get("items").filter(|_| value.is_array());
    let bound = |key: &str| schema.get(key).and_then(Value::as_u64);
    let length = value.as_array().map_or(0, Vec::len) as u64;
    let fits = !value.is_array()
        || (bound("minItems").unwrap_or(0)..=bound("maxItems").unwrap_or(u64::MAX)).contains(&length);
    typed
        && referred
        && fits
        && entries
        && required.all(|key| value.get(key).is_some())
        && limit.is_none_or(|limit| value.as_object().is_none_or(|object| object.len() as u64 <= limit))
        && items.is_none_or(|schema| value.as_array().unwrap().iter().all(|inner| valid(root, schema, inner)))
        && schema.get("const").is_none_or(|only| only == value)
        && list("enum").is_none_or(|all| all.contains(value))
        && matching("oneOf").is_none_or(|count| count == 1)
        && matching("anyOf").is_none_or(|count| count >= 1)
        && matching("allOf").is_none_or(|count| count == list("allOf").unwrap().len())
}

fn valid_by_schema(text: &str) -> bool {
    let value: Value = serde_saphyr::from_str(text).unwrap();
    let schema = schema();
    valid(&schema, &schema, &value)
}

/// The schema accepts what the program accepts, in every spelling, and refuses what is misspelt.
#[test]
fn schema_and_reader_agree() {
    for path in shipped() {
        assert!(valid_by_schema(&std::fs::read_to_string(&path).unwrap()), "{path:?}");
    }
    let law = "{ coulomb: { coefficient: 1.0, regularization: { stick_velocity: \"1 mm/s\" } } }";
    let start = "{ equilibrium: { friction: false, increments: 4 } }";
    for (from, to, right) in [
        ("title", "title", true),
        ("title", "tittle", false),
        (law, "none", true),
        (law, "{ none: {} }", true),
        (law, "{ none: { a: 1 } }", false),
        (law, "coulomb", false),
        (law, "nine", false),
        (start, "rest", true),
        (start, "{ rest: {} }", true),
        (start, "equilibrium", true),
        ("friction: false", "friction: 1", false),
        ("coefficient: 1.0", "coefficient: { constant: 1 }", true),
        ("coefficient: 1.0", "coefficient: { stribeck: { static: 1, kinetic: 1 } }", false),
        ("{ penalty: { compliance: \"1e-10 m/Pa\" } }", "penalty", true),
        ("element: quad4", "element: quad5", false),
        ("cells: [4, 4]", "cells: [4, 4.5]", false),
        ("y: -0.05", "y: { table: [[0, 0], [1, 2 mm]] }", true),
        ("y: -0.05", "y: { table: [[0, 0, 1]] }", false),
        ("linear: auto", "newton: { tolerance: 1e-8 }", true),
        ("strategy: monolithic", "strategy: staggered", true),
        (
            "strategy: monolithic",
            "strategy: { staggered: { variant: frozen_traction, max_sweeps: 9 } }",
            true,
        ),
        ("monolithic, linear: auto", "staggered, linear: cg_icc", true),
        ("linear: auto", "linear: two_stage", true),
        ("linear: auto", "linear: filtered_amg", true),
        ("linear: auto", "linear: { filtered_amg: { layers: 1 } }", false),
        ("linear: auto", "linear: { two_stage: { second: friction_stage, inner: cholesky } }", true),
        ("  fields: { every: 10 }\n", "", true),
        ("dimension: 2\n", "", false),
    ] {
        let text = with(from, to);
        assert_eq!(valid_by_schema(&text), right, "{to}");
        assert_eq!(
            Case::parse(&text, "case.yml").is_ok(),
            right,
            "{to}: {:?}",
            Case::parse(&text, "case.yml").err()
        );
    }
}

/// The rubber block reads as the contract says.
#[test]
fn rubber_block_reads_as_written() {
    let path = repository().join("meshes/rubber-block/case.yml");
    let case = Case::read(&path).unwrap();
    let block = case.bodies.get("block").unwrap();
    let Mesh::Box(cuboid) = &block.mesh else { panic!("no box") };
    assert_eq!(
        (cuboid.cells.value.as_slice(), cuboid.element.as_ref().unwrap().value),
        (&[48, 50][..], Element::Quad4)
    );
    assert!((block.material.moduli().young_modulus() - 5e6).abs() < 1e-8);
    let sole = case.contact.get("sole").unwrap();
    let expected = Coulomb::of(Constant(1.0), Regularization::stick_velocity(1e-3));
    assert_eq!(sole.friction, expected.into());
    assert_eq!(case.start.as_ref().unwrap().value, Start::Equilibrium { friction: false, increments: 4 });
    assert_eq!(case.time.step(), 5e-4);
    assert_eq!(case.output.probes.names().collect::<Vec<_>>(), ["node_50", "node_98"]);
    assert_eq!(case.resolve("block.msh"), path.with_file_name("block.msh"));
}

/// The constants of the power laws follow from E and c_N, in both readings of its unit.
#[test]
fn power_laws_follow_the_theory() {
    for exponent in [1.0, 2.0, 3.0] {
        for (suffix, unit) in [("", 1e6), ("-kn", 1e3)] {
            let file = format!("meshes/rubber-block/power-law-{exponent}{suffix}.yml");
            let case = Case::read(&repository().join(file)).unwrap();
            let sole = case.contact.get("sole").unwrap();
            let NormalLaw::NormalPowerLaw(NormalPowerLaw { stiffness: c_n, exponent: m_n }) = &sole.normal
            else {
                panic!("no power law")
            };
            let FrictionLaw::FrictionPowerLaw(FrictionPowerLaw { stiffness: c_t, exponent: m_t, .. }) =
                &sole.friction
            else {
                panic!("no power law")
            };
            let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-14;
            assert!(close(c_n.value, 10_f64.powf(4.0 * exponent) * unit) && m_n.value == exponent);
            assert!(close(c_t.value, c_n.value.powf(8.0 / 9.0) * 5e6_f64.powf(1.0 / 9.0)), "{}", c_t.value);
            assert!(close(m_t.value, 8.0 / 9.0 * exponent));
        }
    }
}

/// The smooth start has the velocity (1 - cos(pi t / T)) / 2 and no jump at T = 0.01 s.
#[test]
fn smooth_start_is_smooth() {
    let path = repository().join("meshes/rubber-block/smooth-start.yml");
    let case = Case::read(&path).unwrap();
    let displacement = case.boundary.get("clamp").unwrap().displacement.as_ref().unwrap();
    let x = displacement.x.as_ref().unwrap();
    for t in [0.0, 0.002, 0.005, 0.0099999] {
        let phase = std::f64::consts::PI * t / 0.01;
        let motion = x.motion([0.0; 3], t);
        assert!((motion.rate - 0.5 * (1.0 - phase.cos())).abs() < 1e-12);
        assert!((motion.second - 50.0 * std::f64::consts::PI * phase.sin()).abs() < 1e-9);
    }
    let (before, after) = (x.motion([0.0; 3], 0.01 - 1e-12), x.motion([0.0; 3], 0.01));
    assert!((before.value - after.value).abs() < 2e-12 && (before.rate - after.rate).abs() < 1e-9);
}

/// A law without parameters may be written as a name or as a mapping.
#[test]
fn laws_have_two_spellings() {
    let friction =
        "friction: { coulomb: { coefficient: 1.0, regularization: { stick_velocity: \"1 mm/s\" } } }";
    let same = |from: &str, a: &str, b: &str| {
        let [a, b] =
            [a, b].map(|to| Case::parse(&with(from, to), "case.yml").unwrap_or_else(|e| panic!("{e}")));
        assert_eq!(a, b);
    };
    same(friction, "friction: none", "friction: { none: {} }");
    same("start: { equilibrium: { friction: false, increments: 4 } }", "start: rest", "start: { rest: {} }");
    same("start: { equilibrium: { friction: false, increments: 4 } }\n", "start: rest\n", "");
    same("{ friction: false, increments: 4 }", "{}", "{ friction: false }");
    same("{ equilibrium: { friction: false, increments: 4 } }", "equilibrium", "{ equilibrium: {} }");
    same("scheme: { newmark: { beta: 0.25, gamma: 0.5 } }", "scheme: newmark", "scheme: { newmark: {} }");
    same(
        "scheme: { newmark: { beta: 0.25, gamma: 0.5 } }",
        "scheme: backward_euler",
        "scheme: { backward_euler: }",
    );
    same("{ penalty: { compliance: \"1e-10 m/Pa\" } }", "penalty", "{ penalty: {} }");
    same("coefficient: 1.0", "coefficient: 1", "coefficient: { constant: 1.0 }");
}

/// Everything that may be written comes through the round trip, and is valid by the schema's keys.
#[test]
fn everything_survives_the_round_trip() {
    let three = GOOD
        .replace("dimension: 2", "dimension: 3")
        .replace("[0, 0]", "[0, 0, 0]")
        .replace("[1, 1]", "[1, 1, 1]")
        .replace("[4, 4], element: quad4", "[4, 4, 4]")
        .replace("normal: [0, 1]", "normal: [0, 0, 1]")
        .replace("[\"0.1 * y\", 0]", "[\"0.1 * y\", 0, \"2 mm/s\"]");
    let full = three.replace(
        "petsc: { ksp_monitor: }",
        "petsc: { ksp_monitor: , mat_mumps_icntl_14: 40, ksp_type: gmres, ksp_rtol: 1.0e-6, a: true, b: \"\" }",
    );
    let material =
        with("neo_hookean", "saint_venant_kirchhoff").replace("kinematics: finite", "kinematics: linear");
    let variants = [
        GOOD.to_string(),
        three,
        full,
        material.replace("    locking: selective_reduced\n", "    mass: lumped\n"),
        with(
            "box: { min: [0, 0], max: [1, 1], cells: [4, 4], element: quad4 }",
            "file: a.msh, region: rubber",
        ),
        with(
            "coefficient: 1.0",
            "coefficient: { stribeck: { static: 1.2, kinetic: 0.8, decay_velocity: 0.1 } }",
        ),
        with("coefficient: 1.0", "coefficient: { grosch_schallamach: { reference: 1, modulus: 5 MPa } }"),
        with("stick_velocity: \"1 mm/s\"", "stick_stiffness: 1 GPa/m"),
        with("compliance: \"1e-10 m/Pa\"", "penetration: \"0.05 mm\""),
        with(
            "plane: { point: [0, 0], normal: [0, 1] }",
            "sphere: { center: [0, 0], radius: 3, side: inside }",
        ),
        with("newmark: { beta: 0.25, gamma: 0.5 }", "hht: { spectral_radius: 0.9 }"),
        with("y: -0.05", "y: { table: [[0, 0], [0.01, 8.0e-4], [0.02, 0]] }"),
        with("fields: { every: 10 }", "fields: { every: 5 }"),
        with("on: block.top, displacement: { x: \"1.0 * t\", y: -0.05 }", "on: block, gravity: [0, -9.81]"),
        with("displacement: { x: \"1.0 * t\", y: -0.05 }", "traction: { x: 5 kPa }"),
        with("displacement: { x: \"1.0 * t\", y: -0.05 }", "pressure: \"1e5 * t\""),
    ];
    for text in variants {
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        let yaml = case.to_yaml().unwrap();
        let again = Case::parse(&yaml, "again.yml").unwrap_or_else(|error| panic!("{error}\n{yaml}"));
        assert_eq!(case, again, "{yaml}");
    }
}

/// What depends on other keys is filled in; a constant of physics is not.
#[test]
fn defaults_are_completed() {
    let text = with(", element: quad4", "")
        .replace("start: { equilibrium: { friction: false, increments: 4 } }\n", "");
    let text = text.replace(", scheme: { newmark: { beta: 0.25, gamma: 0.5 } }", "");
    let case = Case::parse(&text, "case.yml").unwrap();
    let json = case.to_json().unwrap();
    assert_eq!(json["bodies"]["block"]["mesh"]["box"]["element"], "quad4");
    assert_eq!(json["start"], "rest");
    assert_eq!(json["time"]["scheme"]["generalized_alpha"]["spectral_radius"], 0.8);
    assert_eq!(json["time"]["cuts"], 5);
    assert_eq!(json["solver"]["newton"]["max_iterations"], 25);
    assert_eq!(json["solver"]["linear"], "auto");
    let stat = with("stick_velocity: \"1 mm/s\"", "stick_stiffness: 1e9")
        .replace("start: { equilibrium: { friction: false, increments: 4 } }\n", "")
        .replace("    initial_velocity: [\"0.1 * y\", 0]\n", "")
        .replace("    density: \"1700 kg/m3\"\n", "")
        .replace(
            "step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } }",
            "scheme: { static: { increments: 4 } }",
        );
    let case = Case::parse(&stat, "case.yml").unwrap_or_else(|error| panic!("{error}"));
    assert!(case.is_static() && case.start.is_none() && (case.time.step() - 0.07 / 4.0).abs() < 1e-16);
    assert!(matches!(case.time.scheme.value, Scheme::Static(Static { increments: None })));
}
