"""Base class of measures, and functions that several measures share.

A ``Measure`` computes named results of one scene, with a status, error estimates and the cost of
the computation. The base class checks the results. The package never contains a measure of a single
topic: critical steps, limit cycles, responses and fits have their own packages, and
``rsfstudy.measures`` exports all measures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.measure_base._declaration_checks import OutputValue
    from rsfstudy.measure_base._loading_checks import check_steady_loading
    from rsfstudy.measure_base._recorded_motion import RecordingMeasure, phase_outputs
    from rsfstudy.measure_base.elasticities import Elasticities
    from rsfstudy.measure_base.measure import Measure, Outcome
    from rsfstudy.measure_base.settling_checks import settles_to_steady_sliding
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "measure_base._declaration_checks": ("OutputValue",),
            "measure_base._loading_checks": ("check_steady_loading",),
            "measure_base._recorded_motion": ("RecordingMeasure", "phase_outputs"),
            "measure_base.elasticities": ("Elasticities",),
            "measure_base.measure": ("Measure", "Outcome"),
            "measure_base.settling_checks": ("settles_to_steady_sliding",),
        },
    )

__all__ = [
    "Elasticities",
    "Measure",
    "Outcome",
    "OutputValue",
    "RecordingMeasure",
    "check_steady_loading",
    "phase_outputs",
    "settles_to_steady_sliding",
]
