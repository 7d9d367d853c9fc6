"""Recurrence of laboratory earthquakes in the model of Gualandi et al. (2023).

Pores close when the slip rate increases. Without noise, all recurrence intervals are equal at ten
of the twelve normal stresses of the experiments. At 17.003 and 20.002 MPa, the cycle with one event
per period is unstable, and long and short intervals alternate. The coefficient of variation (CV) of
the intervals at these two normal stresses is 10 % and 20 %, respectively. The motion is periodic,
with two events per period.

White noise in the shear stress causes scatter of the intervals at all normal stresses. The CV
differs from the CV of the stochastic model of Gualandi et al., because the noise in their model
also acts on the state variable and on the normal stress. In their model, stress fluctuates at
constant slip rate, so the state variable changes with the noise. In this study, the slip rate
changes with the noise instead.
"""

from collections.abc import Sequence
from typing import Any

import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Study
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._gualandi import (
    NORMAL_STRESSES,
    REFERENCES,
    STRESS_NOISE,
    build_gualandi_rig,
    build_gualandi_scene,
)
from ._peak_statistics import PeakStatistics

SOURCE = "Gualandi et al. (2023), deterministic model, and independent integration"
#: CV in per cent of the stochastic model of Gualandi et al. and of the experiments, at the normal
#: stresses of the study. The values were read from a figure, with an error of 0.3.
STOCHASTIC_MODEL = (5.6, 7.5, 6.0, 8.4, 11.4, 13.3, 14.6, 17.0, 11.5, 6.4, 2.7, 1.8)
EXPERIMENTS = (23.3, 5.4, 6.6, 8.4, 7.0, 13.5, 14.7, 16.4, 23.9, 13.1, 3.6, 3.9)
#: Normal stresses at which long and short intervals alternate.
ALTERNATING = (17.003, 20.002)


def experiment_fields(normal_stress: float, noise: str) -> dict[str, Any]:
    """Return the fields that depend on the normal stress and on the noise.

    Parameters
    ----------
    normal_stress : float
        Applied normal stress in MPa.
    noise : str
        Name of the noise: "none" or "white".

    Returns
    -------
    dict of str to float or str
        Fields of the scene.
    """
    scene, rig = build_gualandi_scene(normal_stress), build_gualandi_rig(normal_stress)
    names = ("stiffness", "radiation_damping", "dilatancy")
    fields = {"loading_noise": noise, **{name: getattr(scene, name) for name in names}}
    if noise == "none":
        return fields
    return {**fields, "stress_noise": STRESS_NOISE / rig.normal_stress, "noise_interval": 0.1}


def experiment_name(normal_stress: float, noise: str) -> str:
    """Return the coordinate label of an experiment."""
    return f"{normal_stress:g} MPa" + ", noise" * (noise != "none")


def interval_cv_claim(normal_stress: float, variation: float, tolerance: float) -> Claim:
    """Return a claim about the CV of alternating long and short intervals (L1).

    Parameters
    ----------
    normal_stress : float
        Applied normal stress in MPa.
    variation : float
        Expected CV.
    tolerance : float
        Tolerance of the claim.

    Returns
    -------
    Claim
        Claim about the CV of the intervals without noise.
    """
    return Claim(
        id="L1",
        statement=f"{normal_stress:g} MPa without noise: long and short intervals alternate",
        source=SOURCE,
        variable="recurrence_interval_cv",
        where={"experiment": experiment_name(normal_stress, "none")},
        published=variation,
        tolerance=tolerance,
        reason="values of the paper were read from a figure, and depend on how events are timed",
    )


def equal_intervals_claim(normal_stress: float) -> Claim:
    """Return the claim that all intervals are equal without noise (L2).

    Parameters
    ----------
    normal_stress : float
        Applied normal stress in MPa.

    Returns
    -------
    Claim
        Claim about the CV of the intervals without noise.
    """
    return Claim.below(
        id="L2",
        statement=f"{normal_stress:g} MPa without noise: all intervals are equal",
        source=SOURCE,
        variable="recurrence_interval_cv",
        where={"experiment": experiment_name(normal_stress, "none")},
        published=0.015,
        reason="an inequality; at 21.985 MPa the intervals approach each other slowly",
    )


def normal_stresses(row: xr.Dataset) -> xr.DataArray:
    """Return the normal stresses of the experiments in MPa."""
    values = [float(str(name).split()[0]) for name in row["experiment"].values]
    return xr.DataArray(values, dims="experiment")


def interval_cv(row: xr.Dataset) -> xr.DataArray:
    """Return the CV of the recurrence interval in per cent."""
    return 100.0 * row["recurrence_interval_cv"]


def plot_published(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the published CVs: from the stochastic model of the paper and from experiments.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study. Not used.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    style = {"linestyle": "", "markerfacecolor": "none"}
    label = "Gualandi et al., noise of stress and state"
    axes.plot(NORMAL_STRESSES, STOCHASTIC_MODEL, marker="s", color="0.4", label=label, **style)
    axes.plot(NORMAL_STRESSES, EXPERIMENTS, marker="x", color="0.6", label="experiments", **style)


def experiments_without_noise(names: Sequence[str]) -> list[str]:
    """Return the names of the experiments without noise.

    Parameters
    ----------
    names : sequence of str
        Names of experiments.

    Returns
    -------
    list of str
        Selected names.
    """
    return [name for name in names if name.endswith("MPa")]


def experiments_with_noise(names: Sequence[str]) -> list[str]:
    """Return the names of the experiments with noise.

    Parameters
    ----------
    names : sequence of str
        Names of experiments.

    Returns
    -------
    list of str
        Selected names.
    """
    return [name for name in names if name.endswith("noise")]


figure = Figure(
    [
        Panel(
            x=normal_stresses,
            y=interval_cv,
            isel={"experiment": points},
            overlays=overlays,
            title=title,
            x_label="Normal stress (MPa)",
            y_label="CV of the recurrence interval (%)",
            y_limits=(-1.0, 26.0),
            y_scale_group="cv",
        )
        for points, overlays, title in (
            (experiments_without_noise, [], "Without noise"),
            (experiments_with_noise, [plot_published], "Noise of the shear stress"),
        )
    ]
)

study = Study(
    name="laboratory_recurrence",
    title="Recurrence of laboratory earthquakes on a fault whose pores close",
    summary=Study.caption(__doc__),
    base=build_gualandi_scene(NORMAL_STRESSES[0]),
    axes=[
        Axis(
            "experiment",
            {
                experiment_name(stress, noise): experiment_fields(stress, noise)
                for noise in ("none", "white")
                for stress in NORMAL_STRESSES
            },
        )
    ],
    measure=PeakStatistics(cycles=400, discarded_cycles=150, slip_rate_ratio=2.0),
    accuracy=Accuracy(rtol=1e-6, budget=100_000_000, engine="compiled"),
    claims=[
        interval_cv_claim(17.003, 0.102, 0.003),
        interval_cv_claim(20.002, 0.203, 0.006),
        *(equal_intervals_claim(stress) for stress in NORMAL_STRESSES if stress not in ALTERNATING),
        Claim(
            id="L3",
            statement="15.001 MPa with noise: CV of the stochastic model",
            source="Gualandi et al. (2023), stochastic model, read from a figure",
            variable="recurrence_interval_cv",
            where={"experiment": experiment_name(15.001, "white")},
            published=0.084,
            tolerance=0.01,
            reason="reading error of 0.3 %, and sampling error of 0.3 % of both values",
            expected="differs",
            difference_reason=(
                "in the paper, noise also acts on the state variable and on normal stress"
            ),
        ),
    ],
    plot=figure,
    references=REFERENCES,
)
