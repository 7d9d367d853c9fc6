"""What figures in the plane of stress and slip rate share: the steady-state and constant-state
lines.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.slider.fields import FIELDS, KINDS, without_meaning
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.steady import stress_at
from rsfstudy.vocabulary import quantity

LN10 = math.log(10.0)


def coupling(cell: xr.Dataset) -> tuple[str, float]:
    """What decides the steady-state line: normal stress, and its angle."""
    scene = scene_of(cell)
    return scene.normal_stress, scene.phi or 0.0


def scene_of(cell: xr.Dataset) -> Scene:
    """The scene of one cell, from its coordinates."""
    own = (name for name in FIELDS if name in cell.coords and cell[name].ndim == 0)
    values = {name: cell[name].item() for name in own}
    values = {name: value for name, value in values.items() if value == value}  # no NaN
    values |= {name: bool(value) for name, value in values.items() if KINDS[name] is bool}
    for name in without_meaning(Scene().as_dict() | values):
        values.pop(name, None)
    return Scene(**values)


def steady_line(cell: xr.Dataset, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress of steady sliding at slip rates 10^x V_*; NaN where there is none."""
    scene = scene_of(cell)
    return _stresses(scene, (scene.a - scene.b) * log10_rates * LN10)


def constant_state_line(cell: xr.Dataset, state: float, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress at one value of the state variable; NaN where no stress is as strong."""
    scene = scene_of(cell)
    return _stresses(scene, scene.a * log10_rates * LN10 + state)


def _stresses(scene: Scene, excesses: np.ndarray) -> np.ndarray:
    """Shear stress at each friction coefficient, less mu_*."""
    found = (stress_at(scene, excess) for excess in excesses.tolist())
    return np.array([math.nan if g is None else scene.mu_star + g for g in found])


def label_axes(axes: Axes) -> None:
    """Axis labels of the plane."""
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(f"Frictional stress, {quantity('frictional_stress').symbol}")
