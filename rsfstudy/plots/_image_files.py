"""Functions that render figures for notebooks and write figures to image files."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Figure

from rsfstudy._deprecation import accept_former_keyword_names

#: Resolution of figures in notebooks, in dots per inch.
_NOTEBOOK_FIGURE_DPI = 150
#: Metadata that remove the creation date from an image file, so that two files of the same figure
#: are identical.
_IMAGE_METADATA_WITHOUT_DATES: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}


class NotebookFigure(Figure):
    """Figure that notebooks display without pyplot.

    Parameters
    ----------
    *args : object
        Positional arguments of ``matplotlib.figure.Figure``.
    **options : object
        Keyword arguments of ``matplotlib.figure.Figure``.

    Examples
    --------
    >>> from rsfstudy.plots import NotebookFigure
    >>> figure = NotebookFigure(figsize=(3.0, 2.0))
    >>> axes = figure.add_subplot()
    >>> len(figure.axes)
    1
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        """Create the figure with a canvas that can render images."""
        super().__init__(*args, **options)
        # The canvas keeps its renderer, which is used to measure the size of text.
        FigureCanvasAgg(self)

    def _repr_png_(self) -> bytes:
        """Return the figure as a PNG image for notebooks."""
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=_NOTEBOOK_FIGURE_DPI)
        return image.getvalue()


@accept_former_keyword_names
def render_figure(figure: Figure, image_format: str) -> bytes:
    r"""Render a figure as an image.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to render.
    image_format : {"png", "pdf", "svg"}
        Format of the image.

    Returns
    -------
    bytes
        Contents of an image file without a creation date.

    Examples
    --------
    >>> from rsfstudy.plots import NotebookFigure, render_figure
    >>> image = render_figure(NotebookFigure(figsize=(1.0, 1.0)), "png")
    >>> image[:4]
    b'\x89PNG'
    """
    image = io.BytesIO()
    figure.savefig(
        image, format=image_format, metadata=_IMAGE_METADATA_WITHOUT_DATES.get(image_format)
    )
    return image.getvalue()


def write_image(image: bytes, path: Path) -> None:
    """Write an image to a file atomically.

    The function writes the image to a temporary file in the same directory, and renames the
    temporary file. Missing parent directories are created.

    Parameters
    ----------
    image : bytes
        Encoded image.
    path : Path
        Path of the file.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from rsfstudy.plots import NotebookFigure, render_figure, write_image
    >>> image = render_figure(NotebookFigure(figsize=(1.0, 1.0)), "svg")
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = Path(directory, "figures", "empty.svg")
    ...     write_image(image, path)
    ...     path.read_bytes() == image
    True
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.new")
    try:
        # If the temporary file were a link or a pipe, the image would be written to another place.
        beside.unlink(missing_ok=True)
        beside.write_bytes(image)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
