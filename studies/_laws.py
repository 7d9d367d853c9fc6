"""Evolution laws that the studies compare, and the references and plot styles of these laws."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rsfstudy import Panel

if TYPE_CHECKING:
    import xarray as xr

#: Names of the laws. A family of laws with the exponent eps connects the slip law (eps = 0) with
#: the slowness law (eps = 1). The other laws do not belong to this family.
SLIP_END, FAMILY_MIDDLE, SLOWNESS_END = "eps = 0 (slip)", "eps = 0.5", "eps = 1 (slowness)"
PERRIN_RICE_ZHENG, COMPOSITE, CUT_OFF = "Perrin-Rice-Zheng", "composite", "cut-off"
NAGATA = "slowness, c = 1"
#: Cut-off velocity V_c/V_* of the composite law and of the law with a cut-off.
COMPOSITE_CUTOFF_VELOCITY, CUT_OFF_VELOCITY = 100.0, 1e4


def _family_fields(exponent: float) -> dict[str, str | float]:
    """Return the scene fields that select a law of the family."""
    return {"law": "family", "law_exponent": exponent}


LAWS: dict[str, dict[str, str | float]] = {
    SLIP_END: _family_fields(0.0),
    "eps = 0.25": _family_fields(0.25),
    FAMILY_MIDDLE: _family_fields(0.5),
    "eps = 0.75": _family_fields(0.75),
    SLOWNESS_END: _family_fields(1.0),
    PERRIN_RICE_ZHENG: {"law": "perrin_rice_zheng"},
    COMPOSITE: {"law": "composite", "cutoff_velocity_ratio": COMPOSITE_CUTOFF_VELOCITY},
    CUT_OFF: {"law": "cut_off", "cutoff_velocity_ratio": CUT_OFF_VELOCITY},
    NAGATA: {"law": "slowness", "stress_dependence": 1.0},
}

#: Laws that have a name. The laws with eps = 0.25 and eps = 0.75 are not included.
LABELLED_LAWS = (
    SLIP_END,
    FAMILY_MIDDLE,
    SLOWNESS_END,
    PERRIN_RICE_ZHENG,
    COMPOSITE,
    CUT_OFF,
    NAGATA,
)

#: Steady state w of the composite law at V_*. The value solves w exp(w) = exp(-V_*/V_c).
COMPOSITE_STEADY_STATE = 0.56353169695

REFERENCES = [
    "Perrin, Rice and Zheng (1995), J. Mech. Phys. Solids 43, 1461-1495",
    "Kato and Tullis (2001), Geophys. Res. Lett. 28, 1103-1106",
    "Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314",
    "Ciardo and Viesca (2024), arXiv 2407.16846",
]


# ---- styles of figures --------------------------------------------------------------------------

#: Indices of the colours and line styles of the laws outside the family. The family uses other
#: colours, and the line styles can be distinguished in greyscale.
_STYLES_OUTSIDE_FAMILY = {
    PERRIN_RICE_ZHENG: (1, 1),
    COMPOSITE: (3, 3),
    CUT_OFF: (6, 2),
    NAGATA: (5, 4),
}


def family_colour(exponent: float) -> Any:
    """Return the colour in which a law of the family is drawn.

    Parameters
    ----------
    exponent : float
        Exponent eps of the law. Colours range from dark (0) to light (1).

    Returns
    -------
    object
        Colour in a format that matplotlib accepts.
    """
    from matplotlib import colormaps

    return colormaps["viridis"](0.85 * exponent)


def law_style(row: xr.Dataset) -> dict[str, Any]:
    """Return the line style of a law.

    Laws of the family are drawn as solid lines with markers, from dark to light. Other laws are
    drawn as dashed lines in other colours, without markers.

    Parameters
    ----------
    row : xarray.Dataset
        Results of one law.

    Returns
    -------
    dict
        Keyword arguments for ``matplotlib.axes.Axes.plot``.
    """
    from rsfstudy.plots import cycle_marker, cycle_style

    name, exponent = str(row["evolution"].item()), float(row.get("law_exponent", math.nan))
    if math.isnan(exponent):
        colour, dashes = next(
            (at for law, at in _STYLES_OUTSIDE_FAMILY.items() if name.startswith(law)), (2, 1)
        )
        return {
            **cycle_style(dashes),
            "color": cycle_style(colour)["color"],
            "marker": "",
            "markersize": 2.8,
        }
    solid = {"color": family_colour(exponent), "linestyle": "-", "markersize": 2.8}
    return solid | {"marker": cycle_marker(round(4.0 * exponent))}


def panel_by_normal_stress(x: str, y: str, log: str, **more: Any) -> Panel:
    """Return a panel declaration with one panel per condition and one curve per law.

    Parameters
    ----------
    x : str
        Variable or coordinate on the horizontal axis.
    y : str
        Variable on the vertical axis.
    log : str
        Axes with a logarithmic scale: "x", "y", "xy" or "".
    **more : object
        Other arguments of ``Panel``.

    Returns
    -------
    Panel
        Panel for a figure.
    """
    laws: dict[str, Any] = {"hue": ["evolution"], "facet": ["normal_stress"], "style": law_style}
    return Panel(x=x, y=y, log=log, y_scale_group=y, **laws, **more)
