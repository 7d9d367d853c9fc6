"""Figure that shows a single motion or limit cycle.

The function ``plot_motion`` plots friction and slip rate against displacement or time, and draws
the trajectory of the motion in the phase plane.
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

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.plots._axis_formatting import set_log_scale
from rsfstudy.plots._figure_size import (
    compute_figure_size_in_inches,
    compute_max_header_line_characters,
    limit_panel_column_count_to_width,
)
from rsfstudy.plots._image_files import NotebookFigure
from rsfstudy.plots._style import (
    add_legend,
    add_panel_letters,
    cycle_style,
    finalize_layout,
    freeze_tick_label_size,
    increase_figure_height_for_legends,
    style_context,
)
from rsfstudy.plots._text_formatting import convert_symbols_to_mathtext, wrap_text
from rsfstudy.rig import DatasetUnits, Rig
from rsfstudy.slider import Scene
from rsfstudy.storage import StoredDataset

#: Height of a panel in mm.
MOTION_PANEL_HEIGHT_MM = 48.0
NATURAL_LOG_OF_10 = math.log(10.0)
#: Variables that can be drawn along x.
X_AXIS_VARIABLES_OF_MOTION = ("load_point_displacement", "slip", "time")
#: Relative change below which the load point displacement or the slip rate counts as constant.
#: Smaller changes are due to rounding errors.
_MAX_RELATIVE_CHANGE_TREATED_AS_CONSTANT = 1e-6
_FRICTION_AXIS_LABEL = r"Friction coefficient, $\mu$"


@accept_former_keyword_names
@partial(raise_only_rsfstudy_errors, applies_to_internal_calls=True)
def plot_motion(
    motion: xr.Dataset,
    rig: Rig | None = None,
    *,
    against: str | None = None,
    style: Any = None,
    width: Any = None,
    header: bool = True,
) -> Figure:
    """Draw a motion or a limit cycle.

    Parameters
    ----------
    motion : xarray.Dataset
        Motion from ``rsfstudy.simulate``, or limit cycle from ``rsfstudy.limit_cycle``. The
        required variables are ``slip``, ``log10_slip_rate``, ``frictional_stress``, the variable
        along x, and ``normal_stress_ratio`` or ``effective_normal_stress``. In addition, a motion
        needs ``friction_coefficient``, and a limit cycle needs ``shear_stress``. All variables must
        have the same dimensions as the variable ``slip``. The attribute ``scene`` is also required.
    rig : Rig, optional
        Rig whose scales convert the axes to MPa, um and s. By default, the axes are in the units of
        the dataset.
    against : {"load_point_displacement", "slip", "time"}, optional
        Variable along x. The default is the load point displacement, or the slip if the load point
        is stationary. For a limit cycle, the default is the time, because the load point
        displacement is unknown.
    style : path, str, dict or list, optional
        Styles that override the style of rsfstudy, as for ``rsfstudy.plot``.
    width : quantity, optional
        Width of the figure, from "60 mm" to "600 mm". The default is 174 mm. If the figure is
        narrower than 110 mm, it has a single column of panels.
    header : bool, default: True
        If False, the figure has no title.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with three panels. The panels show the friction coefficient, the slip rate, and the
        trajectory in the phase plane with the steady-state friction. For a limit cycle, the first
        panel shows the shear stress.

    Raises
    ------
    DataError
        If the dataset is not a motion or a limit cycle, or if the motion contains no values.
    InvalidValue
        If ``against`` is unknown, if the style or the width is invalid, or if the dataset cannot be
        converted to the units of the rig.

    Examples
    --------
    >>> from rsfstudy import Scene, plot_motion, simulate
    >>> scene = Scene(b_over_a=2.0, stiffness_ratio=1.2, load_velocity_ratio=2.0)
    >>> figure = plot_motion(simulate(scene, duration=5.0))
    >>> len(figure.axes)
    3
    """
    if against not in (None, *X_AXIS_VARIABLES_OF_MOTION):
        raise InvalidValue("against", against, "is unknown", choices=X_AXIS_VARIABLES_OF_MOTION)
    _check_motion_variables(motion, against)
    if not motion["slip"].notnull().any():
        text = f"{motion.attrs.get('status', '')}: {motion.attrs.get('message', '')}"
        raise DataError(f"the dataset contains no motion, so there is nothing to draw. {text}")
    against = against or _choose_x_variable(motion)
    shown = motion if rig is None else rig.in_units(motion, **DatasetUnits.DISPLAY_UNITS)
    with style_context(style, width):
        figure, upper, lower, plane = _create_motion_panels(limit_panel_column_count_to_width(2))
        for axes in figure.axes:
            freeze_tick_label_size(axes)
        if "friction_coefficient" in shown:
            upper.plot(shown[against], shown["friction_coefficient"])
            upper.set_ylabel(_FRICTION_AXIS_LABEL)
        else:
            upper.plot(shown[against], shown["shear_stress"])
            stress = shown["shear_stress"].assign_attrs(long_name="shear stress")
            upper.set_ylabel(_format_axis_label_of_variable(stress))
        upper.tick_params(labelbottom=False)
        _draw_slip_rate(shown, lower, against)
        lower.set_xlabel(_format_x_label(motion, shown[against]))
        _draw_phase_plane(motion, shown, plane)
        add_panel_letters(figure.axes)
        if header:
            title = convert_symbols_to_mathtext(_format_motion_title(motion))
            figure.suptitle(wrap_text(title, compute_max_header_line_characters(figure)))
        increase_figure_height_for_legends(figure, [[upper], [lower], [plane]])
        finalize_layout(figure)
    return figure


def _create_motion_panels(column_count: int) -> tuple[NotebookFigure, Axes, Axes, Axes]:
    """Create a figure with empty panels for friction, slip rate and the phase plane.

    If there are two columns, the phase plane is to the right of the other panels. Otherwise, the
    phase plane is below the other panels.
    """
    rows = 2 if column_count == 2 else 3
    size = compute_figure_size_in_inches(column_count, rows, MOTION_PANEL_HEIGHT_MM)
    figure = NotebookFigure(figsize=size, layout="constrained")
    grid = figure.add_gridspec(rows, column_count)
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    plane = figure.add_subplot(grid[:, 1] if column_count == 2 else grid[2, 0])
    return figure, upper, lower, plane


def _check_motion_variables(motion: xr.Dataset, x_variable: str | None) -> None:
    """Check that a dataset has the variables of a motion or a limit cycle.

    Raises
    ------
    DataError
        If a variable is missing, if a variable is not numeric or has the wrong dimensions, or if a
        slip rate exceeds the range of floating-point numbers.
    """
    stress = () if "friction_coefficient" in motion else ("shear_stress",)
    needed = ("slip", x_variable or "time", "frictional_stress", "log10_slip_rate", *stress)
    known = [name for name in X_AXIS_VARIABLES_OF_MOTION if name in motion]
    for name in (*needed, _find_normal_stress_variable_name(motion), *known):
        if name not in motion:
            text = "is missing. The dataset is neither a motion from simulate nor a limit cycle"
            raise DataError(f"{name} {text}")
        if motion[name].dims != motion["slip"].dims or motion[name].dtype.kind not in "fiu":
            text = (
                "must be numeric and have the dimensions of slip, "
                f"{', '.join(map(str, motion['slip'].dims))}"
            )
            raise DataError(f"{name} {text}. Pass a motion from rsfstudy.simulate")
    largest = float(np.abs(motion["log10_slip_rate"]).max())
    if largest > sys.float_info.max_10_exp:
        rule = f"must be at most {sys.float_info.max_10_exp} in absolute value"
        raise DataError(
            f"log10_slip_rate = {largest:g} {rule}. The file is damaged. Run the simulation again."
        )


def _find_normal_stress_variable_name(motion: xr.Dataset) -> str:
    """Return the name of the variable that contains the normal stress of a motion."""
    return "normal_stress_ratio" if "normal_stress_ratio" in motion else "effective_normal_stress"


def _choose_x_variable(motion: xr.Dataset) -> str:
    """Choose the variable along x.

    The function chooses the load point displacement, or the slip if the load point displacement is
    constant apart from rounding errors. If the dataset has no load point displacement, the function
    chooses the time.
    """
    if "load_point_displacement" not in motion:
        return "time"
    pulled, slid = (np.asarray(motion[name]) for name in ("load_point_displacement", "slip"))
    least = _MAX_RELATIVE_CHANGE_TREATED_AS_CONSTANT * max(
        float(np.ptp(slid)), float(np.abs(pulled).max())
    )
    return "load_point_displacement" if np.ptp(pulled) > least else "slip"


def _format_motion_title(motion: xr.Dataset) -> str:
    """Return the title of a motion, including the status if the motion ended early."""
    status = motion.attrs.get("status", "ok")
    ending = "" if status == "ok" else f" [{status}: {motion.attrs.get('message', '')}]"
    title = motion.attrs.get("title", "Limit cycle of a spring-slider")
    return f"{title}{ending}"


def _draw_slip_rate(displayed_motion: xr.Dataset, axes: Axes, x_variable: str) -> None:
    """Draw the slip rate, or its logarithm if the dataset has no slip rate."""
    if "slip_rate" in displayed_motion:
        axes.plot(displayed_motion[x_variable], displayed_motion["slip_rate"])
        # A constant slip rate needs explicit limits, because rounding errors would fill the panel.
        if (
            np.ptp(ends := axes.dataLim.intervaly)
            < _MAX_RELATIVE_CHANGE_TREATED_AS_CONSTANT * ends[1]
        ):
            axes.set_ylim(0.5 * ends[0], 2.0 * ends[1])
        set_log_scale(axes, "y")
        axes.set_ylabel(
            "Slip rate "
            f"({_format_units(str(displayed_motion['slip_rate'].attrs.get('units', '1')))})"
        )
    else:
        axes.plot(displayed_motion[x_variable], displayed_motion["log10_slip_rate"])
        axes.set_ylabel(r"Slip rate, $\log_{10}(V/V_*)$")


def _draw_phase_plane(motion: xr.Dataset, displayed_motion: xr.Dataset, axes: Axes) -> None:
    """Plot friction and steady-state friction against slip rate."""
    logs = motion["log10_slip_rate"]
    rates = displayed_motion.get("slip_rate", (10.0**logs).assign_attrs(units="$V_*$"))
    scale = float(rates[0]) / 10.0 ** float(logs[0])
    # During ruptures, the spring stress is the sum of the frictional stress and the stress that
    # accelerates the mass.
    friction = motion["frictional_stress"] / motion[_find_normal_stress_variable_name(motion)]
    axes.plot(scale * 10.0**logs, friction, **cycle_style(0), label="motion")
    axes.plot(
        scale * 10.0 ** logs[0], friction[0], "o", color=cycle_style(0)["color"], label="its start"
    )
    beyond = np.linspace(float(logs.min()) - 0.3, float(logs.max()) + 0.3, 201)
    steady = _compute_steady_state_friction(StoredDataset(motion).scene_fields, beyond)
    if steady is not None:
        axes.plot(scale * 10.0**beyond, steady, "--", color="0.4", label="steady sliding")
    set_log_scale(axes, "x")
    axes.set_xlabel(f"Slip rate ({_format_units(str(rates.attrs.get('units', '1')))})")
    axes.set_ylabel(r"Friction coefficient of the fault, $\mu$")
    add_legend(axes, 3)


def _compute_steady_state_friction(
    scene_fields: dict[str, Any], log10_slip_rates: np.ndarray
) -> np.ndarray | None:
    """Compute the steady-state friction coefficient.

    The loading of the scene is ignored, because steady-state friction does not depend on the
    loading. The result is None if rsfstudy cannot build the scene, for example because of an
    unknown friction law.
    """
    try:
        scene = Scene(
            **{k: v for k, v in scene_fields.items() if k not in ("loading", "segments", "samples")}
        )
    except InvalidValue:
        return None
    rates = log10_slip_rates * NATURAL_LOG_OF_10
    excess = [scene.steady_friction_minus_reference(x) for x in rates.tolist()]
    return np.asarray(scene.mu_star + np.array(excess))


def _format_axis_label_of_variable(variable: xr.DataArray) -> str:
    """Build an axis label from the attributes of a variable."""
    name = str(variable.attrs.get("long_name", variable.name))
    name = name.removesuffix(" since the step") if "phase" in variable.dims else name
    name = f"{name[:1].upper()}{name[1:]}"
    units = str(variable.attrs.get("scale", variable.attrs.get("units", "1")))
    scales = {"D_c": "$D_c$", "D_c/V_*": "$D_c/V_*$", "sigma_*": r"$\sigma_*$"}
    return f"{name} ({scales.get(units, _format_units(units))})"


def _format_x_label(motion: xr.Dataset, x_variable: xr.DataArray) -> str:
    """Return the label of the x axis.

    The label of the time axis does not refer to one particular step, because a protocol may have
    several steps.
    """
    label = _format_axis_label_of_variable(x_variable)
    has_protocol = bool(StoredDataset(motion).scene_fields.get("loading"))
    return label.replace("Time since the step", "Time") if has_protocol else label


def _format_units(units: str) -> str:
    """Format units for the label of an axis."""
    return units.replace(" s-1", "/s").replace("um", r"$\mu$m")
