"""Paths of results: the directory of a run, and the file or store of a study."""

from __future__ import annotations

from pathlib import Path

from rsfstudy.defaults import OUTPUT_DIRECTORY
from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.path_checks import check_path
from rsfstudy.study import load_study, study_names


def output_directory(output: str | Path | None) -> Path | None:
    """Directory of results, which need not be there yet; None for nowhere.

    Raises
    ------
    InvalidValue
        For what cannot be the path of one.
    """
    if output is None:
        return None
    if not isinstance(output, str | Path):
        raise InvalidValue("output", output, "must be a path, or None")
    return check_path("output", output)


def find_results(study_or_file: str | Path, output_path: str | Path | None) -> Path:
    """The results of a named study, or of the study that a file declares, in a directory; or the
    results file that is named itself. A file that declares a study is run, because results bear the
    name that its `Study` states.

    Raises
    ------
    DataError, InvalidValue
        If there are none.
    """
    check_path("study", study_or_file)
    path = Path(study_or_file)
    if path.suffix in (".nc", ".zarr"):
        return path
    study = load_study(str(path)).name if path.suffix == ".py" else str(study_or_file)
    try:
        return _result_path_of_study(study, output_directory(output_path) or OUTPUT_DIRECTORY)
    except OSError as error:
        raise DataError(
            f"{shorten_text(study_or_file)} cannot be looked for: {error.strerror}"
        ) from error


def _result_path_of_study(study_name: str, output_path: Path) -> Path:
    """The results of a study, by its name."""
    file, in_pieces = output_path / f"{study_name}.nc", output_path / f"{study_name}.zarr"
    if file.exists() and in_pieces.exists():
        raise DataError(f"{file} and {in_pieces} are both there: name one, ending and all.")
    if file.exists() or in_pieces.exists():
        return file if file.exists() else in_pieces
    partial = output_path / f"{study_name}.partial.nc"
    if partial.exists():
        raise DataError(
            f"{file} does not exist, but {partial} does: run the study again, or name it."
        )
    there = any(file.name.startswith(f"{study_name}.") for file in output_path.glob("*"))
    if not there and study_name not in study_names():
        rule, remedy = (
            f"has no results in {shorten_text(output_path)}",
            "Results files end in .nc or .zarr.",
        )
        raise InvalidValue("study", study_name, rule, choices=study_names(), remedy=remedy)
    return file
