"""Which experiment tells the parameters? Designs of steps and machines, before any is run.

Fisher's information tells the errors of an experiment before it is made: steps up, back, holds and
pairs of them, on a stiff and on a compliant machine. A step up and one back tell the exponent of
the law seven times better than two steps up; a compliant machine tells it better by one step, five
times; four times as many rows tell as much as half the noise, twice as well. Fits of synthetic
records keep what is promised.
"""

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.analysis.fitting.model import LOGARITHMIC
from rsfstudy.analysis.fitting.model import PARAMETERS as MODEL

from ._synthetic_fit import ACCURACY, BACK, UP
from .law_identification import CHANCE, EXPONENT_FREE, FAMILY, ScatterOverPromise

RECORDS, DISTANCE = 4, 10.0
HOLD = "1:30, 0:1000 s, 1:270"
#: Rows of a step, and white noise.
ROWS, NOISE = 500, 5e-4
DESIGNS: dict[str, dict[str, str | float]] = {
    "step up": {"protocol": UP},
    "4 times the rows": {"protocol": UP, "rows": 4 * ROWS},
    "half the noise": {"protocol": UP, "noise_size": 0.5 * NOISE},
    "step back": {"protocol": BACK},
    "hold": {"protocol": HOLD},
    "two steps up": {"protocol": f"{UP}; {UP}"},
    "up and back": {"protocol": f"{UP}; {BACK}"},
    "up and hold": {"protocol": f"{UP}; {HOLD}"},
}
SHOWN = ("a", "b", "slip_distance", "law_exponent")
#: Stiffness over normal stress in 1/um.
MACHINES = (1e-3, 3e-3)


def symbol(row: xr.Dataset) -> str:
    """That of a parameter, or of its logarithm where that is fitted."""
    name = str(row["parameter"].item())
    return rf"$\ln$ {MODEL[name].symbol}" if name in LOGARITHMIC else MODEL[name].symbol


def machine(dataset: xr.Dataset) -> str:
    """The machine of a panel."""
    return rf"$k$ = {float(dataset['stiffness']) / DISTANCE:g} per $\mu$m"


figure = Figure(
    [
        Panel(
            x="promised_spread",
            y="design",
            by=["parameter"],
            each=["stiffness"],
            at={"seed": 0, "parameter": lambda _names: list(SHOWN)},
            name=symbol,
            title=machine,
            log="x",
            x_label="Standard error promised",
            y_label="Experiment",
            x_limits=(1e-5, 0.3),
        )
    ]
)


def promise(design: str, k: float, published: float) -> Claim:
    """D1: what a design promises for the exponent of the law."""
    return Claim(
        id="D1",
        statement=f"{design}, k = {k:g} per um: standard error of the exponent",
        source="Fisher's information; of 500 rows a step and white noise of 5e-4, if not said",
        variable="promised_spread",
        where={"design": design, "stiffness": k * DISTANCE, "parameter": "law_exponent", "seed": 0},
        published=published,
        tolerance=0.1 * published,
        reason="rows before the step are not told; 10 to 100 um of them move it by as much",
    )


def kept(k: float, parameter: str) -> Claim:
    """D2: fits keep the promise."""
    return Claim(
        id="D2",
        statement=f"k = {k:g} per um: estimates of {parameter} scatter as promised",
        source="Fisher's information",
        variable="kept_off",
        where={"stiffness": k * DISTANCE, "parameter": parameter},
        published=0.0,
        tolerance=CHANCE,
        reason="standard deviations of a standard deviation",
    )


study = Study(
    name="design_of_steps",
    title="Standard errors that steps, holds and machines promise",
    summary=Study.caption(__doc__),
    base=FAMILY,
    axes=[
        Axis("design", {n: {"rows": ROWS, "noise_size": NOISE, **d} for n, d in DESIGNS.items()}),
        Axis("stiffness", [k * DISTANCE for k in MACHINES]),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=EXPONENT_FREE,
    reductions=[ScatterOverPromise("kept", "deviation", ("seed", "design"))],
    claims=[
        promise("step up", 3e-3, 0.087),
        promise("step up", 1e-3, 0.018),
        promise("4 times the rows", 3e-3, 0.087 / 2.0),
        promise("half the noise", 3e-3, 0.087 / 2.0),
        promise("up and back", 3e-3, 0.009),
        promise("two steps up", 3e-3, 0.062),
        *(kept(k, name) for k in MACHINES for name in SHOWN),
    ],
    plot=figure,
    accuracy=ACCURACY,
)
