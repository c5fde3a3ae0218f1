"""Sums in apertures, and the background of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _satphot
from ._core import bad, count, floats, image_of, is_astropy, mask_of, number, optional, threads_of, vector
from ._table import Table, answer


@dataclass(frozen=True)
class Circle:
    """A circle: photutils' ``CircularAperture(r)``, sep's ``sum_circle(r)``.

    `r_px` is the radius [px], one for all positions or one for each.
    """

    r_px: Any


@dataclass(frozen=True)
class Ellipse:
    """An ellipse: photutils' ``EllipticalAperture(a, b, theta)``, sep's ``sum_ellipse(a, b, theta, r=1)``.

    `a_px` and `b_px` are the semi-axes [px], `theta_rad` the angle of the first from +x towards +y [rad].
    """

    a_px: Any
    b_px: Any
    theta_rad: Any = 0.0


@dataclass(frozen=True)
class Rectangle:
    """A rectangle: photutils' ``RectangularAperture(w=2 a, h=2 b, theta)``.

    `a_px` and `b_px` are half its length and half its width [px], `theta_rad` the angle of the length [rad].
    """

    a_px: Any
    b_px: Any
    theta_rad: Any = 0.0


@dataclass(frozen=True)
class Pill:
    """A rectangle with half a disc at both ends, for a target that trails.

    `a_px` is half its length with the discs, `b_px` half its width [px], `theta_rad` the angle of the length [rad].
    """

    a_px: Any
    b_px: Any
    theta_rad: Any = 0.0


Shape = Circle | Ellipse | Rectangle | Pill


def _axes(shape: Shape, n: int) -> tuple[str, list[NDArray[np.float64]]]:
    if isinstance(shape, Circle):
        given = [("r_px", shape.r_px), ("r_px", shape.r_px), ("theta_rad", 0.0)]
    elif isinstance(shape, (Ellipse, Rectangle, Pill)):
        given = [("a_px", shape.a_px), ("b_px", shape.b_px), ("theta_rad", shape.theta_rad)]
    else:
        raise bad("shape", "is not a Circle, an Ellipse, a Rectangle or a Pill")
    axes = []
    for name, value in given:
        values = vector(name, value, "rad" if name == "theta_rad" else None)
        if values.size not in (1, n):
            raise bad(name, f"has {values.size} values for {n} positions")
        axes.append(np.ascontiguousarray(np.broadcast_to(values, (n,))))
    return type(shape).__name__.lower(), axes


def sum_apertures(
    image: Any,
    x_px: Any,
    y_px: Any,
    shape: Shape,
    *,
    error: Any = None,
    mask: Any = None,
    e_per_unit: float | None = None,
    threads: int = 0,
) -> Any:
    """Sums of the pixels in apertures, each pixel by the exact share of it that the aperture covers.

    Positions are 0-based from the centre of the first pixel, as in photutils and sep. Nothing is subtracted.

    Parameters
    ----------
    image : array (ny, nx)
        Single or double precision; other numbers are converted.
    x_px, y_px : array
        Centres of the apertures [px].
    shape : Circle, Ellipse, Rectangle or Pill
    error : array (ny, nx) or float, optional
        1-sigma error of each pixel, in the unit of the image: photutils' `error`, sep's `err`.
    mask : array (ny, nx) of bool, optional
        True where a pixel is excluded. As in photutils, its light is not replaced; `area_px` is what was summed.
    e_per_unit : float, optional
        Electrons per unit of the image: adds the noise of the light itself, as sep does with the argument of this meaning.

    Returns
    -------
    Table or QTable
        `sum` and `sum_err` in the unit of the image (NaN without `error` and `e_per_unit`), `area_px` [px2]: the area of
        the aperture on the image and outside the mask.
    """
    unit = getattr(image, "unit", None)
    pixels = image_of("image", image)
    x, y = vector("x_px", x_px), vector("y_px", y_px)
    if x.size != y.size:
        raise bad("x_px", f"{x.size} x and {y.size} y do not fit")
    name, (a_px, b_px, theta_rad) = _axes(shape, x.size)
    errors = None
    if error is not None:
        errors = floats("error", error, str(unit) if unit is not None and hasattr(error, "to_value") else None)
        try:
            errors = np.ascontiguousarray(np.broadcast_to(errors, pixels.shape))
        except ValueError as problem:
            raise bad("error", f"{errors.shape} is not the shape of the image, {pixels.shape}") from problem
    sums = _satphot.sum_apertures(
        pixels,
        x,
        y,
        name,
        a_px,
        b_px,
        theta_rad,
        errors,
        mask_of("mask", mask),
        optional("e_per_unit", e_per_unit),
        threads_of(threads),
    )
    table = Table(x_px=x, y_px=y, sum=sums[0], sum_err=sums[1], area_px=sums[2])
    image_unit = "" if unit is None else str(unit)
    table.units = {"x_px": "pix", "y_px": "pix", "sum": image_unit, "sum_err": image_unit, "area_px": "pix2"}
    table.descriptions = {
        "x_px": "centre of the aperture along a row, 0-based from the centre of the first pixel",
        "y_px": "centre of the aperture over rows, 0-based from the centre of the first pixel",
        "sum": "sum of the pixels, each by the share that the aperture covers",
        "sum_err": "1-sigma error of sum",
        "area_px": "area of the aperture on the image and outside the mask",
    }
    return answer(table, is_astropy(image, error))


class Background:
    """The level and the scatter of the background of an image; :func:`background` makes one.

    All in the unit of the image.
    """

    def __init__(self, core: _satphot.Background, unit: Any) -> None:
        self._core = core
        self._unit = unit

    def _of_image(self, value: Any) -> Any:
        return value if self._unit is None else value * self._unit

    @property
    def global_level(self) -> Any:
        """Median level over the mesh: sep's `globalback`, photutils' `background_median`."""
        return self._of_image(self._core.global_level)

    @property
    def global_rms(self) -> Any:
        """Median scatter over the mesh: sep's `globalrms`, photutils' `background_rms_median`."""
        return self._of_image(self._core.global_rms)

    def level(self) -> Any:
        """The level of every pixel, single precision: sep's `back()`, photutils' `background`."""
        return self._of_image(self._core.level())

    def rms(self) -> Any:
        """The scatter of every pixel, single precision: sep's `rms()`, photutils' `background_rms`."""
        return self._of_image(self._core.rms())

    def at(self, x_px: Any, y_px: Any) -> Any:
        """Level, its error from noise alone, and scatter at positions [px], 0-based from the centre of the first pixel.

        Returns
        -------
        Table or QTable
            Columns `level`, `level_err`, `rms`.
        """
        x, y = vector("x_px", x_px), vector("y_px", y_px)
        if not np.all(np.isfinite(x) & np.isfinite(y)):
            raise bad("x_px", "a position is not finite")
        level, err, rms = self._core.at(x, y)
        table = Table(level=level, level_err=err, rms=rms)
        table.units = dict.fromkeys(table, "" if self._unit is None else str(self._unit))
        return answer(table, self._unit is not None)


def background(
    image: Any, *, mask: Any = None, mesh_px: int = 64, clip_sigma: float = 3.0, threads: int = 0
) -> Background:
    """Measures the background of an image on a mesh: SExtractor's recipe, as sep and photutils follow it.

    In each box the histogram of the good pixels is clipped until its scatter settles; the level is the mode
    2.5 median - 1.5 mean, or the median where the two differ by more than 0.3 sigma. A 3 x 3 median over the mesh and a
    bicubic spline follow. The pixels are used in single precision.

    Parameters
    ----------
    image : array (ny, nx)
        Pixels that are not finite are excluded.
    mask : array (ny, nx) of bool, optional
        True where a pixel is excluded.
    mesh_px : int
        Side of a box [px], 8 or more: sep's `bw` and `bh`, photutils' `box_size`. Their filter of 3 x 3 boxes (`fw`, `fh`,
        `filter_size`) is fixed.
    clip_sigma : float
        Pixels beyond this many sigma of the median are clipped.
    """
    core = _satphot.Background(
        image_of("image", image),
        mask_of("mask", mask),
        count("mesh_px", mesh_px),
        number("clip_sigma", clip_sigma),
        threads_of(threads),
    )
    return Background(core, getattr(image, "unit", None))
