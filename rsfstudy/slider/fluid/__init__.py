r"""Pore fluids of the fault.

Each module of this package defines one pore fluid. The function ``discover_parts`` finds the
modules automatically. Stress is normalised by the effective normal stress
:math:`\sigma_* = \sigma - p_\infty` of steady sliding at :math:`V_*`. The pore pressure is
:math:`P = (p - p_\infty)/\sigma_*`, so the fluids do not depend on :math:`p_\infty` itself. The
base class is ``Fluid``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rsfstudy.quantities import Quantity
from rsfstudy.slider.parts import (
    POSITIVE,
    FloatTuple,
    Part,
    discover_parts,
    number,
)
from rsfstudy.slider.quantities_required_by_parts import PORE_PRESSURE, SLIP_RATE


@dataclass(frozen=True, kw_only=True)
class Fluid(Part):
    r"""Base class of all pore fluids.

    A fluid with unknowns declares these unknowns in the class attribute ``unknowns``. The last
    unknown of a fluid must be the pore pressure P. A fluid with unknowns also defines two functions
    as static methods:

    - ``auxiliary_rates(log_slip_rate, states, fraction, p)`` returns the changes of the unknowns
      per unit slip in :math:`D_c`, multiplied by ``fraction``, which is the slip per unit of the
      independent variable.
    - ``auxiliary_steady_states(log_slip_rate, p)`` returns the unknowns in steady sliding, where
      the pore pressure P is zero.

    The argument ``log_slip_rate`` is :math:`\ln(V/V_*)`, ``states`` is the tuple of the unknowns,
    and ``p`` is the tuple of parameters, in which the parameters of the fluid start at
    ``p[FLUID]``. When slip stops, a rate of change per unit slip becomes infinite, but the product
    of this rate and the argument ``fraction`` remains finite.

    The distance between the unknowns and their values in steady sliding determines whether a motion
    has settled and whether a cycle repeats. The attribute ``excluded_from_distance`` lists the
    names of unknowns that do not contribute to the distance from steady sliding. Exclude an unknown
    from the distance if its steady value is extremely large at the slip rates of ruptures.

    Examples
    --------
    >>> from rsfstudy.parts import Fluid
    >>> from rsfstudy.slider.fluid.dilatant import DilatantFluid
    >>> issubclass(DilatantFluid, Fluid)
    True
    >>> [unknown.name for unknown in DilatantFluid.unknowns]
    ['porosity', 'pore_pressure']
    """

    members_derived_from_equations = ("compute_pore_pressure_upper_bound",)
    members_defining_equations = frozenset({"auxiliary_rates", "parameter_values"})
    received_quantity_names = frozenset({SLIP_RATE, PORE_PRESSURE})

    @property
    def pressurisation_factor(self) -> float:
        """Increase in pore pressure, in sigma_*, when an undrained fault heats up by T_*."""
        return 0.0

    def compute_pore_pressure_upper_bound(self, log_slip_rate: float, states: FloatTuple) -> float:
        r"""Compute an upper bound on the future pore pressure.

        Parameters
        ----------
        log_slip_rate : float
            Upper limit of the future :math:`\ln(V/V_*)`.
        states : tuple of float
            Current unknowns of the fluid.

        Returns
        -------
        float
            Upper bound on the pore pressure P. The base class returns infinity, because it does not
            define an upper bound.
        """
        return math.inf


#: Unknown for the pore pressure of the built-in fluids.
PORE_PRESSURE_QUANTITY = Quantity(
    "pore_pressure",
    r"$(p-p_\infty)/\sigma_*$",
    "1",
    "pore pressure minus the pressure of the surroundings",
    "sigma_*",
)


def declare_dilatancy_field(default: float) -> Any:
    """Declare the field ``dilatancy`` of a fluid.

    The value may be negative. If the dilatancy is negative, the pores close when the slip rate
    increases.

    Parameters
    ----------
    default : float
        Default value.

    Returns
    -------
    dataclasses.Field
        Field for a dataclass.
    """
    return number(
        default,
        r"$\epsilon/(\beta\sigma_*)$",
        "1",
        "decrease of pore pressure due to undrained dilatancy, per unit of ln V",
        "sigma_*",
    )


def declare_porosity_length_field() -> Any:
    """Declare the field ``porosity_length`` of a fluid.

    Returns
    -------
    dataclasses.Field
        Field for a dataclass, with a default of 1.
    """
    return number(
        1.0,
        r"$L_\varphi/D_c$",
        "1",
        "slip distance over which porosity evolves",
        "D_c",
        rule=POSITIVE,
        omit_if_default=True,
    )


def declare_drainage_field() -> Any:
    """Declare the field ``drainage`` of a fluid.

    Returns
    -------
    dataclasses.Field
        Field for a dataclass, with a default of 1.
    """
    return number(
        1.0,
        "$c^*D_c/V_*$",
        "1",
        "rate of pore pressure diffusion",
        "V_*/D_c",
        rule=POSITIVE,
        remedy="Without drainage, no steady state exists. For nearly undrained conditions, use "
        "a small value.",
    )


BUILT_IN_FLUID_CLASS_BY_NAME = discover_parts(__name__, __path__)
