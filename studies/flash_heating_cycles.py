"""Stick-slip cycles with flash heating and radiation damping.

With flash heating, the friction coefficient in a rupture decreases almost to the friction of
weakened contacts, f_w. Without flash heating, the static stress drop is 0.07 sigma_*. With flash
heating at V_w = 10^5 V_*, the static stress drop is 0.87 (mu_* - f_w) sigma_*, and the recurrence
interval increases in proportion to the stress drop. If the weakening velocity is ten times lower,
the static stress drop is almost equal to (mu_* - f_w) sigma_*. When the slip rate reaches its peak,
only a twentieth of the static stress drop has been released. For comparison, the lattice also
contains V_w = 10^9 V_*. This weakening velocity is so high that flash heating has no effect.
"""

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._heat import FLASH_FAULT, FLASH_REFERENCES, INDEPENDENT, RICE, known_value_claim


def cycle_claim(variable: str, velocity: float, friction: float, value: float) -> Claim:
    """Return the claim that a limit cycle agrees with its known value (H5).

    Parameters
    ----------
    variable : str
        Name of the variable.
    velocity : float
        Weakening velocity V_w/V_*.
    friction : float
        Friction coefficient f_w.
    value : float
        Expected value.

    Returns
    -------
    Claim
        Claim about the variable.
    """
    where = {"weakening_velocity_ratio": velocity, "weakened_friction": friction}
    # The dynamic stress drop is a small difference, whose error estimate is 5e-7 of its value.
    tolerance = 1e-6 if variable == "dynamic_stress_drop" else 1e-7
    statement = f"V_w = {velocity:g} V_*, f_w = {friction:g}: {variable.replace('_', ' ')}"
    return known_value_claim("H5", statement, variable, where, value, tolerance)


def plot_complete_drop(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line that shows the friction at V_* minus the friction of weakened contacts.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    friction = dataset["weakened_friction"].values
    drop = float(dataset["mu_star"]) - friction
    axes.plot(friction, drop, color="0.6", linestyle=":", label=r"$\mu_* - f_w$")


figure = Figure(
    [
        Panel(
            x="weakened_friction",
            y="static_stress_drop",
            hue=["weakening_velocity_ratio"],
            overlays=[plot_complete_drop],
            x_label="Friction of weakened contacts, $f_w$",
            title="Nearly complete stress drop",
        ),
        Panel(
            x="weakened_friction",
            y="recurrence_interval",
            hue=["weakening_velocity_ratio"],
            x_label="Friction of weakened contacts, $f_w$",
            y_label="Recurrence interval, $t_r V_*/D_c$",
            title="Longer intervals",
        ),
    ],
)


study = Study(
    name="flash_heating_cycles",
    title="Limit cycles with flash heating against the friction of weakened contacts",
    summary=Study.caption(__doc__),
    base=FLASH_FAULT.with_(stiffness=0.002, load_velocity_ratio=2.0, radiation_damping=4e-8),
    axes=[
        Axis("weakening_velocity_ratio", [1e4, 1e5, 1e9]),
        Axis("weakened_friction", np.round(np.linspace(0.1, 0.5, 9), 3).tolist()),
    ],
    measure=LimitCycle(phases=2),
    accuracy=Accuracy(rtol=1e-7),
    claims=[
        cycle_claim("recurrence_interval", 1e5, 0.2, 89.60742455707),
        cycle_claim("static_stress_drop", 1e5, 0.2, 0.347306584383),
        cycle_claim("dynamic_stress_drop", 1e5, 0.2, 0.018485627417),
        cycle_claim("recurrence_interval", 1e5, 0.1, 112.23897431018),
        cycle_claim("static_stress_drop", 1e5, 0.1, 0.437458506041),
        cycle_claim("recurrence_interval", 1e4, 0.2, 101.89423501781),
        cycle_claim("static_stress_drop", 1e4, 0.2, 0.396242106851),
        cycle_claim("recurrence_interval", 1e9, 0.2, 19.36239551804),
        cycle_claim("static_stress_drop", 1e9, 0.2, 0.067882894021),
        Claim.above(
            id="H6",
            statement="the stress drop is nearly complete: more than 0.8 (mu_* - f_w)",
            source=f"{RICE}, and {INDEPENDENT}",
            variable="static_stress_drop",
            where={"weakening_velocity_ratio": 1e5, "weakened_friction": 0.2},
            published=0.32,
        ),
    ],
    plot=figure,
    references=FLASH_REFERENCES,
)
