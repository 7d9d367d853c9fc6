"""Do the errors of fits with two states cover the truth, of one step and of two fitted as one?"""

from rsfstudy import Axis, Scene, Study
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Figure, Panel
from rsfstudy.measures.synthetic_fit import SyntheticFit
from rsfstudy.motion.accuracy import Accuracy

from .fit_coverage import CHANCE, INTERVALS, ShareInside, mark_shares

RECORDS = 6
PROCESSES = ("white", "ar1")
UP, BACK = "1:30, 10:300", "10:30, 1:300"
DESIGNS = {"one step up": UP, "a pair, up and back": f"{UP}; {BACK}"}

figure = Figure(
    [
        Panel(
            each=["design"],
            marks=[mark_shares],
            x_label="Parameter",
            y_label="Truth inside 68.3 % interval (%)",
            y_limits=(0.0, 100.0),
            alike="share",
        )
    ]
)


def covers(design: str) -> list[Claim]:
    """J1 and J2: intervals cover what they promise, within chance."""
    return [
        Claim(
            id=f"J{number}",
            statement=f"white noise, {design}: {100 * share:.1f} % intervals cover as much",
            source="this project's promise for the errors of fits",
            variable=f"share_{name.removeprefix('inside_')}_least",
            where={"process": "white", "design": design},
            relation="above",
            published=0.0,
            tolerance=CHANCE,
            reason="binomial standard deviations, of the parameter covered least",
        )
        for number, (name, share) in enumerate(INTERVALS.items(), start=1)
    ]


study = Study(
    name="fit_coverage_joint",
    title="Shares of synthetic records of two states whose truth lies within the errors of the fit",
    summary=(
        "Velocity steps of a slider with two states, with white noise and with noise of a "
        "correlation of 0.9, are fitted by the law that made them: a step up alone, and a step up "
        "and one back as one, each with its own friction before it and its own trend. Correlated "
        "noise leaves 26 independent rows to a step, for seven parameters: intervals then cover "
        "less than they promise, those of the trend and of what varies as slowly least. Markers "
        "are as in fit_coverage."
    ),
    base=Scene(
        law="two_slowness_states",
        normal_stress="constant",
        a=0.01,
        b1_over_a=1.2,
        b2_over_a=0.5,
        length_ratio=8.0,
        stiffness=0.03,
    ),
    axes=[
        Axis("process", list(PROCESSES)),
        Axis("design", {name: {"protocol": text} for name, text in DESIGNS.items()}),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=SyntheticFit(
        free=("a", "b1", "b2", "slip_distance", "slip_distance_2", "mu_star", "trend1")
    ),
    reductions=[
        ShareInside(f"{prefix}share_{name.removeprefix('inside_')}", f"{prefix}{name}", share)
        for prefix in ("", "naive_")
        for name, share in INTERVALS.items()
    ],
    claims=[claim for design in DESIGNS for claim in covers(design)],
    plot=figure,
    accuracy=Accuracy(budget=50_000_000, engine="compiled"),
)
