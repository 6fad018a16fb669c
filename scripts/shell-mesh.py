#!/usr/bin/env python3
"""Writes an eighth of a spherical shell in Gmsh's format 2.2, and prints the corners of facets on one of
its surfaces.

Three patches of CELLS by CELLS elements meet on the diagonal. Their edges divide angles evenly. All
nodes, including mid-side nodes, lie on spheres. Sets: inner, outer, and the symmetry planes x, y, z.

usage: shell-mesh.py ELEMENT CELLS LAYERS INNER_RADIUS OUTER_RADIUS FILE SET
ELEMENT is hex8, hex20 or hex27; SET is inner or outer.
"""

import math
import sys

CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
FACES = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
# Gmsh's type numbers of the element and of its facets.
KINDS = {"hex8": (5, 3), "hex20": (17, 16), "hex27": (12, 10)}
SETS = ["inner", "outer", "x", "y", "z"]


def mean(points):
    return tuple(sum(values) // len(points) for values in zip(*points))


def offsets(element):
    """Positions of the nodes of an element on a lattice of half its size, in Gmsh's order."""
    places = list(CORNERS)
    if element != "hex8":
        places += [mean([CORNERS[a] for a in edge]) for edge in EDGES]
    if element == "hex27":
        places += [mean([CORNERS[a] for a in face]) for face in FACES] + [(1, 1, 1)]
    return places


def facet_offsets(element, face):
    """Positions of the nodes of a facet."""
    corners = [CORNERS[a] for a in face]
    places = list(corners)
    if element != "hex8":
        places += [mean([corners[k], corners[(k + 1) % 4]]) for k in range(4)]
    if element == "hex27":
        places.append(mean(corners))
    return places


def main():
    element, cells, layers = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    low, high = float(sys.argv[4]), float(sys.argv[5])
    file, wanted = sys.argv[6], sys.argv[7]
    numbers, points = {}, []

    def node(patch, place):
        i, j, k = place
        direction = [math.tan(math.pi / 8 * i / cells), math.tan(math.pi / 8 * j / cells), 1.0]
        direction = direction[-patch:] + direction[:-patch] if patch else direction
        size = math.sqrt(sum(value * value for value in direction))
        radius = low + (high - low) * k / (2 * layers)
        point = [radius * value / size for value in direction]
        key = tuple(round(value * 1e9) for value in point)
        if key not in numbers:
            points.append(point)
            numbers[key] = len(points)
        return numbers[key]

    solids, facets, corners = [], [], set()
    for patch in range(3):
        for i in range(cells):
            for j in range(cells):
                for k in range(layers):
                    def at(places):
                        return [node(patch, (2 * i + a, 2 * j + b, 2 * k + c)) for a, b, c in places]

                    solids.append(at(offsets(element)))
                    # `direction` is rotated by `patch` positions, so the plane of the first
                    # coordinate is that of axis `patch`.
                    sides = [(k == 0, 0, "inner"), (k == layers - 1, 5, "outer")]
                    sides += [(i == 0, 2, "xyz"[patch]), (j == 0, 1, "xyz"[(patch + 1) % 3])]
                    for lies, face, name in sides:
                        if lies:
                            nodes = at(facet_offsets(element, FACES[face]))
                            facets.append((SETS.index(name) + 1, nodes))
                            if name == wanted:
                                corners.update(nodes[:4])
    solid, facet = KINDS[element]
    with open(file, "w") as out:
        out.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n6\n")
        for number, name in enumerate(SETS):
            out.write(f'2 {number + 1} "{name}"\n')
        out.write('3 6 "shell"\n$EndPhysicalNames\n')
        out.write(f"$Nodes\n{len(points)}\n")
        for number, point in enumerate(points):
            out.write(f"{number + 1} {point[0]:.17g} {point[1]:.17g} {point[2]:.17g}\n")
        out.write(f"$EndNodes\n$Elements\n{len(facets) + len(solids)}\n")
        for number, (group, nodes) in enumerate(facets):
            out.write(f"{number + 1} {facet} 2 {group} {group} {' '.join(map(str, nodes))}\n")
        for number, nodes in enumerate(solids):
            out.write(f"{len(facets) + number + 1} {solid} 2 6 6 {' '.join(map(str, nodes))}\n")
        out.write("$EndElements\n")
    for corner in sorted(corners):
        print(*(f"{value:.17g}" for value in points[corner - 1]))


main()
