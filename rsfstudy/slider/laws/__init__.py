"""State evolution laws, one file each, found by file name.

A law is a module with ``evolution(log_rate, state, b)``: the change of the state variable per unit
of slip at constant normal stress. The state variable is written so that every law shares

    tau = sigma * (mu_* + a ln(V/V_*) + Theta),

which for the slowness law means Theta = b ln(theta/theta_*).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable

Evolution = Callable[[float, float, float], float]

NAMES: tuple[str, ...] = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__)))


def evolution_of(law: str) -> Evolution:
    """The evolution function of the law of this name."""
    evolution: Evolution = importlib.import_module(f"{__name__}.{law}").evolution
    return evolution
