"""Computational cost of physical effects, and the error that results if they are neglected.

The study combines all normal stress conditions with all types of dynamics, for both laws at k = 0.8
k_cr. Without inertia and radiation damping, the slip rate is unbounded, except under the slowness
law at variable normal stress, where it reaches 10^13 to 10^19 V_*. A cycle with radiation damping
needs half as many right-hand-side evaluations as a cycle with inertia. However, a cycle with
radiation damping has no overshoot, so the static stress drop is smaller by 25 to 50 %. Effects that
the scene does not include add no unknowns and no computing time. The time per right-hand-side
evaluation is divided by the time for a quasi-static scene at constant normal stress. The two scenes
are timed alternately.
"""

import math
import statistics
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import LimitCycle, Measure, Outcome, Output
from rsfstudy.motion import Integrator, MotionStopped
from rsfstudy.reductions import RelativeDifference
from rsfstudy.slider import EquationsOfMotion
from rsfstudy.study import DrawFunction
from rsfstudy.study.figure_declarations import MatplotlibAxes

#: Radiation damping K T V_*/(2 pi D_c). This value equals the impedance of the spring and the mass
#: at constant normal stress.
IMPEDANCE = 0.8 * 0.0145 * 5.0 * 1.17e-8 / (2.0 * math.pi)

COUPLINGS: dict[str, dict[str, str | float]] = {
    "constant normal stress": {"normal_stress": "constant"},
    "inclined driving": {"normal_stress": "variable", "alpha": 0.0},
    "inclined driving, alpha": {"normal_stress": "variable", "alpha": 0.56},
}
DYNAMICS: dict[str, dict[str, bool | float]] = {
    "quasi-static": {"inertia": False},
    "radiation damping": {"radiation_damping": IMPEDANCE},
    "inertia": {"inertia": True},
}
FULL_SCENE_PLACE = {"coupling": "inclined driving, alpha", "dynamics": "inertia"}


#: Number of evaluations per timing, and number of timings. The equations of the scene and of the
#: simplest scene are timed in short turns, so that other processes on the machine affect all
#: timings equally.
_EVALUATIONS_PER_TIMING, _TIMING_REPEATS = 100, 25
#: Values of the unknowns at which the equations are evaluated. Additional states are zero.
_SLOW_UNKNOWNS, _RUPTURE_UNKNOWNS = (0.01, 0.0), (0.01, 10.0, 0.01)

_CYCLE_MEASURE = LimitCycle(phases=2)
#: Outputs of the limit cycle that the study reports.
_CYCLE_OUTPUTS = tuple(
    replace(about, error=about.name == LimitCycle.primary_output)
    for about in LimitCycle.outputs
    if about.error or about.name == "work_per_cycle"
)


#: Outputs of the measure.
_OUTPUTS = (
    *_CYCLE_OUTPUTS,
    Output("unknowns", "", "1", "unknowns of the equations between ruptures"),
    Output("unknowns_in_rupture", "", "1", "unknowns of the equations with inertia"),
    Output("share_in_rupture", "", "1", "fraction of right-hand side evaluations with inertia"),
    Output(
        "evaluation_cost",
        "",
        "1",
        "time per right-hand side evaluation between ruptures, relative to the simplest scene",
    ),
    Output(
        "evaluation_cost_in_rupture",
        "",
        "1",
        "time per right-hand side evaluation with inertia, relative to the simplest scene",
    ),
    Output("time_per_evaluation", "", "s", "time per right-hand side evaluation between ruptures"),
    Output(
        "time_per_evaluation_in_rupture",
        "",
        "s",
        "time per right-hand side evaluation with inertia",
    ),
)


@dataclass(frozen=True)
class EffectCost(Measure):
    """Measure that computes a limit cycle and the computational cost of its physical effects.

    The number of unknowns and the time of a right-hand-side evaluation are reported separately for
    the equations between ruptures and during ruptures. The results also include the fraction of
    evaluations during ruptures. Times are also reported relative to the simplest scene with the
    same law, which is quasi-static and has constant normal stress.
    """

    name: ClassVar[str] = "effect_cost"
    primary_output = "recurrence_interval"
    typical_rhs_evaluations = 20_000
    outputs = _OUTPUTS
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the limit cycle, and measure the cost of evaluating the equations.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure. The costs are reported even if the limit cycle fails.
        """
        costs = _measure_costs(scene)
        try:
            cycle = _CYCLE_MEASURE.compute(scene, integrator)
        except MotionStopped as halt:
            return Outcome(halt.status, costs, str(halt))
        spent = integrator.work_meter.evaluations_by_regime.get("inertial", 0)
        costs["share_in_rupture"] = (
            spent / integrator.evaluations if integrator.evaluations else math.nan
        )
        names = [name for about in _CYCLE_OUTPUTS for name in about.variable_names]
        kept = {name: cycle.values[name] for name in names if name in cycle.values}
        return Outcome(cycle.status, {**kept, **costs}, cycle.message)


def _measure_costs(scene: Scene) -> dict[str, float]:
    """Count the unknowns of a scene, and time the evaluation of its equations.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.

    Returns
    -------
    dict
        Results by name, for the equations between ruptures and, with inertia, during ruptures.
    """
    slow = scene.equations_between_ruptures(with_time=False)
    forms: dict[str, tuple[EquationsOfMotion, tuple[float, ...]]] = {"": (slow, _SLOW_UNKNOWNS)}
    if scene.inertia:
        forms["_in_rupture"] = scene.equations_in_rupture(), _RUPTURE_UNKNOWNS
    plainest = scene.with_(
        normal_stress="constant", fluid="drained", inertia=False, radiation_damping=0.0
    )
    timed = {
        "plainest": (plainest.equations_between_ruptures(with_time=False), _SLOW_UNKNOWNS),
        **forms,
    }
    turns = [
        {where: _time_right_hand_side(*form) for where, form in timed.items()}
        for _turn in range(_TIMING_REPEATS)
    ]
    costs = {}
    for where, (form, _state) in forms.items():
        ratios = [seconds[where] / seconds["plainest"] for seconds in turns]
        costs[f"unknowns{where}"] = float(len(form.unknown_names))
        costs[f"evaluation_cost{where}"] = statistics.median(ratios)
        costs[f"time_per_evaluation{where}"] = statistics.median(s[where] for s in turns)
    return costs


def _time_right_hand_side(equations: EquationsOfMotion, state: tuple[float, ...]) -> float:
    """Return the processor time of one right-hand-side evaluation in s."""
    rate, p = equations.rate_function, equations.parameters
    state += (0.0,) * (len(equations.unknown_names) - len(state))
    began = time.thread_time()
    for _ in range(_EVALUATIONS_PER_TIMING):
        rate(state, p)
    return (time.thread_time() - began) / _EVALUATIONS_PER_TIMING


def draw_bars(variable: str, digits: int) -> DrawFunction:
    """Return a function that draws a bar chart of a variable.

    The chart has one row for each combination of effects, and one bar for each law.

    Parameters
    ----------
    variable : str
        Name of the variable.
    digits : int
        Number of digits of the labels.

    Returns
    -------
    DrawFunction
        Function that draws on axes.
    """

    def mark(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
        """Draw the bar chart."""
        from rsfstudy.plots import cycle_style, label_rows

        values = dataset[variable].stack(row=("coupling", "dynamics")).transpose("law", "row")
        for number, law in enumerate(values["law"].values):
            at = np.arange(values.sizes["row"]) + 0.4 * (number - 0.5 * (values.sizes["law"] - 1))
            of_law = values.isel(law=number).values
            look_of_it = {"color": cycle_style(number)["color"], "hatch": ("", "/////")[number % 2]}
            look_of_it |= {"edgecolor": "white", "linewidth": 0.0, "label": f"{law} law"}
            axes.barh(at, of_law, height=0.36, **look_of_it)
            for y, value in zip(at, of_law, strict=True):
                text = f" {value:.{digits}g}" if np.isfinite(value) else " no cycle"
                axes.text(
                    value if value > 0.0 else 0.0, y, text, va="center", fontsize=6, clip_on=True
                )
        label_rows(axes, [", ".join(row) for row in values["row"].values], 20)
        axes.tick_params(axis="y", labelsize=6)
        axes.margins(x=0.25)
        axes.grid(axis="y", visible=False)

    return mark


figure = Figure(
    [
        Panel(
            x=variable,
            x_label=label,
            y_label="Effects",
            overlays=[draw_bars(variable, digits)],
            title="",
        )
        for variable, digits, label in (
            ("work_per_cycle", 4, "Right-hand side evaluations per cycle"),
            ("evaluation_cost", 2, "Relative time per evaluation"),
            ("static_stress_drop", 4, None),
            ("max_log10_slip_rate", 4, None),
        )
    ],
    height=88.0,
)


def static_drop_loss_claim(law: str, dynamics: str, published: float) -> Claim:
    """Return the claim that the static stress drop is smaller without inertia (E1).

    Parameters
    ----------
    law : str
        State evolution law.
    dynamics : str
        Kind of dynamics that replaces inertia.
    published : float
        Minimum relative reduction of the static stress drop.

    Returns
    -------
    Claim
        Claim about the relative reduction.
    """
    return Claim.above(
        id="E1",
        statement=f"{law} law: {dynamics} instead of inertia reduces the static drop",
        source="overshoot is due to inertia; damped slip stops at stress equilibrium",
        variable="drop_lost_without_mass",
        where={"law": law, "coupling": "constant normal stress", "dynamics": dynamics},
        published=published,
    )


study = Study(
    name="effects",
    title="Cost of each effect in a limit cycle, and change of the result without it",
    summary=Study.caption(__doc__),
    base=Scene(b_over_a=2.0, stiffness_ratio=0.8, load_velocity_ratio=2.0),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("coupling", COUPLINGS),
        Axis("dynamics", DYNAMICS),
    ],
    measure=EffectCost(),
    reductions=[
        RelativeDifference(name=name, of=of, along=along, reference=FULL_SCENE_PLACE[along])
        for name, of, along in (
            ("drop_lost_without_mass", "static_stress_drop", "dynamics"),
            ("drop_lost_without_coupling", "static_stress_drop", "coupling"),
            ("work_saved", "work_per_cycle", "dynamics"),
        )
    ],
    claims=[
        static_drop_loss_claim("slip", "radiation damping", 0.3),
        static_drop_loss_claim("slowness", "radiation damping", 0.3),
        Claim(
            id="E2",
            statement="full scene: two unknowns between ruptures",
            source="the equations contain only the effects of the scene",
            variable="unknowns",
            where={"law": "slip", **FULL_SCENE_PLACE},
            published=2.0,
            reason="the unknowns are spring stress and state; inertia adds an unknown only during "
            "ruptures",
        ),
        Claim.below(
            id="E2",
            statement="full scene, slip law: less than 90 % of the evaluations are in ruptures",
            source="inertia is integrated explicitly only during ruptures",
            variable="share_in_rupture",
            where={"law": "slip", **FULL_SCENE_PLACE},
            published=0.9,
        ),
    ],
    plot=figure,
    references=["Rice (1993), J. Geophys. Res. 98, 9885-9907"],
)
