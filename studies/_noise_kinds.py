"""Synthetic records with typical imperfections of laboratory records.

Each kind of imperfection converts the exact friction after a velocity step to a noisy record. The
conversion selects the sample times, adds noise, and modifies friction or displacement as a data
acquisition system would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.signal import lfilter

if TYPE_CHECKING:
    from rsfstudy.fitting import Record


class ExactResponse(NamedTuple):
    """Exact response to a velocity step.

    Parameters
    ----------
    step : float
        Time of the step in s.
    ends : float
        End of the record in s.
    before : float
        Load point velocity in um/s before the step.
    after : float
        Load point velocity in um/s after the step.
    friction : callable
        Function that returns friction at given times in s.
    noise_size : float
        Standard deviation of the friction noise.
    """

    step: float
    ends: float
    before: float
    after: float
    friction: Callable[[np.ndarray], np.ndarray]
    noise_size: float

    def displacement(self, time: np.ndarray) -> np.ndarray:
        """Return the load point displacement relative to its value at the step.

        Parameters
        ----------
        time : ndarray
            Times in s.

        Returns
        -------
        ndarray
            Displacements in um, which are negative before the step.
        """
        late = time - self.step
        return np.where(late < 0.0, self.before, self.after) * late


@dataclass(frozen=True)
class NoiseKind:
    """Imperfections of a laboratory record.

    Parameters
    ----------
    rate : tuple[float, float], default: (2.0, 20.0)
        Sampling rates in Hz before and after the step.
    jitter : float, default: 0.0
        Standard deviation of the sample times, as a fraction of the sampling interval.
    correlation : float, default: 0.0
        Correlation between the noise of successive rows.
    correlation_time : float, default: 0.0
        Correlation time of the noise in s, as an alternative to ``correlation``.
    louder : float, default: 1.0
        Ratio of the noise after the step to the noise before the step.
    spikes : float, default: 0.0
        Fraction of rows that are outliers.
    quantum : float, default: 0.0
        Rounding step of friction, in units of the standard deviation of the noise.
    mean_of : int, default: 1
        Number of rows in a running mean of friction.
    displacement_noise : float, default: 0.0
        Standard deviation of the noise of the recorded load point displacement, in um.
    displacement_quantum : float, default: 0.0
        Rounding step of the recorded load point displacement, in um.
    pink : bool, default: False
        If True, the power spectrum of the noise is proportional to 1/f.
    trend : float, default: 0.0
        Trend of friction in 1/um.
    noise_factor : float, default: 1.0
        Factor by which the standard deviation of the noise is multiplied.
    states_filter : bool, default: False
        If True, the length of the running mean is passed to the fit.
    """

    rate: tuple[float, float] = (2.0, 20.0)
    jitter: float = 0.0
    correlation: float = 0.0
    correlation_time: float = 0.0
    louder: float = 1.0
    spikes: float = 0.0
    quantum: float = 0.0
    mean_of: int = 1
    displacement_noise: float = 0.0
    displacement_quantum: float = 0.0
    pink: bool = False
    trend: float = 0.0
    noise_factor: float = 1.0
    states_filter: bool = False

    @property
    def filter(self) -> str:
        """Filter that is passed to the fit. An empty string means no filter."""
        return f"mean {self.mean_of / self.rate[1]!r}" if self.states_filter else ""

    @property
    def finds_steps(self) -> bool:
        """True if the fit detects the steps in the recorded displacement.

        If the value is False, the exact steps are passed to the fit instead.
        """
        return self.displacement_noise > 0.0 or self.displacement_quantum > 0.0

    def draw(self, truth: ExactResponse, rng: np.random.Generator) -> Record:
        """Draw a random record.

        Parameters
        ----------
        truth : ExactResponse
            Exact response to the velocity step.
        rng : numpy.random.Generator
            Random number generator.

        Returns
        -------
        Record
            Record of time, load point displacement and friction.
        """
        from rsfstudy.fitting import Record  # The import is slow.

        margin = self.mean_of // 2
        time = self._times(truth, rng, margin)
        moved, size = truth.displacement(time), self.noise_factor * truth.noise_size
        noise = size * self._unit_noise(time, rng)
        noise[time > truth.step] *= self.louder
        friction = truth.friction(time) + self.trend * moved + noise
        if self.mean_of > 1:
            friction = np.convolve(friction, np.full(self.mean_of, 1.0 / self.mean_of), "valid")
            time, moved = time[margin:-margin], moved[margin:-margin]
        hit = rng.random(len(time)) < self.spikes
        friction[hit] += 30.0 * size * rng.choice([-1.0, 1.0], int(hit.sum()))
        if self.quantum:
            step = self.quantum * size
            friction = step * np.rint(friction / step)
        moved = moved + self.displacement_noise * rng.standard_normal(len(time))
        if self.displacement_quantum:
            offset = rng.random()
            moved = self.displacement_quantum * np.rint(moved / self.displacement_quantum + offset)
        columns = {"time": time, "displacement": moved, "friction": friction}
        record = Record(columns)
        if self.finds_steps:
            return record
        return record.with_steps([(truth.step, truth.step, truth.before, truth.after)])

    def _times(self, truth: ExactResponse, rng: np.random.Generator, margin: int) -> np.ndarray:
        """Return the sample times.

        The ``margin`` argument is the number of additional rows at each end. These rows are needed
        because the running mean shortens the record.
        """
        slow, fast = (1.0 / rate for rate in self.rate)
        first = np.arange(-margin * slow + 0.5 * slow, truth.step, slow)
        second = np.arange(truth.step + 0.3 * fast, truth.ends + margin * fast, fast)
        time = np.concatenate([first, second])
        gaps = np.repeat([slow, fast], [len(first), len(second)])
        shift = np.clip(rng.standard_normal(len(time)), -1.4, 1.4) * self.jitter * gaps
        return np.asarray(np.sort(time + shift))

    def _unit_noise(self, time: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Draw noise with a standard deviation of 1."""
        drawn = rng.standard_normal(len(time))
        if self.pink:
            power = 1.0 / np.fft.rfftfreq(8 * len(time))[1:]
            phases = rng.standard_normal((2, len(power)))
            spectrum = np.concatenate([[0.0], np.sqrt(power) * (phases[0] + 1j * phases[1])])
            found = np.fft.irfft(spectrum)[: len(time)]
            return np.asarray(found / np.sqrt(np.mean(np.square(found))))
        if self.correlation:
            rho = self.correlation
            warm = np.concatenate([rng.standard_normal(500), drawn])
            return np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], warm)[500:])
        if self.correlation_time:
            remembered = np.exp(-np.diff(time) / self.correlation_time)
            for row, r in enumerate(remembered.tolist(), start=1):
                drawn[row] = r * drawn[row - 1] + np.sqrt(1.0 - r * r) * drawn[row]
        return drawn


NOISE_KINDS = {
    "louder_after": NoiseKind(louder=10.0, noise_factor=0.2),
    "spikes": NoiseKind(spikes=0.01),
    "rounded": NoiseKind(quantum=2.0),
    "uneven_clock": NoiseKind(rate=(5.0, 50.0), jitter=0.2, correlation_time=0.5),
    "jittered_displacement": NoiseKind(
        correlation=0.9, displacement_noise=0.4, trend=-5e-5, noise_factor=0.5
    ),
    "encoder": NoiseKind(rate=(10.0, 10.0), displacement_quantum=0.5, noise_factor=0.2),
    "averaged": NoiseKind(rate=(10.0, 10.0), mean_of=5, noise_factor=0.4, states_filter=True),
    "unstated_average": NoiseKind(rate=(10.0, 10.0), mean_of=5, noise_factor=0.4),
    "coarsely_rounded": NoiseKind(quantum=3.5),
    "pink": NoiseKind(rate=(4.0, 40.0), pink=True, noise_factor=0.5),
}
