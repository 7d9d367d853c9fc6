"""Functions and a class that combine a pore fluid with a loading that imposes pressure."""

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
    LOG_SLOWNESS_UPPER_LIMIT,
)
from rsfstudy.slider.parts import FloatTuple, NumericFunction, collect_parameter_values
from rsfstudy.slider.scene_view import SceneView

if TYPE_CHECKING:
    from rsfstudy.slider.loading import Loading
    from rsfstudy.slider.noise import Noise


@cache
def add_boundary_pressure_to_rates(fluid_auxiliary_rates: NumericFunction) -> NumericFunction:
    r"""Return a rate function that includes the pressure of the surroundings.

    Parameters
    ----------
    fluid_auxiliary_rates : callable
        Function ``auxiliary_rates`` of the fluid.

    Returns
    -------
    callable
        Function ``auxiliary_rates`` of the fluid and its surroundings. The first unknown is the
        pressure R of the surroundings, and the unknowns of the fluid follow.

    Notes
    -----
    The rates of the fluid depend on the difference :math:`P - R` between the pore pressure and the
    pressure of the surroundings, for example

    .. math::

        \frac{dP}{dt} = c^* (R - P) - \frac{1}{\beta} \frac{d\varphi}{dt}.
    """

    def auxiliary_rates(
        log_slip_rate: float, states: FloatTuple, fraction: float, p: FloatTuple
    ) -> FloatTuple:
        time = fraction * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
        own = (*states[1:-1], states[-1] - states[0])
        return (
            -p[BOUNDARY_PRESSURE_RATE] * time,
            *fluid_auxiliary_rates(log_slip_rate, own, fraction, p),
        )

    return auxiliary_rates


@cache
def add_boundary_pressure_to_steady_states(
    fluid_auxiliary_steady_states: NumericFunction,
) -> NumericFunction:
    """Return a steady-state function that includes the pressure of the surroundings.

    Parameters
    ----------
    fluid_auxiliary_steady_states : callable
        Function ``auxiliary_steady_states`` of the fluid.

    Returns
    -------
    callable
        Function ``auxiliary_steady_states`` of the fluid and its surroundings. The pressure of the
        surroundings is zero in steady sliding, because all pressures are relative to the pressure
        before the loading.
    """

    def auxiliary_steady_states(log_slip_rate: float, p: FloatTuple) -> FloatTuple:
        return (0.0, *fluid_auxiliary_steady_states(log_slip_rate, p))

    return auxiliary_steady_states


@dataclass(frozen=True)
class FluidWithBoundaryPressure:
    """Fluid combined with a loading that imposes the surrounding pressure.

    Parameters
    ----------
    boundary_pressure_loading : Loading
        Loading with unknowns, the last of which is the pressure of the surroundings.
    fluid : Fluid
        Fluid with unknowns, the last of which is the pore pressure in the fault.
    """

    boundary_pressure_loading: Loading | Noise
    fluid: Fluid

    @property
    def name(self) -> str:
        """Name of the fluid."""
        return self.fluid.name

    @property
    def unknowns(self) -> tuple[Quantity, ...]:
        """Unknowns of the loading, followed by the unknowns of the fluid.

        The first unknown is the pressure of the surroundings, and the last unknown is the pore
        pressure in the fault.
        """
        return (*self.boundary_pressure_loading.unknowns, *self.fluid.unknowns)

    @property
    def excluded_from_distance(self) -> tuple[str, ...]:
        """Names of the unknowns excluded from the distance from steady sliding.

        The tuple includes the excluded unknowns of both the loading and the fluid.
        """
        return (
            *self.boundary_pressure_loading.excluded_from_distance,
            *self.fluid.excluded_from_distance,
        )

    @property
    def auxiliary_rates(self) -> NumericFunction:
        """Function that computes the rates of all unknowns."""
        assert self.fluid.auxiliary_rates is not None
        return add_boundary_pressure_to_rates(self.fluid.auxiliary_rates)

    @property
    def auxiliary_steady_states(self) -> NumericFunction:
        """Function that returns all unknowns in steady sliding."""
        assert self.fluid.auxiliary_steady_states is not None
        return add_boundary_pressure_to_steady_states(self.fluid.auxiliary_steady_states)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the parameters of the fluid and the rate of the loading.

        Parameters
        ----------
        scene : Scene
            Scene that the fluid and the loading belong to.

        Returns
        -------
        tuple of float
            Parameters of the fluid, padded with NaN, and the rate of the surrounding pressure as
            the last element.
        """
        own = collect_parameter_values(self.fluid, scene)
        between = (math.nan,) * (DYNAMICS - FLUID - 1 - len(own))
        return (*own, *between, *collect_parameter_values(self.boundary_pressure_loading, scene))
