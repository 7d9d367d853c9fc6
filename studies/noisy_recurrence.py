"""Coefficient of variation of recurrence intervals against noise amplitude.

White noise in the shear stress causes scatter of the recurrence intervals, which would otherwise be
equal. For weak noise, the coefficient of variation (CV) follows from the phase response of the
limit cycle, which is a property of the motion without noise. For amplitudes up to 3e-4 sigma_* per
sqrt(D_c/V_*), the CV of simulated intervals differs from this theory by at most 1.5 % plus the
sampling error. At an amplitude of 1e-3, the CV is larger than predicted, because the distribution
of the intervals has a long tail. If noise affected only the reloading between events, the CV would
be 14 % lower.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.reductions import Mean, Reduction
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._phase_response import NoisyRecurrence

#: Amplitudes of the noise. The theory is linear in the amplitude, and valid for all but the last.
AMPLITUDES = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
#: Largest amplitude for which the claims compare the theory with the simulation.
LARGEST_WEAK_AMPLITUDE = 3e-4
#: Relative deviation of the CV of single intervals from the long-run CV. Successive intervals are
#: weakly correlated.
LONG_RUN_DEVIATION = 0.015
#: Number of seeds, and number of recurrence intervals per seed.
SEEDS, CYCLES = 4, 5000
INDEPENDENT = "independent integration of the equations, with stochastic Runge-Kutta steps (SRA1)"
#: Result of the adjoint equations and of the limit cycle in an independent program.
STRESS_SENSITIVITY, JOINT_SENSITIVITY = 220.448392, 187.549556
LIMIT_CYCLE_INTERVAL = 27.9378083295


@dataclass(frozen=True)
class TheoryDeviation(Reduction):
    """Deviation of the mean CV from the theory, divided by the permitted value.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Name of the CV in the cells.
    """

    kind: ClassVar[str] = "theory_deviation"
    long_names: ClassVar[Mapping[str, str]] = {
        "": "deviation of the CV from the phase response, over 1.5 % and three standard errors"
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the deviation for each amplitude.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Absolute deviation divided by the permitted deviation, for each amplitude.
        """
        theory = dataset["interval_cv_theory"].mean("sample")
        stderr = np.sqrt(
            (dataset[f"{self.of}_stderr"] ** 2).mean("sample") / dataset.sizes["sample"]
        )
        permitted = LONG_RUN_DEVIATION * theory + 3.0 * stderr
        deviation = abs(dataset[self.of].mean("sample") - theory) / permitted
        error = dataset[f"{self.of}_error"].mean("sample") / permitted
        return xr.Dataset({self.name: deviation, f"{self.name}_error": error})


def cv_claim(amplitude: float) -> Claim:
    """Return the claim that the CV agrees with the theory for weak noise.

    Parameters
    ----------
    amplitude : float
        Amplitude of the noise.

    Returns
    -------
    Claim
        Claim about the mean CV of all seeds.
    """
    return Claim.below(
        id="N1",
        statement=(
            f"amplitude {amplitude:g}: the CV agrees with the phase response to within 1.5 % and "
            "three standard errors"
        ),
        source=INDEPENDENT,
        variable="theory_deviation",
        where={"stress_noise": amplitude},
        published=1.0,
    )


def theory_claim(variable: str, value: float, statement: str) -> Claim:
    """Return the claim that a result of the phase response has its known value.

    Parameters
    ----------
    variable : str
        Name of the variable.
    value : float
        Known value.
    statement : str
        Statement of the claim.

    Returns
    -------
    Claim
        Claim about the variable.
    """
    return Claim(
        id="N2",
        statement=statement,
        source="adjoint equations in an independent program",
        variable=variable,
        where={"stress_noise": 1e-4, "sample": 0},
        published=value,
        tolerance=1e-8 * value,
        reason="the printed digits of the value",
    )


def plot_theory(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the CV that the theory for weak noise predicts.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    amplitudes = dataset["stress_noise"].values
    slope = float(dataset["stress_noise_sensitivity"].max())
    ends = np.array([amplitudes.min(), amplitudes.max()])
    axes.plot(ends, slope * ends, color="0.4", linestyle="--", label="phase response")


def plot_unity(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line at the ratio 1.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    axes.axhline(1.0, color="0.4", linestyle="--")


def ratio_to_theory(row: xr.Dataset) -> xr.DataArray:
    """Return the mean CV divided by the CV that the theory predicts.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Ratio.
    """
    return row["interval_cv"] / row["interval_cv_theory"].mean("sample")


figure = Figure(
    [
        Panel(
            x="stress_noise",
            y="interval_cv",
            error_bars="interval_cv_stderr",
            markers_only=True,
            overlays=[plot_theory],
            log="xy",
            y_label="CV of the recurrence interval",
            title="Scatter by noise",
        ),
        Panel(
            x="stress_noise",
            y=ratio_to_theory,
            overlays=[plot_unity],
            log="x",
            y_label="CV over CV of the phase response",
            title="Limit of the theory",
        ),
    ]
)

study = Study(
    name="noisy_recurrence",
    title="Scatter of recurrence intervals by noise of the shear stress",
    summary=Study.caption(__doc__),
    base=Scene(
        law="slip",
        normal_stress="constant",
        a=0.01,
        b_over_a=1.2,
        stiffness=0.001,
        radiation_damping=1e-4,
        loading_noise="white",
        noise_interval=0.25,
    ),
    axes=[
        Axis("stress_noise", AMPLITUDES),
        Axis("sample", {"noise_seed": list(range(SEEDS))}),
    ],
    measure=NoisyRecurrence(cycles=CYCLES),
    accuracy=Accuracy(rtol=1e-6, budget=100_000_000, engine="compiled"),
    reductions=[
        Mean(name="interval_cv", of="recurrence_interval_cv"),
        Mean(name="mean_interval", of="recurrence_interval_mean"),
        TheoryDeviation(name="theory_deviation", of="recurrence_interval_cv"),
        Mean(name="drop_cv", of="static_stress_drop_cv"),
    ],
    claims=[
        *(cv_claim(amplitude) for amplitude in AMPLITUDES if amplitude <= LARGEST_WEAK_AMPLITUDE),
        theory_claim("stress_noise_sensitivity", STRESS_SENSITIVITY, "noise of the shear stress"),
        theory_claim(
            "joint_noise_sensitivity",
            JOINT_SENSITIVITY,
            "noise of the shear stress and the state variable",
        ),
        theory_claim("recurrence_interval", LIMIT_CYCLE_INTERVAL, "interval without noise"),
        Claim.above(
            id="N3",
            statement="amplitude 1e-3: the CV exceeds the value of the phase response",
            source=INDEPENDENT,
            variable="interval_cv",
            where={"stress_noise": 1e-3},
            published=0.235,
        ),
    ],
    plot=figure,
    references=[
        "Gualandi et al. (2023), Earth Planet. Sci. Lett. 604, 117995",
        "Wong and Zakai (1965), Ann. Math. Stat. 36, 1560-1564",
    ],
)
