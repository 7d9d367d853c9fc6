"""Files of results for other programs: CSV and MATLAB."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.quantities import units_or_scale_of_variable


def to_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write the table of a dataset, whose header names units as `read_table` reads them; numbers
    keep all their digits, and codes of cells are words.
    """
    table = dataset.rsf.to_dataframe()
    for name in table if "status" in dataset else ():
        if flags := read_flag_meanings(dataset[name].attrs):
            table[name] = table[name].map(flags)
    headed = {
        n: f"{n} ({units_or_scale_of_variable(dataset[n].attrs) or 1})"
        for n in table
        if table[n].dtype.kind in "iuf"
    }
    table.rename(columns=headed).to_csv(path, index=False)


def to_mat(dataset: xr.Dataset, path: Path) -> None:
    """Write all variables of a dataset as a file of MATLAB, each with its dimensions in order, and
    the structures ``units`` and ``dimensions`` that name those of each, and ``attributes``.

    Raises
    ------
    InvalidValue
        For a name that is none in MATLAB; those of rsfstudy are.
    """
    from scipy.io import savemat

    for name in map(str, (*dataset.variables, *dataset.attrs)):
        if not re.fullmatch(r"[A-Za-z]\w{0,62}", name, re.ASCII):
            rule = "is no name in MATLAB, which has letters, digits and _, and a letter first"
            remedy = "Rename it, as in dataset.rename(old='new')."
            raise InvalidValue("name", name, rule, remedy=remedy)
    data: dict[str, Any] = {str(n): values.values for n, values in dataset.variables.items()}
    for name, values in data.items():
        if values.dtype.kind in "OUT":
            data[name] = np.array(values.tolist(), dtype=object)
    about = {
        "units": {name: units_or_scale_of_variable(dataset[name].attrs) for name in data},
        "dimensions": {name: " ".join(map(str, dataset[name].dims)) for name in data},
        "attributes": dataset.attrs,
    }
    savemat(path, about | data, long_field_names=True, oned_as="column")
