r"""Base class of the oscillations of normal stress and of the load point velocity.

The oscillation is proportional to :math:`\sin[2 \pi (t - t_b)/T_o + \phi_o]`. It starts at the time
:math:`t_b` and ends after a given number of cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from rsfstudy.slider.loading import (
    Loading,
    LoadingWithFinalVelocityBase,
    Segment,
    declare_load_velocity_field,
)
from rsfstudy.slider.parameter_layout import LOADING, LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import NON_NEGATIVE, POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


def compute_harmonic_oscillation_rates(
    log_slip_rate: float, states: FloatTuple, slip_per_independent_variable: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the rates of the two unknowns of a harmonic oscillation.

    See ``Fluid`` for the arguments. The tuple ``states`` contains the two unknowns, :math:`y` and
    :math:`P`. The function reads :math:`\omega D_c/V_*` from ``p[LOADING]`` and the amplitude
    :math:`A` from ``p[LOADING + 1]``.

    Notes
    -----
    The unknowns oscillate according to

    .. math::

        \frac{dy}{dt} = \omega P, \quad \frac{dP}{dt} = -\omega y.

    With the initial values :math:`y = A` and :math:`P = 0`, the solution is :math:`P = -A \sin
    \omega t`. To correct numerical errors of the amplitude within about one period, the function
    adds the term :math:`(\omega/2) [1 - (y^2 + P^2)/A^2] y` to the rate of :math:`y`. The function
    adds the term :math:`(\omega/2) [1 - (y^2 + P^2)/A^2] P` to the rate of :math:`P`. Both terms
    vanish for the exact solution.
    """
    ahead, relief = states
    turn = (
        p[LOADING]
        * slip_per_independent_variable
        * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    )
    over, relative = ahead / p[LOADING + 1], relief / p[LOADING + 1]
    missing = 0.5 * (1.0 - over * over - relative * relative)
    return turn * (relief + missing * ahead), turn * (missing * relief - ahead)


def return_zero_steady_oscillation(log_slip_rate: float, p: FloatTuple) -> FloatTuple:
    r"""Return the unknowns of the oscillation in steady sliding.

    Steady sliding has no oscillation, so both unknowns are zero.
    """
    return 0.0, 0.0


@dataclass(frozen=True, kw_only=True)
class OscillationBase(LoadingWithFinalVelocityBase):
    r"""Base class of the oscillations, which add two harmonic unknowns to the equations.

    Parameters
    ----------
    oscillation_period : float, default: 10.0
        Period :math:`T_o` in :math:`D_c/V_*`.
    load_velocity_ratio : float, optional
        Mean load point velocity :math:`V_0/V_*`. The default is 1.
    oscillation_begin : float, optional
        Time :math:`t_b` in :math:`D_c/V_*` at which the oscillation begins. By default the
        oscillation begins immediately.
    oscillation_phase : float, optional
        Initial phase :math:`\phi_o` in degrees. The default is 0.
    oscillation_cycles : float, optional
        Number :math:`N_o` of cycles. By default the oscillation has no end.
    """

    oscillation_period: float = number(
        10.0,
        r"$T_o V_*/D_c$",
        "1",
        "period of the oscillation of imposed normal stress",
        "D_c/V_*",
        rule=POSITIVE,
    )
    load_velocity_ratio: float | None = declare_load_velocity_field()
    oscillation_begin: float | None = number(
        None,
        r"$t_b V_*/D_c$",
        "1",
        "time at which the oscillation begins",
        "D_c/V_*",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    oscillation_phase: float | None = number(
        None,
        r"$\phi_o$",
        "degree",
        "phase of the sinusoidal oscillation at its beginning",
        omit_if_default=True,
    )
    oscillation_cycles: float | None = number(
        None,
        "$N_o$",
        "1",
        "number of cycles after which the oscillation ends",
        rule=POSITIVE,
        remedy="For an oscillation without end, omit oscillation_cycles.",
        omit_if_default=True,
    )

    of_pressure = False
    auxiliary_rates = staticmethod(compute_harmonic_oscillation_rates)
    auxiliary_steady_states = staticmethod(return_zero_steady_oscillation)

    def check(self, scene: SceneView) -> None:
        """Check that the scene has inertia if the oscillation is fast.

        See ``Part.check``. If the scene has no inertia, the oscillation period must not be shorter
        than the period of free oscillation of the slider.
        """
        super().check(scene)
        free = 2.0 * math.pi * scene.inertial_time
        if self.oscillation_period < free and not scene.has_mass:
            rule = (
                f"is shorter than the period of free oscillation, T V_*/D_c = {free:.3g}, so "
                "inertia cannot be neglected"
            )
            remedy = "Set inertia=True, or use a longer period."
            raise self.build_field_error("oscillation_period", rule, remedy)

    @property
    def initial_phase_in_radians(self) -> float:
        """Initial phase of the oscillation in radians."""
        return math.radians(self.oscillation_phase or 0.0)

    @property
    def angular_frequency(self) -> float:
        """Dimensionless angular frequency of the oscillation.

        The angular frequency is in units of :math:`V_*/D_c`.
        """
        return 2.0 * math.pi / self.oscillation_period

    @property
    def oscillation_duration(self) -> float:
        """Duration of the oscillation, in units of :math:`D_c/V_*`."""
        cycles = self.oscillation_cycles
        return math.inf if cycles is None else cycles * self.oscillation_period

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Segments before, during and after the oscillation."""
        steady, begin = Segment(self.load_velocity), self.oscillation_begin
        before = [steady._replace(duration=begin)] if begin else []
        after = [steady] if self.oscillation_duration < math.inf else []
        return (*before, steady._replace(duration=self.oscillation_duration), *after)

    @property
    def jump_at_segment_start_mask(self) -> list[bool]:
        """True for every segment.

        The loading may change suddenly at the start of the oscillation, because the initial phase
        may be nonzero. The end of the oscillation is also treated as a jump of the loading, because
        the oscillation has unknowns.
        """
        return [True] * len(self.segments)

    def isolate_segment(self, segment_index: int) -> Loading | Segment:
        """Return one segment of the loading as a separate loading.

        See ``Loading.isolate_segment``. For the segment with the oscillation, the method returns an
        oscillation that begins immediately and has no end.
        """
        segments = self.segments
        if segment_index % len(segments) != bool(self.oscillation_begin):
            return segments[segment_index]
        if len(segments) == 1:
            return self
        return replace(self, oscillation_begin=None, oscillation_cycles=None)
