"""Samples of several quantities at once: from distributions, by sequences that fill space evenly;
and tables of cases.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from rsfstudy.argument_checks import MAX_ITEMS
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import parse_heading

#: What a field is set by: a quantity that is drawn, or a function of all of them.
QuantityNameOrFunction = str | Callable[[Mapping[str, np.ndarray]], Any]

SAMPLING_METHODS = ("sobol", "latin_hypercube", "random", "saltelli")
#: Those that are made of Sobol points, whose number must be a power of two to be balanced.
_SOBOL_METHODS = ("sobol", "saltelli")
#: Probabilities nearer to 0 and 1 are none: a distribution without bounds would be infinite there.
_MIN_SAMPLED_PROBABILITY = 2.0**-40
#: Rounding error that an eigenvalue of a correlation, over the largest, may have.
_EIGENVALUE_ROUNDING_ERROR = 1e-10


def draw_samples(
    distributions: Mapping[str, Any], sample_count: int, seed: int, method: str, covariance: Any
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Samples of each quantity, and how they were drawn as plain data; see `Axis.samples`."""
    if not isinstance(distributions, Mapping) or not distributions:
        raise InvalidValue("distribution", distributions, "must map names to distributions")
    _check_sampling_arguments(distributions, sample_count, seed, method)
    deviations, correlation = _deviations_and_correlation(distributions, covariance, method)
    scores = ndtri(
        _draw_uniform_samples(len(distributions), sample_count, seed, method)
    ) @ _matrix_square_root(correlation)
    found = {}
    for (name, drawn), score, deviation in zip(
        distributions.items(), scores.T, deviations, strict=True
    ):
        if _is_value_with_error(drawn):
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
    if sample_count > MAX_ITEMS:
        raise InvalidValue("n", sample_count, f"must be at most {MAX_ITEMS:,}")
    if method in _SOBOL_METHODS and sample_count & (sample_count - 1):
        below = 1 << (int(sample_count).bit_length() - 1)
        rule = "is no power of two, without which Sobol points are not balanced"
        remedy = f"Draw {below} or {2 * below}, or by method='latin_hypercube'."
        raise InvalidValue("n", sample_count, rule, remedy=remedy)
    for name, drawn in distributions.items():
        if not _is_value_with_error(drawn) and _quantile_function(drawn) is None:
            rule = "is neither a distribution of scipy.stats with its parameters, nor an estimate"
            raise InvalidValue(name, drawn, rule, remedy="As in scipy.stats.norm(0.01, 0.001).")


def _deviations_and_correlation(
    distributions: Mapping[str, Any], covariance: Any, method: str
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of what is drawn, and the correlation of their normal scores."""
    count = len(distributions)
    estimates = [name for name, drawn in distributions.items() if _is_value_with_error(drawn)]
    if covariance is None:
        if estimates:
            rule = "is an estimate without a variance"
            remedy = "Give covariance=, or a distribution in its place."
            raise InvalidValue(estimates[0], distributions[estimates[0]], rule, remedy=remedy)
        return np.ones(count), np.eye(count)
    try:
        given = np.asarray(covariance, dtype=float)
    except (TypeError, ValueError):
        given = np.empty(0)
    if given.shape != (count, count) or not np.isfinite(given).all():
        rule = f"must be {count} by {count} finite numbers, in the order {', '.join(distributions)}"
        raise InvalidValue("covariance", covariance, rule)
    variances = np.diag(given)
    if not np.allclose(given, given.T, rtol=1e-9, atol=0.0) or (variances <= 0.0).any():
        rule = "must be symmetric, with variances above zero along its diagonal"
        raise InvalidValue("covariance", given.tolist(), rule)
    deviations = np.sqrt(variances)
    correlation = given / np.outer(deviations, deviations)
    if method == "saltelli" and not np.array_equal(correlation, np.eye(count)):
        rule = "correlates what is drawn, and Sobol indices are of independent quantities"
        remedy = "Draw by method='sobol', or draw independent quantities of which fields are made."
        raise InvalidValue("covariance", given.tolist(), rule, remedy=remedy)
    lowest = float(np.linalg.eigvalsh(correlation)[0])
    if lowest < -_EIGENVALUE_ROUNDING_ERROR * count:
        rule = f"is impossible: its correlations have the eigenvalue {lowest:.2g}, below zero"
        raise InvalidValue("covariance", given.tolist(), rule)
    return deviations, correlation


def _matrix_square_root(correlation: np.ndarray) -> np.ndarray:
    """The symmetric square root, which unlike other factors is one on every machine."""
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _draw_uniform_samples(
    quantity_count: int, sample_count: int, seed: int, method: str
) -> np.ndarray:
    """Points of the unit cube, of shape (samples, count)."""
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
        # of each point: A, B, and A with one coordinate from B after the other
        ours, theirs = found[:, :quantity_count], found[:, quantity_count:]
        mixed = np.where(np.eye(quantity_count, dtype=bool), theirs[:, None, :], ours[:, None, :])
        found = np.concatenate([ours[:, None], theirs[:, None], mixed], axis=1)
    return np.clip(
        found.reshape(-1, quantity_count), _MIN_SAMPLED_PROBABILITY, 1.0 - _MIN_SAMPLED_PROBABILITY
    )


def _is_value_with_error(distribution: Any) -> bool:
    return isinstance(distribution, int | float | np.number) and not isinstance(distribution, bool)


def _quantile_function(distribution: Any) -> Any:
    """The function that gives quantiles of a distribution; None of what is none."""
    return (
        getattr(distribution, "ppf", None)
        if hasattr(distribution, "dist")
        else getattr(distribution, "icdf", None)
    )


def _compute_quantiles(
    quantity_name: str, distribution: Any, probabilities: np.ndarray
) -> np.ndarray:
    """The quantiles of a distribution."""
    try:
        found = np.asarray(_quantile_function(distribution)(probabilities), dtype=float)
    except ValueError:  # of parameters that are arrays
        found = np.empty(0)
    if found.shape != probabilities.shape or not np.isfinite(found).all():
        raise InvalidValue(
            quantity_name,
            _describe_distribution(distribution),
            "has no finite quantiles: look at its parameters",
        )
    return found


def _describe_distribution(distribution: Any) -> Any:
    """A distribution in words; an estimate as it is."""
    if _is_value_with_error(distribution):
        return float(distribution)
    if not hasattr(distribution, "dist"):
        return str(distribution)
    given = [
        *map(str, distribution.args),
        *(f"{name}={value}" for name, value in distribution.kwds.items()),
    ]
    return f"{distribution.dist.name}({', '.join(given)})"


def compute_field_values(
    sampled_values: Mapping[str, Any], field_sources: Mapping[str, QuantityNameOrFunction] | None
) -> dict[str, Sequence[Any] | np.ndarray]:
    """Values of each field that is set: by a quantity that is drawn, or a function of them all."""
    if field_sources is None:
        return dict(sampled_values)
    found = {}
    for name, by in field_sources.items():
        if isinstance(by, str):
            if by not in sampled_values:
                raise InvalidValue(name, by, "is not drawn", choices=sampled_values)
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
        rule = f"gives no number for each sample ({type(error).__name__}: {error})"
        raise InvalidValue(
            field_name,
            getattr(field_function, "__name__", field_function),
            rule,
            choices=sampled_values,
        ) from error


def read_table_columns_and_units(table: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Columns of a table by their names, and the units that it states of them."""
    if not hasattr(table, "keys") or getattr(table, "ndim", 2) != 2 or not len(table):
        rule = "is no table of columns"
        remedy = "Give a mapping of names to lists, a DataFrame, or rsfstudy.read_table(path)."
        raise InvalidValue("table", table, rule, remedy=remedy)
    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    # the keys of an xarray.Dataset are its data variables
    for key in getattr(table, "data_vars", table):
        heading, column = str(key), table[key]
        stated = getattr(column, "attrs", {}).get("units", getattr(column, "units", ""))
        stated = stated.get(heading, "") if isinstance(stated, Mapping) else stated
        name, of_heading = parse_heading(heading) or (heading, "")
        if name in found:
            raise InvalidValue("column", name, "stands twice in the table")
        if stated and of_heading and stated != of_heading:
            raise InvalidValue("units", stated, f"are not those of the heading, {heading}")
        values = getattr(column, "values", column)
        values = np.asarray(values) if hasattr(values, "dtype") else values
        if np.ndim(np.asarray(values, dtype=object)) != 1:
            raise InvalidValue(name, column, "must be one list, of a value for each row")
        found[name], stated = list(values), stated or of_heading
        if stated not in ("", "1"):
            units[name] = stated
    return found, units
