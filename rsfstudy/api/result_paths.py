"""Functions that determine the paths of output directories and of results files."""

from __future__ import annotations

from pathlib import Path

from rsfstudy.defaults import Defaults
from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.path_checks import check_path_is_valid
from rsfstudy.study import list_study_names, load_study


def parse_output_path(output: str | Path | None) -> Path | None:
    """Convert the ``output`` argument to a path.

    Parameters
    ----------
    output : str, Path or None
        Directory of the results, which need not exist. None disables writing.

    Returns
    -------
    Path or None
        Path of the directory, or None if ``output`` is None.

    Raises
    ------
    InvalidValue
        If ``output`` is not a valid path.
    """
    if output is None:
        return None
    if not isinstance(output, str | Path):
        raise InvalidValue("output", output, "must be a path, or None")
    return check_path_is_valid("output", output)


def find_results_file(study_or_file: str | Path, output_directory: str | Path | None) -> Path:
    """Find the results file of a study.

    Parameters
    ----------
    study_or_file : str or Path
        Path of a results file (``.nc`` or ``.zarr``), name of a study, or path of a Python file
        that declares a study. If a Python file is passed, the function executes the file to obtain
        the name of the study.
    output_directory : str, Path or None
        Directory that contains the results. If None, the default output directory is used.

    Returns
    -------
    Path
        Path of the results file. If ``study_or_file`` is the path of a results file, or if a named
        study has not been run, the file may be missing.

    Raises
    ------
    DataError
        If the directory contains results of the study in both formats, NetCDF and Zarr, if the run
        is incomplete, or if the directory cannot be read.
    InvalidValue
        If ``study_or_file`` is neither a path nor the name of a study.
    """
    check_path_is_valid("study", study_or_file)
    path = Path(study_or_file)
    if path.suffix in (".nc", ".zarr"):
        return path
    study = load_study(str(path)).name if path.suffix == ".py" else str(study_or_file)
    try:
        return _find_results_file_of_study(
            study, parse_output_path(output_directory) or Defaults.OUTPUT_DIRECTORY
        )
    except OSError as error:
        raise DataError(
            f"cannot search for the results of {shorten_text(study_or_file)}: {error.strerror}"
        ) from error


def _find_results_file_of_study(study_name: str, output_directory: Path) -> Path:
    """Return the path of the NetCDF file or Zarr store of a study."""
    file, in_pieces = output_directory / f"{study_name}.nc", output_directory / f"{study_name}.zarr"
    if file.exists() and in_pieces.exists():
        raise DataError(
            f"both {file} and {in_pieces} exist. Pass the path of one of them, "
            "including its suffix."
        )
    if file.exists() or in_pieces.exists():
        return file if file.exists() else in_pieces
    partial = output_directory / f"{study_name}.partial.nc"
    if partial.exists():
        raise DataError(
            f"{file} does not exist, but the incomplete results {partial} exist. Run the study "
            "again, or pass the path of the incomplete results."
        )
    there = any(file.name.startswith(f"{study_name}.") for file in output_directory.glob("*"))
    if not there and study_name not in list_study_names():
        rule, remedy = (
            f"has no results in {shorten_text(output_directory)}",
            "Results files have the suffix .nc or .zarr.",
        )
        raise InvalidValue("study", study_name, rule, choices=list_study_names(), remedy=remedy)
    return file
