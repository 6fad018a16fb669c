//! The routes of `docs/how-to/meshes-from-elsewhere.md`: meshes in Exodus, MED and VTU keep their
//! elements and sets in `scripts/convert-mesh.py`, geometries in STEP and meshes in UNV in Gmsh.

mod common;

use std::f64::consts::PI;
use std::fs;
use std::process::Command;

use common::{Folder, LIMIT, Running, Table, near, run};

/// Writes `mesh.e`, `mesh.med`, `mesh.vtk-order.med` and `mesh.vtu` with one element of each kind in
/// space, 3 m apart. The sides are sets in Exodus and groups in MED, and the VTU has them as cells
/// with an array of integers.
const WRITER: &str = r#"
import h5py
import meshio
import netCDF4
import numpy

HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
WEDGE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
PYRAMID = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)]


def middles(corners, edges):
    return corners + [tuple((a + b) / 2 for a, b in zip(corners[i], corners[j])) for i, j in edges]


BOTTOM, UPRIGHT, TOP = [(0, 1), (1, 2), (2, 3), (3, 0)], [(0, 4), (1, 5), (2, 6), (3, 7)], [(4, 5), (5, 6), (6, 7), (7, 4)]
HEX20 = middles(HEX, BOTTOM + UPRIGHT + TOP)
TET10 = middles(TET, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
# Corners of the sides in the order of the Exodus manual.
HEX_SIDES = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)]
TET_SIDES = [(0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)]
WEDGE_SIDES = [(0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)]
PYRAMID_SIDES = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)]
ELEMENTS = [
    ("HEX8", "hexahedron", HEX, HEX_SIDES), ("TETRA4", "tetra", TET, TET_SIDES),
    ("WEDGE6", "wedge", WEDGE, WEDGE_SIDES), ("PYRAMID5", "pyramid", PYRAMID, PYRAMID_SIDES),
    ("HEX20", None, HEX20, HEX_SIDES), ("TETRA10", None, TET10, TET_SIDES),
]


def names(data, variable, dimension, texts):
    rows = data.createVariable(variable, "S1", (dimension, "len_name"))
    rows[:] = netCDF4.stringtochar(numpy.array(texts, dtype="S32"))


points, blocks, sides = [], [], []
for k, (kind, _, corners, of_element) in enumerate(ELEMENTS):
    first = len(points)
    points += [(3 * k + x, y, z) for x, y, z in corners]
    blocks.append((kind, [first + i + 1 for i in range(len(corners))]))
    for number, side in enumerate(of_element, 1):
        sides.append((f"{kind}_{number}", k + 1, number))
        centre = [sum(points[first + c][i] for c in side) / len(side) for i in range(3)]
        print(f"{kind}_{number}", *centre)

with netCDF4.Dataset("mesh.e", "w", format="NETCDF3_64BIT_OFFSET") as data:
    for name, size in dict(num_dim=3, num_nodes=len(points), num_elem=len(blocks), num_el_blk=len(blocks),
                           num_side_sets=len(sides), num_node_sets=1, num_nod_ns1=2, len_name=32).items():
        data.createDimension(name, size)
    for axis, values in zip("xyz", zip(*points)):
        data.createVariable("coord" + axis, "f8", ("num_nodes",))[:] = values
    for k, (kind, nodes) in enumerate(blocks, 1):
        data.createDimension(f"num_el_in_blk{k}", 1)
        data.createDimension(f"num_nod_per_el{k}", len(nodes))
        cells = data.createVariable(f"connect{k}", "i4", (f"num_el_in_blk{k}", f"num_nod_per_el{k}"))
        cells.elem_type = kind
        cells[:] = [nodes]
    for k, (_, element, side) in enumerate(sides, 1):
        data.createDimension(f"num_side_ss{k}", 1)
        data.createVariable(f"elem_ss{k}", "i4", (f"num_side_ss{k}",))[:] = [element]
        data.createVariable(f"side_ss{k}", "i4", (f"num_side_ss{k}",))[:] = [side]
    data.createVariable("node_ns1", "i4", ("num_nod_ns1",))[:] = [1, 4]
    names(data, "eb_names", "num_el_blk", [kind for kind, _ in blocks])
    names(data, "ss_names", "num_side_sets", [name for name, _, _ in sides])
    names(data, "ns_names", "num_node_sets", ["edge"])

# Corners in the order of the MED manual: the base counts the other way round than in Exodus and VTK.
MED_HEX = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 1, 1), (1, 0, 1)]
MED_TET = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)]
MED_WEDGE = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1)]
MED_PYRAMID = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 1)]
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
MED = [("HE8", 308, MED_HEX), ("TE4", 304, MED_TET), ("PE6", 306, MED_WEDGE), ("PY5", 305, MED_PYRAMID),
       ("H20", 320, middles(MED_HEX, BOTTOM + TOP + UPRIGHT)), ("T10", 310, middles(MED_TET, TET_EDGES))]
VTK = [("HE8", 308, HEX), ("TE4", 304, TET), ("PE6", 306, WEDGE), ("PY5", 305, PYRAMID),
       ("H20", 320, middles(HEX, BOTTOM + TOP + UPRIGHT)), ("T10", 310, TET10)]
MED_SIDES = {3: ("TR3", 203), 4: ("QU4", 204), 6: ("TR6", 206), 8: ("QU8", 208)}
PROFILE = numpy.bytes_("MED_NO_PROFILE_INTERNAL")


def write_med(path, order):
    # Types: code, connectivity, families. Families: number, groups; the first has no groups.
    types, families, first = {}, [(-1000, [])], 0
    for (name, code, nodes), (kind, _, corners, of_element) in zip(order, ELEMENTS):
        place = {corner: first + k + 1 for k, corner in enumerate(corners)}
        families.append((-len(families), [kind, "all"]))
        types[name] = code, [[place[node] for node in nodes]], [families[-1][0]]
        for number, side in enumerate(of_element, 1):
            around = [corners[c] for c in side]
            if len(corners) in (10, 20):
                around = middles(around, [(k, (k + 1) % len(side)) for k in range(len(side))])
            families.append((-len(families), [f"{kind}_{number}"]))
            _, cells, numbers = types.setdefault(MED_SIDES[len(around)][0], (MED_SIDES[len(around)][1], [], []))
            cells.append([place[node] for node in around])
            numbers.append(families[-1][0])
        first += len(corners)

    def attributes(item, **values):
        item.attrs.update(values)
        return item

    def entities(group, dataset, values, count, numbers):
        attributes(group, CGT=1, CGS=1, PFL=PROFILE)
        # All first components come before all second ones.
        attributes(group.create_dataset(dataset, data=numpy.transpose(values).ravel()), CGT=1, NBR=count)
        attributes(group.create_dataset("FAM", data=numbers), CGT=1, NBR=count)

    def family(group, name, number, groups):
        item = attributes(group.create_group(name), NUM=number)
        if groups:
            rows = item.create_group("GRO").create_dataset("NOM", (len(groups),), "(80,)i1")
            attributes(item["GRO"], NBR=len(groups))
            for k, text in enumerate(groups):
                rows[k] = numpy.frombuffer(text.encode().ljust(80, b"\0"), "i1")

    # MED 4 wants HDF5 groups that keep their order of creation.
    with h5py.File(path, "w") as data:
        attributes(data.create_group("INFOS_GENERALES"), MAJ=3, MIN=0, REL=0)
        empty = numpy.bytes_("")
        mesh = attributes(data.create_group("ENS_MAA/part"), DIM=3, ESP=3, REP=0, TYP=0, SRT=0, NXI=-1, NXT=-1,
                          UNT=empty, UNI=empty, DES=empty, NOM=numpy.bytes_("".join(f"{x:16}" for x in "XYZ")))
        step = attributes(mesh.create_group("-0000000000000000001" * 2), CGT=1, NDT=-1, NOR=-1, NXI=-1, NXT=-1,
                          PVI=-1, PVT=-1, PDT=-1.0)
        entities(step.create_group("NOE"), "COO", points, len(points), [int(k in (0, 3)) for k in range(len(points))])
        cells = attributes(step.create_group("MAI"), CGT=1)
        for name, (code, nodes, numbers) in types.items():
            entities(cells.create_group(name), "NOD", nodes, len(nodes), numbers)
            attributes(cells[name], GEO=code)
        family(data.create_group("FAS/part"), "FAMILLE_ZERO", 0, [])
        family(data.create_group("FAS/part/NOEUD"), "edge", 1, ["edge"])
        of_cells = data.create_group("FAS/part/ELEME")
        for number, groups in families:
            family(of_cells, f"FAM{number}", number, groups)


write_med("mesh.med", MED)
write_med("mesh.vtk-order.med", VTK)

cells, region, first = [], [], 0
facets = {3: ([], []), 4: ([], [])}
for kind, name, corners, of_element in ELEMENTS:
    if name is not None:
        cells.append((name, [[first + i for i in range(len(corners))]]))
        region.append([1])
        for number, side in enumerate(of_element, 1):
            facets[len(side)][0].append([first + c for c in side])
            facets[len(side)][1].append(10 * len(cells) + number)
    first += len(corners)
for size, name in [(3, "triangle"), (4, "quad")]:
    cells.append((name, facets[size][0]))
    region.append(facets[size][1])
meshio.write("mesh.vtu", meshio.Mesh(points[:first], cells, cell_data={"part": [numpy.array(r) for r in region]}))
"#;

/// A plate of 40 x 20 x 10 mm with a hole of radius 4 mm through its centre.
const PLATE: &str = r#"
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 40, 20, 10};
Cylinder(2) = {20, 10, 0, 0, 0, 10, 4};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
"#;

/// A case with these loads on the body `block` of this mesh.
fn case(mesh: &str, loads: &[String]) -> String {
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ {mesh} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
    density: 1
boundary:
{}time: {{ end: 1.0e-6, step: 1.0e-6 }}
output: {{ loads: true, bodies: true }}
",
        loads.concat()
    )
}

/// A load with a name on a set of `block`.
fn load(name: &str, set: &str, kind: &str, axis: &str) -> String {
    format!("  {name}: {{ on: block.{set}, {kind}: {{ {axis}: 1 }} }}\n")
}

/// Centre of a load at the end.
fn centre(loads: &Table, name: &str) -> [f64; 3] {
    let load = loads.only("boundary", name);
    ["x", "y", "z"].map(|axis| load.last(&format!("centre_{axis}")))
}

/// Runs Debian's Python, which has meshio, netCDF4 and h5py, in a folder.
fn python(folder: &Folder, arguments: &[&str]) -> String {
    let output = Command::new("/usr/bin/python3").args(arguments).current_dir(&**folder).output();
    let output = output.expect("Debian's Python: run scripts/setup --tests");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Runs commands of Gmsh in a folder.
fn gmsh(folder: &Folder, commands: &str) {
    let output = Running::script(1, &format!("set -e\n{commands}"), folder).wait(LIMIT / 5);
    assert_ne!(output.code, Some(127), "gmsh is missing: run scripts/setup --tests");
    output.success();
}

/// The first block of a language in a section of the page.
fn shown(section: &str, language: &str) -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/how-to/meshes-from-elsewhere.md");
    let page = fs::read_to_string(path).expect("the page");
    let (_, section) = page.split_once(&format!("\n## {section}\n")).expect("the section");
    let (_, block) = section.split_once(&format!("```{language}\n")).expect("the block");
    block.split_once("```").expect("the end of the block").0.to_owned()
}

/// The centre of a traction on each set of sides is that of the side of its number in the format,
/// the centre of a force on the set of nodes is that of its nodes, and the mass is that of the
/// elements. MED files are read in the node order of the MED manual and in that of VTK.
#[test]
fn sides_and_elements_survive_the_conversion() {
    let folder = Folder::new("convert");
    folder.write("write.py", WRITER);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/convert-mesh.py");
    let centres: Vec<(String, Vec<f64>)> = python(&folder, &["write.py"])
        .lines()
        .map(|line| {
            let (name, numbers) = line.split_once(' ').expect("a name");
            (name.to_owned(), numbers.split(' ').map(|x| x.parse().expect("a number")).collect())
        })
        .collect();
    assert_eq!(centres.len(), 30);
    let part = |number: usize| ["HEX8", "TETRA4", "WEDGE6", "PYRAMID5"][number];
    let named: Vec<(String, String)> = (0..4)
        .flat_map(|k| {
            (1..=6).map(move |side| (format!("part-{}", 10 * (k + 1) + side), format!("{}_{side}", part(k))))
        })
        .collect();
    for (input, mesh, arguments, mass) in [
        ("mesh.e", "file: mesh.inp", &[][..], 3.0 + 1.0 / 6.0),
        ("mesh.med", "file: mesh.inp, region: all", &[], 3.0 + 1.0 / 6.0),
        ("mesh.vtk-order.med", "file: mesh.inp, region: all", &[], 3.0 + 1.0 / 6.0),
        ("mesh.vtu", "file: mesh.inp", &["--array", "part"], 2.0),
    ] {
        let summary = python(&folder, &[&[script, input, "mesh.inp"], arguments].concat());
        let has_names = arguments.is_empty();
        // The set in the converted mesh, and the centre of its side.
        let sides: Vec<(String, &[f64])> = if has_names {
            centres.iter().map(|(name, centre)| (name.clone(), centre.as_slice())).collect()
        } else {
            let of = |name: &String| centres.iter().find(|(known, _)| known == name);
            let found = named.iter().filter_map(|(set, name)| Some((set.clone(), of(name)?.1.as_slice())));
            found.collect()
        };
        assert_eq!(sides.len(), if has_names { 30 } else { 20 });
        assert!(sides.iter().all(|(name, _)| summary.contains(&format!("surface {name}: 1"))), "{summary}");
        let mut loads: Vec<String> = sides.iter().map(|(set, _)| load(set, set, "traction", "x")).collect();
        if has_names {
            let kinds = ["HEX8", "TETRA4", "WEDGE6", "PYRAMID5", "HEX20", "TETRA10"];
            assert!(
                kinds.iter().all(|kind| summary.contains(&format!("element set {kind}: 1"))),
                "{summary}"
            );
            loads.push(load("edge", "edge", "force", "x"));
        }
        folder.write("case.yml", &case(mesh, &loads));
        let results = input.trim_start_matches("mesh.");
        run(1, &["case.yml", "-q", "-o", results], &folder).success();
        let table = |name: &str| Table::read(&folder.join(results).join(name));
        let found = table("loads.csv");
        for (name, known) in sides {
            near(&centre(&found, &name), known, 1e-9);
        }
        if has_names {
            near(&centre(&found, "edge"), &[0.0, 0.5, 0.0], 1e-9);
        }
        near(&[table("bodies.csv").last("mass")], &[mass], 1e-12);
    }
}

/// The script and the command of the page mesh a STEP file in millimetres. Volume, areas and centres
/// are those of the plate in metres. The mesh passes through UNV with the command of the page.
#[test]
fn a_plate_in_step_and_unv_keeps_its_unit_and_its_sets() {
    let folder = Folder::new("step");
    folder.write("plate.geo", PLATE);
    gmsh(&folder, "gmsh -0 plate.geo -o part.step");
    folder.write("part.geo", &shown("STEP", "text"));
    let mut loads = Vec::new();
    for set in ["bottom", "hole"] {
        loads.extend(["x", "y"].map(|axis| load(&format!("{set}_{axis}"), set, "traction", axis)));
    }
    folder.write("case.yml", &case("file: part.msh, region: part", &loads));
    let (size, radius, thickness) = (0.003, 0.004, 0.01);
    // The edges of tri6 on the circle are parabolas through three points. With arcs of length `size`
    // they miss this part of the area of the disc, and a smaller part of its circumference.
    let tolerance = f64::powi(size / radius, 4) / 480.0;
    let bottom = 0.04 * 0.02 - PI * radius * radius;
    for route in ["STEP", "UNV"] {
        if route == "UNV" {
            gmsh(&folder, "gmsh part.msh -save -o part.unv");
            fs::remove_file(folder.join("part.msh")).expect("the mesh");
        }
        gmsh(&folder, &shown(route, "sh"));
        run(1, &["case.yml", "-q", "-o", route], &folder).success();
        let loads = Table::read(&folder.join(route).join("loads.csv"));
        for (set, area, height) in
            [("bottom", bottom, 0.0), ("hole", 2.0 * PI * radius * thickness, thickness / 2.0)]
        {
            let name = |axis: &str| format!("{set}_{axis}");
            near(&[loads.only("boundary", &name("x")).last("force_x")], &[area], tolerance);
            // The centre of a force is known across its direction.
            let (along_x, along_y) = (centre(&loads, &name("x")), centre(&loads, &name("y")));
            near(&[along_y[0], along_x[1], along_x[2]], &[0.02, 0.01, height], tolerance);
        }
        let bodies = Table::read(&folder.join(route).join("bodies.csv"));
        near(&[bodies.last("mass")], &[bottom * thickness], tolerance);
    }
}
