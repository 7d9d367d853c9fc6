"""Functions that select the view that displays a scene, a dataset or a file.

The main function is ``create_view``.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import Record
from rsfstudy.rig import Rig
from rsfstudy.slider import Scene
from rsfstudy.storage import StoredDataset, read_dataset

if TYPE_CHECKING:
    from rsfstudy.explorer.base_view import ExplorerView

#: Class of each view, as module and name. The modules import Panel.
_MODULE_AND_CLASS_BY_VIEW_KIND = {
    "scene": ("rsfstudy.explorer.simulation_view", "SimulationView"),
    "results": ("rsfstudy.explorer.results_view", "ResultsView"),
    "record": ("rsfstudy.explorer.record_view", "RecordView"),
}
#: Suffixes of results files.
_RESULTS_FILE_SUFFIXES = (".nc", ".nc4", ".zarr")


def create_view(source: Any = None, state_json: str | None = None) -> ExplorerView:
    """Create the view of a scene, a dataset or a file.

    Parameters
    ----------
    source : Scene, Rig, Record, xarray.Dataset or path, optional
        Object to show. The default is a scene with the default values.
    state_json : str, optional
        Settings of the widgets as JSON.

    Returns
    -------
    ExplorerView
        View whose method ``build_page`` returns the Panel object.
    """
    kind, loaded = _find_view_kind_and_object(source)
    module, name = _MODULE_AND_CLASS_BY_VIEW_KIND[kind]
    view_class: type[ExplorerView] = getattr(importlib.import_module(module), name)
    return view_class.create_with_widget_state(loaded, view_class.parse_widget_state(state_json))


def _find_view_kind_and_object(source: Any) -> tuple[str, Any]:
    """Return the type of view to create and the object to display.

    If the source is a results file, the function opens the file. If the source is the file of a
    record, the function does not read the file, because the record view reads it with options that
    the user can change.
    """
    if source is None or isinstance(source, Scene | Rig):
        return "scene", source
    if isinstance(source, Record):
        return "record", source
    if isinstance(source, xr.Dataset):
        return ("scene" if StoredDataset(source).is_of_single_scene else "results"), source
    if not isinstance(source, str | Path):
        rule = "is not a scene, a rig, a record, a dataset or the path of a file"
        remedy = "Pass a Scene, a Rig, a Record, a dataset of rsfstudy, or the path of a file."
        raise InvalidValue("source", source, rule, remedy=remedy)
    if Path(source).suffix.lower() in _RESULTS_FILE_SUFFIXES:
        return _find_view_kind_and_object(read_dataset(Path(source)))
    return "record", Path(source)
