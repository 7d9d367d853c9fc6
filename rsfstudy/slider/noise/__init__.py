r"""Noise in shear stress and normal stress, which is added to the loading.

Each module of this package defines one kind of noise. The function ``discover_parts`` finds the
modules automatically. Noise is added to the loading as a sampled path, not as an additional term in
the equations of motion. Between two samples, the stress changes at a constant rate, and the
resulting motion is integrated to the requested tolerance. If the noise is independent of the
motion, the motion converges to the solution of the stochastic differential equation as the sampling
interval decreases (Wong-Zakai theorem). The module ``noise_paths`` computes the paths from the
seed. The base class is ``Noise``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import ramp
from rsfstudy.slider.parts import FloatTuple, Part, discover_parts
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class Noise(Part):
    r"""Base class of the noise that is added to the loading.

    A subclass sets ``is_active`` to True and defines the methods
    ``iterate_noisy_loading_segment_blocks`` and ``changes_normal_stress``.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> Scene().parts.loading_noise.name
    'none'
    >>> scene = Scene(loading_noise="white", stress_noise=1e-4, noise_interval=0.05, noise_seed=3)
    >>> scene.parts.loading_noise.is_active
    True
    """

    #: True if the noise changes the motion.
    is_active: ClassVar[bool] = False
    adds_load_point_displacement_unknown: ClassVar[bool] = False
    of_pressure: ClassVar[bool] = False
    auxiliary_rates = staticmethod(ramp.compute_remaining_stress_change_rates)
    auxiliary_steady_states = staticmethod(ramp.return_zero_remaining_stress_change)

    @property
    def changes_normal_stress(self) -> bool:
        """True if the noise changes normal stress."""
        return False

    @property
    def unknowns(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        """Unknowns of the noise.

        If the noise changes normal stress, the decrease in normal stress is an unknown. Noise in
        shear stress is added directly to the rate of the spring stress and needs no unknown.
        """
        return _UNKNOWNS_OF_NORMAL_STRESS_NOISE if self.changes_normal_stress else ()

    @property
    def adds_normal_stress_unknowns(self) -> bool:
        """True if the noise has unknowns that change normal stress."""
        return bool(self.unknowns)

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        """Return the decrease in normal stress at the start of the path, which is zero.

        Parameters
        ----------
        scene : Scene
            Scene that the noise belongs to.

        Returns
        -------
        tuple of float
            One value per unknown.
        """
        return (0.0,) * len(self.unknowns)

    def iterate_noisy_loading_segment_blocks(
        self, start_time: float, end_time: float, load_velocity: float
    ) -> Iterator[Any]:
        """Yield the segment table of the noise, one block of rows at a time.

        Parameters
        ----------
        start_time, end_time : float
            Start and end of a loading segment in :math:`D_c/V_*`. The end may be infinite.
        load_velocity : float
            Load point velocity :math:`V_0/V_*` during the loading segment.

        Returns
        -------
        iterator of ndarray of shape (rows, 7)
            Successive rows of the segment table. The columns are defined in ``parameter_layout``.

        Raises
        ------
        TypeError
            If the noise is not active.
        """
        raise TypeError(f"{self.name} has no path")


_UNKNOWNS_OF_NORMAL_STRESS_NOISE = (
    Quantity("noise_fall", "$P$", "1", "fall of normal stress by noise", "sigma_*"),
)


BUILT_IN_NOISE_CLASS_BY_NAME = discover_parts(__name__, __path__)
