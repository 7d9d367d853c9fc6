"""Storage of results in journals and in results files that follow a schema.

The package also compares results and rebuilds studies. A results file is either written completely
or not written at all. When a results file is read, its contents are checked. A study can be rebuilt
from the declaration in its results file. To add a format of results files, add a module to this
package. To add an export format, see ``rsfstudy.cli.export_files``. The package never computes
cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.storage.cell_journal import (
        CellJournal,
        CellWallTimes,
    )
    from rsfstudy.storage.cell_number_from_coordinates import find_cell_number
    from rsfstudy.storage.cell_result_arrays import (
        CellJournalRow,
        CellOutputPacker,
        CellResultArrays,
    )
    from rsfstudy.storage.dataset_files import (
        convert_attributes_for_netcdf,
        read_dataset,
        write_dataset,
    )
    from rsfstudy.storage.lattice_coordinates import LatticeCoordinatesBuilder
    from rsfstudy.storage.lattice_datasets import assemble_study_dataset
    from rsfstudy.storage.results_comparison import (
        ResultsComparison,
        compare_results,
        compare_results_of_same_study,
    )
    from rsfstudy.storage.run_fingerprints import find_fingerprint_differences
    from rsfstudy.storage.stored_dataset import StoredDataset
    from rsfstudy.storage.stored_declarations import build_scene_from_stored_fields
    from rsfstudy.storage.zarr_store import ZarrStore
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "storage.zarr_store": ("ZarrStore",),
            "storage.stored_dataset": ("StoredDataset",),
            "storage.cell_number_from_coordinates": ("find_cell_number",),
            "storage.results_comparison": (
                "ResultsComparison",
                "compare_results",
                "compare_results_of_same_study",
            ),
            "storage.cell_result_arrays": (
                "CellJournalRow",
                "CellOutputPacker",
                "CellResultArrays",
            ),
            "storage.cell_journal": ("CellJournal", "CellWallTimes"),
            "storage.stored_declarations": ("build_scene_from_stored_fields",),
            "storage.run_fingerprints": ("find_fingerprint_differences",),
            "storage.lattice_coordinates": ("LatticeCoordinatesBuilder",),
            "storage.lattice_datasets": ("assemble_study_dataset",),
            "storage.dataset_files": (
                "convert_attributes_for_netcdf",
                "read_dataset",
                "write_dataset",
            ),
        },
    )

__all__ = [
    "StoredDataset",
    "ZarrStore",
    "CellResultArrays",
    "CellJournalRow",
    "CellWallTimes",
    "ResultsComparison",
    "CellJournal",
    "LatticeCoordinatesBuilder",
    "CellOutputPacker",
    "assemble_study_dataset",
    "build_scene_from_stored_fields",
    "convert_attributes_for_netcdf",
    "compare_results",
    "compare_results_of_same_study",
    "find_cell_number",
    "find_fingerprint_differences",
    "read_dataset",
    "write_dataset",
]
