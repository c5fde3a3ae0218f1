"""Tables: columns by name, with units and a line about each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Table(dict[str, NDArray[Any]]):
    """Columns by name, each an array of numpy of the same length.

    ``pandas.DataFrame(table)`` and ``polars.DataFrame(dict(table))`` take it as it is. A missing number is NaN, a missing
    text is empty, a missing moment is NaT. Moments are UTC.

    Attributes
    ----------
    units : dict of str
        Unit of each column as astropy spells it; empty for a pure number or a text.
    descriptions : dict of str
        A line about each column.
    meta : dict
        What the table says about itself.
    """

    units: dict[str, str]
    descriptions: dict[str, str]
    meta: dict[str, Any]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.units, self.descriptions, self.meta = {}, {}, {}

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return next((len(column) for column in self.values()), 0)

    def where(self, rows: Any) -> Table:
        """The table of some rows: a mask, a slice or places."""
        part = Table({name: column[rows] for name, column in self.items()})
        part.units, part.descriptions, part.meta = dict(self.units), dict(self.descriptions), dict(self.meta)
        return part

    def to_structured(self) -> NDArray[Any]:
        """One structured array of numpy."""
        rows = np.empty(self.n_rows, dtype=[(name, column.dtype) for name, column in self.items()])
        for name, column in self.items():
            rows[name] = column
        return rows

    def to_astropy(self) -> Any:
        """An ``astropy.table.QTable``: columns with units are quantities, moments are ``Time``."""
        from astropy.table import QTable
        from astropy.time import Time
        from astropy.units import Quantity, Unit

        table = QTable(meta=dict(self.meta))
        for name, column in self.items():
            if column.dtype.kind == "M":
                missing = np.isnat(column)
                filled = np.where(missing, np.datetime64(0, "ns"), column)
                table[name] = Time(filled, format="datetime64", scale="utc")
                if missing.any():
                    table[name][missing] = np.ma.masked
            elif self.units.get(name) and column.dtype.kind == "f":
                table[name] = Quantity(column, Unit(self.units[name]), copy=False)
            else:
                table[name] = column
            table[name].info.description = self.descriptions.get(name, "")
        return table

    def __repr__(self) -> str:
        return f"Table({self.n_rows} rows: {', '.join(self)})"


def table_of(columns: list[tuple[str, str, str, str, Any]], **meta: Any) -> Table:
    """The table of the columns that the compiled part returns."""
    table = Table()
    for name, kind, unit, description, values in columns:
        if kind == "time":
            array = values.view("datetime64[ns]")
        elif kind == "text":
            array = np.array(values, dtype=str)
        elif kind == "code":
            codes, names = values
            array = np.array(names, dtype=str)[codes]
        else:
            array = values
        table[name] = array
        table.units[name] = unit
        table.descriptions[name] = description
    table.meta.update(meta)
    return table


def answer(table: Table, as_astropy: bool) -> Any:
    """The table, or that of astropy where an argument was of astropy."""
    return table.to_astropy() if as_astropy else table
