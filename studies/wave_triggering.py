"""Clock advance of stick-slip events due to a train of waves.

A train of two waves changes the normal stress of a slider during its stick-slip cycle. The first
half of each wave decreases normal stress. Small waves advance or delay the next event in proportion
to their amplitude, as predicted by linear perturbation theory. Under the slowness law, waves have
no effect if they end several nucleation times before the event. The nucleation time is a sigma/(k
V_0). Slow waves and strong waves trigger the event when Coulomb stress reaches the threshold at
which an event occurs without waves. For slow waves with a period of a hundred nucleation times, the
clock advance that this threshold predicts is accurate to a few percent. Strong waves raise Coulomb
stress faster than the load point does. For strong waves, the error of the predicted clock advance
is at most one nucleation time. In all other cases, the prediction is wrong by a factor of two to
ten.
"""

from collections.abc import Callable
from typing import Any

import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.study.figure_declarations import build_horizontal_line_overlay

from ._clock_advance import LINEARISED_LAWS, ClockAdvance

# ---- the study -----------------------------------------------------------------------------------

base = Scene(
    normal_stress="imposed",
    alpha=0.0,
    b_over_a=2.0,
    stiffness_ratio=0.5,
    inertia=True,
    oscillation_amplitude=0.01,
    oscillation_phase=180.0,
    oscillation_cycles=2.0,
)
#: Nucleation time a sigma/(k V_0), in which loading increases ln V by 1.
NUCLEATION_TIME = base.a / base.stiffness
FAST_WAVES, WAVES, SLOW_WAVES = PERIODS = [
    factor * NUCLEATION_TIME for factor in (2.0, 10.0, 100.0)
]
SMALL, LARGE, LARGEST = AMPLITUDES = [1e-4, 1e-2, 5e-2]
PHASES = [0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95]
#: Change of ln V per unit amplitude of a wave. This value is the ratio of the second-order term to
#: the first-order term of perturbation theory.
SECOND_ORDER_RATIO = base.mu_star / base.a


def claim_place(law: str, period: float, amplitude: float, phase: float) -> dict[str, Any]:
    """Return the coordinates of a claim.

    Parameters
    ----------
    law : str
        State evolution law.
    period : float
        Period of the waves in D_c/V_*.
    amplitude : float
        Amplitude of the waves in sigma_*.
    phase : float
        Beginning of the train as a fraction of the recurrence interval.

    Returns
    -------
    dict
        Coordinates of the lattice cell.
    """
    return {
        "law": law,
        "oscillation_period": period,
        "oscillation_amplitude": amplitude,
        "cycle_phase": phase,
    }


def place_description(law: str, period: float, phase: float) -> str:
    """Return a description of the coordinates of a claim.

    Parameters
    ----------
    law : str
        State evolution law.
    period : float
        Period of the waves in D_c/V_*.
    phase : float
        Beginning of the train as a fraction of the recurrence interval.

    Returns
    -------
    str
        Text for the statement of the claim.
    """
    return (
        f"{law} law, period {period / NUCLEATION_TIME:g} a sigma/(k V_0), train at "
        f"{phase:g} of a cycle"
    )


def linear_limit_claim(law: str, period: float, phase: float) -> Claim:
    """Return the claim that small waves follow linear theory (W1).

    Parameters
    ----------
    law : str
        State evolution law.
    period : float
        Period of the waves in D_c/V_*.
    phase : float
        Beginning of the train as a fraction of the recurrence interval.

    Returns
    -------
    Claim
        Claim about the ratio of the clock advance to the prediction of linear theory.
    """
    within = 2.0 * SMALL * SECOND_ORDER_RATIO
    return Claim(
        id="W1",
        statement=f"{place_description(law, period, phase)}: clock advance of small waves divided "
        "by that of the linearised equations",
        source="first-order deviations from the cycle without waves",
        variable="linear_ratio",
        where=claim_place(law, period, SMALL, phase),
        published=1.0,
        tolerance=within,
        reason="the second order is 2 A mu_*/a, because the first-order effects of several waves "
        "cancel in part",
    )


def coulomb_limit_claim(law: str, phase: float) -> Claim:
    """Return the claim that slow waves trigger events at a Coulomb stress threshold (W2).

    Parameters
    ----------
    law : str
        State evolution law.
    phase : float
        Beginning of the train as a fraction of the recurrence interval.

    Returns
    -------
    Claim
        Claim about the ratio of the clock advance to the prediction of the Coulomb threshold.
    """
    return Claim(
        id="W2",
        statement=(
            f"{place_description(law, SLOW_WAVES, phase)}: the event begins when Coulomb stress "
            "reaches its value at the onset of an event without waves"
        ),
        source="K V_0 (t - t_1) = mu dsigma/sigma_*",
        variable="coulomb_ratio",
        where=claim_place(law, SLOW_WAVES, LARGE, phase),
        published=1.0,
        tolerance=0.05,
        reason="healing by b ln t is 0.04 of the loading (b relative to K V_0 times the interval); "
        "half a wave after the beginning of the train, normal stress changes by 0.2 % within the "
        "nucleation time",
    )


def strong_waves_claim(law: str) -> Claim:
    """Return the claim that strong waves trigger events at a Coulomb stress threshold (W3).

    Strong waves increase Coulomb stress faster than the load point does.

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the ratio of the clock advance to the prediction of the Coulomb threshold.
    """
    return Claim(
        id="W3",
        statement=(
            f"{place_description(law, WAVES, 0.9)}, A = {LARGEST:g}: the event is triggered when "
            "Coulomb stress reaches its threshold, to within the nucleation time"
        ),
        source="K V_0 (t - t_1) = mu dsigma/sigma_*",
        variable="coulomb_ratio",
        where=claim_place(law, WAVES, LARGEST, 0.9),
        published=1.0,
        tolerance=NUCLEATION_TIME / 5.0,
        reason="ratio of the nucleation time a sigma/(k V_0) to a clock advance of 5 D_c/V_*",
    )


def early_train_claim(amplitude: float) -> Claim:
    """Return the claim that early trains have no effect (W4).

    Parameters
    ----------
    amplitude : float
        Amplitude of the waves in sigma_*.

    Returns
    -------
    Claim
        Claim about the clock advance under the slowness law.
    """
    return Claim(
        id="W4",
        statement=(
            f"{place_description('slowness', FAST_WAVES, 0.5)}, A = {amplitude:g}: waves have no "
            "effect"
        ),
        source=(
            "under the slowness law, the effect of stress decreases as exp(-t/t_a) with the time "
            "t before the event, t_a = a sigma/(k V_0): 1e-9 remains after 42 D_c/V_*"
        ),
        variable="clock_advance",
        where=claim_place("slowness", FAST_WAVES, amplitude, 0.5),
        published=0.0,
        tolerance=5e-7,
        reason="several times the error estimate, which is 5e-9 of the recurrence interval",
    )


def coulomb_error_claim(law: str) -> Claim:
    """Return the claim that a Coulomb stress threshold does not hold for fast waves (W5).

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the ratio of the clock advance to the prediction of the Coulomb threshold.
    """
    return Claim.above(
        id="W5",
        statement=(
            f"{place_description(law, WAVES, 0.8)}, A = {LARGE:g}: the delay is larger than the "
            "threshold predicts"
        ),
        source="an inequality: nucleation averages over a sigma/(k V_0)",
        variable="coulomb_ratio",
        where=claim_place(law, WAVES, LARGE, 0.8),
        published=1.5,
        reason="an inequality; our results are 1.9 and 11",
    )


def over_amplitude(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function that divides a clock advance by the amplitude of the waves.

    Parameters
    ----------
    name : str
        Name of the variable.

    Returns
    -------
    callable
        Function of the results along one curve.
    """
    return lambda row: row[name] / row["oscillation_amplitude"]


def theory_line(row: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the clock advance that the applicable theory predicts.

    The theory is the Coulomb threshold for the slowest waves, and linear perturbation theory for
    all other waves.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of xarray.DataArray
        Beginnings of the train, and clock advance divided by amplitude.
    """
    slow = float(row["oscillation_period"]) == SLOW_WAVES
    name = "coulomb_clock_advance" if slow else "linear_clock_advance"
    return row["cycle_phase"], over_amplitude(name)(row)


figure = Figure(
    [
        Panel(
            x="cycle_phase",
            y=over_amplitude("clock_advance"),
            hue=["oscillation_amplitude"],
            facet=["law", "oscillation_period"],
            fit_line=theory_line,
            markers_only=True,
            overlays=[build_horizontal_line_overlay(0.0, color="0.82")],
            x_label="Beginning of the train, in intervals",
            y_label=r"Clock advance divided by amplitude ($D_c/V_*$)",
            legend_title="Lines: linearised equations, and a Coulomb stress threshold for the "
            "slowest waves",
        )
    ],
    columns=3,
    height=45.0,
)

study = Study(
    name="wave_triggering",
    title="Clock advance of stick-slip by a train of two waves of normal stress, k = 0.5 k_cr",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", LINEARISED_LAWS),
        Axis("oscillation_period", PERIODS),
        Axis("oscillation_amplitude", AMPLITUDES),
        Axis("cycle_phase", PHASES),
    ],
    measure=ClockAdvance(),
    accuracy=Accuracy(rtol=1e-8),
    claims=[
        *(
            linear_limit_claim(law, period, phase)
            for law in LINEARISED_LAWS
            for period in (WAVES, SLOW_WAVES)
            for phase in (0.5, 0.8, 0.9)
        ),
        *(linear_limit_claim(law, FAST_WAVES, 0.9) for law in LINEARISED_LAWS),
        *(coulomb_limit_claim(law, 0.5) for law in LINEARISED_LAWS),
        *map(strong_waves_claim, LINEARISED_LAWS),
        *map(early_train_claim, AMPLITUDES),
        *map(coulomb_error_claim, LINEARISED_LAWS),
    ],
    plot=figure,
    references=[
        "Dieterich (1994), J. Geophys. Res. 99, 2601-2618",
        "Gomberg, Blanpied and Beeler (1997), Bull. Seismol. Soc. Am. 87, 294-309",
    ],
)
