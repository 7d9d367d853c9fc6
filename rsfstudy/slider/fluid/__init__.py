"""The fluid in the pores of the fault, one file a case.

Stress is in units of the effective normal stress sigma_* = sigma - p_inf of steady sliding at V_*,
and pore pressure is P = (p - p_inf)/sigma_*: no part needs p_inf itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.parts import Numbers, Part, found_in
from rsfstudy.slider.requirements import PORE_PRESSURE, SLIP_RATE


@dataclass(frozen=True, kw_only=True)
class Fluid(Part):
    """Base of the cases of pore fluid.

    A case with unknowns of its own says what they are, pore pressure P last, and states

    - ``auxiliary_rates(log_slip_rate, states, fraction, p)``: their changes per unit slip in D_c,
      times a fraction;
    - ``auxiliary_steady_states(log_slip_rate, p)``: what they are in steady sliding, where P is 0.

    A case may list unknowns in `excluded_from_distance`. The distance from steady sliding, by which
    a motion settles or a cycle repeats, then leaves them out. This is meant for unknowns whose
    steady values are huge at the slip rate of a rupture.
    """

    conclusions = ("highest_pressure",)
    equations = frozenset({"auxiliary_rates", "numbers"})
    receives = frozenset({SLIP_RATE, PORE_PRESSURE})

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


PARTS = found_in(__name__, __path__)
