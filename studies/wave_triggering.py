"""Wave triggering: by how much a train of waves advances the clock of the next event.

A slider in its stick-slip cycle is met by two waves of normal stress, which falls first. Small ones
advance or delay the next event in proportion to their amplitude, as the equations linear in
departures from the free cycle say; with the slowness law what comes longer than a few a sigma/(k
V_0) before the event is forgotten. Waves a hundred times slower than that trigger where Coulomb
stress reaches the threshold of free events, to a few per cent, and so do strong ones, which raise
it faster than the load point does, to within a sigma/(k V_0). In between the threshold misleads by
a factor of two to ten.
"""

from collections.abc import Callable
from typing import Any

import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.study.figure_declarations import horizontal_line

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
#: Time in which loading raises ln V by 1, a sigma/(k V_0): that of nucleation.
NUCLEATION_TIME = base.a / base.stiffness
FAST_WAVES, WAVES, SLOW_WAVES = PERIODS = [
    factor * NUCLEATION_TIME for factor in (2.0, 10.0, 100.0)
]
SMALL, LARGE, LARGEST = AMPLITUDES = [1e-4, 1e-2, 5e-2]
PHASES = [0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95]
#: Change of ln V by the amplitude of a wave: the second order over the first.
SECOND_ORDER_RATIO = base.mu_star / base.a


def claim_place(law: str, period: float, amplitude: float, phase: float) -> dict[str, Any]:
    """Where a claim looks."""
    return {
        "law": law,
        "oscillation_period": period,
        "oscillation_amplitude": amplitude,
        "cycle_phase": phase,
    }


def place_description(law: str, period: float, phase: float) -> str:
    """The same in words."""
    return (
        f"{law} law, period {period / NUCLEATION_TIME:g} a sigma/(k V_0), train at "
        f"{phase:g} of a cycle"
    )


def linear_limit_claim(law: str, period: float, phase: float) -> Claim:
    """W1: the limit of small amplitude."""
    within = 2.0 * SMALL * SECOND_ORDER_RATIO
    return Claim(
        id="W1",
        statement=f"{place_description(law, period, phase)}: clock advance of small waves "
        "over that of linear equations",
        source="departures from the free cycle to first order in the amplitude",
        variable="linear_ratio",
        where=claim_place(law, period, SMALL, phase),
        published=1.0,
        tolerance=within,
        reason="the second order: twice A mu_*/a, for the first order of several waves cancels in "
        "part",
    )


def coulomb_limit_claim(law: str, phase: float) -> Claim:
    """W2: Coulomb's limit of slow waves."""
    return Claim(
        id="W2",
        statement=f"{place_description(law, SLOW_WAVES, phase)}: the event comes where "
        "Coulomb stress reaches what it is at the onset of a free one",
        source="K V_0 (t - t_1) = mu dsigma/sigma_*",
        variable="coulomb_ratio",
        where=claim_place(law, SLOW_WAVES, LARGE, phase),
        published=1.0,
        tolerance=0.05,
        reason="contact goes on healing by b ln t, 0.04 of the loading (b over K V_0 times the "
        "interval); half a wave after it began normal stress changes by 0.002 of itself within the "
        "time of nucleation",
    )


def strong_waves_claim(law: str) -> Claim:
    """W3: strong waves, which raise Coulomb stress faster than the load point does."""
    return Claim(
        id="W3",
        statement=f"{place_description(law, WAVES, 0.9)}, A = {LARGEST:g}: triggered where "
        "Coulomb stress reaches its threshold, to within the time of nucleation",
        source="K V_0 (t - t_1) = mu dsigma/sigma_*",
        variable="coulomb_ratio",
        where=claim_place(law, WAVES, LARGEST, 0.9),
        published=1.0,
        tolerance=NUCLEATION_TIME / 5.0,
        reason="a sigma/(k V_0) over a clock advance of 5 D_c/V_*",
    )


def early_train_claim(amplitude: float) -> Claim:
    """W4: trains that are over long before the event."""
    return Claim(
        id="W4",
        statement=f"{place_description('slowness', FAST_WAVES, 0.5)}, A = {amplitude:g}: forgotten",
        source="with the slowness law stress at a time t before the event counts by exp(-t/t_a), "
        "t_a = a sigma/(k V_0): 42 D_c/V_* leave 1e-9",
        variable="clock_advance",
        where=claim_place("slowness", FAST_WAVES, amplitude, 0.5),
        published=0.0,
        tolerance=5e-7,
        reason="its error estimate, and as much again several times: 5e-9 of the interval",
    )


def coulomb_error_claim(law: str) -> Claim:
    """W5: what Coulomb's threshold misses of waves that are not slow."""
    return Claim.above(
        id="W5",
        statement=f"{place_description(law, WAVES, 0.8)}, A = {LARGE:g}: delayed by more "
        "than a threshold says",
        source="an inequality: nucleation averages over a sigma/(k V_0)",
        variable="coulomb_ratio",
        where=claim_place(law, WAVES, LARGE, 0.8),
        published=1.5,
        reason="an inequality; ours are 1.9 and 11",
    )


def over_amplitude(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """A clock advance over the amplitude."""
    return lambda row: row[name] / row["oscillation_amplitude"]


def theory_line(row: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Clock advance by Coulomb's threshold of slow waves, and by linear equations of others."""
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
            overlays=[horizontal_line(0.0, color="0.82")],
            x_label="Beginning of the train, in intervals",
            y_label=r"Clock advance over amplitude ($D_c/V_*$)",
            legend_title="Lines: linear equations; of the slowest waves, a threshold of Coulomb "
            "stress",
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
