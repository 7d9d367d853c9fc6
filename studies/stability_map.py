"""Map of slip modes over stiffness and load point velocity.

The map shows the final behaviour of a slider after the load point velocity changes from V_* to V_0:
steady sliding, damped oscillation, slow slip or stick-slip. Steady sliding occurs if linear theory
predicts stability, and a limit cycle occurs in all other cases. A limit cycle is slow slip if its
peak slip rate remains below the instability norm, and stick-slip otherwise. A motion settles by
damped oscillation if the eigenvalues are a complex pair, which is the case at stiffnesses up to
about six times the critical stiffness. The critical stiffness at V_0, computed from the eigenvalues
of steady sliding, bounds the region of limit cycles in every column of the map. At variable normal
stress, the stiffness at this boundary decreases with V_0, and slow slip occurs in a narrow band
below the boundary. At constant normal stress, stick-slip occurs up to the boundary. Close to the
boundary, motions approach their limit cycle slowly, over thousands of events, and small integration
errors have large effects. The tolerance of the integration is therefore 300 times smaller than the
requested accuracy.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import LimitCycle, Quantity, Status
from rsfstudy.reductions import Boundary, Reduction
from rsfstudy.study import is_failed_or_pending
from rsfstudy.study.figure_declarations import MatplotlibAxes
from rsfstudy.study.reductions.base import depends_on_failed_cells, find_dimension_of_coordinate

from ._paper import GU_ET_AL, PAPER, REFERENCE
from ._phase_plane import scene_from_coordinates

CASES = [(law, stress) for law in ("slip", "slowness") for stress in ("constant", "variable")]


_STIFFNESS = "stiffness_ratio"


@dataclass(frozen=True)
class CycleRegionEdge(Reduction):
    """Stiffness at the boundary between limit cycles and steady sliding.

    The boundary lies between the stiffest cell with a limit cycle and the softest cell that settles
    to steady sliding. The position of the boundary is not interpolated between these two cells. The
    result is compared with the critical stiffness at :math:`V_0` from the eigenvalues of steady
    sliding with inertia. Both stiffnesses are relative to :math:`k_{cr}(V_*)`.

    Parameters
    ----------
    name : str
        Name of the boundary, which is the midpoint of its bracket. Further results are
        ``<name>_error`` (half of the width of the bracket), ``<name>_stable`` and
        ``<name>_unstable`` (ends of the bracket), ``<name>_crossings`` (number of changes between
        limit cycles and steady sliding along stiffness), ``<name>_linear`` (critical stiffness from
        the eigenvalues), ``<name>_farthest`` (largest distance between the boundary and the
        critical stiffness along ``across``, relative to the width of the bracket), and
        ``<name>_misplaced`` (number of limit cycles above and of settling cells below the critical
        stiffness). The boundary is NaN unless there is exactly one change between limit cycles and
        steady sliding.
    of : str
        Variable that has a value in cells with a limit cycle.
    across : str, default: "load_velocity_ratio"
        Coordinate along the boundary, over which ``<name>_farthest`` and ``<name>_misplaced`` are
        computed.
    """

    across: str = "load_velocity_ratio"
    kind: ClassVar[str] = "cycling_edge"
    long_names: ClassVar[Mapping[str, str]] = {
        "_farthest": "largest distance of the edge from the linear boundary, divided by the "
        "spacing of cells",
        "_misplaced": "number of cells that cycle above the linear boundary or settle below it",
    }

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities of the results."""
        name, ratio = self.name, r"$k/k_{cr}(V_*)$"
        return (
            Quantity(
                name, ratio, "1", "stiffness at which limit cycles end, divided by k_cr(V_star)"
            ),
            Quantity(
                f"{name}_linear",
                r"$k_{cr}(V_0)/k_{cr}(V_*)$",
                "1",
                "critical stiffness at V_0 from the eigenvalues of steady sliding, divided by "
                "k_cr(V_star)",
            ),
            *super().quantities,
        )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Find the two stiffnesses between which the boundary lies.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Results of the comparison. The dataset is empty if the scenes contain user-defined
            components that cannot be reconstructed from the coordinates.

        Raises
        ------
        InvalidValue
            If ``stiffness_ratio`` is not a coordinate along one dimension.
        """
        dimension = find_dimension_of_coordinate(dataset, _STIFFNESS)
        cycles, settles = dataset[self.of].notnull(), dataset["status"] == Status.NO_LIMIT_CYCLE
        lost = depends_on_failed_cells(dataset, self.of, dimension)
        answers = cycles.astype(float).where((cycles | settles) & ~lost)
        linear = _linear_boundary(answers.isel({dimension: 0}, drop=True), dataset)
        if linear is None:
            return xr.Dataset()
        stiffness = dataset[_STIFFNESS].astype(float)
        # The reduction ``Boundary`` returns the first change, so the order is reversed to find the
        # change at the stiffest cells.
        softening = answers.assign_coords({_STIFFNESS: -stiffness})
        found = Boundary(self.name, self.of, on=_STIFFNESS).bracket_threshold_crossing(softening)
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
        if bool(is_failed_or_pending(dataset["status"]).any()):
            note += "; cells along it failed or are missing"
        return self.results(note, made)


def _linear_boundary(places: xr.DataArray, dataset: xr.Dataset) -> xr.DataArray | None:
    """Compute the ratio of the critical stiffness at V_0 to the value at V_*.

    Parameters
    ----------
    places : xarray.DataArray
        Array that has all dimensions of the lattice except the stiffness dimension.
    dataset : xarray.Dataset
        Results of the study.

    Returns
    -------
    xarray.DataArray or None
        Ratio for each cell. The value is None if a scene cannot be reconstructed from the
        coordinates.
    """
    values, cells = np.full(places.shape, np.nan), dataset.coords.to_dataset()
    cells = cells.isel({d: 0 for d in cells.dims if d not in places.dims})
    for place in np.ndindex(places.shape):
        try:
            scene = scene_from_coordinates(cells.isel(dict(zip(places.dims, place, strict=True))))
        except InvalidValue:
            return None
        values[place] = (
            scene.critical_stiffness_at(scene.log_load_velocity) / scene.critical_stiffness
        )
    return places.copy(data=values)


MAP_AXES = ("stiffness_ratio", "load_velocity_ratio")
PEAK = "max_log10_slip_rate"
#: Range of stiffness ratios of the magnified map.
CLOSE_STIFFNESS_MIN, CLOSE_STIFFNESS_MAX = 0.8, 1.1
#: Stiffness ratios on both sides of the limit of damped oscillations. At constant normal stress,
#: the limit is the solution of (k - k_cr)^2 = 4 a k, which is 5.83 k_cr for b = 2a.
STIFF_SPRINGS = (1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0)


def spans_stiffness(softest: float, dataset: xr.Dataset) -> bool:
    """Return True if some stiffness ratios lie below a limit and others lie above it.

    Parameters
    ----------
    softest : float
        Limit of the stiffness ratio. The limit is zero for a map of all stiffness ratios.
    dataset : xarray.Dataset
        Results of one case.

    Returns
    -------
    bool
        True if the map can be drawn.
    """
    ratio = dataset["stiffness_ratio"]
    return not softest or bool(ratio.min() < softest < ratio.max())


def plot_map(softest: float, dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the map of peak slip rate and the linear stability boundary.

    Parameters
    ----------
    softest : float
        Smallest stiffness ratio of the magnified map. The value is zero for a map of all stiffness
        ratios.
    dataset : xarray.Dataset
        Results of one case.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots.maps import draw_map

    ratio = dataset["stiffness_ratio"]
    shown = (ratio > softest) & (ratio < CLOSE_STIFFNESS_MAX) if softest else ratio > softest
    case = dataset.isel(stiffness_ratio=np.flatnonzero(shown)).transpose(*MAP_AXES, ...)
    draw_map(PEAK, MAP_AXES, None, case, axes)
    if not softest:  # The outermost cells may extend below zero.
        axes.set_ylim(float(ratio.min()), float(ratio.max()))
        axes.set_yscale("log")
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    if "cycling_edge_linear" in case:
        orange = {"color": "#D55E00", "linewidth": 1.3, "label": "linear boundary"}
        axes.plot(case["load_velocity_ratio"], case["cycling_edge_linear"], "-", **orange)
    label_slip_modes(case, axes)


def label_slip_modes(case: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the boundaries of the slip modes and their names.

    Parameters
    ----------
    case : xarray.Dataset
        Results of one case.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    x, y = case["load_velocity_ratio"].values, case["stiffness_ratio"].values
    # Heights as fractions of the panel, for any scale of the axis.
    to_panel = axes.transData + axes.transAxes.inverted()
    heights = to_panel.transform(np.column_stack([np.full(len(y), x[0]), y]))[:, 1]
    box = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0}
    for mode, name in enumerate(LimitCycle.SLIP_MODE_NAMES):
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
    """Return the title of a map.

    Parameters
    ----------
    softest : float
        Smallest stiffness ratio of the magnified map. The value is zero for a map of all stiffness
        ratios.
    case : xarray.Dataset
        Results of one case.

    Returns
    -------
    str
        Law, normal stress condition, and the word "magnified" if applicable.
    """
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


#: Claims about the position of the boundary in each case. The second claim concerns the number of
#: cells with a limit cycle above the boundary and of cells with steady sliding below the boundary.
EDGE_CLAIM: dict[str, Any] = {
    "says": "limit cycles end at the stiffness from the eigenvalues",
    "variable": "cycling_edge_farthest",
    "tolerance": 0.5,
    "reason": "half of the spacing of the cells in stiffness, because the boundary lies within the "
    "bracket",
}
MISPLACED_CELLS_CLAIM: dict[str, Any] = {
    "says": "no cell has a limit cycle above the boundary or settles below it",
    "variable": "cycling_edge_misplaced",
    "tolerance": 0.0,
    "reason": "a count",
}


def edge_claim(law: str, normal_stress: str, says: str, **held: Any) -> Claim:
    """Return a claim about the boundary of limit cycles (C1).

    Parameters
    ----------
    law : str
        State evolution law.
    normal_stress : str
        Normal stress condition.
    says : str
        Statement of the claim.
    **held : object
        Other arguments of ``Claim``.

    Returns
    -------
    Claim
        Claim about the boundary.
    """
    return Claim(
        id="C1",
        statement=f"{law} law, {normal_stress}: {says}",
        source=f"{PAPER}, section 2.2, eqs. 7 and 8; eigenvalues with inertia",
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
