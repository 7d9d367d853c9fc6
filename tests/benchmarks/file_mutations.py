"""Random changes of bytes, text files and datasets for ``fuzz_files``."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable

import numpy as np
import xarray as xr

ESCAPE = "\x1b]0;title\x07\x1b[31m"
#: Strings that replace a number, a heading or a unit.
ODD_STRINGS = (
    "nan", "inf", "-inf", "1e400", "9" * 400, "0x10", "1,5", "1_000", "", " ", "None", "\u0663",
    "\u00b5m", ESCAPE, "\0", "1e-400", "-0", "--", "=1+1", '"', "(", ")", "um", "MPa" * 60,
    "1" * 5000, "um " * 5000, "( " * 20_000, "m/" * 20_000,
)  # fmt: skip


# ---- bytes ---------------------------------------------------------------------------------------


def damage_bytes(content: bytes, chance: random.Random) -> bytes:
    """Return a randomly damaged copy of ``content``, which may be empty."""
    found = content
    while found == content:
        found = bytes(chance.choice(_BYTE_MUTATIONS)(bytearray(content), chance))
        if not content:
            return found
    return found


def _choose_position(content: bytearray, chance: random.Random) -> tuple[int, int]:
    begins = chance.randrange(len(content) + 1)
    return begins, min(len(content), begins + chance.choice((1, 2, 8, 64, 512, 4096)))


def _truncate(content: bytearray, chance: random.Random) -> bytearray:
    return content[
        : chance.choice((0, 1, len(content) // 2, len(content) - chance.randint(1, 100)))
    ]


def _flip(content: bytearray, chance: random.Random) -> bytearray:
    for _ in range(chance.choice((1, 1, 1, 2, 8))):
        if content:
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    return content


def _swap(content: bytearray, chance: random.Random) -> bytearray:
    first, second = (_choose_position(content, chance)[0] for _ in range(2))
    size = chance.choice((1, 8, 512))
    one, other = content[first : first + size], content[second : second + size]
    if len(one) == len(other) and abs(first - second) >= size:
        content[first : first + size], content[second : second + size] = other, one
    return content


def _zero(content: bytearray, chance: random.Random) -> bytearray:
    begins, ends = _choose_position(content, chance)
    content[begins:ends] = bytes(ends - begins)
    return content


def _delete(content: bytearray, chance: random.Random) -> bytearray:
    begins, ends = _choose_position(content, chance)
    return content[:begins] + content[ends:]


def _insert(content: bytearray, chance: random.Random) -> bytearray:
    begins, ends = _choose_position(content, chance)
    return content[:begins] + chance.randbytes(max(1, ends - begins)) + content[begins:]


def _repeat(content: bytearray, chance: random.Random) -> bytearray:
    begins, ends = _choose_position(content, chance)
    return content[:ends] + content[begins:]


_BYTE_MUTATIONS: tuple[Callable[[bytearray, random.Random], bytearray], ...] = (
    _truncate, _flip, _flip, _flip, _swap, _zero, _delete, _insert, _repeat,
)  # fmt: skip


# ---- texts ---------------------------------------------------------------------------------------


def hostile_text(content: bytes, chance: random.Random) -> bytes:
    """Apply one hostile change to the content of a text file."""
    text = content.decode("utf-8", "replace")
    changed = chance.choice(_TEXT_MUTATIONS)(text, chance)
    return changed if isinstance(changed, bytes) else changed.encode("utf-8", "replace")


def _replace_field(text: str, chance: random.Random) -> str:
    fields = [*re.finditer(r"[^,;\t\n=]+", text)]
    found = chance.choice(fields) if fields else re.match("", text)
    return (
        text[: found.start()] + chance.choice(ODD_STRINGS) + text[found.end() :] if found else text
    )


def _change_line(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    at = chance.choice((0, 0, len(lines) // 2, len(lines) - 1))
    lines[at] = chance.choice((
        "", lines[at] * 2, f"{lines[at]},", f'"{lines[at]}', ESCAPE, lines[at][:7],
        ",".join(f"c{number} (um)" for number in range(20_000)), "x" * 120_000, lines[0], "#",
        f"{lines[at]}\0", lines[at].upper(), ",".join([lines[at]] * 50),
    ))  # fmt: skip
    return "\n".join(lines)


def _nest_brackets(text: str, chance: random.Random) -> str:
    signs = chance.choice((("[", "]"), ("{a=", "}"), ("a.", ""), ("(", ")"), ('"', '"')))
    depth = chance.choice((10, 5000))
    return f"{text}\nx = {signs[0] * depth}1{signs[1] * depth}\n"


def _change_rows(text: str, chance: random.Random) -> str:
    head, *rows = text.split("\n")
    kept = chance.choice(([], rows[:1], rows[:2], rows + rows, rows[::-1], rows[:1] * 500,
                          [head, *rows]))  # fmt: skip
    return "\n".join([head, *kept])


def _change_columns(text: str, chance: random.Random) -> str:
    rows = [line.split(",") for line in text.split("\n")]
    order = [*range(len(rows[0]))]
    chance.shuffle(order)
    order = chance.choice((order, order[:1], order * 2, order[1:]))
    return "\n".join(",".join(row[n] for n in order if n < len(row)) for row in rows)


def _scale_numbers(text: str, chance: random.Random) -> str:
    other = chance.choice(("nan", "inf", "0", "-1", "1e300", "1e-300", "1", "-1e308"))
    at = chance.randrange(3)
    rows = [line.split(",") for line in text.split("\n")]
    for row in rows[1:]:
        row[at % len(row)] = other
    return "\n".join(",".join(row) for row in rows)


def _change_encoding(text: str, chance: random.Random) -> bytes:
    text = text.replace("um", "\u00b5m") if chance.random() < 0.5 else text
    return text.encode(
        chance.choice(("utf-16", "utf-32", "cp1252", "utf-8-sig", "latin-1")), "replace"
    )


def _change_separator(text: str, chance: random.Random) -> str:
    text = text.replace(",", chance.choice((";", "\t", " ", "|", ",,")))
    return text.replace("\n", chance.choice(("\r\n", "\r", "\n\n", "\n", "\u2028", "\x0b")))


_TEXT_MUTATIONS: tuple[Callable[[str, random.Random], str | bytes], ...] = (
    _replace_field,
    _replace_field,
    _replace_field,
    _change_line,
    _nest_brackets,
    _change_rows,
    _change_columns,
    _scale_numbers,
    _change_encoding,
    _change_separator,
)


# ---- datasets ------------------------------------------------------------------------------------

_HOSTILE_VALUES = (
    5,
    -1.5,
    "",
    " ",
    "x",
    [1, 2],
    ["a", "b"],
    ESCAPE,
    "x" * 150_000,
    " (" * 50_000,
    "\n",
    "[",
    "$\\frac{$",
    "<script>",
    "{}",
    "9" * 400,
    "[" * 100_000,
    True,
)
_ATTRIBUTES = (
    "long_name", "units", "scale", "symbol", "flag_values", "flag_meanings", "comment", "loading",
    "refused", "calendar", "coordinates", "drawn", "despite", "dtype", "scale_factor",
)  # fmt: skip


def hostile_dataset(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    """Apply one to three hostile changes to a copy of a dataset."""
    for _ in range(chance.choice((1, 1, 2, 3))):
        dataset = chance.choice(_DATASET_MUTATIONS)(dataset.copy(deep=True), chance)
    return dataset


def _choose_variable(dataset: xr.Dataset, chance: random.Random) -> str:
    return str(chance.choice(sorted(map(str, dataset.variables))))


def _change_attribute(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    if chance.random() < 0.6:
        values = dataset[_choose_variable(dataset, chance)]
        values.attrs[chance.choice(_ATTRIBUTES)] = chance.choice(_HOSTILE_VALUES)
    else:
        dataset.attrs[chance.choice(sorted(map(str, dataset.attrs)))] = chance.choice(
            _HOSTILE_VALUES
        )
    return dataset


def _remove_variable(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    if chance.random() < 0.5:
        return dataset.drop_vars(_choose_variable(dataset, chance))
    del dataset.attrs[chance.choice(sorted(map(str, dataset.attrs)))]
    return dataset


def _change_values(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    name = _choose_variable(dataset, chance)
    shape, dims = dataset[name].shape, dataset[name].dims
    other = chance.choice((np.nan, np.inf, 0, -77, "x", ESCAPE, 10**18, 1e300, True))
    kind = object if isinstance(other, str) else None
    return dataset.drop_vars(name).assign({name: (dims, np.full(shape, other, dtype=kind))})


def _select_part(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    dimension = str(chance.choice(sorted(map(str, dataset.sizes))))
    size = dataset.sizes[dimension]
    return dataset.isel({dimension: chance.choice(([], [0], [0, 0], [*range(size)][::-1]))})


def _change_declaration(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    name = chance.choice(("declaration", "provenance", "scene"))
    if name not in dataset.attrs:
        return dataset
    plain = json.loads(dataset.attrs[name])
    inside, key = plain, chance.choice(sorted(plain))
    while isinstance(inside[key], dict | list) and inside[key] and chance.random() < 0.7:
        inside = inside[key]
        key = chance.choice([*inside] if isinstance(inside, dict) else [*range(len(inside))])
    if chance.random() < 0.2:
        del inside[key]
    else:
        inside[key] = chance.choice(
            (*_HOSTILE_VALUES, {}, [], None, 1e308, -1, 10**30, [[[]]], {"a": {}})
        )
    return dataset.assign_attrs({name: json.dumps(plain)})


def _rename_variable(dataset: xr.Dataset, chance: random.Random) -> xr.Dataset:
    name = chance.choice(("x" * 300, "a b", "\u00e9", "class", "status2", "x\x1b[31m"))
    return dataset.rename({_choose_variable(dataset, chance): name})


_DATASET_MUTATIONS: tuple[Callable[[xr.Dataset, random.Random], xr.Dataset], ...] = (
    _change_attribute,
    _change_attribute,
    _change_attribute,
    _remove_variable,
    _change_values,
    _select_part,
    _change_declaration,
    _change_declaration,
    _rename_variable,
)
