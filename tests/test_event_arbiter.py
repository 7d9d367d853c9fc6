"""Times and values of our events against those of SciPy's `solve_ivp`, from equations written once
more, in time, with the state variable itself, and with event functions of their own.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.engines import ENGINES
from rsfstudy.motion.events import fall, maximum, minimum, rise
from rsfstudy.motion.meter import Meter

A, B, MU = 0.01, 0.018, 0.7
#: Levels of ln V that are crossed, before and after the step of the load point.
ABOVE, BELOW = math.log(2.0) + 0.1, math.log(2.0) - 0.1
WATCHES = (
    *(maximum("log_rate"), minimum("log_rate"), maximum("spring"), minimum("spring")),
    *(rise("log_rate", ABOVE), fall("log_rate", BELOW)),
)
LOAD = 2.0


class Known(NamedTuple):
    """What there is to know at an instant: ln V and its rate, spring stress, normal stress, and
    the state variable (the sum, of several).
    """

    x: float
    growth: float
    f: float
    s: float
    theta: float


class Problem(NamedTuple):
    """A scene, and its equations in time.

    Attributes
    ----------
    scene : Scene
    rates : callable
        Derivatives of the unknowns, which are all 0 at first.
    known : callable
        What follows from the unknowns.
    until : float
    rtol : float
        What is asked of ours.
    """

    scene: Scene
    rates: Callable[[np.ndarray], list[float]]
    known: Callable[[np.ndarray], Known]
    until: float
    rtol: float = 1e-9


def scene(stiffness: float, law: str, **fields) -> Scene:
    of_law = {} if law.startswith("two") else {"b_over_a": B / A}
    same = {"a": A, "mu_star": MU, "load_velocity_ratio": LOAD}
    return Scene(law=law, stiffness=stiffness, **of_law, **same, **fields)


def slip_law(x: float, theta: float) -> float:
    return -math.exp(x) * (theta + B * x)


def slowness_law(x: float, theta: float) -> float:
    return B * (math.exp(-theta / B) - math.exp(x))


def constant(law: str, evolution: Callable[[float, float], float], stiffness: float) -> Problem:
    """Constant normal stress: f = a x + Theta."""

    def rates(y):
        x = (y[0] - y[1]) / A
        return [stiffness * (LOAD - math.exp(x)), evolution(x, y[1])]

    def known(y):
        df, dtheta = rates(y)
        return Known((y[0] - y[1]) / A, (df - dtheta) / A, y[0], 1.0, y[1])

    return Problem(scene(stiffness, law, normal_stress="constant"), rates, known, 25.0)


def variable(stiffness: float = 0.012, phi: float = 65.0, alpha: float = 0.3) -> Problem:
    """(mu + f)/s = mu + a x + Theta, s = 1 + c f; the slip law, less alpha d(ln s)."""
    c = 1.0 / math.tan(math.radians(phi))

    def rates(y):
        f, theta = y
        s = 1.0 + c * f
        x = ((MU + f) / s - MU - theta) / A
        df = stiffness * (LOAD - math.exp(x))
        return [df, slip_law(x, theta) - alpha * c * df / s]

    def known(y):
        (f, theta), (df, dtheta) = y, rates(y)
        s = 1.0 + c * f
        growth = ((1.0 - MU * c) / s**2 * df - dtheta) / A
        return Known(((MU + f) / s - MU - theta) / A, growth, f, s, theta)

    like = scene(stiffness, "slip", normal_stress="variable", phi=phi, alpha=alpha)
    return Problem(like, rates, known, 25.0)


def damped(stiffness: float = 0.0065, eta: float = 2e-3) -> Problem:
    """f = a x + Theta + eta (V - 1), with x as the unknown; slowness law, beyond the stability of
    steady sliding.
    """

    def rates(y):
        x, theta = y
        v, dtheta = math.exp(x), slowness_law(x, theta)
        return [(stiffness * (LOAD - v) - dtheta) / (A + eta * v), dtheta]

    def known(y):
        x, theta = y
        return Known(x, rates(y)[0], A * x + theta + eta * math.expm1(x), 1.0, theta)

    like = scene(stiffness, "slowness", normal_stress="constant", radiation_damping=eta)
    return Problem(like, rates, known, 30.0)


def two_states(stiffness: float = 0.006, bs=(0.012, 0.006), length: float = 4.0) -> Problem:
    """Theta = Theta_1 + Theta_2, each by the slip law over a length of its own."""

    def rates(y):
        f, one, two = y
        x = (f - one - two) / A
        v = math.exp(x)
        return [
            *(stiffness * (LOAD - v), -v * (one + bs[0] * x)),
            -v / length * (two + bs[1] * x),
        ]

    def known(y):
        f, one, two = y
        df, *states = rates(y)
        return Known((f - one - two) / A, (df - sum(states)) / A, f, 1.0, one + two)

    of_law = {"b1_over_a": bs[0] / A, "b2_over_a": bs[1] / A, "length_ratio": length}
    like = scene(stiffness, "two_slip_states", normal_stress="constant", **of_law)
    return Problem(like, rates, known, 40.0)


def dilatant(stiffness: float = 0.008, opens: float = 0.01, drains: float = 0.7) -> Problem:
    """(mu + f)/(1 - p) = mu + a x + Theta; pores open by eps ln V, and drain; slowness law."""

    def rates(y):
        f, theta, pores, p = y
        x = ((MU + f) / (1.0 - p) - MU - theta) / A
        v = math.exp(x)
        opening = -v * (pores - opens * x)
        return [
            *(stiffness * (LOAD - v), slowness_law(x, theta)),
            *(opening, -drains * p - opening),
        ]

    def known(y):
        (f, theta, _pores, p), (df, dtheta, _opening, dp) = y, rates(y)
        s = 1.0 - p
        growth = (df / s + (MU + f) / s**2 * dp - dtheta) / A
        return Known(((MU + f) / s - MU - theta) / A, growth, f, s, theta)

    fluid = {"fluid": "dilatant", "dilatancy": opens, "drainage": drains}
    return Problem(
        scene(stiffness, "slowness", normal_stress="constant", **fluid), rates, known, 12.0
    )


def with_mass(stiffness: float = 0.0065, eps: float = 0.03, phi: float = 65.0) -> Problem:
    """K eps**2 V dx/dt = f - g, g = (a x + Theta)/(1 - F c), s = 1 + c g; slip law and an effect
    alpha of normal stress. Ruptures are as fast as mass lets them be.
    """
    c, alpha = 1.0 / math.tan(math.radians(phi)), 0.3

    def friction(x, theta):
        excess = A * x + theta
        return excess / (1.0 - (MU + excess) * c)

    def rates(y):
        f, x, theta = y
        v, support = math.exp(x), 1.0 - (MU + A * x + theta) * c
        growth = (f - friction(x, theta)) / (stiffness * eps**2 * v)
        share = alpha * c / support
        dtheta = (slip_law(x, theta) - share * A * growth) / (1.0 + share)
        return [stiffness * (LOAD - v), growth, dtheta]

    def known(y):
        f, x, theta = y
        return Known(x, rates(y)[1], f, 1.0 + c * friction(x, theta), theta)

    of_mass = {"inertia": True, "period": 2.0 * math.pi * eps, "reference_rate": 1.0}
    stress = {"normal_stress": "variable", "phi": phi, "alpha": alpha}
    return Problem(scene(stiffness, "slip", **stress, **of_mass), rates, known, 15.0, rtol=1e-8)


PROBLEMS = {
    "slip": constant("slip", slip_law, 0.0095),
    "slowness": constant("slowness", slowness_law, 0.009),
    "variable normal stress": variable(),
    "radiation damping": damped(),
    "two states": two_states(),
    "dilatant": dilatant(),
    "ruptures with mass": with_mass(),
}


@functools.cache
def theirs(name: str) -> dict[tuple[str, str], list[tuple[float, Known]]]:
    """Times and values of all events by `solve_ivp`, by kind and quantity.

    By an implicit method with mass, where the equations are stiff between ruptures.
    """
    problem = PROBLEMS[name]
    known = problem.known
    asked = {
        ("maximum", "log_rate"): (lambda y: known(y).growth, -1.0),
        ("minimum", "log_rate"): (lambda y: known(y).growth, 1.0),
        ("maximum", "spring"): (lambda y: LOAD - math.exp(known(y).x), -1.0),
        ("minimum", "spring"): (lambda y: LOAD - math.exp(known(y).x), 1.0),
        ("rise", "log_rate"): (lambda y: known(y).x - ABOVE, 1.0),
        ("fall", "log_rate"): (lambda y: known(y).x - BELOW, -1.0),
    }
    events = []
    for of, direction in asked.values():
        events.append(lambda _t, y, of=of: of(y))
        events[-1].direction = direction
    count = 3 if problem.scene.has_mass else problem.scene.states + 1
    ran = solve_ivp(
        lambda _t, y: problem.rates(y), (0.0, problem.until), [0.0] * count,
        "LSODA" if problem.scene.has_mass else "DOP853", events=events, rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    assert ran.success
    return {
        # with mass slip is at rest in its rate at first, which is no event of the motion
        what: [(time, known(y)) for time, y in zip(times, ys, strict=True) if time > 0.0]
        for what, times, ys in zip(asked, ran.t_events, ran.y_events, strict=True)
    }


def ours(problem: Problem, engine: str) -> dict[tuple[str, str], list[tuple[float, Known]]]:
    """The same by an engine."""
    found: dict[tuple[str, str], list[tuple[float, Known]]] = {}
    moving = follow(
        problem.scene, Accuracy(problem.rtol, engine=engine), Meter(10**6, engine=engine), WATCHES,
        clock=True, until=problem.until,
    )  # fmt: skip
    for event in moving:
        if event.watch is not None:
            point, what = event.point, (str(event.kind), event.watch.of)
            told = point.log_rate, math.nan, point.spring, point.normal_stress, point.state
            found.setdefault(what, []).append((event.time, Known(*told)))
    return found


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", PROBLEMS)
def test_events_are_those_of_equations_written_once_more(name, engine):
    """Local errors are a fourteenth of rtol, and a motion of a hundred steps adds them up: by 0.4
    rtol in ln V and in stresses over a, by 9 where ruptures are told at the instants of extrema
    (both measured, at three rtol). An extremum is late by the error of its slope over its
    curvature, of which the flattest here has a tenth: 5 rtol. Twice the largest is allowed; theirs
    err by a thousandth of that.
    """
    problem = PROBLEMS[name]
    known, told = theirs(name), ours(problem, engine)
    allowed = 20.0 * problem.rtol
    assert {what: len(told.get(what, ())) for what in known} == {
        what: len(events) for what, events in known.items()
    }
    assert min(map(len, known.values())) > 0
    for what, events in known.items():
        for (time, point), (our_time, our_point) in zip(events, told[what], strict=True):
            assert our_time == pytest.approx(time, rel=0.0, abs=allowed), what
            assert our_point.x == pytest.approx(point.x, rel=0.0, abs=allowed), what
            for of in ("f", "theta"):
                there, here = getattr(point, of), getattr(our_point, of)
                assert here == pytest.approx(there, rel=0.0, abs=allowed * A), (what, of)
            assert our_point.s == pytest.approx(point.s, rel=0.0, abs=allowed * A), what
