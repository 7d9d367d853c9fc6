"""Which experiment tells the parameters? Designs of steps and machines, before any is run.

Fisher's information tells the errors of an experiment before it is made: steps up, back, holds and
pairs of them, on a stiff and on a compliant machine. A step up and one back tell the exponent of
the law seven times better than two steps up; a compliant machine tells it better by one step, five
times; four times as many rows tell as much as half the noise, twice as well. Fits of synthetic
records keep what is promised.
"""

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.fitting import LOGARITHMIC_PARAMETERS
from rsfstudy.fitting import PARAMETERS as MODEL

from ._synthetic_fit import FIT_ACCURACY, STEP_BACK_PROTOCOL, STEP_UP_PROTOCOL
from .law_identification import EXPONENT_FIT, FAMILY_SCENE, MAX_CHANCE_DEVIATION, ScatterRatio

RECORDS, SLIP_DISTANCE = 4, 10.0
HOLD_PROTOCOL = "1:30, 0:1000 s, 1:270"
#: Rows of a step, and white noise.
ROWS, NOISE_SIZE = 500, 5e-4
DESIGNS: dict[str, dict[str, str | float]] = {
    "step up": {"protocol": STEP_UP_PROTOCOL},
    "4 times the rows": {"protocol": STEP_UP_PROTOCOL, "rows": 4 * ROWS},
    "half the noise": {"protocol": STEP_UP_PROTOCOL, "noise_size": 0.5 * NOISE_SIZE},
    "step back": {"protocol": STEP_BACK_PROTOCOL},
    "hold": {"protocol": HOLD_PROTOCOL},
    "two steps up": {"protocol": f"{STEP_UP_PROTOCOL}; {STEP_UP_PROTOCOL}"},
    "up and back": {"protocol": f"{STEP_UP_PROTOCOL}; {STEP_BACK_PROTOCOL}"},
    "up and hold": {"protocol": f"{STEP_UP_PROTOCOL}; {HOLD_PROTOCOL}"},
}
PLOTTED_PARAMETERS = ("a", "b", "slip_distance", "law_exponent")
#: Stiffness over normal stress in 1/um.
MACHINE_STIFFNESSES = (1e-3, 3e-3)


def parameter_symbol(row: xr.Dataset) -> str:
    """That of a parameter, or of its logarithm where that is fitted."""
    name = str(row["parameter"].item())
    return rf"$\ln$ {MODEL[name].symbol}" if name in LOGARITHMIC_PARAMETERS else MODEL[name].symbol


def machine_title(dataset: xr.Dataset) -> str:
    """The machine of a panel."""
    return rf"$k$ = {float(dataset['stiffness']) / SLIP_DISTANCE:g} per $\mu$m"


figure = Figure(
    [
        Panel(
            x="promised_spread",
            y="design",
            hue=["parameter"],
            facet=["stiffness"],
            isel={"seed": 0, "parameter": lambda _names: list(PLOTTED_PARAMETERS)},
            curve_label=parameter_symbol,
            title=machine_title,
            log="x",
            x_label="Standard error promised",
            y_label="Experiment",
            x_limits=(1e-5, 0.3),
        )
    ]
)


def expected_error_claim(design: str, k: float, published: float) -> Claim:
    """D1: what a design promises for the exponent of the law."""
    return Claim(
        id="D1",
        statement=f"{design}, k = {k:g} per um: standard error of the exponent",
        source="Fisher's information; of 500 rows a step and white noise of 5e-4, if not said",
        variable="promised_spread",
        where={
            "design": design,
            "stiffness": k * SLIP_DISTANCE,
            "parameter": "law_exponent",
            "seed": 0,
        },
        published=published,
        tolerance=0.1 * published,
        reason="rows before the step are not told; 10 to 100 um of them move it by as much",
    )


def fit_error_claim(k: float, parameter: str) -> Claim:
    """D2: fits keep the promise."""
    return Claim(
        id="D2",
        statement=f"k = {k:g} per um: estimates of {parameter} scatter as promised",
        source="Fisher's information",
        variable="kept_off",
        where={"stiffness": k * SLIP_DISTANCE, "parameter": parameter},
        published=0.0,
        tolerance=MAX_CHANCE_DEVIATION,
        reason="standard deviations of a standard deviation",
    )


study = Study(
    name="design_of_steps",
    title="Standard errors that steps, holds and machines promise",
    summary=Study.caption(__doc__),
    base=FAMILY_SCENE,
    axes=[
        Axis(
            "design", {n: {"rows": ROWS, "noise_size": NOISE_SIZE, **d} for n, d in DESIGNS.items()}
        ),
        Axis("stiffness", [k * SLIP_DISTANCE for k in MACHINE_STIFFNESSES]),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=EXPONENT_FIT,
    reductions=[ScatterRatio("kept", "deviation", ("seed", "design"))],
    claims=[
        expected_error_claim("step up", 3e-3, 0.087),
        expected_error_claim("step up", 1e-3, 0.018),
        expected_error_claim("4 times the rows", 3e-3, 0.087 / 2.0),
        expected_error_claim("half the noise", 3e-3, 0.087 / 2.0),
        expected_error_claim("up and back", 3e-3, 0.009),
        expected_error_claim("two steps up", 3e-3, 0.062),
        *(fit_error_claim(k, name) for k in MACHINE_STIFFNESSES for name in PLOTTED_PARAMETERS),
    ],
    plot=figure,
    accuracy=FIT_ACCURACY,
)
