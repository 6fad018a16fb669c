#!/usr/bin/env python3
"""Converts a mesh to an input file (.inp) that contact-petsc reads, and keeps its sets.

usage: scripts/convert-mesh.py IN OUT.inp [--array NAME]

Exodus (.e, .exo, .g): blocks become element sets, side sets become surfaces, node sets stay.
Needs netCDF4 (pip install netCDF4).

MED 3 or newer (.med): groups of solids become element sets, groups of facets become surfaces, groups
of nodes become node sets. Groups of edges of solids become node sets. Needs h5py (pip install h5py).

All other formats are read by meshio (pip install meshio): VTU, VTK, XDMF, ... Cell sets become
element sets, or surfaces if their cells are facets; point sets become node sets. --array NAME is an
array of integers on the cells, as in VTU files: value 3 becomes the set NAME-3.

Gmsh converts STEP and UNV, see docs/how-to/meshes-from-elsewhere.md.
"""

import argparse
import sys
from pathlib import Path

# Type in Abaqus for each type of meshio, in 2D and in 3D. Nodes are in the order of VTK.
SOLIDS = {
    2: {"triangle": "CPE3", "triangle6": "CPE6", "quad": "CPE4", "quad8": "CPE8"},
    3: {"tetra": "C3D4", "tetra10": "C3D10", "pyramid": "C3D5", "wedge": "C3D6", "hexahedron": "C3D8",
        "hexahedron20": "C3D20"},
}
FACETS = {2: {"line": 2, "line3": 2}, 3: {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4}}

# Corners of faces S1, S2, ... by the number of corners of the element.
FACES = {
    (2, 3): [(0, 1), (1, 2), (2, 0)],
    (2, 4): [(0, 1), (1, 2), (2, 3), (3, 0)],
    (3, 4): [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    (3, 5): [(0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)],
    (3, 6): [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    (3, 8): [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)],
}
CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "tetra": 4, "tetra10": 4,
           "pyramid": 5, "wedge": 6, "hexahedron": 8, "hexahedron20": 8}

# Exodus: type in meshio by shape and number of nodes, and the face of each side.
EXODUS = {("TRI", 3): "triangle", ("TRI", 6): "triangle6", ("QUA", 4): "quad", ("QUA", 8): "quad8",
          ("TET", 4): "tetra", ("TET", 10): "tetra10", ("PYR", 5): "pyramid", ("WED", 6): "wedge",
          ("HEX", 8): "hexahedron", ("HEX", 20): "hexahedron20"}
EXODUS_SIDES = {3: [1, 2, 3], 4: [1, 2, 3, 4], "tetra": [2, 3, 4, 1], 5: [2, 3, 4, 5, 1], 6: [3, 4, 5, 1, 2],
                8: [3, 4, 5, 6, 1, 2]}
# The midside nodes of the upright edges come before those of the top.
EXODUS_HEX20 = list(range(12)) + [16, 17, 18, 19, 12, 13, 14, 15]

# MED: type in meshio by the name of the type in the file.
MED = {"PO1": "vertex", "SE2": "line", "SE3": "line3", "TR3": "triangle", "TR6": "triangle6", "QU4": "quad",
       "QU8": "quad8", "TE4": "tetra", "T10": "tetra10", "PY5": "pyramid", "PE6": "wedge", "HE8": "hexahedron",
       "H20": "hexahedron20"}
# MED numbers the nodes of the base of a solid in the other direction of rotation than VTK.
MIRRORED = {"tetra": [0, 2, 1, 3], "tetra10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8], "pyramid": [0, 3, 2, 1, 4],
            "wedge": [0, 2, 1, 3, 5, 4], "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5],
            "hexahedron20": [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17]}
# Number of nodes of the base, which come first.
BASE = {"tetra": 3, "tetra10": 3, "pyramid": 4, "wedge": 3, "hexahedron": 4, "hexahedron20": 4}


class Output:
    """Blocks and sets, with numbers from zero."""

    def __init__(self, points, dimension):
        self.points, self.dimension = points, dimension
        self.blocks = []  # (type of meshio, nodes)
        self.elements, self.nodes, self.surfaces = {}, {}, {}

    def count(self):
        return sum(len(nodes) for _, nodes in self.blocks)

    def write(self, path):
        with open(path, "w", encoding="utf-8") as file:
            print("*NODE", file=file)
            for number, point in enumerate(self.points, 1):
                x = [float(value) for value in point] + [0.0] * (3 - len(point))
                print(f"{number}, {x[0]!r}, {x[1]!r}, {x[2]!r}", file=file)
            number = 0
            for kind, cells in self.blocks:
                print(f"*ELEMENT, TYPE={SOLIDS[self.dimension][kind]}", file=file)
                for cell in cells:
                    number += 1
                    nodes = [str(node + 1) for node in cell]
                    lines = [", ".join(nodes[k:k + 10]) for k in range(0, len(nodes), 10)]
                    print(f"{number}, " + ",\n".join(lines), file=file)
            for keyword, sets in [("NSET", self.nodes), ("ELSET", self.elements)]:
                for name, members in sets.items():
                    print(f'*{keyword}, {keyword}="{name}"', file=file)
                    for member in sorted(set(members)):
                        print(f"{member + 1},", file=file)
            for name, faces in self.surfaces.items():
                print(f'*SURFACE, NAME="{name}", TYPE=ELEMENT', file=file)
                for element, face in sorted(set(faces)):
                    print(f"{element + 1}, S{face}", file=file)

    def summary(self):
        sizes = [("element set", self.elements), ("surface", self.surfaces), ("node set", self.nodes)]
        yield f"{len(self.points)} nodes, {self.count()} elements"
        for what, sets in sizes:
            for name, members in sets.items():
                yield f"{what} {name}: {len(set(members))}"


def from_exodus(path):
    import netCDF4

    data = netCDF4.Dataset(path)
    get = data.variables

    def names(variable, count, prefix):
        if variable in get:
            rows = netCDF4.chartostring(get[variable][:].filled(b"\0"), encoding="utf-8")
            found = [str(row).strip("\0 ") for row in rows]
        else:
            found = [""] * count
        return [name or f"{prefix}{k}" for k, name in enumerate(found, 1)]

    def size(dimension):
        return len(data.dimensions[dimension]) if dimension in data.dimensions else 0

    axes = size("num_dim")
    if "coord" in get:
        points = get["coord"][:].filled().T
    else:
        points = list(zip(*(get["coord" + axis][:].filled() for axis in "xyz"[:axes])))
    out = Output(points, axes)
    kinds = []
    for k, name in enumerate(names("eb_names", size("num_el_blk"), "block"), 1):
        variable = get[f"connect{k}"]
        cells = variable[:].filled() - 1
        kind = EXODUS.get((variable.elem_type[:3].upper(), cells.shape[1]))
        if kind not in SOLIDS[axes]:
            sys.exit(f"block {name}: {variable.elem_type} with {cells.shape[1]} nodes can not be converted")
        if kind == "hexahedron20":
            cells = cells[:, EXODUS_HEX20]
        out.elements[name] = list(range(out.count(), out.count() + len(cells)))
        kinds += [kind] * len(cells)
        out.blocks.append((kind, cells))
    for k, name in enumerate(names("ss_names", size("num_side_sets"), "side"), 1):
        faces = out.surfaces.setdefault(name, [])
        for element, side in zip(get[f"elem_ss{k}"][:].filled(), get[f"side_ss{k}"][:].filled()):
            kind = kinds[element - 1]
            sides = EXODUS_SIDES["tetra" if kind.startswith("tetra") else CORNERS[kind]]
            faces.append((int(element) - 1, sides[side - 1]))
    for k, name in enumerate(names("ns_names", size("num_node_sets"), "nodes"), 1):
        out.nodes[name] = [int(node) - 1 for node in get[f"node_ns{k}"][:].filled()]
    return out


def is_mirrored(kind, points):
    """Whether solids have the order of MED, by the sum of their signed volumes. `points` are the
    positions of the nodes of each solid."""
    import numpy

    base, rest = points[:, :BASE[kind]], points[:, BASE[kind]:CORNERS[kind]]
    normals = numpy.cross(base[:, 1] - base[:, 0], base[:, -1] - base[:, 0])
    heights = rest.mean(axis=1) - base.mean(axis=1)
    return (normals * heights).sum() < 0


def from_med(path):
    import h5py

    with h5py.File(path) as data:
        meshes = data.get("ENS_MAA", {})
        if len(meshes) != 1:
            sys.exit(f"the file has {len(meshes)} meshes; it must have one")
        (mesh, steps), = meshes.items()
        if "NOE" in steps:
            sys.exit("this is a file of MED 2; save it as MED 3 or newer")
        if len(steps) != 1:
            sys.exit(f"mesh {mesh} has {len(steps)} time steps; it must have one")
        step, = steps.values()
        if "MAI" not in step or "COO" not in step.get("NOE", ()):
            sys.exit(f"mesh {mesh} has no unstructured cells")

        def members(kind, entities, count):
            """Numbers from zero of the nodes or cells of each group."""
            names = {}
            for family in data.get(f"FAS/{mesh}/{kind}", {}).values():
                if "GRO" in family:
                    texts = [bytes(name).split(b"\0")[0].decode(errors="replace") for name in family["GRO/NOM"][:]]
                    names[int(family.attrs["NUM"])] = [text.strip() for text in texts]
            groups = {}
            for number, family in enumerate(entities["FAM"][:] if "FAM" in entities else [0] * count):
                for name in names.get(int(family), []):
                    groups.setdefault(name, []).append(number)
            return groups

        points = step["NOE/COO"][:].reshape(int(steps.attrs["ESP"]), -1).T
        point_sets = members("NOEUD", step["NOE"], len(points))
        blocks, cell_sets = [], {}
        for index, (name, cells) in enumerate(step["MAI"].items()):
            if name not in MED:
                sys.exit(f"cells of type {name} can not be converted")
            kind = MED[name]
            nodes = cells["NOD"][:].reshape(-1, int(cells["NOD"].attrs["NBR"])).T - 1
            # Some programs, such as meshio, write the order of VTK.
            if kind in MIRRORED and is_mirrored(kind, points[nodes]):
                nodes = nodes[:, MIRRORED[kind]]
            blocks.append((kind, nodes))
            for group, numbers in members("ELEME", cells, len(nodes)).items():
                cell_sets.setdefault(group, {})[index] = numbers
    out, add = from_cells(points, blocks)
    for name, of_blocks in cell_sets.items():
        for index, numbers in of_blocks.items():
            add(name, index, numbers)
    for name, nodes in point_sets.items():
        out.nodes.setdefault(name, []).extend(nodes)
    return out


def from_cells(points, blocks):
    """The output without sets, and a function that adds cells of a block to a set. A block is a type of
    meshio and the nodes of its cells, solids or facets."""
    dimension = 3 if any(kind in SOLIDS[3] for kind, _ in blocks) else 2
    out = Output(points, dimension)
    first, faces = [], {}
    for kind, cells in blocks:
        first.append(out.count())
        if kind in SOLIDS[dimension]:
            corners = CORNERS[kind]
            for k, cell in enumerate(cells):
                for face, local in enumerate(FACES[dimension, corners], 1):
                    faces.setdefault(tuple(sorted(cell[c] for c in local)), []).append((first[-1] + k, face))
            out.blocks.append((kind, cells))
        elif kind not in FACETS[dimension] and kind not in ("vertex", "line", "line3"):
            sys.exit(f"cells of type {kind} can not be converted")

    def add(name, index, members):
        kind, cells = blocks[index]
        if kind in SOLIDS[dimension]:
            out.elements.setdefault(name, []).extend(first[index] + int(k) for k in members)
        elif kind in FACETS[dimension]:
            for k in members:
                corners = cells[k][:FACETS[dimension][kind]]
                found = faces.get(tuple(sorted(corners)), [])
                if len(found) != 1:
                    sys.exit(f"{name}: a facet bounds {len(found)} elements; it must bound one")
                out.surfaces.setdefault(name, []).extend(found)
        else:
            out.nodes.setdefault(name, []).extend(int(node) for k in members for node in cells[k])

    return out, add


def from_meshio(path, array):
    import meshio

    mesh = meshio.read(path)
    out, add = from_cells(mesh.points, [(block.type, block.data) for block in mesh.cells])
    for name, members in mesh.cell_sets.items():
        if not name.startswith("gmsh:"):
            for index, cells in enumerate(members):
                if cells is not None and len(cells) > 0:
                    add(name, index, cells)
    if array is not None:
        if array not in mesh.cell_data:
            sys.exit(f"no cells have an array '{array}'; known: {', '.join(mesh.cell_data) or 'none'}")
        for index, values in enumerate(mesh.cell_data[array]):
            for k, value in enumerate(values):
                if value != 0:
                    add(f"{array}-{int(value)}", index, [k])
    for name, nodes in mesh.point_sets.items():
        out.nodes[name] = [int(node) for node in nodes]
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("--array")
    options = parser.parse_args()
    suffix = Path(options.input).suffix.lower()
    if suffix in (".e", ".ex2", ".exo", ".g"):
        out = from_exodus(options.input)
    elif suffix == ".med":
        out = from_med(options.input)
    else:
        out = from_meshio(options.input, options.array)
    if out.count() == 0:
        sys.exit("the mesh has no triangles, quadrilaterals, tetrahedra, pyramids, wedges or hexahedra")
    out.write(options.output)
    print("\n".join(out.summary()))


main()
