"""Coverage of error estimates: share of errors within them, worst miss, and how tight they
are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.reduce.base import Reduction


@dataclass(frozen=True)
class Covered(Reduction):
    """Statistics of errors over their estimates, by the points of some dimensions.

    Parameters
    ----------
    name : str
        Gives ``<name>_share`` (of numbers whose error is within its estimate), ``<name>_worst``
        (the largest error over its estimate), ``<name>_typical`` (the median of estimates over
        errors) and ``<name>_numbers`` (how many there are).
    of : str
        Variable that holds errors over estimates; NaN where there is no number.
    by : tuple of str
        Dimensions that stay.
    """

    by: tuple[str, ...] = ()
    kind: ClassVar[str] = "covered"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Count over all other dimensions."""
        ratios = dataset[self.of]
        over = [d for d in ratios.dims if d not in self.by]
        known = ratios.notnull()
        numbers = known.sum(over)
        with np.errstate(divide="ignore"):
            tightness = (1.0 / ratios).median(over)
        statistics = {
            "share": (ratios <= 1.0).sum(over) / numbers.where(numbers > 0),
            "worst": ratios.max(over),
            "typical": tightness,
            "numbers": numbers,
        }
        note = f"{self.of} over {', '.join(map(str, over))}"
        return xr.Dataset(
            {f"{self.name}_{k}": v.assign_attrs(comment=note) for k, v in statistics.items()}
        )
