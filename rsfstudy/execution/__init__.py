"""Functions and classes that plan, compute and record the cells of a study.

The package divides the cells of a study into batches. Batches are computed in this process or on
Dask workers. If a worker is lost, its cells are computed again. An interrupted run can be resumed.
To decide whether the cells in a journal are still valid, the package compares digests of the code
and of the declaration (see ``provenance``). The package never imports the command-line interface,
and never formats output for users.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.execution.cell_plan import (
        CellPlan,
    )
    from rsfstudy.execution.dask_clusters import connect_to_cluster
    from rsfstudy.execution.provenance import build_provenance_attributes, collect_run_fingerprint
    from rsfstudy.execution.study_run import OutputOptions, ProgressCallback, StudyRun
    from rsfstudy.execution.study_run_preparation import prepare_study_run
    from rsfstudy.execution.worker_pool import WorkerPool
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "execution.dask_clusters": ("connect_to_cluster",),
            "execution.cell_plan": ("CellPlan",),
            "execution.study_run_preparation": ("prepare_study_run",),
            "execution.provenance": ("build_provenance_attributes", "collect_run_fingerprint"),
            "execution.study_run": ("OutputOptions", "ProgressCallback", "StudyRun"),
            "execution.worker_pool": ("WorkerPool",),
        },
    )

__all__ = [
    "OutputOptions",
    "CellPlan",
    "ProgressCallback",
    "StudyRun",
    "WorkerPool",
    "connect_to_cluster",
    "prepare_study_run",
    "build_provenance_attributes",
    "collect_run_fingerprint",
]
