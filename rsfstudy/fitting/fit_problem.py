r"""Estimation of friction parameters by generalised least squares.

The class ``FitProblem`` minimises :math:`|W (y - f(p))|^2` with respect to the parameters
:math:`p`, where :math:`y` is the recorded friction and :math:`f` is the model [1]_. The matrix
:math:`W` whitens the noise, so that :math:`W^T W` is the inverse of the correlation matrix
:math:`R` of the noise. The parameters and the noise are estimated in turn. The covariance matrix of
the parameters is

.. math:: s^2 (J^T R^{-1} J)^{-1}, \qquad s^2 = \frac{|W (y - f)|^2}{n - p},

with the derivatives :math:`J` of the model, for :math:`n` rows and :math:`p` parameters. Errors of
the times and velocities of steps change the model by the columns of a matrix :math:`G` (see
``load_point_errors``). These errors add :math:`A A^T` to the covariance matrix, with
:math:`A = (J^T R^{-1} J)^{-1} J^T R^{-1} G`. The noise is estimated by restricted maximum
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

from rsfstudy.fitting import noise as noises
from rsfstudy.fitting.fit_solution import FitSolution as FitSolution
from rsfstudy.fitting.fit_solution import compute_aic
from rsfstudy.fitting.joint_model import JointModel
from rsfstudy.fitting.noise import NoiseModel
from rsfstudy.fitting.outliers import find_kept_mask, find_quantum
from rsfstudy.fitting.window_model import (
    FINE_DIFFERENCES,
    LOGARITHMIC_PARAMETERS,
    QUICK_DIFFERENCES,
    DifferenceScheme,
    Values,
    coordinate_derivative,
    from_coordinate,
    to_coordinate,
)
from rsfstudy.motion import MotionStopped
from rsfstudy.status import Status

#: Bounds of parameters.
_PARAMETER_BOUNDS = {
    "a": (1e-4, 1.0),
    "b": (-1.0, 1.0),
    "b1": (-1.0, 1.0),
    "b2": (-1.0, 1.0),
    "alpha": (0.0, 2.0),
    "law_exponent": (0.0, 1.0),
}
#: Largest difference between the logarithms of the stiffness and of its initial guess.
_MAX_LOG_STIFFNESS_CHANGE = math.log(1e4)
#: Largest slip distance relative to the displacement of the window. The smallest slip distance is
#: the mean displacement between two rows.
_MAX_RELATIVE_SLIP_DISTANCE = 10.0
#: Difference between the logarithmic bounds of the first and the second slip distance.
_MIN_LOG_DISTANCE_GAP = 1e-6
#: Initial slip distances that are tested, relative to the initial guess.
_INITIAL_DISTANCE_FACTORS = (0.1, 0.3, 1.0, 3.0, 10.0)
#: Largest number of passes that estimate the noise and the parameters in turn, change of the
#: parameters relative to their standard errors at which the passes end, largest number of model
#: evaluations per pass, and relative tolerance of the search. The last two items limit the final
#: Gauss-Newton steps. They are the smallest number of steps, the largest number of steps that do
#: not shrink, the largest number of steps, and the ratio below which successive steps shrink.
(
    _MAX_PASSES,
    _PASS_TOLERANCE,
    _MAX_CURVES,
    _SEARCH_TOLERANCE,
    _NEWTON_STEP_COUNTS,
    _MAX_SHRINK_FACTOR,
) = 4, 0.05, 200, 1e-8, (2, 8, 24), 0.9
#: Options of ``scipy.optimize.least_squares``.
_LEAST_SQUARES_OPTIONS = {
    "x_scale": "jac",
    "xtol": _SEARCH_TOLERANCE,
    "gtol": 1e-12,
    "max_nfev": _MAX_CURVES,
}
#: Largest final Gauss-Newton step, relative to the standard errors.
_NEWTON_TOLERANCE = 1e-3
#: Lower bound for the degrees of freedom of confidence intervals.
_MIN_DEGREES_OF_FREEDOM = 3.0
#: Largest standard error of an identified parameter, and smallest evolution effect in standard
#: errors for which its slip distance is identified. The first limit applies to the logarithm of a
#: parameter, or to a and b relative to the largest effect.
_MAX_IDENTIFIED_STDERR, _MIN_EFFECT_SIGMAS = 0.5, 2.0
#: Smallest decrease of the AIC due to the response to the steps.
_MIN_AIC_GAIN = 10.0


class FitProblem:
    """Least-squares problem for the free parameters of a model.

    Parameters
    ----------
    model : JointModel
        Model of the windows.
    values : mapping of str to float
        Values of all parameters. The values of the free parameters are the initial guess.
    free : sequence of str
        Names of the free parameters.
    noise : str
        Noise model (see ``rsfstudy.fitting.noise.fit_noise``).

    Attributes
    ----------
    lower_bounds, upper_bounds : ndarray, shape (parameters,)
        Bounds of the coordinates of the free parameters.
    quantum : float
        Quantum to which friction is rounded, or 0 if friction is not rounded.
    has_converged : bool
        True if the last search converged.
    """

    def __init__(self, model: JointModel, values: Values, free: Sequence[str], noise: str) -> None:
        self.model, self.free, self.noise_model = model, tuple(free), noise
        self.initial_values, self.has_converged = dict(values), True
        self.ols_residuals = np.zeros(0)
        self.quantum = max(find_quantum(part) for part in model.friction_per_window)
        self.lower_bounds, self.upper_bounds = np.array(
            [self._coordinate_bounds(name) for name in free]
        ).T

    def _coordinate_bounds(self, name: str) -> tuple[float, float]:
        """Return the bounds of the coordinate of a parameter."""
        if name.startswith("slip_distance"):
            moved = self.model.displacement
            extent = float(np.ptp(moved))
            low, high = (
                math.log(extent / len(moved)),
                math.log(_MAX_RELATIVE_SLIP_DISTANCE * extent),
            )
            # If both slip distances are at a bound, the second slip distance is longer.
            return (
                (low + _MIN_LOG_DISTANCE_GAP, high)
                if name.endswith("_2")
                else (low, high - _MIN_LOG_DISTANCE_GAP)
            )
        if name in LOGARITHMIC_PARAMETERS:
            at = math.log(self.initial_values[name])
            return at - _MAX_LOG_STIFFNESS_CHANGE, at + _MAX_LOG_STIFFNESS_CHANGE
        if name.startswith("step_time"):
            late = self.model.max_delay(name)
            return -late, late
        return _PARAMETER_BOUNDS.get(name, (-math.inf, math.inf))

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Convert coordinates to the values of all parameters.

        Parameters
        ----------
        x : ndarray, shape (parameters,)
            Coordinates of the free parameters.

        Returns
        -------
        dict of {str: float}
            Values of all parameters.
        """
        found = zip(self.free, x.tolist(), strict=True)
        return self.initial_values | {name: from_coordinate(name, v) for name, v in found}

    def coordinates(self, values: Values) -> np.ndarray:
        """Convert the values of parameters to coordinates.

        Parameters
        ----------
        values : mapping of str to float
            Values of all parameters.

        Returns
        -------
        ndarray, shape (parameters,)
            Coordinates of the free parameters.
        """
        return np.array([to_coordinate(name, values[name]) for name in self.free])

    def residuals(self, values: Values, *, require_stable: bool = False) -> np.ndarray:
        """Compute recorded friction minus model friction and trend.

        Parameters
        ----------
        values : mapping of str to float
            Values of all parameters.
        require_stable : bool, default: False
            If True, the motion is not computed if the stiffness is below the critical stiffness.

        Returns
        -------
        ndarray, shape (rows,)
            Residuals. The values of a window are NaN if its motion fails.
        """
        curve = self.model.model_friction(values, require_stable=require_stable)
        return np.asarray(self.model.friction - curve - self.model.trend(values))

    def _jacobian(self, x: np.ndarray, differences: DifferenceScheme) -> np.ndarray:
        """Compute the Jacobian of the model.

        The Jacobian contains the derivatives with respect to the coordinates of the free
        parameters. A derivative is set to 0 if one of the motions of its finite difference fails.
        """
        found = self.model.jacobian(self.values(x), self.free, differences)
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
            If no motion fits the record, if the work budget is exhausted, or if the search does not
            converge although the record constrains all parameters.
        """
        x, noise = self._initial_coordinates(), noises.white_noise(self.model.time)
        for number in range(
            1 if self.noise_model == noises.WHITE and len(noise.level_sds) == 1 else _MAX_PASSES
        ):
            before = x
            x, jacobian = self.minimise(x, noise)
            left = self.residuals(self.values(x))
            if not number:
                self.ols_residuals = left
            if number and _has_converged(
                x - before, noise.whiten(np.column_stack([jacobian, left]))
            ):
                break
            kept = find_kept_mask(left, self.model.friction - left, self.quantum)
            least = self.quantum / math.sqrt(12.0)
            noise = noises.fit_noise(
                self.noise_model,
                self.model.time,
                left,
                jacobian,
                kept,
                least,
                self.model.averaging_time,
            )
        found = self._build_solution(x, noise)
        if not (self.has_converged or found.unidentified):
            text = f"the search did not end within {_MAX_CURVES} curves"
            raise MotionStopped(Status.ACCURACY_OUT_OF_REACH, text)
        return found

    def _initial_coordinates(self) -> np.ndarray:
        """Return the initial coordinates with the best slip distance.

        Several initial slip distances are tested, and the slip distance with the smallest residuals
        is used.
        """
        # Check the initial guess, because the search treats invalid parameters as failed motions.
        self.model.check_parameters(self.initial_values)
        scales = _INITIAL_DISTANCE_FACTORS if "slip_distance" in self.free else (1.0,)
        distances = [n for n in ("slip_distance", "slip_distance_2") if n in self.free]
        linear = [n for n in self.free if self.model.is_linear(n)]
        columns = self.model.jacobian(self.initial_values, linear) if linear else None
        best = (math.inf, self.initial_values)
        for scale in scales:
            values = self.initial_values | {n: self.initial_values[n] * scale for n in distances}
            values = self.values(
                np.clip(self.coordinates(values), self.lower_bounds, self.upper_bounds)
            )
            left = self.residuals(values, require_stable=True)
            if columns is not None and np.isfinite(left).all():
                moved = np.linalg.lstsq(columns, left)[0]
                left = left - columns @ moved
                values |= {n: values[n] + v for n, v in zip(linear, moved.tolist(), strict=True)}
            best = min(best, (float(left @ left), values), key=lambda found: (found[0],))
        if not math.isfinite(best[0]):
            text = "no motion with the first guess can be followed, or its spring is softer than "
            raise MotionStopped(Status.NOT_APPLICABLE, f"{text}the critical stiffness")
        return self.coordinates(best[1])

    def minimise(
        self, x: np.ndarray, noise: NoiseModel, rtol: float = _SEARCH_TOLERANCE
    ) -> tuple[np.ndarray, np.ndarray]:
        """Minimise the sum of squares for given noise.

        The search uses the trust-region method of ``scipy.optimize.least_squares`` within the
        bounds.

        Parameters
        ----------
        x : ndarray, shape (parameters,)
            Initial coordinates.
        noise : NoiseModel
            Noise that whitens the residuals.
        rtol : float, optional
            Relative tolerance of the sum of squares. The default is 1e-8.

        Returns
        -------
        x : ndarray, shape (parameters,)
            Coordinates at the minimum.
        jacobian : ndarray, shape (rows, parameters)
            Derivatives at the minimum.
        """
        derivatives = {}

        def left(x: np.ndarray) -> np.ndarray:
            found = self.residuals(self.values(x), require_stable=True)
            return np.asarray(noise.whiten(found[:, None])[:, 0] / scale)

        def slopes(x: np.ndarray) -> np.ndarray:
            derivatives["last"] = self._jacobian(x, QUICK_DIFFERENCES)
            return -noise.whiten(derivatives["last"]) / scale

        scale = 1.0
        inner = np.clip(x, self.lower_bounds + 1e-9, self.upper_bounds - 1e-9)
        scale = math.sqrt(float(np.square(left(inner)).mean())) or 1.0
        # The motion at the initial coordinates fails, so the search cannot improve them.
        if not math.isfinite(scale):
            self.has_converged = True
            return x, self._jacobian(x, QUICK_DIFFERENCES)
        bounds = self.lower_bounds, self.upper_bounds
        found = least_squares(left, inner, slopes, bounds, ftol=rtol, **_LEAST_SQUARES_OPTIONS)
        self.has_converged = found.status != 0
        return found.x, derivatives["last"]

    def _build_solution(self, x: np.ndarray, noise: NoiseModel) -> FitSolution:
        """Compute the final parameters, their errors and the noise.

        First, Gauss-Newton steps :math:`(J^T R^{-1} J)^{-1} J^T R^{-1} (y - f)` with accurate
        derivatives refine the parameters. The numerical error of a parameter is the last
        Gauss-Newton step plus three times the change due to a tenfold reduction of the integration
        tolerances. The degrees of freedom are the degrees of freedom of the noise, multiplied by (n
        - p)/n for p parameters and n rows.
        """
        change = math.inf
        for number in range(_NEWTON_STEP_COUNTS[2]):
            jacobian = self._jacobian(x, FINE_DIFFERENCES)
            left = self.residuals(self.values(x))
            whitened = noise.whiten(np.column_stack([jacobian, left]))
            if not np.isfinite(whitened).all():
                raise MotionStopped(Status.INTEGRATION_FAILED, "the best motion cannot be followed")
            beyond = np.clip(x + _solve_linear(whitened), self.lower_bounds, self.upper_bounds)
            moved = beyond - x
            before, change = change, float(np.linalg.norm(whitened[:, :-1] @ moved))
            if np.isfinite(self.residuals(self.values(beyond), require_stable=True)).all():
                x = beyond
            if number + 1 >= _NEWTON_STEP_COUNTS[0] and _has_converged(
                moved, whitened, _NEWTON_TOLERANCE
            ):
                break
            # Steps due to rounding errors do not shrink, but steps due to large residuals do.
            if number + 1 >= _NEWTON_STEP_COUNTS[1] and not change < _MAX_SHRINK_FACTOR * before:
                break
        values = self.values(x)
        curve = self.model.model_friction(values)
        left = self.model.friction - curve - self.model.trend(values)
        innovations = noise.whiten(left[:, None])[:, 0]
        count = len(innovations)
        free_of = count - len(x)
        size = math.sqrt(float(innovations @ innovations) / free_of)
        inverse = _inverse_normal_matrix(whitened[:, :-1])
        by_noise = covariance = size**2 * inverse
        moved_by = self.model.loading_sensitivity(values)
        if moved_by.size and np.isfinite(inverse).all():
            shifts = inverse @ whitened[:, :-1].T @ noise.whiten(moved_by)
            covariance = by_noise + shifts @ shifts.T
        degrees = max(noise.degrees_of_freedom * free_of / count, _MIN_DEGREES_OF_FREEDOM)
        finer = self.model.model_friction(values, refined=True) - curve
        with np.errstate(invalid="ignore"):  # The inverse is infinite if a derivative is zero.
            off = np.abs(inverse @ whitened[:, :-1].T @ noise.whiten(finer[:, None])[:, 0])
        slopes = [coordinate_derivative(name, values[name]) for name in self.free]
        errors = (3.0 * off + np.abs(moved)) * slopes
        criterion = compute_aic(innovations, noise, len(x), len(left))
        steps = self._aic_without_steps(jacobian, noise) - criterion > _MIN_AIC_GAIN
        return FitSolution(
            values=values,
            free=self.free,
            covariance=covariance,
            noise_covariance=by_noise,
            numerical_errors=dict(zip(self.free, errors.tolist(), strict=True)),
            noise=noise,
            noise_sd=size,
            degrees_of_freedom=degrees,
            model_friction=curve,
            residuals=left,
            whitened_residuals=innovations / size,
            jacobian=jacobian,
            by_loading=moved_by,
            aic=criterion,
            unidentified=self._find_unidentified(x, values, covariance, steps),
            ols_residual_rms=float(
                np.sqrt(np.mean(np.square(noise.drop_outliers(self.ols_residuals))))
            ),
            quantum=self.quantum,
        )

    def _aic_without_steps(self, jacobian: np.ndarray, noise: NoiseModel) -> float:
        """Compute the AIC of a model without a response to the steps.

        The model contains only trends and has a = b = 0. The noise model of the fit is not changed,
        because a new noise model would describe the response to the steps as predictable noise.
        """
        linear = [self.model.is_linear(name) for name in self.free]
        columns = np.column_stack([jacobian[:, linear], self.model.friction])
        if not any(name.startswith("mu_star") for name in self.free):
            columns = np.insert(columns, 0, 1.0, axis=1)
        whitened = noise.whiten(columns)
        innovations = whitened[:, -1] - whitened[:, :-1] @ _solve_linear(whitened)
        return compute_aic(innovations, noise, columns.shape[1] - 1, len(columns))

    def _find_unidentified(
        self, x: np.ndarray, values: Values, covariance: np.ndarray, steps: bool
    ) -> tuple[str, ...]:
        """Return the free parameters that the record does not constrain.

        If the record shows no response to the steps, only parameters with a linear effect on
        friction can be constrained.
        """
        spread = dict(zip(self.free, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        bound = (x - self.lower_bounds < 1e-6) | (self.upper_bounds - x < 1e-6)
        effects = {"slip_distance": "b" if "b" in values else "b1", "slip_distance_2": "b2"}
        largest = max(abs(values.get(n, 0.0)) for n in ("a", "b", "b1", "b2"))
        found = []
        for name, at_bound in zip(self.free, bound.tolist(), strict=True):
            told = math.isfinite(spread[name])
            if name in LOGARITHMIC_PARAMETERS or name == "law_exponent":
                told = spread[name] < _MAX_IDENTIFIED_STDERR and not (
                    at_bound and name in LOGARITHMIC_PARAMETERS
                )
            elif name in ("a", "b", "b1", "b2"):
                told = spread[name] < _MAX_IDENTIFIED_STDERR * largest and not at_bound
            effect = effects.get(name, "")
            if effect in spread:
                told = told and abs(values[effect]) > _MIN_EFFECT_SIGMAS * spread[effect]
            if not told or not (steps or self.model.is_linear(name)):
                found.append(name)
        return tuple(found)

    def parameter_bounds(self, name: str) -> tuple[float, float]:
        """Return the bounds of a parameter in the search.

        Parameters
        ----------
        name : str
            Name of a free parameter.

        Returns
        -------
        low : float
            Lower bound of the parameter, or NaN if there is no lower bound.
        high : float
            Upper bound of the parameter, or NaN if there is no upper bound.
        """
        place = self.free.index(name)
        ends = self.lower_bounds[place], self.upper_bounds[place]
        low, high = (from_coordinate(name, v) if math.isfinite(v) else math.nan for v in ends)
        return low, high


def _solve_linear(columns: np.ndarray) -> np.ndarray:
    """Solve a linear least-squares problem.

    The last column is the right-hand side, and the result contains the coefficients of the other
    columns.
    """
    return np.asarray(np.linalg.lstsq(columns[:, :-1], columns[:, -1])[0])


def _has_converged(
    change: np.ndarray, whitened: np.ndarray, tolerance: float = _PASS_TOLERANCE
) -> bool:
    """Return True if the last change is small relative to the standard errors.

    Parameters
    ----------
    change : ndarray, shape (parameters,)
        Last change of the coordinates.
    whitened : ndarray, shape (rows, parameters + 1)
        Whitened derivatives, followed by the whitened residuals.
    tolerance : float
        Largest change, as a fraction of the standard error.
    """
    size = np.linalg.norm(whitened[:, -1]) / math.sqrt(len(whitened))
    spread = size * np.sqrt(np.diag(_inverse_normal_matrix(whitened[:, :-1])))
    return bool((np.abs(change) <= tolerance * spread).all())


def _inverse_normal_matrix(columns: np.ndarray) -> np.ndarray:
    """Compute the inverse of the normal matrix, :math:`(J^T J)^{-1}`.

    All elements are infinite if a column is zero or not finite.
    """
    sizes = np.linalg.norm(columns, axis=0)
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        return np.full((columns.shape[1],) * 2, math.inf)
    _u, values, turned = np.linalg.svd(columns / sizes, full_matrices=False)
    values = np.maximum(values, 1e-14 * values[0])
    root = turned.T / values
    return np.asarray((root @ root.T) / np.outer(sizes, sizes))
