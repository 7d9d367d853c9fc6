"""Functions that format labels, symbols, units and numbers for figures."""

from __future__ import annotations

import math
import re
from typing import Any

import xarray as xr
from matplotlib.mathtext import MathTextParser

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.quantities import Quantity

_MATHTEXT_PARSER = MathTextParser("path")
_MATHTEXT_PATTERN = re.compile(r"((?<!\\)\$(?:[^$\\]|\\.)*\$)")
_NUMBER_PATTERN = re.compile(r"-?[\d.,]*\d")
_WORD_PATTERN = re.compile(rf"(?:{_MATHTEXT_PATTERN.pattern[1:-1]}|\\\$|[^\s$])+")
#: Non-breaking space.
_NON_BREAKING_SPACE = r"$\ $"

#: Patterns of symbols in datasets, and their replacements in mathtext.
_MATHTEXT_REPLACEMENTS_OF_SYMBOLS: tuple[tuple[str, str], ...] = (
    (r"\bk_cr\(V_\*\)", r"$k_{cr}(V_*)$"),
    (r"\ba/\(b-a\)", r"$a/(b-a)$"),
    (r"\bb/a\b", r"$b/a$"),
    (r"\bk_cr\b", r"$k_{cr}$"),
    (r"\b([VDbL])_([0c12])\b", r"$\1_\2$"),
    (r"\bV_(?:\*|star\b)", r"$V_*$"),
    (r"\b(sigma|mu)_(?:\*|star\b)", r"$\\\1_*$"),
    (r"\bmu_ss\b", r"$\\mu_{ss}$"),
    (r"\b(alpha|phi|lambda|zeta|theta|Theta)\b", r"$\\\1$"),
    (r"\beps\b", r"$\\epsilon$"),
    (r"\b10\^(-?\d+)", r"$10^{\1}$"),
    (r"\b1e\+?(-?)0*(\d+)\b", r"$10^{\1\2}$"),
    (r"\b(\d+(?:\.\d+)?)e\+?(-?)0*(\d+)\b", r"$\1\\times10^{\2\3}$"),
)


#: Short names of quantities for axis labels. The names in files are longer.
_SHORT_AXIS_LABEL_BY_QUANTITY = {
    "a_over_b_minus_a": "",
    "critical_displacement": "critical displacement",
    "critical_velocity_ratio": "critical load point velocity",
    "critical_stiffness": "critical stiffness",
    "critical_stiffness_from_growth": "critical stiffness from growth rate",
    "dilatancy": "dilatancy",
    "drainage": "drainage",
    "dynamic_stress_drop": "dynamic stress drop",
    "frictional_stress": "frictional stress",
    "hold_time": "hold time",
    "instability_norm": "instability norm",
    "lattice_boundary": "load point velocity",
    "load_velocity_ratio": "load point velocity",
    "log10_slip_rate": "slip rate",
    "log_load_velocity_ratio": "load point velocity",
    "max_log10_slip_rate": "maximum slip rate",
    "min_log10_slip_rate": "minimum slip rate",
    "oscillation_amplitude": "amplitude",
    "oscillation_period": "period",
    "peak_log10_slip_rate": "peak slip rate",
    "porosity_length": "porosity length",
    "slip": "slip",
    "static_stress_drop": "static stress drop",
    "stiffness_ratio": "stiffness",
}

#: Shorter names of quantities, for axis labels that would otherwise need several lines. An empty
#: name means that the label consists of the symbol only.
_AXIS_LABEL_IF_NARROW_BY_QUANTITY = {"b_over_a": "", "critical_velocity_ratio": "critical velocity"}


def convert_symbols_to_mathtext(text: Any) -> str:
    """Convert the symbols in a string to mathtext.

    Underscores outside formulas are replaced by spaces. Formulas between dollar signs are not
    changed. If the string is not valid mathtext, the dollar signs are displayed literally.

    Parameters
    ----------
    text : str or object
        Name or label. Other objects are converted to a string first.

    Returns
    -------
    str
        String for a matplotlib label.
    """
    parts = (
        _MATHTEXT_PATTERN.split(str(text))
        if _is_valid_mathtext(str(text))
        else [str(text).replace("$", r"\$")]
    )
    return "".join(
        part if _MATHTEXT_PATTERN.fullmatch(part) else _replace_symbols_outside_formulas(part)
        for part in parts
    )


def _replace_symbols_outside_formulas(text: str) -> str:
    """Replace symbols and underscores outside formulas."""
    for found, written in _MATHTEXT_REPLACEMENTS_OF_SYMBOLS:
        pieces = _MATHTEXT_PATTERN.split(text)
        text = "".join(
            p if _MATHTEXT_PATTERN.fullmatch(p) else re.sub(found, written, p) for p in pieces
        )
    pieces = _MATHTEXT_PATTERN.split(text)
    return "".join(p if _MATHTEXT_PATTERN.fullmatch(p) else p.replace("_", " ") for p in pieces)


def _is_valid_mathtext(text: str) -> bool:
    """Return True if matplotlib can display a string."""
    if text.count("$") % 2:
        return False
    try:
        _MATHTEXT_PARSER.parse(text)
    except ValueError:
        return False
    return True


def wrap_text(text: str, max_line_characters: int) -> str:
    """Wrap a string without breaking formulas.

    Existing line breaks are kept. An equation such as ``x = 2 y`` is never broken across lines.

    Parameters
    ----------
    text : str
        String, which may contain mathtext.
    max_line_characters : int
        Maximum number of visible characters per line. Words and formulas that are longer than a
        line are placed on separate lines.

    Returns
    -------
    str
        String with line breaks.
    """
    if "\n" in text:
        return "\n".join(wrap_text(line, max_line_characters) for line in text.split("\n"))
    words: list[str] = []
    for word in _WORD_PATTERN.findall(text):
        last = words[-1].split()[-2:] if words else [""]
        with_units = last[0] == "=" and _NUMBER_PATTERN.fullmatch(last[-1])
        if words and ("=" in (word, last[-1]) or with_units):
            words[-1] += f" {word}"
        else:
            words.append(word)
    lines: list[list[str]] = [[]]
    for word in words:
        if (
            lines[-1]
            and estimate_visible_character_count(" ".join([*lines[-1], word])) > max_line_characters
        ):
            lines.append([])
        lines[-1].append(word)
    return "\n".join(" ".join(line) for line in lines)


def estimate_visible_character_count(text: str) -> int:
    """Estimate the number of visible characters of a string.

    Parameters
    ----------
    text : str
        String, which may contain mathtext.

    Returns
    -------
    int
        Number of characters. Each mathtext command is counted as one character.
    """
    return len(re.sub(r"[${}^_]", "", re.sub(r"\\[a-zA-Z]+", "x", text)))


def format_quantity_axis_label(quantity: Quantity, max_line_characters: int = 45) -> str:
    """Return an axis label with the name, symbol and units of a quantity.

    Parameters
    ----------
    quantity : Quantity
        Quantity along the axis.
    max_line_characters : int, default: 45
        Maximum number of visible characters per line. Some quantities have a shorter name, which is
        used if the label does not fit on one line.

    Returns
    -------
    str
        Label in mathtext. If the quantity has neither units nor a symbol, the label contains the
        scale instead of units.
    """
    words = _SHORT_AXIS_LABEL_BY_QUANTITY.get(quantity.name, quantity.long_name.split(":")[0])
    label = _format_axis_label_with_name(quantity, words, max_line_characters)
    if "\n" in label and quantity.symbol and quantity.name in _AXIS_LABEL_IF_NARROW_BY_QUANTITY:
        words = _AXIS_LABEL_IF_NARROW_BY_QUANTITY[quantity.name]
        label = _format_axis_label_with_name(quantity, words, max_line_characters)
    return label


def _format_axis_label_with_name(quantity: Quantity, words: str, max_line_characters: int) -> str:
    """Return an axis label that starts with the given name of a quantity."""
    text = ", ".join(filter(None, (f"{words[:1].upper()}{words[1:]}", quantity.symbol)))
    units = (
        quantity.units
        if quantity.units not in ("", "1")
        else quantity.scale * (not quantity.symbol)
    )
    text = convert_symbols_to_mathtext(text) + (
        f"{_NON_BREAKING_SPACE}({format_units(units).replace(' ', _NON_BREAKING_SPACE)})"
        if units
        else ""
    )
    return wrap_text(text, max_line_characters).replace(_NON_BREAKING_SPACE, " ")


def format_units(units: str) -> str:
    """Format units in mathtext.

    Parameters
    ----------
    units : str
        UDUNITS string, for example ``"um s-1"``.

    Returns
    -------
    str
        Units in mathtext, with powers as superscripts.
    """
    powers = re.sub(r"(\b[a-zA-Z]+|\))(-?\d)\b", r"\1$^{\2}$", units)
    return convert_symbols_to_mathtext(re.sub(r"\bum\b", r"$\\mu$m", powers))


def find_quantity_symbol_or_name(quantity: Quantity) -> str:
    """Return the symbol of a quantity, or its name if there is no symbol.

    Parameters
    ----------
    quantity : Quantity
        Quantity of a dataset.

    Returns
    -------
    str
        Symbol or name in mathtext.
    """
    return convert_symbols_to_mathtext(quantity.symbol or quantity.name)


def format_number(value: float, digits: int = 3) -> str:
    """Format a number in mathtext with a fixed number of significant digits.

    Parameters
    ----------
    value : float
        Number to format.
    digits : int, default: 3
        Number of significant digits.

    Returns
    -------
    str
        Number in mathtext. Numbers that are much larger or much smaller than 1 are written with a
        power of ten.

    Examples
    --------
    >>> from rsfstudy.plots import format_number
    >>> format_number(0.66421)
    '0.664'
    >>> format_number(1e-8)
    '$10^{-8}$'
    """
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(float(text)) < 1e5:
        text = f"{float(text):,.0f}"
    return convert_symbols_to_mathtext(text)


def format_value_with_error(value: float, error: float, max_decimals: int | None = None) -> str:
    r"""Format a value and its error, rounded to the first significant digit of the error.

    The formatted value has at least one decimal place.

    Parameters
    ----------
    value : float
        Value to format.
    error : float
        Error of the value, for example its standard error.
    max_decimals : int, optional
        Maximum number of decimal places. If the error would be rounded to zero, it is omitted. By
        default, the error is always included.

    Returns
    -------
    str
        Formula such as ``$0.66 \pm 0.02$``, or "unknown" if the value or the error is not finite.
    """
    if not math.isfinite(value) or not math.isfinite(error):
        return "unknown"
    if max_decimals is not None and error < 0.5 * 10.0**-max_decimals:
        return f"${value:.{max_decimals}f}$"
    digits = max(1, math.ceil(-math.log10(error))) if error > 0.0 else 4
    return rf"${value:.{digits}f} \pm {error:.{digits}f}$"


@accept_former_keyword_names
def format_slope(row: xr.Dataset, name: str, max_decimals: int | None = None) -> str:
    r"""Format a slope and its error.

    The error is the sum of the standard error and the numerical error. The standard error measures
    the scatter of the data about the fitted line.

    Parameters
    ----------
    row : xarray.Dataset
        Results for one line. The scalar variables ``name`` and ``<name>_stderr`` are required, and
        the variable ``<name>_error`` is optional.
    name : str
        Name of the slope.
    max_decimals : int, optional
        Maximum number of decimal places. If the error would be rounded to zero, it is omitted. By
        default, the error is always included.

    Returns
    -------
    str
        Formula in mathtext, or "unknown" if the slope or its error is not finite.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.plots import format_slope
    >>> row = xr.Dataset({"zeta": 0.6642, "zeta_stderr": 0.002, "zeta_error": 1e-7})
    >>> print(format_slope(row, "zeta"))
    $0.664 \pm 0.002$
    """
    numerical = float(row[f"{name}_error"]) if f"{name}_error" in row else 0.0
    return format_value_with_error(
        float(row[name]), float(row[f"{name}_stderr"]) + numerical, max_decimals
    )


def format_stiffness_ratio(ratio: float) -> str:
    """Format a stiffness relative to the critical stiffness.

    Parameters
    ----------
    ratio : float
        Stiffness divided by the critical stiffness at :math:`V_*`.

    Returns
    -------
    str
        Equation in mathtext.
    """
    return "$k = k_{cr}$" if ratio == 1.0 else rf"$k = {ratio:g}\,k_{{cr}}$"
