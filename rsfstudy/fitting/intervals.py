"""Intervals of parameters: of Student's t where the likelihood is nearly a parabola, else of the
likelihood itself.

The squared distance of a value is what the sum of squares of whitened residuals grows by, in
variances of the noise, where the parameter has that value and all others are found anew (profile
likelihood). The ends of an interval have the squared distance ``t^2``, t being the quantile of
Student's distribution with the degrees of freedom of the fit: standard errors, for a parabola.

References
----------
Bates and Watts (1988), Nonlinear Regression Analysis and Its Applications, Wiley, section 6.1.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import t as student

from rsfstudy.fitting.fit_problem import FitProblem, FitSolution
from rsfstudy.fitting.window_model import from_coordinate

#: What intervals cover, and by how much of itself a squared distance may miss that of a parabola
#: before the likelihood is followed, how often, how closely; and the variances by which the least
#: sum of squares may be missed then.
CONFIDENCE_LEVEL, _PARABOLA_TOLERANCE, _MAX_END_ITERATIONS, _END_TOLERANCE, _MINIMUM_TOLERANCE = (
    0.95,
    0.2,
    6,
    0.05,
    0.02,
)


def stderr_multiplier(solution: FitSolution, confidence_level: float) -> float:
    """Distance, in standard errors, to the ends of intervals that cover so much."""
    return float(student.isf(0.5 * (1.0 - confidence_level), solution.degrees_of_freedom))


def confidence_interval(
    problem: FitProblem, solution: FitSolution, name: str
) -> tuple[float, float]:
    """Ends of the 95 % interval of a parameter, in its units: where the likelihood has fallen as
    far as Student's t says, or the bounds of the search. Noise of load point displacement makes it
    wider by as much as the standard error.

    Parameters
    ----------
    problem : FitProblem
    solution : FitSolution
        Of that search.
    name : str

    Returns
    -------
    (float, float)
    """
    profile, far = (
        LikelihoodProfile(problem, solution, name),
        stderr_multiplier(solution, CONFIDENCE_LEVEL),
    )
    best = float(profile.best_coordinates[profile.index])
    wider = float(solution.coordinate_stderr[profile.index]) / profile.noise_stderr
    ends = [best + wider * (profile.find_end(sign, far) - best) for sign in (-1.0, 1.0)]
    bounds = problem.lower_bounds[profile.index], problem.upper_bounds[profile.index]
    low, high = (from_coordinate(name, float(end)) for end in np.clip(ends, *bounds))
    return low, high


class LikelihoodProfile:
    """The likelihood of a parameter, all others being where it is greatest.

    The noise is as the fit found it.

    Parameters
    ----------
    search : FitProblem
    found : FitSolution
        Of that search.
    name : str
        The parameter.
    """

    def __init__(self, search: FitProblem, found: FitSolution, name: str) -> None:
        self.problem, self.solution, self.index = search, found, found.free.index(name)
        self.best_coordinates = search.coordinates(found.values)
        variance = float(found.noise_covariance[self.index, self.index])
        self.noise_stderr = math.sqrt(variance)
        #: By how much the others go with the parameter.
        self.covariation = found.noise_covariance[:, self.index] / variance

    def find_end(self, sign: float, stderr_count: float) -> float:
        """Coordinate where the squared distance is that of so many standard errors, or a bound."""
        bound = (self.problem.lower_bounds if sign < 0.0 else self.problem.upper_bounds)[self.index]
        most = abs(float(bound - self.best_coordinates[self.index]))
        at, power, before = min(stderr_count * self.noise_stderr, most), 2.0, (0.0, 0.0)
        for number in range(_MAX_END_ITERATIONS):
            squared = self.squared_distance(float(self.best_coordinates[self.index] + sign * at))
            if (at == most and squared < stderr_count**2) or abs(
                squared / stderr_count**2 - 1.0
            ) < _END_TOLERANCE:
                break
            here = math.log(at), math.log(min(max(squared, 1e-9), 1e9))
            if number:  # the likelihood may flatten, or fall faster than a parabola
                power = min(max((here[1] - before[1]) / (here[0] - before[0]), 0.3), 6.0)
            factor = math.exp((2.0 * math.log(stderr_count) - here[1]) / power)
            at, before = min(most, at * min(max(factor, 0.3), 3.0)), here
        return float(self.best_coordinates[self.index] + sign * at)

    def squared_distance(self, coordinate: float) -> float:
        """Twice the logarithm by which the likelihood has fallen where the parameter, or its
        logarithm, is this: by how much the sum of squares has grown, in variances of the noise.
        """
        moved = coordinate - self.best_coordinates[self.index]
        parabola = float(moved / self.noise_stderr) ** 2
        if not parabola or self.solution.unidentified:  # what is not told leads nowhere
            return parabola
        x = np.clip(
            self.best_coordinates + moved * self.covariation,
            self.problem.lower_bounds,
            self.problem.upper_bounds,
        )
        x[self.index] = coordinate
        nearly = self._linearised_excess(x)
        if not math.isfinite(nearly) or abs(nearly - parabola) < _PARABOLA_TOLERANCE * parabola:
            return parabola if math.isfinite(nearly) else nearly
        others = np.arange(len(x)) != self.index
        rest = FitProblem(
            self.problem.model,
            self.problem.values(x),
            [name for name in self.solution.free if name != self.solution.free[self.index]],
            self.problem.noise_model,
        )
        rest.lower_bounds, rest.upper_bounds = (
            self.problem.lower_bounds[others],
            self.problem.upper_bounds[others],
        )
        x[others], _ = rest.minimise(
            x[others], self.solution.noise, _MINIMUM_TOLERANCE / len(others)
        )
        left = self._whitened_residuals(x)
        self.covariation = (x - self.best_coordinates) / moved
        return self._excess_squares(left)

    def _whitened_residuals(self, x: np.ndarray) -> np.ndarray:
        """Residuals freed of correlation, over their size; NaN where no motion can be followed."""
        left = self.problem.residuals(self.problem.values(x), require_stable=True)
        return self.solution.noise.whiten(left[:, None])[:, 0] / self.solution.noise_sd

    def _excess_squares(self, residuals: np.ndarray) -> float:
        return float(residuals @ residuals - np.square(self.solution.whitened_residuals).sum())

    def _linearised_excess(self, x: np.ndarray) -> float:
        """By how much squares have grown where the others move, to first order, to the least."""
        left = self._whitened_residuals(x)
        if not np.isfinite(left).all():
            return math.inf
        others = np.delete(self.solution.jacobian, self.index, axis=1)
        columns = self.solution.noise.whiten(others) / self.solution.noise_sd
        return self._excess_squares(left - columns @ np.linalg.lstsq(columns, left)[0])
