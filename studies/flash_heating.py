"""Critical stiffness of steady sliding with flash heating.

Flash heating weakens contacts if the slip rate exceeds the weakening velocity V_w. Far below V_w,
the critical stiffness is (b - a) sigma_*/D_c. Close to V_w, the steady friction decreases so
steeply that the critical stiffness is 60 times larger. Far above V_w, the steady friction
approaches f_w, and the critical stiffness decreases in proportion to 1/V. A spring with a stiffness
between (b - a) sigma_*/D_c and the maximum is therefore stable at low slip rates, and becomes
unstable if the slip rate comes close to V_w.
"""

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LinearStability

from ._heat import FLASH_FAULT, FLASH_REFERENCES, INDEPENDENT, RICE, known_value_claim

#: Friction coefficient f_w, exponent n and b - a of the fault.
_WEAK, _EXPONENT, _WEAKENING = 0.2, 8.0, 0.004


def closed_form(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Compute the critical stiffness from the slope of the steady friction.

    Parameters
    ----------
    row : xarray.Dataset
        Results for one weakening velocity.

    Returns
    -------
    tuple of ndarray
        Slip rates V/V_* and critical stiffness in sigma_*/D_c.
    """
    velocity = float(row["weakening_velocity_ratio"])
    rates = np.geomspace(
        row["load_velocity_ratio"].values[0], row["load_velocity_ratio"].values[-1], 400
    )
    ratio = (rates / velocity) ** _EXPONENT
    fall = ((1.0 + velocity**-_EXPONENT) / (1.0 + ratio)) ** (1.0 / _EXPONENT)
    excess = float(row["mu_star"]) - _WEAK - _WEAKENING * np.log(rates)
    return rates, fall * (_WEAKENING + excess * ratio / (1.0 + ratio))


def stiffness_claim(rate: float, value: float) -> Claim:
    """Return the claim that k_cr equals its closed form (H1).

    Parameters
    ----------
    rate : float
        Slip rate V/V_*.
    value : float
        Critical stiffness in sigma_*/D_c.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    where = {"weakening_velocity_ratio": 1e5, "load_velocity_ratio": rate}
    statement = f"V_w = 1e5 V_*, V = {rate:g} V_*: k_cr = {value:g} sigma_*/D_c"
    return known_value_claim("H1", statement, "critical_stiffness", where, value, 1e-10)


figure = Figure(
    [
        Panel(
            x="load_velocity_ratio",
            y="critical_stiffness_from_growth",
            hue=["weakening_velocity_ratio"],
            fit_line=closed_form,
            style={"markersize": 2},
            x_label="Slip rate, $V/V_*$",
            y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
            title="Stable above; lines: closed form",
            log="xy",
        ),
        Panel(
            x="load_velocity_ratio",
            y="steady_friction",
            hue=["weakening_velocity_ratio"],
            style={"markersize": 2},
            x_label="Slip rate, $V/V_*$",
            y_label=r"Steady friction, $\mu_{ss}$",
            title="Steady friction decreases to $f_w$",
            log="x",
        ),
    ]
)


study = Study(
    name="flash_heating",
    title="Critical stiffness with flash heating against slip rate, b/a = 1.4, f_w = 0.2",
    summary=Study.caption(__doc__),
    base=FLASH_FAULT,
    axes=[
        Axis("weakening_velocity_ratio", [1e3, 1e4, 1e5]),
        Axis("load_velocity_ratio", sorted({*10.0 ** np.linspace(0.0, 7.0, 43), 1e5, 3e5})),
    ],
    measure=LinearStability(),
    claims=[
        stiffness_claim(1.0, 0.004),
        stiffness_claim(1e5, 0.16595402641277),
        stiffness_claim(3e5, 0.11783128175733),
        stiffness_claim(1e6, 0.03487379538848),
        stiffness_claim(1e7, 0.00339527617396),
        Claim(
            id="H2",
            statement="V = V_w = 1e5 V_*: k_cr is the stiffness below which perturbations grow",
            source="eigenvalues of the assembled equations",
            variable="critical_stiffness_error",
            where={"weakening_velocity_ratio": 1e5, "load_velocity_ratio": 1e5},
            published=0.0,
            tolerance=1e-9,
            reason="central differences of the assembled equations have a relative error of 1e-9",
        ),
        Claim.above(
            id="H3",
            statement="V = V_w: k_cr is more than 40 times the value at V_*",
            source=f"{RICE}, and {INDEPENDENT}",
            variable="critical_stiffness",
            where={"weakening_velocity_ratio": 1e5, "load_velocity_ratio": 1e5},
            published=40.0 * _WEAKENING,
        ),
        Claim(
            id="H4",
            statement="V = 100 V_w: steady friction is 0.203355",
            source=INDEPENDENT,
            variable="steady_friction",
            where={"weakening_velocity_ratio": 1e5, "load_velocity_ratio": 1e7},
            published=0.20335527617396,
            tolerance=1e-13,
            reason="the printed digits of the value",
        ),
    ],
    plot=figure,
    references=FLASH_REFERENCES,
)
