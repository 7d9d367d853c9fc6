"""Whether error estimates cover: a random scene, measured as asked and a hundred times tighter."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.motion.accuracy import TIGHTEST_RTOL, Accuracy
from rsfstudy.motion.stepping import Meter
from rsfstudy.quantity import Quantity
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: What may be asked of a random scene, by name.
QUESTIONS: Mapping[str, Measure] = {
    "limit cycle": LimitCycle(phases=2),
    "step response": StepResponse(peaks=3, phases=2),
    "rate step": CriticalStep(),
    "displacement step": CriticalStep(of="displacement_step"),
}
_ESTIMATED = tuple(
    dict.fromkeys(
        name.removesuffix("_error")
        for measure in QUESTIONS.values()
        for name in measure.variables
        if name.endswith("_error")
    )
)
_TIGHTER = 0.01
#: Work the tighter run may cost, over that of the run it judges.
_PATIENCE = 6


#: What its numbers are.
_QUANTITIES = (
    Quantity("number", "", "", "name of the number"),
    Quantity("status_kept", "", "1", "whether a tighter run ends with the same status"),
    Quantity("error_over_estimate", "", "1", "error over its own estimate"),
    Quantity("error_over_request", "", "1", "relative error over the accuracy asked for"),
)


@dataclass(frozen=True)
class Coverage(Measure):
    """Errors of a measure in a random scene, over its own estimates of them.

    The scene shares law, normal stress condition and dynamics with the scene of the cell; its
    numbers are drawn from wide ranges, the same whenever it is asked for. The true numbers are
    those of a run a hundred times tighter, within its error estimate.

    Parameters
    ----------
    question : str
        What is measured; one of `QUESTIONS`.
    sample : int
        Number of the draw.
    requested_digits : int
        Accuracy asked for: rtol = 10**-digits.
    """

    question: str = "limit cycle"
    sample: int = 0
    requested_digits: int = 7
    name: ClassVar[str] = "coverage"
    clocks: ClassVar[tuple[bool, ...]] = (False, True)

    def __post_init__(self) -> None:
        if self.question not in QUESTIONS:
            raise InvalidValue("question", self.question, "is unknown", choices=QUESTIONS)
        if self.sample < 0:
            raise InvalidValue("sample", self.sample, "must be 0 or greater")
        if not 2 <= self.requested_digits <= 9:
            rule = "must lie between 2 and 9: the tighter run needs two more"
            raise InvalidValue("requested_digits", self.requested_digits, rule)

    @property
    def headline(self) -> str:
        return "status_kept"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        numbers = ("error_over_estimate", "error_over_request")
        return dict.fromkeys(("status_kept", "status_kept_error", "ended_as"), ()) | dict.fromkeys(
            numbers, ("number",)
        )

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"number": np.array(_ESTIMATED, dtype=object)}

    @property
    def quantities(self) -> Sequence[Quantity]:
        return _QUANTITIES

    @property
    def typical_work(self) -> int:
        return 60_000

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Measure twice, and compare each number that both give."""
        measure = QUESTIONS[self.question]
        drawn = random_scene(scene, self.question, self.sample)
        asked = replace(accuracy, rtol=10.0**-self.requested_digits)
        rtol = max(_TIGHTER * asked.rtol, TIGHTEST_RTOL)
        tighter = replace(asked, rtol=rtol, budget=_PATIENCE * asked.budget)
        (outcome, spent), (truth, more) = (measure.metered(drawn, a) for a in (asked, tighter))
        meter.by_regime["asked"], meter.by_regime["tighter"] = spent.spent, more.spent
        meter.spent = spent.spent + more.spent
        values: dict[str, Any] = {
            "ended_as": float(outcome.status),
            "status_kept_error": 0.0,
            # a failure claims nothing, and nothing is known where the tighter run fails
            "status_kept": float(
                outcome.status is truth.status
                or not (outcome.status.is_answer and truth.status.is_answer)
            ),
        }
        if outcome.status is truth.status is Status.OK:
            values |= _compared(outcome.values, truth.values, asked.rtol)
        return Outcome(Status.OK, values)


def _compared(
    measured: Mapping[str, Any], truth: Mapping[str, Any], rtol: float
) -> dict[str, np.ndarray]:
    """Errors beyond what the truth itself is uncertain by, over their estimates, and over the
    accuracy asked for.
    """
    over_estimate, over_request = (np.full(len(_ESTIMATED), math.nan) for _ in range(2))
    for i, name in enumerate(_ESTIMATED):
        if f"{name}_error" in measured:
            uncertain = truth[f"{name}_error"]
            error = max(abs(measured[name] - truth[name]) - uncertain, 0.0)
            over_estimate[i] = error / measured[f"{name}_error"]
            over_request[i] = error / (rtol * abs(truth[name]))
    return {"error_over_estimate": over_estimate, "error_over_request": over_request}


def random_scene(like: Scene, question: str, sample: int) -> Scene:
    """A scene of the same law, normal stress condition and dynamics as another, with numbers drawn
    from wide ranges.
    """
    kind = f"{question} {like.law} {' '.join(like.effects)}"
    draw = np.random.default_rng([sample, zlib.crc32(kind.encode())])

    def between(low: float, high: float) -> float:
        return float(draw.uniform(low, high))

    def decades(low: float, high: float) -> float:
        return math.exp(between(math.log(low), math.log(high)))

    cycles, rates = question == "limit cycle", question in ("limit cycle", "step response")
    fields: dict[str, Any] = {
        "a": decades(0.003, 0.025),
        "b_over_a": 1.0 + decades(0.1, 4.5),
        "mu_star": between(0.5, 0.85),
        "period": decades(0.1, 1000.0),
        "reference_rate": decades(1e-10, 1e-6),
        "stiffness_ratio": between(0.3, 0.97) if cycles else between(1.0, 2.5),
        "load_velocity_ratio": decades(1.1, 100.0) if rates else None,
    }
    angle, alpha = between(0.05, 0.95), between(0.0, 0.6)
    if like.phi is not None:
        lowest = math.degrees(math.atan(fields["mu_star"]))
        fields |= {"phi": lowest + angle * (90.0 - lowest), "alpha": alpha}
    if like.radiation_damping:
        # about the impedance of spring and mass
        inertial_time = fields["period"] * fields["reference_rate"] / (2.0 * math.pi)
        impedance = fields["stiffness_ratio"] * fields["a"] * inertial_time
        fields["radiation_damping"] = impedance * (fields["b_over_a"] - 1.0)
    return like.with_(**fields)
