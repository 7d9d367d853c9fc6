"""Independent implementation of the motions in the time domain.

The reference solutions are computed with SciPy's ``solve_ivp``.

The unknowns are the slip rate and the state variables, without transformations. The module
uses the fields of a scene but no other code of the package.

With frictional stress g, imposed normal stress e, c = cot(phi), pore pressure p and stress
dependence N, the equations are

    (mu_* + g) = s mu,  mu = mu_* + a ln V + Theta,  s = 1 + e(t) + c g - p
    df = K (V_0 - V) dt
    f = g + eta (V - 1), or K eps**2 V d(ln V) = (f - g) dt with inertia
    dTheta = V b h(u) dt - (alpha ds + N dg)/s,  u = Theta/b + ln V
    dphi = V (dilatancy ln V - phi) dt/porosity_length,  dp = -drainage p dt - dphi

With the temperature rise Y, the friction coefficient and u contain further terms, and heating
raises the pressure:

    mu = mu_* + a (ln V + q_a L) + Theta,  u = Theta/b + ln V + q_b L,  L = 1/(1 + Y) - 1
    dY = H [(mu_* + g) V - mu_*] dt - C Y dt,  dp = ... + pressurisation dY

With flash heating, V b h(u) is V {f_ss - mu_* - a ln V - Theta}.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rsfstudy import Scene

#: h(u) of d(Theta)/d(slip) = b h(u) for each law. The second argument is the exponent of the law
#: ``family``.
EVOLUTION_FUNCTIONS: Mapping[str, Callable[[float, float], float]] = {
    "slip": lambda u, _eps: -u,
    "slowness": lambda u, _eps: math.expm1(-u),
    "perrin_rice_zheng": lambda u, _eps: -math.sinh(u),
    "family": lambda u, eps: math.expm1(-eps * u) / eps,
    "flash_heating": lambda u, _eps: -u,
}
#: Fields of scenes with heat, which are 0 in other scenes.
HEAT_FIELDS = ("heating", "cooling", "direct_activation", "evolution_activation", "pressurisation")

#: Upper bound of ln V, because trial steps of the solver can overflow.
MAX_LOG_SLIP_RATE = 300.0


class InstantState(NamedTuple):
    """State of a slider at one time.

    The attributes are V with its sign, ln |V| and its rate, spring stress, frictional
    stress, normal stress, and the state variable (the sum of all state variables if there
    are several).
    """

    velocity: float
    log_slip_rate: float
    log_slip_rate_derivative: float
    spring_stress: float
    frictional_stress: float
    normal_stress: float
    theta: float


class TimeDomainMotion:
    """Motion of a scene in time.

    The unknowns are f, the state variables, porosity and pore pressure of a fault with a
    fluid, the temperature rise if the temperature changes, and ln V if the scene has
    radiation damping or inertia.

    Parameters
    ----------
    scene : Scene
        Scene whose law is in ``EVOLUTION_FUNCTIONS``, or has two states that evolve by such a law.
    velocity_ramp : float, optional
        Increase of the load velocity over a time of 4. This ramp is the limit of many stairs.
    """

    def __init__(self, scene: Scene, velocity_ramp: float = 0.0) -> None:
        of = dict.fromkeys(HEAT_FIELDS, 0.0)
        of |= {name: value or 0.0 for name, value in scene.as_dict().items()}
        if scene.load_velocity_ratio is None and not of["displacement_step"]:
            of["load_velocity_ratio"] = 1.0
        self.of, self.mass, self.velocity_ramp = of, bool(of["inertia"]), velocity_ramp
        self.a, self.mu, self.stiffness = scene.a, scene.mu_star, scene.stiffness
        self.cot = 1.0 / math.tan(math.radians(of["phi"])) if of["phi"] else 0.0
        self.alpha, self.damping = of["alpha"], of["radiation_damping"]
        self.eps = of["period"] * of["reference_rate"] / (2.0 * math.pi)
        name = scene.law
        self.bs, self.lengths = [of["b_over_a"] * self.a], [1.0]
        if name.startswith("two_"):
            name = name.split("_")[1]
            self.bs = [of["b1_over_a"] * self.a, of["b2_over_a"] * self.a]
            self.lengths = [1.0, of["length_ratio"]]
        self.h = EVOLUTION_FUNCTIONS[name]
        self.wet, self.has_rate = scene.fluid != "drained", self.mass or self.damping > 0.0
        self.hot = scene.temperature != "isothermal"
        stiff = self.has_rate or bool(of["regularised"])
        self.method = "LSODA" if stiff else "DOP853"
        # This module does not implement the partition of stress effects among several states.
        assert len(self.bs) == 1 or not (self.alpha or of["stress_dependence"])

    # ---- loading ---------------------------------------------------------------------------------

    @property
    def loading_breaks(self) -> list[float]:
        """Times at which the loading is not smooth."""
        found = [self.of["ramp_duration"]] if self.of["normal_stress_ramp"] else []
        found += [self.of["hold_time"]] if self.of["hold_time"] else []
        return found + ([4.0] if self.velocity_ramp else [])

    def loading_at(self, time: float, middle: float) -> tuple[float, float, float]:
        """Return the load velocity, the normal stress change and its rate.

        ``middle`` is a time between the two breaks that enclose ``time``.
        """
        of, velocity = self.of, self.of["load_velocity_ratio"]
        e, change = of["normal_stress_step"], 0.0
        if of["hold_time"]:
            velocity = 0.0 if middle < of["hold_time"] else 1.0
        if self.velocity_ramp:
            velocity = 1.0 + self.velocity_ramp * (time / 4.0 if middle < 4.0 else 1.0)
        if of["normal_stress_ramp"]:
            lasts, over = of["ramp_duration"], middle > of["ramp_duration"]
            change = 0.0 if over else of["normal_stress_ramp"] / lasts
            e = of["normal_stress_ramp"] * (1.0 if over else time / lasts)
        if of["oscillation_amplitude"]:
            often = 2.0 * math.pi / of["oscillation_period"]
            e = of["oscillation_amplitude"] * math.sin(often * time)
            change = of["oscillation_amplitude"] * often * math.cos(often * time)
        return velocity, e, change

    def initial_unknowns(self) -> list[float]:
        """Return the unknowns after the steps at time 0.

        The state variable responds to the step of normal stress.
        """
        of, (_velocity, e, _change) = self.of, self.loading_at(0.0, 0.0)
        f, theta = of["initial_stress"], of["initial_state"]
        before = 1.0 + self.cot * f
        x = ((self.mu + f) / before - self.mu - theta) / self.a
        f += self.stiffness * of["displacement_step"]

        def missing(x: float) -> float:
            g = f - self.damping * math.expm1(x)
            s = 1.0 + e + self.cot * g
            if s <= 0.0:  # The slip rate is too large.
                return -1.0
            state = theta - self.alpha * math.log(s / before)
            return self.mu + g - s * (self.mu + self.a * x + state)

        if self.has_rate and not self.mass:
            x = brentq(missing, -60.0, 60.0, xtol=1e-15)
        s = 1.0 + e + self.cot * (f - self.damping * math.expm1(x) * (not self.mass))
        states = [theta - self.alpha * math.log(s / before), *[0.0] * (len(self.bs) - 1)]
        others = [0.0, 0.0] * self.wet + [0.0] * self.hot
        return [f, *states, *others, *[x][: self.has_rate]]

    # ---- equations -------------------------------------------------------------------------------

    def offset_of_steady_state(self, x: float) -> float:
        """Return the steady state of flash heating plus b ln V, and otherwise 0."""
        if self.of["law"] != "flash_heating":
            return 0.0
        power, ratio = self.of["weakening_exponent"], self.of["weakening_velocity_ratio"]
        low_velocity = self.mu + (self.a - self.bs[0]) * x
        fall = (1.0 + ratio**-power) / (1.0 + math.exp(min(power * (x - math.log(ratio)), 600.0)))
        weakened = self.of["weakened_friction"]
        return weakened + (low_velocity - weakened) * fall ** (1.0 / power) - low_velocity

    def rates_and_state(
        self, time: float, y: Sequence[float], middle: float
    ) -> tuple[list[float], InstantState]:
        """Return the rates of the unknowns, and the state of the slider."""
        of, a, mu, cot, count = self.of, self.a, self.mu, self.cot, len(self.bs)
        velocity, e, change = self.loading_at(time, middle)
        f, states, theta = y[0], y[1 : 1 + count], sum(y[1 : 1 + count])
        pores, pressure = y[1 + count : 3 + count] if self.wet else (0.0, 0.0)
        warm = y[1 + count + 2 * self.wet] if self.hot else 0.0
        colder, direct = -warm / (1.0 + warm), a * of["direct_activation"]
        if self.has_rate:
            x = y[-1]
            v = math.exp(min(x, MAX_LOG_SLIP_RATE))
        elif of["regularised"]:
            # V = 2 exp[-(mu_* + Theta)/a] sinh(mu/a)
            coefficient = (mu + f) / (1.0 + e + cot * f) / a
            held = abs(coefficient) - (mu + theta) / a
            v = math.copysign(-math.exp(held) * math.expm1(-2.0 * abs(coefficient)), coefficient)
            x = math.log(max(abs(v), 1e-300))
        else:
            x = (mu + f) / (1.0 + e + cot * f - pressure) - mu - theta - direct * colder
            x /= a
            v = math.exp(min(x, MAX_LOG_SLIP_RATE))
        friction = mu + a * x + theta + direct * colder
        g = f - self.damping * (v - 1.0)
        if self.mass:
            g = ((1.0 + e - pressure) * friction - mu) / (1.0 - cot * friction)
        s = 1.0 + e + cot * g - pressure
        coefficient = (mu + g) / s
        activated = of["evolution_activation"] * colder
        activated -= self.offset_of_steady_state(x) / self.bs[0]
        evolving = [
            abs(v) * b / length * self.h(state / b + x + activated, of["law_exponent"])
            for b, length, state in zip(self.bs, self.lengths, states, strict=True)
        ]
        warming = of["heating"] * ((mu + g) * v - mu) - of["cooling"] * warm
        opening = v * (of["dilatancy"] * x - pores) / of["porosity_length"] if self.wet else 0.0
        draining = -of["drainage"] * pressure - opening if self.wet else 0.0
        draining += of["pressurisation"] * warming
        df, nagata = self.stiffness * (velocity - v), of["stress_dependence"]
        # dg [1 + N - c (mu - alpha)] = s (a dx + a q_a dL + evolution) + (mu - alpha)(de - dp)
        yields = 1.0 + nagata - cot * (coefficient - self.alpha)
        softening = -direct * warming / (1.0 + warm) ** 2
        pushed = s * (sum(evolving) + softening) + (coefficient - self.alpha) * (change - draining)
        if self.mass:
            dx = (f - g) / (self.stiffness * self.eps**2 * v)
            dg = (s * a * dx + pushed) / yields
        else:
            dx = (df * yields - pushed) / (s * a + self.damping * v * yields)
            dg = df - self.damping * v * dx
        ds = change - draining + cot * dg
        evolving[0] -= (self.alpha * ds + nagata * dg) / s
        fluid = [opening, draining] if self.wet else []
        fluid += [warming] if self.hot else []
        rates = [df, *evolving, *fluid, *([dx] if self.has_rate else [])]
        return rates, InstantState(v, x, dx, f, g, s, theta)

    def solve(
        self,
        times: Sequence[float],
        events: Sequence[Callable[[InstantState], float]] = (),
        directions: Sequence[float] = (),
    ) -> tuple[list[InstantState], list[list[tuple[float, InstantState]]]]:
        """Integrate the motion to the last of the increasing times.

        The function returns the states at these times, and the zero crossings of each event
        function in its direction. Zero crossings at time 0 are omitted.
        """
        rows, told, y = [], [[] for _ in events], self.initial_unknowns()
        cuts = [0.0, *(cut for cut in self.loading_breaks if cut < times[-1]), times[-1]]
        for begin, end in itertools.pairwise(cuts):
            middle = 0.5 * (begin + end)

            def known(time, y, middle=middle):
                return self.rates_and_state(time, y, middle)[1]

            asked = []
            for event, direction in zip(events, directions, strict=True):
                asked.append(lambda t, y, event=event, known=known: event(known(t, y)))
                asked[-1].direction = direction
            within = [t for t in times if begin < t <= end or t == begin == 0.0]
            ran = solve_ivp(
                lambda t, y, middle=middle: self.rates_and_state(t, y, middle)[0], (begin, end), y,
                self.method, t_eval=sorted({*within, end}),
                events=asked or None, rtol=1e-12, atol=1e-14,
            )  # fmt: skip
            assert ran.success
            y = ran.y[:, -1]
            rows += [known(t, at) for t, at in zip(within, ran.y.T, strict=False)]
            found = zip(told, ran.t_events or (), ran.y_events or (), strict=False)
            for of_event, ts, ys in found:
                of_event += [(t, known(t, at)) for t, at in zip(ts, ys, strict=True) if t > 0.0]
        return rows, told


def rows_to_columns(rows: Sequence[InstantState]) -> dict[str, np.ndarray]:
    """Return the states as a dictionary of arrays."""
    return dict(zip(InstantState._fields, np.array(rows).T, strict=True))
