"""The states of a scene: how they evolve, where they rest, and what they add up to.

Those of the law come first, which act on friction together; behind them stand those of a fluid, or
of a loading that goes on changing normal stress, pore pressure P last.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parameter_layout import A, B
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene_view import SceneView

#: ln(V/V_*) at which a law must rest in its steady states, and the change of a state per slip of
#: D_c, over a, that is still rest: far above rounding.
_CHECKED_LOG_SLIP_RATES, _REST_TOLERANCE = (0.0, -0.5, 0.5), 1e-6


@cache
def evolutions_from_single_state(evolution: Function) -> Function:
    """``dPsi/d(delta)`` times a fraction, of a law of one state."""

    def evolutions(
        log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
    ) -> Numbers:
        return (fraction * evolution(log_slip_rate, psis[0] - shift, p),)

    return evolutions


def default_steady_state(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
    """Psi in steady sliding by most laws, where Theta = -b ln(V/V_*)."""
    return (shift - p[B] * log_slip_rate,)


def with_auxiliary_evolutions(
    evolutions: Function, auxiliary: Function, law_state_count: int
) -> Function:
    """Changes of the states of the law, and of those that end in P behind them."""

    def all_evolutions(
        log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
    ) -> Numbers:
        return (
            *evolutions(log_slip_rate, psis[:law_state_count], shift, fraction, p),
            *auxiliary(log_slip_rate, psis[law_state_count:], fraction, p),
        )

    return all_evolutions


def with_auxiliary_steady_states(steady_states: Function, auxiliary: Function) -> Function:
    """All states in steady sliding: those of the law, and those that end in P."""

    def all_steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
        return (*steady_states(log_slip_rate, shift, p), *auxiliary(log_slip_rate, p))

    return all_steady_states


@cache
def sum_function(count: int) -> Function:
    """Sum of the first so many numbers."""
    return _function_from_expression("numbers", _sum_expression("numbers", count))


@cache
def scaling_function(count: int) -> Function:
    """``(numbers, by) -> tuple``: so many times each of the first so many numbers."""
    each = (f"by * numbers[{i}], " for i in range(count))
    return _function_from_expression("numbers, by", f"({''.join(each)})")


@cache
def state_step_function(count: int) -> Function:
    """``(psis, changes, by) -> tuple``: so many states after so many times their changes."""
    each = (f"psis[{i}] + by * changes[{i}], " for i in range(count))
    return _function_from_expression("psis, changes, by", f"({''.join(each)})")


def _sum_expression(numbers: str, count: int) -> str:
    """Text of the sum of the first so many numbers."""
    return " + ".join(f"{numbers}[{i}]" for i in range(count))


def _function_from_expression(arguments: str, value: str) -> Function:
    """A function without a loop, which a compiler needs for tuples."""
    function: Function = eval(f"lambda {arguments}: {value}", {"__name__": __name__})
    return function


def state_contribution_function(count: int, pressure_derivatives: Function | None) -> Function:
    """``(changes, g, psis, p)``: what changes of so many states of the law take from a ln(V/V_*),
    less what the change of P, or of imposed shear stress, gives, if there is any.
    """
    if pressure_derivatives is None:
        return _function_from_expression("changes, g, psis, p", _sum_expression("changes", count))
    state_sum = sum_function(count)

    def contribution_with_pressure(changes: Numbers, g: float, psis: Numbers, p: Numbers) -> float:
        return state_sum(changes) - pressure_derivatives(g, psis, p)[0] * changes[-1]

    return contribution_with_pressure


def states_from_strength_function(count: int) -> Function:
    """``(strength, log_slip_rate, others, p)``: all states, of which so many are of the law, where
    friction has a strength: the first is what the others leave of it.
    """
    if count == 1:

        def single_law_state(
            strength: float, log_slip_rate: float, others: Numbers, p: Numbers
        ) -> Numbers:
            return (strength - p[A] * log_slip_rate, *others)

        return single_law_state

    sum_of_others = sum_function(count - 1)

    def several_law_states(
        strength: float, log_slip_rate: float, others: Numbers, p: Numbers
    ) -> Numbers:
        return (strength - p[A] * log_slip_rate - sum_of_others(others), *others)

    return several_law_states


def check_steady_states(scene: SceneView) -> None:
    """Raise InvalidValue where the law of a scene still changes in the states that it states, or is
    given, as those of steady sliding, or moves away from them: critical stiffness and cycles would
    contradict each other.
    """
    law, p, still = scene.parts.law, scene.numbers, _REST_TOLERANCE * scene.a
    evolutions = law.evolutions or evolutions_from_single_state(law.evolution)
    for rate in _CHECKED_LOG_SLIP_RATES:
        psis = (law.steady_states or default_steady_state)(rate, 0.0, p)
        change = max(map(abs, evolutions(rate, psis, 0.0, 1.0, p)))
        if not change <= still:
            rule = f"changes by {change:.3g} per D_c in steady sliding at ln(V/V_*) = {rate:g}"
            remedy = "Write steady_states(log_slip_rate, shift, p) for it."
            raise InvalidValue("law", law.name, rule, remedy=remedy)
        if rate == 0.0 and not abs(sum(psis)) <= still:
            rule = f"has states that add up to {sum(psis):.3g} at V_*, where friction is mu_*"
            raise InvalidValue("law", law.name, rule, remedy="Measure them from V_*.")
        away = np.linalg.eigvals(_evolution_jacobian(evolutions, rate, psis, scene.a, p)).real.max()
        if away > _REST_TOLERANCE:
            rule = f"moves away from steady sliding at ln(V/V_*) = {rate:g}, by {away:.3g} per D_c"
            remedy = "See whether its evolution has the sign of dPsi/d(delta)."
            raise InvalidValue("law", law.name, rule, remedy=remedy)


def _evolution_jacobian(
    evolutions: Function, rate: float, psis: Numbers, size: float, p: Numbers
) -> list[list[float]]:
    """Derivatives of the change of each state by each, central differences of 1e-4 of a size."""
    step, rows = 1e-4 * size, list[list[float]]()
    for n, psi in enumerate(psis):
        ahead, behind = (
            evolutions(rate, (*psis[:n], psi + off, *psis[n + 1 :]), 0.0, 1.0, p)
            for off in (step, -step)
        )
        rows.append([(x - y) / (2.0 * step) for x, y in zip(ahead, behind, strict=True)])
    return rows
