"""State variables of a scene: evolution, steady states and sums.

The states of the law come first, and their sum acts on friction. The unknowns of a loading that
changes normal stress and of a fluid follow. The last unknown is the pore pressure P, or the stress
that the loading imposes. Most functions of this module return other functions, which are
specialised for the number of states so that Numba can compile them.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parameter_layout import A, B
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene_view import SceneView

#: Values of ln(V/V_*) at which steady states are checked, and the tolerance of the change of a
#: state per unit slip in D_c, divided by a. The tolerance is far above rounding errors.
_CHECKED_LOG_SLIP_RATES, _REST_TOLERANCE = (0.0, -0.5, 0.5), 1e-6


@cache
def evolutions_from_single_state(evolution: Function) -> Function:
    r"""Return the function ``evolutions`` of a law with one state.

    Parameters
    ----------
    evolution : callable
        Function ``evolution(log_slip_rate, state, p)`` of the law.

    Returns
    -------
    callable
        Function that returns the derivative of :math:`\Psi` with respect to slip, multiplied by a
        fraction, as a tuple.
    """

    def evolutions(
        log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
    ) -> Numbers:
        return (fraction * evolution(log_slip_rate, psis[0] - shift, p),)

    return evolutions


def default_steady_state(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
    r"""Compute the default steady state of laws with one state.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    shift : float
        Decrease of the state variable due to stress.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    tuple of float
        State :math:`\Psi`. In steady sliding, :math:`\Theta = -b \ln(V/V_*)`.
    """
    return (shift - p[B] * log_slip_rate,)


def with_auxiliary_evolutions(
    evolutions: Function, auxiliary: Function, law_state_count: int
) -> Function:
    """Append the rates of unknowns to the rates of the states of the law.

    Parameters
    ----------
    evolutions : callable
        Function ``evolutions`` of the law.
    auxiliary : callable
        Function ``auxiliary_rates`` of the fluid or the loading.
    law_state_count : int
        Number of states of the law.

    Returns
    -------
    callable
        Function ``evolutions`` of all states.
    """

    def all_evolutions(
        log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
    ) -> Numbers:
        return (
            *evolutions(log_slip_rate, psis[:law_state_count], shift, fraction, p),
            *auxiliary(log_slip_rate, psis[law_state_count:], fraction, p),
        )

    return all_evolutions


def with_auxiliary_steady_states(steady_states: Function, auxiliary: Function) -> Function:
    """Append the steady unknowns to the steady states of the law.

    Parameters
    ----------
    steady_states : callable
        Function ``steady_states`` of the law.
    auxiliary : callable
        Function ``auxiliary_steady_states`` of the fluid or the loading.

    Returns
    -------
    callable
        Function ``steady_states`` of all states.
    """

    def all_steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
        return (*steady_states(log_slip_rate, shift, p), *auxiliary(log_slip_rate, p))

    return all_steady_states


@cache
def sum_function(count: int) -> Function:
    """Return a function that sums the first elements of a tuple.

    Parameters
    ----------
    count : int
        Number of elements to sum.

    Returns
    -------
    callable
        Function ``(numbers) -> float``.
    """
    return _function_from_expression("numbers", _sum_expression("numbers", count))


@cache
def scaling_function(count: int) -> Function:
    """Return a function that scales the first elements of a tuple.

    Parameters
    ----------
    count : int
        Number of elements to scale.

    Returns
    -------
    callable
        Function ``(numbers, by) -> tuple`` that multiplies each element by ``by``.
    """
    each = (f"by * numbers[{i}], " for i in range(count))
    return _function_from_expression("numbers, by", f"({''.join(each)})")


@cache
def state_step_function(count: int) -> Function:
    """Return a function that advances the states by a step.

    Parameters
    ----------
    count : int
        Number of states.

    Returns
    -------
    callable
        Function ``(psis, changes, by) -> tuple`` that returns ``psis + by * changes`` for each
        state.
    """
    each = (f"psis[{i}] + by * changes[{i}], " for i in range(count))
    return _function_from_expression("psis, changes, by", f"({''.join(each)})")


def _sum_expression(numbers: str, count: int) -> str:
    """Return the source code of a sum of the first elements of a tuple."""
    return " + ".join(f"{numbers}[{i}]" for i in range(count))


def _function_from_expression(arguments: str, value: str) -> Function:
    """Create a function from the source code of its arguments and value.

    The code has no loop, because the compiler cannot iterate over tuples.
    """
    function: Function = eval(f"lambda {arguments}: {value}", {"__name__": __name__})
    return function


def state_contribution_function(count: int, pressure_derivatives: Function | None) -> Function:
    r"""Return a function for the contribution of the states to the slip rate.

    Parameters
    ----------
    count : int
        Number of states of the law.
    pressure_derivatives : callable or None
        Function ``(g, psis, p)`` that returns the derivative of the strength with respect to the
        last unknown as its first value. None if the scene has no such unknown.

    Returns
    -------
    callable
        Function ``(changes, g, psis, p) -> float``. It returns the decrease of :math:`a \ln(V/V_*)`
        due to changes of the states.
    """
    if pressure_derivatives is None:
        return _function_from_expression("changes, g, psis, p", _sum_expression("changes", count))
    state_sum = sum_function(count)

    def contribution_with_pressure(changes: Numbers, g: float, psis: Numbers, p: Numbers) -> float:
        return state_sum(changes) - pressure_derivatives(g, psis, p)[0] * changes[-1]

    return contribution_with_pressure


def states_from_strength_function(count: int) -> Function:
    """Return a function that computes the first state from the strength.

    Parameters
    ----------
    count : int
        Number of states of the law.

    Returns
    -------
    callable
        Function ``(strength, log_slip_rate, others, p) -> tuple`` that returns all states. The
        argument ``others`` contains all states except the first.
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
    """Check the steady states of a user-defined law.

    The states must not change in steady sliding, must add up to zero at :math:`V_*` and must be
    stable at constant slip rate. Otherwise the critical stiffness and the limit cycles would
    contradict each other.

    Parameters
    ----------
    scene : Scene
        Scene with the law.

    Raises
    ------
    InvalidValue
        If the law violates one of the conditions.
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
    """Compute the Jacobian matrix of the evolution by central differences.

    The step is 1e-4 times ``size``.
    """
    step, rows = 1e-4 * size, list[list[float]]()
    for n, psi in enumerate(psis):
        ahead, behind = (
            evolutions(rate, (*psis[:n], psi + off, *psis[n + 1 :]), 0.0, 1.0, p)
            for off in (step, -step)
        )
        rows.append([(x - y) / (2.0 * step) for x, y in zip(ahead, behind, strict=True)])
    return rows
