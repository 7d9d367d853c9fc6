"""Shared vocabulary of the quantities in scenes, motions and results.

Each quantity has a name, a symbol, units and a long name. Datasets, axis labels and tables use
these properties. Most quantities are defined in ``vocabulary.csv``. A quantity that only one
measure computes is defined in the module of the measure.
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
from rsfstudy.slider import SceneFields


def _read_quantities_from_csv() -> Iterator[Quantity]:
    """Yield the quantities of the file ``vocabulary.csv``.

    The file does not list scene fields. The file lists quantities of scenes and rigs first, then
    quantities of measures and motions, then quantities of reductions, and finally quantities that
    every lattice has. Datasets and pages list the quantities in the order of the file.
    """
    with resources.files(__package__).joinpath("vocabulary.csv").open(encoding="utf-8") as file:
        rows: Iterator[dict[str, Any]] = csv.DictReader(file)
        yield from (Quantity(**row) for row in rows)


QUANTITY_BY_NAME: dict[str, Quantity] = {
    about.name: about for about in (*SceneFields.QUANTITIES, *_read_quantities_from_csv())
}

_DESCRIPTION_BY_VARIABLE_SUFFIX = {
    "error": "numerical error estimate of",
    "stable": "largest value verified as stable for",
    "unstable": "smallest value verified as unstable for",
    "stderr": "standard error (misfit of the fitted law) of",
    "misfit": "largest misfit of the fitted law of",
    "points": "number of fitted points of",
    "crossings": "number of crossings of",
    "closed_form": "published closed-form value of",
}

_SUFFIXES_OF_COUNT_VARIABLES = ("points", "crossings")

#: Variables that contain measured computing times, and therefore differ between two runs of the
#: same study.
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

#: Coordinates that are computed from an axis. The dictionary maps the name of a coordinate to the
#: name of the axis and the formula.
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


def find_coverage_content_type(variable_name: str) -> str:
    """Return the content type of a variable, as a term of ISO 19115-1.

    Parameters
    ----------
    variable_name : str
        Name of the variable.

    Returns
    -------
    str
        ``"auxiliaryInformation"`` for costs and times, ``"qualityInformation"`` for statuses,
        messages and error estimates, and ``"modelResult"`` for other variables.
    """
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
    """Find the quantity of a variable.

    The quantity of a derived variable, such as ``<name>_error``, is built from the quantity
    ``<name>``. If a name is unknown, the returned quantity is dimensionless and its long name is
    the variable name.

    Parameters
    ----------
    variable_name : str
        Name of the variable.
    extra_quantities : mapping of str to Quantity, optional
        Additional quantities, for example the outputs of a user-defined measure. These quantities
        take precedence over the shared vocabulary.

    Returns
    -------
    Quantity
        Description of the variable.
    """
    if variable_name in extra_quantities:
        return extra_quantities[variable_name]
    if variable_name in QUANTITY_BY_NAME:
        return QUANTITY_BY_NAME[variable_name]
    match = re.fullmatch(rf"(\w+)_({'|'.join(_DESCRIPTION_BY_VARIABLE_SUFFIX)})", variable_name)
    if match:
        of = find_quantity(match[1], extra_quantities)
        units = "1" if match[2] in _SUFFIXES_OF_COUNT_VARIABLES else of.units
        scale = "" if match[2] in _SUFFIXES_OF_COUNT_VARIABLES else of.scale
        return Quantity(
            variable_name,
            of.symbol,
            units,
            f"{_DESCRIPTION_BY_VARIABLE_SUFFIX[match[2]]} {of.long_name}",
            scale,
        )
    return Quantity(variable_name, "", "1", variable_name.replace("_", " "))
