r"""Search for the limit cycle that a motion approaches.

If a scene has one state, use ``LimitCycleSearch``. The spring stress at the moment when V rises
through V_0 determines the subsequent motion. Two successive cycles are therefore sufficient to
compute the derivative of the return map. If the cycles converge slowly, the search continues from
an extrapolated fixed point of the return map.

If a scene has several states, use ``follow_motion_to_periodic_orbit``. The function
``follow_motion_to_periodic_orbit`` integrates the motion cycle by cycle, and compares the cycles to
find the number of cycles after which the motion repeats.

Notes
-----
The section of a motion at a rise of V through V_0 is :math:`s = (f, \Psi)`, with the spring stress
:math:`f` and the state :math:`\Psi`. The image :math:`P(s)` contains the section one cycle later,
followed by the main results of the cycle. The derivative :math:`P'` of the image has a column
:math:`b` for :math:`f` and a column :math:`c` for :math:`\Psi`.

Spring stress has a maximum at a section, so the motion passes the section in the direction
:math:`(0, d\Psi/dt)`. If the motion starts a time :math:`dt` later, the cycle is shorter by
:math:`dt`, and nothing else changes. Therefore :math:`c` is :math:`-1/(d\Psi/dt)` in the row of the
recurrence interval, and 0 in all other rows. If the sections of two cycles differ by :math:`(df,
d\Psi)` and their images differ by :math:`dP`, the other column is

.. math:: b = (dP - c\,d\Psi)/df.

The first two rows of :math:`P'` are the derivative :math:`A` of the next section. Column :math:`c`
of :math:`A` is zero, so :math:`A` has rank one, and its nonzero eigenvalue is its trace. Therefore
:math:`A^2 = (\mathrm{tr} A) A`, and the vector from :math:`s` to the fixed point is

.. math:: (1 - A)^{-1} (P(s) - s) = P(s) - s + \frac{A (P(s) - s)}{1 - \mathrm{tr} A}.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import sub

import numpy as np

from rsfstudy.limit_cycles.return_map import (
    ORBIT_CLOSURE_TOLERANCE_OVER_RTOL,
    PeriodicOrbit,
    ReturnMap,
    extract_section_coordinates,
)
from rsfstudy.limit_cycles.stick_slip_cycles import (
    LN10,
    PRIMARY_OUTPUT_COUNT_PER_CYCLE,
    StickSlipCycle,
    iterate_stick_slip_cycles,
    suggest_raising_event_limit,
)
from rsfstudy.motion import Integrator, MotionStopped
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Limits of the contraction ratio, the ratio of successive distances to the limit cycle. If the
#: contraction ratio is above the first limit, the search continues from the extrapolated fixed
#: point. If the contraction ratio is above the second limit, the cycles do not converge.
_MIN_CONTRACTION_TO_LEAP, _MAX_CONTRACTION = 0.03, 0.98
#: Maximum change in the range of ln V by a leap to the extrapolated fixed point, as a fraction of
#: the range of ln V.
_MAX_EXTRAPOLATION_OVER_LOG_RATE_RANGE = 0.1
#: Maximum number of cycles after which a periodic motion repeats.
MAX_PERIOD_IN_CYCLES = 16
#: Largest relative tolerance for the difference between the two ends of an orbit. The limit is
#: necessary because finite differences lose digits.
_MAX_ORBIT_CLOSURE_RTOL = 1e-7
#: Number of cycles after which a motion is first tested for periodicity.
_MIN_CYCLES_BEFORE_RECURRENCE_TEST = 8
#: Two limits. An orbit certainly repels motions if the absolute value of a Floquet multiplier
#: exceeds the first limit. Two cycles are considered equal if their difference, divided by the
#: product of a and the range of ln V, is below the second limit.
_REPELLING_MULTIPLIER, _MAX_RECURRENCE_MISFIT = 1.01, 0.02
#: Relative difference from the critical stiffness below which oscillations grow or decay so slowly
#: that the search cannot converge.
_RTOL_OF_NEARLY_CRITICAL_STIFFNESS = 1e-5


class LimitCycleSearch:
    """Search for the limit cycle of a scene with one state.

    Parameters
    ----------
    scene : Scene
        Scene with one state and a moving load point.
    integrator : Integrator
        Integrator with the requested accuracy.

    Attributes
    ----------
    cycles : list of StickSlipCycle
        All computed cycles. If ``follow_cycles_until_converged`` has returned True, the last cycle
        is the limit cycle.
    """

    def __init__(self, scene: Scene, integrator: Integrator) -> None:
        self._scene, self._integrator = scene, integrator
        self._return_map = ReturnMap(scene, integrator)
        self._noise = integrator.local_tolerance * scene.a
        self._work = 0
        self.cycles: list[StickSlipCycle] = []
        #: Columns b and c of P', which are the derivatives of the image with respect to spring
        #: stress and state. The flag is True if the derivatives are known.
        self._derivatives, self._has_derivatives = (
            2 * ([0.0] * (2 + PRIMARY_OUTPUT_COUNT_PER_CYCLE),),
            False,
        )
        #: Section s at which the last cycle begins, its image P(s), and the difference dP from the
        #: previous image.
        self._section, self._image = (0.0, 0.0), [0.0] * (2 + PRIMARY_OUTPUT_COUNT_PER_CYCLE)
        self._image_change = self._image
        #: Vector from the section s to the fixed point, and the resulting change of the image P(s).
        self._correction, self._image_correction = self._section, self._image
        #: Change in spring stress over the cycle before the last leap to an extrapolated fixed
        #: point.
        self._distance_at_leap = np.inf

    def follow_cycles_until_converged(self, max_cycles: int) -> bool:
        """Compute cycles until the motion reaches the limit cycle.

        Parameters
        ----------
        max_cycles : int
            Largest number of cycles.

        Returns
        -------
        bool
            True if the motion has reached the limit cycle, and False if the motion settles to
            steady sliding.

        Raises
        ------
        MotionStopped
            With the status ``work_budget_spent`` if no cycle repeats within ``max_cycles`` cycles.
        """
        start = None
        while True:
            spent = self._integrator.evaluations
            for cycle in iterate_stick_slip_cycles(self._scene, self._integrator, start):
                if cycle is None:
                    return False
                self._work, spent = (
                    self._integrator.evaluations - spent,
                    self._integrator.evaluations,
                )
                self.cycles.append(cycle)
                self._update_return_map_derivatives()
                if self._has_converged():
                    return True
                if len(self.cycles) >= max_cycles:
                    remedy = suggest_raising_event_limit(max_cycles)
                    text = (
                        f"the motion does not repeat itself within {max_cycles} events"
                        f"{self._nearly_critical_stiffness_message}. {remedy}"
                    )
                    raise MotionStopped(Status.WORK_BUDGET_SPENT, text)
                if self._should_extrapolate_to_fixed_point():
                    self._distance_at_leap = abs(
                        cycle.motion_point_at_end.spring_stress
                        - cycle.motion_point_at_start.spring_stress
                    )
                    start = self._return_map.section_coordinates_to_point(
                        extract_section_coordinates(cycle.motion_point_at_start)
                        + np.array(self._correction)
                    )
                    break

    @property
    def _nearly_critical_stiffness_message(self) -> str:
        """Explanation that is added to the message if the stiffness is nearly critical.

        The explanation is an empty string if the stiffness is not close to critical.
        """
        critical = self._scene.critical_stiffness_at(self._scene.log_load_velocity)
        off = abs(self._scene.stiffness / critical - 1.0) if critical else math.inf
        if off > _RTOL_OF_NEARLY_CRITICAL_STIFFNESS:
            return ""
        return (
            ", because oscillations neither grow nor decay if the stiffness differs from the "
            f"critical stiffness by a fraction of only {off:.0e}. Use a different stiffness="
        )

    @property
    def last_cycle_as_periodic_orbit(self) -> PeriodicOrbit:
        """Periodic orbit that consists of the last cycle and the offset to the limit cycle."""
        last, slopes = self.cycles[-1:], np.array(self._derivatives).T
        return PeriodicOrbit(
            tuple(last),
            (slopes,),
            np.array(self._correction),
            self._integrator.accuracy,
            self._work,
        )

    @property
    def _contraction_ratio_per_cycle(self) -> float:
        """Trace of the derivative A of the return map.

        The trace is the ratio of successive distances to the limit cycle. The other eigenvalue of A
        is zero, because shifting the section along the motion has no effect on the next section.
        """
        return self._derivatives[0][0] + self._derivatives[1][1]

    def _update_return_map_derivatives(self) -> None:
        """Update the return map derivatives and the vector to the fixed point.

        The derivatives of the return map are computed from the last two cycles, unless numerical
        errors dominate the difference between the cycles. The module docstring contains the
        formulas.
        """
        last = self.cycles[-1]
        begin, end = last.motion_point_at_start, last.motion_point_at_end
        start = begin.spring_stress, begin.psi
        image = [end.spring_stress, end.psi, *last.compute_primary_output_values()]
        changes = list(map(sub, image, self._image))
        if len(self.cycles) > 1:
            by_stress, by_state = map(sub, start, self._section)
            if abs(by_stress) > (1000.0 if self._has_derivatives else 1.0) * self._noise:
                self._has_derivatives = True
                # Spring stress does not change when the motion passes a section.
                (_none, way), passed = self._return_map.compute_motion_direction_and_image_change(
                    begin
                )
                along = [change / way for change in passed]
                pairs = zip(changes, along, strict=True)
                self._derivatives = [(x - by_state * y) / by_stress for x, y in pairs], along
        self._section, self._image, self._image_change = start, image, changes
        off, kept = (
            list(map(sub, image, start)),
            1.0 - min(self._contraction_ratio_per_cycle, _MAX_CONTRACTION),
        )
        returned = self._predict_return_map_image_change(off)
        self._correction = off[0] + returned[0] / kept, off[1] + returned[1] / kept
        self._image_correction = self._predict_return_map_image_change(self._correction)

    def _predict_return_map_image_change(self, section_change: Sequence[float]) -> list[float]:
        """Predict the change in the image P(s) due to a change in the section s."""
        by_stress, by_state = section_change
        return [x * by_stress + y * by_state for x, y in zip(*self._derivatives, strict=True)]

    def _has_converged(self) -> bool:
        """Return True if the last cycle is close enough to the limit cycle.

        The return map derivatives predict how much the results of the last cycle differ from the
        results of the limit cycle. The cycles have converged if this difference is sufficiently
        small, or if the last two cycles agree.
        """
        tolerance = self._integrator.result_tolerance(0.3)
        allowed = [tolerance * abs(number) for number in self._image[2:]]
        if (
            self._has_derivatives
            and self._contraction_ratio_per_cycle < _MAX_CONTRACTION
            and _are_within_tolerance(self._image_correction[2:], allowed)
        ):
            return True
        if (
            len(self.cycles) < 2
            or self.cycles[-2].motion_point_at_end != self.cycles[-1].motion_point_at_start
        ):
            return False
        if self._last_cycles_alternate():
            return True
        left = min(max(self._contraction_ratio_per_cycle, 0.0), _MAX_CONTRACTION)
        left = max(1.0, left / (1.0 - left))
        return _are_within_tolerance([change * left for change in self._image_change[2:]], allowed)

    def _last_cycles_alternate(self) -> bool:
        """Return True if the last two cycles are on opposite sides of the limit cycle.

        Trajectories in a plane cannot cross, so exact cycles approach the limit cycle from one
        side. If the computed cycles alternate around the limit cycle, numerical errors are the
        cause.
        """
        before, last = (
            cycle.motion_point_at_end.spring_stress - cycle.motion_point_at_start.spring_stress
            for cycle in self.cycles[-2:]
        )
        near = (
            self._integrator.result_tolerance(ORBIT_CLOSURE_TOLERANCE_OVER_RTOL)
            * self._scene.a
            * self.cycles[-1].log_slip_rate_range
        )
        return before * last <= 0.0 and abs(last) <= near

    def _should_extrapolate_to_fixed_point(self) -> bool:
        """Return True if the search should continue from the extrapolated fixed point.

        The search does not extrapolate if the cycles already converge quickly. The search also
        avoids large extrapolations, because the motion may settle to steady sliding afterwards. The
        search extrapolates again only if the change in spring stress per cycle has halved since the
        last extrapolation. Otherwise, repeated extrapolations may form a loop.
        """
        cycle = self.cycles[-1]
        left = abs(
            cycle.motion_point_at_end.spring_stress - cycle.motion_point_at_start.spring_stress
        )
        if not 10.0 * self._noise <= left < 0.5 * self._distance_at_leap:
            return False
        if not _MIN_CONTRACTION_TO_LEAP < self._contraction_ratio_per_cycle < _MAX_CONTRACTION:
            return False
        slowest, fastest = self._image_correction[-2:]
        return (
            LN10 * abs(fastest - slowest)
            < _MAX_EXTRAPOLATION_OVER_LOG_RATE_RANGE * cycle.log_slip_rate_range
        )


def _are_within_tolerance(changes: Sequence[float], tolerances: Sequence[float]) -> bool:
    """Return True if no change exceeds its tolerance."""
    return all(abs(change) <= most for change, most in zip(changes, tolerances, strict=True))


@dataclass(frozen=True)
class StickSlipSequence:
    """Cycles of a motion, and the orbit that the motion approaches.

    Parameters
    ----------
    cycles : list of StickSlipCycle
        Cycles of the motion. In the results of ``LimitCycle``, a cycle is called an event.
    attracting_periodic_orbit : PeriodicOrbit or None
        Periodic orbit that the motion approaches, or None if no orbit was found.
    may_still_converge : bool
        True if the motion may still approach a periodic orbit.
    """

    cycles: list[StickSlipCycle]
    attracting_periodic_orbit: PeriodicOrbit | None
    may_still_converge: bool


def follow_motion_to_periodic_orbit(
    scene: Scene,
    integrator: Integrator,
    max_cycles: int,
    *,
    follow_all_cycles: bool = False,
) -> StickSlipSequence | None:
    """Integrate a motion until it approaches an attracting periodic orbit.

    Parameters
    ----------
    scene : Scene
        Scene with a moving load point.
    integrator : Integrator
        Integrator with the requested accuracy.
    max_cycles : int
        Largest number of cycles.
    follow_all_cycles : bool, default: False
        If True, compute ``max_cycles`` cycles even if an orbit is found earlier.

    Returns
    -------
    StickSlipSequence or None
        Cycles and orbit, or None if the motion settles to steady sliding.
    """
    seen, orbit, repels = list[StickSlipCycle](), None, False
    fine = integrator.tightened_to(_MAX_ORBIT_CLOSURE_RTOL)
    look = min(_MIN_CYCLES_BEFORE_RECURRENCE_TEST, max_cycles)
    for cycle in iterate_stick_slip_cycles(scene, integrator, None):
        if cycle is None:
            return None
        seen.append(cycle)
        if len(seen) == look and not orbit:
            look = min(2 * look, max_cycles)
            found, off = None, math.inf
            for counted in _list_state_index_sets_to_compare(scene):
                period, off = find_recurrence_period_in_cycles(scene, seen, counted)
                if off < _MAX_RECURRENCE_MISFIT:
                    by = ReturnMap(scene, fine, counted=counted)
                    found = by.find_periodic_orbit(
                        extract_section_coordinates(cycle.motion_point_at_end),
                        period,
                        cycle.log_slip_rate_range,
                    )
                    break
            repels = off >= _MAX_RECURRENCE_MISFIT or (
                found is not None and abs(found.floquet_multipliers[0]) > _REPELLING_MULTIPLIER
            )
            orbit = found if found is not None and found.is_attracting else None
        if len(seen) == max_cycles or (orbit and not follow_all_cycles):
            break
    return StickSlipSequence(
        seen, orbit, may_still_converge=not repels or _may_still_converge(seen)
    )


def _may_still_converge(cycles: Sequence[StickSlipCycle]) -> bool:
    """Return True if a motion may still approach a periodic orbit.

    The result is True for motions with few cycles. For longer motions, the result is True if the
    range of ln V, or a state, increases or decreases monotonically from cycle to cycle.
    """
    if len(cycles) < _MIN_CYCLES_BEFORE_RECURRENCE_TEST:
        return True
    latest = [
        (cycle.log_slip_rate_range, *cycle.motion_point_at_end.psis)
        for cycle in cycles[len(cycles) // 2 :]
    ]
    changes = np.diff(latest, axis=0)
    return bool(((changes > 0.0).all(axis=0) | (changes < 0.0).all(axis=0)).any())


def _list_state_index_sets_to_compare(scene: Scene) -> tuple[tuple[int, ...], ...]:
    """Return the sets of states (as indices) that are compared to detect a period.

    The first set contains the states used for the distance from steady sliding. The second set
    contains only the states of the friction law, because a slow unknown of the fluid may converge
    long after the states of the law.
    """
    of_law = tuple(range(scene.parts.law.state_count))
    return tuple(
        dict.fromkeys((scene.friction_law_functions.state_indices_in_steady_state_distance, of_law))
    )


def find_recurrence_period_in_cycles(
    scene: Scene,
    cycles: Sequence[StickSlipCycle],
    compared_state_indices: Sequence[int] | None = None,
) -> tuple[int, float]:
    r"""Find the number of cycles after which a motion nearly repeats itself.

    The states at the ends of cycles i and i + n are compared over the second half of the motion.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    cycles : sequence of StickSlipCycle
        Successive cycles.
    compared_state_indices : sequence of int, optional
        Indices of the states to compare. By default, all states are compared, except the states in
        the attribute ``excluded_from_distance`` of a scene part.

    Returns
    -------
    period : int
        Smallest number of cycles n for which the difference between states n cycles apart is at
        most twice the smallest difference for any n.
    off : float
        Difference between states ``period`` cycles apart, or infinity if there are too few cycles.

    Notes
    -----
    The difference after :math:`n` cycles is the largest :math:`|\Psi_{i+n} - \Psi_i|` of any state,
    divided by :math:`a` times the range of :math:`\ln V`.
    """
    if len(cycles) < 4:
        return 1, math.inf
    places = list(
        scene.friction_law_functions.state_indices_in_steady_state_distance
        if compared_state_indices is None
        else compared_state_indices
    )
    states = np.array([cycle.motion_point_at_end.psis for cycle in cycles])[:, places]
    latest, scale = states[len(states) // 2 :], scene.a * cycles[-1].log_slip_rate_range
    longest = min(MAX_PERIOD_IN_CYCLES, len(latest) // 2)
    off = np.array(
        [np.abs(latest[count:] - latest[:-count]).max() for count in range(1, longest + 1)]
    )
    period = int(np.argmax(off <= 2.0 * off.min())) + 1
    return period, float(off[period - 1]) / scale
