"""Estimates of the work and the computing time of a study.

The computing time is estimated from the measured times of cells in earlier runs. If there are no
measured times, the estimate is based on typical times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.execution import CellPlan
from rsfstudy.formatting import format_duration
from rsfstudy.motion import Engine
from rsfstudy.storage import CellWallTimes

#: Typical speed-up of the compiled engine relative to the SciPy engine, by name of the measure. We
#: measured speed-ups by factors of 7 to 12 for critical steps, and of 31 to 72 for limit cycles.
#: The speed-up is larger at higher accuracy.
_COMPILED_SPEEDUP_BY_MEASURE = {"critical_step": 10, "limit_cycle": 30}
#: Name of the measure that compares the integrators of SciPy. Studies with this measure can only
#: use the SciPy engine.
_NAME_OF_MEASURE_REQUIRING_SCIPY_ENGINE = "work_precision"
#: Estimated computing time in s. If a study takes longer than this time, the commands suggest the
#: compiled engine.
_MIN_SECONDS_FOR_FASTER_ENGINE_HINT = 60.0


@dataclass(frozen=True)
class StudyCostEstimate:
    """Estimated work and computing time of a study on one core.

    Parameters
    ----------
    rhs_evaluations : int
        Expected number of right-hand-side evaluations, rounded to two significant digits.
    estimated_seconds : float
        Estimated computing time in s.
    cell_count : int
        Number of distinct cells of the study.
    timed_cell_count_in_study : int
        Number of cells of the study with a measured computing time.
    timed_cell_count_in_journal : int
        Number of all cells with a measured computing time in the journal. If this number is 0, the
        estimated computing time is based on typical times.
    journal_path : Path
        Path of the journal.
    """

    rhs_evaluations: int
    estimated_seconds: float
    cell_count: int
    timed_cell_count_in_study: int
    timed_cell_count_in_journal: int
    journal_path: Path


def estimate_study_cost(cell_plan: CellPlan, output_directory: Path) -> StudyCostEstimate:
    """Estimate the work and the computing time of a study on one core.

    Parameters
    ----------
    cell_plan : CellPlan
        Cells of the study.
    output_directory : Path
        Directory of results. If the directory contains the journal of an earlier run with the same
        accuracy and engine, the estimate uses the measured times in this journal.

    Returns
    -------
    StudyCostEstimate
        Estimated work and computing time.
    """
    work, guess = cell_plan.estimate_evaluations_and_time()
    work = round(work, 2 - len(str(work)))  # More digits would not be significant.
    journal = output_directory / f"{cell_plan.study.name}.cells.sqlite"
    took, cells = CellWallTimes.read_from_journal(journal), len(cell_plan.unique_cell_numbers)
    if (
        took is None
        or not _timings_match_accuracy_and_engine(cell_plan, took)
        or not took.seconds_by_cell_key
    ):
        return StudyCostEstimate(work, guess, cells, 0, 0, journal)
    times = took.seconds_by_cell_key
    keys = cell_plan.keys[cell_plan.unique_cell_numbers].tolist()
    known = [times[key] for key in keys if key in times]
    missing = (cells - len(known)) * float(np.mean(list(times.values())))
    return StudyCostEstimate(
        work, math.fsum(known) + missing, cells, len(known), len(times), journal
    )


def collect_accuracy_and_cost_fields(cell_plan: CellPlan, output_directory: Path) -> dict[str, Any]:
    """Return a dictionary with the accuracy and the expected cost of a study.

    Parameters
    ----------
    cell_plan : CellPlan
        Cells of the study.
    output_directory : Path
        Directory of results with measured times.

    Returns
    -------
    dict
        Relative tolerance, expected work, computing time and number of measured cells.
    """
    cost = estimate_study_cost(cell_plan, output_directory)
    return {
        "rtol": cell_plan.study.accuracy.rtol,
        "cost": {
            "rhs_evaluations": cost.rhs_evaluations,
            "seconds": cost.estimated_seconds,
            "measured_cells": cost.timed_cell_count_in_study,
        },
    }


def describe_study_cost(cell_plan: CellPlan, output_directory: Path) -> str:
    """Describe the work and the computing time of a study on one core.

    Parameters
    ----------
    cell_plan : CellPlan
        Cells of the study.
    output_directory : Path
        Directory of results, as for ``estimate_study_cost``.

    Returns
    -------
    str
        Text with the expected number of right-hand-side evaluations and the computing time.
    """
    cost = estimate_study_cost(cell_plan, output_directory)
    rtol, time = (
        cell_plan.study.accuracy.rtol,
        f"{format_duration(cost.estimated_seconds)} on one core",
    )
    text = f"about {cost.rhs_evaluations:,} right-hand-side evaluations at rtol {rtol:g}; "
    if not cost.timed_cell_count_in_journal:
        return f"{text}roughly {time} (may be up to ten times longer)"
    if cost.timed_cell_count_in_study == cost.cell_count:
        return f"{text}last run took {time} ({cost.journal_path})"
    return (
        f"{text}about {time}, based on {cost.timed_cell_count_in_journal:,} cells in "
        f"{cost.journal_path}"
    )


def suggest_compiled_engine(cell_plan: CellPlan, output_directory: Path) -> str:
    """Return a hint for the user that the compiled engine is faster.

    Parameters
    ----------
    cell_plan : CellPlan
        Cells of the study.
    output_directory : Path
        Directory of results.

    Returns
    -------
    str
        Hint, or an empty string. The string is empty if the study cannot use the compiled engine or
        already uses this engine. The string is also empty if the directory contains cells of the
        study, or if the estimated computing time is at most 60 s.
    """
    measure, engine = cell_plan.study.measure.describe()["name"], cell_plan.study.accuracy.engine
    kept = output_directory / f"{cell_plan.study.name}.cells.sqlite"
    saves = (
        engine == Engine.SCIPY
        and measure != _NAME_OF_MEASURE_REQUIRING_SCIPY_ENGINE
        and cell_plan.estimate_evaluations_and_time()[1] > _MIN_SECONDS_FOR_FASTER_ENGINE_HINT
    )
    if not saves or kept.exists() or describe_missing_engine_packages(Engine.COMPILED):
        return ""
    if measure in _COMPILED_SPEEDUP_BY_MEASURE:
        return (
            f"--engine compiled is about {_COMPILED_SPEEDUP_BY_MEASURE[measure]} times faster here"
        )
    each = ", ".join(
        f"{times} times with {name}" for name, times in _COMPILED_SPEEDUP_BY_MEASURE.items()
    )
    return f"--engine compiled is usually faster: about {each}"


def _timings_match_accuracy_and_engine(cell_plan: CellPlan, cell_timings: CellWallTimes) -> bool:
    """Return True if timings were measured with the accuracy and engine of a plan."""
    asked = cell_plan.study.accuracy
    return cell_timings.run_fingerprint.get(
        "rtol"
    ) == asked.rtol and cell_timings.run_fingerprint.get("engine") == (asked.engine)


def describe_missing_engine_packages(engine_name: str) -> str:
    """Describe the packages that an engine requires but that are missing.

    Parameters
    ----------
    engine_name : str
        Name of the engine.

    Returns
    -------
    str
        Name of the missing package and the command that installs this package. The string is empty
        if the engine can be used.

    Raises
    ------
    InvalidValue
        If the engine is unknown.
    """
    try:
        Engine.check_is_usable(engine_name)
    except InvalidValue:
        if engine_name != Engine.COMPILED:
            raise
        return "requires Numba (pip install 'rsfstudy[fast]')"
    return ""
