"""Test of ``rsfstudy.events`` with synthetic records of known drops.

Usage: ``python tests/benchmarks/record_events.py``. The script generates 30 records of each kind,
with seeds from 0 to 29. For each kind, it prints a row of a table with

- the number of large drops, which have at least three times the smallest detectable size
- the percentage of large drops that are found
- the number of false events
- the percentages of found drops whose true size and time lie within the estimated errors
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

import rsfstudy


class Catalogue(NamedTuple):
    """Synthetic record with start times, durations and sizes of its drops."""

    time: np.ndarray
    stress: np.ndarray
    begins: np.ndarray
    durations: np.ndarray
    sizes: np.ndarray


class Score(NamedTuple):
    """Counts of drops and events.

    Attributes
    ----------
    large : int
        Drops of at least three times the smallest detectable size.
    found : int
        Large drops that are found.
    false : int
        Events without a drop.
    matched : int
        Events with a drop of any size.
    sizes, times : int
        Matched events whose size or time agrees with the true value within the estimated error.
    """

    large: int = 0
    found: int = 0
    false: int = 0
    matched: int = 0
    sizes: int = 0
    times: int = 0

    def add(self, other: Score) -> Score:
        """Add the counts of two scores."""
        return Score(*(one + two for one, two in zip(self, other, strict=True)))


def draw_record(
    rng: np.random.Generator,
    time: np.ndarray,
    *,
    size: tuple[float, float] = (0.3, 0.6),
    lasts: tuple[float, float] = (0.0, 0.0),
    every: float = 10.0,
    noise: float = 0.02,
    correlation: float = 0.0,
) -> Catalogue:
    """Generate a record with steady loading and random drops.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    time : ndarray, shape (samples,)
        Sampling times in s.
    size : (float, float), optional
        Range of drop sizes.
    lasts : (float, float), optional
        Range of drop durations in s.
    every : float, optional
        Mean interval between drops in s.
    noise : float, optional
        Standard deviation of the noise.
    correlation : float, optional
        Correlation of the noise of successive samples.

    Returns
    -------
    Catalogue
        Record with its drops.
    """
    count = int((time[-1] - time[0]) / every) - 1
    jitter = rng.uniform(-0.15, 0.15, count) * every
    begins = time[0] + every * (1.0 + np.arange(count)) + jitter
    durations, sizes = rng.uniform(*lasts, count), rng.uniform(*size, count)
    share = (time[:, None] - begins) / np.maximum(durations, 1e-9)
    fallen = (np.clip(share, 0.0, 1.0) * sizes).sum(axis=1)
    # The loading compensates the drops, and stops during each drop.
    rests = np.clip(time[:, None] - begins, 0.0, durations).sum(axis=1)
    loading = sizes.sum() / (time[-1] - time[0] - durations.sum())
    white = rng.standard_normal(len(time) + 500)
    root = np.sqrt(1.0 - correlation**2)
    correlated = lfilter([root], [1.0, -correlation], white)[500:]
    stress = 5.0 + loading * (time - time[0] - rests) - fallen + noise * correlated
    return Catalogue(time, stress, begins, durations, sizes)


def sudden_drops(rng: np.random.Generator, **options: float) -> Catalogue:
    """Generate sudden drops, sampled at 50 Hz."""
    return draw_record(rng, 0.02 * np.arange(10_000), **options)  # type: ignore[arg-type]


def triggered_bursts(rng: np.random.Generator) -> Catalogue:
    """Generate drops of 10 to 50 ms.

    The record is sampled at 10 Hz, with bursts at 1 kHz around the drops.
    """
    state = rng.bit_generator.state
    slow = 0.1 * np.arange(2_000)
    begins = draw_record(rng, slow, lasts=(0.01, 0.05)).begins
    bursts = [np.arange(begin - 0.05, begin + 0.15, 0.001) for begin in begins]
    time = np.unique(np.concatenate([slow, *bursts]).round(6))
    rng.bit_generator.state = state
    return draw_record(rng, time, lasts=(0.01, 0.05))


def slow_drops(rng: np.random.Generator) -> Catalogue:
    """Generate slow drops that last 2 to 4 s, at intervals of 10 s."""
    return draw_record(rng, 0.02 * np.arange(10_000), lasts=(2.0, 4.0))


def short_drops(rng: np.random.Generator) -> Catalogue:
    """Generate short drops that last 2 to 6 sampling intervals."""
    return draw_record(rng, 0.02 * np.arange(10_000), lasts=(0.04, 0.12))


def cut_record(rng: np.random.Generator) -> Catalogue:
    """Generate a record that ends during a drop."""
    made = draw_record(rng, 0.02 * np.arange(10_000), lasts=(0.2, 1.0))
    stop = made.begins[-1] + rng.uniform(0.4, 0.8) * made.durations[-1]
    rows = made.time <= stop
    sizes = made.sizes.copy()
    sizes[-1] *= (made.time[rows][-1] - made.begins[-1]) / made.durations[-1]
    return made._replace(time=made.time[rows], stress=made.stress[rows], sizes=sizes)


def negative_stress(rng: np.random.Generator) -> Catalogue:
    """Generate sudden drops of a negative shear stress."""
    made = sudden_drops(rng)
    return made._replace(stress=-made.stress)


def small_drops(rng: np.random.Generator) -> Catalogue:
    """Generate sudden drops of 1.5 to 10 standard deviations of noise."""
    return sudden_drops(rng, size=(0.03, 0.2), noise=0.02)  # type: ignore[arg-type]


def correlated_noise(rng: np.random.Generator) -> Catalogue:
    """Generate short drops in correlated noise.

    The correlation between successive samples is 0.5.
    """
    return draw_record(rng, 0.02 * np.arange(10_000), lasts=(0.04, 0.12), correlation=0.5)


def uneven_sampling(rng: np.random.Generator) -> Catalogue:
    """Generate drops of up to 0.3 s with uneven sampling.

    The sampling times vary by 30 % of the sampling interval.
    """
    time = 0.02 * (np.arange(10_000) + rng.uniform(-0.3, 0.3, 10_000))
    return draw_record(rng, time, lasts=(0.0, 0.3))


def coarse_sampling(rng: np.random.Generator) -> Catalogue:
    """Generate sudden drops at intervals of 40 s, sampled at 1 Hz."""
    time = np.arange(rng.uniform(0.0, 1.0), 800.0)
    return draw_record(rng, time, every=40.0, noise=0.003)


KINDS: dict[str, Callable[[np.random.Generator], Catalogue]] = {
    "whole": sudden_drops,
    "triggered": triggered_bursts,
    "slow": slow_drops,
    "short": short_drops,
    "cut": cut_record,
    "negative": negative_stress,
    "small": small_drops,
    "correlated": correlated_noise,
    "uneven": uneven_sampling,
    "coarse": coarse_sampling,
}


def score_record(catalogue: Catalogue) -> Score:
    """Compare the events of ``rsfstudy.events`` with the drops of a record."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = rsfstudy.events(time=catalogue.time, shear_stress=catalogue.stress)
    begins, ends = catalogue.begins, catalogue.begins + catalogue.durations
    large = catalogue.sizes >= 3.0 * float(found["smallest_drop"])
    taken: set[int] = set()
    result = Score(large=int(large.sum()))
    for event in range(found.sizes["event"]):
        one = found.isel(event=event)
        start, error = float(one["time"]), float(one["time_error"])
        stop = start + float(one["duration"])
        reach = max(error, 0.1 * float(one["duration"]), float(np.median(np.diff(catalogue.time))))
        over = np.flatnonzero((begins <= stop + reach) & (ends >= start - reach))
        fresh = [int(place) for place in over if int(place) not in taken]
        if not fresh:
            result = result.add(Score(false=1))
            continue
        place = fresh[0]
        taken.add(place)
        drop, of = (float(one[f"static_stress_drop{end}"]) for end in ("", "_error"))
        result = result.add(
            Score(
                found=int(large[place]),
                matched=1,
                sizes=int(abs(drop - catalogue.sizes[place]) <= of),
                times=int(abs(start - begins[place]) <= error),
            )
        )
    return result


def main(count: int = 30) -> None:
    """Print a table with one row per kind of record."""
    print("kind         drops  found %  false  size %  time %")
    for kind, make in KINDS.items():
        total = Score()
        for seed in range(count):
            total = total.add(score_record(make(np.random.default_rng([seed, *kind.encode()]))))
        shares = (
            100.0 * part / max(whole_of, 1)
            for part, whole_of in (
                (total.found, total.large),
                (total.sizes, total.matched),
                (total.times, total.matched),
            )
        )
        found, sizes, times = shares
        row = f"{kind:12} {total.large:5}  {found:7.1f}  {total.false:5}"
        print(f"{row}  {sizes:6.1f}  {times:6.1f}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
