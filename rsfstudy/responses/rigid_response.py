"""Response of a rigid slider to a step of its slip rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import Measure, Outcome, check_loading_has_no_noise
from rsfstudy.motion import EventKind, Integrator, MotionRecorder, MotionStopped, fall, rise
from rsfstudy.quantities import Output
from rsfstudy.responses._recorded_motion import estimate_error_at_instant
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Smallest evolution of friction after a step, as a fraction of a. Smaller changes are dominated by
#: rounding errors.
_MIN_FRICTION_CHANGE_AFTER_STEP_OVER_A = 1e-9

#: Results of the measure for stress changes and their ratios, with scales and meanings.
_STRESS_CHANGE_OUTPUTS = (
    ("direct_stress_change", "sigma_*", "stress change immediately after a rate step"),
    (
        "direct_asymmetry",
        "",
        "direct stress change divided by the direct stress change of the inverse step, minus 1",
    ),
    (
        "evolution_asymmetry",
        "",
        "evolution stress change divided by the evolution stress change of the inverse step, "
        "minus 1",
    ),
    ("steady_stress_change", "sigma_*", "change of steady-state stress due to a rate step"),
    ("stress_left_at_unit_slip", "sigma_*", "stress minus steady-state stress after a slip of D_c"),
    (
        "closed_form_misfit",
        "sigma_*",
        "largest difference from the closed-form stress at constant normal stress",
    ),
    (
        "exponential_misfit",
        "",
        "largest difference from exponential decay over D_c, divided by the stress change",
    ),
)
_RIGID_RESPONSE_OUTPUTS = (
    Output("evolution_distance", error=True),
    *(Output(name, "", "1", meaning, scale) for name, scale, meaning in _STRESS_CHANGE_OUTPUTS),
    *(
        Output(name, dims=("slip",))
        for name in ("shear_stress", "normal_stress_ratio", "state_variable")
    ),
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class RigidResponse(Measure):
    r"""Stress of a rigid slider as a function of the slip after a step in slip rate.

    The slip rate of the slider changes suddenly from V_* to V, and the ratio V/V_* is the field
    ``load_velocity_ratio`` of the scene. At the step, the direct effect changes the stress by the
    product of ``a``, ``sigma`` and ``ln(V/V_*)``. The stress then evolves with slip towards steady
    sliding at V.

    ``evolution_distance`` is the slip after which the difference between the stress and its steady
    value has decreased to 1/e of the initial difference. Under the slip law, ``evolution_distance``
    is D_c. The outputs ``shear_stress``, ``normal_stress_ratio`` and ``state_variable`` are arrays
    of shape (points,) along the dimension ``slip``. Slip is in units of D_c, and stresses are in
    units of sigma_*.

    Parameters
    ----------
    slip : float, default: 10.0
        Slip up to which the response is computed, in units of D_c.
    points : int, default: 201
        Number of points of the response, evenly spaced along ``slip``.

    Raises
    ------
    InvalidValue
        If ``slip`` is less than 1 or infinite, or if ``points`` is less than 2.

    Notes
    -----
    With :math:`r = V/V_*` and the slip :math:`x` in units of :math:`D_c`, friction at constant
    normal stress is

    .. math:: \mu - \mu_* = a \ln r - b \ln r\,[1 - e^{-x}]

    under the slip law [1]_, and

    .. math:: \mu - \mu_* = (a - b) \ln r + b \ln[1 + (r - 1) e^{-x}]

    under the slowness law. The formulas are eqs. 16 and 17 of [2]_, and the measure follows section
    2.3 of [2]_.

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
    >>> from rsfstudy.measures import RigidResponse
    >>> scene = Scene(normal_stress="constant", load_velocity_ratio=10)
    >>> outcome = RigidResponse()(scene, Accuracy())
    >>> round(outcome.values["evolution_distance"], 6)
    1.0
    """

    slip: float = 10.0
    points: int = 201
    name: ClassVar[str] = "rigid_response"
    primary_output = "evolution_distance"
    typical_rhs_evaluations = 800
    outputs = _RIGID_RESPONSE_OUTPUTS
    needs_time: ClassVar[tuple[bool, ...]] = ()

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        if not 1.0 <= self.slip < math.inf:
            raise InvalidValue("slip", self.slip, "must be finite and at least 1 D_c")
        if self.points < 2:
            raise InvalidValue("points", self.points, "must be at least 2")

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Slip at the points of the response, in units of D_c."""
        return {"slip": np.linspace(0.0, self.slip, self.points)}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of the evolution distance.

        The scale is the sum of two terms: the evolution distance, and the change in the evolution
        distance that results if friction changes by the direct effect parameter ``a``.

        Parameters
        ----------
        scene : Scene
            Scene of the computation.
        values : mapping of str to float or ndarray
            Results by name.

        Returns
        -------
        mapping of str to float
            Scales by name of the result.
        """
        evolution = abs(values["direct_stress_change"] - values["steady_stress_change"])
        part = 1.0 + math.e * scene.a / evolution
        return {"evolution_distance": part * abs(values["evolution_distance"])}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the response of the slider and its error estimate.

        The response is computed twice, with the requested accuracy and with smaller tolerances. The
        difference between the two runs determines the error estimate.

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
        check_loading_has_no_noise(scene)
        log_slip_rate = scene.log_load_velocity
        if log_slip_rate == 0.0:
            return Outcome(Status.NO_STEP, message="the slip rate is V_*, so there is no step")
        if log_slip_rate == -math.inf:
            return Outcome(
                Status.NO_STEADY_STATE,
                message="the load point is held, so the slider does not slip",
            )
        sliding = scene.compute_steady_sliding(log_slip_rate)
        if sliding is None:
            return Outcome(Status.NO_STEADY_STATE, message="no steady state at this slip rate")
        start, steady = (
            compute_frictional_stress_after_step(scene, log_slip_rate),
            sliding.frictional_stress,
        )
        if abs(start - steady) < _MIN_FRICTION_CHANGE_AFTER_STEP_OVER_A * scene.a:
            return Outcome(Status.NOT_APPLICABLE, message="friction does not evolve after the step")
        level = steady + (start - steady) / math.e
        distance, left, rows = self._compute_stress_along_slip(scene, start, level, integrator)
        again, _left, _rows = self._compute_stress_along_slip(
            scene, start, level, integrator.refined()
        )
        # Derivative of the distance with respect to friction, for an exponential decay.
        by_friction = math.e * distance / (start - steady)
        slip = self.output_coordinates["slip"]
        exponential = steady + (start - steady) * np.exp(-slip)
        departs = (rows[:, 0] - exponential) / (start - steady)
        return Outcome(
            Status.OK,
            {
                "evolution_distance": distance,
                "evolution_distance_error": estimate_error_at_instant(
                    distance, again, by_friction, scene, integrator
                ),
                "direct_stress_change": start,
                **_compute_step_asymmetries(scene, log_slip_rate),
                "steady_stress_change": steady,
                "stress_left_at_unit_slip": left - steady,
                "closed_form_misfit": _compute_misfit_to_closed_form(
                    scene, steady, slip, rows[:, 0]
                ),
                "exponential_misfit": float(departs[np.abs(departs).argmax()]),
                "shear_stress": scene.mu_star + rows[:, 0],
                "normal_stress_ratio": rows[:, 2],
                "state_variable": rows[:, 1],
            },
        )

    def _compute_stress_along_slip(
        self,
        scene: Scene,
        start_stress: float,
        crossed_stress_level: float,
        integrator: Integrator,
    ) -> tuple[float, float, np.ndarray]:
        """Integrate the response of the slider over slip.

        Returns
        -------
        distance : float
            Slip at which the stress crosses ``crossed_stress_level``.
        stress_left : float
            Stress after a slip of D_c.
        rows : ndarray, shape (points, 3)
            Stress, state variable and normal stress ratio at the points.
        """
        at, distance = self.output_coordinates["slip"], math.nan
        recording = MotionRecorder(sample_times=np.union1d(at, [1.0]))
        equations = scene.equations_at_imposed_slip_rate(scene.log_load_velocity)
        watches = (
            rise("frictional_stress", crossed_stress_level),
            fall("frictional_stress", crossed_stress_level),
        )
        # The step does not change the states Psi, which have their values of steady sliding at V_*.
        state = (start_stress, *scene.compute_steady_states(0.0, 0.0)[1:])
        complete = False
        for event in integrator.follow_equations(equations, state, watches, recording=recording):
            if event.specification is not None and math.isnan(distance):
                distance = event.slip
            complete = complete or event.kind is EventKind.ALL_SAMPLES_RECORDED
            if complete and not math.isnan(distance):
                break
        names = ("slip", "frictional_stress", "state_variable", "normal_stress_ratio")
        columns = [MotionRecorder.RECORDED_VARIABLE_NAMES.index(name) for name in names]
        slips, *values = recording.as_table(scene)[:, columns].T
        values[0] = values[0] - scene.mu_star
        rows = np.stack(values, axis=1)
        return distance, float(rows[slips == 1.0, 0][0]), rows[np.isin(slips, at)]


def _compute_misfit_to_closed_form(
    scene: Scene, steady_stress: float, slip: np.ndarray, stress: np.ndarray
) -> float:
    r"""Compute the largest difference between stress and its closed form.

    The closed form applies if normal stress and temperature are constant after the step. The result
    is in units of sigma_*, and is NaN if the law or the scene has no closed form.

    Notes
    -----
    The closed form corresponds to eqs. 17a and 17b of doi:10.1007/s11589-014-0098-4, which omit the
    level :math:`\mu_* \sigma + a \sigma \ln(V/V_*)` at which the evolution starts.
    """
    law, parts = scene.parts.law, scene.parts
    stress_acts = parts.normal_stress.effects or parts.fluid.effects or law.depends_on_stress
    if stress_acts or parts.temperature.unknowns or law.state_relaxation_function is None:
        return math.nan
    left = np.array(
        [law.state_relaxation_function(scene.log_load_velocity, at) for at in slip.tolist()]
    )
    exact = steady_stress + (1.0 + scene.imposed_normal_stress) * scene.b * left
    return float(np.abs(stress - exact).max())


def _compute_step_asymmetries(scene: Scene, log_slip_rate: float) -> dict[str, float]:
    """Compute the asymmetries between a step and the inverse step.

    The asymmetry is defined as the ratio of the stress change after one step to the stress change
    after the inverse step (in magnitude), minus 1. The dictionary contains the asymmetries of the
    direct effect and of the evolution to steady sliding. If sliding cannot be steady after one of
    the two steps, the dictionary is empty.
    """
    steady, inverse_steady = (
        scene.compute_steady_sliding(x) for x in (log_slip_rate, -log_slip_rate)
    )
    if steady is None or inverse_steady is None:
        return {}
    direct, inverse = (
        compute_frictional_stress_after_step(scene, x) for x in (log_slip_rate, -log_slip_rate)
    )
    evolves = direct - steady.frictional_stress
    inverse_evolves = inverse - inverse_steady.frictional_stress
    return {
        "direct_asymmetry": -direct / inverse - 1.0,
        "evolution_asymmetry": -evolves / inverse_evolves - 1.0,
    }


def compute_frictional_stress_after_step(scene: Scene, log_slip_rate: float) -> float:
    """Compute the frictional stress immediately after a slip rate step.

    The step changes the slip rate from V_* to V and does not change the state Psi.

    Parameters
    ----------
    scene : Scene
        Scene of the slider.
    log_slip_rate : float
        Logarithm ln(V/V_*) after the step.

    Returns
    -------
    float
        Deviation of frictional stress from steady sliding at V_*, in units of sigma_*.

    Raises
    ------
    MotionStopped
        With the status ``normal_stress_lost`` if a decrease of friction would open the fault, and
        with the status ``locked`` if no stress balances an increase of friction.
    """
    friction = scene.frictional_stress_from_strength(scene.a * log_slip_rate)
    if friction is None and log_slip_rate < 0.0:
        raise MotionStopped(
            Status.NORMAL_STRESS_LOST, "the normal stress vanishes due to the direct effect"
        )
    if friction is None:
        raise MotionStopped(Status.LOCKED, "no shear stress balances the direct effect")
    return friction
