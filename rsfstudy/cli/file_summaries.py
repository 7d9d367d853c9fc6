"""Summary of a file with results, fits, a motion, or results of a single scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import xarray as xr

from rsfstudy.cli.printing import print_line, print_pieces
from rsfstudy.cli.results import EXIT_STATUS_FAILED, EXIT_STATUS_OK, CommandResult, drop_none
from rsfstudy.cli.study_results import StudyResults, print_failures
from rsfstudy.reporting import (
    TextTable,
    all_fits_are_valid,
    build_primary_output_table,
    build_single_scene_result_table,
    build_summary_tables_and_sentences,
    describe_dataset_origin,
    find_constant_fields,
    is_fit,
    is_motion,
    list_fit_values,
    measure_motion,
)
from rsfstudy.status import Status
from rsfstudy.storage import (
    is_of_single_scene,
    read_provenance,
    read_scene_fields,
)
from rsfstudy.vocabulary import find_coverage_content_type


@dataclass(frozen=True)
class FileSummary(CommandResult):
    """Contents of a file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of the file.
    file : str
        Path of the file.
    """

    dataset: xr.Dataset
    file: str

    @property
    def kind(self) -> str:
        """Kind of the contents: results, fit, motion or scene."""
        if is_fit(self.dataset):
            return "fit"
        if not is_of_single_scene(self.dataset):
            return "results"
        return "motion" if is_motion(self.dataset) else "scene"

    @property
    def exit_status(self) -> int:
        """Failure if a cell, a fit or a motion failed, or if a cell has not been computed."""
        if self.kind == "results":
            succeeded = StudyResults(self.dataset, self.file).is_complete
        elif self.kind == "fit":
            succeeded = all_fits_are_valid(self.dataset)
        else:
            succeeded = self.dataset.attrs["status"] == Status.OK.label
        return EXIT_STATUS_OK if succeeded else EXIT_STATUS_FAILED

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        about = {"kind": self.kind, "file": self.file}
        if self.kind == "results":
            return about | self._fields_of_results()
        if self.kind == "fit":
            return about | {"fits": list_fit_values(self.dataset)}
        attrs = self.dataset.attrs
        numbers = (
            {"motion": measure_motion(self.dataset)}
            if self.kind == "motion"
            else {"values": build_single_scene_result_table(self.dataset).values}
        )
        return about | {
            "status": attrs["status"],
            "message": attrs.get("message", ""),
            "scene": drop_none(read_scene_fields(self.dataset)),
            **numbers,
        }

    def _fields_of_results(self) -> dict[str, Any]:
        """Return the fields of the JSON output for the results of a study."""
        about, sizes = read_provenance(self.dataset), self.dataset.sizes
        scene, rig = find_constant_fields(self.dataset)
        return StudyResults(self.dataset, self.file).json_fields() | {
            "lattice": {str(d): sizes[d] for d in self.dataset["status"].dims},
            "scene": drop_none(scene),
            "rig": rig,
            "primary_output": build_primary_output_table(self.dataset).values,
            "variables": [
                {"name": name, "description": text, "dimensions": dimensions}
                for name, text, dimensions in _list_results(self.dataset)
            ],
            "provenance": {
                "command_line": about["command"],
                **{name: about[name] for name in ("time", "git", "machine", "versions")},
            },
        }


def _list_results(dataset: xr.Dataset) -> list[tuple[str, str, list[str]]]:
    """Return name, description and dimensions of each result in a dataset."""
    return [
        # users may add variables without long_name
        (str(name), str(values.attrs.get("long_name", "")), list(map(str, values.dims)))
        for name, values in dataset.data_vars.items()
        if find_coverage_content_type(str(name)) == "modelResult"
    ]


def build_contents_table(dataset: xr.Dataset) -> TextTable:
    """Return a table of the results that a dataset contains.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    TextTable
        Name, description and dimensions of each result.
    """
    rows = [
        {"variable": name, "description": f"{text} ({', '.join(dimensions)})".strip()}
        for name, text, dimensions in _list_results(dataset)
    ]
    return TextTable(rows, wrappable_columns={"description"})


def print_file_summary(summary: FileSummary) -> None:
    """Print the contents and the provenance of a file.

    Parameters
    ----------
    summary : FileSummary
        Contents of the file.
    """
    dataset = summary.dataset
    title = dataset.attrs.get("title", "result for a single scene")
    name = f"{dataset.attrs['id']}: " if "id" in dataset.attrs else ""
    print_line(f"{name}{title}\n", style="bold")
    print_pieces([describe_dataset_origin(dataset)])
    print_pieces(build_summary_tables_and_sentences(dataset))
    if summary.kind == "results":
        print_pieces([build_contents_table(dataset)])
        print_failures(StudyResults(dataset, summary.file))
