r"""White noise, whose path is a Wiener process."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import noise_paths
from rsfstudy.slider.noise import Noise
from rsfstudy.slider.parts import (
    NON_NEGATIVE,
    NON_NEGATIVE_INTEGER,
    POSITIVE,
    FloatTuple,
    number,
)
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class WhiteNoise(Noise):
    r"""White noise in the rates of shear stress and normal stress.

    Parameters
    ----------
    stress_noise : float, default: 0.0
        Amplitude :math:`\epsilon` of the noise in shear stress, in :math:`\sigma_*` per
        :math:`\sqrt{D_c/V_*}`.
    normal_stress_noise : float, default: 0.0
        Amplitude :math:`\epsilon_\sigma` of the noise in normal stress, in the same units. Noise in
        normal stress requires a normal stress condition that allows the loading to change normal
        stress.
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
    :math:`t_i = i h`, the paths are linear. The noise in shear stress does not directly change the
    state variable, so :math:`\ln V` has the same fluctuations as the shear stress. The seed, the
    interval and the amplitudes define the paths. The paths do not change if the motion is extended
    or if the interval is halved.

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
        """True if the amplitude of the normal stress noise is greater than zero."""
        return self.normal_stress_noise > 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("noise",)

    def check(self, scene: SceneView) -> None:
        """Check that the loading of the scene can be combined with noise.

        See ``Part.check``. Noise can be added to loadings that consist of segments at constant
        velocity, but not to sampled histories.
        """
        loading, fluid = scene.parts.loading, scene.parts.fluid
        if loading.unknowns or loading.reported_segment_start_count < len(loading.segments) - 1:
            rule = f"cannot be added to the loading {loading.name!r}"
            remedy = "Noise can only be added to steady loading, steps and protocols."
            raise InvalidValue("loading_noise", self.name, rule, remedy=remedy)
        if self.unknowns and fluid.unknowns:
            rule = f"cannot be combined with fluid={fluid.name!r}"
            rule += ", because both change the effective normal stress"
            raise self.build_field_error("normal_stress_noise", rule, "Omit one of the two.")

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the initial rate of change of the normal stress.

        See ``Part.parameter_values``. The event loop replaces the value at each sample.
        """
        return (0.0,) * len(self.unknowns)

    def build_unit_noise_path(self, stream_number: int) -> noise_paths.UnitNoisePath:
        """Return the path of unit noise.

        Parameters
        ----------
        stream_number : int
            Number of the path: 0 for shear stress and 1 for normal stress.

        Returns
        -------
        Path
            Path whose samples are multiplied by the amplitude.
        """
        return noise_paths.UnitNoisePath(int(self.noise_seed), stream_number)

    def iterate_noisy_loading_segment_blocks(
        self, start_time: float, end_time: float, load_velocity: float
    ) -> Iterator[Any]:
        """Yield the segment table of the noise, one block of rows at a time.

        See ``Noise.iterate_noisy_loading_segment_blocks``.
        """
        shear = self.build_unit_noise_path(0), self.stress_noise
        normal = (
            (self.build_unit_noise_path(1), self.normal_stress_noise) if self.unknowns else None
        )
        return noise_paths.iterate_noisy_loading_segment_blocks(
            start_time, end_time, load_velocity, self.noise_interval, shear, normal
        )
