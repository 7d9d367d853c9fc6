"""Stick-slip cycles of a dilatant fault, from dynamic rupture to slow slip.

The stiffness is half of the critical stiffness of a drained fault, so steady sliding is unstable in
all cells. Without dilatancy, the cycles end in dynamic ruptures with slip rates of 10^9 V_*. Fluid
does not have enough time to flow into the pores during a rupture. If dilatancy is so strong that
the spring is considerably stiffer than the undrained critical stiffness, (b - a - E) sigma_*/D_c,
slip accelerates but does not become a rupture. Within a narrow range of dilatancy, the peak slip
rate decreases from 10^9 V_* to values between 10 and 1000 V_*, and the stress drop decreases by a
factor of ten. With faster drainage, this change occurs at stronger dilatancy.
"""

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._fluids import DILATANT_FAULT, REFERENCE, SEGALL_RICE


def peak_slip_rate_claim(
    law: str, dilatancy: float, relation: str, log10: float, what: str
) -> Claim:
    """Return a claim about the peak slip rate of a cycle at c* D_c/V_* = 1 (D7).

    Parameters
    ----------
    law : str
        State evolution law.
    dilatancy : float
        Value of the field ``dilatancy``.
    relation : str
        Relation of the result to the expected value: "equals", "below" or "above".
    log10 : float
        Bound of the decimal logarithm of V/V_*.
    what : str
        Description of the cycle.

    Returns
    -------
    Claim
        Claim about the peak slip rate.
    """
    return Claim(
        id="D7",
        statement=f"{law} law, dilatancy {dilatancy:g}: {what}",
        source=f"{SEGALL_RICE}: dilatancy can prevent instability and cause slow slip",
        variable="max_log10_slip_rate",
        where={"law": law, "drainage": 1.0, "dilatancy": dilatancy},
        relation=relation,
        published=log10,
        reason="an inequality; dynamic ruptures reach 10^9 V_*",
    )


#: Half-width of the linear range of the time axis, in D_c/V_*. Outside this range, the time axis is
#: logarithmic before and after the fastest slip. A logarithmic axis is used because the slip rate
#: before a rupture is inversely proportional to the remaining time.
LINEAR_TIME_RANGE = 1e-6


def plot_undrained_stiffness(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line at the dilatancy for which the undrained critical stiffness equals k.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    weakening = float(dataset["a"]) * (float(dataset["b_over_a"]) - 1.0)
    critical = (weakening - float(dataset["stiffness"])) / float(dataset["mu_star"])
    text = "spring as stiff as the undrained critical one"
    axes.axvline(critical, color="0.4", linestyle=":", label=text)


def time_from_fastest_slip(row: xr.Dataset) -> xr.DataArray:
    """Return time relative to the time of fastest slip.

    Parameters
    ----------
    row : xarray.Dataset
        Results of one cycle.

    Returns
    -------
    xarray.DataArray
        Time in D_c/V_*.
    """
    fastest = int(np.argmax(np.nan_to_num(row["log10_slip_rate"].values, nan=-np.inf)))
    return row["time"] - row["time"][fastest]


def set_symlog_time_scale(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Set logarithmic time scales before and after the fastest slip.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study. Not used.
    axes : matplotlib.axes.Axes
        Axes with time on the horizontal axis.
    """
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
            x_label=r"Time since peak slip rate, $t V_*/D_c$",
            y_label=r"Slip rate, $\log_{10}(V/V_*)$",
            x_limits=(-10.0, 400.0),
            y_scale_group="slip rate",
            legend_columns=3,
        ),
    ]
)


study = Study(
    name="dilatant_cycles",
    title="Stick-slip of a dilatant fault, k = 0.5 (b-a) sigma_*/D_c, with inertia",
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
                statement=f"{law} law: the stress drop of slow cycles is less than 0.05 sigma_*",
                source=SEGALL_RICE,
                variable="static_stress_drop",
                where={"law": law, "drainage": 1.0, "dilatancy": 0.008},
                published=0.05,
                reason="an inequality; the stress drop without dilatancy is 0.24 to 0.27 sigma_*",
            ),
        )
    ],
    plot=figure,
    references=[REFERENCE],
)
