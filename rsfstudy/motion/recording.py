"""What is recorded along a motion, from its events."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rsfstudy.motion.events import Event
from rsfstudy.slider.scene import Scene

#: What is recorded, in this order.
OBSERVED = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "frictional_stress",
    "normal_stress_ratio",
    "state_variable",
)
#: Samples within each integration step of a recorded motion: enough for a smooth curve.
SAMPLES = 4


def observed(scene: Scene, event: Event) -> tuple[float, ...]:
    """The quantities of `OBSERVED` at an event."""
    point = event.point
    return (
        event.time,
        event.slip,
        point.log_rate / math.log(10.0),
        scene.mu_star + point.spring,
        scene.mu_star + point.friction,
        point.normal_stress,
        point.state,
    )


def along_path(rows: Sequence[tuple[float, ...]], points: int) -> dict[str, np.ndarray]:
    """Recorded rows at points spread evenly along the path, half by its length in time, ln V and
    stress, half by the steps the integrator took, which are short where the path bends.
    """
    table = np.array(rows)
    table = table[np.append(True, (np.diff(table, axis=0) != 0.0).any(axis=1))]
    seen = table[:, [OBSERVED.index(n) for n in ("time", "log10_slip_rate", "shear_stress")]]
    spread = np.ptp(seen, axis=0)
    strides = np.abs(np.diff(seen, axis=0) / np.where(spread > 0.0, spread, 1.0)).sum(axis=1)
    strides = strides / strides.sum() + 1.0 / len(strides)
    path = np.concatenate([[0.0], np.cumsum(strides)])
    at = np.linspace(0.0, path[-1], points)
    return {name: np.interp(at, path, table[:, i]) for i, name in enumerate(OBSERVED)}
