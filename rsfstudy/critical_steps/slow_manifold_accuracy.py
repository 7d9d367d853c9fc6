"""Accuracy of critical steps that are computed on the slow manifold."""

from __future__ import annotations

from rsfstudy.motion import Integrator
from rsfstudy.slider import Scene


def is_slow_manifold_inaccurate(scene: Scene, integrator: Integrator) -> bool:
    """Return True if inertia makes the slow manifold inaccurate below the norm.

    Parameters
    ----------
    scene : Scene
        Scene with or without inertia.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    bool
        True if the scene has inertia, and if the relative error of a boundary that is computed on
        the slow manifold exceeds a tenth of the requested accuracy.
    """
    return scene.has_mass and estimate_slow_manifold_relative_error(
        scene
    ) > integrator.result_tolerance(0.1)


def estimate_slow_manifold_relative_error(scene: Scene) -> float:
    r"""Estimate the relative error that the slow manifold causes in a critical step.

    Parameters
    ----------
    scene : Scene
        Scene with inertia.

    Returns
    -------
    float
        Upper estimate of the relative error.

    Notes
    -----
    The estimate is

    .. math:: 3 \left(\frac{K}{a} w^2\right)^2

    with the stiffness :math:`K` and the instability norm :math:`w`. Inertia changes a critical step
    by up to :math:`0.8 (K/a) w^2`, if the instability norm corresponds to a slip rate of a few
    :math:`V_*`. The error of the slow manifold is at most 0.9 times the square of the effect of
    inertia on the critical step. The test suite measures both coefficients.
    """
    return 3.0 * (scene.stiffness / scene.a * scene.instability_norm**2) ** 2
