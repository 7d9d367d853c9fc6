"""Class that reads the declaration, provenance and scenes of a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from rsfstudy.slider import Scene
from rsfstudy.storage import scene_reconstruction, schema, study_reconstruction
from rsfstudy.storage.schema import StoredProvenance
from rsfstudy.storage.stored_declarations import StoredStudyDeclaration
from rsfstudy.study import Study


@dataclass(frozen=True)
class StoredDataset:
    """Dataset with properties that read the declaration, the provenance and the scenes.

    Each property reads and checks the attributes of the dataset, and raises ``DataError`` if the
    attributes are missing or damaged.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or dataset of a single scene.
    """

    dataset: xr.Dataset

    @property
    def is_of_single_scene(self) -> bool:
        """True if the dataset belongs to a single scene rather than to a study."""
        return schema.is_of_single_scene(self.dataset)

    @property
    def table_contents(self) -> str:
        """Description of a table of holds, events or steps, or an empty string."""
        return schema.describe_table_contents(self.dataset)

    @property
    def study_declaration(self) -> StoredStudyDeclaration:
        """Declaration of the study."""
        return schema.read_study_declaration(self.dataset)

    @property
    def provenance(self) -> StoredProvenance:
        """Provenance of the results."""
        return schema.read_provenance(self.dataset)

    @property
    def scene_fields(self) -> dict[str, Any]:
        """Scene fields, if the dataset belongs to a single scene."""
        return schema.read_scene_fields(self.dataset)

    @property
    def study(self) -> Study:
        """Study with all of its cells, even if the dataset contains only some of the cells."""
        return study_reconstruction.rebuild_study_without_user_code(self.dataset)

    @property
    def primary_output_name(self) -> str | None:
        """Name of the primary output, or None if no output is numeric."""
        return study_reconstruction.find_primary_output_name(self.dataset)

    def rebuild_study(self, study_file: str | Path | None = None) -> Study:
        """Rebuild the study that produced the results from the stored declaration.

        Parameters
        ----------
        study_file : str or Path, optional
            File that declares user-defined classes of the study.

        Returns
        -------
        Study
            Study of the results.
        """
        return study_reconstruction.rebuild_study(self.dataset, study_file)

    def rebuild_scene(self, study: Study | None) -> Scene:
        """Return the scene of the dataset, or of the selected cell of a study.

        Parameters
        ----------
        study : Study or None
            Study of the results. None for a dataset of a single scene.

        Returns
        -------
        Scene
            Scene of the dataset.
        """
        return scene_reconstruction.rebuild_scene(self.dataset, study)

    def read_json_attribute(self, attribute_name: str) -> Any:
        """Decode a root attribute that contains JSON.

        Parameters
        ----------
        attribute_name : str
            Name of the attribute.

        Returns
        -------
        object
            Decoded value.
        """
        return schema.read_json_attribute(self.dataset, attribute_name)

    def check_contains_study_results(self, file_description: str) -> None:
        """Raise ``DataError`` if the dataset does not contain the results of a study.

        Parameters
        ----------
        file_description : str
            Description of the file or dataset for the error message.
        """
        schema.check_contains_study_results(self.dataset, file_description)
