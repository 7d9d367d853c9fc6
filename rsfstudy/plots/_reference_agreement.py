"""Figure that shows how well the results of another code agree with reference results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.plots._figure_size import compute_figure_size_in_inches
from rsfstudy.plots._image_files import NotebookFigure
from rsfstudy.plots._style import (
    add_legend,
    cycle_marker,
    cycle_style,
    finalize_layout,
    increase_figure_height_for_legends,
)

SequenceOfXYPairs = Sequence[tuple[float, float]]


@accept_former_keyword_names
def draw_agreement(
    digits: Mapping[str, SequenceOfXYPairs], label: str, required_digits: float
) -> Figure:
    """Plot the number of correct digits of each quantity.

    Parameters
    ----------
    digits : mapping of str to sequence of (float, float)
        Pairs of an x value and the number of correct digits, for each quantity.
    label : str
        Label of the x axis. The first letter is capitalised.
    required_digits : float
        Number of correct digits that is required to pass the comparison. A dashed line in the
        figure marks this number.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with one panel.

    Examples
    --------
    >>> from rsfstudy.plots import draw_agreement
    >>> digits = {"friction": [(0.0, 9.1), (10.0, 8.4)], "slip_rate": [(0.0, 8.0), (10.0, 7.2)]}
    >>> figure = draw_agreement(digits, "time (s)", 6.0)
    >>> figure.axes[0].get_xlabel()
    'Time (s)'
    """
    figure = NotebookFigure(figsize=compute_figure_size_in_inches(2, 1), layout="constrained")
    axes = figure.subplots()
    for number, (name, points) in enumerate(digits.items()):
        style = {"color": cycle_style(number)["color"], "fillstyle": "none"}
        axes.plot(
            *zip(*points, strict=True), cycle_marker(number), label=name.replace("_", " "), **style
        )
    axes.axhline(
        required_digits, color="0.5", linewidth=0.8, linestyle="--", label="required to pass"
    )
    axes.set(xlabel=label[0].upper() + label[1:], ylabel="Number of correct digits")
    add_legend(axes, 5)
    increase_figure_height_for_legends(figure, [[axes]])
    finalize_layout(figure)
    return figure
