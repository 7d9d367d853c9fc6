"""Bounded slip rates after velocity steps under the slowness law (Figs. 8 and 12).

Under the slowness law and with k >= k_cr, the slip rate remains bounded after every velocity step,
even without inertia. At constant normal stress and k = k_cr, the oscillations continue without
decay. Nevertheless, the peak slip rates can be very high. After large steps, inertia limits the
slip rate, and the motion with inertia departs from the quasi-static motion. At variable normal
stress and k = k_cr, the motion with inertia and the quasi-static motion merge again after the
largest steps. In all other cases, a difference in stress between the two motions remains.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import Quantity, StepResponse
from rsfstudy.reductions import Difference, Reduction
from rsfstudy.study import is_failed_or_pending
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._paper import PAPER, REFERENCE
from ._phase_plane import hatch_reversed_stress, plot_steady_line

RANJITH_RICE = "Ranjith and Rice (1999), J. Mech. Phys. Solids 47, 1207-1218"


#: Number of slip rates at which two paths are compared. The slip rates are evenly spaced in ln V.
_COMPARED_SLIP_RATES = 4000
#: Fraction of a branch that is excluded at each end of the branch. The path turns at these ends,
#: and the stress at a given slip rate is not meaningful there.
_EXCLUDED_END_SHARE = 0.02


@dataclass(frozen=True)
class PathSeparation(Reduction):
    """Slip rates at which two paths separate and merge.

    One of the paths includes an additional effect, such as inertia. The paths separate while the
    slip rate rises to its first peak, and merge while the slip rate decreases after this peak.

    Parameters
    ----------
    name : str
        Prefix of the results. ``<name>_parting`` and ``<name>_merging`` are decimal logarithms of
        V/V_*. The slip rates are NaN if the paths never separate, or if the paths do not merge
        before the first minimum of slip rate. ``<name>_offset`` is the median difference of stress
        after the peak.
    of : str
        Variable that contains the stress along the path.
    along : str, default: "inertia"
        Dimension that distinguishes the two paths. The dimension must have a length of 2.
    tolerance : float, default: 0.001
        Largest stress difference for which two paths are considered equal. The stress difference is
        relative to the range of stress along the second path.
    """

    along: str = "inertia"
    tolerance: float = 1e-3
    kind: ClassVar[str] = "parting"
    long_names: ClassVar[Mapping[str, str]] = {
        "_parting": "log10(V/V_star) at which the paths with and without inertia separate",
        "_merging": "log10(V/V_star) at which the paths with and without inertia merge",
    }

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities of the results."""
        words = "stress after the rupture with inertia minus stress without inertia"
        offset = Quantity(f"{self.name}_offset", "", "1", words, "sigma_*")
        return [*super().quantities, offset]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare the two paths along ``along``.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Slip rates and difference of stress. The dataset is empty unless the dimension has a
            length of 2.
        """
        if dataset.sizes.get(self.along, 0) != 2:
            return xr.Dataset()
        dataset = dataset.sortby(self.along)  # The path without the effect comes first.
        bad = is_failed_or_pending(dataset["status"]).any(self.along)
        core = [self.along, "phase"]
        parting, merging, offset = xr.apply_ufunc(
            self._compare,
            dataset["log10_slip_rate"].where(~bad),
            dataset[self.of].where(~bad),
            input_core_dims=[core, core],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        note = f"{self.of} of the two paths differs by {self.tolerance:g} of its range"
        return xr.Dataset(
            {
                f"{self.name}_parting": parting.assign_attrs(comment=f"log10(V/V_*) where {note}"),
                f"{self.name}_merging": merging.assign_attrs(
                    comment="log10(V/V_*) below which the difference is smaller than this"
                ),
                f"{self.name}_offset": offset.assign_attrs(
                    comment=f"median difference of {self.of}"
                ),
            }
        )

    def _compare(self, rates: np.ndarray, stresses: np.ndarray) -> tuple[float, float, float]:
        """Return the slip rates at which paths separate and merge, and the median stress offset."""
        if not (np.isfinite(rates).all() and np.isfinite(stresses).all()):
            return np.nan, np.nan, np.nan
        one, other = (_branches(rate, stress) for rate, stress in zip(rates, stresses, strict=True))
        apart = self.tolerance * np.ptp(stresses[1])
        upward, difference = _stress_difference(one[0], other[0])
        parted = np.abs(difference) > apart
        downward, difference = _stress_difference(one[1], other[1])
        still = np.abs(difference) > apart
        offset = float(np.median(difference))
        if not parted.any():
            return np.nan, np.nan, offset
        merged = downward[still][0] if still.any() else downward[-1]
        return float(upward[parted][0]), np.nan if still[0] else float(merged), offset


def _stress_difference(
    one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the stress difference between two branches at the same slip rates.

    Parameters
    ----------
    one : tuple[np.ndarray, np.ndarray]
        Slip rates and stresses of the first branch.
    other : tuple[np.ndarray, np.ndarray]
        Slip rates and stresses of the second branch.

    Returns
    -------
    tuple of ndarray
        Slip rates that the branches share, in ascending order, and the stress of the second branch
        minus the stress of the first branch.
    """
    low, high = max(one[0][0], other[0][0]), min(one[0][-1], other[0][-1])
    at = np.linspace(
        low + _EXCLUDED_END_SHARE * (high - low),
        high - _EXCLUDED_END_SHARE * (high - low),
        _COMPARED_SLIP_RATES,
    )
    return at, CubicSpline(*other)(at) - CubicSpline(*one)(at)


def _branches(
    rate: np.ndarray, stress: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Split a path at its first peak of slip rate.

    Parameters
    ----------
    rate : ndarray
        Slip rates along the path.
    stress : ndarray
        Stresses along the path.

    Returns
    -------
    tuple
        Slip rates and stresses of both branches, in ascending order of the slip rates.
    """
    moves = np.append(True, np.diff(rate) != 0.0)
    rate, stress = rate[moves], stress[moves]
    rising = np.diff(rate) > 0.0
    start = int(np.argmax(rising))
    top = start + int(np.argmin(np.append(rising[start:], False)))
    bottom = top + int(np.argmax(np.append(rising[top:], True)))
    up, down = slice(start, top + 1), slice(bottom, top - 1 if top else None, -1)
    return (rate[up], stress[up]), (rate[down], stress[down])


orbit_panel = Panel(
    x="log10_slip_rate",
    y="frictional_stress",
    isel={"normal_stress": max, "stiffness_ratio": min},
    style={"marker": "", "linewidth": 0.9},
    overlays=[plot_steady_line, hatch_reversed_stress],
    legend_columns=3,
)


def plot_separation(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw lines at the slip rates at which the paths separate and merge.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    for name in ("paths_parting", "paths_merging"):
        rates = np.atleast_1d(dataset.get(name, math.nan))
        for rate in rates[np.isfinite(rates)]:
            text = "paths separate and merge"
            axes.axvline(rate, color="0.5", linewidth=0.8, linestyle="-.", label=text)


peaks_panel = Panel(hue=["normal_stress", "stiffness_ratio"])

figure = Figure(
    [
        # Fig. 8 of the paper.
        replace(
            orbit_panel,
            hue=["load_velocity_ratio"],
            isel={
                "inertia": min,
                **orbit_panel.isel,
                "load_velocity_ratio": lambda v: [max(v), min(v)],
            },
        ),
        # Fig. 12 of the paper.
        replace(
            orbit_panel,
            hue=["inertia"],
            isel={"load_velocity_ratio": max, **orbit_panel.isel},
            overlays=[plot_separation, *orbit_panel.overlays],
            condition=lambda dataset: dataset.sizes["inertia"] > 1,
        ),
        replace(
            peaks_panel,
            x="load_velocity_ratio",
            y="max_log10_slip_rate",
            facet=["inertia"],
            log="x",
        ),
        replace(
            peaks_panel,
            x="peak",
            y="peak_log10_slip_rate",
            isel={"inertia": min, "load_velocity_ratio": min},
            x_label="Number of the peak",
        ),
    ]
)


def decaying_peaks_claim(
    normal_stress: str, stiffness_ratio: float, rate: float, source: str
) -> Claim:
    """Return the claim that the peaks of quasi-static motions decay (C11).

    Parameters
    ----------
    normal_stress : str
        Normal stress condition.
    stiffness_ratio : float
        Stiffness relative to the critical stiffness.
    rate : float
        Load point velocity relative to V_*.
    source : str
        Source of the claim.

    Returns
    -------
    Claim
        Claim about the ratio of the second peak to the first peak.
    """
    return Claim.below(
        id="C11",
        statement=(
            f"quasi-static, {normal_stress}, {stiffness_ratio:g} k_cr, {rate:g} V_*: peaks decay"
        ),
        source=source,
        variable="peak_ratio",
        where={
            "normal_stress": normal_stress,
            "stiffness_ratio": stiffness_ratio,
            "load_velocity_ratio": rate,
            "inertia": False,
        },
        published=1.0,
    )


def repeating_peaks_claim(rate: float) -> Claim:
    """Return the claim that oscillations at k = k_cr repeat (C11).

    Ranjith and Rice (1999) proved that quasi-static oscillations repeat under the slowness law if
    normal stress is constant.

    Parameters
    ----------
    rate : float
        Load point velocity relative to V_*.

    Returns
    -------
    Claim
        Claim about the ratio of the second peak to the first peak.
    """
    return Claim(
        id="C11",
        statement=f"quasi-static, constant, k = k_cr, {rate:g} V_*: oscillations repeat",
        source=RANJITH_RICE,
        variable="peak_ratio",
        where={
            "normal_stress": "constant",
            "stiffness_ratio": 1.0,
            "load_velocity_ratio": rate,
            "inertia": False,
        },
        published=1.0,
        tolerance=1e-7,
        reason="exact result; the tolerance is the requested accuracy",
    )


LARGEST_STEP = {"normal_stress": "variable", "stiffness_ratio": 1.0, "load_velocity_ratio": 200.0}


study = Study(
    name="bounded_slip",
    title="Motions after steps of load point velocity, slowness law, k >= k_cr(V_*), b/a = 2",
    summary=Study.caption(__doc__),
    base=Scene(law="slowness", b_over_a=2.0, alpha=0.56),
    axes=[
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", [1.0, 1.1, 1.25]),
        Axis("load_velocity_ratio", [2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0]),
        Axis("inertia", [False, True]),
    ],
    measure=StepResponse(),
    reductions=[
        Difference(name="peak_lowering", of="max_log10_slip_rate", along="inertia", reference=0),
        PathSeparation(name="paths", of="frictional_stress", along="inertia", tolerance=2e-3),
    ],
    claims=[
        decaying_peaks_claim("variable", 1.0, 2.0, f"{PAPER}, Fig. 8"),
        decaying_peaks_claim("variable", 1.0, 200.0, f"{PAPER}, Fig. 8"),
        decaying_peaks_claim("constant", 1.1, 2.0, RANJITH_RICE),
        decaying_peaks_claim("constant", 1.1, 200.0, RANJITH_RICE),
        repeating_peaks_claim(2.0),
        repeating_peaks_claim(200.0),
        Claim(
            id="C18",
            statement="V_0 = 200 V_*: inertia lowers the peak slip rate by an order of magnitude",
            source=f"{PAPER}, section 4, Fig. 12",
            variable="peak_lowering",
            where={**LARGEST_STEP, "inertia": True},
            published=-1.0,
            tolerance=0.5,
            reason="'by one order of magnitude'",
            expected="differs",
            difference_reason=(
                "the peaks are 10^13.335 and 10^8.952 V_*. Without inertia, any stress above "
                "the strength at the current state increases the slip rate, by a factor of e "
                "for each a sigma. With inertia, this stress accelerates the slider. The "
                "difference is one order of magnitude for V_0 = 19 V_*, or for V_0 = 200 V_* "
                "and a stiffness of 1.12 k_cr"
            ),
        ),
        Claim(
            id="C18",
            statement="V_0 = 200 V_*: the paths merge again, and the next peaks are the same",
            source=f"{PAPER}, section 4, Fig. 12",
            variable="peak_log10_slip_rate",
            where={**LARGEST_STEP, "peak": 2, "inertia": True},
            baseline={**LARGEST_STEP, "peak": 2, "inertia": False},
            published=0.0,
            tolerance=5e-5,
            reason="5 % of the difference in stress, as for other masses; paths are considered "
            "merged if they differ by less than 2e-3 of the range of stress, 0.6 sigma_*",
        ),
        Claim.above(
            id="C18",
            statement="V_0 = 200 V_*: the paths merge on the segment of constant stress",
            source=f"{PAPER}, section 4, Fig. 12",
            variable="paths_merging",
            where=LARGEST_STEP,
            published=0.0,
            reason="an inequality: the segment extends to 10^-6 V_*; the result is NaN if the "
            "paths do not merge",
        ),
        Claim.above(
            id="C18",
            statement="V_0 = 200 V_*: with inertia, the peak slip rate exceeds the norm of 5e-4",
            source=f"{PAPER}, section 4",
            variable="max_log10_slip_rate",
            where={**LARGEST_STEP, "inertia": True},
            published=4.73,
            reason="an inequality: the norm V T/(2 pi D_c) = 5e-4 is at 10^4.73 V_*",
        ),
    ],
    plot=figure,
    references=[REFERENCE, RANJITH_RICE],
)
