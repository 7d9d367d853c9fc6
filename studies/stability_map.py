"""Maps of limit cycles over stiffness and load point velocity: where steady sliding, slow
oscillation and stick-slip lie.
"""

import math
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Figure, Panel
from rsfstudy.declare.study import Study
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.reduce import CyclingEdge
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

from ._paper import PAPER, REFERENCE

#: What is claimed of each case: its edge, and that no stick-slip lies above it, nor steady sliding
#: below.
LINEAR: dict[str, Any] = {
    "says": "limit cycles end where the eigenvalues say",
    "variable": "cycling_edge_farthest",
    "tolerance": 0.5,
    "reason": "half a spacing of the cells in stiffness: the boundary is within the bracket",
}
NONE_MISPLACED: dict[str, Any] = {
    "says": "no cell cycles above it or settles below it",
    "variable": "cycling_edge_misplaced",
    "tolerance": 0.0,
    "reason": "a count",
}
CASES = [(law, stress) for law in ("slip", "slowness") for stress in ("constant", "variable")]


def edge(law: str, normal_stress: str, says: str, **held: Any) -> Claim:
    """C1: the edge of the computed region is where the eigenvalues say."""
    return Claim(
        id="C1",
        statement=f"{law} law, {normal_stress}: {says}",
        source=f"{PAPER}, section 2.2, eqs. 7 and 8; eigenvalues with mass",
        where={"law": law, "normal_stress": normal_stress},
        published=0.0,
        **held,
    )


PLANE = ("stiffness_ratio", "load_velocity_ratio")
PEAK = "max_log10_slip_rate"
#: Stiffness ratio from which on the edge is shown enlarged.
CLOSE = 0.8


def is_beyond(softest: float, dataset: xr.Dataset) -> bool:
    """True if some springs are softer than that, and some stiffer."""
    ratio = dataset["stiffness_ratio"]
    return not softest or bool(ratio.min() < softest < ratio.max())


def mark_map(softest: float, dataset: xr.Dataset, axes: Axes) -> None:
    """Peak slip rate from a stiffness on, with the linear boundary of steady sliding."""
    from rsfstudy.plots.maps import draw_map

    stiffer = dataset["stiffness_ratio"] > softest
    case = dataset.isel(stiffness_ratio=np.flatnonzero(stiffer)).transpose(*PLANE, ...)
    draw_map(PEAK, PLANE, None, case, axes)
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    if "cycling_edge_linear" in case:
        orange = {"color": "#D55E00", "linewidth": 1.3, "label": "linear boundary"}
        axes.plot(case["load_velocity_ratio"], case["cycling_edge_linear"], "-", **orange)
    name_regimes(case, axes)


def name_regimes(case: xr.Dataset, axes: Axes) -> None:
    """The peak slip rate at which the instability norm is reached, and names of the regimes."""
    inertial_time = float(case["period"]) * float(case["reference_rate"]) / (2.0 * math.pi)
    norm = math.log10(float(case["instability_norm"]) / inertial_time)
    peak, (low, high) = case[PEAK], axes.get_ylim()
    x, y = case["load_velocity_ratio"].values, case["stiffness_ratio"].values
    if min(peak.shape) > 1 and float(peak.min()) < norm < float(peak.max()):
        lines = axes.contour(x, y, peak, [norm], colors="black", linewidths=1.0, linestyles="--")
        axes.clabel(lines, fmt="norm", fontsize=6)
    regimes = {
        "steady sliding": (case["status"] == Status.NO_LIMIT_CYCLE).values,
        "slow oscillation": (peak < norm).values,
        "stick-slip": (peak >= norm).values,
    }
    margin = 0.06 * (high - low)
    box = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0}
    for name, here in regimes.items():
        rows, columns = np.nonzero(here)
        if rows.size > 0.02 * peak.size and np.ptp(y[rows]) > 2.0 * margin:
            inside = low + margin, high - margin
            middle = float(np.median(x[columns])), float(np.clip(np.median(y[rows]), *inside))
            axes.text(*middle, name, bbox=box, ha="center", va="center", fontsize=6)


def title(softest: float, case: xr.Dataset) -> str:
    """Law and normal stress, and which springs."""
    text = f"{case['law'].item()} law, {case['normal_stress'].item()} normal stress".capitalize()
    return f"{text}, magnified" if softest else text


figure = Figure(
    [
        Panel(
            x="load_velocity_ratio",
            each=["law", "normal_stress"],
            marks=[partial(mark_map, softest)],
            y_label="Stiffness, $k/k_{cr}(V_*)$",
            alike=f"from {softest}",
            when=partial(is_beyond, softest),
            title=partial(title, softest),
        )
        for softest in (0.0, CLOSE)
    ],
    height=52.0,
)


study = Study(
    name="stability_map",
    title="Limit cycles over stiffness and load point velocity, b/a = 2, alpha = 0.56",
    summary=(
        "What a slider does in the end whose load point steps from V_* to V_0: it slides steadily "
        "where linear theory calls that stable, and cycles everywhere else. Cycles whose peak "
        "slip rate stays below the instability norm are slow oscillation, those that reach it "
        "stick-slip. The critical stiffness at V_0, from the eigenvalues of steady sliding, "
        "bounds the cycling region in every column of the map; at variable normal stress it "
        "falls with V_0, and slow oscillation lies in a narrow band below, while at constant "
        "normal stress stick-slip reaches up to the boundary. Beside it cycles are approached "
        "slowly, over thousands of events, and small errors of a step move them far: motions "
        "are integrated 300 times more tightly than their numbers are asked for."
    ),
    base=Scene(b_over_a=2.0, alpha=0.56, inertia=True),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", np.linspace(0.05, 1.05, 100)),
        Axis("load_velocity_ratio", np.geomspace(1.01, 1000.0, 100)),
    ],
    measure=LimitCycle(phases=2, events=20_000),
    accuracy=Accuracy(rtol=1e-3, budget=20_000_000, engine="compiled", refinement=0.003),
    reductions=[CyclingEdge(name="cycling_edge", of="recurrence_interval")],
    claims=[
        *(edge(*case, **LINEAR) for case in CASES),
        *(edge(*case, **NONE_MISPLACED) for case in CASES),
    ],
    plot=figure,
    references=[
        REFERENCE,
        "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196",
    ],
)
