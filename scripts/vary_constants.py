#!/usr/bin/env python3
"""Changes every tuned constant of the target finder in turn and shows what that does to seven kinds of simulated scenes.

usage: scripts/vary_constants.py [--frames 60] [--factors 0.8,1.25] [--only REGEX] [-o docs/finder_constants.md]

The tree is copied, the constants of src/photometry/target and src/photometry/trails become functions that an environment
variable changes, and the test table_of_the_finder is run once for each. Prints a page: for each constant its value, what it is,
and for each factor the change of what is found, of false detections, of errors beyond 4 sigma, and of the 68 % error of V, over
all scenes. Counts that change by no more than the same scenes with other noise do are put in brackets. An hour of two cores.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ["src/photometry/target", "src/photometry/trails"]
CONST = re.compile(r"((?:^[ \t]*///[^\n]*\n)*)^(pub(?:\([a-z]+\))? )?const ([A-Z][A-Z0-9_]*): (f64|f32|usize|i32|i64) = ([^;]+);$", re.M)


def constants(folder):
    found = []
    for name in FOLDERS:
        for path in sorted((folder / name).glob("*.rs")):
            if path.name.endswith("_tests.rs"):
                continue
            text = path.read_text()
            # public ones are used elsewhere
            for m in (m for m in CONST.finditer(text) if (m.group(2) or "").strip() != "pub"):
                doc = " ".join(line.strip()[3:].strip() for line in m.group(1).splitlines())
                found.append((path.relative_to(folder), m.group(3), m.group(4), m.group(5).strip(), doc))
    return found


def needed_when_compiled(text, name):
    """Lengths of arrays, parts of other constants and patterns stay constants."""
    return re.search(rf"; {name}\b[^\]\n]*\]|const (?!{name}:)[A-Z_0-9]+: [^=;]+=[^;]*\b{name}\b|\b{name} =>|<[^<>\n;]*\b{name}\b[^<>\n;]*>", text)


def instrumented(folder):
    """Makes functions of the constants in place; returns those that were."""
    all_constants = constants(folder)
    by_file, kept = {}, []
    texts = {p: p.read_text() for f in ["src/photometry"] for p in (folder / f).rglob("*.rs")}
    for path, name, kind, value, doc in all_constants:
        text = texts[folder / path]
        importers = [p for p, t in texts.items() if re.search(rf"(target|trails)::{path.stem}::[^;]*\b{name}\b|{path.stem}::\{{[^}}]*\b{name}\b", t)]
        if any(needed_when_compiled(texts[p], name) for p in [folder / path, *importers]):
            continue
        kept.append((path, name, kind, value, doc))
        for p in {folder / path, *importers}:
            by_file.setdefault(p, {})[name] = (path, kind, value)
    for p, names in by_file.items():
        out = []
        for line in texts[p].splitlines(keepends=True):
            if line.lstrip().startswith("//") or re.match(r"\s*(pub(\([a-z]+\))? )?use ", line):
                out.append(line)
                continue
            for name in names:
                if not re.search(rf"const {name}:", line):
                    line = re.sub(rf"(?<![\w:]){name}\b", f"{name}()", line)
            out.append(line)
        text = "".join(out)
        for name, (path, kind, value) in names.items():
            if p != folder / path:
                continue
            key = f"{path.parent.name}.{path.stem}.{name}"
            text = re.sub(
                rf"^(pub(?:\([a-z]+\))? )?const {name}: {kind} = [^;]+;$",
                rf"#[allow(non_snake_case)]\npub(crate) fn {name}() -> {kind} {{\n    static V: std::sync::OnceLock<f64> = std::sync::OnceLock::new();\n"
                rf'    *V.get_or_init(|| crate::photometry::varied("{key}", ({value}) as f64)) as {kind}\n}}',
                text, flags=re.M)
        p.write_text(text)
    with open(folder / "src/photometry/mod.rs", "a") as out:
        out.write("""
/// A constant times the factor in the environment.
pub(crate) fn varied(key: &str, value: f64) -> f64 {
    let set = std::env::var("VARY").unwrap_or_default();
    match set.split_once('=') {
        Some((name, factor)) if name == key => value * factor.parse::<f64>().unwrap_or(1.0),
        _ => value,
    }
}
""")
    return kept


def build(folder):
    env = dict(os.environ, CARGO_TARGET_DIR=os.environ.get("CARGO_TARGET_DIR", str(ROOT / "target/vary")))
    result = subprocess.run(["cargo", "test", "--locked", "--no-run", "--test", "photometry"], cwd=folder, env=env, text=True, capture_output=True)
    if result.returncode:
        sys.exit(result.stderr[-6000:])
    return re.search(r"\((\S*photometry-[0-9a-f]+)\)", result.stderr).group(1)


def table(program, folder, frames, vary="", seed=None):
    env = dict(os.environ, VARY=vary, FRAMES=str(frames))
    if seed:
        env["SEED"] = str(seed)
    text = subprocess.run([program, "--ignored", "--nocapture", "table_of_the_finder"], cwd=folder, env=env, text=True, capture_output=True).stdout
    rows = [line[line.index("FINDER"):].split()[1:] for line in text.splitlines() if "FINDER" in line]
    if not rows:
        return None
    return {r[0]: [float(x) for x in r[1:]] for r in rows}


def sums(rows):
    """Found, false, beyond four errors, and the mean 68 % error of V."""
    values = list(rows.values())
    errors = [r[5] for r in values if r[1] > 0]
    return [sum(r[1] for r in values), sum(r[2] for r in values), sum(r[3] for r in values), sum(errors) / len(errors)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--factors", default="0.8,1.25")
    parser.add_argument("--only", default="")
    parser.add_argument("-o", "--out")
    parser.add_argument("--keep", help="a folder for the changed tree, kept")
    args = parser.parse_args()
    factors = [float(f) for f in args.factors.split(",")]
    with tempfile.TemporaryDirectory() as temp:
        folder = Path(args.keep or temp)
        for name in subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, text=True, capture_output=True).stdout.splitlines():
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)
        kept = [c for c in instrumented(folder)]
        program = str((folder / build(folder)).resolve())
        normal = table(program, folder, args.frames)
        base = sums(normal)
        others = [sums(table(program, folder, args.frames, seed=700_000_000 + 17 * k)) for k in range(4)]
        spread = [max(abs(o[i] - base[i]) for o in others) for i in range(4)]
        lines = page(normal, base, spread, args)
        for path, name, kind, value, doc in kept:
            key = f"{path.parent.name}.{path.stem}.{name}"
            if not re.search(args.only, key):
                continue
            cells = []
            for factor in factors:
                if kind not in ("f64", "f32") and int(eval_number(value) * factor) == int(eval_number(value)):
                    cells.append("the same number")
                    continue
                rows = table(program, folder, args.frames, f"{key}={factor}")
                cells.append("stops" if rows is None else change(sums(rows), base))
            lines.append(f"| `{path.parent.name}/{path.stem}` `{name}` | {value.replace('_', '')} | {doc.replace('|', '/')} | {' | '.join(cells)} |")
            print(lines[-1], file=sys.stderr, flush=True)
        text = "\n".join(lines) + "\n"
        if args.out:
            Path(args.out).write_text(text)
        else:
            print(text)


def eval_number(text):
    return float(re.sub(r"[^0-9.e+\-/*() ]", "", text.replace("_", "")) and eval(re.sub(r"[^0-9.e+\-/*() ]", "", text.replace("_", ""))))


def change(now, base):
    parts = []
    for name, i in (("found", 0), ("false", 1), ("> 4 σ", 2)):
        if now[i] != base[i]:
            parts.append(f"{name} {now[i] - base[i]:+.0f}")
    ratio = now[3] / base[3] - 1
    if abs(ratio) >= 0.005:
        parts.append(f"error {100 * ratio:+.0f} %")
    return ", ".join(parts) or "nothing"


def page(normal, base, spread, args):
    lines = ["# The constants of the target finder", "",
             "`scripts/vary_constants.py` makes this page. It multiplies one constant at a time and counts what becomes of",
             f"{args.frames} scenes of each of seven kinds (`tests/photometry/finder.rs`): targets found in their place, sources reported",
             "elsewhere, magnitudes off by more than four of their errors, and the 68 % error of V, averaged over the kinds.", "",
             "| scenes | found | elsewhere | > 4 σ | median of V − true [mag] | 68 % error [mag] | within 1 σ |", "|---|---|---|---|---|---|---|"]
    for kind, (n, found, false, beyond, bias, error, within) in normal.items():
        lines.append(f"| {kind} | {found:.0f} of {n:.0f} | {false:.0f} | {beyond:.0f} | {bias:+.3f} | {error:.3f} | {100 * within:.0f} % |")
    lines += ["", f"In all {base[0]:.0f} found, {base[1]:.0f} elsewhere, {base[2]:.0f} beyond four errors, error {base[3]:.3f} mag. Other noise changes these by up to",
              f"{spread[0]:.0f}, {spread[1]:.0f}, {spread[2]:.0f} and {100 * spread[3] / base[3]:.0f} % (four other seeds). Changes below are of the same scenes, so that smaller ones are real,",
              "but whether they are better in general is not known below that.", "",
              "| constant | value | what it is | " + " | ".join(f"× {f}" for f in args.factors.split(",")) + " |", "|---|---|---|" + "---|" * len(args.factors.split(","))]
    return lines


if __name__ == "__main__":
    main()
