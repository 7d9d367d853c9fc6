"""Measure that records the motion after a step and finds the peaks of the slip rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    check_loading_changes_stress_only_in_steps,
    create_outputs_along_phase,
    is_steady_sliding_linearly_stable,
)
from rsfstudy.motion import (
    Event,
    EventKind,
    Integrator,
    MotionRecorder,
    MotionStopped,
    approach_to_steady_state,
    maximum,
    resample_motion_along_path,
)
from rsfstudy.quantities import Output, Quantity
from rsfstudy.responses._recorded_motion import ERROR_FLOOR_OVER_RTOL
from rsfstudy.slider import Scene
from rsfstudy.status import Status

LN10 = math.log(10.0)

#: An oscillation has ended if the distance from steady sliding is less than this fraction of the
#: largest distance from steady sliding during the motion.
_SETTLED_DISTANCE_OVER_MAX_DISTANCE = 1e-3

_STEP_RESPONSE_OUTPUTS = (
    Output("max_log10_slip_rate", error=True),
    Output(
        "peak_ratio",
        long_name="second peak of ln(V/V_0) divided by the first peak; 1 if the oscillation "
        "repeats itself",
    ),
    Output("peak_log10_slip_rate", dims=("peak",)),
    *create_outputs_along_phase(*MotionRecorder.MOTION_VARIABLE_NAMES),
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class StepResponse(RecordingMeasure):
    """Peaks of the slip rate after a step, and the recorded path of the motion.

    The motion is integrated until it has the requested number of peaks, or until it settles. A
    motion is considered settled if its distance from steady sliding (in ln V and the states) is
    less than a thousandth of the largest such distance during the motion. The results include the
    peaks of log10(V/V_*). The values of missing peaks are NaN. ``peak_log10_slip_rate`` has the
    shape (peaks,).

    ``peak_ratio`` is the height of the second peak divided by the height of the first peak. The
    height of a peak is ln V at the peak minus the logarithm of the load point velocity.
    ``peak_ratio`` is 1 if the amplitude of the oscillations is constant, for example in small
    oscillations at the critical stiffness. ``peak_ratio`` is 0 if there is no second peak. The
    quantities along the path have the shape (phases,), and are in units of D_c, D_c/V_* and
    sigma_*.

    Parameters
    ----------
    peaks : int, default: 8
        Maximum number of slip rate peaks.
    phases : int, default: 2000
        Number of points of the path along ``phase``, distributed over slow parts and ruptures of
        the motion.

    Raises
    ------
    InvalidValue
        If ``peaks`` or ``phases`` is less than 2.

    Notes
    -----
    Gu et al. [1]_ analyse the oscillations in the phase plane. Figs. 8 and 12 of [2]_ show motions
    after steps of load point velocity.

    References
    ----------
    .. [1] Gu, J.-C., Rice, J. R., Ruina, A. L., & Tse, S. T. (1984). Slip motion and stability of a
       single degree of freedom elastic system with rate and state dependent friction. J. Mech.
       Phys. Solids, 32, 167-196.
    .. [2] Effect of varying normal stress on stability and dynamic motion of a spring-slider system
       with rate- and state-dependent friction. Earthquake Science (2014).
       doi:10.1007/s11589-014-0098-4

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import StepResponse
    >>> scene = Scene(normal_stress="constant", load_velocity_ratio=1.1, stiffness_ratio=1.1)
    >>> outcome = StepResponse(peaks=2)(scene, Accuracy(rtol=1e-5))
    >>> outcome.values["peak_log10_slip_rate"].round(4).tolist()
    [0.0973, 0.0826]
    >>> round(outcome.values["peak_ratio"], 3)
    0.737
    """

    peaks: int = 8
    phases: int = 2000
    name: ClassVar[str] = "step_response"
    primary_output = "max_log10_slip_rate"
    typical_rhs_evaluations = 10_000
    outputs = _STEP_RESPONSE_OUTPUTS
    dimensions = (Quantity("peak", "", "1", "number of the peak of slip rate after the step"),)

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        super().__post_init__()
        if self.peaks < 2:
            raise InvalidValue("peaks", self.peaks, "must be at least 2")

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Values of the coordinates ``peak`` (peak numbers, counted from 1) and ``phase``."""
        return {"peak": np.arange(1, self.peaks + 1), **super().output_coordinates}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of the highest peak.

        The scale is the absolute value plus log10(e), which corresponds to an increase of the slip
        rate by a factor of e. The absolute value is not sufficient, because the logarithm of V/V_*
        may be zero.

        Parameters
        ----------
        scene : Scene
            Scene of the computation.
        values : mapping of str to float or ndarray
            Results by name.

        Returns
        -------
        mapping of str to float
            Scales by name of the result.
        """
        return {"max_log10_slip_rate": abs(values["max_log10_slip_rate"]) + 1.0 / LN10}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the peaks and the path of the motion, and error estimates.

        The motion is computed twice, with the requested accuracy and with smaller tolerances. The
        difference between the two runs determines the error estimate.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        check_loading_changes_stress_only_in_steps(scene)
        if scene.log_load_velocity == -math.inf:
            return Outcome(Status.NO_STEADY_STATE, message="the load point is held")
        if not scene.is_perturbed:
            return Outcome(Status.NO_STEP, message="V_0 is equal to V_*, so there is no step")
        peaks, rows = self._integrate_and_record_oscillations(scene, integrator)
        again, _rows = self._integrate_and_record_oscillations(scene, integrator.refined())
        heights = peaks - scene.log_load_velocity / LN10
        log_slip_rates = np.full(self.peaks, np.nan)
        log_slip_rates[: len(peaks)] = peaks
        return Outcome(
            Status.OK,
            {
                "max_log10_slip_rate": float(peaks.max()),
                "max_log10_slip_rate_error": integrator.estimate_error(
                    peaks.max(), again.max(), ERROR_FLOOR_OVER_RTOL
                )
                + _compute_neglected_slip_rate_rise_error(scene, integrator),
                "peak_ratio": float(heights[1] / heights[0]) if len(peaks) > 1 else 0.0,
                "peak_log10_slip_rate": log_slip_rates,
                **resample_motion_along_path(rows, self.phases),
            },
        )

    def _integrate_and_record_oscillations(
        self, scene: Scene, integrator: Integrator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integrate the motion, and return its peaks and the record."""
        peaks: list[float] = []
        recording, asked = (
            MotionRecorder(),
            (
                maximum("log_slip_rate"),
                approach_to_steady_state(_SETTLED_DISTANCE_OVER_MAX_DISTANCE),
            ),
        )
        for event in integrator.follow(scene, asked, with_time=True, recording=recording):
            if event.kind is EventKind.MAXIMUM or _does_slip_rate_peak_at_start(scene, event):
                peaks.append(event.point.log_slip_rate / LN10)
            settles = event.kind is EventKind.SETTLED and is_steady_sliding_linearly_stable(scene)
            if settles and not peaks:
                text = (
                    "the slip rate has no maximum, because it approaches the load point "
                    "velocity monotonically"
                )
                raise MotionStopped(Status.NOT_APPLICABLE, text)
            if len(peaks) == self.peaks or settles:
                return np.array(peaks), recording.as_table(scene, end_event=event)
        raise AssertionError("a motion without a time limit cannot end")


def _does_slip_rate_peak_at_start(scene: Scene, event: Event) -> bool:
    """Return True if the motion starts with a maximum of slip rate.

    If the scene has inertia, the slip rate may rise within the inertial time after the step. If the
    initial rise is not integrated, the start of the motion is a maximum of slip rate.
    """
    return (
        _does_inertia_delay_initial_slip_rate_rise(scene)
        and event.kind is EventKind.START
        and event.point.log_slip_rate_derivative <= 0.0
    )


def _compute_neglected_slip_rate_rise_error(scene: Scene, integrator: Integrator) -> float:
    """Return the error of log10(V/V_*) caused by an initial rise of slip rate.

    The error is zero unless inertia delays the initial rise of slip rate.
    """
    slip = (
        integrator.accuracy.max_slip_in_return_to_slow_manifold
        if _does_inertia_delay_initial_slip_rate_rise(scene)
        else 0.0
    )
    return (1.0 + scene.stiffness / scene.a) * slip / LN10


def _does_inertia_delay_initial_slip_rate_rise(scene: Scene) -> bool:
    """Return True if inertia delays an initial rise of slip rate."""
    return scene.has_mass and (scene.starts_unsteady or scene.spring_stress_step > 0.0)
