"""Response to oscillating normal stress: how much spring stress oscillates with it, and when."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Outcome
from rsfstudy.measures._reading import Reading, errors_of
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Event
from rsfstudy.motion.stepping import Meter
from rsfstudy.quantity import Quantity
from rsfstudy.slider.forms import Point
from rsfstudy.slider.loading.oscillation import Oscillation
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.stability import growth_rates, response_to_normal_stress
from rsfstudy.slider.steady import steady_sliding
from rsfstudy.status import Status

#: Part of the accuracy asked for that is left of the transient where the record begins, by the
#: slowest decay of small changes; and the fewest periods before it.
_LEFT, _FEWEST = 0.1, 2
#: Part by which two records may differ where the response has settled.
_SAME = 1e-3

_READ = (
    Quantity(
        "gain",
        r"$|\hat\tau/\hat\sigma|$",
        "1",
        "amplitude of spring stress over that of imposed normal stress, at the period of forcing",
    ),
    Quantity(
        "phase_lead",
        r"$\arg(\hat\tau/\hat\sigma)$",
        "degree",
        "angle by which spring stress is ahead of imposed normal stress, at the period of forcing",
    ),
    Quantity(
        "distortion",
        "",
        "1",
        "spring stress at the overtones of the forcing, over that at its period",
    ),
    Quantity(
        "departure_from_linear",
        "",
        "1",
        "distance of the response from that of small oscillations, over that",
    ),
)
_OTHERS = (
    Quantity(
        "linear_gain",
        r"$|\hat\tau/\hat\sigma|$",
        "1",
        "gain of small oscillations, by linear theory",
    ),
    Quantity(
        "linear_phase_lead",
        r"$\arg(\hat\tau/\hat\sigma)$",
        "degree",
        "lead of spring stress in small oscillations, by linear theory",
    ),
    Quantity("settled", "", "1", "whether one period of the response is as another later on"),
)


class _Record(NamedTuple):
    """One period of a motion: events spread evenly over it, the last a period after the first; and
    spring stress and imposed normal stress at all but that, without the trend by which spring
    stress does not come back, which would be taken for overtones.
    """

    events: Sequence[Event]
    spring: np.ndarray
    imposed: np.ndarray
    trend: float

    @property
    def drift(self) -> float:
        """What the trend would have made of the response, over that."""
        amplitude = 2.0 * abs(_harmonics(self.spring)[1]) / len(self.spring)
        return float(abs(self.trend) / (math.pi * amplitude))

    @property
    def overtones(self) -> np.ndarray:
        """Spring stress at the overtones of the period, over that at the period."""
        harmonics = _harmonics(self.spring)
        return np.asarray(harmonics[2:] / harmonics[1])

    @property
    def aliasing(self) -> float:
        """What overtones that the samples do not resolve may change of all together.

        They are taken to be as strong as the upper quarter of those that are resolved, B. They add
        up in squares, and are folded back upon that quarter: (B**2 + 2 B B)/(2 D) of a sum D.
        """
        overtones = np.abs(self.overtones)
        resolved = float(np.linalg.norm(overtones))
        upper = float(np.linalg.norm(overtones[3 * len(overtones) // 4 :]))
        return 2.0 * upper * upper / resolved if resolved else 0.0

    @property
    def response(self) -> complex:
        """Spring stress over imposed normal stress, at the period."""
        return complex(_harmonics(self.spring)[1] / _harmonics(self.imposed)[1])


@dataclass(frozen=True)
class NormalStressResponse(Reading):
    """What an oscillation of imposed normal stress makes of spring stress, once transients have
    decayed: Fourier's projection over one period.

    The motion is followed until the slowest decay of small changes has left a tenth of the accuracy
    asked for, and read then; and once more after a further e-fold of that decay, from which all is
    told. The response has `settled` where the two agree to a thousandth. Where steady sliding is
    unstable nothing decays, and nothing is read.

    Parameters
    ----------
    samples : int
        Instants in a period at which the motion is looked at, an even number; those, and the first
        of the next period, are kept along `phase`.

    References
    ----------
    Boettcher and Marone (2004), J. Geophys. Res. 109, B03406; Perfettini et al. (2001), J.
    Geophys. Res. 106, 13455-13472.
    """

    samples: int = 64
    name: ClassVar[str] = "normal_stress_response"
    read = _READ
    beside = _OTHERS

    def __post_init__(self) -> None:
        if self.samples < 8 or self.samples % 2:
            rule = "must be an even number, at least 8"
            raise InvalidValue("samples", self.samples, rule)

    @property
    def headline(self) -> str:
        return "gain"

    @property
    def points(self) -> int:
        return self.samples + 1

    @property
    def typical_work(self) -> int:
        return 20_000

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Read the response, and once more with smaller tolerances for the errors."""
        loading = scene.parts.loading
        if not isinstance(loading, Oscillation):
            return Outcome(Status.NO_STEP, message="normal stress does not oscillate")
        if not scene.load_velocity or steady_sliding(scene, scene.log_load_rate) is None:
            why = "the load point is held, or steady sliding is not possible at its velocity"
            return Outcome(Status.NO_STEADY_STATE, message=why)
        decay = -scene.load_velocity * growth_rates(scene, scene.log_load_rate)[0].real
        if not decay > 0.0:
            why = "steady sliding is unstable: no transient decays"
            return Outcome(Status.NOT_APPLICABLE, message=why)
        period = loading.oscillation_period
        frequency = 2.0 * math.pi / period
        linear = response_to_normal_stress(scene, scene.log_load_rate, frequency)
        waits = -math.log(_LEFT * accuracy.rtol) / decay / period
        periods = max(_FEWEST, math.ceil(waits)), math.ceil(1.0 / decay / period)
        first, last = self._follow(scene, period, periods, accuracy, meter)
        _first, again = self._follow(scene, period, periods, accuracy.refined(), meter)
        values, finer = _read(last, linear), _read(again, linear)
        moved = abs(last.response / first.response - 1.0)
        unseen = abs(_coarse(last) / last.response - 1.0) + moved + last.drift
        hidden = {
            "gain": unseen * values["gain"],
            "phase_lead": math.degrees(unseen),
            # what is left of overtones adds up as noise does, and seldom cancels
            "distortion": 5.0 * float(np.linalg.norm(last.overtones - again.overtones))
            + last.drift
            + last.aliasing,
            "departure_from_linear": unseen * abs(last.response / linear),
        }
        over_imposed = 1.0 / loading.oscillation_amplitude
        over_spring = over_imposed / values["gain"]
        # errors of the instants add up as noise does: over the period they cancel for the most part
        left = math.sqrt(2.0 / self.samples)
        by_friction = {
            "gain": left * over_imposed,
            "phase_lead": math.degrees(left * over_spring),
            "distortion": over_spring,
            "departure_from_linear": left * over_imposed / abs(linear),
        }
        errors = errors_of(values, finer, by_friction, scene, accuracy)
        for name, more in hidden.items():
            errors[f"{name}_error"] += more
        others = {
            "linear_gain": abs(linear),
            "linear_phase_lead": _degrees(linear),
            "settled": float(moved < _SAME),
        }
        return Outcome(Status.OK, {**values, **errors, **others, **_shown(scene, last)})

    def _follow(
        self,
        scene: Scene,
        period: float,
        periods: tuple[int, int],
        accuracy: Accuracy,
        meter: Meter,
    ) -> tuple[_Record, _Record]:
        """Two records of one period, after so many periods, and so many later."""
        before, between = periods
        *_earlier, begin = follow(scene, accuracy, meter, until=before * period)
        first = self._record(scene, begin.point, period, accuracy, meter)
        point = first.events[-1].point
        if between > 1:
            wait = (between - 1) * period
            *_earlier, begin = follow(scene, accuracy, meter, start=point, until=wait)
            point = begin.point
        return first, self._record(scene, point, period, accuracy, meter)

    def _record(
        self, scene: Scene, start: Point, period: float, accuracy: Accuracy, meter: Meter
    ) -> _Record:
        """The motion at instants spread evenly over a period, each followed from the one before:
        exactly then, and not between the steps of an integrator.
        """
        events: list[Event] = []
        time = slip = 0.0
        stride = period / self.samples
        for number in range(self.samples):
            moving = list(follow(scene, accuracy, meter, start=start, until=stride))
            if not number:
                events.append(moving[0])
            end = moving[-1]
            time, slip = time + end.time, slip + end.slip
            events.append(end._replace(time=time, slip=slip))
            start = end.point
        springs, reliefs = zip(*((e.point.spring, e.point.psis[-1]) for e in events), strict=True)
        trend = springs[-1] - springs[0]
        spring = np.array(springs[:-1]) - trend * np.arange(self.samples) / self.samples
        return _Record(events, spring, -np.array(reliefs[:-1]), trend)


def _harmonics(values: np.ndarray) -> np.ndarray:
    return np.fft.rfft(values)


def _coarse(record: _Record) -> complex:
    """The response, from every other instant."""
    return complex(_harmonics(record.spring[::2])[1] / _harmonics(record.imposed[::2])[1])


def _degrees(response: complex) -> float:
    return math.degrees(cmath.phase(response))


def _read(record: _Record, linear: complex) -> dict[str, float]:
    """What is read off a record."""
    response = record.response
    return {
        "gain": abs(response),
        "phase_lead": _degrees(response),
        "distortion": float(np.linalg.norm(record.overtones)),
        "departure_from_linear": abs(response / linear - 1.0),
    }


def _shown(scene: Scene, record: _Record) -> dict[str, np.ndarray]:
    """The record itself."""
    events = record.events
    time = np.array([event.time for event in events])
    return {
        "time": time,
        "load_point_displacement": scene.load_velocity * time,
        "slip": np.array([event.slip for event in events]),
        "friction_coefficient": np.array([e.point.reading for e in events]),
        "normal_stress_ratio": np.array([event.point.normal_stress for event in events]),
        "log10_slip_rate": np.array([e.point.log_rate for e in events]) / math.log(10.0),
    }
