r"""Functions that linearise the friction and the force balance around steady sliding.

Consider a small perturbation of slip, :math:`du`, that grows as :math:`\exp(p s)` with slip
:math:`s` in units of :math:`D_c`. The perturbation of the frictional stress is
:math:`dg = G(p) \, du` with

.. math::

    G(p) = \frac{p [a + 1^T (p - M)^{-1} E_x]}{D - S \, 1^T (p - M)^{-1} E_s}.

Here :math:`D` and :math:`S` are the derivatives of strength and of the shift with respect to
frictional stress. The matrix :math:`M` and the vectors :math:`E_x` and :math:`E_s` contain the
derivatives of the state evolution with respect to the states, to :math:`x = \ln V` and to the
shift. Friction depends on the sum of the states of the law, so the vector of weights is
:math:`1^T`. If the scene has a fluid, the pore pressure :math:`P` is the last state. The weight of
:math:`P` is the negative derivative of strength with respect to :math:`P`, and the weight of
porosity is 0. Because the pressure also changes the shift, the last column of :math:`M` includes
the product of :math:`E_s` and the derivative of the shift with respect to :math:`P`. If the
temperature changes, it is treated in the same way as the pore pressure.

If the loading changes the normal stress by :math:`-dP`, the frictional stress changes by the
additional term

.. math::

    -\frac{F - S_P \, 1^T (p - M)^{-1} E_s}{D - S \, 1^T (p - M)^{-1} E_s} \, dP.

Here :math:`F` and :math:`S_P` are the derivatives of strength and of the shift with respect to
:math:`P`.
"""

from __future__ import annotations

from typing import NamedTuple

from rsfstudy.slider.evolution_derivatives import (
    StateEvolutionDerivatives,
    compute_state_evolution_derivatives,
)
from rsfstudy.slider.friction import build_friction_relation
from rsfstudy.slider.parameter_layout import pack_temperature_parameter_values
from rsfstudy.slider.polynomials import (
    PolynomialCoefficients,
    compute_dot_product,
    compute_resolvent_polynomials,
)
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.steady_state import SteadySliding
from rsfstudy.slider.temperature_functions import compute_thermal_friction_derivatives


class LinearisedForceBalance(NamedTuple):
    """Coefficients of the force balance, linearised around steady sliding."""

    friction_response_numerator: PolynomialCoefficients
    friction_response_denominator: PolynomialCoefficients
    radiation_damping: float
    slip_rate_norm: float


def linearise_force_balance(
    scene: SceneView,
    steady_state: SteadySliding,
    evolution_derivatives: StateEvolutionDerivatives | None = None,
    *,
    quasi_static: bool = False,
) -> LinearisedForceBalance:
    """Linearise the force balance around steady sliding."""
    damping = (
        0.0 if quasi_static else scene.dynamics.radiated_stress_slope(steady_state.log_slip_rate)
    )
    norm = (
        0.0
        if quasi_static
        else scene.dynamics.compute_slip_rate_norm(scene, steady_state.log_slip_rate)
    )
    return LinearisedForceBalance(
        *compute_linear_friction_response(scene, steady_state, evolution_derivatives), damping, norm
    )


def compute_linear_friction_response(
    scene: SceneView,
    steady_state: SteadySliding,
    evolution_derivatives: StateEvolutionDerivatives | None = None,
) -> tuple[PolynomialCoefficients, PolynomialCoefficients]:
    r"""Compute the response of frictional stress to small perturbations of slip.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    steady_state : SteadySliding
        Steady sliding of the scene.
    evolution_derivatives : StateEvolutionDerivatives, optional
        Derivatives of the state evolution. By default, the function computes these derivatives.

    Returns
    -------
    above, below : list of float
        Coefficients of the numerator and denominator polynomials of the response, in ascending
        order of the powers.

    Notes
    -----
    The response is the rational function :math:`G(p) = p \, \mathrm{above}(p)/\mathrm{below}(p)`.
    The module docstring defines :math:`G(p)`. For a law with one state at constant normal stress,
    :math:`G(p) = p [a - b/(p + 1)]` in units of :math:`\sigma_*/D_c`.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    _value, slope, _shift, shift_slope = build_friction_relation(scene, steady_state.states)(
        steady_state.frictional_stress
    )
    by_rate, by_shift, by_state, _error = (
        evolution_derivatives or compute_state_evolution_derivatives(scene, steady_state)
    )
    by_state = [list(row) for row in by_state]
    weights, shifting = _compute_state_weights_in_friction(scene, steady_state)
    for row, of_shift in zip(by_state, by_shift, strict=True):
        for place, shift in shifting.items():
            row[place] += of_shift * shift
    denominator, adjugate = compute_resolvent_polynomials(by_state)
    above = [scene.a * x for x in denominator]
    below = [slope * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        for weight, row in zip(weights, matrix, strict=True):
            above[power] += weight * compute_dot_product(row, by_rate)
            below[power] -= shift_slope * (weight * compute_dot_product(row, by_shift))
    return above, below


def _compute_state_weights_in_friction(
    scene: SceneView, steady_state: SteadySliding
) -> tuple[list[float], dict[int, float]]:
    """Return the weight of each state in friction, and the derivatives of the state shift.

    The first returned value is a list with one weight per state. The second returned value is a
    dictionary with the derivatives of the shift (the decrease in the state variable due to stress
    and temperature) with respect to temperature and pore pressure. The keys of the dictionary are
    the indices of these two unknowns in the tuple of states.
    """
    law, fluid = scene.parts.law.state_count, len(scene.parts.fluid.unknowns)
    weights, shifts = [1.0] * law, dict[int, float]()
    if scene.parts.temperature.unknowns:
        gained, shifts[law] = compute_thermal_friction_derivatives(
            steady_state.states[law], pack_temperature_parameter_values(scene)
        )
        weights.append(-gained)
    if fluid:
        by_pressure = scene.friction_law_functions.strength_derivatives_by_pressure
        gained, shifts[-1] = by_pressure(
            steady_state.frictional_stress, steady_state.states, scene.friction_parameter_values
        )
        weights += [*[0.0] * (fluid - 1), -gained]
    return weights, shifts
