#!/usr/bin/env python3
"""Fits the laws of rubber to measured curves and prints the material of a case.

A curve is a table uniaxial.csv, equibiaxial.csv or pure-shear.csv with the columns stretch and
nominal_stress [UNIT]. The rubber is taken as incompressible: the bulk modulus is not in such data.
Each curve counts the same: its error is the root of the mean square of the difference, over the root
of the mean square of the measured stress. The fit minimises the sum of the squares of these errors.

The coefficients that are factors of the stress follow from linear least squares. The others (lambda_m,
j_m, the exponents of Ogden's law) are found by the method of Levenberg and Marquardt.

usage: scripts/fit-rubber.py [--law LAW] [--fit CURVE,CURVE] [--bulk-modulus "2 GPa"] [FOLDER]
  FOLDER   folder of the curves (meshes/treloar)
  --law    one law in place of all
  --fit    curves that are fitted (all of the folder); errors are printed for all
Needs Python only.
"""
import argparse
import csv
import pathlib
from math import exp, log, sqrt

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Principal stretches; the first is pulled, and the last side is free.
CURVES = {
    "uniaxial": lambda l: (l, l**-0.5, l**-0.5),
    "equibiaxial": lambda l: (l, l, l**-2),
    "pure-shear": lambda l: (l, 1.0, 1 / l),
}
LANGEVIN = [1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750]


# Laws. Each gives the derivatives of the energy by a principal stretch, one for each factor, from the
# stretch, the first invariant and the parameters that are not factors.


def mooney_rivlin(stretch, _first, _shape):
    return [2 * stretch, -2 * stretch**-3]


def yeoh(stretch, first, _shape):
    return [2 * stretch * k * (first - 3) ** (k - 1) for k in (1, 2, 3)]


def arruda_boyce(stretch, first, shape):
    square = shape[0] ** 2
    return [2 * stretch * sum(k * c * (first / square) ** (k - 1) for k, c in enumerate(LANGEVIN, 1))]


def gent(stretch, first, shape):
    return [stretch * shape[0] / (shape[0] - (first - 3))]


def ogden(stretch, _first, shape):
    return [stretch ** (alpha - 1) for alpha in shape]


class Law:
    """A law, its parameters that are not factors from unbounded numbers, and the text of a case."""

    def __init__(self, slopes, start, shape, text):
        self.slopes, self.start, self.shape, self.text = slopes, start, shape, text


def laws(largest):
    """All laws. `largest` is the largest `I1 - 3` of the curves, which Gent's law has to reach."""
    return {
        "mooney_rivlin": Law(
            mooney_rivlin, [], lambda q: q, lambda f, _, u: f"c10: {number(f[0], u)}, c01: {number(f[1], u)}"
        ),
        "yeoh": Law(
            yeoh, [], lambda q: q, lambda f, _, u: ", ".join(f"c{k}: {number(c, u)}" for k, c in enumerate(f, 1))
        ),
        "arruda_boyce": Law(
            arruda_boyce,
            [log(3.0)],
            lambda q: [1 + limited(q[0])],
            lambda f, s, u: f"mu: {number(f[0], u)}, lambda_m: {s[0]:.6g}",
        ),
        "gent": Law(
            gent,
            [log(0.3 * largest)],
            lambda q: [largest + limited(q[0])],
            lambda f, s, u: f"mu: {number(f[0], u)}, j_m: {s[0]:.6g}",
        ),
        # Starts from the exponents of Ogden's fit to Treloar's curves (1972).
        "ogden": Law(
            ogden,
            [1.3, 5.0, -2.0],
            lambda q: q,
            lambda f, s, u: "terms: ["
            + ", ".join(f"{{ mu: {number(mu, u)}, alpha: {alpha:.6g} }}" for mu, alpha in zip(f, s))
            + "]",
        ),
    }


def number(value, unit):
    return f'"{value:.6g} {unit}"'


def limited(x):
    """The exponential function up to 1000: curves that do not turn up have no limiting stretch."""
    return exp(min(x, log(1000.0)))


def first_invariant(stretches):
    return sum(value * value for value in stretches)


def basis(law, shape, curve, stretch):
    """Nominal stresses of the factors. The pressure makes the last stress vanish."""
    stretches = CURVES[curve](stretch)
    first = first_invariant(stretches)
    pulled = law.slopes(stretches[0], first, shape)
    free = law.slopes(stretches[2], first, shape)
    return [a - stretches[2] / stretches[0] * b for a, b in zip(pulled, free)]


def solve(rows, right):
    """The solution of linear equations by elimination."""
    size = len(right)
    rows = [list(row) + [value] for row, value in zip(rows, right)]
    for i in range(size):
        pivot = max(range(i, size), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(size):
            if r != i:
                factor = rows[r][i] / rows[i][i]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i])]
    return [rows[i][size] / rows[i][i] for i in range(size)]


def least_squares(columns, right):
    """Coefficients of the columns by the method of Gram and Schmidt, applied twice."""
    size = len(columns)
    orthogonal, upper = [], [[0.0] * size for _ in range(size)]
    for k, column in enumerate(columns):
        rest = list(column)
        for _ in range(2):
            for j, other in enumerate(orthogonal):
                part = sum(a * b for a, b in zip(rest, other))
                upper[j][k] += part
                rest = [a - part * b for a, b in zip(rest, other)]
        upper[k][k] = sqrt(sum(a * a for a in rest))
        orthogonal.append([a / upper[k][k] for a in rest])
    return solve(upper, [sum(a * b for a, b in zip(column, right)) for column in orthogonal])


def factors_and_rests(law, shape, points):
    """Factors of the best fit with this shape, and the weighted differences from the points."""
    rows = [[weight * part for part in basis(law, shape, curve, l)] for curve, l, _, weight in points]
    right = [weight * stress for _, _, stress, weight in points]
    factors = least_squares([list(column) for column in zip(*rows)], right)
    rests = [sum(f * part for f, part in zip(factors, row)) - value for row, value in zip(rows, right)]
    return factors, rests


def fit(law, points):
    """Factors and shape of the best fit: Levenberg and Marquardt for the shape."""
    at, damping = list(law.start), 1e-2

    def rests_at(q):
        return factors_and_rests(law, law.shape(q), points)[1]

    rests = rests_at(at)
    size = sum(r * r for r in rests)
    for _ in range(500 if at else 0):
        columns = []
        for k in range(len(at)):
            step = 1e-6 * max(1.0, abs(at[k]))
            ends = [rests_at([q + sign * step * (j == k) for j, q in enumerate(at)]) for sign in (1, -1)]
            columns.append([(a - b) / (2 * step) for a, b in zip(*ends)])
        normal = [[sum(a * b for a, b in zip(one, other)) for other in columns] for one in columns]
        slope = [-sum(a * b for a, b in zip(column, rests)) for column in columns]
        for k, row in enumerate(normal):
            # At a bound the slope is zero.
            row[k] = max((1 + damping) * row[k], 1e-30)
        move = solve(normal, slope)
        trial = [a + b for a, b in zip(at, move)]
        new = rests_at(trial)
        new_size = sum(r * r for r in new)
        if new_size <= size:
            at, rests, size, damping = trial, new, new_size, 0.2 * damping
            if max(map(abs, move)) < 1e-10:
                break
        else:
            damping *= 10
            if damping > 1e12:
                break
    shape = law.shape(at)
    return factors_and_rests(law, shape, points)[0], shape


def error(law, factors, shape, curve, points):
    """Root of the mean square of the difference over that of the measured stress."""
    off, size = 0.0, 0.0
    for stretch, stress in points:
        found = sum(f * part for f, part in zip(factors, basis(law, shape, curve, stretch)))
        off += (found - stress) ** 2
        size += stress**2
    return sqrt(off / size)


def read(file):
    """Points of a curve without the state at rest, and the unit of the stress."""
    with file.open() as table:
        (_, title), *rows = list(csv.reader(table))
    points = [(float(stretch), float(stress)) for stretch, stress in rows]
    return [point for point in points if point[0] != 1], title.split("[")[1].rstrip("] ")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=ROOT / "meshes/treloar", type=pathlib.Path)
    parser.add_argument("--law")
    parser.add_argument("--fit")
    parser.add_argument("--bulk-modulus", default="2 GPa")
    given = parser.parse_args()

    curves, units = {}, set()
    for curve in CURVES:
        if (given.folder / f"{curve}.csv").exists():
            curves[curve], unit = read(given.folder / f"{curve}.csv")
            units.add(unit)
    if len(units) != 1:
        parser.error(f"{given.folder}: expected curves {', '.join(CURVES)} with one unit, found {sorted(units)}")
    used = given.fit.split(",") if given.fit else list(curves)
    if set(used) - set(curves):
        parser.error(f"--fit: there is no curve {', '.join(sorted(set(used) - set(curves)))}")
    points = []
    for curve in used:
        weight = 1 / sqrt(sum(stress * stress for _, stress in curves[curve]))
        points += [(curve, stretch, stress, weight) for stretch, stress in curves[curve]]

    largest = max(
        first_invariant(CURVES[curve](stretch)) - 3 for curve, points in curves.items() for stretch, _ in points
    )
    known = laws(largest)
    if given.law and given.law not in known:
        parser.error(f"--law: expected one of {', '.join(known)}")
    for name in [given.law] if given.law else known:
        law = known[name]
        factors, shape = fit(law, points)
        errors = [f"{curve} {100 * error(law, factors, shape, curve, curves[curve]):.1f} %" for curve in curves]
        print(f"# errors: {', '.join(errors)}")
        text = law.text(factors, shape, units.copy().pop())
        print(f"material: {{ {name}: {{ {text}, bulk_modulus: \"{given.bulk_modulus}\" }} }}")


if __name__ == "__main__":
    main()
