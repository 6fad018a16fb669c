#!/usr/bin/env python3
"""Reference values of this scene: an inextensible elastic ring under pressure that acts on its outer face.

Forces are in E I / R^2, pressures in E I / R^3, lengths in R. The ring is cut at its lowest point and
at y = 0. The equations of a planar rod are integrated from one cut to the other, and Newton's method
finds the unknowns at the first cut. With zero thickness the sides touch at 5.247, and the contact is
flat from 10.34 on (Flaherty, Keller, Rubinow, SIAM J. Appl. Math. 23, 1972).
"""
import sys
from math import cos, pi, sin

STEPS = 200


def other_cut(place, axial, curvature, pressure, shear, thickness):
    """x, y, angle, curvature, force_x, force_y at y = 0, from those at the lowest point."""

    def slopes(state):
        _, _, angle, bend, force_x, force_y = state
        load = pressure * (1 + bend * thickness / 2)
        moment = -(cos(angle) * force_y - sin(angle) * force_x)
        return cos(angle), sin(angle), bend, moment, load * sin(angle), -load * cos(angle)

    def moved(state, by, length):
        return tuple(a + length * b for a, b in zip(state, by))

    state, h = (0, place, 0, curvature, axial, shear), pi / 2 / STEPS
    for _ in range(STEPS):
        k1 = slopes(state)
        k2 = slopes(moved(state, k1, h / 2))
        k3 = slopes(moved(state, k2, h / 2))
        k4 = slopes(moved(state, k3, h))
        state = tuple(s + h / 6 * (a + 2 * b + 2 * c + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4))
    return state


def misses(state):
    return [state[1], state[2] - pi / 2, state[4]]


def solve(rows, right):
    size = len(right)
    rows = [row + [value] for row, value in zip(rows, right)]
    for i in range(size):
        pivot = max(range(i, size), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(size):
            if r != i:
                factor = rows[r][i] / rows[i][i]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i])]
    return [rows[i][size] / rows[i][i] for i in range(size)]


def newton(function, x):
    for _ in range(80):
        value = function(x)
        if max(map(abs, value)) < 1e-11:
            return x
        columns = []
        for j in range(len(x)):
            up, down = x[:], x[:]
            up[j], down[j] = x[j] + 1e-6, x[j] - 1e-6
            columns.append([(a - b) / 2e-6 for a, b in zip(function(up), function(down))])
        step = solve([list(row) for row in zip(*columns)], [-v for v in value])
        part = min(1, 0.3 / max(map(abs, step)))
        x = [a + part * b for a, b in zip(x, step)]
    sys.exit("no convergence")


def main():
    thickness = float(sys.argv[1]) if len(sys.argv) > 1 else 0.02
    unknowns = [-2.6, 0.6, 3.05]  # axial force, curvature, pressure
    for place in [-0.85 + 0.02 * i for i in range(41)] + [-thickness / 2]:
        unknowns = newton(lambda u: misses(other_cut(place, u[0], u[1], u[2], 0.0, thickness)), unknowns)
    axial, curvature, first = unknowns
    print(f"the sides touch at a pressure of {first:.4f}")
    unknowns = [axial, curvature, 0.0]  # axial force, curvature, half of the contact force
    for pressure in [6, 7, 8, 9, 10]:
        unknowns = newton(
            lambda u: misses(other_cut(-thickness / 2, u[0], u[1], pressure, u[2], thickness)), unknowns
        )
        print(f"pressure {pressure}: contact force on half of the ring {unknowns[2]:.4f}")
    unknowns = [unknowns[0], 10.0, unknowns[2]]  # axial force, pressure, half of the contact force
    unknowns = newton(lambda u: misses(other_cut(-thickness / 2, u[0], 0.0, u[1], u[2], thickness)), unknowns)
    print(f"the sides are flat where they touch from a pressure of {unknowns[1]:.4f} on")


main()
