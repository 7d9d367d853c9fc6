"""Parameter studies of a spring-slider with rate- and state-dependent friction.

A study varies the fields of a scene along labelled axes. Dask workers compute a measure in each
cell of the resulting lattice. The results are written to self-describing NetCDF files and are
reduced to stability boundaries and scaling slopes.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from rsfstudy import _former_modules
from rsfstudy._deprecation import NEW_NAME_BY_OWNER_AND_FORMER_NAME, warn_renamed

if TYPE_CHECKING:
    from rsfstudy.api.event_catalogue import events as events
    from rsfstudy.api.healing_tables import healing as healing
    from rsfstudy.api.html_report import report as report
    from rsfstudy.api.record_fitting import fit as fit
    from rsfstudy.api.simulation import simulate as simulate
    from rsfstudy.api.single_scene_measures import critical_step as critical_step
    from rsfstudy.api.single_scene_measures import limit_cycle as limit_cycle
    from rsfstudy.api.single_scene_measures import to_si as to_si
    from rsfstudy.api.study_runs import check as check
    from rsfstudy.api.study_runs import compare as compare
    from rsfstudy.api.study_runs import open as open
    from rsfstudy.api.study_runs import plot as plot
    from rsfstudy.api.study_runs import recompute_cell as recompute_cell
    from rsfstudy.api.study_runs import rerun as rerun
    from rsfstudy.api.study_runs import run as run
    from rsfstudy.api.study_runs import studies as studies
    from rsfstudy.axes.axis import Axis as Axis
    from rsfstudy.explorer.entry_points import explore as explore
    from rsfstudy.motion.accuracy import Accuracy as Accuracy
    from rsfstudy.motion.integrator import Integrator as Integrator
    from rsfstudy.plots._healing import plot_healing as plot_healing
    from rsfstudy.plots._motion import plot_motion as plot_motion
    from rsfstudy.plots._records import plot_record as plot_record
    from rsfstudy.rig.protocol_files import history as history
    from rsfstudy.rig.protocol_files import read_protocol as read_protocol
    from rsfstudy.rig.record_files import read_record as read_record
    from rsfstudy.rig.rig import Rig as Rig
    from rsfstudy.rig.table_files import read_table as read_table
    from rsfstudy.slider.loading import Segment as Segment
    from rsfstudy.slider.scene import Scene as Scene
    from rsfstudy.slider.user_loadings import protocol as protocol
    from rsfstudy.study.claims import Claim as Claim
    from rsfstudy.study.figure_declarations import Figure as Figure
    from rsfstudy.study.figure_declarations import Panel as Panel
    from rsfstudy.study.study import Study as Study

#: Exported names by module. A module is imported when one of its names is first used, so that
#: worker processes do not import modules that only the main process needs.
_EXPORTED_NAMES_BY_MODULE = {
    "slider.scene": ("Scene",),
    "slider.loading": ("Segment",),
    "slider.user_loadings": ("protocol",),
    "rig.rig": ("Rig",),
    "rig.record_files": ("read_record",),
    "rig.table_files": ("read_table",),
    "api.record_fitting": ("fit",),
    "rig.protocol_files": ("history", "read_protocol"),
    "plots._healing": ("plot_healing",),
    "plots._motion": ("plot_motion",),
    "plots._records": ("plot_record",),
    "study.study": ("Study",),
    "axes.axis": ("Axis",),
    "study.claims": ("Claim",),
    "study.figure_declarations": ("Figure", "Panel"),
    "motion.accuracy": ("Accuracy",),
    "motion.integrator": ("Integrator",),
    "api.study_runs": (
        "run",
        "rerun",
        "recompute_cell",
        "open",
        "check",
        "compare",
        "plot",
        "studies",
    ),
    "api.html_report": ("report",),
    "api.simulation": ("simulate",),
    "api.single_scene_measures": ("critical_step", "limit_cycle", "to_si"),
    "api.event_catalogue": ("events",),
    "api.healing_tables": ("healing",),
    "explorer.entry_points": ("explore",),
}
_MODULE_BY_EXPORTED_NAME = {
    name: module for module, names in _EXPORTED_NAMES_BY_MODULE.items() for name in names
}

#: Documented submodules that ``rsfstudy`` provides in addition to the exported names.
_PUBLIC_SUBMODULE_NAMES = ("fitting", "measures", "parts", "plots", "reductions", "reduce")

__all__ = sorted(_MODULE_BY_EXPORTED_NAME)


def __getattr__(name: str) -> Any:
    """Import an exported name or a documented namespace on first use."""
    if name in _PUBLIC_SUBMODULE_NAMES:
        return importlib.import_module(f"{__name__}.{name}")
    if name in NEW_NAME_BY_OWNER_AND_FORMER_NAME[__name__]:
        warn_renamed(name, new := NEW_NAME_BY_OWNER_AND_FORMER_NAME[__name__][name], __name__)
        name = new
    if name not in _MODULE_BY_EXPORTED_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULE_BY_EXPORTED_NAME[name]}"), name)


def __dir__() -> list[str]:
    """Return the exported names."""
    return __all__


_former_modules.install_former_module_finder()
