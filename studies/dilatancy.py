"""Critical stiffness of a dilatant fault as a function of drainage.

If pores dilate when the slip rate increases, the pore pressure falls. The frictional strength then
rises until fluid has flowed into the pores. With fast drainage, the critical stiffness is (b - a)
sigma_*/D_c, as without a fluid. Without drainage, the critical stiffness is (b - a - E)
sigma_*/D_c, with E = mu_* eps/(beta sigma_*). If E exceeds b - a, the undrained fault is stable at
every stiffness. Between these limits, the critical stiffness depends on how much fluid flows into
the pores while the fault slips by D_c. On a soft spring, slow oscillations are unstable even at the
strongest dilatancy, because fluid has enough time to flow into the pores.
"""

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LinearStability
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._fluids import DILATANT_FAULT, REFERENCE, SEGALL_RICE


def closed_form_claim(drainage: float, value: float) -> Claim:
    """Return the claim that k_cr equals the closed form (D1).

    Parameters
    ----------
    drainage : float
        Drainage rate c* D_c/V.
    value : float
        Critical stiffness from the closed form at E = 0.002.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    return Claim(
        id="D1",
        statement=f"E = 0.002, c* D_c/V = {drainage:g}: k_cr = {value:g} sigma_*/D_c",
        source=f"{SEGALL_RICE}: [K + a(1+c) - b + E][K(1+c) - c(b-a)] = a c K",
        variable="critical_stiffness",
        where={"dilatancy": 0.004, "drainage": drainage},
        published=value,
        tolerance=5.1e-9,
        reason="evaluated to eight decimals",
    )


def drainage_limit_claim(
    drainage: float, value: float, which: str, tolerance: float, reason: str
) -> Claim:
    """Return a claim about the undrained or drained limit of k_cr (D2).

    Parameters
    ----------
    drainage : float
        Drainage rate c* D_c/V.
    value : float
        Critical stiffness in the limit.
    which : str
        Name of the limit.
    tolerance : float
        Tolerance of the claim.
    reason : str
        Reason for the tolerance.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    return Claim(
        id="D2",
        statement=f"E = 0.002, {which}: k_cr = {value:g} sigma_*/D_c",
        source=SEGALL_RICE,
        variable="critical_stiffness",
        where={"dilatancy": 0.004, "drainage": drainage},
        published=value,
        tolerance=tolerance,
        reason=reason,
    )


def growth_threshold_claim(dilatancy: float, drainage: float) -> Claim:
    """Return the claim that perturbations grow below k_cr (D3).

    The stiffness below which perturbations grow is computed from the eigenvalues of the linearised
    equations of motion.

    Parameters
    ----------
    dilatancy : float
        Value of the field ``dilatancy``.
    drainage : float
        Drainage rate c* D_c/V.

    Returns
    -------
    Claim
        Claim about the difference from the closed form.
    """
    return Claim(
        id="D3",
        statement=f"dilatancy {dilatancy:g}, drainage {drainage:g}: k_cr agrees with the growth "
        "rate",
        source="eigenvalues of the assembled equations",
        variable="critical_stiffness_error",
        where={"dilatancy": dilatancy, "drainage": drainage},
        published=0.0,
        tolerance=3e-11,
        reason="central differences of the assembled equations have a relative error of 1e-8",
    )


def drained_critical_stiffness(dataset: xr.Dataset) -> float:
    """Return the critical stiffness of a drained fault, (b - a) sigma_*/D_c.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.

    Returns
    -------
    float
        Critical stiffness in sigma_*/D_c.
    """
    return float(dataset["a"]) * (float(dataset["b_over_a"]) - 1.0)


def plot_limits(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw lines at the drained limit of k_cr and, for slow drainage, at the undrained limits.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    drained = drained_critical_stiffness(dataset)
    axes.axhline(drained, color="0.75", linewidth=2.2, zorder=1, label="drained, $b-a$")
    for number, dilatancy in enumerate(dataset["dilatancy"].values):
        undrained = drained - float(dataset["mu_star"]) * dilatancy
        if undrained > 0.0:
            look_of_it = {"color": cycle_style(number)["color"], "linewidth": 2.2, "alpha": 0.45}
            text = r"undrained, $b-a-\mu_*\epsilon/(\beta\sigma_*)$"
            axes.axhline(undrained, xmax=0.16, label=text, **look_of_it)


figure = Figure(
    [
        Panel(
            x="drainage",
            y=lambda row: row["critical_stiffness_from_growth"].where(
                np.arange(row["drainage"].size) % 4 == 0
            ),
            hue=["dilatancy"],
            fit_line=lambda row: (row["drainage"], row["critical_stiffness"]),
            overlays=[plot_limits],
            title="Stable above; lines: closed form, points: growth",
            y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
            log="x",
        )
    ],
    height=70.0,
)


study = Study(
    name="dilatancy",
    title="Critical stiffness of a dilatant fault against drainage",
    summary=Study.caption(__doc__),
    base=DILATANT_FAULT,
    axes=[
        Axis("dilatancy", [0.002, 0.004, 0.008, 0.012]),
        Axis("drainage", 10.0 ** np.linspace(-3.0, 3.0, 49)),
    ],
    measure=LinearStability(),
    claims=[
        closed_form_claim(0.1, 0.00306725),
        closed_form_claim(1.0, 0.00444076),
        closed_form_claim(10.0, 0.00499026),
        drainage_limit_claim(
            1e-3,
            0.003,
            "undrained",
            1e-8,
            "the difference increases as c^2, and is 6.7e-5 at c = 0.1 (D1)",
        ),
        drainage_limit_claim(
            1e3,
            0.005,
            "drained",
            2e-9,
            "the difference decreases as 1/c^2, and is 9.7e-6 at c = 10 (D1)",
        ),
        growth_threshold_claim(0.002, 1e-3),
        growth_threshold_claim(0.004, 1.0),
        growth_threshold_claim(0.012, 1e3),
        Claim.below(
            id="D4",
            statement="E = 0.006 > b - a: k_cr is almost zero if drainage is slow",
            source=SEGALL_RICE,
            variable="critical_stiffness",
            where={"dilatancy": 0.012, "drainage": 1e-3},
            published=1e-4,
            reason="an inequality; the bound is 2 % of b - a",
        ),
        Claim.above(
            id="D4",
            statement="E = 0.006 > b - a: k_cr exceeds 0.75 (b - a) sigma_*/D_c at c* D_c/V = 1",
            source=SEGALL_RICE,
            variable="critical_stiffness",
            where={"dilatancy": 0.012, "drainage": 1.0},
            published=0.00375,
        ),
    ],
    plot=figure,
    references=[REFERENCE],
)
