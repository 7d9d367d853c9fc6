"""Functions that users call, and the accessor ``dataset.rsf``.

The namespace ``rsfstudy`` exports the functions of this package. The functions check their
arguments and call other packages, which run studies, integrate motions and fit records. The package
contains no physics and never prints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.api.html_report import write_html_report
    from rsfstudy.api.record_fitting import (
        DEFAULT_FREE_PARAMETERS,
        STIFFNESS_OPTION_FROM_RECORD,
        fit,
    )
    from rsfstudy.api.result_paths import find_results_file
    from rsfstudy.api.simulation import UNPHYSICAL_MOTION_ATTRIBUTE_NAME, simulate
    from rsfstudy.api.study_runs import (
        StudyRunWithProgress,
        apply_overrides_to_study,
        make_run_function_with_progress,
        recompute_cell,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "api.record_fitting": (
                "DEFAULT_FREE_PARAMETERS",
                "STIFFNESS_OPTION_FROM_RECORD",
                "fit",
            ),
            "api.html_report": ("write_html_report",),
            "api.result_paths": ("find_results_file",),
            "api.simulation": ("UNPHYSICAL_MOTION_ATTRIBUTE_NAME", "simulate"),
            "api.study_runs": (
                "StudyRunWithProgress",
                "apply_overrides_to_study",
                "make_run_function_with_progress",
                "recompute_cell",
            ),
        },
    )

__all__ = [
    "UNPHYSICAL_MOTION_ATTRIBUTE_NAME",
    "DEFAULT_FREE_PARAMETERS",
    "STIFFNESS_OPTION_FROM_RECORD",
    "StudyRunWithProgress",
    "apply_overrides_to_study",
    "find_results_file",
    "fit",
    "make_run_function_with_progress",
    "recompute_cell",
    "simulate",
    "write_html_report",
]
from rsfstudy.api import accessor as accessor  # The import registers the accessor.
