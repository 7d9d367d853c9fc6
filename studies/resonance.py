"""Response of spring stress to oscillating normal stress.

Imposed normal stress oscillates during steady sliding, and spring stress oscillates with the same
period. Close to the critical stiffness, small oscillations have a resonance at the period 2 pi
sqrt(a/(b - a)) D_c/V under both laws. The amplitude above which linear theory fails decreases as
the stiffness approaches the critical stiffness.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.reductions import Inverse
from rsfstudy.slider.stability import compute_spring_response_to_normal_stress
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_horizontal_line_overlay

from ._normal_stress_response import NormalStressResponse
from ._phase_plane import scene_from_coordinates

base = Scene(normal_stress="imposed", alpha=0.25, b_over_a=2.0)
a, b = base.a, base.b
#: Resonant period in D_c/V_* in the limit k = k_cr, 2 pi/sqrt((b - a)/a).
RESONANCE_PERIOD = 2.0 * math.pi * math.sqrt(a / (b - a))
PERIODS = [factor * RESONANCE_PERIOD for factor in (0.75, 1.0, 1.5)]
STIFFNESS_RATIOS = [1.2, 1.5, 4.0]
SMALL_AMPLITUDE, LARGE_AMPLITUDE = 1e-4, 1e-2
AMPLITUDES = [SMALL_AMPLITUDE, 3e-4, 1e-3, 3e-3, LARGE_AMPLITUDE, 5e-2]
LAWS = ("slip", "slowness")
#: Largest relative difference from linear theory for which linear theory is considered valid.
MAX_LINEAR_DEVIATION = 0.1
LINEAR_THEORY_SOURCE = (
    "linear theory of steady sliding: K [mu + (mu - alpha) z]/[a z^2 + (K - b + a) z + K]"
)


def linear_gain(ratio: float, period: float) -> float:
    """Compute the gain of small oscillations.

    Parameters
    ----------
    ratio : float
        Stiffness relative to the critical stiffness.
    period : float
        Period of the oscillation in D_c/V_*.

    Returns
    -------
    float
        Ratio of the amplitude of spring stress to the amplitude of normal stress.
    """
    stiffness, z = ratio * (b - a), 2j * math.pi / period
    above = stiffness * (base.mu_star + (base.mu_star - base.alpha) * z)
    return float(abs(above / (a * z * z + (stiffness - b + a) * z + stiffness)))


def log_rate_amplitude(ratio: float, period: float, amplitude: float) -> float:
    r"""Compute the amplitude of ln V in small oscillations.

    The slip rate differs from :math:`V_0` by :math:`-(d\tau/dt)/K`, where :math:`\tau` is the
    spring stress.

    Parameters
    ----------
    ratio : float
        Stiffness relative to the critical stiffness.
    period : float
        Period of the oscillation in D_c/V_*.
    amplitude : float
        Amplitude of normal stress in sigma_*.

    Returns
    -------
    float
        Amplitude of ln V.
    """
    return 2.0 * math.pi / period * linear_gain(ratio, period) * amplitude / (ratio * (b - a))


def linear_limit_claim(law: str, ratio: float, period: float) -> Claim:
    """Return the claim that small oscillations follow linear theory (R1).

    Parameters
    ----------
    law : str
        State evolution law.
    ratio : float
        Stiffness relative to the critical stiffness.
    period : float
        Period of the oscillation in D_c/V_*.

    Returns
    -------
    Claim
        Claim about the gain.
    """
    gain = linear_gain(ratio, period)
    return Claim(
        id="R1",
        statement=f"{law} law, k = {ratio:g} k_cr, {period / RESONANCE_PERIOD:g} times the "
        "resonant period: gain of small oscillations",
        source=LINEAR_THEORY_SOURCE,
        variable="gain",
        where={
            "law": law,
            "stiffness_ratio": ratio,
            "oscillation_period": period,
            "oscillation_amplitude": SMALL_AMPLITUDE,
        },
        published=gain,
        tolerance=gain * (log_rate_amplitude(ratio, period, SMALL_AMPLITUDE) ** 2 + 1e-6),
        reason="linear theory neglects the square of the amplitude of ln V, which is up to 5e-4; "
        "1e-6 is added",
    )


def resonance_claim(law: str, period: float) -> Claim:
    """Return the claim that the gain is largest at the resonant period (R2).

    Parameters
    ----------
    law : str
        State evolution law.
    period : float
        Another period in D_c/V_*.

    Returns
    -------
    Claim
        Claim about the difference of the gains at the two periods.
    """
    at = {
        "law": law,
        "stiffness_ratio": STIFFNESS_RATIOS[0],
        "oscillation_amplitude": SMALL_AMPLITUDE,
    }
    return Claim.above(
        id="R2",
        statement=(
            f"{law} law, k = {STIFFNESS_RATIOS[0]:g} k_cr: the gain at resonance exceeds that at "
            f"{period / RESONANCE_PERIOD:g} times the period"
        ),
        source=(
            "linear theory: as k decreases to k_cr, resonance is at omega D_c/V = sqrt((b - a)/a)"
        ),
        variable="gain",
        where={**at, "oscillation_period": RESONANCE_PERIOD},
        baseline={**at, "oscillation_period": period},
        published=0.0,
    )


def linear_range_claim(law: str, ratio: float, amplitude: float, *, still: bool = True) -> Claim:
    """Return the claim that linear theory is, or is not, valid at a given amplitude (R3).

    Parameters
    ----------
    law : str
        State evolution law.
    ratio : float
        Stiffness relative to the critical stiffness.
    amplitude : float
        Amplitude of normal stress in sigma_*.
    still : bool, default: True
        If True, linear theory is valid at this amplitude.

    Returns
    -------
    Claim
        Claim about the relative difference from linear theory.
    """
    return Claim(
        id="R3",
        statement=f"{law} law, k = {ratio:g} k_cr at resonance, A = {amplitude:g}: linear theory "
        f"{'holds' if still else 'no longer holds'} to a tenth",
        source="linear theory assumes small changes of ln V, which increase with the gain",
        variable="departure_from_linear",
        where={
            "law": law,
            "stiffness_ratio": ratio,
            "oscillation_period": RESONANCE_PERIOD,
            "oscillation_amplitude": amplitude,
        },
        relation="below" if still else "above",
        published=MAX_LINEAR_DEVIATION,
    )


def failure_order_claim(softer: float, stiffer: float) -> Claim:
    """Return a claim about the amplitudes at which linear theory fails (R4).

    Linear theory fails at a smaller amplitude on the softer spring.

    Parameters
    ----------
    softer : float
        Lower stiffness relative to the critical stiffness.
    stiffer : float
        Higher stiffness relative to the critical stiffness.

    Returns
    -------
    Claim
        Claim about the difference of the amplitudes at which linear theory fails.
    """
    at = {"law": "slowness", "oscillation_period": RESONANCE_PERIOD}
    return Claim.below(
        id="R4",
        statement=f"slowness law: linear theory fails at a smaller amplitude at {softer:g} k_cr "
        f"than at {stiffer:g} k_cr",
        source=(
            "changes of ln V increase with the gain, which is larger closer to critical stiffness"
        ),
        variable="failing_amplitude",
        where={**at, "stiffness_ratio": softer},
        baseline={**at, "stiffness_ratio": stiffer},
        published=0.0,
    )


def linear_theory_line(
    part: Callable[[np.ndarray], Any], row: xr.Dataset
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the response that linear theory predicts at closely spaced periods.

    The periods extend beyond the range of the results by a factor of two.

    Parameters
    ----------
    part : callable
        Function that converts complex responses to the plotted values.
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of ndarray
        Periods in D_c/V_*, and plotted values.
    """
    scene, known = scene_from_coordinates(row.isel(oscillation_period=0)), row["oscillation_period"]
    periods = np.geomspace(0.5 * float(known.min()), 2.0 * float(known.max()), 300)
    frequencies = 2.0 * math.pi / periods
    found = [
        compute_spring_response_to_normal_stress(scene, scene.log_load_velocity, f)
        for f in frequencies
    ]
    return periods, np.asarray(part(np.array(found)))


def phase_lead(responses: np.ndarray) -> Any:
    """Return the phase lead of spring stress in degrees.

    Parameters
    ----------
    responses : ndarray
        Complex responses.

    Returns
    -------
    object
        Phase lead in degrees.
    """
    return np.degrees(np.angle(responses))


def settled_values(variable: str, row: xr.Dataset) -> xr.DataArray:
    """Return the values of a variable in the cells in which the response has settled.

    Parameters
    ----------
    variable : str
        Name of the variable.
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Values of the variable, with NaN in cells without a settled response.
    """
    return row[variable].where(row["settled"] == 1.0)


def plot_linear_theory(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw horizontal lines at the gains of linear theory.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    for number in range(dataset.sizes["stiffness_ratio"]):
        gain = float(dataset["linear_gain"].isel(stiffness_ratio=number).max())
        build_horizontal_line_overlay(
            gain, color=cycle_style(number)["color"], linewidth=0.6, linestyle=":"
        )(dataset, axes)


def closest_to_resonance(periods: list[float]) -> float:
    """Return the period that is closest to the resonant period.

    Parameters
    ----------
    periods : list of float
        Periods in D_c/V_*.

    Returns
    -------
    float
        Period in D_c/V_*.
    """
    return min(periods, key=lambda period: abs(period - RESONANCE_PERIOD))


small_amplitude_panel = Panel(
    x="oscillation_period",
    hue=["stiffness_ratio", "law"],
    style=lambda row: {"markersize": 3.0 if row["law"] == LAWS[0] else 5.5},
    isel={"oscillation_amplitude": 0},
    log="x",
    legend_columns=3,
)
large_amplitude_panel = Panel(
    x="oscillation_amplitude",
    hue=["stiffness_ratio", "law"],
    isel={"oscillation_period": closest_to_resonance},
    style={"linewidth": 0.9},
    log="xy",
)
GAIN_LABEL = r"Gain, $|\hat\tau/\hat\sigma|$"
figure = Figure(
    [
        replace(
            small_amplitude_panel,
            y="gain",
            fit_line=partial(linear_theory_line, np.abs),
            y_label=GAIN_LABEL,
            log="xy",
        ),
        replace(
            small_amplitude_panel,
            y="phase_lead",
            fit_line=partial(linear_theory_line, phase_lead),
            y_label="Lead (degree)",
        ),
        replace(
            large_amplitude_panel,
            y=partial(settled_values, "gain"),
            overlays=[plot_linear_theory],
            y_label=GAIN_LABEL,
        ),
        replace(
            large_amplitude_panel,
            y=partial(settled_values, "departure_from_linear"),
            overlays=[build_horizontal_line_overlay(MAX_LINEAR_DEVIATION)],
            y_label="Relative difference from linear theory",
        ),
    ],
    height=50.0,
)


study = Study(
    name="resonance",
    title="Response to oscillating normal stress, b/a = 2",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", LAWS),
        Axis("stiffness_ratio", STIFFNESS_RATIOS),
        Axis("oscillation_period", PERIODS),
        Axis("oscillation_amplitude", AMPLITUDES),
    ],
    measure=NormalStressResponse(samples=32),
    accuracy=Accuracy(rtol=1e-5),
    reductions=[
        Inverse(
            name="failing_amplitude",
            of="departure_from_linear",
            on="oscillation_amplitude",
            levels=MAX_LINEAR_DEVIATION,
        )
    ],
    claims=[
        *(
            linear_limit_claim("slip", ratio, period)
            for ratio in STIFFNESS_RATIOS
            for period in PERIODS
        ),
        *(linear_limit_claim("slowness", ratio, RESONANCE_PERIOD) for ratio in STIFFNESS_RATIOS),
        *(resonance_claim(law, period) for law in LAWS for period in (PERIODS[0], PERIODS[-1])),
        linear_range_claim("slip", STIFFNESS_RATIOS[0], 3e-3, still=False),
        linear_range_claim("slowness", STIFFNESS_RATIOS[0], LARGE_AMPLITUDE, still=False),
        *(linear_range_claim(law, STIFFNESS_RATIOS[-1], LARGE_AMPLITUDE) for law in LAWS),
        failure_order_claim(STIFFNESS_RATIOS[0], STIFFNESS_RATIOS[1]),
    ],
    plot=figure,
    references=[
        "Perfettini, Schmittbuhl, Rice and Cocco (2001), J. Geophys. Res. 106, 13455-13472",
        "Boettcher and Marone (2004), J. Geophys. Res. 109, B03406",
    ],
)
