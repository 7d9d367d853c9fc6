"""Maps of limit cycles over stiffness and load point velocity: where steady sliding, damped
oscillation, slow slip and stick-slip lie.

What a slider does in the end whose load point steps from V_* to V_0: it slides steadily where
linear theory calls that stable, and cycles everywhere else. Cycles whose peak slip rate stays below
the instability norm are slow slip, those that reach it stick-slip; motions that settle do so by a
damped oscillation where the eigenvalues are a complex pair, up to some six times the critical
stiffness (slip_mode). The critical stiffness at V_0, from the eigenvalues of steady sliding, bounds
the cycling region in every column of the map; at variable normal stress it falls with V_0, and slow
slip lies in a narrow band below, while at constant normal stress stick-slip reaches up to the
boundary. Beside it cycles are approached slowly, over thousands of events, and small errors of a
step move them far: motions are integrated 300 times more tightly than their numbers are asked for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles import SLIP_MODES
from rsfstudy.measures import LimitCycle, Quantity, Status
from rsfstudy.reductions import Boundary, Reduction
from rsfstudy.slider import critical_stiffness
from rsfstudy.study import is_failed
from rsfstudy.study.figure_declarations import Axes
from rsfstudy.study.reductions.base import dimension_of_coordinate, is_refused

from ._paper import GU_ET_AL, PAPER, REFERENCE
from ._phase_plane import scene_from_coordinates

CASES = [(law, stress) for law in ("slip", "slowness") for stress in ("constant", "variable")]


_STIFFNESS = "stiffness_ratio"


@dataclass(frozen=True)
class CycleRegionEdge(Reduction):
    """Stiffness between cells with a limit cycle and cells that settle to steady sliding, beside
    the critical stiffness at V_0 that follows from the eigenvalues of steady sliding, with mass.

    Nothing is interpolated: the cells bracket the edge, and no more. Both are over k_cr(V_*).

    Parameters
    ----------
    name : str
        Name of the edge, the middle of its bracket; ``<name>_error`` (half its width),
        ``<name>_stable`` and ``<name>_unstable`` (its ends), ``<name>_crossings`` (how often the
        answer changes along stiffness: the edge is a number only where it changes once),
        ``<name>_linear`` (what the eigenvalues say), ``<name>_farthest`` (the largest distance of
        the two along `across`, over the width of the bracket) and ``<name>_misplaced`` (how many
        cells cycle above or settle below what the eigenvalues say) come with it.
    of : str
        Variable that is a number where there is a limit cycle.
    across : str
        Coordinate along the edge, of which the last two are summaries.
    """

    across: str = "load_velocity_ratio"
    kind: ClassVar[str] = "cycling_edge"
    long_names: ClassVar[Mapping[str, str]] = {
        "_farthest": "largest distance of that edge from the linear boundary, over the spacing of "
        "cells",
        "_misplaced": "number of cells that cycle above the linear boundary or settle below it",
    }

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Its results, as far as their names do not say what they are."""
        name, ratio = self.name, r"$k/k_{cr}(V_*)$"
        return (
            Quantity(name, ratio, "1", "stiffness at which limit cycles end, over k_cr(V_star)"),
            Quantity(
                f"{name}_linear",
                r"$k_{cr}(V_0)/k_{cr}(V_*)$",
                "1",
                "critical stiffness at V_0 by eigenvalues of steady sliding, over k_cr(V_star)",
            ),
            *super().quantities,
        )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Bracket the edge along stiffness; nothing where parts of the slider are the user's own.

        Raises
        ------
        InvalidValue
            Where stiffness_ratio is no coordinate along one dimension.
        """
        dimension = dimension_of_coordinate(dataset, _STIFFNESS)
        cycles, settles = dataset[self.of].notnull(), dataset["status"] == Status.NO_LIMIT_CYCLE
        lost = is_refused(dataset, self.of, dimension)
        answers = cycles.astype(float).where((cycles | settles) & ~lost)
        linear = _linear_boundary(answers.isel({dimension: 0}, drop=True), dataset)
        if linear is None:
            return xr.Dataset()
        stiffness = dataset[_STIFFNESS].astype(float)
        # the change at the stiffest cells counts, and a boundary tells of the first one
        softening = answers.assign_coords({_STIFFNESS: -stiffness})
        found = Boundary(self.name, self.of, on=_STIFFNESS).bracket(softening)
        stable, unstable, crossings = abs(found[0]), abs(found[1]), found[2]
        edge, width = (0.5 * (stable + unstable)).where(crossings == 1), abs(stable - unstable)
        misplaced = ((answers == 1.0) & (stiffness > linear)) | (
            (answers == 0.0) & (stiffness < linear)
        )
        along = [d for d in dataset[self.across].dims if d in linear.dims]
        whole = ~lost.any(along)
        made = {
            "": edge,
            "_error": 0.5 * width.where(crossings == 1),
            "_stable": stable,
            "_unstable": unstable,
            "_crossings": crossings,
            "_linear": linear,
            "_farthest": (abs(edge - linear) / width).max(along).where(whole),
            "_misplaced": misplaced.sum([dimension, *along]).where(whole),
        }
        note = f"between cells with a number and without one in {self.of}, along {_STIFFNESS}"
        if bool(is_failed(dataset["status"]).any()):
            note += "; cells along it failed or are missing"
        return self.results(note, made)


def _linear_boundary(places: xr.DataArray, dataset: xr.Dataset) -> xr.DataArray | None:
    """Critical stiffness at V_0 over that at V_*, at each place of a lattice; None where a scene
    cannot be told from its coordinates alone.
    """
    values, cells = np.full(places.shape, np.nan), dataset.coords.to_dataset()
    cells = cells.isel({d: 0 for d in cells.dims if d not in places.dims})
    for place in np.ndindex(places.shape):
        try:
            scene = scene_from_coordinates(cells.isel(dict(zip(places.dims, place, strict=True))))
        except InvalidValue:
            return None
        values[place] = (
            critical_stiffness(scene, scene.log_load_velocity) / scene.critical_stiffness
        )
    return places.copy(data=values)


MAP_AXES = ("stiffness_ratio", "load_velocity_ratio")
PEAK = "max_log10_slip_rate"
#: Stiffness ratios between which the edge is shown enlarged.
CLOSE_STIFFNESS_MIN, CLOSE_STIFFNESS_MAX = 0.8, 1.1
#: Springs on both sides of where oscillation about steady sliding ends: at constant normal stress,
#: where (k - k_cr)^2 = 4 a k, 5.83 k_cr for b = 2a.
STIFF_SPRINGS = (1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0)


def spans_stiffness(softest: float, dataset: xr.Dataset) -> bool:
    """True if some springs are softer than that, and some stiffer."""
    ratio = dataset["stiffness_ratio"]
    return not softest or bool(ratio.min() < softest < ratio.max())


def plot_map(softest: float, dataset: xr.Dataset, axes: Axes) -> None:
    """Peak slip rate from a stiffness on, with the linear boundary of steady sliding."""
    from rsfstudy.plots.maps import draw_map

    ratio = dataset["stiffness_ratio"]
    shown = (ratio > softest) & (ratio < CLOSE_STIFFNESS_MAX) if softest else ratio > softest
    case = dataset.isel(stiffness_ratio=np.flatnonzero(shown)).transpose(*MAP_AXES, ...)
    draw_map(PEAK, MAP_AXES, None, case, axes)
    if not softest:  # the outermost cells may reach below zero
        axes.set_ylim(float(ratio.min()), float(ratio.max()))
        axes.set_yscale("log")
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    if "cycling_edge_linear" in case:
        orange = {"color": "#D55E00", "linewidth": 1.3, "label": "linear boundary"}
        axes.plot(case["load_velocity_ratio"], case["cycling_edge_linear"], "-", **orange)
    label_slip_modes(case, axes)


def label_slip_modes(case: xr.Dataset, axes: Axes) -> None:
    """The bounds of the slip modes, and their names."""
    x, y = case["load_velocity_ratio"].values, case["stiffness_ratio"].values
    # heights in parts of the panel, on any scale
    to_panel = axes.transData + axes.transAxes.inverted()
    heights = to_panel.transform(np.column_stack([np.full(len(y), x[0]), y]))[:, 1]
    box = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0}
    for mode, name in enumerate(SLIP_MODES):
        here = (case["slip_mode"] == mode).values
        if not here.any():
            continue
        if min(here.shape) > 1 and not here.all():
            axes.contour(x, y, here, [0.5], colors="black", linewidths=0.8, linestyles="--")
        rows, columns = np.nonzero(here)
        if rows.size > 0.02 * here.size and np.ptp(heights[rows]) > 0.08:
            column = int(np.median(columns))
            ends = heights[rows[np.abs(columns - column) == np.abs(columns - column).min()]]
            middle = float(x[column]), float(np.clip(0.5 * (ends.min() + ends.max()), 0.06, 0.94))
            words, where = name.replace("_", " "), axes.get_xaxis_transform()
            axes.text(
                *middle, words, transform=where, bbox=box, ha="center", va="center", fontsize=6
            )


def map_title(softest: float, case: xr.Dataset) -> str:
    """Law and normal stress, and which springs."""
    text = f"{case['law'].item()} law, {case['normal_stress'].item()} normal stress".capitalize()
    return f"{text}, magnified" if softest else text


figure = Figure(
    [
        Panel(
            x="load_velocity_ratio",
            facet=["law", "normal_stress"],
            overlays=[partial(plot_map, softest)],
            y_label="Stiffness, $k/k_{cr}(V_*)$",
            y_scale_group=f"from {softest}",
            condition=partial(spans_stiffness, softest),
            title=partial(map_title, softest),
        )
        for softest in (0.0, CLOSE_STIFFNESS_MIN)
    ],
    height=52.0,
)


#: What is claimed of each case: its edge, and that no stick-slip lies above it, nor steady sliding
#: below.
EDGE_CLAIM: dict[str, Any] = {
    "says": "limit cycles end where the eigenvalues say",
    "variable": "cycling_edge_farthest",
    "tolerance": 0.5,
    "reason": "half a spacing of the cells in stiffness: the boundary is within the bracket",
}
MISPLACED_CELLS_CLAIM: dict[str, Any] = {
    "says": "no cell cycles above it or settles below it",
    "variable": "cycling_edge_misplaced",
    "tolerance": 0.0,
    "reason": "a count",
}


def edge_claim(law: str, normal_stress: str, says: str, **held: Any) -> Claim:
    """C1: the edge of the computed region is where the eigenvalues say."""
    return Claim(
        id="C1",
        statement=f"{law} law, {normal_stress}: {says}",
        source=f"{PAPER}, section 2.2, eqs. 7 and 8; eigenvalues with mass",
        where={"law": law, "normal_stress": normal_stress},
        published=0.0,
        **held,
    )


study = Study(
    name="stability_map",
    title="Limit cycles over stiffness and load point velocity, b/a = 2, alpha = 0.56",
    summary=Study.caption(__doc__),
    base=Scene(b_over_a=2.0, alpha=0.56, inertia=True),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", [*np.linspace(0.05, 1.05, 100), *STIFF_SPRINGS]),
        Axis("load_velocity_ratio", np.geomspace(1.01, 1000.0, 100)),
    ],
    measure=LimitCycle(phases=2, events=20_000),
    accuracy=Accuracy(rtol=1e-3, budget=20_000_000, engine="compiled", refinement=0.003),
    reductions=[CycleRegionEdge(name="cycling_edge", of="recurrence_interval")],
    claims=[
        *(edge_claim(*case, **EDGE_CLAIM) for case in CASES),
        *(edge_claim(*case, **MISPLACED_CELLS_CLAIM) for case in CASES),
    ],
    plot=figure,
    references=[REFERENCE, GU_ET_AL],
)
