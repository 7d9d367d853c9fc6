"""Named quantities with symbols and units, and HTML tables of quantities."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from html.entities import html5
from typing import Any

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names
from rsfstudy.errors import InvalidValue, escape_control_characters
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors

__getattr__ = build_getattr_for_former_names(__name__)

#: Attribute ``comment`` of the results of a study. The text is true for dimensionless results, for
#: axes in the units of a rig, and for fits.
COMMENT_ON_UNITS_AND_SCALES = (
    "Variables have the units in their attributes. Variables with the attribute scale are "
    "dimensionless, and the attribute contains their scale: sigma_* for stress, D_c for slip, "
    "D_c/V_* for time, V_* for slip rate."
)
#: Beginnings of the comment in results files. Older files contain the second text.
_BEGINNINGS_OF_COMMENT_ON_SCALES = (
    COMMENT_ON_UNITS_AND_SCALES,
    "Quantities are dimensionless: stress in sigma_*",
)

#: Pattern of a column heading with a name and units.
_HEADING_WITH_UNITS_PATTERN = re.compile(r"(\w+)\s*[\[(]([^\[\]()]*)[\])]")


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Quantity:
    """Named quantity with a symbol, units and a description.

    Parameters
    ----------
    name : str
        Name of the quantity in datasets and in Python.
    symbol : str
        Mathematical symbol for axis labels, in LaTeX.
    units : str
        Units in the syntax of UDUNITS. Use "1" for a dimensionless quantity, and an empty string if
        the quantity is not numerical.
    long_name : str
        Description of the quantity, as a phrase that can be understood without context.
    scale : str, default: ""
        Scale of a dimensionless quantity, for example "D_c/V_*". The product of value and scale is
        a quantity in SI units.
    flags : tuple of str, default: ()
        Meanings of the codes 0, 1, 2, ... of a categorical variable.

    Examples
    --------
    >>> from rsfstudy.measures import Quantity
    >>> recurrence = Quantity("recurrence", "$t_r$", "1", "recurrence interval", scale="D_c/V_*")
    >>> recurrence.variable_attributes
    {'long_name': 'recurrence interval', 'units': '1', 'scale': 'D_c/V_*'}
    """

    name: str
    symbol: str
    units: str
    long_name: str
    scale: str = ""
    flags: tuple[str, ...] = ()

    @property
    def variable_attributes(self) -> dict[str, Any]:
        """Attributes of a variable that contains the quantity.

        Empty attributes are omitted.
        """
        stated = {"long_name": self.long_name, "units": self.units, "scale": self.scale}
        return {key: text for key, text in stated.items() if text} | self.flag_attributes

    @property
    def flag_attributes(self) -> dict[str, Any]:
        """CF attributes that define the flag values and their meanings.

        The dictionary is empty if the quantity has no flags.
        """
        values = [float(number) for number in range(len(self.flags))]
        return {"flag_values": values, "flag_meanings": " ".join(self.flags)} if self.flags else {}


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Output(Quantity):
    r"""Number or array that a measure computes.

    If only a name is passed, the symbol, units and description of the output are taken from the
    shared vocabulary. If the output is not in the vocabulary, its name is used as the description.

    Parameters
    ----------
    name : str
        Name of the output in datasets and in Python.
    symbol : str, default: ""
        Mathematical symbol for axis labels, in LaTeX.
    units : str, default: "1"
        Units in the syntax of UDUNITS.
    long_name : str, default: ""
        Description of the output. The description is required if a symbol, units or a scale is
        passed.
    scale : str, default: ""
        Scale of a dimensionless output, for example "D_c/V_*". The product of value and scale is a
        quantity in SI units.
    flags : tuple of str, default: ()
        Meanings of the codes 0, 1, 2, ... of a categorical output.
    dims : tuple of str, default: ()
        Names of the dimensions of the output in a single cell of a study.
    error : bool, default: False
        If True, the measure also computes the numerical error estimate ``<name>_error``.
    optional : bool, default: False
        If True, a successful outcome may omit the output and its error estimate. If the output is
        omitted, the message of the outcome contains the reason.

    Raises
    ------
    InvalidValue
        If a symbol, units or a scale is passed without a long name.

    Examples
    --------
    >>> from rsfstudy.measures import Output
    >>> peak = Output("peak_friction", r"$\mu_{max}$", long_name="peak friction", error=True)
    >>> peak.variable_names
    ('peak_friction', 'peak_friction_error')
    """

    symbol: str = ""
    units: str = "1"
    long_name: str = ""
    dims: tuple[str, ...] = ()
    error: bool = False
    optional: bool = False

    def __post_init__(self) -> None:
        """Check that an output with a symbol, units or a scale also has a description."""
        if not self.long_name and (self.symbol or self.scale or self.units != "1"):
            rule = "must not be empty, because the output has a symbol, units or a scale"
            raise InvalidValue(f"long_name of output {self.name!r}", self.long_name, rule)

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of the output, followed by the name of its error estimate if the output has one."""
        return (self.name, f"{self.name}_error") if self.error else (self.name,)


def is_valid_variable_name(name: object) -> bool:
    """Return True if an object is a valid variable name.

    Parameters
    ----------
    name : object
        Candidate name.

    Returns
    -------
    bool
        True for Python identifiers in Unicode normalisation form C. NetCDF files normalise variable
        names to form C.
    """
    return isinstance(name, str) and name.isidentifier() and unicodedata.is_normalized("NFC", name)


def describe_invalid_variable_name(name: object) -> tuple[str, str]:
    """Return the rule that an invalid variable name violates, and a suggested remedy."""
    if isinstance(name, str) and name.isidentifier():
        rule = "is not in Unicode normalisation form NFC"
        return rule, "Convert the name with unicodedata.normalize('NFC', name)."
    return (
        "must be a Python identifier",
        "Use only letters, digits and underscores, and begin with a letter.",
    )


def format_unit_quotient(units_or_scales: Sequence[str]) -> str:
    """Format the units of a quotient of quantities.

    Parameters
    ----------
    units_or_scales : sequence of str
        Units or scales of the numerator, followed by the units or scales of the denominators.
        Denominators with the units "1" are omitted.

    Returns
    -------
    str
        Units such as ``s (um s-1)-1``. The inverse function is ``split_unit_quotient``.
    """
    first, *others = units_or_scales
    return first + "".join(f" ({each})-1" for each in others if each != "1")


def split_unit_quotient(unit_quotient: str) -> list[str]:
    """Split the units of a quotient into numerator and denominators.

    Parameters
    ----------
    unit_quotient : str
        Units in the form that ``format_unit_quotient`` returns.

    Returns
    -------
    list of str
        Units or scales of the numerator, followed by the units or scales of the denominators.
    """
    return [each.removesuffix(")-1") for each in unit_quotient.split(" (")]


def read_units_or_reference_scale(variable_attributes: Mapping[Any, Any]) -> str:
    """Return the units of a variable, or the scale of a normalised variable.

    Parameters
    ----------
    variable_attributes : mapping
        Attributes of the variable.

    Returns
    -------
    str
        Units of the variable. If the variable has a scale, the scale replaces the units of the
        numerator.
    """
    units, scale = (
        str(variable_attributes.get("units", "")),
        str(variable_attributes.get("scale", "")),
    )
    return format_unit_quotient([scale, *split_unit_quotient(units)[1:]]) if scale else units


def split_heading_into_name_and_units(text: str) -> tuple[str, str] | None:
    """Split a column heading into a name and units.

    Parameters
    ----------
    text : str
        Heading such as ``velocity (um/s)`` or ``velocity [um/s]``.

    Returns
    -------
    tuple of str or None
        Name and units. The value is None if the heading contains no units in parentheses or
        brackets.
    """
    match = _HEADING_WITH_UNITS_PATTERN.fullmatch(text.strip())
    return (match[1], match[2].strip()) if match else None


# ---- HTML tables for notebooks -------------------------------------------------------------------

#: Column headings of a table of quantities.
_QUANTITY_TABLE_HEADINGS = ("field", "symbol", "value", "unit", "meaning")
_FUNCTION_NAMES_IN_FORMULAS = ("ln", "log", "exp")
_HTML_TAG_BY_SUB_OR_SUPERSCRIPT_MARK = {"_": "sub", "^": "sup"}
_HTML_CELL_STYLE_ATTRIBUTE = 'style="text-align: left; vertical-align: top"'


class HtmlText(str):
    """String of HTML markup that needs no further escaping."""

    __slots__ = ()

    @staticmethod
    def escape(text: object) -> str:
        """Escape a string for HTML, and make control characters visible.

        Parameters
        ----------
        text : object
            Text, or an object that is converted to a string.

        Returns
        -------
        str
            Text that can be inserted in an HTML page.
        """
        return escape(escape_control_characters(str(text)))

    @classmethod
    def format_table(
        cls, headings: Sequence[str], rows: Iterable[Sequence[object]], caption: str = ""
    ) -> HtmlText:
        """Format a table in HTML.

        All strings except ``HtmlText`` objects are escaped.

        Parameters
        ----------
        headings : sequence of str
            Column headings.
        rows : iterable of sequence
            Rows of strings and numbers. Each row has one item per heading.
        caption : str, default: ""
            Text above the table.

        Returns
        -------
        HtmlText
            Table with inline styles.
        """
        above = f"<p><b>{_format_html_table_cell(caption)}</b></p>" if caption else ""
        head = "".join(
            f"<th {_HTML_CELL_STYLE_ATTRIBUTE}>{_format_html_table_cell(text)}</th>"
            for text in headings
        )
        lines = (
            "".join(
                f"<td {_HTML_CELL_STYLE_ATTRIBUTE}>{_format_html_table_cell(value)}</td>"
                for value in row
            )
            for row in rows
        )
        body = "".join(f"<tr>{line}</tr>" for line in lines)
        return cls(f"{above}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")


def format_quantities_as_html_table(
    quantities_with_values: Iterable[tuple[Quantity, object]],
    caption: str = "",
    *,
    with_values: bool = True,
) -> HtmlText:
    """Format a table of quantities in HTML.

    Parameters
    ----------
    quantities_with_values : iterable of tuple
        Pairs of a quantity and its value.
    caption : str, default: ""
        Text above the table.
    with_values : bool, default: True
        If False, the column of values is omitted.

    Returns
    -------
    HtmlText
        Table with the columns field, symbol, value, unit and meaning.
    """
    shown = [n for n, text in enumerate(_QUANTITY_TABLE_HEADINGS) if with_values or text != "value"]
    table = (_build_quantity_row(about, value) for about, value in quantities_with_values)
    return HtmlText.format_table(
        [_QUANTITY_TABLE_HEADINGS[n] for n in shown],
        ([row[n] for n in shown] for row in table),
        caption,
    )


def _build_quantity_row(quantity: Quantity, value: object) -> tuple[object, ...]:
    """Return the cells of the table row of a quantity, in the order of the headings."""
    return (
        quantity.name,
        format_symbol_as_html(quantity.symbol),
        value,
        format_unit_as_html(quantity),
        quantity.long_name,
    )


class HtmlTableMixin:
    """Base class of objects that notebooks display as a table."""

    def iterate_quantities_with_values(self) -> Iterable[tuple[Quantity, object]]:
        """Return the quantities to display, with their values.

        Subclasses must override the method.

        Returns
        -------
        iterable of tuple
            Pairs of a quantity and its value.

        Raises
        ------
        TypeError
            If the subclass does not override the method.
        """
        raise TypeError(f"{type(self).__name__} does not define the quantities")

    def _repr_html_(self) -> str:
        """Return the HTML table that notebooks display."""
        return format_quantities_as_html_table(
            self.iterate_quantities_with_values(), type(self).__name__
        )


def format_symbol_as_html(latex_symbol: str) -> HtmlText:
    """Convert a LaTeX symbol to HTML that can be displayed without MathJax.

    Parameters
    ----------
    latex_symbol : str
        Symbol of a quantity. If the symbol contains no dollar signs, it is escaped but not
        converted.

    Returns
    -------
    HtmlText
        Symbol in italics, with Greek letters, subscripts and superscripts.
    """
    if "$" not in latex_symbol:
        return HtmlText(HtmlText.escape(latex_symbol))
    text = HtmlText.escape(latex_symbol.strip("$"))
    text = re.sub(r"\\([A-Za-z]+)", lambda found: _find_html_character(found[1]), text)
    text = re.sub(r"([_^])(?:\{([^{}]*)\}|(&\w+;|.))", _format_sub_or_superscript_as_html, text)
    bare = re.sub(r"[{}]|\\.", "", text)
    return HtmlText(f"<i>{bare}</i>")


def format_unit_as_html(quantity: Quantity) -> HtmlText:
    """Format the unit of a quantity in HTML.

    Parameters
    ----------
    quantity : Quantity
        Quantity with units or a scale.

    Returns
    -------
    HtmlText
        Scale of a dimensionless quantity, or the units. The string is empty if a dimensionless
        quantity has no scale.
    """
    if quantity.scale:
        scale = quantity.scale.replace("sigma", r"\sigma")
        return format_symbol_as_html(f"${scale}$")
    return HtmlText(HtmlText.escape(quantity.units if quantity.units != "1" else ""))


def _find_html_character(latex_command: str) -> str:
    """Return the character that a LaTeX command represents.

    LaTeX and HTML use the same names for many letters and signs. Function names are returned
    unchanged, and unknown commands are removed.
    """
    return (
        latex_command
        if latex_command in _FUNCTION_NAMES_IN_FORMULAS
        else html5.get(f"{latex_command};", "")
    )


def _format_sub_or_superscript_as_html(match: re.Match[str]) -> str:
    """Format a subscript or superscript in HTML."""
    tag = _HTML_TAG_BY_SUB_OR_SUPERSCRIPT_MARK[match[1]]
    return f"<{tag}>{match[2] if match[2] is not None else match[3]}</{tag}>"


def _format_html_table_cell(value: Any) -> str:
    """Format a value for a cell of an HTML table."""
    if isinstance(value, HtmlText):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return HtmlText.escape(value)


def replace_comment_on_scales(attributes: Mapping[Any, Any], replacement: str) -> dict[Any, Any]:
    """Replace a comment that describes the ``scale`` attributes, which have been removed.

    Parameters
    ----------
    attributes : mapping of str to object
        Attributes of a dataset.
    replacement : str
        New comment.

    Returns
    -------
    dict of str to object
        Attributes with the new comment. A comment on a different subject is not replaced.
    """
    comment = str(attributes.get("comment", ""))
    replaced = (
        {"comment": replacement} if comment.startswith(_BEGINNINGS_OF_COMMENT_ON_SCALES) else {}
    )
    return {**attributes, **replaced}
