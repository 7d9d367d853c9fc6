"""Results and motions for other programs: tables, files of CSV and of MATLAB; and motions computed
again from their files.
"""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.api.simulation import simulate
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.quantities import units_or_scale
from rsfstudy.rig import SCALES_ATTRIBUTE, Rig
from rsfstudy.storage import compare_motions


def to_dataframe(dataset: xr.Dataset) -> pd.DataFrame:
    """A table of a dataset, as `Accessor.to_dataframe` says."""
    along = [name for name in ("time",) if name in dataset.dims]
    along = list(map(str, dataset["status"].dims)) if "status" in dataset else along
    kept = [name for name, values in dataset.variables.items() if set(values.dims) <= set(along)]
    if not along:  # the numbers of one answer, in one row
        return pd.DataFrame({str(n): [dataset[n].values.item()] for n in kept})
    table = dataset[kept].to_dataframe().reset_index()
    if len(table) < 2:
        return table
    changing = [n for n in table if n in along or table[n].nunique(dropna=False) > 1]
    constant = {str(n): table[n].iloc[0] for n in table if n not in changing}
    table = table[changing]
    table.attrs["constant"] = constant
    return table


def to_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write the table of a dataset, whose header names units as `read_table` reads them; numbers
    keep all their digits, and codes of cells are words.
    """
    table = to_dataframe(dataset)
    for name in table if "status" in dataset else ():
        if flags := read_flag_meanings(dataset[name].attrs):
            table[name] = table[name].map(flags)
    headed = {
        n: f"{n} ({units_or_scale(dataset[n].attrs) or 1})"
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
        "units": {name: units_or_scale(dataset[name].attrs) for name in data},
        "dimensions": {name: " ".join(map(str, dataset[name].dims)) for name in data},
        "attributes": dataset.attrs,
    }
    savemat(path, about | data, long_field_names=True, oned_as="column")


def rerun_motion(motion: xr.Dataset) -> pd.DataFrame:
    """Compute a motion again, and compare it with what its file holds.

    Parameters
    ----------
    motion : xarray.Dataset
        As a file holds it.

    Returns
    -------
    pandas.DataFrame
        As `rsfstudy.rerun` gives it.

    Raises
    ------
    DataError
        Where it is no motion, or one of which the file does not say how it was told.
    """
    about = motion.attrs
    if "duration" not in about or about.get("told") != "as it moves":
        title, made = about.get("title", "untitled"), about.get("history", "").rpartition(" ")[2]
        call = f"{made if made.startswith('rsfstudy.') else 'rsfstudy.simulate'}(dataset.rsf.scene"
        if "told" in about:
            title, call = f"{title}, told {about['told']}", f"{call}, times=..."
        raise DataError(
            "rerun computes again results of a study, and motions of rsfstudy.simulate (`rsfstudy "
            f"simulate`) without times; this is of one scene ({title}). With the options that made "
            f"it, {call}, rtol={about.get('rtol', '...')}) computes it anew."
        )
    if SCALES_ATTRIBUTE in about and "laboratory" not in about:
        raise DataError(
            "it is in units of no rig: keep motions as simulate gives them, or by a rig"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ours = simulate(
            motion.rsf.scene,
            duration=float(about["duration"]),
            rtol=float(about["rtol"]),
            budget=int(about["budget"]),
            engine=about["engine"],
        )
    if "laboratory" in about:
        units = {"stress": "shear_stress", "length": "slip", "time": "time"}
        units = {of: str(motion[name].attrs["units"]) for of, name in units.items()}
        ours = Rig(**json.loads(about["laboratory"])).in_units(ours, **units)
    return compare_motions(motion, ours)
