"""Critical steps of normal stress, displacement and velocity, as changes of stress."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy import Accuracy, Scene
from rsfstudy.critical_steps.forward_motion import is_linearly_stable
from rsfstudy.measures import CriticalStep, Measure, Outcome, Output, Status
from rsfstudy.motion import WorkMeter
from rsfstudy.slider import effective_friction

#: The triggers; the fall of normal stress comes first, which constant normal stress refuses.
_NORMAL_STRESS_FALL = CriticalStep(of="normal_stress_step", direction="down")
_DISPLACEMENT_STEP, _VELOCITY_STEP = (
    CriticalStep(of="displacement_step"),
    CriticalStep(of="load_velocity_ratio"),
)
TRIGGERS = (_NORMAL_STRESS_FALL, _DISPLACEMENT_STEP, _VELOCITY_STEP)


def _trigger_outputs(trigger: CriticalStep) -> tuple[Output, ...]:
    """Outputs of one critical step."""
    of = trigger.primary_output
    ended = f"status with which the search for a critical {trigger.of} ended, as its flag value"
    return (
        Output(of, error=True, optional=trigger is _VELOCITY_STEP),
        Output(f"{of}_stable"),
        Output(f"{of}_unstable"),
        Output(f"{of}_status", "", "1", ended),
    )


_SYMBOL = r"$\Delta\mathrm{CFS}/\sigma_*$"
#: Changes of stress, and ratios of them.
_STRESS_OUTPUTS = (
    Output(
        "coulomb_stress_of_displacement",
        _SYMBOL,
        "1",
        "change of Coulomb stress by the critical displacement step",
        "sigma_*",
        error=True,
    ),
    Output(
        "coulomb_stress_of_normal_stress",
        _SYMBOL,
        "1",
        "change of Coulomb stress by the critical fall of normal stress",
        "sigma_*",
        error=True,
    ),
    Output(
        "direct_stress_of_velocity",
        r"$a\,\ln(V_0/V_*)$",
        "1",
        "direct effect of the critical load point velocity step",
        "sigma_*",
        error=True,
        optional=True,
    ),
    Output(
        "coulomb_ratio",
        r"$\Delta\mathrm{CFS}_\sigma/\Delta\mathrm{CFS}_\delta$",
        "1",
        "change of Coulomb stress by the critical fall of normal stress over that by the critical "
        "displacement step",
        error=True,
    ),
    Output(
        "direct_ratio",
        r"$a\sigma_*\ln(V_0/V_*)/\Delta\mathrm{CFS}_\delta$",
        "1",
        "direct effect of the critical load point velocity step over the change of Coulomb stress "
        "by the critical displacement step",
        error=True,
        optional=True,
    ),
)
_OUTPUTS = (
    *_STRESS_OUTPUTS,
    Output("effective_friction", r"$\mu'$", "1", "effective friction of Coulomb stress"),
    *(about for trigger in TRIGGERS for about in _trigger_outputs(trigger)),
    Output("critical_stiffness"),
)


@dataclass(frozen=True)
class Triggers(Measure):
    """Critical fall of normal stress, critical displacement step and critical velocity step, with
    the changes of Coulomb stress that the first two are.

    After the first two the load point is held, unless the scene states its `load_velocity_ratio`,
    which the third looks for. Each is sought within a work budget of its own, as if it were asked
    for alone, and has its own status. One without a critical step leaves its number out, and says
    why in the message; the slider answers while the first two have theirs and none has failed.
    """

    name: ClassVar[str] = "triggers"
    primary_output = "coulomb_ratio"
    typical_work = 12_000
    outputs = _OUTPUTS
    needs_time: ClassVar[tuple[bool, ...]] = (False,)

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """As for a critical step."""
        return _NORMAL_STRESS_FALL.work_by_digits

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """One critical step after the other."""
        why = _reason_without_effective_friction(scene)
        coupling = scene.parts.normal_stress.coupling
        if why or coupling is None:
            return Outcome(Status.NOT_APPLICABLE, message=f"{why} has no one effective friction")
        found = {
            trigger: _find_critical_step(trigger, scene, accuracy, meter) for trigger in TRIGGERS
        }
        values: dict[str, float] = {}
        for trigger, outcome in found.items():
            numbers = {n: float(v) for n, v in outcome.values.items() if n in self.variables}
            values |= {n: v for n, v in numbers.items() if not math.isnan(v)}
            values[f"{trigger.primary_output}_status"] = float(outcome.status)
        values |= _trigger_stresses(scene, *coupling, values)
        told = [
            f"{trigger.of}: {outcome.message or outcome.status.label}"
            for trigger, outcome in found.items()
            if outcome.status is not Status.OK or outcome.message
        ]
        ends = [outcome.status for outcome in found.values()]
        failed = [end for end in ends if not end.is_answer]
        lacking = [found[trigger].status for trigger in (_NORMAL_STRESS_FALL, _DISPLACEMENT_STEP)]
        lacking = [end for end in lacking if end is not Status.OK]
        return Outcome(next(iter((*failed, *lacking)), Status.OK), values, "; ".join(told))


def _reason_without_effective_friction(scene: Scene) -> str:
    """Part of a scene that has no one effective friction mu', in words; empty where it is known."""
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    if stress.coupling is None or stress.normal_stress is None:
        return f"{stress.name} normal stress"
    if law.steady_states is not None and law.state_count == 1:
        return f"{law.name}, a law with a slip rate of its own,"
    return f"a fault that is {fluid.name}" if fluid.unknowns else ""


def _find_critical_step(
    trigger: CriticalStep, scene: Scene, accuracy: Accuracy, meter: WorkMeter
) -> Outcome:
    """A critical step, or the status of what ended the search. Where steady sliding at V_* is
    unstable, any step of velocity triggers.
    """
    if trigger is _VELOCITY_STEP and not is_linearly_stable(_without_steps(scene)):
        text = "steady sliding at V_* is unstable already"
        return Outcome(Status.UNSTABLE_AT_ANY_STEP, message=text)
    return trigger.run_nested(scene, accuracy, meter)


def _without_steps(scene: Scene) -> Scene:
    """The slider whose load point goes on at V_*."""
    return scene.with_(load_velocity_ratio=1.0, displacement_step=0.0, normal_stress_step=0.0)


def _trigger_stresses(
    scene: Scene, cot_phi: float, alpha: float, values: Mapping[str, float]
) -> dict[str, float]:
    """Triggers as changes of stress, and their ratios, with errors."""
    friction = effective_friction(scene.mu_star, scene.parts.law.b_over_a, alpha)
    pulled = _scale_with_error(
        scene.stiffness * (1.0 - friction * cot_phi), _DISPLACEMENT_STEP.primary_output, values
    )
    fallen = _scale_with_error(-friction, _NORMAL_STRESS_FALL.primary_output, values)
    velocity, error = _scale_with_error(scene.a, _VELOCITY_STEP.primary_output, values)
    ratio = velocity / scene.a
    faster = scene.a * math.log(ratio) if ratio > 0.0 else math.nan, error / ratio
    numbers = (
        pulled,
        fallen,
        faster,
        _quotient_with_error(fallen, pulled),
        _quotient_with_error(faster, pulled),
    )
    told = {"effective_friction": friction}
    for about, number in zip(_STRESS_OUTPUTS, numbers, strict=True):
        if not math.isnan(number[0]):
            told |= zip(about.variable_names, number, strict=True)
    return told


def _scale_with_error(factor: float, name: str, values: Mapping[str, float]) -> tuple[float, float]:
    """A number times a factor, and its error."""
    value, error = values.get(name, math.nan), values.get(f"{name}_error", math.nan)
    return factor * value, abs(factor) * error


def _quotient_with_error(
    above: tuple[float, float], below: tuple[float, float]
) -> tuple[float, float]:
    """A quotient and its error, which those of both add up to."""
    (value, error), (divisor, its_error) = above, below
    if not divisor:
        return math.nan, math.nan
    ratio = value / divisor
    return ratio, (error + abs(ratio) * its_error) / abs(divisor)
