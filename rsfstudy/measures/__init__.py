"""Measures, which compute named results of a scene.

A measure is a frozen dataclass derived from ``Measure``. A measure returns an outcome with a
status, named results and error estimates. Use the measures of this package in studies, or derive
your own measure from ``Measure``. The package only exports names: each measure is defined in the
package of its topic. Measures that are used only in named studies are defined in the modules of the
named studies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.critical_steps.critical_step import CriticalStep
    from rsfstudy.critical_steps.triggered_instability import Triggered
    from rsfstudy.fitting.fit_measure import Fit
    from rsfstudy.limit_cycles.event_statistics import EventStatistics
    from rsfstudy.limit_cycles.limit_cycle import LimitCycle
    from rsfstudy.measure_base._declaration_checks import OutputValue, PlainValue
    from rsfstudy.measure_base.elasticities import Elasticities
    from rsfstudy.measure_base.measure import RESERVED_NAMES, Measure, Outcome
    from rsfstudy.quantities import Output, Quantity
    from rsfstudy.responses.healing import Healing
    from rsfstudy.responses.linear_stability import LinearStability
    from rsfstudy.responses.rigid_response import RigidResponse
    from rsfstudy.responses.step_response import StepResponse
    from rsfstudy.responses.velocity_step import VelocityStep
    from rsfstudy.status import Status
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "critical_steps.critical_step": ("CriticalStep",),
            "critical_steps.triggered_instability": ("Triggered",),
            "fitting.fit_measure": ("Fit",),
            "limit_cycles.event_statistics": ("EventStatistics",),
            "limit_cycles.limit_cycle": ("LimitCycle",),
            "measure_base._declaration_checks": ("OutputValue", "PlainValue"),
            "measure_base.elasticities": ("Elasticities",),
            "measure_base.measure": ("Measure", "Outcome", "RESERVED_NAMES"),
            "quantities": ("Output", "Quantity"),
            "responses.healing": ("Healing",),
            "responses.linear_stability": ("LinearStability",),
            "responses.rigid_response": ("RigidResponse",),
            "responses.step_response": ("StepResponse",),
            "responses.velocity_step": ("VelocityStep",),
            "status": ("Status",),
        },
    )

__all__ = [
    "CriticalStep",
    "Elasticities",
    "EventStatistics",
    "Fit",
    "Healing",
    "LimitCycle",
    "LinearStability",
    "Measure",
    "Outcome",
    "Output",
    "OutputValue",
    "PlainValue",
    "Quantity",
    "RESERVED_NAMES",
    "RigidResponse",
    "Status",
    "StepResponse",
    "Triggered",
    "VelocityStep",
]
