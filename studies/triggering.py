"""Triggering: critical steps of normal stress, displacement and velocity as changes of stress, and
whether a change of Coulomb stress predicts one from the other.

A change of Coulomb stress is ``dtau - mu' dsigma``. A displacement step of the load point changes
shear stress by K d, and normal stress by cot(phi) times that; a step of imposed normal stress, or
of sigma_3, changes nothing else. To first order in k/k_cr both trigger at the same change of
Coulomb stress, with mu' = mu_* - alpha (1 - a/b), by every law that falls with Theta/b + ln V. A
step of load point velocity changes no stress at once; it is compared by that by which friction at
V_0 exceeds friction at V_* before the state has changed, a ln(V_0/V_*).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import xarray as xr

from rsfstudy import Axis, Scene, Study
from rsfstudy.analysis.swing import settles
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Draw, Figure, Panel, level, reference_line
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Meter
from rsfstudy.quantity import Output
from rsfstudy.reduce import LinearFit
from rsfstudy.slider.closed_forms import effective_friction, normal_stress_step
from rsfstudy.status import Status

from ._paper import REFERENCE

#: The triggers; the fall of normal stress comes first, which constant normal stress refuses.
_FALL = CriticalStep(of="normal_stress_step", direction="down")
_PULL, _FASTER = CriticalStep(of="displacement_step"), CriticalStep(of="load_velocity_ratio")
TRIGGERS = (_FALL, _PULL, _FASTER)


def _of_trigger(trigger: CriticalStep) -> tuple[Output, ...]:
    """Outputs of one critical step."""
    of = trigger.headline
    ended = f"status with which the search for a critical {trigger.of} ended, as its flag value"
    return (
        Output(of, error=True, optional=trigger is _FASTER),
        Output(f"{of}_stable"),
        Output(f"{of}_unstable"),
        Output(f"{of}_status", "", "1", ended),
    )


_SYMBOL = r"$\Delta\mathrm{CFS}/\sigma_*$"
#: Changes of stress, and ratios of them.
_STRESSES = (
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
    *_STRESSES,
    Output("effective_friction", r"$\mu'$", "1", "effective friction of Coulomb stress"),
    *(about for trigger in TRIGGERS for about in _of_trigger(trigger)),
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
    headline = "coulomb_ratio"
    typical_work = 12_000
    outputs = _OUTPUTS
    clocks: ClassVar[tuple[bool, ...]] = (False,)

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """As for a critical step."""
        return _FALL.work_by_digits

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """One critical step after the other."""
        why = _without_effective_friction(scene)
        coupling = scene.parts.normal_stress.coupling
        if why or coupling is None:
            return Outcome(Status.NOT_APPLICABLE, message=f"{why} has no one effective friction")
        found = {trigger: _found(trigger, scene, accuracy, meter) for trigger in TRIGGERS}
        values: dict[str, float] = {}
        for trigger, outcome in found.items():
            numbers = {n: float(v) for n, v in outcome.values.items() if n in self.variables}
            values |= {n: v for n, v in numbers.items() if not math.isnan(v)}
            values[f"{trigger.headline}_status"] = float(outcome.status)
        values |= _stresses(scene, *coupling, values)
        told = [
            f"{trigger.of}: {outcome.message or outcome.status.label}"
            for trigger, outcome in found.items()
            if outcome.status is not Status.OK or outcome.message
        ]
        ends = [outcome.status for outcome in found.values()]
        failed = [end for end in ends if not end.is_answer]
        lacking = [found[trigger].status for trigger in (_FALL, _PULL)]
        lacking = [end for end in lacking if end is not Status.OK]
        return Outcome(next(iter((*failed, *lacking)), Status.OK), values, "; ".join(told))


def _without_effective_friction(scene: Scene) -> str:
    """Part of a scene that has no one effective friction mu', in words; empty where it is known."""
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    if stress.coupling is None or stress.normal_stress is None:
        return f"{stress.name} normal stress"
    if law.steady_states is not None and law.states == 1:
        return f"{law.name}, a law with a slip rate of its own,"
    return f"a fault that is {fluid.name}" if fluid.unknowns else ""


def _found(trigger: CriticalStep, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
    """A critical step, or the status of what ended the search. Where steady sliding at V_* is
    unstable, any step of velocity triggers.
    """
    if trigger is _FASTER and not settles(_undisturbed(scene)):
        text = "steady sliding at V_* is unstable already"
        return Outcome(Status.UNSTABLE_AT_ANY_STEP, message=text)
    return trigger.charged(scene, accuracy, meter)


def _undisturbed(scene: Scene) -> Scene:
    """The slider whose load point goes on at V_*."""
    return scene.with_(load_velocity_ratio=1.0, displacement_step=0.0, normal_stress_step=0.0)


def _stresses(
    scene: Scene, cot_phi: float, alpha: float, values: Mapping[str, float]
) -> dict[str, float]:
    """Triggers as changes of stress, and their ratios, with errors."""
    friction = effective_friction(scene.mu_star, scene.parts.law.b_over_a, alpha)
    pulled = _times(scene.stiffness * (1.0 - friction * cot_phi), _PULL.headline, values)
    fallen = _times(-friction, _FALL.headline, values)
    velocity, error = _times(scene.a, _FASTER.headline, values)
    ratio = velocity / scene.a
    faster = scene.a * math.log(ratio) if ratio > 0.0 else math.nan, error / ratio
    numbers = (pulled, fallen, faster, _quotient(fallen, pulled), _quotient(faster, pulled))
    told = {"effective_friction": friction}
    for about, number in zip(_STRESSES, numbers, strict=True):
        if not math.isnan(number[0]):
            told |= zip(about.names, number, strict=True)
    return told


def _times(factor: float, name: str, values: Mapping[str, float]) -> tuple[float, float]:
    """A number times a factor, and its error."""
    value, error = values.get(name, math.nan), values.get(f"{name}_error", math.nan)
    return factor * value, abs(factor) * error


def _quotient(above: tuple[float, float], below: tuple[float, float]) -> tuple[float, float]:
    """A quotient and its error, which those of both add up to."""
    (value, error), (divisor, its_error) = above, below
    if not divisor:
        return math.nan, math.nan
    ratio = value / divisor
    return ratio, (error + abs(ratio) * its_error) / abs(divisor)


base = Scene(b_over_a=2.0)

PLAIN, IMPOSED = "imposed, alpha = 0", "imposed, alpha = 0.56"
WEAK, STRONG = "inclined, alpha = 0.25", "inclined, alpha = 0.56"
CASES: dict[str, dict[str, str | float]] = {
    PLAIN: {"normal_stress": "imposed", "alpha": 0.0},
    IMPOSED: {"normal_stress": "imposed", "alpha": 0.56},
    WEAK: {"normal_stress": "variable", "alpha": 0.25, "phi": 60.0},
    STRONG: {"normal_stress": "variable", "alpha": 0.56, "phi": 60.0},
}
EXPONENTS = {"slip": 0.0, "slowness": 1.0}
HELD = "load point held: u begins at mu_* (q-1)/a - alpha (1/a - 1/b) ln q, threshold h(u*) = -q k^"

#: alpha = 0.56 at b/a = 2.
FRICTION = effective_friction(base.mu_star, base.b_over_a, 0.56)
TAKEN = base.mu_star - FRICTION


def closed_form(law: str, alpha: float, ratio: float, within: float, reason: str) -> Claim:
    """N1: the critical fall of normal stress."""
    published = normal_stress_step(
        base.mu_star, base.a, base.b_over_a, alpha, EXPONENTS[law], ratio
    )
    return Claim(
        id="N1",
        statement=f"{law} law, imposed, alpha = {alpha:g}, k = {ratio:g} k_cr: critical fall",
        source=f"{HELD}, q = sigma_*/sigma, k^ = k/k_cr",
        variable="critical_normal_stress_step",
        where={
            "law": law,
            "case": IMPOSED if alpha else PLAIN,
            "stiffness_ratio": ratio,
        },
        published=published,
        tolerance=within * abs(published),
        reason=reason,
    )


def limit(law: str, case: str) -> Claim:
    """N2: the Coulomb limit."""
    return Claim(
        id="N2",
        statement=f"{law} law, {case}, k = 0.05 k_cr: falls and displacements trigger at the same "
        "change of Coulomb stress",
        source="mu' = mu_* - alpha (1 - a/b), to first order in k/k_cr",
        variable="coulomb_ratio",
        where={"law": law, "case": case, "stiffness_ratio": 0.05},
        published=1.0,
        tolerance=1e-3,
        reason="the second order: less than 0.02 k/k_cr in all of them",
    )


def weaker(law: str) -> Claim:
    """N3: what Linker and Dieterich's effect does."""
    where = {"law": law, "stiffness_ratio": 0.5}
    return Claim(
        id="N3",
        statement=f"{law} law, imposed, k = 0.5 k_cr: with alpha = 0.56 a larger fall is needed",
        source="Linker and Dieterich (1992): a fall of normal stress strengthens the state",
        variable="critical_normal_stress_step",
        where={**where, "case": IMPOSED},
        minus={**where, "case": PLAIN},
        relation="below",
        published=-0.5 * base.a * (0.5 / FRICTION - 0.5 / base.mu_star),
        reason="an inequality: by more than half of what the first order says",
    )


EXACT = "its error estimate, to 1.2e-9 of it, and what a finite norm leaves, no more than that"


X = "stiffness_ratio"
FALL, PULL, FASTER = (
    "coulomb_stress_of_normal_stress",
    "coulomb_stress_of_displacement",
    "direct_stress_of_velocity",
)
RUN: dict[str, Any] = {"linestyle": "-", "marker": "x", "markersize": 3.5, "linewidth": 0.5}
PULLED: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 6.0,
    "markeredgewidth": 0.6,
    "fillstyle": "none",
}


def beside(variable: str, name: str, style: dict[str, Any], over: str | None = None) -> Draw:
    """Curves beside falls of normal stress, in their colours; over a number of the scene."""

    def mark(dataset: xr.Dataset, axes: Axes) -> None:
        from rsfstudy.plots import in_grey, look

        values = dataset[variable] / (dataset[over] if over else 1.0)
        for number in range(values.sizes["case"]):
            row = values.isel(case=number)
            axes.plot(row[X], row, **style | {"color": look(number)["color"]})
        if values.notnull().any():
            in_grey(axes, name, style)

    return mark


panel = Panel(
    x=X,
    by=["case"],
    each=["law"],
    style={"markersize": 2.6},
    x_limits=(0.0, None),
    legend_title="Filled markers: fall of normal stress, case by case",
)
FASTER_NAME = r"velocity step, $a\,\ln(V_0/V_*)$"
figure = Figure(
    [
        replace(
            panel,
            y=lambda row: row[FALL] / row["a"],
            marks=[
                reference_line(X, lambda x: x, "Coulomb, first order, imposed"),
                beside(PULL, "displacement step", PULLED, over="a"),
                beside(FASTER, FASTER_NAME, RUN, over="a"),
            ],
            y_label=r"Critical stress change over $a\sigma_*$",
            log="y",
            alike="stress",
        ),
        replace(
            panel,
            y="coulomb_ratio",
            marks=[
                level(1.0, color="0.82", linewidth=2.5),
                beside("direct_ratio", FASTER_NAME, RUN),
            ],
            y_label="Stress change over that by a displacement step",
        ),
    ],
    height=58.0,
)


study = Study(
    name="triggering",
    title="Does a change of Coulomb stress predict triggering?",
    summary=(
        "A slider in steady state at V_* has its normal stress lowered at once, or its load point "
        "displaced, and is then held; or its load point goes on faster. To first order in k/k_cr a "
        "fall of normal stress triggers as a displacement step does, at a change of Coulomb stress "
        "with mu' = mu_* - alpha (1 - a/b), by every law. By the slip law that goes on to hold: "
        "exactly for alpha = 0, and to 3 % up to 2 k_cr, inclined driving included. By the "
        "slowness law it ends near critical stiffness, where a fall of normal stress takes up to "
        "2.4 times the change of Coulomb stress of a displacement: a fall also "
        "lowers the critical stiffness. Where the spring is so stiff "
        "that only a jump of slip rate to the norm is critical, it predicts no better. The effect "
        "of normal stress on the state makes falls trigger less. A velocity step, whose direct "
        "effect is a ln(V_0/V_*), takes 0.6 to 1.03 times the stress of a displacement, most of "
        "them less because the load point goes on; below critical stiffness any triggers. "
        "Inclined driving is at 60 degrees, the fall then one of sigma_3."
    ),
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("case", CASES),
        Axis("stiffness_ratio", [0.05, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0]),
    ],
    measure=Triggers(),
    reductions=[
        LinearFit(
            name="coulomb_slope", of="coulomb_ratio", on="stiffness_ratio", within=(0.0, 0.5)
        ),
    ],
    claims=[
        closed_form("slip", 0.0, 0.5, 2e-9, EXACT),
        closed_form("slip", 0.56, 0.25, 2e-9, EXACT),
        closed_form("slip", 0.56, 0.5, 2e-9, EXACT),
        closed_form(
            "slip", 0.56, 1.0, 3e-5, "a finite norm leaves exp(-10.9 (b/a - 1)/(q k^)) = 3e-5 of it"
        ),
        closed_form("slowness", 0.56, 0.25, 2e-9, EXACT),
        limit("slip", IMPOSED),
        limit("slip", STRONG),
        limit("slowness", IMPOSED),
        limit("slowness", STRONG),
        Claim(
            id="N2",
            statement="slip law, imposed, alpha = 0.56: how that limit is left, by k/k_cr",
            source="second order of the closed form: -alpha (1 - a/b) a/(2 mu'^2)",
            variable="coulomb_slope",
            where={"law": "slip", "case": IMPOSED},
            published=-TAKEN * base.a / (2.0 * FRICTION**2),
            tolerance=0.02 * TAKEN * base.a / (2.0 * FRICTION**2),
            reason="the third order, over stiffnesses up to 0.5 k_cr",
        ),
        weaker("slip"),
        weaker("slowness"),
        Claim(
            id="N4",
            statement="slip law, imposed, alpha = 0, k = k_cr: Coulomb stress is exact, mu' = mu_*",
            source="mu_* (1 - 1/q) = a k^: that of a displacement, at any stiffness",
            variable="coulomb_ratio",
            where={"law": "slip", "case": PLAIN, "stiffness_ratio": 1.0},
            published=1.0,
            tolerance=1e-5,
            reason="a finite norm takes 2e-5 of either, and about the same",
        ),
        Claim(
            id="N5",
            statement="slip law, inclined, alpha = 0.56, k = 2 k_cr: it predicts to 3 %",
            source="what is left of the first order where it is worst",
            variable="coulomb_ratio",
            where={"law": "slip", "case": STRONG, "stiffness_ratio": 2.0},
            relation="above",
            published=0.97,
            reason="an inequality; ours is 0.974",
        ),
        Claim(
            id="N6",
            statement="slowness law, inclined, alpha = 0.56, k = 1.25 k_cr: it misleads",
            source="a fall also lowers the critical stiffness: h(u*) = -q k^",
            variable="coulomb_ratio",
            where={"law": "slowness", "case": STRONG, "stiffness_ratio": 1.25},
            relation="above",
            published=2.0,
            reason="an inequality; ours is 2.40",
        ),
    ],
    plot=figure,
    references=[
        REFERENCE,
        "Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940",
        "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196",
    ],
)
