"""Functions that draw the random samples and read the tables of cases for the axes of a study.

The quantile functions of the distributions convert points in the unit cube to samples. See
`Axis.samples` and `Axis.cases`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from rsfstudy.argument_checks import MAX_ITEMS_OF_LIST_ARGUMENT
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import split_heading_into_name_and_units

#: Source of a field: the name of a sampled quantity, or a function of all sampled quantities.
QuantityNameOrFunction = str | Callable[[Mapping[str, np.ndarray]], Any]

SAMPLING_METHODS = ("sobol", "latin_hypercube", "random", "saltelli")
#: Sampling methods that use Sobol points. Sobol points are balanced only if their number is a power
#: of two.
_SOBOL_SAMPLING_METHODS = ("sobol", "saltelli")
#: Smallest probability at which quantiles are computed. The quantiles of unbounded distributions
#: are infinite at the probabilities 0 and 1.
_MIN_QUANTILE_PROBABILITY = 2.0**-40
#: Tolerance for negative eigenvalues of a correlation matrix. Small negative eigenvalues result
#: from rounding errors.
_NEGATIVE_EIGENVALUE_TOLERANCE = 1e-10
#: Dimension of the draws of fitted parameters, and units of the fitted parameters that are also
#: fields with units.
_DRAW_DIMENSION, _UNITS_BY_FITTED_PARAMETER = "draw", {"slip_distance": "um", "stiffness": "1/um"}


def draw_samples(
    distributions: Mapping[str, Any], sample_count: int, seed: int, method: str, covariance: Any
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Draw samples of several quantities.

    Parameters
    ----------
    distributions : mapping of str to distribution or float
        Distribution or mean value of each quantity.
    sample_count : int
        Number of samples.
    seed : int
        Seed of the random number generator.
    method : str
        Name of the sampling method.
    covariance : array_like or None
        Covariance matrix in the order of the distributions.

    Returns
    -------
    samples : dict of str to ndarray
        Samples of each quantity.
    info : dict of str to object
        Description of the method and its arguments.

    Raises
    ------
    InvalidValue
        If an argument is invalid. See `Axis.samples`.
    """
    if not isinstance(distributions, Mapping) or not distributions:
        raise InvalidValue(
            "distribution",
            distributions,
            "must be a mapping from names to distributions, with at least one name",
        )
    _check_sampling_arguments(distributions, sample_count, seed, method)
    deviations, correlation = _compute_stds_and_correlation_matrix(
        distributions, covariance, method
    )
    scores = ndtri(
        _draw_uniform_samples(len(distributions), sample_count, seed, method)
    ) @ _compute_matrix_square_root(correlation)
    found = {}
    for (name, drawn), score, deviation in zip(
        distributions.items(), scores.T, deviations, strict=True
    ):
        if _is_mean_of_normal_distribution(drawn):
            found[name] = drawn + deviation * score
        else:
            found[name] = _compute_quantiles(name, drawn, ndtr(score))
    how = {
        "method": method,
        "n": sample_count * (len(distributions) + 2) if method == "saltelli" else sample_count,
        "seed": seed,
        "of": {name: _describe_distribution(drawn) for name, drawn in distributions.items()},
    }
    if covariance is not None:
        how["covariance"] = np.asarray(covariance, dtype=float).tolist()
    return found, how


def _check_sampling_arguments(
    distributions: Mapping[str, Any], sample_count: int, seed: int, method: str
) -> None:
    if method not in SAMPLING_METHODS:
        raise InvalidValue("method", method, "is unknown", choices=SAMPLING_METHODS)
    for name, value, least in (("n", sample_count, 1), ("seed", seed, 0)):
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
            raise InvalidValue(name, value, f"must be a whole number, {least} or more")
    if sample_count > MAX_ITEMS_OF_LIST_ARGUMENT:
        raise InvalidValue("n", sample_count, f"must be at most {MAX_ITEMS_OF_LIST_ARGUMENT:,}")
    if method in _SOBOL_SAMPLING_METHODS and sample_count & (sample_count - 1):
        below = 1 << (int(sample_count).bit_length() - 1)
        rule = "must be a power of two, because Sobol sequences are balanced only for powers of two"
        remedy = f"Use n={below} or n={2 * below}, or method='latin_hypercube'."
        raise InvalidValue("n", sample_count, rule, remedy=remedy)
    for name, drawn in distributions.items():
        if not _is_mean_of_normal_distribution(drawn) and _get_quantile_function(drawn) is None:
            rule = "must be a frozen distribution of scipy.stats, or a mean value"
            raise InvalidValue(
                name, drawn, rule, remedy="Pass, for example, scipy.stats.norm(0.01, 0.001)."
            )


def _compute_stds_and_correlation_matrix(
    distributions: Mapping[str, Any], covariance: Any, method: str
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the standard deviations and correlations of the sampled quantities."""
    count = len(distributions)
    estimates = [
        name for name, drawn in distributions.items() if _is_mean_of_normal_distribution(drawn)
    ]
    if covariance is None:
        if estimates:
            rule = "is a mean value, which requires a variance"
            remedy = "Pass the argument covariance, or replace the value with a distribution."
            raise InvalidValue(estimates[0], distributions[estimates[0]], rule, remedy=remedy)
        return np.ones(count), np.eye(count)
    try:
        given = np.asarray(covariance, dtype=float)
    except (TypeError, ValueError):
        given = np.empty(0)
    if given.shape != (count, count) or not np.isfinite(given).all():
        rule = f"must be a {count} by {count} matrix of finite numbers"
        remedy = f"The order of the rows and columns is {', '.join(distributions)}."
        if count == 1:
            remedy = f"The matrix contains the variance of {', '.join(distributions)}."
        raise InvalidValue("covariance", covariance, rule, remedy=remedy)
    variances = np.diag(given)
    if not np.allclose(given, given.T, rtol=1e-9, atol=0.0) or (variances <= 0.0).any():
        rule = "must be symmetric with positive variances on the diagonal"
        raise InvalidValue("covariance", given.tolist(), rule)
    deviations = np.sqrt(variances)
    correlation = given / np.outer(deviations, deviations)
    if method == "saltelli" and not np.array_equal(correlation, np.eye(count)):
        rule = "must be diagonal, because Sobol indices require independent quantities"
        remedy = (
            "To keep the correlation, use method='sobol', which computes no indices. To compute "
            "indices, sample independent quantities and derive the fields from them with fields=."
        )
        raise InvalidValue("covariance", given.tolist(), rule, remedy=remedy)
    lowest = float(np.linalg.eigvalsh(correlation)[0])
    if lowest < -_NEGATIVE_EIGENVALUE_TOLERANCE * count:
        rule = (
            "must be positive semidefinite, but its correlation matrix has the eigenvalue "
            f"{lowest:.2g}"
        )
        raise InvalidValue("covariance", given.tolist(), rule)
    return deviations, correlation


def _compute_matrix_square_root(correlation: np.ndarray) -> np.ndarray:
    """Compute the symmetric square root of a matrix.

    Unlike other matrix factorisations, the symmetric square root is unique, so all machines return
    the same samples.
    """
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _draw_uniform_samples(
    quantity_count: int, sample_count: int, seed: int, method: str
) -> np.ndarray:
    """Draw an array of points in the unit cube, with one row per sample."""
    random = np.random.default_rng(seed)
    if method == "random":
        found = random.random((sample_count, quantity_count))
    elif method == "latin_hypercube":
        found = qmc.LatinHypercube(quantity_count, seed=random).random(sample_count)
    else:
        found = qmc.Sobol(quantity_count * (1 + (method == "saltelli")), seed=random).random(
            sample_count
        )
    if method == "saltelli":
        # Saltelli's scheme splits each point into two points A and B, and adds copies of A in which
        # one coordinate is replaced by the coordinate of B.
        ours, theirs = found[:, :quantity_count], found[:, quantity_count:]
        mixed = np.where(np.eye(quantity_count, dtype=bool), theirs[:, None, :], ours[:, None, :])
        found = np.concatenate([ours[:, None], theirs[:, None], mixed], axis=1)
    return np.clip(
        found.reshape(-1, quantity_count),
        _MIN_QUANTILE_PROBABILITY,
        1.0 - _MIN_QUANTILE_PROBABILITY,
    )


def _is_mean_of_normal_distribution(distribution: Any) -> bool:
    return isinstance(distribution, int | float | np.number) and not isinstance(distribution, bool)


def _get_quantile_function(distribution: Any) -> Any:
    """Return the quantile function of a distribution."""
    return (
        getattr(distribution, "ppf", None)
        if hasattr(distribution, "dist")
        else getattr(distribution, "icdf", None)
    )


def _compute_quantiles(
    quantity_name: str, distribution: Any, probabilities: np.ndarray
) -> np.ndarray:
    """Compute the quantiles of a distribution, and check that they are finite."""
    try:
        found = np.asarray(_get_quantile_function(distribution)(probabilities), dtype=float)
    except ValueError:  # The parameters of the distribution are arrays.
        found = np.empty(0)
    if found.shape != probabilities.shape or not np.isfinite(found).all():
        raise InvalidValue(
            quantity_name,
            _describe_distribution(distribution),
            "has quantiles that are not finite numbers",
            remedy="Its parameters must be single finite numbers, and its width must be positive.",
        )
    return found


def _describe_distribution(distribution: Any) -> Any:
    """Format a distribution as a string for display.

    If a mean value is passed instead of a distribution, the function returns a float.
    """
    if _is_mean_of_normal_distribution(distribution):
        return float(distribution)
    if not hasattr(distribution, "dist"):
        return str(distribution)
    given = [
        *map(str, distribution.args),
        *(f"{name}={value}" for name, value in distribution.kwds.items()),
    ]
    return f"{distribution.dist.name}({', '.join(given)})"


def compute_field_values_from_samples(
    sampled_values: Mapping[str, Any],
    quantity_or_function_by_field: Mapping[str, QuantityNameOrFunction] | None,
) -> dict[str, Sequence[Any] | np.ndarray]:
    """Compute the values of all fields from sampled quantities.

    Parameters
    ----------
    sampled_values : mapping of str to array_like
        Samples of each quantity.
    quantity_or_function_by_field : mapping of str to str or callable, or None
        Source of each field. If None, each quantity sets the field of the same name.

    Returns
    -------
    dict of str to sequence or ndarray
        Values of each field.

    Raises
    ------
    InvalidValue
        If a source is unknown, or if a function does not return numbers.
    """
    if quantity_or_function_by_field is None:
        return dict(sampled_values)
    found = {}
    for name, by in quantity_or_function_by_field.items():
        if isinstance(by, str):
            if by not in sampled_values:
                raise InvalidValue(
                    name, by, "is not the name of a sampled quantity", choices=sampled_values
                )
            found[name] = sampled_values[by]
        else:
            found[name] = _evaluate_field_function(
                name, by, {n: np.asarray(values) for n, values in sampled_values.items()}
            )
    return found


def _evaluate_field_function(
    field_name: str, field_function: Callable[..., Any], sampled_values: Mapping[str, np.ndarray]
) -> np.ndarray:
    count = len(next(iter(sampled_values.values())))
    try:
        made = np.asarray(field_function(sampled_values)).astype(float, casting="same_kind")
        return np.broadcast_to(made, count)
    except Exception as error:
        rule = f"does not return one number per sample ({type(error).__name__}: {error})"
        raise InvalidValue(
            field_name,
            getattr(field_function, "__name__", field_function),
            rule,
            choices=sampled_values,
        ) from error


def read_table_columns_and_units(table: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Read the columns of a table and their units.

    Parameters
    ----------
    table : mapping of str to sequence, DataFrame or Dataset
        Table with named columns.

    Returns
    -------
    columns : dict of str to list
        Values of each column.
    units : dict of str to str
        Units of the columns that have units.

    Raises
    ------
    InvalidValue
        If the object is not a table, if a column occurs twice, or if units contradict each other.
    """
    if not hasattr(table, "keys") or getattr(table, "ndim", 2) != 2 or not len(table):
        rule = "must have named columns and at least one row"
        remedy = "Pass a mapping of names to lists, a DataFrame, or rsfstudy.read_table(path)."
        raise InvalidValue("table", table, rule, remedy=remedy)
    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    # Iterate over data variables only, because coordinates are not columns.
    for key in getattr(table, "data_vars", table):
        heading, column = str(key), table[key]
        stated = getattr(column, "attrs", {}).get("units", getattr(column, "units", ""))
        # The coordinate contains the units of a parameter that was selected from posterior draws.
        of_parameter = getattr(column, "coords", {}).get("parameter_units")
        if of_parameter is not None and not of_parameter.ndim:
            stated = of_parameter.item()
        stated = stated.get(heading, "") if isinstance(stated, Mapping) else stated
        name, of_heading = split_heading_into_name_and_units(heading) or (heading, "")
        if name in found:
            raise InvalidValue("column", name, "occurs twice in the table")
        if stated and of_heading and stated != of_heading:
            rule = f"differ from the units in the heading {heading!r}"
            remedy = "Omit the units, or correct the heading."
            raise InvalidValue("units", stated, rule, remedy=remedy)
        values = getattr(column, "values", column)
        values = np.asarray(values) if hasattr(values, "dtype") else values
        if np.ndim(np.asarray(values, dtype=object)) != 1:
            raise InvalidValue(name, column, "must be a list with one value per row")
        found[name], stated = list(values), stated or of_heading
        if stated not in ("", "1"):
            units[name] = stated
    return found, units


def check_fitted_draws_have_units(
    table: Any,
    columns_by_field: Mapping[str, QuantityNameOrFunction],
    units_by_field: Mapping[str, str],
) -> None:
    """Check that draws of a fitted slip distance or stiffness have units.

    Fitted values are in um or MPa/um, whereas field values without units are assumed to be in SI
    units.

    Parameters
    ----------
    table : mapping of str to sequence, DataFrame or Dataset
        Table with named columns. Draws of fitted parameters have the dimension or the index
        ``draw``.
    columns_by_field : mapping of str to str or callable
        Column of each field, or a function that computes the field.
    units_by_field : mapping of str to str
        Units of the fields that have units.

    Raises
    ------
    InvalidValue
        If a field without units is set to the draws of a parameter with units.
    """
    for name, column_name in columns_by_field.items():
        if not isinstance(column_name, str) or name in units_by_field:
            continue
        units = _UNITS_BY_FITTED_PARAMETER.get(column_name)
        if (
            units
            and column_name in table
            and _contains_draws_of_fitted_parameters(table[column_name])
        ):
            raise InvalidValue(
                name,
                float(np.ravel(table[column_name])[0]),
                f"has no units, although the draws of a fit are in {units}",
                remedy="Pass fit.rsf.sample_parameters(n, posterior=True), whose columns have "
                f"units, or add units={{{name!r}: {units!r}}}.",
            )


def _contains_draws_of_fitted_parameters(column: Any) -> bool:
    """Return True if a column of a table contains draws of fitted parameters."""
    index_name = getattr(getattr(column, "index", None), "name", None)
    return _DRAW_DIMENSION in (*getattr(column, "dims", ()), index_name)
