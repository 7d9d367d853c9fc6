"""Estimates of alpha and D_c from steps of normal stress.

Imposed normal stress changes by a step while the load point continues to move at V_*, and friction
is recorded over 20 D_c. An exponential function is fitted to the transient and extrapolated to the
time of the step, as in the experiments of Linker and Dieterich (1992). The fitted function gives
estimates of alpha and D_c. Under the slip law, both estimates are correct on a stiff machine. Under
the slowness law, alpha is too small for steps up and too large for steps down, even on a very stiff
machine. On a compliant machine, considerable slip occurs before the spring stress has adjusted to
the change of strength. The estimates therefore depend on the machine as much as on the fault.
"""

import math
from dataclasses import replace

import numpy as np
import xarray as xr
from scipy.integrate import quad

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_horizontal_line_overlay

from ._normal_stress_transient import NormalStressTransient
from ._phase_plane import scene_from_coordinates

#: Ratios of stiffness to critical stiffness, from compliant to stiff machines.
RATIOS = [10.0, 20.0, 50.0, 100.0]
STEPS = [-0.2, -0.05, 0.05, 0.2]
STIFFEST = RATIOS[-1]
LAWS = ("slip", "slowness")

base = Scene(normal_stress="imposed", alpha=0.25, b_over_a=2.0, load_velocity_ratio=1.0)
a, b, mu, alpha = base.a, base.b, base.mu_star, base.alpha
TRANSIENT_MEASURE = NormalStressTransient(record=20.0)
CLOSED_FORM_SOURCE = "closed form at constant slip rate, and its first order in a/K"


def initial_log_rate(step: float) -> float:
    """Compute ln(V/V_*) immediately after a step of normal stress.

    Parameters
    ----------
    step : float
        Step of normal stress in sigma_*.

    Returns
    -------
    float
        Natural logarithm of V/V_*.
    """
    r = 1.0 + step
    return float((mu * (1.0 / r - 1.0) + alpha * math.log(r)) / a)


def remaining_transient(law: str, step: float, ratio: float, slip: float) -> float:
    r"""Compute the friction transient that remains at a given slip, to first order in a/K.

    Let :math:`r` be one plus the step of normal stress, and :math:`\delta` the slip in :math:`D_c`.
    The transient of a rigid slider is :math:`-\alpha \ln r \, e^{-\delta}` under the slip law.
    Under the slowness law, the transient is :math:`b \ln(1 + y)` with
    :math:`y = (r^{-\alpha/b} - 1)\,e^{-\delta}`. The finite stiffness :math:`K` of the machine has
    two effects on the transient. While the spring follows the change of strength, ln V returns to
    zero over a slip of approximately :math:`a r/K`, and the evolution of the state differs from the
    evolution at :math:`V_*`. Later, while friction changes, the slip rate differs from the load
    point velocity.

    Parameters
    ----------
    law : str
        State evolution law.
    step : float
        Step of normal stress in sigma_*.
    ratio : float
        Stiffness relative to the critical stiffness.
    slip : float
        Slip since the step in D_c.

    Returns
    -------
    float
        Remaining transient of friction.
    """
    r = 1.0 + step
    short = r / (ratio * (b - a))
    x = initial_log_rate(step)
    if law == "slip":
        size = -alpha * math.log(r)
        late = -a * b * short * quad(lambda y: y / math.expm1(-y) if y else -1.0, x, 0.0)[0]
        return float((size + late + short * size * (a - b * slip)) * math.exp(-slip))
    y = math.expm1(-alpha / b * math.log(r))
    slower = b * short * y * math.log((math.exp(slip) + y) / (1.0 + y))
    now = math.exp(-slip) * (y - a * short * x - slower)
    rigid = math.exp(-slip) * y
    return b * math.log1p(now) + a * b * short * rigid / (1.0 + rigid)


def expected_readings(law: str, step: float, ratio: float = math.inf) -> tuple[float, float]:
    """Compute the expected estimates of alpha and D_c from the closed form.

    Parameters
    ----------
    law : str
        State evolution law.
    step : float
        Step of normal stress in sigma_*.
    ratio : float, optional
        Stiffness relative to the critical stiffness. By default, the slider is rigid.

    Returns
    -------
    tuple of float
        Estimates of alpha and of D_c.
    """
    first, last = (
        remaining_transient(law, step, ratio, slip)
        for slip in (TRANSIENT_MEASURE.fit_from, TRANSIENT_MEASURE.fit_to)
    )
    distance = (TRANSIENT_MEASURE.fit_to - TRANSIENT_MEASURE.fit_from) / math.log(first / last)
    return -first * math.exp(TRANSIENT_MEASURE.fit_from / distance) / math.log(1.0 + step), distance


def rigid_limit_claim(law: str, step: float) -> Claim:
    """Return a claim about the estimate of alpha on a stiff machine (R5).

    Parameters
    ----------
    law : str
        State evolution law.
    step : float
        Step of normal stress in sigma_*.

    Returns
    -------
    Claim
        Claim about the estimate.
    """
    read, rigid = expected_readings(law, step, STIFFEST)[0], expected_readings(law, step)[0]
    return Claim(
        id="R5",
        statement=(
            f"{law} law, step of {step:+g} sigma_*, k = {STIFFEST:g} k_cr: the apparent alpha "
            f"agrees with the closed form to first order in a/K (rigid slider: {rigid:.4f})"
        ),
        source=CLOSED_FORM_SOURCE,
        variable="apparent_alpha",
        where={"law": law, "normal_stress_step": step, "stiffness_ratio": STIFFEST},
        published=read,
        tolerance=0.2 * abs(read - rigid) + 1e-3 * alpha,
        reason="the second order in a/K is less than a fifth of the first order; 1e-3 of alpha is "
        "added",
    )


def slip_distance_claim(law: str, step: float) -> Claim:
    """Return a claim about the estimate of D_c on a stiff machine (R6).

    Parameters
    ----------
    law : str
        State evolution law.
    step : float
        Step of normal stress in sigma_*.

    Returns
    -------
    Claim
        Claim about the estimate.
    """
    read, rigid = expected_readings(law, step, STIFFEST)[1], expected_readings(law, step)[1]
    quicker = initial_log_rate(step) if law == "slip" else -initial_log_rate(step)
    return Claim(
        id="R6",
        statement=(
            f"{law} law, step of {step:+g} sigma_*, k = {STIFFEST:g} k_cr: the apparent D_c "
            f"agrees with the closed form to first order in a/K (rigid slider: {rigid:.4f} D_c)"
        ),
        source=CLOSED_FORM_SOURCE,
        variable="apparent_slip_distance",
        where={"law": law, "normal_stress_step": step, "stiffness_ratio": STIFFEST},
        published=read,
        tolerance=(0.1 * max(quicker, 0.0) + 0.06) * b / (STIFFEST * (b - a)),
        reason="the second order relative to b/K is 0.06, plus 0.1 for each factor of e by which "
        "the slider is initially faster (slip law) or slower (slowness law)",
    )


def direct_change_claim(law: str, step: float) -> Claim:
    """Return the claim that the state changes by -alpha ln r at the step (R7).

    Parameters
    ----------
    law : str
        State evolution law.
    step : float
        Step of normal stress in sigma_*.

    Returns
    -------
    Claim
        Claim about the immediate change of friction.
    """
    return Claim(
        id="R7",
        statement=f"{law} law, step of {step:+g} sigma_*: the state decreases by alpha ln r "
        "immediately",
        source="Linker and Dieterich (1992): dTheta = -alpha dsigma/sigma",
        variable="direct_change",
        where={"law": law, "normal_stress_step": step, "stiffness_ratio": RATIOS[0]},
        published=-alpha * math.log(1.0 + step),
        tolerance=1e-15,
        reason="an identity; the tolerance covers rounding",
    )


#: Slip in D_c up to which records are plotted.
PLOTTED_SLIP = 4.0


def friction_change(row: xr.Dataset) -> xr.DataArray:
    """Return the change of friction over the plotted range of slip.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Change of friction, with NaN outside the plotted range.
    """
    return (row["friction_coefficient"] - row["mu_star"]).where(row["slip"] <= PLOTTED_SLIP)


def plot_rigid_transients(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the transients of a rigid slider from the closed form of the law.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    slip, highest = np.linspace(0.0, PLOTTED_SLIP, 100), 0.0
    for place in range(dataset.sizes["normal_stress_step"]):
        row = dataset.isel(normal_stress_step=place, stiffness_ratio=0)
        scene = scene_from_coordinates(row)
        if form := scene.parts.law.state_relaxation_function:
            away = -scene.alpha / scene.b * math.log1p(float(row["normal_stress_step"]))
            left = scene.b * np.array([form(away, at) for at in slip.tolist()])
            axes.plot(slip, left, ":", color="black", label="rigid")
            highest = max(highest, float(np.abs(left).max()))
    if highest:
        axes.set_ylim(-1.4 * highest, 1.4 * highest)


readings_panel = Panel(
    x="stiffness_ratio",
    hue=["normal_stress_step", "law"],
    style={"linewidth": 0.9},
    overlays=[build_horizontal_line_overlay(1.0)],
    log="x",
)
figure = Figure(
    [
        Panel(
            x="slip",
            y=friction_change,
            hue=["stiffness_ratio", "normal_stress_step"],
            facet=["law"],
            isel={"normal_stress_step": lambda steps: sorted({min(steps), max(steps)})},
            style={"marker": ""},
            overlays=[plot_rigid_transients],
            x_label=r"Slip since the step, $\delta/D_c$",
            y_label=r"Change of friction, $\Delta\mu$",
            x_limits=(0.0, PLOTTED_SLIP),
        ),
        replace(
            readings_panel,
            y=lambda row: row["apparent_alpha"] / row["alpha"],
            title=r"Apparent $\alpha$",
            y_label=r"$\alpha_{read}/\alpha$",
        ),
        replace(
            readings_panel,
            y="apparent_slip_distance",
            title="Apparent slip distance",
            y_label="$D_{read}/D_c$",
        ),
    ],
    height=48.0,
)


study = Study(
    name="normal_stress_steps",
    title="Apparent parameters of normal stress steps, b/a = 2",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", LAWS),
        Axis("normal_stress_step", STEPS),
        Axis("stiffness_ratio", RATIOS),
    ],
    measure=TRANSIENT_MEASURE,
    accuracy=Accuracy(rtol=1e-5),
    claims=[
        *(rigid_limit_claim(law, step) for law in LAWS for step in STEPS),
        *(slip_distance_claim(law, step) for law in LAWS for step in STEPS),
        *(direct_change_claim(law, step) for law in LAWS for step in (STEPS[0], STEPS[-1])),
    ],
    plot=figure,
    references=[
        "Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940",
        "Hong and Marone (2005), Geochem. Geophys. Geosyst. 6, Q03012",
    ],
)
