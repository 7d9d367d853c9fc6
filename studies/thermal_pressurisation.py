"""Critical stiffness as a function of heating, cooling and drainage.

Frictional heat raises the pore pressure, which weakens the fault until heat and fluid have flowed
out. The heating parameter E is the undrained increase of pore pressure due to a slip of D_c at a
friction coefficient of 1. Without cooling and drainage, the critical stiffness is b - a + mu_*
(mu_* + a) E in units of sigma_*/D_c, to first order in E. For E = 0.03, the critical stiffness is
three times as high as without heating. If the fluid drains before the fault has slipped by a
considerable fraction of D_c, the critical stiffness is (b - a) sigma_*/D_c. Fast cooling with fast
drainage even stabilises the fault slightly.
"""

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LinearStability
from rsfstudy.study.figure_declarations import build_horizontal_line_overlay

from ._heat import PRESSURE_REFERENCES, PRESSURISED_FAULT, closest_to, known_value_claim

_A, _B, _MU_STAR = 0.01, 0.015, 0.6


def quartic_threshold(factor: float, cooling: float, drainage: float) -> float:
    """Compute the critical stiffness from the quartic of the growth rates.

    Parameters
    ----------
    factor : float
        Undrained increase E of pore pressure due to a slip of D_c at a friction coefficient of 1.
    cooling, drainage : float
        Cooling rate C and drainage rate C_h.

    Returns
    -------
    float
        Stiffness in sigma_*/D_c at which the largest growth rate is zero.
    """
    grows = np.poly1d([1.0, 1.0])
    flows = np.poly1d([1.0, cooling]) * np.poly1d([1.0, drainage])
    heats = np.poly1d([_MU_STAR * factor, 0.0])
    friction = (_A * grows - _B) * flows - _MU_STAR * heats * grows

    def growth(stiffness: float) -> float:
        quartic = stiffness * (flows + heats) * grows + np.poly1d([1.0, 0.0]) * friction
        return float(quartic.roots.real.max())

    return float(brentq(growth, 1e-3, 0.1, xtol=1e-14))


def closed_form(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Compute the critical stiffness along one curve.

    Parameters
    ----------
    row : xarray.Dataset
        Results for one heating and one cooling rate.

    Returns
    -------
    tuple of ndarray
        Drainage rates and critical stiffness in sigma_*/D_c.
    """
    rates = np.geomspace(row["drainage"].values[0], row["drainage"].values[-1], 100)
    fixed = float(row["heating"]), float(row["cooling"])
    return rates, np.array([quartic_threshold(*fixed, rate) for rate in rates.tolist()])


def stiffness_claim(heating: float, cooling: float, drainage: float, value: float) -> Claim:
    """Return the claim that k_cr equals the root of the quartic (H10).

    Parameters
    ----------
    heating, cooling, drainage : float
        Heating E, cooling rate C and drainage rate C_h.
    value : float
        Critical stiffness in sigma_*/D_c.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    where = {"heating": heating, "cooling": cooling, "drainage": drainage}
    statement = (
        f"E = {heating:g}, C = {cooling:g}, C_h = {drainage:g}: k_cr = {value:g} sigma_*/D_c"
    )
    return known_value_claim("H10", statement, "critical_stiffness", where, value, 1e-11)


panel = Panel(
    x="drainage",
    y="critical_stiffness_from_growth",
    hue=["heating"],
    isel={"cooling": closest_to(0.01)},
    fit_line=closed_form,
    curve_label=lambda row: f"$E = {float(row['heating']):g}$",
    overlays=[
        build_horizontal_line_overlay(_B - _A, color="0.75", linewidth=2.0, label="drained, $b-a$")
    ],
    style={"markersize": 2.5},
    x_label="Drainage rate, $c^*D_c/V_*$",
    y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
    title="Lines: closed form, $C = 0.01$",
    log="xy",
)
figure = Figure(
    [
        panel,
        Panel(
            x="drainage",
            y="critical_stiffness_from_growth",
            hue=["cooling"],
            isel={"heating": closest_to(0.01)},
            fit_line=closed_form,
            curve_label=lambda row: f"$C = {float(row['cooling']):g}$",
            style={"markersize": 2.5},
            x_label="Drainage rate, $c^*D_c/V_*$",
            y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
            title="Lines: closed form, $E = 0.01$",
            log="x",
        ),
    ]
)


study = Study(
    name="thermal_pressurisation",
    title="Critical stiffness with thermal pressurisation against drainage",
    summary=Study.caption(__doc__),
    base=PRESSURISED_FAULT,
    axes=[
        Axis("heating", [0.001, 0.003, 0.01, 0.03]),
        Axis("cooling", [0.001, 0.01, 0.1, 1.0, 10.0]),
        Axis(
            "drainage",
            sorted({*np.round(10.0 ** np.linspace(-3.0, 2.0, 21), 12).tolist(), 0.05}),
        ),
    ],
    measure=LinearStability(),
    claims=[
        stiffness_claim(0.01, 0.01, 0.05, 0.00904380016279394),
        stiffness_claim(0.001, 0.01, 0.05, 0.00540614179458418),
        stiffness_claim(0.03, 0.01, 0.05, 0.01703865335310541),
        stiffness_claim(0.01, 0.1, 0.01, 0.00924690541739002),
        stiffness_claim(0.01, 1.0, 1.0, 0.00660581847808572),
        stiffness_claim(0.01, 0.001, 10.0, 0.00537469157942947),
        stiffness_claim(0.01, 10.0, 10.0, 0.00498549402338809),
        Claim(
            id="H11",
            statement="E = 0.03: k_cr is the stiffness below which perturbations grow",
            source="eigenvalues of the assembled equations",
            variable="critical_stiffness_error",
            where={"heating": 0.03, "cooling": 0.01, "drainage": 0.05},
            published=0.0,
            tolerance=1e-9,
            reason="central differences of the assembled equations have a relative error of 1e-8",
        ),
        Claim.below(
            id="H12",
            statement="fast cooling and drainage stabilise: k_cr is below b - a",
            source="quartic of the growth rates",
            variable="critical_stiffness",
            where={"heating": 0.01, "cooling": 10.0, "drainage": 10.0},
            published=_B - _A,
        ),
    ],
    plot=figure,
    references=PRESSURE_REFERENCES,
)
