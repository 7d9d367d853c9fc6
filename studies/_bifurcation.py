"""Measure that computes peak slip rates of successive events and Floquet multipliers.

The measure ``Bifurcation`` integrates a motion event by event. The measure also searches for the
period-one cycle, which has one event per period, and computes the Floquet multipliers of this
cycle.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsfstudy import Scene, Segment
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import (
    EVENTS_PER_PERIOD_OUTPUT,
    INDEX_OF_PEAK_SLIP_RATE_OUTPUT,
    INITIAL_PERTURBATION_DISPLACEMENT,
    STEADY_SLIDING_OUTCOME,
    build_outcome_of_aperiodic_motion,
    determine_status_from_output_errors,
    estimate_primary_output_errors,
)
from rsfstudy.limit_cycles.limit_cycle_search import (
    StickSlipSequence,
    follow_motion_to_periodic_orbit,
)
from rsfstudy.limit_cycles.return_map import (
    DIFFERENCE_STEP_OVER_LOG_RATE_RANGE,
    PeriodicOrbit,
    ReturnMap,
    extract_section_coordinates,
)
from rsfstudy.limit_cycles.stick_slip_cycles import (
    LN10,
    StickSlipCycle,
    suggest_raising_event_limit,
)
from rsfstudy.measure_base import check_loading_changes_stress_only_in_steps
from rsfstudy.measures import Measure, Outcome, Output, Quantity, Status
from rsfstudy.motion import Integrator

#: Lower bound of error estimates, relative to the requested accuracy. Without this bound, the error
#: estimate would be too small if two runs agree by chance.
_COINCIDENCE_FLOOR = 0.02
#: Number of events that are used to align a perturbation with the direction of fastest growth. In
#: all other directions, a perturbation grows more slowly by a factor of at least ten per event.
_ALIGNMENT_EVENTS = 16
#: Maximum number of starting points in the search for the period-one cycle. The second value is the
#: maximum distance between the cycle and a starting point, in units of ``a`` times the range of ln
#: V.
_MAX_CYCLE_GUESSES, _MAX_GUESS_DISTANCE = 3, 0.3

_OUTPUTS = (
    replace(EVENTS_PER_PERIOD_OUTPUT, error=True),
    Output(
        "floquet_multiplier",
        r"$\mathrm{Re}\,\Lambda_1$",
        "1",
        "real part of the largest Floquet multiplier of the cycle with one event",
        error=True,
        optional=True,
    ),
    Output(
        "floquet_multiplier_imaginary",
        r"$\mathrm{Im}\,\Lambda_1$",
        "1",
        "imaginary part of the largest Floquet multiplier",
    ),
    Output(
        "floquet_multiplier_size",
        r"$|\Lambda_1|$",
        "1",
        "absolute value of the largest Floquet multiplier; the cycle with one event is stable "
        "below 1",
    ),
    Output(
        "one_event_log10_peak",
        r"$\log_{10}(V_{peak}/V_*)$",
        "1",
        "decimal logarithm of the peak slip rate over V_star of the stable or unstable cycle "
        "with one event",
        error=True,
        optional=True,
    ),
    Output(
        "lyapunov_exponent",
        r"$\lambda$",
        "1",
        "mean logarithmic growth of small perturbations per event; positive for chaos",
    ),
    Output(
        "lyapunov_exponent_stderr",
        "",
        "1",
        "standard error of the mean growth, from blocks of events; only if no cycle is stable",
    ),
    Output(
        "peak_spread",
        "",
        "1",
        "decimal logarithm of the ratio of the largest and smallest peak slip rates",
    ),
    Output("critical_stiffness"),
    Output("peak_log10_slip_rate", dims=("event",)),
    Output(
        "event_interval",
        "$t_r V_*/D_c$",
        "1",
        "time between successive events",
        "D_c/V_*",
        dims=("event",),
    ),
)


@dataclass(frozen=True)
class Bifurcation(Measure):
    """Peak slip rates of successive events at a constant load point velocity.

    The measure discards a transient and then records the peak slip rate of each event. The measure
    also searches for the period-one cycle. The search starts from events at which the state of the
    slider is almost the same as at the preceding event. The period-one cycle is reported even if
    neighbouring motions diverge from it. The Floquet multipliers of this cycle are the eigenvalues
    of the derivative of the return map, which maps spring stress and states from one maximum of
    spring stress to the next. The period of the cycle doubles when a multiplier passes through -1.

    A period is reported only if the motion approaches an attracting cycle, and if this cycle closes
    to the requested accuracy. If no period is reported, the status is ``not_periodic``. In this
    case, the Lyapunov exponent is the mean growth rate of small perturbations over the recorded
    events, and its standard error is also computed. If the motion approaches a cycle, the Lyapunov
    exponent is computed from the largest multiplier: the logarithm of the absolute value of the
    multiplier is divided by the number of events per period. In this case, no standard error is
    computed. The peaks of a chaotic motion have no error estimate, because a more accurate
    integration does not reproduce the peaks. The number of events per period is an integer, so its
    error is zero.

    Parameters
    ----------
    transient : int, default: 64
        Number of initial events that are discarded.
    events : int, default: 32
        Number of events that are recorded along the dimension ``event``.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196; Becker (2000), in AGU
    Geophys. Monogr. 120, 5-26.
    """

    transient: int = 64
    events: int = 32
    name: ClassVar[str] = "bifurcation"
    primary_output = "period_events"
    typical_rhs_evaluations = 120_000
    outputs = _OUTPUTS
    dimensions = (Quantity("event", "", "1", "number of the stored event"),)

    def __post_init__(self) -> None:
        """Check the numbers of events."""
        if self.transient < 0:
            raise InvalidValue("transient", self.transient, "must be 0 or greater")
        if self.events < 4:
            raise InvalidValue("number of events", self.events, "must be at least 4")

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinate values along the ``event`` dimension."""
        return {"event": np.arange(1, self.events + 1)}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Integrate the motion event by event, and find the period-one cycle.

        The period-one cycle is computed at two accuracies to estimate its errors.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome with the status ``not_periodic`` if the motion does not approach a cycle.
        """
        check_loading_changes_stress_only_in_steps(scene)
        if scene.log_load_velocity == -math.inf:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if not scene.is_perturbed:
            scene = scene.with_segment(Segment(1.0, INITIAL_PERTURBATION_DISPLACEMENT))
        motion = follow_motion_to_periodic_orbit(
            scene, integrator, self.transient + self.events, follow_all_cycles=True
        )
        if motion is None:
            return STEADY_SLIDING_OUTCOME
        values = self._event_outputs(scene, motion.cycles[-self.events :])
        status, why, of_one = _one_event_cycle_outputs(scene, integrator, motion)
        values |= of_one
        if motion.attracting_periodic_orbit is None:
            growth = _mean_growth(ReturnMap(scene, integrator), motion.cycles, self.events)
            values |= zip(("lyapunov_exponent", "lyapunov_exponent_stderr"), growth, strict=True)
            remedy = suggest_raising_event_limit(max(self.transient, self.events), "transient")
            ended = build_outcome_of_aperiodic_motion(scene, motion, remedy)
            if status is Status.OK:
                status, why = ended.status, ended.message
            return Outcome(status, values, why)
        values["lyapunov_exponent"] = _lyapunov_exponent(motion.attracting_periodic_orbit)
        values |= {
            "period_events": float(motion.attracting_periodic_orbit.period_in_cycles),
            "period_events_error": 0.0,
        }
        if status is Status.OK and "one_event_log10_peak" not in values:
            why = "the motion does not approach a cycle with one event"
        return Outcome(status, values, why)

    def _event_outputs(
        self, scene: Scene, seen: Sequence[StickSlipCycle]
    ) -> dict[str, float | np.ndarray]:
        """Return the results that are computed from the recorded events."""
        peaks = np.array([cycle.max_log_slip_rate / LN10 for cycle in seen])
        return {
            "peak_log10_slip_rate": peaks,
            "event_interval": np.array([cycle.recurrence_interval for cycle in seen]),
            "peak_spread": float(np.ptp(peaks)),
            "critical_stiffness": scene.critical_stiffness,
        }


def _one_event_cycle_outputs(
    scene: Scene, integrator: Integrator, motion: StickSlipSequence
) -> tuple[Status, str, dict[str, float | np.ndarray]]:
    """Compute the results of the period-one cycle.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.
    integrator : Integrator
        Integrator with the requested accuracy.
    motion : EventSequence
        Cycles of the motion.

    Returns
    -------
    status : Status
        ``unverified`` if the error estimate is too large, and OK otherwise.
    message : str
        Explanation of the status.
    values : dict of str to float
        Results of the cycle. The dictionary is empty if no period-one cycle is found.
    """
    one = _find_one_event_cycle(ReturnMap(scene, integrator), motion.cycles)
    if one is None:
        return Status.OK, "", {}
    again = ReturnMap(scene, integrator.refined()).find_periodic_orbit(
        one.start_point_on_poincare_section, 1, one.cycles[0].log_slip_rate_range
    )
    if again is None:
        return Status.OK, "", {}
    (first, *_), (same, *_) = one.floquet_multipliers, again.floquet_multipliers
    errors = estimate_primary_output_errors(integrator, one, again)
    values: dict[str, float | np.ndarray] = {
        "floquet_multiplier": float(first.real),
        "floquet_multiplier_error": integrator.estimate_error(
            first.real, same.real, _COINCIDENCE_FLOOR
        ),
        "floquet_multiplier_imaginary": float(abs(first.imag)),
        "floquet_multiplier_size": float(abs(first)),
        "one_event_log10_peak": float(
            one.corrected_primary_outputs[INDEX_OF_PEAK_SLIP_RATE_OUTPUT]
        ),
        "one_event_log10_peak_error": float(errors[INDEX_OF_PEAK_SLIP_RATE_OUTPUT]),
    }
    return *determine_status_from_output_errors(
        integrator,
        one,
        errors,
        slice(INDEX_OF_PEAK_SLIP_RATE_OUTPUT, INDEX_OF_PEAK_SLIP_RATE_OUTPUT + 1),
    ), values


def _mean_growth(by: ReturnMap, seen: Sequence[StickSlipCycle], kept: int) -> tuple[float, float]:
    """Compute the mean logarithmic growth of small perturbations per event.

    Before the growth is averaged, the perturbation is followed over several events until it is
    aligned with the direction of fastest growth. This alignment takes 16 events, or half of the
    events if there are fewer than 32. The standard error is computed from the means of
    approximately ``sqrt(n)`` blocks of events, where ``n`` is the number of averaged events.

    Parameters
    ----------
    by : ReturnMap
        Return map of the motion.
    seen : sequence of Cycle
        Cycles of the motion.
    kept : int
        Number of events over which growth is averaged.

    Returns
    -------
    tuple of float
        Mean growth and its standard error. The two values are NaN if a perturbed motion does not
        complete a cycle.
    """
    seen = seen[-(kept + _ALIGNMENT_EVENTS) :]
    step = (
        DIFFERENCE_STEP_OVER_LOG_RATE_RANGE
        * by.scene.a
        * max(cycle.log_slip_rate_range for cycle in seen)
    )
    departure, grown = np.ones(len(extract_section_coordinates(seen[0].motion_point_at_start))), []
    for cycle in seen:
        start, offset = (
            extract_section_coordinates(cycle.motion_point_at_start),
            step * departure / np.linalg.norm(departure),
        )
        ahead, behind = (
            by.follow_one_cycle_to_next_section(start + offset),
            by.follow_one_cycle_to_next_section(start - offset),
        )
        if ahead is None or behind is None:
            return math.nan, math.nan
        departure = (ahead - behind)[: len(start)] / (2.0 * step)
        grown.append(math.log(np.linalg.norm(departure)))
    grown = grown[min(_ALIGNMENT_EVENTS, len(grown) // 2) :]
    blocks = np.array_split(grown, max(2, math.isqrt(len(grown))))
    means = [block.mean() for block in blocks]
    return float(np.mean(grown)), float(np.std(means, ddof=1) / math.sqrt(len(means)))


def _find_one_event_cycle(by: ReturnMap, seen: Sequence[StickSlipCycle]) -> PeriodicOrbit | None:
    """Find the period-one cycle near the motion.

    Parameters
    ----------
    by : ReturnMap
        Return map of the motion.
    seen : sequence of Cycle
        Cycles of the motion.

    Returns
    -------
    Orbit or None
        Period-one cycle. The value is None if the search fails from all starting points.
    """
    for near in _closest_returns(seen):
        # After a period doubling, successive events alternate between the two sides of the cycle.
        midpoint = 0.5 * (
            extract_section_coordinates(near.motion_point_at_start)
            + extract_section_coordinates(near.motion_point_at_end)
        )
        orbit = by.find_periodic_orbit(
            midpoint, 1, near.log_slip_rate_range, max_distance=_MAX_GUESS_DISTANCE
        )
        if orbit is not None:
            return orbit
    return None


def _closest_returns(seen: Sequence[StickSlipCycle]) -> list[StickSlipCycle]:
    """Return the cycles that almost close, in order of increasing mismatch.

    Cycles in the first half of the motion are ignored. A cycle almost closes if the states at its
    end are close to the states at its beginning. The cycles are sorted by the largest change of a
    state over the cycle, relative to the range of ln V.
    """

    def off(cycle: StickSlipCycle) -> float:
        """Return the relative change of the states over a cycle."""
        apart = np.subtract(cycle.motion_point_at_end.psis, cycle.motion_point_at_start.psis)
        return float(np.abs(apart).max()) / cycle.log_slip_rate_range

    return sorted(seen[len(seen) // 2 :], key=off)[:_MAX_CYCLE_GUESSES]


def _lyapunov_exponent(orbit: PeriodicOrbit) -> float:
    """Return the Lyapunov exponent of a periodic orbit."""
    size = float(abs(orbit.floquet_multipliers[0]))
    return math.log(size) / orbit.period_in_cycles if size else -math.inf
