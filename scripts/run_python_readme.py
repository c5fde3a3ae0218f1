"""Runs the Python lines of a README in a folder of their own, where iss.tle is the elements of the documentation."""

import contextlib
import io
import os
import re
import sys
import tempfile
from pathlib import Path

ISS = """ISS (ZARYA)
1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748
"""

blocks = re.findall(r"```python\n(.*?)```", Path(sys.argv[1]).read_text(encoding="utf-8"), re.DOTALL)
if not blocks:
    sys.exit(f"{sys.argv[1]} has no lines of Python")
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    Path("iss.tle").write_text(ISS, encoding="utf-8")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for block in blocks:
            exec(block, {})
    os.chdir("/")
text = printed.getvalue()
print(text, end="")
numbers = [float(number) for number in re.findall(r"\[([0-9.]+)\]", text)]
if len(numbers) != 2 or abs(numbers[0] - 32.105) > 0.001 or abs(numbers[1] - 12.64) > 0.005 or "lunar_earthshine" not in text:
    sys.exit("the README states an altitude of 32.1 deg, lunar_earthshine and V 12.64")
