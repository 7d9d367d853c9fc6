"""Preparation of the run of a study."""

from __future__ import annotations

from rsfstudy.execution import provenance
from rsfstudy.execution.cell_computation import CellTask, compute_serially, serialize_task
from rsfstudy.execution.study_run import OutputOptions, StudyRun
from rsfstudy.execution.worker_pool import WorkerPool
from rsfstudy.motion import Engine
from rsfstudy.study import Study


def prepare_study_run(study: Study, options: OutputOptions, workers: WorkerPool) -> StudyRun:
    """Prepare to run a study on workers.

    Parameters
    ----------
    study : Study
        Study to run.
    options : OutputOptions
        Output files and handling of failed cells.
    workers : WorkerPool
        Workers that compute the cells.

    Returns
    -------
    StudyRun
        Run of the study. To start the run, call the ``StudyRun`` object as a function.

    Raises
    ------
    InvalidValue
        If the study is invalid, or if the code of the study cannot be sent to the workers.
    """
    task = CellTask(
        study.base,
        study.measure,
        study.accuracy,
        workers.cell_time_limit,
        user_parts=tuple(study.user_parts.values()),
        user_stepper_classes=Engine.find_user_stepper(study.accuracy.engine),
        code_fingerprint=provenance.code_fingerprint(study.accuracy.engine, study.user_classes),
    )
    if workers.make_cell_batch_mapper() is not compute_serially:
        serialize_task(task)  # Serialisation errors are raised here, before any cell is computed.
    return StudyRun(study, options, task, workers.count_concurrent_cells())
