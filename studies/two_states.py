"""A law of two states: cycles whose period doubles, chaos, and Floquet multipliers (Gu et al. 1984;
Becker 2000).
"""

import numpy as np

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.study import Study
from rsfstudy.measures.bifurcation import Bifurcation
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.reduce import Boundary, Inverse
from rsfstudy.slider.scene import Scene

GU = "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196"
BECKER = "Becker (2000), in AGU Geophys. Monogr. 120, 5-26"
SLIP = {"law": "two_slip_states"}


def at(ratio: float) -> dict[str, str | float]:
    """Place of one spring."""
    return {**SLIP, "stiffness_ratio": ratio}


#: Springs too soft for slip to stay bounded without mass; where periods double; and the others.
SPRINGS = np.round(
    np.concatenate(
        [
            [0.84, 0.845, 0.849],
            np.linspace(0.8515, 0.8575, 16),
            np.linspace(0.8583, 0.8647, 9),
            np.linspace(0.8651, 0.8691, 11),
            np.linspace(0.87, 0.895, 6),
            np.linspace(0.9, 0.99, 10),
            [0.995, 1.02],
        ]
    ),
    4,
)

study = Study(
    name="two_states",
    title="Two states: slow oscillations double their period, b_1 = a, b_2 = 0.84 a, L_2 = 21 D_c",
    summary=(
        "A spring a little softer than critical oscillates with a limited slip rate, without mass "
        "and with the slip law, because a second state evolves over a longer slip. Softened, its "
        "period doubles, and doubles again, until the motion never repeats itself; softer than "
        "that slip rate is unbounded. The first doubling is where a Floquet multiplier of the "
        "cycle of one event passes -1; repelling, that cycle goes on through all that follows."
    ),
    base=Scene(
        law="two_slip_states",
        normal_stress="constant",
        a=0.01,
        b1_over_a=1.0,
        b2_over_a=0.84,
        length_ratio=1.0 / 0.048,
        load_velocity_ratio=1.0,
        displacement_step=2.0,
    ),
    axes=[
        Axis("law", ["two_slip_states"]),
        Axis("stiffness_ratio", SPRINGS),
    ],
    measure=Bifurcation(transient=48, events=32),
    accuracy=Accuracy(rtol=1e-6),
    reductions=[
        Inverse(name="doubling_by_multiplier", of="floquet_multiplier_size", on="stiffness_ratio"),
        Boundary(name="doubling_by_motion", of="period_events", on="stiffness_ratio", level=1.5),
    ],
    claims=[
        Claim(
            id="S1",
            statement="critical stiffness k_cr L_1/(a sigma) is 0.0802755656",
            source=f"{GU}, closed form from the cubic of small perturbations",
            variable="critical_stiffness",
            where=at(0.95),
            published=8.02755656e-4,
            tolerance=5e-13,
            reason="the digits given, times a = 0.01",
        ),
        Claim(
            id="S2",
            statement="the period doubles where a Floquet multiplier passes -1",
            source="Floquet theory",
            variable="doubling_by_multiplier",
            where=SLIP,
            minus=SLIP,
            minus_variable="doubling_by_motion",
            published=0.0,
            tolerance=2e-4,
            reason="half the distance of two springs, between which the motions say",
        ),
        Claim(
            id="S3",
            statement="that is at 0.86626 k_cr",
            source="not known to be published; both ways agree",
            variable="doubling_by_multiplier",
            where=SLIP,
            published=0.86626,
            tolerance=1e-5,
            reason="digits given; differences of the return map and interpolation leave 1e-6",
        ),
        Claim(
            id="S4",
            statement="k = 0.8663 k_cr, next to it: the multiplier is real, and negative",
            source="Floquet theory",
            variable="floquet_multiplier",
            where=at(0.8663),
            published=-1.0,
            tolerance=4e-3,
            reason="within 1e-4 k_cr of the doubling: a change of the multiplier by 4e-3",
        ),
        Claim(
            id="S5",
            statement="k = 0.8531 k_cr: small departures grow, in the mean: chaos",
            source=f"{BECKER}, finds chaos; for this spring not known to be published",
            variable="lyapunov_exponent",
            where=at(0.8531),
            relation="above",
            published=0.1,
            tolerance=0.0,
            reason="an inequality, well above what 32 events leave uncertain",
        ),
        Claim(
            id="S6",
            statement="k = 0.8567 k_cr: motions repeat themselves after four events",
            source="not known to be published",
            variable="period_events",
            where=at(0.8567),
            published=4.0,
            tolerance=0.0,
            reason="a whole number",
        ),
    ],
    plot="two_states",
    references=[
        GU,
        BECKER,
        "Ruina (1983), J. Geophys. Res. 88, 10359-10370",
    ],
)
