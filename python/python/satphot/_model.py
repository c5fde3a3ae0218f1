"""Predicted magnitudes, passes and maps of the sky."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np

from . import _satphot
from ._core import bad, count, floats, is_astropy, moment_of, number, optional, site_of, threads_of, times_of, vector, warn, watch_of
from ._table import answer, table_of


def satellites() -> list[str]:
    """The names of the satellites that come with satphot."""
    return _satphot.satellite_names()


class Model:
    """The model of a satellite: how bright it is by Sunlight, Earthshine, Moonlight and Lunar-Earthshine.

    Parameters
    ----------
    satellite : str
        A name of :func:`satellites`, one of the file `satellites`, or any name where `surfaces` are given.
    mode : {"corrected", "as_published"}
        The physics, or that of the paper as printed.
    band : str
        B, V, R, I, g, r, i, z, G, or a file of ``wavelength_nm,transmission``. Magnitudes are of this band, also where a
        name of a column says v: Vega in V, AB in all other bands.
    tolerance : float
        Relative tolerance of each Earth-reflected integral, above 0 and at most 0.5.
    **settings
        Any other key of the table ``[model]`` of a configuration: `satellites` and `throughput` (files), `surfaces` (a
        list of dictionaries), `effects`, `earth` (dictionaries), `k_mag_airmass` [mag/airmass].

    Raises
    ------
    SatphotError
        For an unknown satellite, an unknown key, or a value out of range.
    """

    def __init__(
        self,
        satellite: str,
        mode: str = "corrected",
        band: str = "V",
        tolerance: float = 1e-4,
        **settings: Any,
    ) -> None:
        values = {"satellite": satellite, "mode": mode, "band": band, "tolerance": number("tolerance", tolerance)}
        values.update({key: value for key, value in settings.items() if value is not None})
        try:
            text = json.dumps(values, default=_plain, allow_nan=False)
        except (TypeError, ValueError, RecursionError) as error:
            raise bad("settings", f"is not a text, a finite number, a list or a dictionary: {error}") from error
        self._core = _satphot.Model(text)
        self._about = {"satellite": self._core.name, "mode": str(mode), "band": str(band)}

    @property
    def name(self) -> str:
        """Name of the satellite."""
        return self._core.name

    @property
    def standing(self) -> str:
        """What observations say of the model of this satellite."""
        return self._core.standing

    @property
    def area_m2(self) -> float:
        """Area of all surfaces [m2]."""
        return self._core.area_m2

    def __repr__(self) -> str:
        return f"Model({self._about['satellite']!r}, mode={self._about['mode']!r}, band={self._about['band']!r})"

    def magnitudes(
        self,
        elements: Any,
        site: Any,
        times: Any,
        *,
        norad: int | None = None,
        errors: str = "raise",
        max_age_d: float = 14.0,
        force_age: bool = False,
        threads: int = 0,
    ) -> Any:
        """Geometry and magnitudes of every satellite at every moment.

        Parameters
        ----------
        elements : str, path, or list of them
            Text or file of elements: TLE, 3LE, OMM (JSON, KVN, CSV, XML). Several sets of one object are one satellite,
            of which the nearest in time is used.
        site : (float, float, float) or EarthLocation
            Latitude and longitude [deg], height above the ellipsoid [m].
        times : array of texts, datetime64, MJD (UTC) [d], or Time
        norad : int, optional
            Only the satellite of this catalogue number.
        errors : {"raise", "nan"}
            What becomes of a row that cannot be computed (elements too old, a satellite that has decayed): an exception,
            or NaN with the reason in the column `problem`.
        max_age_d : float
            Elements older than this are refused [d]; `force_age` uses them all the same.
        threads : int
            Threads; 0 uses all cores. The result does not depend on it.

        Returns
        -------
        Table or QTable
            A row for each satellite and moment, all moments of the first satellite first. `satellite` is the place of the
            satellite, `meta["object_names"]` has the names. Angles in deg, ranges and heights in km, magnitudes outside the
            atmosphere; a light that is not there is NaN. `model_err_mag` is the numerical error alone,
            `v_pred_err_mag` that of the prediction (NaN where the model was not compared with observations).
        """
        moments = times_of("times", times)
        watch = watch_of(elements, site, norad, max_age_d, force_age)
        columns, names, warnings = self._core.magnitudes(
            watch, moments.ns, moments.is_tai, _raises(errors), threads_of(threads)
        )
        warn(warnings)
        table = table_of(columns, **self._about, site=list(watch["site"]), object_names=names)
        return answer(table, moments.is_astropy or is_astropy(site))

    def magnitudes_of_vectors(
        self,
        satellite_km: Any,
        observer_km: Any,
        sun_km: Any,
        moon_km: Any,
        *,
        velocity_km_s: Any = (0.0, 0.0, 0.0),
        sidereal_rad: Any = 0.0,
        errors: str = "raise",
        threads: int = 0,
    ) -> Any:
        """Magnitudes of explicit geometries.

        Parameters
        ----------
        satellite_km, observer_km, sun_km, moon_km : array (n, 3) or (3,)
            Positions from the Earth's centre along Earth-fixed axes [km]; one vector serves all rows.
        velocity_km_s : array (n, 3) or (3,)
            Inertial velocity of the satellite along the same axes [km/s], for attitudes that follow the orbit.
        sidereal_rad : array (n,) or float
            Sidereal time at Greenwich [rad], for attitudes that are fixed among the stars.

        Returns
        -------
        Table or QTable
            A row for each geometry: the four lights, their sum, surface brightness, numerical error.
        """
        given = {
            "satellite_km": (satellite_km, "km"),
            "velocity_km_s": (velocity_km_s, "km/s"),
            "observer_km": (observer_km, "km"),
            "sun_km": (sun_km, "km"),
            "moon_km": (moon_km, "km"),
        }
        vectors = {}
        for name, (value, unit) in given.items():
            rows = np.atleast_2d(floats(name, value, unit))
            if rows.ndim != 2 or rows.shape[1] != 3:
                raise bad(name, f"has the shape {rows.shape}; accepted is (rows, 3)")
            vectors[name] = rows
        angle = vector("sidereal_rad", sidereal_rad, "rad")
        n = max([angle.size, *(rows.shape[0] for rows in vectors.values())])
        try:
            flat = {
                name: np.ascontiguousarray(np.broadcast_to(rows, (n, 3))).reshape(-1) for name, rows in vectors.items()
            }
            angle = np.ascontiguousarray(np.broadcast_to(angle, (n,)))
        except ValueError as error:
            raise bad("satellite_km", f"the vectors do not have the same number of rows: {error}") from error
        satellite, velocity, observer, sun, moon = flat.values()
        columns = self._core.magnitudes_of_vectors(
            satellite, velocity, observer, sun, moon, angle, _raises(errors), threads_of(threads)
        )
        given_astropy = is_astropy(satellite_km, observer_km, sun_km, moon_km, velocity_km_s)
        return answer(table_of(columns, **self._about), given_astropy)


def passes(
    elements: Any,
    site: Any,
    start: Any,
    end: Any,
    *,
    min_alt_deg: Any = 10.0,
    norad: int | None = None,
    max_age_d: float = 14.0,
    force_age: bool = False,
    threads: int = 0,
) -> Any:
    """The passes of satellites over a site: rise, culmination and set, and the light they are seen by.

    A pass of which a part lies in the window is listed whole; `outside_window` names which of rise, culmination and set
    lie before `start` or after `end`. What neither rises nor sets has no culmination: NaT and NaN.

    Parameters
    ----------
    elements, site, norad, max_age_d, force_age, threads
        As in :meth:`Model.magnitudes`.
    start, end : text, datetime64, MJD (UTC) [d], or Time
    min_alt_deg : float
        Passes that reach at least this altitude, between their crossings of it [deg]; -5 to 90.

    Returns
    -------
    Table or QTable
        A row for each pass, in the order of the satellites and of time. Angles in deg, ranges in km.
    """
    start_ns, is_tai, one = moment_of("start", start)
    end_ns, end_is_tai, other = moment_of("end", end)
    if is_tai != end_is_tai:
        raise bad("end", "start and end must both be of astropy, or neither")
    watch = watch_of(elements, site, norad, max_age_d, force_age)
    lowest = number("min_alt_deg", min_alt_deg, "deg")
    columns, warnings = _satphot.passes(watch, start_ns, end_ns, is_tai, lowest, threads_of(threads))
    warn(warnings)
    return answer(table_of(columns, site=list(watch["site"]), min_alt_deg=lowest), one or other or is_astropy(site))


def sky(
    model: Model | str,
    site: Any,
    time: Any,
    *,
    height_km: Any = None,
    n_alt: int = 31,
    n_az: int = 73,
    track_az_deg: Any = 90.0,
    threads: int = 0,
) -> Any:
    """How bright satellites of one type would be in every direction of the sky over a site at one moment.

    Each direction holds one satellite, where the line of sight meets the sphere of the orbits; it moves towards
    `track_az_deg` on a circular orbit.

    Parameters
    ----------
    model : Model or str
        The model, or the name of a satellite.
    site : (float, float, float) or EarthLocation
        Latitude and longitude [deg], height above the ellipsoid [m].
    time : text, datetime64, MJD (UTC) [d], or Time
    height_km : float, optional
        Height of the orbits above the site [km]; the middle of those the catalogue knows.
    n_alt, n_az : int
        Altitudes from 0 to 90 deg and azimuths from 0 to 360 deg, ends included.
    track_az_deg : float
        Azimuth in which the satellites move [deg].

    Returns
    -------
    Table or QTable
        A row for each direction, all altitudes of the first azimuth first; ``meta["shape"]`` is (n_az, n_alt), so that
        ``table["model_v_mag"].reshape(table.meta["shape"])`` is the map.
    """
    if isinstance(model, str):
        model = Model(model)
    if not isinstance(model, Model):
        raise bad("model", "is neither a Model nor the name of a satellite")
    ns, is_tai, of_astropy = moment_of("time", time)
    grid = (count("n_alt", n_alt), count("n_az", n_az))
    if grid[0] * grid[1] > 4_000_000:
        raise bad("n_az", f"{grid[0]} x {grid[1]} directions are more than four million")
    columns, height = _satphot.sky(
        model._core,
        site_of(site),
        ns,
        is_tai,
        optional("height_km", height_km, "km"),
        number("track_az_deg", track_az_deg, "deg"),
        grid,
        threads_of(threads),
    )
    table = table_of(columns, **model._about, height_km=height, shape=(grid[1], grid[0]))
    return answer(table, of_astropy or is_astropy(site, height_km))


def _raises(errors: str) -> bool:
    if errors not in ("raise", "nan"):
        raise bad("errors", f"{errors!r} is neither 'raise' nor 'nan'")
    return errors == "raise"


def _plain(value: Any) -> Any:
    """What JSON does not know: paths and numbers of numpy."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not accepted")
