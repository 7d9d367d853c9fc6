"""Elasticities, the relative sensitivities of a result to scene parameters."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base.measure import Measure, Outcome, OutputValue
from rsfstudy.motion import Integrator, MotionStopped
from rsfstudy.quantities import Output, Quantity
from rsfstudy.slider import Scene, SceneFields
from rsfstudy.status import Status

#: Fields of a scene that hold numbers.
NUMERIC_SCENE_FIELD_NAMES = tuple(
    name for name, kind in SceneFields.VALUE_TYPE_BY_NAME.items() if kind in (float, float | None)
)
#: Scene fields of shear heating, thermal pressurisation and flash heating. By default,
#: ``parameters`` does not contain these fields, so that the results of scenes without heating do
#: not change.
_HEATING_FIELDS_EXCLUDED_BY_DEFAULT = frozenset(
    {
        "heating", "cooling", "direct_activation", "evolution_activation", "pressurisation",
        "weakening_velocity_ratio", "weakened_friction", "weakening_exponent",
    }
)  # fmt: skip
#: Parameters of a rig that are not fields of a scene, and advice on computing elasticities with
#: respect to these parameters.
_RIG_QUANTITIES_THAT_ARE_NOT_SCENE_FIELDS = (
    "b",
    "slip_distance",
    "normal_stress",
    "sigma_star",
    "reference_velocity",
)
_REMEDY_FOR_ELASTICITY_OF_B = (
    "At constant a, the elasticities with respect to b and b_over_a are equal. Pass b_over_a."
)
_REMEDY_FOR_RIG_QUANTITY_ELASTICITIES = (
    "The elasticity follows from those with respect to stiffness (e_k) and reference_rate (e_r). "
    "For a time in s, the elasticity with respect to D_c is e_k - e_r + 1, the elasticity "
    "with respect to normal stress is -e_k, and the elasticity with respect to V_* is e_r - 1."
)
#: Largest finite-difference step of ln p for a parameter p. The finite-difference formula spans
#: four steps.
_MAX_LOG_PARAMETER_STEP = 0.05
#: Evaluation points of the finite-difference formula, in units of the step of ln p. The second
#: tuple contains the weights of the fourth difference.
_STENCIL, _FOURTH_DIFFERENCE_WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1.0, -4.0, 6.0, -4.0, 1.0)
#: Estimated truncation error of an elasticity, divided by the difference between the results of the
#: fourth-order and the second-order formula. In random scenes, the largest ratio of the true
#: truncation error to this difference is 0.14, and occurs with the largest steps.
_ERROR_OVER_RICHARDSON_CORRECTION = 0.25
#: Constants of the step selection. The first item contains fractions of the largest step of ln p.
#: The fractions are tried in turn if the result of the measure does not exist for a smaller or for
#: a larger parameter value, or if the relative error of the derivative exceeds the second item. The
#: third item limits the number of right-hand-side evaluations with a shorter step, divided by the
#: number of evaluations for the unchanged scene.
_STEP_FRACTIONS, _MAX_RELATIVE_ERROR, _MAX_EVALUATION_RATIO = (
    (1.0, 0.125, 0.125**2, 0.125**3),
    0.1,
    4,
)
#: Typical number of nonzero parameters of a scene.
_TYPICAL_PARAMETER_COUNT = 8


class _LogValueWithError(NamedTuple):
    """Value and error of ``ln|y|``.

    The error of ``ln|y|`` is the error of y divided by ``|y|``.
    """

    log_value: float
    log_value_error: float


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Elasticities(Measure):
    r"""Elasticities of the main result of a measure.

    An elasticity is the relative change of a result divided by the relative change of a scene
    parameter. For example, the elasticity is 2 if a result is proportional to the square of a
    parameter. All other parameters remain fixed. The elasticities and their errors are
    dimensionless and have the shape (parameters,).

    The elasticities are finite differences, so the measure is evaluated four times per parameter
    and once for the scene itself. If the result does not exist for a smaller or for a larger
    parameter value, for example near a stability boundary, the computation is repeated with up to
    three smaller changes of the parameter. If the scene is exactly at a stability boundary, such as
    the critical stiffness, the derivative is a one-sided difference.

    Parameters
    ----------
    measure : Measure
        A measure whose main result is a single number.
    parameters : tuple of str, optional
        Scene parameters, along the dimension ``parameter``. By default, the tuple contains all
        parameters that the measure does not solve for. The elasticity is NaN if the scene does not
        have the parameter, or if the parameter is zero.

    Raises
    ------
    InvalidValue
        If the main result is not a single number, or if a parameter is not a numeric field of the
        scene.

    Notes
    -----
    The elasticity of the result :math:`y` with respect to the parameter :math:`p` is

    .. math:: E = \frac{\partial \ln |y|}{\partial \ln p}.

    With the central differences :math:`D(h)` of :math:`\ln |y|` at :math:`\ln p \pm h`, the
    fourth-order formula is

    .. math:: E \approx \frac{4 D(h) - D(2h)}{3}.

    The step :math:`h` is the smaller of 0.05 and :math:`(e/2)^{1/3}`, with the relative error
    estimate :math:`e` of :math:`y`. The error estimate of an elasticity is the sum of three terms.
    The first term, about :math:`1.5\,e/h`, is the effect of the errors of :math:`y`. The second
    term is a quarter of the difference between the fourth-order and the second-order formula. The
    third term is a bound that follows from the fourth difference of :math:`\ln |y|`. Each shorter
    step is an eighth of the previous step.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import Elasticities, LinearStability
    >>> measure = Elasticities(LinearStability(), ("b_over_a", "a"))
    >>> outcome = measure(Scene(normal_stress="constant"), Accuracy())
    >>> outcome.values["elasticity"].round(3).tolist()
    [2.0, 1.0]
    """

    measure: Measure
    parameters: tuple[str, ...] = ()
    name: ClassVar[str] = "elasticities"
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)
    dimensions: ClassVar[Sequence[Quantity]] = (
        Quantity("parameter", "", "", "parameter of the scene that is varied"),
    )

    def __post_init__(self) -> None:
        """Check the measure and the parameters."""
        if (
            not isinstance(self.measure, Measure)
            or self.measure.variables[self.measure.primary_output]
        ):
            rule = "must be a Measure object whose primary output is a single number"
            raise InvalidValue("measure", self.measure, rule)
        object.__setattr__(
            self,
            "parameters",
            tuple(self.parameters)
            or tuple(
                n
                for n in self._differentiable_parameter_names
                if n not in _HEATING_FIELDS_EXCLUDED_BY_DEFAULT
            ),
        )
        for name in self.parameters:
            if name not in self._differentiable_parameter_names:
                is_solved = name in self.measure.solved_fields
                rule = (
                    f"must not contain fields that {self.measure.name} computes"
                    if is_solved
                    else "must contain only numeric scene fields"
                )
                choices, remedy = (
                    (
                        (),
                        _REMEDY_FOR_ELASTICITY_OF_B
                        if name == "b"
                        else _REMEDY_FOR_RIG_QUANTITY_ELASTICITIES,
                    )
                    if name in _RIG_QUANTITIES_THAT_ARE_NOT_SCENE_FIELDS
                    else (() if is_solved else self._differentiable_parameter_names, "")
                )
                raise InvalidValue("parameters", name, rule, choices=choices, remedy=remedy)

    @cached_property
    def _differentiable_parameter_names(self) -> tuple[str, ...]:
        return tuple(
            name for name in NUMERIC_SCENE_FIELD_NAMES if name not in self.measure.solved_fields
        )

    @property
    def primary_output(self) -> str:
        """Name of the main result of the inner measure."""
        return self.measure.primary_output

    @property
    def outputs(self) -> Sequence[Output]:
        """Main result of the inner measure, and the elasticities of this result."""
        given = {about.name: about for about in self.measure.outputs}
        headline = given.get(self.primary_output, Output(self.primary_output))
        text = f"d ln|y|/d ln p of {self.primary_output.replace('_', ' ')}"
        return (
            replace(headline, error=True),
            Output("elasticity", "", "1", text, dims=("parameter",), error=True),
        )

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Names of the parameters, as coordinate values of the dimension ``parameter``."""
        return {"parameter": np.array(self.parameters, dtype=object)}

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Scene fields that the inner measure solves for."""
        return self.measure.solved_fields

    @property
    def typical_rhs_evaluations(self) -> int:
        """Typical number of right-hand-side evaluations per cell."""
        return self.measure.typical_rhs_evaluations * (
            4 * min(_TYPICAL_PARAMETER_COUNT, len(self.parameters)) + 1
        )

    @property
    def relative_cost_by_digits(self) -> Mapping[float, float]:
        """Mapping from the requested number of digits to the relative cost."""
        return self.measure.relative_cost_by_digits

    def describe(self) -> dict[str, Any]:
        """Return the definition of the measure as plain data.

        Returns
        -------
        dict
            Name of the measure, definition of the inner measure, and parameters.
        """
        return {
            "name": self.name,
            "measure": self.measure.describe(),
            "parameters": list(self.parameters),
        }

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the main result of the inner measure, and the elasticities of this result.

        If the main result is zero, the status is ``not_applicable``, because zero has no logarithm.

        Parameters
        ----------
        scene : Scene
            Scene at which the derivatives are computed.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Main result, elasticities and error estimates. The message lists the parameters without
            an elasticity.
        """
        outcome = self.measure.run_nested(scene, integrator)
        if outcome.status is not Status.OK:
            return Outcome(outcome.status, message=outcome.message)
        names = self.primary_output, f"{self.primary_output}_error"
        values: dict[str, OutputValue] = {name: outcome.values.get(name, 0.0) for name in names}
        here = self._compute_log_of_primary_output(outcome)
        if here is None:
            why = f"{self.primary_output} is zero, so its logarithm does not exist"
            return Outcome(Status.NOT_APPLICABLE, values, why)
        accuracy = integrator.accuracy
        most = min(accuracy.budget, _MAX_EVALUATION_RATIO * (outcome.rhs_evaluations or 1))
        limited = integrator.with_accuracy(replace(accuracy, budget=most))
        step = min(_MAX_LOG_PARAMETER_STEP, (0.5 * here.log_value_error) ** (1.0 / 3.0))
        found = np.full((len(self.parameters), 2), np.nan)
        lacking, stated = [], scene.as_dict()
        for place, name in enumerate(self.parameters):
            if not stated.get(name):
                continue
            found[place] = self._differentiate_by_parameter(
                scene, name, here, step, (integrator, *3 * (limited,))
            )
            if np.isnan(found[place, 0]):
                lacking.append(name)
        values = {**values, "elasticity": found[:, 0], "elasticity_error": found[:, 1]}
        why = f"the measure has no result after a change of {', '.join(lacking)}" if lacking else ""
        return Outcome(Status.OK, values, why)

    def _differentiate_by_parameter(
        self,
        scene: Scene,
        parameter_name: str,
        central_value: _LogValueWithError,
        log_step: float,
        integrators: Sequence[Integrator],
    ) -> tuple[float, float]:
        """Compute the derivative with respect to one parameter, and its error.

        If the result does not exist for a smaller or for a larger parameter value, or if the error
        of the derivative is large, the derivative is computed again with shorter steps.

        Parameters
        ----------
        scene : Scene
            Scene at which the derivative is computed.
        parameter_name : str
            Name of the parameter.
        central_value : _LogValueWithError
            Value of ``ln|y|`` at the unchanged scene.
        log_step : float
            Largest step of ln p.
        integrators : sequence of Integrator
            Integrator for each step.

        Returns
        -------
        slope, error : float
            The derivative and its error. Both numbers are NaN if the result exists neither for a
            smaller nor for a larger parameter value.
        """
        found: list[tuple[bool, float, float]] = []
        for part, integrator in zip(_STEP_FRACTIONS, integrators, strict=True):
            size = part * log_step
            try:
                sides = [
                    self._evaluate_with_changed_parameter(
                        scene, parameter_name, by * size, integrator
                    )
                    for by in _STENCIL
                ]
            except MotionStopped:
                if not found:
                    raise
                break  # Some evaluations near the end of a solution branch exceed the budget.
            slope, error, of_levels = _compute_central_difference(central_value, sides, size)
            if found and not all(sides):
                # The truncation error of the previous step is eight times as large.
                error += 2.0 * abs(slope - found[-1][2])
            found.append((not all(sides), error, slope))
            told = error < max(2.0 * of_levels, _MAX_RELATIVE_ERROR * abs(slope))
            if not any(sides) or (all(sides) and told):
                break
        _one_sided, error, slope = found[-1] if found[-1][0] else min(found)
        return slope, error

    def _evaluate_with_changed_parameter(
        self,
        scene: Scene,
        parameter_name: str,
        log_change: float,
        integrator: Integrator,
    ) -> _LogValueWithError | None:
        """Change the logarithm of a parameter, and compute ``ln|y|`` for the changed scene.

        Parameters
        ----------
        scene : Scene
            Scene before the change.
        parameter_name : str
            Name of the parameter.
        log_change : float
            Change of ln p.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        _LogValueWithError or None
            None if the changed scene is invalid or has no numerical result.

        Raises
        ------
        MotionStopped
            If the computation fails.
        """
        try:
            beside = scene.with_(
                **{parameter_name: getattr(scene, parameter_name) * math.exp(log_change)}
            )
        except InvalidValue:
            return None
        outcome = self.measure.run_nested(beside, integrator)
        if not outcome.status.is_answer:
            where = f"at {parameter_name} = {getattr(beside, parameter_name):.9g}"
            raise MotionStopped(outcome.status, f"{where}: {outcome.message}")
        return self._compute_log_of_primary_output(outcome)

    def _compute_log_of_primary_output(self, outcome: Outcome) -> _LogValueWithError | None:
        """Return ``ln|y|`` for an outcome, with an error that includes rounding errors.

        Returns
        -------
        _LogValueWithError or None
            None if the outcome has no main result, or if the main result is zero.
        """
        y = float(outcome.values[self.primary_output]) if outcome.status is Status.OK else 0.0
        if not y:
            return None
        value, error = (
            math.log(abs(y)),
            float(outcome.values.get(f"{self.primary_output}_error", 0.0)),
        )
        return _LogValueWithError(
            value, error / abs(y) + 4.0 * sys.float_info.epsilon * (1.0 + abs(value))
        )


def _compute_central_difference(
    central_value: _LogValueWithError,
    neighbouring_values: Sequence[_LogValueWithError | None],
    log_step: float,
) -> tuple[float, float, float]:
    """Compute the derivative of ``ln|y|`` with respect to ln p.

    Parameters
    ----------
    central_value : _LogValueWithError
        Value of ``ln|y|`` at the unchanged scene.
    neighbouring_values : sequence of _LogValueWithError or None
        Values at the points of ``_STENCIL``, or None for missing values.
    log_step : float
        Step of ln p.

    Returns
    -------
    slope, error, of_levels : float
        The derivative, its error, and the contribution of the errors of y to this error. All three
        numbers are NaN if the values are missing both for smaller and for larger parameter values.
    """
    far_below, below, above, far_above = neighbouring_values
    if far_below and below and above and far_above:
        near = (above.log_value - below.log_value) / (2.0 * log_step)
        far = (far_above.log_value - far_below.log_value) / (4.0 * log_step)
        of_levels = (above.log_value_error + below.log_value_error) / 1.5 + (
            far_above.log_value_error + far_below.log_value_error
        ) / 12.0
        of_levels /= log_step
        correction = (near - far) / 3.0
        levels = far_below, below, central_value, above, far_above
        fourth = abs(
            sum(
                w * level.log_value
                for w, level in zip(_FOURTH_DIFFERENCE_WEIGHTS, levels, strict=True)
            )
        )
        # The bound assumes that the fifth derivative is at most the fourth derivative divided by
        # the distance of the outer points.
        left = _ERROR_OVER_RICHARDSON_CORRECTION * abs(correction) + fourth / (12.0 * log_step)
        return near + correction, left + of_levels, of_levels
    if below and above:
        slope = (above.log_value - below.log_value) / (2.0 * log_step)
        bend = abs(above.log_value - 2.0 * central_value.log_value + below.log_value) / log_step
        of_levels = (above.log_value_error + below.log_value_error) / (2.0 * log_step)
        return slope, max(log_step**2, bend) + of_levels, of_levels
    for beside, sign in ((below, -1.0), (above, 1.0)):
        if beside:
            slope = sign * (beside.log_value - central_value.log_value) / log_step
            # The curvature is unknown. The estimate assumes twice the curvature of a logarithm
            # with this slope.
            of_levels = (beside.log_value_error + central_value.log_value_error) / log_step
            return slope, log_step * max(1.0, slope**2) + of_levels, of_levels
    return math.nan, math.nan, math.nan
