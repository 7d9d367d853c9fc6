"""Steps of load point velocity in a record: where straight pieces of displacement meet.

Rows i to j are parted at the k that leaves the least, ``S(i, k) + S(k, j)``, S being the sum of
squares that a line leaves, where this is less than S(i, j) by ``12 ln(j - i)`` variances of the
noise: by far more than chance does (binary segmentation).

References
----------
Scott and Knott (1974), Biometrics 30, 507-512; Bai and Perron (1998), Econometrica 66, 47-78.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from rsfstudy.error_boundary import guard_methods

#: Rows among which steps are looked for at once: of a longer record, the means of as many.
_ROWS = 20_000
#: Fewest rows of a piece, part of the faster velocity by which the next one must differ, and by how
#: much that must move displacement, in standard deviations of what lines leave of it: displacement
#: wanders about its set point.
_FEWEST, _DIFFERS, _MOVES = 5, 0.2, 10.0
#: What two lines must explain better than one, in variances of the noise over ln n.
_WORTH = 12.0
#: Part of the faster velocity below which the load point is held.
_HELD = 0.01
#: Part of the piece before and of the rest behind that pieces of a ramp last at most, and rows that
#: each holds less than: a fit takes more.
_SHORT, _FEW = 0.05, 15
#: Standard deviation over the median of absolute deviations of Gaussian noise.
_NORMAL = 1.4826


#: Sum of squares that remains of rows i to j.
Squares = Callable[[np.ndarray | int, np.ndarray | int], np.ndarray]
#: Displacement at time 0, and velocity.
_Line = tuple[float, float]


@guard_methods
class Step(NamedTuple):
    """A change of load point velocity, of normal stress, or of both.

    Attributes
    ----------
    begins, ends : float
        Times in s; the same, unless the change takes several samples.
    before, after : float
        Load point velocities in um/s; 0 if the load point is held.
    stress_before, stress_after : float
        Normal stresses in Pa; NaN if normal stress was not recorded.
    """

    begins: float
    ends: float
    before: float
    after: float
    stress_before: float = math.nan
    stress_after: float = math.nan

    @property
    def changes_velocity(self) -> bool:
        """True if the load point velocity changes."""
        return self.before != self.after

    @property
    def stress_ratio(self) -> float:
        """Normal stress after the step over that before; 1 if it does not change."""
        ratio = self.stress_after / self.stress_before
        return ratio if math.isfinite(ratio) else 1.0


def steps_of(time: np.ndarray, displacement: np.ndarray) -> tuple[Step, ...]:
    """The steps of the load point in a record.

    Displacement is taken for straight pieces with noise. A piece is parted in two where that lowers
    the sum of squares by more than chance does, and where both velocities differ by a fifth.

    Parameters
    ----------
    time, displacement : ndarray, shape (rows,)
        In s and um.

    Returns
    -------
    tuple of Step
        In their order; times in s, velocities in um/s.
    """
    every = max(1, math.ceil(len(time) / _ROWS))
    count = len(time) // every * every
    t, x = (v[:count].reshape(-1, every).mean(axis=1) for v in (time, displacement))
    if len(t) < 2 * _FEWEST:
        return ()
    t0, x0 = t[0], x[0]
    sums = RunningSums(t - t0, x - x0)
    variance = noise_variance(t, x)
    knots = _merged(
        sums, sorted(part_rows(sums.residual_squares, 0, len(t), variance)), t, variance
    )
    lines = [sums.line(i, j) for i, j in itertools.pairwise(knots)]
    meets = [
        _meeting(lines[n], lines[n + 1], (t[k - 1] - t0, t[k] - t0), variance)
        for n, k in enumerate(knots[1:-1])
    ]
    if every > 1:
        moved, variance = displacement - x0, noise_variance(time, displacement)
        meets = [_refined(time - t0, moved, at, 2 * every, variance) for at in meets]
    fastest = max(abs(line[1]) for line in lines)
    speeds = [line[1] if abs(line[1]) > _HELD * fastest else 0.0 for line in lines]
    found = []
    for first, last in _ramps(meets, speeds, np.diff(knots).tolist(), (0.0, t[-1] - t0)):
        begins, ends = meets[first], meets[last]
        if last > first:
            # the lines before and behind meet in the middle: so displacement behind is theirs
            (x, v), (y, w) = lines[first], lines[last + 1]
            late = min(max((x - y) / (w - v), begins), ends) - 0.5 * (begins + ends)
            begins, ends = begins + late, ends + late
        found.append(Step(t0 + begins, t0 + ends, speeds[first], speeds[last + 1]))
    return tuple(found)


class RunningSums:
    """Running sums of samples, from which the line through any part of them follows at once."""

    def __init__(self, t: np.ndarray, x: np.ndarray) -> None:
        columns = np.array([np.ones(len(t)), t, x, t * t, t * x, x * x])
        self.sums = np.concatenate([np.zeros((1, 6)), np.cumsum(columns.T, axis=0)])

    def between(self, i: np.ndarray | int, j: np.ndarray | int) -> tuple[np.ndarray, ...]:
        """Means of t and x over rows i to j, and sums of squares about them."""
        n, st, sx, stt, stx, sxx = (self.sums[j] - self.sums[i]).T
        mt, mx = st / n, sx / n
        return mt, mx, stt - st * mt, stx - st * mx, sxx - sx * mx

    def residual_squares(self, i: np.ndarray | int, j: np.ndarray | int) -> np.ndarray:
        """Sum of squares that the line through rows i to j leaves."""
        _mt, _mx, tt, tx, xx = self.between(i, j)
        return np.asarray(np.maximum(xx - tx * tx / tt, 0.0))

    def squares_about_mean(self, i: np.ndarray | int, j: np.ndarray | int) -> np.ndarray:
        """Compute the sum of squares about the mean of rows i to j."""
        return np.asarray(np.maximum(self.between(i, j)[4], 0.0))

    def line(self, i: int, j: int) -> _Line:
        """Displacement at time 0, and velocity, of the line through rows i to j."""
        mt, mx, tt, tx, _xx = self.between(i, j)
        return float(mx - tx / tt * mt), float(tx / tt)


def noise_variance(t: np.ndarray, x: np.ndarray) -> float:
    """Variance of the noise of samples, in their units squared: of each about the line through its
    neighbours, by the median, which steps do not move.
    """
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    off = x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:]
    off /= np.sqrt(1.0 + (1.0 - share) ** 2 + share**2)
    spread = _NORMAL * float(np.median(np.abs(off)))
    least = 1e-9 * float(np.ptp(x))  # a record may be without noise
    return max(spread, least) ** 2


def part_rows(squares: Squares, first: int, last: int, variance: float) -> set[int]:
    """Part rows by binary segmentation, if parts explain them by far better than chance does.

    Parameters
    ----------
    squares : callable
        Sum of squares that remains of rows i to j.
    first, last : int
    variance : float
        Variance of the noise.

    Returns
    -------
    set of int
        Rows at which parts begin, with `first` and `last`.
    """
    open_parts, found = [(first, last)], {first, last}
    while open_parts:
        i, j = open_parts.pop()
        at = np.arange(i + _FEWEST, j - _FEWEST + 1)
        if not len(at):
            continue
        both = squares(i, at) + squares(at, j)
        best = int(at[np.argmin(both)])
        if squares(i, j) - both.min() > _WORTH * math.log(j - i) * variance:
            found.add(best)
            open_parts += [(i, best), (best, j)]
    return found


def _merged(sums: RunningSums, knots: list[int], t: np.ndarray, variance: float) -> list[int]:
    """Knots without those between pieces that tell no step, the least one first."""
    while len(knots) > 2:
        pieces = [*itertools.pairwise(knots)]
        speeds = np.array([sums.line(i, j)[1] for i, j in pieces])
        squares = sum(float(sums.residual_squares(i, j)) for i, j in pieces) / knots[-1]
        left = math.sqrt(max(squares, variance))
        change, lasts = np.abs(np.diff(speeds)), np.diff(t[[*knots[:-1], -1]])
        faster = np.maximum(np.abs(speeds[1:]), np.abs(speeds[:-1]))
        differs = change / (_DIFFERS * np.maximum(faster, _HELD * np.abs(speeds).max()))
        moves = change * np.minimum(lasts[1:], lasts[:-1]) / (_MOVES * left)
        tells = np.minimum(differs, moves)
        least = int(np.argmin(tells))
        if tells[least] > 1.0:
            break
        del knots[least + 1]
    return knots


def _meeting(one: _Line, other: _Line, between: tuple[float, float], variance: float) -> float:
    """Time at which two lines meet, near the times of the last sample of one and the first of the
    other: where samples part best is told by noise to (variance gap/change**2)**(1/3).
    """
    (last, first), change = between, other[1] - one[1]
    middle, gap = 0.5 * (last + first), first - last
    reach = max(3.0 * gap, 5.0 * math.cbrt(variance * gap / change**2))
    meet = (one[0] - other[0]) / change
    return float(min(max(meet, middle - reach), middle + reach))


def _refined(
    time: np.ndarray, displacement: np.ndarray, at: float, reach: int, variance: float
) -> float:
    """The meeting of two lines found anew among all rows near it."""
    middle = int(np.searchsorted(time, at))
    i, j = max(middle - 20 * reach, 0), min(middle + 20 * reach, len(time))
    t, x = time[i:j] - at, displacement[i:j]
    sums, places = RunningSums(t, x - x[0]), np.arange(_FEWEST, j - i - _FEWEST)
    both = sums.residual_squares(0, places) + sums.residual_squares(places, j - i)
    best = int(places[np.argmin(both)])
    lines = sums.line(0, best), sums.line(best, j - i)
    return at + _meeting(*lines, (t[best - 1], t[best]), variance)


def _ramps(
    times: list[float], speeds: list[float], rows: list[int], ends: tuple[float, float]
) -> Iterator[tuple[int, int]]:
    """First and last change of velocity of each step: short pieces, or those of few rows, on the
    way from one velocity to another are a ramp.
    """
    changes, n = np.sign(np.diff(speeds)), 0
    while n < len(times):
        last, before = n, times[n] - (times[n - 1] if n else ends[0])
        while (
            last + 1 < len(times)
            and changes[last + 1] == changes[n]
            and (
                rows[last + 1] < _FEW
                or times[last + 1] - times[n] < _SHORT * min(before, ends[1] - times[last + 1])
            )
        ):
            last += 1
        yield n, last
        n = last + 1
