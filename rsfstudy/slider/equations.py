"""The equations of motion of a scene, assembled from its parts and ready to be integrated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rsfstudy.slider.assembly import functions, numbers_of_friction
from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Function, Numbers

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

#: The regime of the full equations of a scene with mass, and that of a rigid slider.
IN_RUPTURE, RIGID = "inertial", "rigid"

#: Longest step of any clock. A motion at rest would otherwise double its steps until they overflow.
LONGEST_STEP = 1e9

#: Longest step in slip plus load point displacement, over D_c: longer ones may pass a turn of the
#: motion that none of their stages sees. Stationary contact has no turns, up to a few units of ln V
#: before slip takes up again; and normal stress stretches them all.
LONGEST_STRIDE, FEW = 3.0, 10.0


def _any_step(_point: Point) -> float:
    return LONGEST_STEP


@dataclass(frozen=True)
class Equations:
    """A system of ordinary differential equations in its own clock, on which it does not depend.

    Attributes
    ----------
    regime : str
        Name of the form.
    unknowns : tuple of str
        Names of the unknowns.
    scales : tuple of float
        The change of each unknown that weighs as much as a change of 1 in ln V.
    rate : callable
        ``rate(state, p) -> tuple``: derivatives of the unknowns.
    point : callable
        ``point(state, derivatives, p) -> Point``.
    p : tuple of float
        The numbers of the scene.
    longest : callable
        ``longest(point)``: longest step of the clock, beyond which an integrator's estimate of its
        local error cannot be trusted.
    """

    regime: str
    unknowns: tuple[str, ...]
    scales: tuple[float, ...]
    rate: Function
    point: Function
    p: Numbers
    longest: Callable[[Point], float] = _any_step

    def rates(self, state: Numbers) -> Numbers:
        """Derivatives of the unknowns."""
        changes: Numbers = self.rate(state, self.p)
        return changes

    def at(self, state: Numbers) -> Point:
        """What the slider does."""
        now: Point = self.point(state, self.rate(state, self.p), self.p)
        return now


def between_ruptures(scene: Scene, *, clock: bool) -> Equations:
    """The form of a scene where mass, if it has any, hardly acts: unknowns f and Psi (or the states
    of a law that has several), and time as a passenger where a `clock` is wanted.
    """
    return _slow(scene, scene.dynamics, clock=clock)


def without_mass(scene: Scene, *, clock: bool) -> Equations:
    """The same, with mass left out altogether."""
    if scene.dynamics.rupture_rate is None:
        return between_ruptures(scene, clock=clock)
    return _slow(scene, QuasiStatic(), clock=clock)


def _slow(scene: Scene, dynamics: Dynamics, *, clock: bool) -> Equations:
    forms, count = functions(scene, dynamics), scene.parts.law.states
    unknowns: tuple[str, ...] = ("spring", *_states(0, count))
    scales, rate = (scene.a,) * len(unknowns), forms["rate"]
    if clock:
        unknowns, scales, rate = (*unknowns, "time"), (*scales, 1.0), forms["rate_with_time"]
    return Equations(
        dynamics.regime, unknowns, scales, rate, forms["point"], scene.numbers, stride(scene)
    )


def _states(first: int, count: int) -> list[str]:
    """Names of states from one on."""
    return ["psi"] if count == 1 > first else [f"psi_{i + 1}" for i in range(first, count)]


def in_rupture(scene: Scene) -> Equations:
    """The full equations of a scene with mass, in inertial time T/(2 pi): f, ln(V/V_*) and g, and
    the states but the first.
    """
    forms, a = functions(scene), scene.a
    rate, point = forms["rupture_rate"], forms["rupture_point"]
    others = _states(1, scene.parts.law.states)
    unknowns, scales = ("spring", "log_rate", "friction", *others), (a, 1.0, a, *[a] * len(others))
    return Equations(IN_RUPTURE, unknowns, scales, rate, point, scene.numbers)


def rigid(scene: Scene, log_rate: float) -> Equations:
    """A rigid slider at prescribed ln(V/V_*), against slip: g, and the states but the first."""
    forms, p = functions(scene), (*scene.numbers, log_rate)
    unknowns = ("friction", *_states(1, scene.parts.law.states))
    scales = (scene.a,) * len(unknowns)
    return Equations(RIGID, unknowns, scales, forms["rigid_rate"], forms["rigid_point"], p)


def stride(scene: Scene) -> Callable[[Point], float]:
    """Longest step of a form whose clock is slip plus load point displacement."""
    load = scene.log_load_rate

    def longest(point: Point) -> float:
        stationary = max(1.0, (load - point.log_rate) / FEW)
        stretched = max(1.0, point.normal_stress)
        return min(LONGEST_STRIDE * stationary * stretched, LONGEST_STEP)

    return longest


def relation_of(scene: Scene) -> Callable[[float], tuple[float, float, float, float]]:
    """The friction relation of a scene: g -> (strength, slope, shift, slope of the shift)."""
    relation, p = functions(scene)["strength"], numbers_of_friction(scene)

    def at(friction: float) -> tuple[float, float, float, float]:
        values: tuple[float, float, float, float] = relation(friction, p)
        return values

    return at


def normal_stress_at(scene: Scene, friction: float) -> float:
    """Normal stress over sigma_* under a deviation of frictional stress."""
    return 1.0 + float(functions(scene)["normal_stress"](friction, numbers_of_friction(scene))[0])


def log_rate_at(scene: Scene, spring: float, psi: float) -> float:
    """ln(V/V_*) for a spring stress and state (the sum, of several) where mass does not act."""
    massless = scene.dynamics if scene.dynamics.rupture_rate is None else QuasiStatic()
    return float(functions(scene, massless)["balance"](spring, (psi,), scene.numbers)[0])


def evolution_of(scene: Scene) -> Callable[[float, float], float]:
    """The law of a scene with one state: (ln(V/V_*), Theta) -> dTheta per unit slip."""
    evolutions, p = functions(scene)["evolutions"], numbers_of_friction(scene)

    def at(log_rate: float, state: float) -> float:
        return float(evolutions(log_rate, (state,), 0.0, 1.0, p)[0])

    return at


def evolutions_of(scene: Scene) -> Callable[[float, Numbers, float], Numbers]:
    """The law of a scene: (ln(V/V_*), Psi, shift) -> change of each state per unit slip."""
    evolutions, p = functions(scene)["evolutions"], numbers_of_friction(scene)

    def at(log_rate: float, psis: Numbers, shift: float) -> Numbers:
        changes: Numbers = evolutions(log_rate, psis, shift, 1.0, p)
        return changes

    return at


def resting_of(scene: Scene, log_rate: float, shift: float) -> Numbers:
    """The states of steady sliding at ln(V/V_*), of which stress has taken `shift`."""
    psis: Numbers = functions(scene)["resting"](log_rate, shift, numbers_of_friction(scene))
    return psis
