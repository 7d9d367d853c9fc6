"""Two states with slip distances of their own, which laws of different evolution share."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.laws import STIFFNESS_REMEDY, LawBase, lacks_critical_stiffness
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import POSITIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView

#: Places of the numbers of the law: b of each state, the part each has in what stress takes from
#: the state variable, and L_1/L_2.
FIRST_B, SECOND_B, FIRST_SHARE, SECOND_SHARE, LENGTH_QUOTIENT = range(LAW, LAW + 5)


def steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
    """The states of steady sliding, ``Psi_i = c_i shift - b_i ln(V/V_*)``, c_i being the shares."""
    return (
        p[FIRST_SHARE] * shift - p[FIRST_B] * log_slip_rate,
        p[SECOND_SHARE] * shift - p[SECOND_B] * log_slip_rate,
    )


@dataclass(frozen=True, kw_only=True)
class TwoStateLaw(LawBase):
    """Base of the laws of two states, tau = sigma (mu_* + a ln(V/V_*) + Theta_1 + Theta_2), each
    with a b of its own; the first evolves over D_c, the second over L_2.

    What stress takes from the state variable, such as alpha ln s, it takes from the two in the
    shares |b_i|/(|b_1| + |b_2|). That is a choice, which experiments do not decide: with it two
    states of one sign and one length are one, and no share exceeds 1 where b_1 + b_2 is small. The
    default numbers are those of Gu et al. (1984), which Becker (2000) found to be chaotic.

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88, 10359-10370; Gu, Rice, Ruina and Tse (1984), J. Mech. Phys.
    Solids 32, 167-196; Becker (2000), in AGU Geophys. Monogr. 120, 5-26.
    """

    b1_over_a: float = number(
        1.0, "$b_1/a$", "1", "evolution effect of the first state over direct effect"
    )
    b2_over_a: float = number(
        0.84, "$b_2/a$", "1", "evolution effect of the second state over direct effect"
    )
    length_ratio: float = number(
        1.0 / 0.048,
        "$L_2/D_c$",
        "1",
        "slip distance of the second state over that of the first",
        rule=POSITIVE,
    )

    state_count = 2
    steady_states = staticmethod(steady_states)

    @property
    def b_over_a(self) -> float:
        return self.b1_over_a + self.b2_over_a

    @property
    def state_change_over_a(self) -> float:
        return abs(self.b1_over_a) + abs(self.b2_over_a)

    def numbers(self, scene: SceneView) -> Numbers:
        """b_1, b_2, their shares in what stress takes, and L_1/L_2."""
        both, size = (self.b1_over_a, self.b2_over_a), self.state_change_over_a
        # of two states without effect there are no shares: see `check`
        shares = (abs(b) / size if size else 0.5 for b in both)
        return (*(scene.a * b for b in both), *shares, 1.0 / self.length_ratio)

    @classmethod
    def rejection_error(cls, name: str, value: object) -> InvalidValue:
        if name == "b_over_a":
            rule = f"is b1_over_a + b2_over_a for {cls.name}, and follows from them"
            return InvalidValue(name, value, rule, remedy="Give those.")
        return super().rejection_error(name, value)

    def check(self, scene: SceneView) -> None:
        """States that do something, and a critical stiffness where the spring is given by its ratio
        to it.
        """
        super().check(scene)
        if not self.state_change_over_a:
            rule = "must not be 0 where b1_over_a is: no state has an effect"
            raise self.field_error("b2_over_a", rule, "Give one of them.")
        if lacks_critical_stiffness(scene):
            rule = (
                f"with b1_over_a = {self.b1_over_a:g} and length_ratio = {self.length_ratio:g} "
                "gives no critical stiffness"
            )
            raise self.field_error("b2_over_a", rule, STIFFNESS_REMEDY)
