"""Expected standard errors of parameters for several designs of experiments.

The Fisher information predicts the standard errors of an experiment before it is performed. The
study compares designs with steps up, steps back, holds and pairs of steps, on a stiff and on a
compliant machine. A step up followed by a step back determines the exponent of the law seven times
more accurately than two steps up. With a single step, a compliant machine determines the exponent
five times more accurately than a stiff machine. Halving the noise halves the standard errors, and
so does recording four times as many rows. Fits of synthetic records agree with the predicted
standard errors.
"""

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.fitting import LOGARITHMIC_PARAMETERS
from rsfstudy.fitting import PARAMETERS as MODEL

from ._synthetic_fit import FIT_ACCURACY, STEP_BACK_PROTOCOL, STEP_UP_PROTOCOL
from .law_identification import EXPONENT_FIT, FAMILY_SCENE, MAX_CHANCE_DEVIATION, ScatterRatio

RECORDS, SLIP_DISTANCE = 4, 10.0
HOLD_PROTOCOL = "1:30, 0:1000 s, 1:270"
#: Number of rows per step, and standard deviation of the white noise.
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
#: Ratios of stiffness to normal stress in 1/um.
MACHINE_STIFFNESSES = (1e-3, 3e-3)


def parameter_symbol(row: xr.Dataset) -> str:
    """Return the symbol of a parameter, or of its logarithm.

    Parameters
    ----------
    row : xarray.Dataset
        Results of one parameter.

    Returns
    -------
    str
        Symbol in LaTeX. Parameters that are fitted as logarithms have the symbol of the logarithm.
    """
    name = str(row["parameter"].item())
    return rf"$\ln$ {MODEL[name].symbol}" if name in LOGARITHMIC_PARAMETERS else MODEL[name].symbol


def machine_title(dataset: xr.Dataset) -> str:
    """Return a panel title that contains the stiffness of the machine.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of one machine.

    Returns
    -------
    str
        Title in LaTeX.
    """
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
            x_label="Predicted standard error",
            y_label="Experiment",
            x_limits=(1e-5, 0.3),
        )
    ]
)


def expected_error_claim(design: str, k: float, published: float) -> Claim:
    """Return a claim about the standard error that is expected for the exponent (D1).

    Parameters
    ----------
    design : str
        Name of the design.
    k : float
        Ratio of stiffness to normal stress in 1/um.
    published : float
        Expected standard error.

    Returns
    -------
    Claim
        Claim about the expected standard error.
    """
    return Claim(
        id="D1",
        statement=f"{design}, k = {k:g} per um: standard error of the exponent",
        source=(
            "Fisher information for 500 rows per step and white noise of 5e-4, unless specified"
        ),
        variable="promised_spread",
        where={
            "design": design,
            "stiffness": k * SLIP_DISTANCE,
            "parameter": "law_exponent",
            "seed": 0,
        },
        published=published,
        tolerance=0.1 * published,
        reason="the length of the record before the step is not specified; lengths from 10 to 100 "
        "um change the standard error by this amount",
    )


def fit_error_claim(k: float, parameter: str) -> Claim:
    """Return the claim that estimates scatter by the expected standard error (D2).

    Parameters
    ----------
    k : float
        Ratio of stiffness to normal stress in 1/um.
    parameter : str
        Name of the parameter.

    Returns
    -------
    Claim
        Claim about the scatter of the estimates.
    """
    return Claim(
        id="D2",
        statement=f"k = {k:g} per um: the scatter of {parameter} agrees with the prediction",
        source="Fisher's information",
        variable="kept_off",
        where={"stiffness": k * SLIP_DISTANCE, "parameter": parameter},
        published=0.0,
        tolerance=MAX_CHANCE_DEVIATION,
        reason="in standard deviations of the estimated standard deviation",
    )


study = Study(
    name="design_of_steps",
    title="Predicted standard errors for steps, holds and machines",
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
