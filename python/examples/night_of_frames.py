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
# # A night from FITS to residuals
#
# Reduces the small night that comes with satphot (three passes of the ISS, 2025 June 13): flats, star pointings and target
# frames become calibrated V magnitudes, which are compared with the model. Name another `pipeline.toml` as the first
# argument of the program, or in `config` below.
#
# Needs `satphot` alone; with matplotlib it draws. Open it as a notebook with jupytext, or run it as a program.

# %%
import sys
import tempfile
from pathlib import Path

import numpy as np

import satphot

here = Path(__file__).resolve().parent if "__file__" in globals() else Path.cwd()
arguments = [a for a in sys.argv[1:] if a.endswith(".toml")]
config = Path(arguments[0]) if arguments else here.parents[1] / "fixtures" / "night" / "pipeline.toml"

# %% [markdown]
# ## Reduce
#
# Every key of the configuration can be given here instead; tables are written to the folder of the results, as the program
# writes them.

# %%
folder = tempfile.mkdtemp()
night = satphot.Night(config, {"night.output": f'"{folder}"'}).run()
print(night.summary)

# %% [markdown]
# ## The zeropoint
#
# V = V_inst - ZP - k X - C (B-V). `determined` says which terms the stars of the night fixed.

# %%
zeropoint = night.zeropoint
print(zeropoint.equation)
for name, value, error in zip(
    ("ZP", "k", "C"), (zeropoint.zp_mag, zeropoint.k_mag_airmass, zeropoint.c_mag_mag), zeropoint.errors, strict=False
):
    print(f"{name:<3} {value:8.4f} +- {error:.4f}")
print(f"{zeropoint.n_used} measurements of {zeropoint.n_stars} stars, rms {zeropoint.rms_mag:.3f} mag")
print(zeropoint.determined)

# %% [markdown]
# ## The frames
#
# Each frame is a row, also one that failed: its `status` and `verdict` say whether to use it, its `reason` why not.

# %%
photometry = night.photometry
for word in ("use", "caution", "reject"):
    print(f"{word:<8} {np.sum(photometry['verdict'] == word):3d} frames")

# %% [markdown]
# ## Observed minus modelled
#
# By pass, of the frames to be used: the median, and 1.4826 times the median deviation from it.

# %%
residuals = night.residuals
good = residuals.where((residuals["verdict"] == "use") & np.isfinite(residuals["residual_mag"]))
for number in np.unique(good["pass"]):
    of_pass = good.where(good["pass"] == number)
    difference = of_pass["residual_mag"]
    median = np.median(difference)
    spread = 1.4826 * np.median(np.abs(difference - median))
    light = ", ".join(dict.fromkeys(of_pass["illum"].tolist()))
    print(f"pass {number:.0f}: {difference.size:2d} frames, median {median:+.3f} mag, scatter {spread:.3f} mag ({light})")

# %% [markdown]
# ## Light curves

# %%
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("matplotlib is not installed; nothing is drawn")
else:
    numbers = np.unique(good["pass"])
    figure, panels = plt.subplots(1, numbers.size, sharey=True, squeeze=False, figsize=(4 * numbers.size, 4), layout="constrained")
    for axes, number in zip(panels[0], numbers, strict=True):
        rows = good.where(good["pass"] == number)
        minutes = 1440 * (rows["mjd_mid_d"] - rows["mjd_mid_d"].min())
        axes.errorbar(minutes, rows["v_mag"], rows["v_mag_err"], fmt="o", label="observed")
        axes.plot(minutes, rows["model_v_mag"], "k.-", zorder=3, label="model")
        axes.set(xlabel="minutes", title=f"pass {number:.0f}")
    panels[0][0].set_ylabel("V [mag]")
    panels[0][0].invert_yaxis()
    panels[0][0].legend()
    plt.show()
