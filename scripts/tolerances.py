#!/usr/bin/env python3
"""Measures what Newton's tolerance and inexact linear solves cost, and the errors they cause.

Runs scenes with several tolerances and compares forces, reactions and probes of all instants with
those of a run with tolerances of 1e-12. An error is the largest difference, relative to the largest
value of the same unit in its table. CPU seconds are user time and valid on a busy machine.

usage: scripts/tolerances.py [SCENE ...]     scenes as rubber-block/case; default: all but long ones
  PROGRAM   the program (target/release/contact-petsc)
Needs PyYAML. Writes results/tolerances.csv.
"""
import csv
import glob
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent
MESHES = ROOT / "meshes"
PROGRAM = os.environ.get("PROGRAM", ROOT / "target/release/contact-petsc")
TABLES = ["contact.csv", "reactions.csv", "probes.csv"]
QUANTITIES = ["force", "u_"]
VARIANTS = {
    "reference": ({"tolerance": "1e-12"}, {"tolerance": "1e-12"}),
    "1e-9": ({"tolerance": "1e-9", "inexact": "false"}, None),
    "1e-9 inexact": ({"tolerance": "1e-9", "inexact": "true"}, None),
    "1e-7": ({"tolerance": "1e-7", "inexact": "false"}, None),
    "1e-7 inexact": ({"tolerance": "1e-7", "inexact": "true"}, None),
    "1e-6": ({"tolerance": "1e-6", "inexact": "false"}, None),
    "1e-6 inexact": ({"tolerance": "1e-6", "inexact": "true"}, None),
    "1e-5 inexact": ({"tolerance": "1e-5", "inexact": "true"}, None),
}


def mapping(entries):
    """A YAML mapping."""
    words = ", ".join(f"{key}: {value}" for key, value in entries.items())
    return yaml.compose("{ " + words + " }", Loader=yaml.SafeLoader)


def entry(parent, key, default=None):
    """The value of a key, which is added if it is missing and has a default."""
    for name, value in parent.value:
        if name.value == key:
            return value
    if default is not None:
        parent.value.append((yaml.ScalarNode("tag:yaml.org,2002:str", key), default))
    return default


def replace(parent, key, value):
    """Gives a key another value."""
    parent.value = [pair for pair in parent.value if pair[0].value != key]
    entry(parent, key, value)


def case_text(scene, newton, krylov):
    """The scene with these tolerances."""
    case = yaml.compose((MESHES / f"{scene}.yml").read_text(), Loader=yaml.SafeLoader)
    solver = entry(case, "solver", mapping({}))
    replace(solver, "newton", mapping(newton))
    if krylov:
        replace(solver, "krylov", mapping(krylov))
    return yaml.serialize(case, width=100000)


def run(scene, name, folder):
    """CPU seconds, Newton and Krylov iterations of a run; None if it failed."""
    # Mesh files are named relative to the case.
    file = (MESHES / scene).with_name(f".{os.path.basename(scene)}-tolerance.yml")
    file.write_text(case_text(scene, *VARIANTS[name]))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    code = subprocess.run([PROGRAM, file, "-q", "--anew", "-o", folder], capture_output=True).returncode
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    file.unlink()
    if code:
        return None
    text = json.dumps(json.loads((folder / "run.json").read_text()))
    count = lambda key: int(text.split(f'"{key}": ')[1].split(",")[0].rstrip("}"))
    return round(cpu, 2), count("newton_iterations"), count("krylov_iterations")


def error(reference, folder):
    """Largest difference of any table; infinite if the instants differ."""
    worst = 0.0
    for table in TABLES:
        if not (reference / table).exists():
            continue
        (head, *exact), (_, *found) = [list(csv.reader((at / table).open())) for at in (reference, folder)]
        if len(exact) != len(found):
            return float("inf")
        differences, scales = {}, {}
        for column, title in enumerate(head):
            if not any(word in title for word in QUANTITIES):
                continue
            unit = title.split("[")[-1]
            pairs = [(float(a[column]), float(b[column])) for a, b in zip(exact, found)]
            difference = max((abs(a - b) for a, b in pairs), default=0.0)
            differences[unit] = max(differences.get(unit, 0.0), difference)
            scales[unit] = max(scales.get(unit, 0.0), max((abs(a) for a, _ in pairs), default=0.0))
        worst = max([worst] + [differences[unit] / scales[unit] for unit in scales if scales[unit] > 0])
    return worst


def main():
    scenes = sys.argv[1:] or sorted(
        file.removeprefix(f"{MESHES}/").removesuffix(".yml")
        for file in glob.glob(f"{MESHES}/*/*.yml")
        if not any(word in file for word in ("study", "patch/", "tube/", "ten-bounces"))
    )
    out = ROOT / "results" / "tolerances.csv"
    out.parent.mkdir(exist_ok=True)
    with out.open("w") as file, tempfile.TemporaryDirectory() as scratch:
        rows = csv.writer(file)
        rows.writerow(["scene", "tolerance", "CPU [s]", "Newton", "Krylov", "error"])
        for scene in scenes:
            for name in VARIANTS:
                folder = pathlib.Path(scratch) / f"{scene.replace('/', '-')}-{name.replace(' ', '-')}"
                found = run(scene, name, folder)
                if name == "reference":
                    reference = folder
                row = [scene, name, *(found or ["failed", "", ""])]
                row += [f"{error(reference, folder):.1e}"] if found else [""]
                rows.writerow(row)
                file.flush()
                print(*row, flush=True)


if __name__ == "__main__":
    main()
