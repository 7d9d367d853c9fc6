"""Self-contained HTML report of all results in a directory.

The main function is ``report``. Each results file has a row in the summary at the top of the page,
and a section with figures and tables below.
"""

from __future__ import annotations

import base64
import os
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import xarray as xr

from rsfstudy.api import study_runs
from rsfstudy.api.result_paths import parse_output_path
from rsfstudy.defaults import Defaults
from rsfstudy.errors import DataError, InvalidValue, RsfStudyError, shorten_text
from rsfstudy.exception_conversion import (
    check_regular_file,
    format_exception,
    raise_only_rsfstudy_errors,
)
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.formatting import format_count_with_noun, format_overrides
from rsfstudy.quantities import HtmlText
from rsfstudy.reporting import (
    SummaryTableOrSentence,
    TextTable,
    build_claims_table,
    build_failed_cells_table,
    build_summary_tables_and_sentences,
    contains_fits,
    count_cells_by_status,
    count_pending_cells,
    describe_dataset_origin,
    is_hold_table,
    summarise_verdicts_and_failures,
)
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset, read_dataset

_UNREADABLE_FILE_STATUS = "cannot be read"
#: HTML tag that identifies reports of rsfstudy, and signature at the beginning of PNG files.
_HTML_GENERATOR_META_TAG = b'<meta name="generator" content="rsfstudy">'
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class _ReportSectionOfFile:
    """Contents of the report section and of the summary row for one results file."""

    results_path: Path
    title: str = ""
    verdicts_summary: str = ""
    status_text: str = Status.OK.label
    status_colour: str = "green"
    html_parts: tuple[str, ...] = ()

    @property
    def html_anchor(self) -> str:
        """HTML anchor of the section, which is the target of the link in the summary row."""
        return re.sub(r"\W+", "-", self.results_path.name)


@raise_only_rsfstudy_errors
def report(
    directory: str | Path = Defaults.OUTPUT_DIRECTORY, output: str | Path | None = None
) -> Path:
    """Write an HTML report of all results in a directory.

    The report is a single page with verdicts, figures, reductions, failed cells and the provenance
    of each file. The page needs no other files and no network, and has a layout for printing.

    Parameters
    ----------
    directory : str or Path, default: "outputs"
        Directory with results of studies, fits, motions and tables of holds (files with the suffix
        ``.nc`` or ``.zarr``). Files that cannot be read are listed in the report with the reason.
    output : str or Path, optional
        Path of the page, with the suffix ``.html``. The default is ``report.html`` in the
        directory.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    InvalidValue
        If the directory does not exist, if the suffix of the page is not ``.html``, or if the page
        would replace a file that is not a report.
    DataError
        If the directory contains no results, or if the page cannot be written.

    See Also
    --------
    rsfstudy.open : Load the results of a study into memory.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from rsfstudy import Scene, critical_step, report
    >>> scene = Scene(normal_stress="constant")
    >>> result = critical_step(scene, of="displacement_step", rtol=1e-4)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     _ = result.to_netcdf(Path(directory) / "step.nc")
    ...     page = report(directory)
    >>> page.name
    'report.html'
    """
    return write_html_report(directory, output)[0]


def write_html_report(
    directory: str | Path, output: str | Path | None = None
) -> tuple[Path, list[Path]]:
    """Write a report, and return its path and the unreadable files.

    Parameters
    ----------
    directory : str or Path
        Directory with results.
    output : str or Path, optional
        Path of the page. The default is ``report.html`` in the directory.

    Returns
    -------
    page : Path
        Path of the page.
    unreadable : list of Path
        Results files that could not be read.

    Raises
    ------
    InvalidValue
        If the directory or the path of the page is invalid.
    DataError
        If the directory contains no results, or if the page cannot be written.
    """
    from rsfstudy.plots import write_image

    place = parse_output_path(directory)
    if place is None or not place.is_dir():
        raise InvalidValue("directory", str(directory), "does not exist or is not a directory")
    page = place / "report.html" if output is None else parse_output_path(output)
    if page is None or page.suffix != ".html" or page.is_dir():
        raise InvalidValue("output", str(output), "must be a path with the suffix .html")
    check_regular_file("output", page)
    try:
        if page.exists() and _HTML_GENERATOR_META_TAG not in page.read_bytes()[:1000]:
            remedy = "Choose another output, or move the file."
            raise InvalidValue(
                "output", str(page), "already exists and is not a report", remedy=remedy
            )
        files = sorted(file for ending in ("nc", "zarr") for file in place.glob(f"[!.]*.{ending}"))
        if not files:
            raise DataError(f"{shorten_text(place)} contains no results (.nc or .zarr).")
        found = [_build_section_of_file(file, page.parent) for file in files]
        write_image(_build_html_page(place, found).encode(), page)
    except OSError as error:
        raise DataError(f"{shorten_text(page)} cannot be written ({error})") from error
    return page, [one.results_path for one in found if one.title == _UNREADABLE_FILE_STATUS]


def _build_html_page(directory: Path, file_sections: list[_ReportSectionOfFile]) -> str:
    """Return the HTML text of the page."""
    rows = [
        {
            "results": HtmlText(
                f'<a href="#{one.html_anchor}">{_escape_for_html(one.results_path.stem)}</a>'
            ),
            "title": one.title,
            "claims": one.verdicts_summary or "-",
            "status": one.status_text,
        }
        for one in file_sections
    ]
    colours = [one.status_colour for one in file_sections]
    summary = TextTable(
        rows, wrappable_columns={"title", "claims", "status"}, last_column_colours=colours
    )
    made = build_provenance_attributes("rsfstudy report")
    when, by = made["history"].split()[0], made["source"].partition(",")[0]
    sections = (
        f'<section id="{one.html_anchor}">\n<h2>{_escape_for_html(one.results_path.stem)}: '
        f"{_escape_for_html(one.title)}</h2>\n" + "\n".join(one.html_parts) + "\n</section>"
        for one in file_sections
    )
    page = Template(resources.files(__package__).joinpath("report.html").read_text("utf-8"))
    return page.substitute(
        title=f"Results in {_escape_for_html(directory.resolve().name)}",
        made=_escape_for_html(
            f"{format_count_with_noun(len(file_sections), 'file')}, read by {by}, {when}"
        ),
        summary=f"<nav>{_format_table_or_sentence_as_html(summary)}</nav>",
        sections="\n".join(sections),
    )


def _build_section_of_file(results_path: Path, page_directory: Path) -> _ReportSectionOfFile:
    """Build the section of a results file.

    If the file cannot be read, the section contains the reason.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = _build_section_of_dataset(
                results_path, read_dataset(results_path, allow_tables=True)
            )
        except Exception as error:  # Damaged files raise many types of exceptions.
            why = str(error) if isinstance(error, RsfStudyError) else format_exception(error)
            found = _ReportSectionOfFile(
                results_path,
                _UNREADABLE_FILE_STATUS,
                "",
                _UNREADABLE_FILE_STATUS,
                "red",
                (_format_html_paragraph(why, "red"),),
            )
    remarks = {str(one.message) for one in caught if issubclass(one.category, UserWarning)}
    links = _format_file_links_as_html(results_path, page_directory)
    return replace(
        found, html_parts=(*found.html_parts, *map(_format_html_paragraph, sorted(remarks)), links)
    )


def _build_section_of_dataset(results_path: Path, dataset: xr.Dataset) -> _ReportSectionOfFile:
    """Build the section of a dataset."""
    title = str(dataset.attrs.get("title", "result for one scene"))
    numbers = format_dataset_as_html(dataset)
    # The module uses the accessor without an import, because the accessor imports this module.
    if StoredDataset(dataset).table_contents:
        parts = [_format_figure_as_html(results_path, dataset.rsf.plot)] * is_hold_table(dataset)
        return _ReportSectionOfFile(results_path, title, html_parts=(*parts, numbers))
    if StoredDataset(dataset).is_of_single_scene:
        figure = (
            _format_figure_as_html(results_path, dataset.rsf.plot)
            if "slip" in dataset.variables
            else ""
        )
        status = Status[str(dataset.attrs["status"]).upper()]
        colour = "green" if status is Status.OK else "yellow" if status.is_answer else "red"
        return _ReportSectionOfFile(
            results_path, title, "", status.label.replace("_", " "), colour, (figure, numbers)
        )
    about = StoredDataset(dataset).study_declaration
    parts = [_format_table_or_sentence_as_html(about.summary)] if about.summary else []
    if about.overrides:
        parts.append(
            _format_html_paragraph(f"Overrides: {format_overrides(about.overrides)}", "yellow")
        )
    parts += [_format_figure_as_html(results_path, dataset.rsf.plot), numbers]
    verdicts, wrong = summarise_verdicts_and_failures(dataset, study_runs.check(dataset))
    if undone := count_pending_cells(dataset):
        wrong.append(f"{undone} cells not yet computed")
    failed = build_failed_cells_table(dataset, results_path.name)
    if failed.rows:
        lines = _escape_for_html("\n".join(row["command"] for row in failed.unformatted_rows))
        parts.append(
            f"<h3>Failures</h3>\n{_format_table_or_sentence_as_html(failed)}<pre>{lines}</pre>"
        )
    parts.append(
        f"<h3>Provenance</h3>\n{_format_table_or_sentence_as_html(describe_dataset_origin(dataset))}"
    )
    found = _ReportSectionOfFile(results_path, title, verdicts, html_parts=tuple(parts))
    if wrong:
        return replace(found, status_text=", ".join(wrong), status_colour="red")
    counts = count_cells_by_status(dataset)
    if (len(counts) > 1 and contains_fits(dataset)) or Status.OK.label not in counts:
        ended = ", ".join(f"{count} {label}" for label, count in counts.items())
        return replace(found, status_text=ended.replace("_", " "), status_colour="yellow")
    return found


def format_dataset_as_html(dataset: xr.Dataset) -> str:
    """Return the summary of a dataset as HTML.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene.

    Returns
    -------
    str
        HTML with the tables of the summary. The results of a study are followed by the verdicts of
        the claims, and other datasets are followed by their provenance.
    """
    parts = list(
        map(_format_table_or_sentence_as_html, build_summary_tables_and_sentences(dataset))
    )
    if StoredDataset(dataset).is_of_single_scene or StoredDataset(dataset).table_contents:
        parts.append(_format_table_or_sentence_as_html(describe_dataset_origin(dataset)))
    elif claimed := build_claims_table(study_runs.check(dataset)):
        parts += ["<h3>Claims</h3>", _format_table_or_sentence_as_html(claimed)]
    return "\n".join(filter(None, parts))


# ---- elements of HTML ----------------------------------------------------------------------------


def _escape_for_html(text: object) -> str:
    """Escape a string and its control characters for HTML."""
    return HtmlText.escape(text)


def _format_html_paragraph(text: str, colour: str = "") -> str:
    """Return a string as an HTML paragraph."""
    return f'<p class="{colour}">{_escape_for_html(text)}</p>'


def _format_table_or_sentence_as_html(table_or_sentence: SummaryTableOrSentence) -> str:
    """Format a sentence, a mapping or a table as HTML.

    A wide table is placed in a scrollable box. If the mapping or the table is empty, the function
    returns an empty string.
    """
    if isinstance(table_or_sentence, str):
        return _format_html_paragraph(table_or_sentence)
    if not isinstance(table_or_sentence, TextTable):
        rows = (
            f"<dt>{_escape_for_html(n)}</dt><dd>{_escape_for_html(value)}</dd>"
            for n, value in table_or_sentence.items()
        )
        return f"<dl>{''.join(rows)}</dl>" if table_or_sentence else ""
    rows_ = []
    for row, colour in zip(
        table_or_sentence.rows,
        table_or_sentence.last_column_colours or [""] * len(table_or_sentence.rows),
        strict=True,
    ):
        whole = {
            head: "" if head in table_or_sentence.wrappable_columns else "whole" for head in row
        }
        whole[list(row)[-1]] += f" {colour}"
        texts = {
            head: c if isinstance(c, HtmlText) else _escape_for_html(c) for head, c in row.items()
        }
        rows_.append([HtmlText(f'<span class="{whole[h]}">{t}</span>') for h, t in texts.items()])
    caption = _format_html_paragraph(table_or_sentence.caption) if table_or_sentence.caption else ""
    if not rows_:
        return ""
    table = HtmlText.format_table(list(table_or_sentence.rows[0]), rows_)
    return f'{caption}<div class="wide">{table}</div>'


def _format_figure_as_html(results_path: Path, draw_figure: Callable[[], Any]) -> str:
    """Return the figure of a results file as an embedded image.

    The function uses the PNG file next to the results if the PNG file is not older than the
    results, and draws the figure otherwise.
    """
    from rsfstudy.plots import render_figure, style_context

    beside = results_path.with_suffix(".png")
    image = b""
    if beside.is_file() and beside.stat().st_mtime >= results_path.stat().st_mtime:
        image = beside.read_bytes()
    try:
        if not image.startswith(_PNG_SIGNATURE):
            with style_context(None):
                image = render_figure(draw_figure(), "png")
    except Exception as error:  # The report shows the numbers even if the figure fails.
        return _format_html_paragraph(f"no figure: {error}", "yellow")
    data = base64.b64encode(image).decode()
    inches = _read_png_width_in_inches(image)
    about = (
        f'alt="{_escape_for_html(f"figure of {results_path.stem}")}" style="--inches: {inches:.3g}"'
    )
    return f'<figure><img {about} src="data:image/png;base64,{data}"></figure>'


def _read_png_width_in_inches(png_bytes: bytes) -> float:
    """Return the width in inches at which a PNG image is printed.

    The page scales each figure in proportion to this width, so that all text has the same size.
    """
    at = png_bytes.find(b"pHYs") + 4
    pixels, per_metre = (int.from_bytes(png_bytes[n : n + 4]) for n in (16, at))
    return pixels / per_metre / 0.0254 if at > 3 and per_metre else 100.0


def _format_file_links_as_html(results_path: Path, page_directory: Path) -> str:
    """Return links to the results file and to files with the same name.

    The links are relative to the directory of the page.
    """
    endings = [
        results_path.suffix,
        *(f".{form}" for form in Defaults.FIGURE_FORMATS),
        ".csv",
        ".mat",
        ".cells.sqlite",
    ]
    files = [file for ending in endings if (file := results_path.with_suffix(ending)).exists()]
    linked = (
        f'<a href="{quote(Path(os.path.relpath(file, page_directory)).as_posix())}">'
        f"{_escape_for_html(file.name)}</a>"
        for file in files
    )
    return f"<p>Files: {', '.join(linked)}</p>"
