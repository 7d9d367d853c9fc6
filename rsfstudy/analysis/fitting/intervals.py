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

from rsfstudy.analysis.fitting.model import value_of
from rsfstudy.analysis.fitting.search import Fitted, Search

#: What intervals cover, and by how much of itself a squared distance may miss that of a parabola
#: before the likelihood is followed, how often, how closely; and the variances by which the least
#: sum of squares may be missed then.
COVERS, _PARABOLIC, _FOLLOWED, _CLOSE, _MISSED = 0.95, 0.2, 6, 0.05, 0.02


def half_width(found: Fitted, covers: float) -> float:
    """Distance, in standard errors, to the ends of intervals that cover so much."""
    return float(student.isf(0.5 * (1.0 - covers), found.degrees_of_freedom))


def interval(search: Search, found: Fitted, name: str) -> tuple[float, float]:
    """Ends of the 95 % interval of a parameter, in its units: where the likelihood has fallen as
    far as Student's t says, or the bounds of the search. Noise of load point displacement makes it
    wider by as much as the standard error.

    Parameters
    ----------
    search : Search
    found : Fitted
        Of that search.
    name : str

    Returns
    -------
    (float, float)
    """
    profile, far = Profile(search, found, name), half_width(found, COVERS)
    best = float(profile.best[profile.place])
    wider = float(found.spread[profile.place]) / profile.spread
    ends = [best + wider * (profile.end(sign, far) - best) for sign in (-1.0, 1.0)]
    bounds = search.low[profile.place], search.high[profile.place]
    low, high = (value_of(name, float(end)) for end in np.clip(ends, *bounds))
    return low, high


class Profile:
    """The likelihood of a parameter, all others being where it is greatest.

    The noise is as the fit found it.

    Parameters
    ----------
    search : Search
    found : Fitted
        Of that search.
    name : str
        The parameter.
    """

    def __init__(self, search: Search, found: Fitted, name: str) -> None:
        self.search, self.found, self.place = search, found, found.free.index(name)
        self.best = search.coordinates(found.values)
        variance = float(found.by_noise[self.place, self.place])
        self.spread = math.sqrt(variance)
        #: By how much the others go with the parameter.
        self.along = found.by_noise[:, self.place] / variance

    def end(self, sign: float, far: float) -> float:
        """Coordinate where the squared distance is that of so many standard errors, or a bound."""
        bound = (self.search.low if sign < 0.0 else self.search.high)[self.place]
        most = abs(float(bound - self.best[self.place]))
        at, power, before = min(far * self.spread, most), 2.0, (0.0, 0.0)
        for number in range(_FOLLOWED):
            squared = self.squared_distance(float(self.best[self.place] + sign * at))
            if (at == most and squared < far**2) or abs(squared / far**2 - 1.0) < _CLOSE:
                break
            here = math.log(at), math.log(min(max(squared, 1e-9), 1e9))
            if number:  # the likelihood may flatten, or fall faster than a parabola
                power = min(max((here[1] - before[1]) / (here[0] - before[0]), 0.3), 6.0)
            factor = math.exp((2.0 * math.log(far) - here[1]) / power)
            at, before = min(most, at * min(max(factor, 0.3), 3.0)), here
        return float(self.best[self.place] + sign * at)

    def squared_distance(self, coordinate: float) -> float:
        """Twice the logarithm by which the likelihood has fallen where the parameter, or its
        logarithm, is this: by how much the sum of squares has grown, in variances of the noise.
        """
        moved = coordinate - self.best[self.place]
        parabola = float(moved / self.spread) ** 2
        if not parabola or self.found.unidentified:  # what is not told leads nowhere
            return parabola
        x = np.clip(self.best + moved * self.along, self.search.low, self.search.high)
        x[self.place] = coordinate
        nearly = self._to_first_order(x)
        if not math.isfinite(nearly) or abs(nearly - parabola) < _PARABOLIC * parabola:
            return parabola if math.isfinite(nearly) else nearly
        others = np.arange(len(x)) != self.place
        rest = Search(
            self.search.model,
            self.search.values(x),
            [name for name in self.found.free if name != self.found.free[self.place]],
            self.search.noise_model,
        )
        rest.low, rest.high = self.search.low[others], self.search.high[others]
        x[others], _ = rest.least_squares(x[others], self.found.noise, _MISSED / len(others))
        left = self._left(x)
        self.along = (x - self.best) / moved
        return self._growth(left)

    def _left(self, x: np.ndarray) -> np.ndarray:
        """Residuals freed of correlation, over their size; NaN where no motion can be followed."""
        left = self.search.residuals(self.search.values(x), checked=True)
        return self.found.noise.whitened(left[:, None])[:, 0] / self.found.noise_sd

    def _growth(self, left: np.ndarray) -> float:
        return float(left @ left - np.square(self.found.innovations).sum())

    def _to_first_order(self, x: np.ndarray) -> float:
        """By how much squares have grown where the others move, to first order, to the least."""
        left = self._left(x)
        if not np.isfinite(left).all():
            return math.inf
        others = np.delete(self.found.jacobian, self.place, axis=1)
        columns = self.found.noise.whitened(others) / self.found.noise_sd
        return self._growth(left - columns @ np.linalg.lstsq(columns, left)[0])
