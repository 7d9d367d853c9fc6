"""The figure of how far answers of another code agree with those that are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from rsfstudy.plots import Drawing
from rsfstudy.plots._style import legend, look, make_room, marker, settle, size

Points = Sequence[tuple[float, float]]


def agreement(digits: Mapping[str, Points], label: str, enough: float) -> Figure:
    """Digits that agree, of each quantity, against what stands on the abscissa; and how many make a
    pass.
    """
    figure = Drawing(figsize=size(2, 1), layout="constrained")
    axes = figure.subplots()
    for number, (name, points) in enumerate(digits.items()):
        style = {"color": look(number)["color"], "fillstyle": "none"}
        axes.plot(*zip(*points, strict=True), marker(number), label=name.replace("_", " "), **style)
    axes.axhline(enough, color="0.5", linewidth=0.8, linestyle="--", label="enough to pass")
    axes.set(xlabel=label[0].upper() + label[1:], ylabel="Digits that agree")
    legend(axes, 5)
    make_room(figure, [[axes]])
    settle(figure)
    return figure
