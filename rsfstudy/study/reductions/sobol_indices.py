"""Sobol indices of sampled quantities.

A Sobol index is the share of the variance of a result that is caused by one sampled quantity.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity
from rsfstudy.study.reductions.base import Reduction, depends_on_failed_cells

#: Number of bootstrap resamples, number of resamples per batch, and seed of the random generator.
_BOOTSTRAP_RESAMPLES, _RESAMPLES_PER_BATCH, _RESAMPLING_SEED = 400, 25, 2010
#: Probabilities of the bounds of the confidence interval.
_CONFIDENCE_INTERVAL_QUANTILES = (0.025, 0.975)
_SOBOL_INDEX_NAMES = ("first_order", "total")
#: Maximum width of a confidence interval without a note that the sample is too small.
_MAX_INTERVAL_WIDTH_WITHOUT_NOTE = 0.5


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class SobolIndices(Reduction):
    """First-order and total Sobol indices.

    The first-order index of a quantity is the share of the variance that is caused only by this
    quantity, without interactions with other quantities. The total index is the share of the
    variance that would remain if all other quantities were known exactly. The 95 % confidence
    intervals are computed by bootstrapping the sample points. If a cell failed or has no value, all
    indices are NaN, because the remaining samples would have a different distribution. The indices
    are computed by `scipy.stats.sobol_indices`.

    Parameters
    ----------
    name : str
        Prefix of the names of the results, which are ``<name>_first_order`` and ``<name>_total``.
        The bounds of their confidence intervals have the suffixes ``_ci_low`` and ``_ci_high``. The
        results have the dimension ``input``, whose labels are the sampled quantities.
    of : str
        Name of the variable whose variance is analysed.
    over : str, default: "sample"
        Dimension of the samples. The samples must be drawn with ``Axis.samples(...,
        method="saltelli")``.

    References
    ----------
    .. [1] Saltelli et al. (2010), Variance based sensitivity analysis of model output. Computer
       Physics Communications 181, 259-270.

    Examples
    --------
    >>> import json
    >>> import xarray as xr
    >>> from rsfstudy.reductions import SobolIndices
    >>> sampling = {"of": ["a", "b"], "method": "saltelli"}
    >>> dataset = xr.Dataset(
    ...     {
    ...         "drop": ("sample", [1.0, 4.0, 3.0, 2.0, 5.0, 3.0, 5.0, 3.0]),
    ...         "status": ("sample", [0] * 8),
    ...     },
    ...     coords={"sample": ("sample", range(8), {"drawn": json.dumps(sampling)})},
    ... )
    >>> indices = SobolIndices(name="sobol", of="drop")(dataset)
    >>> indices["input"].values.tolist()
    ['a', 'b']
    >>> "sobol_total_ci_high" in indices
    True
    """

    over: str = "sample"
    kind: ClassVar[str] = "sobol_indices"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities that describe the indices, their bounds and the new dimension."""
        about = Quantity("input", "", "", "sampled quantity")
        return (
            about,
            *(Quantity(n, "", "1", text) for n, text in self._list_result_names_and_descriptions()),
        )

    def _list_result_names_and_descriptions(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the description of each result."""
        for order in _SOBOL_INDEX_NAMES:
            text = f"{order.replace('_', '-')} Sobol index of {self.of.replace('_', ' ')}"
            yield f"{self.name}_{order}", text
            for end, word in (("ci_low", "lower"), ("ci_high", "upper")):
                about = f"{word} end of the 95 % confidence interval of the {text}"
                yield f"{self.name}_{order}_{end}", about

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the indices for each point along the other dimensions.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Indices and bounds of their confidence intervals. If the sample is too small for
            accurate indices, the results have the attribute ``note``.

        Raises
        ------
        InvalidValue
            If the samples were not drawn for Sobol indices, or if some samples are missing.
        """
        inputs = self._read_names_of_sampled_quantities(dataset)
        of, d = dataset[self.of].transpose(..., self.over), len(inputs)
        others = of.dims[:-1]
        bad = depends_on_failed_cells(dataset, self.of, self.over) | of.isnull().any(self.over)
        found = np.full((*of.shape[:-1], len(_SOBOL_INDEX_NAMES), 3, d), np.nan)
        for place in np.ndindex(*of.shape[:-1]):
            values = of.values[place]
            if not bool(bad.isel(dict(zip(others, place, strict=True)))) and np.ptp(values) > 0.0:
                found[place] = _compute_indices_and_bootstrap_bounds(values.reshape(-1, d + 2).T)
        lost = int(of.isnull().sum())
        about = {"comment": f"confidence intervals from {_BOOTSTRAP_RESAMPLES} bootstrap resamples"}
        if lost:
            about["refused"] = (
                f"{lost} of {of.size} cells have no value, but the indices require all cells. Use "
                "narrower distributions"
            )
        elif np.isnan(found).any():
            about["refused"] = f"cells failed, or {self.of} has the same value in all cells"
        if note := self._describe_inaccurate_indices(found, inputs):
            about["note"] = note
        names = iter(name for name, _text in self._list_result_names_and_descriptions())
        return xr.Dataset(
            {
                next(names): ((*others, "input"), found[..., result, end, :], about)
                for result in range(len(_SOBOL_INDEX_NAMES))
                for end in range(3)
            },
            {**{n: c for n, c in of.coords.items() if self.over not in c.dims}, "input": inputs},
        )

    def _describe_inaccurate_indices(self, found: np.ndarray, inputs: Sequence[str]) -> str:
        """Return a note if the sample is too small for accurate indices.

        Parameters
        ----------
        found : ndarray, shape (..., 2, 3, inputs)
            Indices and bounds, as `_compute_indices_and_bootstrap_bounds` returns them.
        inputs : sequence of str
            Names of the sampled quantities.

        Returns
        -------
        str
            Note that states the largest width of a confidence interval, and the quantities whose
            first-order index exceeds their total index by more than the errors. The string is empty
            if the indices are accurate.
        """
        first, total = np.moveaxis(found, -3, 0)
        widths = found[..., 2, :] - found[..., 1, :]
        widest = float(np.nanmax(widths)) if np.isfinite(widths).any() else 0.0
        above = (first[..., 1, :] > total[..., 2, :]).reshape(-1, len(inputs)).any(axis=0)
        problems = []
        if widest > _MAX_INTERVAL_WIDTH_WITHOUT_NOTE:
            problems.append(f"a 95 % confidence interval is {widest:.2g} wide")
        if above.any():
            names = ", ".join(
                name for name, is_above in zip(inputs, above, strict=True) if is_above
            )
            problems.append(
                f"the first-order index of {names} exceeds the total index by more than the "
                "confidence intervals"
            )
        if not problems:
            return ""
        return (
            f"{self.name}: the Sobol indices are not accurate, because {' and '.join(problems)}. "
            "Increase the number n of Axis.samples(..., n, method='saltelli')."
        )

    def _read_names_of_sampled_quantities(self, dataset: xr.Dataset) -> list[str]:
        """Return the names of the sampled quantities."""
        if self.over not in dataset[self.of].dims:
            raise InvalidValue("over", self.over, f"is not a dimension of {self.of}")
        drawn: dict[str, Any] = json.loads(dataset[self.over].attrs.get("drawn", "{}"))
        inputs = list(drawn.get("of", ()))
        points, rest = divmod(dataset.sizes[self.over], len(inputs) + 2)
        if drawn.get("method") != "saltelli" or rest or points & (points - 1):
            rule = "was not drawn for Sobol indices, or is incomplete"
            remedy = (
                "Draw the samples with Axis.samples(..., n, method='saltelli'), where n is "
                "a power of two."
            )
            raise InvalidValue("over", self.over, rule, remedy=remedy)
        return inputs


def _compute_indices_and_bootstrap_bounds(sample_values: np.ndarray) -> np.ndarray:
    """Compute Sobol indices with confidence intervals.

    Parameters
    ----------
    sample_values : ndarray, shape (2 + inputs, points)
        Values of the variable for the sample matrix A, for the sample matrix B, and for copies of A
        in which one column at a time is replaced by the same column of B.

    Returns
    -------
    ndarray, shape (2, 3, inputs)
        First-order and total indices. The entries along the second dimension are the estimate, the
        lower bound and the upper bound.
    """
    random, count = np.random.default_rng(_RESAMPLING_SEED), sample_values.shape[1]
    resampled = []
    for _ in range(_BOOTSTRAP_RESAMPLES // _RESAMPLES_PER_BATCH):
        again = random.integers(count, size=(_RESAMPLES_PER_BATCH, count))
        resampled.append(_compute_saltelli_indices(sample_values[:, again]))
    ends = np.quantile(np.concatenate(resampled, axis=1), _CONFIDENCE_INTERVAL_QUANTILES, axis=1)
    best = _compute_saltelli_indices(sample_values[:, None, :])[:, 0]
    return np.stack([best, *ends], axis=1)


def _compute_saltelli_indices(sample_values: np.ndarray) -> np.ndarray:
    """Compute the first-order and total indices for each of several sets of values.

    Parameters
    ----------
    sample_values : ndarray, shape (2 + inputs, sets, points)
        Values of each set, in the order described in `_compute_indices_and_bootstrap_bounds`.

    Returns
    -------
    ndarray, shape (2, sets, inputs)
        First-order and total indices.
    """
    from scipy.stats import sobol_indices  # Importing scipy.stats is slow.

    parts = {"f_A": sample_values[0], "f_B": sample_values[1], "f_AB": sample_values[2:]}
    found = sobol_indices(func=parts, n=sample_values.shape[-1])
    shape = sample_values.shape[1], len(sample_values) - 2
    return np.stack([found.first_order.reshape(shape), found.total_order.reshape(shape)])
