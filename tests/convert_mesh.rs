//! `scripts/convert-mesh.py`: meshes in Exodus and VTU keep their elements and sets on the way to a
//! run.

mod common;

use std::process::Command;

use common::{Folder, Table, near, run};

/// Writes `mesh.e` and `mesh.vtu` with one element of each kind in space, 3 m apart. The sides of
/// Exodus are sets, and the VTU has them as cells with an array of integers.
const WRITER: &str = r#"
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

/// A case with a unit traction on each of these sides of a converted mesh.
fn case(sides: &[String]) -> String {
    let loads: Vec<String> = sides
        .iter()
        .map(|side| format!("  {side}: {{ on: block.{side}, traction: {{ x: 1 }} }}\n"))
        .collect();
    format!(
        "dimension: 3
bodies:
  block:
    mesh: {{ file: mesh.inp }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
    density: 1
boundary:
{}time: {{ end: 1.0e-6, step: 1.0e-6 }}
output: {{ loads: true, bodies: true }}
",
        loads.concat()
    )
}

/// Runs Debian's Python, which has meshio and netCDF4, in a folder.
fn python(folder: &Folder, arguments: &[&str]) -> String {
    let output = Command::new("/usr/bin/python3").args(arguments).current_dir(&**folder).output();
    let output = output.expect("Debian's Python: run scripts/setup --tests");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The centre of a traction on each set of sides is that of the side of its number in the format,
/// and the mass that of the elements.
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
    for (input, arguments, mass) in
        [("mesh.e", &[][..], 3.0 + 1.0 / 6.0), ("mesh.vtu", &["--array", "part"], 2.0)]
    {
        let summary = python(&folder, &[&[script, input, "mesh.inp"], arguments].concat());
        // The set in the converted mesh, and the name of its side.
        let sides: Vec<(String, &[f64])> = match arguments {
            [] => centres.iter().map(|(name, centre)| (name.clone(), centre.as_slice())).collect(),
            _ => {
                let of = |name: &String| centres.iter().find(|(known, _)| known == name);
                let found =
                    named.iter().filter_map(|(set, name)| Some((set.clone(), of(name)?.1.as_slice())));
                found.collect()
            }
        };
        assert_eq!(sides.len(), if arguments.is_empty() { 30 } else { 20 });
        assert!(sides.iter().all(|(name, _)| summary.contains(&format!("surface {name}: 1"))), "{summary}");
        let sets: Vec<String> = sides.iter().map(|(set, _)| set.clone()).collect();
        folder.write("case.yml", &case(&sets));
        run(1, &["case.yml", "-q", "-o", input.trim_start_matches("mesh.")], &folder).success();
        let table = |name: &str| Table::read(&folder.join(input.trim_start_matches("mesh.")).join(name));
        let loads = table("loads.csv");
        for (name, centre) in sides {
            let load = loads.only("boundary", &name);
            near(&["x", "y", "z"].map(|axis| load.last(&format!("centre_{axis}"))), centre, 1e-9);
        }
        near(&[table("bodies.csv").last("mass")], &[mass], 1e-12);
    }
}
