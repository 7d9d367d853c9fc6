"""Statistics over samples.

The statistics are the mean, the standard deviation, quantiles, and the share of samples with each
status. Each statistic has two errors. The sampling error ``<name>_stderr`` is the standard error
for independent samples. Sobol points and Latin hypercubes usually have smaller sampling errors than
independent samples. The numerical error ``<name>_error`` is propagated from the numerical errors of
the cells.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity
from rsfstudy.status import Status
from rsfstudy.study.reductions.base import (
    DerivativesAndCellCoordinates,
    FieldsDeterminingUnitsByResultSuffix,
    Reduction,
    depends_on_failed_cells,
)
from rsfstudy.study.reductions.result_units import find_scale_varying_along_dimensions


@dataclass(frozen=True)
class _SampleStatistic(Reduction):
    """Base class of statistics over samples.

    Subclasses define ``compute_value_and_stderr``, ``statistic_description`` and ``min_samples``.

    Parameters
    ----------
    name : str
        Name of the result. Three more variables are returned: the sampling error ``<name>_stderr``,
        the propagated numerical error ``<name>_error``, and ``<name>_points``, which is the number
        of samples that have a value.
    of : str
        Name of the variable to reduce.
    over : str, default: "sample"
        Dimension of the samples.
    """

    over: str = "sample"
    long_names: ClassVar[Mapping[str, str]] = {
        "_stderr": "sampling standard error of {name}",
        "_points": "number of samples with a value of {name}",
    }
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {
        "": ("of",),
        "_stderr": ("of",),
    }
    #: Description of the statistic for the attribute ``comment`` of the results.
    statistic_description: ClassVar[str]

    #: Minimum number of samples for which the statistic and its standard error are computed.
    min_samples: ClassVar[int] = 2

    def compute_value_and_stderr(
        self, sample_values: xr.DataArray
    ) -> tuple[xr.DataArray, xr.DataArray]:
        """Compute the statistic and its standard error.

        Parameters
        ----------
        sample_values : xarray.DataArray
            Values of the samples.

        Returns
        -------
        value : xarray.DataArray
            Statistic.
        stderr : xarray.DataArray
            Standard error.

        Raises
        ------
        TypeError
            If a subclass does not override this method.
        """
        raise TypeError(f"{type(self).__name__} does not define compute_value_and_stderr")

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the statistic along the sample dimension.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Statistic, standard error and number of samples. The values are NaN if samples failed,
            if there are too few samples, or if the scale of the variable varies between the
            samples.

        Raises
        ------
        InvalidValue
            If the variable does not have the dimension of the samples.
        """
        of, why = _select_variable_to_reduce(self, dataset), ""
        count = of.notnull().sum(self.over)
        bad = depends_on_failed_cells(dataset, self.of, self.over)
        if varied := find_scale_varying_along_dimensions(
            dataset, of.attrs.get("scale", ""), {self.over}
        ):
            bad, why = (
                xr.ones_like(bad),
                (f"{self.of} is in units of {varied}, which varies between the samples"),
            )
        elif bool(bad.any()):
            why = "samples failed or are missing"
        elif bool((count < self.min_samples).any()):
            why = f"requires at least {self.min_samples} samples with a value"
        known, said = (count >= self.min_samples) & ~bad, {"refused": why} if why else {}
        value, stderr = (
            result.where(known).drop_attrs(deep=False).assign_attrs(said)
            for result in self.compute_value_and_stderr(of)
        )
        found = {"": value, "_stderr": stderr, "_points": count.astype("int32")}
        return self.results(f"{self.statistic_description} of {self.of} over {self.over}", found)


def compute_standard_deviation(
    values: xr.DataArray, sample_dimension: str, degrees_of_freedom_lost: int = 1
) -> xr.DataArray:
    """Compute the standard deviation of samples.

    Parameters
    ----------
    values : xarray.DataArray
        Values of the samples. NaN values are ignored.
    sample_dimension : str
        Dimension of the samples.
    degrees_of_freedom_lost : int, default: 1
        Difference between the number of samples and the number of degrees of freedom.

    Returns
    -------
    xarray.DataArray
        Standard deviation. NaN if the number of samples does not exceed
        ``degrees_of_freedom_lost``.
    """
    with warnings.catch_warnings():  # Older versions of xarray raise this warning.
        warnings.filterwarnings("ignore", "Degrees of freedom", RuntimeWarning)
        return values.std(sample_dimension, ddof=degrees_of_freedom_lost)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Mean(_SampleStatistic):
    """Mean of a variable over samples.

    Parameters
    ----------
    name : str
        Name of the mean. Three more variables are returned: the sampling error ``<name>_stderr``,
        the propagated numerical error ``<name>_error``, and ``<name>_points``, which is the number
        of samples that have a value.
    of : str
        Name of the variable to reduce.
    over : str, default: "sample"
        Dimension of the samples.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Mean
    >>> dataset = xr.Dataset(
    ...     {"drop": ("sample", [1.0, 2.0, 3.0, 4.0]), "status": ("sample", [0, 0, 0, 0])}
    ... )
    >>> mean = Mean(name="mean", of="drop")(dataset)
    >>> float(mean["mean"]), round(float(mean["mean_stderr"]), 4)
    (2.5, 0.6455)
    """

    kind: ClassVar[str] = "mean"
    statistic_description: ClassVar[str] = "mean"

    def compute_value_and_stderr(
        self, sample_values: xr.DataArray
    ) -> tuple[xr.DataArray, xr.DataArray]:
        """Compute the mean and its standard error.

        The standard error is the standard deviation divided by the square root of the number of
        samples.

        Parameters
        ----------
        sample_values : xarray.DataArray
            Values of the samples.

        Returns
        -------
        value : xarray.DataArray
            Mean.
        stderr : xarray.DataArray
            Standard error.
        """
        count = sample_values.notnull().sum(self.over)
        return sample_values.mean(self.over), compute_standard_deviation(
            sample_values, self.over
        ) / count**0.5

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the mean (the reciprocal of the sample count).

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        has = _select_variable_to_reduce(self, dataset).notnull()
        return [(has / has.sum(self.over), {})]


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class StandardDeviation(_SampleStatistic):
    """Standard deviation of a variable over at least three samples.

    Parameters
    ----------
    name : str
        Name of the standard deviation. Three more variables are returned: the sampling error
        ``<name>_stderr``, the propagated numerical error ``<name>_error``, and ``<name>_points``,
        which is the number of samples that have a value.
    of : str
        Name of the variable to reduce.
    over : str, default: "sample"
        Dimension of the samples.

    References
    ----------
    .. [1] Efron and Stein (1981), The jackknife estimate of variance. Annals of Statistics 9,
       586-596.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import StandardDeviation
    >>> dataset = xr.Dataset(
    ...     {"drop": ("sample", [1.0, 2.0, 3.0]), "status": ("sample", [0, 0, 0])}
    ... )
    >>> deviation = StandardDeviation(name="deviation", of="drop")(dataset)
    >>> float(deviation["deviation"])
    1.0
    """

    kind: ClassVar[str] = "standard_deviation"
    statistic_description: ClassVar[str] = "standard deviation"
    min_samples = 3

    def compute_value_and_stderr(
        self, sample_values: xr.DataArray
    ) -> tuple[xr.DataArray, xr.DataArray]:
        """Compute the standard deviation and its standard error.

        The standard deviation has n - 1 degrees of freedom. The standard error is a jackknife
        estimate, which uses the standard deviations of all subsets of n - 1 samples [1]_. The
        estimate requires independent samples but no particular distribution.

        Parameters
        ----------
        sample_values : xarray.DataArray
            Values of the samples.

        Returns
        -------
        value : xarray.DataArray
            Standard deviation.
        stderr : xarray.DataArray
            Standard error.

        References
        ----------
        .. [1] Efron and Stein (1981), The jackknife estimate of variance. Annals of Statistics 9,
           586-596.
        """
        count, apart = (
            sample_values.notnull().sum(self.over),
            sample_values - sample_values.mean(self.over),
        )
        rest = (apart**2).sum(self.over) - apart**2 * count / (count - 1.0)
        without = (rest.clip(min=0.0) / (count - 2.0).where(count > 2)) ** 0.5
        scatter = compute_standard_deviation(without, self.over, 0) * (count - 1.0) ** 0.5
        return compute_standard_deviation(sample_values, self.over), scatter

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        r"""Compute the derivatives of the standard deviation.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.

        Notes
        -----
        The derivative of the standard deviation :math:`s` with respect to a sample :math:`y_i` is

        .. math:: \frac{\partial s}{\partial y_i} = \frac{y_i - \bar{y}}{(n - 1) s}.
        """
        of = _select_variable_to_reduce(self, dataset)
        freedom = of.notnull().sum(self.over) - 1
        by = (of - of.mean(self.over)) / (freedom * compute_standard_deviation(of, self.over))
        return [(by.fillna(0.0), {})]


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Quantile(_SampleStatistic):
    """Quantile of a variable over samples.

    The quantile is interpolated linearly between two neighbouring samples. The standard error is
    half the difference between two other quantiles. The levels of these two quantiles are the
    requested level plus and minus one binomial standard deviation.

    Parameters
    ----------
    name : str
        Name of the quantile. Three more variables are returned: the sampling error
        ``<name>_stderr``, the propagated numerical error ``<name>_error``, and ``<name>_points``,
        which is the number of samples that have a value.
    of : str
        Name of the variable to reduce.
    over : str, default: "sample"
        Dimension of the samples.
    level : float, default: 0.5
        Probability of the quantile, between 0 and 1. The default is the median.

    Raises
    ------
    InvalidValue
        If ``level`` is not between 0 and 1.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Quantile
    >>> dataset = xr.Dataset(
    ...     {"drop": ("sample", [1.0, 2.0, 4.0, 9.0]), "status": ("sample", [0, 0, 0, 0])}
    ... )
    >>> float(Quantile(name="median", of="drop")(dataset)["median"])
    3.0
    """

    level: float = 0.5
    kind: ClassVar[str] = "quantile"

    def __post_init__(self) -> None:
        """Check the level."""
        if not isinstance(self.level, int | float) or not 0.0 < self.level < 1.0:
            raise InvalidValue("level", self.level, "must be between 0 and 1")

    @property
    def statistic_description(self) -> str:  # type: ignore[override]
        """Name and level of the statistic."""
        return f"quantile at {self.level:g}"

    @property
    def min_samples(self) -> int:  # type: ignore[override]
        """Minimum number of samples for the standard error.

        With fewer samples, the level of the quantile plus or minus one binomial standard deviation
        would be outside the range from 0 to 1.
        """
        rarer = min(self.level, 1.0 - self.level)
        return max(2, math.ceil((1.0 - rarer) / rarer - 1e-9))

    def compute_value_and_stderr(
        self, sample_values: xr.DataArray
    ) -> tuple[xr.DataArray, xr.DataArray]:
        r"""Compute the quantile and its standard error.

        Parameters
        ----------
        sample_values : xarray.DataArray
            Values of the samples.

        Returns
        -------
        value : xarray.DataArray
            Quantile.
        stderr : xarray.DataArray
            Standard error.

        Notes
        -----
        The standard error of the quantile :math:`Q(p)` of :math:`n` samples is

        .. math:: \frac{Q(p + s) - Q(p - s)}{2}, \quad s = \sqrt{\frac{p (1 - p)}{n}}.
        """
        apart = (self.level * (1.0 - self.level) / sample_values.notnull().sum(self.over)) ** 0.5
        found = [
            _compute_interpolated_quantile(sample_values, self.over, self.level + sign * apart)
            for sign in (0.0, -1.0, 1.0)
        ]
        return found[0], 0.5 * (found[2] - found[1])

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the statistic along the sample dimension.

        If the variable has error estimates, the error of the quantile is computed from two bounds.
        The upper bound is the quantile of the values plus their errors, and the lower bound is the
        quantile of the values minus their errors. The quantile of the exact values is between the
        two bounds, even if the errors change the order of the samples.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Quantile, standard error, number of samples, and numerical error.

        Raises
        ------
        InvalidValue
            If the variable does not have the dimension of the samples.
        """
        found, beside = super().__call__(dataset), f"{self.of}_error"
        if beside not in dataset:
            return found
        of, at = _select_variable_to_reduce(self, dataset), xr.DataArray(self.level)
        errors = dataset[beside].reset_coords(drop=True)
        errors = (errors + sys.float_info.epsilon * abs(of)).fillna(np.inf)
        low, high = (
            _compute_interpolated_quantile(of + sign * errors, self.over, at)
            for sign in (-1.0, 1.0)
        )
        down, up = found[self.name] - low, high - found[self.name]
        error = down.where(down > up, up)
        note = "from quantiles of the values minus and plus their errors"
        error = error.where(abs(error) < np.inf).assign_attrs(comment=note)
        return found.assign({f"{self.name}_error": error})


def _compute_interpolated_quantile(
    values: xr.DataArray, sample_dimension: str, quantile_level: xr.DataArray
) -> xr.DataArray:
    """Interpolate a quantile linearly between neighbouring samples."""
    place = values.get_axis_num(sample_dimension)
    ranks = values.copy(
        data=np.argsort(np.argsort(values.values, axis=place), axis=place).astype(float)
    )
    at = quantile_level.clip(0.0, 1.0) * (values.notnull().sum(sample_dimension) - 1)
    weights = (1.0 - abs(ranks - at)).clip(min=0.0).where(values.notnull(), 0.0)
    return (weights * values.where(weights > 0.0, 0.0)).sum(sample_dimension)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class StatusShares(Reduction):
    """Share of the samples that have each status, including failures.

    The standard error of a share is the standard deviation of the posterior beta distribution for a
    uniform prior. Therefore, the standard error is positive even if the share is 0 or 1.

    Parameters
    ----------
    name : str
        Name of the shares. The shares have the dimension ``ended``. The labels of this dimension
        are the statuses. The standard error is returned as ``<name>_stderr``.
    of : str
        Name of a measured variable.
    over : str, default: "sample"
        Dimension of the samples.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import StatusShares
    >>> dataset = xr.Dataset(
    ...     {"drop": ("sample", [1.0, 2.0, 3.0]), "status": ("sample", [0, 0, 3])}
    ... )
    >>> shares = StatusShares(name="share", of="drop")(dataset)["share"]
    >>> round(float(shares.sel(ended="no_limit_cycle")), 4)
    0.3333
    """

    over: str = "sample"
    kind: ClassVar[str] = "status_shares"
    uses_failed_cells: ClassVar[bool] = True
    long_names: ClassVar[Mapping[str, str]] = {
        "": "fraction of samples with this status",
        "_stderr": "sampling standard error of {name}",
    }

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities that describe the shares, their errors and the new dimension."""
        return [*super().quantities, Quantity("ended", "", "", "status of a sample")]

    def get_status_of_used_cells(self, status: xr.DataArray) -> xr.DataArray:
        """Replace the status of all computed cells with ``OK``.

        Failed cells contribute to the shares, so they do not invalidate the result.

        Parameters
        ----------
        status : xarray.DataArray
            Status codes of all cells.

        Returns
        -------
        xarray.DataArray
            Status codes of the cells on which the results depend.
        """
        return status.where(status == int(Status.PENDING), int(Status.OK))

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the shares along the sample dimension.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Shares and standard errors, which are NaN if some samples are pending.

        Raises
        ------
        InvalidValue
            If the variable does not have the dimension of the samples.
        """
        _select_variable_to_reduce(self, dataset)
        status = dataset["status"].reset_coords(drop=True)
        statuses = [status for status in Status if status is not Status.PENDING]
        codes = xr.DataArray(
            [int(each) for each in statuses], {"ended": [s.label for s in statuses]}, "ended"
        )
        count, ended = status.sizes[self.over], (status == codes).sum(self.over)
        smoothed = (ended + 1) / (count + 2)
        stderr = (smoothed * (1.0 - smoothed) / (count + 3)) ** 0.5
        known = ~(status == int(Status.PENDING)).any(self.over)
        found = {self.name: ended / count, f"{self.name}_stderr": stderr}
        # Recent versions of xarray keep the attributes of the status, such as its flag meanings.
        about = {"comment": f"fraction of the cells along {self.over} with each status"}
        return xr.Dataset(
            {
                name: values.where(known).drop_attrs(deep=False).assign_attrs(about)
                for name, values in found.items()
            }
        )


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Logarithm(Reduction):
    """Natural logarithm of a variable.

    The logarithm is NaN if the variable is not positive. The slope of a logarithm against the
    natural logarithm of a coordinate is the exponent of a power law. See also `PowerLaw`.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Name of the variable to reduce.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Logarithm
    >>> dataset = xr.Dataset({"drop": ("phi", [1.0, 10.0]), "status": ("phi", [0, 0])})
    >>> Logarithm(name="ln_drop", of="drop")(dataset)["ln_drop"].values.round(4).tolist()
    [0.0, 2.3026]
    """

    kind: ClassVar[str] = "logarithm"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the natural logarithm in each cell.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Logarithm, which is dimensionless.
        """
        of = dataset[self.of]
        logarithm: xr.DataArray = xr.apply_ufunc(np.log, of.where(of > 0.0))
        note = {"comment": f"natural logarithm of the numerical value of {self.of}"}
        return xr.Dataset({self.name: logarithm.drop_attrs(deep=False).assign_attrs(note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the logarithm (the reciprocal of the variable).

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        of = dataset[self.of]
        return [((1.0 / of.where(of > 0.0)).fillna(0.0), {})]


def _select_variable_to_reduce(
    reduction: _SampleStatistic | StatusShares, dataset: xr.Dataset
) -> xr.DataArray:
    """Return the variable to reduce, without auxiliary coordinates.

    Auxiliary coordinates are dropped because sums over the samples would keep these coordinates.
    """
    of = dataset[reduction.of].reset_coords(drop=True)
    if reduction.over not in of.dims:
        rule = f"is not a dimension of {reduction.of}"
        raise InvalidValue("over", reduction.over, rule, choices=map(str, of.dims))
    return of
