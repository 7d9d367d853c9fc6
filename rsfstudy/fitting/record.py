"""Class that stores a laboratory record, and finds the steps, the holds and the stiffness.

A ``Record`` validates its columns, and detects the steps of load point velocity and normal stress.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy._deprecation import accept_former_keyword_names, add_former_member_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.fitting.hold_measurements import measure_holds
from rsfstudy.fitting.locked_portion_stiffness import measure_stiffness
from rsfstudy.fitting.normal_stress_steps import (
    find_normal_stress_steps,
    merge_normal_stress_and_velocity_steps,
    set_normal_stresses_of_steps,
)
from rsfstudy.fitting.velocity_steps import LoadingStep, detect_velocity_steps
from rsfstudy.formatting import format_count_with_noun
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import Quantity, is_valid_variable_name

#: Columns of a record with their symbols, units and meanings. The normal stress is optional.
RECORD_COLUMNS = (
    Quantity("time", "$t$", "s", "time"),
    Quantity("displacement", r"$\delta_0$", "um", "load point displacement"),
    Quantity("friction", r"$\mu$", "1", "friction coefficient"),
    Quantity("normal_stress", r"$\sigma$", "Pa", "normal stress"),
)

#: Columns of the table of steps, in the order of the fields of ``LoadingStep``.
_STEP_TABLE_COLUMNS = (
    Quantity("begins", "$t$", "s", "time at which the step begins"),
    Quantity("ends", "$t$", "s", "time at which the step ends"),
    Quantity("velocity_before", "$V_0$", "um s-1", "load point velocity before the step"),
    Quantity("velocity_after", "$V_1$", "um s-1", "load point velocity after the step"),
    Quantity("normal_stress_before", r"$\sigma$", "Pa", "normal stress before the step"),
    Quantity("normal_stress_after", r"$\sigma$", "Pa", "normal stress after the step"),
)
#: Units in the headings of the printed table of steps, and factors for the conversion, by the units
#: of the variable.
_PRINTED_UNITS_AND_FACTORS = {"s": ("s", 1.0), "um s-1": ("um/s", 1.0), "Pa": ("MPa", 1e-6)}


@accept_former_keyword_names
@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, eq=False)
class Record:
    """Laboratory record of a friction experiment.

    Parameters
    ----------
    columns : dict of {str: ndarray}
        Columns by name: ``time`` in s, ``displacement`` of the load point in um, ``friction``, and
        optionally ``normal_stress`` in Pa. All columns have the shape (rows,).
    name : str, default: "record"
        Name of the record in results. The name must be a valid Python identifier.
    specified_steps : tuple of LoadingStep, optional
        Steps that replace the detected steps. By default, the steps are detected.
    processing : tuple of str, optional
        Descriptions of the selections and filters that were applied to the rows.
    filter : str, default: ""
        Filter that was applied to friction, as a string that ``Filter.parse`` accepts. A fit
        applies the same filter to the model.

    Raises
    ------
    InvalidValue
        If a required column is missing, if the columns differ in length, if a value is not finite,
        if the time does not increase from row to row, or if the name is not a valid identifier.

    Notes
    -----
    Two records are equal if their names, their columns and their specified steps are equal.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import Record
    >>> time = np.arange(0.0, 100.0, 0.5)
    >>> displacement = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
    >>> friction = np.full(200, 0.6)
    >>> record = Record({"time": time, "displacement": displacement, "friction": friction})
    >>> len(record)
    200
    >>> record.steps()["velocity_after"].values.round(2)
    array([10.])
    """

    columns: dict[str, np.ndarray]
    name: str = "record"
    specified_steps: tuple[LoadingStep, ...] | None = None
    processing: tuple[str, ...] = ()
    filter: str = ""

    def __post_init__(self) -> None:
        """Validate the name and the columns."""
        if not is_valid_variable_name(self.name):
            raise InvalidValue("name", self.name, "must be a Python identifier")
        for about in RECORD_COLUMNS[:3]:
            if about.name not in self.columns:
                rule = f"has no {about.name}"
                raise InvalidValue("record", [*self.columns], rule, remedy=f"Pass {about.name}.")
        for name, values in self.columns.items():
            if values.shape != self.time.shape:
                rule = (
                    f"must have as many samples as 'time' (got an array of shape {values.shape} "
                    f"instead of {self.time.shape})"
                )
                raise InvalidValue(name, ..., rule)
            if not np.isfinite(values).all():
                row = int(np.argmin(np.isfinite(values)))
                remedy = "Remove such rows from the record."
                rule = f"must be a finite number, but is not finite in row {row + 1}"
                raise InvalidValue(name, float(values[row]), rule, remedy=remedy)
        late = np.diff(self.time) <= 0.0
        if late.any():
            row = int(np.argmax(late)) + 1
            rule = f"must increase from row to row, but does not increase in row {row + 1}"
            raise InvalidValue("time", float(self.time[row]), rule)

    @property
    def time(self) -> np.ndarray:
        """Times of the rows in s, as an array of shape (rows,)."""
        return self.columns["time"]

    @cached_property
    def digest(self) -> str:
        """Hash of the columns and the user-specified steps.

        Records with equal columns and equal user-specified steps have the same hash.
        """
        told = hashlib.sha256(repr((sorted(self.columns), self.specified_steps)).encode())
        for name in sorted(self.columns):
            told.update(np.ascontiguousarray(self.columns[name]).tobytes())
        return told.hexdigest()[:16]

    def __repr__(self) -> str:
        """Return a string with the name, the numbers of rows and steps, and the columns."""
        units = {about.name: about.units for about in RECORD_COLUMNS}
        columns = ", ".join(
            name if units[name] == "1" else f"{name} ({units[name]})" for name in self.columns
        )
        lines = [
            f"{len(self):,} rows from {self.time[0]:.6g} to {self.time[-1]:.6g} s"
            if len(self)
            else "no rows",
            columns,
            format_count_with_noun(len(self.loading_steps), "step"),
            *self.processing,
        ]
        return f"<Record '{self.name}': {'; '.join(lines)}>"

    def __eq__(self, other: object) -> bool:
        """Return True if two records have equal names and equal digests."""
        return isinstance(other, Record) and (self.name, self.digest) == (other.name, other.digest)

    def __hash__(self) -> int:
        """Return a hash that is consistent with equality."""
        return hash(self.digest)

    def __len__(self) -> int:
        """Return the number of rows of the record."""
        return len(self.time)

    def window(self, start: float, end: float) -> Record:
        """Select the rows of the record between two times.

        Parameters
        ----------
        start, end : float
            Times in s. The selection includes rows at ``start`` and at ``end``.

        Returns
        -------
        Record
            Record with the selected rows. The name and the specified steps are unchanged.

        Raises
        ------
        InvalidValue
            If ``end`` is not later than ``start``, or if the record has no rows between the two
            times.
        """
        if not start < end:
            raise InvalidValue("window", (start, end), "must end after it begins")
        rows = (self.time >= start) & (self.time <= end)
        if not rows.any():
            rule = (
                f"is outside the record, which lasts from {self.time[0]:g} to {self.time[-1]:g} s"
            )
            raise InvalidValue("window", (start, end), rule)
        return replace(self, columns={n: v[rows] for n, v in self.columns.items()})

    def with_steps(self, steps: Sequence[Sequence[float]]) -> Record:
        """Return a copy of the record with user-defined steps.

        The user-defined steps replace the detected steps.

        Parameters
        ----------
        steps : sequence of (float, float, float, float) or sequence of six floats
            Steps as sequences of four or six numbers: the times in s at which the step begins and
            ends, the load point velocities in um/s before and after the step, and optionally the
            normal stresses in Pa before and after the step. By default, the normal stresses are
            computed from the record.

        Returns
        -------
        Record
            Record with the same columns and the user-defined steps.

        Raises
        ------
        InvalidValue
            If a step does not consist of four or six finite numbers, if a step ends before it
            begins, if a velocity is negative, or if a normal stress is not positive.
        """
        return replace(self, specified_steps=tuple(map(_parse_loading_step, steps)))

    @cached_property
    def loading_steps(self) -> tuple[LoadingStep, ...]:
        """Steps of the record, as a tuple of ``LoadingStep``.

        If the user specified steps, the property contains the specified steps. Otherwise, the
        property contains the detected steps. If the record has a normal stress, each step includes
        the normal stresses before and after the step.
        """
        stress, moved = self.columns.get("normal_stress"), self.columns["displacement"]
        steps = (
            self.specified_steps
            if self.specified_steps is not None
            else detect_velocity_steps(self.time, moved)
        )
        if stress is None:
            return steps
        changes = find_normal_stress_steps(self.time, stress)
        if self.specified_steps is None:
            velocity = float(np.polyfit(self.time - self.time[0], moved, 1)[0])
            steps = merge_normal_stress_and_velocity_steps(steps, changes, velocity)
        return set_normal_stresses_of_steps(steps, changes, self.time, stress)

    def steps(self) -> xr.Dataset:
        """Return a table of the steps of velocity and normal stress.

        Returns
        -------
        xarray.Dataset
            Dataset with the dimension ``step``, which is numbered from 1, and the variables
            ``begins`` and ``ends`` in s, and ``velocity_before`` and ``velocity_after`` in um/s. If
            the normal stress was recorded, the dataset also contains ``normal_stress_before`` and
            ``normal_stress_after`` in Pa. The attribute ``units`` of each variable contains its
            units.

        See Also
        --------
        step_table : The same table as a data frame, with units in the column names.
        """
        numbers = [step[: len(_STEP_TABLE_COLUMNS)] for step in self.loading_steps]
        rows = np.array(numbers, dtype=float).reshape(-1, len(_STEP_TABLE_COLUMNS))
        shown = _STEP_TABLE_COLUMNS if "normal_stress" in self.columns else _STEP_TABLE_COLUMNS[:4]
        data = {
            about.name: ("step", rows[:, n], about.variable_attributes)
            for n, about in enumerate(shown)
        }
        number = {"long_name": "number of the step", "units": "1"}
        steps = {"step": ("step", np.arange(1, len(rows) + 1), number)}
        return copy_with_cf_encoding(
            xr.Dataset(data, steps, self._build_dataset_attributes("Detected steps"))
        )

    def step_table(self) -> pd.DataFrame:
        """Return a data frame of the steps, with units in the column names.

        Returns
        -------
        pandas.DataFrame
            Table with one row per step. The columns are ``begins (s)``, ``ends (s)``,
            ``velocity_before (um/s)`` and ``velocity_after (um/s)``. If the normal stress was
            recorded, the table also contains ``normal_stress_before (MPa)`` and
            ``normal_stress_after (MPa)``.

        See Also
        --------
        steps : The same table as a dataset, with normal stress in Pa.

        Examples
        --------
        >>> import numpy as np
        >>> from rsfstudy.fitting import Record
        >>> time = np.arange(0.0, 100.0, 0.5)
        >>> displacement = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
        >>> friction = np.full(200, 0.6)
        >>> record = Record({"time": time, "displacement": displacement, "friction": friction})
        >>> record.step_table()["velocity_after (um/s)"].round(6).tolist()
        [10.0]
        """
        steps, table = self.steps(), {}
        for name, values in steps.data_vars.items():
            units, factor = _PRINTED_UNITS_AND_FACTORS[values.attrs["units"]]
            table[f"{name} ({units})"] = factor * values.values
        return pd.DataFrame(table, index=steps.indexes["step"])

    def holds(self) -> xr.Dataset:
        """Measure frictional healing and relaxation in all holds of the record.

        A hold is an interval in which the load point is at rest, or moves at less than 1 % of its
        velocities before and after the interval.

        Returns
        -------
        xarray.Dataset
            Table with the dimension ``hold``. The variables are ``begins`` and ``duration`` in s,
            ``velocity_before`` and ``velocity_after`` in um/s, ``friction_before``,
            ``peak_friction``, ``healing``, ``relaxation``, and ``peak_displacement`` in um. The
            standard errors of ``friction_before`` and of all variables after it in this list have
            names of the form ``<name>_stderr``. The scalar ``healing_rate`` is the increase in
            healing per decade of hold duration, and ``healing_rate_stderr`` is the standard error
            of the healing rate. ``trend`` is the trend of friction in 1/um. The trend is subtracted
            from friction. If friction has no peak after a hold, or if the record has too few rows,
            the values are NaN. The healing rate is NaN if the record contains fewer than two hold
            durations.

        See Also
        --------
        rsfstudy.measures.Healing : Healing and relaxation of a simulated slider.

        Notes
        -----
        Healing is the peak friction on reloading minus the friction before the hold, and relaxation
        is the friction at the end of the hold minus the friction before the hold, as in the measure
        ``Healing``. The maximum of noisy samples is biased. The peak friction is therefore the
        maximum of a polynomial of degree four, in the longest window in which a parabola describes
        friction within the noise. The standard errors account for correlated noise, and for the
        errors of the trend. The healing rate is the slope of an ordinary least-squares line of
        healing against the decimal logarithm of the duration. If the scatter of healing about the
        line exceeds the standard errors of healing, the scatter determines the standard error of
        the healing rate.

        Examples
        --------
        >>> import numpy as np
        >>> from rsfstudy.fitting import Record
        >>> time = np.arange(0.0, 100.0, 0.1)
        >>> displacement = np.interp(time, [0.0, 30.0, 60.0, 100.0], [0.0, 300.0, 300.0, 700.0])
        >>> friction = np.full(1000, 0.6)
        >>> record = Record({"time": time, "displacement": displacement, "friction": friction})
        >>> record.holds()["duration"].values.round(1)
        array([30.])
        """
        table = measure_holds(
            self.time, self.columns["displacement"], self.columns["friction"], self.loading_steps
        )
        return table.assign_attrs(self._build_dataset_attributes("Holds"))

    def stiffness(self) -> xr.Dataset:
        """Measure the machine stiffness from the locked portions of the record.

        A locked portion is a part of the record in which the fault is almost locked, because the
        load point has just started, stopped or reversed. The stiffness is the slope of friction
        against load point displacement in the locked portions, corrected for the slip of the fault.

        Returns
        -------
        xarray.Dataset
            Dataset with the scalars ``stiffness`` and ``stiffness_stderr`` in 1/um. Along the
            dimension ``portion``, the dataset contains ``kind`` ("reloading", "unloading" or
            "initial loading"), ``begins`` and ``ends`` in s, ``portion_stiffness`` and
            ``portion_stiffness_stderr``. If the normal stress was recorded, the dataset also
            contains ``machine_stiffness`` in Pa/um, with its standard error and its value in each
            portion. If the record has no locked portion, the stiffness is NaN.

        See Also
        --------
        rsfstudy.fit : Fit a record. The argument ``stiffness="from record"`` uses this stiffness.

        Notes
        -----
        The stiffness is the weighted mean of the stiffnesses of all portions. If these stiffnesses
        differ by more than their standard errors, the standard error of the mean is enlarged
        accordingly. The initial loading is used only if there are no other portions, because the
        slope may increase while the sample settles.
        """
        table = measure_stiffness(
            self.time,
            self.columns["displacement"],
            self.columns["friction"],
            self.columns.get("normal_stress"),
            self.loading_steps,
        )
        return table.assign_attrs(self._build_dataset_attributes("Stiffness"))

    def to_dataset(self) -> xr.Dataset:
        """Convert the record to a dataset.

        Returns
        -------
        xarray.Dataset
            Dataset with one variable per column along the dimension ``time``.
        """
        about = {column.name: column for column in RECORD_COLUMNS}
        data = {
            name: ("time", values, {"long_name": about[name].long_name, "units": about[name].units})
            for name, values in self.columns.items()
        }
        return copy_with_cf_encoding(
            xr.Dataset(data, attrs=self._build_dataset_attributes("Laboratory record"))
        )

    def _build_dataset_attributes(self, title: str) -> dict[str, str]:
        """Return the global attributes of the dataset."""
        about = {"title": f"{title}: {self.name}", "Conventions": "CF-1.11"}
        return about | ({"processing": "; ".join(self.processing)} if self.processing else {})


def _parse_loading_step(step_fields: Sequence[float]) -> LoadingStep:
    """Validate the values of a user-defined step and create a ``LoadingStep``."""
    if isinstance(step_fields, LoadingStep):  # Steps from another record are already valid.
        return step_fields
    rule = (
        "must consist of the beginning, the end, the velocities before and after, and "
        "optionally the "
    )
    rule += "normal stresses before and after"
    try:
        numbers = [float(number) for number in step_fields]
    except (TypeError, ValueError) as error:
        raise InvalidValue("step", step_fields, rule) from error
    if len(numbers) not in (4, 6) or not np.isfinite(numbers).all():
        raise InvalidValue("step", step_fields, rule)
    begins, ends, before, after, *stresses = numbers
    first, second = stresses or (math.nan, math.nan)
    step = LoadingStep(begins, ends, before, after, first, second)
    if not begins <= ends or min(before, after) < 0.0 or min([1.0, *stresses]) <= 0.0:
        raise InvalidValue("step", tuple(numbers), rule)
    return step
