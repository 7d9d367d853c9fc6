r"""Noise with a correlation time, whose path is an Ornstein-Uhlenbeck process."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider import noise_paths
from rsfstudy.slider.noise.white import WhiteNoise
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class CorrelatedNoise(WhiteNoise):
    r"""Noise in shear stress and normal stress, with a correlation time.

    The other fields are described in ``WhiteNoise``.

    Parameters
    ----------
    noise_correlation_time : float, default: 1.0
        Correlation time :math:`t_c` in :math:`D_c/V_*`.

    Notes
    -----
    The noise :math:`n(t)` in shear stress is an Ornstein-Uhlenbeck process,

    .. math::

        dn = -\frac{n}{t_c} \, dt + \epsilon \, dW,

    and so is the noise in normal stress. Both start at zero. After a few correlation times, the
    standard deviation of the noise is :math:`\epsilon \sqrt{t_c/2}`. For times much shorter than
    the correlation time, the noise equals white noise of the same amplitude.
    """

    noise_correlation_time: float = number(
        1.0,
        "$t_c V_*/D_c$",
        "1",
        "correlation time of noise",
        "D_c/V_*",
        rule=POSITIVE,
        omit_if_default=True,
    )

    name = "correlated"

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the initial rate of change of the normal stress.

        See ``WhiteNoise.parameter_values``.
        """
        return super().parameter_values(scene)

    def build_unit_noise_path(self, stream_number: int) -> noise_paths.UnitNoisePath:
        """Return the path of unit noise.

        See ``WhiteNoise.build_unit_noise_path``.
        """
        return noise_paths.UnitNoisePath(
            int(self.noise_seed), stream_number, self.noise_correlation_time
        )
