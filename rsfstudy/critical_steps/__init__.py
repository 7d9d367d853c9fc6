"""Critical steps: the smallest load steps that trigger an instability.

The package contains the measures ``CriticalStep`` and ``Triggered`` and the algorithms that the
measures use: the critical path, the motion after a step, and a shooting method. The package never
computes limit cycles, and never reads or writes a file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.critical_steps.critical_step import CriticalStep
    from rsfstudy.critical_steps.triggered_instability import Triggered
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "critical_steps.critical_step": ("CriticalStep",),
            "critical_steps.triggered_instability": ("Triggered",),
        },
    )

__all__ = [
    "CriticalStep",
    "Triggered",
]
