"""A user-defined law that is steep away from steady sliding.

The law is symmetric about steady sliding.

The state evolves by ``dTheta = -(b/2) sinh[2 (Theta/b + ln V)]`` per slip of D_c.
"""

import math
from dataclasses import dataclass

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.parts import LAW, Law

#: Only trial steps that the integrator rejects are further away from steady sliding.
FARTHEST = 300.0


def evolution(log_slip_rate, state, p):
    b = p[LAW]
    return -0.5 * b * math.sinh(2.0 * max(-FARTHEST, min(state / b + log_slip_rate, FARTHEST)))


@dataclass(frozen=True, kw_only=True)
class SteepLaw(Law):
    name = "steep"
    evolution = staticmethod(evolution)


study = Study(
    name="steep_law",
    title="Critical displacement step of a law that is steep away from steady sliding",
    base=Scene(normal_stress="constant", instability_norm=1e6),
    axes=[
        Axis("law", ["slip", SteepLaw]),
        Axis("stiffness_ratio", [0.5, 1.0, 2.0]),
    ],
    measure=CriticalStep(of="displacement_step"),
)
