"""The compiled part of satphot: arrays of 64-bit floats, nanoseconds since 1970, and columns as tuples."""

from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

# name, kind (float, int, time, text, code), unit, description, values
_Columns = list[tuple[str, str, str, str, Any]]
_Floats = NDArray[np.float64]

__all__ = [
    "Background",
    "Model",
    "Night",
    "SatphotError",
    "Zeropoint",
    "fit_zeropoint",
    "fit_zeropoint_of_columns",
    "limit_defaults",
    "limits",
    "parse_times",
    "passes",
    "satellite_names",
    "sky",
    "sum_apertures",
]

class SatphotError(ValueError):
    """What satphot cannot do: the sentence names the value, what is accepted and what to do."""

@final
class Model:
    """A satellite under settings, given as the table ``[model]`` of a configuration in JSON."""

    def __new__(cls, json: str) -> Model: ...
    @property
    def name(self) -> str: ...
    @property
    def standing(self) -> str: ...
    @property
    def area_m2(self) -> float: ...
    def magnitudes(
        self, watch: dict[str, Any], times_ns: NDArray[np.int64], is_tai: bool, raise_errors: bool, threads: int
    ) -> tuple[_Columns, list[str], list[str]]: ...
    def magnitudes_of_vectors(
        self,
        satellite_km: _Floats,
        velocity_km_s: _Floats,
        observer_km: _Floats,
        sun_km: _Floats,
        moon_km: _Floats,
        sidereal_rad: _Floats,
        raise_errors: bool,
        threads: int,
    ) -> _Columns: ...

@final
class Background:
    """Level and scatter of the background of an image."""

    def __new__(
        cls, image: NDArray[Any], masked: NDArray[np.bool_] | None, mesh_px: int, clip_sigma: float, threads: int
    ) -> Background: ...
    @property
    def global_level(self) -> float: ...
    @property
    def global_rms(self) -> float: ...
    def level(self) -> NDArray[np.float32]: ...
    def rms(self) -> NDArray[np.float32]: ...
    def at(self, x_px: _Floats, y_px: _Floats) -> tuple[_Floats, _Floats, _Floats]: ...

@final
class Zeropoint:
    """A zeropoint with its terms and their covariance."""

    def number(self, name: str) -> float: ...
    @property
    def counts(self) -> tuple[int, int, int, int]: ...
    def covariance(self, of_95: bool) -> _Floats: ...
    @property
    def determined(self) -> tuple[str, str, str, str]: ...
    @property
    def equation(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    def calibrate(
        self, inst_mag: _Floats, airmass: _Floats, b_v_mag: _Floats, b_v_err_mag: _Floats
    ) -> list[_Floats]: ...
    def stars(self) -> _Columns: ...

@final
class Night:
    """The configuration of a night."""

    def __new__(cls, path: str | PathLike[str], settings: list[str]) -> Night: ...
    @property
    def toml(self) -> str: ...
    def run(
        self, threads: int, redo: bool, figures: bool
    ) -> tuple[str, Zeropoint | None, list[str], list[str], str]: ...
    @staticmethod
    def table(folder: str | PathLike[str], name: str) -> _Columns | None: ...

def satellite_names() -> list[str]: ...
def parse_times(texts: list[str]) -> NDArray[np.int64]: ...
def passes(
    watch: dict[str, Any], start_ns: int, end_ns: int, is_tai: bool, min_alt_deg: float, threads: int
) -> tuple[_Columns, list[str]]: ...
def sky(
    model: Model,
    place: tuple[float, float, float],
    time_ns: int,
    is_tai: bool,
    height_km: float | None,
    track_az_deg: float,
    alt_by_az: tuple[int, int],
    threads: int,
) -> tuple[_Columns, float]: ...
def limits(request: dict[str, Any]) -> tuple[_Columns, float]: ...
def limit_defaults() -> dict[str, float]: ...
def sum_apertures(
    image: NDArray[Any],
    x_px: _Floats,
    y_px: _Floats,
    shape: str,
    a_px: _Floats,
    b_px: _Floats,
    theta_rad: _Floats,
    error: _Floats | None,
    mask: NDArray[np.bool_] | None,
    e_per_unit: float | None,
    threads: int,
) -> tuple[_Floats, _Floats, _Floats]: ...
def fit_zeropoint(table: str | PathLike[str], reading: dict[str, Any]) -> Zeropoint: ...
def fit_zeropoint_of_columns(names: list[str], columns: list[Any], reading: dict[str, Any]) -> Zeropoint: ...
