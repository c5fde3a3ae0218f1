"""What arguments may be, and how they reach the compiled part."""

from __future__ import annotations

import datetime
import os
import warnings
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _satphot
from ._satphot import SatphotError

# MJD of 1970-01-01, and nanoseconds of a day
MJD_1970 = 40587
NS_PER_DAY = 86_400_000_000_000
# moments that 64-bit nanoseconds can hold
MJD_RANGE = (-66000.0, 147000.0)
# most threads of one call
MOST_THREADS = 1024


class SatphotWarning(UserWarning):
    """What should be known of a result: old elements, a clock that is only predicted."""


def warn(texts: Iterable[str]) -> None:
    """Raises a warning of Python for each text."""
    for text in texts:
        warnings.warn(text, SatphotWarning, stacklevel=3)


class Times(NamedTuple):
    """Nanoseconds since 1970, of UTC or of TAI."""

    ns: NDArray[np.int64]
    is_tai: bool
    is_astropy: bool


def bad(name: str, problem: str) -> SatphotError:
    """The error of an argument."""
    return SatphotError(f"argument `{name}`: {problem}")


def is_astropy(*values: Any) -> bool:
    """Whether one of the values is an object of astropy."""
    return any(type(value).__module__.split(".")[0] == "astropy" for value in values)


def floats(name: str, value: Any, unit: str | None = None) -> NDArray[np.float64]:
    """An array of floats; a quantity is converted to the unit first."""
    if hasattr(value, "to_value"):
        try:
            value = value.to_value(unit) if unit else value.to_value()
        except Exception as error:
            raise bad(name, f"cannot be converted to {unit or 'a number'}: {error}") from error
    if np.ma.isMaskedArray(value):
        value = np.ma.filled(value.astype(float), np.nan)
    try:
        array = np.asarray(value)
        if array.dtype.kind == "c":
            raise TypeError("complex numbers are not accepted")
        return np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise bad(name, f"is not an array of numbers: {error}") from error


def number(name: str, value: Any, unit: str | None = None) -> float:
    """One number."""
    array = floats(name, value, unit)
    if array.size != 1:
        raise bad(name, f"{array.size} numbers are given, one is accepted")
    return float(array.reshape(-1)[0])


def optional(name: str, value: Any, unit: str | None = None) -> float | None:
    """One number, or none."""
    return None if value is None else number(name, value, unit)


def count(name: str, value: Any) -> int:
    """One whole number from 0 on."""
    try:
        whole = int(value)
        if whole != value:
            raise ValueError
    except (TypeError, ValueError, OverflowError) as error:
        raise bad(name, f"{value!r} is not a whole number") from error
    if not 0 <= whole < 2**31:
        raise bad(name, f"{whole} is outside 0 to 2147483647")
    return whole


def threads_of(value: Any) -> int:
    """A number of threads; 0 is all cores."""
    threads = count("threads", value)
    if threads > MOST_THREADS:
        raise bad("threads", f"{threads} is outside 0 to {MOST_THREADS}; 0 uses all cores")
    return threads


def vector(name: str, value: Any, unit: str | None = None) -> NDArray[np.float64]:
    """A one-dimensional array."""
    return floats(name, value, unit).reshape(-1)


def image_of(name: str, value: Any) -> NDArray[Any]:
    """An image: two dimensions, single or double precision, in the byte order of the machine."""
    if hasattr(value, "to_value"):
        value = value.to_value()
    try:
        array = np.asarray(value)
        if array.dtype.kind == "c":
            raise TypeError("complex numbers are not accepted")
        kept = array.dtype.type if array.dtype.type in (np.float32, np.float64) else np.float64
        array = np.ascontiguousarray(array, dtype=kept)
    except (TypeError, ValueError) as error:
        raise bad(name, f"is not an array of numbers: {error}") from error
    if array.ndim != 2:
        raise bad(name, f"has {array.ndim} dimensions; an image has two, rows and columns")
    return array


def mask_of(name: str, value: Any) -> NDArray[np.bool_] | None:
    """A mask: true where a pixel is excluded."""
    if value is None:
        return None
    array = np.ascontiguousarray(value, dtype=bool)
    if array.ndim != 2:
        raise bad(name, f"has {array.ndim} dimensions; that of an image has two")
    return array


def times_of(name: str, value: Any) -> Times:
    """Moments from all that stands for one."""
    if hasattr(value, "jd1") and hasattr(value, "tai"):
        tai = value.tai
        jd1, jd2 = (np.atleast_1d(np.asarray(part, dtype=np.float64)).reshape(-1) for part in (tai.jd1, tai.jd2))
        return Times(ns_of_days(name, jd1 - 2440587.5, jd2), True, True)
    if isinstance(value, (str, datetime.datetime)):
        value = [value]
    if isinstance(value, Iterable) and not isinstance(value, np.ndarray):
        value = list(value)
        if value and all(isinstance(one, datetime.datetime) for one in value):
            value = [one.isoformat() for one in value]
    try:
        array = np.atleast_1d(np.asarray(value)).reshape(-1)
    except (TypeError, ValueError) as error:
        raise bad(name, f"{error}; accepted are texts, datetime64, MJD or an astropy Time") from error
    if array.dtype.kind == "M":
        return Times(np.ascontiguousarray(array.astype("datetime64[ns]").view(np.int64)), False, False)
    if array.dtype.kind in "US":
        return Times(_satphot.parse_times([str(text) for text in array.astype(str).tolist()]), False, False)
    if array.dtype.kind in "iuf":
        days = array.astype(np.float64)
        return Times(ns_of_days(name, days - MJD_1970, np.zeros_like(days)), False, False)
    if array.size == 0:
        return Times(np.empty(0, dtype=np.int64), False, False)
    raise bad(name, "is not a time; accepted are texts such as 2025-06-09T10:33:12, datetime64, MJD or an astropy Time")


def ns_of_days(name: str, days: NDArray[np.float64], more: NDArray[np.float64]) -> NDArray[np.int64]:
    """Nanoseconds of days since 1970, given as two parts."""
    if not np.all(np.isfinite(days) & np.isfinite(more)):
        raise bad(name, "a moment is missing or not finite")
    mjd = days + more + MJD_1970
    if mjd.size and not (mjd.min() >= MJD_RANGE[0] and mjd.max() <= MJD_RANGE[1]):
        raise bad(name, f"MJD {mjd.min()} to {mjd.max()} is outside {MJD_RANGE[0]} to {MJD_RANGE[1]}")
    whole = np.floor(days)
    part = np.rint(((days - whole) + more) * NS_PER_DAY).astype(np.int64)
    return np.ascontiguousarray(whole.astype(np.int64) * NS_PER_DAY + part)


def moment_of(name: str, value: Any) -> tuple[int, bool, bool]:
    """One moment."""
    times = times_of(name, value)
    if times.ns.size != 1:
        raise bad(name, f"{times.ns.size} moments are given, one is accepted")
    return int(times.ns[0]), times.is_tai, times.is_astropy


def elements_of(value: Any) -> list[tuple[bool, str]]:
    """Texts and files of elements: (is a file, text or name)."""
    if isinstance(value, os.PathLike):
        return [(True, os.fspath(value))]
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if isinstance(value, str):
        is_text = "\n" in value.strip() or value.lstrip()[:1] in ("{", "[", "<")
        return [(not is_text, value)]
    try:
        return [one for each in value for one in elements_of(each)]
    except TypeError as error:
        raise bad("elements", "is neither a text, a file nor a list of them") from error


def site_of(value: Any) -> tuple[float, float, float]:
    """A site: latitude and longitude [deg], height [m]; or an EarthLocation."""
    if hasattr(value, "geodetic"):
        place = value.geodetic
        return (number("site", place.lat, "deg"), number("site", place.lon, "deg"), number("site", place.height, "m"))
    try:
        lat, lon, height = value
    except (TypeError, ValueError) as error:
        raise bad("site", "must be (latitude [deg], longitude [deg], height [m]) or an EarthLocation") from error
    return (number("site", lat, "deg"), number("site", lon, "deg"), number("site", height, "m"))


def watch_of(elements: Any, site: Any, norad: int | None, max_age_d: float, force_age: bool) -> dict[str, Any]:
    """Elements and site as the compiled part takes them."""
    return {
        "elements": elements_of(elements),
        "site": site_of(site),
        "norad": None if norad is None else count("norad", norad),
        "max_age_d": number("max_age_d", max_age_d, "d"),
        "force_age": bool(force_age),
    }
