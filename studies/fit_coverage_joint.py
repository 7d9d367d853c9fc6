"""Coverage of the confidence intervals of fits with two states.

Synthetic records of a slider with two states are fitted with the law that was used to compute them.
The records contain a single velocity step up, or a step up and a step back that are fitted jointly
with separate values of initial friction and trend. The noise is white or has a correlation of 0.9.
Correlated noise reduces the effective sample size of a step to 26. In this case, a fit of a single
step determines the longer slip distance with a relative standard error of about one third. The
errors of some other parameters are correlated with the error of this slip distance. As a function
of these parameters, the log-likelihood is not parabolic. The confidence intervals are therefore
computed from the profile likelihood. Full and open markers have the same meaning as in the study
fit_coverage.
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
    title="Coverage of confidence intervals for synthetic records of two states",
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
