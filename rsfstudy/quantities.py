"""Named quantities: symbol, units and what each is, wherever it is stated; and tables of them, in
HTML.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from html.entities import html5
from typing import Any

from rsfstudy._deprecation import renamed_members, renamed_names
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue, escape_control_characters

__getattr__ = renamed_names(__name__)

#: A heading of a table.
_HEADING_WITH_UNITS_PATTERN = re.compile(r"(\w+)\s*[\[(]([^\[\]()]*)[\])]")


@guard_methods
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
    flags : tuple of str
        What 0, 1, 2 and so on mean, of a number that stands for a word.
    """

    name: str
    symbol: str
    units: str
    long_name: str
    scale: str = ""
    flags: tuple[str, ...] = ()

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of a variable of it: words, units, scale and flags, those that it has."""
        stated = {"long_name": self.long_name, "units": self.units, "scale": self.scale}
        return {key: text for key, text in stated.items() if text} | self.flag_attributes

    @property
    def flag_attributes(self) -> dict[str, Any]:
        """The CF attributes that say what its values mean; none of a plain number."""
        values = [float(number) for number in range(len(self.flags))]
        return {"flag_values": values, "flag_meanings": " ".join(self.flags)} if self.flags else {}


@renamed_members
@guard_methods
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
    def variable_names(self) -> tuple[str, ...]:
        """Its name, and that of its error estimate if there is one."""
        return (self.name, f"{self.name}_error") if self.error else (self.name,)


def is_variable_name(name: object) -> bool:
    """True if a text can name a variable: an identifier, as a file gives it back."""
    return isinstance(name, str) and name.isidentifier() and unicodedata.is_normalized("NFC", name)


def format_unit_quotient(units_or_scales: Sequence[str]) -> str:
    """Units, or scales, of a first quantity over others, as in ``s (um s-1)-1``;
    `split_unit_quotient` gives the single ones again.
    """
    first, *others = units_or_scales
    return first + "".join(f" ({each})-1" for each in others if each != "1")


def split_unit_quotient(unit_quotient: str) -> list[str]:
    """Units, or scales, of which something is in the first over the others."""
    return [each.removesuffix(")-1") for each in unit_quotient.split(" (")]


def units_or_scale_of_variable(attributes: Mapping[Any, Any]) -> str:
    """What the numbers of a variable are in: units, or what those without units are measured in."""
    units, scale = str(attributes.get("units", "")), str(attributes.get("scale", ""))
    return format_unit_quotient([scale, *split_unit_quotient(units)[1:]]) if scale else units


def parse_heading(text: str) -> tuple[str, str] | None:
    """Name and units that a heading such as ``velocity (um/s)`` states; None of another text."""
    match = _HEADING_WITH_UNITS_PATTERN.fullmatch(text.strip())
    return (match[1], match[2].strip()) if match else None


# ---- tables, as notebooks show them --------------------------------------------------------------

#: Of a table of quantities.
_QUANTITY_TABLE_HEADINGS = ("field", "symbol", "value", "unit", "meaning")
_FUNCTION_NAMES_IN_FORMULAS = ("ln", "log", "exp")
_HTML_TAGS_OF_SUB_AND_SUPERSCRIPTS = {"_": "sub", "^": "sup"}
_CELL_STYLE = 'style="text-align: left; vertical-align: top"'


def escape_html(text: object) -> str:
    """Escape a string for HTML, and make control characters visible."""
    return escape(escape_control_characters(str(text)))


class HtmlMarkup(str):
    """A text that is HTML already."""

    __slots__ = ()


def html_table(
    headings: Sequence[str], rows: Iterable[Sequence[object]], caption: str = ""
) -> HtmlMarkup:
    """A table; texts are escaped, unless they are `HtmlMarkup`.

    Parameters
    ----------
    headings : sequence of str
    rows : iterable of sequence
        Texts and numbers, as many in each row as there are headings.
    caption : str
        What stands above it.
    """
    above = f"<p><b>{_format_html_table_cell(caption)}</b></p>" if caption else ""
    head = "".join(f"<th {_CELL_STYLE}>{_format_html_table_cell(text)}</th>" for text in headings)
    lines = (
        "".join(f"<td {_CELL_STYLE}>{_format_html_table_cell(value)}</td>" for value in row)
        for row in rows
    )
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return HtmlMarkup(f"{above}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")


def html_quantities_table(
    rows: Iterable[tuple[Quantity, object]], caption: str = "", *, with_values: bool = True
) -> HtmlMarkup:
    """A table of quantities, with their values unless ``with_values`` is False."""
    shown = [n for n, text in enumerate(_QUANTITY_TABLE_HEADINGS) if with_values or text != "value"]
    table = (_quantity_row(about, value) for about, value in rows)
    return html_table(
        [_QUANTITY_TABLE_HEADINGS[n] for n in shown],
        ([row[n] for n in shown] for row in table),
        caption,
    )


def _quantity_row(about: Quantity, value: object) -> tuple[object, ...]:
    """The row of a quantity, under `_QUANTITY_TABLE_HEADINGS`."""
    return about.name, html_symbol(about.symbol), value, html_unit(about), about.long_name


class HtmlTableMixin:
    """Base of what a notebook shows as a table of quantities."""

    def quantities_with_values(self) -> Iterable[tuple[Quantity, object]]:
        """The quantities, with their values."""
        raise TypeError(f"{type(self).__name__} shows no quantities")

    def _repr_html_(self) -> str:
        return html_quantities_table(self.quantities_with_values(), type(self).__name__)


def html_symbol(formula: str) -> HtmlMarkup:
    """A symbol as `Quantity` states it, without the need of MathJax."""
    if "$" not in formula:
        return HtmlMarkup(escape_html(formula))
    text = escape_html(formula.strip("$"))
    text = re.sub(r"\\([A-Za-z]+)", lambda found: _html_character_entity(found[1]), text)
    text = re.sub(r"([_^])(?:\{([^{}]*)\}|(&\w+;|.))", _format_html_script, text)
    bare = re.sub(r"[{}]|\\.", "", text)
    return HtmlMarkup(f"<i>{bare}</i>")


def html_unit(quantity: Quantity) -> HtmlMarkup:
    """Unit of a quantity, or its scale where it is dimensionless; empty for 1."""
    if quantity.scale:
        scale = quantity.scale.replace("sigma", r"\sigma")
        return html_symbol(f"${scale}$")
    return HtmlMarkup(escape_html(quantity.units if quantity.units != "1" else ""))


def _html_character_entity(character_name: str) -> str:
    """Letters and signs have the same names in HTML."""
    return (
        character_name
        if character_name in _FUNCTION_NAMES_IN_FORMULAS
        else html5.get(f"{character_name};", "")
    )


def _format_html_script(match: re.Match[str]) -> str:
    tag = _HTML_TAGS_OF_SUB_AND_SUPERSCRIPTS[match[1]]
    return f"<{tag}>{match[2] if match[2] is not None else match[3]}</{tag}>"


def _format_html_table_cell(value: Any) -> str:
    if isinstance(value, HtmlMarkup):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return escape_html(value)
