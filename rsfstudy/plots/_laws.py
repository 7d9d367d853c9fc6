"""What figures that compare state evolution laws share: a line for each of them, and panels for
constant and for variable normal stress that have the same height.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes

from rsfstudy.plots._axes import same_height
from rsfstudy.plots._style import look, marker

_FAMILY = colormaps["viridis"]
#: Colour and line, by their places in the cycle of the style, of laws beside the family; no colour
#: is one of the family's, and no two lines look alike in grey.
_BESIDE = ((1, 1), (3, 3), (6, 2), (5, 4), (4, 5))


def shade(exponent: float) -> Any:
    """Colour of a member of the family of laws, from dark to light."""
    return _FAMILY(0.85 * exponent)


def lines(dataset: xr.Dataset) -> Iterator[tuple[xr.Dataset, str, dict[str, Any]]]:
    """Each law along `evolution`, what it is called, and its line: the family solid, from dark to
    light and with markers, others in other colours and dashed.
    """
    beside = members = 0
    for number, name in enumerate(dataset["evolution"].values):
        law = dataset.isel(evolution=number)
        exponent = float(law["law_exponent"]) if "law_exponent" in law.coords else math.nan
        if math.isnan(exponent):
            colour, dashes = _BESIDE[beside % len(_BESIDE)]
            line = look(dashes) | {"color": look(colour)["color"]}
            beside += 1
        else:
            line = {"color": shade(exponent), "linestyle": "-", "marker": marker(members)}
            members += 1
        yield law, str(name).replace("eps", r"$\epsilon$"), {"markersize": 2.8, **line}


def curves(
    dataset: xr.Dataset, axes: Axes, variable: str, along: str, stress: int, *, log: bool
) -> xr.Dataset:
    """One curve a law at one case of normal stress, which is returned; axes are as high for the
    others.
    """
    case = dataset.isel(normal_stress=stress)
    for law, label, line in lines(case):
        axes.plot(law[along], law[variable], label=label, **line)
    axes.set_title(f"{case['normal_stress'].item()} normal stress".capitalize())
    same_height(axes, dataset[variable], log=log)
    return case
