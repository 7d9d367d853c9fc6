"""Coverage of healing rates and stiffnesses that are measured on synthetic records.

An independent implementation integrates the quasi-static slider with the Radau method of SciPy.
With psi = ln(theta V_0/D_c) and w = ln(V/V_0) = (mu - mu_0 - b psi)/a, the equations are

    mu' = k (V_l - V),    psi' = (V/D_c) h(psi + w),

where h(u) = exp(-u) - 1 for the ageing law and h(u) = -u for the slip law. Run the module as a
script to print the coverage for 100 slide-hold-slide records and 60 locked portions:

    python tests/benchmarks/holds_and_stiffness.py [RECORDS PORTIONS]
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import rsfstudy
from rsfstudy.fitting import Record

LAWS = {"ageing": lambda u: math.expm1(min(-u, 300.0)), "slip": lambda u: -u}
#: Correlation time of the noise in sampling intervals: white noise, and correlations of successive
#: rows of 0.5 and 0.9.
NOISES = {"white": 0.0, "correlation 0.5": 1.443, "correlation 0.9": 9.491}
NOISE_SD, MAX_TREND = 3e-4, 1e-5


class Slider(NamedTuple):
    """Parameters of a spring-slider, with lengths in um and times in s."""

    law: str
    a: float
    b: float
    slip_distance: float
    stiffness: float
    velocity: float
    initial_friction: float = 0.6


def random_slider(rng: np.random.Generator, law: str) -> Slider:
    """Draw the parameters of a slider that is stable."""
    a = rng.uniform(0.005, 0.012)
    b, distance = a + rng.uniform(-0.002, 0.004), rng.uniform(5.0, 20.0)
    critical = max(b - a, 0.0) / distance
    stiffness = max(8.0 * critical, 10.0 ** rng.uniform(-3.0, -2.3))
    return Slider(law, a, b, distance, stiffness, 10.0 ** rng.uniform(0.0, 1.5))


def integrate(
    slider: Slider,
    loading: Sequence[tuple[float, float]],
    times: np.ndarray,
    first: tuple[float, float] = (0.6, 0.0),
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Integrate the slider.

    Each segment of the loading is a pair of its duration in s and its load point velocity in um/s.

    Returns
    -------
    displacement, friction : ndarray
        Load point displacement in um and friction at the given times.
    peaks : list of float
        First maximum of friction in each segment, or NaN.
    """
    law, scale = LAWS[slider.law], slider.velocity

    def rates(_time, state, load):
        w = (state[0] - slider.initial_friction - slider.b * state[1]) / slider.a
        speed = scale * math.exp(min(w, 300.0))
        change = speed / slider.slip_distance * law(state[1] + w)
        return [slider.stiffness * (load - speed), change]

    def at_peak(time, state, load):
        return rates(time, state, load)[0]

    at_peak.direction = -1
    state, begins, moved = [*first], 0.0, 0.0
    displacement, friction = np.empty((2, len(times)))
    peaks = []
    for lasts, load in loading:
        # Trial values of the implicit solver may overflow.
        with np.errstate(over="ignore"):
            solved = solve_ivp(
                rates,
                (0.0, lasts),
                state,
                "Radau",
                dense_output=True,
                events=at_peak,
                args=(load,),
                rtol=1e-8,
                atol=1e-10,
            )
        here = times >= begins  # Later segments overwrite their own rows.
        friction[here] = solved.sol(np.minimum(times[here] - begins, lasts))[0]
        displacement[here] = moved + load * (times[here] - begins)
        peaks.append(float(solved.y_events[0][0, 0]) if len(solved.t_events[0]) else math.nan)
        state, begins, moved = solved.y[:, -1], begins + lasts, moved + load * lasts
    return displacement, friction, peaks


def correlated_noise(rng: np.random.Generator, times: np.ndarray, memory: float) -> np.ndarray:
    """Return noise with a correlation that decays exponentially with time."""
    noise = rng.standard_normal(len(times))
    if memory:
        decay = np.exp(-np.diff(times) / memory)
        for row, rho in enumerate(decay.tolist(), start=1):
            noise[row] = rho * noise[row - 1] + math.sqrt(1.0 - rho * rho) * noise[row]
    return noise


def record_of(
    rng: np.random.Generator,
    slider: Slider,
    loading: Sequence[tuple[float, float]],
    noise: str,
    first: tuple[float, float] = (0.6, 0.0),
) -> tuple[Record, list[float]]:
    """Return a noisy record with a trend, and the exact peaks of friction."""
    gap = rng.uniform(0.1, 0.3) / slider.velocity
    begins = np.concatenate([[0.0], np.cumsum([lasts for lasts, _load in loading])])
    pieces = []
    for (start, end), (_lasts, load) in zip(itertools.pairwise(begins), loading, strict=True):
        every = gap if load else max(gap, (end - start) / 400.0)
        pieces.append(np.arange(start, end - 1e-9, every))
    times = np.concatenate(pieces)
    displacement, friction, peaks = integrate(slider, loading, times, first)
    friction = friction + rng.uniform(-MAX_TREND, MAX_TREND) * displacement
    friction += NOISE_SD * correlated_noise(rng, times, NOISES[noise] * gap)
    displacement = displacement + 0.05 * rng.standard_normal(len(times))
    arrays = {"time": times, "displacement": displacement, "friction": friction}
    return rsfstudy.read_record(arrays, name="synthetic"), peaks


def slide_hold_slide(seed: int) -> tuple[Record, np.ndarray, np.ndarray]:
    """Return a slide-hold-slide record, its hold durations and its exact healing."""
    rng = np.random.default_rng(seed)
    law, noise = [*LAWS][seed % 2], [*NOISES][seed // 2 % 3]
    slider = random_slider(rng, law)
    slide = 40.0 * slider.slip_distance / slider.velocity
    durations = 10.0 ** np.sort(rng.uniform(0.7, 3.0, 5)) * 10.0 / slider.velocity
    loading = [(slide, slider.velocity)]
    for duration in durations.tolist():
        loading += [(duration, 0.0), (slide, slider.velocity)]
    record, peaks = record_of(rng, slider, loading, noise)
    return record, durations, np.array(peaks[2::2]) - slider.initial_friction


def loading_portion(seed: int) -> tuple[Record, float]:
    """Return a record with an unload-reload cycle, a hold or an initial loading, and k."""
    rng = np.random.default_rng(1000 + seed)
    law, noise = [*LAWS][seed % 2], [*NOISES][seed // 2 % 3]
    slider = random_slider(rng, law)
    velocity, first = slider.velocity, (slider.initial_friction, 0.0)
    slide = (30.0 * slider.slip_distance / velocity, velocity)
    kind = seed // 6 % 3
    if kind == 0:
        back = rng.uniform(0.06, 0.2) / slider.stiffness / velocity
        loading = [slide, (back, -velocity), (rng.uniform(0.2, 2.0) * back, 0.0)]
        loading.append((back + slide[0], velocity))
    elif kind == 1:
        loading = [slide, (10.0 ** rng.uniform(1.0, 3.0) * 10.0 / velocity, 0.0), slide]
    else:
        rise = rng.uniform(0.2, 0.5)
        first = slider.initial_friction - rise, rng.uniform(0.0, 10.0)
        loading = [(rise / slider.stiffness / velocity + slide[0], velocity)]
    return record_of(rng, slider, loading, noise, first)[0], slider.stiffness


def deviations_of_holds(seed: int) -> tuple[np.ndarray, float, float]:
    """Measure the holds of a record.

    Returns
    -------
    healing : ndarray
        Deviations of healing from the exact values, in standard errors.
    rate : float
        Deviation of the healing rate from the slope of the exact values, in standard errors.
    relative_stderr : float
        Relative standard error of the healing rate.
    """
    record, durations, exact = slide_hold_slide(seed)
    table = record.holds()
    if table.sizes["hold"] != len(durations):
        raise ValueError(f"seed {seed}: {table.sizes['hold']} of {len(durations)} holds are found")
    rate = np.polyfit(np.log10(durations), exact, 1)[0]
    stderr = float(table["healing_rate_stderr"])
    healing = (table["healing"].values - exact) / table["healing_stderr"].values
    return healing, (float(table["healing_rate"]) - rate) / stderr, stderr / rate


def deviation_of_stiffness(seed: int) -> tuple[float, float]:
    """Measure the stiffness of a record.

    Returns
    -------
    deviation : float
        Deviation from the exact stiffness, in standard errors.
    relative_stderr : float
        Relative standard error of the stiffness.
    """
    record, exact = loading_portion(seed)
    table = record.stiffness()
    stderr = float(table["stiffness_stderr"])
    return (float(table["stiffness"]) - exact) / stderr, stderr / exact


def main(records: int = 100, portions: int = 60) -> None:
    """Print the coverage of the intervals of two standard errors."""
    holds = [deviations_of_holds(seed) for seed in range(records)]
    healing, rates = np.concatenate([of[0] for of in holds]), np.array([of[1] for of in holds])
    print(f"healing rate: {np.sum(np.abs(rates) < 2.0)} of {records} within 2 standard errors,")
    print(f"  median relative standard error {np.median([of[2] for of in holds]):.2g}")
    print(f"healing: {np.sum(np.abs(healing) < 2.0)} of {len(healing)} within 2 standard errors")
    found = np.array([deviation_of_stiffness(seed) for seed in range(portions)])
    print(f"stiffness: {np.sum(np.abs(found[:, 0]) < 2.0)} of {portions} within 2 standard errors,")
    print(f"  median relative standard error {np.median(found[:, 1]):.2g}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
