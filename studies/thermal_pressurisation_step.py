"""Pore pressure during rapid slip, compared with the closed form for an undrained fault.

A slider with an almost constant friction coefficient F is accelerated from V_* to 10^4 V_*. Without
drainage, the pore pressure is P = 1 - exp(-F E delta). Here delta is the slip in D_c, and E is the
heating parameter. The pressure approaches the normal stress, but cannot exceed it, because the
heating decreases with the effective normal stress. With drainage, the pressure is lower than
without drainage.
"""

import math

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import RigidResponse
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._heat import PRESSURE_REFERENCES, PRESSURISED_FAULT, RICE

_MU_STAR = 0.6


def plot_closed_forms(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the undrained pore pressure in closed form.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    slip = np.linspace(0.0, float(dataset["slip"].max()), 21)
    for number, heating in enumerate(dataset["heating"].values.tolist()):
        label = r"$1 - \exp(-F E \delta)$" if number == 0 else None
        pressure = -np.expm1(-_MU_STAR * heating * slip)
        axes.plot(slip, pressure, "o", color="0.4", fillstyle="none", markersize=4, label=label)


def pressure_claim(heating: float, slip: float) -> Claim:
    """Return the claim that the effective normal stress is exp(-F E delta) (H15).

    Parameters
    ----------
    heating : float
        Heating E.
    slip : float
        Slip in D_c.

    Returns
    -------
    Claim
        Claim about the effective normal stress.
    """
    return Claim(
        id="H15",
        statement=f"undrained, E = {heating:g}, slip {slip:g} D_c: P = 1 - exp(-F E delta)",
        source=RICE,
        variable="normal_stress_ratio",
        where={"heating": heating, "drainage": UNDRAINED, "slip": slip},
        published=math.exp(-_MU_STAR * heating * slip),
        tolerance=3e-4,
        reason="friction is constant to 1.5e-4, and V_*/V = 1e-4",
    )


#: Drainage rate of a fault that does not drain during the slip.
UNDRAINED = 1e-6
figure = Figure(
    [
        Panel(
            x="slip",
            y=lambda row: 1.0 - row["normal_stress_ratio"],
            hue=["heating", "drainage"],
            overlays=[plot_closed_forms],
            x_label=r"Slip, $\delta/D_c$",
            y_label=r"Pore pressure, $P = (p-p_\infty)/\sigma_*$",
            title="Points: undrained closed form",
        )
    ],
    height=80.0,
)


study = Study(
    name="thermal_pressurisation_step",
    title="Pore pressure during slip at 10^4 V_*, and its undrained closed form",
    summary=Study.caption(__doc__),
    base=PRESSURISED_FAULT.with_(a=1e-5, b_over_a=1.0, cooling=1e-6, load_velocity_ratio=1e4),
    axes=[Axis("heating", [0.01, 0.03]), Axis("drainage", [UNDRAINED, 30.0, 300.0])],
    measure=RigidResponse(slip=200.0, points=201),
    claims=[
        pressure_claim(0.01, 20.0),
        pressure_claim(0.01, 100.0),
        pressure_claim(0.03, 100.0),
        Claim.above(
            id="H16",
            statement="drainage keeps the pressure below the undrained pressure",
            source="dP/dt = E F s V - C_h P",
            variable="normal_stress_ratio",
            where={"heating": 0.01, "drainage": 300.0, "slip": 100.0},
            baseline={"heating": 0.01, "drainage": UNDRAINED, "slip": 100.0},
            published=0.2,
        ),
    ],
    plot=figure,
    references=PRESSURE_REFERENCES,
)
