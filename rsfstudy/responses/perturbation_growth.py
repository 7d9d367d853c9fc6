"""Functions that compute how fast perturbations grow according to the equations of motion.

The equations of motion are differentiated numerically. The module does not use the friction
relation, so the growth rates are an independent check on the growth rates that are computed from
the friction relation.
"""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.measure_base import Outcome
from rsfstudy.motion import Integrator
from rsfstudy.quantities import Output
from rsfstudy.slider import EquationsOfMotion, Scene, SteadySliding
from rsfstudy.status import Status

#: Step of the central differences, in units of the scale of an unknown. Rounding and truncation
#: errors are of the same size at this step.
_FINITE_DIFFERENCE_STEP_OVER_SCALE = 1e-4
#: Dimensionless slip rate above which growth rates are computed from the inertial equations of
#: motion. At lower slip rates, the effect of inertia is smaller than the rounding errors of the
#: inertial equations of motion. At lower slip rates, the slow manifold, which is of second order in
#: the mass, is accurate enough.
_MIN_SLIP_RATE_NORM_FOR_INERTIA = 1e-3
#: Growth rates from the friction relation and from the equations of motion disagree if their
#: relative difference exceeds the first number. The second number is the smallest growth rate, per
#: unit slip in D_c, to which the difference is compared. The Jacobian has a relative error of 1e-8.
_MAX_RELATIVE_DIFFERENCE, _MIN_COMPARED_GROWTH_RATE = 1e-3, 1e-4


#: Outputs that describe the least stable small perturbation.
GROWTH_OUTPUTS = (
    Output(
        "growth_rate",
        r"$\mathrm{Re}(p) V/V_*$",
        "1",
        "growth rate of the least stable small perturbation of steady sliding, at the stiffness of "
        "the scene",
        "V_*/D_c",
        error=True,
    ),
    Output(
        "angular_frequency",
        r"$\mathrm{Im}(p) V/V_*$",
        "1",
        "angular frequency of the least stable small perturbation of steady sliding, at the "
        "stiffness of the scene",
        "V_*/D_c",
        error=True,
    ),
)


def _needs_inertial_equations(scene: Scene, steady_state: SteadySliding) -> bool:
    """Return True if the slow manifold is too inaccurate at the given slip rate."""
    norm = scene.dynamics.compute_slip_rate_norm(scene, steady_state.log_slip_rate)
    return bool(norm > _MIN_SLIP_RATE_NORM_FOR_INERTIA)


def compute_jacobian_of_steady_sliding(
    scene: Scene, steady_state: SteadySliding, integrator: Integrator
) -> np.ndarray:
    """Compute the Jacobian of the equations of motion in steady sliding.

    The independent variable is the inertial time if the full equations are needed. Otherwise, it is
    the sum of slip and load point displacement.

    Parameters
    ----------
    scene : Scene
        Scene with a stiffness.
    steady_state : SteadySliding
        Steady sliding at the load point velocity.
    integrator : Integrator
        Integrator that counts the evaluations of the right-hand side.

    Returns
    -------
    ndarray, shape (n, n)
        Derivatives of the right-hand side (rows) with respect to the unknowns (columns).
    """
    if _needs_inertial_equations(scene, steady_state):
        equations = scene.equations_against_inertial_time()
        stress = steady_state.spring_stress
        state = (stress, steady_state.log_slip_rate, stress, *steady_state.states[1:])
    else:
        equations = scene.equations_against_displacement()
        state = (steady_state.spring_stress, *steady_state.states)
    integrator.work_meter.charge(equations.regime_name, 2 * len(state))
    return compute_jacobian(equations, state)


def add_growth_rate(
    outcome: Outcome, scene: Scene, steady_state: SteadySliding, integrator: Integrator
) -> Outcome:
    """Add the growth rate at the stiffness of the scene to an outcome.

    Parameters
    ----------
    outcome : Outcome
        Outcome with the critical stiffness, or with a status if the critical stiffness does not
        exist.
    scene : Scene
        Scene with a stiffness.
    steady_state : SteadySliding
        Steady sliding at the load point velocity.
    integrator : Integrator
        Integrator that counts the evaluations of the right-hand side.

    Returns
    -------
    Outcome
        Outcome with the values in ``GROWTH_OUTPUTS``. If the critical stiffness does not exist, the
        status is ``ok``. If the two computations of the growth rate disagree, the status is
        ``unverified``.
    """
    load = steady_state.log_slip_rate
    leading = complex(scene.linear_growth_rates(load)[0])
    found = np.linalg.eigvals(compute_jacobian_of_steady_sliding(scene, steady_state, integrator))
    # In steady sliding, the displacement is the sum of two equal displacements: the slip and the
    # load point displacement.
    found = found * (
        1.0 / scene.dynamics.compute_slip_rate_norm(scene, load)
        if _needs_inertial_equations(scene, steady_state)
        else 2.0
    )
    difference = float(abs(found - leading).min())
    rounding = scene.compute_largest_linear_growth_rate(load)
    error = difference + (rounding.error_estimate if rounding else math.inf)
    rate = math.exp(load)
    values = {
        **outcome.values,
        "growth_rate": leading.real * rate,
        "growth_rate_error": error * rate,
        "angular_frequency": abs(leading.imag) * rate,
        "angular_frequency_error": error * rate,
    }
    if difference > _MAX_RELATIVE_DIFFERENCE * max(abs(leading), _MIN_COMPARED_GROWTH_RATE):
        why = (
            f"the growth rates from the friction relation and from the equations of motion differ "
            f"by {difference * rate:.3g} V_*/D_c"
        )
        return Outcome(Status.UNVERIFIED, values, "; ".join(filter(None, [outcome.message, why])))
    if outcome.status is Status.OK or not outcome.status.is_answer:
        return Outcome(outcome.status, values, outcome.message)
    why = f"the critical stiffness does not exist ({outcome.status.label}): {outcome.message}"
    return Outcome(Status.OK, values, why)


def compute_max_growth_rate(jacobian: np.ndarray) -> float:
    """Return the growth rate of the fastest-growing perturbation.

    Parameters
    ----------
    jacobian : ndarray, shape (n, n)
        Jacobian of the right-hand side of the equations of motion.

    Returns
    -------
    float
        Growth rate per unit of the independent variable of the equations.
    """
    return float(np.linalg.eigvals(jacobian).real.max())


def compute_jacobian(equations: EquationsOfMotion, unknowns: tuple[float, ...]) -> np.ndarray:
    """Compute the Jacobian of the right-hand side by central differences.

    Parameters
    ----------
    equations : Equations
        Equations of motion.
    unknowns : tuple of float
        Unknowns at which the Jacobian is computed.

    Returns
    -------
    ndarray, shape (n, n)
        Derivatives of the right-hand side (rows) with respect to the unknowns (columns).
    """
    columns = []
    for number, scale in enumerate(equations.unknown_scales):
        step = _FINITE_DIFFERENCE_STEP_OVER_SCALE * scale
        ahead, behind = (
            equations.evaluate_rates(
                tuple(x + sign * step * (i == number) for i, x in enumerate(unknowns))
            )
            for sign in (1.0, -1.0)
        )
        columns.append([(u - v) / (2.0 * step) for u, v in zip(ahead, behind, strict=True)])
    return np.array(columns).T
