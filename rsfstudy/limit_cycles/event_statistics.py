r"""Statistics of the events of motions that do not repeat.

If a slider has noise, or if its motion is chaotic, the recurrence intervals vary from event to
event. The measure ``EventStatistics`` computes moments of the distributions of recurrence intervals
and stress drops. The measure reports three errors separately: the integration error for the given
noise path, the error due to the sampling interval of the noise, and the standard error due to the
finite number of events.

With white noise, :math:`\ln V` fluctuates as rapidly as the noise, so the slip rate crosses each
level many times. Event detection in scenes with noise therefore uses two levels. An event begins
when the slip rate first exceeds a multiple of the load point velocity, and it ends when the slip
rate falls below the load point velocity. In scenes without noise, the events are the cycles of
``iterate_stick_slip_cycles``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.limit_cycles.limit_cycle import INITIAL_PERTURBATION_DISPLACEMENT
from rsfstudy.limit_cycles.stick_slip_cycles import iterate_stick_slip_cycles
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import EventKind, Integrator, fall, rise
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Minimum numerical error, divided by the requested relative accuracy.
_MIN_ESTIMATED_ERROR_OVER_RTOL = 0.06
#: Statistics and described quantities, with their symbols and scales.
_MOMENT_NAMES_SYMBOLS_AND_LABELS = (
    ("mean", r"\langle {}\rangle", "mean"),
    ("sd", "s({})", "standard deviation"),
    ("cv", "CV({})", "coefficient of variation"),
)
_EVENT_QUANTITIES_WITH_MOMENTS = (
    ("recurrence_interval", "t_r", "recurrence interval", "D_c/V_*"),
    ("static_stress_drop", r"\Delta\tau_s", "static stress drop", "sigma_*"),
)


def _iterate_moment_outputs() -> Iterator[Output]:
    """Yield the outputs of the measure."""
    for name, symbol, text, scale in _EVENT_QUANTITIES_WITH_MOMENTS:
        for statistic, pattern, described in _MOMENT_NAMES_SYMBOLS_AND_LABELS:
            about = f"{described} of the {text}"
            math_symbol = f"${pattern.format(symbol)}$"
            size = "" if statistic == "cv" else scale
            full = f"{name}_{statistic}"
            yield Output(full, math_symbol, "1", about, scale=size, error=True)
            for suffix, kind in (
                ("stderr", "standard error of the"),
                ("path_error", "error by the sampling interval of noise of the"),
            ):
                yield Output(f"{full}_{suffix}", math_symbol, "1", f"{kind} {about}", scale=size)


class _SlipEvent(NamedTuple):
    """Start time (in units of D_c/V_*) and static stress drop (in sigma_*) of an event."""

    start_time: float
    static_stress_drop: float


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class EventStatistics(Measure):
    r"""Statistical moments of the recurrence intervals and stress drops of successive events.

    Use this measure for scenes with noise, and for scenes without noise whose motion may be
    chaotic. If a scene has noise, the recurrence interval is the time between the beginnings of
    successive events. The static stress drop is the difference between two spring stresses. The
    first stress is the spring stress at the moment when the slip rate last rises above the load
    point velocity before the event. The second stress is the spring stress at the end of the event.
    If a scene has no noise, both quantities are defined as in ``LimitCycle``, but are computed for
    each cycle.

    If the motion settles to steady sliding, the status is ``no_limit_cycle``. If a scene with noise
    has too few events, the status is ``work_budget_spent``.

    Parameters
    ----------
    cycles : int, default: 200
        Number of recurrence intervals.
    discarded_cycles : int, default: 10
        Number of initial recurrence intervals that are discarded.
    checked_cycles : int, default: 20
        Number of recurrence intervals for which the numerical errors are computed.
    slip_rate_ratio : float, default: 10.0
        Ratio of the slip rate to the load point velocity at which an event begins, in scenes with
        noise.

    Raises
    ------
    InvalidValue
        If a number of cycles is not a whole number, if fewer than four intervals are counted or
        checked, or if the ratio of slip rates is not above 1.

    Notes
    -----
    For each statistic ``x``, the outputs contain three errors:

    - ``x_error`` is the error of the integrator on the given path: the difference of ``x`` between
      two tolerances.
    - ``x_path_error`` is the error due to the sampling interval :math:`h` of the noise: the
      difference of ``x`` between the intervals :math:`h` and :math:`h/2` on the same path. The
      value is zero without noise.
    - ``x_stderr`` is the standard error for independent events. With the number of intervals
      :math:`n`, the standard deviation :math:`s`, the coefficient of variation :math:`c` and the
      kurtosis :math:`\kappa`, the standard errors of the mean, :math:`s` and :math:`c` are

    .. math::

        \frac{s}{\sqrt{n}}, \quad s \sqrt{\frac{\kappa - 1}{4 n}}, \quad
          c \sqrt{\frac{\kappa - 1}{4 n} + \frac{c^2}{n}}.

    The first two errors are computed from the first ``checked_cycles`` intervals only, and usually
    overestimate the errors for all intervals. If the motion is chaotic, motions that are computed
    with different tolerances diverge. In this case, the first two errors are about as large as the
    standard error for the checked intervals.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import EventStatistics
    >>> scene = Scene(
    ...     normal_stress="constant",
    ...     stiffness_ratio=0.5,
    ...     radiation_damping=1e-4,
    ...     loading_noise="white",
    ...     stress_noise=1e-5,
    ...     noise_interval=2.0,
    ... )
    >>> measure = EventStatistics(cycles=4, discarded_cycles=2, checked_cycles=4)
    >>> outcome = measure(scene, Accuracy(rtol=1e-4))
    >>> round(outcome.values["recurrence_interval_mean"], 1)
    18.8
    """

    cycles: int = 200
    discarded_cycles: int = 10
    checked_cycles: int = 20
    slip_rate_ratio: float = 10.0
    name: ClassVar[str] = "event_statistics"
    primary_output = "recurrence_interval_cv"
    outputs = (
        Output("interval_count", "$n$", "1", "number of recurrence intervals"),
        Output("record_length", "", "1", "total duration of the intervals", scale="D_c/V_*"),
        *_iterate_moment_outputs(),
    )
    #: Smallest number of intervals, below which the moments have no meaning.
    MIN_CYCLE_COUNT: ClassVar[int] = 4

    @property
    def typical_rhs_evaluations(self) -> int:
        """Typical number of right-hand-side evaluations per cell."""
        return 2_000 * (self.cycles + self.discarded_cycles + 4 * self.checked_cycles)

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        for name, least in (
            ("cycles", self.MIN_CYCLE_COUNT),
            ("discarded_cycles", 0),
            ("checked_cycles", self.MIN_CYCLE_COUNT),
        ):
            value = getattr(self, name)
            if isinstance(value, bool) or not value >= least or value % 1:
                raise InvalidValue(name, value, f"must be a whole number from {least}")
        if not 1.0 < self.slip_rate_ratio < math.inf:
            raise InvalidValue("slip_rate_ratio", self.slip_rate_ratio, "must be above 1")

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the statistics and their errors.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        if scene.log_load_velocity == -math.inf:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if not scene.is_perturbed:
            scene = scene.with_segment(Segment(1.0, INITIAL_PERTURBATION_DISPLACEMENT))
        events = self._list_events_delimiting_cycles(scene, integrator, self.cycles)
        checked = min(self.checked_cycles, self.cycles)
        if len(events) <= self.cycles:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the motion settles to steady sliding")
        refined, halved = (
            self._list_events_delimiting_cycles(scene, integrator.refined(), checked),
            events,
        )
        noise = scene.parts.loading_noise
        if noise.is_active:
            finer = scene.with_(noise_interval=0.5 * scene.noise_interval)
            halved = self._list_events_delimiting_cycles(finer, integrator, checked)
        if min(len(refined), len(halved)) <= checked:
            why = "the motion settles if it is computed with other tolerances. Use a smaller rtol"
            return Outcome(Status.UNVERIFIED, message=why)
        values = {
            "interval_count": float(self.cycles),
            "record_length": events[-1].start_time - events[0].start_time,
        }
        for number, (name, *_about) in enumerate(_EVENT_QUANTITIES_WITH_MOMENTS):
            found, few, fine, half = (
                _compute_moments(_list_recurrence_intervals_and_drops(part)[number])
                for part in (
                    events,
                    *(part[: checked + 1] for part in (events, refined, halved)),
                )
            )
            stderrs = _compute_moment_standard_errors(
                _list_recurrence_intervals_and_drops(events)[number]
            )
            for i, (statistic, *_rest) in enumerate(_MOMENT_NAMES_SYMBOLS_AND_LABELS):
                full, scale = f"{name}_{statistic}", found[i]
                error = integrator.estimate_error(
                    few[i], fine[i], _MIN_ESTIMATED_ERROR_OVER_RTOL, scale
                )
                values |= {
                    full: found[i],
                    f"{full}_error": error,
                    f"{full}_stderr": stderrs[i],
                    f"{full}_path_error": abs(few[i] - half[i]),
                }
        return Outcome(Status.OK, values)

    def _list_events_delimiting_cycles(
        self, scene: Scene, integrator: Integrator, cycle_count: int
    ) -> list[_SlipEvent]:
        """Return the events that delimit the intervals, without the discarded events.

        The list is shorter than ``cycle_count + 1`` if the motion settles.
        """
        events = (
            self._iterate_events_of_noisy_motion(scene, integrator)
            if scene.parts.loading_noise.is_active
            else _iterate_events_of_noiseless_motion(scene, integrator)
        )
        return list(islice(events, self.discarded_cycles, self.discarded_cycles + cycle_count + 1))

    def _iterate_events_of_noisy_motion(
        self, scene: Scene, integrator: Integrator
    ) -> Iterator[_SlipEvent]:
        """Yield the slip events of a scene with noise, using two slip rates as thresholds."""
        arrest = scene.log_load_velocity
        asked = (
            rise("log_slip_rate", arrest),
            rise("log_slip_rate", arrest + math.log(self.slip_rate_ratio)),
            fall("log_slip_rate", arrest),
        )
        before, begun = math.nan, math.nan
        for event in integrator.follow(scene, asked, with_time=True):
            if event.kind is EventKind.SEGMENT_START:
                before, begun = math.nan, math.nan
            elif event.specification == asked[0] and math.isnan(begun):
                before = event.point.spring_stress
            elif event.specification == asked[1] and math.isnan(begun):
                begun = event.time
            elif event.specification == asked[2] and not math.isnan(begun):
                yield _SlipEvent(begun, before - event.point.spring_stress)
                begun = math.nan


def _iterate_events_of_noiseless_motion(
    scene: Scene, integrator: Integrator
) -> Iterator[_SlipEvent]:
    """Yield one event for each cycle of a scene without noise."""
    time = 0.0
    for cycle in iterate_stick_slip_cycles(scene, integrator, None):
        if cycle is None:
            return
        time += cycle.recurrence_interval
        yield _SlipEvent(time, cycle.compute_primary_output_values()[1])


def _list_recurrence_intervals_and_drops(events: list[_SlipEvent]) -> tuple[np.ndarray, np.ndarray]:
    """Return the recurrence intervals, and the stress drop at the end of each interval."""
    intervals = [after.start_time - before.start_time for before, after in pairwise(events)]
    return np.array(intervals), np.array([event.static_stress_drop for event in events[1:]])


def _compute_moments(samples: np.ndarray) -> tuple[float, float, float]:
    """Return the mean, the standard deviation and the coefficient of variation of samples."""
    mean, deviation = float(samples.mean()), float(samples.std(ddof=1))
    return mean, deviation, deviation / mean


def _compute_moment_standard_errors(samples: np.ndarray) -> tuple[float, float, float]:
    """Return standard errors of the results of _compute_moments for independent samples."""
    _mean, deviation, variation = _compute_moments(samples)
    count, centred = len(samples), samples - samples.mean()
    variance = float(np.mean(centred**2))
    kurtosis = float(np.mean(centred**4)) / variance**2 if variance > 0.0 else 1.0
    spread = (kurtosis - 1.0) / (4.0 * count)
    return (
        deviation / math.sqrt(count),
        deviation * math.sqrt(spread),
        variation * math.sqrt(spread + variation**2 / count),
    )
