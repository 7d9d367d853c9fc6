"""Limit cycle of stick-slip: recurrence interval, stress drops and slip rates.

A cycle extends from one maximum of spring stress to the next maximum. At a maximum of spring
stress, the slip rate V rises through the load point velocity V_0. The return map computes the
spring stress and the states at a maximum of spring stress from the values at the previous maximum.
The limit cycle is the fixed point of the return map.

The motion is first integrated with a low accuracy until it approaches the limit cycle. The orbit is
then refined until all unknowns have the same values at both ends of the orbit. The refinement is
done twice, first with the requested accuracy and then with smaller tolerances. The first cycle
after the loading step is never accepted as the limit cycle.

If the law or the fluid has several states, the motion may repeat only after 2, 4 or more cycles, or
never. If the motion repeats after several cycles, the results describe the cycle with the highest
slip rate, and the recorded orbit covers the whole period. If the motion never repeats, there are no
results.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.limit_cycles.limit_cycle_search import (
    LimitCycleSearch,
    StickSlipSequence,
    follow_motion_to_periodic_orbit,
)
from rsfstudy.limit_cycles.return_map import PeriodicOrbit, ReturnMap
from rsfstudy.limit_cycles.stick_slip_cycles import (
    LN10,
    StickSlipCycle,
    extract_recorded_rows_of_cycles,
    suggest_raising_event_limit,
)
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    check_loading_changes_stress_only_in_steps,
    create_outputs_along_phase,
)
from rsfstudy.motion import (
    Accuracy,
    Integrator,
    MotionRecorder,
    MotionStopped,
    resample_motion_along_path,
)
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Minimum error estimate of a result, divided by the requested relative accuracy. The minimum is
#: necessary because two runs may have the same error by chance.
_MIN_ESTIMATED_ERROR_OVER_RTOL = 0.06
#: Displacement of the load point that starts a motion if the scene has no step, in units of D_c.
INITIAL_PERTURBATION_DISPLACEMENT = 0.1
#: Number of recorded points if only the two ends of an orbit are stored.
_POINT_COUNT_IF_ONLY_ENDS_ARE_STORED = 2
#: Relative accuracy of the search for the limit cycle. After the search, the orbit is refined to
#: the requested accuracy.
_CYCLE_SEARCH_RTOL = 1e-4

_PRIMARY_OUTPUT_NAMES = (
    "recurrence_interval",
    "static_stress_drop",
    "dynamic_stress_drop",
    "min_log10_slip_rate",
    "max_log10_slip_rate",
)
#: Index of the peak slip rate in the main results.
INDEX_OF_PEAK_SLIP_RATE_OUTPUT = 4

#: Number of events after which a motion repeats itself.
EVENTS_PER_PERIOD_OUTPUT = Output(
    "period_events", "", "1", "number of events after which a motion repeats itself"
)
#: Final behaviour of a slider. In the first two modes, the motion settles to steady sliding,
#: without or with oscillations. In the last two modes, the motion repeats in cycles, with a peak
#: slip rate below or above a limit.
SLIP_MODE_NAMES = ("steady", "damped_oscillation", "slow_slip", "stick_slip")
_STEADY_CODE, _DAMPED_OSCILLATION_CODE, _SLOW_SLIP_CODE, _STICK_SLIP_CODE = map(
    float, range(len(SLIP_MODE_NAMES))
)
_LIMIT_CYCLE_OUTPUTS = (
    *(Output(name, error=True) for name in _PRIMARY_OUTPUT_NAMES),
    Output("slip_per_event"),
    Output(
        "healing_exponent",
        "",
        "1",
        "exponent of theta in the slip rate, from arrest to the minimum slip rate; only for laws "
        "with one state",
    ),
    Output("residual_friction"),
    Output(
        "drop_asymmetry",
        "",
        "1",
        "stress drop during acceleration divided by stress drop during deceleration",
    ),
    EVENTS_PER_PERIOD_OUTPUT,
    Output(
        "events_until_repeat",
        "",
        "1",
        "number of the first cycle that is equal to the previous cycle",
    ),
    Output("work_per_cycle", "", "1", "right-hand side evaluations of the accepted cycle"),
    Output(
        "slip_mode",
        "",
        "",
        "long-term behaviour of the slider, classified by the peak slip rate",
        flags=SLIP_MODE_NAMES,
    ),
    *create_outputs_along_phase(*MotionRecorder.MOTION_VARIABLE_NAMES),
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class LimitCycle(RecordingMeasure):
    r"""Limit cycle of stick-slip under a constant load point velocity.

    The results include the recurrence interval, the stress drops and the extremes of slip rate. If
    a motion with several states repeats only after several events (output ``period_events``), the
    results describe the event with the highest slip rate. If the motion never repeats, the status
    is ``not_periodic``, and the message reports the ranges of the peak slip rates and the
    recurrence intervals.

    The output ``slip_mode`` is ``stick_slip`` if the peak slip rate of the cycle reaches a limit
    that depends on the scene (see Notes), and ``slow_slip`` if the peak slip rate is lower. If a
    motion settles with decaying oscillations, ``slip_mode`` is ``damped_oscillation``. If a motion
    settles without oscillations, ``slip_mode`` is ``steady``.

    The status is ``no_limit_cycle`` only if small perturbations of steady sliding decay. If a
    motion approaches steady sliding and the largest growth rate of small perturbations is zero
    within its error, the status is ``unverified``. The status is also ``unverified`` if an error
    estimate is more than a hundred times the requested error. If a motion has not repeated after
    the maximum number of events (``events``) but may still approach a periodic orbit, the status is
    ``work_budget_spent``. At the critical stiffness, oscillations neither grow nor decay, so the
    status may be either ``unverified`` or ``work_budget_spent``.

    Parameters
    ----------
    phases : int, default: 400
        Number of points of the orbit along ``phase``, distributed over the slow part and the
        rupture.
    events : int, default: 300
        Maximum number of events until the motion repeats. If you increase the work budget, this
        limit remains the same.

    Raises
    ------
    InvalidValue
        If ``events`` is not a positive integer, or if ``phases`` is less than 2.

    Notes
    -----
    With radiation damping, the limit of the peak slip rate is :math:`a \sigma_*/\eta`. At the slip
    rate :math:`a \sigma_*/\eta`, a small change in slip rate changes the radiated stress and the
    direct effect of friction by the same amount. Without radiation damping, the limit is the slip
    rate at the instability norm. If this slip rate is below the load point velocity, as it may be
    for laboratory machines with small periods, ``slip_mode`` is ``stick_slip`` for every cycle. To
    use another limit, call ``dataset.rsf.slip_mode(limit)``. A motion settles with oscillations if
    the slowest-decaying perturbations of steady sliding have complex eigenvalues.

    The error estimates are based on two computations of the cycle with different tolerances. The
    error estimates also include the correction of each result for the closure error, which is the
    difference between the two ends of the orbit.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import LimitCycle
    >>> scene = Scene(normal_stress="constant", stiffness_ratio=0.8, radiation_damping=1e-3)
    >>> outcome = LimitCycle(phases=2)(scene, Accuracy(rtol=1e-4))
    >>> round(outcome.values["recurrence_interval"], 3)
    9.061
    """

    phases: int = 400
    events: int = 300
    name: ClassVar[str] = "limit_cycle"
    #: Values of ``slip_mode``, in the order of their codes.
    SLIP_MODE_NAMES: ClassVar = SLIP_MODE_NAMES
    primary_output = "recurrence_interval"
    typical_rhs_evaluations = 9_000
    outputs = _LIMIT_CYCLE_OUTPUTS

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        super().__post_init__()
        if isinstance(self.events, bool) or not self.events >= 1 or self.events % 1:
            raise InvalidValue("events", self.events, "must be a whole number, 1 or more")

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the limit cycle and its error estimates.

        The motion is integrated until it approaches the limit cycle. The cycle is then computed
        twice, with the requested accuracy and with smaller tolerances.

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
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if not scene.is_perturbed:
            # Without a step, the slider would remain in steady sliding, even if steady sliding is
            # unstable.
            scene = scene.with_segment(Segment(1.0, INITIAL_PERTURBATION_DISPLACEMENT))
        if scene.state_count > 1:
            return self._find_cycle_of_multi_state_scene(scene, integrator)
        for own in dict.fromkeys((integrator.loosened_to(_CYCLE_SEARCH_RTOL), integrator)):
            approach = LimitCycleSearch(scene, own)
            try:
                found = approach.follow_cycles_until_converged(self.events)
            except MotionStopped:
                # A search with the requested accuracy may succeed even if the search with low
                # accuracy fails.
                if own is integrator or integrator.is_budget_exceeded:
                    raise
                continue
            if found:
                outcome = self._refine_known_periodic_orbit(
                    scene, integrator, approach.last_cycle_as_periodic_orbit, len(approach.cycles)
                )
                if outcome.status is not Status.UNVERIFIED:
                    return outcome
        return outcome if found else build_outcome_of_settling_motion(scene)

    def _find_cycle_of_multi_state_scene(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the limit cycle of a scene with several states.

        The motion is integrated with a low accuracy until it approaches a periodic orbit. The orbit
        is then refined, starting from the event with the highest slip rate.
        """
        motion = follow_motion_to_periodic_orbit(
            scene,
            integrator.loosened_to(_CYCLE_SEARCH_RTOL),
            self.events,
        )
        if motion is None:
            return build_outcome_of_settling_motion(scene)
        if motion.attracting_periodic_orbit is None:
            return build_outcome_of_aperiodic_motion(
                scene, motion, suggest_raising_event_limit(self.events)
            )
        return self._refine_known_periodic_orbit(
            scene,
            integrator,
            motion.attracting_periodic_orbit.orbit_starting_at_largest_event,
            len(motion.cycles),
        )

    def _refine_known_periodic_orbit(
        self,
        scene: Scene,
        integrator: Integrator,
        orbit: PeriodicOrbit,
        max_cycles: int,
    ) -> Outcome:
        """Refine a periodic orbit to the requested accuracy.

        The orbit is refined again with smaller tolerances, to estimate the errors and to record the
        orbit.
        """
        one = ReturnMap(scene, integrator).refine_periodic_orbit(orbit)
        fine = ReturnMap(
            scene,
            integrator.refined(),
            recorded=self.phases > _POINT_COUNT_IF_ONLY_ENDS_ARE_STORED,
        )
        again = one and fine.refine_periodic_orbit(one)
        if one is None or again is None:
            why = (
                "the cycle does not close if it is computed with other tolerances. Use a "
                "smaller rtol"
            )
            return Outcome(Status.UNVERIFIED, message=why)
        errors = estimate_primary_output_errors(integrator, one, again)
        values = dict(
            zip(_PRIMARY_OUTPUT_NAMES, one.corrected_primary_outputs.tolist(), strict=True)
        )
        values |= {
            f"{n}_error": e for n, e in zip(_PRIMARY_OUTPUT_NAMES, errors.tolist(), strict=True)
        }
        cycle = one.cycles[0]
        carried = (
            cycle.motion_point_at_end.spring_stress - cycle.motion_point_at_start.spring_stress
        ) / scene.stiffness
        values["slip_per_event"] = scene.load_velocity * values["recurrence_interval"]
        values["slip_per_event"] -= carried if one.period_in_cycles > 1 else 0.0
        values |= _compute_additional_cycle_outputs(scene, cycle)
        values["slip_mode"] = _classify_slip_mode(
            scene, LN10 * float(one.corrected_primary_outputs[INDEX_OF_PEAK_SLIP_RATE_OUTPUT])
        )
        values["period_events"] = float(one.period_in_cycles)
        values["events_until_repeat"] = float(max_cycles)
        values["work_per_cycle"] = one.rhs_evaluation_count / one.period_in_cycles
        status, why = determine_status_from_output_errors(integrator, one, errors)
        why = why or _describe_several_events_per_period(one)
        path = extract_recorded_rows_of_cycles(scene, again.cycles, again.motion_recorder)
        return Outcome(
            status,
            values | resample_motion_along_path(path, self.phases, engine=integrator.engine),
            why,
        )


def _describe_several_events_per_period(orbit: PeriodicOrbit) -> str:
    """Return a message if the orbit contains several events, and otherwise an empty string."""
    if orbit.period_in_cycles == 1:
        return ""
    period = math.fsum(cycle.recurrence_interval for cycle in orbit.cycles)
    return (
        f"the motion repeats itself after {orbit.period_in_cycles} events, with a "
        f"period of {period:.6g} "
        "D_c/V_*. The results describe the event with the highest peak slip rate, until the next "
        "maximum of the spring stress"
    )


STEADY_SLIDING_OUTCOME = Outcome(
    Status.NO_LIMIT_CYCLE, message="the motion settles to steady sliding"
)


def build_outcome_of_settling_motion(scene: Scene) -> Outcome:
    """Return the outcome of a motion that settles to steady sliding.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.

    Returns
    -------
    Outcome
        Outcome with the status ``no_limit_cycle`` and the slip mode.
    """
    try:
        last = scene.linear_growth_rates(scene.log_load_velocity)[0]
    except ValueError:
        # The growth rates have no closed form.
        return STEADY_SLIDING_OUTCOME
    return replace(
        STEADY_SLIDING_OUTCOME,
        values={"slip_mode": _DAMPED_OSCILLATION_CODE if last.imag else _STEADY_CODE},
    )


def _classify_slip_mode(scene: Scene, peak_log_slip_rate: float) -> float:
    """Return the slip mode code of a cycle with a given peak of ln V."""
    damping = scene.parts.dynamics.radiated_stress_slope(0.0)
    limit = math.log(scene.a / damping) if damping else scene.log_slip_rate_at_instability
    return _STICK_SLIP_CODE if peak_log_slip_rate >= limit else _SLOW_SLIP_CODE


def build_outcome_of_aperiodic_motion(
    scene: Scene, stick_slip_sequence: StickSlipSequence, remedy: str
) -> Outcome:
    """Return the outcome of a motion that has not reached a periodic orbit.

    The status depends on whether the motion may still reach a periodic orbit.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    stick_slip_sequence : StickSlipSequence
        Events of the motion.
    remedy : str
        Advice for the message if the motion may still reach a periodic orbit.

    Returns
    -------
    Outcome
        Outcome with the status ``work_budget_spent`` or ``not_periodic``.
    """
    latest = stick_slip_sequence.cycles[len(stick_slip_sequence.cycles) // 2 :]
    peaks = [cycle.max_log_slip_rate / LN10 for cycle in latest]
    intervals = [cycle.recurrence_interval for cycle in latest]
    text = (
        f"the last {len(latest)} of {len(stick_slip_sequence.cycles)} events have peak "
        "slip rates of "
        f"10^{min(peaks):.4g} to 10^{max(peaks):.4g} V_* and intervals of {min(intervals):.5g} to "
        f"{max(intervals):.5g} D_c/V_*"
    )
    if stick_slip_sequence.may_still_converge:
        why = f"the motion does not repeat itself yet: {text}. {remedy}"
        return Outcome(Status.WORK_BUDGET_SPENT, message=why)
    return Outcome(Status.NOT_PERIODIC, message=text)


def determine_status_from_output_errors(
    integrator: Integrator,
    orbit: PeriodicOrbit,
    output_errors: np.ndarray,
    outputs: slice = slice(None),
) -> tuple[Status, str]:
    """Determine the status from the errors of the main results.

    Parameters
    ----------
    integrator : Integrator
        Integrator with the requested accuracy.
    orbit : PeriodicOrbit
        Orbit with the main results.
    output_errors : ndarray
        Error estimates of the main results.
    outputs : slice, optional
        Main results to check. By default, all main results are checked.

    Returns
    -------
    status : Status
        Status ``unverified`` if an error is too large, and otherwise ``ok``.
    message : str
        Message with the largest relative error, or an empty string.
    """
    worst = float((output_errors / _compute_primary_output_error_scales(orbit))[outputs].max())
    if worst <= integrator.result_tolerance(Accuracy.MAX_RELIABLE_ERROR_OVER_RTOL):
        return Status.OK, ""
    asked = integrator.result_tolerance()
    why = f"the error of the cycle is {worst:.1e}, but {asked:g} was requested"
    return Status.UNVERIFIED, f"{why}. Use another rtol"


def _compute_primary_output_error_scales(orbit: PeriodicOrbit) -> list[float]:
    """Return the error scale of each main result.

    The logarithm of a slip rate may be zero. The error scale of the logarithm is therefore at least
    half of the difference between the largest and the smallest logarithm.
    """
    *others, slowest, fastest = orbit.corrected_primary_outputs.tolist()
    half = 0.5 * (fastest - slowest)
    return [*map(abs, others), max(abs(slowest), half), max(abs(fastest), half)]


def estimate_primary_output_errors(
    integrator: Integrator, orbit: PeriodicOrbit, refined_orbit: PeriodicOrbit
) -> np.ndarray:
    """Estimate the errors of the main results.

    Each estimate is the sum of two terms. The first term is based on the difference between two
    runs. The second term is the correction for the closure error, which occurs in both runs.

    Parameters
    ----------
    integrator : Integrator
        Integrator with the requested accuracy.
    orbit : PeriodicOrbit
        Orbit of the first run.
    refined_orbit : PeriodicOrbit
        Orbit of the refined run.

    Returns
    -------
    ndarray
        Error estimates in the order of the main results.
    """
    pairs = zip(
        orbit.corrected_primary_outputs.tolist(),
        refined_orbit.corrected_primary_outputs.tolist(),
        _compute_primary_output_error_scales(orbit),
        strict=True,
    )
    errors = [
        integrator.estimate_error(number, refined, _MIN_ESTIMATED_ERROR_OVER_RTOL, scale)
        for number, refined, scale in pairs
    ]
    return np.asarray(np.abs(orbit.primary_output_corrections) + np.array(errors))


def _compute_additional_cycle_outputs(scene: Scene, cycle: StickSlipCycle) -> dict[str, float]:
    """Return the additional results for a cycle."""
    return {
        "healing_exponent": _compute_healing_exponent(scene, cycle),
        "residual_friction": cycle.friction_coefficient_at_peak_rate,
        "drop_asymmetry": (
            cycle.max_spring_stress_minus_steady - cycle.peak_rate_spring_stress_minus_steady
        )
        / (cycle.peak_rate_spring_stress_minus_steady - cycle.min_spring_stress_minus_steady),
    }


def _compute_healing_exponent(scene: Scene, cycle: StickSlipCycle) -> float:
    """Return the mean slope d ln(theta)/d ln(V) between slip arrest and the lowest slip rate.

    The result is NaN if the law has no state variable Theta = b ln(theta/theta_*).
    """
    slowed = (
        cycle.motion_point_at_slowest_slip.log_slip_rate
        - cycle.motion_point_at_slip_arrest.log_slip_rate
    )
    law = scene.parts.law
    if law.state_count > 1 or not law.has_logarithmic_state or not abs(slowed) > 1.0:
        return math.nan
    return (cycle.motion_point_at_slowest_slip.state - cycle.motion_point_at_slip_arrest.state) / (
        scene.b * slowed
    )
