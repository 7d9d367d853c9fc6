"""The slowness law with a state variable that shear stress reduces.

The stress dependence follows Nagata et al. (2012).

The variable ``Psi = Theta + c (mu - mu_*)`` evolves by the slowness law, and the state
effect defines the shift between Psi and Theta, and the slope of the shift. At constant
normal stress, the field ``stress_dependence`` of every law has the same effect.
"""

from dataclasses import dataclass

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import LinearStability
from rsfstudy.parts import LAW, MU_STAR, number
from rsfstudy.slider.laws.slowness import SlownessLaw


def stress_state_effect(friction, ratio, change, p):
    stress, c = p[MU_STAR] + friction, p[LAW + 1]
    return c * (stress / ratio - p[MU_STAR]), c * (1.0 - stress * change / ratio) / ratio


@dataclass(frozen=True, kw_only=True)
class StressWeakening(SlownessLaw):
    c: float = number(
        2.0, "$c$", "1", "stress effect on the state variable", rule="must be 0 or greater"
    )

    name = "stress_weakening"
    state_effect = staticmethod(stress_state_effect)

    def parameter_values(self, scene):
        return (*super().parameter_values(scene), self.c)


study = Study(
    name="stress_weakened",
    title="Critical stiffness where stress wears the state away",
    base=Scene(law=StressWeakening),
    axes=[
        Axis("normal_stress", ["constant", "variable"]),
        Axis("c", [0.0, 0.5, 2.0]),
    ],
    measure=LinearStability(),
)
