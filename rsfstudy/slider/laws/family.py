"""A family of laws between the slip law and the slowness law."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, Law, fast_expm1
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]`` and
    :math:`\epsilon` from ``p[LAW + 1]``.

    Notes
    -----
    The evolution is

    .. math::

        D_c \frac{d\Theta}{d\delta}
          = \frac{b}{\epsilon} \left\{\exp\left[-\epsilon \left(\frac{\Theta}{b}
          + \ln\frac{V}{V_*}\right)\right] - 1\right\}.

    The value :math:`\epsilon = 1` gives the slowness law. The limit :math:`\epsilon \to 0` is the
    slip law.

    References
    ----------
    Ciardo and Viesca (2024), arXiv 2407.16846.
    """
    b, exponent = p[LAW], p[LAW + 1]
    if exponent == 0.0:
        return -(state + b * log_slip_rate)
    return (
        b
        * fast_expm1(min(-exponent * (state / b + log_slip_rate), MAX_EXPONENT_IN_STATE_EVOLUTION))
        / exponent
    )


@dataclass(frozen=True, kw_only=True)
class SlipToSlownessLaw(Law):
    r"""Family of laws between the slip law and the slowness law.

    Parameters
    ----------
    law_exponent : float, default: 0.5
        Exponent :math:`\epsilon` from 0 (slip law) to 1 (slowness law).
    """

    law_exponent: float = number(
        0.5,
        r"$\epsilon$",
        "1",
        "exponent of the law: 0 is the slip law, 1 the slowness law",
        rule="must lie between 0 and 1",
    )

    name = "family"
    evolution = staticmethod(compute_state_evolution_per_slip)
    lacks_characteristic_slip_rate = True
    has_closed_orbits_at_critical_stiffness = (
        True  # The derivative dh/du = -(1 + eps h) is linear in h.
    )

    def state_relaxation_function(self, log_slip_rate: float, slip: float) -> float:
        r"""Compute the relaxation of stress at constant slip rate.

        See ``LawBase.state_relaxation_function``.

        Notes
        -----
        The relaxation is

        .. math::

            \frac{1}{\epsilon} \ln\left\{1
              + \left[\left(\frac{V}{V_*}\right)^\epsilon - 1\right] e^{-\delta/D_c}\right\}.
        """
        power = self.law_exponent * log_slip_rate
        if self.law_exponent == 0.0:
            return log_slip_rate * math.exp(-slip)
        return math.log(-math.expm1(-slip) + math.exp(power - slip)) / self.law_exponent

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return b and the exponent of the law.

        See ``Part.parameter_values``.
        """
        return (*super().parameter_values(scene), self.law_exponent)
