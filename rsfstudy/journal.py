"""The journal of a study: every finished cell, on disk as soon as it is finished.

An SQLite file beside the results. A cell is found again by the exact values of its scene;
everything else that decides its numbers is the journal's fingerprint, and a journal with another
fingerprint is refused.
"""

from __future__ import annotations

import hashlib
import io
import json
import sqlite3
import textwrap
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from rsfstudy.errors import DataError
from rsfstudy.measures import Outcome
from rsfstudy.scene import Scene
from rsfstudy.status import Status

Finished = tuple[Outcome, float]


def cell_key(scene: Scene) -> str:
    """Name of a cell: a digest of the exact values of its scene."""
    exact = {
        name: value.hex() if isinstance(value, float) else value
        for name, value in scene.as_dict().items()
    }
    return hashlib.sha256(json.dumps(exact, sort_keys=True).encode()).hexdigest()


class Journal:
    """Finished cells of one study.

    Parameters
    ----------
    path : Path
        The SQLite file.
    fingerprint : mapping
        All that decides the numbers of a cell but its scene, as plain data.
    fresh : bool
        Forget what the file holds.

    Raises
    ------
    DataError
        If the file cannot be opened, or its fingerprint differs; the text says where.
    """

    def __init__(self, path: Path, fingerprint: Mapping[str, Any], *, fresh: bool = False) -> None:
        self._path = path
        wanted = json.dumps(fingerprint, sort_keys=True)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if fresh:
                path.unlink(missing_ok=True)
            self._db = sqlite3.connect(path)
            with self._db:
                self._db.execute("CREATE TABLE IF NOT EXISTS fingerprint (json TEXT NOT NULL)")
                self._db.execute(
                    "CREATE TABLE IF NOT EXISTS cells "
                    "(key TEXT PRIMARY KEY, status TEXT, message TEXT, work INTEGER, "
                    "seconds REAL, numbers BLOB)"
                )
                row = self._db.execute("SELECT json FROM fingerprint").fetchone()
                if row is None:
                    self._db.execute("INSERT INTO fingerprint VALUES (?)", (wanted,))
        except (OSError, sqlite3.Error) as error:
            raise DataError(
                f"cannot use {path}: {error}. Choose another --output, or start over with --fresh."
            ) from error
        if row is not None and row[0] != wanted:
            self._db.close()
            raise DataError(
                f"{path} holds cells computed differently: {_differences(row[0], fingerprint)}. "
                "Mixing them would be wrong: start over with --fresh (fresh=True), or choose "
                "another --output (output=)."
            )

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._db.close()

    def finished(self, keys: Iterable[str]) -> dict[str, Finished]:
        """Those of the cells that are finished; failures are left out, so that they are tried
        again.
        """
        found: dict[str, Finished] = {}
        for key in keys:
            row = self._db.execute(
                "SELECT status, message, work, seconds, numbers FROM cells WHERE key = ?", (key,)
            ).fetchone()
            if row is not None and Status[row[0]].is_answer:
                with np.load(io.BytesIO(row[4]), allow_pickle=False) as numbers:
                    values = {name: _scalar(numbers[name]) for name in numbers.files}
                found[key] = (Outcome(Status[row[0]], values, row[1], row[2]), row[3])
        return found

    def add(self, cells: Iterable[tuple[str, Finished]]) -> None:
        """Record finished cells, all or none.

        Raises
        ------
        DataError
            If the disk takes no more.
        """
        rows = []
        for key, (outcome, seconds) in cells:
            numbers = io.BytesIO()
            arrays: dict[str, Any] = {name: np.asarray(v) for name, v in outcome.values.items()}
            np.savez(numbers, **arrays)
            status, work = outcome.status.name, outcome.rhs_evaluations
            rows.append((key, status, outcome.message, work, seconds, numbers.getvalue()))
        try:
            with self._db:
                self._db.executemany("INSERT OR REPLACE INTO cells VALUES (?, ?, ?, ?, ?, ?)", rows)
        except sqlite3.Error as error:
            raise DataError(f"cannot add to {self._path}: {error}.") from error


def _scalar(values: np.ndarray) -> float | np.ndarray:
    return float(values) if values.ndim == 0 else values


def _brief(value: object) -> str:
    """A value of a fingerprint as a message has room for it."""
    return textwrap.shorten(str(value), 70, placeholder="...")


def _differences(theirs: str, ours: Mapping[str, Any]) -> str:
    before = json.loads(theirs)
    return "; ".join(
        f"{name}: {_brief(before.get(name))} there, {_brief(ours.get(name))} now"
        for name in sorted({*before, *ours})
        if before.get(name) != ours.get(name)
    )
