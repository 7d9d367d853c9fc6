"""One page of HTML of all results in a directory, complete by itself."""

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

from rsfstudy.api import fit_results, runs, summaries, tables
from rsfstudy.api.tables import Table
from rsfstudy.compute import provenance, runner
from rsfstudy.defaults import FIGURES, OUTPUT
from rsfstudy.error_boundary import check_file, error_boundary, in_words
from rsfstudy.errors import DataError, InvalidValue, RsfStudyError, brief
from rsfstudy.files import contents, places, store
from rsfstudy.quantity import Markup, as_html, table
from rsfstudy.status import Status
from rsfstudy.wording import counted, settings

_UNREAD = "cannot be read"
#: What begins a page of ours, and a figure.
_OURS = b'<meta name="generator" content="rsfstudy">'
_PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class _Result:
    """One results file: what the summary tells, and what the page shows below."""

    path: Path
    title: str = ""
    verdicts: str = ""
    status: str = Status.OK.label
    colour: str = "green"
    shown: tuple[str, ...] = ()

    @property
    def anchor(self) -> str:
        return re.sub(r"\W+", "-", self.path.name)


@error_boundary
def report(directory: str | Path = OUTPUT, output: str | Path | None = None) -> Path:
    """Path of one page of HTML, which is written: it shows all results in a directory.

    The page holds verdicts, figures, reductions, failed cells and where each file comes from. It
    needs no other file and no network, and prints. A file that cannot be read is told on it.

    Parameters
    ----------
    directory : path
        With files of studies, fits and motions, as `run`, `fit` and `simulate` write them.
    output : path, optional
        The file to write; ``report.html`` in the directory, unless stated.

    Raises
    ------
    InvalidValue
        If the directory is none, or the page has another ending than ``.html``.
    DataError
        If the directory holds no results, or the page cannot be written.
    """
    return written(directory, output)[0]


def written(directory: str | Path, output: str | Path | None = None) -> tuple[Path, list[Path]]:
    """Path of the page, which is written, and the files that could not be read."""
    from rsfstudy.plots import write_image

    place = places.directory(directory)
    if place is None or not place.is_dir():
        raise InvalidValue("directory", str(directory), "is no directory")
    page = place / "report.html" if output is None else places.directory(output)
    if page is None or page.suffix != ".html" or page.is_dir():
        raise InvalidValue("output", str(output), "must be a file that ends in .html")
    check_file("output", page)
    try:
        if page.exists() and _OURS not in page.read_bytes()[:1000]:
            remedy = "Choose another output, or move it away first."
            raise InvalidValue(
                "output", str(page), "is there already, and no report", remedy=remedy
            )
        files = sorted(file for ending in ("nc", "zarr") for file in place.glob(f"[!.]*.{ending}"))
        if not files:
            raise DataError(f"{brief(place)} holds no results, which end in .nc or .zarr.")
        found = [_result(file, page.parent) for file in files]
        write_image(_page(place, found).encode(), page)
    except OSError as error:
        raise DataError(f"{brief(page)} cannot be written ({error})") from error
    return page, [one.path for one in found if one.title == _UNREAD]


def _page(directory: Path, found: list[_Result]) -> str:
    """The whole page."""
    rows = [
        {
            "results": Markup(f'<a href="#{one.anchor}">{_text(one.path.stem)}</a>'),
            "title": one.title,
            "claims": one.verdicts or "-",
            "status": one.status,
        }
        for one in found
    ]
    colours = [one.colour for one in found]
    summary = Table(rows, prose={"title", "claims", "status"}, colours=colours)
    made = provenance.attributes("rsfstudy report")
    when, by = made["history"].split()[0], made["source"].partition(",")[0]
    sections = (
        f'<section id="{one.anchor}">\n<h2>{_text(one.path.stem)}: {_text(one.title)}</h2>\n'
        + "\n".join(one.shown)
        + "\n</section>"
        for one in found
    )
    page = Template(resources.files(__package__).joinpath("report.html").read_text("utf-8"))
    return page.substitute(
        title=f"Results in {_text(directory.resolve().name)}",
        made=_text(f"{counted(len(found), 'file')}, read by {by}, {when}"),
        summary=f"<nav>{_shown(summary)}</nav>",
        sections="\n".join(sections),
    )


def _result(path: Path, beside: Path) -> _Result:
    """What is told of a file, whatever it holds."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = _read(path, store.read_any(path))
        except Exception as error:  # damaged files raise almost anything
            why = str(error) if isinstance(error, RsfStudyError) else in_words(error)
            found = _Result(path, _UNREAD, "", _UNREAD, "red", (_said(why, "red"),))
    remarks = {str(one.message) for one in caught if issubclass(one.category, UserWarning)}
    links = _links(path, beside)
    return replace(found, shown=(*found.shown, *map(_said, sorted(remarks)), links))


def _read(path: Path, dataset: xr.Dataset) -> _Result:
    """What is told of a file that can be read."""
    title = str(dataset.attrs.get("title", "answer for one scene"))
    numbers = html(dataset)
    # the accessor, which this module cannot import: it shows these tables
    if contents.is_of_a_scene(dataset):
        figure = _figure(path, dataset.rsf.plot) if "slip" in dataset.variables else ""
        status = Status[str(dataset.attrs["status"]).upper()]
        colour = "green" if status is Status.OK else "yellow" if status.is_answer else "red"
        return _Result(path, title, "", status.label.replace("_", " "), colour, (figure, numbers))
    about = contents.declaration(dataset)
    parts = [_shown(about.summary)] if about.summary else []
    if about.overrides:
        parts.append(_said(f"Not as declared: {settings(about.overrides)}", "yellow"))
    parts += [_figure(path, dataset.rsf.plot), numbers]
    verdicts, wrong = tables.ended(dataset, runs.check(dataset))
    if undone := tables.undone(dataset):
        wrong.append(f"{undone} cells not computed")
    failed, cells = tables.failures(dataset)
    if cells:
        commands = "\n".join(tables.reproducing(dataset, path.name, cell) for cell in cells)
        parts.append(f"<h3>Failures</h3>\n{_shown(failed)}<pre>{_text(commands)}</pre>")
    parts.append(f"<h3>Provenance</h3>\n{_shown(summaries.origin(dataset))}")
    found = _Result(path, title, verdicts, shown=tuple(parts))
    if wrong:
        return replace(found, status=", ".join(wrong), colour="red")
    counts = runner.counts(dataset)
    if (len(counts) > 1 and fit_results.is_fit(dataset)) or Status.OK.label not in counts:
        ended = ", ".join(f"{count} {label}" for label, count in counts.items())
        return replace(found, status=ended.replace("_", " "), colour="yellow")
    return found


def html(dataset: xr.Dataset) -> str:
    """The numbers of a dataset in HTML, and the verdicts on those of a study."""
    parts = list(map(_shown, summaries.numbers(dataset)))
    if contents.is_of_a_scene(dataset):
        parts.append(_shown(summaries.origin(dataset)))
    elif claimed := tables.claims(runs.check(dataset)):
        parts += ["<h3>Claims</h3>", _shown(claimed)]
    return "\n".join(filter(None, parts))


# ---- pieces of HTML ------------------------------------------------------------------------------


def _text(text: object) -> str:
    """A text as HTML; control characters, which no browser shows, are spelt out."""
    return as_html(text)


def _said(text: str, colour: str = "") -> str:
    return f'<p class="{colour}">{_text(text)}</p>'


def _shown(piece: summaries.Piece) -> str:
    """A sentence, what is what, or a table, in a box of its own that scrolls where it is too wide;
    nothing of what is empty.
    """
    if isinstance(piece, str):
        return _said(piece)
    if not isinstance(piece, Table):
        rows = (f"<dt>{_text(n)}</dt><dd>{_text(value)}</dd>" for n, value in piece.items())
        return f"<dl>{''.join(rows)}</dl>" if piece else ""
    rows_ = []
    for row, colour in zip(piece.rows, piece.colours or [""] * len(piece.rows), strict=True):
        whole = {head: "" if head in piece.prose else "whole" for head in row}
        whole[list(row)[-1]] += f" {colour}"
        texts = {head: c if isinstance(c, Markup) else _text(c) for head, c in row.items()}
        rows_.append([Markup(f'<span class="{whole[h]}">{t}</span>') for h, t in texts.items()])
    caption = _said(piece.caption) if piece.caption else ""
    return f'{caption}<div class="wide">{table(list(piece.rows[0]), rows_)}</div>' if rows_ else ""


def _figure(path: Path, draw: Callable[[], Any]) -> str:
    """The figure beside results, drawn anew where it is missing or older than they are."""
    from rsfstudy.plots import rendered, styled

    beside = path.with_suffix(".png")
    image = b""
    if beside.is_file() and beside.stat().st_mtime >= path.stat().st_mtime:
        image = beside.read_bytes()
    try:
        if not image.startswith(_PNG):
            with styled(None):
                image = rendered(draw(), "png")
    except Exception as error:  # of whatever kind, the numbers are there
        return _said(f"no figure: {error}", "yellow")
    data = base64.b64encode(image).decode()
    about = f'alt="{_text(f"figure of {path.stem}")}" style="--inches: {_inches(image):.3g}"'
    return f'<figure><img {about} src="data:image/png;base64,{data}"></figure>'


def _inches(image: bytes) -> float:
    """Width of a PNG on paper, by which letters of all figures are of one size."""
    at = image.find(b"pHYs") + 4
    pixels, per_metre = (int.from_bytes(image[n : n + 4]) for n in (16, at))
    return pixels / per_metre / 0.0254 if at > 3 and per_metre else 100.0


def _links(path: Path, beside: Path) -> str:
    """Links to the results and to what lies beside them, from where the page is."""
    endings = [path.suffix, *(f".{form}" for form in FIGURES), ".csv", ".mat", ".cells.sqlite"]
    files = [file for ending in endings if (file := path.with_suffix(ending)).exists()]
    linked = (
        f'<a href="{quote(Path(os.path.relpath(file, beside)).as_posix())}">{_text(file.name)}</a>'
        for file in files
    )
    return f"<p>Files: {', '.join(linked)}</p>"
