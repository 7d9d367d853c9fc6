"""Functions that compute the evolution, the steady states and the sums of state variables.

The tuple of states starts with the states of the law. Friction depends on the sum of these states.
If the loading changes normal stress, the unknowns of the loading follow the states of the law. The
unknowns of a fluid come last. The last unknown is the pore pressure P, or the stress that the
loading imposes. Most functions of this module return other functions. The returned functions are
specialised for the number of states, so that Numba can compile them.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parameter_layout import A, B
from rsfstudy.slider.parts import FloatTuple, NumericFunction
from rsfstudy.slider.scene_view import SceneView

if TYPE_CHECKING:
    from rsfstudy.slider.laws import LawBase

#: Values of ln(V/V_*) at which steady states are checked. The second constant is the largest
#: accepted change of a steady state per slip distance of D_c, divided by a. This tolerance is far
#: above rounding errors.
_CHECKED_LOG_SLIP_RATES, _REST_TOLERANCE = (0.0, -0.5, 0.5), 1e-6


@cache
def wrap_single_state_evolution_for_tuples(
    single_state_evolution: NumericFunction,
) -> NumericFunction:
    r"""Convert the evolution function of a law with one state to a function of tuples.

    Parameters
    ----------
    single_state_evolution : callable
        Function ``single_state_evolution(log_slip_rate, state, p)`` of the law.

    Returns
    -------
    callable
        Function ``evolutions(log_slip_rate, psis, shift, fraction, p)`` that returns the derivative
        of :math:`\Psi` with respect to slip, multiplied by ``fraction``, as a tuple.
    """

    def evolutions(
        log_slip_rate: float, psis: FloatTuple, shift: float, fraction: float, p: FloatTuple
    ) -> FloatTuple:
        return (fraction * single_state_evolution(log_slip_rate, psis[0] - shift, p),)

    return evolutions


def compute_default_steady_state(
    log_slip_rate: float, stress_induced_state_shift: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the default steady state of laws with one state.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    stress_induced_state_shift : float
        Decrease in the state variable due to stress.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    tuple of float
        State :math:`\Psi`. In steady sliding, :math:`\Theta = -b \ln(V/V_*)`.
    """
    return (stress_induced_state_shift - p[B] * log_slip_rate,)


def get_evolution_and_steady_state_functions(
    law: LawBase,
) -> tuple[NumericFunction, NumericFunction]:
    """Return the evolution function and the steady-state function of a law.

    Parameters
    ----------
    law : LawBase
        Law. A law with one state may define only ``evolution``.

    Returns
    -------
    evolutions, steady_states : callable
        Functions of the tuple of states, as described in ``LawBase``.
    """
    return (
        law.evolutions or wrap_single_state_evolution_for_tuples(law.evolution),
        law.steady_states or compute_default_steady_state,
    )


def return_isothermal_state_variable(
    state_sum_minus_shift: float, psis: FloatTuple, p: FloatTuple
) -> float:
    r"""Return the state variable at constant temperature.

    Parameters
    ----------
    state_sum_minus_shift : float
        Sum of the states of the law minus the shift, :math:`\sum_i \Psi_i - \mathrm{shift}`.
    psis : tuple of float
        States of the scene. This argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    float
        State variable :math:`\Theta`, which is equal to ``state_sum_minus_shift``.
    """
    return state_sum_minus_shift


@cache
def combine_law_and_auxiliary_rates(
    law_state_rates: NumericFunction, auxiliary_rates: NumericFunction, law_state_count: int
) -> NumericFunction:
    """Combine the evolution functions of the law and of the other unknowns.

    Parameters
    ----------
    law_state_rates : callable
        Function ``evolutions`` of the law.
    auxiliary_rates : callable
        Function ``auxiliary_rates`` of the fluid or the loading.
    law_state_count : int
        Number of states of the law.

    Returns
    -------
    callable
        Function that has the arguments of ``evolutions`` and returns the changes of all states.
    """

    def all_evolutions(
        log_slip_rate: float, psis: FloatTuple, shift: float, fraction: float, p: FloatTuple
    ) -> FloatTuple:
        return (
            *law_state_rates(log_slip_rate, psis[:law_state_count], shift, fraction, p),
            *auxiliary_rates(log_slip_rate, psis[law_state_count:], fraction, p),
        )

    return all_evolutions


@cache
def combine_law_and_auxiliary_steady_states(
    law_steady_states: NumericFunction, auxiliary_steady_states: NumericFunction
) -> NumericFunction:
    """Combine the steady-state functions of the law and of the other unknowns.

    Parameters
    ----------
    law_steady_states : callable
        Function ``steady_states`` of the law.
    auxiliary_steady_states : callable
        Function ``auxiliary_steady_states`` of the fluid or the loading.

    Returns
    -------
    callable
        Function that has the arguments of ``steady_states`` and returns all steady states.
    """

    def all_steady_states(log_slip_rate: float, shift: float, p: FloatTuple) -> FloatTuple:
        return (
            *law_steady_states(log_slip_rate, shift, p),
            *auxiliary_steady_states(log_slip_rate, p),
        )

    return all_steady_states


@cache
def build_tuple_sum_function(term_count: int) -> NumericFunction:
    """Return a function that sums the first elements of a tuple.

    Parameters
    ----------
    term_count : int
        Number of elements to sum.

    Returns
    -------
    callable
        Function ``(numbers) -> float``.
    """
    return _build_function_from_expression(
        "numbers", _write_tuple_sum_expression("numbers", term_count)
    )


@cache
def build_tuple_scaling_function(component_count: int) -> NumericFunction:
    """Return a function that multiplies the first elements of a tuple by a number.

    Parameters
    ----------
    component_count : int
        Number of elements to scale.

    Returns
    -------
    callable
        Function ``(numbers, by) -> tuple`` that multiplies each element by ``by``.
    """
    each = (f"by * numbers[{i}], " for i in range(component_count))
    return _build_function_from_expression("numbers, by", f"({''.join(each)})")


@cache
def build_function_adding_state_changes(state_count: int) -> NumericFunction:
    """Return a function that multiplies the state changes by a number and adds them to the states.

    Parameters
    ----------
    state_count : int
        Number of states.

    Returns
    -------
    callable
        Function ``(psis, changes, by) -> tuple`` that returns ``psis + by * changes`` for each
        state.
    """
    each = (f"psis[{i}] + by * changes[{i}], " for i in range(state_count))
    return _build_function_from_expression("psis, changes, by", f"({''.join(each)})")


def _write_tuple_sum_expression(tuple_name: str, term_count: int) -> str:
    """Return the source code of a sum of the first elements of a tuple."""
    return " + ".join(f"{tuple_name}[{i}]" for i in range(term_count))


def _build_function_from_expression(argument_names: str, expression: str) -> NumericFunction:
    """Create a function from strings with its argument names and its return expression.

    The source code contains no loop, because the compiler cannot iterate over tuples.
    """
    function: NumericFunction = eval(
        f"lambda {argument_names}: {expression}", {"__name__": __name__}
    )
    return function


@cache
def build_state_contribution_function(
    law_state_count: int, pressure_derivatives: NumericFunction | None
) -> NumericFunction:
    r"""Return a function that computes the contribution of the states to the slip rate.

    Parameters
    ----------
    law_state_count : int
        Number of states of the law.
    pressure_derivatives : callable or None
        Function ``(g, psis, p)`` that returns the derivative of the strength with respect to the
        last unknown as its first value. The value is None if the scene has only the states of the
        law.

    Returns
    -------
    callable
        Function ``(changes, g, psis, p) -> float``. The function returns the decrease of :math:`a
        \ln(V/V_*)` due to changes of the states.
    """
    if pressure_derivatives is None:
        return _build_function_from_expression(
            "changes, g, psis, p", _write_tuple_sum_expression("changes", law_state_count)
        )
    state_sum = build_tuple_sum_function(law_state_count)

    def contribution_with_pressure(
        changes: FloatTuple, g: float, psis: FloatTuple, p: FloatTuple
    ) -> float:
        return state_sum(changes) - pressure_derivatives(g, psis, p)[0] * changes[-1]

    return contribution_with_pressure


@cache
def build_states_from_strength_function(law_state_count: int) -> NumericFunction:
    """Return a function that computes the first state from the strength.

    Parameters
    ----------
    law_state_count : int
        Number of states of the law.

    Returns
    -------
    callable
        Function ``(strength, log_slip_rate, others, p) -> tuple`` that returns all states. The
        argument ``others`` contains all states except the first.
    """
    if law_state_count == 1:

        def single_law_state(
            strength: float, log_slip_rate: float, others: FloatTuple, p: FloatTuple
        ) -> FloatTuple:
            return (strength - p[A] * log_slip_rate, *others)

        return single_law_state

    sum_of_others = build_tuple_sum_function(law_state_count - 1)

    def several_law_states(
        strength: float, log_slip_rate: float, others: FloatTuple, p: FloatTuple
    ) -> FloatTuple:
        return (strength - p[A] * log_slip_rate - sum_of_others(others), *others)

    return several_law_states


def check_steady_states_of_user_law(scene: SceneView) -> None:
    """Check the steady states of a user-defined law.

    The states must not change in steady sliding, must add up to zero at :math:`V_*` and must be
    stable at constant slip rate. Otherwise, the computed critical stiffness would contradict the
    computed limit cycles.

    Parameters
    ----------
    scene : Scene
        Scene with the law.

    Raises
    ------
    InvalidValue
        If the law violates one of the conditions.
    """
    law, p, still = scene.parts.law, scene.parameter_values, _REST_TOLERANCE * scene.a
    evolutions, steady_states = get_evolution_and_steady_state_functions(law)
    for rate in _CHECKED_LOG_SLIP_RATES:
        psis = steady_states(rate, 0.0, p)
        change = max(map(abs, evolutions(rate, psis, 0.0, 1.0, p)))
        if not change <= still:
            rule = (
                f"has a state that changes by {change:.3g} per D_c in steady sliding at "
                f"ln(V/V_*) = {rate:g}"
            )
            remedy = "Define steady_states(log_slip_rate, shift, p) in the law."
            raise InvalidValue("law", law.name, rule, remedy=remedy)
        if rate == 0.0 and not abs(sum(psis)) <= still:
            rule = (
                f"has states with the sum {sum(psis):.3g} at V_*, but the sum must be 0 "
                "because friction at V_* is mu_*"
            )
            raise InvalidValue("law", law.name, rule, remedy="Define the states relative to V_*.")
        away = np.linalg.eigvals(
            _compute_evolution_jacobian(evolutions, rate, psis, scene.a, p)
        ).real.max()
        if away > _REST_TOLERANCE:
            rule = (
                f"moves away from steady sliding at ln(V/V_*) = {rate:g} with a growth rate of "
                f"{away:.3g} per D_c"
            )
            remedy = "Check that its evolution function has the sign of dPsi/d(delta)."
            raise InvalidValue("law", law.name, rule, remedy=remedy)


def _compute_evolution_jacobian(
    evolutions: NumericFunction,
    log_slip_rate: float,
    states: FloatTuple,
    finite_difference_scale: float,
    p: FloatTuple,
) -> list[list[float]]:
    """Compute the Jacobian matrix of the state evolution by central differences.

    The step size is 1e-4 times ``finite_difference_scale``.
    """
    step, rows = 1e-4 * finite_difference_scale, list[list[float]]()
    for n, psi in enumerate(states):
        ahead, behind = (
            evolutions(log_slip_rate, (*states[:n], psi + off, *states[n + 1 :]), 0.0, 1.0, p)
            for off in (step, -step)
        )
        rows.append([(x - y) / (2.0 * step) for x, y in zip(ahead, behind, strict=True)])
    return rows
