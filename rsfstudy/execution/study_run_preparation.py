"""Preparation of the run of a study."""

from __future__ import annotations

from rsfstudy.execution import provenance
from rsfstudy.execution.cell_computation import (
    SharedCellSettings,
    compute_cell_batches_serially,
    serialize_cell_settings,
)
from rsfstudy.execution.study_run import OutputOptions, StudyRun
from rsfstudy.execution.worker_pool import WorkerPool
from rsfstudy.motion import Engine
from rsfstudy.study import Study


def prepare_study_run(
    study: Study, output_options: OutputOptions, worker_pool: WorkerPool
) -> StudyRun:
    """Prepare to run a study on workers.

    Parameters
    ----------
    study : Study
        Study to run.
    output_options : OutputOptions
        Output files and handling of failed cells.
    worker_pool : WorkerPool
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
    cell_settings = SharedCellSettings(
        study.base,
        study.measure,
        study.accuracy,
        worker_pool.cell_time_limit,
        user_parts=tuple(study.user_parts.values()),
        user_stepper_classes=Engine.find_user_stepper(study.accuracy.engine),
        code_fingerprint=provenance.collect_code_fingerprint(
            study.accuracy.engine, study.user_defined_classes
        ),
    )
    if worker_pool.make_cell_batch_mapper() is not compute_cell_batches_serially:
        # Serialisation errors are raised here, before any cell is computed.
        serialize_cell_settings(cell_settings)
    return StudyRun(study, output_options, cell_settings, worker_pool.count_concurrent_cells())
