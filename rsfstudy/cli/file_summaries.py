"""Summary of a file that contains results, fits, a table, a motion or a single scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import xarray as xr

from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK, CommandResult
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.cli.study_results import StudyResults, print_failed_cells
from rsfstudy.reporting import (
    are_all_fits_valid,
    build_result_variables_table,
    build_summary_tables_and_sentences,
    classify_file_contents,
    describe_dataset_origin,
    summarise_file_as_json_fields,
)
from rsfstudy.status import Status


@dataclass(frozen=True)
class FileSummary(CommandResult):
    """Dataset in a file, prepared for display by the ``show`` command.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of the file.
    file_path : str
        Path of the file.
    """

    dataset: xr.Dataset
    file_path: str

    @property
    def exit_status(self) -> int:
        """Exit status of the command. The status is 1 if a result failed or is missing."""
        kind = classify_file_contents(self.dataset)
        if kind == "results":
            succeeded = StudyResults(self.dataset, self.file_path).is_complete_without_failures
        elif kind == "fit":
            succeeded = are_all_fits_valid(self.dataset)
        elif kind == "table":
            succeeded = True
        else:
            succeeded = self.dataset.attrs["status"] == Status.OK.label
        return EXIT_STATUS_OK if succeeded else EXIT_STATUS_FAILED

    def to_json_fields(self) -> Mapping[str, Any]:
        """Return the fields of the JSON output."""
        return summarise_file_as_json_fields(self.dataset, self.file_path)


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
    print_tables_and_sentences([describe_dataset_origin(dataset)])
    print_tables_and_sentences(build_summary_tables_and_sentences(dataset))
    if classify_file_contents(dataset) == "results":
        print_tables_and_sentences([build_result_variables_table(dataset)])
        print_failed_cells(StudyResults(dataset, summary.file_path))
