"""Drained fault with constant pore pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.fluid import Fluid


@dataclass(frozen=True, kw_only=True)
class DrainedFluid(Fluid):
    r"""Pore fluid of a drained fault, in which the pore pressure is constant.

    Notes
    -----
    The pore pressure satisfies

    .. math::

        \frac{dp}{dt} = 0.
    """

    name = "drained"
    rejection_condition_and_remedy = "when the fault is drained", "set fluid='dilatant'"

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: Any) -> InvalidValue:
        """Return the error for a field that belongs to another fluid.

        See ``Part.build_field_rejection_error``.
        """
        if field_name != "pressurisation":
            return super().build_field_rejection_error(field_name, value)
        remedy = "Omit pressurisation, or set fluid='thermal'."
        return InvalidValue(
            field_name, value, "does not apply when the fault is drained", remedy=remedy
        )
