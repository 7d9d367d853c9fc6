"""Execution of studies: from a declaration to finished cells.

The package plans batches of cells, computes them in this process or on Dask workers, survives lost
workers, and resumes interrupted runs. Digests of the code and of the declaration decide if the
cells of a journal are still valid (``provenance``). It never imports the command line and never
decides how results are shown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.execution.cell_plan import CellPlan, estimate_cost
    from rsfstudy.execution.clusters import connect_to_cluster
    from rsfstudy.execution.preparation import prepare_study_run
    from rsfstudy.execution.provenance import provenance_attributes, run_fingerprint
    from rsfstudy.execution.study_run import OutputOptions, ProgressCallback
    from rsfstudy.execution.worker_pool import WorkerPool
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "execution.clusters": ("connect_to_cluster",),
            "execution.cell_plan": ("CellPlan", "estimate_cost"),
            "execution.preparation": ("prepare_study_run",),
            "execution.provenance": ("provenance_attributes", "run_fingerprint"),
            "execution.study_run": ("OutputOptions", "ProgressCallback"),
            "execution.worker_pool": ("WorkerPool",),
        },
    )

__all__ = [
    "OutputOptions",
    "CellPlan",
    "ProgressCallback",
    "WorkerPool",
    "connect_to_cluster",
    "estimate_cost",
    "prepare_study_run",
    "provenance_attributes",
    "run_fingerprint",
]
