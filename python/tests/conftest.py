"""What the tests share: the program, a site, elements."""

from __future__ import annotations

import csv
import io
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SITE = (-33.7703, 151.1113, 70.0)
ISS = """ISS (ZARYA)
1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748
"""


def find_program() -> Path | None:
    """The program: that of SATPHOT_BIN, else one that was built in this folder."""
    named = os.environ.get("SATPHOT_BIN")
    built = [ROOT / "target" / profile / "satphot" for profile in ("release", "debug")]
    return next((path for path in ([Path(named)] if named else built) if path.exists()), None)


@pytest.fixture(scope="session")
def program():
    """Runs the program and returns its standard output."""
    path = find_program()
    if path is None:
        pytest.skip("the program is not built; cargo build, or set SATPHOT_BIN")

    def run(*arguments: object) -> str:
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def elements(tmp_path_factory) -> Path:
    """A file of elements."""
    path = tmp_path_factory.mktemp("elements") / "iss.tle"
    path.write_text(ISS)
    return path


def rows_of(text: str) -> list[dict[str, str]]:
    """The rows of comma-separated values."""
    return list(csv.DictReader(io.StringIO(text)))
