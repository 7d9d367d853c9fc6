"""Variable normal stress: a driving stress inclined to the fault couples normal to shear stress."""

from __future__ import annotations

#: Normal stress ratios outside of this only occur in trial steps; the clamp keeps them finite.
SMALLEST_RATIO, LARGEST_RATIO = 1e-12, 1e12


def normal_stress_ratio(shear: float, cot_phi: float) -> float:
    """Normal stress over its reference value.

    ``sigma/sigma_* = 1 + cot(phi) (tau - tau_*)/sigma_*``, from sigma = sigma_3 + tau cot(phi)
    with sigma_3 constant.

    Parameters
    ----------
    shear : float
        Deviation of shear stress, (tau - tau_*)/sigma_*.
    cot_phi : float
        Cotangent of the angle between the driving stress and the fault normal.
    """
    return min(max(1.0 + cot_phi * shear, SMALLEST_RATIO), LARGEST_RATIO)


def friction(shear: float, ratio: float, mu_star: float, cot_phi: float) -> tuple[float, float]:
    """Excess of the friction coefficient over mu_*, and its derivative with respect to `shear`.

    ``tau/sigma - mu_* = g (1 - mu_* cot(phi))/s`` with g the deviation of shear stress and
    s = 1 + g cot(phi) the normal stress ratio; its derivative is ``(1 - mu_* cot(phi))/s**2``.

    Parameters
    ----------
    shear : float
        Deviation of shear stress, (tau - tau_*)/sigma_*.
    ratio : float
        Normal stress ratio at that shear stress.
    mu_star, cot_phi : float
        Reference friction coefficient; cotangent of the driving angle.
    """
    slope = (1.0 - mu_star * cot_phi) / ratio
    return shear * slope, slope / ratio
