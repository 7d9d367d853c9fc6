"""The equations of motion of a scene, assembled from the effects it calls for and from nothing
else.

Every form rests on one relation between frictional stress, slip rate and state. With g = (tau -
tau_*)/sigma_*, the deviation of frictional resistance, and the state freed of normal stress, Psi =
Theta + alpha ln(sigma/sigma_*),

    a ln(V/V_*) + Psi = strength(g),

where `strength` is g itself at constant normal stress and each effect changes it. Psi is continuous
across any sudden change of stress, and dPsi/dt is the evolution law alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rsfstudy.slider.effects import inclined_driving, inertia, linker_dieterich, radiation_damping
from rsfstudy.slider.laws import Evolution, evolution_of
from rsfstudy.slider.scene import Scene

#: Exponents beyond this occur in trial steps only, which the integrator rejects: a motion ends at
#: ln(V/V_*) = 276 (`slip_rate_unbounded`).
LARGEST_EXPONENT = 300.0

#: Rates beyond this, per inertial time, occur in trial steps only. A motion hands over to the slow
#: manifold long before its slip rate relaxes that fast.
LARGEST_RATE = 1e30

#: Longest step of any clock. A motion at rest would otherwise double its steps until they overflow.
LONGEST_STEP = 1e9

#: Longest step in slip plus load point displacement, over D_c: longer ones may pass a turn of the
#: motion that none of their stages sees. Stationary contact has no turns, up to a few units of ln V
#: before slip takes up again; and normal stress stretches them all.
LONGEST_STRIDE, FEW = 3.0, 10.0

#: ln(V/V_*) below which slip counts as stopped, 10^-290: a motion ends there if nothing loads it.
SLOWEST = -290.0 * math.log(10.0)

#: Where slip is slower than V_0 by this in ln V, contact is stationary: the state then changes by
#: less than exp(-100) of itself over all the slip there is.
STATIONARY = 100.0

#: g -> (strength, d strength/dg, Psi - Theta)
Strength = Callable[[float], tuple[float, float, float]]
State = Sequence[float]


@dataclass(frozen=True)
class Point:
    """What the slider does at one instant, whatever the unknowns it was computed with.

    Attributes
    ----------
    log_rate : float
        ln(V/V_*).
    growth : float
        Its derivative with respect to the clock of the equations.
    spring, friction : float
        Deviations f and g of spring stress and frictional resistance from tau_*, over sigma_*.
    psi : float
        State freed of normal stress.
    imbalance : float
        Steadiness of the state, Theta + b ln(V/V_*): zero on the steady-state line.
    """

    log_rate: float
    growth: float
    spring: float
    friction: float
    psi: float
    imbalance: float


def _any_step(_point: Point) -> float:
    return LONGEST_STEP


@dataclass(frozen=True)
class Equations:
    """A system of ordinary differential equations in its own clock.

    Attributes
    ----------
    regime : str
        Name of the form.
    unknowns : tuple of str
        Names of the unknowns.
    scales : tuple of float
        The change of each unknown that weighs as much as a change of 1 in ln V.
    rate : callable
        ``rate(clock, state) -> list``: derivatives of the unknowns.
    point : callable
        ``point(state, derivatives) -> Point``.
    longest : callable
        ``longest(point)``: longest step of the clock, beyond which an integrator's estimate of its
        local error cannot be trusted.
    """

    regime: str
    unknowns: tuple[str, ...]
    scales: tuple[float, ...]
    rate: Callable[[float, State], list[float]]
    point: Callable[[State, State], Point]
    longest: Callable[[Point], float] = _any_step


def strength_of(scene: Scene) -> Strength:
    """Assemble ``strength`` from the effects on normal stress that the scene calls for."""
    mu_star, cot_phi, alpha = scene.mu_star, scene.cot_phi, scene.alpha

    if scene.normal_stress == "constant":

        def constant(friction: float) -> tuple[float, float, float]:
            return friction, 1.0, 0.0

        return constant

    def inclined(friction: float) -> tuple[float, float, float]:
        ratio = inclined_driving.normal_stress_ratio(friction, cot_phi)
        value, slope = inclined_driving.friction(friction, ratio, mu_star, cot_phi)
        return value, slope, 0.0

    if not alpha:
        return inclined

    def inclined_with_state_effect(friction: float) -> tuple[float, float, float]:
        ratio = inclined_driving.normal_stress_ratio(friction, cot_phi)
        value, slope = inclined_driving.friction(friction, ratio, mu_star, cot_phi)
        shift, shift_slope = linker_dieterich.state_shift(ratio, alpha, cot_phi)
        return value + shift, slope + shift_slope, shift

    return inclined_with_state_effect


def log_rate_at(scene: Scene, spring: float, psi: float) -> float:
    """ln(V/V_*) for a spring stress and state where mass does not act."""
    strength, damping = strength_of(scene), scene.radiation_damping
    if damping > 0.0:
        return radiation_damping.balanced_rate(spring, psi, strength, scene.a, damping)[0]
    return (strength(spring)[0] - psi) / scene.a


def radiated(scene: Scene, log_rate: float) -> float:
    """Part of the spring stress that waves carry away at this slip rate, over sigma_*."""
    return radiation_damping.radiated(log_rate, scene.radiation_damping)


def combined_rate(x: float, load_velocity: float) -> float:
    """Rate (V + V_0)/V_* of slip and load point displacement together, at ln(V/V_*) = x."""
    return math.exp(max(min(x, LARGEST_EXPONENT), SLOWEST)) + load_velocity


def evolving(evolution: Evolution, x: float, load: float, state: float, b: float) -> float:
    """Evolution of the state per unit of slip and load point displacement together:
    ``V/(V + V_0) dTheta/d(delta)``.

    Evolution per unit slip may grow like 1/V as slip slows down, so that the product has a limit,
    that of stationary contact. There it is taken a little faster than slip goes, because its
    factors would underflow and overflow.
    """
    x = max(x, load - STATIONARY)
    return evolution(x, state, b) / (1.0 + math.exp(load - x))


def stride(scene: Scene) -> Callable[[Point], float]:
    """Longest step of a form whose clock is slip plus load point displacement."""
    load, cot_phi = scene.log_load_rate, scene.cot_phi

    def longest(point: Point) -> float:
        stationary = max(1.0, (load - point.log_rate) / FEW)
        normal_stress = max(1.0, 1.0 + cot_phi * point.friction)
        return min(LONGEST_STRIDE * stationary * normal_stress, LONGEST_STEP)

    return longest


def quasi_static(scene: Scene, *, clock: bool) -> Equations:
    """Without mass: two unknowns, f and Psi, and time as a passenger where a `clock` is wanted.

    The independent variable is slip plus load point displacement, ds = (V + V_0) dt, in which every
    rate is of order one from arrest to rupture:

        df/ds = -K tanh[(x - x_0)/2],   dPsi/ds = V/(V + V_0) dPsi/d(delta),   dt/ds = 1/(V + V_0),

    with x = ln(V/V_*) and x_0 = ln(V_0/V_*).
    """
    strength, evolution = strength_of(scene), evolution_of(scene.law)
    a, b, stiffness = scene.a, scene.b, scene.stiffness
    load, load_velocity = scene.log_load_rate, scene.load_velocity

    def rate(_: float, state: State) -> list[float]:
        spring, psi = state[0], state[1]
        value, _slope, shift = strength(spring)
        x = (value - psi) / a
        loading = -stiffness * math.tanh(0.5 * (x - load))
        rates = [loading, evolving(evolution, x, load, psi - shift, b)]
        if clock:
            rates.append(1.0 / combined_rate(x, load_velocity))
        return rates

    def point(state: State, rates: State) -> Point:
        spring, psi = float(state[0]), float(state[1])
        value, slope, shift = strength(spring)
        x = (value - psi) / a
        growth = (slope * float(rates[0]) - float(rates[1])) / a
        return Point(x, growth, spring, spring, psi, psi - shift + b * x)

    unknowns, scales = ("spring", "psi"), (a, a)
    if clock:
        unknowns, scales = (*unknowns, "time"), (*scales, 1.0)  # type: ignore[assignment]
    return Equations("quasi_static", unknowns, scales, rate, point, stride(scene))


def quasi_dynamic(scene: Scene, *, clock: bool) -> Equations:
    """With radiation damping: the quasi-static unknowns and independent variable, but friction and
    radiation share the stress of the spring, ``f = g + eta (V - 1)``.
    """
    strength, evolution = strength_of(scene), evolution_of(scene.law)
    a, b, stiffness, damping = scene.a, scene.b, scene.stiffness, scene.radiation_damping
    load, load_velocity = scene.log_load_rate, scene.load_velocity
    balanced_rate = radiation_damping.balanced_rate

    def rate(_: float, state: State) -> list[float]:
        x, friction = balanced_rate(state[0], state[1], strength, a, damping)
        shift = strength(friction)[2]
        loading = -stiffness * math.tanh(0.5 * (x - load))
        rates = [loading, evolving(evolution, x, load, state[1] - shift, b)]
        if clock:
            rates.append(1.0 / combined_rate(x, load_velocity))
        return rates

    def point(state: State, rates: State) -> Point:
        spring, psi = float(state[0]), float(state[1])
        x, friction = balanced_rate(spring, psi, strength, a, damping)
        _value, slope, shift = strength(friction)
        change = slope * float(rates[0]) - float(rates[1])
        growth = change / (a + slope * damping * math.exp(min(x, LARGEST_EXPONENT)))
        return Point(x, growth, spring, friction, psi, psi - shift + b * x)

    undamped = quasi_static(scene, clock=clock)
    return Equations(
        "quasi_dynamic", undamped.unknowns, undamped.scales, rate, point, stride(scene)
    )


def without_mass(scene: Scene, *, clock: bool) -> Equations:
    """The form of a scene that leaves mass out: quasi-static, or quasi-dynamic where waves damp."""
    assemble = quasi_dynamic if scene.radiation_damping > 0.0 else quasi_static
    return assemble(scene, clock=clock)


def slow_manifold(scene: Scene, *, clock: bool) -> Equations:
    """With mass, as long as it hardly acts: the quasi-static form with inertia's first-order part
    of the stress.
    """
    strength, evolution = strength_of(scene), evolution_of(scene.law)
    a, b, stiffness = scene.a, scene.b, scene.stiffness
    load, load_velocity = scene.log_load_rate, scene.load_velocity
    log_time, load_norm = math.log(scene.inertial_time), scene.load_velocity * scene.inertial_time

    def balance(spring: float, psi: float) -> tuple[float, float, float]:
        """Slip rate on the slow manifold, friction, and the growth of ln V without mass."""
        value, slope, shift = strength(spring)
        x = (value - psi) / a
        loading = -stiffness * math.tanh(0.5 * (x - load))
        growth = (slope * loading - evolving(evolution, x, load, psi - shift, b)) / a
        norm = math.exp(min(x + log_time, LARGEST_EXPONENT / 4.0))
        friction = spring - inertia.inertial_resistance(growth, stiffness, norm, load_norm, most=a)
        return (strength(friction)[0] - psi) / a, friction, growth

    def rate(_: float, state: State) -> list[float]:
        psi = state[1]
        x, friction, _growth = balance(state[0], psi)
        loading = -stiffness * math.tanh(0.5 * (x - load))
        rates = [loading, evolving(evolution, x, load, psi - strength(friction)[2], b)]
        if clock:
            rates.append(1.0 / combined_rate(x, load_velocity))
        return rates

    def point(state: State, _rates: State) -> Point:
        spring, psi = float(state[0]), float(state[1])
        x, friction, growth = balance(spring, psi)
        return Point(x, growth, spring, friction, psi, psi - strength(friction)[2] + b * x)

    massless = quasi_static(scene, clock=clock)
    return Equations(
        "slow_manifold", massless.unknowns, massless.scales, rate, point, stride(scene)
    )


def between_ruptures(scene: Scene, *, clock: bool) -> Equations:
    """The form of a scene where mass, if it has any, hardly acts."""
    assemble = slow_manifold if scene.inertia else without_mass
    return assemble(scene, clock=clock)


def inertial(scene: Scene) -> Equations:
    """With mass, where it acts: three unknowns f, x = ln(V/V_*) and g, in inertial time T/(2 pi).

        df = K (w_0 - w),   dx = (f - g)/(K w),   strength'(g) dg = a dx + w dPsi/d(delta),

    with w = V T/(2 pi D_c). Keeping g as an unknown needs no inverse of `strength`.
    """
    strength, evolution = strength_of(scene), evolution_of(scene.law)
    a, b, stiffness = scene.a, scene.b, scene.stiffness
    load_norm = scene.load_velocity * scene.inertial_time
    log_time = math.log(scene.inertial_time)

    def rate(_: float, state: State) -> list[float]:
        spring, x, friction = state[0], state[1], state[2]
        norm = math.exp(max(min(x + log_time, LARGEST_EXPONENT), -LARGEST_EXPONENT))
        value, slope, shift = strength(friction)
        growth = _bounded(inertia.acceleration(spring, friction, stiffness, norm))
        weakening = norm * evolution(x, value - shift - a * x, b)
        return [
            _bounded(stiffness * (load_norm - norm)),
            growth,
            _bounded((a * growth + weakening) / slope),
        ]

    def point(state: State, rates: State) -> Point:
        spring, x, friction = float(state[0]), float(state[1]), float(state[2])
        value, _slope, shift = strength(friction)
        psi = value - a * x
        return Point(x, float(rates[1]), spring, friction, psi, psi - shift + b * x)

    return Equations("inertial", ("spring", "log_rate", "friction"), (a, 1.0, a), rate, point)


def _bounded(rate: float) -> float:
    return max(min(rate, LARGEST_RATE), -LARGEST_RATE)


def rigid(scene: Scene, log_rate: float) -> Equations:
    """A rigid slider at prescribed ln(V/V_*): one unknown, g, against slip: ``strength'(g) dg =
    dPsi/d(delta)``.
    """
    strength, evolution = strength_of(scene), evolution_of(scene.law)
    a, b = scene.a, scene.b

    def rate(_: float, state: State) -> list[float]:
        value, slope, shift = strength(state[0])
        return [evolution(log_rate, value - shift - a * log_rate, b) / slope]

    def point(state: State, _rates: State) -> Point:
        friction = float(state[0])
        value, _slope, shift = strength(friction)
        psi = value - a * log_rate
        return Point(log_rate, 0.0, friction, friction, psi, psi - shift + b * log_rate)

    return Equations("rigid", ("friction",), (a,), rate, point)
