"""Claims: published values, held against what a dataset says.

A claim is plain data, so that it travels in the NetCDF file, and checking a file needs nothing
else.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy._deprecation import renamed_members
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.rig import SCALES_ATTRIBUTE
from rsfstudy.status import Status
from rsfstudy.study.verdict_table import VerdictTable

REPRODUCED_VERDICT = "reproduced"
DIFFERS_VERDICT = "differs"
UNDECIDED_VERDICT = "undecided"
NOT_APPLICABLE_VERDICT = "not applicable"
VERDICTS = (REPRODUCED_VERDICT, DIFFERS_VERDICT, UNDECIDED_VERDICT, NOT_APPLICABLE_VERDICT)

CLAIM_RELATIONS = ("equals", "below", "above")
#: Of a table of claims.
_VERDICT_TABLE_COLUMNS = (
    *("id", "claim", "source", "relation", "published", "ours"),
    *("tolerance", "reason", "verdict", "expected", "because", "moved"),
)
#: Reason of a tolerance of zero where more cannot be asked for.
TOLERANCE_REASON_OF_INEQUALITY = "an inequality"
_EXPECTED_VERDICTS = (REPRODUCED_VERDICT, DIFFERS_VERDICT)
_TEXT_FIELDS = (
    *("id", "statement", "source", "variable", "minus_variable", "reason", "because"),
    *("relation", "expected"),
)


@renamed_members
@guard_methods
@dataclass(frozen=True, kw_only=True)
class Claim:
    """One published value and the verdict expected on it.

    Parameters
    ----------
    id : str
        Short name, as in "C7".
    statement : str
        What is claimed, in words.
    source : str
        Where it is published.
    variable : str
        Variable of the dataset it speaks of.
    where : mapping
        Coordinate values that single out one number.
    minus : mapping, optional
        A second place; the claim is then on the difference.
    minus_variable : str, optional
        The variable at the second place, where it is another.
    relation : {"equals", "below", "above"}
        How ours should relate to the published value.
    published : float
        The published value.
    tolerance : float
        How far ours may be from it, or on the wrong side of it, and
    reason : str
        why that far; of an inequality both may be left out.
    expected : str
        The verdict expected today.
    because : str
        Why, where that is not "reproduced".
    """

    id: str
    statement: str
    source: str
    variable: str
    where: Mapping[str, Any]
    published: float
    tolerance: float = 0.0
    reason: str = TOLERANCE_REASON_OF_INEQUALITY
    relation: str = "equals"
    minus: Mapping[str, Any] = field(default_factory=dict)
    minus_variable: str = ""
    expected: str = REPRODUCED_VERDICT
    because: str = ""

    def __post_init__(self) -> None:
        for name in _TEXT_FIELDS:
            if not isinstance(getattr(self, name), str):
                rule = f"must be a text, in claim {self.id}"
                raise InvalidValue(name, getattr(self, name), rule)
        if self.relation not in CLAIM_RELATIONS:
            raise InvalidValue("relation", self.relation, "is unknown", choices=CLAIM_RELATIONS)
        if self.relation == "equals" and self.reason == TOLERANCE_REASON_OF_INEQUALITY:
            rule = f"must tell why the tolerance is {self.tolerance}, in claim {self.id}"
            raise InvalidValue("reason", self.reason, rule)
        if self.expected not in _EXPECTED_VERDICTS:
            raise InvalidValue(
                "expected", self.expected, "is no verdict", choices=_EXPECTED_VERDICTS
            )
        for name in ("published", "tolerance"):
            value = getattr(self, name)
            if not _is_number(value) or not math.isfinite(value):
                raise InvalidValue(name, value, f"must be a number, in claim {self.id}")
        for name in ("where", "minus"):
            if not isinstance(getattr(self, name), Mapping):
                rule = f"must map coordinates to values, in claim {self.id}"
                raise InvalidValue(name, getattr(self, name), rule)
            for value in getattr(self, name).values():
                if not isinstance(value, str) and not _is_number(value):
                    rule = f"must be a text or a number, in claim {self.id}"
                    raise InvalidValue(name, value, rule)

    @classmethod
    def below(cls, **claim_fields: Any) -> Claim:
        """A claim that ours is below the published value; takes what `Claim` does."""
        return cls(relation="below", **claim_fields)

    @classmethod
    def above(cls, **claim_fields: Any) -> Claim:
        """A claim that ours is above the published value; takes what `Claim` does."""
        return cls(relation="above", **claim_fields)

    def describe(self) -> dict[str, Any]:
        """The claim as plain data."""
        return {**asdict(self), "where": dict(self.where), "minus": dict(self.minus)}

    def check_selection(self, dataset: xr.Dataset) -> None:
        """Raise InvalidValue where a dataset has no such variable or place: the claim would never
        be applicable.
        """
        variables, coordinates = map(str, dataset.data_vars), [str(n) for n in dataset.coords]
        for variable in filter(None, (self.variable, self.minus_variable)):
            if variable not in dataset:
                rule = f"is no variable of the results, in claim {self.id}"
                raise InvalidValue("variable", variable, rule, choices=sorted(variables))
        for name in [*self.where, *self.minus]:
            if name not in coordinates:
                rule = f"is no coordinate of the results, in claim {self.id}"
                raise InvalidValue("where", name, rule, choices=sorted(coordinates))
        if self.verdict(dataset)[1] == NOT_APPLICABLE_VERDICT:
            rule = f"is no place of the lattice, in claim {self.id}"
            raise InvalidValue("where", {**self.where, **self.minus}, rule)

    def verdict(self, dataset: xr.Dataset) -> tuple[float, str]:
        """Our value, and whether it reproduces the published one.

        A place the lattice does not have makes the claim not applicable; a place without a number
        leaves it undecided.
        """
        try:
            ours = _select_single_value(dataset, self.variable, self.where)
            if self.minus:
                ours -= _select_single_value(
                    dataset, self.minus_variable or self.variable, self.minus
                )
        except KeyError:
            return math.nan, NOT_APPLICABLE_VERDICT
        if math.isnan(ours):
            return ours, UNDECIDED_VERDICT
        distance = ours - self.published
        holds = {
            "equals": abs(distance) <= self.tolerance,
            "below": distance < self.tolerance,
            "above": distance > -self.tolerance,
        }[self.relation]
        return ours, REPRODUCED_VERDICT if holds else DIFFERS_VERDICT


def build_verdict_table(
    dataset: xr.Dataset, claims: list[Claim], study_overrides: Mapping[str, Any]
) -> VerdictTable:
    """A table of claims, one row each.

    Claims hold for a study as declared. Where a fixed value of the scene or of the measure was
    changed (`overrides` that are no dimension or coordinate along one), they are not applicable;
    nor are claims on what was reduced along an axis that was changed, and any on other units.
    """
    along = {str(name) for name in dataset.coords if dataset[name].ndim > 0}
    moved_base = [
        name for name in study_overrides if name not in along
    ] or SCALES_ATTRIBUTE in dataset.attrs
    rows = []
    for claim in claims:
        ours, verdict = claim.verdict(dataset)
        if moved_base or not _has_all_overridden_dimensions(
            dataset, claim.variable, study_overrides
        ):
            verdict = NOT_APPLICABLE_VERDICT
        moved = verdict not in (claim.expected, NOT_APPLICABLE_VERDICT)
        about = claim.id, claim.statement, claim.source, claim.relation, claim.published, ours
        why = claim.tolerance, claim.reason, verdict, claim.expected, claim.because, moved
        rows.append((*about, *why))
    return VerdictTable(pd.DataFrame(rows, columns=_VERDICT_TABLE_COLUMNS).astype({"moved": bool}))


def _is_number(value: object) -> bool:
    """True if a value is a number that a float can hold."""
    return isinstance(value, int | float) and not sys.float_info.max < abs(value) < math.inf


def _has_all_overridden_dimensions(
    dataset: xr.Dataset, variable_name: str, study_overrides: Mapping[str, Any]
) -> bool:
    """True if a variable still has every dimension that was changed."""
    changed = {str(d) for n in study_overrides if n in dataset.coords for d in dataset[n].dims}
    return variable_name not in dataset or changed <= set(dataset[variable_name].dims)


def _select_single_value(
    dataset: xr.Dataset, variable_name: str, coordinate_values: Mapping[str, Any]
) -> float:
    """The one number at these coordinate values; KeyError where there is no such place."""
    values = dataset[variable_name]
    for name, wanted in coordinate_values.items():
        at, text = dataset[name], isinstance(wanted, str)
        along = at.ndim <= 1 and set(at.dims) <= set(values.dims)
        if not along or at.dtype.kind not in ("OUST" if text else "iufb"):
            raise KeyError(name)
        same = at.values == wanted if text else np.isclose(at.values, wanted, rtol=1e-9, atol=0.0)
        matches = np.flatnonzero(same)
        if matches.size != 1:
            raise KeyError(name)
        values = values.isel(dict.fromkeys(at.dims, int(matches[0])))
    if values.ndim or values.dtype.kind not in "iufb":
        raise KeyError(variable_name)  # more dimensions than the claim speaks of, or no number
    if variable_name == "status" and int(values) == int(Status.PENDING):
        return math.nan
    return float(values)
