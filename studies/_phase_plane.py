"""Marks that figures in the plane of stress and slip rate share: the steady-state and
constant-state lines.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from rsfstudy import Scene
from rsfstudy.slider import (
    field_types,
    find_inapplicable_fields,
    steady_friction_excess,
    stress_for_friction,
)
from rsfstudy.study import find_named_user_parts
from rsfstudy.study.figure_declarations import Axes

LN10 = math.log(10.0)


def steady_line_key(cell: xr.Dataset) -> tuple[str, float, float]:
    """Choices that decide the steady-state line: normal stress, its angle, and the law where steady
    friction at ten times V_* tells of one.
    """
    scene = scene_from_coordinates(cell)
    return scene.normal_stress, scene.phi or 0.0, steady_friction_excess(scene, LN10)


def scene_from_coordinates(cell: xr.Dataset) -> Scene:
    """The scene of one cell, from its coordinates."""
    here = {str(name): cell[name].item() for name in cell.coords if cell[name].ndim == 0}
    parts = find_named_user_parts(here, [here])
    kinds = field_types(parts.values())
    # no NaN, and no part of the user's own where there is none
    values = {n: v for n, v in here.items() if n in kinds and v == v and v != ""}
    flags = [name for name in values if kinds[name] in (bool, bool | None)]
    values |= {name: bool(values[name]) for name in flags}
    for name in find_inapplicable_fields(Scene().as_dict() | values, parts.values()):
        values.pop(name, None)
    return Scene(**values)


def steady_line(cell: xr.Dataset, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress of steady sliding at slip rates 10^x V_*; NaN where there is none."""
    scene = scene_from_coordinates(cell)
    excesses = [steady_friction_excess(scene, rate * LN10) for rate in log10_rates.tolist()]
    return _stresses_from_friction(scene, np.array(excesses))


def constant_state_line(cell: xr.Dataset, state: float, log10_rates: np.ndarray) -> np.ndarray:
    """Shear stress at one value of the state variable; NaN where no stress is as strong."""
    scene = scene_from_coordinates(cell)
    return _stresses_from_friction(scene, scene.a * log10_rates * LN10 + state)


def _stresses_from_friction(scene: Scene, excesses: np.ndarray) -> np.ndarray:
    """Shear stress at each friction coefficient, less mu_*."""
    stresses = (stress_for_friction(scene, excess) for excess in excesses.tolist())
    return np.array([math.nan if g is None else scene.mu_star + g for g in stresses])


def plot_steady_line(dataset: xr.Dataset, axes: Axes) -> None:
    """Steady sliding, as far as the axes reach; a mark."""
    reach, height = axes.get_xlim(), axes.get_ylim()
    rates = np.linspace(reach[0], reach[1], 400)
    one = dataset.isel(dict.fromkeys(dataset["status"].dims, 0))
    axes.plot(rates, steady_line(one, rates), ":", color="0.5", label="steady state")
    axes.set(xlim=reach, ylim=height)


def hatch_reversed_stress(_dataset: xr.Dataset, axes: Axes) -> None:
    """Hatch where stress along y is below zero, if the axes reach there: friction of forward slip
    does not apply; a mark.
    """
    lowest, highest = axes.get_ylim()
    if lowest < 0.0:
        grey = {"facecolor": "0.95", "edgecolor": "0.6", "linewidth": 0.0, "zorder": 0}
        axes.axhspan(lowest, 0.0, hatch="////", label="below 0: stress reversed", **grey)
        axes.set_ylim(lowest, highest)
