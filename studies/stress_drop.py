"""Static and dynamic stress drops against ln V_0 (section 3.5).

Stress drops of limit cycles decrease with the logarithm of load point velocity. Under the slip law
and at constant normal stress, the slopes over three decades of load point velocity are close to 2
(a-b) sigma_* (static) and (a-b) sigma_* (dynamic). At variable normal stress, the slopes are close
to these values divided by 1 - mu_* cot(phi). Under the slowness law, the slopes depend on
stiffness. At variable normal stress, separate fits at low and at high velocities show that the
slope depends on velocity. At phi = 50 degrees, k_cr decreases so much with V that stick-slip does
not occur at high velocities. The fits ignore cells without stick-slip and report the number of
remaining cells.
"""

import math
from functools import partial

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import LimitCycle, Status
from rsfstudy.reductions import ClosedFormRatio, LinearFit, Reduction

from ._paper import PAPER, REFERENCE

base = Scene(b_over_a=2.0, alpha=0.56, inertia=True)
weakening = base.b - base.a
enhancement = 1.0 / (1.0 - base.mu_star / math.tan(math.radians(base.phi)))


CONSTANT_CASE, VARIABLE_CASE, STEEP_CASE = "constant", "phi = 60", "phi = 50"
CASES: dict[str, dict[str, str | float]] = {
    CONSTANT_CASE: {"normal_stress": "constant"},
    VARIABLE_CASE: {"normal_stress": "variable", "phi": 60.0},
    STEEP_CASE: {"normal_stress": "variable", "phi": 50.0},
}

#: Ranges of ln(V_0/V_*) at the slow and at the fast end of the three decades.
SLOW_RANGE, FAST_RANGE = (0.0, math.log(10.0)), (math.log(100.0), math.log(1000.0))


def _normal_stress_term(case: str) -> str:
    """Return the description of a normal stress case."""
    return case if case == CONSTANT_CASE else f"variable, {case}"


def slip_law_slope_claim(drop: str, case: str, multiple: float, unit: float, law: str) -> Claim:
    """Return a claim about the slope of a drop under the slip law at k = 0.8 k_cr (C15).

    Parameters
    ----------
    drop : str
        Type of stress drop: "static" or "dynamic".
    case : str
        Name of the case.
    multiple : float
        Expected slope, as a multiple of ``unit``.
    unit : float
        Unit of the slope, for example (a-b) sigma_*.
    law : str
        Expression for the slope.

    Returns
    -------
    Claim
        Claim about the slope against ln V_0.
    """
    return Claim(
        id="C15",
        statement=f"slip law, {_normal_stress_term(case)}: {drop} drop against ln V_0, {law}",
        source=f"{PAPER}, section 3.5",
        variable=f"{drop}_slope",
        where={"law": "slip", "case": case, "stiffness_ratio": 0.8},
        published=multiple * unit,
        tolerance=0.5 * abs(unit),
        reason="the paper reports an integer multiple ('scales with') without an error; the "
        "tolerance is half of the unit",
    )


def slowness_law_drop_claim(case: str) -> Claim:
    """Return the claim that the static drop decreases with ln V_0 under the slowness law (C16).

    Parameters
    ----------
    case : str
        Name of the case.

    Returns
    -------
    Claim
        Claim about the slope of the static drop against ln V_0.
    """
    return Claim.below(
        id="C16",
        statement=f"slowness law, {case}: the static drop decreases with ln V_0",
        source=f"{PAPER}, section 3.5",
        variable="static_slope",
        where={"law": "slowness", "case": case, "stiffness_ratio": 0.8},
        published=0.0,
    )


def slope_reductions(drop: str) -> list[Reduction]:
    """Return the reductions that compute the slopes of a stress drop.

    Parameters
    ----------
    drop : str
        Type of stress drop: "static" or "dynamic".

    Returns
    -------
    list of Reduction
        Slopes over three decades and at both ends of the range, and the slope relative to (a-b)
        sigma_*.
    """
    of, on = f"{drop}_stress_drop", "log_load_velocity_ratio"
    return [
        LinearFit(name=f"{drop}_slope", of=of, on=on),
        LinearFit(name=f"{drop}_slope_slow", of=of, on=on, within=SLOW_RANGE),
        LinearFit(name=f"{drop}_slope_fast", of=of, on=on, within=FAST_RANGE),
        ClosedFormRatio(name=f"{drop}_slope_scaled", of=f"{drop}_slope", form="net_weakening"),
    ]


ABSCISSA = "log_load_velocity_ratio"
#: Maximum misfit of a line, relative to the range of the stress drop. A line with a smaller misfit
#: is considered a good fit.
MAX_MISFIT_SHARE = 0.05
DROPS = ("static", "dynamic")


def is_fitted_by_line(drop: str, row: xr.Dataset) -> bool:
    """Return True if a stress drop is linear in ln V_0.

    Parameters
    ----------
    drop : str
        Type of stress drop: "static" or "dynamic".
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    bool
        True if the misfit is small compared to the range of the stress drop.
    """
    values, misfit = row[f"{drop}_stress_drop"], float(row.get(f"{drop}_slope_misfit", math.nan))
    return misfit <= MAX_MISFIT_SHARE * float(values.max() - values.min())


def fit_line(drop: str, row: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the fitted line.

    Parameters
    ----------
    drop : str
        Type of stress drop: "static" or "dynamic".
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of xarray.DataArray
        Values of ln(V_0/V_*) and of the line. The values are NaN if a line does not fit.
    """
    known = row[f"{drop}_stress_drop"]
    x = row[ABSCISSA].where(known.notnull() & is_fitted_by_line(drop, row))
    slope = float(row.get(f"{drop}_slope", math.nan))
    return x, float(known.mean()) + slope * (x - x.mean())


def curve_name(drop: str, row: xr.Dataset) -> str:
    """Return the name of a case, with the slope if the drop is linear in ln V_0.

    Parameters
    ----------
    drop : str
        Type of stress drop: "static" or "dynamic".
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    str
        Label of the curve.
    """
    from rsfstudy.plots import format_slope

    text, slope = str(row["case"].item()), row.get(f"{drop}_slope", xr.DataArray(math.nan))
    if not bool(np.isfinite(slope)):
        return text
    return f"{text}: " + (
        format_slope(row, f"{drop}_slope") if is_fitted_by_line(drop, row) else "no linear fit"
    )


def scaled_slope(row: xr.Dataset) -> xr.DataArray:
    """Return the slope of the static stress drop, in (a-b) sigma_*, at each stiffness.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Slopes relative to (a-b) sigma_*. The slopes are NaN if a line does not fit.
    """
    places = range(row.sizes["stiffness_ratio"])
    straight = [is_fitted_by_line("static", row.isel(stiffness_ratio=place)) for place in places]
    return row["static_slope_scaled"].where(xr.DataArray(straight, dims="stiffness_ratio"))


def local_slope(row: xr.Dataset) -> xr.DataArray:
    """Compute the local slope at each load point velocity.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Slopes from finite differences.
    """
    values = row["static_stress_drop"]
    several = values.size > 1
    return values.copy(data=np.gradient(values, row[ABSCISSA])) if several else values * math.nan


figure = Figure(
    [
        *(
            Panel(
                x=ABSCISSA,
                y=f"{drop}_stress_drop",
                hue=["case"],
                facet=["law"],
                isel={"stiffness_ratio": max},
                fit_line=partial(fit_line, drop),
                curve_label=partial(curve_name, drop),
                y_limits=(0.0, None),
                legend_title="Slopes",
            )
            for drop in DROPS
        ),
        Panel(
            x="stiffness_ratio",
            y=scaled_slope,
            hue=["case", "law"],
            title="Slopes of the fitted lines, $f(k)$",
            y_label=r"Slope of static drop over $(a-b)\,\sigma_*$",
        ),
        Panel(
            x=ABSCISSA,
            y=local_slope,
            hue=["case", "law"],
            isel={"stiffness_ratio": max},
            title="Local slopes (constant if the law holds)",
            y_label=r"Local slope of static drop, $\sigma_*$",
        ),
    ],
    height=46.0,
)


study = Study(
    name="stress_drop",
    title="Static and dynamic stress drops of stick-slip against ln V_0",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("case", CASES),
        Axis("stiffness_ratio", [0.4, 0.6, 0.8]),
        Axis("load_velocity_ratio", 10.0 ** np.linspace(0.0, 3.0, 10)),
    ],
    measure=LimitCycle(phases=2),
    reductions=[*slope_reductions("static"), *slope_reductions("dynamic")],
    claims=[
        slip_law_slope_claim("static", CONSTANT_CASE, 2.0, -weakening, "2(a-b)"),
        slip_law_slope_claim("dynamic", CONSTANT_CASE, 1.0, -weakening, "a-b"),
        slip_law_slope_claim(
            "static", VARIABLE_CASE, 2.0, -weakening * enhancement, "2(a-b)/(1 - mu_* cot phi)"
        ),
        slip_law_slope_claim(
            "dynamic", VARIABLE_CASE, 1.0, -weakening * enhancement, "(a-b)/(1 - mu_* cot phi)"
        ),
        slowness_law_drop_claim(CONSTANT_CASE),
        slowness_law_drop_claim(VARIABLE_CASE),
        Claim.below(
            id="C16",
            statement="slowness law: the slope is steeper at variable normal stress",
            source=f"{PAPER}, section 3.5",
            variable="static_slope",
            where={"law": "slowness", "case": VARIABLE_CASE, "stiffness_ratio": 0.8},
            baseline={"law": "slowness", "case": CONSTANT_CASE, "stiffness_ratio": 0.8},
            published=0.0,
        ),
        Claim.above(
            id="C16",
            statement="slowness law, constant: f(k) depends on stiffness (0.4 minus 0.8 k_cr)",
            source="He et al. (2003), cited in section 3.5",
            variable="static_slope_scaled",
            where={"law": "slowness", "case": CONSTANT_CASE, "stiffness_ratio": 0.4},
            baseline={"law": "slowness", "case": CONSTANT_CASE, "stiffness_ratio": 0.8},
            published=0.05,
            reason="an inequality; the bound is much larger than the standard errors",
        ),
        Claim(
            id="C2",
            statement="phi = 50, 0.8 k_cr: at 1000 V_* there is no stick-slip",
            source=f"{PAPER}, section 2.2",
            variable="status",
            where={
                "law": "slip",
                "case": STEEP_CASE,
                "stiffness_ratio": 0.8,
                "load_velocity_ratio": 1e3,
            },
            published=float(Status.NO_LIMIT_CYCLE),
            reason="the status no_limit_cycle: faster loading stabilises",
        ),
        Claim.below(
            id="C2",
            statement="phi = 50, 0.8 k_cr: the result contains the number of fitted points",
            source=f"{PAPER}, section 2.2",
            variable="static_slope_points",
            where={"law": "slip", "case": STEEP_CASE, "stiffness_ratio": 0.8},
            published=10.0,
            reason="an inequality: cells without stick-slip are ignored",
        ),
    ],
    plot=figure,
    references=[REFERENCE, "Gu and Wong (1991), J. Geophys. Res. 96, 21677-21691"],
)
