"""Effects: what each combination costs in a limit cycle, and what the answer loses without it."""

import math

import numpy as np
import xarray as xr

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Draw, Figure, Panel
from rsfstudy.declare.study import Study
from rsfstudy.measures.effect_cost import EffectCost
from rsfstudy.reduce import RelativeDifference
from rsfstudy.slider.scene import Scene

#: Radiation damping with the impedance of spring and mass, K T V_*/(2 pi D_c), at constant normal
#: stress.
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
FULL = {"coupling": "inclined driving, alpha", "dynamics": "inertia"}


def loses(law: str, dynamics: str, published: float) -> Claim:
    """What the static drop loses with radiation damping instead of mass."""
    return Claim(
        id="E1",
        statement=f"{law} law: {dynamics} instead of mass loses part of the static drop",
        source="overshoot is the mass's: damped slip stops where the stress balances",
        variable="drop_lost_without_mass",
        where={"law": law, "coupling": "constant normal stress", "dynamics": dynamics},
        relation="above",
        published=published,
        tolerance=0.0,
        reason="an inequality",
    )


def bars(variable: str, digits: int) -> Draw:
    """Bars of a number: one row a combination, and one bar a law."""

    def mark(dataset: xr.Dataset, axes: Axes) -> None:
        from rsfstudy.plots import look, name_points

        values = dataset[variable].stack(row=("coupling", "dynamics")).transpose("law", "row")
        for number, law in enumerate(values["law"].values):
            at = np.arange(values.sizes["row"]) + 0.4 * (number - 0.5 * (values.sizes["law"] - 1))
            of_law = values.isel(law=number).values
            look_of_it = {"color": look(number)["color"], "hatch": ("", "/////")[number % 2]}
            look_of_it |= {"edgecolor": "white", "linewidth": 0.0, "label": f"{law} law"}
            axes.barh(at, of_law, height=0.36, **look_of_it)
            for y, value in zip(at, of_law, strict=True):
                text = f" {value:.{digits}g}" if np.isfinite(value) else " no cycle"
                axes.text(
                    value if value > 0.0 else 0.0, y, text, va="center", fontsize=5.5, clip_on=True
                )
        name_points(axes.yaxis, [", ".join(row) for row in values["row"].values], 20)
        axes.tick_params(axis="y", labelsize=6)
        axes.set_ylim(values.sizes["row"] - 0.5, -0.5)
        axes.margins(x=0.25)
        axes.grid(axis="y", visible=False)

    return mark


figure = Figure(
    [
        Panel(
            x=variable, x_label=label, y_label="Effects", marks=[bars(variable, digits)], title=""
        )
        for variable, digits, label in (
            ("work_per_cycle", 4, "Right-hand sides per cycle"),
            ("evaluation_cost", 2, "Time of a right-hand side, relative"),
            ("static_stress_drop", 4, None),
            ("max_log10_slip_rate", 4, None),
        )
    ],
    height=88.0,
)


study = Study(
    name="effects",
    title="What each effect costs in a limit cycle, and what the answer loses without it",
    summary=(
        "Every combination of normal stress coupling and dynamics for both laws, k = 0.8 k_cr. "
        "Without mass or damping the slip rate runs away, but for the slowness law at variable "
        "normal stress, whose cycles reach 10^13 to 10^19 V_*. Radiation damping costs half of "
        "what mass does, and loses the overshoot: a quarter to a half of the static stress drop. "
        "An effect that is not in the scene adds no unknown and no time. Times of a right-hand "
        "side are over those of the plainest scene, quasi-static at constant normal stress, which "
        "takes turns with it."
    ),
    base=Scene(b_over_a=2.0, stiffness_ratio=0.8, load_velocity_ratio=2.0),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("coupling", COUPLINGS),
        Axis("dynamics", DYNAMICS),
    ],
    measure=EffectCost(),
    reductions=[
        RelativeDifference(
            name="drop_lost_without_mass",
            of="static_stress_drop",
            along="dynamics",
            reference="inertia",
        ),
        RelativeDifference(
            name="drop_lost_without_coupling",
            of="static_stress_drop",
            along="coupling",
            reference="inclined driving, alpha",
        ),
        RelativeDifference(
            name="work_saved", of="work_per_cycle", along="dynamics", reference="inertia"
        ),
    ],
    claims=[
        loses("slip", "radiation damping", 0.3),
        loses("slowness", "radiation damping", 0.3),
        Claim(
            id="E2",
            statement="full scene: two unknowns between ruptures",
            source="the equations are assembled from the effects of the scene",
            variable="unknowns",
            where={"law": "slip", **FULL},
            published=2.0,
            tolerance=0.0,
            reason="spring stress and state; mass adds its unknown in ruptures only",
        ),
        Claim(
            id="E2",
            statement="full scene, slip law: the full equations take part of the work only",
            source="inertia is integrated where it acts",
            variable="share_in_rupture",
            where={"law": "slip", **FULL},
            relation="below",
            published=0.9,
            tolerance=0.0,
            reason="an inequality",
        ),
    ],
    plot=figure,
    references=["Rice (1993), J. Geophys. Res. 98, 9885-9907"],
)
