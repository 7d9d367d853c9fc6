"""Steady friction and critical stiffness of a fault that is heated by slip.

If both activation energies are equal, a higher temperature has the same effect as a lower slip
rate. At low slip rates, heating is negligible, and the steady friction decreases with slip rate. At
the transition slip rate, the temperature rise is about R T^2/Q. Above the transition slip rate, the
temperature increases so steeply with slip rate that the steady friction increases. The transition
slip rate is proportional to the cooling rate. At the slip rate V_* and with slow cooling, the
critical stiffness is higher than without heating. The reason is that a rise in temperature weakens
the fault through the direct effect. With fast cooling, the temperature follows the slip rate, and
the critical stiffness is slightly below (b - a) sigma_*/D_c.
"""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.measures import LinearStability
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._heat import (
    HEATED_FAULT,
    HEATING_REFERENCES,
    INDEPENDENT,
    closest_to,
    known_value_claim,
)

#: Heating H, both activation terms, a and b of the fault.
_HEATING, _ACTIVATION, _A, _B, _MU_STAR = 0.001, 35.0, 0.01, 0.015, 0.6


def transition_rate(cooling: float) -> float:
    """Compute the slip rate at which steady friction is lowest, in closed form.

    At this slip rate, y F = b - a, with y = M (H/C) V and M = (b q_b - a q_a)/(T/T_*)^2.

    Parameters
    ----------
    cooling : float
        Cooling rate C.

    Returns
    -------
    float
        Slip rate V/V_*, or NaN if steady friction increases at V_*.
    """
    over = _HEATING / cooling

    def steady(rate: float) -> tuple[float, float]:
        # The temperature rise solves a quadratic equation.
        cold = _MU_STAR + (_A - _B) * math.log(rate)
        linear = 1.0 - over * (cold * rate - _MU_STAR) - over * (_B - _A) * _ACTIVATION * rate
        constant = -over * (cold * rate - _MU_STAR)
        rise = 0.5 * (-linear + math.sqrt(linear * linear - 4.0 * constant))
        return rise, cold + (_B - _A) * _ACTIVATION * rise / (1.0 + rise)

    def excess(log_rate: float) -> float:
        rate = math.exp(log_rate)
        rise, friction = steady(rate)
        turning = (_B - _A) * _ACTIVATION / (1.0 + rise) ** 2 * over * rate
        return turning * friction - (_B - _A)

    # Friction has its minimum at the first sign change, because friction decreases again at
    # temperatures far above T_*.
    logs = np.linspace(0.0, 15.0, 301)
    rising = [x for x in logs.tolist() if excess(x) > 0.0]
    return math.exp(brentq(excess, 0.0, rising[0])) if rising and rising[0] > 0.0 else math.nan


def shown_cooling_rates(values: Sequence[float]) -> list[float]:
    """Return the cooling rates for which the figure shows the steady friction.

    Parameters
    ----------
    values : sequence of float
        All cooling rates.

    Returns
    -------
    list of float
        Cooling rates that are powers of ten, from 0.1. If there are no such cooling rates, the list
        contains all cooling rates.
    """
    return [v for v in values if v in (0.1, 1.0, 10.0, 100.0)] or list(values)


def plot_transitions(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw dotted lines at the slip rates of lowest friction, in closed form.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    for number, cooling in enumerate(shown_cooling_rates(dataset["cooling"].values.tolist())):
        rate = transition_rate(cooling)
        if rate <= float(dataset["load_velocity_ratio"].max()):
            axes.axvline(rate, color=cycle_style(number)["color"], linestyle=":", linewidth=0.8)


def stiffness_claim(cooling: float, value: float) -> Claim:
    """Return the claim that k_cr at V_* equals its closed form (H8).

    Parameters
    ----------
    cooling : float
        Cooling rate C.
    value : float
        Critical stiffness in sigma_*/D_c.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    where = {"cooling": cooling, "load_velocity_ratio": 1.0}
    statement = f"C = {cooling:g}, V = V_*: k_cr = {value:g} sigma_*/D_c"
    return known_value_claim("H8", statement, "critical_stiffness", where, value, 1e-11)


def transition_claim(factor: float, change: str) -> Claim:
    """Return a claim about the transition from weakening to strengthening (H9).

    Parameters
    ----------
    factor : float
        Slip rate divided by the slip rate of the transition.
    change : str
        Change of steady friction towards the transition.

    Returns
    -------
    Claim
        Claim that the steady friction exceeds its minimum.
    """
    return Claim.above(
        id="H9",
        statement=f"C = 0.1: steady friction {change} at {factor:g} times the closed-form rate",
        source="dF/dx = [(a - b) + y F]/(1 - y), which is zero at V = 5.02612838 V_*",
        variable="steady_friction",
        where={"cooling": 0.1, "load_velocity_ratio": factor * TRANSITION_RATE},
        baseline={"cooling": 0.1, "load_velocity_ratio": TRANSITION_RATE},
        published=0.0,
    )


def critical_stiffness_at_reference(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Compute the critical stiffness at V_* in closed form.

    The closed form is the Routh-Hurwitz condition of a polynomial of degree three.

    Parameters
    ----------
    row : xarray.Dataset
        Results at one slip rate.

    Returns
    -------
    tuple of ndarray
        Cooling rates C and critical stiffness in sigma_*/D_c.
    """
    cooling = np.geomspace(row["cooling"].values[0], row["cooling"].values[-1], 200)
    direct, turning = _A * _ACTIVATION, (_B - _A) * _ACTIVATION
    found = []
    for rate in cooling.tolist():
        quadratic = np.poly1d([1.0, _A * (1.0 + rate) - _B - _MU_STAR * _HEATING * direct])
        linear = np.poly1d(
            [1.0 + rate + _HEATING * direct, -rate * (_B - _A) + _MU_STAR * _HEATING * turning]
        )
        constant = np.poly1d([_A * (rate - _HEATING * turning), 0.0])
        found.append((quadratic * linear - constant).roots.real.max())
    return cooling, np.array(found)


figure = Figure(
    [
        Panel(
            x="load_velocity_ratio",
            y="steady_friction",
            hue=["cooling"],
            isel={"cooling": shown_cooling_rates},
            overlays=[plot_transitions],
            style={"markersize": 2},
            x_label="Slip rate, $V/V_*$",
            y_label=r"Steady friction, $\mu_{ss}$",
            title="Dotted: lowest friction",
            log="x",
        ),
        Panel(
            x="cooling",
            y="critical_stiffness_from_growth",
            isel={"load_velocity_ratio": closest_to(1.0)},
            fit_line=critical_stiffness_at_reference,
            x_label="Cooling rate, $c_{th}D_c/V_*$",
            y_label=r"Critical stiffness, $k_{cr}D_c/\sigma_*$",
            title="At $V_*$; line: closed form, points: growth",
            log="x",
        ),
    ]
)

#: Slip rate of lowest friction for C = 0.1.
TRANSITION_RATE = 5.02612838

study = Study(
    name="shear_heating",
    title="Steady friction and critical stiffness with shear heating, Q_a = Q_b = 35 R T",
    summary=Study.caption(__doc__),
    base=HEATED_FAULT.with_(direct_activation=_ACTIVATION, evolution_activation=_ACTIVATION),
    axes=[
        Axis("cooling", np.round(10.0 ** np.linspace(-2.0, 2.0, 13), 10).tolist()),
        Axis(
            "load_velocity_ratio",
            sorted(
                {
                    *np.round(10.0 ** np.linspace(-3.0, 4.0, 29), 10).tolist(),
                    *(factor * TRANSITION_RATE for factor in (0.999, 1.0, 1.001)),
                }
            ),
        ),
    ],
    measure=LinearStability(),
    claims=[
        *(
            known_value_claim(
                "H7",
                f"C = 0.1, V = {rate:g} V_*: steady friction is {value:.6f}",
                "steady_friction",
                {"cooling": 0.1, "load_velocity_ratio": rate},
                value,
                2e-12,
            )
            for rate, value in (
                (0.001, 0.633483560380),
                (0.1, 0.610564663686),
                (10.0, 0.597412143020),
                (100.0, 0.645215782106),
            )
        ),
        stiffness_claim(0.1, 0.00518469716608586),
        stiffness_claim(1.0, 0.00499973913318129),
        transition_claim(0.999, "still decreases"),
        transition_claim(1.001, "increases again"),
        Claim.above(
            id="H9",
            statement="C = 0.1: friction increases from 10 V_* to 100 V_*",
            source=f"Blanpied et al. (1998), and {INDEPENDENT}",
            variable="steady_friction",
            where={"cooling": 0.1, "load_velocity_ratio": 100.0},
            baseline={"cooling": 0.1, "load_velocity_ratio": 10.0},
            published=0.0,
        ),
        Claim.below(
            id="H9",
            statement="C = 100: friction still decreases from 10 V_* to 100 V_*",
            source=INDEPENDENT,
            variable="steady_friction",
            where={"cooling": 100.0, "load_velocity_ratio": 100.0},
            baseline={"cooling": 100.0, "load_velocity_ratio": 10.0},
            published=0.0,
        ),
    ],
    plot=figure,
    references=HEATING_REFERENCES,
)
