"""Coefficient zeta of the critical velocity step for a family of laws.

A family of laws with the exponent eps connects the slip law (eps = 0) with the slowness law (eps =
1). At constant normal stress and critical stiffness, the critical step is V_0/V_* = 1 + a/[(1 -
eps)(b-a)], so zeta = 1/(1 - eps). Eq. 10 of the paper is the special case eps = 0. Under the
slowness law, the slip rate remains bounded after every velocity step. With an infinite instability
norm, no velocity step therefore triggers an instability. Variable normal stress lowers zeta. At
variable normal stress and with eps close to 1, no critical step exists. The reason is that k_cr
decreases with V_0. The closed form assumes an infinite instability norm, and the norm of 1e6 in
this study is high enough for it to apply.
"""

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import ClosedFormRatio, ProportionalFit

from ._laws import REFERENCES, family_colour
from ._paper import PAPER, REFERENCE


def zeta_claim(exponent: float) -> Claim:
    """Return the claim that zeta equals its closed form, 1/(1 - eps) (L7).

    Parameters
    ----------
    exponent : float
        Exponent eps of the law.

    Returns
    -------
    Claim
        Claim about zeta at constant normal stress.
    """
    return Claim(
        id="L7",
        statement=f"eps = {exponent:g}, constant normal stress: zeta = 1/(1 - eps)",
        source="invariant line of the orbits at k = k_cr; eps = 0 is eq. 10 of the paper",
        variable="zeta",
        where={"law_exponent": exponent, "normal_stress": "constant"},
        published=1.0 / (1.0 - exponent),
        tolerance=1.5e-7,
        reason="exact for an infinite norm; a norm of 1e6 lowers zeta by 1e-7 at eps = 0.5, and "
        "numerical errors of the critical steps contribute up to 7e-8",
    )


def variable_normal_stress_claim(exponent: float) -> Claim:
    """Return the claim that variable normal stress lowers zeta (L8).

    The paper reports this result for the slip law.

    Parameters
    ----------
    exponent : float
        Exponent eps of the law.

    Returns
    -------
    Claim
        Claim about the difference of zeta.
    """
    return Claim.below(
        id="L8",
        statement=f"eps = {exponent:g}: variable normal stress lowers zeta",
        source=f"{PAPER}, Fig. 5, for the slip law",
        variable="zeta",
        where={"law_exponent": exponent, "normal_stress": "variable"},
        baseline={"law_exponent": exponent, "normal_stress": "constant"},
        published=0.0,
    )


def fit_line(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the fitted line.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of ndarray
        Values of a/(b-a) and of V_0/V_* at the ends of the line.
    """
    reach = np.array([0.0, 1.04 * float(row["a_over_b_minus_a"].max())])
    return reach, 1.0 + float(row.get("zeta", np.nan)) * reach


figure = Figure(
    [
        Panel(
            x="a_over_b_minus_a",
            y="critical_velocity_ratio",
            hue=["law_exponent", "normal_stress"],
            style=lambda row: {"color": family_colour(2.0 * float(row["law_exponent"]))},
            fit_line=fit_line,
            annotation="zeta",
            title="Family of laws, $k = k_{cr}$; by normal stress",
            x_limits=(0.0, None),
            y_limits=(1.0, None),
        )
    ],
    height=70.0,
)


study = Study(
    name="laws_zeta",
    title="zeta in V_0/V_* = 1 + zeta a/(b-a) and the state evolution law, k = k_cr",
    summary=Study.caption(__doc__),
    base=Scene(law="family", instability_norm=1e6),
    axes=[
        Axis("law_exponent", [0.0, 0.25, 0.5]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("b_over_a", 1.0 + 1.0 / (np.arange(2, 9) / 8)),
    ],
    measure=CriticalStep(of="load_velocity_ratio"),
    reductions=[
        ProportionalFit(
            name="zeta", of="critical_velocity_ratio", intercept=1.0, on="a_over_b_minus_a"
        ),
        ClosedFormRatio(
            name="over_closed_form",
            of="critical_velocity_ratio",
            form="velocity_step_of_the_family",
        ),
    ],
    claims=[
        zeta_claim(0.0),
        zeta_claim(0.25),
        zeta_claim(0.5),
        *map(variable_normal_stress_claim, (0.0, 0.25, 0.5)),
    ],
    plot=figure,
    references=[REFERENCE, *REFERENCES],
)
