"""Stick-slip cycles with thermal pressurisation.

The heating parameter E is the undrained increase of pore pressure due to a slip of D_c at a
friction coefficient of 1. The static stress drop increases with E. For small E, the stress drop is
the same as for a drained fault. For E = 0.01, the pore pressure in a rupture removes most of the
effective normal stress. With the slip law, the stress drop is then almost seven times as large as
for a drained fault. After such a rupture, the fluid drains and the strength recovers. The lowest
slip rate of the cycle is therefore several orders of magnitude lower than for a drained fault. The
test for a repeating cycle ignores the temperature. Otherwise, the extremely large steady
temperature at the slip rate of a rupture would dominate the distance from steady sliding.
"""

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LimitCycle

from ._heat import INDEPENDENT, PRESSURE_REFERENCES, PRESSURISED_FAULT, RICE, known_value_claim


def cycle_claim(variable: str, law: str, heating: float, value: float) -> Claim:
    """Return the claim that a limit cycle agrees with its known value (H13).

    Parameters
    ----------
    variable : str
        Name of the variable.
    law : str
        State evolution law.
    heating : float
        Heating E.
    value : float
        Expected value.

    Returns
    -------
    Claim
        Claim about the variable.
    """
    statement = f"{law} law, E = {heating:g}: {variable.replace('_', ' ')}"
    where = {"law": law, "heating": heating}
    return known_value_claim("H13", statement, variable, where, value, 1e-6)


figure = Figure(
    [
        Panel(
            x="heating",
            y=variable,
            hue=["law"],
            x_label="Undrained pressure due to slip of $D_c$, $E$",
            y_label=label,
            log="x",
        )
        for variable, label in (
            ("static_stress_drop", r"Static stress drop, $\Delta\tau_s/\sigma_*$"),
            ("min_log10_slip_rate", r"Minimum slip rate, $\log_{10}(V/V_*)$"),
        )
    ]
)


study = Study(
    name="thermal_pressurisation_cycles",
    title="Limit cycles with thermal pressurisation, k = 0.5 (b - a) sigma_*/D_c",
    summary=Study.caption(__doc__),
    base=PRESSURISED_FAULT.with_(load_velocity_ratio=2.0, radiation_damping=1e-6),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("heating", [1e-4, 3e-4, 1e-3, 2e-3, 3e-3, 5e-3, 7e-3, 1e-2, 1.5e-2]),
    ],
    measure=LimitCycle(phases=2),
    accuracy=Accuracy(rtol=1e-6),
    claims=[
        cycle_claim("recurrence_interval", "slip", 0.01, 90.10695629030),
        cycle_claim("static_stress_drop", "slip", 0.01, 0.441482691904),
        cycle_claim("recurrence_interval", "slowness", 0.01, 106.427752333),
        cycle_claim("static_stress_drop", "slowness", 0.01, 0.527348780351),
        cycle_claim("recurrence_interval", "slip", 0.001, 16.760990726143),
        cycle_claim("static_stress_drop", "slip", 0.001, 0.072637758467),
        Claim.above(
            id="H14",
            statement=(
                "slip law: the stress drop is larger by 0.37 sigma_* at E = 0.01 than at E = 1e-4"
            ),
            source=f"{RICE}, and {INDEPENDENT}",
            variable="static_stress_drop",
            where={"law": "slip", "heating": 0.01},
            baseline={"law": "slip", "heating": 1e-4},
            published=0.37,
        ),
    ],
    plot=figure,
    references=PRESSURE_REFERENCES,
)
