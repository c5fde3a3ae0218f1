"""The faintest magnitudes of a telescope that follows a satellite."""

from __future__ import annotations

import os
from typing import Any

from . import _satphot
from ._core import bad, count, is_astropy, number, optional, vector
from ._table import answer, table_of
from ._zeropoint import _toml


def limits(
    *,
    exptime_s: Any = 10.0,
    n_sub: int = 1,
    snr: Any = (1.0, 5.0),
    mag: float | None = None,
    band: str = "none",
    sky_mag_arcsec2: Any = None,
    moon_phase_deg: Any = None,
    moon_alt_deg: Any = None,
    moon_sep_deg: Any = None,
    alt_deg: Any = 90.0,
    dark_sky_mag_arcsec2: float = 21.587,
    k_mag_airmass: float = 0.172,
    area_m2: Any = 4250.25,
    range_km: Any = 400.0,
    omega_arcsec2: Any = None,
    config: str | os.PathLike[str] | None = None,
    settings: dict[str, Any] | None = None,
    zp_mag: float | None = None,
    pixel_arcsec: Any = None,
    fwhm_arcsec: Any = 2.0,
    aper_r_arcsec: Any = None,
    gain_setting: int = 200,
    read_noise_e: float | None = None,
    dark_e_s_px: float | None = None,
    saturation_e: float | None = None,
    extinction_mag: float = 0.0,
    obstruction: float | None = None,
    optics: float | None = None,
    filter_transmission: float | None = None,
    qe: float | None = None,
) -> Any:
    """Limiting magnitudes, as `satphot limits tracked` computes them.

    Four limits under every sky and for every signal-to-noise ratio: light that fills one pixel or one arcsec2 (surface
    brightnesses), a point source, and an extended target. Without arguments: the CDK24 of Macquarie with its ASI6200MM
    at gain setting 200, no filter, under full and new Moon.

    Parameters
    ----------
    exptime_s : float
        Exposure time, all exposures together [s], split into `n_sub` exposures.
    snr : float or array
        Signal-to-noise ratios of the limits.
    mag : float, optional
        Magnitude of a target: its signal-to-noise ratio, and the time it needs.
    band : str
        none, or a band as in :class:`Model`.
    sky_mag_arcsec2 : float or array, optional
        Brightness of the sky in the band [mag/arcsec2].
    moon_phase_deg, moon_alt_deg : float or array, optional
        Phase angle of the Moon (0 = full) and, for the sky of Krisciunas & Schaefer 1991, its altitude [deg].
    moon_sep_deg, alt_deg : float
        Distance of the Moon from the line of sight, and altitude of the line of sight [deg].
    dark_sky_mag_arcsec2, k_mag_airmass : float
        Dark sky in V [mag/arcsec2] and extinction [mag/airmass] under the Moon.
    area_m2, range_km, omega_arcsec2 : float
        The extended target: its area [m2] and distance [km], or its solid angle [arcsec2].
    config, settings : optional
        A configuration with telescope and detector, and keys over it.
    zp_mag, pixel_arcsec, fwhm_arcsec, aper_r_arcsec : float, optional
        Magnitude of 1 e-/s, pixel scale, FWHM and radius of the aperture of a star [arcsec].
    gain_setting, read_noise_e, dark_e_s_px, saturation_e : optional
        Gain setting of the camera [0.1 dB]; read noise [e-], dark current [e-/s/px] and what a pixel holds [e-].
    extinction_mag : float
        What the air takes of the target [mag]: limits are then outside the atmosphere.
    obstruction, optics, filter_transmission, qe : float, optional
        Diameter of the central obstruction over the aperture, shares of light that optics and filter pass, quantum
        efficiency.

    Returns
    -------
    Table or QTable
        The columns of `satphot limits tracked --csv`; ``meta["zp_mag"]`` is the zeropoint of the telescope.
    """
    defaults = _satphot.limit_defaults()
    phases = None if moon_phase_deg is None else vector("moon_phase_deg", moon_phase_deg, "deg").tolist()
    altitudes = None if moon_alt_deg is None else vector("moon_alt_deg", moon_alt_deg, "deg").tolist()
    skies = None if sky_mag_arcsec2 is None else vector("sky_mag_arcsec2", sky_mag_arcsec2).tolist()
    if skies is not None and phases is not None:
        raise bad("sky_mag_arcsec2", "is given together with moon_phase_deg; give one of them")
    if phases is not None and altitudes is not None and len(phases) != len(altitudes):
        shared = max(len(phases), len(altitudes))
        phases = phases * shared if len(phases) == 1 else phases
        altitudes = altitudes * shared if len(altitudes) == 1 else altitudes
    try:
        setting = int(gain_setting)
    except (TypeError, ValueError, OverflowError) as error:
        raise bad("gain_setting", f"{gain_setting!r} is not a whole number") from error
    request = {
        "config": None if config is None else os.fspath(config),
        "settings": [f"{key}={_toml(value)}" for key, value in (settings or {}).items()],
        "band": str(band),
        "obstruction": number("obstruction", defaults["obstruction"] if obstruction is None else obstruction),
        "optics": number("optics", defaults["optics"] if optics is None else optics),
        "filter_transmission": number(
            "filter_transmission",
            defaults["filter_transmission"] if filter_transmission is None else filter_transmission,
        ),
        "qe": optional("qe", qe),
        "zp_mag": optional("zp_mag", zp_mag, "mag"),
        "pixel_arcsec": optional("pixel_arcsec", pixel_arcsec, "arcsec"),
        "gain_setting": min(max(setting, -(2**62)), 2**62),
        "read_noise_e": optional("read_noise_e", read_noise_e),
        "dark_e_s_px": number("dark_e_s_px", defaults["dark_e_s_px"] if dark_e_s_px is None else dark_e_s_px),
        "saturation_e": optional("saturation_e", saturation_e),
        "fwhm_arcsec": number("fwhm_arcsec", fwhm_arcsec, "arcsec"),
        "aper_r_arcsec": optional("aper_r_arcsec", aper_r_arcsec, "arcsec"),
        "extinction_mag": number("extinction_mag", extinction_mag, "mag"),
        "sky_mag_arcsec2": skies,
        "moon_phase_deg": phases,
        "moon_alt_deg": altitudes,
        "moon_sep_deg": optional("moon_sep_deg", moon_sep_deg, "deg"),
        "alt_deg": number("alt_deg", alt_deg, "deg"),
        "dark_sky_mag_arcsec2": number("dark_sky_mag_arcsec2", dark_sky_mag_arcsec2),
        "k_mag_airmass": number("k_mag_airmass", k_mag_airmass),
        "exptime_s": number("exptime_s", exptime_s, "s"),
        "n_sub": count("n_sub", n_sub),
        "snr": vector("snr", snr).tolist(),
        "mag": optional("mag", mag, "mag"),
        "omega_arcsec2": optional("omega_arcsec2", omega_arcsec2, "arcsec2"),
        "area_m2": number("area_m2", area_m2, "m2"),
        "range_km": number("range_km", range_km, "km"),
    }
    columns, zeropoint = _satphot.limits(request)
    of_astropy = is_astropy(exptime_s, sky_mag_arcsec2, moon_phase_deg, area_m2, range_km, omega_arcsec2)
    return answer(table_of(columns, zp_mag=zeropoint, band=str(band)), of_astropy)
