"""Figures of study results, motions and fits.

Most functions take a dataset, and either return a figure or draw on existing axes. The package
``rsfstudy.plots`` also exports helper functions for user-defined figures. The package never
computes results, and never calls ``show()``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.plots._axis_formatting import (
        are_log_spaced,
        are_positive_and_span_decades,
        compute_cell_edges,
        describe_point,
        format_axis_label,
        label_rows,
    )
    from rsfstudy.plots._figure_choice import FIGURE_NAMES
    from rsfstudy.plots._figure_drawing import draw_figure, save_figure
    from rsfstudy.plots._healing import plot_healing
    from rsfstudy.plots._image_files import Figure, NotebookFigure, render_figure, write_image
    from rsfstudy.plots._motion import plot_motion
    from rsfstudy.plots._records import plot_record
    from rsfstudy.plots._reference_agreement import draw_agreement
    from rsfstudy.plots._style import (
        add_grey_legend_entry,
        cycle_marker,
        cycle_style,
        style_context,
    )
    from rsfstudy.plots._text_formatting import format_number, format_slope
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "plots._reference_agreement": ("draw_agreement",),
            "plots._axis_formatting": (
                "are_log_spaced",
                "are_positive_and_span_decades",
                "compute_cell_edges",
                "describe_point",
                "format_axis_label",
                "label_rows",
            ),
            "plots._figure_choice": ("FIGURE_NAMES",),
            "plots._figure_drawing": ("draw_figure", "save_figure"),
            "plots._healing": ("plot_healing",),
            "plots._image_files": ("Figure", "NotebookFigure", "render_figure", "write_image"),
            "plots._motion": ("plot_motion",),
            "plots._records": ("plot_record",),
            "plots._style": (
                "add_grey_legend_entry",
                "cycle_marker",
                "cycle_style",
                "style_context",
            ),
            "plots._text_formatting": ("format_number", "format_slope"),
        },
    )

__all__ = [
    "FIGURE_NAMES",
    "Figure",
    "NotebookFigure",
    "add_grey_legend_entry",
    "are_log_spaced",
    "are_positive_and_span_decades",
    "compute_cell_edges",
    "cycle_marker",
    "cycle_style",
    "describe_point",
    "draw_agreement",
    "draw_figure",
    "format_axis_label",
    "format_number",
    "format_slope",
    "label_rows",
    "plot_healing",
    "plot_motion",
    "plot_record",
    "render_figure",
    "save_figure",
    "style_context",
    "write_image",
]
