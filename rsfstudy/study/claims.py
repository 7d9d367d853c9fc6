"""Claims, which compare results with published values.

A claim contains only plain data. A claim can therefore be stored in a NetCDF file, and the results
in the file can be checked without the study that created the file.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy._deprecation import accept_former_keyword_names, add_former_member_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.study.claim_verdict_table import ClaimVerdictTable

REPRODUCED_VERDICT = "reproduced"
DIFFERS_VERDICT = "differs"
UNDECIDED_VERDICT = "undecided"
NOT_APPLICABLE_VERDICT = "not applicable"
VERDICTS = (REPRODUCED_VERDICT, DIFFERS_VERDICT, UNDECIDED_VERDICT, NOT_APPLICABLE_VERDICT)

CLAIM_RELATIONS = ("equals", "below", "above")
#: Columns of the table of verdicts on claims.
_VERDICT_TABLE_COLUMNS = (
    *("id", "claim", "source", "relation", "published", "computed"),
    *("tolerance", "reason", "verdict", "expected", "difference_reason", "verdict_changed"),
)
#: Default reason for the tolerance of a claim. An equality requires another reason.
DEFAULT_REASON_FOR_TOLERANCE = "an inequality"
_ALLOWED_EXPECTED_VERDICTS = (REPRODUCED_VERDICT, DIFFERS_VERDICT)
_STRING_FIELDS_OF_CLAIM = (
    *("id", "statement", "source", "variable", "baseline_variable", "reason"),
    *("difference_reason", "relation", "expected"),
)


@accept_former_keyword_names
@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Claim:
    """Claim that compares a result with a published value and states the expected verdict.

    Parameters
    ----------
    id : str
        Short name of the claim, such as ``"C7"``.
    statement : str
        Statement of the claim in words.
    source : str
        Literature reference of the published value.
    variable : str
        Name of the variable to compare with the published value.
    where : mapping of str to object
        Coordinate values that select a single value of the variable.
    published : float
        Published value.
    tolerance : float, default: 0.0
        Largest permitted difference between the result and the published value. An inequality may
        be violated by up to ``tolerance``.
    reason : str, default: "an inequality"
        Reason for the tolerance. Required if ``relation`` is ``"equals"``.
    relation : {"equals", "below", "above"}, default: "equals"
        Expected relation of the result to the published value.
    baseline : mapping of str to object, optional
        Coordinate values that select a second value. If you pass ``baseline``, the difference
        between the first value and the second value is compared with the published value.
    baseline_variable : str, optional
        Name of the variable of the second value. The default is ``variable``.
    expected : {"reproduced", "differs"}, default: "reproduced"
        Expected verdict.
    difference_reason : str, optional
        Reason for the expected verdict ``"differs"``.

    Raises
    ------
    InvalidValue
        If an argument has a wrong type, or if an equality has no reason for its tolerance.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy import Claim
    >>> claim = Claim(
    ...     id="C7",
    ...     statement="zeta is 0.66 for alpha = 0.56",
    ...     source="Fig. 5",
    ...     variable="zeta",
    ...     where={"alpha": 0.56},
    ...     published=0.66,
    ...     tolerance=0.02,
    ...     reason="read from the figure",
    ... )
    >>> dataset = xr.Dataset({"zeta": ("alpha", [0.67])}, coords={"alpha": [0.56]})
    >>> claim.verdict(dataset)
    (0.67, 'reproduced')
    """

    #: Possible verdicts, and the verdict on a claim that does not apply to the results.
    VERDICTS: ClassVar = VERDICTS
    NOT_APPLICABLE: ClassVar = NOT_APPLICABLE_VERDICT

    id: str
    statement: str
    source: str
    variable: str
    where: Mapping[str, Any]
    published: float
    tolerance: float = 0.0
    reason: str = DEFAULT_REASON_FOR_TOLERANCE
    relation: str = "equals"
    baseline: Mapping[str, Any] = field(default_factory=dict)
    baseline_variable: str = ""
    expected: str = REPRODUCED_VERDICT
    difference_reason: str = ""

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name in _STRING_FIELDS_OF_CLAIM:
            if not isinstance(getattr(self, name), str):
                rule = "must be a string"
                raise self._build_field_error(name, getattr(self, name), rule)
        if self.relation not in CLAIM_RELATIONS:
            raise self._build_field_error(
                "relation", self.relation, "is unknown", choices=CLAIM_RELATIONS
            )
        if self.relation == "equals" and self.reason == DEFAULT_REASON_FOR_TOLERANCE:
            rule = (
                f"must explain how the tolerance of {self.tolerance} was chosen, but is the default"
            )
            raise self._build_field_error("reason", self.reason, rule)
        if self.expected not in _ALLOWED_EXPECTED_VERDICTS:
            rule = "is not a possible verdict"
            raise self._build_field_error(
                "expected", self.expected, rule, choices=_ALLOWED_EXPECTED_VERDICTS
            )
        for name in ("published", "tolerance"):
            value = getattr(self, name)
            if isinstance(value, int) and not _is_finite_number(value):
                raise self._build_field_error(
                    name, value, "is too large for a floating-point number"
                )
            if not _is_finite_number(value) or not math.isfinite(value):
                raise self._build_field_error(name, value, "must be a finite number")
        for name in ("where", "baseline"):
            if not isinstance(getattr(self, name), Mapping):
                rule = "must be a mapping from coordinates to values"
                raise self._build_field_error(name, getattr(self, name), rule)
            for value in getattr(self, name).values():
                if not isinstance(value, str) and not _is_finite_number(value):
                    rule = "must be strings or numbers"
                    raise self._build_field_error(f"coordinate values in {name!r}", value, rule)

    def _build_field_error(
        self, name: str, value: object, rule: str, *, choices: Iterable[str] = ()
    ) -> InvalidValue:
        """Build an error whose message begins with the identifier of the claim."""
        return InvalidValue(name, value, rule, choices=choices).with_location(f"claim {self.id}")

    @classmethod
    def below(cls, **claim_fields: Any) -> Claim:
        """Create a claim that a result is smaller than a published value.

        Parameters
        ----------
        **claim_fields : object
            Parameters of `Claim` except ``relation``.

        Returns
        -------
        Claim
            Claim with the relation ``"below"``.
        """
        return cls(relation="below", **claim_fields)

    @classmethod
    def above(cls, **claim_fields: Any) -> Claim:
        """Create a claim that a result is larger than a published value.

        Parameters
        ----------
        **claim_fields : object
            Parameters of `Claim` except ``relation``.

        Returns
        -------
        Claim
            Claim with the relation ``"above"``.
        """
        return cls(relation="above", **claim_fields)

    def describe(self) -> dict[str, Any]:
        """Convert the claim to a dictionary of plain values.

        Returns
        -------
        dict of str to object
            Parameters of the claim.
        """
        return {**asdict(self), "where": dict(self.where), "baseline": dict(self.baseline)}

    def check_applies_to_dataset(self, dataset: xr.Dataset) -> None:
        """Check that the claim applies to a dataset.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of a study.

        Raises
        ------
        InvalidValue
            If the dataset does not have the variable, a coordinate or the selected point, so that
            the verdict would always be ``"not applicable"``.
        """
        variables, coordinates = map(str, dataset.data_vars), [str(n) for n in dataset.coords]
        for variable in filter(None, (self.variable, self.baseline_variable)):
            if variable not in dataset:
                rule = "is not a variable of the results"
                raise self._build_field_error("variable", variable, rule, choices=sorted(variables))
        for name in [*self.where, *self.baseline]:
            if name not in coordinates:
                rule = "is not a coordinate of the results"
                raise self._build_field_error("where", name, rule, choices=sorted(coordinates))
        if self.verdict(dataset)[1] == NOT_APPLICABLE_VERDICT:
            rule = "must be a point of the lattice"
            raise self._build_field_error("where", {**self.where, **self.baseline}, rule)

    def verdict(self, dataset: xr.Dataset) -> tuple[float, str]:
        """Compare the result with the published value.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of a study.

        Returns
        -------
        value : float
            Result that is compared with the published value.
        verdict : str
            Verdict, which is ``"reproduced"``, ``"differs"``, ``"undecided"`` or ``"not
            applicable"``. The claim is not applicable if the dataset does not contain the selected
            point. The claim is undecided if the value at the selected point is NaN.
        """
        try:
            computed = _select_single_value(dataset, self.variable, self.where)
            if self.baseline:
                computed -= _select_single_value(
                    dataset, self.baseline_variable or self.variable, self.baseline
                )
        except KeyError:
            return math.nan, NOT_APPLICABLE_VERDICT
        if math.isnan(computed):
            return computed, UNDECIDED_VERDICT
        distance = computed - self.published
        holds = {
            "equals": abs(distance) <= self.tolerance,
            "below": distance < self.tolerance,
            "above": distance > -self.tolerance,
        }[self.relation]
        return computed, REPRODUCED_VERDICT if holds else DIFFERS_VERDICT


def _build_note_on_large_error_estimate(dataset: xr.Dataset, claim: Claim) -> str:
    """Return a note if the error estimate exceeds the tolerance of an equality claim."""
    values = [(claim.variable, claim.where)]
    if claim.baseline:
        values.append((claim.baseline_variable or claim.variable, claim.baseline))
    try:
        error = sum(_select_single_value(dataset, f"{name}_error", at) for name, at in values)
    except KeyError:  # The variable has no error estimate.
        return ""
    if claim.relation != "equals" or not error > claim.tolerance:
        return ""
    return (
        f"the error estimate {error:.2g} exceeds the tolerance {claim.tolerance:g}. Use a smaller "
        "--rtol (rtol=)"
    )


def build_verdict_table(
    dataset: xr.Dataset, claims: list[Claim], study_overrides: Mapping[str, Any]
) -> ClaimVerdictTable:
    """Build a table of verdicts with one row per claim.

    Claims apply to the study as declared, without overrides. If an override has changed a fixed
    field of the scene or of the measure, or if the results have been converted to other units, no
    claim is applicable. If an override has changed the values of a dimension, claims about results
    that were reduced along this dimension are not applicable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    claims : list of Claim
        Claims to check.
    study_overrides : mapping of str to object
        Overrides of the study.

    Returns
    -------
    ClaimVerdictTable
        Table of the claims and verdicts. The column ``verdict_changed`` is True if an applicable
        claim does not have the expected verdict. If the error estimate of a result exceeds the
        tolerance of its claim, the table has the column ``note``, which contains this information.
    """
    along = {str(name) for name in dataset.coords if dataset[name].ndim > 0}
    is_other_study = [
        name for name in study_overrides if name not in along
    ] or DatasetUnits.UNIT_SCALES_ATTRIBUTE_NAME in dataset.attrs
    rows: list[tuple[Any, ...]] = []
    notes: dict[int, str] = {}
    for claim in claims:
        computed, verdict = claim.verdict(dataset)
        if is_other_study or not _has_all_overridden_dimensions(
            dataset, claim.variable, study_overrides
        ):
            verdict = NOT_APPLICABLE_VERDICT
        elif note := _build_note_on_large_error_estimate(dataset, claim):
            notes[len(rows)] = note
        changed = verdict not in (claim.expected, NOT_APPLICABLE_VERDICT)
        about = claim.id, claim.statement, claim.source, claim.relation, claim.published, computed
        why = (
            claim.tolerance,
            claim.reason,
            verdict,
            claim.expected,
            claim.difference_reason,
            changed,
        )
        rows.append((*about, *why))
    table = pd.DataFrame(rows, columns=_VERDICT_TABLE_COLUMNS)
    if notes:
        table["note"] = [notes.get(number, "") for number in range(len(rows))]
    return ClaimVerdictTable(table.astype({"verdict_changed": bool}))


def _is_finite_number(value: object) -> bool:
    """Return True if a value is a finite number in the range of a float."""
    return isinstance(value, int | float) and not sys.float_info.max < abs(value) < math.inf


def _has_all_overridden_dimensions(
    dataset: xr.Dataset, variable_name: str, study_overrides: Mapping[str, Any]
) -> bool:
    """Return True if a variable has every dimension whose values were overridden."""
    changed = {str(d) for n in study_overrides if n in dataset.coords for d in dataset[n].dims}
    return variable_name not in dataset or changed <= set(dataset[variable_name].dims)


def _select_single_value(
    dataset: xr.Dataset, variable_name: str, coordinate_values: Mapping[str, Any]
) -> float:
    """Select a single value of a variable.

    Raises
    ------
    KeyError
        If the coordinate values do not select a single number.
    """
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
        raise KeyError(variable_name)  # The selection is not a single number.
    if variable_name == "status" and int(values) == int(Status.PENDING):
        return math.nan
    return float(values)
