"""Storage of results: journals, results files and their schema.

The package also compares results and rebuilds studies. A results file is written completely or not
at all. When a results file is read, its contents are checked. A study can be rebuilt from the
declaration in its results file. To add a format of results files, add a module to this package. To
add an export format, see ``rsfstudy.cli.export_files``. The package never computes cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.storage.cell_columns import CellColumns, OutputPacker, StoredCellRow
    from rsfstudy.storage.cell_journal import CellJournal, CellTimings, read_timings
    from rsfstudy.storage.cell_numbers import find_cell_number
    from rsfstudy.storage.comparison import Comparison, compare_results, compare_same_lattice
    from rsfstudy.storage.dataset_files import (
        convert_attributes_for_netcdf,
        read_dataset,
        write_dataset,
    )
    from rsfstudy.storage.dataset_scenes import scene_of_dataset
    from rsfstudy.storage.declarations import build_scene_from_stored
    from rsfstudy.storage.fingerprints import find_fingerprint_differences
    from rsfstudy.storage.lattice_coordinates import LatticeCoordinates
    from rsfstudy.storage.lattice_datasets import assemble_dataset
    from rsfstudy.storage.rebuild_from_file import (
        find_primary_output,
        rebuild_study,
        study_of_dataset,
    )
    from rsfstudy.storage.schema import (
        check_contains_study_results,
        is_of_single_scene,
        read_declaration,
        read_json_attribute,
        read_provenance,
        read_scene_fields,
    )
    from rsfstudy.storage.zarr_store import (
        check_store_does_not_exist,
        check_zarr_installed,
        write_store,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "storage.cell_numbers": ("find_cell_number",),
            "storage.comparison": ("Comparison", "compare_results", "compare_same_lattice"),
            "storage.dataset_scenes": ("scene_of_dataset",),
            "storage.cell_columns": ("CellColumns", "StoredCellRow", "OutputPacker"),
            "storage.cell_journal": ("CellTimings", "CellJournal", "read_timings"),
            "storage.declarations": ("build_scene_from_stored",),
            "storage.fingerprints": ("find_fingerprint_differences",),
            "storage.lattice_coordinates": ("LatticeCoordinates",),
            "storage.lattice_datasets": ("assemble_dataset",),
            "storage.rebuild_from_file": (
                "find_primary_output",
                "rebuild_study",
                "study_of_dataset",
            ),
            "storage.schema": (
                "check_contains_study_results",
                "is_of_single_scene",
                "read_declaration",
                "read_json_attribute",
                "read_provenance",
                "read_scene_fields",
            ),
            "storage.dataset_files": (
                "convert_attributes_for_netcdf",
                "read_dataset",
                "write_dataset",
            ),
            "storage.zarr_store": (
                "check_store_does_not_exist",
                "check_zarr_installed",
                "write_store",
            ),
        },
    )

__all__ = [
    "CellColumns",
    "StoredCellRow",
    "CellTimings",
    "Comparison",
    "CellJournal",
    "LatticeCoordinates",
    "OutputPacker",
    "assemble_dataset",
    "build_scene_from_stored",
    "check_contains_study_results",
    "check_store_does_not_exist",
    "check_zarr_installed",
    "convert_attributes_for_netcdf",
    "compare_results",
    "compare_same_lattice",
    "find_cell_number",
    "find_fingerprint_differences",
    "find_primary_output",
    "is_of_single_scene",
    "read_dataset",
    "read_declaration",
    "read_json_attribute",
    "read_provenance",
    "read_scene_fields",
    "read_timings",
    "rebuild_study",
    "scene_of_dataset",
    "study_of_dataset",
    "write_dataset",
    "write_store",
]
