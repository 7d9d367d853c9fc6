"""Peaks of slip rate event by event, with Floquet multipliers of the cycle of one event."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsfstudy import Accuracy, Scene, Segment
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.cycle_search import EventSequence, follow_to_orbit
from rsfstudy.limit_cycles.cycles import LN10, Cycle, more_events_remedy
from rsfstudy.limit_cycles.limit_cycle import (
    PEAK_INDEX,
    PERIOD_OUTPUT,
    PERTURBATION_DISPLACEMENT,
    STEADY_SLIDING_OUTCOME,
    aperiodic_outcome,
    check_errors,
    estimate_cycle_errors,
)
from rsfstudy.limit_cycles.return_map import DIFFERENCE_STEP, Orbit, ReturnMap, section_at
from rsfstudy.measure_base import check_steady_loading
from rsfstudy.measures import Measure, Outcome, Output, Quantity, Status
from rsfstudy.motion import WorkMeter, estimate_error

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
_COINCIDENCE_FLOOR = 0.02
#: Events along which a departure turns to where it grows, before growth counts: other directions
#: lag behind by a factor of ten an event and more.
_ALIGNMENT_EVENTS = 16
#: How many guesses there are at a cycle of one event, and how far off the first may be.
_MAX_CYCLE_GUESSES, _MAX_GUESS_DISTANCE = 3, 0.3

_OUTPUTS = (
    replace(PERIOD_OUTPUT, error=True),
    Output(
        "floquet_multiplier",
        r"$\mathrm{Re}\,\Lambda_1$",
        "1",
        "Floquet multiplier of the cycle of one event that is largest in size, its real part",
        error=True,
        optional=True,
    ),
    Output(
        "floquet_multiplier_imaginary",
        r"$\mathrm{Im}\,\Lambda_1$",
        "1",
        "imaginary part of that Floquet multiplier",
    ),
    Output(
        "floquet_multiplier_size",
        r"$|\Lambda_1|$",
        "1",
        "size of that Floquet multiplier: the cycle of one event attracts below 1",
    ),
    Output(
        "one_event_log10_peak",
        r"$\log_{10}(V_{peak}/V_*)$",
        "1",
        "decimal logarithm of the peak slip rate over V_star of the cycle of one event, whether it "
        "attracts or not",
        error=True,
        optional=True,
    ),
    Output(
        "lyapunov_exponent",
        r"$\lambda$",
        "1",
        "logarithm of the growth of small departures per event, in the mean: positive in chaos",
    ),
    Output(
        "lyapunov_exponent_stderr",
        "",
        "1",
        "standard error of that mean, from blocks of events; only where no cycle attracts",
    ),
    Output(
        "peak_spread", "", "1", "decimal logarithm of the fastest over the slowest of the peaks"
    ),
    Output("critical_stiffness"),
    Output("peak_log10_slip_rate", dims=("event",)),
    Output(
        "event_interval",
        "$t_r V_*/D_c$",
        "1",
        "time from an event to the next",
        "D_c/V_*",
        dims=("event",),
    ),
)


@dataclass(frozen=True)
class Bifurcation(Measure):
    """Peaks of slip rate after a transient, event by event, under a steady load point velocity.

    A cycle of one event is looked for too, whether it attracts or not, close to where the motion
    comes closest to repeating itself. Its Floquet multipliers are the eigenvalues of the derivative
    of the map of spring stress and states from one maximum of spring stress to the next: where one
    passes -1, the period doubles. The period is that of a cycle that closes to the accuracy and
    attracts; without one the motion ends as `not_periodic`, with all numbers but those of a period.
    Peaks of chaotic motion have no error estimate, because no accuracy would reproduce them; the
    number of events in a period has none because it is whole. The Lyapunov exponent of such a
    motion is a mean over the events that are kept, with its standard error; that of a cycle is the
    logarithm of its largest multiplier, and has none.

    Parameters
    ----------
    transient : int
        Events that are left out.
    events : int
        Events that are kept, along `event`.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196; Becker (2000), in AGU
    Geophys. Monogr. 120, 5-26.
    """

    transient: int = 64
    events: int = 32
    name: ClassVar[str] = "bifurcation"
    primary_output = "period_events"
    typical_work = 120_000
    outputs = _OUTPUTS
    dimensions = (Quantity("event", "", "1", "number of the event, of those that are kept"),)

    def __post_init__(self) -> None:
        if self.transient < 0:
            raise InvalidValue("transient", self.transient, "must be 0 or greater")
        if self.events < 4:
            raise InvalidValue("events", self.events, "must be at least 4")

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"event": np.arange(1, self.events + 1)}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Follow the events, and close the cycle of one event at two accuracies."""
        check_steady_loading(scene)
        if scene.log_load_velocity == -math.inf:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if not scene.is_perturbed:
            scene = scene.with_segment(Segment(1.0, PERTURBATION_DISPLACEMENT))
        motion = follow_to_orbit(
            scene, accuracy, meter, self.transient + self.events, follow_all=True
        )
        if motion is None:
            return STEADY_SLIDING_OUTCOME
        values = self._event_outputs(scene, motion.cycles[-self.events :])
        status, why, of_one = _one_event_cycle_outputs(scene, accuracy, motion, meter)
        values |= of_one
        if motion.orbit is None:
            growth = _mean_growth(ReturnMap(scene, accuracy, meter), motion.cycles, self.events)
            values |= zip(("lyapunov_exponent", "lyapunov_exponent_stderr"), growth, strict=True)
            remedy = more_events_remedy(max(self.transient, self.events), "transient")
            ended = aperiodic_outcome(scene, motion, remedy)
            if status is Status.OK:
                status, why = ended.status, ended.message
            return Outcome(status, values, why)
        values["lyapunov_exponent"] = _lyapunov_exponent(motion.orbit)
        values |= {"period_events": float(motion.orbit.period), "period_events_error": 0.0}
        if status is Status.OK and "one_event_log10_peak" not in values:
            why = "the motion comes close to no cycle of one event"
        return Outcome(status, values, why)

    def _event_outputs(self, scene: Scene, seen: Sequence[Cycle]) -> dict[str, float | np.ndarray]:
        """Numbers of the events that are kept."""
        peaks = np.array([cycle.max_log_slip_rate / LN10 for cycle in seen])
        return {
            "peak_log10_slip_rate": peaks,
            "event_interval": np.array([cycle.recurrence_interval for cycle in seen]),
            "peak_spread": float(np.ptp(peaks)),
            "critical_stiffness": scene.critical_stiffness,
        }


def _one_event_cycle_outputs(
    scene: Scene, accuracy: Accuracy, motion: EventSequence, meter: WorkMeter
) -> tuple[Status, str, dict[str, float | np.ndarray]]:
    """The cycle of one event, if the motion comes close to one; and whether it is known."""
    one = _find_one_event_cycle(ReturnMap(scene, accuracy, meter), motion.cycles)
    if one is None:
        return Status.OK, "", {}
    again = ReturnMap(scene, accuracy.refined(), meter).find_orbit(
        one.start_section, 1, one.cycles[0].log_slip_rate_range
    )
    if again is None:
        return Status.OK, "", {}
    (first, *_), (same, *_) = one.multipliers, again.multipliers
    chance = _COINCIDENCE_FLOOR * accuracy.rtol
    errors = estimate_cycle_errors(accuracy, one, again)
    values: dict[str, float | np.ndarray] = {
        "floquet_multiplier": float(first.real),
        "floquet_multiplier_error": estimate_error(first.real, same.real, chance),
        "floquet_multiplier_imaginary": float(abs(first.imag)),
        "floquet_multiplier_size": float(abs(first)),
        "one_event_log10_peak": float(one.primary_outputs[PEAK_INDEX]),
        "one_event_log10_peak_error": float(errors[PEAK_INDEX]),
    }
    return *check_errors(accuracy, one, errors, slice(PEAK_INDEX, PEAK_INDEX + 1)), values


def _mean_growth(by: ReturnMap, seen: Sequence[Cycle], kept: int) -> tuple[float, float]:
    """By how much small departures grow along the last so many events, as a logarithm: mean and
    its standard error, over as many blocks of events as each has; NaN where they lead away from
    the motion.

    Which way a departure grows it learns along the events before, or the first half where there
    are few.
    """
    seen = seen[-(kept + _ALIGNMENT_EVENTS) :]
    step = DIFFERENCE_STEP * by.scene.a * max(cycle.log_slip_rate_range for cycle in seen)
    departure, grown = np.ones(len(section_at(seen[0].start_point))), []
    for cycle in seen:
        start, offset = section_at(cycle.start_point), step * departure / np.linalg.norm(departure)
        ahead, behind = by.compute_image(start + offset), by.compute_image(start - offset)
        if ahead is None or behind is None:
            return math.nan, math.nan
        departure = (ahead - behind)[: len(start)] / (2.0 * step)
        grown.append(math.log(np.linalg.norm(departure)))
    grown = grown[min(_ALIGNMENT_EVENTS, len(grown) // 2) :]
    blocks = np.array_split(grown, max(2, math.isqrt(len(grown))))
    means = [block.mean() for block in blocks]
    return float(np.mean(grown)), float(np.std(means, ddof=1) / math.sqrt(len(means)))


def _find_one_event_cycle(by: ReturnMap, seen: Sequence[Cycle]) -> Orbit | None:
    """The cycle of one event that a motion comes close to, whether it attracts or not."""
    for near in _closest_returns(seen):
        # where periods have doubled, events go back and forth around it
        midpoint = 0.5 * (section_at(near.start_point) + section_at(near.end_point))
        orbit = by.find_orbit(
            midpoint, 1, near.log_slip_rate_range, max_distance=_MAX_GUESS_DISTANCE
        )
        if orbit is not None:
            return orbit
    return None


def _closest_returns(seen: Sequence[Cycle]) -> list[Cycle]:
    """The events of the later half that came closest to the one before, over how far ln V swings;
    the closest first.
    """

    def off(cycle: Cycle) -> float:
        apart = np.subtract(cycle.end_point.psis, cycle.start_point.psis)
        return float(np.abs(apart).max()) / cycle.log_slip_rate_range

    return sorted(seen[len(seen) // 2 :], key=off)[:_MAX_CYCLE_GUESSES]


def _lyapunov_exponent(orbit: Orbit) -> float:
    """The Lyapunov exponent of a cycle."""
    size = float(abs(orbit.multipliers[0]))
    return math.log(size) / orbit.period if size else -math.inf
