#!/usr/bin/env python3
"""What each constant of the target finder does: all of them are varied, one at a time, over the same ten kinds of scenes.

    scripts/vary_constants.py [--frames 20] [--seed 613000111] [--only NAME,NAME] [--table constants.md]

A copy of the source gets its scalar constants in src/photometry/target, src/photometry/trails and src/photometry/clip.rs from the
environment; the table of tests/photometry/finder.rs (scripts/prove_target.sh) is then drawn with each at 0.7 and at 1.4 times its
value (whole numbers by at least one): a build, and two tables for each of some 180 constants, which takes an hour and more. Frames and seed
are the same for all, so that any difference is the constant's.
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
DECLARED = re.compile(r"^(pub(?:\((?:crate|super)\))? )?const ([A-Z][A-Z0-9_]*): (f64|f32|usize|i32) = (.+);$", re.M)
# lengths of arrays, definitions and numbers that follow from a formula: there is nothing to choose
FIXED = {
    "LANES", "KINDS", "LEAST_SHARE", "TERMS", "NONE", "ROUND", "CLASSES", "WIDE_SCALE", "PIXEL_VARIANCE", "CLIPPED_VARIANCE", "MAD_ERR",
    "LIMIT_COMPLETENESS", "LIMIT_MARGIN_SIGMA", "DISC_RINGS", "DISC_DIRECTIONS", "REACH_FWHM", "DISC_FWHM", "WIDE_REACH_FWHM",
    "TURNS", "STEPS_PER_FWHM", "WIDE_STEPS_PER_FWHM", "ELLIPSE_TOLERANCE", "LARGEST_FWHM", "CENTRAL", "PART",
}
# not needed for the build
SKIPPED = {"target", ".git", "docs", "fuzz", "satphot-out"}
VARIED = '''
/// A constant, or what the environment has in its place.
pub fn varied<T: std::str::FromStr>(name: &str, value: T) -> T {
    let wanted = std::env::var("SATPHOT_VARY").unwrap_or_default();
    wanted.strip_prefix(name).and_then(|v| v.strip_prefix('=')).and_then(|v| v.parse().ok()).unwrap_or(value)
}
'''


def is_number(match):
    return match[2] not in FIXED and re.fullmatch(r"[\d._e+-]+", match[4]) is not None


def sources(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).glob("*.rs")):
            if not path.stem.endswith("_tests"):
                yield path
    yield root / "src/photometry/clip.rs"


def constants(root):
    """(name of file and constant, type, value as written, its comment)."""
    found = []
    for path in sources(root):
        text = path.read_text().split("#[cfg(test)]")[0]
        for match in DECLARED.finditer(text):
            name = match[2]
            if not is_number(match):
                continue
            lines = text[: match.start()].rstrip("\n").split("\n")
            comment = []
            while lines and lines[-1].startswith("///"):
                comment.insert(0, lines.pop()[3:].strip())
            found.append((f"{path.parent.name}/{path.stem}.{name}", match[3], match[4], " ".join(comment)))
    return found


# the tables of the page, in its order
GROUPS = ["Significances", "Lengths and angles", "Shares and ratios", "Numbers: steps, bounds and least counts"]


def group(name, kind, comment):
    """Which of the tables a constant belongs to."""
    word = name.split(".")[-1]
    if kind in ("usize", "i32"):
        return GROUPS[3]
    if re.search(r"FWHM|_PX|ANGLE|DIRECTION|DISC2", word):
        return GROUPS[1]
    if re.search(r"SIGMA|SNR|CHI2|ODDS|FALSE|CHANCE", word) or r"\[σ" in comment or "χ²" in comment:
        return GROUPS[0]
    return GROUPS[2]


def make_variable(root):
    """Turns the constants of a copy of the source into functions of the environment."""
    lib = root / "src/lib.rs"
    lib.write_text(lib.read_text() + VARIED)
    shared = set()
    for path in sources(root):
        text = path.read_text()
        own = [m for m in DECLARED.finditer(text.split("#[cfg(test)]")[0]) if is_number(m)]
        for match in own:
            if match[1]:
                shared.add(match[2])
            key = f"{path.parent.name}/{path.stem}.{match[2]}"
            function = (
                f"#[allow(non_snake_case)] {match[1] or ''}fn {match[2]}() -> {match[3]} {{ "
                f"static V: std::sync::OnceLock<{match[3]}> = std::sync::OnceLock::new(); "
                f'*V.get_or_init(|| crate::varied("{key}", {match[4]})) }}'
            )
            text = text.replace(match[0], function)
        path.write_text(called(text, {m[2] for m in own}))
    for path in (root / "src").rglob("*.rs"):
        text = path.read_text()
        imported = {n for n in shared if re.search(rf"^use [^;]*\b{n}\b[^;]*;", text, re.M | re.S) and f"fn {n}()" not in text}
        if imported:
            path.write_text(called(text, imported))


def called(text, names):
    """`text` with every use of a name turned into a call, but in comments and imports."""
    out, importing = [], False
    for line in text.split("\n"):
        importing = importing or re.match(r"\s*(pub(\(\w+\))? )?use ", line) is not None
        if not importing and not line.lstrip().startswith("//"):
            for name in names:
                line = re.sub(rf"(?<!fn )(?<![\w:\"])(?<![^.]\.){name}\b(?!\(\)|\")", f"{name}()", line)
        if importing and line.rstrip().endswith(";"):
            importing = False
        out.append(line)
    return "\n".join(out)


def other_values(kind, value):
    """The constant at 0.7 and at 1.4 times its value."""
    if kind in ("usize", "i32"):
        number = int(value.replace("_", ""))
        return [max(number - max(1, round(0.3 * number)), 0), number + max(1, round(0.4 * number))]
    number = float(value.replace("_", ""))
    return [0.7 * number, 1.4 * number]


def table(program, frames, seed, vary=None):
    """{kind of scene: (found, false, beyond 4 errors, median, 68 % of |V - true|)} of one run."""
    env = {**os.environ, "FRAMES": str(frames), "SEED": str(seed)}
    if vary:
        env["SATPHOT_VARY"] = vary
    command = [program, "--ignored", "--nocapture", "--test-threads", "1", "table_of_the_finder"]
    # the table is whole, also where a constant makes an assertion about it fail
    run = subprocess.run(command, capture_output=True, text=True, env=env)
    rows = {}
    for line in run.stdout.splitlines():
        words = line[line.find("FINDER") :].split() if "FINDER" in line else []
        if len(words) == 9:
            # without a detection the last ones are not numbers
            rows[words[1]] = (*map(int, words[3:6]), *map(float, words[6:8])) if int(words[3]) else (0, int(words[4]), 0, 0.0, 0.0)
    return rows


def difference(base, rows):
    """(changed at all, found, false, beyond 4 errors: differences of the sums; largest ratio of the 68 % errors)."""
    kinds = [k for k in base if k in rows]
    if not kinds:
        return None
    of = lambda i: sum(rows[k][i] - base[k][i] for k in kinds)
    ratios = [rows[k][4] / base[k][4] for k in kinds if base[k][4] > 0 and rows[k][4] > 0]
    changed = any(rows[k] != base[k] for k in kinds)
    return changed, of(0), of(1), of(2), max(ratios, default=float("nan"), key=lambda r: abs(r - 1))


def words_of(diff):
    if diff is None:
        return "no table"
    changed, found, false, beyond, ratio = diff
    if not changed:
        return "no effect"
    return f"{found:+d} / {false:+d} / {beyond:+d} / {ratio:.2f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--seed", type=int, default=613_000_111)
    parser.add_argument("--only", default="", help="names of constants, by commas")
    parser.add_argument("--table", type=Path, help="Markdown file to write")
    args = parser.parse_args()
    chosen = [c for c in constants(ROOT) if not args.only or any(o in c[0] for o in args.only.split(","))]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "satphot"
        shutil.copytree(ROOT, copy, ignore=lambda at, names: set(names) & SKIPPED if Path(at) == ROOT else set())
        make_variable(copy)
        env = {"CARGO_TARGET_DIR": str(ROOT / "target"), **os.environ}
        build = ["cargo", "test", "--locked", "--test", "photometry", "--no-run"]
        built = subprocess.run(build, cwd=copy, env=env, capture_output=True, text=True)
        match = re.search(r"Executable .*\((.*)\)", built.stderr)
        if built.returncode != 0 or not match:
            sys.exit(built.stderr[-4000:])
        program = str(Path(folder) / "photometry")
        shutil.copy(copy / match[1] if not Path(match[1]).is_absolute() else match[1], program)
        base = table(program, args.frames, args.seed)
        rows = []
        for k, (name, kind, value, comment) in enumerate(chosen):
            print(f"{k + 1} of {len(chosen)}: {name}", file=sys.stderr, flush=True)
            effects = []
            for other in other_values(kind, value):
                effects.append(words_of(difference(base, table(program, args.frames, args.seed, f"{name}={other}"))))
            row = (name, value, *effects, comment)
            rows.append((group(name, kind, comment), f"| `{name}` | {' | '.join(row[1:])} |"))
            print(" | ".join(row[:4]), flush=True)
    if args.table:
        head = args.table.read_text().split("<!-- table -->")[0] if args.table.exists() else ""
        args.table.write_text(f"{head}<!-- table -->\n{tables(rows)}")


def tables(rows):
    """The tables of all groups; `rows` = group and line of each constant."""
    columns = "| constant | value | at 0.7 times | at 1.4 times | what it is |\n|---|---|---|---|---|\n"
    lines = {of: [line for own, line in rows if own == of] for of in GROUPS}
    return "".join(f"\n### {of} ({len(own)})\n\n{columns}" + "\n".join(own) + "\n" for of, own in lines.items() if own)


if __name__ == "__main__":
    main()
