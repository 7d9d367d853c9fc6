"""Effect of normal stress on the state variable (Linker and Dieterich 1992).

An increase in normal stress decreases the state variable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.parameter_layout import NORMAL_STRESS
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, NumericFunction, number


def compute_linker_dieterich_state_decrease(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: FloatTuple,
) -> tuple[float, float]:
    r"""Compute how much a change in normal stress decreases the state variable.

    See ``NormalStress.state_effect`` for the arguments. The function reads :math:`\alpha` from
    ``p[NORMAL_STRESS]``.

    Notes
    -----
    The integral of :math:`d\Theta = -\alpha \, d\sigma/\sigma` is

    .. math::

        \Theta = \Psi - \alpha \ln s, \quad \text{slope} = \frac{\alpha s'}{s}.

    The state :math:`\Psi` does not depend on normal stress, so :math:`\Psi` remains constant when
    normal stress changes suddenly.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """
    alpha = p[NORMAL_STRESS]
    return alpha * math.log(
        normal_stress_ratio
    ), alpha * normal_stress_derivative / normal_stress_ratio


@dataclass(frozen=True, kw_only=True)
class NormalStressWithStateEffect(NormalStress):
    r"""Base class of the normal stress conditions in which normal stress can change.

    Parameters
    ----------
    alpha : float, default: 0.56
        Coefficient :math:`\alpha` of the effect of normal stress on the state variable.
    """

    alpha: float = number(
        0.56, r"$\alpha$", "1", "normal stress effect on the state variable", rule=NON_NEGATIVE
    )

    @property
    def state_effect(self) -> NumericFunction | None:
        """Effect of normal stress on the state variable.

        The property is None if ``alpha`` is zero.
        """
        return compute_linker_dieterich_state_decrease if self.alpha else None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("linker_dieterich",) if self.alpha else ()
