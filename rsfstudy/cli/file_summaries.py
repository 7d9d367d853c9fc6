"""Summary of a file that contains results, fits, a motion or a single scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import xarray as xr

from rsfstudy.cli.printing import print_line, print_pieces
from rsfstudy.cli.results import EXIT_STATUS_FAILED, EXIT_STATUS_OK, CommandResult
from rsfstudy.cli.study_results import StudyResults, print_failures
from rsfstudy.reporting import (
    all_fits_are_valid,
    build_contents_table,
    build_summary_tables_and_sentences,
    classify_contents,
    describe_dataset_origin,
    summarise_file_as_fields,
)
from rsfstudy.status import Status


@dataclass(frozen=True)
class FileSummary(CommandResult):
    """Dataset in a file, prepared for display by the command ``show``.

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
    def exit_status(self) -> int:
        """Exit status of the command. The status is 1 if a result failed or is missing."""
        kind = classify_contents(self.dataset)
        if kind == "results":
            succeeded = StudyResults(self.dataset, self.file).is_complete
        elif kind == "fit":
            succeeded = all_fits_are_valid(self.dataset)
        else:
            succeeded = self.dataset.attrs["status"] == Status.OK.label
        return EXIT_STATUS_OK if succeeded else EXIT_STATUS_FAILED

    def json_fields(self) -> Mapping[str, Any]:
        """Return the fields of the JSON output."""
        return summarise_file_as_fields(self.dataset, self.file)


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
    if classify_contents(dataset) == "results":
        print_pieces([build_contents_table(dataset)])
        print_failures(StudyResults(dataset, summary.file))
