"""Clock advance of the next event by a train of waves: as measured, and by two theories."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rsfstudy import Accuracy, Scene, Segment
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.cycle_search import CycleSearch
from rsfstudy.limit_cycles.return_map import ReturnMap
from rsfstudy.measures import Measure, Outcome, Output, Status
from rsfstudy.motion import (
    Event,
    EventSpecification,
    WorkMeter,
    estimate_error,
    integrate_events,
    rise,
)
from rsfstudy.slider import Point
from rsfstudy.slider.loading.oscillation import NormalStressOscillation

#: Displacement step in D_c that sets free motion off, and most events until its cycle repeats.
START_DISPLACEMENT_STEP, MAX_EVENTS = 0.1, 300
#: Part of the accuracy asked for to which two runs may agree by chance.
_COINCIDENCE_FLOOR = 0.06
#: ln(V/V_*) beyond which what is left of the time to an event is nothing: exp(-9) D_c/V_*.
NEGLIGIBLE_TIME_LOG_RATE = 9.0
#: Times at which Coulomb stress is looked at.
COULOMB_STRESS_SAMPLES = 2001
INTERVAL = "recurrence_interval"
#: Laws of which there are linear equations here.
LINEARISED_LAWS = ("slip", "slowness")

_OUTPUTS = (
    Output(
        "clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "time by which the next event comes earlier",
        "D_c/V_*",
        error=True,
    ),
    Output(
        "linear_clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "the same by the equations linear in departures from the free cycle",
        "D_c/V_*",
    ),
    Output(
        "coulomb_clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "the same of an event that comes as soon as shear stress over normal stress reaches what "
        "it is at the onset of a free one",
        "D_c/V_*",
    ),
    Output("linear_ratio", "", "1", "clock advance over that of the linear equations"),
    Output("coulomb_ratio", "", "1", "clock advance over that by a threshold of Coulomb stress"),
    Output("recurrence_interval", error=True),
)


@dataclass(frozen=True)
class ClockAdvance(Measure):
    """Time by which a train of waves makes the next event of stick-slip come earlier.

    An event comes as the slip rate reaches the instability norm. The train begins at a part
    `cycle_phase` of the interval from one event to the next, whatever the scene says of its begin.
    """

    cycle_phase: float = 0.5
    name: ClassVar[str] = "clock_advance"
    primary_output = "clock_advance"
    typical_work = 60_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        if not 0.0 < self.cycle_phase < 1.0:
            raise InvalidValue("cycle_phase", self.cycle_phase, "must lie between 0 and 1")

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """From a free cycle, and once more with smaller tolerances for the errors."""
        if not isinstance(scene.parts.loading, NormalStressOscillation):
            return Outcome(Status.NO_STEP, message="normal stress does not oscillate")
        runs = [self._find_next_event(scene, how, meter) for how in (accuracy, accuracy.refined())]
        one, again = runs
        if one is None or again is None:
            why = "the motion settles to steady sliding"
            return Outcome(Status.NO_LIMIT_CYCLE, message=why)
        chance = _COINCIDENCE_FLOOR * accuracy.rtol
        errors = {
            f"{name}_error": estimate_error(getattr(one, name), getattr(again, name), chance, scale)
            for name, scale in (("clock_advance", one.recurrence_interval), (INTERVAL, None))
        }
        values = {
            "clock_advance": one.clock_advance,
            INTERVAL: one.recurrence_interval,
            "linear_clock_advance": _linear_clock_advance(scene, one, meter),
            "coulomb_clock_advance": _coulomb_clock_advance(scene, one),
        }
        ratios = {
            f"{by}_ratio": one.clock_advance / (values[f"{by}_clock_advance"] or math.nan)
            for by in ("linear", "coulomb")
        }
        return Outcome(Status.OK, {**values, **ratios, **errors})

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Both are differences of times."""
        return dict.fromkeys(("clock_advance", INTERVAL), 2.0 * values[INTERVAL])

    def _find_next_event(
        self, scene: Scene, accuracy: Accuracy, meter: WorkMeter
    ) -> "_NextEvent | None":
        """The next event after a train comes; None where there is no stick-slip."""
        free = scene.with_segment(Segment(scene.load_velocity))
        cycle = _find_free_cycle(free, accuracy, meter)
        if cycle is None:
            return None
        start, (first, second) = cycle
        begins = first + self.cycle_phase * (second - first)
        *_earlier, begin = integrate_events(free, accuracy, meter, start=start, until=begins)
        forced, watches = scene.with_(oscillation_begin=begins), _event_specifications(scene)
        (comes,) = _event_times(
            integrate_events(forced, accuracy, meter, watches, resume_from=begin), 1
        )
        onset = start.friction_coefficient
        return _NextEvent(second - first, second - comes, second - begins, begin.point, onset)


class _NextEvent(NamedTuple):
    """The next event after a train comes.

    Attributes
    ----------
    recurrence_interval, clock_advance : float
    left : float
        Time from the beginning of the train to the free event.
    begin : Point
        What the slider does as the train begins.
    onset : float
        Friction coefficient where V rises through V_0 before a free event.
    """

    recurrence_interval: float
    clock_advance: float
    remaining_time: float
    cycle_start: Point
    train_start: float


def _find_free_cycle(
    free: Scene, accuracy: Accuracy, meter: WorkMeter
) -> tuple[Point, tuple[float, float]] | None:
    """A free cycle: where it begins, with V at V_0, and times of two events from there; None where
    the motion settles to steady sliding.
    """
    nudged = free.with_segment(Segment(free.load_velocity, START_DISPLACEMENT_STEP))
    approach = CycleSearch(nudged, accuracy, meter)
    if not approach.run(MAX_EVENTS):
        return None
    start = ReturnMap(free, accuracy, meter).point_at(approach.orbit.start_section)
    motion = integrate_events(
        free, accuracy, meter, _event_specifications(free), start=start, with_time=True
    )
    begin = next(motion).point  # all of it
    first, second = _event_times(motion, 2)
    return begin, (first, second)


def _event_specifications(scene: Scene) -> list[EventSpecification]:
    """An event comes as the slip rate reaches the instability norm."""
    return [rise("log_slip_rate", scene.log_instability_rate)]


def _event_times(motion: Iterator[Event], count: int) -> list[float]:
    """Times of the first events of a motion that was asked for nothing else."""
    return list(islice((event.time for event in motion if event.specification is not None), count))


def _normal_stress_change(scene: Scene) -> Callable[[float], float]:
    """Change of normal stress over sigma_*, against time since the train begins."""
    loading = scene.parts.loading
    assert isinstance(loading, NormalStressOscillation)
    amplitude, angle, lasts = (
        loading.oscillation_amplitude,
        loading.initial_phase,
        loading.oscillation_duration,
    )
    turn = 2.0 * math.pi / loading.oscillation_period

    def train(time: float) -> float:
        return amplitude * math.sin(turn * time + angle) if 0.0 <= time < lasts else 0.0

    return train


def _linear_clock_advance(scene: Scene, found: _NextEvent, meter: WorkMeter) -> float:
    """Clock advance to first order in the amplitude; NaN of scenes with other equations than these.
    Departures of spring stress f and state Psi from the free motion grow along it by

        a dx = df - dPsi - (mu_* + f) dsigma,    df/dt = -K V dx,
        dPsi/dt = -V [(Psi + b x) dx + dPsi + b dx]            (slip law),
        dPsi/dt = -exp(-Psi/b) dPsi - b V dx                   (slowness law);

    once slip rate grows by itself, the motion is the free one of an earlier time, dx = Dt dx/dt.
    """
    damps = scene.parts.dynamics.radiated_stress_slope(0.0)
    if scene.law not in LINEARISED_LAWS or scene.normal_stress != "imposed" or scene.alpha or damps:
        return math.nan
    a, b, mu_star, stiffness = scene.a, scene.b, scene.mu_star, scene.stiffness
    amplitude, slip_law, train = (
        scene.oscillation_amplitude,
        scene.law == "slip",
        _normal_stress_change(scene),
    )

    def along(t: float, y: np.ndarray, pressed: float) -> tuple[float, float, list[float]]:
        f, psi, df, dpsi = y
        x, dx = (f - psi) / a, (df - dpsi - (mu_star + f) * pressed) / a
        v = math.exp(x)
        if slip_law:
            lag = psi + b * x
            healing = -v * lag, -v * (lag * dx + dpsi + b * dx)
        else:
            fresh = math.exp(-psi / b)
            healing = b * (fresh - v), -fresh * dpsi - b * v * dx
        growth = stiffness * (scene.load_velocity - v), -stiffness * v * dx
        rates = [growth[0], healing[0], growth[1], healing[1]]
        return (rates[0] - rates[1]) / a, dx, rates

    def rate(t: float, y: np.ndarray) -> list[float]:
        return along(t, y, train(t) / amplitude)[-1]

    def fast(t: float, y: np.ndarray) -> float:
        return float((y[0] - y[1]) / a - NEGLIGIBLE_TIME_LOG_RATE)

    setattr(fast, "terminal", True)  # noqa: B010  # as SciPy asks for it
    latest = 2.0 * found.remaining_time
    over = min((scene.oscillation_cycles or math.inf) * scene.oscillation_period, latest)
    y: Any = [found.cycle_start.spring_stress, found.cycle_start.psis[0], 0.0, 0.0]
    # no step is longer than part of a wave
    for begin, end, longest in (
        (0.0, over, scene.oscillation_period / 8.0),
        (over, latest, latest),
    ):
        steps = {"rtol": 1e-7, "atol": 1e-10, "max_step": longest}
        run = solve_ivp(rate, (begin, end), y, "DOP853", events=fast, **steps)
        meter.charge("linear", run.nfev)
        y = run.y[:, -1]
        if run.status == 1:
            break
    growth, dx, _rates = along(run.t[-1], y, 0.0)
    return float(amplitude * dx / growth)


def _coulomb_clock_advance(scene: Scene, found: _NextEvent) -> float:
    """Clock advance where the spring is loaded at K V_0, and an event comes as soon as friction is
    what it is at the onset of a free one: K V_0 (t - t_1) = mu dsigma/sigma_*.
    """
    loading = scene.stiffness * scene.load_velocity
    latest = found.remaining_time + found.train_start * scene.oscillation_amplitude / loading

    train = _normal_stress_change(scene)

    def missing(time: float) -> float:
        return found.train_start * train(time) - loading * (time - found.remaining_time)

    times = np.linspace(0.0, 1.01 * latest, COULOMB_STRESS_SAMPLES).tolist()
    first = next(place for place, time in enumerate(times) if missing(time) <= 0.0)
    return found.remaining_time - float(brentq(missing, times[first - 1], times[first]))
