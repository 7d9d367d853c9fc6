r"""White noise, whose path is a Wiener process."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.noise import Noise, _log_magnitude
from rsfstudy.slider.noise._paths import Path
from rsfstudy.slider.parts import (
    NON_NEGATIVE,
    NON_NEGATIVE_INTEGER,
    POSITIVE,
    Numbers,
    number,
)
from rsfstudy.slider.scene_view import SceneView

#: Number of samples that are computed at once.
_SAMPLES_PER_BLOCK = 4096
#: Smallest distance between the start or end of a loading segment and a sample, relative to the
#: sampling interval. Closer samples are left out, because rounding errors dominate the distance.
_MIN_DISTANCE_OVER_INTERVAL = 1e-9
#: Numbers of the independent paths of shear stress and normal stress.
_SHEAR_STREAM, _NORMAL_STREAM = 0, 1


@dataclass(frozen=True, kw_only=True)
class WhiteNoise(Noise):
    r"""White noise of the stress rates.

    Parameters
    ----------
    stress_noise : float, default: 0.0
        Amplitude :math:`\epsilon` of the noise of shear stress, in :math:`\sigma_*` per
        :math:`\sqrt{D_c/V_*}`.
    normal_stress_noise : float, default: 0.0
        Amplitude :math:`\epsilon_\sigma` of the noise of normal stress, in the same units. The
        noise requires a normal stress that the loading can change.
    noise_interval : float, default: 0.05
        Sampling interval :math:`h` of the path in :math:`D_c/V_*`. The error of the motion is
        proportional to the interval.
    noise_seed : float, default: 0
        Seed of the path, a whole number. The paths of shear stress and normal stress are
        independent.

    Notes
    -----
    The noise is added to the spring stress and to the imposed normal stress:

    .. math::

        f(t) = f_{\mathrm{smooth}}(t) + \epsilon W(t), \quad
          \sigma(t) = \sigma_{\mathrm{smooth}}(t) + \epsilon_\sigma W_\sigma(t).

    The Wiener processes :math:`W` and :math:`W_\sigma` start at zero. Between the samples at
    :math:`t_i = i h`, the paths are linear. The noise of shear stress does not change the state
    variable, so :math:`\ln V` fluctuates as the stress does. The seed, the interval and the
    amplitudes define the paths. A longer motion and a motion with half the interval have the same
    path.

    References
    ----------
    Wong and Zakai (1965), Ann. Math. Stat. 36, 1560-1564; Gualandi et al.
    (2023), Earth Planet. Sci. Lett. 604, 117995.
    """

    stress_noise: float = number(
        0.0,
        r"$\epsilon$",
        "1",
        "amplitude of noise of shear stress in sigma_* over the square root of D_c/V_*",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    normal_stress_noise: float = number(
        0.0,
        r"$\epsilon_\sigma$",
        "1",
        "amplitude of noise of normal stress in sigma_* over the square root of D_c/V_*",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    noise_interval: float = number(
        0.05,
        "$h V_*/D_c$",
        "1",
        "sampling interval of noise",
        "D_c/V_*",
        rule=POSITIVE,
        omit_if_default=True,
    )
    noise_seed: float = number(
        0.0,
        "",
        "1",
        "seed of noise",
        rule=NON_NEGATIVE_INTEGER,
        omit_if_default=True,
    )

    name = "white"
    is_active = True

    @property
    def changes_normal_stress(self) -> bool:
        """True if the noise of normal stress has an amplitude above zero."""
        return self.normal_stress_noise > 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the physical effects that are active in the part."""
        return ("noise",)

    def check(self, scene: SceneView) -> None:
        """Check that the loading of the scene can be combined with noise.

        See ``Part.check``. Noise can be added to loadings that consist of segments at constant
        velocity, but not to records.
        """
        loading, fluid = scene.parts.loading, scene.parts.fluid
        if loading.unknowns or loading.reported_segment_count < len(loading.segments) - 1:
            rule = f"cannot be added to the loading {loading.name!r}"
            remedy = "Noise is added to steady loading, steps and protocols."
            raise InvalidValue("noise", self.name, rule, remedy=remedy)
        if self.unknowns and fluid.unknowns:
            rule = f"has no meaning for fluid={fluid.name!r}"
            rule += ", whose pore pressure changes normal stress"
            raise self.field_error("normal_stress_noise", rule, "Leave one of them out.")

    def parameter_values(self, scene: SceneView) -> Numbers:
        """Return the initial rate of normal stress.

        See ``Part.parameter_values``. The event loop replaces the value at each sample.
        """
        return (0.0,) * len(self.unknowns)

    def path(self, stream: int) -> Path:
        """Return the path of unit noise.

        Parameters
        ----------
        stream : int
            Number of the path: 0 for shear stress and 1 for normal stress.

        Returns
        -------
        Path
            Path whose samples are multiplied by the amplitude.
        """
        return Path(int(self.noise_seed), stream)

    def iterate_segments(self, start: float, end: float, velocity: float) -> Iterator[np.ndarray]:
        """Yield the segment table of the noise in blocks.

        See ``Noise.iterate_segments``.
        """
        interval = self.noise_interval
        first = math.floor(start / interval + _MIN_DISTANCE_OVER_INTERVAL)
        stop, late = end / interval - _MIN_DISTANCE_OVER_INTERVAL, start - first * interval
        while first < stop:
            count = math.ceil(min(stop - first, _SAMPLES_PER_BLOCK))
            times = interval * np.arange(first, first + count + 1)
            times[0] += late
            if first + count >= stop:
                times[-1] = end
            shear = self._values_and_rates(self.stress_noise, _SHEAR_STREAM, first, count)[1]
            fall = rate = np.full(count, math.nan)
            if self.unknowns:
                amplitude = self.normal_stress_noise
                values, rate = self._values_and_rates(amplitude, _NORMAL_STREAM, first, count)
                fall = -values
                fall[0] -= late * rate[0]
            steady = np.full(count, velocity), np.full(count, _log_magnitude(velocity))
            yield np.column_stack((times[:-1], times[1:], *steady, rate, fall, shear))
            first, late = first + count, 0.0

    def _values_and_rates(
        self, amplitude: float, stream: int, first: int, count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the noise at the samples, and its rates after the samples."""
        if not amplitude:
            return np.zeros(count), np.zeros(count)
        values = amplitude * self.path(stream).sample(self.noise_interval, first, count + 1)
        return values[:-1], np.diff(values) / self.noise_interval
