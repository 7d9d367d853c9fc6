"""Functions that differentiate the state evolution numerically in steady sliding."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from rsfstudy.slider.friction import build_friction_relation, compute_steady_states
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.steady_state import SteadySliding

#: Largest step size of the finite differences, divided by the scale of the argument. The second
#: constant contains the coefficients of central differences of order eight.
_MAX_FINITE_DIFFERENCE_STEP_OVER_SCALE = 0.05
_CENTRAL_DIFFERENCE_OFFSETS_AND_WEIGHTS = (
    (1, 4.0 / 5.0),
    (2, -1.0 / 5.0),
    (3, 4.0 / 105.0),
    (4, -1.0 / 280.0),
)
#: Default scale of a state, divided by b. If a steady state changes with ln V by more than the
#: second constant (a fraction of the default scale), this change is the scale of the state.
_STATE_SCALE_OVER_B, _MIN_STATE_CHANGE = 0.05, 1e-9
#: Maximum number of halvings of the step size of the finite differences. The second constant is the
#: tolerance for the relative difference between two successive estimates of a derivative. The third
#: constant is the relative rounding error of a finite difference.
_MAX_HALVINGS, _CONVERGENCE_TOLERANCE, _ROUNDING_ERROR = 9, 1e-12, 8.0 * 2.0**-52

NestedListMatrix = list[list[float]]


class StateEvolutionDerivatives(NamedTuple):
    r"""Derivatives of the state evolution per unit slip in steady sliding.

    Parameters
    ----------
    with_respect_to_log_slip_rate, with_respect_to_stress_induced_shift : list of float
        Derivatives of the state evolution with respect to :math:`\ln V`, and with respect to the
        stress-induced decrease in the state (shift). Each list has one element per state.
    with_respect_to_states : list of list of float
        Derivatives of the state evolution with respect to each state, as a square matrix.
    max_relative_error_estimate : float
        Largest relative error estimate among the derivatives.
    """

    with_respect_to_log_slip_rate: list[float]
    with_respect_to_stress_induced_shift: list[float]
    with_respect_to_states: NestedListMatrix
    max_relative_error_estimate: float

    def with_perturbed_derivatives(self, relative_change: float) -> StateEvolutionDerivatives:
        r"""Return a copy in which all derivatives are multiplied by factors near 1.

        Parameters
        ----------
        relative_change : float
            Relative change of the derivatives. The derivatives with respect to :math:`\ln V` and to
            the shift are multiplied by ``1 + relative_change``. The derivatives with respect to the
            states are multiplied by ``1 - relative_change``.

        Returns
        -------
        StateEvolutionDerivatives
            Copy with the changed derivatives.
        """
        by_log_slip_rate, by_shift = (
            [x * (1.0 + relative_change) for x in row] for row in self[:2]
        )
        by_state = [
            [x * (1.0 - relative_change) for x in row] for row in self.with_respect_to_states
        ]
        return self._replace(
            with_respect_to_log_slip_rate=by_log_slip_rate,
            with_respect_to_stress_induced_shift=by_shift,
            with_respect_to_states=by_state,
        )


def compute_state_evolution_derivatives(
    scene: SceneView, steady_state: SteadySliding
) -> StateEvolutionDerivatives:
    r"""Compute the derivatives of the state evolution in steady sliding.

    The step size of the finite differences is halved until two successive estimates agree. The
    derivatives are therefore accurate even if the state evolution varies strongly when
    :math:`\ln V` changes by less than 1.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    steady_state : SteadySliding
        Steady sliding of the scene.

    Returns
    -------
    StateEvolutionDerivatives
        Derivatives with an error estimate.
    """
    evolutions, p = (
        scene.friction_law_functions.state_evolutions,
        scene.friction_parameter_values,
    )
    relation = build_friction_relation(scene, steady_state.states)
    shift = relation(steady_state.frictional_stress)[2]
    arguments = [steady_state.log_slip_rate, shift, *steady_state.states]
    scales, columns, errors = _compute_finite_difference_scales(scene, steady_state, shift), [], []
    # Each unit is the change of an argument that is equivalent to a change in ln V by 1. Rounding
    # errors are proportional to the units.
    units = [scales[0], *(scale / _STATE_SCALE_OVER_B for scale in scales[1:])]
    rounding = _ROUNDING_ERROR * (
        1.0 + max(abs(x) / y for x, y in zip(arguments, units, strict=True))
    )
    for place, (scale, unit) in enumerate(zip(scales, units, strict=True)):
        # Finite differences with half the step size share half of their arguments.
        known = dict[float, FloatTuple]()

        def evolve(
            change: float, place: int = place, known: dict[float, FloatTuple] = known
        ) -> FloatTuple:
            if change not in known:
                changed = [*arguments]
                changed[place] += change
                x, shift, *psis = changed
                known[change] = evolutions(x, tuple(psis), shift, 1.0, p)
            return known[change]

        derivatives, error = _differentiate_at_zero(
            evolve, _MAX_FINITE_DIFFERENCE_STEP_OVER_SCALE * scale, rounding * unit
        )
        columns.append(derivatives)
        errors.append(error)
    by_rate, by_shift, *by_state = columns
    rows = [list(row) for row in zip(*by_state, strict=True)]
    return StateEvolutionDerivatives(by_rate, by_shift, rows, max(errors))


def _differentiate_at_zero(
    function: Callable[[float], FloatTuple], initial_step: float, rounding_error: float
) -> tuple[list[float], float]:
    """Differentiate a function at zero, and estimate the relative error.

    The step size is halved until the derivatives for two successive step sizes agree within the
    rounding error. The function then returns the derivatives for the larger step size, because
    their rounding error is smaller. If the derivatives never agree for two successive step sizes,
    the function selects the two successive step sizes whose derivatives differ least. In this case
    the function returns the derivatives for the smaller step size.
    """
    (coarse, _sizes), best, smallest = (
        _compute_central_differences_at_zero(function, initial_step),
        list[float](),
        math.inf,
    )
    for _ in range(_MAX_HALVINGS):
        initial_step *= 0.5
        fine, sizes = _compute_central_differences_at_zero(function, initial_step)
        pairs = zip(fine, coarse, sizes, strict=True)
        error = max(abs(x - y) / size if x != y else 0.0 for x, y, size in pairs)
        noise = _CONVERGENCE_TOLERANCE + rounding_error / initial_step
        if error <= noise:
            return coarse, noise
        if not best or error + noise < smallest:
            best, smallest = fine, error + noise
        coarse = fine
    return best, smallest


def _compute_central_differences_at_zero(
    function: Callable[[float], FloatTuple], step: float
) -> tuple[list[float], list[float]]:
    """Differentiate a function at zero by central differences of order eight.

    Returns
    -------
    derivatives : list of float
        Derivative of each component of the function.
    sizes : list of float
        For each component, the largest ratio of the function value to the magnitude of the
        argument. The rounding errors of the derivatives are proportional to this ratio.
    """
    slopes = [0.0] * len(function(step))
    sizes = [*slopes]
    for number, weight in _CENTRAL_DIFFERENCE_OFFSETS_AND_WEIGHTS:
        away = number * step
        for i, (more, less) in enumerate(zip(function(away), function(-away), strict=True)):
            slopes[i] += weight * (more - less) / step
            sizes[i] = max(sizes[i], abs(more) / away, abs(less) / away)
    return slopes, sizes


def _compute_finite_difference_scales(
    scene: SceneView, steady_state: SteadySliding, stress_induced_state_shift: float
) -> list[float]:
    """Return the scales of finite differences with respect to ln V, the shift and each state."""
    size = _STATE_SCALE_OVER_B * scene.a * scene.parts.law.steady_state_change_per_log_rate_over_a
    # If the law has several states, the sum of all b may be close to zero even if each b is large.
    of_shift = (
        size if scene.parts.law.state_count > 1 else _STATE_SCALE_OVER_B * abs(scene.b) or size
    )
    if len(steady_state.states) == 1:
        return [1.0, of_shift, size]
    slow, fast = (
        compute_steady_states(scene, steady_state.log_slip_rate + x, stress_induced_state_shift)
        for x in (-1.0, 1.0)
    )
    moved = [0.5 * abs(y - x) for x, y in zip(slow, fast, strict=True)]
    if scene.parts.temperature.unknowns:
        place = scene.parts.law.state_count
        moved[place] = _STATE_SCALE_OVER_B * (1.0 + steady_state.states[place])
    return [1.0, of_shift, *(by if by > _MIN_STATE_CHANGE * size else size for by in moved)]
