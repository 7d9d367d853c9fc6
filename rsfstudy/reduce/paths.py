"""Comparisons of paths in the plane of stress and slip rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from rsfstudy.reduce.base import Reduction, failed

#: Slip rates, evenly spaced in ln V, at which two paths are compared.
_POINTS = 4000
#: Part of a branch left out at each end: where a path turns, stress at one slip rate says nothing.
_ENDS = 0.02


@dataclass(frozen=True)
class Parting(Reduction):
    """Places where a path with another effect leaves the path without it on the way to its first
    peak of slip rate, and where it joins it again on the way down.

    Parameters
    ----------
    name : str
        Gives ``<name>_parting`` and ``<name>_merging``, decimal logarithms of V/V_* (NaN where the
        two never part, or never merge before their first minima), and ``<name>_offset``, the median
        difference of stress on the way down.
    of : str
        Stress along the path.
    along : str
        Dimension of the two points that are compared.
    tolerance : float
        Difference of stress, over its range along the second path, at which paths count as parted.
    """

    along: str = "inertia"
    tolerance: float = 1e-3
    kind: ClassVar[str] = "parting"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare the two points of `along`; nothing unless there are two."""
        if dataset.sizes.get(self.along, 0) != 2:
            return xr.Dataset()
        dataset = dataset.sortby(self.along)  # without the effect first
        bad = failed(dataset["status"]).any(self.along)
        core = [self.along, "phase"]
        parting, merging, offset = xr.apply_ufunc(
            self._compare,
            dataset["log10_slip_rate"].where(~bad),
            dataset[self.of].where(~bad),
            input_core_dims=[core, core],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        note = f"{self.of} of the two paths differs by {self.tolerance:g} of its range"
        return xr.Dataset(
            {
                f"{self.name}_parting": parting.assign_attrs(comment=f"log10(V/V_*) where {note}"),
                f"{self.name}_merging": merging.assign_attrs(
                    comment=f"log10(V/V_*) below which {note} no more"
                ),
                f"{self.name}_offset": offset.assign_attrs(
                    comment=f"median difference of {self.of}"
                ),
            }
        )

    def _compare(self, rates: np.ndarray, stresses: np.ndarray) -> tuple[float, float, float]:
        if not (np.isfinite(rates).all() and np.isfinite(stresses).all()):
            return np.nan, np.nan, np.nan
        one, other = (_branches(rate, stress) for rate, stress in zip(rates, stresses, strict=True))
        apart = self.tolerance * np.ptp(stresses[1])
        upward, difference = _difference(one[0], other[0])
        parted = np.abs(difference) > apart
        downward, difference = _difference(one[1], other[1])
        still = np.abs(difference) > apart
        offset = float(np.median(difference))
        if not parted.any():
            return np.nan, np.nan, offset
        merged = downward[still][0] if still.any() else downward[-1]
        return float(upward[parted][0]), np.nan if still[0] else float(merged), offset


def _difference(
    one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Slip rates the two branches share, ascending, and the second's stress less the first's."""
    low, high = max(one[0][0], other[0][0]), min(one[0][-1], other[0][-1])
    at = np.linspace(low + _ENDS * (high - low), high - _ENDS * (high - low), _POINTS)
    return at, CubicSpline(*other)(at) - CubicSpline(*one)(at)


def _branches(
    rate: np.ndarray, stress: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """The ways up to the first peak of slip rate and down from it, by ascending slip rate."""
    moves = np.append(True, np.diff(rate) != 0.0)
    rate, stress = rate[moves], stress[moves]
    rising = np.diff(rate) > 0.0
    start = int(np.argmax(rising))
    top = start + int(np.argmin(np.append(rising[start:], False)))
    bottom = top + int(np.argmax(np.append(rising[top:], True)))
    up, down = slice(start, top + 1), slice(bottom, top - 1 if top else None, -1)
    return (rate[up], stress[up]), (rate[down], stress[down])
