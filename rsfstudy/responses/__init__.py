"""Measures that compute responses to small perturbations, steps, holds and ramps.

The package contains the measures ``LinearStability``, ``VelocityStep``, ``Healing``,
``StepResponse`` and ``RigidResponse``. The package never searches for stability boundaries or limit
cycles, and never reads or writes a file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.responses._recorded_motion import (
        compute_settled_friction_flag,
        estimate_errors_at_instants,
    )
    from rsfstudy.responses.healing import Healing
    from rsfstudy.responses.linear_stability import LinearStability
    from rsfstudy.responses.rigid_response import RigidResponse
    from rsfstudy.responses.step_response import StepResponse
    from rsfstudy.responses.velocity_step import VelocityStep
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "responses._recorded_motion": (
                "estimate_errors_at_instants",
                "compute_settled_friction_flag",
            ),
            "responses.healing": ("Healing",),
            "responses.linear_stability": ("LinearStability",),
            "responses.rigid_response": ("RigidResponse",),
            "responses.step_response": ("StepResponse",),
            "responses.velocity_step": ("VelocityStep",),
        },
    )

__all__ = [
    "Healing",
    "LinearStability",
    "RigidResponse",
    "StepResponse",
    "VelocityStep",
    "estimate_errors_at_instants",
    "compute_settled_friction_flag",
]
