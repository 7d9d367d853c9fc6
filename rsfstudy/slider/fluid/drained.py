"""Drained fault with constant pore pressure."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.fluid import Fluid


@dataclass(frozen=True, kw_only=True)
class DrainedFluid(Fluid):
    r"""Constant pore pressure of a drained fault.

    Notes
    -----
    The pore pressure satisfies

    .. math::

        \frac{dp}{dt} = 0.
    """

    name = "drained"
    rejection_hint = "while the fault is drained", "set fluid='dilatant'"
