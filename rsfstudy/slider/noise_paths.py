r"""Functions that compute noise paths, which depend only on the seed and the time.

A path is defined at the times :math:`H j/2^l`, in which :math:`H` is the base interval, and the
index :math:`j` and the level :math:`l` are integers. The base interval is the product of a power of
two and the sampling interval. The level :math:`l = 0` contains independent increments. Each further
level inserts values at the midpoints between the times of the previous level. The value at a
midpoint is drawn from a normal distribution, whose mean is a weighted sum of the values at the two
neighbouring times (bridge sampling). If a path is extended, its earlier values do not change. If
the sampling interval is halved, the values at the previous sampling times do not change.

The random numbers are raw 64-bit words of the counter-based generator Philox. The key of the
generator is the seed, and its counter contains the level and the index of the midpoint. Any section
of a path can therefore be computed without the preceding sections.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

#: Binary exponent of the base interval: it is at least 2**31 and less than 2**32.
_BASE_INTERVAL_BINARY_EXPONENT = 32
#: Number of samples that are computed at once.
_SAMPLES_PER_BLOCK = 4096
#: Smallest distance between the start or end of a loading segment and a sample, relative to the
#: sampling interval. Closer samples are left out, because rounding errors dominate the distance.
_MIN_TIME_GAP_OVER_SAMPLING_INTERVAL = 1e-9
#: Number of words that the generator returns for each value of its counter.
_RANDOM_WORDS_PER_COUNTER_VALUE = 4


class UnitNoisePath(NamedTuple):
    r"""Noise path of unit amplitude, as a function of time in units of :math:`D_c/V_*`.

    Without a correlation time, the path is a Wiener process with the variance :math:`t`. With the
    correlation time :math:`t_c`, it is the Ornstein-Uhlenbeck process
    :math:`dn = -n \, dt/t_c + dW`, whose standard deviation approaches :math:`\sqrt{t_c/2}`. Both
    processes start at zero.

    Parameters
    ----------
    seed : int
        Seed of the random numbers.
    random_stream_number : int
        Stream number. Paths with the same seed but different stream numbers are independent.
    correlation_time : float or None
        Correlation time :math:`t_c`, or None for a Wiener process.
    """

    seed: int
    random_stream_number: int
    correlation_time: float | None = None

    def compute_samples(
        self, sampling_interval: float, first_sample_index: int, sample_count: int
    ) -> np.ndarray:
        """Return the path at multiples of the sampling interval.

        Parameters
        ----------
        sampling_interval : float
            Sampling interval.
        first_sample_index : int
            Index of the first sample, whose time is ``first_sample_index * sampling_interval``.
        sample_count : int
            Number of samples.

        Returns
        -------
        ndarray of shape (count,)
            Values of the path.
        """
        mantissa, exponent = math.frexp(sampling_interval)
        level = _BASE_INTERVAL_BINARY_EXPONENT - exponent
        base = math.ldexp(mantissa, _BASE_INTERVAL_BINARY_EXPONENT)
        return self._compute_samples_at_bisection_level(
            base, level, first_sample_index, first_sample_index + sample_count
        )

    def _compute_samples_at_bisection_level(
        self, base_interval: float, level: int, first_sample_index: int, stop_sample_index: int
    ) -> np.ndarray:
        """Return the path at the times ``i * base_interval/2**level`` for first <= i < stop."""
        if level == 0:
            return self._compute_samples_at_base_interval(base_interval, stop_sample_index)[
                first_sample_index:
            ]
        spacing = math.ldexp(base_interval, 1 - level)
        left, right = first_sample_index // 2, stop_sample_index // 2
        parents = self._compute_samples_at_bisection_level(
            base_interval, level - 1, left, right + 1
        )
        weight, deviation = self._compute_bridge_weight_and_deviation(spacing)
        values = np.empty(2 * len(parents) - 1)
        values[::2] = parents
        values[1::2] = weight * (
            parents[:-1] + parents[1:]
        ) + deviation * self._draw_normal_random_numbers(level, left, right - left)
        return values[first_sample_index - 2 * left : stop_sample_index - 2 * left]

    def _compute_samples_at_base_interval(
        self, base_interval: float, stop_sample_index: int
    ) -> np.ndarray:
        """Return the first values of the path at multiples of the base interval."""
        values, normals = (
            [0.0],
            self._draw_normal_random_numbers(0, 0, max(stop_sample_index - 1, 0)),
        )
        kept, deviation = self._compute_decay_and_innovation_deviation(base_interval)
        for normal in normals.tolist():
            values.append(kept * values[-1] + deviation * normal)
        return np.array(values[:stop_sample_index])

    def _compute_decay_and_innovation_deviation(self, time_step: float) -> tuple[float, float]:
        """Return the decay factor of one step, and the standard deviation of the added noise."""
        if self.correlation_time is None:
            return 1.0, math.sqrt(time_step)
        decay = 2.0 * time_step / self.correlation_time
        return math.exp(-0.5 * decay), math.sqrt(-0.5 * self.correlation_time * math.expm1(-decay))

    def _compute_bridge_weight_and_deviation(self, neighbour_spacing: float) -> tuple[float, float]:
        r"""Return the weight of each neighbour, and the standard deviation at the midpoint.

        With the correlation :math:`\rho` over half the spacing, the weight is
        :math:`\rho/(1 + \rho^2)`, and the variance of the Ornstein-Uhlenbeck process is reduced by
        the factor :math:`(1 - \rho^2)/(1 + \rho^2)`.
        """
        if self.correlation_time is None:
            return 0.5, 0.5 * math.sqrt(neighbour_spacing)
        ratio = 0.5 * neighbour_spacing / self.correlation_time
        correlation = math.exp(-ratio)
        variance = 0.5 * self.correlation_time * math.tanh(ratio)
        return correlation / (1.0 + correlation * correlation), math.sqrt(variance)

    def _draw_normal_random_numbers(
        self, bisection_level: int, first_index: int, count: int
    ) -> np.ndarray:
        """Return normally distributed random numbers for the given bisection level."""
        skipped = first_index % _RANDOM_WORDS_PER_COUNTER_VALUE
        generator = np.random.Philox(
            key=np.array([self.seed, self.random_stream_number], dtype=np.uint64),
            counter=np.array(
                [first_index // _RANDOM_WORDS_PER_COUNTER_VALUE, bisection_level, 0, 0],
                dtype=np.uint64,
            ),
        )
        words = np.atleast_1d(generator.random_raw(skipped + count))[skipped:]
        uniform = ((words >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53
        return np.asarray(ndtri(uniform))


def iterate_noisy_loading_segment_blocks(
    start_time: float,
    end_time: float,
    load_velocity: float,
    sampling_interval: float,
    shear_stress_path_and_amplitude: tuple[UnitNoisePath, float],
    normal_stress_path_and_amplitude: tuple[UnitNoisePath, float] | None,
) -> Iterator[np.ndarray]:
    r"""Yield the segment table of the noise, one block of rows at a time.

    Parameters
    ----------
    start_time, end_time : float
        Start and end of a loading segment in :math:`D_c/V_*`. The end may be infinite.
    load_velocity : float
        Load point velocity :math:`V_0/V_*` during the loading segment.
    sampling_interval : float
        Sampling interval of the noise.
    shear_stress_path_and_amplitude : tuple of (Path, float)
        Path and amplitude of the noise in shear stress.
    normal_stress_path_and_amplitude : tuple of (Path, float) or None
        Path and amplitude of the noise in normal stress.

    Yields
    ------
    ndarray of shape (rows, 7)
        Successive rows of the segment table. The columns are defined in ``parameter_layout``.
    """
    first = math.floor(start_time / sampling_interval + _MIN_TIME_GAP_OVER_SAMPLING_INTERVAL)
    stop, late = (
        end_time / sampling_interval - _MIN_TIME_GAP_OVER_SAMPLING_INTERVAL,
        start_time - first * sampling_interval,
    )
    log_velocity = math.log(abs(load_velocity)) if load_velocity else -math.inf
    while first < stop:
        count = math.ceil(min(stop - first, _SAMPLES_PER_BLOCK))
        times = sampling_interval * np.arange(first, first + count + 1)
        times[0] += late
        if first + count >= stop:
            times[-1] = end_time
        fall = rate = np.full(count, math.nan)
        if normal_stress_path_and_amplitude is not None:
            values, rate = _compute_noise_values_and_rates(
                *normal_stress_path_and_amplitude, sampling_interval, first, count
            )
            fall = -values
            fall[0] -= late * rate[0]
        noise_rate = _compute_noise_values_and_rates(
            *shear_stress_path_and_amplitude, sampling_interval, first, count
        )[1]
        steady = np.full(count, load_velocity), np.full(count, log_velocity)
        yield np.column_stack((times[:-1], times[1:], *steady, rate, fall, noise_rate))
        first, late = first + count, 0.0


def _compute_noise_values_and_rates(
    unit_noise_path: UnitNoisePath,
    amplitude: float,
    sampling_interval: float,
    first_sample_index: int,
    sample_count: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the noise at each sample, and its rate of change after each sample."""
    if not amplitude:
        return np.zeros(sample_count), np.zeros(sample_count)
    values = amplitude * unit_noise_path.compute_samples(
        sampling_interval, first_sample_index, sample_count + 1
    )
    return values[:-1], np.diff(values) / sampling_interval
