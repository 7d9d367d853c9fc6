"""Confidence intervals of parameters from the profile likelihood.

The profile likelihood of a parameter is the likelihood at a fixed value of the parameter, maximised
with respect to all other parameters [1]_. The squared distance between the fixed value and the best
value is defined as the increase in the sum of squared whitened residuals, divided by the noise
variance. At the ends of a confidence interval, the squared distance from the best value is
:math:`t^2`, where :math:`t` is a quantile of Student's t distribution with the degrees of freedom
of the fit. If the log-likelihood is nearly quadratic, the interval is computed from the standard
error.

References
----------
.. [1] Bates and Watts (1988), Nonlinear Regression Analysis and Its Applications, Wiley, section
   6.1.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import t as student

from rsfstudy.fitting.fit_problem import FitProblem, FitSolution
from rsfstudy.fitting.window_model import convert_fit_coordinate_to_parameter

#: Settings of confidence intervals. The first value is the confidence level. The profile likelihood
#: is computed if the relative deviation of the log-likelihood from a quadratic function exceeds the
#: second value. The third value is the largest number of iterations for each end of an interval.
#: The fourth value is the relative tolerance of the squared distance between an end of the interval
#: and the best value. The fifth value is the tolerance of the minimum sum of squares, in noise
#: variances.
(
    CONFIDENCE_LEVEL,
    _MAX_DEVIATION_FROM_PARABOLA,
    _MAX_INTERVAL_END_ITERATIONS,
    _INTERVAL_END_TOLERANCE,
    _MINIMUM_SQUARES_TOLERANCE,
) = (
    0.95,
    0.2,
    6,
    0.05,
    0.02,
)


def compute_student_t_quantile(fit_solution: FitSolution, confidence_level: float) -> float:
    """Compute the half-width of a confidence interval in units of the standard error.

    Parameters
    ----------
    fit_solution : FitSolution
        Solution of a fit.
    confidence_level : float
        Confidence level between 0 and 1.

    Returns
    -------
    float
        Quantile of Student's t distribution with the degrees of freedom of the fit.
    """
    return float(student.isf(0.5 * (1.0 - confidence_level), fit_solution.degrees_of_freedom))


def compute_confidence_interval(
    fit_problem: FitProblem, fit_solution: FitSolution, parameter_name: str
) -> tuple[float, float]:
    """Compute the 95 % confidence interval of a parameter.

    The interval is computed from the profile likelihood, and does not extend beyond the bounds of
    the search. Noise in the load point displacement widens the interval by the same factor as the
    standard error.

    Parameters
    ----------
    fit_problem : FitProblem
        Least-squares problem that contains the model of the record.
    fit_solution : FitSolution
        Solution of the least-squares problem.
    parameter_name : str
        Name of a free parameter.

    Returns
    -------
    low : float
        Lower end of the interval, in the unit of the parameter.
    high : float
        Upper end of the interval, in the unit of the parameter.
    """
    profile, far = (
        LikelihoodProfile(fit_problem, fit_solution, parameter_name),
        compute_student_t_quantile(fit_solution, CONFIDENCE_LEVEL),
    )
    best = float(profile.best_coordinates[profile.parameter_index])
    wider = (
        float(fit_solution.fit_coordinate_stderr[profile.parameter_index])
        / profile.stderr_from_noise
    )
    ends = [
        best + wider * (profile.find_confidence_interval_end(sign, far) - best)
        for sign in (-1.0, 1.0)
    ]
    bounds = (
        fit_problem.lower_bounds[profile.parameter_index],
        fit_problem.upper_bounds[profile.parameter_index],
    )
    low, high = (
        convert_fit_coordinate_to_parameter(parameter_name, float(end))
        for end in np.clip(ends, *bounds)
    )
    return low, high


class LikelihoodProfile:
    """Profile likelihood of a parameter.

    The noise model of the fit is used at all values of the parameter.

    Parameters
    ----------
    problem : FitProblem
        Least-squares problem that contains the model of the record.
    solution : FitSolution
        Solution of the least-squares problem.
    parameter_name : str
        Name of a free parameter.

    Attributes
    ----------
    best_coordinates : ndarray, shape (parameters,)
        Coordinates of all free parameters at the maximum of the likelihood.
    stderr_from_noise : float
        Standard error of the parameter coordinate, computed from the friction noise only.
    coordinate_change_ratios : ndarray, shape (parameters,)
        Change in the coordinate of each free parameter, per unit change in the coordinate of the
        parameter ``parameter_name``.
    """

    def __init__(self, problem: FitProblem, solution: FitSolution, parameter_name: str) -> None:
        self.problem, self.solution, self.parameter_index = (
            problem,
            solution,
            solution.free_parameters.index(parameter_name),
        )
        self.best_coordinates = problem.compute_fit_coordinates(solution.parameter_values)
        variance = float(
            solution.fit_coordinate_covariance_from_noise[
                self.parameter_index, self.parameter_index
            ]
        )
        self.stderr_from_noise = math.sqrt(variance)
        self.coordinate_change_ratios = (
            solution.fit_coordinate_covariance_from_noise[:, self.parameter_index] / variance
        )

    def find_confidence_interval_end(
        self, direction_sign: float, distance_in_stderrs: float
    ) -> float:
        """Find an end of a confidence interval.

        Parameters
        ----------
        direction_sign : float
            Direction of the search: -1 for the lower end and 1 for the upper end.
        distance_in_stderrs : float
            Distance between the best value and the end of the interval, in standard errors.

        Returns
        -------
        float
            Coordinate of the parameter at the end of the confidence interval. If the interval
            extends beyond the bounds of the search, the result is the bound.
        """
        bound = (self.problem.lower_bounds if direction_sign < 0.0 else self.problem.upper_bounds)[
            self.parameter_index
        ]
        most = abs(float(bound - self.best_coordinates[self.parameter_index]))
        at, power, before = min(distance_in_stderrs * self.stderr_from_noise, most), 2.0, (0.0, 0.0)
        for number in range(_MAX_INTERVAL_END_ITERATIONS):
            squared = self.compute_twice_log_likelihood_decrease(
                float(self.best_coordinates[self.parameter_index] + direction_sign * at)
            )
            if (at == most and squared < distance_in_stderrs**2) or abs(
                squared / distance_in_stderrs**2 - 1.0
            ) < _INTERVAL_END_TOLERANCE:
                break
            here = math.log(at), math.log(min(max(squared, 1e-9), 1e9))
            if number:  # The log-likelihood may be flatter or steeper than a parabola.
                power = min(max((here[1] - before[1]) / (here[0] - before[0]), 0.3), 6.0)
            factor = math.exp((2.0 * math.log(distance_in_stderrs) - here[1]) / power)
            at, before = min(most, at * min(max(factor, 0.3), 3.0)), here
        return float(self.best_coordinates[self.parameter_index] + direction_sign * at)

    def compute_twice_log_likelihood_decrease(self, fit_coordinate: float) -> float:
        """Compute twice the decrease in the log-likelihood from its maximum.

        The log-likelihood is evaluated at a given value of the parameter. Twice its decrease is
        used as the squared distance between this value and the best value. The squared distance is
        equal to the increase in the sum of squared residuals, divided by the noise variance. If the
        log-likelihood is nearly quadratic, the method returns the quadratic approximation.

        Parameters
        ----------
        fit_coordinate : float
            Value of the parameter. For a slip distance or a stiffness, the coordinate is the
            logarithm of the parameter.

        Returns
        -------
        float
            Squared distance from the best value, or infinity if the simulation of the motion fails.
        """
        moved = fit_coordinate - self.best_coordinates[self.parameter_index]
        parabola = float(moved / self.stderr_from_noise) ** 2
        # Without constraints on all parameters, the search would not converge.
        if not parabola or self.solution.unidentified_parameters:
            return parabola
        x = np.clip(
            self.best_coordinates + moved * self.coordinate_change_ratios,
            self.problem.lower_bounds,
            self.problem.upper_bounds,
        )
        x[self.parameter_index] = fit_coordinate
        nearly = self._compute_linearised_excess_sum_of_squares(x)
        if (
            not math.isfinite(nearly)
            or abs(nearly - parabola) < _MAX_DEVIATION_FROM_PARABOLA * parabola
        ):
            return parabola if math.isfinite(nearly) else nearly
        others = np.arange(len(x)) != self.parameter_index
        rest = FitProblem(
            self.problem.model,
            self.problem.compute_parameter_values(x),
            [
                name
                for name in self.solution.free_parameters
                if name != self.solution.free_parameters[self.parameter_index]
            ],
            self.problem.noise_model_name,
        )
        rest.lower_bounds, rest.upper_bounds = (
            self.problem.lower_bounds[others],
            self.problem.upper_bounds[others],
        )
        x[others], _ = rest.minimise_weighted_squares(
            x[others], self.solution.noise_model, _MINIMUM_SQUARES_TOLERANCE / len(others)
        )
        left = self._compute_whitened_residuals(x)
        self.coordinate_change_ratios = (x - self.best_coordinates) / moved
        return self._compute_sum_of_squares_above_minimum(left)

    def _compute_whitened_residuals(self, fit_coordinates: np.ndarray) -> np.ndarray:
        """Compute whitened residuals divided by the noise standard deviation.

        If the simulation of the motion fails, the residuals are NaN.
        """
        left = self.problem.compute_residuals(
            self.problem.compute_parameter_values(fit_coordinates), require_stable=True
        )
        return (
            self.solution.noise_model.whiten_columns(left[:, None])[:, 0] / self.solution.noise_sd
        )

    def _compute_sum_of_squares_above_minimum(self, residuals: np.ndarray) -> float:
        """Return the sum of squared residuals minus the minimum sum of squares of the fit."""
        return float(residuals @ residuals - np.square(self.solution.whitened_residuals).sum())

    def _compute_linearised_excess_sum_of_squares(self, fit_coordinates: np.ndarray) -> float:
        """Use a linearised model to compute the increase in the sum of squares.

        The parameter of the profile likelihood is fixed, and the sum of squares is minimised with
        respect to all other parameters. The result is this sum of squares minus the minimum sum of
        squares of the fit.
        """
        left = self._compute_whitened_residuals(fit_coordinates)
        if not np.isfinite(left).all():
            return math.inf
        others = np.delete(self.solution.jacobian, self.parameter_index, axis=1)
        columns = self.solution.noise_model.whiten_columns(others) / self.solution.noise_sd
        return self._compute_sum_of_squares_above_minimum(
            left - columns @ np.linalg.lstsq(columns, left)[0]
        )
