"""Oscillating normal stress: what the rig, a tide or a passing wave imposes, for ever or for some
cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider.loading import Loading, Segment, _train, last_velocity, refuse_fluid
from rsfstudy.slider.parts import Numbers, number
from rsfstudy.slider.places import LARGEST_SLOWNESS, LOADING

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene


def auxiliary_rates(log_rate: float, states: Numbers, share: float, p: Numbers) -> Numbers:
    """Changes of a harmonic pair (y, P) per unit slip in D_c, times a share: ``dy/dt = omega P``
    and ``dP/dt = -omega y``, so that P = -A sin(omega t) where it begins with y = A and P = 0.

    What numerical errors make of the amplitude decays in a period: to both is added ``(omega/2) [1
    - (y**2 + P**2)/A**2]`` times y or P, which vanishes along the exact solution.

    Parameters
    ----------
    log_rate : float
        ln(V/V_*).
    states : tuple of float
        y and P.
    share : float
        What the changes are multiplied by (see `fluid.dilatant.auxiliary_rates`).
    p : tuple of float
        omega D_c/V_* at LOADING, and A behind it.
    """
    ahead, relief = states
    turn = p[LOADING] * share * math.exp(min(-log_rate, LARGEST_SLOWNESS))
    over, relative = ahead / p[LOADING + 1], relief / p[LOADING + 1]
    missing = 0.5 * (1.0 - over * over - relative * relative)
    return turn * (relief + missing * ahead), turn * (missing * relief - ahead)


def auxiliary_steady_states(log_rate: float, p: Numbers) -> Numbers:
    """No oscillation in steady sliding."""
    return 0.0, 0.0


@dataclass(frozen=True, kw_only=True)
class Oscillation(_train.Train):
    """Imposed normal stress ``sigma_* [1 + A sin(2 pi (t - t_b)/T_o + phase)]`` from t_b on, for
    some cycles or for ever, and load point velocity (V_* unless stated).
    """

    oscillation_amplitude: float = number(
        0.0,
        r"$A$",
        "1",
        "amplitude of an oscillation of imposed normal stress",
        rule="must be 0 or greater",
        remedy="0 is no oscillation.",
        scale="sigma_*",
    )
    oscillation_period: float = _train.period()
    load_velocity_ratio: float | None = last_velocity()
    oscillation_begin: float | None = _train.begin()
    oscillation_phase: float | None = _train.phase()
    oscillation_cycles: float | None = _train.cycles()

    name = "oscillation"
    called_by = "oscillation_amplitude"
    unknowns = (
        Quantity("oscillation_ahead", "$y$", "1", "oscillation a quarter ahead", "sigma_*"),
        Quantity("oscillation_relief", "$P$", "1", "imposed fall of normal stress", "sigma_*"),
    )
    auxiliary_rates = staticmethod(auxiliary_rates)
    auxiliary_steady_states = staticmethod(auxiliary_steady_states)

    def check(self, scene: Scene) -> None:
        """Normal stress that stays positive, slow enough where there is no mass, and is not that of
        a fluid too.
        """
        amplitude = self.oscillation_amplitude
        if amplitude >= 1.0:
            remedy = "Normal stress stays positive: it oscillates by less than all of it."
            raise InvalidValue(
                "oscillation_amplitude", amplitude, "must be less than 1", remedy=remedy
            )
        refuse_fluid(scene, "oscillation_amplitude", amplitude)
        super().check(scene)

    @property
    def jumps(self) -> list[bool]:
        """Its unknowns are those of itself alone, and its phase is one at once."""
        return [True] * len(self.segments)

    def alone(self, number: int) -> Loading | Segment:
        segments = self.segments
        if number % len(segments) != bool(self.oscillation_begin):
            return segments[number]
        if len(segments) == 1:
            return self
        return replace(self, oscillation_begin=None, oscillation_cycles=None)

    @property
    def beginning(self) -> Numbers:
        """y and P of its phase."""
        amplitude, angle = self.oscillation_amplitude, self.angle
        return amplitude * math.cos(angle), -amplitude * math.sin(angle)

    def numbers(self, scene: Scene) -> Numbers:
        """omega D_c/V_*, and A."""
        return 2.0 * math.pi / self.oscillation_period, self.oscillation_amplitude
