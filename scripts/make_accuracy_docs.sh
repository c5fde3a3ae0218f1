#!/usr/bin/env bash
# Makes docs/accuracy.md and docs/figures/accuracy/ again: every sweep, every extreme case, two paths to every number.
# usage: scripts/make_accuracy_docs.sh [quick|full]        (full: some minutes of one core; leave the machine alone)
# SATPHOT_PYTHON names interpreters with lumos-sat, sep or photutils (with : between), for their curves with ours.
# SATPHOT names the program; without it a release build is made. Needs Python 3 with its standard library.
set -euo pipefail
cd "$(dirname "$0")/.."
effort=${1:-full}
if [[ -z ${SATPHOT:-} ]]; then
    cargo build --release
    SATPHOT=target/release/satphot
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$SATPHOT" accuracy "--$effort" -q -o "$work" > "$work/accuracy.txt"
"$SATPHOT" accuracy --extremes -q -o "$work" > "$work/extremes.txt"
"$SATPHOT" accuracy --paths -q -o "$work" > "$work/paths.txt"
mkdir -p docs/figures/accuracy
rm -f docs/figures/accuracy/*.svg
for figure in "$work"/accuracy_*.svg; do
    name=$(basename "$figure")
    cp "$figure" "docs/figures/accuracy/${name#accuracy_}"
done
python3 - "$work" "$effort" > docs/accuracy.md <<'PYTHON'
import csv
import itertools
import pathlib
import sys

work, effort = pathlib.Path(sys.argv[1]), sys.argv[2]


def table(name):
    lines = [line for line in (work / name).read_text().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines, delimiter=","))


def size(text):
    return f"{float(text):.1e}" if text else "no number"


def cell(text):
    return text.replace("|", "\\|")


rows, text = table("accuracy.ecsv"), (work / "accuracy.txt").read_text().splitlines()
# in the order of the sweeps: one line "name: about", one line "default: ..."
methods = [name for name, _ in itertools.groupby(rows, lambda r: r["method"])]
defaults = [line.strip()[len("default: "):] for line in text if line.startswith("    default: ")]
abouts = {name: next(l for l in text if l.startswith(f"{name}: "))[len(name) + 2:] for name in methods}
extremes, paths = table("extremes.ecsv"), table("paths.ecsv")
known = [r for r in extremes if r["verdict"] == "known limit"]
wrong = [r for r in extremes + paths if r["verdict"] not in ("ok", "known limit")]

few = "" if effort == "full" else " This page was made with few cases of each (`quick`), so that the worst of them is not a bound."
print(f"""# Error against run time, and the extremes

This page compares the error of numerical methods with their run time. `scripts/make_accuracy_docs.sh` makes it, which runs
`satphot accuracy --{effort}`, `--extremes` and `--paths`. CPU times are those of one thread of the machine that wrote the page; their
ratios can be transferred to other machines, the microseconds cannot. Errors are given as the median, as the value that 95 of 100
cases do not exceed, and as the worst case.

A CPU time is the median of repeats. The interval behind it holds the median in 95 of 100 cases where there are six repeats or more,
and is the smallest and the largest repeat otherwise. Two times count as different only where their intervals are more than 5 % apart,
because two runs of a program differ by that much. A setting is *behind* another that is at least as accurate (in the 95 % error and the worst) and
takes less time in this sense; it is *on the front* if every setting that is as accurate takes more time; it is *level* with another
where the times do not differ. Two runs can therefore differ in "level"; that one says "front" and the other "behind" happened for one of
10 000 simulated settings with three repeats, and for none with seven or more.

**Bold** settings are the defaults of satphot, *italic* ones are behind another setting of the same case. In the figures, filled marks
are not behind another setting, open marks are, and squares are the defaults. Thin lines are other programs; those of apertures take
whole apertures, satphot's only the outline. Where a column states the share within 1 sigma, 68 % is what the stated errors
promise.{few}

| method | what is turned | its default |
|---|---|---|""")
for name, default in zip(methods, defaults):
    print(f"| [{name}](#{name}) | {cell(abouts[name])} | {cell(default.split(';')[0])} |")
print(f"""
[{len(extremes)} stiff and extreme cases](#the-extremes): {len(wrong)} wrong, {len(known)} known limits.
[{len(paths)} numbers by two independent paths](#two-paths-to-one-number).
""")
for name, default in zip(methods, defaults):
    own = [r for r in rows if r["method"] == name]
    first = own[0]
    print(f"## {name}\n\n{abouts[name][0].upper()}{abouts[name][1:]}. Reference: {first['reference']}.\n")
    print(f"Default: {default}.\n\n![{name}](figures/accuracy/{name}.svg)\n")
    memory = any(r["memory_kb"] for r in own)
    judged = any(r["coverage_frac"] for r in own)
    print(f"| case | {first['knob']} | median [{first['err_unit']}] | 95 % | worst |" + (" bias | scatter | within 1 sigma |" if judged else "")
          + f" cases | CPU µs, {first['work']} | its interval |" + (" kB |" if memory else ""))
    print("|---|---|---|---|---|---|---|---|" + ("---|---|---|" if judged else "") + ("---|" if memory else ""))
    for r in own:
        mark = "**" if r["is_default"] == "1" else "*" if r["place"] == "behind" else ""
        line = [cell(r["case"]), f"{mark}{cell(r['setting'])}{mark}", size(r["err_median"]), size(r["err_p95"]), size(r["err_worst"])]
        if judged:
            line += [f"{float(r[c]):+.4f}" if r[c] else "" for c in ("err_mean",)] + [f"{float(r['err_sd']):.4f}" if r["err_sd"] else ""]
            line.append(f"{100 * float(r['coverage_frac']):.0f} %" if r["coverage_frac"] else "")
        us = lambda column: f"{float(r[column]):.0f}" if float(r[column]) >= 100 else f"{float(r[column]):.3g}"
        line += [r["n"], us("cpu_us"), f"{us('cpu_us_low')} to {us('cpu_us_high')}"]
        if memory:
            line.append(f"{float(r['memory_kb']):.3g}" if r["memory_kb"] else "")
        print("| " + " | ".join(line) + " |")
    print()
print("## The extremes\n\nThe expected result is a closed form, an independent computation, or a refusal that states its reason.\n")
for r in known:
    print(f"Known limit: {r['case']}: {size(r['error'])} off, {size(r['limit'])} wanted.\n")
print("| area | case | expected | got | off by | limit | verdict |\n|---|---|---|---|---|---|---|")
for r in extremes:
    line = [r["area"], r["case"], r["expected"], r["got"][:160], size(r["error"]) if r["error"] else "", size(r["limit"]) if r["limit"] else "", r["verdict"]]
    print("| " + " | ".join(cell(c) for c in line) + " |")
print("""
## Two paths to one number

The worst disagreement between two computations that share no formula, no series and no quadrature. The limit is what is
known of the lesser of the two.

| quantity | one path | another | cases | worst apart | limit | verdict |
|---|---|---|---|---|---|---|""")
for r in paths:
    line = [r["area"], r["expected"], r["got"], r["case"], size(r["error"]), size(r["limit"]), r["verdict"]]
    print("| " + " | ".join(cell(c) for c in line) + " |")
PYTHON
echo "docs/accuracy.md, $(ls docs/figures/accuracy | wc -l) figures"
