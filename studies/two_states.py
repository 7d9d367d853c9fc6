"""Period doubling and chaos under a law with two states.

A second state variable with a longer slip distance limits the slip rate. A slider on a spring that
is slightly softer than critical therefore oscillates, even without inertia and under the slip law
(Gu et al. 1984; Becker 2000). As the stiffness decreases, the period doubles repeatedly until the
motion is chaotic. At still lower stiffness, the slip rate is unbounded. The first period doubling
occurs when a Floquet multiplier of the period-one cycle passes through -1. Below the stiffness of
the first period doubling, the period-one cycle still exists, but neighbouring motions diverge from
it.
"""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import Status
from rsfstudy.reductions import Boundary, Inverse
from rsfstudy.study import DrawFunction
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_horizontal_line_overlay

from ._bifurcation import Bifurcation

GU_ET_AL = "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196"
BECKER = "Becker (2000), in AGU Geophys. Monogr. 120, 5-26"
LAW_SELECTION = {"law": "two_slip_states"}


def spring_place(ratio: float) -> dict[str, str | float]:
    """Return the coordinates of a spring.

    Parameters
    ----------
    ratio : float
        Stiffness relative to the critical stiffness.

    Returns
    -------
    dict
        Coordinates of the lattice cell.
    """
    return {**LAW_SELECTION, "stiffness_ratio": ratio}


#: Stiffness ratios in ascending order: springs with unbounded slip rates, springs with closely
#: spaced stiffness in the range of period doubling, and stiffer springs.
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


def plot_peaks(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the peak slip rates of the events and of the period-one cycle.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    ratio, peaks = dataset["stiffness_ratio"], dataset["peak_log10_slip_rate"]
    chaotic = dataset["status"] == int(Status.NOT_PERIODIC)
    for number, (where, shape, label) in enumerate(
        ((~chaotic, "o", "repeats itself"), (chaotic, "x", "does not repeat itself"))
    ):
        at, shown = xr.broadcast(ratio, peaks.where(where))
        small = {"markersize": 2.6 - 0.6 * number, "markeredgewidth": 0.5, "label": label}
        axes.plot(
            at.values.ravel(),
            shown.values.ravel(),
            shape,
            color=cycle_style(number)["color"],
            **small,
        )
    dashed = {"color": "0.4", "linewidth": 0.8, "label": "cycle of one event"}
    axes.plot(ratio, dataset["one_event_log10_peak"], "--", **dashed)


def plot_multipliers(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the Floquet multipliers and the Lyapunov exponent.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    imaginary = dataset["floquet_multiplier_imaginary"]
    for number, (values, style, label) in enumerate(
        (
            (
                dataset["floquet_multiplier"],
                {"marker": "o"},
                r"multiplier, $\mathrm{Re}\,\Lambda_1$",
            ),
            (dataset["lyapunov_exponent"], {"marker": "s"}, r"growth per event, $\lambda$"),
            (
                imaginary.where(imaginary > 0.0),
                {"marker": "x", "linestyle": "none"},
                r"$\mathrm{Im}\,\Lambda_1$, where complex",
            ),
        )
    ):
        axes.plot(
            dataset["stiffness_ratio"],
            values,
            label=label,
            **{**cycle_style(number), "linewidth": 0.9, "markersize": 2.5, **style},
        )


def set_abscissa(magnified: bool) -> DrawFunction:
    """Return a function that sets the range of the stiffness axis.

    The function also marks the range of unbounded slip rates and the first period doubling.

    Parameters
    ----------
    magnified : bool
        If True, only the range of period doubling is shown.

    Returns
    -------
    DrawFunction
        Function that draws on axes.
    """

    def mark(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
        """Set the range of the axis and draw the marks."""
        ratio = dataset["stiffness_ratio"].values
        beyond = ratio[dataset["status"].values == int(Status.SLIP_RATE_UNBOUNDED)]
        bounded = ratio[np.isfinite(dataset["peak_spread"].values)]
        low, high = float(ratio.min()), float(ratio.max())
        if magnified and bounded.size:
            low = float(bounded.min()) - 0.001
            high = min(high, low + 0.02)
        if high > low:
            axes.set_xlim(low, high)
        axes.locator_params(axis="x", nbins=5)
        if beyond.size:
            end = float(bounded.min()) if bounded.size else high
            grey = {"color": "0.9", "linewidth": 0.0, "zorder": 0}
            axes.axvspan(low, end, label="slip rate unbounded", **grey)
        doubling = float(dataset.get("doubling_by_multiplier", math.nan))
        if math.isfinite(doubling):
            label = rf"$\Lambda_1 = -1$ at $k = {doubling:.5f}\,k_{{cr}}$"
            axes.axvline(doubling, color="k", linestyle=":", linewidth=0.9, label=label)

    return mark


def has_doublings(dataset: xr.Dataset) -> bool:
    """Return True if enough stiffness values lie in the range of period doubling.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.

    Returns
    -------
    bool
        True if the magnified panel can be drawn.
    """
    ratio = dataset["stiffness_ratio"].where(dataset["peak_spread"].notnull())
    return 2 < int((ratio < ratio.min() + 0.019).sum()) < int(ratio.notnull().sum())


peaks_panel = Panel(
    x="stiffness_ratio",
    y_label=r"Peak slip rate, $\log_{10}(V_{peak}/V_*)$",
    isel={"law": 0},
    title="Peak slip rate of each event",
    overlays=[plot_peaks, set_abscissa(False)],
    condition=lambda dataset: bool(dataset["peak_spread"].notnull().any()),
)
multipliers_panel = replace(
    peaks_panel,
    y_label=r"$\Lambda_1$ of the cycle of one event; $\lambda$",
    title="Multipliers: the cycle is unstable below $-1$",
    overlays=[
        plot_multipliers,
        build_horizontal_line_overlay(-1.0),
        build_horizontal_line_overlay(1.0),
        set_abscissa(False),
    ],
)
figure = Figure(
    [
        peaks_panel,
        replace(
            peaks_panel,
            title="Peaks, magnified",
            overlays=[plot_peaks, set_abscissa(True)],
            condition=has_doublings,
        ),
        multipliers_panel,
        replace(
            multipliers_panel,
            title="Multipliers, magnified",
            overlays=[*multipliers_panel.overlays[:-1], set_abscissa(True)],
            condition=has_doublings,
        ),
    ]
)


study = Study(
    name="two_states",
    title="Two states: slow oscillations double their period, b_1 = a, b_2 = 0.84 a, L_2 = 21 D_c",
    summary=Study.caption(__doc__),
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
            source=f"{GU_ET_AL}, closed form from the cubic of small perturbations",
            variable="critical_stiffness",
            where=spring_place(0.95),
            published=8.02755656e-4,
            tolerance=5e-13,
            reason="rounding of the published value, multiplied by a = 0.01",
        ),
        Claim(
            id="S2",
            statement="the period doubles where a Floquet multiplier passes -1",
            source="Floquet theory",
            variable="doubling_by_multiplier",
            where=LAW_SELECTION,
            baseline=LAW_SELECTION,
            baseline_variable="doubling_by_motion",
            published=0.0,
            tolerance=2e-4,
            reason="half of the difference between the two stiffness values that bracket the "
            "period doubling of the motions",
        ),
        Claim(
            id="S3",
            statement="the period doubles at 0.86626 k_cr",
            source="not published; both computations agree",
            variable="doubling_by_multiplier",
            where=LAW_SELECTION,
            published=0.86626,
            tolerance=1e-5,
            reason="rounding of the expected value; finite differences of the return map and "
            "interpolation have an error of 1e-6",
        ),
        Claim(
            id="S4",
            statement="k = 0.8663 k_cr, next to the period doubling: the multiplier is real and "
            "negative",
            source="Floquet theory",
            variable="floquet_multiplier",
            where=spring_place(0.8663),
            published=-1.0,
            tolerance=4e-3,
            reason="the stiffness is within 1e-4 k_cr of the period doubling, which changes the "
            "multiplier by up to 4e-3",
        ),
        Claim.above(
            id="S5",
            statement="k = 0.8531 k_cr: small perturbations grow on average, so the motion is "
            "chaotic",
            source=f"{BECKER}, who found chaos; no published result is known for this stiffness",
            variable="lyapunov_exponent",
            where=spring_place(0.8531),
            published=0.1,
            reason="an inequality; the bound is much larger than the uncertainty due to 32 events",
        ),
        Claim(
            id="S6",
            statement="k = 0.8567 k_cr: motions repeat themselves after four events",
            source="no published result is known",
            variable="period_events",
            where=spring_place(0.8567),
            published=4.0,
            reason="an integer",
        ),
    ],
    plot=figure,
    references=[GU_ET_AL, BECKER, "Ruina (1983), J. Geophys. Res. 88, 10359-10370"],
)
