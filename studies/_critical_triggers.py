"""Critical steps of normal stress, displacement and velocity.

The measure ``Triggers`` computes the three critical steps of a scene and converts them to stress
changes, so that the triggers can be compared.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy import Scene
from rsfstudy.critical_steps.stability_after_step import is_linearly_stable
from rsfstudy.measures import CriticalStep, Measure, Outcome, Output, Status
from rsfstudy.motion import Integrator
from rsfstudy.slider import compute_coulomb_effective_friction

#: Triggers in the order of computation. The decrease of normal stress comes first, because a scene
#: with constant normal stress rejects a step of normal stress.
_NORMAL_STRESS_FALL = CriticalStep(of="normal_stress_step", direction="down")
_DISPLACEMENT_STEP, _VELOCITY_STEP = (
    CriticalStep(of="displacement_step"),
    CriticalStep(of="load_velocity_ratio"),
)
TRIGGERS = (_NORMAL_STRESS_FALL, _DISPLACEMENT_STEP, _VELOCITY_STEP)


def _trigger_outputs(trigger: CriticalStep) -> tuple[Output, ...]:
    """Return the outputs that describe the search for a critical step."""
    of = trigger.primary_output
    ended = f"status of the search for the critical {trigger.of}, as a flag value"
    return (
        Output(of, error=True, optional=trigger is _VELOCITY_STEP),
        Output(f"{of}_stable"),
        Output(f"{of}_unstable"),
        Output(f"{of}_status", "", "1", ended),
    )


_SYMBOL = r"$\Delta\mathrm{CFS}/\sigma_*$"
#: Outputs for the stress changes and their ratios.
_STRESS_OUTPUTS = (
    Output(
        "coulomb_stress_of_displacement",
        _SYMBOL,
        "1",
        "Coulomb stress change of the critical displacement step",
        "sigma_*",
        error=True,
    ),
    Output(
        "coulomb_stress_of_normal_stress",
        _SYMBOL,
        "1",
        "Coulomb stress change of the critical normal stress decrease",
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
        "Coulomb stress change of the critical normal stress decrease divided by that of the "
        "critical displacement step",
        error=True,
    ),
    Output(
        "direct_ratio",
        r"$a\sigma_*\ln(V_0/V_*)/\Delta\mathrm{CFS}_\delta$",
        "1",
        "direct effect of the critical load point velocity step over the Coulomb stress change "
        "of the critical displacement step",
        error=True,
        optional=True,
    ),
)
_OUTPUTS = (
    *_STRESS_OUTPUTS,
    Output(
        "effective_friction", r"$\mu'$", "1", "effective friction coefficient of the Coulomb stress"
    ),
    *(about for trigger in TRIGGERS for about in _trigger_outputs(trigger)),
    Output("critical_stiffness"),
)


@dataclass(frozen=True)
class Triggers(Measure):
    """Critical decrease of normal stress, displacement step and velocity step.

    The results include the critical steps and the corresponding stress changes. Decreases of normal
    stress and displacement steps are converted to changes of Coulomb stress. Velocity steps are
    converted to the stress change that the direct effect causes.

    After a decrease of normal stress or a displacement step, the load point does not move, unless
    the scene specifies ``load_velocity_ratio``. The search for each critical step has a separate
    work budget and a separate status. If a critical step does not exist, the message explains the
    reason. If a search fails, the outcome has the status of the first failed search. If no search
    fails, the outcome is successful if both a critical decrease of normal stress and a critical
    displacement step exist. A critical velocity step is not required.
    """

    name: ClassVar[str] = "triggers"
    primary_output = "coulomb_ratio"
    typical_rhs_evaluations = 12_000
    outputs = _OUTPUTS
    needs_time: ClassVar[tuple[bool, ...]] = (False,)

    @property
    def relative_cost_by_digits(self) -> Mapping[float, float]:
        """Relative cost of the computation for each requested number of digits."""
        return _NORMAL_STRESS_FALL.relative_cost_by_digits

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the critical steps and the corresponding stress changes.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome with the status ``not_applicable`` if the scene has no effective friction.
        """
        why = _reason_without_effective_friction(scene)
        coupling = scene.parts.normal_stress.coupling
        if why or coupling is None:
            return Outcome(
                Status.NOT_APPLICABLE, message=f"{why} has no unique effective friction coefficient"
            )
        found = {trigger: _find_critical_step(trigger, scene, integrator) for trigger in TRIGGERS}
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
    """Return the scene component that makes the effective friction undefined.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.

    Returns
    -------
    str
        Description of the scene component. The string is empty if the effective friction is
        defined.
    """
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    if stress.coupling is None or stress.normal_stress is None:
        return f"{stress.name} normal stress"
    if law.steady_states is not None and law.state_count == 1:
        return f"{law.name}, a law with a slip rate of its own,"
    return f"a fault that is {fluid.name}" if fluid.unknowns else ""


def _find_critical_step(trigger: CriticalStep, scene: Scene, integrator: Integrator) -> Outcome:
    """Find a critical step.

    If steady sliding at V_* is unstable, every velocity step triggers an instability, and the
    search is skipped.

    Parameters
    ----------
    trigger : CriticalStep
        Critical step to search for.
    scene : Scene
        Parameters of the slider.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    Outcome
        Outcome of the search.
    """
    if trigger is _VELOCITY_STEP and not is_linearly_stable(_without_steps(scene)):
        text = "steady sliding at V_* is unstable already"
        return Outcome(Status.UNSTABLE_AT_ANY_STEP, message=text)
    return trigger.run_nested(scene, integrator)


def _without_steps(scene: Scene) -> Scene:
    """Return the scene without steps and with a load point velocity of V_*."""
    return scene.with_(load_velocity_ratio=1.0, displacement_step=0.0, normal_stress_step=0.0)


def _trigger_stresses(
    scene: Scene, cot_phi: float, alpha: float, values: Mapping[str, float]
) -> dict[str, float]:
    r"""Convert the critical steps to stress changes.

    The change of Coulomb stress is :math:`\Delta\tau - \mu'\,\Delta\sigma` with the effective
    friction :math:`\mu' = \mu_* - \alpha\,(1 - a/b)`. The direct effect of a velocity step is
    :math:`a\,\ln(V_0/V_*)`.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.
    cot_phi : float
        Derivative of normal stress with respect to shear stress.
    alpha : float
        Effect of normal stress on the state.
    values : mapping
        Critical steps and their errors.

    Returns
    -------
    dict
        Stress changes in sigma_*, ratios of stress changes, and errors of all values.
    """
    friction = compute_coulomb_effective_friction(scene.mu_star, scene.parts.law.b_over_a, alpha)
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
    """Return the product of a result and a factor, and the error of the product."""
    value, error = values.get(name, math.nan), values.get(f"{name}_error", math.nan)
    return factor * value, abs(factor) * error


def _quotient_with_error(
    above: tuple[float, float], below: tuple[float, float]
) -> tuple[float, float]:
    r"""Return the quotient of two results, and the error of the quotient.

    The error of a quotient is absolute: :math:`(\Delta x + |x/y|\,\Delta y)/|y|` for a quotient
    :math:`x/y`.
    """
    (value, error), (divisor, its_error) = above, below
    if not divisor:
        return math.nan, math.nan
    ratio = value / divisor
    return ratio, (error + abs(ratio) * its_error) / abs(divisor)
