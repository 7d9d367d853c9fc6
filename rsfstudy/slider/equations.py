"""Equations of one scene as an integrator takes them: unknowns, scales, rates and points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rsfstudy.slider.derived import once
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.parts import Function, Numbers, Scene
from rsfstudy.slider.point import Point
from rsfstudy.slider.system import Form, System, functions

#: The regime of the full equations of a scene with mass, and that of a rigid slider.
IN_RUPTURE, RIGID = "inertial", "rigid"

#: Longest step of any clock. A motion at rest would otherwise double its steps until they overflow.
LONGEST_STEP = 1e9

#: Longest step along the path, as far as slip of D_c is: longer ones may pass a turn of the motion
#: that none of their stages sees. Stationary contact has no turns, up to a few units of ln V before
#: slip takes up again; and normal stress stretches them all.
LONGEST_ALONG_PATH, FEW = 3.0, 10.0


def longest_step(log_slip_rate: float, normal_stress: float, log_load_rate: float) -> float:
    """Longest step of a form whose clock is length along the path."""
    stationary = max(1.0, (log_load_rate - log_slip_rate) / FEW)
    return min(LONGEST_ALONG_PATH * stationary * max(1.0, normal_stress), LONGEST_STEP)


class Equations(NamedTuple):
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
    states : int
        How many states the scene has.
    balance : callable or None
        ``balance(spring, psis, p)``: ln(V/V_*), frictional stress and the state lost to stress;
        between ruptures only.
    """

    regime: str
    unknowns: tuple[str, ...]
    scales: tuple[float, ...]
    rate: Function
    point: Function
    p: Numbers
    states: int = 1
    balance: Function | None = None

    def rates(self, state: Numbers) -> Numbers:
        """Derivatives of the unknowns."""
        return self.rate(state, self.p)

    @property
    def is_rigid(self) -> bool:
        """True if slip is the clock."""
        return self.regime == RIGID

    def at(self, state: Numbers) -> Point:
        """The point of the motion at a state."""
        return self.point(state, self.rate(state, self.p), self.p)


@once
def between_ruptures(scene: Scene, *, clock: bool) -> Equations:
    """The form of a scene where mass, if it has any, hardly acts: unknowns f and Psi (or the states
    of a law that has several), and time as a passenger where a `clock` is wanted.
    """
    return _slow(scene, scene.functions, scene.dynamics.regime, clock=clock)


@once
def without_mass(scene: Scene, *, clock: bool) -> Equations:
    """The form between ruptures with mass left out altogether."""
    if scene.dynamics.rupture_rate is None:
        return between_ruptures(scene, clock=clock)
    return _slow(scene, functions(scene, QuasiStatic()), QuasiStatic.regime, clock=clock)


def _slow(scene: Scene, forms: System, regime: str, *, clock: bool) -> Equations:
    unknowns, form = ("spring_stress", *_states(scene)), forms.between_ruptures
    unknowns, scales, rate = _of_form(form, unknowns, (scene.a,) * len(unknowns), clock=clock)
    p, states = scene.numbers, scene.states
    return Equations(regime, unknowns, scales, rate, form.point, p, states, forms.balance)


def _of_form(
    form: Form, unknowns: tuple[str, ...], scales: Numbers, *, clock: bool
) -> tuple[tuple[str, ...], Numbers, Function]:
    """Unknowns, scales and rate of a form; with time, of its clock, as a passenger."""
    if not clock:
        return unknowns, scales, form.rate
    return (*unknowns, "time"), (*scales, 1.0), form.rate_with_time


def _states(scene: Scene) -> tuple[str, ...]:
    """Names of the states."""
    count = scene.parts.law.states
    of_law = ["psi"] if count == 1 else [f"psi_{i + 1}" for i in range(count)]
    return (*of_law, *(unknown.name for unknown in scene.pressure_source.unknowns))


@once
def in_rupture(scene: Scene, *, clock: bool = False) -> Equations:
    """The full equations of a scene with mass: f, ln(V/V_*) and g, and the states but the first;
    and inertial time, in T/(2 pi), as a passenger where a `clock` is wanted.
    """
    a, form, others = scene.a, _full(scene), _states(scene)[1:]
    unknowns = ("spring_stress", "log_slip_rate", "friction", *others)
    scales, p = (a, 1.0, a, *[a] * len(others)), scene.numbers
    unknowns, scales, rate = _of_form(form, unknowns, scales, clock=clock)
    return Equations(IN_RUPTURE, unknowns, scales, rate, form.point, p, scene.states)


def _full(scene: Scene) -> Form:
    full = scene.functions.in_rupture
    if full is None:
        raise TypeError(f"{scene.dynamics.name} has no equations of ruptures")
    return full


def by_displacement(scene: Scene) -> Equations:
    """The form between ruptures against slip plus load point displacement: differences of its rates
    are linear in departures farther from steady sliding than those along the path.
    """
    along = between_ruptures(scene, clock=False)
    return along._replace(rate=scene.functions.between_ruptures.against_clock)


def by_inertial_time(scene: Scene) -> Equations:
    """The full equations in inertial time T/(2 pi)."""
    return in_rupture(scene)._replace(rate=_full(scene).against_clock)


def rigid(scene: Scene, log_slip_rate: float) -> Equations:
    """A rigid slider at prescribed ln(V/V_*), against slip: g, and the states but the first."""
    forms, unknowns = scene.functions, ("friction", *_states(scene)[1:])
    scales, p = (scene.a,) * len(unknowns), (*scene.numbers, log_slip_rate)
    return Equations(RIGID, unknowns, scales, forms.rigid_rate, forms.rigid_point, p, scene.states)


def relation_of(
    scene: Scene, psis: Numbers = ()
) -> Callable[[float], tuple[float, float, float, float]]:
    """The friction relation of a scene: g -> (strength, slope, shift, slope of the shift); at the
    pore pressure of steady sliding, unless states are given.
    """
    strength, p = scene.functions.friction.strength, scene.numbers_of_friction
    known = psis or (0.0,) * scene.states
    return lambda friction: strength(friction, known, p)


def normal_stress_at(scene: Scene, friction: float, psis: Numbers = ()) -> float:
    """Effective normal stress over sigma_* under a deviation of frictional stress, at steady
    sliding unless states are given.
    """
    at = psis or (0.0,) * scene.states
    stress = scene.functions.friction.effective_stress(friction, at, scene.numbers_of_friction)
    return 1.0 + float(stress[0])


def log_slip_rate_at(scene: Scene, spring_stress: float, psi: float) -> float:
    """ln(V/V_*) for a spring stress and state (the sum, of several) where mass does not act, and
    there is no pore pressure.
    """
    forms = functions(scene, QuasiStatic()) if scene.has_mass else scene.functions
    psis = (psi, *(0.0,) * (scene.states - 1))
    return float(forms.balance(spring_stress, psis, scene.numbers)[0])


def evolution_of(scene: Scene) -> Callable[[float, float], float]:
    """The law of a scene with one state: (ln(V/V_*), Theta) -> dTheta per unit slip."""
    evolve = evolutions_of(scene)
    return lambda log_slip_rate, state: evolve(log_slip_rate, (state,), 0.0)[0]


def evolutions_of(scene: Scene) -> Callable[[float, Numbers, float], Numbers]:
    """The law of a scene: (ln(V/V_*), Psi, shift) -> change of each state per unit slip."""
    evolutions, p = scene.functions.friction.evolutions, scene.numbers_of_friction
    return lambda log_slip_rate, psis, shift: evolutions(log_slip_rate, psis, shift, 1.0, p)


def steady_states_of(scene: Scene, log_slip_rate: float, shift: float) -> Numbers:
    """The states of steady sliding at ln(V/V_*), of which stress has taken `shift`."""
    p = scene.numbers_of_friction
    return scene.functions.friction.steady_states(log_slip_rate, shift, p)
