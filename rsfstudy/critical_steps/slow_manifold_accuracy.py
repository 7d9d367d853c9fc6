"""Accuracy of boundaries that are computed on the slow manifold."""

from __future__ import annotations

from rsfstudy.motion import Accuracy
from rsfstudy.slider import Scene


def inertia_matters_below_norm(scene: Scene, accuracy: Accuracy) -> bool:
    """True if mass matters up to the instability norm, beyond what the slow manifold holds of
    it.
    """
    return scene.has_mass and slow_manifold_relative_error(scene) > 0.1 * accuracy.rtol


def slow_manifold_relative_error(scene: Scene) -> float:
    """Relative error of a boundary computed on the slow manifold up to the norm w of a scene:
    ``3 [(K/a) w**2]**2``.

    Mass moves a boundary in proportion to (K/a) w**2, by up to 0.8 of it where the norm is a slip
    rate of a few V_*; the slow manifold leaves up to 0.9 of its square (the tests measure it).
    """
    return 3.0 * (scene.stiffness / scene.a * scene.instability_norm**2) ** 2
