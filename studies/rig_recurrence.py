"""Recurrence interval and stress drop of laboratory stick-slip.

The figures show the recurrence interval in s and the static stress drop in MPa against load point
velocity in um/s at three normal stresses. At 5, 10 and 20 MPa, the stiffness of the machine is 0.4,
0.2 and 0.1 times the critical stiffness, respectively. Stress drops decrease by slightly more than
2 (b-a) sigma per unit increase in the natural logarithm of the load point velocity. One half of
this decrease is due to friction, and the other half is due to overshoot. Lines show the time in
which the load point restores the stress drop if the slider is at rest. The recurrence interval is
slightly longer than this time, because the slider creeps while the load point moves.
"""

from dataclasses import replace

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Rig, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.reductions import LinearFit
from rsfstudy.study.figure_declarations import MatplotlibAxes

#: Normal stresses in MPa.
NORMAL_STRESSES = (5.0, 10.0, 20.0)
#: Decrease of each stress drop in (b-a) sigma if ln V_0 increases by 1.
DROP_MULTIPLES = {"dynamic": 1.0, "static": 2.0}

rig = Rig(
    normal_stress="5 MPa",
    slip_distance="10 um",
    reference_velocity="1 um/s",
    stiffness="0.001 MPa/um",
    mass="1e4 kg/m^2",
)
base = rig.scene(a=0.01, b_over_a=1.5, normal_stress="constant")
weakening = base.b - base.a

CLOSED_FORM_SOURCE = "steady friction at the load point velocity and at the peak slip rate rate"
TOLERANCE_REASON = (
    "the peak slip rate is proportional to the stress drop, so the slope is steeper by the ratio "
    "of (b-a) sigma to the dynamic drop, 6 to 9 % to first order"
)


def slip_law_drop_claim(stress: float, drop: str, multiple: float) -> Claim:
    """Return a claim about how a stress drop varies with ln V_0 under the slip law (S1).

    Parameters
    ----------
    stress : float
        Normal stress in MPa.
    drop : str
        Type of stress drop: "static" or "dynamic".
    multiple : float
        Expected decrease in (b-a) sigma.

    Returns
    -------
    Claim
        Claim about the slope against ln V_0.
    """
    return Claim(
        id="S1",
        statement=(
            f"slip law, {stress:g} MPa: {drop} drop decreases by {multiple:g} (b-a) sigma per "
            "unit of ln V_0"
        ),
        source=f"{CLOSED_FORM_SOURCE}" + ", and an overshoot of equal size" * (drop == "static"),
        variable=f"{drop}_slope",
        where={"law": "slip", "sigma_star": stress},
        published=-multiple * weakening,
        tolerance=0.12 * multiple * weakening,
        reason=TOLERANCE_REASON,
    )


def slowness_law_drop_claim(stress: float) -> Claim:
    """Return a claim about the static stress drop under the slowness law (S2).

    If ln V_0 increases by 1, the static drop decreases by more than 2 (b-a) sigma. The reason is
    that the state increases throughout the interval between events, and this interval is shorter at
    a higher V_0.

    Parameters
    ----------
    stress : float
        Normal stress in MPa.

    Returns
    -------
    Claim
        Claim about the slope against ln V_0.
    """
    return Claim.below(
        id="S2",
        statement=f"slowness law, {stress:g} MPa: the static drop decreases more steeply",
        source="contacts heal between events, for a time that is proportional to the drop",
        variable="static_slope",
        where={"law": "slowness", "sigma_star": stress},
        published=-2.0 * weakening,
    )


def loading_time_line(row: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the time in which the load point restores the static stress drop.

    The slider is assumed to be at rest during this time.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of xarray.DataArray
        Load point velocities and times.
    """
    stress_rate = row["stiffness"] * row["load_velocity"]
    return row["load_velocity"], row["static_stress_drop"] / stress_rate


def explain_lines(_results: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Write an explanation of the lines in a panel.

    Parameters
    ----------
    _results : xarray.Dataset
        Results of the panel, which are not used.
    axes : matplotlib.axes.Axes
        Axes of the panel.
    """
    text = "lines: stress drop /\n(stiffness $\\times$ load point velocity)"
    axes.text(0.04, 0.05, text, transform=axes.transAxes, va="bottom", fontsize="small")


panel = Panel(x="load_velocity", hue=["sigma_star"], facet=["law"])
figure = Figure(
    [
        replace(
            panel,
            y="recurrence_interval",
            log="xy",
            fit_line=loading_time_line,
            overlays=[explain_lines],
            y_scale_group="interval",
            y_label="Recurrence interval (s)",
        ),
        replace(panel, y="static_stress_drop", log="x", y_limits=(0.0, None), y_scale_group="drop"),
    ]
)

study = Study(
    name="rig_recurrence",
    title="Stick-slip of a rig, k = 0.001 MPa/um, at three normal stresses",
    summary=Study.caption(__doc__),
    rig=rig,
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        rig.axis("normal_stress", [f"{stress:g} MPa" for stress in NORMAL_STRESSES]),
        rig.axis("load_velocity", "1:100:9:log um/s"),
    ],
    measure=LimitCycle(),
    reductions=[
        LinearFit(name=f"{drop}_slope", of=f"{drop}_stress_drop", on="log_load_velocity_ratio")
        for drop in ("static", "dynamic")
    ],
    claims=[
        *(
            slip_law_drop_claim(stress, drop, n)
            for stress in NORMAL_STRESSES
            for drop, n in DROP_MULTIPLES.items()
        ),
        *(slowness_law_drop_claim(stress) for stress in NORMAL_STRESSES),
    ],
    plot=figure,
    references=["Gu and Wong (1991), J. Geophys. Res. 96, 21677-21691"],
)
