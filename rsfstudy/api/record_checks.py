"""Checks of records before a fit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import LoadingStep, Record, displacement_is_slip, noise_variance

#: Factors of the three limits for a reset of the load point displacement to zero. A decrease of
#: displacement between two rows is a reset if the decrease exceeds a multiple of the noise of
#: displacement, a multiple of the changes between the neighbouring rows, and a fraction of the
#: range of displacement. The noise is estimated only if the record has more than 20 rows.
(
    _MIN_DISPLACEMENT_RESET_OVER_NOISE,
    _MIN_DISPLACEMENT_RESET_OVER_EXTENT,
    _MIN_ROWS_FOR_NOISE_ESTIMATE,
) = 10.0, 0.01, 20


def check_displacement_was_not_reset(record: Record) -> None:
    """Raise an error if the load point displacement was reset to zero.

    A reset appears as a large decrease of displacement between two successive rows.

    Parameters
    ----------
    record : Record
        Record to check.

    Raises
    ------
    InvalidValue
        If the displacement was reset, and the steps of the record were not specified by the user.
    """
    time, moved = record.time, record.columns["displacement"]
    jumps = np.diff(moved)
    row = int(np.argmin(jumps))
    noise = (
        math.sqrt(noise_variance(time, moved)) if len(time) > _MIN_ROWS_FOR_NOISE_ESTIMATE else 0.0
    )
    beside = np.abs(np.delete(jumps[max(row - 5, 0) : row + 6], min(row, 5))).max(initial=0.0)
    back = -float(jumps[row]) > max(
        _MIN_DISPLACEMENT_RESET_OVER_NOISE * beside,
        _MIN_DISPLACEMENT_RESET_OVER_NOISE * noise,
        _MIN_DISPLACEMENT_RESET_OVER_EXTENT * np.ptp(moved),
    )
    if record.specified_steps is None and back:
        rule = f"decreases suddenly at {time[row + 1]:g} s in {record.name}, because the load "
        rule += "point displacement was probably reset to zero"
        remedy = (
            f"Fit the parts separately, for example record.window({time[0]:g}, "
            f"{time[row]:g}), or read the record with "
        )
        remedy += f"begin='{time[row + 1]:g} s' (--begin), or add the offset to the later rows."
        raise InvalidValue("displacement", f"{jumps[row]:.4g} um", rule, remedy=remedy)


def check_displacement_is_not_slip(
    records: Sequence[Record],
    step_numbers: Sequence[int],
    stiffness_over_normal_stress: float,
    machine_stiffness: float,
) -> None:
    """Raise an error if the displacement column of a record contains fault slip.

    Parameters
    ----------
    records : sequence of Record
        Records to check.
    step_numbers : sequence of int
        Numbers of the steps to fit.
    stiffness_over_normal_stress, machine_stiffness : float
        Stiffness. ``stiffness_over_normal_stress`` is the stiffness divided by normal stress in
        1/um, and ``machine_stiffness`` is the stiffness in Pa/um. One of the two values is 0.

    Raises
    ------
    InvalidValue
        If the displacement is slip, because the sum of displacement and elastic shortening moves at
        constant velocities.
    """
    for record in records:
        stress = record.columns["friction"]
        shortening = (
            stress * record.columns["normal_stress"] / machine_stiffness
            if machine_stiffness
            else stress / stiffness_over_normal_stress
        )
        ends = [-math.inf, *(step.end for step in record.loading_steps)]
        begins = [*(step.start for step in record.loading_steps[1:]), math.inf, math.inf]
        for number in step_numbers:
            if number > len(record.loading_steps):
                continue
            rows = (record.time >= ends[number - 1]) & (record.time <= begins[number - 1])
            moved = record.columns["displacement"][rows]
            if displacement_is_slip(record.time[rows], moved, shortening[rows]):
                rule = (
                    f"must be load point displacement, but is fault slip at step {number}, "
                    "because displacement plus "
                )
                rule += (
                    "friction divided by stiffness increases at constant velocities, like a "
                    "load point"
                )
                remedy = (
                    "Assign the column to slip with --columns 'slip=HEADING (um)' (columns=), "
                    "and pass "
                )
                remedy += "the stiffness to read_record."
                raise InvalidValue("displacement", record.name, rule, remedy=remedy)


def check_step_can_be_fitted(record: Record, step_number: int, loading_step: LoadingStep) -> None:
    """Raise an error if a step cannot be fitted.

    Parameters
    ----------
    record : Record
        Record with the step.
    step_number : int
        Number of the step, for error messages.
    loading_step : LoadingStep
        Step to check.

    Raises
    ------
    InvalidValue
        If the step is outside the record, or if the load point does not move forward.
    """
    time, moved = record.time, record.columns["displacement"]
    if not time[0] < loading_step.start <= loading_step.end < time[-1]:
        rule = f"is outside {record.name}, which lasts from {time[0]:g} to {time[-1]:g} s"
        remedy = "Specify the times of steps in s, as in the record: record.with_steps([...])."
        raise InvalidValue(f"step {step_number}", tuple(loading_step), rule, remedy=remedy)
    if min(loading_step.velocity_before, loading_step.velocity_after) < 0.0 or not moved[
        -1
    ] > np.interp(loading_step.end, time, moved):
        told = (
            f"{loading_step.velocity_before:.4g} um/s before step {step_number}, "
            f"{loading_step.velocity_after:.4g} um/s after it"
        )
        rule = "must increase, because the load point moves forward"
        remedy = "Reverse the sign, or select other columns: --columns (columns=)."
        raise InvalidValue("displacement", told, rule, remedy=remedy)


def check_alpha_can_be_fitted(
    records: Sequence[Record], loading_history_source: str, step_numbers: Sequence[int]
) -> None:
    """Raise an error if ``alpha`` cannot be fitted.

    Parameters
    ----------
    records : sequence of Record
        Records to fit.
    loading_history_source : {"steps", "recorded"}
        Loading of the model.
    step_numbers : sequence of int
        Numbers of the steps to fit.

    Raises
    ------
    InvalidValue
        If the normal stress is constant.
    """
    for record in records:
        stress = record.columns.get("normal_stress", np.zeros(1))
        steps = [
            record.loading_steps[n - 1] for n in step_numbers if n <= len(record.loading_steps)
        ]
        by_steps = loading_history_source == "steps" and any(
            step.normal_stress_ratio != 1.0 for step in steps
        )
        if not by_steps and not (loading_history_source == "recorded" and np.ptp(stress) > 0.0):
            rule = "cannot be fitted, because the normal stress does not change in the fitted "
            rule += f"steps of record {record.name!r}"
            remedy = "Remove alpha from the free parameters, select a step in normal stress with "
            remedy += "steps=, or use the recorded normal stress with loading='recorded' (on the "
            remedy += "command line: --loading recorded)."
            raise InvalidValue("alpha", ..., rule, remedy=remedy)
