"""Base class and steady-state function of the laws that have two state variables."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.laws import (
    MISSING_CRITICAL_STIFFNESS_REMEDY,
    LawBase,
    lacks_critical_stiffness,
)
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView

#: Indices of the law parameters in ``p``. The parameters are b of each state, the share of each
#: state in the effect of stress, and the ratio L_1/L_2 of the slip distances.
FIRST_B, SECOND_B, FIRST_SHARE, SECOND_SHARE, LENGTH_QUOTIENT = range(LAW, LAW + 5)


def compute_steady_states(
    log_slip_rate: float, stress_induced_state_shift: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute both state variables in steady sliding.

    See ``LawBase`` for the arguments.

    Notes
    -----
    If each state contributes a share :math:`c_i` of the total shift, the steady states are

    .. math::

        \Psi_i = c_i \, \mathrm{shift} - b_i \ln\frac{V}{V_*}.
    """
    return (
        p[FIRST_SHARE] * stress_induced_state_shift - p[FIRST_B] * log_slip_rate,
        p[SECOND_SHARE] * stress_induced_state_shift - p[SECOND_B] * log_slip_rate,
    )


@dataclass(frozen=True, kw_only=True)
class TwoStateLaw(LawBase):
    r"""Base class of the laws with two state variables.

    Each state has its own evolution effect parameter b. The first state evolves over the slip
    distance :math:`D_c`, and the second state evolves over :math:`L_2`. The default values are
    taken from Gu et al. (1984). Becker (2000) found chaotic motions for these values.

    Parameters
    ----------
    b1_over_a : float, default: 1.0
        Ratio :math:`b_1/a` of the evolution effect of the first state to the direct effect.
        Negative values are allowed.
    b2_over_a : float, default: 0.84
        Ratio :math:`b_2/a` of the evolution effect of the second state to the direct effect.
        Negative values are allowed.
    length_ratio : float, default: 1/0.048
        Ratio :math:`L_2/D_c` of the slip distances of the second and the first state.

    Notes
    -----
    The friction law is

    .. math::

        \tau = \sigma \left(\mu_* + a \ln\frac{V}{V_*} + \Theta_1 + \Theta_2\right).

    Effects of stress on the state, such as :math:`\alpha \ln(\sigma/\sigma_*)`, are divided between
    the two states in proportion to :math:`\lvert b_i \rvert`. Experiments do not constrain this
    choice. It makes two states with equal slip distances and coefficients :math:`b_i` of the same
    sign equivalent to a single state. The share of a state in the effect of stress never exceeds 1,
    even if :math:`b_1 + b_2` is small.

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88, 10359-10370; Gu, Rice, Ruina and Tse (1984), J. Mech. Phys.
    Solids 32, 167-196; Becker (2000), in AGU Geophys. Monogr. 120, 5-26.
    """

    b1_over_a: float = number(
        1.0, "$b_1/a$", "1", "evolution effect of the first state divided by the direct effect"
    )
    b2_over_a: float = number(
        0.84, "$b_2/a$", "1", "evolution effect of the second state divided by the direct effect"
    )
    length_ratio: float = number(
        1.0 / 0.048,
        "$L_2/D_c$",
        "1",
        "slip distance of the second state divided by the slip distance of the first state",
        rule=POSITIVE,
    )

    state_count = 2
    steady_states = staticmethod(compute_steady_states)

    @property
    def b_over_a(self) -> float:
        """Ratio of the total evolution effect to the direct effect."""
        return self.b1_over_a + self.b2_over_a

    @property
    def steady_state_change_per_log_rate_over_a(self) -> float:
        """Sum of the magnitudes of both evolution effects, divided by a."""
        return abs(self.b1_over_a) + abs(self.b2_over_a)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the parameters of both states and the length ratio.

        See ``Part.parameter_values``. The parameters of each state are its evolution effect
        parameter b and its share of the effect of stress. The last value is :math:`L_1/L_2`, the
        inverse of ``length_ratio``.
        """
        both, size = (self.b1_over_a, self.b2_over_a), self.steady_state_change_per_log_rate_over_a
        # If b is zero for both states, the shares are undefined. The method ``check`` rejects this
        # case.
        shares = (abs(b) / size if size else 0.5 for b in both)
        return (*(scene.a * b for b in both), *shares, 1.0 / self.length_ratio)

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: object) -> InvalidValue:
        """Return the error for a field that belongs to another law.

        See ``Part.build_field_rejection_error``. The error message for ``b_over_a`` names the two
        fields that replace ``b_over_a``.
        """
        if field_name == "b_over_a":
            rule = (
                f"cannot be set for law={cls.name!r}, because b_over_a is the sum of b1_over_a and "
                "b2_over_a"
            )
            return InvalidValue(field_name, value, rule, remedy="Pass b1_over_a and b2_over_a.")
        return super().build_field_rejection_error(field_name, value)

    def check(self, scene: SceneView) -> None:
        """Check that a state affects friction and that the critical stiffness exists.

        See ``Part.check``. The critical stiffness is required only if the stiffness is given by
        ``stiffness_ratio``.
        """
        super().check(scene)
        if not self.steady_state_change_per_log_rate_over_a:
            rule = (
                "must not be 0 if b1_over_a is 0, because otherwise no state variable "
                "affects friction"
            )
            raise self.build_field_error(
                "b2_over_a", rule, "Pass a nonzero value for b1_over_a or b2_over_a."
            )
        if lacks_critical_stiffness(scene):
            rule = (
                "cannot be used with stiffness_ratio, because no critical stiffness exists for "
                f"this value, b1_over_a = {self.b1_over_a:g} and "
                f"length_ratio = {self.length_ratio:g}"
            )
            raise self.build_field_error("b2_over_a", rule, MISSING_CRITICAL_STIFFNESS_REMEDY)
