"""Search for the parameters of a record by generalised least squares.

The parameters p minimise ``|W (y - f(p))|^2``, where y is recorded friction and f is the model. The
matrix W whitens the noise: ``W'W`` is the inverse of the correlation matrix R of the noise. The
noise and the parameters are estimated in turn. The covariance matrix of the parameters is then
``s^2 (J'R^-1 J)^-1``, where J contains the derivatives of f, and ``s^2 = |W (y - f)|^2/(n - p)``
for n rows and p parameters. Errors of the times and velocities of steps (see ``load_point``) change
f by the columns of a matrix G. These errors add A A' to the covariance matrix, where ``A = (J'R^-1
J)^-1 J'R^-1 G``.

References
----------
Seber and Wild (1989), Nonlinear Regression, Wiley, chapters 2 and 6, for least squares under
autocorrelated noise; Patterson and Thompson (1971), Biometrika 58, 545-554, for noise by restricted
maximum likelihood; Hurvich and Tsai (1989), Biometrika 76, 297-307, for the criterion.
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

#: Bounds of parameters; those of stiffness are over the first guess.
_PARAMETER_BOUNDS = {
    "a": (1e-4, 1.0),
    "b": (-1.0, 1.0),
    "b1": (-1.0, 1.0),
    "b2": (-1.0, 1.0),
    "alpha": (0.0, 2.0),
    "law_exponent": (0.0, 1.0),
}
_MAX_LOG_STIFFNESS_CHANGE = math.log(1e4)
#: Longest slip distance over the displacement of the window; the shortest is the distance of rows.
_MAX_RELATIVE_SLIP_DISTANCE = 10.0
#: Difference of logarithms by which the bounds of two slip distances are apart.
_MIN_LOG_DISTANCE_GAP = 1e-6
#: Slip distances to begin with, over the first guess.
_INITIAL_DISTANCE_FACTORS = (0.1, 0.3, 1.0, 3.0, 10.0)
#: Passes in which noise and parameters are found in turn, until those move by this part of their
#: standard errors; most curves of a pass, and where it ends; and the number of Newton steps at the
#: end: at least, at most, and at most if each step is shorter than the last one by this factor. The
#: last step is shorter than a fraction of the standard errors.
(
    _MAX_PASSES,
    _PASS_TOLERANCE,
    _MAX_CURVES,
    _SEARCH_TOLERANCE,
    _NEWTON_STEP_COUNTS,
    _MAX_SHRINK_FACTOR,
) = 4, 0.05, 200, 1e-8, (2, 8, 24), 0.9
_LEAST_SQUARES_OPTIONS = {
    "x_scale": "jac",
    "xtol": _SEARCH_TOLERANCE,
    "gtol": 1e-12,
    "max_nfev": _MAX_CURVES,
}
_NEWTON_TOLERANCE = 1e-3
#: Fewest degrees of freedom of intervals.
_MIN_DEGREES_OF_FREEDOM = 3.0
#: Standard error of a logarithm, and of a or b over the larger of both, beyond which a record does
#: not tell them; and the standard errors that b must differ from 0 by to have a slip distance.
_MAX_IDENTIFIED_STDERR, _MIN_EFFECT_SIGMAS = 0.5, 2.0
#: By how much the criterion of a record must be better with its steps than without them.
_MIN_AIC_GAIN = 10.0


class FitProblem:
    """Search for the free parameters of a model.

    Parameters
    ----------
    model : JointModel
    values : mapping of str to float
        Values of all parameters. The values of free parameters are the initial guess.
    free : sequence of str
        Names of the free parameters.
    noise : str
        Noise model (see ``noise.fitted``).
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
            # at bounds too the second one is longer
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
        """Return the values of all parameters for given coordinates."""
        found = zip(self.free, x.tolist(), strict=True)
        return self.initial_values | {name: from_coordinate(name, v) for name, v in found}

    def coordinates(self, values: Values) -> np.ndarray:
        """Return the coordinates of the free parameters."""
        return np.array([to_coordinate(name, values[name]) for name in self.free])

    def residuals(self, values: Values, *, require_stable: bool = False) -> np.ndarray:
        """Compute recorded friction minus model friction and trend, shape (rows,)."""
        curve = self.model.model_friction(values, require_stable=require_stable)
        return np.asarray(self.model.friction - curve - self.model.trend(values))

    def _jacobian(self, x: np.ndarray, differences: DifferenceScheme) -> np.ndarray:
        """Compute the derivatives of the model.

        A derivative is set to 0 if one of the simulations of its finite difference fails.
        """
        found = self.model.jacobian(self.values(x), self.free, differences)
        return np.where(np.isfinite(found).all(axis=0), found, 0.0)

    def solve(self) -> FitSolution:
        """Run the search.

        Returns
        -------
        FitSolution

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
        """Return the initial coordinates.

        Several slip distances are tried, and the one with the smallest residuals is selected.
        """
        self.model.check_parameters(self.initial_values)  # whatever is wrong with it is said
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
        """Minimise the sum of squares for a given noise.

        The function uses the trust-region method of ``scipy.optimize.least_squares`` within the
        bounds.

        Parameters
        ----------
        x : ndarray
            Initial coordinates.
        noise : NoiseModel
        rtol : float
            Relative tolerance of the sum of squares.

        Returns
        -------
        x : ndarray
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
        if not math.isfinite(scale):  # next to what can be followed: there is no better neighbour
            self.has_converged = True
            return x, self._jacobian(x, QUICK_DIFFERENCES)
        bounds = self.lower_bounds, self.upper_bounds
        found = least_squares(left, inner, slopes, bounds, ftol=rtol, **_LEAST_SQUARES_OPTIONS)
        self.has_converged = found.status != 0
        return found.x, derivatives["last"]

    def _build_solution(self, x: np.ndarray, noise: NoiseModel) -> FitSolution:
        """Compute the final parameters, their errors and the noise.

        First, Gauss-Newton steps ``(J'R^-1 J)^-1 J'R^-1 (y - f)`` with accurate derivatives refine
        the parameters. The numerical error of a parameter is the sum of two terms. The first term
        is three times the change of the parameter if the motion is computed with a tenth of all
        tolerances. The second term is the last Gauss-Newton step. The degrees of freedom are those
        of the noise, multiplied by (n - p)/n for p parameters and n rows.
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
            # rounding errors no longer shrink, but steps with large residuals do
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
        with np.errstate(invalid="ignore"):  # of what is not told
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
        """Compute the criterion of the trends without a response (a = b = 0).

        The noise model is the noise of the fit. A noise model fitted to these residuals would
        describe the response to a step as predictable noise.
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

        If the record shows no response to the steps, a parameter can be constrained only if
        friction is a linear function of it.
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

        Returns
        -------
        low, high : float
            NaN for a missing bound.
        """
        place = self.free.index(name)
        ends = self.lower_bounds[place], self.upper_bounds[place]
        low, high = (from_coordinate(name, v) if math.isfinite(v) else math.nan for v in ends)
        return low, high


def _solve_linear(columns: np.ndarray) -> np.ndarray:
    """Solve a linear least-squares problem.

    The last column is the right-hand side. The result contains the coefficients of the other
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
    """Compute ``(J'J)^-1``.

    All entries are infinite if a column is zero or not finite.
    """
    sizes = np.linalg.norm(columns, axis=0)
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        return np.full((columns.shape[1],) * 2, math.inf)
    _u, values, turned = np.linalg.svd(columns / sizes, full_matrices=False)
    values = np.maximum(values, 1e-14 * values[0])
    root = turned.T / values
    return np.asarray((root @ root.T) / np.outer(sizes, sizes))
