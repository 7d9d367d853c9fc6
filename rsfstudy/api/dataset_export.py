"""Functions that convert datasets to tables and recompute stored motions.

The module does not write files. CSV and MATLAB files are written by ``rsfstudy.cli.export_files``.
"""

from __future__ import annotations

import json
import warnings
from typing import Any

import pandas as pd
import xarray as xr

from rsfstudy.api.simulation import simulate
from rsfstudy.errors import DataError
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.quantities import read_units_or_reference_scale
from rsfstudy.rig import DatasetUnits, Rig
from rsfstudy.storage import StoredDataset, compare_results_of_same_study


def to_dataframe(dataset: xr.Dataset, decoded: bool = False) -> pd.DataFrame:
    """Convert a dataset to a table, and omit constant coordinates.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene.
    decoded : bool, default: False
        If True, the table contains the labels of codes, for example ``ok`` instead of 0.

    Returns
    -------
    pandas.DataFrame
        Table as returned by ``DatasetAccessor.to_dataframe``. If the table would have fewer than
        two rows, no columns are omitted.

    Notes
    -----
    The columns must not depend on the results of the cells. The status and the other data variables
    are therefore columns even if they are constant or NaN in all cells.
    """
    is_table = bool(StoredDataset(dataset).table_contents)
    along = [str(name) for name in dataset.dims if is_table or name == "time"]
    along = list(map(str, dataset["status"].dims)) if "status" in dataset else along
    kept = [name for name, values in dataset.variables.items() if set(values.dims) <= set(along)]
    if along:
        table = dataset[kept].to_dataframe().reset_index()
    else:
        table = pd.DataFrame({str(n): [dataset[n].values.item()] for n in kept})
    if decoded:
        for name in table:
            if labels := read_flag_meanings(dataset[name].attrs):
                table[name] = table[name].map(labels)
    units = {
        str(n): read_units_or_reference_scale(dataset[n].attrs) or "1"
        for n in table
        if table[n].dtype.kind in "iuf"
    }
    if len(table) > 1:
        results = [n for n, values in dataset.data_vars.items() if values.dims]
        columns = [
            n for n in table if n in (*along, *results) or table[n].nunique(dropna=False) > 1
        ]
        constant = {
            str(n): _remove_rounding_error(table[n].iloc[0]) for n in table if n not in columns
        }
        table = table[columns]
        table.attrs["constant"] = constant
    table.attrs["units"] = units
    return table


def _remove_rounding_error(value: Any) -> Any:
    """Round a floating-point number to 15 digits, so that 10.000000000000002 becomes 10.

    Other values are returned unchanged.
    """
    return float(f"{value:.15g}") if isinstance(value, float) else value


def rerun_and_compare_motion(motion: xr.Dataset) -> pd.DataFrame:
    """Compute a motion again, and compare it with the stored motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Stored motion.

    Returns
    -------
    pandas.DataFrame
        Table with one row per variable, as ``rsfstudy.rerun`` returns it.

    Raises
    ------
    DataError
        If the dataset is not a motion from ``rsfstudy.simulate``, if the motion was computed at
        requested times, or if the motion has units but no rig.
    """
    about = motion.attrs
    times = about.get("output_times", about.get("told"))  # Older files have the attribute told.
    if "duration" not in about or times not in ("all time steps", "as it moves"):
        title, made = about.get("title", "untitled"), about.get("history", "").rpartition(" ")[2]
        call = f"{made if made.startswith('rsfstudy.') else 'rsfstudy.simulate'}(dataset.rsf.scene"
        if times is not None:
            title, call = f"{title}, output at {times}", f"{call}, times=..."
        raise DataError(
            "rerun can only recompute results of studies, and motions that rsfstudy.simulate "
            "(`rsfstudy simulate`) computed without times. The dataset belongs to a single "
            f"scene ({title}). To recompute it, call {call}, rtol={about.get('rtol', '...')}) "
            "with the original options."
        )
    if DatasetUnits.UNIT_SCALES_ATTRIBUTE_NAME in about and "laboratory" not in about:
        raise DataError(
            "the units of the motion were converted without a rig. Store the motion before the "
            "units are converted, or convert the units with a rig"
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
    return compare_results_of_same_study(motion, ours)
