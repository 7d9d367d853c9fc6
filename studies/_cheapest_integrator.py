"""The integrator with the least work for a number of correct digits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy.measures import Quantity
from rsfstudy.reductions import Reduction

#: What is given, by the ends of the names: units, and what it is.
_RESULT_DESCRIPTIONS = {
    "integrator": ("", "integrator with the least right-hand sides"),
    "work": ("1", "its right-hand sides"),
    "default_work": ("1", "right-hand sides of the default integrator"),
    "default_time": ("s", "wall time of the default integrator"),
    "default_request": ("1", "digits to ask for with the default integrator"),
    "relative": ("1", "work of an integrator over that of the default one"),
    "ratio": ("1", "work of the default integrator over the least"),
}


@dataclass(frozen=True)
class CheapestIntegrator(Reduction):
    """The integrator that reaches a number of correct digits with the least work.

    Work at exactly that many digits is interpolated, in logarithms, between neighbouring runs of
    one integrator; runs that failed are left out.

    Parameters
    ----------
    name : str
        Gives, along a dimension ``digits``, ``<name>_integrator`` (its name), ``<name>_work``,
        ``<name>_relative`` (the work of each integrator over that of `default`), and
        for the integrator `default` ``<name>_default_work``, ``<name>_default_time``,
        ``<name>_default_request`` (the digits to ask for) and ``<name>_ratio``, its work over the
        least.
    of : str
        Variable that holds the achieved digits along ``integrator`` and ``requested_digits``.
    default : str
        Name of the integrator in use.
    digits : tuple of float
        Digits wanted.
    """

    default: str = "DOP853"
    digits: tuple[float, ...] = (3.0, 6.0, 9.0)
    kind: ClassVar[str] = "cheapest"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities that are given, and the digits that they are given for."""
        digits = Quantity("digits", "", "1", "correct decimal digits wanted")
        return digits, *(
            Quantity(f"{self.name}_{n}", "", *about) for n, about in _RESULT_DESCRIPTIONS.items()
        )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare the integrators; nothing where `default` is not among them."""
        names = dataset["integrator"].values.astype(str)
        if self.default not in names:
            return xr.Dataset()
        digits = xr.DataArray(list(self.digits), {"digits": list(self.digits)}, "digits")

        def reached(values: Any) -> Any:
            """Values of each integrator where it reaches the digits."""
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
        note = f"digits by {self.of}; the least right-hand sides of {', '.join(names)}"
        return self.results(note, result)


def _values_at_digits(achieved: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values at the first run from which on all reach the digits wanted; NaN where none does."""
    known = np.isfinite(achieved) & np.isfinite(values)
    achieved, values = achieved[known], values[known]
    if achieved.size == 0:
        return np.full(wanted.shape, np.nan)
    # digits that a loose request reaches by luck do not count, only those all tighter ones reach
    kept = np.minimum.accumulate(achieved[::-1])[::-1]
    return np.array([_first_value_with_digits(kept, values, digits) for digits in wanted])


def _first_value_with_digits(kept: np.ndarray, values: np.ndarray, digits: float) -> float:
    reached = np.flatnonzero(kept >= digits)
    if reached.size == 0:
        return float("nan")
    first = int(reached[0])
    if first == 0 or kept[first] == kept[first - 1]:
        return float(values[first])
    share = (digits - kept[first - 1]) / (kept[first] - kept[first - 1])
    return float(values[first - 1] + share * (values[first] - values[first - 1]))
