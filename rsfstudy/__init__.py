"""Parameter studies of a spring-slider with rate- and state-dependent friction.

Named studies, and studies of your own, are declared as labelled dimensions over a scene, computed
over a lattice by Dask workers, and land as self-describing NetCDF datasets that are reduced to
boundaries and scaling slopes.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from rsfstudy._deprecation import RENAMED, warn_renamed

if TYPE_CHECKING:
    from rsfstudy.api.events import events as events
    from rsfstudy.api.fitting import fit as fit
    from rsfstudy.api.one_scene import critical_step as critical_step
    from rsfstudy.api.one_scene import limit_cycle as limit_cycle
    from rsfstudy.api.one_scene import to_si as to_si
    from rsfstudy.api.report import report as report
    from rsfstudy.api.runs import check as check
    from rsfstudy.api.runs import compare as compare
    from rsfstudy.api.runs import open as open
    from rsfstudy.api.runs import plot as plot
    from rsfstudy.api.runs import recompute_cell as recompute_cell
    from rsfstudy.api.runs import rerun as rerun
    from rsfstudy.api.runs import run as run
    from rsfstudy.api.runs import studies as studies
    from rsfstudy.api.trajectory import simulate as simulate
    from rsfstudy.axes.axis import Axis as Axis
    from rsfstudy.declare.claims import Claim as Claim
    from rsfstudy.declare.figure import Figure as Figure
    from rsfstudy.declare.figure import Panel as Panel
    from rsfstudy.declare.study import Study as Study
    from rsfstudy.motion.accuracy import Accuracy as Accuracy
    from rsfstudy.plots._motion import plot_motion as plot_motion
    from rsfstudy.rig.history import history as history
    from rsfstudy.rig.history import read_protocol as read_protocol
    from rsfstudy.rig.laboratory import Rig as Rig
    from rsfstudy.rig.records import read_record as read_record
    from rsfstudy.rig.table import read_table as read_table
    from rsfstudy.slider.loading import Segment as Segment
    from rsfstudy.slider.protocol import protocol as protocol
    from rsfstudy.slider.scene import Scene as Scene

#: What each module gives. It is loaded on first use, so that a worker does not import what only its
#: driver needs.
_LAZY_EXPORTS = {
    "slider.scene": ("Scene",),
    "slider.loading": ("Segment",),
    "slider.protocol": ("protocol",),
    "rig.laboratory": ("Rig",),
    "rig.records": ("read_record",),
    "rig.table": ("read_table",),
    "api.fitting": ("fit",),
    "rig.history": ("history", "read_protocol"),
    "plots._motion": ("plot_motion",),
    "declare.study": ("Study",),
    "axes.axis": ("Axis",),
    "declare.claims": ("Claim",),
    "declare.figure": ("Figure", "Panel"),
    "motion.accuracy": ("Accuracy",),
    "api.runs": ("run", "rerun", "recompute_cell", "open", "check", "compare", "plot", "studies"),
    "api.report": ("report",),
    "api.trajectory": ("simulate",),
    "api.one_scene": ("critical_step", "limit_cycle", "to_si"),
    "api.events": ("events",),
}
_MODULE_OF = {name: module for module, names in _LAZY_EXPORTS.items() for name in names}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name in ("measures", "reduce"):  # what studies of one's own are made of
        return importlib.import_module(f"{__name__}.{name}")
    if name in RENAMED[__name__]:
        warn_renamed(name, new := RENAMED[__name__][name], __name__)
        name = new
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
