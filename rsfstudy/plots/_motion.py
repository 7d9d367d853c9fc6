"""The picture of one motion or limit cycle: friction and slip rate along it, and its path on the
phase plane.
"""

from __future__ import annotations

import math
import sys
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy._deprecation import renamed_keywords
from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.plots._axes import set_log_scale
from rsfstudy.plots._figures import NotebookFigure
from rsfstudy.plots._style import (
    add_legend,
    add_panel_letters,
    cycle_style,
    enlarge_for_legends,
    figure_size,
    finalize_layout,
    freeze_ticks,
    style_context,
)
from rsfstudy.plots._text import to_mathtext, wrap_text
from rsfstudy.rig import DISPLAY_BASE_UNITS, Rig
from rsfstudy.slider import Scene, steady_friction_excess
from rsfstudy.storage import read_scene_fields

#: Of a panel, in mm.
PANEL_HEIGHT = 48.0
LN10 = math.log(10.0)
#: What a motion may be drawn against.
ABSCISSAE = ("load_point_displacement", "slip", "time")
#: Change of load point displacement, over slip, below which the load point is held.
_RELATIVE_ROUNDING_ERROR = 1e-6
_FRICTION_LABEL = r"Friction coefficient, $\mu$"


@renamed_keywords
@partial(error_boundary, is_inner=True)
def plot_motion(
    motion: xr.Dataset, rig: Rig | None = None, *, against: str | None = None
) -> Figure:
    """Draw one motion, or a limit cycle.

    Parameters
    ----------
    motion : xarray.Dataset
        As `rsfstudy.simulate` or `rsfstudy.limit_cycle` gives it.
    rig : Rig, optional
        The rig, in whose units the axes are then.
    against : {"load_point_displacement", "slip", "time"}, optional
        What friction and slip rate are drawn against: by default load point displacement, or slip
        where the load point is held throughout; time along a limit cycle, of which load point
        displacement is not known.

    Returns
    -------
    matplotlib.figure.Figure
        Friction (of a limit cycle shear stress), slip rate, and the path on the plane of both with
        the line of steady sliding.

    Raises
    ------
    DataError
        Where the dataset is no motion and no limit cycle, or there is none.
    InvalidValue
        For another abscissa.
    """
    if against not in (None, *ABSCISSAE):
        raise InvalidValue("against", against, "is unknown", choices=ABSCISSAE)
    _check_motion(motion, against)
    if not motion["slip"].notnull().any():
        text = f"{motion.attrs.get('status', '')}: {motion.attrs.get('message', '')}"
        raise DataError(f"there is no motion, and nothing to draw. {text}")
    against = against or _choose_abscissa(motion)
    shown = motion if rig is None else rig.in_units(motion, **DISPLAY_BASE_UNITS)
    with style_context():
        figure = NotebookFigure(figsize=figure_size(2, 2, PANEL_HEIGHT), layout="constrained")
        grid = figure.add_gridspec(2, 2)
        upper = figure.add_subplot(grid[0, 0])
        lower = figure.add_subplot(grid[1, 0], sharex=upper)
        plane = figure.add_subplot(grid[:, 1])
        for axes in figure.axes:
            freeze_ticks(axes)
        if "friction_coefficient" in shown:
            upper.plot(shown[against], shown["friction_coefficient"])
            upper.set_ylabel(_FRICTION_LABEL)
        else:
            upper.plot(shown[against], shown["shear_stress"])
            stress = shown["shear_stress"].assign_attrs(long_name="shear stress")
            upper.set_ylabel(_axis_label(stress))
        upper.tick_params(labelbottom=False)
        _draw_slip_rate(shown, lower, against)
        lower.set_xlabel(_axis_label(shown[against]))
        _draw_phase_plane(motion, shown, plane)
        add_panel_letters(figure.axes)
        figure.suptitle(wrap_text(to_mathtext(_motion_title(motion)), 120))
        enlarge_for_legends(figure, [[upper], [lower, plane]])
        finalize_layout(figure)
    return figure


def _check_motion(motion: xr.Dataset, against: str | None) -> None:
    """Check that a dataset has the variables of a motion or a limit cycle.

    Raises
    ------
    DataError
        If a variable is missing, is not numeric, or has the wrong dimensions.
    """
    stress = () if "friction_coefficient" in motion else ("shear_stress",)
    needed = ("slip", against or "time", "frictional_stress", "log10_slip_rate", *stress)
    known = [name for name in ABSCISSAE if name in motion]
    for name in (*needed, _normal_stress_name(motion), *known):
        if name not in motion:
            text = "is missing: it is no motion as simulate gives it, and no limit cycle"
            raise DataError(f"{name} {text}")
        if motion[name].dims != motion["slip"].dims or motion[name].dtype.kind not in "fiu":
            text = f"must be numbers along {', '.join(map(str, motion['slip'].dims))}, as slip is"
            raise DataError(f"{name} {text}: the dataset is no motion as simulate returns it")
    largest = float(np.abs(motion["log10_slip_rate"]).max())
    if largest > sys.float_info.max_10_exp:
        rule = f"must be at most {sys.float_info.max_10_exp} in absolute value"
        raise DataError(f"log10_slip_rate = {largest:g} {rule}: the file is damaged. Run it again.")


def _normal_stress_name(motion: xr.Dataset) -> str:
    """Return the name of the normal stress variable of a motion."""
    return "normal_stress_ratio" if "normal_stress_ratio" in motion else "effective_normal_stress"


def _choose_abscissa(motion: xr.Dataset) -> str:
    """Load point displacement, or slip where that does not change but for rounding; time where it
    is not known.
    """
    if "load_point_displacement" not in motion:
        return "time"
    pulled, slid = (np.asarray(motion[name]) for name in ("load_point_displacement", "slip"))
    least = _RELATIVE_ROUNDING_ERROR * max(float(np.ptp(slid)), float(np.abs(pulled).max()))
    return "load_point_displacement" if np.ptp(pulled) > least else "slip"


def _motion_title(motion: xr.Dataset) -> str:
    """Title of a motion, and how it ended if not as it should."""
    status = motion.attrs.get("status", "ok")
    ending = "" if status == "ok" else f" [{status}: {motion.attrs.get('message', '')}]"
    title = motion.attrs.get("title", "Limit cycle of a spring-slider")
    return f"{title}{ending}"


def _draw_slip_rate(shown: xr.Dataset, axes: Axes, against: str) -> None:
    """Slip rate in the units of the rig, or its logarithm over V_*."""
    if "slip_rate" in shown:
        axes.plot(shown[against], shown["slip_rate"])
        if (
            np.ptp(ends := axes.dataLim.intervaly) < _RELATIVE_ROUNDING_ERROR * ends[1]
        ):  # it slides steadily
            axes.set_ylim(0.5 * ends[0], 2.0 * ends[1])
        set_log_scale(axes, "y")
        axes.set_ylabel(
            f"Slip rate ({_format_units(str(shown['slip_rate'].attrs.get('units', '1')))})"
        )
    else:
        axes.plot(shown[against], shown["log10_slip_rate"])
        axes.set_ylabel(r"Slip rate, $\log_{10}(V/V_*)$")


def _draw_phase_plane(motion: xr.Dataset, shown: xr.Dataset, axes: Axes) -> None:
    """Friction against slip rate, with the line of steady sliding."""
    logs = motion["log10_slip_rate"]
    rates = shown.get("slip_rate", (10.0**logs).assign_attrs(units="$V_*$"))
    scale = float(rates[0]) / 10.0 ** float(logs[0])
    # in ruptures the spring carries what accelerates the mass, too
    friction = motion["frictional_stress"] / motion[_normal_stress_name(motion)]
    axes.plot(scale * 10.0**logs, friction, **cycle_style(0), label="motion")
    axes.plot(
        scale * 10.0 ** logs[0], friction[0], "o", color=cycle_style(0)["color"], label="its start"
    )
    beyond = np.linspace(float(logs.min()) - 0.3, float(logs.max()) + 0.3, 201)
    steady = _steady_friction(read_scene_fields(motion), beyond)
    if steady is not None:
        axes.plot(scale * 10.0**beyond, steady, "--", color="0.4", label="steady sliding")
    set_log_scale(axes, "x")
    axes.set_xlabel(f"Slip rate ({_format_units(str(rates.attrs.get('units', '1')))})")
    axes.set_ylabel(r"Friction coefficient of the fault, $\mu$")
    add_legend(axes, 3)


def _steady_friction(values: dict[str, Any], log10_rates: np.ndarray) -> np.ndarray | None:
    """Friction coefficient of steady sliding; None of a scene with a part that is not known here,
    but for its loading, which does not matter.
    """
    try:
        scene = Scene(
            **{k: v for k, v in values.items() if k not in ("loading", "segments", "samples")}
        )
    except InvalidValue:
        return None
    rates = log10_rates * LN10
    excess = [steady_friction_excess(scene, x) for x in rates.tolist()]
    return np.asarray(scene.mu_star + np.array(excess))


def _axis_label(values: xr.DataArray) -> str:
    name = str(values.attrs.get("long_name", values.name))
    name = name.removesuffix(" since the step") if "phase" in values.dims else name
    name = f"{name[:1].upper()}{name[1:]}"
    units = str(values.attrs.get("scale", values.attrs.get("units", "1")))
    scales = {"D_c": "$D_c$", "D_c/V_*": "$D_c/V_*$", "sigma_*": r"$\sigma_*$"}
    return f"{name} ({scales.get(units, _format_units(units))})"


def _format_units(units: str) -> str:
    """Units as an axis names them."""
    return units.replace(" s-1", "/s").replace("um", r"$\mu$m")
