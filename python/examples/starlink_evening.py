# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # An evening of Starlink satellites
#
# How bright Starlink satellites of version 1.5 are over Macquarie University Observatory on the evening of 2025 June 9:
# over the whole sky, along the passes of one satellite, and against what a 0.6 m telescope can see.
#
# Needs `satphot` alone; with matplotlib it draws. Open it as a notebook with jupytext, or run it as a program.

# %%
import numpy as np

import satphot

site = (-33.7703, 151.1113, 70.0)  # latitude [deg], longitude [deg], height [m]
model = satphot.Model("starlink-v1.5", band="V")
print(model.name, f"{model.area_m2:.1f} m2;", model.standing)

# %% [markdown]
# ## The whole sky
#
# Each direction holds one satellite at 550 km. The map is a table with a row for each direction; its shape is in `meta`.

# %%
evening = "2025-06-09T08:30:00"
sky = satphot.sky(model, site, evening, height_km=550.0)
v_mag = sky["model_v_mag"].reshape(sky.meta["shape"])  # azimuth, altitude
brightest = np.nanargmin(sky["model_v_mag"])
print(
    f"brightest: V {sky['model_v_mag'][brightest]:.2f} at altitude {sky['alt_deg'][brightest]:.0f}, "
    f"azimuth {sky['az_deg'][brightest]:.0f} deg, by {sky['illum'][brightest]}"
)
print(f"lit: {100 * np.isfinite(v_mag).mean():.0f} % of the directions")

# %% [markdown]
# ## The passes of one satellite
#
# Elements are text or a file: TLE, 3LE or OMM. These are of an orbit like that of the shell at 53 deg.

# %%
elements = """EXAMPLE
1 44713U 19074A   25160.00000000  .00000000  00000+0  00000+0 0  9992
2 44713  53.0500 220.0000 0001632 195.4618 180.0000 15.06000000 10006
"""
passes = satphot.passes(elements, site, "2025-06-09T06:00:00", "2025-06-09T22:00:00", min_alt_deg=20.0)
for rise, top_deg, light, sky_class in zip(
    passes["rise"].astype("datetime64[s]"), passes["max_alt_deg"], passes["illum"], passes["sky_class"], strict=True
):
    print(f"{rise}  highest {top_deg:4.1f} deg  {light:<20} {sky_class}")

# %% [markdown]
# ## One pass, second by second
#
# Moments of `numpy` make the rows: four lights, their sum, the numerical error, and where everything stands.

# %%
highest = int(np.argmax(passes["max_alt_deg"]))
length = passes["set"][highest] - passes["rise"][highest]
times = passes["rise"][highest] + np.arange(0, length // np.timedelta64(1, "s")) * np.timedelta64(1, "s")
curve = model.magnitudes(elements, site, times)
for light in ("sun", "earthshine", "moon", "lunar_earthshine"):
    magnitudes = curve[f"{light}_v_mag"]
    lit = np.isfinite(magnitudes)
    print(f"{light:<18}", f"brightest V {magnitudes[lit].min():6.2f}" if lit.any() else "no light")

# %% [markdown]
# ## Is it bright enough?
#
# The limits of the telescope in 10 s at a signal-to-noise ratio of 5, under the full and the new Moon.

# %%
limits = satphot.limits(exptime_s=10.0, snr=5.0)
points = limits.where(limits["limit_of"] == "point source")
for name, limit_mag in zip(points["sky"], points["limit_mag"], strict=True):
    seen = np.mean(curve["model_v_mag"] < limit_mag)
    print(f"{name}: a point of V {limit_mag:.2f} is seen; {100 * seen:.0f} % of the pass is brighter")

# %% [markdown]
# ## The light curve

# %%
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("matplotlib is not installed; nothing is drawn")
else:
    figure, axes = plt.subplots(layout="constrained")
    for light in ("sun", "earthshine", "moon", "lunar_earthshine"):
        axes.plot(curve["time"], curve[f"{light}_v_mag"], label=light)
    axes.plot(curve["time"], curve["model_v_mag"], "k", label="all four")
    axes.set(xlabel="UTC", ylabel="V [mag]", title=f"{model.name}, highest {passes['max_alt_deg'][highest]:.0f} deg")
    axes.invert_yaxis()
    axes.legend()
    plt.show()
