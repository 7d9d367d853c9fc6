"""Functions that format a study as HTML for notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rsfstudy.axes import Axis
from rsfstudy.formatting import format_abbreviated_list
from rsfstudy.measures import Measure
from rsfstudy.quantities import HtmlText, Quantity, format_quantities_as_html_table
from rsfstudy.slider import Scene, SceneFields
from rsfstudy.vocabulary import find_quantity


def format_study_as_html(
    heading: str,
    axes: Sequence[Axis],
    base_scene: Scene,
    measure: Measure,
    known_quantities: Mapping[str, Quantity],
) -> str:
    """Format a study as HTML tables of axes, fixed fields and results.

    Parameters
    ----------
    heading : str
        Heading of the first table.
    axes : sequence of Axis
        Axes of the study.
    base_scene : Scene
        Scene with the fixed fields, which are shown in a collapsed table.
    measure : Measure
        Measure of the study. The results are shown in a collapsed table.
    known_quantities : mapping of str to Quantity
        Quantities that are not in the common vocabulary.

    Returns
    -------
    str
        HTML code.
    """
    varied = {name for axis in axes for name in axis.fields}
    fixed = {name: v for name, v in base_scene.as_dict().items() if name not in varied}
    shared = SceneFields.iterate_quantities_with_values(fixed, base_scene.user_parts)
    along = [(_find_axis_quantity(a, known_quantities), _format_axis_points(a)) for a in axes]
    measured = [(find_quantity(name, known_quantities), None) for name in measure.variables]
    return (
        format_quantities_as_html_table(along, heading)
        + _build_collapsed_html_section(
            "fields of all cells", format_quantities_as_html_table(shared)
        )
        + _build_collapsed_html_section(
            f"results of {measure.name} in each cell",
            format_quantities_as_html_table(measured, with_values=False),
        )
    )


def _build_collapsed_html_section(caption: str, content: HtmlText) -> HtmlText:
    """Return HTML code that shows the content when the user clicks the caption."""
    return HtmlText(f"<details><summary>{HtmlText.escape(caption)}</summary>{content}</details>")


def _find_axis_quantity(axis: Axis, known_quantities: Mapping[str, Quantity]) -> Quantity:
    """Return the quantity that an axis varies.

    If the axis has units, the returned quantity has no symbol and no scale.
    """
    about, units = find_quantity(axis.dimension, known_quantities), axis.units.get(axis.dimension)
    return about if units is None else replace(about, symbol="", units=units, scale="")


def _format_axis_points(axis: Axis) -> str:
    """Format the points of an axis, and shorten long lists."""
    return f"{format_abbreviated_list(axis.point_names, ', ')} ({len(axis)})"
