r"""Estimation of friction parameters by generalised least squares.

The class ``FitProblem`` minimises :math:`|W (y - f(\theta))|^2` with respect to the parameters
:math:`\theta`, where :math:`y` is the recorded friction and :math:`f` is the model [1]_. The matrix
:math:`W` whitens the noise, so that :math:`W^T W` is the inverse of the correlation matrix
:math:`R` of the noise. The algorithm estimates the parameters and the noise in turn. The covariance
matrix of the parameters is

.. math:: s^2 (J^T R^{-1} J)^{-1}, \qquad s^2 = \frac{|W (y - f)|^2}{n - p},

where :math:`J` is the Jacobian of the model, :math:`n` is the number of rows, and :math:`p` is the
number of parameters. The friction of the model also depends on the step times and step velocities.
Each column of a matrix :math:`G` contains the change in friction due to one independent error of
the steps (see ``load_point_noise``). The step errors add :math:`A A^T` to the covariance matrix,
with :math:`A = (J^T R^{-1} J)^{-1} J^T R^{-1} G`. The noise is estimated by restricted maximum
likelihood [2]_.

References
----------
.. [1] Seber and Wild (1989), Nonlinear Regression, Wiley, chapters 2 and 6.
.. [2] Patterson and Thompson (1971), Biometrika 58, 545-554.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from rsfstudy.fitting import noise_models as noises
from rsfstudy.fitting.fit_solution import FitSolution as FitSolution
from rsfstudy.fitting.fit_solution import compute_aic
from rsfstudy.fitting.joint_window_model import JointWindowModel
from rsfstudy.fitting.noise_models import NoiseModel
from rsfstudy.fitting.outliers import find_non_outlier_mask, find_rounding_quantum
from rsfstudy.fitting.window_model import (
    ACCURATE_DIFFERENCE_SCHEME,
    LOGARITHMIC_PARAMETERS,
    QUICK_DIFFERENCE_SCHEME,
    FiniteDifferenceScheme,
    ParameterValues,
    compute_derivative_by_fit_coordinate,
    convert_fit_coordinate_to_parameter,
    convert_parameter_to_fit_coordinate,
)
from rsfstudy.motion import MotionStopped
from rsfstudy.status import Status

#: Lower and upper bounds of the fitted parameters.
_PARAMETER_BOUNDS = {
    "a": (1e-4, 1.0),
    "b": (-1.0, 1.0),
    "b1": (-1.0, 1.0),
    "b2": (-1.0, 1.0),
    "alpha": (0.0, 2.0),
    "law_exponent": (0.0, 1.0),
}
#: Largest logarithm of the ratio between the stiffness and its initial guess.
_MAX_LOG_STIFFNESS_OVER_GUESS = math.log(1e4)
#: Upper bound of the slip distance, relative to the load point displacement of the window. The
#: lower bound of the slip distance is the mean load point displacement between two rows.
_MAX_SLIP_DISTANCE_OVER_DISPLACEMENT = 10.0
#: The bounds of the logarithm of the second slip distance are shifted by this value from the bounds
#: for the first slip distance, so that the second slip distance is always longer.
_MIN_LOG_GAP_BETWEEN_SLIP_DISTANCES = 1e-6
#: Tested initial values of the slip distance, relative to the initial guess.
_TESTED_SLIP_DISTANCES_OVER_FIRST_GUESS = (0.1, 0.3, 1.0, 3.0, 10.0)
#: Settings of the search. The first value is the largest number of iterations. Each iteration
#: estimates the noise and the parameters. The iterations end if the changes in the parameters in
#: standard errors are smaller than the second value. The third value is the largest number of model
#: evaluations per iteration, and the fourth value is the relative tolerance of the search. The last
#: two settings apply to the final Gauss-Newton steps. The fifth setting contains the smallest
#: number of Gauss-Newton steps, the largest number of steps that do not shrink, and the largest
#: number of all steps. A Gauss-Newton step shrinks if the ratio of its length to the length of the
#: previous step is less than the last value.
(
    _MAX_NOISE_ESTIMATION_PASSES,
    _NOISE_PASS_TOLERANCE,
    _MAX_MODEL_EVALUATIONS,
    _LEAST_SQUARES_XTOL,
    _NEWTON_STEP_COUNT_LIMITS,
    _MAX_NEWTON_STEP_SHRINK_RATIO,
) = 4, 0.05, 200, 1e-8, (2, 8, 24), 0.9
#: Options of ``scipy.optimize.least_squares``.
_LEAST_SQUARES_OPTIONS = {
    "x_scale": "jac",
    "xtol": _LEAST_SQUARES_XTOL,
    "gtol": 1e-12,
    "max_nfev": _MAX_MODEL_EVALUATIONS,
}
#: The fit has converged if the length of the last Gauss-Newton step in standard errors is less than
#: this value.
_NEWTON_STEP_TOLERANCE_IN_STDERRS = 1e-3
#: Lower bound for the degrees of freedom of confidence intervals.
_MIN_DEGREES_OF_FREEDOM = 3.0
#: Criteria for parameters that the record constrains. The first value is the largest standard error
#: of the logarithm of a parameter. For a, b, b1 and b2, it is the largest standard error relative
#: to the largest of these parameters. The record constrains the slip distance only if the evolution
#: effect in standard errors exceeds the second value.
_MAX_STDERR_OF_IDENTIFIED_PARAMETER, _MIN_EVOLUTION_EFFECT_SIGMAS = 0.5, 2.0
#: Smallest difference between the AIC of the model without a response to the steps and the AIC of
#: the model with a response. If the difference is smaller, the record shows no response.
_MIN_AIC_DECREASE_BY_STEP_RESPONSE = 10.0


class FitProblem:
    """Least-squares problem for the free parameters of a model.

    Parameters
    ----------
    model : JointModel
        Model of the windows.
    initial_values : mapping of str to float
        Values of all parameters. The values of the free parameters are initial guesses.
    free_parameters : sequence of str
        Names of the free parameters.
    noise_model_name : str
        Noise model (see ``rsfstudy.fitting.noise_models.fit_noise_model``).
    stiffness_relative_stderr : float, default: 0.0
        Relative standard error of a fixed stiffness.

    Attributes
    ----------
    lower_bounds, upper_bounds : ndarray, shape (parameters,)
        Bounds of the coordinates of the free parameters.
    friction_rounding_quantum : float
        Rounding unit of the recorded friction, or 0 if friction is not rounded.
    has_converged : bool
        True if the last search converged.
    """

    def __init__(
        self,
        model: JointWindowModel,
        initial_values: ParameterValues,
        free_parameters: Sequence[str],
        noise_model_name: str,
        stiffness_relative_stderr: float = 0.0,
    ) -> None:
        self.stiffness_relative_stderr = stiffness_relative_stderr
        self.model, self.free_parameters, self.noise_model_name = (
            model,
            tuple(free_parameters),
            noise_model_name,
        )
        self.initial_values, self.has_converged = dict(initial_values), True
        self.ordinary_least_squares_residuals = np.zeros(0)
        self.friction_rounding_quantum = max(
            find_rounding_quantum(part) for part in model.recorded_friction_per_window
        )
        self.lower_bounds, self.upper_bounds = np.array(
            [self._compute_fit_coordinate_bounds(name) for name in free_parameters]
        ).T

    def _compute_fit_coordinate_bounds(self, parameter_name: str) -> tuple[float, float]:
        """Return the lower and upper bounds of a free parameter's coordinate."""
        if parameter_name.startswith("slip_distance"):
            moved = self.model.load_point_displacement
            extent = float(np.ptp(moved))
            low, high = (
                math.log(extent / len(moved)),
                math.log(_MAX_SLIP_DISTANCE_OVER_DISPLACEMENT * extent),
            )
            # If both slip distances are at a bound, the second slip distance is longer.
            return (
                (low + _MIN_LOG_GAP_BETWEEN_SLIP_DISTANCES, high)
                if parameter_name.endswith("_2")
                else (low, high - _MIN_LOG_GAP_BETWEEN_SLIP_DISTANCES)
            )
        if parameter_name in LOGARITHMIC_PARAMETERS:
            at = math.log(self.initial_values[parameter_name])
            return at - _MAX_LOG_STIFFNESS_OVER_GUESS, at + _MAX_LOG_STIFFNESS_OVER_GUESS
        if parameter_name.startswith("step_time"):
            late = self.model.find_longest_allowed_loading_delay(parameter_name)
            return -late, late
        return _PARAMETER_BOUNDS.get(parameter_name, (-math.inf, math.inf))

    def compute_parameter_values(self, fit_coordinates: np.ndarray) -> dict[str, float]:
        """Convert coordinates to the values of all parameters.

        Parameters
        ----------
        fit_coordinates : ndarray, shape (parameters,)
            Coordinates of the free parameters.

        Returns
        -------
        dict of {str: float}
            Values of all parameters.
        """
        found = zip(self.free_parameters, fit_coordinates.tolist(), strict=True)
        return self.initial_values | {
            name: convert_fit_coordinate_to_parameter(name, v) for name, v in found
        }

    def compute_fit_coordinates(self, parameter_values: ParameterValues) -> np.ndarray:
        """Convert the values of parameters to coordinates.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.

        Returns
        -------
        ndarray, shape (parameters,)
            Coordinates of the free parameters.
        """
        return np.array(
            [
                convert_parameter_to_fit_coordinate(name, parameter_values[name])
                for name in self.free_parameters
            ]
        )

    def compute_residuals(
        self, parameter_values: ParameterValues, *, require_stable: bool = False
    ) -> np.ndarray:
        """Compute the residuals: recorded friction minus model friction and trend.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.
        require_stable : bool, default: False
            If True, the motion is computed only if the stiffness exceeds the critical stiffness.

        Returns
        -------
        ndarray, shape (rows,)
            Residuals. If the simulation of a window fails, the residuals of the window are NaN.
        """
        curve = self.model.compute_model_friction(parameter_values, require_stable=require_stable)
        return np.asarray(
            self.model.recorded_friction
            - curve
            - self.model.compute_friction_trend(parameter_values)
        )

    def _compute_jacobian(
        self, fit_coordinates: np.ndarray, difference_scheme: FiniteDifferenceScheme
    ) -> np.ndarray:
        """Compute the Jacobian matrix of the model friction.

        The Jacobian contains the derivatives with respect to the coordinates of the free
        parameters. A derivative is set to 0 if a simulation for its finite difference fails.
        """
        found = self.model.compute_jacobian(
            self.compute_parameter_values(fit_coordinates),
            self.free_parameters,
            difference_scheme,
        )
        return np.where(np.isfinite(found).all(axis=0), found, 0.0)

    def solve(self) -> FitSolution:
        """Estimate the parameters and the noise.

        Returns
        -------
        FitSolution
            Parameters, errors and noise of the fit.

        Raises
        ------
        MotionStopped
            If all simulations of the record fail, if the work budget is exhausted, or if the search
            does not converge although the record constrains all parameters.
        """
        x, noise = (
            self._find_initial_fit_coordinates(),
            noises.build_white_noise_model(self.model.time_since_start_of_each_window),
        )
        for number in range(
            1
            if self.noise_model_name == noises.WHITE_NOISE_NAME
            and len(noise.relative_noise_levels) == 1
            else _MAX_NOISE_ESTIMATION_PASSES
        ):
            before = x
            x, jacobian = self.minimise_weighted_squares(x, noise)
            left = self.compute_residuals(self.compute_parameter_values(x))
            if not number:
                self.ordinary_least_squares_residuals = left
            if number and _has_converged(
                x - before, noise.whiten_columns(np.column_stack([jacobian, left]))
            ):
                break
            kept = find_non_outlier_mask(
                left, self.model.recorded_friction - left, self.friction_rounding_quantum
            )
            least = self.friction_rounding_quantum / math.sqrt(12.0)
            noise = noises.fit_noise_model(
                self.noise_model_name,
                self.model.time_since_start_of_each_window,
                left,
                jacobian,
                kept,
                least,
                self.model.friction_averaging_time,
            )
        found = self._build_solution(x, noise)
        if not (self.has_converged or found.unidentified_parameters):
            text = f"the search did not converge within {_MAX_MODEL_EVALUATIONS} model evaluations"
            raise MotionStopped(Status.ACCURACY_OUT_OF_REACH, text)
        return found

    def _find_initial_fit_coordinates(self) -> np.ndarray:
        """Return the initial coordinates, after choosing the best of several slip distances.

        The best slip distance is the slip distance with the smallest sum of squared residuals.
        """
        # Check the initial guess, because the search treats invalid parameters like failed
        # simulations.
        self.model.check_parameters_define_valid_scenes(self.initial_values)
        scales = (
            _TESTED_SLIP_DISTANCES_OVER_FIRST_GUESS
            if "slip_distance" in self.free_parameters
            else (1.0,)
        )
        distances = [n for n in ("slip_distance", "slip_distance_2") if n in self.free_parameters]
        linear = [n for n in self.free_parameters if self.model.is_linear_in_parameter(n)]
        columns = self.model.compute_jacobian(self.initial_values, linear) if linear else None
        best = (math.inf, self.initial_values)
        for scale in scales:
            values = self.initial_values | {n: self.initial_values[n] * scale for n in distances}
            values = self.compute_parameter_values(
                np.clip(
                    self.compute_fit_coordinates(values),
                    self.lower_bounds,
                    self.upper_bounds,
                )
            )
            left = self.compute_residuals(values, require_stable=True)
            if columns is not None and np.isfinite(left).all():
                moved = np.linalg.lstsq(columns, left)[0]
                left = left - columns @ moved
                values |= {n: values[n] + v for n, v in zip(linear, moved.tolist(), strict=True)}
            best = min(best, (float(left @ left), values), key=lambda found: (found[0],))
        if not math.isfinite(best[0]):
            text = "the motion for the first guess cannot be computed, or the stiffness is below "
            raise MotionStopped(Status.NOT_APPLICABLE, f"{text}the critical stiffness")
        return self.compute_fit_coordinates(best[1])

    def minimise_weighted_squares(
        self,
        initial_fit_coordinates: np.ndarray,
        noise_model: NoiseModel,
        cost_tolerance: float = _LEAST_SQUARES_XTOL,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Minimise the sum of squared whitened residuals for a fixed noise model.

        The search uses the trust-region method of ``scipy.optimize.least_squares`` within the
        bounds.

        Parameters
        ----------
        initial_fit_coordinates : ndarray, shape (parameters,)
            Initial coordinates.
        noise_model : NoiseModel
            Noise model that whitens the residuals.
        cost_tolerance : float, optional
            Relative tolerance of the sum of squares. The default is 1e-8.

        Returns
        -------
        coordinates : ndarray, shape (parameters,)
            Coordinates at the minimum.
        jacobian : ndarray, shape (rows, parameters)
            Derivatives of the model at the minimum.
        """
        derivatives = {}

        def left(x: np.ndarray) -> np.ndarray:
            found = self.compute_residuals(self.compute_parameter_values(x), require_stable=True)
            return np.asarray(noise_model.whiten_columns(found[:, None])[:, 0] / scale)

        def slopes(x: np.ndarray) -> np.ndarray:
            derivatives["last"] = self._compute_jacobian(x, QUICK_DIFFERENCE_SCHEME)
            return -noise_model.whiten_columns(derivatives["last"]) / scale

        scale = 1.0
        inner = np.clip(initial_fit_coordinates, self.lower_bounds + 1e-9, self.upper_bounds - 1e-9)
        scale = math.sqrt(float(np.square(left(inner)).mean())) or 1.0
        # The simulation at the initial coordinates fails, so the search cannot start.
        if not math.isfinite(scale):
            self.has_converged = True
            return initial_fit_coordinates, self._compute_jacobian(
                initial_fit_coordinates, QUICK_DIFFERENCE_SCHEME
            )
        bounds = self.lower_bounds, self.upper_bounds
        found = least_squares(
            left, inner, slopes, bounds, ftol=cost_tolerance, **_LEAST_SQUARES_OPTIONS
        )
        self.has_converged = found.status != 0
        return found.x, derivatives["last"]

    def _build_solution(self, fit_coordinates: np.ndarray, noise_model: NoiseModel) -> FitSolution:
        """Compute the final parameters, their errors and the noise.

        First, Gauss-Newton steps :math:`(J^T R^{-1} J)^{-1} J^T R^{-1} (y - f)` with accurate
        derivatives refine the parameters. The numerical error of a parameter is the sum of two
        terms: the last Gauss-Newton step, and three times the change in the parameter when the
        integration tolerances are reduced by a factor of ten. For p parameters and n rows, the
        number of degrees of freedom of the fit is (n - p)/n times the number of degrees of freedom
        of the noise.
        """
        change = math.inf
        for number in range(_NEWTON_STEP_COUNT_LIMITS[2]):
            jacobian = self._compute_jacobian(fit_coordinates, ACCURATE_DIFFERENCE_SCHEME)
            left = self.compute_residuals(self.compute_parameter_values(fit_coordinates))
            whitened = noise_model.whiten_columns(np.column_stack([jacobian, left]))
            if not np.isfinite(whitened).all():
                raise MotionStopped(
                    Status.INTEGRATION_FAILED, "the motion for the best fit cannot be computed"
                )
            beyond = np.clip(
                fit_coordinates + _solve_linear_least_squares(whitened),
                self.lower_bounds,
                self.upper_bounds,
            )
            moved = beyond - fit_coordinates
            before, change = change, float(np.linalg.norm(whitened[:, :-1] @ moved))
            if np.isfinite(
                self.compute_residuals(self.compute_parameter_values(beyond), require_stable=True)
            ).all():
                fit_coordinates = beyond
            if number + 1 >= _NEWTON_STEP_COUNT_LIMITS[0] and _has_converged(
                moved, whitened, _NEWTON_STEP_TOLERANCE_IN_STDERRS
            ):
                break
            # Gauss-Newton steps due to rounding errors do not shrink, but steps due to large
            # residuals shrink.
            if (
                number + 1 >= _NEWTON_STEP_COUNT_LIMITS[1]
                and not change < _MAX_NEWTON_STEP_SHRINK_RATIO * before
            ):
                break
        values = self.compute_parameter_values(fit_coordinates)
        curve = self.model.compute_model_friction(values)
        left = self.model.recorded_friction - curve - self.model.compute_friction_trend(values)
        innovations = noise_model.whiten_columns(left[:, None])[:, 0]
        count = len(innovations)
        free_of = count - len(fit_coordinates)
        size = math.sqrt(float(innovations @ innovations) / free_of)
        inverse = _compute_inverse_normal_matrix(whitened[:, :-1])
        by_noise = covariance = size**2 * inverse
        moved_by = self.model.compute_friction_change_by_loading_error(values)
        if moved_by.size and np.isfinite(inverse).all():
            shifts = inverse @ whitened[:, :-1].T @ noise_model.whiten_columns(moved_by)
            covariance = by_noise + shifts @ shifts.T
        by_stiffness = self._compute_covariance_from_stiffness_error(
            values, inverse, whitened, noise_model
        )
        covariance = covariance + by_stiffness
        degrees = max(
            noise_model.low_frequency_noise_degrees_of_freedom * free_of / count,
            _MIN_DEGREES_OF_FREEDOM,
        )
        finer = self.model.compute_model_friction(values, with_refined_tolerances=True) - curve
        with np.errstate(invalid="ignore"):  # The inverse is infinite if a derivative is zero.
            off = np.abs(
                inverse @ whitened[:, :-1].T @ noise_model.whiten_columns(finer[:, None])[:, 0]
            )
        slopes = [
            compute_derivative_by_fit_coordinate(name, values[name])
            for name in self.free_parameters
        ]
        errors = (3.0 * off + np.abs(moved)) * slopes
        criterion = compute_aic(innovations, noise_model, len(fit_coordinates), len(left))
        steps = (
            self._compute_aic_without_step_response(jacobian, noise_model) - criterion
            > _MIN_AIC_DECREASE_BY_STEP_RESPONSE
        )
        return FitSolution(
            parameter_values=values,
            free_parameters=self.free_parameters,
            fit_coordinate_covariance=covariance,
            fit_coordinate_covariance_from_noise=by_noise,
            fit_coordinate_covariance_from_stiffness=by_stiffness,
            parameter_numerical_errors=dict(
                zip(self.free_parameters, errors.tolist(), strict=True)
            ),
            noise_model=noise_model,
            noise_sd=size,
            degrees_of_freedom=degrees,
            model_friction=curve,
            residuals=left,
            whitened_residuals=innovations / size,
            jacobian=jacobian,
            friction_change_by_loading_error=moved_by,
            aic=criterion,
            unidentified_parameters=self._find_unidentified_parameters(
                fit_coordinates, values, covariance, steps
            ),
            ols_residual_rms=float(
                np.sqrt(
                    np.mean(
                        np.square(
                            noise_model.drop_outlier_rows(self.ordinary_least_squares_residuals)
                        )
                    )
                )
            ),
            friction_rounding_quantum=self.friction_rounding_quantum,
        )

    def _compute_covariance_from_stiffness_error(
        self,
        parameter_values: ParameterValues,
        inverse_normal_matrix: np.ndarray,
        whitened_jacobian_and_residuals: np.ndarray,
        noise_model: NoiseModel,
    ) -> np.ndarray:
        """Return the parameter covariance that is caused by the error of a fixed stiffness."""
        if not (self.stiffness_relative_stderr and np.isfinite(inverse_normal_matrix).all()):
            return np.zeros_like(inverse_normal_matrix)
        by_stiffness = self.stiffness_relative_stderr * self.model.compute_jacobian(
            parameter_values, ["stiffness"]
        )
        shifts = (
            inverse_normal_matrix
            @ whitened_jacobian_and_residuals[:, :-1].T
            @ noise_model.whiten_columns(by_stiffness)
        )
        return np.asarray(shifts @ shifts.T)

    def _compute_aic_without_step_response(
        self, jacobian: np.ndarray, noise_model: NoiseModel
    ) -> float:
        """Compute the AIC of a model in which friction does not respond to the steps.

        In this model, friction has only trends, and the parameters a and b are zero. The
        computation uses the noise model of the fit, because a newly estimated noise model would
        describe the response to the steps as correlated noise.
        """
        linear = [self.model.is_linear_in_parameter(name) for name in self.free_parameters]
        columns = np.column_stack([jacobian[:, linear], self.model.recorded_friction])
        if not any(name.startswith("mu_star") for name in self.free_parameters):
            columns = np.insert(columns, 0, 1.0, axis=1)
        whitened = noise_model.whiten_columns(columns)
        innovations = whitened[:, -1] - whitened[:, :-1] @ _solve_linear_least_squares(whitened)
        return compute_aic(innovations, noise_model, columns.shape[1] - 1, len(columns))

    def _find_unidentified_parameters(
        self,
        fit_coordinates: np.ndarray,
        parameter_values: ParameterValues,
        fit_coordinate_covariance: np.ndarray,
        friction_responds_to_steps: bool,
    ) -> tuple[str, ...]:
        """Return the free parameters that the record does not constrain.

        If the record shows no response to the steps, it can constrain only parameters with a linear
        effect on friction.
        """
        spread = dict(
            zip(
                self.free_parameters,
                np.sqrt(np.diag(fit_coordinate_covariance)).tolist(),
                strict=True,
            )
        )
        bound = (fit_coordinates - self.lower_bounds < 1e-6) | (
            self.upper_bounds - fit_coordinates < 1e-6
        )
        effects = {
            "slip_distance": "b" if "b" in parameter_values else "b1",
            "slip_distance_2": "b2",
        }
        largest = max(abs(parameter_values.get(n, 0.0)) for n in ("a", "b", "b1", "b2"))
        found = []
        for name, at_bound in zip(self.free_parameters, bound.tolist(), strict=True):
            told = math.isfinite(spread[name])
            if name in LOGARITHMIC_PARAMETERS or name == "law_exponent":
                told = spread[name] < _MAX_STDERR_OF_IDENTIFIED_PARAMETER and not (
                    at_bound and name in LOGARITHMIC_PARAMETERS
                )
            elif name in ("a", "b", "b1", "b2"):
                told = spread[name] < _MAX_STDERR_OF_IDENTIFIED_PARAMETER * largest and not at_bound
            effect = effects.get(name, "")
            if effect in spread:
                told = (
                    told
                    and abs(parameter_values[effect])
                    > _MIN_EVOLUTION_EFFECT_SIGMAS * spread[effect]
                )
            if not told or not (
                friction_responds_to_steps or self.model.is_linear_in_parameter(name)
            ):
                found.append(name)
        return tuple(found)

    def compute_parameter_bounds(self, parameter_name: str) -> tuple[float, float]:
        """Return the bounds of a parameter in the search.

        Parameters
        ----------
        parameter_name : str
            Name of a free parameter.

        Returns
        -------
        low : float
            Lower bound of the parameter, or NaN if there is no lower bound.
        high : float
            Upper bound of the parameter, or NaN if there is no upper bound.
        """
        place = self.free_parameters.index(parameter_name)
        ends = self.lower_bounds[place], self.upper_bounds[place]
        low, high = (
            convert_fit_coordinate_to_parameter(parameter_name, v) if math.isfinite(v) else math.nan
            for v in ends
        )
        return low, high


def _solve_linear_least_squares(predictor_and_target_columns: np.ndarray) -> np.ndarray:
    """Compute the coefficients of a linear least-squares problem.

    The last column of the array is approximated by a linear combination of the other columns. The
    result contains the coefficients of the other columns.
    """
    return np.asarray(
        np.linalg.lstsq(predictor_and_target_columns[:, :-1], predictor_and_target_columns[:, -1])[
            0
        ]
    )


def _has_converged(
    last_fit_coordinate_change: np.ndarray,
    whitened_jacobian_and_residuals: np.ndarray,
    tolerance: float = _NOISE_PASS_TOLERANCE,
) -> bool:
    """Return True if the last change in each parameter is well below its standard error.

    Parameters
    ----------
    last_fit_coordinate_change : ndarray, shape (parameters,)
        Last change in the coordinates of the free parameters.
    whitened_jacobian_and_residuals : ndarray, shape (rows, parameters + 1)
        Whitened derivatives, followed by the whitened residuals.
    tolerance : float
        Largest change in the coordinate of a parameter, as a fraction of the standard error of the
        coordinate.
    """
    size = np.linalg.norm(whitened_jacobian_and_residuals[:, -1]) / math.sqrt(
        len(whitened_jacobian_and_residuals)
    )
    spread = size * np.sqrt(
        np.diag(_compute_inverse_normal_matrix(whitened_jacobian_and_residuals[:, :-1]))
    )
    return bool((np.abs(last_fit_coordinate_change) <= tolerance * spread).all())


def _compute_inverse_normal_matrix(jacobian: np.ndarray) -> np.ndarray:
    """Compute the inverse of the normal matrix, :math:`(J^T J)^{-1}`.

    All elements of the result are infinite if a column of :math:`J` is zero or not finite.
    """
    sizes = np.linalg.norm(jacobian, axis=0)
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        return np.full((jacobian.shape[1],) * 2, math.inf)
    _u, values, turned = np.linalg.svd(jacobian / sizes, full_matrices=False)
    values = np.maximum(values, 1e-14 * values[0])
    root = turned.T / values
    return np.asarray((root @ root.T) / np.outer(sizes, sizes))
