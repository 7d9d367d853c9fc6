"""Functions that export results files to CSV and MATLAB.

To add an export format, write a function in this module. In ``commands/export.py``, add an entry to
the ``writers`` dictionary and an option to the ``export`` command. The formats in
``rsfstudy.defaults.Defaults.RESULT_FORMATS`` are formats of results files, not export formats.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import read_units_or_reference_scale


def to_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write the table of a dataset to a CSV file.

    The header contains the name and the units of each column, in a form that ``read_table`` can
    read. Numbers are written with full precision. In the table of a study, integer codes such as
    the status are written as labels.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the results of a study, a motion or a fit.
    path : Path
        CSV file to write.
    """
    # ``read_table`` reads exported motions, and accepts only columns with units.
    table = dataset.rsf.to_dataframe(decoded="status" in dataset)
    headings = {name: f"{name} ({units})" for name, units in table.attrs["units"].items()}
    table.rename(columns=headings).to_csv(path, index=False)


def to_mat(dataset: xr.Dataset, path: Path) -> None:
    """Write all variables of a dataset to a MATLAB file.

    The dimensions of each array keep their order. The MATLAB file also contains three structures:
    ``units`` and ``dimensions`` (the units and the dimension names of each variable) and
    ``attributes`` (the attributes of the dataset).

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the results of a study, a motion or a fit.
    path : Path
        MATLAB file to write.

    Raises
    ------
    InvalidValue
        If the name of a variable or attribute is not valid in MATLAB. All names that rsfstudy
        defines are valid.
    """
    from scipy.io import savemat

    for name in map(str, (*dataset.variables, *dataset.attrs)):
        if not re.fullmatch(r"[A-Za-z]\w{0,62}", name, re.ASCII):
            rule = (
                "is not a valid MATLAB name, which consists of letters, digits and _ and starts "
                "with a letter"
            )
            remedy = "Rename the variable, for example with dataset.rename(old='new')."
            raise InvalidValue("name", name, rule, remedy=remedy)
    data: dict[str, Any] = {str(n): values.values for n, values in dataset.variables.items()}
    for name, values in data.items():
        if values.dtype.kind in "OUT":
            data[name] = np.array(values.tolist(), dtype=object)
    about = {
        "units": {name: read_units_or_reference_scale(dataset[name].attrs) for name in data},
        "dimensions": {name: " ".join(map(str, dataset[name].dims)) for name in data},
        "attributes": dataset.attrs,
    }
    savemat(path, about | data, long_field_names=True, oned_as="column")
