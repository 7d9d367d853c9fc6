"""A measure in seconds: the e-folding time of the slip rate under loading."""

from dataclasses import dataclass
from typing import ClassVar

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import Measure, Outcome, Output, Status


@dataclass(frozen=True)
class LoadingTime(Measure):
    name: ClassVar[str] = "loading_time"
    primary_output = "loading_time"
    outputs = (Output("loading_time", "$t_a$", "s", "time in which loading speeds slip up"),)
    typical_rhs_evaluations = 1

    def compute(self, scene, integrator):
        stressing = scene.stiffness * scene.load_velocity * scene.reference_rate
        return Outcome(Status.OK, {"loading_time": scene.a / stressing})


study = Study(
    name="loading_times",
    title="How long loading takes",
    base=Scene(normal_stress="constant"),
    axes=[Axis("load_velocity_ratio", [1, 10, 100])],
    measure=LoadingTime(),
)
