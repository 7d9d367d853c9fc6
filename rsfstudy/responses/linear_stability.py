"""Linear stability of steady sliding.

The critical stiffness is computed in three ways: from the friction relation, from the growth rates
of small perturbations, and in closed form. The growth rate at the stiffness of the scene is
computed in two ways: from the friction relation, and from the equations of motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from scipy.optimize import brentq

from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import Integrator
from rsfstudy.quantities import Output
from rsfstudy.responses.perturbation_growth import (
    GROWTH_OUTPUTS,
    add_growth_rate,
    compute_jacobian_of_steady_sliding,
    compute_max_growth_rate,
)
from rsfstudy.slider import Scene, SteadySliding, critical_stiffness_closed_form
from rsfstudy.status import Status

#: Steady sliding is treated as unstable at any stiffness if the relative increase of the critical
#: stiffness by inertia exceeds this number.
_MAX_CRITICAL_STIFFNESS_RISE_BY_INERTIA = 1e6

_CRITICAL_STIFFNESS_OUTPUT = Output(
    "critical_stiffness",
    r"$k_{cr}D_c/\sigma_*$",
    "1",
    "critical stiffness of steady sliding at the load point velocity, with inertia or radiation "
    "damping if the scene includes them",
    "sigma_*/D_c",
    error=True,
)
_STABILITY_OUTPUTS = (
    _CRITICAL_STIFFNESS_OUTPUT,
    Output("critical_stiffness_from_growth"),
    Output("critical_stiffness_explicit"),
    Output("relative_critical_stiffness"),
    Output(
        "rise_by_dynamics",
        long_name="relative change of the critical stiffness due to inertia or radiation damping",
    ),
    Output("steady_friction"),
    Output("steady_normal_stress", "", "1", "steady-state normal stress", "sigma_*"),
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class LinearStability(Measure):
    r"""Critical stiffness and growth rate at the load point velocity.

    The critical stiffness of steady sliding is computed by three methods, whose results are
    compared. The first result is computed from the friction relation. The second result is the
    stiffness at which small perturbations neither grow nor decay according to the equations of
    motion. The third result is the quasi-static closed form, corrected for inertia and radiation
    damping.

    Stresses are in units of sigma_*, and stiffnesses are in units of sigma_*/D_c. The relative
    critical stiffness is the critical stiffness divided by the critical stiffness at V_* without
    inertia or radiation damping.

    Parameters
    ----------
    growth_rate : bool, default: False
        If True, the measure also computes the growth rate and the angular frequency of the least
        stable small perturbation at the stiffness of the scene, in units of V_*/D_c. The main
        result is then the growth rate, and the stiffness of the scene may be an axis of a study. If
        the critical stiffness does not exist, the status is nevertheless ``ok``, and the message
        contains the reason.

    Notes
    -----
    Let :math:`s` be slip divided by :math:`D_c`. If a perturbation of slip is proportional to
    :math:`\exp(p s)`, the change in frictional stress is the perturbation multiplied by
    :math:`G(p)`. With the stiffness :math:`K = k D_c/\sigma_*` and :math:`w = V T/(2 \pi D_c)`, the
    growth rate :math:`p` satisfies

    .. math:: K (1 + w^2 p^2) + \eta V p + G(p) = 0.

    The measure selects the root :math:`p` with the largest real part. The growth rate is the real
    part of :math:`p V/V_*`, and the angular frequency is its imaginary part. If this root is real,
    the angular frequency is zero. The stiffness is critical if :math:`p` is purely imaginary [1]_.
    Under the slip law and the slowness law, the critical stiffness of quasi-static, drained motion
    at :math:`V_*` is

    .. math:: K = \frac{b - a}{1 - (\mu_* - \alpha) \cot\varphi},

    which is eq. 7 of [2]_. Eq. 8 of [2]_ gives the critical stiffness at other slip rates. If
    normal stress is constant, the term with :math:`\cot\varphi` is absent.

    References
    ----------
    .. [1] Ruina, A. (1983). Slip instability and state variable friction laws. J. Geophys. Res.,
       88, 10359-10370.
    .. [2] Effect of varying normal stress on stability and dynamic motion of a spring-slider system
       with rate- and state-dependent friction. Earthquake Science (2014).
       doi:10.1007/s11589-014-0098-4

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import LinearStability
    >>> scene = Scene(normal_stress="constant", a=0.01, b_over_a=1.5)
    >>> outcome = LinearStability()(scene, Accuracy())
    >>> round(outcome.values["critical_stiffness"], 6)
    0.005
    >>> softer = scene.with_(stiffness_ratio=0.9)
    >>> outcome = LinearStability(growth_rate=True)(softer, Accuracy())
    >>> round(outcome.values["growth_rate"], 6)
    0.025
    """

    growth_rate: bool = False
    fields_stored_unless_default: ClassVar[tuple[str, ...]] = ("growth_rate",)
    name: ClassVar[str] = "linear_stability"
    typical_rhs_evaluations = 100
    needs_time: ClassVar[tuple[bool, ...]] = ()

    @property
    def primary_output(self) -> str:
        """Name of the main result, ``critical_stiffness`` or ``growth_rate``."""
        return "growth_rate" if self.growth_rate else "critical_stiffness"

    @property
    def outputs(self) -> Sequence[Output]:
        """Critical stiffness, properties of steady sliding, and the growth rate if requested."""
        if not self.growth_rate:
            return _STABILITY_OUTPUTS
        return (
            *GROWTH_OUTPUTS,
            replace(_CRITICAL_STIFFNESS_OUTPUT, optional=True),
            *_STABILITY_OUTPUTS[1:],
        )

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Names of ignored scene fields: ``stiffness_ratio``, unless the growth rate is requested.

        If the growth rate is requested, the value of the stiffness is used and the tuple is empty.
        """
        return () if self.growth_rate else ("stiffness_ratio",)

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the critical stiffness, and the growth rate if requested.

        The critical stiffness is computed from the linear response of friction, and again from the
        condition that the growth rate is zero. The difference between the two results is the error
        estimate. The growth rate is computed from the linear response of friction, and again from
        the equations of motion, and its error is estimated in the same way.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        scene = scene.steadily_loaded_scene
        load = scene.log_load_velocity
        if load == -math.inf:
            return Outcome(Status.NO_STEADY_STATE, message="the load point is held")
        steady = scene.compute_steady_sliding(load)
        if steady is None:
            return Outcome(
                Status.NO_STEADY_STATE,
                {"steady_friction": scene.mu_star + scene.steady_friction_minus_reference(load)},
                "phi < atan(mu_ss): the slider locks while stress increases, and slips while "
                "stress decreases",
            )
        outcome = self._compute_critical_stiffness(scene, steady, integrator)
        return add_growth_rate(outcome, scene, steady, integrator) if self.growth_rate else outcome

    def _compute_critical_stiffness(
        self, scene: Scene, steady_state: SteadySliding, integrator: Integrator
    ) -> Outcome:
        """Compute the critical stiffness, and verify that the growth rate there is zero."""
        load = steady_state.log_slip_rate
        sigma_ss = scene.compute_effective_normal_stress(steady_state.frictional_stress)
        mu_ss = (scene.mu_star + steady_state.frictional_stress) / sigma_ss
        values = {"steady_friction": mu_ss, "steady_normal_stress": sigma_ss}
        massless = scene.critical_stiffness_at(load, quasi_static=True)
        critical = scene.critical_stiffness_at(load)
        if critical <= 0.0:
            return Outcome(
                Status.STABLE_AT_ANY_STIFFNESS,
                values,
                "every perturbation decays, because friction is not rate-weakening"
                if massless <= 0.0
                else "radiation damping of eta V = "
                f"{scene.dynamics.radiated_stress_slope(load):.3g} sigma_* damps every "
                "perturbation",
            )
        if massless == math.inf:
            why = "with this friction law, perturbations also grow without inertia or damping"
            return Outcome(Status.UNSTABLE_AT_ANY_STIFFNESS, values, why)
        at_reference = scene.critical_stiffness
        relative = critical / at_reference if at_reference else math.inf
        rise = critical / massless - 1.0 if massless else math.inf
        if rise > _MAX_CRITICAL_STIFFNESS_RISE_BY_INERTIA:
            norm = scene.dynamics.compute_slip_rate_norm(scene, load)
            return Outcome(
                Status.UNSTABLE_AT_ANY_STIFFNESS,
                values,
                f"at V T/(2 pi D_c) = {norm:.3g}, the direct effect cannot damp the oscillations",
            )
        by_growth = _find_stiffness_at_zero_growth(scene, steady_state, critical, integrator)
        if math.isnan(by_growth):
            why = (
                "the growth rate of the linearised equations does not vanish at the stiffness "
                f"{critical:.9g}"
            )
            return Outcome(Status.UNVERIFIED, values, why)
        return Outcome(
            Status.OK,
            {
                "critical_stiffness": critical,
                "critical_stiffness_error": abs(by_growth - critical) + 1e-15 * critical,
                "critical_stiffness_from_growth": by_growth,
                "critical_stiffness_explicit": _compute_closed_form_critical_stiffness(scene)
                * (1.0 + rise),
                "relative_critical_stiffness": relative,
                "rise_by_dynamics": rise,
                **values,
            },
        )


def _compute_closed_form_critical_stiffness(scene: Scene) -> float:
    """Compute the critical stiffness from the published formula.

    The result is NaN if the formula does not apply to the scene.
    """
    law, coupling = scene.parts.law, scene.parts.normal_stress.coupling
    others = law.steady_states or law.depends_on_stress or scene.parts.fluid.effects
    hot = scene.parts.temperature.unknowns
    if coupling is None or others or hot or scene.imposed_normal_stress:
        return math.nan
    return critical_stiffness_closed_form(
        scene.log_load_velocity, scene.mu_star, scene.a, scene.b, *coupling
    )


def _find_stiffness_at_zero_growth(
    scene: Scene, steady_state: SteadySliding, stiffness_guess: float, integrator: Integrator
) -> float:
    """Find the stiffness at which the largest growth rate is zero.

    The result is NaN if perturbations do not grow below this stiffness, or do not decay above it.
    """

    def growth_at(stiffness: float) -> float:
        changed = scene.with_(stiffness=stiffness)
        return compute_max_growth_rate(
            compute_jacobian_of_steady_sliding(changed, steady_state, integrator)
        )

    # If the scene has several states, sliding may be stable again below the next smaller critical
    # stiffness.
    before = [
        k
        for k in scene.compute_all_critical_stiffnesses(steady_state.log_slip_rate)
        if k < stiffness_guess
    ]
    softer = max(0.5 * stiffness_guess, math.sqrt(stiffness_guess * before[-1]) if before else 0.0)
    if not growth_at(softer) > 0.0 > growth_at(2.0 * stiffness_guess):
        return math.nan
    return float(
        brentq(growth_at, softer, 2.0 * stiffness_guess, xtol=1e-15 * stiffness_guess, rtol=1e-14)
    )
