"""Critical velocity step of a dilatant fault as a function of drainage.

The spring is stiffer than critical at all drainage rates, so steady sliding is stable, and only a
step of load point velocity can trigger an instability. The critical step increases with dilatancy,
in particular at slow drainage. Before an instability, slip becomes much faster than drainage. The
critical step therefore reaches its drained limit only at very fast drainage. This drainage rate is
a hundred times higher than the rate at which the critical stiffness reaches its drained limit (see
the study dilatancy).
"""

from typing import Any

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import CriticalStep

from ._fluids import DILATANT_FAULT, REFERENCE, SEGALL_RICE

DRAINED = "drained"
FAULTS: dict[str, dict[str, str | float]] = {
    DRAINED: {"fluid": "drained"},
    **{
        f"dilatancy {number:g}": {"fluid": "dilatant", "dilatancy": number}
        for number in (0.001, 0.002, 0.004)
    },
}


def stabilisation_claim(fault: str, drainage: float, by: float) -> Claim:
    """Return the claim that dilatancy increases the critical velocity step (D5).

    Parameters
    ----------
    fault : str
        Name of the fault.
    drainage : float
        Drainage rate c* D_c/V_*.
    by : float
        Minimum increase of the critical step relative to the drained fault, in V_*.

    Returns
    -------
    Claim
        Claim about the difference of the critical steps.
    """
    return Claim.above(
        id="D5",
        statement=(
            f"{fault}, drainage {drainage:.3g}: the critical step is larger by {by:g} V_* than "
            "drained"
        ),
        source=f"{SEGALL_RICE}: dilatancy opposes nucleation",
        variable="critical_velocity_ratio",
        where={"fault": fault, "drainage": drainage},
        baseline={"fault": DRAINED, "drainage": drainage},
        published=by,
    )


def fault_style(row: xr.Dataset) -> dict[str, Any]:
    """Return the line style of a fault.

    The curve of the drained fault is independent of the drainage rate and is drawn in grey behind
    the other curves.

    Parameters
    ----------
    row : xarray.Dataset
        Results of one fault.

    Returns
    -------
    dict
        Keyword arguments for ``matplotlib.axes.Axes.plot``.
    """
    grey = {"color": "0.75", "linestyle": "-", "linewidth": 2.2, "marker": "", "zorder": 1}
    return grey if row["fluid"] == "drained" else {}


figure = Figure(
    [
        Panel(
            x="drainage",
            y="critical_velocity_ratio",
            hue=["fault"],
            style=fault_style,
            title="Stable below, unstable above",
            log="xy",
        )
    ]
)


study = Study(
    name="dilatant_steps",
    title="Critical load point velocity step of a dilatant fault, k = 1.2 (b-a) sigma_*/D_c",
    summary=Study.caption(__doc__),
    base=DILATANT_FAULT.with_(stiffness=0.006, fluid="drained"),
    axes=[
        Axis("fault", FAULTS),
        Axis("drainage", 10.0 ** np.linspace(-1.0, 1.5, 6)),
    ],
    measure=CriticalStep(),
    accuracy=Accuracy(rtol=1e-4),
    claims=[
        stabilisation_claim("dilatancy 0.002", 0.1, 1.0),
        stabilisation_claim("dilatancy 0.004", 1.0, 5.0),
        Claim.below(
            id="D6",
            statement="dilatancy 0.004: ten times faster drainage reduces the critical step",
            source=SEGALL_RICE,
            variable="critical_velocity_ratio",
            where={"fault": "dilatancy 0.004", "drainage": 10.0},
            baseline={"fault": "dilatancy 0.004", "drainage": 1.0},
            published=-1.0,
        ),
        Claim.above(
            id="D6",
            statement=(
                "dilatancy 0.004, drainage 1: the stability of steady sliding is within 12 % of "
                "the drained limit, but the critical step is within 5 % of the undrained limit"
            ),
            source=SEGALL_RICE,
            variable="critical_velocity_ratio",
            where={"fault": "dilatancy 0.004", "drainage": 1.0},
            baseline={"fault": "dilatancy 0.004", "drainage": 0.1},
            published=-0.5,
            reason="an inequality; the bound is 5 % of the critical step",
        ),
    ],
    plot=figure,
    references=[REFERENCE],
)
