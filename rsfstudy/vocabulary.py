"""Quantities that scenes, motions and results share: name, symbol, units and long name of each,
for datasets, axis labels and tables; most stand in vocabulary.csv. What one measure alone gives is
described in its own file.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from types import MappingProxyType
from typing import Any

from rsfstudy.quantities import Quantity
from rsfstudy.slider import FIELD_QUANTITIES as SCENE


def _read_vocabulary() -> Iterator[Quantity]:
    """The quantities beside those of scenes, in the order in which datasets and pages name them:
    of scenes and rigs; of measures, or along motions; of reductions; and of every lattice.
    """
    with resources.files(__package__).joinpath("vocabulary.csv").open(encoding="utf-8") as file:
        rows: Iterator[dict[str, Any]] = csv.DictReader(file)
        yield from (Quantity(**row) for row in rows)


QUANTITY_BY_NAME: dict[str, Quantity] = {
    about.name: about for about in (*SCENE, *_read_vocabulary())
}

_SUFFIX_DESCRIPTIONS = {
    "error": "numerical error estimate of",
    "stable": "value verified as stable beside",
    "unstable": "value verified as unstable beside",
    "stderr": "standard error (misfit of the fitted law) of",
    "misfit": "largest misfit of the law fitted for",
    "points": "number of points fitted for",
    "crossings": "changes of the answer along",
    "closed_form": "published closed form beside",
}

_SUFFIXES_OF_COUNT_VARIABLES = ("points", "crossings")

#: Times that were measured: no two runs share them.
TIMING_VARIABLES = (
    "wall_time",
    "run_time",
    "relative_time",
    "cheapest_default_time",
    "evaluation_cost",
    "evaluation_cost_in_rupture",
    "time_per_evaluation",
    "time_per_evaluation_in_rupture",
)

#: Coordinates that follow from an axis: name -> (axis, formula).
FORMULAS_OF_DERIVED_COORDINATES: dict[str, tuple[str, Callable[[float], float]]] = {
    "log_load_velocity_ratio": (
        "load_velocity_ratio",
        lambda ratio: -math.inf if ratio == 0.0 else math.log(ratio),
    ),
    "a_over_b_minus_a": (
        "b_over_a",
        lambda b_over_a: math.inf if b_over_a == 1.0 else 1.0 / (b_over_a - 1.0),
    ),
}


def coverage_content_type(variable_name: str) -> str:
    """Kind of content of a variable, in the words of ISO 19115-1."""
    if variable_name in ("rhs_evaluations", *TIMING_VARIABLES):
        return "auxiliaryInformation"
    if variable_name in ("status", "message") or re.search(
        "_(error|stderr|misfit|points)$", variable_name
    ):
        return "qualityInformation"
    return "modelResult"


def find_quantity(
    variable_name: str, extra_quantities: Mapping[str, Quantity] = MappingProxyType({})
) -> Quantity:
    """Look a quantity up, deriving ``<name>_error`` and its like from ``<name>``.

    Names that neither `extra_quantities` nor the vocabulary holds describe themselves.

    Parameters
    ----------
    variable_name : str
    extra_quantities : mapping of str to Quantity
        What a study says of its own numbers.
    """
    if variable_name in extra_quantities:
        return extra_quantities[variable_name]
    if variable_name in QUANTITY_BY_NAME:
        return QUANTITY_BY_NAME[variable_name]
    match = re.fullmatch(rf"(\w+)_({'|'.join(_SUFFIX_DESCRIPTIONS)})", variable_name)
    if match:
        of = find_quantity(match[1], extra_quantities)
        units = "1" if match[2] in _SUFFIXES_OF_COUNT_VARIABLES else of.units
        scale = "" if match[2] in _SUFFIXES_OF_COUNT_VARIABLES else of.scale
        return Quantity(
            variable_name,
            of.symbol,
            units,
            f"{_SUFFIX_DESCRIPTIONS[match[2]]} {of.long_name}",
            scale,
        )
    return Quantity(variable_name, "", "1", variable_name.replace("_", " "))
