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
# # A zeropoint from a table of one's own
#
# Stars measured by another program and matched with a catalogue are enough: instrumental magnitudes, catalogue magnitudes
# and colours, airmass. Here the table is drawn with known terms and a seed, with 5 % of blends, so that the answer can be
# checked; a file (CSV, ECSV, VOTable, FITS) is given to `fit_zeropoint` by its path.
#
# Needs `satphot` alone; with matplotlib it draws. Open it as a notebook with jupytext, or run it as a program.

# %%
import numpy as np

import satphot

rng = np.random.default_rng(11)
truth = {"ZP": -23.40, "k": 0.13, "C": 0.06}
n_pointings, n_each = 8, 40
pointing = np.repeat(np.arange(n_pointings), n_each)
airmass = np.linspace(1.02, 2.1, n_pointings)[pointing]
v_mag = rng.uniform(9.0, 13.5, pointing.size)
b_v_mag = rng.uniform(0.1, 1.3, pointing.size)
error = 0.005 * 10 ** (0.2 * (v_mag - 9.0))
inst_mag = v_mag + truth["ZP"] + truth["k"] * airmass + truth["C"] * b_v_mag + rng.normal(0.0, error)
blended = rng.random(pointing.size) < 0.05
inst_mag[blended] -= rng.exponential(0.5, blended.sum())

# %% [markdown]
# ## Fit
#
# Columns are found by their names; `columns=` names others. Errors that are given weigh the stars.

# %%
table = {
    "inst_mag": inst_mag,
    "inst_mag_err": error,
    "v_mag": v_mag,
    "b_v_mag": b_v_mag,
    "airmass": airmass,
    "pointing": pointing.astype(float),
}
fit = satphot.fit_zeropoint(table)
print(fit)
found = {"ZP": fit.zp_mag, "k": fit.k_mag_airmass, "C": fit.c_mag_mag}
for (name, value), sigma in zip(found.items(), fit.errors, strict=False):
    print(f"{name:<3} {value:8.4f} +- {sigma:.4f}   put in {truth[name]:8.4f}   {(value - truth[name]) / sigma:+.1f} sigma")
for note in fit.notes:
    print("note:", note)

# %% [markdown]
# ## The stars
#
# The weight of each star after the robust fit: blends have next to none.

# %%
stars = fit.stars()
weight = stars["fit_weight"]
print(f"mean weight of good stars {np.nanmean(weight[~blended]):.2f}, of blends {np.nanmean(weight[blended]):.2f}")

# %% [markdown]
# ## Use it
#
# Calibrated magnitudes of two targets, with the error of the calibration at their airmass and colour.

# %%
calibrated = fit.calibrate(inst_mag=[-12.0, -10.5], airmass=[1.1, 1.8], b_v_mag=[0.65, 0.65])
for v, sigma, interval in zip(calibrated["v_mag"], calibrated["v_err_mag"], calibrated["v_err_95_mag"], strict=True):
    print(f"V {v:.3f} +- {sigma:.3f} (95 %: {interval:.3f})")

# %% [markdown]
# ## Residuals against airmass and colour

# %%
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("matplotlib is not installed; nothing is drawn")
else:
    figure, (left, right) = plt.subplots(1, 2, sharey=True, figsize=(9, 4), layout="constrained")
    for axes, x, label in ((left, airmass, "airmass"), (right, b_v_mag, "B-V [mag]")):
        points = axes.scatter(x, stars["fit_residual_mag"], c=weight, s=12)
        axes.axhline(0.0, color="k", linewidth=0.5)
        axes.set(xlabel=label, ylim=(-0.1, 0.1))
    left.set_ylabel("residual [mag]")
    figure.colorbar(points, label="weight")
    plt.show()
