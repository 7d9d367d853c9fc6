"""Dilatancy: stick-slip cycles that become slow.

A spring half as stiff as the drained critical one: steady sliding is unstable in every cell, and
without dilatancy cycles end in dynamic rupture at 10^9 V_*. Ruptures have no time to drain. Some
way beyond the dilatancy at which the spring is stiffer than the undrained critical one, b - a - E,
slip still accelerates, but never comes to rupture: within a narrow range of dilatancy cycles of
10^9 V_* become slow slip of 10 to 1000 V_*, with a tenth of the stress drop. Faster drainage moves
that to stronger dilatancy.
"""

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.study.figure_declarations import Axes

from ._fluids import DILATANT_FAULT, REFERENCE, SEGALL_RICE


def peak_slip_rate_claim(
    law: str, dilatancy: float, relation: str, log10: float, what: str
) -> Claim:
    """D7: how fast a cycle slips where c* D_c/V_* = 1."""
    return Claim(
        id="D7",
        statement=f"{law} law, dilatancy {dilatancy:g}: {what}",
        source=f"{SEGALL_RICE}: dilatancy may prevent instability, with slow slip in its place",
        variable="max_log10_slip_rate",
        where={"law": law, "drainage": 1.0, "dilatancy": dilatancy},
        relation=relation,
        published=log10,
        reason="an inequality; dynamic ruptures reach 10^9 V_*",
    )


#: Time, in D_c/V_*, before and after the fastest slip is on log scales that meet in a linear one of
#: this width: slip speeds up to a rupture as one over the time that is left.
LINEAR_TIME_RANGE = 1e-6


def plot_undrained_stiffness(dataset: xr.Dataset, axes: Axes) -> None:
    """Line where the spring is as stiff as the critical one of no drainage."""
    weakening = float(dataset["a"]) * (float(dataset["b_over_a"]) - 1.0)
    critical = (weakening - float(dataset["stiffness"])) / float(dataset["mu_star"])
    text = "spring as stiff as the undrained critical one"
    axes.axvline(critical, color="0.4", linestyle=":", label=text)


def time_from_fastest_slip(row: xr.Dataset) -> xr.DataArray:
    """Time from the fastest slip."""
    fastest = int(np.argmax(np.nan_to_num(row["log10_slip_rate"].values, nan=-np.inf)))
    return row["time"] - row["time"][fastest]


def set_symlog_time_scale(_dataset: xr.Dataset, axes: Axes) -> None:
    """Log scales before and after the fastest slip."""
    axes.set_xscale("symlog", linthresh=LINEAR_TIME_RANGE, linscale=0.5)
    axes.set_xticks([-1.0, -1e-3, 0.0, 1e-3, 1.0], ["$-1$", "$-10^{-3}$", "0", "$10^{-3}$", "1"])
    axes.set_xticks([], minor=True)


figure = Figure(
    [
        *(
            Panel(
                x="dilatancy",
                y=variable,
                hue=["drainage", "law"],
                overlays=[plot_undrained_stiffness],
                title=title,
            )
            for variable, title in (
                ("max_log10_slip_rate", "Ruptures become slow slip"),
                ("static_stress_drop", "Stress drop"),
            )
        ),
        Panel(
            x=time_from_fastest_slip,
            y=lambda row: row["log10_slip_rate"].where(row["status"] == 0),
            hue=["dilatancy"],
            facet=["law"],
            isel={"drainage": 0, "dilatancy": slice(None, None, 2)},
            overlays=[set_symlog_time_scale],
            x_label=r"Time from fastest slip, $t V_*/D_c$",
            y_label=r"Slip rate, $\log_{10}(V/V_*)$",
            x_limits=(-10.0, 400.0),
            y_scale_group="slip rate",
            legend_columns=3,
        ),
    ]
)


study = Study(
    name="dilatant_cycles",
    title="Stick-slip of a dilatant fault, k = 0.5 (b-a) sigma_*/D_c, with mass",
    summary=Study.caption(__doc__),
    base=DILATANT_FAULT.with_(stiffness=0.0025, load_velocity_ratio=1.0, inertia=True),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("drainage", [1.0, 10.0]),
        Axis("dilatancy", [0.0, 0.002, 0.004, 0.006, 0.007, 0.008, 0.009, 0.010, 0.012]),
    ],
    measure=LimitCycle(),
    accuracy=Accuracy(rtol=1e-5),
    claims=[
        claim
        for law in ("slip", "slowness")
        for claim in (
            peak_slip_rate_claim(law, 0.0, "above", 9.0, "dynamic rupture"),
            peak_slip_rate_claim(law, 0.008, "below", 2.5, "slow slip"),
            Claim.below(
                id="D8",
                statement=f"{law} law: slow cycles drop less than a fifth of the stress",
                source=SEGALL_RICE,
                variable="static_stress_drop",
                where={"law": law, "drainage": 1.0, "dilatancy": 0.008},
                published=0.05,
                reason="an inequality; 0.24 to 0.27 without dilatancy",
            ),
        )
    ],
    plot=figure,
    references=[REFERENCE],
)
