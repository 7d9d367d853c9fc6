"""The fluid in the pores of the fault, one file a case.

Stress is in units of the effective normal stress sigma_* = sigma - p_inf of steady sliding at V_*,
and pore pressure is P = (p - p_inf)/sigma_*: no part needs p_inf itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.parts import Numbers, Part, discover_parts
from rsfstudy.slider.requirements import PORE_PRESSURE, SLIP_RATE


@dataclass(frozen=True, kw_only=True)
class Fluid(Part):
    """Base class of all pore fluid cases.

    A case with unknowns declares them in ``unknowns``, with pore pressure P as the last unknown.
    Such a case defines two functions:

    - ``auxiliary_rates(log_slip_rate, states, fraction, p)`` returns the changes of the unknowns
      per unit slip in D_c, multiplied by a fraction.
    - ``auxiliary_steady_states(log_slip_rate, p)`` returns the unknowns in steady sliding, where P
      is zero.

    The distance from steady sliding determines if a motion has settled and if a cycle repeats. A
    case can exclude unknowns from this distance by listing their names in
    ``excluded_from_distance``. Exclude an unknown if its steady value at the slip rate of a rupture
    is extremely large.
    """

    derived_properties = ("highest_pressure",)
    defining_methods = frozenset({"auxiliary_rates", "numbers"})
    received_quantities = frozenset({SLIP_RATE, PORE_PRESSURE})

    def highest_pressure(self, log_slip_rate: float, states: Numbers) -> float:
        """Bound of pore pressure from now on, while ln(V/V_*) is at most `log_slip_rate`; infinite
        where none is known.

        Parameters
        ----------
        log_slip_rate : float
            ln(V/V_*).
        states : tuple of float
            The unknowns of the fluid now.
        """
        return math.inf


BUILT_IN_PARTS = discover_parts(__name__, __path__)
