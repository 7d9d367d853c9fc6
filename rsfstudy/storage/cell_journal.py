"""Journal that stores the finished cells of a study.

The journal is an SQLite file in the directory of the results. Cells are stored soon after they have
finished, so that an interrupted run can be resumed. Only one run at a time can use a journal.

The key of a cell is a digest of the exact values of the scene fields and the measure fields. The
fingerprint of a journal contains all settings that affect the results, except the fields in the
cell keys. If the fingerprint of the journal differs from the fingerprint of the run, the run
rejects the journal (see ``run_fingerprints``). However, the run accepts the journal if the only
difference is that the run has a larger work budget.
"""

from __future__ import annotations

import contextlib
import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.errors import DataError, shorten_text
from rsfstudy.status import Status
from rsfstudy.storage.cell_result_arrays import (
    CellJournalRow,
    CellOutputPacker,
    CellResultArrays,
    compute_journal_row_checksum,
)
from rsfstudy.storage.run_fingerprints import find_fingerprint_differences, merge_fingerprints

#: Version of the journal format. Increment the version if the tables, the checksum or the
#: definition of the cell key change.
_JOURNAL_FORMAT_VERSION = 4
_SQL_TO_CREATE_TABLES = """
CREATE TABLE IF NOT EXISTS fingerprint (json TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS cells (
    key BLOB PRIMARY KEY, status TEXT, message TEXT, work INTEGER, seconds REAL, numbers BLOB,
    checksum INTEGER);
"""
#: Query for database objects that rsfstudy does not create. For example, a trigger in the file
#: could run whenever rsfstudy writes to the journal.
_SQL_TO_FIND_UNEXPECTED_OBJECTS = """
SELECT type || ' ' || name FROM sqlite_master
WHERE type NOT IN ('table', 'index') OR tbl_name NOT IN ('fingerprint', 'cells')
"""
_MAX_CELL_KEYS_PER_QUERY = 900
#: Maximum time in s that a run waits for another run to release the journal.
_JOURNAL_LOCK_TIMEOUT_SECONDS = 5.0
_UNUSABLE_JOURNAL_REMEDY = "Choose another --output, or start again with --fresh."


class CellJournal:
    """Journal that stores the finished cells of one study.

    A ``CellJournal`` locks its file until the journal is closed. Use the journal as a context
    manager.

    Parameters
    ----------
    path : Path or None
        SQLite file. If None, the journal is kept in memory.
    fingerprint : mapping of str to object
        Settings that affect the results of all cells, as plain data. The fingerprint does not
        contain the scene fields and measure fields from which the cell keys are computed.
    output_packer : CellOutputPacker
        Layout of the outputs of a cell.
    fresh : bool, default: False
        If True, delete an existing journal first.

    Raises
    ------
    DataError
        If the file cannot be opened, if another run uses the file, or if the fingerprint of the
        journal differs from ``fingerprint``. If the fingerprints differ, the message lists the
        differences.
    """

    def __init__(
        self,
        path: Path | None,
        fingerprint: Mapping[str, Any],
        output_packer: CellOutputPacker,
        *,
        fresh: bool = False,
    ) -> None:
        self._path, self._output_packer = path or Path("memory"), output_packer
        ours = {**fingerprint, "journal": _JOURNAL_FORMAT_VERSION}
        wanted = json.dumps(ours, sort_keys=True)
        try:
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                if fresh:
                    _remove_unused_journal(path)
            self._db = _open_and_lock_database(path or ":memory:")
        except (OSError, sqlite3.Error) as error:
            raise self._build_unusable_journal_error(error) from error
        try:
            theirs = self._read_or_store_fingerprint(wanted)
            if theirs != wanted:
                self._check_and_merge_fingerprints(theirs, ours)
        except sqlite3.Error as error:
            self._db.close()
            raise self._build_unusable_journal_error(error) from error
        except BaseException:
            self._db.close()  # An open connection would keep the journal locked.
            raise

    def _build_unusable_journal_error(self, error: Exception) -> DataError:
        """Build the error for a journal that cannot be opened."""
        if _is_database_locked_error(error):
            rule = (
                f"another run uses {self._path}. Wait until that run ends, or choose another "
                "--output."
            )
            return DataError(rule)
        return DataError(f"cannot use {self._path}: {error}. {_UNUSABLE_JOURNAL_REMEDY}")

    def _read_or_store_fingerprint(self, run_fingerprint: str) -> Any:
        """Return the fingerprint that is stored in the journal.

        If the journal is new, the method first stores ``run_fingerprint``.
        """
        with self._db:
            self._db.executescript(_SQL_TO_CREATE_TABLES)
            others = self._db.execute(_SQL_TO_FIND_UNEXPECTED_OBJECTS).fetchall()
            if others:
                found = shorten_text(others[0][0])
                raise DataError(
                    f"{self._path} contains {found}, which rsfstudy did not create. "
                    f"{_UNUSABLE_JOURNAL_REMEDY}"
                )
            row = self._db.execute("SELECT json FROM fingerprint").fetchone()
            if row is None:
                self._db.execute("INSERT INTO fingerprint VALUES (?)", (run_fingerprint,))
        return run_fingerprint if row is None else row[0]

    def _check_and_merge_fingerprints(
        self, stored_fingerprint: Any, run_fingerprint: Mapping[str, Any]
    ) -> None:
        """Check that the stored fingerprint is compatible with the fingerprint of a run.

        The code digests are compared only for modules that both fingerprints contain. The results
        in the journal do not depend on the other modules. The run may also have a larger work
        budget than the journal, because the result of a finished cell does not depend on the
        budget. If the fingerprints differ only in these two ways, the method stores the merged
        fingerprint. For any other difference, the method raises ``DataError``.
        """
        try:
            stored = dict(json.loads(stored_fingerprint))
            differ = find_fingerprint_differences(stored, run_fingerprint)
            is_budget_raised = "budget" in differ and differ["budget"][0] < differ["budget"][1]
            if not differ or (is_budget_raised and len(differ) == 1):
                merged = json.dumps(merge_fingerprints(stored, run_fingerprint), sort_keys=True)
                with self._db:
                    self._db.execute("UPDATE fingerprint SET json = ?", (merged,))
                return
            told = "; ".join(
                f"{name}: {shorten_text(there, 70)} in the journal, {shorten_text(now, 70)} in "
                "this run"
                for name, (there, now) in differ.items()
            )
        except (AttributeError, RecursionError, TypeError, ValueError):
            told = "its fingerprint is damaged"
        raise DataError(
            f"{self._path} contains cells that were computed with other settings ({told}). Start "
            "again with --fresh (fresh=True), or choose another --output (output=)."
        )

    def __enter__(self) -> CellJournal:
        """Return the journal."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Close the journal."""
        self._db.close()

    def add_cells(self, journal_rows: Iterable[CellJournalRow]) -> None:
        """Add finished cells to the journal in one transaction.

        Parameters
        ----------
        journal_rows : iterable of CellJournalRow
            Rows of the finished cells. If the journal already contains a row with the same key, the
            new row replaces this row.

        Raises
        ------
        DataError
            If the cells cannot be written, for example because the disk is full.
        """
        try:
            with self._db:
                self._db.executemany(
                    "INSERT OR REPLACE INTO cells VALUES (?, ?, ?, ?, ?, ?, ?)", journal_rows
                )
        except sqlite3.Error as error:
            raise DataError(f"cannot write to {self._path}: {error}.") from error

    def read_statuses(self, cell_keys: np.ndarray) -> np.ndarray:
        """Return the statuses of cells.

        Parameters
        ----------
        cell_keys : ndarray of bytes, shape (n,)
            Keys of the cells.

        Returns
        -------
        ndarray of int8, shape (n,)
            Status codes in the order of ``cell_keys``. If the journal does not contain a cell, its
            status is ``PENDING``.

        Raises
        ------
        DataError
            If the journal cannot be read.
        """
        codes = {status.name: int(status) for status in Status}
        statuses = np.full(len(cell_keys), int(Status.PENDING), dtype=np.int8)
        for places, rows in self._query_rows_of_cells(cell_keys, "status"):
            statuses[places] = [codes.get(name, int(Status.PENDING)) for (name,) in rows]
        return statuses

    def read_cells(self, cell_keys: np.ndarray) -> CellResultArrays:
        """Read cells from the journal.

        Parameters
        ----------
        cell_keys : ndarray of bytes, shape (n,)
            Keys of the cells.

        Returns
        -------
        CellResultArrays
            Columns of the cells, in the order of ``cell_keys``. If the journal does not contain a
            cell, its status is ``PENDING``.

        Raises
        ------
        DataError
            If the journal cannot be read, or if a row does not match its checksum.
        """
        columns = CellResultArrays.build_for_pending_cells(
            len(cell_keys), self._output_packer.packed_number_count
        )
        what = "key, status, message, work, seconds, numbers, checksum"
        for places, rows in self._query_rows_of_cells(cell_keys, what):
            try:
                _copy_journal_rows_into_arrays(columns, places, rows)
            except (KeyError, OverflowError, TypeError, ValueError) as error:
                raise DataError(
                    f"{self._path} is damaged: a cell does not match its checksum. "
                    f"{_UNUSABLE_JOURNAL_REMEDY}"
                ) from error
        return columns

    def _query_rows_of_cells(
        self, cell_keys: np.ndarray, column_names: str
    ) -> Iterator[tuple[list[int], list[Any]]]:
        """Yield the stored rows of the given cells in groups.

        Cells that are not in the journal are skipped. Each group consists of two lists. The first
        list contains indices into ``cell_keys``, and the second list contains the corresponding
        rows.
        """
        for start in range(0, len(cell_keys), _MAX_CELL_KEYS_PER_QUERY):
            wanted: list[bytes] = cell_keys[start : start + _MAX_CELL_KEYS_PER_QUERY].tolist()
            marks = ", ".join("?" * len(wanted))
            ask = f"SELECT key, {column_names} FROM cells WHERE key IN ({marks})"
            try:
                rows = {key: row for key, *row in self._db.execute(ask, wanted)}
            except sqlite3.Error as error:
                raise DataError(
                    f"{self._path} is damaged: {error}. {_UNUSABLE_JOURNAL_REMEDY}"
                ) from error
            known = [number for number, key in enumerate(wanted) if key in rows]
            if known:
                yield [start + number for number in known], [rows[wanted[n]] for n in known]


def _copy_journal_rows_into_arrays(
    cell_arrays: CellResultArrays, cell_indices: list[int], journal_rows: list[Any]
) -> None:
    """Copy rows of the journal into the arrays of cell results.

    If a row is damaged, the function raises a ``KeyError``, ``OverflowError``, ``TypeError`` or
    ``ValueError``.
    """
    if any(compute_journal_row_checksum(*known) != checksum for *known, checksum in journal_rows):
        raise ValueError("checksum")
    _keys, status, message, work, seconds, numbers, _checksums = zip(*journal_rows, strict=True)
    cell_arrays.statuses[cell_indices] = [Status[name] for name in status]
    cell_arrays.messages[cell_indices], cell_arrays.rhs_evaluations[cell_indices] = message, work
    cell_arrays.wall_times[cell_indices] = [math.nan if s is None else s for s in seconds]
    found = np.frombuffer(b"".join(numbers), dtype="<f8")
    cell_arrays.packed_outputs[cell_indices] = found.reshape(len(journal_rows), -1)


@dataclass(frozen=True)
class CellWallTimes:
    """Wall times of the cells in a journal.

    Parameters
    ----------
    run_fingerprint : mapping of str to object
        Fingerprint of the journal.
    seconds_by_cell_key : mapping of bytes to float
        Wall time in s by cell key. The mapping omits cells whose wall time is not in the journal.
    """

    run_fingerprint: Mapping[str, Any]
    seconds_by_cell_key: Mapping[bytes, float]

    @classmethod
    def read_from_journal(cls, journal_path: Path) -> CellWallTimes | None:
        """Read the wall times of the cells in a journal.

        Parameters
        ----------
        journal_path : Path
            Path of the journal.

        Returns
        -------
        CellWallTimes or None
            Wall times, or None if the journal does not exist, is damaged, or is locked by a run.
        """
        try:
            uri = f"{journal_path.resolve().as_uri()}?mode=ro"
            with contextlib.closing(sqlite3.connect(uri, uri=True, timeout=0.0)) as db:
                (known,) = db.execute("SELECT json FROM fingerprint").fetchone()
                seconds = db.execute(
                    "SELECT key, seconds FROM cells WHERE typeof(seconds) = 'real'"
                )
                return cls(dict(json.loads(known)), dict(seconds))
        except (OSError, RecursionError, sqlite3.Error, TypeError, ValueError):
            return None


def _open_and_lock_database(path: Path | str) -> sqlite3.Connection:
    """Open a database, and lock the database until it is closed."""
    db = sqlite3.connect(path, timeout=_JOURNAL_LOCK_TIMEOUT_SECONDS)
    try:
        db.execute("PRAGMA locking_mode = EXCLUSIVE")
        db.execute("BEGIN EXCLUSIVE")
        db.commit()
    except sqlite3.Error:
        db.close()
        raise
    return db


def _is_database_locked_error(error: Exception) -> bool:
    """Return True if another process has locked the database."""
    return getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_BUSY


def _remove_unused_journal(path: Path) -> None:
    """Delete a journal and its rollback file if no run uses the journal.

    If SQLite is interrupted while it writes the journal, a rollback file remains.
    """
    if path.exists():
        try:
            _open_and_lock_database(path).close()
        except sqlite3.Error as error:
            if _is_database_locked_error(error):
                raise
    for file in (path, path.with_name(f"{path.name}-journal")):
        file.unlink(missing_ok=True)
