"""What figures in the plane of stress and slip rate share: the steady-state and constant-state
lines.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.slider import steady_state
from rsfstudy.vocabulary import quantity

LN10 = math.log(10.0)


def cot_phi(cell: xr.Dataset) -> float:
    """cot(phi) of one cell; 0 at constant normal stress."""
    if str(cell["normal_stress"].item()) == "constant" or "phi" not in cell.coords:
        return 0.0
    return 1.0 / math.tan(math.radians(float(cell["phi"])))


def steady_line(cell: xr.Dataset, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress of steady sliding at slip rates 10^x V_*; NaN where there is none."""
    mu_star, a = float(cell["mu_star"]), float(cell["a"])
    b, cot = a * float(cell["b_over_a"]), cot_phi(cell)
    lowest = steady_state.lowest_log_rate(mu_star, a, b, cot)
    stress = [
        mu_star
        + steady_state.steady_shear_stress(
            steady_state.steady_friction(rate, mu_star, a, b), mu_star, cot
        )
        if rate > lowest
        else math.nan
        for rate in (log10_rates * LN10).tolist()
    ]
    return np.array(stress)


def constant_state_line(cell: xr.Dataset, state: float, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress at one value of the state variable; NaN where no stress is as strong."""
    excess = float(cell["a"]) * log10_rates * LN10 + state
    friction = float(cell["mu_star"]) + excess
    support = 1.0 - friction * cot_phi(cell)
    return np.asarray(float(cell["mu_star"]) + excess / np.where(support > 0.0, support, np.nan))


def label_axes(axes: Axes) -> None:
    """Axis labels of the plane."""
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(f"Frictional stress, {quantity('frictional_stress').symbol}")
