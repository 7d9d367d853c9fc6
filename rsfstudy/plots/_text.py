"""Words, symbols and numbers as figures write them."""

from __future__ import annotations

import math
import re
from typing import Any

import xarray as xr
from matplotlib.mathtext import MathTextParser

from rsfstudy.quantities import Quantity

_MATH_PARSER = MathTextParser("path")
_MATH_PATTERN = re.compile(r"((?<!\\)\$(?:[^$\\]|\\.)*\$)")
_NUMBER_PATTERN = re.compile(r"-?[\d.,]*\d")
_WORD_PATTERN = re.compile(rf"(?:{_MATH_PATTERN.pattern[1:-1]}|\\\$|[^\s$])+")
#: A space at which no line ends.
_UNBREAKABLE_SPACE = r"$\ $"

#: What results call things, and how figures write it.
_SYMBOL_REPLACEMENTS: tuple[tuple[str, str], ...] = (
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


#: Names that are enough on an axis, where files say more.
_SHORT_NAMES = {
    "a_over_b_minus_a": "",
    "critical_displacement": "critical displacement",
    "critical_velocity_ratio": "critical load point velocity",
    "critical_stiffness": "critical stiffness",
    "critical_stiffness_from_growth": "critical stiffness by growth",
    "dilatancy": "dilatancy",
    "drainage": "drainage",
    "dynamic_stress_drop": "dynamic stress drop",
    "frictional_stress": "frictional stress",
    "hold_time": "time of the hold",
    "instability_norm": "instability norm",
    "lattice_boundary": "load point velocity",
    "load_velocity_ratio": "load point velocity",
    "log10_slip_rate": "slip rate",
    "log_load_velocity_ratio": "load point velocity",
    "max_log10_slip_rate": "fastest slip rate",
    "min_log10_slip_rate": "slowest slip rate",
    "oscillation_amplitude": "amplitude",
    "oscillation_period": "period",
    "peak_log10_slip_rate": "peak slip rate",
    "slip": "slip",
    "static_stress_drop": "static stress drop",
    "stiffness_ratio": "stiffness",
}


def to_mathtext(text: Any) -> str:
    """A name or label with symbols for what stands for them, and no underscore; formulas stay as
    they are, and what only looks like one is taken literally.
    """
    parts = (
        _MATH_PATTERN.split(str(text))
        if _is_valid_mathtext(str(text))
        else [str(text).replace("$", r"\$")]
    )
    return "".join(
        part if _MATH_PATTERN.fullmatch(part) else _replace_symbols(part) for part in parts
    )


def _replace_symbols(text: str) -> str:
    for found, written in _SYMBOL_REPLACEMENTS:
        pieces = _MATH_PATTERN.split(text)
        text = "".join(
            p if _MATH_PATTERN.fullmatch(p) else re.sub(found, written, p) for p in pieces
        )
    pieces = _MATH_PATTERN.split(text)
    return "".join(p if _MATH_PATTERN.fullmatch(p) else p.replace("_", " ") for p in pieces)


def _is_valid_mathtext(text: str) -> bool:
    if text.count("$") % 2:
        return False
    try:
        _MATH_PARSER.parse(text)
    except ValueError:
        return False
    return True


def wrap_text(text: str, width: int) -> str:
    """Text in lines of `width` characters at most, never broken within a formula, nor within
    ``x = 2 y``; its own lines stay apart.
    """
    if "\n" in text:
        return "\n".join(wrap_text(line, width) for line in text.split("\n"))
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
        if lines[-1] and visible_length(" ".join([*lines[-1], word])) > width:
            lines.append([])
        lines[-1].append(word)
    return "\n".join(" ".join(line) for line in lines)


def visible_length(text: str) -> int:
    """Characters to be seen, about."""
    return len(re.sub(r"[${}^_]", "", re.sub(r"\\[a-zA-Z]+", "x", text)))


def axis_label(about: Quantity, width: int = 45) -> str:
    """Label of an axis: name of a quantity, its symbol and its units."""
    words = _SHORT_NAMES.get(about.name, about.long_name.split(":")[0])
    text = ", ".join(filter(None, (f"{words[:1].upper()}{words[1:]}", about.symbol)))
    units = about.units if about.units not in ("", "1") else about.scale * (not about.symbol)
    text = to_mathtext(text) + (
        f"{_UNBREAKABLE_SPACE}({format_units(units).replace(' ', _UNBREAKABLE_SPACE)})"
        if units
        else ""
    )
    return wrap_text(text, width).replace(_UNBREAKABLE_SPACE, " ")


def format_units(units: str) -> str:
    """Units as figures write them."""
    powers = re.sub(r"(\b[a-zA-Z]+|\))(-?\d)\b", r"\1$^{\2}$", units)
    return to_mathtext(re.sub(r"\bum\b", r"$\\mu$m", powers))


def quantity_symbol(about: Quantity) -> str:
    """Its symbol, or else its name in words."""
    return to_mathtext(about.symbol or about.name)


def format_number(value: float, digits: int = 3) -> str:
    """A number of so many digits; with a power of ten where it is far from 1."""
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(float(text)) < 1e5:
        text = f"{float(text):,.0f}"
    return to_mathtext(text)


def format_with_error(value: float, error: float, most: int | None = None) -> str:
    """A value and its error, to the first digit of the error; the value alone where the
    error is too small to show in at most so many digits behind the point.
    """
    if not math.isfinite(value) or not math.isfinite(error):
        return "unknown"
    if most is not None and error < 0.5 * 10.0**-most:
        return f"${value:.{most}f}$"
    digits = max(1, math.ceil(-math.log10(error))) if error > 0.0 else 4
    return rf"${value:.{digits}f} \pm {error:.{digits}f}$"


def format_slope(row: xr.Dataset, name: str, most: int | None = None) -> str:
    """A slope, as `format_with_error` writes it: its standard error, which tells of misfit, and the
    numerical one.
    """
    numerical = float(row[f"{name}_error"]) if f"{name}_error" in row else 0.0
    return format_with_error(float(row[name]), float(row[f"{name}_stderr"]) + numerical, most)


def format_stiffness_ratio(ratio: float) -> str:
    """A stiffness in units of the critical one at V_*."""
    return "$k = k_{cr}$" if ratio == 1.0 else rf"$k = {ratio:g}\,k_{{cr}}$"
