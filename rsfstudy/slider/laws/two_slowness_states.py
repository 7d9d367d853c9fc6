"""The slowness (ageing) law with two state variables."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, fast_expm1
from rsfstudy.slider.laws._two_states import (
    FIRST_B,
    FIRST_SHARE,
    LENGTH_QUOTIENT,
    SECOND_B,
    SECOND_SHARE,
    TwoStateLaw,
)
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView


def compute_state_evolutions(
    log_slip_rate: float,
    states: FloatTuple,
    stress_induced_state_shift: float,
    slip_per_independent_variable: float,
    p: FloatTuple,
) -> FloatTuple:
    r"""Compute the evolution of both states at constant normal stress.

    See ``LawBase`` for the arguments.

    Notes
    -----
    With :math:`L_1 = D_c`, the law and its state variables are

    .. math::

        \frac{d\theta_i}{dt} = 1 - \frac{\theta_i V}{L_i}, \quad
          \Theta_i = b_i \ln\frac{\theta_i V_*}{L_i}.

    The evolution per unit slip is

    .. math::

        L_i \frac{d\Theta_i}{d\delta}
          = b_i \left\{\exp\left[-\left(\frac{\Theta_i}{b_i}
          + \ln\frac{V}{V_*}\right)\right] - 1\right\}.
    """
    first = (states[0] - p[FIRST_SHARE] * stress_induced_state_shift) / p[FIRST_B] + log_slip_rate
    second = (states[1] - p[SECOND_SHARE] * stress_induced_state_shift) / p[
        SECOND_B
    ] + log_slip_rate
    return (
        slip_per_independent_variable
        * p[FIRST_B]
        * fast_expm1(min(-first, MAX_EXPONENT_IN_STATE_EVOLUTION)),
        slip_per_independent_variable
        * p[LENGTH_QUOTIENT]
        * p[SECOND_B]
        * fast_expm1(min(-second, MAX_EXPONENT_IN_STATE_EVOLUTION)),
    )


@dataclass(frozen=True, kw_only=True)
class TwoStateSlownessLaw(TwoStateLaw):
    """Slowness (ageing) law with two state variables.

    The fields are described in the base class ``TwoStateLaw``.
    """

    name = "two_slowness_states"
    evolutions = staticmethod(compute_state_evolutions)

    def check(self, scene: SceneView) -> None:
        """Check that the parameter b of each state is nonzero.

        See ``Part.check``. A state with b = 0 is rejected, because the evolution equations divide
        by b.
        """
        for name in ("b1_over_a", "b2_over_a"):
            if not getattr(self, name):
                remedy = "For a single state variable, set law='slowness'."
                raise InvalidValue(name, 0.0, "must not be 0", remedy=remedy)
        super().check(scene)
