"""The figure of how far answers of another code agree with those that are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

Points = Sequence[tuple[float, float]]


def agreement(digits: Mapping[str, Points], label: str, enough: float) -> Figure:
    """Digits that agree, of each quantity, against what stands on the abscissa; and how many make a
    pass.
    """
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for name, points in digits.items():
        axes.plot(*zip(*points, strict=True), "o", markersize=4, label=name)
    axes.axhline(enough, color="0.5", linewidth=0.8, linestyle="--")
    axes.set(xlabel=label, ylabel="digits that agree")
    axes.legend(fontsize="small", ncols=2)
    return figure
