"""A night from its raw frames to calibrated magnitudes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from . import _satphot
from ._core import threads_of
from ._table import Table, table_of
from ._zeropoint import Zeropoint, _toml


class ReducedNight:
    """A reduced night; :meth:`Night.run` makes one.

    Attributes
    ----------
    photometry : Table
        A row for every target frame, and for every other frame that failed or was set aside, with its status, verdict
        and reason.
    stars : Table or None
        A row for every measurement of a catalogue star.
    residuals : Table or None
        A row for every frame that was compared with the model.
    zeropoint : Zeropoint or None
        None where magnitudes stay instrumental.
    notes, problems : list of str
        What the observer should know; why the night is not good enough to be called a success.
    folder : Path
        Where the tables are.
    summary : str
        The closing summary, as the program prints it.
    """

    def __init__(
        self,
        folder: Path,
        zeropoint: Zeropoint | None,
        notes: list[str],
        problems: list[str],
        summary: str,
    ) -> None:
        self.folder = folder
        self.zeropoint = zeropoint
        self.notes = notes
        self.problems = problems
        self.summary = summary
        self.photometry: Table = self._table("photometry") or Table()
        self.stars: Table | None = self._table("stars")
        self.residuals: Table | None = self._table("residuals")

    def _table(self, name: str) -> Table | None:
        columns = _satphot.Night.table(self.folder, name)
        return None if columns is None else table_of(columns, table=name)

    def __repr__(self) -> str:
        return f"ReducedNight({self.folder}, {self.photometry.n_rows} rows)"


class Night:
    """The configuration of a night.

    Parameters
    ----------
    config : path
        The file, ``pipeline.toml``.
    settings : dict, optional
        Keys over it, such as ``{"night.output": "elsewhere"}``.
    """

    def __init__(self, config: str | os.PathLike[str], settings: dict[str, Any] | None = None) -> None:
        values = [f"{key}={_toml(value)}" for key, value in (settings or {}).items()]
        self._core = _satphot.Night(os.fspath(config), values)

    @property
    def toml(self) -> str:
        """The configuration with every default, as TOML."""
        return self._core.toml

    def run(self, *, threads: int = 0, redo: bool = False, figures: bool = False) -> ReducedNight:
        """Reduces the night and writes its tables to ``<output>/<name>/``, as `satphot run` does.

        Frames that an earlier run into the same folder has measured are not measured again, unless `redo` is true or
        something they depend on has changed. A first Ctrl-C ends the run after the frames in work.
        """
        folder, zeropoint, notes, problems, summary = self._core.run(threads_of(threads), bool(redo), bool(figures))
        fitted = None if zeropoint is None else Zeropoint(zeropoint)
        return ReducedNight(Path(folder), fitted, notes, problems, summary)
