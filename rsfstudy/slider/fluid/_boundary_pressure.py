"""A fluid whose surroundings have a pore pressure that the loading changes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from rsfstudy.quantities import Quantity
from rsfstudy.slider.fluid import Fluid
from rsfstudy.slider.parameter_layout import (
    BOUNDARY_PRESSURE_RATE,
    DYNAMICS,
    FLUID,
    LARGEST_LOG_SLOWNESS,
)
from rsfstudy.slider.parts import Function, Numbers, collect_numbers
from rsfstudy.slider.scene_view import SceneView

if TYPE_CHECKING:
    from rsfstudy.slider.loading import Loading


@cache
def rates_with_boundary_pressure(rates: Function) -> Function:
    """Changes of the pressure R of the surroundings, and of the unknowns of a fluid behind it.

    The fluid knows of pressure as far as it exceeds that of the surroundings, P - R, as in
    ``dP/dt = c* (R - P) - (dphi/dt)/beta``; what it says of the changes holds for P itself.
    """

    def auxiliary_rates(
        log_slip_rate: float, states: Numbers, fraction: float, p: Numbers
    ) -> Numbers:
        time = fraction * math.exp(min(-log_slip_rate, LARGEST_LOG_SLOWNESS))
        own = (*states[1:-1], states[-1] - states[0])
        return (-p[BOUNDARY_PRESSURE_RATE] * time, *rates(log_slip_rate, own, fraction, p))

    return auxiliary_rates


@cache
def steady_states_with_boundary_pressure(steady_states: Function) -> Function:
    """The same in steady sliding before the loading: pressures are counted from there."""

    def auxiliary_steady_states(log_slip_rate: float, p: Numbers) -> Numbers:
        return (0.0, *steady_states(log_slip_rate, p))

    return auxiliary_steady_states


@dataclass(frozen=True)
class FluidWithBoundaryPressure:
    """A fluid together with a loading that imposes the pressure around it.

    Attributes
    ----------
    loading, fluid : Loading, Fluid
        Its parts, both of which have unknowns.
    """

    loading: Loading
    fluid: Fluid

    @property
    def name(self) -> str:
        """That of the fluid."""
        return self.fluid.name

    @property
    def unknowns(self) -> tuple[Quantity, ...]:
        """Pressure of the surroundings first, and that inside the fault last."""
        return (*self.loading.unknowns, *self.fluid.unknowns)

    @property
    def excluded_from_distance(self) -> tuple[str, ...]:
        """Names of the unknowns that are excluded from the distance from steady sliding.

        The names come from both the loading and the fluid.
        """
        return (*self.loading.excluded_from_distance, *self.fluid.excluded_from_distance)

    @property
    def auxiliary_rates(self) -> Function:
        """Theirs."""
        assert self.fluid.auxiliary_rates is not None
        return rates_with_boundary_pressure(self.fluid.auxiliary_rates)

    @property
    def auxiliary_steady_states(self) -> Function:
        """Theirs."""
        assert self.fluid.auxiliary_steady_states is not None
        return steady_states_with_boundary_pressure(self.fluid.auxiliary_steady_states)

    def numbers(self, scene: SceneView) -> Numbers:
        """Those of the fluid, and the rate of the loading in the last place."""
        own = collect_numbers(self.fluid, scene)
        between = (math.nan,) * (DYNAMICS - FLUID - 1 - len(own))
        return (*own, *between, *collect_numbers(self.loading, scene))
