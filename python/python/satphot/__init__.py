"""Photometry of tracked satellites, and predicted magnitudes.

Arrays go in and tables come out; units are in the names. A moment is a text such as ``2025-06-09T10:33:12`` (UTC, or with a
zone), a ``datetime``, a ``numpy.datetime64``, a number (MJD, UTC) or an ``astropy.time.Time``. Where an argument is an object
of astropy, the table is an ``astropy.table.QTable``; else it is a :class:`Table`, a dictionary of numpy arrays.

>>> import satphot
>>> model = satphot.Model("iss")
>>> table = model.magnitudes("iss.tle", (-33.7703, 151.1113, 70.0), "2025-06-09T10:33:12")  # doctest: +SKIP
"""

from ._core import SatphotWarning
from ._images import Background, Circle, Ellipse, Pill, Rectangle, background, sum_apertures
from ._limits import limits
from ._model import Model, passes, satellites, sky
from ._night import Night, ReducedNight
from ._satphot import SatphotError
from ._table import Table
from ._zeropoint import Zeropoint, fit_zeropoint

__all__ = [
    "Background",
    "Circle",
    "Ellipse",
    "Model",
    "Night",
    "Pill",
    "Rectangle",
    "ReducedNight",
    "SatphotError",
    "SatphotWarning",
    "Table",
    "Zeropoint",
    "background",
    "fit_zeropoint",
    "limits",
    "passes",
    "satellites",
    "sky",
    "sum_apertures",
]
