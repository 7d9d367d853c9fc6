"""Response to oscillating normal stress: how much spring stress oscillates with it, and when."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy import Accuracy, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import RecordingMeasure, phase_outputs
from rsfstudy.measure_base._recorded_motion import PHASE_VARIABLES
from rsfstudy.measures import Outcome, Output, Status
from rsfstudy.motion import Event, WorkMeter, integrate_events
from rsfstudy.responses import estimate_instant_errors
from rsfstudy.slider import Point, growth_rates, steady_sliding
from rsfstudy.slider.loading.oscillation import NormalStressOscillation
from rsfstudy.slider.stability import response_to_normal_stress

#: Part of the accuracy asked for that is left of the transient where the record begins, by the
#: slowest decay of small changes.
_REMAINING_TRANSIENT = 0.1
#: Most periods of forcing after which a response that repeats itself is told as one; how many it is
#: looked at for, at the end of the transient, and at how many instants in each.
_MAX_RESPONSE_PERIODS, _COMPARED_PERIODS, _INSTANTS_PER_PERIOD = 4, 8, 4
#: How often it is looked at before it is said to repeat nothing, and how many times as many
#: instants as are kept are looked at to resolve it.
_MAX_REPETITION_CHECKS, _MAX_SAMPLE_REFINEMENT = 6, 8
#: Part by which two records may differ where the response has settled.
_REPETITION_RTOL = 1e-3

_OUTPUTS = (
    Output(
        "gain",
        r"$|\hat\tau/\hat\sigma|$",
        "1",
        "amplitude of spring stress over that of imposed normal stress, at the period of forcing",
        error=True,
    ),
    Output(
        "phase_lead",
        r"$\arg(\hat\tau/\hat\sigma)$",
        "degree",
        "angle by which spring stress is ahead of imposed normal stress, at the period of forcing",
        error=True,
    ),
    Output(
        "distortion",
        "",
        "1",
        "spring stress at all other periods than that of forcing, over that at it",
        error=True,
    ),
    Output(
        "departure_from_linear",
        "",
        "1",
        "distance of the response from that of small oscillations, over that",
        error=True,
    ),
    Output(
        "linear_gain",
        r"$|\hat\tau/\hat\sigma|$",
        "1",
        "gain of small oscillations, by linear theory",
    ),
    Output(
        "linear_phase_lead",
        r"$\arg(\hat\tau/\hat\sigma)$",
        "degree",
        "lead of spring stress in small oscillations, by linear theory",
    ),
    Output(
        "response_period",
        "",
        "1",
        "number of periods of forcing after which the response repeats itself",
    ),
    Output("settled", "", "1", "whether one period of the response is as another later on"),
    *phase_outputs(*PHASE_VARIABLES),
)


class _ResponsePeriod(NamedTuple):
    """A response: how long a period of it lasts, how many of forcing that is, and over how many of
    its own small changes fall to 1/e.
    """

    duration: float
    forcing_periods: int
    decay_time: float = 0.0


class _ResponseRecord(NamedTuple):
    """One period of a response, of so many periods of forcing: events spread evenly over it, the
    last a period after the first; and spring stress and imposed normal stress at all but that,
    without the trend by which spring stress does not come back, which would be taken for overtones.
    """

    events: Sequence[Event]
    spring_stress: np.ndarray
    imposed: np.ndarray
    trend: float
    periods: int

    @property
    def harmonics(self) -> np.ndarray:
        """Fourier's coefficients of spring stress."""
        return np.fft.rfft(self.spring_stress)

    @property
    def drift(self) -> float:
        """Response that the trend would have made, over the response."""
        amplitude = 2.0 * abs(self.harmonics[self.periods]) / len(self.spring_stress)
        return float(abs(self.trend) / (math.pi * self.periods * amplitude))

    @property
    def overtones(self) -> np.ndarray:
        """Spring stress at other periods than that of forcing, over that at it."""
        harmonics = self.harmonics
        return np.asarray(np.delete(harmonics, [0, self.periods]) / harmonics[self.periods])

    @property
    def aliasing(self) -> float:
        """Change of all overtones together by those that the samples do not resolve.

        They are taken to be as strong as the upper quarter of those that are resolved, B. They add
        up in squares, and are folded back upon that quarter: (B**2 + 2 B B)/(2 D) of a sum D.
        """
        overtones = np.abs(self.overtones)
        resolved = float(np.linalg.norm(overtones))
        upper = float(np.linalg.norm(overtones[3 * len(overtones) // 4 :]))
        return 2.0 * upper * upper / resolved if resolved else 0.0

    @property
    def response(self) -> complex:
        """Spring stress over imposed normal stress, at the period of forcing."""
        return self._subsampled(1)

    def _subsampled(self, stride: int) -> complex:
        pair = self.spring_stress, self.imposed
        ours, imposed = (np.fft.rfft(x[::stride])[self.periods] for x in pair)
        return complex(ours / imposed)

    def equals_in_median(self, other: _ResponseRecord) -> bool:
        """True if spring stress is the same in the median: jumps may come an instant earlier."""
        apart = np.abs(self.spring_stress - other.spring_stress)
        return bool(np.median(apart) < _REPETITION_RTOL * np.ptp(self.spring_stress))

    @property
    def resolution_error(self) -> float:
        """Relative error of the response by what the instants do not resolve.

        Twice as many take away half of it where spring stress jumps, and all but its square where
        it is smooth: from a quarter, half and all of them. Two to a period resolve nothing.
        """
        change = abs(self._subsampled(2) / self.response - 1.0)
        several, rest = divmod(len(self.spring_stress) // self.periods, 4)
        if rest or several < 4:
            return change
        before = abs((self._subsampled(4) - self._subsampled(2)) / self.response)
        return change * min(1.0, 2.0 * change / before) if before else change


@dataclass(frozen=True)
class NormalStressResponse(RecordingMeasure):
    """Response of spring stress to an oscillation of imposed normal stress, once transients have
    decayed: Fourier's projection over one period.

    The motion is followed until the slowest decay of small changes has left a tenth of the accuracy
    asked for, and read then; and once more after a further e-fold of that decay, from which all is
    told. Strong oscillations may be answered by a response that repeats itself only after 2, 3 or 4
    periods of forcing, the `response_period`: all is then told of so many. It has `settled` where
    the two records agree to a thousandth of how far spring stress swings. A response that repeats
    itself after none of these is `not_periodic`. Where steady sliding is unstable nothing decays,
    and nothing is read.

    Parameters
    ----------
    samples : int
        Instants in a period of forcing at which the motion is looked at, an even number; up to
        eight times as many where these do not resolve it to the accuracy. So many of a period of
        the response, and the first of the next, are kept along `phase`.

    References
    ----------
    Boettcher and Marone (2004), J. Geophys. Res. 109, B03406; Perfettini et al. (2001), J.
    Geophys. Res. 106, 13455-13472.
    """

    samples: int = 64
    name: ClassVar[str] = "normal_stress_response"
    primary_output = "gain"
    typical_work = 20_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        if self.samples < 8 or self.samples % 2:
            rule = "must be an even number, at least 8"
            raise InvalidValue("samples", self.samples, rule)

    @property
    def point_count(self) -> int:
        return self.samples + 1

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Of spring stress itself and a, over the amplitude of normal stress. The overtones are
        resolved by `samples`.
        """
        stressed = scene.a / scene.oscillation_amplitude
        size = values["gain"] + stressed
        return {
            "gain": size,
            "phase_lead": math.degrees(size / values["gain"]),
            "departure_from_linear": size / values["linear_gain"],
        }

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Read the response, and once more with smaller tolerances for the errors."""
        loading = scene.parts.loading
        if not isinstance(loading, NormalStressOscillation):
            return Outcome(Status.NO_STEP, message="normal stress does not oscillate")
        if len(loading.segments) > 1:
            rule = "begins later or ends: the response is that to one that goes on for ever"
            remedy = "Leave out oscillation_begin and oscillation_cycles, or read it by simulate."
            raise InvalidValue("loading", loading.name, rule, remedy=remedy)
        if not scene.load_velocity or steady_sliding(scene, scene.log_load_velocity) is None:
            why = "the load point is held, or steady sliding is not possible at its velocity"
            return Outcome(Status.NO_STEADY_STATE, message=why)
        decay = -scene.load_velocity * growth_rates(scene, scene.log_load_velocity)[0].real
        if not decay > 0.0:
            why = "steady sliding is unstable: no transient decays"
            return Outcome(Status.NOT_APPLICABLE, message=why)
        period = loading.oscillation_period
        linear = response_to_normal_stress(scene, scene.log_load_velocity, 2.0 * math.pi / period)
        by_theory = {"linear_gain": abs(linear), "linear_phase_lead": _phase_in_degrees(linear)}
        fold = 1.0 / decay / period
        # looked at once the transient would not be taken for a response, and until it is over
        faint, over = (
            -math.log(_REMAINING_TRANSIENT * part) * fold
            for part in (_REPETITION_RTOL, accuracy.rtol)
        )
        waits = math.ceil(max(faint, over - _COMPARED_PERIODS))
        start, repeats = self._find_repetition(scene, waits, accuracy, meter)
        if not repeats:
            why = f"it repeats itself after none of 1 to {_MAX_RESPONSE_PERIODS} periods of forcing"
            return Outcome(Status.NOT_PERIODIC, {**by_theory, "settled": 0.0}, why)
        way = _ResponsePeriod(period * repeats, repeats, fold / repeats)
        first, last = self._resolve(scene, start, way, accuracy, meter)
        finer, instants = accuracy.refined(), len(last.spring_stress)
        start, same = self._find_repetition(scene, waits, finer, meter)
        _first, again = self._record_twice(scene, start, way, instants, finer, meter)
        moved = abs(last.response / first.response - 1.0)
        values = _read_outputs(last, linear)
        values |= (
            _estimate_errors(values, linear, last, again, moved, (scene, accuracy)) | by_theory
        )
        values["response_period"] = float(repeats)
        values["settled"] = float(same == repeats and last.equals_in_median(first))
        shown = last.events[:: instants // self.samples]
        return Outcome(Status.OK, {**values, **_record_outputs(scene, shown)})

    def _find_repetition(
        self, scene: Scene, waits: int, accuracy: Accuracy, meter: WorkMeter
    ) -> tuple[Point, int]:
        """Point of a motion after so many periods of forcing, and those during which it is looked
        at; and after how many it repeats itself, or 0. It may take longer than small changes do.
        """
        period = scene.oscillation_period
        *_earlier, begin = integrate_events(scene, accuracy, meter, until=waits * period)
        point, way = begin.point, _ResponsePeriod(_COMPARED_PERIODS * period, _COMPARED_PERIODS)
        for _ in range(_MAX_REPETITION_CHECKS):
            seen = self._record_period(
                scene, point, way, _COMPARED_PERIODS * _INSTANTS_PER_PERIOD, accuracy, meter
            )
            point = seen.events[-1].point
            # with its trend: of a response of three periods that is a part of it
            springs = [event.point.spring_stress for event in seen.events[:-1]]
            spring_stress = np.reshape(springs, (_COMPARED_PERIODS, _INSTANTS_PER_PERIOD))
            for count in range(1, _MAX_RESPONSE_PERIODS + 1):
                apart = (
                    spring_stress[_MAX_RESPONSE_PERIODS:]
                    - spring_stress[_MAX_RESPONSE_PERIODS - count : -count]
                )
                if np.abs(apart).max() < _REPETITION_RTOL * np.ptp(spring_stress):
                    return point, count
        return point, 0

    def _resolve(
        self, scene: Scene, start: Point, way: _ResponsePeriod, accuracy: Accuracy, meter: WorkMeter
    ) -> tuple[_ResponseRecord, _ResponseRecord]:
        """Two records at enough instants for the accuracy, or at the most there may be."""
        instants = way.forcing_periods * self.samples
        most = _MAX_SAMPLE_REFINEMENT * instants
        while True:
            first, last = self._record_twice(scene, start, way, instants, accuracy, meter)
            stressed = abs(last.response) * scene.oscillation_amplitude
            allowed = accuracy.rtol * (1.0 + scene.a / stressed)
            if instants >= most or last.resolution_error <= allowed:
                return first, last
            instants *= 2

    def _record_twice(
        self,
        scene: Scene,
        start: Point,
        way: _ResponsePeriod,
        instants: int,
        accuracy: Accuracy,
        meter: WorkMeter,
    ) -> tuple[_ResponseRecord, _ResponseRecord]:
        """Two records of a response: from a point, and an e-fold of decay later. What repeats
        itself later than that is elsewhere then: what lies between is no multiple of 2 or 3.
        """
        first = self._record_period(scene, start, way, instants, accuracy, meter)
        point, between = first.events[-1].point, math.ceil(way.decay_time)
        while math.gcd(between, 6) > 1:
            between += 1
        if between > 1:
            wait = (between - 1) * way.duration
            *_earlier, begin = integrate_events(scene, accuracy, meter, start=point, until=wait)
            point = begin.point
        return first, self._record_period(scene, point, way, instants, accuracy, meter)

    def _record_period(
        self,
        scene: Scene,
        start: Point,
        way: _ResponsePeriod,
        instants: int,
        accuracy: Accuracy,
        meter: WorkMeter,
    ) -> _ResponseRecord:
        """The motion at instants spread evenly, each followed from the one before: exactly then,
        and not between the steps of an integrator.
        """
        events: list[Event] = []
        time = slip = 0.0
        stride = way.duration / instants
        for _ in range(instants):
            begin, *_others, end = integrate_events(
                scene, accuracy, meter, start=start, until=stride
            )
            events = events or [begin]
            time, slip = time + end.time, slip + end.slip
            events.append(end._replace(time=time, slip=slip))
            start = end.point
        springs = [event.point.spring_stress for event in events]
        reliefs = [event.point.psis[-1] for event in events]
        trend = springs[-1] - springs[0]
        spring_stress = np.array(springs[:-1]) - trend * np.arange(instants) / instants
        return _ResponseRecord(
            events, spring_stress, -np.array(reliefs[:-1]), trend, way.forcing_periods
        )


def _phase_in_degrees(response: complex) -> float:
    return math.degrees(cmath.phase(response))


def _read_outputs(record: _ResponseRecord, linear: complex) -> dict[str, float]:
    """Numbers that are read off a record."""
    response = record.response
    return {
        "gain": abs(response),
        "phase_lead": _phase_in_degrees(response),
        "distortion": float(np.linalg.norm(record.overtones)),
        "departure_from_linear": abs(response / linear - 1.0),
    }


def _estimate_errors(
    values: Mapping[str, float],
    linear: complex,
    record: _ResponseRecord,
    again: _ResponseRecord,
    moved: float,
    asked: tuple[Scene, Accuracy],
) -> dict[str, float]:
    """Errors of what is read off a record, from another run: with what the response has moved
    since, what its trend made of it, and what the instants do not resolve.
    """
    unseen = record.resolution_error + moved + record.drift
    hidden = {
        "gain": unseen * values["gain"],
        "phase_lead": math.degrees(unseen),
        # what is left of overtones adds up as noise does, and seldom cancels
        "distortion": 5.0 * float(np.linalg.norm(record.overtones - again.overtones))
        + record.drift
        + record.aliasing,
        "departure_from_linear": unseen * values["gain"] / abs(linear),
    }
    over_imposed = 1.0 / asked[0].oscillation_amplitude
    over_spring = over_imposed / values["gain"]
    # errors of the instants add up as noise does: over the period they cancel for the most part
    left = math.sqrt(2.0 / len(record.spring_stress))
    by_friction = {
        "gain": left * over_imposed,
        "phase_lead": math.degrees(left * over_spring),
        "distortion": over_spring,
        "departure_from_linear": left * over_imposed / abs(linear),
    }
    errors = estimate_instant_errors(values, _read_outputs(again, linear), by_friction, *asked)
    return {name: error + hidden[name.removesuffix("_error")] for name, error in errors.items()}


def _record_outputs(scene: Scene, events: Sequence[Event]) -> dict[str, np.ndarray]:
    """The record itself."""
    time = np.array([event.time for event in events])
    return {
        "time": time,
        "load_point_displacement": scene.load_velocity * time,
        "slip": np.array([event.slip for event in events]),
        "friction_coefficient": np.array([e.point.apparent_friction for e in events]),
        "normal_stress_ratio": np.array([event.point.normal_stress for event in events]),
        "log10_slip_rate": np.array([e.point.log_slip_rate for e in events]) / math.log(10.0),
    }
