"""Widgets of the record view."""

from __future__ import annotations

from typing import Any

import panel as pn

from rsfstudy.explorer.fit_choices import FitChoices
from rsfstudy.fitting import LoadingStep

#: Laws that the record view offers. The other laws need parameters that a fit does not determine.
_SELECTABLE_FRICTION_LAWS = (
    "slip",
    "slowness",
    "perrin_rice_zheng",
    "family",
    "two_slip_states",
    "two_slowness_states",
)
#: Parameters that can be fitted in addition to the default parameters.
_ADDITIONAL_FIT_PARAMETER_BY_LABEL = {
    "stiffness k": "stiffness",
    "time of the step": "step_time",
    "alpha (normal stress steps)": "alpha",
    "exponent of the law family": "law_exponent",
}
_TREND_DEGREE_BY_LABEL = {"none": 0, "linear": 1, "quadratic": 2}
_NOISE_MODEL_BY_LABEL = {
    "autoregressive, automatic order": "ar",
    "AR(1)": "ar1",
    "AR(2)": "ar2",
} | {"white": "white"}
_LOADING_OPTION_BY_LABEL = {
    "constant velocities between steps": "steps",
    "recorded displacement": "recorded",
}


def create_fit_choice_widgets() -> dict[str, Any]:
    """Create the widgets of the choices.

    Returns
    -------
    dict of str to panel.widgets.Widget
        Widgets by the name of the field of ``FitChoices``, with the default values.
    """
    default, kinds = FitChoices(), pn.widgets
    half = {"width": 125, "format": "0.[000000]"}
    wide = {"sizing_mode": "stretch_width"}
    return {
        "columns": _create_text_input("Columns", "time=t (s), friction=mu"),
        "decimal": kinds.Select(label="Decimal separator", options=[".", ","], **wide),
        "normal_stress": _create_text_input("Normal stress, if not in the file", "20 MPa"),
        "begin": kinds.FloatInput(label="Begin (s)", value=None, **half),
        "end": kinds.FloatInput(label="End (s)", value=None, **half),
        "laws": kinds.MultiChoice(
            label="Laws", options=[*_SELECTABLE_FRICTION_LAWS], value=[*default.laws], **wide
        ),
        "stiffness": _create_text_input("Stiffness", "0.04 MPa/um, 2e-3 1/um or from record"),
        "trend_degree": kinds.Select(
            label="Trend of friction",
            options=_TREND_DEGREE_BY_LABEL,
            value=default.trend_degree,
            **wide,
        ),
        "more_free": kinds.MultiChoice(
            label="Also fit", options=_ADDITIONAL_FIT_PARAMETER_BY_LABEL, **wide
        ),
        "slip_distance": _create_text_input("Initial guess of Dc", "10 um"),
        "before": _create_text_input("Displacement before each step", "100 um"),
        "after": _create_text_input("Displacement after each step", "200 um"),
        "noise": kinds.Select(
            label="Noise model", options=_NOISE_MODEL_BY_LABEL, value=default.noise, **wide
        ),
        "loading": kinds.Select(
            label="Loading", options=_LOADING_OPTION_BY_LABEL, value=default.loading, **wide
        ),
        "together": kinds.Checkbox(label="Fit all steps jointly"),
    }


def _create_text_input(label: str, example: str) -> Any:
    """Create a text field with an example."""
    return pn.widgets.TextInput(label=label, placeholder=example, sizing_mode="stretch_width")


def describe_loading_step(step_number: int, step: LoadingStep) -> str:
    """Describe a step in one line.

    Parameters
    ----------
    step_number : int
        Number of the step, starting from 1.
    step : LoadingStep
        Step of load point velocity or normal stress.

    Returns
    -------
    str
        Number, time, velocities, and the normal stresses if the normal stress changes.
    """
    text = f"{step_number}: {step.start:.6g} s, "
    text += f"{step.velocity_before:.3g} to {step.velocity_after:.3g} µm/s"
    if step.normal_stress_ratio != 1.0:
        text += f", {step.stress_before * 1e-6:.3g} to {step.stress_after * 1e-6:.3g} MPa"
    return text
