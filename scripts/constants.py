#!/usr/bin/env python3
"""Measures what half and twice the value of each tuned constant do.

Makes a copy of the committed sources in which constants can be multiplied by a factor at run time,
builds it, and runs scenes with each constant at 0.5 and at 2 times its value. A scene is run again
only for constants that its normal run reads. Writes docs/developer/constants.md.

usage: scripts/constants.py [--scratch FOLDER] [FILE::NAME ...]      default: all tuned constants
The scratch folder keeps build and results, so that a study that was ended continues. All constants
take hours. With `--page`, chosen constants get new rows and the others keep theirs.
Needs PyYAML.
"""
import argparse
import csv
import datetime
import json
import os
import pathlib
import re
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/developer/constants.md"
# Folders of tuned constants. Elsewhere constants are formats, sizes and styles.
FOLDERS = [
    "accuracy", "advice", "assembly", "contact", "element", "guard", "model", "observe", "partition",
    "simulation", "solvers", "time",
]
DEFINITION = re.compile(
    r"(?P<indent>[ ]*)(?P<visibility>pub(?:\([a-z]+\))? )?const (?P<name>[A-Z][A-Z_0-9]*): "
    r"(?P<type>f64|usize|u32|i32|u64) = (?P<value>[^;]+);"
)
# Scenes, with changes to the case text (pattern, replacement) for variants.
SCENES = {
    "rubber-block": ("rubber-block/case", []),
    "rubber-block staggered": ("rubber-block/case", [("strategy: monolithic", "strategy: staggered"), ("end: 0.07", "end: 0.02")]),
    "rubber-block accuracy": ("rubber-block/case", [("\nsolver:", "\naccuracy: fast\nsolver:"), ("end: 0.07", "end: 0.03")]),
    "concrete-block": ("concrete-block/case", []),
    "incline": ("incline/case", []),
    "sliding-block": ("sliding-block/case", []),
    "collision": ("collision/case", []),
    "collision friction": ("collision/friction", []),
    "collision cubes": ("collision/cubes", []),
    "two-cubes": ("two-cubes/case", []),
    "rubber-cube": ("rubber-cube/case", []),
    "bar-impact": ("bar-impact/case", []),
    "bar-impact conserving": ("bar-impact/conserving-neo-hookean", []),
    "cattaneo-mindlin": ("cattaneo-mindlin/case", []),
    "hertz": ("hertz/case", []),
    "ironing": ("ironing/case", []),
    "rubber-stretch": ("rubber-stretch/case", []),
    "rubber-cube filtered": ("rubber-cube/case", [("\ntime:", "\nsolver: { linear: filtered_amg }\ntime:"), ("end: 0.03", "end: 0.01")]),
    "rubber-cube two-stage": ("rubber-cube/case", [("\ntime:", "\nsolver: { linear: two_stage }\ntime:"), ("end: 0.03", "end: 0.01")]),
    "rubber-block inexact": ("rubber-block/case", [("strategy: monolithic", "strategy: monolithic, newton: { inexact: true }"), ("end: 0.07", "end: 0.03")]),
    "pile": ("pile/case", [("end: 0.8", "end: 0.1")]),
    "tube": ("tube/case", [("increments: 48", "increments: 12")]),
}
# A scene that takes longer than this [s] is left out, and a run that takes ten times longer than
# the normal one counts as failed.
LONGEST = 40.0
# A constant is measured in the fastest scenes that read it, at most this number.
MOST_SCENES = 7


def constants():
    """All candidates as (file, match)."""
    for folder in FOLDERS:
        for file in sorted(ROOT.glob(f"src/{folder}/**/*.rs")) + sorted(ROOT.glob(f"src/{folder}.rs")):
            name = str(file.relative_to(ROOT))
            if "test" in name:
                continue
            text = file.read_text().split("#[cfg(test)]\nmod tests")[0]
            for match in DEFINITION.finditer(text):
                # The largest index means "none", and powers of two are sizes of buffers.
                if "MAX" not in match["value"] and "<<" not in match["value"]:
                    yield name, match["name"]


READER = '''
//! Constants that can be changed at run time.
use std::collections::HashMap;
use std::io::Write as _;
use std::sync::LazyLock;

static FACTORS: LazyLock<HashMap<String, f64>> = LazyLock::new(|| {
    let text = std::env::var("CONSTANTS").unwrap_or_default();
    let pairs = text.split(',').filter_map(|pair| pair.split_once('='));
    pairs.map(|(name, factor)| (name.to_owned(), factor.parse().unwrap_or(1.0))).collect()
});

/// The value times its factor. Notes that it was read.
pub fn value(name: &str, value: f64) -> f64 {
    if let Ok(path) = std::env::var("CONSTANTS_READ") {
        if let Ok(mut file) = std::fs::OpenOptions::new().append(true).create(true).open(path) {
            let _ = writeln!(file, "{name}");
        }
    }
    FACTORS.get(name).map_or(value, |factor| value * factor)
}
'''


def patch_file(text, file, names):
    """Replaces constants by functions, and their uses by calls."""
    for name in names:
        def function(match):
            kind, visibility = match["type"], match["visibility"] or ""
            cast = "" if kind == "f64" else f".round() as {kind}"
            indent = match["indent"]
            return (
                f"{indent}#[allow(non_snake_case)]\n{indent}{visibility}fn {name}() -> {kind} {{\n"
                f"{indent}static AT: std::sync::OnceLock<{kind}> = std::sync::OnceLock::new();\n"
                f"{indent}*AT.get_or_init(|| crate::tuned::value(\"{file}::{name}\", ({match['value']}) as f64){cast})\n"
                f"{indent}}}"
            )
        lines = []
        pattern = re.compile(DEFINITION.pattern.replace("(?P<name>[A-Z][A-Z_0-9]*)", f"(?P<name>{name})"))
        text = pattern.sub(function, text)
        for line in text.split("\n"):
            comment = line.lstrip().startswith("//") or line.lstrip().startswith("use ")
            if not comment and f"fn {name}()" not in line and "tuned::value" not in line:
                line = re.sub(rf"(?<![A-Za-z0-9_:\[]){name}\b(?!\s*[(\]])", f"{name}()", line)
                line = re.sub(rf"\bSelf::{name}\b", f"Self::{name}()", line)
            elif "tuned::value" in line:
                head, tail = line.split('", (', 1)
                if f"::{name}" not in head:
                    tail = re.sub(rf"(?<![A-Za-z0-9_:\[]){name}\b(?!\s*[(\]])", f"{name}()", tail)
                line = head + '", (' + tail
            lines.append(line)
        text = "\n".join(lines)
    return text


def build(scratch):
    """Builds the changed program. Constants that are needed by the compiler stay constants."""
    source = scratch / "source"
    program = scratch / "target/release/contact-petsc"
    chosen = scratch / "constants.json"
    if program.exists() and chosen.exists():
        return program, json.loads(chosen.read_text())
    wanted, dropped = list(constants()), set()
    environment = dict(os.environ, CARGO_TARGET_DIR=str(scratch / "target"))
    while True:
        subprocess.run(["rm", "-rf", source], check=True)
        source.mkdir(parents=True)
        archive = subprocess.run(["git", "-C", ROOT, "archive", "HEAD"], stdout=subprocess.PIPE, check=True)
        subprocess.run(["tar", "x", "-C", source], input=archive.stdout, check=True)
        (source / "src/tuned.rs").write_text(READER)
        for library, before, added in [
            ("src/serial.rs", "\npub mod case;", "\npub mod tuned;"),
            ("src/element/mod.rs", "\nuse serial::{", "\nuse serial::tuned;"),
            ("src/lib.rs", "\npub mod assembly;", "\nuse serial::tuned;"),
        ]:
            text = (source / library).read_text()
            (source / library).write_text(text.replace(before, added + before))
        by_file = {}
        for file, name in wanted:
            if (file, name) not in dropped:
                by_file.setdefault(file, []).append(name)
        for file, names in by_file.items():
            path = source / file
            head, *tests = path.read_text().split("#[cfg(test)]\nmod tests")
            path.write_text("#[cfg(test)]\nmod tests".join([patch_file(head, file, names)] + tests))
        check = subprocess.run(
            ["cargo", "check", "--workspace", "--lib", "--message-format=json"], cwd=source, env=environment, capture_output=True
        )
        if check.returncode == 0:
            break
        before = len(dropped)
        for line in check.stdout.decode().splitlines():
            message = json.loads(line).get("message")
            if not message or message.get("level") != "error":
                continue
            text = message["message"] + json.dumps(message["spans"]) + json.dumps(message.get("children"))
            for file, name in wanted:
                here = any(re.sub(r"^[a-z]+/\.\./", "", span["file_name"]) == file for span in message["spans"])
                if re.search(rf"\{{[^{{}}]*\b{name}\}}", text) or here and re.search(rf"\b{name}\b", text):
                    dropped.add((file, name))
        print(f"{len(dropped)} constants are needed by the compiler", flush=True)
        if len(dropped) == before:
            raise SystemExit(check.stderr.decode()[-2000:] + "\n".join(
                json.loads(line)["message"]["rendered"] for line in check.stdout.decode().splitlines()
                if (json.loads(line).get("message") or {}).get("level") == "error")[:4000])
    subprocess.run(["cargo", "build", "--release", "--bin", "contact-petsc"], cwd=source, env=environment, check=True)
    left = [[file, name] for file, name in wanted if (file, name) not in dropped]
    chosen.write_text(json.dumps(left))
    return program, left


TABLES = ["contact.csv", "reactions.csv", "probes.csv", "energy.csv"]


def case_file(scene):
    """Writes the case of a scene beside its original, because mesh files are named relative to it."""
    path, changes = SCENES[scene]
    text = (ROOT / "meshes" / f"{path}.yml").read_text()
    for old, new in changes:
        assert old in text, f"{scene}: no '{old}'"
        text = text.replace(old, new)
    file = ROOT / "meshes" / pathlib.Path(path).with_name(f".constants-{scene.replace(' ', '-')}.yml")
    file.write_text(text)
    return file


def run(program, scene, folder, factors="", limit=None):
    """Counts of a run, and the constants that it read. A run that fails has a code."""
    file, read = case_file(scene), folder.with_suffix(".read")
    environment = dict(os.environ, CONSTANTS=factors)
    if not factors:
        environment["CONSTANTS_READ"] = str(read)
    try:
        began = os.times().children_user
        command = [program, file, "-q", "--anew", "-o", folder]
        code = subprocess.run(command, capture_output=True, env=environment, timeout=limit).returncode
    except subprocess.TimeoutExpired:
        return {"code": "time"}
    finally:
        file.unlink()
    seconds = os.times().children_user - began
    if code:
        return {"code": code}
    text = json.dumps(json.loads((folder / "run.json").read_text()))
    count = lambda key: int(text.split(f'"{key}": ')[1].split(",")[0].rstrip("}"))
    names = sorted(set(read.read_text().split())) if read.exists() else []
    return {
        "code": 0, "newton": count("newton_iterations"), "krylov": count("krylov_iterations"),
        "seconds": round(seconds, 2), "read": names,
    }


def difference(normal, changed):
    """Largest difference of any column relative to the largest value of its unit; at the end if the
    instants differ."""
    worst = 0.0
    for table in TABLES:
        if not (normal / table).exists():
            continue
        (head, *exact), (_, *found) = [list(csv.reader((at / table).open())) for at in (normal, changed)]
        pairs = list(zip(exact, found)) if len(exact) == len(found) else [(exact[-1], found[-1])]
        differences, scales = {}, {}
        for column, title in enumerate(head):
            if not any(word in title for word in ("force", "u_", "strain", "kinetic")):
                continue
            unit = title.split("[")[-1]
            for a, b in pairs:
                try:
                    a, b = float(a[column]), float(b[column])
                except ValueError:
                    continue
                differences[unit] = max(differences.get(unit, 0.0), abs(a - b))
            everything = [abs(float(row[column])) for row in exact if row[column] not in ("", "nan")]
            scales[unit] = max([scales.get(unit, 0.0)] + everything)
        worst = max([worst] + [differences[u] / scales[u] for u in differences if scales[u] > 0])
    return worst


def measure(program, names, scratch):
    """Runs all scenes; results are lines of a file, so that an ended study continues."""
    log = scratch / "runs.jsonl"
    done = {}
    for line in log.read_text().splitlines() if log.exists() else []:
        entry = json.loads(line)
        done[entry["scene"], entry["constant"], entry["factor"]] = entry
    with log.open("a") as file:
        def note(scene, constant, factor, result):
            entry = dict(result, scene=scene, constant=constant, factor=factor)
            done[scene, constant, factor] = entry
            print(json.dumps(entry), file=file, flush=True)
            short = {key: value for key, value in entry.items() if key != "read"}
            print(*short.values(), flush=True)

        for scene in SCENES:
            if (scene, "", 1.0) not in done:
                normal = scratch / f"normal-{scene.replace(' ', '-')}"
                note(scene, "", 1.0, run(program, scene, normal, limit=20 * LONGEST))
        for file_name, name in names:
            constant = f"{file_name}::{name}"
            reads = lambda scene: constant in done[scene, "", 1.0].get("read", [])
            seconds = lambda scene: done[scene, "", 1.0]["seconds"]
            readers = sorted((scene for scene in SCENES if reads(scene)), key=seconds)
            for scene in readers[:MOST_SCENES]:
                base = done[scene, "", 1.0]
                if base["seconds"] > LONGEST:
                    continue
                for factor in (0.5, 2.0):
                    if (scene, constant, factor) in done:
                        continue
                    folder = scratch / "changed"
                    limit = 60 + 20 * base["seconds"]
                    result = run(program, scene, folder, f"{constant}={factor}", limit)
                    if not result["code"]:
                        normal = scratch / f"normal-{scene.replace(' ', '-')}"
                        result["difference"] = difference(normal, folder)
                    result.pop("read", None)
                    note(scene, constant, factor, result)
    return done


def effect(done, constant, factor):
    """Sentence about the effect of a factor."""
    entries = [entry for (_, name, by), entry in done.items() if name == constant and by == factor]
    failed = [entry["scene"] for entry in entries if entry["code"]]
    fine = [entry for entry in entries if not entry["code"]]
    if not failed and all(
        entry["difference"] == 0 and entry["krylov"] == done[entry["scene"], "", 1.0]["krylov"] for entry in fine
    ):
        return "nothing"
    total = lambda key: sum(entry[key] for entry in fine) / max(1, sum(done[e["scene"], "", 1.0][key] for e in fine))
    words = []
    if fine:
        worst = max(fine, key=lambda entry: entry["difference"])
        words = [f"Newton {total('newton'):.3f}, Krylov {total('krylov'):.3f}"]
        words.append(f"results {worst['difference']:.0e} ({worst['scene']})" if worst["difference"] else "results equal")
    if failed:
        words.append("fails: " + ", ".join(failed))
    return "; ".join(words)


HEAD = "| Constant | Value | Scenes | Half of it | Twice | Measured |"


def known_rows():
    """Rows of the page by constant, as they were measured before."""
    rows = [line for line in PAGE.read_text().splitlines() if line.startswith("| `")] if PAGE.exists() else []
    return {row.split("`")[1]: row for row in rows}


def page(done, names):
    """The table of all constants. One that was not measured now keeps its row if its value is the same."""
    lines = ["<!-- Written by scripts/constants.py. -->", "", "# Tuned constants", "", INTRODUCTION, ""]
    before = known_rows()
    folder = None
    unread, unmeasured = [], []
    for file, name in names:
        constant = f"{file}::{name}"
        short = constant.removeprefix("src/")
        match = re.search(rf"const {name}: \w+ = ([^;]+);", (ROOT / file).read_text())
        value = " ".join(match[1].split()) if match else "-"
        scenes = sorted({scene for (scene, known, _) in done if known == constant})
        if scenes:
            half, twice = effect(done, constant, 0.5), effect(done, constant, 2.0)
            row = f"| `{short}` | {value} | {len(scenes)} | {half} | {twice} | {datetime.date.today()} |"
        elif short in before and before[short].split(" | ")[1] == value:
            row = before[short]
        else:
            read = any(constant in entry.get("read", []) for entry in done.values())
            (unmeasured if read else unread).append(f"`{short}` ({value})")
            continue
        if file.split("/")[1].removesuffix(".rs") != folder:
            folder = file.split("/")[1].removesuffix(".rs")
            lines += ["", f"## {folder}", "", HEAD, "|---|---|---|---|---|---|"]
        lines.append(row)
    if unmeasured:
        lines += ["", "## Not measured yet", "", ", ".join(unmeasured) + "."]
    lines += ["", "## Not read by these scenes", "", ", ".join(unread) + ".", ""]
    PAGE.write_text("\n".join(lines))


INTRODUCTION = """What half and twice the value of each constant do, summed over scenes that read it: the fastest
seven, or all for constants that were measured first. The table has the ratio of the numbers of Newton and Krylov iterations to those with the normal value, and the
largest change of any force, displacement or energy relative to the largest of its table. "Nothing"
means that numbers of iterations and results are identical. Either the values that are compared with
the constant are far from it, or these scenes do not have the case that it guards against. The documentation
of a constant says what it is and how it was chosen.

Scenes: SCENE_LIST."""


if __name__ == "__main__":
    options = argparse.ArgumentParser()
    options.add_argument("--scratch", default="results/constants")
    options.add_argument("--page", action="store_true", help="write the page although constants are chosen")
    options.add_argument("names", nargs="*")
    arguments = options.parse_args()
    scratch = pathlib.Path(arguments.scratch).resolve()
    scratch.mkdir(parents=True, exist_ok=True)
    program, names = build(scratch)
    names = [name for name in names if tuple(name) in set(constants())]
    wanted = [name for name in names if not arguments.names or "::".join(name) in arguments.names]
    done = measure(program, wanted, scratch)
    used = [f"`{SCENES[scene][0]}`" + (f" as *{scene}*" if SCENES[scene][1] else "")
            for scene in SCENES if not done[scene, "", 1.0]["code"] and done[scene, "", 1.0]["seconds"] <= LONGEST]
    INTRODUCTION = INTRODUCTION.replace("SCENE_LIST", ", ".join(used))
    if not arguments.names or arguments.page:
        page(done, names)
