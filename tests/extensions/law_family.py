"""A law with a number of its own: a family with the slip law at one end, the slowness law at the
other.
"""

import math
from dataclasses import dataclass

from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.slider.laws import Law
from rsfstudy.slider.parts import number

OWN = 0


def evolution(log_rate, state, p):
    b, exponent = p[OWN], p[OWN + 1]
    ahead = state / b + log_rate
    if exponent == 0.0:
        return -b * ahead
    return b * math.expm1(min(-exponent * ahead, 700.0)) / exponent


@dataclass(frozen=True, kw_only=True)
class Family(Law):
    law_exponent: float = number(
        0.5, r"$\epsilon$", "1", "exponent of the law", rule="must be 0 or greater"
    )

    name = "family"
    evolution = staticmethod(evolution)

    def numbers(self, scene):
        return (*super().numbers(scene), self.law_exponent)

    def check(self, scene):
        super().check(scene)
        if self.law_exponent > 1.0:
            raise InvalidValue("law_exponent", self.law_exponent, "must not exceed 1")


study = Study(
    name="family_of_laws",
    title="Critical displacement step between the slip and the slowness law",
    base=Scene(law=Family, normal_stress="constant", instability_norm=1e6),
    axes=[
        Axis("law_exponent", [0.0, 0.5, 1.0]),
        Axis("stiffness_ratio", [0.8, 1.5]),
    ],
    measure=CriticalStep(of="displacement_step"),
)
