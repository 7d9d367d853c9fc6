"""Base classes and parameter indices for user-defined parts of a slider.

Derive a state evolution law from ``Law`` or ``LawBase``, a normal stress condition from
``NormalStress``, a pore fluid from ``Fluid``, the dynamics from ``Dynamics``, a loading from
``Loading``, and a temperature from ``Temperature``. Declare the fields of the part with the
functions ``number()`` and ``flag()``. The functions of parts receive a tuple of parameters ``p``.
Constants such as ``LAW`` are the indices of the parameters in the tuple ``p``. This package only
exports names that are defined in ``rsfstudy.slider``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.slider.dynamics import Dynamics
    from rsfstudy.slider.fluid import Fluid
    from rsfstudy.slider.laws import Law, LawBase
    from rsfstudy.slider.loading import Loading, Segment
    from rsfstudy.slider.normal_stress import NormalStress
    from rsfstudy.slider.parameter_layout import (
        BOUNDARY_PRESSURE_RATE,
        DYNAMICS,
        FLUID,
        IMPOSED_NORMAL_STRESS,
        LAW,
        LOAD_VELOCITY,
        LOADING,
        LOG_LOAD_VELOCITY,
        MU_STAR,
        NORMAL_STRESS,
        SEGMENT_END,
        SEGMENT_LOG_VELOCITY,
        SEGMENT_NOISE_RATE,
        SEGMENT_START,
        SEGMENT_STRESS_FALL,
        SEGMENT_STRESS_RATE,
        SEGMENT_VELOCITY,
        STIFFNESS,
        STRESS_DEPENDENCE,
        A,
        B,
    )
    from rsfstudy.slider.parts import Part, flag, number
    from rsfstudy.slider.scene_view import SceneView
    from rsfstudy.slider.temperature import Temperature
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "slider.dynamics": ("Dynamics",),
            "slider.fluid": ("Fluid",),
            "slider.laws": ("Law", "LawBase"),
            "slider.loading": ("Loading", "Segment"),
            "slider.normal_stress": ("NormalStress",),
            "slider.parameter_layout": (
                "A",
                "B",
                "BOUNDARY_PRESSURE_RATE",
                "DYNAMICS",
                "FLUID",
                "IMPOSED_NORMAL_STRESS",
                "LAW",
                "LOADING",
                "LOAD_VELOCITY",
                "LOG_LOAD_VELOCITY",
                "MU_STAR",
                "NORMAL_STRESS",
                "SEGMENT_END",
                "SEGMENT_LOG_VELOCITY",
                "SEGMENT_NOISE_RATE",
                "SEGMENT_START",
                "SEGMENT_STRESS_FALL",
                "SEGMENT_STRESS_RATE",
                "SEGMENT_VELOCITY",
                "STIFFNESS",
                "STRESS_DEPENDENCE",
            ),
            "slider.parts": ("Part", "flag", "number"),
            "slider.scene_view": ("SceneView",),
            "slider.temperature": ("Temperature",),
        },
    )

__all__ = [
    "A",
    "B",
    "BOUNDARY_PRESSURE_RATE",
    "DYNAMICS",
    "Dynamics",
    "FLUID",
    "Fluid",
    "IMPOSED_NORMAL_STRESS",
    "LAW",
    "LOADING",
    "LOAD_VELOCITY",
    "LOG_LOAD_VELOCITY",
    "Law",
    "LawBase",
    "Loading",
    "MU_STAR",
    "NORMAL_STRESS",
    "NormalStress",
    "Part",
    "SEGMENT_END",
    "SEGMENT_LOG_VELOCITY",
    "SEGMENT_NOISE_RATE",
    "SEGMENT_START",
    "SEGMENT_STRESS_FALL",
    "SEGMENT_STRESS_RATE",
    "SEGMENT_VELOCITY",
    "STIFFNESS",
    "STRESS_DEPENDENCE",
    "SceneView",
    "Segment",
    "Temperature",
    "flag",
    "number",
]
