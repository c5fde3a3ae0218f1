"""Zeropoint, extinction and colour term of matched stars."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _satphot
from ._core import bad, floats, is_astropy, number, vector
from ._table import Table, answer, table_of

Texts = dict[str, str]


class Zeropoint:
    """V = V_inst - ZP - k X - C (B-V), with the covariance of its terms; :func:`fit_zeropoint` makes one.

    Attributes
    ----------
    covariance, covariance_95 : array (4, 4)
        Covariance of (ZP, k, C, k''); zero for a term that is held. The second is the one whose +-sqrt(g Cov g) holds the
        truth in 95 % of nights.
    notes : list of str
        What the observer should know.
    """

    def __init__(self, core: _satphot.Zeropoint) -> None:
        self._core = core
        self.covariance: NDArray[np.float64] = core.covariance(False)
        self.covariance_95: NDArray[np.float64] = core.covariance(True)
        self.notes: list[str] = core.notes

    @property
    def zp_mag(self) -> float:
        """ZP [mag], outside the atmosphere, at colour 0."""
        return self._core.number("zp_mag")

    @property
    def k_mag_airmass(self) -> float:
        """Extinction k [mag/airmass]."""
        return self._core.number("k_mag_airmass")

    @property
    def c_mag_mag(self) -> float:
        """Colour term C [mag/mag]."""
        return self._core.number("c_mag_mag")

    @property
    def k2_mag(self) -> float:
        """Second-order extinction k'' [mag/airmass/mag]; 0 when it is not fitted."""
        return self._core.number("k2_mag")

    @property
    def rms_mag(self) -> float:
        """Root mean square residual of the used measurements [mag]."""
        return self._core.number("rms_mag")

    @property
    def intrinsic_mag(self) -> float:
        """Scatter of single stars beyond their stated errors [mag]."""
        return self._core.number("intrinsic_mag")

    @property
    def line_of_sight_mag(self) -> float:
        """Scatter of one line of sight [mag], which no calibration error contains."""
        return self._core.number("line_of_sight_mag")

    @property
    def errors(self) -> NDArray[np.float64]:
        """1-sigma errors of (ZP, k, C, k'')."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def n_used(self) -> int:
        """Measurements with weight."""
        return self._core.counts[0]

    @property
    def n_stars(self) -> int:
        """Different stars among them."""
        return self._core.counts[1]

    @property
    def n_rejected(self) -> int:
        """Measurements without weight."""
        return self._core.counts[2]

    @property
    def n_pointings(self) -> int:
        """Pointings with a used measurement."""
        return self._core.counts[3]

    @property
    def determined(self) -> Texts:
        """How k, C, k'' and the covariance were determined."""
        return dict(zip(("k", "c", "k2", "covariance"), self._core.determined, strict=True))

    @property
    def equation(self) -> str:
        """The equation, with the names of its band and its colour."""
        return self._core.equation

    def stars(self) -> Table:
        """The rows of the fitted table, with weight and residual, or why they were excluded. Empty for a night's."""
        return table_of(self._core.stars())

    def calibrate(self, inst_mag: Any, airmass: Any = None, b_v_mag: Any = None, b_v_err_mag: Any = None) -> Any:
        """Calibrated magnitudes of instrumental ones.

        Parameters
        ----------
        inst_mag : array
            Instrumental magnitudes as those of the fitted table [mag].
        airmass : array, optional
            May be omitted where the zeropoint has no term of airmass.
        b_v_mag : array, optional
            Colours [mag]. May be omitted where the zeropoint has no colour term.
        b_v_err_mag : array, optional
            Errors of the colours [mag].

        Returns
        -------
        Table or QTable
            `v_mag`, `v_err_mag` (1 sigma of the calibration: not in it are the error of `inst_mag` and the offset of one
            line of sight, `line_of_sight_mag`), `v_err_95_mag` (half-width of the interval of 95 %); [mag].
        """
        parts = {"inst_mag": floats("inst_mag", inst_mag, "mag").reshape(-1)}
        missing = {"airmass": (airmass, self.k_mag_airmass), "b_v_mag": (b_v_mag, self.c_mag_mag)}
        for name, (value, term) in missing.items():
            if value is None and (term != 0.0 or self.k2_mag != 0.0):
                raise bad(name, f"is needed: the zeropoint has a term of it, {term} mag")
            parts[name] = np.zeros(1) if value is None else vector(name, value, None if name == "airmass" else "mag")
        parts["b_v_err_mag"] = np.zeros(1) if b_v_err_mag is None else vector("b_v_err_mag", b_v_err_mag, "mag")
        try:
            arrays = [np.ascontiguousarray(part) for part in np.broadcast_arrays(*parts.values())]
        except ValueError as error:
            sizes = ", ".join(f"{name} {part.size}" for name, part in parts.items())
            raise bad("inst_mag", f"the lengths do not fit: {sizes}") from error
        v, err, err_95 = self._core.calibrate(*arrays)
        table = Table(v_mag=v, v_err_mag=err, v_err_95_mag=err_95)
        table.units = dict.fromkeys(table, "mag")
        return answer(table, is_astropy(inst_mag))

    def __repr__(self) -> str:
        return f"Zeropoint({self.equation}: ZP {self.zp_mag:.4f} +- {self.errors[0]:.4f} mag, {self.n_used} stars used)"


def fit_zeropoint(
    table: Any,
    columns: dict[str, Any] | None = None,
    *,
    band: str = "V",
    inst_constant_mag: float = 0.0,
    config: str | os.PathLike[str] | None = None,
    settings: dict[str, Any] | None = None,
) -> Zeropoint:
    """Fits zeropoint, extinction and colour term to matched stars: V = V_inst - ZP - k X - C (B-V).

    The estimator is robust against outliers; a term that the stars do not determine is held, and
    :attr:`Zeropoint.determined` says so.

    Parameters
    ----------
    table : path, dict of arrays, structured array, or astropy Table
        A file may be CSV, TSV, ECSV, VOTable, a FITS table or columns of text. Columns are known by the names that SExtractor,
        photutils, STDPipe and VizieR give theirs.
    columns : dict, optional
        Names of columns by key, a number for all rows, or a difference of two columns (``"gmag-rmag"``): `inst_mag` or
        `flux`, `inst_mag_err`, `flux_err` or `snr`, `v_mag`, `v_mag_err`, `b_v_mag` or `b_mag`, `b_v_err_mag`, `airmass`
        or `alt_deg`, `pointing`, `exptime_s`, `e_per_adu`, `mjd_mid_d`, `id`, `include`.
    band : str
        Band of the catalogue magnitudes.
    inst_constant_mag : float
        Constant that the instrumental magnitudes contain, subtracted first [mag].
    config : path, optional
        A configuration with cuts and settings of the fit; without it no star is cut.
    settings : dict, optional
        Keys over it, such as ``{"zeropoint.estimator": "ols"}``.
    """
    reading = {
        "columns": {str(key): str(value) for key, value in (columns or {}).items()},
        "band": str(band),
        "inst_constant_mag": number("inst_constant_mag", inst_constant_mag, "mag"),
        "config": None if config is None else os.fspath(config),
        "settings": [f"{key}={_toml(value)}" for key, value in (settings or {}).items()],
    }
    if isinstance(table, (str, os.PathLike)):
        return Zeropoint(_satphot.fit_zeropoint(os.fspath(table), reading))
    if hasattr(table, "colnames"):
        names = list(table.colnames)
    elif getattr(getattr(table, "dtype", None), "names", None):
        names = list(table.dtype.names)
    elif hasattr(table, "keys"):
        names = [str(name) for name in table.keys()]
    else:
        raise bad("table", "is neither a file, a dictionary of arrays, a structured array nor a table of astropy")
    cells: list[Any] = []
    for name in names:
        column = table[name]
        if hasattr(column, "mjd"):
            column = column.utc.mjd
        if hasattr(column, "to_value"):
            column = column.to_value()
        if getattr(column, "ndim", 1) != 1:
            raise bad("table", f"column {name} has {column.ndim} dimensions; accepted is one")
        kind = np.asarray(column).dtype.kind
        if kind in "iuf":
            cells.append(floats(name, column))
        else:
            cells.append([str(text) for text in np.asarray(column).astype(str).tolist()])
    if not names:
        raise bad("table", "has no columns")
    return Zeropoint(_satphot.fit_zeropoint_of_columns(names, cells, reading))


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
