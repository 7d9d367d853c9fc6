"""Functions that print the declaration of a study and the estimated cost of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rsfstudy import Axis, Study
from rsfstudy.cli import cost_estimates
from rsfstudy.cli.command_results import EXIT_STATUS_OK, CommandResult
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.execution import CellPlan
from rsfstudy.formatting import format_count_with_noun
from rsfstudy.reporting import describe_scene_and_rig_fields
from rsfstudy.rig import Rig

#: Maximum number of values that are printed for each axis.
_MAX_PRINTED_AXIS_POINTS = 40


@dataclass(frozen=True)
class StudyDeclaration(CommandResult):
    """Declaration of a study, prepared for display by the ``show`` command.

    Parameters
    ----------
    study : Study
        Study to display.
    output_directory : Path
        Directory of results. If the directory contains measured times of earlier runs, the cost
        estimate uses these times.
    """

    study: Study
    output_directory: Path
    exit_status = EXIT_STATUS_OK

    @cached_property
    def cell_plan(self) -> CellPlan:
        """Plan of the cells of the study."""
        return CellPlan(self.study)

    @cached_property
    def varied_field_names(self) -> set[str]:
        """Names of the scene fields and measure fields that differ between cells."""
        varied = {field for axis in self.study.axes for field in axis.fields}
        if self.study.axis_unit_converter:
            scales = self.study.axis_unit_converter.compute_scale_and_scene_coordinates()
            varied |= {name for name, (dims, _values) in scales.items() if dims}
        return varied

    @property
    def fixed_measure_fields(self) -> dict[str, Any]:
        """Fields of the measure that have the same value in all cells."""
        fields = self.study.measure.describe().items()
        return {name: value for name, value in fields if name not in self.varied_field_names}

    @property
    def rig_quantities(self) -> Mapping[str, float]:
        """Quantities of the rig in SI units."""
        return self.study.rig.as_dict() if self.study.rig else {}

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        study, varied = self.study, self.varied_field_names
        variables = study.measure.variables
        return {
            "kind": "study",
            "study": study.name,
            "title": study.title,
            "summary": study.summary,
            "axes": [{"size": len(axis), **axis.describe()} for axis in study.axes],
            "scene": {
                name: value
                for name, value in study.base.as_dict().items()
                if name not in varied and value is not None
            },
            "rig": {
                n: self.rig_quantities[n]
                for n in Rig.convert_quantities_for_display(self.rig_quantities, varied)
            },
            "measure": self.fixed_measure_fields,
            "outputs": [
                {"name": name, "has_error": f"{name}_error" in variables}
                for name in variables
                if not name.endswith("_error")
            ],
            "reductions": [reduction.describe()["name"] for reduction in study.reductions],
            "claims": list(dict.fromkeys(claim.id for claim in study.claims)),
            "cells": study.size,
            "distinct_cells": len(self.cell_plan.unique_cell_numbers),
            **cost_estimates.collect_accuracy_and_cost_fields(
                self.cell_plan, self.output_directory
            ),
        }


def print_study_declaration(declaration: StudyDeclaration) -> None:
    """Print the declaration of a study and its expected cost.

    Parameters
    ----------
    declaration : StudyDeclaration
        Declaration to print.
    """
    study = declaration.study
    print_line(f"{study.name}: {study.title}\n", style="bold")
    if study.summary:
        print_line(study.summary + "\n")
    measured = {
        name: f"{len(value)} values" if isinstance(value, tuple | list) else value
        for name, value in declaration.fixed_measure_fields.items()
    }
    gives = study.measure.variables
    with_errors = {n: " (with its error)" * (f"{n}_error" in gives) for n in gives}
    different = len(declaration.cell_plan.unique_cell_numbers)
    others = f" ({different:,} of them different)" if different < study.size else ""
    costs = (
        cost_estimates.describe_study_cost(declaration.cell_plan, declaration.output_directory),
        cost_estimates.suggest_compiled_engine(declaration.cell_plan, declaration.output_directory),
    )
    about = {
        **{
            _format_axis_heading(axis): _format_axis_points(axis.point_names) for axis in study.axes
        },
        **describe_scene_and_rig_fields(
            "fixed fields",
            study.base.as_dict(),
            declaration.rig_quantities,
            declaration.varied_field_names,
        ),
        "measure": ", ".join(f"{n} = {v}" for n, v in measured.items()),
        "outputs": ", ".join(f"{n}{w}" for n, w in with_errors.items() if not n.endswith("_error")),
        "reductions": ", ".join(r.describe()["name"] for r in study.reductions),
        "claims": ", ".join(dict.fromkeys(c.id for c in study.claims)),
        "number of cells": f"{study.size:,}{others}",
        "computational cost": "; ".join(filter(None, costs)),
    }
    print_tables_and_sentences([{name: text or "-" for name, text in about.items()}])


def _format_axis_heading(axis: Axis) -> str:
    """Format the dimension of an axis and its number of values."""
    return f"axis {axis.dimension!r} ({format_count_with_noun(len(axis), 'value')})"


def _format_axis_points(axis_points: Sequence[str]) -> str:
    """Format the values of an axis, and abbreviate a long list."""
    return ", ".join(
        axis_points
        if len(axis_points) <= _MAX_PRINTED_AXIS_POINTS
        else [*axis_points[:10], "...", *axis_points[-3:]]
    )
