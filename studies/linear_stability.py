"""Critical stiffness as a function of slip rate and driving angle (Fig. 2).

Steady sliding is stable under small perturbations if the stiffness lies above the curve, and
unstable if the stiffness lies below the curve. The critical stiffness decreases with slip rate, and
the decrease is steeper for small angles between the driving stress and the normal of the fault. If
phi < atan(mu_ss), there is no steady state. Because the critical stiffness decreases with slip
rate, a faster load point can stabilise steady sliding, and a slower load point can destabilise it.
Inertia raises the critical stiffness in proportion to (T V)**2. For T = 5 s, the relative increase
is at most 6e-5, at a slip rate of 10^6 V_*.
"""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import LinearStability
from rsfstudy.reductions import Inverse, LinearFit
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._paper import PAPER, REFERENCE
from ._phase_plane import scene_from_coordinates

NO_MASS, PUBLISHED_PERIOD, LONG_PERIOD = "no mass", "T = 5 s", "T = 1e6 s"
MASS_CASES: dict[str, dict[str, bool | float]] = {
    NO_MASS: {"inertia": False},
    PUBLISHED_PERIOD: {"inertia": True, "period": 5.0},
    LONG_PERIOD: {"inertia": True, "period": 1e6},
}


def growth_threshold_claim(mass: str, phi: float, rate: float) -> Claim:
    """Return the claim that perturbations grow below k_cr (C1).

    The stiffness below which perturbations grow is computed from the eigenvalues of the linearised
    equations of motion.

    Parameters
    ----------
    mass : str
        Name of the inertia case.
    phi : float
        Driving angle in degrees.
    rate : float
        Slip rate relative to V_*.

    Returns
    -------
    Claim
        Claim about the difference from the closed form.
    """
    return Claim(
        id="C1",
        statement=f"{mass}, phi = {phi:g}, {rate:g} V_*: perturbations grow below k_cr",
        source=f"{PAPER}, eqs. 7 and 8",
        variable="critical_stiffness_error",
        where={"mass": mass, "phi": phi, "load_velocity_ratio": rate},
        published=0.0,
        tolerance=3e-10,
        reason="central differences of the assembled equations have a relative error of 1e-8",
    )


def steepness_claim(phi: float, gentler: float) -> Claim:
    """Return the claim that k_cr decreases more steeply with V for a smaller angle (C1).

    Parameters
    ----------
    phi : float
        Smaller driving angle in degrees.
    gentler : float
        Larger driving angle in degrees.

    Returns
    -------
    Claim
        Claim about the difference of the slopes.
    """
    return Claim.below(
        id="C1",
        statement=f"k_cr decreases with V more steeply at {phi:g} than at {gentler:g} degrees",
        source=f"{PAPER}, section 2.2, Fig. 2",
        variable="stiffness_slope",
        where={"mass": NO_MASS, "phi": phi},
        baseline={"mass": NO_MASS, "phi": gentler},
        published=0.0,
    )


def critical_stiffness_curve(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Compute the critical stiffness at closely spaced slip rates.

    The spacing is smallest close to the slip rate at which the critical stiffness is unbounded.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of ndarray
        Slip rates V/V_* and critical stiffness in sigma_*/D_c. The stiffness is NaN if there is no
        steady sliding.
    """
    scene, rates = (
        scene_from_coordinates(row.isel(load_velocity_ratio=-1)),
        row["load_velocity_ratio"].values,
    )
    slowest = max(scene.find_min_steady_log_slip_rate(), math.log(rates.min()))
    if slowest > math.log(rates.max()) - 0.05:
        return np.full(1, math.nan), np.full(1, math.nan)
    logs = slowest + np.geomspace(0.05, math.log(rates.max()) - slowest, 200)
    stiffnesses = np.array([scene.critical_stiffness_at(x, quasi_static=True) for x in logs])
    return np.exp(logs), np.where(stiffnesses > 0.0, stiffnesses, math.nan)


def plot_slowest_steady_rate(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw dotted lines at the lowest slip rate at which steady sliding exists.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    for number in range(dataset.sizes["phi"]):
        row = dataset.isel(phi=number, load_velocity_ratio=-1)
        slowest = math.exp(scene_from_coordinates(row).find_min_steady_log_slip_rate())
        if slowest > float(dataset["load_velocity_ratio"].min()):
            axes.axvline(slowest, color=cycle_style(number)["color"], linestyle=":", linewidth=0.8)
            soon = slowest < 1e3 * float(dataset["load_velocity_ratio"].min())
            side = "left" if soon or dataset.sizes["phi"] == 1 else "right"
            above = {"transform": axes.get_xaxis_transform(), "ha": side, "va": "top"}
            axes.text(slowest, 0.98, r" $\phi = \tan^{-1}\mu_{ss}$ ", fontsize=7, **above)


def angle_label(row: xr.Dataset) -> str:
    """Return a label with the driving angle and the slip rate above which sliding is stable.

    The stiffness of the spring is 0.8 k_cr(V_*).

    Parameters
    ----------
    row : xarray.Dataset
        Results for one driving angle.

    Returns
    -------
    str
        Text in LaTeX.
    """
    from rsfstudy.plots import format_number

    text = rf"$\phi = {float(row['phi']):g}°$"
    velocity = float(row.get("stabilising_velocity", math.nan))
    stable = rf"{text}: $0.8\,k_{{cr}}(V_*)$ stable from {format_number(velocity)} $V_*$"
    return stable if math.isfinite(velocity) else text


def stiffness_rise_claim(row: xr.Dataset) -> xr.DataArray:
    """Return the relative increase of the critical stiffness due to inertia.

    The critical stiffness is computed from the growth of perturbations.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Relative increase. The value is NaN if the increase is too small to be resolved.
    """
    massless = row["critical_stiffness"] / (1.0 + row["rise_by_dynamics"])
    rise = row["critical_stiffness_from_growth"] / massless - 1.0
    return rise.where((rise > 1e-8) & (row["rise_by_dynamics"] > 0.0))


panel = Panel(x="load_velocity_ratio", hue=["phi"], x_label="Slip rate, $V/V_*$", log="xy")
figure = Figure(
    [
        replace(
            panel,
            y="critical_stiffness_from_growth",
            isel={"mass": 0},
            style={"markersize": 2},
            fit_line=critical_stiffness_curve,
            curve_label=angle_label,
            overlays=[plot_slowest_steady_rate],
            y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
            title="Stable above; lines: closed form, points: growth",
        ),
        replace(
            panel,
            y=stiffness_rise_claim,
            hue=["mass", "phi"],
            style={"markersize": 2, "fillstyle": "full"},
            fit_line=lambda row: (
                row["load_velocity_ratio"],
                row["rise_by_dynamics"].where(row["rise_by_dynamics"] > 0.0),
            ),
            curve_label=lambda row: str(row["mass"].item()),
            title="Increase due to inertia, at all angles",
            condition=lambda dataset: bool((dataset["rise_by_dynamics"] > 0.0).any()),
            y_label=r"Relative increase of $k_{cr}$ due to inertia",
        ),
    ]
)


study = Study(
    name="linear_stability",
    title="Critical stiffness of steady sliding against slip rate, b/a = 2, alpha = 0.56",
    summary=Study.caption(__doc__),
    base=Scene(b_over_a=2.0, alpha=0.56),
    axes=[
        Axis("mass", MASS_CASES),
        Axis("phi", [40.0, 45.0, 50.0, 60.0, 75.0]),
        Axis("load_velocity_ratio", 10.0 ** np.linspace(-6.0, 6.0, 49)),
    ],
    measure=LinearStability(),
    reductions=[
        LinearFit(
            name="stiffness_slope",
            of="critical_stiffness",
            on="log_load_velocity_ratio",
            within=(-1.2, 1.2),
        ),
        Inverse(
            name="stabilising_velocity",
            of="relative_critical_stiffness",
            on="load_velocity_ratio",
            levels=0.8,
        ),
    ],
    claims=[
        Claim.below(
            id="C1",
            statement="phi = 60 degrees: k_cr decreases with V",
            source=f"{PAPER}, section 2.2, Fig. 2",
            variable="stiffness_slope",
            where={"mass": NO_MASS, "phi": 60.0},
            published=0.0,
        ),
        steepness_claim(50.0, 60.0),
        steepness_claim(40.0, 50.0),
        Claim(
            id="C1",
            statement="phi = 50, 100 V_*: eq. 7 equals eq. 8",
            source=f"{PAPER}, eqs. 7 and 8",
            variable="critical_stiffness",
            where={"mass": NO_MASS, "phi": 50.0, "load_velocity_ratio": 100.0},
            baseline_variable="critical_stiffness_explicit",
            baseline={"mass": NO_MASS, "phi": 50.0, "load_velocity_ratio": 100.0},
            published=0.0,
            tolerance=1e-15,
            reason="an identity; the tolerance covers rounding",
        ),
        growth_threshold_claim(NO_MASS, 60.0, 1.0),
        growth_threshold_claim(PUBLISHED_PERIOD, 60.0, 1e6),
        growth_threshold_claim(LONG_PERIOD, 60.0, 1.0),
        growth_threshold_claim(LONG_PERIOD, 40.0, 100.0),
        Claim.above(
            id="C2",
            statement="phi = 40 degrees, V = 1e-4 V_*: mu_ss exceeds tan(phi) = 0.8391",
            source=f"{PAPER}, eq. 9",
            variable="steady_friction",
            where={"mass": NO_MASS, "phi": 40.0, "load_velocity_ratio": 1e-4},
            published=0.8391,
            reason="an inequality: there is no steady state at this slip rate, but there is one at "
            "faster slip rates",
        ),
        Claim.below(
            id="C2",
            statement=(
                "phi = 50: sliding at 0.8 k_cr(V_*) becomes stable at a velocity below 1000 V_*"
            ),
            source=f"{PAPER}, section 2.2, Fig. 2",
            variable="stabilising_velocity",
            where={"mass": NO_MASS, "phi": 50.0},
            published=1000.0,
            reason="an inequality; the limit cycles of this spring end at the same velocity",
        ),
        Claim.above(
            id="C2",
            statement="phi = 60: stable sliding requires more than ten times the velocity at phi "
            "= 50",
            source=f"{PAPER}, section 2.2, Fig. 2",
            variable="stabilising_velocity",
            where={"mass": NO_MASS, "phi": 60.0},
            published=1000.0,
            reason="'the curve is very flat'",
        ),
    ],
    plot=figure,
    references=[REFERENCE, "Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694"],
)
