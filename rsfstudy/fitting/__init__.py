"""Estimation of friction parameters from laboratory records.

The class ``Record`` contains the data of an experiment, and the measure ``Fit`` fits friction
parameters to a record. Other modules detect load point steps and stress drops, model the noise, and
compute confidence intervals. The package ``rsfstudy.fitting`` never reads files. Use
``rsfstudy.read_record`` to read a record, and ``rsfstudy.fit`` to fit a record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.fitting.fault_slip_check import displacement_is_slip
    from rsfstudy.fitting.filters import FILTER_KINDS, LOW_PASS_ORDERS, MEAN, TRAILING_MEAN, Filter
    from rsfstudy.fitting.fit_measure import Fit
    from rsfstudy.fitting.fit_validity_checks import describe_whiteness
    from rsfstudy.fitting.fit_window import FitWindow
    from rsfstudy.fitting.hold_measurements import MAX_HOLD_OVER_SLIDING_VELOCITY
    from rsfstudy.fitting.hold_table import build_hold_table
    from rsfstudy.fitting.joint_window_model import (
        fitted_fields,
        split_window_number,
        strip_window_number,
    )
    from rsfstudy.fitting.local_regression import compute_weighted_mean
    from rsfstudy.fitting.record import RECORD_COLUMNS, Record
    from rsfstudy.fitting.stress_drop_detection import MIN_SAMPLES, Detection
    from rsfstudy.fitting.stress_drop_measurements import read_drops
    from rsfstudy.fitting.stress_drop_search import EVENT_QUANTITIES, EventNumbers
    from rsfstudy.fitting.velocity_steps import LoadingStep, noise_variance
    from rsfstudy.fitting.window_model import (
        LOGARITHMIC_PARAMETERS,
        PARAMETERS,
        check_free_parameters,
        parameters_of_law,
        scene_to_parameters,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "fitting.stress_drop_detection": ("Detection", "MIN_SAMPLES"),
            "fitting.stress_drop_measurements": ("read_drops",),
            "fitting.filters": (
                "FILTER_KINDS",
                "Filter",
                "LOW_PASS_ORDERS",
                "MEAN",
                "TRAILING_MEAN",
            ),
            "fitting.fit_measure": ("Fit",),
            "fitting.hold_table": ("build_hold_table",),
            "fitting.hold_measurements": ("MAX_HOLD_OVER_SLIDING_VELOCITY",),
            "fitting.joint_window_model": (
                "fitted_fields",
                "split_window_number",
                "strip_window_number",
            ),
            "fitting.fault_slip_check": ("displacement_is_slip",),
            "fitting.local_regression": ("compute_weighted_mean",),
            "fitting.record": ("RECORD_COLUMNS", "Record"),
            "fitting.stress_drop_search": ("EVENT_QUANTITIES", "EventNumbers"),
            "fitting.fit_validity_checks": ("describe_whiteness",),
            "fitting.velocity_steps": ("LoadingStep", "noise_variance"),
            "fitting.fit_window": ("FitWindow",),
            "fitting.window_model": (
                "LOGARITHMIC_PARAMETERS",
                "PARAMETERS",
                "check_free_parameters",
                "parameters_of_law",
                "scene_to_parameters",
            ),
        },
    )

__all__ = [
    "Detection",
    "EVENT_QUANTITIES",
    "EventNumbers",
    "FILTER_KINDS",
    "Filter",
    "Fit",
    "FitWindow",
    "LOGARITHMIC_PARAMETERS",
    "LOW_PASS_ORDERS",
    "LoadingStep",
    "MEAN",
    "MAX_HOLD_OVER_SLIDING_VELOCITY",
    "MIN_SAMPLES",
    "PARAMETERS",
    "RECORD_COLUMNS",
    "Record",
    "TRAILING_MEAN",
    "build_hold_table",
    "check_free_parameters",
    "compute_weighted_mean",
    "describe_whiteness",
    "displacement_is_slip",
    "fitted_fields",
    "noise_variance",
    "parameters_of_law",
    "read_drops",
    "scene_to_parameters",
    "split_window_number",
    "strip_window_number",
]
