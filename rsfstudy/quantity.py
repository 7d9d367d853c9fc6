"""A named quantity: symbol, units and what it is, wherever it is stated."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One named quantity.

    Attributes
    ----------
    name : str
        Its name in datasets and Python.
    symbol : str
        Mathematical text for axis labels.
    units : str
        UDUNITS string; "1" where dimensionless, and "" where units have no meaning.
    long_name : str
        A phrase that stands alone.
    scale : str
        What a dimensionless quantity is measured in: multiply by this to return to SI.
    """

    name: str
    symbol: str
    units: str
    long_name: str
    scale: str = ""

    @property
    def axis_label(self) -> str:
        """Label with units, for the axis of a figure."""
        text = f"{self.long_name[0].upper()}{self.long_name[1:]}"
        if self.symbol:
            text += f", {self.symbol}"
        if self.units not in ("", "1"):
            text += f" ({self.units})"
        return text


def is_name(name: object) -> bool:
    """Whether a text can name a variable: an identifier, as a file gives it back."""
    return isinstance(name, str) and name.isidentifier() and unicodedata.is_normalized("NFC", name)
