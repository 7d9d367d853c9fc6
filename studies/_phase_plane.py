"""Reference lines for figures of stress against slip rate.

The functions draw the line of steady sliding and lines of constant state.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from rsfstudy import Scene
from rsfstudy.slider import SceneFields
from rsfstudy.study import find_user_parts_in_axis_rows
from rsfstudy.study.figure_declarations import MatplotlibAxes

LN10 = math.log(10.0)


def steady_line_key(cell: xr.Dataset) -> tuple[str, float, float]:
    """Return the parameters that determine the line of steady sliding.

    Cells with the same parameters have the same line, and this line is drawn only once.

    Parameters
    ----------
    cell : xarray.Dataset
        Results of one cell.

    Returns
    -------
    tuple[str, float, float]
        Normal stress condition, driving angle, and steady friction at ten times V_* relative to
        mu_*.
    """
    scene = scene_from_coordinates(cell)
    return scene.normal_stress, scene.phi or 0.0, scene.steady_friction_minus_reference(LN10)


def scene_from_coordinates(cell: xr.Dataset) -> Scene:
    """Return the scene of a cell.

    Parameters
    ----------
    cell : xarray.Dataset
        Results of one cell, with the fields of the scene as coordinates.

    Returns
    -------
    Scene
        Scene with the values of the coordinates.
    """
    here = {str(name): cell[name].item() for name in cell.coords if cell[name].ndim == 0}
    parts = find_user_parts_in_axis_rows(here, [here])
    kinds = SceneFields.map_field_names_to_value_types(parts.values())
    # Coordinates that do not apply to the cell are NaN or an empty string.
    values = {n: v for n, v in here.items() if n in kinds and v == v and v != ""}
    flags = [name for name in values if kinds[name] in (bool, bool | None)]
    values |= {name: bool(values[name]) for name in flags}
    for name in SceneFields.find_inapplicable_fields(Scene().as_dict() | values, parts.values()):
        values.pop(name, None)
    return Scene(**values)


def steady_line(cell: xr.Dataset, log10_rates: np.ndarray) -> np.ndarray:
    """Compute the shear stress of steady sliding.

    Parameters
    ----------
    cell : xarray.Dataset
        Results of one cell.
    log10_rates : ndarray
        Decimal logarithms of V/V_*.

    Returns
    -------
    ndarray
        Shear stress in sigma_*. The stress is NaN at slip rates without steady sliding.
    """
    scene = scene_from_coordinates(cell)
    excesses = [scene.steady_friction_minus_reference(rate * LN10) for rate in log10_rates.tolist()]
    return _stresses_from_friction(scene, np.array(excesses))


def constant_state_line(cell: xr.Dataset, state: float, log10_rates: np.ndarray) -> np.ndarray:
    """Compute the shear stress at a constant value of the state variable.

    Parameters
    ----------
    cell : xarray.Dataset
        Results of one cell.
    state : float
        Value of the state variable Theta.
    log10_rates : ndarray
        Decimal logarithms of V/V_*.

    Returns
    -------
    ndarray
        Shear stress in sigma_*. The stress is NaN if no shear stress balances friction.
    """
    scene = scene_from_coordinates(cell)
    return _stresses_from_friction(scene, scene.a * log10_rates * LN10 + state)


def _stresses_from_friction(scene: Scene, excesses: np.ndarray) -> np.ndarray:
    """Compute the shear stresses for given differences of the friction coefficient from mu_*."""
    stresses = (scene.frictional_stress_from_friction(excess) for excess in excesses.tolist())
    return np.array([math.nan if g is None else scene.mu_star + g for g in stresses])


def plot_steady_line(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the line of steady sliding over the range of the axes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    reach, height = axes.get_xlim(), axes.get_ylim()
    rates = np.linspace(reach[0], reach[1], 400)
    one = dataset.isel(dict.fromkeys(dataset["status"].dims, 0))
    axes.plot(rates, steady_line(one, rates), ":", color="0.5", label="steady state")
    axes.set(xlim=reach, ylim=height)


def hatch_reversed_stress(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Hatch the area of negative shear stress if this area is visible.

    The friction laws apply to forward slip only, so results with negative shear stress are not
    valid.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study. Not used.
    axes : matplotlib.axes.Axes
        Axes with stress on the vertical axis.
    """
    lowest, highest = axes.get_ylim()
    if lowest < 0.0:
        grey = {"facecolor": "0.95", "edgecolor": "0.6", "linewidth": 0.0, "zorder": 0}
        axes.axhspan(lowest, 0.0, hatch="////", label="below 0: stress reversed", **grey)
        axes.set_ylim(lowest, highest)
