"""Print how well `rsfstudy.events` recovers the drops of synthetic records.

Each kind of record is made 30 times by seed. The table shows the share of drops of at least three
times the smallest detectable drop that are found, the number of false events, and the shares of
found drops whose size and time lie within the stated errors::

    python tests/benchmarks/record_events.py
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
    """A record with known drops: times at which they begin, durations and sizes."""

    time: np.ndarray
    stress: np.ndarray
    begins: np.ndarray
    durations: np.ndarray
    sizes: np.ndarray


class Score(NamedTuple):
    """Counts of drops: large ones, those found, false events, and covered sizes and times."""

    large: int = 0
    found: int = 0
    false: int = 0
    matched: int = 0
    sizes: int = 0
    times: int = 0

    def plus(self, other: Score) -> Score:
        """Add the counts of two scores."""
        return Score(*(one + two for one, two in zip(self, other, strict=True)))


def draw(
    rng: np.random.Generator,
    time: np.ndarray,
    *,
    size: tuple[float, float] = (0.3, 0.6),
    lasts: tuple[float, float] = (0.0, 0.0),
    every: float = 10.0,
    noise: float = 0.02,
    correlation: float = 0.0,
) -> Catalogue:
    """Make a record of loading with drops at random times, sizes and durations."""
    count = int((time[-1] - time[0]) / every) - 1
    jitter = rng.uniform(-0.15, 0.15, count) * every
    begins = time[0] + every * (1.0 + np.arange(count)) + jitter
    durations, sizes = rng.uniform(*lasts, count), rng.uniform(*size, count)
    share = (time[:, None] - begins) / np.maximum(durations, 1e-9)
    fallen = (np.clip(share, 0.0, 1.0) * sizes).sum(axis=1)
    # loading makes up for the drops, but not during them
    rests = np.clip(time[:, None] - begins, 0.0, durations).sum(axis=1)
    loading = sizes.sum() / (time[-1] - time[0] - durations.sum())
    white = rng.standard_normal(len(time) + 500)
    root = np.sqrt(1.0 - correlation**2)
    correlated = lfilter([root], [1.0, -correlation], white)[500:]
    stress = 5.0 + loading * (time - time[0] - rests) - fallen + noise * correlated
    return Catalogue(time, stress, begins, durations, sizes)


def whole(rng: np.random.Generator, **options: float) -> Catalogue:
    """Make sudden drops, sampled at 50 Hz."""
    return draw(rng, 0.02 * np.arange(10_000), **options)  # type: ignore[arg-type]


def triggered(rng: np.random.Generator) -> Catalogue:
    """Make drops of some milliseconds, sampled at 10 Hz with bursts of 1 kHz."""
    state = rng.bit_generator.state
    slow = 0.1 * np.arange(2_000)
    begins = draw(rng, slow, lasts=(0.01, 0.05)).begins
    bursts = [np.arange(begin - 0.05, begin + 0.15, 0.001) for begin in begins]
    time = np.unique(np.concatenate([slow, *bursts]).round(6))
    rng.bit_generator.state = state
    return draw(rng, time, lasts=(0.01, 0.05))


def slow(rng: np.random.Generator) -> Catalogue:
    """Make drops that last 2 to 4 of 10 s."""
    return draw(rng, 0.02 * np.arange(10_000), lasts=(2.0, 4.0))


def short(rng: np.random.Generator) -> Catalogue:
    """Make drops over 2 to 6 samples."""
    return draw(rng, 0.02 * np.arange(10_000), lasts=(0.04, 0.12))


def cut(rng: np.random.Generator) -> Catalogue:
    """Make a record that ends within a drop."""
    made = draw(rng, 0.02 * np.arange(10_000), lasts=(0.2, 1.0))
    stop = made.begins[-1] + rng.uniform(0.4, 0.8) * made.durations[-1]
    rows = made.time <= stop
    sizes = made.sizes.copy()
    sizes[-1] *= (made.time[rows][-1] - made.begins[-1]) / made.durations[-1]
    return made._replace(time=made.time[rows], stress=made.stress[rows], sizes=sizes)


def negative(rng: np.random.Generator) -> Catalogue:
    """Make drops of a shear stress with negative sign."""
    made = whole(rng)
    return made._replace(stress=-made.stress)


def small(rng: np.random.Generator) -> Catalogue:
    """Make sudden drops of 1.5 to 10 standard deviations of the noise."""
    return whole(rng, size=(0.03, 0.2), noise=0.02)  # type: ignore[arg-type]


def correlated(rng: np.random.Generator) -> Catalogue:
    """Make drops over 2 to 6 samples with noise whose samples repeat 0.5 of those before."""
    return draw(rng, 0.02 * np.arange(10_000), lasts=(0.04, 0.12), correlation=0.5)


def uneven(rng: np.random.Generator) -> Catalogue:
    """Make drops over some samples of a clock that is uneven by 30 %."""
    time = 0.02 * (np.arange(10_000) + rng.uniform(-0.3, 0.3, 10_000))
    return draw(rng, time, lasts=(0.0, 0.3))


KINDS: dict[str, Callable[[np.random.Generator], Catalogue]] = {
    made.__name__: made
    for made in (whole, triggered, slow, short, cut, negative, small, correlated, uneven)
}


def score(catalogue: Catalogue) -> Score:
    """Compare the events of a record with its drops."""
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
            result = result.plus(Score(false=1))
            continue
        place = fresh[0]
        taken.add(place)
        drop, of = (float(one[f"static_stress_drop{end}"]) for end in ("", "_error"))
        result = result.plus(
            Score(
                found=int(large[place]),
                matched=1,
                sizes=int(abs(drop - catalogue.sizes[place]) <= of),
                times=int(abs(start - begins[place]) <= error),
            )
        )
    return result


def main(count: int = 30) -> None:
    """Print a row for each kind of record."""
    print("kind         drops  found %  false  size %  time %")
    for kind, make in KINDS.items():
        total = Score()
        for seed in range(count):
            total = total.plus(score(make(np.random.default_rng([seed, *kind.encode()]))))
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
