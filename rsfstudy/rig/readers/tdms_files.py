"""Reader of TDMS files, which are written by LabVIEW."""

from __future__ import annotations

import importlib
import io
import logging
from typing import Any

import numpy as np

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.readers.missing_libraries import build_missing_library_error
from rsfstudy.rig.readers.tables_from_files_or_objects import (
    LazyTable,
    TableSource,
    append_units_to_headings,
    build_table_of_arrays,
)

_TDMS_FILE_SIGNATURE = b"TDSm"
#: Names of the channel properties that contain the units and the sampling interval.
_UNIT_PROPERTY_NAMES = ("unit_string", "NI_UnitDescription", "units", "unit")
_SAMPLING_INTERVAL_PROPERTY_NAME = "wf_increment"


def is_tdms_file(source: TableSource) -> bool:
    """Return True if the file is a TDMS file.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file is a TDMS file.
    """
    return source.first_bytes_of_file.startswith(_TDMS_FILE_SIGNATURE)


def read_tdms_file(source: TableSource) -> LazyTable:
    """Read the channels of a group of a TDMS file.

    If the channels are waveforms, a column ``Time (s)`` is added.

    Parameters
    ----------
    source : TableSource
        TDMS file. By default, the first group with channels is read.

    Returns
    -------
    LazyTable
        Channels with their units.

    Raises
    ------
    DataError
        If npTDMS is not installed, or if the file is damaged.
    InvalidValue
        If the file has no group with the given name.
    """
    try:
        nptdms = importlib.import_module("nptdms")
    except ImportError as error:
        raise build_missing_library_error(source, "a TDMS file", "tdms", "npTDMS") from error
    level = logging.root.manager.disable
    logging.disable(logging.WARNING)  # npTDMS prints the bytes of damaged files.
    try:
        file = nptdms.TdmsFile.read(io.BytesIO(source.read_all_bytes()))
    except Exception as error:  # Damaged files cause errors of many types.
        raise DataError(
            f"{source.path_or_object}: cannot be read as a TDMS file ({error})"
        ) from error
    finally:
        logging.disable(level)
    groups = {group.name: group.channels() for group in file.groups()}
    names = [name for name, channels in groups.items() if channels]
    if not names or (source.sheet_or_group_name and source.sheet_or_group_name not in names):
        raise InvalidValue(
            "sheet", source.sheet_or_group_name, "is not a group with channels", choices=names
        )
    channels = groups[source.sheet_or_group_name or names[0]]
    headings = append_units_to_headings(
        [channel.name for channel in channels], [_find_units_of_channel(of) for of in channels]
    )
    values = [np.asarray(channel[:]) for channel in channels]
    intervals = {float(of.properties.get(_SAMPLING_INTERVAL_PROPERTY_NAME, 0.0)) for of in channels}
    if len(intervals) == 1 and (interval := intervals.pop()) > 0.0:
        headings = ["Time (s)", *headings]
        values = [interval * np.arange(len(values[0])), *values]
    return build_table_of_arrays(headings, values, str(source.path_or_object))


def _find_units_of_channel(channel: Any) -> str:
    return next(
        (str(channel.properties[name]) for name in _UNIT_PROPERTY_NAMES
         if channel.properties.get(name)), "",
    )  # fmt: skip
