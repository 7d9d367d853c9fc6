"""A user-defined loading that holds the load point, and a measure of it."""

from dataclasses import dataclass

from rsfstudy import Axis, Scene, Segment, Study
from rsfstudy.measures import Measure, Outcome, Output, Status
from rsfstudy.motion import EventKind, maximum
from rsfstudy.parts import Loading, number


@dataclass(frozen=True, kw_only=True)
class HoldAndReload(Loading):
    rest_time: float = number(
        100.0, "$t_h$", "1", "hold time", rule="must be greater than 0", scale="D_c/V_*"
    )

    name = "hold_and_reload"

    @property
    def segments(self):
        return Segment(load_velocity=0.0, duration=self.rest_time), Segment(load_velocity=1.0)


@dataclass(frozen=True)
class PeakAfterRest(Measure):
    name = "peak_after_rest"
    primary_output = "peak_stress"
    outputs = (
        Output("peak_stress", "", "1", "rise of stress to its peak", "sigma_*", error=True),
        Output("relaxation", "", "1", "change of stress during the hold", "sigma_*"),
    )
    typical_rhs_evaluations = 4_000

    def compute(self, scene, integrator):
        (left, peak), (_left, again) = (
            self.read(scene, each) for each in (integrator, integrator.refined())
        )
        error = integrator.estimate_error(peak, again, 0.01)
        values = {"peak_stress": peak, "peak_stress_error": error, "relaxation": left}
        return Outcome(Status.OK, values)

    def read(self, scene, integrator):
        motion = integrator.follow(scene, [maximum("spring_stress")])
        reload = next(event for event in motion if event.kind is EventKind.SEGMENT_START)
        peak = next(event for event in motion if event.kind is EventKind.MAXIMUM)
        return reload.point.spring_stress, peak.point.spring_stress


study = Study(
    name="holds",
    title="Healing during holds",
    base=Scene(
        law="slowness", normal_stress="constant", loading=HoldAndReload, stiffness_ratio=3.0
    ),
    axes=[Axis("rest_time", [1e4, 1e6])],
    measure=PeakAfterRest(),
)
