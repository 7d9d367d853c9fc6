"""Which experiment tells the parameters? Designs of steps and machines, before any is run."""

import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.analysis.fitting.model import LOGARITHMIC
from rsfstudy.analysis.fitting.model import PARAMETERS as MODEL
from rsfstudy.declare.figure import Axes

from ._synthetic_fit import SyntheticFit
from .law_identification import CHANCE, ScatterOverPromise

RECORDS, DISTANCE = 4, 10.0
UP, DOWN, HOLD = "1:30, 10:270", "10:30, 1:270", "1:30, 0:1000 s, 1:270"
#: Rows of a step, and white noise.
ROWS, NOISE = 500, 5e-4
DESIGNS: dict[str, dict[str, str | float]] = {
    "step up": {"protocol": UP},
    "4 times the rows": {"protocol": UP, "rows": 4 * ROWS},
    "half the noise": {"protocol": UP, "noise_size": 0.5 * NOISE},
    "step back": {"protocol": DOWN},
    "hold": {"protocol": HOLD},
    "two steps up": {"protocol": f"{UP}; {UP}"},
    "up and back": {"protocol": f"{UP}; {DOWN}"},
    "up and hold": {"protocol": f"{UP}; {HOLD}"},
}
#: Stiffness over normal stress in 1/um.
MACHINES = (1e-3, 3e-3)


def mark_promises(dataset: xr.Dataset, axes: Axes) -> None:
    """Standard errors promised for each design, by parameter."""
    from rsfstudy.plots import look, marker, name_rows

    promised = dataset["promised_spread"].isel(seed=0)
    for number, name in enumerate(("a", "b", "slip_distance", "law_exponent")):
        one = promised.sel(parameter=name)
        label = MODEL[name].symbol
        label = rf"$\ln$ {label}" if name in LOGARITHMIC else label
        style = {"color": look(number)["color"], "marker": marker(number), "linestyle": "none"}
        axes.plot(one, range(one.size), label=label, **style)
    axes.set_xscale("log")
    name_rows(axes, [str(name) for name in promised["design"].values])


def machine(dataset: xr.Dataset) -> str:
    """The machine of a panel."""
    return rf"$k$ = {float(dataset['stiffness']) / DISTANCE:g} per $\mu$m"


figure = Figure(
    [
        Panel(
            each=["stiffness"],
            marks=[mark_promises],
            title=machine,
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
        where={
            "design": design,
            "stiffness": k * DISTANCE,
            "parameter": "law_exponent",
            "seed": 0,
        },
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
    summary=(
        "Fisher's information tells the errors of an experiment before it is made: steps up, back, "
        "holds and pairs of them, on a stiff and on a compliant machine. A step up and one back "
        "tell the exponent of the law seven times better than two steps up; a compliant machine "
        "tells it better by one step, five times; four times as many rows tell as much as half "
        "the noise, twice as well. Fits of synthetic records keep what is promised."
    ),
    base=Scene(
        law="family",
        law_exponent=0.5,
        normal_stress="constant",
        a=0.01,
        b_over_a=1.3,
        stiffness=0.03,
    ),
    axes=[
        Axis("design", {n: {"rows": ROWS, "noise_size": NOISE, **d} for n, d in DESIGNS.items()}),
        Axis("stiffness", [k * DISTANCE for k in MACHINES]),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=SyntheticFit(
        free=("a", "b", "slip_distance", "law_exponent", "mu_star", "trend1"), noise="white"
    ),
    reductions=[ScatterOverPromise("kept", "deviation", ("seed", "design"))],
    claims=[
        promise("step up", 3e-3, 0.087),
        promise("step up", 1e-3, 0.018),
        promise("4 times the rows", 3e-3, 0.087 / 2.0),
        promise("half the noise", 3e-3, 0.087 / 2.0),
        promise("up and back", 3e-3, 0.009),
        promise("two steps up", 3e-3, 0.062),
        *(kept(k, name) for k in MACHINES for name in ("a", "b", "slip_distance", "law_exponent")),
    ],
    plot=figure,
    accuracy=Accuracy(budget=50_000_000, engine="compiled"),
)
