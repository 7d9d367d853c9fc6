"""The figure of how far answers of another code agree with those that are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from rsfstudy.plots._figures import NotebookFigure
from rsfstudy.plots._style import (
    add_legend,
    cycle_marker,
    cycle_style,
    enlarge_for_legends,
    figure_size,
    finalize_layout,
)

Points = Sequence[tuple[float, float]]


def draw_agreement(digits: Mapping[str, Points], label: str, enough: float) -> Figure:
    """Digits that agree, of each quantity, against what stands on the abscissa; and how many make a
    pass.
    """
    figure = NotebookFigure(figsize=figure_size(2, 1), layout="constrained")
    axes = figure.subplots()
    for number, (name, points) in enumerate(digits.items()):
        style = {"color": cycle_style(number)["color"], "fillstyle": "none"}
        axes.plot(
            *zip(*points, strict=True), cycle_marker(number), label=name.replace("_", " "), **style
        )
    axes.axhline(enough, color="0.5", linewidth=0.8, linestyle="--", label="enough to pass")
    axes.set(xlabel=label[0].upper() + label[1:], ylabel="Digits that agree")
    add_legend(axes, 5)
    enlarge_for_legends(figure, [[axes]])
    finalize_layout(figure)
    return figure
