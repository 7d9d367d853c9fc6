"""Parameter studies of a spring-slider with rate- and state-dependent friction.

Named studies, and studies of your own, are declared as labelled dimensions over a scene, computed
over a lattice by Dask workers, and land as self-describing NetCDF datasets that are reduced to
boundaries and scaling slopes.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rsfstudy.api.events import events
    from rsfstudy.api.fitting import fit
    from rsfstudy.api.one_scene import critical_step, limit_cycle, to_si
    from rsfstudy.api.report import report
    from rsfstudy.api.runs import cell, check, compare, open, plot, rerun, run, studies
    from rsfstudy.api.trajectory import simulate
    from rsfstudy.declare.axis import Axis
    from rsfstudy.declare.study import Study
    from rsfstudy.plots._motion import picture
    from rsfstudy.rig.history import history
    from rsfstudy.rig.laboratory import Laboratory
    from rsfstudy.rig.protocol_file import read_protocol
    from rsfstudy.rig.records import read_record
    from rsfstudy.rig.table import read_table
    from rsfstudy.slider.loading import Segment
    from rsfstudy.slider.protocol import protocol
    from rsfstudy.slider.scene import Scene

# loaded on first use, so that a worker does not import what only its driver needs
_HOMES = {
    "Scene": "slider.scene",
    "Segment": "slider.loading",
    "protocol": "slider.protocol",
    "Laboratory": "rig.laboratory",
    "read_protocol": "rig.protocol_file",
    "read_record": "rig.records",
    "read_table": "rig.table",
    "fit": "api.fitting",
    "history": "rig.history",
    "picture": "plots._motion",
    "Study": "declare.study",
    "Axis": "declare.axis",
    "run": "api.runs",
    "rerun": "api.runs",
    "cell": "api.runs",
    "open": "api.runs",
    "check": "api.runs",
    "compare": "api.runs",
    "report": "api.report",
    "plot": "api.runs",
    "studies": "api.runs",
    "simulate": "api.trajectory",
    "critical_step": "api.one_scene",
    "limit_cycle": "api.one_scene",
    "to_si": "api.one_scene",
    "events": "api.events",
}

__all__ = [
    "Axis",
    "Laboratory",
    "Scene",
    "Segment",
    "Study",
    "cell",
    "check",
    "compare",
    "critical_step",
    "events",
    "fit",
    "history",
    "limit_cycle",
    "open",
    "picture",
    "plot",
    "protocol",
    "read_protocol",
    "read_record",
    "read_table",
    "report",
    "rerun",
    "run",
    "simulate",
    "studies",
    "to_si",
]


def __getattr__(name: str) -> Any:
    if name in ("measures", "reduce"):  # what studies of one's own are made of
        return importlib.import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
