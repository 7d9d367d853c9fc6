"""A train of waves: what oscillations of normal stress and of the load point share.

It begins as ``sin(2 pi (t - t_b)/T_o + phase)`` at the time t_b, and ends after some cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from rsfstudy.slider.loading import Loading, LoadingAtVelocity, Segment, load_velocity_field
from rsfstudy.slider.parameter_layout import LARGEST_LOG_SLOWNESS, LOADING
from rsfstudy.slider.parts import NON_NEGATIVE, POSITIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


def auxiliary_rates(log_slip_rate: float, states: Numbers, fraction: float, p: Numbers) -> Numbers:
    """Changes of a harmonic pair (y, P) per unit slip in D_c, times a fraction: ``dy/dt = omega P``
    and ``dP/dt = -omega y``, so that P = -A sin(omega t) where it begins with y = A and P = 0.

    What numerical errors make of the amplitude decays in a period: to both is added ``(omega/2) [1
    - (y**2 + P**2)/A**2]`` times y or P, which vanishes along the exact solution.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    states : tuple of float
        y and P.
    fraction : float
        What the changes are multiplied by (see `fluid.dilatant.auxiliary_rates`).
    p : tuple of float
        omega D_c/V_* at LOADING, and A behind it.
    """
    ahead, relief = states
    turn = p[LOADING] * fraction * math.exp(min(-log_slip_rate, LARGEST_LOG_SLOWNESS))
    over, relative = ahead / p[LOADING + 1], relief / p[LOADING + 1]
    missing = 0.5 * (1.0 - over * over - relative * relative)
    return turn * (relief + missing * ahead), turn * (missing * relief - ahead)


def auxiliary_steady_states(log_slip_rate: float, p: Numbers) -> Numbers:
    """No oscillation in steady sliding."""
    return 0.0, 0.0


@dataclass(frozen=True, kw_only=True)
class OscillationBase(LoadingAtVelocity):
    """Base of the oscillations, under a load point at `load_velocity_ratio`, V_* unless stated: a
    harmonic pair of unknowns.
    """

    oscillation_period: float = number(
        10.0,
        r"$T_o V_*/D_c$",
        "1",
        "period of the oscillation of imposed normal stress",
        "D_c/V_*",
        rule=POSITIVE,
    )
    load_velocity_ratio: float | None = load_velocity_field()
    oscillation_begin: float | None = number(
        None,
        r"$t_b V_*/D_c$",
        "1",
        "time at which the oscillation begins",
        "D_c/V_*",
        rule=NON_NEGATIVE,
        omit_if_none=True,
    )
    oscillation_phase: float | None = number(
        None,
        r"$\phi_o$",
        "degree",
        "angle by which the oscillation is ahead of a sine where it begins",
        omit_if_none=True,
    )
    oscillation_cycles: float | None = number(
        None,
        "$N_o$",
        "1",
        "number of cycles after which the oscillation ends",
        rule=POSITIVE,
        remedy="Leave it out for one that goes on for ever.",
        omit_if_none=True,
    )

    of_pressure = False
    auxiliary_rates = staticmethod(auxiliary_rates)
    auxiliary_steady_states = staticmethod(auxiliary_steady_states)

    def check(self, scene: SceneView) -> None:
        """Slow enough where there is no mass; see `Loading`."""
        super().check(scene)
        free = 2.0 * math.pi * scene.inertial_time
        if self.oscillation_period < free and not scene.has_mass:
            rule = f"is below the period of free oscillation, T V_*/D_c = {free:.3g}: mass matters"
            remedy = "Set inertia=True, or give a longer one."
            raise self.field_error("oscillation_period", rule, remedy)

    @property
    def initial_phase(self) -> float:
        """Phase where it begins."""
        return math.radians(self.oscillation_phase or 0.0)

    @property
    def angular_frequency(self) -> float:
        """omega D_c/V_*."""
        return 2.0 * math.pi / self.oscillation_period

    @property
    def oscillation_duration(self) -> float:
        """How long it oscillates."""
        cycles = self.oscillation_cycles
        return math.inf if cycles is None else cycles * self.oscillation_period

    @property
    def segments(self) -> tuple[Segment, ...]:
        """What is before it, itself, and what follows."""
        steady, begin = Segment(self.load_velocity), self.oscillation_begin
        before = [steady._replace(duration=begin)] if begin else []
        after = [steady] if self.oscillation_duration < math.inf else []
        return (*before, steady._replace(duration=self.oscillation_duration), *after)

    @property
    def jump_mask(self) -> list[bool]:
        """Its unknowns are those of itself alone, and its phase is one at once."""
        return [True] * len(self.segments)

    def isolate_segment(self, index: int) -> Loading | Segment:
        segments = self.segments
        if index % len(segments) != bool(self.oscillation_begin):
            return segments[index]
        if len(segments) == 1:
            return self
        return replace(self, oscillation_begin=None, oscillation_cycles=None)
