"""Classes that convert finished cells to journal rows and to column arrays.

The class ``CellOutputPacker`` converts the outcome of a cell to a row of the journal.
``CellResultArrays`` contains arrays with the results of many cells. Datasets are assembled from
these arrays.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status

#: Type of a row of the journal table ``cells``. A row contains the key, the name of the status, the
#: message, the number of right-hand-side evaluations, the wall time in s, the packed outputs and
#: the checksum.
CellJournalRow = tuple[bytes, str, str, int, float, bytes, int]


class CellOutputPacker:
    """Packer that converts the outputs of a measure to a row of float64 numbers.

    Parameters
    ----------
    measure : Measure
        Measure whose outputs are packed.

    Attributes
    ----------
    shapes : dict of str to tuple of int
        Shape of each output.
    slices : dict of str to slice
        Position of each output in the row of numbers.
    packed_number_count : int
        Length of the row of numbers.
    """

    def __init__(self, measure: Measure) -> None:
        sizes = {name: len(values) for name, values in measure.output_coordinates.items()}
        self.shapes = {n: tuple(sizes[d] for d in dims) for n, dims in measure.variables.items()}
        stops = np.cumsum([math.prod(shape) for shape in self.shapes.values()])
        self.packed_number_count = int(stops[-1])
        starts = [0, *stops[:-1]]
        self.slices = {n: slice(*ends) for n, *ends in zip(self.shapes, starts, stops, strict=True)}

        self._struct_format = "" if any(self.shapes.values()) else f"<{self.packed_number_count}d"

    def pack_outputs(self, output_values: Mapping[str, Any]) -> bytes:
        """Pack the outputs of a cell as bytes.

        Parameters
        ----------
        output_values : mapping of str to float or ndarray
            Outputs by name. An output that is missing in the mapping is stored as NaN.

        Returns
        -------
        bytes
            Little-endian float64 numbers.
        """
        if self._struct_format:
            return struct.pack(
                self._struct_format, *(output_values.get(name, math.nan) for name in self.shapes)
            )
        row = np.full(self.packed_number_count, np.nan, dtype="<f8")
        for name, value in output_values.items():
            row[self.slices[name]] = np.ravel(value)
        return row.tobytes()

    def pack_journal_row(
        self, cell_key: bytes, outcome: Outcome, wall_time: float
    ) -> CellJournalRow:
        """Pack the outcome of a cell as a row of the journal.

        Parameters
        ----------
        cell_key : bytes
            Key of the cell.
        outcome : Outcome
            Status, message and outputs of the cell.
        wall_time : float
            Wall time of the computation in s.

        Returns
        -------
        CellJournalRow
            Row of the journal, including the checksum.
        """
        numbers, work = self.pack_outputs(outcome.values), outcome.rhs_evaluations
        row = (outcome.status.name, outcome.message, work, wall_time, numbers)
        return (cell_key, *row, compute_journal_row_checksum(cell_key, *row))


@dataclass(frozen=True)
class CellResultArrays:
    """Arrays with the statuses, messages, costs and outputs of several cells.

    Parameters
    ----------
    statuses : ndarray of int8, shape (n,)
        Codes of the statuses (see ``Status``).
    messages : ndarray of str, shape (n,)
        Error messages and remarks.
    rhs_evaluations : ndarray of int64, shape (n,)
        Numbers of right-hand-side evaluations.
    wall_times : ndarray of float, shape (n,)
        Wall times in s. The wall time of a pending cell is NaN.
    packed_outputs : ndarray of float, shape (n, m)
        Outputs of each cell, in the layout of ``CellOutputPacker``.
    """

    statuses: np.ndarray
    messages: np.ndarray
    rhs_evaluations: np.ndarray
    wall_times: np.ndarray
    packed_outputs: np.ndarray

    @classmethod
    def build_for_pending_cells(cls, cell_count: int, packed_number_count: int) -> CellResultArrays:
        """Build the columns for cells that have not been computed.

        Parameters
        ----------
        cell_count : int
            Number of cells.
        packed_number_count : int
            Number of packed outputs per cell.

        Returns
        -------
        CellResultArrays
            Columns with the status ``PENDING`` and NaN outputs.
        """
        return cls(
            np.full(cell_count, int(Status.PENDING), dtype=np.int8),
            np.full(cell_count, "", dtype=object),
            np.zeros(cell_count, dtype=np.int64),
            np.full(cell_count, np.nan),
            np.full((cell_count, packed_number_count), np.nan),
        )


def compute_journal_row_checksum(
    cell_key: bytes,
    status: str,
    message: str,
    rhs_evaluations: int,
    wall_time: float | None,
    packed_outputs: bytes,
) -> int:
    """Compute the CRC-32 checksum of a row of the journal.

    Parameters
    ----------
    cell_key : bytes
        Key of the cell.
    status : str
        Name of the status.
    message : str
        Error message or remark.
    rhs_evaluations : int
        Number of right-hand-side evaluations.
    wall_time : float or None
        Wall time in s.
    packed_outputs : bytes
        Outputs of the cell.

    Returns
    -------
    int
        Checksum.
    """
    known = math.nan if wall_time is None else wall_time
    # repr escapes quotes, so that different strings cannot produce the same text.
    text = f"{cell_key!r} {status!r} {message!r} {rhs_evaluations} {known!r} "
    return zlib.crc32(packed_outputs, zlib.crc32(text.encode()))
