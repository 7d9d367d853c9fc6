"""A named quantity: symbol, units and what it is, wherever it is stated."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

from rsfstudy.errors import InvalidValue


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


@dataclass(frozen=True)
class Output(Quantity):
    """A number that a measure gives; the vocabulary, or its name, describes one that states no
    more.

    Attributes
    ----------
    dims : tuple of str
        Inner dimensions that it has within one cell.
    error : bool
        Whether a numerical error estimate stands beside it, as ``<name>_error``.
    optional : bool
        Whether an ok outcome may leave it out, with its error; the message says why.

    Raises
    ------
    InvalidValue
        For a symbol, units or a scale of what is not said to be anything.
    """

    symbol: str = ""
    units: str = "1"
    long_name: str = ""
    dims: tuple[str, ...] = ()
    error: bool = False
    optional: bool = False

    def __post_init__(self) -> None:
        if not self.long_name and (self.symbol or self.scale or self.units != "1"):
            rule = f"must say what {self.name} is, which states a symbol, units or a scale"
            raise InvalidValue("long_name", self.long_name, rule)

    @property
    def names(self) -> tuple[str, ...]:
        """Its name, and that of its error estimate if there is one."""
        return (self.name, f"{self.name}_error") if self.error else (self.name,)


def is_name(name: object) -> bool:
    """True if a text can name a variable: an identifier, as a file gives it back."""
    return isinstance(name, str) and name.isidentifier() and unicodedata.is_normalized("NFC", name)
