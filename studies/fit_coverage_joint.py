"""Do the errors of fits with two states cover the truth, of one step and of two fitted as one?

Velocity steps of a slider with two states, with white noise and with noise of a correlation of 0.9,
are fitted by the law that made them: a step up alone, and a step up and one back as one, each with
its own friction before it and its own trend. Correlated noise leaves 26 independent rows to a step:
one step tells the longer slip distance to a third then, and intervals of what goes with it are
those of the likelihood, which is no parabola. Markers are as in fit_coverage.
"""

from dataclasses import replace

from rsfstudy import Axis, Figure, Scene, Study

from ._synthetic_fit import FIT_ACCURACY, SyntheticFit, protocol_axis
from .fit_coverage import REDUCTIONS, coverage_claims, figure_height, shares_panel

RECORDS = 6
PROCESSES = ("white", "ar1")
STEP_UP_PROTOCOL, STEP_BACK_PROTOCOL = "1:30, 10:300", "10:30, 1:300"
DESIGNS = {
    "one step up": STEP_UP_PROTOCOL,
    "a pair, up and back": f"{STEP_UP_PROTOCOL}; {STEP_BACK_PROTOCOL}",
}

study = Study(
    name="fit_coverage_joint",
    title="Shares of synthetic records of two states whose truth lies within the errors of the fit",
    summary=Study.caption(__doc__),
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
        protocol_axis(DESIGNS),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=SyntheticFit(
        free=("a", "b1", "b2", "slip_distance", "slip_distance_2", "mu_star", "trend1")
    ),
    reductions=REDUCTIONS,
    claims=[
        claim
        for design in DESIGNS
        for claim in coverage_claims("J", f"white noise, {design}", process="white", design=design)
    ],
    plot=Figure([replace(shares_panel, facet=["design"])], height=figure_height),
    accuracy=FIT_ACCURACY,
)
