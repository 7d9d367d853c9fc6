"""A user-defined law with one parameter, whose state evolution saturates.

A larger ``sharpness`` moves the saturation closer to steady sliding. A sharpness of 0 is
the slip law.
"""

import math
from dataclasses import dataclass

from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import CriticalStep
from rsfstudy.parts import LAW, Law, number


def evolution(log_slip_rate, state, p):
    b, sharpness = p[LAW], p[LAW + 1]
    ahead = state / b + log_slip_rate
    if sharpness == 0.0:
        return -b * ahead
    return -b * math.tanh(sharpness * ahead) / sharpness


@dataclass(frozen=True, kw_only=True)
class SaturatingLaw(Law):
    sharpness: float = number(0.5, "$n$", "1", "sharpness of the law", rule="must be 0 or greater")

    name = "saturating"
    evolution = staticmethod(evolution)

    def check(self, scene):
        super().check(scene)
        if self.sharpness > 1.0:
            raise InvalidValue("sharpness", self.sharpness, "must not exceed 1")


study = Study(
    name="saturating_laws",
    title="Critical displacement step where evolution saturates",
    base=Scene(law=SaturatingLaw, normal_stress="constant", instability_norm=1e6),
    axes=[
        Axis("sharpness", [0.0, 0.5, 1.0]),
        Axis("stiffness_ratio", [0.8, 1.5]),
    ],
    measure=CriticalStep(of="displacement_step"),
)
