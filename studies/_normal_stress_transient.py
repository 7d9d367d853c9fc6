"""Transient of friction after a step in normal stress while the load point moves.

The evaluation follows Linker and Dieterich (1992).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import (
    RecordingMeasure,
    check_loading_changes_stress_only_in_steps,
    create_outputs_along_phase,
)
from rsfstudy.measure_base._recording_measure import VARIABLES_RECORDED_ALONG_PHASE
from rsfstudy.measures import Outcome, Output, Status
from rsfstudy.motion import Accuracy, Event, Integrator, MotionRecorder, resample_motion_along_path
from rsfstudy.responses import compute_settled_friction_flag, estimate_errors_at_instants

#: Fraction of the record over which friction must be constant. This part is the end of the record.
#: The second value is the tolerance of this condition, relative to the transient that remains at
#: the slip ``fit_from``.
_FINAL_SHARE, _FINAL_FRICTION_RTOL = 0.1, 0.01
#: Largest allowed value of |ln(V/V_*)| at the slip ``fit_from``. If the value is smaller, spring
#: stress has followed the change of strength.
_SPRING_RESPONSE_LOG_RATE = math.log(2.0)
#: Maximum number of iterations that find the time at which slip reaches a prescribed value. The
#: second value is the smallest ln(V/V_*) in these iterations.
_MAX_EXTENSIONS, _MIN_LOG_SLIP_RATE = 3, -600.0
#: Largest immediate change of friction, relative to mu_*, that is attributed to rounding errors.
_NEGLIGIBLE_DIRECT_CHANGE = 10.0 * Accuracy.RELATIVE_ROUNDING_ERROR

_OUTPUTS = (
    Output(
        "apparent_alpha",
        r"$\alpha$",
        "1",
        "apparent normal stress effect on the state variable",
        error=True,
    ),
    Output(
        "apparent_slip_distance",
        "$D_c$",
        "1",
        "apparent slip distance over which the friction transient decays to 1/e",
        "D_c",
        error=True,
    ),
    Output(
        "evolution_left",
        r"$\Delta\mu(D_c)/\Delta\mu(0)$",
        "1",
        "transient after a slip of D_c, as a fraction of the direct change",
        error=True,
    ),
    Output(
        "direct_change",
        r"$\Delta\mu(0)$",
        "1",
        "immediate change of friction minus the direct effect of slip rate",
    ),
    Output(
        "settled",
        "",
        "1",
        "1 if friction has reached the steady state at the end of the record, otherwise 0",
    ),
    Output(
        "closed_form_departure",
        "",
        "1",
        "largest difference of the measured friction from the friction of a stiff slider",
    ),
    *create_outputs_along_phase(*VARIABLES_RECORDED_ALONG_PHASE),
)


class _TransientRecord(NamedTuple):
    """Record after a step of normal stress.

    Attributes
    ----------
    begin : Event
        Beginning of the record, immediately after the step.
    rows : ndarray
        Recorded samples.
    friction : mapping of float to float
        Mapping from slip to the friction at this slip. The mapping is empty if the spring stress
        has not followed the change of strength at the first slip.
    """

    begin: Event
    rows: np.ndarray
    friction: Mapping[float, float]

    @property
    def final_friction(self) -> float:
        """Friction at the end of the record."""
        return float(MotionRecorder.get_friction_coefficient(self.rows[-1:])[0])

    def remaining_transient(self, slip: float) -> float:
        """Return the part of the friction transient that remains at a given slip.

        Parameters
        ----------
        slip : float
            Slip since the step in D_c.

        Returns
        -------
        float
            Friction at the slip minus friction at the end of the record. The value is NaN if
            friction was not read at this slip.
        """
        return self.friction.get(slip, math.nan) - self.final_friction


@dataclass(frozen=True)
class NormalStressTransient(RecordingMeasure):
    r"""Transient of friction after a step of imposed normal stress.

    The load point moves at :math:`V_*` throughout, and normal stress changes by a factor :math:`r`.
    An exponential function is fitted to the remaining transient at two slips. The slip distance
    follows from the decay of this function. The size of the transient is extrapolated to the time
    of the step. The apparent :math:`\alpha` is the extrapolated size of the transient divided by
    :math:`-\ln r`.

    The transient of a rigid slider after a slip :math:`\delta` is

    .. math::

        -\alpha \ln r \; e^{-\delta/D_c} \quad \text{(slip law)}, \qquad
        b \ln\left[1 + \left(r^{-\alpha/b} - 1\right) e^{-\delta/D_c}\right]
        \quad \text{(slowness law)}.

    The apparent :math:`\alpha` therefore equals the parameter :math:`\alpha` only under the slip
    law.

    Parameters
    ----------
    fit_from : float, default: 0.5
        Slip since the step, in D_c, at the first of the two points of the exponential fit. At this
        slip, the spring must have followed the change of strength, so that the slip rate differs
        from V_* by less than a factor of two.
    fit_to : float, default: 1.5
        Slip since the step, in D_c, at the second of the two points of the exponential fit.
    record : float, default: 30.0
        Load point displacement over which friction is recorded, in D_c. Friction at the end of the
        record is regarded as steady.
    phases : int, default: 300
        Number of samples of the record along ``phase``.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """

    fit_from: float = 0.5
    fit_to: float = 1.5
    record: float = 30.0
    phases: int = 300
    name: ClassVar[str] = "normal_stress_transient"
    primary_output = "apparent_alpha"
    typical_rhs_evaluations = 4_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        if not 0.0 < self.fit_from < self.fit_to:
            rule = "must be greater than 0 and less than fit_to"
            raise InvalidValue("fit_from", self.fit_from, rule)
        if not self.fit_to + 1.0 <= self.record < math.inf:
            rule = "must exceed fit_to by at least 1 D_c, and must be finite"
            raise InvalidValue("record", self.record, rule)

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scales of the numerical errors.

        The scale of a result is ``abs(result) * (1 + a / transient)``, where ``a`` is the parameter
        of the direct effect and ``transient`` is the transient that remains at the second point of
        the exponential fit. A larger relative error is therefore permitted if the transient is
        small.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        values : mapping
            Results, keyed by name.

        Returns
        -------
        mapping
            Error scale of each result.
        """
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        distance = values["apparent_slip_distance"]
        size = abs(values["apparent_alpha"] * math.log(ratio)) * math.exp(-self.fit_to / distance)
        part = 1.0 + scene.a / max(size, Accuracy.RELATIVE_ROUNDING_ERROR * scene.a)
        names = ("apparent_alpha", "apparent_slip_distance", "evolution_left")
        return {name: part * abs(values[name]) for name in names}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the transient, and estimate its errors from a second motion.

        The second motion is integrated with smaller tolerances.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure.
        """
        check_loading_changes_stress_only_in_steps(scene)
        step = scene.parts.loading.segments[0]
        if not step.normal_stress:
            return Outcome(Status.NO_STEP, message="normal stress does not change suddenly")
        why = self._reason_not_readable(scene)
        if why:
            return Outcome(Status.NOT_APPLICABLE, message=why)
        record = self._record_motion(scene, integrator)
        again = self._record_motion(scene, integrator.refined())
        if record is None or again is None:
            why = f"slip does not reach {max(self.fit_to, 1.0):g} D_c, where friction is measured"
            return Outcome(Status.NOT_APPLICABLE, message=f"{why}, within record = {self.record:g}")
        shown = self._record_outputs(scene, record)
        values, refined = self._read_outputs(scene, record), self._read_outputs(scene, again)
        if not values or not refined:
            span = f"{self.fit_from:g} to {self.fit_to:g} D_c of slip"
            why = f"between {span}, friction does not decay, or is affected by loading or unloading"
            return Outcome(Status.NOT_APPLICABLE, shown, why)
        errors = estimate_errors_at_instants(
            values,
            refined,
            self._sensitivities_to_friction(scene, record, values),
            scene,
            integrator,
        )
        direct = _direct_change(scene, record)
        if abs(direct) <= _NEGLIGIBLE_DIRECT_CHANGE * scene.mu_star:
            why = "friction does not change suddenly, so the remaining fraction is not defined"
            del values["evolution_left"], errors["evolution_left_error"]
            return Outcome(Status.NOT_APPLICABLE, {**values, **errors, **shown}, why)
        rounded = Accuracy.RELATIVE_ROUNDING_ERROR * scene.mu_star / abs(direct)
        errors["evolution_left_error"] += rounded * abs(values["evolution_left"])
        return Outcome(Status.OK, {**values, **errors, **shown})

    def _reason_not_readable(self, scene: Scene) -> str:
        """Return the reason why the transient cannot be evaluated, or an empty string."""
        step, coupling = scene.parts.loading.segments[0], scene.parts.normal_stress.coupling
        if step.load_velocity != 1.0 or step.displacement:
            return "the load point velocity is not V_* after the step"
        if coupling is None or coupling[0] or scene.part_changing_effective_stress.unknowns:
            return "effective normal stress depends on shear stress or pore pressure"
        if step.duration < self.record:
            return "normal stress changes during the record"
        return ""

    def _record_motion(self, scene: Scene, integrator: Integrator) -> _TransientRecord | None:
        """Record the motion.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        _TransientRecord or None
            Record of the motion. The value is None if slip does not reach the values at which
            friction is read.
        """
        recording = MotionRecorder()
        begin, *_others = integrator.follow(
            scene, with_time=True, recording=recording, until=self.record
        )
        rows = recording.as_table(scene)
        slip = rows[:, MotionRecorder.MOTION_VARIABLE_NAMES.index("slip")]
        if slip.max() < max(self.fit_to, 1.0):
            return None
        rate = rows[:, MotionRecorder.MOTION_VARIABLE_NAMES.index("log10_slip_rate")]
        taken_up = (
            abs(np.interp(self.fit_from, slip, rate)) * math.log(10.0) <= _SPRING_RESPONSE_LOG_RATE
        )
        return _TransientRecord(
            begin, rows, self._friction_at_slips(scene, rows, integrator) if taken_up else {}
        )

    def _friction_at_slips(
        self, scene: Scene, rows: np.ndarray, integrator: Integrator
    ) -> dict[float, float]:
        """Compute friction at the values of slip that the measure uses.

        The recorded rows give an estimate of the time at which a given slip is reached. The motion
        is integrated to this time, and the slip rate at the end is used to correct the time.
        Friction is not interpolated between integration steps.
        """
        found, elapsed, slipped = dict[float, float](), 0.0, 0.0
        stepped, start = scene.segment_scene(0), None
        stress = 1.0 + scene.parts.loading.segments[0].normal_stress
        for slip in sorted({self.fit_from, 1.0, self.fit_to}):
            wait = (
                float(
                    np.interp(
                        slip,
                        rows[:, MotionRecorder.MOTION_VARIABLE_NAMES.index("slip")],
                        rows[:, 0],
                    )
                )
                - elapsed
            )
            for _ in range(_MAX_EXTENSIONS):
                if 0.0 < wait <= self.record - elapsed:
                    *_earlier, end = integrator.follow(stepped, start=start, until=wait)
                    elapsed, slipped, start = elapsed + end.time, slipped + end.slip, end.point
                log_slip_rate = max(end.point.log_slip_rate, _MIN_LOG_SLIP_RATE)
                wait = (slip - slipped) / math.exp(log_slip_rate)
            # Spring stress increases by K (V_0/V - 1) per unit slip.
            pulled = scene.stiffness * math.expm1(-log_slip_rate) / stress
            found[slip] = end.point.apparent_friction + pulled * (slip - slipped)
        return found

    def _read_outputs(self, scene: Scene, record: _TransientRecord) -> dict[str, float]:
        """Compute the results from the record.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        record : _TransientRecord
            Record of the motion.

        Returns
        -------
        dict
            Results by name. The dictionary is empty if the spring stress has not followed the
            change of strength, or if the remaining transient does not decay exponentially.
        """
        first, last = (
            record.remaining_transient(self.fit_from),
            record.remaining_transient(self.fit_to),
        )
        if not first or not 0.0 < last / first < 1.0:
            return {}
        distance = (self.fit_to - self.fit_from) / math.log(first / last)
        size = first * math.exp(self.fit_from / distance)
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        direct = _direct_change(scene, record)
        return {
            "apparent_alpha": -size / math.log(ratio),
            "apparent_slip_distance": distance,
            "evolution_left": record.remaining_transient(1.0) / direct if direct else math.nan,
        }

    def _sensitivities_to_friction(
        self, scene: Scene, record: _TransientRecord, values: Mapping[str, float]
    ) -> dict[str, float]:
        """Return the derivatives of the results with respect to friction.

        The measure evaluates friction at four points: at the slips ``fit_from``, ``fit_to`` and
        D_c, and at the end of the record. The results depend on differences between two values of
        friction. The derivatives contain a factor of two, because each of the two values may have
        an error.
        """
        first, last = (
            abs(record.remaining_transient(self.fit_from)),
            abs(record.remaining_transient(self.fit_to)),
        )
        distance, direct = values["apparent_slip_distance"], _direct_change(scene, record)
        longer = distance * distance / (self.fit_to - self.fit_from) * (1.0 / first + 1.0 / last)
        larger = 1.0 / first + self.fit_from * longer / (distance * distance)
        return {
            "apparent_alpha": 2.0 * values["apparent_alpha"] * larger,
            "apparent_slip_distance": 2.0 * longer,
            "evolution_left": 2.0 / direct if direct else math.nan,
        }

    def _record_outputs(
        self, scene: Scene, record: _TransientRecord
    ) -> dict[str, float | np.ndarray]:
        """Return the recorded variables, and the results that need no exponential fit."""
        rows, friction = record.rows, MotionRecorder.get_friction_coefficient(record.rows)
        late = rows[:, 0] >= (1.0 - _FINAL_SHARE) * self.record
        is_flat = bool(
            np.ptp(friction[late])
            < _FINAL_FRICTION_RTOL * abs(record.remaining_transient(self.fit_from))
        )
        path = resample_motion_along_path(rows, self.phases, MotionRecorder.RECORDED_VARIABLE_NAMES)
        return {
            "direct_change": _direct_change(scene, record),
            "settled": compute_settled_friction_flag(
                scene.segment_scene(-1), is_friction_constant=is_flat
            ),
            "closed_form_departure": self._departure_from_rigid(scene, record),
            "time": path["time"],
            "load_point_displacement": path["time"],
            "slip": path["slip"],
            "friction_coefficient": path["friction_coefficient"],
            "normal_stress_ratio": path["normal_stress_ratio"],
            "log10_slip_rate": path["log10_slip_rate"],
        }

    def _departure_from_rigid(self, scene: Scene, record: _TransientRecord) -> float:
        r"""Compute the largest difference between friction and the closed form for a rigid slider.

        The closed form of a rigid slider is :math:`b\,R(-(\alpha/b) \ln r, \delta)`, where
        :math:`R` is the relaxation function of the law. The difference is evaluated at all slips
        larger than ``fit_from``.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        record : _TransientRecord
            Record of the motion.

        Returns
        -------
        float
            Largest absolute difference. The value is NaN if the law provides no closed form.
        """
        law, coupling = scene.parts.law, scene.parts.normal_stress.coupling
        if law.state_relaxation_function is None or law.depends_on_stress or coupling is None:
            return math.nan
        slip = record.rows[:, MotionRecorder.MOTION_VARIABLE_NAMES.index("slip")]
        read = slip >= self.fit_from
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        # If b is zero, alpha is zero too, and friction does not evolve.
        away = -coupling[1] / scene.b * math.log(ratio) if scene.b else 0.0
        left = np.array([law.state_relaxation_function(away, at) for at in slip[read].tolist()])
        seen = MotionRecorder.get_friction_coefficient(record.rows[read]) - scene.mu_star
        return float(np.abs(seen - scene.b * left).max())


def _direct_change(scene: Scene, record: _TransientRecord) -> float:
    """Compute the immediate change of friction without the direct effect."""
    point = record.begin.point
    return point.friction_coefficient - scene.mu_star - scene.a * point.log_slip_rate
