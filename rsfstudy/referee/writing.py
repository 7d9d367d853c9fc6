"""Problems, their answers, empty templates and an example, written for other codes."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.referee.problem import SHIPPED, Problem, read, shipped


def write(directory: Path) -> None:
    """Write all problems into ``problems``, their answers into ``answers``, a table to be filled
    for each into ``templates``, and ``example.py``.

    Raises
    ------
    InvalidValue
        Where the directory is not empty.
    DataError
        Where it cannot be written.
    """
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        remedy = "Name a new one: nothing is replaced."
        raise InvalidValue("DIR", str(directory), "is there already", remedy=remedy)
    try:
        places = {name: directory / name for name in ("problems", "answers", "templates")}
        for place in places.values():
            place.mkdir(parents=True)
        for path in shipped().values():
            shutil.copyfile(path, places["problems"] / path.name)
            answer = path.with_suffix(".csv")
            shutil.copyfile(answer, places["answers"] / answer.name)
            _template(read(path), places["templates"] / answer.name)
        shutil.copyfile(SHIPPED / "example.txt", directory / "example.py")
    except OSError as error:
        raise DataError(f"{directory}: cannot be written ({error})") from error


def _template(problem: Problem, path: Path) -> None:
    """The header of an answer, and which row is which."""
    empty = [""] * len(problem.quantities)
    rows = [f"{row:.12g}" for row in problem.rows] if problem.key else []
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(problem.header)
        table.writerows([[row, *empty] for row in rows] or [empty])
