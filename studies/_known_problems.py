"""Problems with known answers, and measures that solve them.

A problem consists of a scene, a measure, and the known value of one output of the measure. The
studies that test the accuracy of the package register their problems in this module.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome, Output, Status

#: Outputs of the measures that solve problems with known answers.
ERROR_OUTPUTS = (
    Output("measured_error", "", "1", "difference from an independent reference", error=True),
    Output("error_estimate", "", "1", "error estimate of the run"),
)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Scene with a known answer.

    Parameters
    ----------
    scene : Scene
        Scene of the problem.
    measure : Measure
        Measure that is computed for the scene.
    quantity : str, optional
        Name of the output whose value is known. The default is the primary output of the measure.
    answer : float, optional
        Known value. The value is None if the answer is a status.
    status : Status, optional
        Expected status of the outcome.
    scale : float, default: 0.0
        Value by which errors are divided. The default is the absolute value of the answer.
    uncertainty : float, default: 0.0
        Error of the known value, relative to the scale.
    source : str
        Source of the known value.
    """

    scene: Scene
    measure: Measure
    quantity: str = ""
    answer: float | None = None
    status: Status = Status.OK
    scale: float = 0.0
    uncertainty: float = 0.0
    source: str

    def __post_init__(self) -> None:
        """Set the default of ``quantity``."""
        object.__setattr__(self, "quantity", self.quantity or self.measure.primary_output)

    def relative_error(self, outcome: Outcome) -> float:
        """Return the error of an outcome, divided by the scale of the problem.

        Parameters
        ----------
        outcome : Outcome
            Outcome of the measure.

        Returns
        -------
        float
            Absolute value of the relative error.
        """
        assert self.answer is not None
        return abs(self._output_value(outcome) - self.answer) / self._error_scale

    def relative_error_estimate(self, outcome: Outcome) -> float:
        """Return the error estimate of an outcome, divided by the scale of the problem.

        Parameters
        ----------
        outcome : Outcome
            Outcome of the measure.

        Returns
        -------
        float
            Relative error estimate.
        """
        return float(outcome.values[f"{self.quantity}_error"]) / self._error_scale

    def _output_value(self, outcome: Outcome) -> float:
        """Return the value of the output whose exact value is known."""
        return float(outcome.values[self.quantity])

    @property
    def _error_scale(self) -> float:
        """Value by which errors are divided."""
        assert self.answer is not None
        return self.scale or abs(self.answer)

    def describe(self) -> dict[str, Any]:
        """Return the problem as plain data.

        Returns
        -------
        dict
            Description that can be written as JSON.
        """
        return {
            "scene": self.scene.describe(),
            "measure": self.measure.describe(),
            "quantity": self.quantity,
            "answer": self.answer,
            "status": self.status.label,
            "scale": self._error_scale if self.answer is not None else None,
            "uncertainty": self.uncertainty,
            "source": self.source,
        }


Fields = dict[str, str | float | bool]

#: All problems of the studies.
REGISTERED_PROBLEMS: list[Problem] = []


def register_problem(fields: Fields, measure: Measure, **known: Any) -> tuple[Fields, Problem]:
    """Register a problem.

    Parameters
    ----------
    fields : dict
        Fields of the scene.
    measure : Measure
        Measure that is computed for the scene.
    **known : object
        Other arguments of ``Problem``.

    Returns
    -------
    fields : dict
        Fields of the scene.
    problem : Problem
        Problem that was registered.
    """
    REGISTERED_PROBLEMS.append(Problem(scene=Scene(**fields), measure=measure, **known))
    return fields, REGISTERED_PROBLEMS[-1]


@dataclass(frozen=True)
class ProblemMeasure(Measure):
    """Base class of measures that solve the problem of a scene.

    Parameters
    ----------
    problems : tuple of Problem, optional
        Problems, one for each scene of the lattice.
    """

    problems: tuple[Problem, ...] = ()

    def describe(self) -> dict[str, Any]:
        """Return the measure as plain data.

        Returns
        -------
        dict
            Description that can be written as JSON.
        """
        problems = [problem.describe() for problem in self.problems]
        return {"name": self.name, "problems": problems, **self.scalar_field_values}

    @classmethod
    def fields_from_description(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """Build the problems that are listed in the description of a measure.

        The problems are removed from the description.

        Parameters
        ----------
        described : dict
            Description of the measure.
        path : str
            Location of the description, for error messages.

        Returns
        -------
        dict
            Field ``problems``. The dictionary is empty if the description contains no problems.

        Raises
        ------
        DataError
            If a problem is not registered.
        """
        from rsfstudy.storage import (
            plain_data_conversion,  # Worker processes do not need this module.
        )

        if "problems" not in described:
            return {}
        known = [json.loads(json.dumps(problem.describe())) for problem in REGISTERED_PROBLEMS]
        listed = plain_data_conversion.convert_plain_data(
            described.pop("problems"), Sequence[dict[str, Any]], path
        )
        for number, each in enumerate(listed):
            if each not in known:
                raise plain_data_conversion.build_invalid_entry_error(
                    f"{path}.problems[{number}]", "does not belong to a study"
                )
        return {"problems": tuple(REGISTERED_PROBLEMS[known.index(each)] for each in listed)}

    def problem_of_scene(self, scene: Scene) -> Problem:
        """Return the problem of a scene.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.

        Returns
        -------
        Problem
            Known problem with this scene.

        Raises
        ------
        InvalidValue
            If the scene does not belong to any known problem, for example because the user changed
            an axis or a fixed value.
        """
        for problem in self.problems:
            if problem.scene == scene:
                return problem
        raise InvalidValue(
            "scene",
            scene.as_dict(),
            "has no known answer",
            remedy="Use points of the axis, because other values have no reference.",
        )
