"""Numbers as figures write them."""

from __future__ import annotations

import math


def with_error(value: float, error: float) -> str:
    """A value and its standard error, to the first digit of the error."""
    if not math.isfinite(value) or not math.isfinite(error):
        return "unknown"
    digits = max(1, math.ceil(-math.log10(error))) if error > 0.0 else 4
    return rf"{value:.{digits}f} $\pm$ {error:.{digits}f}"
