r"""Periodic orbits, computed as fixed points of a return map.

The main methods are ``ReturnMap.find_periodic_orbit``, which searches for an orbit, and
``ReturnMap.refine_periodic_orbit``, which recomputes a known orbit with a different accuracy.

A cycle extends from a moment when V rises through V_0 to the next such moment. At these moments,
the slip rate is known, so spring stress and the states determine the motion. If the slider has
inertia, the spring stress also includes the stress that accelerates the slider. The motion
therefore defines a return map of spring stress and states from one section (a point at which V
rises through V_0) to the next section. An orbit of n cycles is a fixed point of the n-th power of
the return map.

The eigenvalues of the derivative of the return map are the Floquet multipliers, the factors by
which small perturbations grow during one orbit. An orbit repels nearby motions if the absolute
value of a multiplier exceeds 1. When a multiplier passes through -1, an orbit with twice the number
of cycles branches off (period doubling).

If the effect of inertia is small, a perturbation in the direction of the motion only shifts the
motion in time. The number of independent perturbations is therefore one less than the number of
components of a section. At a section, spring stress has a maximum, so the time derivative of spring
stress is zero. A perturbation along the motion therefore changes the states but not the spring
stress.

Notes
-----
Sections are arrays :math:`(f, \Psi_1, \ldots)` of shape (1 + states,), with the spring stress
:math:`f` in units of :math:`\sigma_*` and the states :math:`\Psi_i`. If :math:`P` is the map of n
cycles, an orbit solves :math:`P(s) - s = 0`. The equation is solved by Newton's method. The
Jacobian :math:`P' - 1` is computed by finite differences of order four, and is updated after each
step by Broyden's method [1]_.

References
----------
.. [1] Broyden, C. G. (1965). A class of methods for solving nonlinear simultaneous equations. Math.
   Comp., 19, 577-593.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg.lapack import dgesv

from rsfstudy.limit_cycles.stick_slip_cycles import (
    MIN_LOG_SLIP_RATE_RANGE,
    PRIMARY_OUTPUT_COUNT_PER_CYCLE,
    StickSlipCycle,
    iterate_stick_slip_cycles,
)
from rsfstudy.motion import Accuracy, Integrator, MotionRecorder, MotionStopped
from rsfstudy.slider import FloatTuple, MotionPoint, Scene
from rsfstudy.status import Status

#: Step of the finite differences of the return map, divided by the product of a and the range of ln
#: V. The derivatives of the return map vary on a scale of a hundredth of this product.
DIFFERENCE_STEP_OVER_LOG_RATE_RANGE = 1e-4
_FINITE_DIFFERENCE_WEIGHTS = ((1, 2.0 / 3.0), (2, -1.0 / 12.0))
#: Two limits of the search for an orbit. The first limit is the maximum distance of the orbit from
#: the starting point of the search, divided by the product of a and the range of ln V. The second
#: limit is the maximum number of Newton steps.
_MAX_ORBIT_DISTANCE, _MAX_ITERATIONS = 0.1, 12
#: Largest closure error (difference between the two ends) of an orbit, divided by the requested
#: accuracy. The results are corrected for the closure error to first order.
ORBIT_CLOSURE_TOLERANCE_OVER_RTOL = 0.3


@dataclass(frozen=True)
class PeriodicOrbit:
    """Closed orbit of one or several cycles.

    Parameters
    ----------
    cycles : tuple of StickSlipCycle
        Successive cycles.
    return_map_derivatives_per_cycle : tuple of ndarray
        Derivatives of each cycle, of shape (1 + states + results, 1 + states). Rows correspond to
        the spring stress and the states at the end of the cycle, and to the main results. Columns
        correspond to the spring stress and the states at the beginning of the cycle.
    offset_to_closed_orbit : ndarray, shape (1 + states,)
        Vector from the section at which the computed cycles begin to the corresponding section of
        the closed orbit.
    integration_accuracy : Accuracy
        Accuracy with which the cycles were computed.
    rhs_evaluation_count : int
        Number of right-hand-side evaluations.
    motion_recorder : MotionRecorder, optional
        Recording along the cycles. The recording may extend beyond the end of the cycles.
    """

    cycles: tuple[StickSlipCycle, ...]
    return_map_derivatives_per_cycle: tuple[np.ndarray, ...]
    offset_to_closed_orbit: np.ndarray
    integration_accuracy: Accuracy
    rhs_evaluation_count: int
    motion_recorder: MotionRecorder | None = None

    @property
    def period_in_cycles(self) -> int:
        """Number of cycles in the orbit."""
        return len(self.cycles)

    @property
    def start_point_on_poincare_section(self) -> np.ndarray:
        """Section at which the closed orbit begins."""
        return np.asarray(
            extract_section_coordinates(self.cycles[0].motion_point_at_start)
            + self.offset_to_closed_orbit
        )

    @cached_property
    def primary_output_corrections(self) -> np.ndarray:
        """Corrections that are added to the main results because of the closure error."""
        return np.asarray(
            self.return_map_derivatives_per_cycle[0][len(self.offset_to_closed_orbit) :]
            @ self.offset_to_closed_orbit
        )

    @cached_property
    def corrected_primary_outputs(self) -> np.ndarray:
        """Main results of the first cycle, corrected for the closure error."""
        return np.asarray(
            np.array(self.cycles[0].compute_primary_output_values())
            + self.primary_output_corrections
        )

    @property
    def floquet_multipliers(self) -> np.ndarray:
        """Complex Floquet multipliers, sorted by decreasing absolute value."""
        found = np.linalg.eigvals(
            multiply_return_map_derivatives(self.return_map_derivatives_per_cycle)
        ).astype(complex)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])

    @property
    def is_attracting(self) -> bool:
        """True if the orbit attracts nearby motions."""
        return bool(abs(self.floquet_multipliers[0]) < 1.0)

    @property
    def orbit_starting_at_largest_event(self) -> PeriodicOrbit:
        """Orbit whose first cycle is the cycle with the highest slip rate."""
        at = max(
            range(self.period_in_cycles), key=lambda place: self.cycles[place].max_log_slip_rate
        )
        if not at:
            return self
        return replace(
            self,
            cycles=self.cycles[at:] + self.cycles[:at],
            return_map_derivatives_per_cycle=self.return_map_derivatives_per_cycle[at:]
            + self.return_map_derivatives_per_cycle[:at],
            offset_to_closed_orbit=multiply_return_map_derivatives(
                self.return_map_derivatives_per_cycle[:at]
            )
            @ self.offset_to_closed_orbit,
        )


def extract_section_coordinates(motion_point: MotionPoint) -> np.ndarray:
    """Return the section vector (spring stress and states) of a point.

    Parameters
    ----------
    motion_point : MotionPoint
        Point of a motion.

    Returns
    -------
    ndarray, shape (1 + states,)
        Spring stress and states.
    """
    return np.array((motion_point.spring_stress, *motion_point.psis))


def extract_section_and_outputs_at_cycle_end(cycle: StickSlipCycle) -> np.ndarray:
    """Return an array that contains the section at the end of a cycle and the main results.

    Parameters
    ----------
    cycle : StickSlipCycle
        Cycle of a motion.

    Returns
    -------
    ndarray, shape (1 + states + results,)
        Section at the end of the cycle, followed by the main results.
    """
    return np.array(
        (
            cycle.motion_point_at_end.spring_stress,
            *cycle.motion_point_at_end.psis,
            *cycle.compute_primary_output_values(),
        )
    )


def multiply_return_map_derivatives(
    return_map_derivatives_per_cycle: Sequence[np.ndarray],
) -> np.ndarray:
    """Compute the derivative of the return map over several successive cycles.

    Parameters
    ----------
    return_map_derivatives_per_cycle : sequence of ndarray
        Derivatives of each cycle.

    Returns
    -------
    ndarray, shape (1 + states, 1 + states)
        Product of the derivatives.
    """
    size = return_map_derivatives_per_cycle[0].shape[1]
    together = return_map_derivatives_per_cycle[0][:size]
    for each in return_map_derivatives_per_cycle[1:]:
        together = each[:size] @ together
    return together


_build_identity_matrix = lru_cache(np.eye)


class ReturnMap:
    """Map of spring stress and states from one section to the next.

    A section is the point of a motion at which V rises through V_0.

    Parameters
    ----------
    scene : Scene
        Scene with a moving load point.
    integrator : Integrator
        Integrator with the requested accuracy.
    recorded : bool, default: False
        If True, record the motions along an orbit. Otherwise only the ends of the cycles are
        stored.
    counted : sequence of int, optional
        Indices of the states used for the distance between two sections. By default, all states are
        used, except the states in the attribute ``excluded_from_distance`` of a scene part.
    """

    def __init__(
        self,
        scene: Scene,
        integrator: Integrator,
        *,
        recorded: bool = False,
        counted: Sequence[int] | None = None,
    ) -> None:
        self.scene, self.integrator = scene, integrator
        self._with_recording = recorded
        places = (
            scene.friction_law_functions.state_indices_in_steady_state_distance
            if counted is None
            else counted
        )
        #: Indices of the section components that contribute to the distance between sections.
        self._compared_unknowns = [0, *(1 + place for place in places)]

    def section_coordinates_to_point(self, section_coordinates: np.ndarray) -> MotionPoint:
        """Convert a section vector to a point of the motion.

        The point is on the slow manifold, unless inertia is important. If inertia is important, the
        slip rate of the point is V_0.

        Parameters
        ----------
        section_coordinates : ndarray, shape (1 + states,)
            Spring stress and states.

        Returns
        -------
        MotionPoint
            Point at which a motion can start.

        Raises
        ------
        MotionStopped
            If forward slip is impossible at this spring stress.
        """
        spring_stress, *psis = section_coordinates.tolist()
        point = Integrator.compute_restart_point(self.scene, spring_stress, tuple(psis))
        return (
            Integrator.compute_point_with_slip_rate(self.scene, point, self.scene.log_load_velocity)
            if self._inertia_matters_at(point)
            else point
        )

    def _inertia_matters_at(self, motion_point: MotionPoint) -> bool:
        """Return True if the slow-manifold approximation of inertia is not accurate enough."""
        return self.integrator.inertia_matters_at(self.scene, motion_point)

    def follow_cycles(
        self, start_section: np.ndarray, cycle_count: int, recording: MotionRecorder | None = None
    ) -> list[StickSlipCycle]:
        """Compute successive cycles from a section.

        Parameters
        ----------
        start_section : ndarray, shape (1 + states,)
            Section at which the first cycle begins.
        cycle_count : int
            Number of cycles.
        recording : MotionRecorder, optional
            Recording to which the motion is added.

        Returns
        -------
        list of StickSlipCycle
            Successive cycles. The list is shorter than ``cycle_count`` if the motion settles, stays
            close to unstable steady sliding, or cannot continue. Unstable steady sliding is a fixed
            point of the map, but not a cycle.
        """
        seen = list[StickSlipCycle]()
        try:
            moving = iterate_stick_slip_cycles(
                self.scene,
                self.integrator,
                self.section_coordinates_to_point(start_section),
                recording,
            )
            for cycle in moving:
                if cycle is None or cycle.log_slip_rate_range < MIN_LOG_SLIP_RATE_RANGE:
                    break
                seen.append(cycle)
                if len(seen) == cycle_count:
                    break
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
        return seen

    def follow_one_cycle_to_next_section(self, start_section: np.ndarray) -> np.ndarray | None:
        """Compute one cycle, and return the next section and the main results.

        Parameters
        ----------
        start_section : ndarray, shape (1 + states,)
            Section at which the cycle begins.

        Returns
        -------
        ndarray, shape (1 + states + results,), or None
            Image of the section, or None if the motion does not complete a cycle.
        """
        seen = self.follow_cycles(start_section, 1)
        return extract_section_and_outputs_at_cycle_end(seen[0]) if seen else None

    def compute_return_map_derivatives_per_cycle(
        self, start_section: np.ndarray, cycle_count: int, state_scale: float
    ) -> tuple[np.ndarray, ...]:
        """For each cycle, compute the Jacobian of the return map by finite differences.

        Parameters
        ----------
        start_section : ndarray, shape (1 + states,)
            Section at which the first cycle begins.
        cycle_count : int
            Number of cycles.
        state_scale : float
            Magnitude of the states, from which the step of the finite differences is computed.

        Returns
        -------
        tuple of ndarray
            Derivatives of each cycle. The tuple is shorter than ``cycle_count`` if the motion does
            not complete all cycles.
        """
        found, step = (
            list[np.ndarray](),
            DIFFERENCE_STEP_OVER_LOG_RATE_RANGE
            * math.sqrt(self.integrator.accuracy.refinement)
            * state_scale,
        )
        current: np.ndarray | None = start_section
        for number in range(cycle_count):
            slopes = (
                None
                if current is None
                else self._compute_return_map_derivative_of_cycle(current, step)
            )
            if current is None or slopes is None:
                break
            found.append(slopes)
            after = (
                self.follow_one_cycle_to_next_section(current) if number < cycle_count - 1 else None
            )
            current = None if after is None else after[: len(current)]
        return tuple(found)

    def compute_motion_direction_and_image_change(
        self, motion_point: MotionPoint
    ) -> tuple[FloatTuple, FloatTuple]:
        """Compute how a section changes along the motion, and the resulting change of its image.

        The image of a section consists of the next section and the main results. The image changes
        if the section is displaced along the motion. If the effect of inertia is small, a
        displacement along the motion changes only the duration of the cycle.

        Parameters
        ----------
        motion_point : MotionPoint
            Point of the motion at the section.

        Returns
        -------
        way : tuple of float
            Rates of change of the section components along the motion.
        passed : tuple of float
            Change of the image (next section and main results) due to a displacement of the section
            along the motion.
        """
        scene, states = self.scene, len(motion_point.psis)
        spring_stress = motion_point.frictional_stress + scene.dynamics.radiated_stress(
            scene.log_load_velocity
        )
        rates = scene.equations_without_mass(with_time=True).evaluate_rates(
            (spring_stress, *motion_point.psis, 0.0)
        )
        rest = (0.0,) * (PRIMARY_OUTPUT_COUNT_PER_CYCLE - 1)
        return (0.0, *rates[1:-1]), (*(0.0,) * (1 + states), -rates[-1], *rest)

    def _compute_return_map_derivative_of_cycle(
        self, start_section: np.ndarray, difference_step: float
    ) -> np.ndarray | None:
        """Compute the derivatives of one cycle by fourth-order finite differences.

        The derivative along the motion is computed from the time derivatives of the unknowns,
        without finite differences. The result is None if a motion does not complete the cycle.
        """
        point = self.section_coordinates_to_point(start_section)
        way, passed = self.compute_motion_direction_and_image_change(point)
        directions = np.linalg.qr(np.column_stack([way, np.eye(len(start_section))]))[0]
        columns = list[np.ndarray]()
        for unit in directions.T:
            if not columns and not self._inertia_matters_at(point):
                columns.append(np.array(passed) / (unit @ way))
                continue
            slope = np.zeros(len(start_section) + PRIMARY_OUTPUT_COUNT_PER_CYCLE)
            for number, weight in _FINITE_DIFFERENCE_WEIGHTS:
                ahead = self.follow_one_cycle_to_next_section(
                    start_section + number * difference_step * unit
                )
                behind = self.follow_one_cycle_to_next_section(
                    start_section - number * difference_step * unit
                )
                if ahead is None or behind is None:
                    return None
                slope += weight * (ahead - behind) / difference_step
            columns.append(slope)
        return np.asarray(np.column_stack(columns) @ directions.T)

    def find_periodic_orbit(
        self,
        start_section: np.ndarray,
        cycle_count: int,
        log_slip_rate_range: float,
        max_distance: float = _MAX_ORBIT_DISTANCE,
    ) -> PeriodicOrbit | None:
        """Find a periodic orbit close to a section.

        Parameters
        ----------
        start_section : ndarray, shape (1 + states,)
            Section at which the search starts.
        cycle_count : int
            Number of cycles of the orbit. The period of the orbit that is found may be a divisor of
            this number.
        log_slip_rate_range : float
            Range of ln V.
        max_distance : float, default: 0.1
            Largest distance of the orbit from ``start_section``, relative to ``a`` times the range
            of ln V.

        Returns
        -------
        PeriodicOrbit or None
            The periodic orbit, or None if no orbit is found.
        """
        scale = self.scene.a * log_slip_rate_range
        slopes = self.compute_return_map_derivatives_per_cycle(start_section, cycle_count, scale)
        found = (
            self._solve_for_closed_orbit(start_section, slopes, scale, max_distance)
            if len(slopes) == cycle_count
            else None
        )
        if found is None:
            return None
        cycle_count = self._count_cycles_until_repeat(found.cycles, scale)
        if (
            np.abs(found.start_point_on_poincare_section - start_section).max()
            > self.integrator.result_tolerance(10.0) * scale
        ):
            slopes = self.compute_return_map_derivatives_per_cycle(
                found.start_point_on_poincare_section, cycle_count, scale
            )
        if len(slopes) < cycle_count:
            return None
        return replace(
            found,
            cycles=found.cycles[:cycle_count],
            return_map_derivatives_per_cycle=slopes[:cycle_count],
        )

    def refine_periodic_orbit(self, orbit: PeriodicOrbit) -> PeriodicOrbit | None:
        """Recompute a known periodic orbit with the accuracy of this return map.

        Parameters
        ----------
        orbit : PeriodicOrbit
            Orbit that was computed with any accuracy.

        Returns
        -------
        PeriodicOrbit or None
            The refined orbit, or None if the orbit does not close.
        """
        if orbit.integration_accuracy == self.integrator.accuracy:
            return orbit
        return self._solve_for_closed_orbit(
            orbit.start_point_on_poincare_section,
            orbit.return_map_derivatives_per_cycle,
            self.scene.a * orbit.cycles[0].log_slip_rate_range,
            _MAX_ORBIT_DISTANCE,
        )

    def _solve_for_closed_orbit(
        self,
        start_section: np.ndarray,
        return_map_derivatives_per_cycle: Sequence[np.ndarray],
        state_scale: float,
        max_distance: float,
    ) -> PeriodicOrbit | None:
        r"""Solve for a periodic orbit with a given number of cycles.

        The length of ``return_map_derivatives_per_cycle`` defines the number of cycles.

        Returns
        -------
        PeriodicOrbit or None
            The orbit, or None if there is no orbit within ``max_distance`` of the section.

        Notes
        -----
        The equation :math:`J\,ds = -(P(s) - s)` is solved by Newton's method with Broyden's
        updates. If :math:`r` is the value of :math:`P(s) - s` after a step :math:`ds`, the update
        of :math:`J` is :math:`r\,ds^T/(ds^T ds)`.
        """
        at, enough, last = (
            start_section,
            self.integrator.result_tolerance(ORBIT_CLOSURE_TOLERANCE_OVER_RTOL) * state_scale,
            math.inf,
        )
        jacobian, move = (
            multiply_return_map_derivatives(return_map_derivatives_per_cycle)
            - _build_identity_matrix(len(start_section)),
            None,
        )
        for _ in range(_MAX_ITERATIONS):
            spent, recording = (
                self.integrator.evaluations,
                MotionRecorder() if self._with_recording else None,
            )
            seen = self.follow_cycles(at, len(return_map_derivatives_per_cycle), recording)
            if len(seen) < len(return_map_derivatives_per_cycle):
                return None
            off = extract_section_coordinates(seen[-1].motion_point_at_end) - at
            if move is not None:
                jacobian += off[:, None] * move / (move @ move)
            move = -dgesv(jacobian, off)[2]
            size = self._compute_largest_scaled_section_change(move, at, state_scale)
            # The iteration ends at the requested accuracy, or if numerical errors of the motion
            # prevent further progress.
            if size <= enough or 0.5 * last <= size <= 100.0 * enough:
                work = self.integrator.evaluations - spent
                return PeriodicOrbit(
                    tuple(seen),
                    tuple(return_map_derivatives_per_cycle),
                    move,
                    self.integrator.accuracy,
                    work,
                    recording,
                )
            at, last = at + move, size
            if (
                not np.abs((at - start_section)[self._compared_unknowns]).max()
                <= max_distance * state_scale
            ):
                return None
        return None

    def _compute_largest_scaled_section_change(
        self, section_change: np.ndarray, section: np.ndarray, state_scale: float
    ) -> float:
        """Scale the components of a section change, and return the largest absolute value.

        The unknowns of a fluid may have large values. If a fluid unknown exceeds the scale of the
        states, the change in the unknown is therefore divided by the ratio of the unknown to the
        scale.
        """
        changes, first = np.abs(section_change), 1 + self.scene.parts.law.state_count
        changes[first:] /= np.maximum(1.0, np.abs(section[first:]) / state_scale)
        return float(changes.max())

    def _count_cycles_until_repeat(
        self, cycles: Sequence[StickSlipCycle], state_scale: float
    ) -> int:
        """Return the number of cycles after which an orbit repeats itself."""
        begin = extract_section_coordinates(cycles[0].motion_point_at_start)
        for count in range(1, len(cycles)):
            apart = self._compute_largest_scaled_section_change(
                extract_section_coordinates(cycles[count - 1].motion_point_at_end) - begin,
                begin,
                state_scale,
            )
            if len(cycles) % count == 0 and apart < 1e-4 * state_scale:
                return count
        return len(cycles)
