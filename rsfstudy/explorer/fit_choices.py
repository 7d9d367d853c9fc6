"""Choices of the user in the record view, which are converted to function calls.

The class ``FitChoices`` contains the choices. The methods of this class return the arguments of
``rsfstudy.read_record`` and ``rsfstudy.fit``. The function ``format_fit_command`` returns the
command line with the same arguments.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from rsfstudy.api import DEFAULT_FREE_PARAMETERS, STIFFNESS_OPTION_FROM_RECORD
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import LoadingStep, Record, parameters_of_law
from rsfstudy.rig import read_record
from rsfstudy.slider import Scene

#: An excluded time belongs to the nearest step of the window if the distance in time is at most
#: this fraction of the shortest interval between two steps.
_MAX_TIME_MISMATCH_OVER_STEP_INTERVAL = 0.25
#: Options of the command ``fit`` whose names differ from the keywords of the functions.
_COMMAND_OPTION_BY_KEYWORD = {"laws": "--law", "steps": "--step"}


@dataclass(frozen=True)
class FitChoices:
    """Choices of the record view.

    An empty string selects the default value of ``rsfstudy.read_record`` or ``rsfstudy.fit``.

    Parameters
    ----------
    columns : str, default: ""
        Headings of the columns, such as "time=t (s), friction=mu".
    decimal : {".", ","}, default: "."
        Decimal separator of a text file.
    normal_stress : str, default: ""
        Normal stress of a record that has no normal stress.
    begin, end : float, optional
        Times in s at which the fitted part of the record begins and ends. By default, the part
        begins at the first row and ends at the last row.
    excluded : tuple of float, default: ()
        Times in s of the steps that are not fitted.
    laws : tuple of str, default: ("slip", "slowness")
        State evolution laws.
    stiffness, slip_distance, before, after, noise, loading, together : optional
        Arguments of ``rsfstudy.fit``.
    trend_degree : int, default: 1
        Degree of the polynomial trend of friction.
    more_free : tuple of str, default: ()
        Free parameters in addition to the default parameters, such as "stiffness".
    """

    columns: str = ""
    decimal: str = "."
    normal_stress: str = ""
    begin: float | None = None
    end: float | None = None
    excluded: tuple[float, ...] = ()
    laws: tuple[str, ...] = ("slip", "slowness")
    stiffness: str = ""
    slip_distance: str = ""
    trend_degree: int = 1
    more_free: tuple[str, ...] = ()
    before: str = ""
    after: str = ""
    noise: str = "ar"
    loading: str = "steps"
    together: bool = False

    @classmethod
    def from_widget_state(cls, widget_state: Mapping[str, Any]) -> FitChoices:
        """Create the choices from the values of a saved state.

        Parameters
        ----------
        widget_state : mapping of str to object
            Values by name, with lists instead of tuples.

        Returns
        -------
        FitChoices
            Choices.

        Raises
        ------
        InvalidValue
            If a name is unknown.
        """
        known = [field.name for field in fields(cls)]
        for name in widget_state:
            if name not in known:
                raise InvalidValue("state", name, "is not a choice of this view", choices=known)
        values: dict[str, Any] = {
            name: tuple(v) if isinstance(v, list) else v for name, v in widget_state.items()
        }
        return cls(**values)

    def build_read_record_arguments(self) -> dict[str, Any]:
        """Return the keyword arguments of ``rsfstudy.read_record`` for the whole record.

        Returns
        -------
        dict of str to object
            Arguments that differ from their defaults.

        Raises
        ------
        InvalidValue
            If the text of the columns is malformed.
        """
        found: dict[str, Any] = {}
        if self.columns.strip():
            found["columns"] = parse_column_headings(self.columns)
        if self.decimal != ".":
            found["decimal"] = self.decimal
        if self.normal_stress:
            found["normal_stress"] = self.normal_stress
        return found

    def add_stiffness_for_slip_record(self, reading_arguments: dict[str, Any]) -> dict[str, Any]:
        """Add the stiffness, which is required if the recorded displacement is the slip.

        Parameters
        ----------
        reading_arguments : dict of str to object
            Arguments of ``rsfstudy.read_record``.

        Returns
        -------
        dict of str to object
            Arguments with the stiffness, if the user entered a stiffness.
        """
        has_value = self.stiffness and self.stiffness != STIFFNESS_OPTION_FROM_RECORD
        return reading_arguments | ({"stiffness": self.stiffness} if has_value else {})

    def build_window_limit_arguments(self) -> dict[str, Any]:
        """Return the keyword arguments of ``rsfstudy.read_record`` for the window.

        Returns
        -------
        dict of str to str
            Arguments ``begin`` and ``end``, as far as the user chose them.
        """
        limits = {"begin": self.begin, "end": self.end}
        return {name: f"{at:.12g} s" for name, at in limits.items() if at is not None}

    def extract_fit_window(self, record: Record) -> Record:
        """Return the portion of a record that lies in the window.

        Parameters
        ----------
        record : Record
            Whole record.

        Returns
        -------
        Record
            Rows in the window. The steps are detected again, as in a file that was read with
            ``begin`` and ``end``.

        Raises
        ------
        InvalidValue
            If the window contains no rows.
        """
        limits = self.build_window_limit_arguments()
        return read_record(record, **limits) if limits else record

    def find_step_number_at_excluded_time(
        self, steps: Sequence[LoadingStep], excluded_time: float
    ) -> int | None:
        """Return the number of the step that is closest to an excluded time.

        Parameters
        ----------
        steps : sequence of LoadingStep
            Steps in the window.
        excluded_time : float
            Time in s.

        Returns
        -------
        int or None
            Number of the step, starting from 1. The function returns None if the time is outside
            the window, or if no step is close to the time.
        """
        begin, end = self.begin, self.end
        if (
            not steps
            or (begin is not None and excluded_time < begin)
            or (end is not None and excluded_time > end)
        ):
            return None
        starts = np.array([step.start for step in steps])
        nearest = int(np.abs(starts - excluded_time).argmin())
        reach = _MAX_TIME_MISMATCH_OVER_STEP_INTERVAL * np.diff(starts).min(initial=np.inf)
        return nearest + 1 if abs(starts[nearest] - excluded_time) <= reach else None

    def find_excluded_step_numbers(self, steps: Sequence[LoadingStep]) -> list[int]:
        """Return the numbers of the steps that the user excluded.

        Parameters
        ----------
        steps : sequence of LoadingStep
            Steps in the window.

        Returns
        -------
        list of int
            Numbers of the excluded steps, starting from 1.
        """
        return sorted(
            {
                n
                for t in self.excluded
                if (n := self.find_step_number_at_excluded_time(steps, t)) is not None
            }
        )

    def build_fit_arguments(self, steps: Sequence[LoadingStep]) -> dict[str, Any]:
        """Return the keyword arguments of ``rsfstudy.fit``.

        Parameters
        ----------
        steps : sequence of LoadingStep
            Steps in the window.

        Returns
        -------
        dict of str to object
            Arguments that differ from their defaults, and the laws.

        Raises
        ------
        InvalidValue
            If the user chose no law or excluded all steps.
        """
        if not self.laws:
            raise InvalidValue("laws", [], "must contain a law", remedy="Select at least one law.")
        excluded = self.find_excluded_step_numbers(steps)
        chosen = [number for number in range(1, len(steps) + 1) if number not in excluded]
        if steps and not chosen:
            remedy = "Include a step: click its mark, or tick its box."
            raise InvalidValue("steps", [], "must contain a step", remedy=remedy)
        found: dict[str, Any] = {"laws": [*self.laws]}
        if excluded:
            found["steps"] = chosen
        if free := self._list_free_parameters():
            found["free"] = free
        defaults = FitChoices()
        for name in (
            "stiffness", "slip_distance", "before", "after", "noise", "loading", "together",
        ):  # fmt: skip
            if (value := getattr(self, name)) != getattr(defaults, name):
                found[name] = value
        return found

    def _list_free_parameters(self) -> list[str]:
        """Return the names of the free parameters.

        An empty list means that the default parameters are free.
        """
        if self.trend_degree == 1 and not self.more_free:
            return []
        names = [name for name in DEFAULT_FREE_PARAMETERS if not name.startswith("trend")]
        names += [f"trend{degree}" for degree in range(1, self.trend_degree + 1)]
        names += [name for name in self.more_free if name not in names]
        own = [parameters_of_law(Scene(law=law), names) for law in self.laws]
        requested = {*self.more_free}
        return [name for name in names if name in requested or any(name in each for each in own)]


def parse_column_headings(heading_assignments: str) -> dict[str, str]:
    """Parse the headings of columns.

    Parameters
    ----------
    heading_assignments : str
        Comma-separated assignments such as "time=t (s), friction=mu".

    Returns
    -------
    dict of str to str
        Heading of each column.

    Raises
    ------
    InvalidValue
        If an assignment has no equals sign.
    """
    found = {}
    for part in filter(str.strip, heading_assignments.split(",")):
        name, equals, heading = (piece.strip() for piece in part.partition("="))
        if not (name and equals and heading):
            rule = "must read NAME=HEADING, as in 'time=t (s), friction=mu'"
            raise InvalidValue("columns", part.strip(), rule)
        found[name] = heading
    return found


def format_fit_command(record_path: str, fit_arguments: Mapping[str, Any]) -> str:
    """Format the command line of a fit.

    Parameters
    ----------
    record_path : str
        Path of the record.
    fit_arguments : mapping of str to object
        Arguments of ``rsfstudy.read_record`` and ``rsfstudy.fit``.

    Returns
    -------
    str
        Command ``rsfstudy fit`` with quoted options.
    """
    words = ["rsfstudy", "fit", record_path]
    for name, value in fit_arguments.items():
        option = _COMMAND_OPTION_BY_KEYWORD.get(name, f"--{name.replace('_', '-')}")
        if isinstance(value, bool):
            words += [option] * value
        elif isinstance(value, Mapping):
            words += [option, ",".join(f"{key}={heading}" for key, heading in value.items())]
        elif isinstance(value, list):
            words += [option, ",".join(map(str, value))]
        else:
            words += [option, str(value)]
    return shlex.join(words)
