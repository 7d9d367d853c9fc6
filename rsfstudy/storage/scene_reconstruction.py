"""Functions that rebuild scenes from datasets.

The scene of a motion is rebuilt from the attributes of the dataset. In the results of a study, each
cell has its own scene, which is rebuilt from the declaration of the study.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import SampledHistory, Scene, SceneFields, UserLoading, UserPart, protocol
from rsfstudy.storage.lattice_coordinates import build_dimension_coordinates
from rsfstudy.storage.plain_data_conversion import build_invalid_entry_error
from rsfstudy.storage.schema import read_scene_fields
from rsfstudy.storage.stored_declarations import build_scene_from_stored_fields
from rsfstudy.study import Study


def rebuild_scene(dataset: xr.Dataset, study: Study | None) -> Scene:
    """Return the scene of a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset of a single scene, or results of a study from which the user selected one cell.
    study : Study or None
        Study that produced the dataset, or None if the dataset describes a single scene.

    Returns
    -------
    Scene
        Scene of the dataset or of the selected cell.

    Raises
    ------
    InvalidValue
        If the results contain several cells, or if the scene contains a user-defined part that is
        not registered.
    """
    if study is not None:
        return study.scene(find_selected_cell_number(dataset, study))
    return read_scene_from_attributes(dataset)


def find_selected_cell_number(dataset: xr.Dataset, study: Study) -> int:
    """Find the cell number of the selected cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study with one selected cell.
    study : Study
        Study that produced the results.

    Returns
    -------
    int
        Number of the cell in row-major order.

    Raises
    ------
    InvalidValue
        If a coordinate has several values, or if its value is not a point of the axis.
    """
    places = []
    for name, values in build_dimension_coordinates(study).items():
        given = dataset[name].values.ravel() if name in dataset.coords else np.array([])
        if given.size != 1:
            remedy = f"Select a cell first, for example dataset.isel({name}=0)."
            raise InvalidValue(name, given.tolist(), "must have a single value", remedy=remedy)
        found = np.flatnonzero(values == given[0])
        if not found.size:
            remedy = "Use the dataset before its units were converted."
            raise InvalidValue(
                name, given[0], "is not a point of this axis of the study", remedy=remedy
            )
        places.append(int(found[0]))
    return int(np.ravel_multi_index(places, study.shape))


def read_scene_from_attributes(dataset: xr.Dataset) -> Scene:
    """Build the scene from the attributes of a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset of a single scene.

    Returns
    -------
    Scene
        Scene of the dataset.

    Raises
    ------
    DataError
        If the attributes are missing or invalid, or if the samples of a loading do not match the
        digest of the samples.
    InvalidValue
        If the scene contains a user-defined part that is not registered.
    """
    plain = read_scene_fields(dataset)
    segments, loading = plain.pop("segments", ()), str(plain.get("loading"))
    digest = plain.pop("samples", "")
    own: dict[str, UserPart] = {
        name: part for slot in SceneFields.PART_SLOTS for name, part in slot.user_parts.items()
    }
    # Protocols with the same name can differ, so the protocol is rebuilt from its segments.
    if segments and (loading not in own or isinstance(own[loading], UserLoading)):
        rebuilt = protocol(segments, loading)
        own[SceneFields.replace_part_or_alias_by_part_name("loading", rebuilt)] = rebuilt
    if digest:
        told = dataset["history_samples"]
        pressure, stress = (bool(told.attrs.get(n)) for n in ("of_pressure", "of_stress"))
        sampled = SampledHistory.from_table(told.values, stress, loading, of_pressure=pressure)
        if sampled.digest != digest:
            raise build_invalid_entry_error(
                "history_samples", f"do not match the digest of the scene ({digest})"
            )
        own[SceneFields.replace_part_or_alias_by_part_name("loading", sampled)] = sampled
    for slot in SceneFields.PART_SLOTS:
        name = plain.get(slot.name)
        if isinstance(name, str) and name not in {*slot.built_in_parts, *own}:
            remedy = (
                "Create a scene with the class first, which registers the part. For commands, "
                "pass --study FILE."
            )
            rule = "is a user-defined part that is not registered"
            raise InvalidValue(slot.name, name, rule, remedy=remedy)
    return build_scene_from_stored_fields(plain, own, "scene")
