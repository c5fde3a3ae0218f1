#!/bin/sh
# Builds the wheel of python/ in a fresh environment, installs it and runs its tests.
#
# Needs cargo and python3 (3.10 or later) with venv; pip fetches the pinned packages below. SATPHOT_BIN names a program to
# compare with; without it the one of this folder is built. SATPHOT_PYTHON names the Python, SATPHOT_PEERS=no skips the
# packages that results and stubs are compared with (astropy, matplotlib, photutils, sep, skyfield, mypy); their tests are then skipped.
# SATPHOT_WHEEL_PROFILE=dev builds the wheel as the tests of the program are built, most of it once for both in one target folder
# (CARGO_TARGET_DIR).
set -eu
cd "$(dirname "$0")/.."
python="${SATPHOT_PYTHON:-python3}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

"$python" -c 'import sys; sys.exit("Python 3.10 or later is needed" if sys.version_info < (3, 10) else 0)'
"$python" -m venv "$work/build"
"$python" -m venv "$work/use"
"$work/build/bin/pip" install --quiet --disable-pip-version-check "maturin==1.16.0"
(cd python && "$work/build/bin/maturin" build --profile "${SATPHOT_WHEEL_PROFILE:-release}" --strip --locked --interpreter "$python" --out "$work/wheels")

wheel="$(ls "$work"/wheels/satphot-*.whl)"
bytes="$(wc -c < "$wheel")"
echo "wheel: $bytes bytes"
test "$bytes" -lt 15000000

"$work/use/bin/pip" install --quiet --disable-pip-version-check "$wheel" "pytest==9.*"
# the five lines of the README, with nothing installed but numpy
"$work/use/bin/python" scripts/run_python_readme.py python/README.md
if [ "${SATPHOT_PEERS:-yes}" = yes ]; then
    "$work/use/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: astropy matplotlib photutils sep skyfield "mypy==2.*"
    (cd python && "$work/use/bin/python" -m mypy.stubtest --mypy-config-file pyproject.toml satphot)
fi
if [ -z "${SATPHOT_BIN:-}" ]; then
    cargo build --quiet --locked
fi
cd python
"$work/use/bin/python" -m pytest -q -p no:cacheprovider
