"""Former names of variables and fields in files, and of table columns.

Variables and declarations of older files are renamed when a file is read. Until version 1.0.0, the
former name of a column still selects the column of a table, and emits a ``DeprecationWarning``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import pandas as pd
import xarray as xr

from rsfstudy._deprecation import warn_renamed

#: New names of variables, by former name and by the beginning of the ``long_name`` that the
#: variable had. The ``long_name`` excludes user-defined variables of the same name.
_NEW_NAME_BY_FORMER_NAME_AND_DESCRIPTION = {
    ("criterion", "Akaike's criterion"): "aic",
    ("whiteness", "chance of as much correlation"): "p_value",
    ("effective_samples", "number of independent samples"): "n_eff",
    ("innovation", "residual freed of correlation"): "whitened_residual",
    ("noise_size", "standard deviation of the noise"): "noise_sd",
}
#: Former suffixes of the ends of confidence intervals, with their new suffixes, and the beginnings
#: of the ``long_name`` that these variables had.
_NEW_CI_SUFFIX_BY_FORMER_SUFFIX = {"_low": "_ci_low", "_high": "_ci_high"}
_FORMER_DESCRIPTION_PREFIXES_OF_CI_ENDS = tuple(
    f"{end} end of the 95 % interval of the" for end in ("lower", "upper", "low", "high")
)
#: New names of the fields of claims and of reductions, and of the outputs of measures.
_NEW_CLAIM_FIELD_BY_FORMER_FIELD = {
    "minus": "baseline",
    "minus_variable": "baseline_variable",
    "because": "difference_reason",
}
_NEW_FIELD_NAMES_BY_REDUCTION_KIND = {
    "proportional_fit": {"minus": "intercept"},
    "spread": {"on": "over"},
}
_NEW_REDUCTION_KIND_BY_FORMER_KIND = {"spread": "range"}
_NEW_OUTPUT_NAMES_BY_MEASURE = {
    "synthetic_fit": {"criterion": "aic"},
    "fit": {
        former: new for (former, _text), new in _NEW_NAME_BY_FORMER_NAME_AND_DESCRIPTION.items()
    },
}
#: New names of the columns of the table of verdicts, by former name.
NEW_VERDICT_COLUMN_BY_FORMER_COLUMN: Mapping[str, str] = {
    "ours": "computed",
    "moved": "verdict_changed",
    "because": "difference_reason",
}


def rename_former_declaration_fields(declaration: Any) -> Any:
    """Replace the former names in the stored declaration of a study.

    Parameters
    ----------
    declaration : object
        Declaration as plain data. Invalid data are returned unchanged.

    Returns
    -------
    object
        Declaration with the current names of the fields.
    """
    if not isinstance(declaration, Mapping):
        return declaration
    current = dict(declaration)
    measure = current.get("measure")
    name = measure.get("name") if isinstance(measure, Mapping) else None
    outputs = dict(_NEW_OUTPUT_NAMES_BY_MEASURE.get(name, {})) if isinstance(name, str) else {}
    outputs |= _find_new_names_of_sobol_ci_variables(current.get("reductions"))
    for key, rename in (("claims", _rename_claim_fields), ("reductions", _rename_reduction_fields)):
        if isinstance(listed := current.get(key), list):
            current[key] = [
                rename(one, outputs) if isinstance(one, Mapping) else one for one in listed
            ]
    return current


def _find_new_names_of_sobol_ci_variables(reductions: Any) -> dict[str, str]:
    """Return a mapping from former to new names of the confidence limits of Sobol indices."""
    names = [
        reduction.get("name")
        for reduction in (reductions if isinstance(reductions, list) else [])
        if isinstance(reduction, Mapping) and reduction.get("kind") == "sobol_indices"
    ]
    return {
        f"{name}_{order}{former}": f"{name}_{order}{new}"
        for name in names
        for order in ("first_order", "total")
        for former, new in _NEW_CI_SUFFIX_BY_FORMER_SUFFIX.items()
    }


def _rename_claim_fields(
    claim: Mapping[str, Any], new_output_names: Mapping[str, str]
) -> dict[str, Any]:
    """Replace former field names in the stored declaration of a claim."""
    current = {
        _NEW_CLAIM_FIELD_BY_FORMER_FIELD.get(key, key): value for key, value in claim.items()
    }
    return _rename_outputs_in_fields(current, ("variable", "baseline_variable"), new_output_names)


def _rename_reduction_fields(
    reduction: Mapping[str, Any], new_output_names: Mapping[str, str]
) -> dict[str, Any]:
    """Replace the former kind and former field names in the declaration of a reduction."""
    kind = reduction.get("kind")
    if not isinstance(kind, str):
        return dict(reduction)
    new = _NEW_FIELD_NAMES_BY_REDUCTION_KIND.get(kind, {})
    current = {new.get(key, key): value for key, value in reduction.items()}
    current["kind"] = _NEW_REDUCTION_KIND_BY_FORMER_KIND.get(kind, kind)
    return _rename_outputs_in_fields(current, ("of",), new_output_names)


def _rename_outputs_in_fields(
    fields: dict[str, Any], field_names: tuple[str, ...], new_output_names: Mapping[str, str]
) -> dict[str, Any]:
    """Replace former output names that occur as values of the given fields."""
    for key in field_names:
        if isinstance(name := fields.get(key), str):
            fields[key] = new_output_names.get(name, name)
    return fields


def rename_former_variables(dataset: xr.Dataset) -> xr.Dataset:
    """Rename the dataset variables that still have a former name.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of a file.

    Returns
    -------
    xarray.Dataset
        Dataset whose variables have their current names. If no variable has a former name, the
        function returns the same object.
    """
    new = {
        name: current
        for name, values in dataset.data_vars.items()
        if (
            current := _find_current_variable_name(
                str(name), str(values.attrs.get("long_name", ""))
            )
        )
        != name
    }
    if not new:
        return dataset
    renamed = dataset.rename_vars(new)
    for values in renamed.variables.values():
        if named := str(values.attrs.get("ancillary_variables", "")).split():
            values.attrs["ancillary_variables"] = " ".join(new.get(name, name) for name in named)
    return renamed


def _find_current_variable_name(variable_name: str, description: str) -> str:
    """Return the current name of a variable."""
    for (former, beginning), new in _NEW_NAME_BY_FORMER_NAME_AND_DESCRIPTION.items():
        if variable_name == former and description.startswith(beginning):
            return new
    for former, new in _NEW_CI_SUFFIX_BY_FORMER_SUFFIX.items():
        if (
            variable_name.endswith(former)
            and not variable_name.endswith(new)
            and description.startswith(_FORMER_DESCRIPTION_PREFIXES_OF_CI_ENDS)
        ):
            return variable_name.removesuffix(former) + new
    return variable_name


class TableAcceptingFormerColumnNames(pd.DataFrame):
    """Data frame whose columns can also be selected by their former names.

    A selection is an ordinary data frame with the requested names. A subclass defines
    ``NEW_COLUMN_BY_FORMER_COLUMN``.
    """

    #: New column names by former name. A key that begins with an underscore is a suffix.
    NEW_COLUMN_BY_FORMER_COLUMN: ClassVar[Mapping[str, str]] = {}

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        """Class of the data frames that result from selections of columns or rows."""
        return pd.DataFrame

    def _find_current_column_name(self, key: Any) -> Any:
        """Return the current name of a column, and warn if the key is a former name."""
        if not isinstance(key, str) or key in self.columns:
            return key
        for former, new in self.NEW_COLUMN_BY_FORMER_COLUMN.items():
            is_match = key.endswith(former) if former.startswith("_") else key == former
            current = key.removesuffix(former) + new
            if is_match and current in self.columns:
                warn_renamed(key, current, "the table")
                return current
        return key

    def __getitem__(self, key: Any) -> Any:
        """Select a column, several columns, or rows."""
        if isinstance(key, list):
            names = [self._find_current_column_name(one) for one in key]
            selected = super().__getitem__(names)
            return selected if names == key else selected.set_axis(key, axis="columns")
        return super().__getitem__(self._find_current_column_name(key))

    def __getattr__(self, name: str) -> Any:  # type: ignore[misc]
        """Return a column as an attribute."""
        if not name.startswith("_") and (current := self._find_current_column_name(name)) != name:
            return self[current]
        return super().__getattr__(name)
