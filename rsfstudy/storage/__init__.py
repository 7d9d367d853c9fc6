"""Results files: the journal of finished cells, datasets, schema, comparison.

The package writes results completely or not at all, checks files when it reads them, rebuilds a
study from the declaration in its file, and compares two files. Add a file format here. It never
computes a cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.storage.cell_journal import (
        CellColumns,
        CellJournal,
        CellTimings,
        OutputPacking,
        StoredCellRow,
        find_fingerprint_differences,
        read_timings,
    )
    from rsfstudy.storage.comparison import (
        Comparison,
        compare_results,
        compare_same_lattice,
        find_cell_number,
    )
    from rsfstudy.storage.dataset_files import clean_attributes, read_dataset, write_dataset
    from rsfstudy.storage.dataset_scenes import scene_of_dataset
    from rsfstudy.storage.lattice_datasets import assemble_dataset
    from rsfstudy.storage.rebuild_from_file import (
        find_primary_output,
        rebuild_study,
        study_of_dataset,
    )
    from rsfstudy.storage.schema import (
        build_axis_from_stored,
        build_scene_from_stored,
        check_is_of_study,
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
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "storage.comparison": (
                "Comparison",
                "compare_results",
                "compare_same_lattice",
                "find_cell_number",
            ),
            "storage.dataset_scenes": ("scene_of_dataset",),
            "storage.cell_journal": (
                "CellColumns",
                "StoredCellRow",
                "CellTimings",
                "CellJournal",
                "OutputPacking",
                "find_fingerprint_differences",
                "read_timings",
            ),
            "storage.lattice_datasets": ("assemble_dataset",),
            "storage.rebuild_from_file": (
                "find_primary_output",
                "rebuild_study",
                "study_of_dataset",
            ),
            "storage.schema": (
                "build_axis_from_stored",
                "build_scene_from_stored",
                "check_is_of_study",
                "is_of_single_scene",
                "read_declaration",
                "read_json_attribute",
                "read_provenance",
                "read_scene_fields",
            ),
            "storage.dataset_files": ("clean_attributes", "read_dataset", "write_dataset"),
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
    "OutputPacking",
    "assemble_dataset",
    "build_axis_from_stored",
    "build_scene_from_stored",
    "check_is_of_study",
    "check_store_does_not_exist",
    "check_zarr_installed",
    "clean_attributes",
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
