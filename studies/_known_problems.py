"""A problem whose answer is known: a scene, a measure, a number and where that comes from; and
measures that solve such problems.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome, Output, Status

#: What is told of a problem that has been solved.
ERROR_OUTPUTS = (
    Output("measured_error", "", "1", "error against an independent reference", error=True),
    Output("error_estimate", "", "1", "the run's own estimate of its error"),
)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A scene with a known answer.

    Parameters
    ----------
    scene : Scene
    measure : Measure
        What is asked of it.
    quantity : str
        The number of the measure that is known; by default its headline.
    answer : float, optional
        Its value; None where the answer is a status.
    status : Status
        How the measure must end.
    scale : float
        What errors are relative to; by default the answer.
    uncertainty : float
        Error of the answer itself, over `scale`.
    source : str
        Where the answer comes from.
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
        object.__setattr__(self, "quantity", self.quantity or self.measure.primary_output)

    def relative_error(self, outcome: Outcome) -> float:
        """Error of an outcome, over the scale."""
        assert self.answer is not None
        return abs(self._output_value(outcome) - self.answer) / self._error_scale

    def relative_error_estimate(self, outcome: Outcome) -> float:
        """The outcome's own estimate of its error, over the scale."""
        return float(outcome.values[f"{self.quantity}_error"]) / self._error_scale

    def _output_value(self, outcome: Outcome) -> float:
        return float(outcome.values[self.quantity])

    @property
    def _error_scale(self) -> float:
        assert self.answer is not None
        return self.scale or abs(self.answer)

    def describe(self) -> dict[str, Any]:
        """The problem as plain data."""
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

#: All problems that the studies pose.
REGISTERED_PROBLEMS: list[Problem] = []


def register_problem(fields: Fields, measure: Measure, **known: Any) -> tuple[Fields, Problem]:
    """Fields of a scene, and the problem that it poses."""
    REGISTERED_PROBLEMS.append(Problem(scene=Scene(**fields), measure=measure, **known))
    return fields, REGISTERED_PROBLEMS[-1]


@dataclass(frozen=True)
class ProblemMeasure(Measure):
    """Base of measures that solve the problem which a scene poses.

    Parameters
    ----------
    problems : tuple of Problem
        One for each scene of the lattice.
    """

    problems: tuple[Problem, ...] = ()

    def describe(self) -> dict[str, Any]:
        """The measure as plain data."""
        problems = [problem.describe() for problem in self.problems]
        return {"name": self.name, "problems": problems, **self.plain_fields}

    @classmethod
    def fields_from_description(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """The problems, taken out of a description: those that are posed, described so."""
        from rsfstudy.storage import schema  # which workers do not load

        if "problems" not in described:
            return {}
        known = [json.loads(json.dumps(problem.describe())) for problem in REGISTERED_PROBLEMS]
        listed = schema.convert_plain(described.pop("problems"), Sequence[dict[str, Any]], path)
        for number, each in enumerate(listed):
            if each not in known:
                raise schema.invalid_part_error(
                    f"{path}.problems[{number}]", "is posed by no study"
                )
        return {"problems": tuple(REGISTERED_PROBLEMS[known.index(each)] for each in listed)}

    def problem_of_scene(self, scene: Scene) -> Problem:
        """The problem of this scene.

        Raises
        ------
        InvalidValue
            Where none has it: an axis or a fixed value was changed.
        """
        for problem in self.problems:
            if problem.scene == scene:
                return problem
        raise InvalidValue(
            "scene",
            scene.as_dict(),
            "has no known answer",
            remedy="Choose among the points of the axis; other values have no reference.",
        )
