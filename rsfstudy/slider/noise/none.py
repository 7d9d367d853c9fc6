"""Loading without noise."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.noise import Noise


@dataclass(frozen=True, kw_only=True)
class NoNoise(Noise):
    """Loading without noise."""

    name = "none"
    rejection_condition_and_remedy = (
        "without noise",
        "set loading_noise='white' or loading_noise='correlated'",
    )
