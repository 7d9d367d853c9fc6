"""Functions that store user-defined loadings in results files and read them back.

The results file contains a table of the samples or segments of each user-defined loading.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.parts import Segment
from rsfstudy.slider import Protocol, SampledHistory, UserLoading, UserPart, protocol
from rsfstudy.storage.plain_data_conversion import build_invalid_entry_error

#: Dimension name of the rows, and description of the columns, for each kind of loading table.
_SAMPLE_DIMENSION_AND_COLUMNS = (
    "sample",
    "time, load point velocity, decrease of normal stress, and rate of normal stress",
)
_SEGMENT_DIMENSION_AND_COLUMNS = (
    "segment",
    "load point velocity, displacement step, duration, and normal stress minus sigma_star",
)

#: Names of the attributes that show whether a sampled history imposes velocity, normal stress or
#: pore pressure.
_FLAG_ATTRIBUTES_OF_SAMPLED_HISTORIES = ("of_stress", "of_pressure")


def build_loading_variables(user_parts: Iterable[UserPart]) -> dict[str, xr.Variable]:
    """Build the variables that contain user-defined loadings.

    Parameters
    ----------
    user_parts : iterable of UserPart
        User-defined parts. Parts that are not loadings are ignored.

    Returns
    -------
    dict of str to xarray.Variable
        Variables by name. Each variable has one row per sample or segment, in dimensionless units.
    """
    found = {}
    for part in user_parts:
        if isinstance(part, SampledHistory):
            (row, columns), rows = _SAMPLE_DIMENSION_AND_COLUMNS, part.sample_table
        elif isinstance(part, Protocol):
            (row, columns), rows = _SEGMENT_DIMENSION_AND_COLUMNS, np.array(part.input_segments)
        else:
            continue
        about: dict[str, Any] = {
            "long_name": f"{columns} of a loading",
            "units": "1",
            "loading": part.name,
            "coverage_content_type": "auxiliaryInformation",
        }
        if isinstance(part, SampledHistory):
            about |= {
                name: int(getattr(part, name)) for name in _FLAG_ATTRIBUTES_OF_SAMPLED_HISTORIES
            }
        dims = (f"{part.name}_{row}", f"{part.name}_column")
        found[f"{part.name}_{row}s"] = xr.Variable(dims, rows, about)
    return found


def read_user_loadings(results: xr.Dataset) -> Mapping[str, UserLoading]:
    """Read the user-defined loadings from a dataset.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.

    Returns
    -------
    mapping of str to UserLoading
        Loadings by name.

    Raises
    ------
    DataError
        If a variable with the attribute ``loading`` is not a valid table.
    """
    found: dict[str, UserLoading] = {}
    for key, values in results.variables.items():
        name = values.attrs.get("loading")
        if name is None:
            continue
        if (
            values.dtype.kind != "f"
            or values.ndim != 2
            or values.shape[1] != SampledHistory.SAMPLE_TABLE_COLUMN_COUNT
        ):
            raise build_invalid_entry_error(
                str(key),
                "is not the table of a loading with "
                f"{SampledHistory.SAMPLE_TABLE_COLUMN_COUNT} columns",
            )
        if "of_stress" in values.attrs:
            of = {
                key: bool(values.attrs.get(key, False))
                for key in _FLAG_ATTRIBUTES_OF_SAMPLED_HISTORIES
            }
            found[name] = SampledHistory.from_table(values.values, name=name, **of)
        else:
            found[name] = protocol([Segment(*row) for row in values.values.tolist()], name)
    return found
