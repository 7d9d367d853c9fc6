"""Protocols from CSV files, whose header names what each column holds and its units."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rsfstudy.doors import door
from rsfstudy.errors import InvalidValue
from rsfstudy.rig.laboratory import SEGMENT, Laboratory
from rsfstudy.rig.table import read_table
from rsfstudy.slider.protocol import KEYS, Protocol, protocol


@door
def read_protocol(
    path: str | Path, laboratory: Laboratory | None = None, name: str = "protocol"
) -> Protocol:
    """A loading history from a CSV file.

    Its first line names the columns and their units, as in ``velocity (um/s), duration (s)``: a
    velocity, and the duration or the distance of each segment (a field may be empty), and perhaps a
    sudden ``step`` at its beginning, or the ``normal_stress`` during it. Units of the slider
    (``V_*``, ``D_c``, ``D_c/V_*``, ``sigma_*``) need no laboratory.

    Parameters
    ----------
    path : str or Path
    laboratory : Laboratory, optional
        The rig whose units are used.
    name : str
        What the protocol is called in results.

    Raises
    ------
    DataError
        Where there is no such file of text.
    InvalidValue
        For a header without units, or a field that is no number, with its line and column.
    """
    columns = read_table(path)
    for key in columns:
        if key not in KEYS:
            raise InvalidValue("column", key, "is unknown", choices=KEYS)
    units = {key: column.units for key, column in columns.items()}
    of_slider = all(SEGMENT[key] == of for key, of in units.items())
    if not of_slider and laboratory is None:
        remedy = "Give a laboratory, or the units of the slider: V_*, D_c, D_c/V_*."
        rule = "need the scales of a rig"
        raise InvalidValue("units", ", ".join(units.values()), rule, remedy=remedy)
    rows = zip(*(column.values.tolist() for column in columns.values()), strict=True)
    stated = [{k: x for k, x in zip(columns, row, strict=True) if not np.isnan(x)} for row in rows]
    if of_slider or laboratory is None:
        return protocol(stated, name)
    return laboratory.protocol(
        [{k: f"{x:.17g} {units[k]}" for k, x in segment.items()} for segment in stated], name
    )
