"""Preparation of a run: what workers are sent, and the run that takes in what they compute."""

from __future__ import annotations

from rsfstudy.execution.cell_computation import CellTask, compute_serially, serialize_task
from rsfstudy.execution.provenance import code_fingerprint
from rsfstudy.execution.study_run import OutputOptions, StudyRun
from rsfstudy.execution.worker_pool import WorkerPool
from rsfstudy.motion import find_user_stepper
from rsfstudy.study import Study


def prepare_study_run(study: Study, options: OutputOptions, workers: WorkerPool) -> StudyRun:
    """Prepare the run of a study on workers.

    Raises
    ------
    InvalidValue
        For anything wrong with the study, and for code that cannot be sent to the workers.
    """
    task = CellTask(
        study.base,
        study.measure,
        study.accuracy,
        workers.cell_time_limit,
        user_parts=tuple(study.user_parts.values()),
        user_stepper_classes=find_user_stepper(study.accuracy.engine),
        code_fingerprint=code_fingerprint(study.accuracy.engine, study.user_classes),
    )
    if workers.make_cell_batch_mapper() is not compute_serially:
        serialize_task(task)  # raises before any work if it cannot be sent
    return StudyRun(study, options, task, workers.count_concurrent_cells())
