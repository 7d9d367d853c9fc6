"""Dilatancy: the critical step of load point velocity against drainage.

The spring is stiffer than critical however fast pores drain, and steady sliding stable: it takes a
step of load point velocity to trigger instability. The step grows with dilatancy, and the more the
less there is time to drain. Slip accelerates far beyond drainage on the way to instability, so that
drainage has to be a hundred times faster than for steady sliding (study dilatancy) to bring the
drained boundary back.
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
    """D5: dilatancy stabilises."""
    return Claim.above(
        id="D5",
        statement=f"{fault}, drainage {drainage:.3g}: {by:g} V_* more than drained",
        source=f"{SEGALL_RICE}: dilatancy opposes nucleation",
        variable="critical_velocity_ratio",
        where={"fault": fault, "drainage": drainage},
        minus={"fault": DRAINED, "drainage": drainage},
        published=by,
    )


def fault_style(row: xr.Dataset) -> dict[str, Any]:
    """Style of what no drainage changes, behind the others."""
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
            statement="dilatancy 0.004: ten times faster drainage lowers the boundary",
            source=SEGALL_RICE,
            variable="critical_velocity_ratio",
            where={"fault": "dilatancy 0.004", "drainage": 10.0},
            minus={"fault": "dilatancy 0.004", "drainage": 1.0},
            published=-1.0,
        ),
        Claim.above(
            id="D6",
            statement="dilatancy 0.004, drainage 1: steady sliding is as if drained, to 12 %; the "
            "boundary is as if undrained, to 5 %",
            source=SEGALL_RICE,
            variable="critical_velocity_ratio",
            where={"fault": "dilatancy 0.004", "drainage": 1.0},
            minus={"fault": "dilatancy 0.004", "drainage": 0.1},
            published=-0.5,
            reason="an inequality, 5 % of the boundary",
        ),
    ],
    plot=figure,
    references=[REFERENCE],
)
