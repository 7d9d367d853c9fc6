"""Figures that commands write next to results files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from rsfstudy.cli.options import CommandOptions
from rsfstudy.cli.printing import print_on_stderr
from rsfstudy.defaults import Defaults
from rsfstudy.errors import DataError, InvalidValue, RsfStudyError
from rsfstudy.plots import (
    FIGURE_NAMES,
    render_figure,
    save_figure,
    style_context,
    write_image,
)
from rsfstudy.storage import StoredDataset
from rsfstudy.study import load_study

if TYPE_CHECKING:
    from rsfstudy.plots import Figure


def write_figure(figure: Figure, path: Path, style: str | None = None) -> None:
    """Write a figure to an image file.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to write.
    path : Path
        Path of the file. The suffix determines the format.
    style : str, optional
        Style sheet of Matplotlib.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    try:
        with style_context(style):
            write_image(render_figure(figure, path.suffix[1:]), path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error})") from error


def build_default_figure_path(results_path: Path, command_options: CommandOptions) -> Path:
    """Return the default path of the figure of a results file.

    Parameters
    ----------
    results_path : Path
        Path of the results file. The file need not exist.
    command_options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    Path
        Path in the directory of the results file. The option ``--figure`` determines the suffix of
        the path.
    """
    name = results_path.name.removesuffix(".nc").removesuffix(".zarr")
    words = [name, command_options.variable, command_options.form or Defaults.FIGURE_FORMATS[0]]
    return results_path.with_name(".".join(filter(None, words)))


def load_user_figure_or_default(dataset: xr.Dataset, study_file: Path | None) -> Any:
    """Load the figure function of a study, or choose a default figure.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    study_file : Path or None
        Python file that declares the study.

    Returns
    -------
    callable, str or None
        Function that draws the figure, or None if the study uses a built-in figure. If the figure
        cannot be loaded and the user passed no study file, ``load_user_figure_or_default`` prints a
        note and returns "lines". The results are then drawn as maps or lines.
    """
    if StoredDataset(dataset).study_declaration.plot in FIGURE_NAMES:
        return None
    try:
        return load_user_figure(dataset, study_file)
    except RsfStudyError as error:
        if study_file is not None:
            raise
        reason = "because the figure of the study is not available"
        print_on_stderr(f"note: drawn as maps or lines, {reason}. {error}")
        return "lines"


def draw_and_save_figure(
    dataset: xr.Dataset, figure_path: Path, command_options: CommandOptions, user_figure: Any
) -> list[Path]:
    """Draw the figure of a results dataset, and save the figure.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    figure_path : Path
        Path of the figure.
    command_options : CommandOptions
        Arguments and options of the command.
    user_figure : callable, str or None
        Figure that replaces the figure in the declaration of the study.

    Returns
    -------
    list of Path
        Path of the figure. If the figure cannot be drawn, the function prints a message and returns
        an empty list, because the results have already been written.
    """
    try:
        appearance = command_options.collect_option_values("style", "width", "header")
        save_figure(
            dataset, figure_path, user_figure, variable=command_options.variable, **appearance
        )
    except (OSError, RsfStudyError) as error:
        print_on_stderr(f"no figure: {error}")
        return []
    return [figure_path]


def load_user_figure(results: xr.Dataset, study_file: str | Path | None = None) -> Any:
    """Load the custom figure of a dataset from the Python file of its study.

    Parameters
    ----------
    results : xarray.Dataset
        Results of the study.
    study_file : str or Path, optional
        Python file that declares the study. The file is executed.

    Returns
    -------
    callable or None
        Function that draws the figure, or None if the study uses a built-in figure.

    Raises
    ------
    InvalidValue
        If no study file is passed, or if the file does not define the figure.

    Notes
    -----
    The dataset contains the path of a study file. The function never executes the file at this
    path, because the results may come from an untrusted source.
    """
    name, named_in = (
        StoredDataset(results).study_declaration.plot,
        StoredDataset(results).provenance["declared_in"],
    )
    if study_file is None:
        remedy = f"Pass the file that declares the figure: --study {named_in or 'FILE'}."
        raise InvalidValue("plot", name, "is not a figure of rsfstudy", remedy=remedy)
    study = load_study(str(study_file))
    if study.name != results.attrs["id"] or study.figure_name_in_declaration != name:
        rule = f"does not draw {name!r} of {results.attrs['id']!r}"
        raise InvalidValue("study", str(study_file), rule)
    return None if isinstance(study.plot, str) else study.plot
