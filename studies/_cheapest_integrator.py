"""Reduction that finds the most efficient integrator for a given accuracy."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy.measures import Quantity
from rsfstudy.reductions import Reduction

#: Unit and description of each result. The keys are the suffixes of the result names.
_RESULT_DESCRIPTIONS = {
    "integrator": ("", "integrator with the fewest right-hand side evaluations"),
    "work": ("1", "right-hand side evaluations of the cheapest integrator"),
    "default_work": ("1", "right-hand side evaluations of the default integrator"),
    "default_time": ("s", "wall time of the default integrator"),
    "default_request": ("1", "digits to request from the default integrator"),
    "relative": ("1", "work of an integrator divided by the work of the default integrator"),
    "ratio": ("1", "work of the default integrator divided by the work of the cheapest integrator"),
}


@dataclass(frozen=True)
class CheapestIntegrator(Reduction):
    """Integrator that reaches a given number of correct digits with the least work.

    The work is the number of right-hand-side evaluations. This number is interpolated
    logarithmically between neighbouring runs of the same integrator. Failed runs are ignored.

    Parameters
    ----------
    name : str
        Prefix of the results, which have a dimension ``digits``. ``<name>_integrator`` is the name
        of the most efficient integrator, ``<name>_work`` is the work of this integrator, and
        ``<name>_relative`` is the work of each integrator relative to the default integrator. The
        results ``<name>_default_work``, ``<name>_default_time``, ``<name>_default_request`` (number
        of digits to request) and ``<name>_ratio`` (work relative to the least work) describe the
        default integrator.
    of : str
        Variable that contains the achieved digits along ``integrator`` and ``requested_digits``.
    default : str, default: "DOP853"
        Name of the default integrator.
    digits : tuple of float, default: (3.0, 6.0, 9.0)
        Numbers of correct digits.
    """

    default: str = "DOP853"
    digits: tuple[float, ...] = (3.0, 6.0, 9.0)
    kind: ClassVar[str] = "cheapest"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities that describe the results and the ``digits`` dimension."""
        digits = Quantity("digits", "", "1", "required number of correct decimal digits")
        return digits, *(
            Quantity(f"{self.name}_{n}", "", *about) for n, about in _RESULT_DESCRIPTIONS.items()
        )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare the integrators.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Comparison of the integrators. The dataset is empty if the default integrator was not
            run.
        """
        names = dataset["integrator"].values.astype(str)
        if self.default not in names:
            return xr.Dataset()
        digits = xr.DataArray(list(self.digits), {"digits": list(self.digits)}, "digits")

        def reached(values: Any) -> Any:
            """Interpolate the values of each integrator."""
            core = [["requested_digits"], ["requested_digits"], ["digits"]]
            return xr.apply_ufunc(
                _values_at_digits,
                dataset[self.of],
                values,
                digits,
                input_core_dims=core,
                output_core_dims=[["digits"]],
                vectorize=True,
            )

        work = np.exp(reached(np.log(dataset["run_evaluations"])))
        time = np.exp(reached(np.log(dataset["run_time"])))
        asked = reached(dataset["requested_digits"].broadcast_like(dataset[self.of]))
        least, default = work.min("integrator"), {"integrator": self.default}
        cheapest = xr.DataArray(names, dims="n")[work.fillna(np.inf).argmin("integrator")]
        by_default = work.sel(default, drop=True)
        result = {
            "_integrator": cheapest.where(work.notnull().any("integrator"), "none"),
            "_work": least,
            "_default_work": by_default,
            "_default_time": time.sel(default, drop=True),
            "_default_request": asked.sel(default, drop=True),
            "_ratio": by_default / least,
            "_relative": work / by_default,
        }
        note = f"digits from {self.of}; fewest right-hand side evaluations of {', '.join(names)}"
        return self.results(note, result)


def _values_at_digits(achieved: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Interpolate the values of the runs to given numbers of correct digits.

    Parameters
    ----------
    achieved : ndarray
        Achieved digits of each run, in the order of the requested digits.
    values : ndarray
        Values of each run.
    wanted : ndarray
        Numbers of correct digits.

    Returns
    -------
    ndarray
        Interpolated values, with NaN for numbers of digits that the runs do not reach.
    """
    known = np.isfinite(achieved) & np.isfinite(values)
    achieved, values = achieved[known], values[known]
    if achieved.size == 0:
        return np.full(wanted.shape, np.nan)
    # A run with a loose tolerance may reach n digits by chance. A run is therefore accepted only if
    # all runs with tighter tolerances also reach n digits.
    kept = np.minimum.accumulate(achieved[::-1])[::-1]
    return np.array([_first_value_with_digits(kept, values, digits) for digits in wanted])


def _first_value_with_digits(kept: np.ndarray, values: np.ndarray, digits: float) -> float:
    """Interpolate the values of the runs to a given number of correct digits.

    Parameters
    ----------
    kept : ndarray
        Number of digits that both the run and all runs with tighter tolerances achieve.
    values : ndarray
        Values of each run.
    digits : float
        Number of correct digits.

    Returns
    -------
    float
        Interpolated value. The value is NaN if the runs do not reach the number of digits.
    """
    reached = np.flatnonzero(kept >= digits)
    if reached.size == 0:
        return float("nan")
    first = int(reached[0])
    if first == 0 or kept[first] == kept[first - 1]:
        return float(values[first])
    share = (digits - kept[first - 1]) / (kept[first] - kept[first - 1])
    return float(values[first - 1] + share * (values[first] - values[first - 1]))
