#!/usr/bin/env python3
"""Figures of nearly incompressible bodies for docs/validation/incompressible.md, docs/how-to/rubber.md and
docs/performance/large-problems.md:

block       compression of the block under a partial load, and Newton iterations
increments  Newton iterations of a cube by the number of increments, at two Poisson's ratios
pad         the same of a pad in which a rigid disc or sphere presses and drags, at three ratios
solvers     CPU seconds of linear solvers on a block that is pressed on a plane and dragged
cost        CPU seconds, iterations and memory of a block that is pressed on a plane and dragged

    . scripts/environment; cargo build --release
    scripts/incompressible.py [block | increments | pad | solvers | cost]...      (all if absent; 25 minutes)
"""

import csv
import os
import re
import resource
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.path.join(ROOT, "target", "release", "contact-petsc")


def run(case, folder):
    """Runs a case; returns its output and its CPU seconds."""
    with open(os.path.join(folder, "case.yml"), "w") as file:
        file.write(case)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([PROGRAM, "case.yml", "-o", "out", "--anew"], cwd=folder, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"exit code {done.returncode}\n{case}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def iterations(folder):
    """Newton's and Krylov iterations of a run, with those of steps that were cut."""
    with open(os.path.join(folder, "out", "iterations.csv")) as file:
        rows = list(csv.DictReader(file))
    return sum(row["iteration"] != "0" for row in rows), sum(int(row["krylov_iterations"]) for row in rows)


def block(folder):
    with open(os.path.join(ROOT, "meshes", "cook", "block.yml")) as file:
        base = file.read()
    print("element  treatment         cells  80, 160, 240, 320 MPa in %      Newton")
    for element, locking, cells in [
        ("hex8", "mean_dilatation", 8),
        ("hex8", "patch_dilatation", 4),
        ("hex8", "patch_dilatation", 8),
        ("hex20", "patch_dilatation", 2),
        ("hex20", "patch_dilatation", 4),
        ("tet10", "mean_dilatation", 4),
        ("tet10", "patch_dilatation", 2),
        ("tet10", "patch_dilatation", 4),
        ("wedge6", "patch_dilatation", 4),
        ("wedge6", "patch_dilatation", 8),
        ("pyramid5", "patch_dilatation", 4),
        ("tet4", "patch_dilatation", 4),
        ("tet4", "patch_dilatation", 8),
        ("tet4", "patch_dilatation", 16),
    ]:
        case = base.replace("element: hex8", f"element: {element}")
        case = case.replace("cells: [4, 4, 4]", f"cells: [{cells}, {cells}, {cells}]")
        case = case.replace("locking: mean_dilatation", f"locking: {locking}")
        run(case, folder)
        with open(os.path.join(folder, "out", "probes.csv")) as file:
            rows = list(csv.DictReader(file))
        # The block is 50 mm high.
        at = {round(float(row["time [s]"]), 9): -2 * float(row["middle.u_z [mm]"]) for row in rows}
        found = ", ".join(f"{at[time]:.2f}" for time in (0.25, 0.5, 0.75, 1.0))
        print(f"{element:8} {locking:17} {cells:5}  {found:30}  {iterations(folder)[0]}", flush=True)


def increments(folder):
    print("element  treatment         Poisson's ratio  Newton iterations in 2, 10, 20 increments")
    for element, locking in [("tet4", "auto"), ("hex8", "auto"), ("hex8", "mean_dilatation"), ("hex8", "patch_dilatation")]:
        for ratio in (0.49, 0.4999):
            found = []
            for count in (2, 10, 20):
                run(
                    f"""dimension: 3
bodies:
  cube:
    mesh: {{ box: {{ min: [0, 0, 0], max: [1, 1, 1], cells: [3, 3, 3], element: {element} }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e+6, poisson_ratio: {ratio} }} }}
    locking: {locking}
boundary:
  clamp: {{ on: cube.bottom, displacement: {{ x: 0, y: 0, z: 0 }} }}
  press: {{ on: cube.top, traction: {{ x: "5e4 * t", z: "-5e4 * t" }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: {count} }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-10 }} }}
""",
                    folder,
                )
                found.append(str(iterations(folder)[0]))
            print(f"{element:8} {locking:17} {ratio:<16} {', '.join(found)}", flush=True)


def pad(folder):
    print("element  treatment         Newton iterations in 10, 40 increments at 0.49, 0.499, 0.4999")
    for element, locking in [
        ("quad4", "auto"),
        ("quad8", "auto"),
        ("tri6", "auto"),
        ("quad9", "mean_dilatation"),
        ("hex8", "auto"),
        ("tet4", "auto"),
    ]:
        is_plane = element in ("quad4", "quad8", "quad9", "tri6")
        box = (
            "min: [-0.1, 0], max: [0.1, 0.06], cells: [24, 10]"
            if is_plane
            else "min: [-0.1, -0.05, 0], max: [0.1, 0.05, 0.06], cells: [10, 6, 5]"
        )
        centre, up, still = ("0, 0.1001", "y", "x: 0, y: 0") if is_plane else ("0, 0, 0.1001", "z", "x: 0, y: 0, z: 0")
        found = []
        for ratio in (0.49, 0.499, 0.4999):
            counts = []
            for increments in (10, 40):
                run(
                    f"""dimension: {2 if is_plane else 3}
bodies:
  pad:
    mesh: {{ box: {{ {box}, element: {element} }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: {ratio} }} }}
    locking: {locking}
rigid:
  tool:
    shape: {{ sphere: {{ center: [{centre}], radius: 0.04 }} }}
    motion:
      translation:
        x: {{ table: [[0, 0], [0.5, 0], [1, 0.03]] }}
        {up}: {{ table: [[0, 0], [0.5, -0.015], [1, -0.015]] }}
contact:
  press:
    contactor: pad.top
    target: tool
    normal: {{ penalty: {{ compliance: 2.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 5.0e+9 }} }} }}
boundary: {{ clamp: {{ on: pad.bottom, displacement: {{ {still} }} }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: {increments} }} }} }}
""",
                    folder,
                )
                counts.append(str(iterations(folder)[0]))
            found.append(", ".join(counts))
        print(f"{element:8} {locking:17} {'; '.join(found)}", flush=True)


def solvers(folder):
    print("scheme   cells  Poisson's ratio  solver         CPU s  Newton  Krylov")
    for scheme, time, stick, sizes in [
        ("static", "{ end: 1, scheme: { static: { increments: 1 } } }", "stick_stiffness: 1.0e+10", (16, 24)),
        ("dynamic", "{ end: 0.004, step: 0.002 }", "stick_velocity: 1.0e-3", (16,)),
    ]:
        for cells in sizes:
            for ratio in (0.45, 0.49, 0.495, 0.499):
                for solver in ("auto", "gmres_asm_ilu", "filtered_ilu", "direct"):
                    _, seconds = run(
                        f"""dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0, 0], max: [0.1, 0.1, 0.05], cells: [{cells}, {cells}, {cells // 2}], element: hex8 }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: {ratio} }} }}
    density: 1100
obstacles: {{ ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }} }} }}
contact:
  sole:
    contactor: block.bottom
    target: ground
    normal: {{ penalty: {{ compliance: 1.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ {stick} }} }} }}
boundary: {{ top: {{ on: block.top, displacement: {{ x: "0.002 * t", y: 0, z: "-0.002 * t" }} }} }}
time: {time}
solver: {{ linear: {solver} }}
""",
                        folder,
                    )
                    newton, krylov = iterations(folder)
                    print(f"{scheme:8} {cells:5}  {ratio:<15}  {solver:14} {seconds:5.1f} {newton:7} {krylov:7}", flush=True)


def cost(folder):
    print("scheme   element  treatment            CPU s  Newton  Krylov   MiB")
    schemes = [
        ("dynamic", "{ end: 0.02, step: 0.002 }", "stick_velocity: 1.0e-3"),
        ("static", "{ end: 1, scheme: { static: { increments: 3 } } }", "stick_stiffness: 1.0e+10"),
    ]
    for scheme, time, stick in schemes:
        for element, locking in [
            ("hex8", "selective_reduced"),
            ("hex8", "patch_dilatation"),
            ("wedge6", "patch_dilatation"),
            ("tet4", "none"),
            ("tet4", "patch_dilatation"),
        ]:
            said, seconds = run(
                f"""dimension: 3
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0, 0], max: [0.1, 0.1, 0.05], cells: [16, 16, 8], element: {element} }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: 0.499 }} }}
    density: 1100
    locking: {locking}
obstacles: {{ ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }} }} }}
contact:
  sole:
    contactor: block.bottom
    target: ground
    normal: {{ penalty: {{ compliance: 1.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ {stick} }} }} }}
boundary: {{ top: {{ on: block.top, displacement: {{ x: "0.002 * t", y: 0, z: "-0.002 * t" }} }} }}
time: {time}
""",
                folder,
            )
            newton, krylov = iterations(folder)
            memory = re.search(r"memory +(\d+) MiB", said)
            print(f"{scheme:8} {element:8} {locking:18} {seconds:7.1f} {newton:7} {krylov:7} {memory and memory[1]:>5}", flush=True)


def main():
    parts = {"block": block, "increments": increments, "pad": pad, "solvers": solvers, "cost": cost}
    wanted = sys.argv[1:] or list(parts)
    for name in wanted:
        if name not in parts:
            sys.exit(f"incompressible.py: there is no part '{name}'; known: {', '.join(parts)}")
        with tempfile.TemporaryDirectory() as folder:
            parts[name](folder)


if __name__ == "__main__":
    main()
