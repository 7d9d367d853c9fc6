"""Amplitude and phase of spring stress under oscillating normal stress.

The measure ``NormalStressResponse`` integrates a motion until transients have decayed. It then
computes the Fourier coefficient of spring stress at the forcing period.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import RecordingMeasure, create_outputs_along_phase
from rsfstudy.measure_base._recording_measure import VARIABLES_RECORDED_ALONG_PHASE
from rsfstudy.measures import Outcome, Output, Status
from rsfstudy.motion import Event, Integrator
from rsfstudy.responses import estimate_errors_at_instants
from rsfstudy.slider import MotionPoint
from rsfstudy.slider.loading.oscillation import NormalStressOscillation
from rsfstudy.slider.stability import compute_spring_response_to_normal_stress

#: Remaining transient at the beginning of the record, relative to the requested accuracy. The
#: remaining transient is computed from the slowest decay rate of small perturbations.
_REMAINING_TRANSIENT = 0.1
#: Largest response period in forcing periods. The second value is the number of forcing periods
#: that are compared to find the response period. The third value is the number of samples per
#: forcing period in this comparison.
_MAX_RESPONSE_PERIODS, _COMPARED_PERIODS, _INSTANTS_PER_PERIOD = 4, 8, 4
#: Maximum number of comparisons before the response is reported as not periodic. The second value
#: is the maximum factor by which the number of samples is increased to resolve the response.
_MAX_REPETITION_CHECKS, _MAX_SAMPLE_REFINEMENT = 6, 8
#: Largest difference between two records of a settled response, relative to the range of spring
#: stress.
_REPETITION_RTOL = 1e-3

_OUTPUTS = (
    Output(
        "gain",
        r"$|\hat\tau/\hat\sigma|$",
        "1",
        "amplitude of spring stress divided by the amplitude of imposed normal stress, at the "
        "forcing period",
        error=True,
    ),
    Output(
        "phase_lead",
        r"$\arg(\hat\tau/\hat\sigma)$",
        "degree",
        "phase lead of spring stress relative to imposed normal stress, at the forcing period",
        error=True,
    ),
    Output(
        "distortion",
        "",
        "1",
        "spring stress at all other periods, divided by the spring stress at the forcing period",
        error=True,
    ),
    Output(
        "departure_from_linear",
        "",
        "1",
        "relative difference from the response to small oscillations",
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
        "period of the response, in forcing periods",
    ),
    Output("settled", "", "1", "1 if later periods of the response are equal, otherwise 0"),
    *create_outputs_along_phase(*VARIABLES_RECORDED_ALONG_PHASE),
)


class _ResponsePeriod(NamedTuple):
    """Period of a response.

    Attributes
    ----------
    duration : float
        Period in D_c/V_*.
    forcing_periods : int
        Response period, as a number of forcing periods.
    decay_time : float, default: 0.0
        Time in which small perturbations decay by a factor of e, in response periods.
    """

    duration: float
    forcing_periods: int
    decay_time: float = 0.0


class _ResponseRecord(NamedTuple):
    """Record of one response period.

    Attributes
    ----------
    events : sequence of Event
        Samples at regular intervals. The last sample is one response period after the first.
    spring_stress : ndarray
        Spring stress at all samples except the last. The linear trend over the period is removed,
        because a trend would contribute to the overtones.
    imposed : ndarray
        Imposed normal stress at all samples except the last.
    trend : float
        Change of spring stress over the response period.
    periods : int
        Number of forcing periods.
    """

    events: Sequence[Event]
    spring_stress: np.ndarray
    imposed: np.ndarray
    trend: float
    periods: int

    @property
    def harmonics(self) -> np.ndarray:
        """Fourier coefficients of spring stress."""
        return np.fft.rfft(self.spring_stress)

    @property
    def drift(self) -> float:
        """Amplitude of the removed trend, divided by the amplitude of the response."""
        amplitude = 2.0 * abs(self.harmonics[self.periods]) / len(self.spring_stress)
        return float(abs(self.trend) / (math.pi * self.periods * amplitude))

    @property
    def overtones(self) -> np.ndarray:
        """Fourier coefficients of spring stress at all periods except the forcing period.

        The coefficients are relative to the coefficient at the forcing period. The mean is not
        included.
        """
        harmonics = self.harmonics
        return np.asarray(np.delete(harmonics, [0, self.periods]) / harmonics[self.periods])

    @property
    def aliasing(self) -> float:
        """Estimated error that aliasing causes in the norm of the overtones.

        Let :math:`D` be the norm of the resolved overtones, and :math:`B` the norm of the upper
        quarter of these overtones. The unresolved overtones are assumed to have the norm :math:`B`
        as well. The sum of squares does not include the unresolved overtones, which changes the
        norm by up to :math:`B^2/(2D)`. Aliasing also folds the unresolved overtones onto the upper
        quarter, which changes the norm by up to :math:`3B^2/(2D)`. The sum of both changes is
        :math:`2B^2/D`.
        """
        overtones = np.abs(self.overtones)
        resolved = float(np.linalg.norm(overtones))
        upper = float(np.linalg.norm(overtones[3 * len(overtones) // 4 :]))
        return 2.0 * upper * upper / resolved if resolved else 0.0

    @property
    def response(self) -> complex:
        """Ratio of spring stress to normal stress at the forcing period."""
        return self._subsampled(1)

    def _subsampled(self, stride: int) -> complex:
        """Compute the response from every ``stride``-th sample."""
        pair = self.spring_stress, self.imposed
        ours, imposed = (np.fft.rfft(x[::stride])[self.periods] for x in pair)
        return complex(ours / imposed)

    def equals_in_median(self, other: _ResponseRecord) -> bool:
        """Return True if the median difference between two records is small.

        The comparison uses the median difference in spring stress instead of the maximum
        difference. A sudden change of spring stress may occur one sample earlier or later, and the
        difference is then large at this sample.

        Parameters
        ----------
        other : _ResponseRecord
            Another record of the same length.

        Returns
        -------
        bool
            True if the median difference is less than 0.1 % of the range of spring stress.
        """
        apart = np.abs(self.spring_stress - other.spring_stress)
        return bool(np.median(apart) < _REPETITION_RTOL * np.ptp(self.spring_stress))

    @property
    def resolution_error(self) -> float:
        """Relative error of the response due to the finite number of samples.

        The estimate compares the responses from all samples, from every second sample and from
        every fourth sample. If spring stress changes suddenly, the error of the response halves
        when the number of samples is doubled. If spring stress is smooth, the error of the response
        decreases much faster. If the number of samples per forcing period is less than 16 or not a
        multiple of four, the estimate is the difference between the responses from all samples and
        from every second sample.
        """
        change = abs(self._subsampled(2) / self.response - 1.0)
        several, rest = divmod(len(self.spring_stress) // self.periods, 4)
        if rest or several < 4:
            return change
        before = abs((self._subsampled(4) - self._subsampled(2)) / self.response)
        return change * min(1.0, 2.0 * change / before) if before else change


@dataclass(frozen=True)
class NormalStressResponse(RecordingMeasure):
    """Response of spring stress to oscillating normal stress.

    The motion is integrated until the transient has decayed to a tenth of the requested accuracy.
    The decay time is computed from the slowest decay rate of small perturbations. The response is
    then recorded twice. The second record begins after the transient has decayed by another factor
    of e. The results are computed from the second record.

    The response to strong oscillations may repeat only after 2, 3 or 4 forcing periods. The result
    ``response_period`` reports the number of forcing periods, and all other results refer to a
    complete response period. The value of ``settled`` is 1 if the two records agree to 0.1 % of the
    range of spring stress. If the response does not repeat within 4 forcing periods, the status is
    ``not_periodic``. If steady sliding is unstable, transients do not decay, and the status is
    ``not_applicable``.

    Parameters
    ----------
    samples : int, default: 64
        Number of samples per forcing period, an even number. The measure uses up to eight times as
        many samples if necessary for the requested accuracy. The record along ``phase`` contains
        ``samples + 1`` samples of one response period.

    References
    ----------
    Boettcher and Marone (2004), J. Geophys. Res. 109, B03406; Perfettini et al. (2001), J. Geophys.
    Res. 106, 13455-13472.
    """

    samples: int = 64
    name: ClassVar[str] = "normal_stress_response"
    primary_output = "gain"
    typical_rhs_evaluations = 20_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        """Check the number of samples."""
        if self.samples < 8 or self.samples % 2:
            rule = "must be an even number, at least 8"
            raise InvalidValue("samples", self.samples, rule)

    @property
    def recorded_point_count(self) -> int:
        """Number of recorded samples along the ``phase`` dimension."""
        return self.samples + 1

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scales of the numerical errors.

        The scale of the gain is ``gain + a / amplitude``, where ``a`` is the parameter of the
        direct effect and ``amplitude`` is the amplitude of normal stress. The distortion has no
        scale, because its accuracy depends on the number of samples.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        values : mapping
            Results, keyed by name.

        Returns
        -------
        mapping
            Error scale of each result.
        """
        stressed = scene.a / scene.oscillation_amplitude
        size = values["gain"] + stressed
        return {
            "gain": size,
            "phase_lead": math.degrees(size / values["gain"]),
            "departure_from_linear": size / values["linear_gain"],
        }

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the response, and estimate its errors from a second motion.

        The second motion is integrated with smaller tolerances.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure.

        Raises
        ------
        InvalidValue
            If the oscillation does not begin at time 0, or if the oscillation ends.
        """
        loading = scene.parts.loading
        if not isinstance(loading, NormalStressOscillation):
            return Outcome(Status.NO_STEP, message="normal stress does not oscillate")
        if len(loading.segments) > 1:
            rule = "begins later or ends, but the response is defined for a permanent oscillation"
            remedy = "Leave out oscillation_begin and oscillation_cycles, or use rsfstudy.simulate."
            raise InvalidValue("loading", loading.name, rule, remedy=remedy)
        if not scene.load_velocity or scene.compute_steady_sliding(scene.log_load_velocity) is None:
            why = "the load point is held, or steady sliding is not possible at its velocity"
            return Outcome(Status.NO_STEADY_STATE, message=why)
        decay = -scene.load_velocity * scene.linear_growth_rates(scene.log_load_velocity)[0].real
        if not decay > 0.0:
            why = "steady sliding is unstable, so transients do not decay"
            return Outcome(Status.NOT_APPLICABLE, message=why)
        period = loading.oscillation_period
        linear = compute_spring_response_to_normal_stress(
            scene, scene.log_load_velocity, 2.0 * math.pi / period
        )
        by_theory = {"linear_gain": abs(linear), "linear_phase_lead": _phase_in_degrees(linear)}
        fold = 1.0 / decay / period
        # The transient must be too weak to be mistaken for the response when the comparison of
        # periods begins, and must have decayed when the comparison ends.
        faint, over = (
            -math.log(_REMAINING_TRANSIENT * part) * fold
            for part in (_REPETITION_RTOL, integrator.rtol)
        )
        waits = math.ceil(max(faint, over - _COMPARED_PERIODS))
        start, repeats = self._find_repetition(scene, waits, integrator)
        if not repeats:
            why = (
                f"the response does not repeat itself within {_MAX_RESPONSE_PERIODS} forcing "
                "periods"
            )
            return Outcome(Status.NOT_PERIODIC, {**by_theory, "settled": 0.0}, why)
        way = _ResponsePeriod(period * repeats, repeats, fold / repeats)
        first, last = self._resolve(scene, start, way, integrator)
        finer, instants = integrator.refined(), len(last.spring_stress)
        start, same = self._find_repetition(scene, waits, finer)
        _first, again = self._record_twice(scene, start, way, instants, finer)
        moved = abs(last.response / first.response - 1.0)
        values = _read_outputs(last, linear)
        values |= (
            _estimate_errors(values, linear, last, again, moved, (scene, integrator)) | by_theory
        )
        values["response_period"] = float(repeats)
        values["settled"] = float(same == repeats and last.equals_in_median(first))
        shown = last.events[:: instants // self.samples]
        return Outcome(Status.OK, {**values, **_record_outputs(scene, shown)})

    def _find_repetition(
        self, scene: Scene, waits: int, integrator: Integrator
    ) -> tuple[MotionPoint, int]:
        """Find the number of forcing periods after which the response repeats.

        The motion is first integrated over a given number of forcing periods (``waits``). The
        search for the period is repeated several times, because the transients of strong
        oscillations may decay more slowly than small perturbations.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        waits : int
            Number of forcing periods before the comparison.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        point : Point
            State of the slider at the end of the motion.
        count : int
            Response period in forcing periods. The number is zero if the response does not repeat.
        """
        period = scene.oscillation_period
        *_earlier, begin = integrator.follow(scene, until=waits * period)
        point, way = begin.point, _ResponsePeriod(_COMPARED_PERIODS * period, _COMPARED_PERIODS)
        for _ in range(_MAX_REPETITION_CHECKS):
            seen = self._record_period(
                scene, point, way, _COMPARED_PERIODS * _INSTANTS_PER_PERIOD, integrator
            )
            point = seen.events[-1].point
            # The trend is not removed, because it is part of a response that repeats after three
            # periods.
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
        self,
        scene: Scene,
        start: MotionPoint,
        way: _ResponsePeriod,
        integrator: Integrator,
    ) -> tuple[_ResponseRecord, _ResponseRecord]:
        """Record the response with sufficient samples for the requested accuracy.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        start : Point
            State of the slider at the beginning of the first record.
        way : _ResponsePeriod
            Period of the response.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        tuple of _ResponseRecord
            Two records of the response. The resolution error may be too large if the maximum number
            of samples is not sufficient.
        """
        instants = way.forcing_periods * self.samples
        most = _MAX_SAMPLE_REFINEMENT * instants
        while True:
            first, last = self._record_twice(scene, start, way, instants, integrator)
            stressed = abs(last.response) * scene.oscillation_amplitude
            allowed = integrator.rtol * (1.0 + scene.a / stressed)
            if instants >= most or last.resolution_error <= allowed:
                return first, last
            instants *= 2

    def _record_twice(
        self,
        scene: Scene,
        start: MotionPoint,
        way: _ResponsePeriod,
        instants: int,
        integrator: Integrator,
    ) -> tuple[_ResponseRecord, _ResponseRecord]:
        """Record the response at two times.

        The second record begins when the transient has decayed by another factor of e. The number
        of response periods from the beginning of the first record to the beginning of the second
        record is not divisible by two or three. The two records therefore differ if the response
        repeats only after two or three times the assumed period.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        start : Point
            State of the slider at the beginning of the first record.
        way : _ResponsePeriod
            Period of the response.
        instants : int
            Number of samples.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        tuple of _ResponseRecord
            First and second record.
        """
        first = self._record_period(scene, start, way, instants, integrator)
        point, between = first.events[-1].point, math.ceil(way.decay_time)
        while math.gcd(between, 6) > 1:
            between += 1
        if between > 1:
            wait = (between - 1) * way.duration
            *_earlier, begin = integrator.follow(scene, start=point, until=wait)
            point = begin.point
        return first, self._record_period(scene, point, way, instants, integrator)

    def _record_period(
        self,
        scene: Scene,
        start: MotionPoint,
        way: _ResponsePeriod,
        instants: int,
        integrator: Integrator,
    ) -> _ResponseRecord:
        """Record the motion at regular intervals over one response period.

        Each sample is the end point of a separate integration. The samples are therefore not
        interpolated between integration steps.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        start : Point
            State of the slider at the beginning of the record.
        way : _ResponsePeriod
            Period of the response.
        instants : int
            Number of samples.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        _ResponseRecord
            Record of the motion.
        """
        events: list[Event] = []
        time = slip = 0.0
        stride = way.duration / instants
        for _ in range(instants):
            begin, *_others, end = integrator.follow(scene, start=start, until=stride)
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
    """Return the phase of a complex number in degrees."""
    return math.degrees(cmath.phase(response))


def _read_outputs(record: _ResponseRecord, linear: complex) -> dict[str, float]:
    """Compute the results from a record."""
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
    asked: tuple[Scene, Integrator],
) -> dict[str, float]:
    """Estimate the errors of the results.

    The errors are estimated from a second run with smaller tolerances. The errors include the
    change of the response between the two records, the effect of the linear trend of spring stress,
    and the effect of the finite number of samples.

    Parameters
    ----------
    values : mapping
        Results of the first run.
    linear : complex
        Response to small oscillations.
    record : _ResponseRecord
        Record of the first run.
    again : _ResponseRecord
        Record of the second run.
    moved : float
        Relative difference of the response between the two records of the first run.
    asked : tuple[Scene, Integrator]
        Scene, and integrator with the requested accuracy.

    Returns
    -------
    dict
        Errors, keyed by name.
    """
    unseen = record.resolution_error + moved + record.drift
    hidden = {
        "gain": unseen * values["gain"],
        "phase_lead": math.degrees(unseen),
        # Errors of the overtones add up like random noise and rarely cancel.
        "distortion": 5.0 * float(np.linalg.norm(record.overtones - again.overtones))
        + record.drift
        + record.aliasing,
        "departure_from_linear": unseen * values["gain"] / abs(linear),
    }
    over_imposed = 1.0 / asked[0].oscillation_amplitude
    over_spring = over_imposed / values["gain"]
    # Errors at different samples are independent, so they mostly cancel over one period.
    left = math.sqrt(2.0 / len(record.spring_stress))
    by_friction = {
        "gain": left * over_imposed,
        "phase_lead": math.degrees(left * over_spring),
        "distortion": over_spring,
        "departure_from_linear": left * over_imposed / abs(linear),
    }
    errors = estimate_errors_at_instants(values, _read_outputs(again, linear), by_friction, *asked)
    return {name: error + hidden[name.removesuffix("_error")] for name, error in errors.items()}


def _record_outputs(scene: Scene, events: Sequence[Event]) -> dict[str, np.ndarray]:
    """Return the recorded variables along the dimension ``phase``."""
    time = np.array([event.time for event in events])
    return {
        "time": time,
        "load_point_displacement": scene.load_velocity * time,
        "slip": np.array([event.slip for event in events]),
        "friction_coefficient": np.array([e.point.apparent_friction for e in events]),
        "normal_stress_ratio": np.array([event.point.normal_stress for event in events]),
        "log10_slip_rate": np.array([e.point.log_slip_rate for e in events]) / math.log(10.0),
    }
