"""Clock advance of the next stick-slip event due to a train of waves.

The measure ``ClockAdvance`` computes the clock advance from motions with and without the waves. The
measure also computes two approximations of the clock advance. One approximation uses first-order
perturbation theory, and the other uses a Coulomb stress threshold.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rsfstudy import Scene, Segment
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle_search import LimitCycleSearch
from rsfstudy.limit_cycles.return_map import ReturnMap
from rsfstudy.measures import Measure, Outcome, Output, Status
from rsfstudy.motion import (
    Event,
    EventSpecification,
    Integrator,
    rise,
)
from rsfstudy.slider import MotionPoint
from rsfstudy.slider.loading.oscillation import NormalStressOscillation

#: Size in D_c of the displacement step that starts the stick-slip motion without waves. The second
#: value is the maximum number of events before the motion repeats.
START_DISPLACEMENT_STEP, MAX_EVENTS = 0.1, 300
#: Lower bound of error estimates, relative to the requested accuracy. Without this bound, the error
#: estimate would be too small if two runs agree by chance.
_COINCIDENCE_FLOOR = 0.06
#: Value of ln(V/V_*) at which the integration of the linear equations for the perturbations stops.
#: The remaining time to the event at this slip rate is approximately exp(-9) D_c/V_*, which is
#: negligible.
NEGLIGIBLE_TIME_LOG_RATE = 9.0
#: Number of points in time at which Coulomb stress is evaluated.
COULOMB_STRESS_SAMPLES = 2001
INTERVAL = "recurrence_interval"
#: Evolution laws for which the linear equations for the perturbations are implemented.
LINEARISED_LAWS = ("slip", "slowness")

_OUTPUTS = (
    Output(
        "clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "advance of the time of the next event",
        "D_c/V_*",
        error=True,
    ),
    Output(
        "linear_clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "clock advance from the equations linearised about the free cycle",
        "D_c/V_*",
    ),
    Output(
        "coulomb_clock_advance",
        r"$\Delta t\,V_*/D_c$",
        "1",
        "clock advance if the event begins when shear stress divided by normal stress reaches "
        "its value at the onset of a free event",
        "D_c/V_*",
    ),
    Output(
        "linear_ratio",
        "",
        "1",
        "clock advance divided by the clock advance from the linearised equations",
    ),
    Output(
        "coulomb_ratio",
        "",
        "1",
        "clock advance divided by the clock advance from a Coulomb stress threshold",
    ),
    Output("recurrence_interval", error=True),
)


@dataclass(frozen=True)
class ClockAdvance(Measure):
    """Clock advance of the next stick-slip event due to a train of waves.

    The clock advance is the time by which the waves advance the next event. An event occurs when
    the slip rate reaches the instability norm. The parameter ``cycle_phase`` determines the time at
    which the train begins, and the value of ``oscillation_begin`` in the scene is ignored.

    Parameters
    ----------
    cycle_phase : float, default: 0.5
        Beginning of the train, as a fraction of the recurrence interval after an event.
    """

    cycle_phase: float = 0.5
    name: ClassVar[str] = "clock_advance"
    primary_output = "clock_advance"
    typical_rhs_evaluations = 60_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        """Check that the wave train begins between two events."""
        if not 0.0 < self.cycle_phase < 1.0:
            raise InvalidValue("cycle_phase", self.cycle_phase, "must lie between 0 and 1")

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the clock advance and its error estimate.

        The error estimate is based on a second run with smaller tolerances.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome with the status ``no_limit_cycle`` if the motion without waves settles to steady
            sliding.
        """
        if not isinstance(scene.parts.loading, NormalStressOscillation):
            return Outcome(Status.NO_STEP, message="normal stress does not oscillate")
        runs = [self._find_next_event(scene, each) for each in (integrator, integrator.refined())]
        one, again = runs
        if one is None or again is None:
            why = "the motion settles to steady sliding"
            return Outcome(Status.NO_LIMIT_CYCLE, message=why)
        errors = {
            f"{name}_error": integrator.estimate_error(
                getattr(one, name), getattr(again, name), _COINCIDENCE_FLOOR, scale
            )
            for name, scale in (("clock_advance", one.recurrence_interval), (INTERVAL, None))
        }
        values = {
            "clock_advance": one.clock_advance,
            INTERVAL: one.recurrence_interval,
            "linear_clock_advance": _linear_clock_advance(scene, one, integrator),
            "coulomb_clock_advance": _coulomb_clock_advance(scene, one),
        }
        ratios = {
            f"{by}_ratio": one.clock_advance / (values[f"{by}_clock_advance"] or math.nan)
            for by in ("linear", "coulomb")
        }
        return Outcome(Status.OK, {**values, **ratios, **errors})

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scales of the numerical errors.

        Each result is the difference between two times. The scale of its error is therefore twice
        the recurrence interval.

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
        return dict.fromkeys(("clock_advance", INTERVAL), 2.0 * values[INTERVAL])

    def _find_next_event(self, scene: Scene, integrator: Integrator) -> "_NextEvent | None":
        """Find the next event after the train has begun.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        _NextEvent or None
            Next event. The value is None if there is no stick-slip motion.
        """
        free = scene.with_segment(Segment(scene.load_velocity))
        cycle = _find_free_cycle(free, integrator)
        if cycle is None:
            return None
        start, (first, second) = cycle
        begins = first + self.cycle_phase * (second - first)
        *_earlier, begin = integrator.follow(free, start=start, until=begins)
        forced, watches = scene.with_(oscillation_begin=begins), _event_specifications(scene)
        (comes,) = _event_times(integrator.follow(forced, watches, resume_from=begin), 1)
        onset = start.friction_coefficient
        return _NextEvent(second - first, second - comes, second - begins, begin.point, onset)


class _NextEvent(NamedTuple):
    """Next event after the beginning of a train of waves.

    Attributes
    ----------
    recurrence_interval : float
        Recurrence interval without waves in D_c/V_*.
    clock_advance : float
        Clock advance in D_c/V_*.
    remaining_time : float
        Time in D_c/V_* from the beginning of the train to the event that occurs without waves.
    cycle_start : Point
        State of the slider at the beginning of the train.
    train_start : float
        Friction coefficient at the onset of an event in the motion without waves. The onset is the
        time at which V rises through V_0.
    """

    recurrence_interval: float
    clock_advance: float
    remaining_time: float
    cycle_start: MotionPoint
    train_start: float


def _find_free_cycle(
    free: Scene, integrator: Integrator
) -> tuple[MotionPoint, tuple[float, float]] | None:
    """Find the limit cycle without waves.

    Parameters
    ----------
    free : Scene
        Scene without waves.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    tuple or None
        State of the slider when V = V_0, and the times of the next two events. The value is None if
        the motion settles to steady sliding.
    """
    nudged = free.with_segment(Segment(free.load_velocity, START_DISPLACEMENT_STEP))
    approach = LimitCycleSearch(nudged, integrator)
    if not approach.follow_cycles_until_converged(MAX_EVENTS):
        return None
    start = ReturnMap(free, integrator).section_coordinates_to_point(
        approach.last_cycle_as_periodic_orbit.start_point_on_poincare_section
    )
    motion = integrator.follow(free, _event_specifications(free), start=start, with_time=True)
    begin = next(motion).point  # The first event holds the fully evaluated point.
    first, second = _event_times(motion, 2)
    return begin, (first, second)


def _event_specifications(scene: Scene) -> list[EventSpecification]:
    """Return the specification of the event at which V reaches the instability norm."""
    return [rise("log_slip_rate", scene.log_slip_rate_at_instability)]


def _event_times(motion: Iterator[Event], count: int) -> list[float]:
    """Return the times of the first events of a motion.

    The motion must detect only one type of event: the slip rate rises through the instability norm.
    """
    return list(islice((event.time for event in motion if event.specification is not None), count))


def _normal_stress_change(scene: Scene) -> Callable[[float], float]:
    """Return the normal stress of the train as a function of time.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.

    Returns
    -------
    callable
        Function that returns the change of normal stress in sigma_* at a time since the beginning
        of the train.
    """
    loading = scene.parts.loading
    assert isinstance(loading, NormalStressOscillation)
    amplitude, angle, lasts = (
        loading.oscillation_amplitude,
        loading.initial_phase_in_radians,
        loading.oscillation_duration,
    )
    turn = 2.0 * math.pi / loading.oscillation_period

    def train(time: float) -> float:
        """Return the change of normal stress at a given time."""
        return amplitude * math.sin(turn * time + angle) if 0.0 <= time < lasts else 0.0

    return train


def _linear_clock_advance(scene: Scene, found: _NextEvent, integrator: Integrator) -> float:
    r"""Compute the clock advance to first order in the amplitude of the waves.

    The perturbations of the spring stress :math:`f` and of the state :math:`\Psi` are integrated
    along the motion without waves:

    .. math::

        a\,\delta x &= \delta f - \delta\Psi - (\mu_* + f)\,\delta\sigma, \qquad
        \dot{\delta f} = -K V\,\delta x, \\
        \dot{\delta\Psi} &= -V\,[(\Psi + b x)\,\delta x + \delta\Psi + b\,\delta x]
        \quad \text{(slip law)}, \\
        \dot{\delta\Psi} &= -e^{-\Psi/b}\,\delta\Psi - b V\,\delta x
        \quad \text{(slowness law)},

    with :math:`x = \ln(V/V_*)`. During nucleation, the perturbed motion becomes a copy of the
    original motion, shifted in time by the clock advance :math:`\Delta t`. Therefore, :math:`\delta
    x = \Delta t\,\dot x`.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.
    found : _NextEvent
        Event after the beginning of the train.
    integrator : Integrator
        Integrator that counts right-hand-side evaluations.

    Returns
    -------
    float
        Clock advance in D_c/V_*. The value is NaN if the linear equations do not apply to the
        scene, for example because of radiation damping, another evolution law, or a dependence of
        the state on normal stress.
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
        """Evaluate the equations of motion and the equations of the perturbations.

        Parameters
        ----------
        t : float
            Time. Not used.
        y : ndarray
            Spring stress, state, and their perturbations.
        pressed : float
            Change of normal stress divided by the amplitude of the waves.

        Returns
        -------
        tuple
            Time derivative of ln V, perturbation of ln V, and time derivatives of ``y``.
        """
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
        """Evaluate the right-hand side of the linear equations."""
        return along(t, y, train(t) / amplitude)[-1]

    def fast(t: float, y: np.ndarray) -> float:
        """Return ln V minus the value of ln V at which the event is imminent."""
        return float((y[0] - y[1]) / a - NEGLIGIBLE_TIME_LOG_RATE)

    setattr(fast, "terminal", True)  # noqa: B010  # attribute required by SciPy
    latest = 2.0 * found.remaining_time
    over = min((scene.oscillation_cycles or math.inf) * scene.oscillation_period, latest)
    y: Any = [found.cycle_start.spring_stress, found.cycle_start.psis[0], 0.0, 0.0]
    # The step size is limited so that the integrator does not skip a wave.
    for begin, end, longest in (
        (0.0, over, scene.oscillation_period / 8.0),
        (over, latest, latest),
    ):
        steps = {"rtol": 1e-7, "atol": 1e-10, "max_step": longest}
        run = solve_ivp(rate, (begin, end), y, "DOP853", events=fast, **steps)
        integrator.work_meter.charge("linear", run.nfev)
        y = run.y[:, -1]
        if run.status == 1:
            break
    growth, dx, _rates = along(run.t[-1], y, 0.0)
    return float(amplitude * dx / growth)


def _coulomb_clock_advance(scene: Scene, found: _NextEvent) -> float:
    r"""Compute the clock advance that a Coulomb stress threshold predicts.

    The load point stresses the spring at the rate :math:`K V_0`. In the motion without waves, the
    onset of the event is at the time :math:`t_1`, and the friction coefficient at the onset is
    :math:`\mu`. With waves, the event is assumed to occur when the friction coefficient first
    reaches :math:`\mu`. The clock advance :math:`t_1 - t` follows from

    .. math:: K V_0\,(t - t_1) = \mu\,\Delta\sigma(t)/\sigma_*.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.
    found : _NextEvent
        Event after the beginning of the train.

    Returns
    -------
    float
        Clock advance in D_c/V_*.
    """
    loading = scene.stiffness * scene.load_velocity
    latest = found.remaining_time + found.train_start * scene.oscillation_amplitude / loading

    train = _normal_stress_change(scene)

    def missing(time: float) -> float:
        """Return the threshold minus the current Coulomb stress."""
        return found.train_start * train(time) - loading * (time - found.remaining_time)

    times = np.linspace(0.0, 1.01 * latest, COULOMB_STRESS_SAMPLES).tolist()
    first = next(place for place, time in enumerate(times) if missing(time) <= 0.0)
    return found.remaining_time - float(brentq(missing, times[first - 1], times[first]))
