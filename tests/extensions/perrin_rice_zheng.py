"""A law of state evolution: that of Perrin, Rice and Zheng (1995), symmetric about steady sliding.

``dtheta/dt = 1 - (theta V/(2 D_c))**2`` is ``dTheta = -b sinh(Theta/b + ln V)`` per slip in D_c.
"""

import math
from dataclasses import dataclass

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.slider.laws import Law

OWN = 0
#: Only trial steps, which the integrator rejects, go further from steady sliding.
FARTHEST = 300.0


def evolution(log_rate, state, p):
    b = p[OWN]
    return -b * math.sinh(max(-FARTHEST, min(state / b + log_rate, FARTHEST)))


@dataclass(frozen=True, kw_only=True)
class PerrinRiceZheng(Law):
    name = "perrin_rice_zheng"
    evolution = staticmethod(evolution)


study = Study(
    name="symmetric_law",
    title="Critical displacement step of a law that is symmetric about steady sliding",
    base=Scene(normal_stress="constant", instability_norm=1e6),
    axes=[
        Axis("law", ["slip", PerrinRiceZheng]),
        Axis("stiffness_ratio", [0.5, 1.0, 2.0]),
    ],
    measure=CriticalStep(of="displacement_step"),
)
