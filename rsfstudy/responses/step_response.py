"""Motion after a step: the peaks of slip rate, and the recorded path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    check_steady_loading,
    phase_outputs,
    settles_to_steady_sliding,
)
from rsfstudy.motion import (
    MOTION_VARIABLES,
    Accuracy,
    Event,
    EventKind,
    MotionStopped,
    Recording,
    WorkMeter,
    approach_to_steady_state,
    estimate_error,
    integrate_events,
    maximum,
    sample_along_path,
)
from rsfstudy.quantities import Output, Quantity
from rsfstudy.responses._recorded_motion import COINCIDENCE_FLOOR
from rsfstudy.slider import Scene
from rsfstudy.status import Status

LN10 = math.log(10.0)

#: Part of the largest distance from steady sliding at which an oscillation counts as over.
_STEADY_FRACTION = 1e-3

_OUTPUTS = (
    Output("max_log10_slip_rate", error=True),
    Output(
        "peak_ratio",
        long_name="second over first peak of ln V above the load point velocity: 1 where "
        "oscillations repeat",
    ),
    Output("peak_log10_slip_rate", dims=("peak",)),
    *phase_outputs(*MOTION_VARIABLES),
)


@guard_methods
@dataclass(frozen=True)
class StepResponse(RecordingMeasure):
    """Oscillations of slip rate after a step: peaks of log10(V/V_*) and the path.

    The motion is followed until it has the requested number of peaks, or until it settles. A motion
    has settled if the distance of ln V and the states from steady sliding is less than a thousandth
    of the largest distance. Let V_1 and V_2 be the slip rates of the first two peaks, and V_0 the
    load point velocity. ``peak_ratio`` is ln(V_2/V_0) over ln(V_1/V_0). The ratio is 1 if
    oscillations repeat, as small oscillations do at the critical stiffness, and 0 if there is no
    second peak. ``peak_log10_slip_rate`` has the shape (peaks,), with NaN for missing peaks. The
    path, in units of D_c, D_c/V_* and sigma_*, has the shape (phases,).

    Parameters
    ----------
    peaks : int
        Largest number of peaks of slip rate to follow.
    phases : int
        Number of points of the path along ``phase``, distributed over its slow parts and its
        ruptures.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196; Figs. 8 and 12 of
    doi:10.1007/s11589-014-0098-4.
    """

    peaks: int = 8
    phases: int = 2000
    name: ClassVar[str] = "step_response"
    primary_output = "max_log10_slip_rate"
    typical_work = 10_000
    outputs = _OUTPUTS
    dimensions = (Quantity("peak", "", "1", "number of the peak of slip rate after the step"),)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.peaks < 2:
            raise InvalidValue("peaks", self.peaks, "must be at least 2")

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"peak": np.arange(1, self.peaks + 1), **super().inner_coordinates}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of the largest logarithm.

        The scale includes an e-fold of slip rate, because the logarithm of V_* is zero.
        """
        return {"max_log10_slip_rate": abs(values["max_log10_slip_rate"]) + 1.0 / LN10}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Compute the peaks and the path of the motion, with error estimates.

        The errors are estimated from a second motion with smaller tolerances.
        """
        check_steady_loading(scene)
        if scene.log_load_velocity == -math.inf:
            return Outcome(Status.NO_STEADY_STATE, message="the load point is held")
        if not scene.is_perturbed:
            return Outcome(Status.NO_STEP, message="V_0 = V_* is no step")
        peaks, rows = self._follow_oscillations(scene, accuracy, meter)
        again, _rows = self._follow_oscillations(scene, accuracy.refined(), meter)
        heights = peaks - scene.log_load_velocity / LN10
        log_slip_rates = np.full(self.peaks, np.nan)
        log_slip_rates[: len(peaks)] = peaks
        return Outcome(
            Status.OK,
            {
                "max_log10_slip_rate": float(peaks.max()),
                "max_log10_slip_rate_error": estimate_error(
                    peaks.max(), again.max(), COINCIDENCE_FLOOR * accuracy.rtol
                )
                + _neglected_rise_error(scene, accuracy),
                "peak_ratio": float(heights[1] / heights[0]) if len(peaks) > 1 else 0.0,
                "peak_log10_slip_rate": log_slip_rates,
                **sample_along_path(rows, self.phases),
            },
        )

    def _follow_oscillations(
        self, scene: Scene, accuracy: Accuracy, meter: WorkMeter
    ) -> tuple[np.ndarray, np.ndarray]:
        """Follow the motion, and return the peaks of log10(V/V_*) and the record."""
        peaks: list[float] = []
        recording, asked = (
            Recording(),
            (maximum("log_slip_rate"), approach_to_steady_state(_STEADY_FRACTION)),
        )
        for event in integrate_events(
            scene, accuracy, meter, asked, with_time=True, recording=recording
        ):
            if event.kind is EventKind.MAXIMUM or _has_initial_maximum(scene, event):
                peaks.append(event.point.log_slip_rate / LN10)
            settles = event.kind is EventKind.SETTLED and settles_to_steady_sliding(scene)
            if settles and not peaks:
                text = "slip rate has no maximum: it changes steadily to that of the load point"
                raise MotionStopped(Status.NOT_APPLICABLE, text)
            if len(peaks) == self.peaks or settles:
                return np.array(peaks), recording.table(scene, until=event)
        raise AssertionError("a motion never ends by itself")


def _has_initial_maximum(scene: Scene, event: Event) -> bool:
    """Return True if the slip rate has a maximum at the start due to inertia.

    If the motion starts on the slow manifold, the initial rise of the slip rate is a jump. The rise
    is followed only if the tolerance requires it.
    """
    return (
        _delays_initial_rise(scene)
        and event.kind is EventKind.START
        and event.point.log_slip_rate_derivative <= 0.0
    )


def _neglected_rise_error(scene: Scene, accuracy: Accuracy) -> float:
    """Return the error of log10(V/V_*) due to a rise that is not followed."""
    slip = accuracy.max_remaining_slip if _delays_initial_rise(scene) else 0.0
    return (1.0 + scene.stiffness / scene.a) * slip / LN10


def _delays_initial_rise(scene: Scene) -> bool:
    """Return True if inertia delays an initial rise of the slip rate from V_*."""
    return scene.has_mass and (scene.starts_unsteady or scene.spring_stress_step > 0.0)
