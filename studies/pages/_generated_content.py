"""What the pages of the site say from the code: each line ``<!-- made: NAME -->`` of a page is
followed by the text of that name.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from functools import cache
from typing import Any

import click
from _examples import CALLS, SCENES  # type: ignore[import-not-found]

import rsfstudy
from rsfstudy import Study, measures
from rsfstudy import reductions as reduce
from rsfstudy.cli.command_line import cli
from rsfstudy.measures import Measure, Output, Quantity, Status
from rsfstudy.parts import Part
from rsfstudy.quantities import html_symbol as in_html
from rsfstudy.quantities import html_unit as unit_in_html
from rsfstudy.reductions import Reduction
from rsfstudy.rig import quantities
from rsfstudy.slider import field_names, registry
from rsfstudy.study import catalogue, study_index
from rsfstudy.study.verdict_table import format_published_value
from rsfstudy.vocabulary import QUANTITIES, find_quantity

#: Where classes stand that parts, measures and studies of one's own are derived from or made of.
CLASSES = {
    "Law": "rsfstudy.parts",
    "LawBase": "rsfstudy.parts",
    "NormalStress": "rsfstudy.parts",
    "Fluid": "rsfstudy.parts",
    "Dynamics": "rsfstudy.parts",
    "Loading": "rsfstudy.parts",
    "Measure": "rsfstudy.measures",
    "Outcome": "rsfstudy.measures",
    "Output": "rsfstudy.measures",
    "Reduction": "rsfstudy.reductions",
    "Stepper": "rsfstudy.motion.steppers",
}


def fill_page(text: str) -> str:
    """A page with what is made.

    Raises
    ------
    KeyError
        For a name that nothing here makes.
    """
    return re.sub(r"<!-- made: (\w+) -->", lambda found: MADE[found[1]](), text)


def escape_asterisks(text: str) -> str:
    """A page on which the asterisk of V_* begins no emphasis: code is left as it is."""
    parts = re.split(
        r"((?:^    [^\n]*\n)+|^```.*?^```|`[^`\n]+(?:\n[^`\n]+)*`)",
        text,
        flags=re.MULTILINE | re.DOTALL,
    )
    return "".join(part if n % 2 else part.replace("_*", "_\\*") for n, part in enumerate(parts))


def markdown_table(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown; empty without rows."""
    lines = [[_cell(value) for value in row] for row in rows]
    head = list(headings)
    texts = [head, ["---"] * len(head), *lines] if lines else []
    return "\n".join(f"| {' | '.join(line)} |" for line in texts)


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return re.sub(r"\s+", " ", text).replace("|", "\\|")


def strip_markup(text: str) -> str:
    """A text without meaning to Markdown but what stands in ``double`` or `single` quotes."""
    parts = re.split(r"(``.+?``|`.+?`)", text, flags=re.DOTALL)
    return "".join(
        part if n % 2 else re.sub(r"([*_<\[])", r"\\\1", part) for n, part in enumerate(parts)
    )


def html_symbol(formula: str) -> str:
    """A symbol in HTML that Markdown leaves alone."""
    return in_html(formula).replace("*", "&ast;")


def html_unit(about: Quantity) -> str:
    """A unit in HTML that Markdown leaves alone."""
    return unit_in_html(about).replace("*", "&ast;")


def first_paragraph(thing: object) -> str:
    """The first paragraph of a docstring."""
    return strip_markup((inspect.getdoc(thing) or "").split("\n\n")[0])


# ---- the slider ----------------------------------------------------------------------------------


def scene_fields() -> str:
    """Every field of a scene, in the order of its parts."""
    abouts = {about.name: about for about in registry.FIELD_QUANTITIES}
    defaults = registry.field_defaults()
    rows = (
        (
            f"`{name}`",
            html_symbol(about.symbol),
            html_unit(about),
            _default(name, defaults),
            _rule(name),
            strip_markup(about.long_name),
            _parts_with(name),
        )
        for name, about in ((name, abouts[name]) for name in registry.FIELD_NAMES)
    )
    return markdown_table(("field", "symbol", "unit", "default", "rule", "meaning", "of"), rows)


def _default(name: str, defaults: Mapping[str, Any]) -> object:
    value = defaults[name]
    return f"`{value}`" if isinstance(value, str) else value


def _rule(name: str) -> str:
    owner = registry.FIELD_OWNERS.get(name)
    if owner is None:
        return ""
    return (
        str(owner.__dataclass_fields__[name].metadata["rule"])
        .removeprefix("must ")
        .removeprefix("be ")
    )


def _parts_with(name: str) -> str:
    """The parts that bring a field to a scene: nothing where every scene has it."""
    owners = [
        f"`{part.name}`"
        for slot in registry.SLOTS
        for part in slot.choices.values()
        if name in field_names(part)
    ]
    return ", ".join(owners)


def parts() -> str:
    """Every choice of each slot."""
    return "\n\n".join(_slot(slot) for slot in registry.SLOTS)


def _slot(slot: registry.Slot) -> str:
    rows = (
        (f"`{name}`" + (" (default)" if name == slot.default else ""), first_paragraph(part),
         equation(part), ", ".join(f"`{own}`" for own in field_names(part)), f"`{SCENES[name]}`")
        for name, part in slot.choices.items()
    )  # fmt: skip
    made = markdown_table(("choice", "what it is", "equation", "its fields", "example"), rows)
    called = "" if not slot.selectors else " A field of the choice, stated, calls for it."
    return f"### {slot.name}\n\n{slot.long_name.capitalize()}.{called}\n\n{made}"


def equation(part: type[Part]) -> str:
    """Return the equations of a part in LaTeX, for Markdown.

    If the docstring of the part contains no equations, the function uses the docstrings of the
    static methods of the part.
    """
    functions = [value.__func__ for value in vars(part).values() if isinstance(value, staticmethod)]
    equations = _docstring_equations(part) or [
        found for function in functions for found in _docstring_equations(function)
    ]
    return ", ".join(f"${found}$" for found in dict.fromkeys(equations))


def _docstring_equations(documented: object) -> list[str]:
    """Return the equations in the ``.. math::`` and ``:math:`` markup of a docstring.

    Parameters, results, references and examples are not searched.
    """
    text = re.sub(
        r"^(?!Notes$)[A-Z][A-Za-z ]+\n-{3,}\n.*?(?=^[A-Z][A-Za-z ]+\n-{3,}\n|\Z)",
        "",
        inspect.getdoc(documented) or "",
        flags=re.MULTILINE | re.DOTALL,
    )
    displayed = re.findall(r"^\.\. math::\n\n((?: +\S.*\n?|\n)+)", text, flags=re.MULTILINE)
    paragraphs = [part for block in displayed for part in block.split("\n\n")]
    inline = [] if displayed else re.findall(r":math:`([^`]+)`", text)
    joined = (" ".join(found.split()).rstrip(".,") for found in (*paragraphs, *inline))
    equations = [found for line in joined for found in re.split(r",? \\quad ", line)]
    return [found for found in equations if "=" in found]


def rig() -> str:
    """The quantities of a rig."""
    must = {name: name in quantities.REQUIRED_QUANTITIES for name in quantities.RIG_QUANTITIES}
    rows = (
        (f"`{name}`", units, must[name], f"{least:g} to {most:g}")
        for name, (units, least, most, *_words) in quantities.RIG_QUANTITIES.items()
    )
    return markdown_table(("quantity", "SI unit", "must be stated", "usual, in that unit"), rows)


# ---- measures, reductions, statuses --------------------------------------------------------------


def measure_classes() -> dict[str, type[Measure]]:
    """The measures of rsfstudy, by name."""
    exported = (getattr(measures, name) for name in measures.__all__)
    own = (kind for kind in exported if isinstance(kind, type) and issubclass(kind, Measure))
    return {kind.name: kind for kind in own if "name" in vars(kind)}


def _examples() -> dict[type[Measure], Measure]:
    """A measure of each kind: as it is without fields, or as a named study states it."""
    stated = {type(study.measure): study.measure for study in _studies().values()}
    for kind in measure_classes().values():
        if all(f.default is not MISSING or f.default_factory is not MISSING for f in fields(kind)):
            stated[kind] = kind()
    return stated


def every_measure() -> str:
    """Every measure: what it finds, its fields, its numbers."""
    examples = _examples()
    return "\n\n".join(_measure(kind, examples.get(kind)) for kind in measure_classes().values())


def _measure(kind: type[Measure], example: Measure | None) -> str:
    taken = markdown_table(("field", "default", "meaning"), _describe_fields(kind))
    given = markdown_table(
        ("number", "symbol", "unit", "error estimate", "over", "meaning"),
        map(_output, example.outputs if example else ()),
    )
    headline = (
        f"Headline: `{example.primary_output}`." if example else "Its numbers follow its fields."
    )
    source = measures if kind.__name__ in measures.__all__ else sys.modules[kind.__module__]
    home = f"`from {source.__name__} import {kind.__name__}`"
    stated = (study.measure for study in _studies().values())
    words = f"{first_paragraph(kind)} {headline} {home}{_format_call(kind, stated)}"
    return "\n\n".join(filter(None, (f"### {kind.__name__}", words, taken, given)))


@cache
def _studies() -> dict[str, Study]:
    """The named studies."""
    return {name: catalogue.load_study(name) for name in study_index.study_names()}


def _format_call(kind: type[Any], stated: Iterable[Measure | Reduction]) -> str:
    """An example, with what the first study states that leaves not all to defaults."""
    found = [
        ", ".join(
            f"{one.name}={getattr(each, one.name)!r}"
            for one in fields(kind)
            if one.init and getattr(each, one.name) != one.default
        )
        for each in stated
        if type(each) is kind
    ]
    call = f"{kind.__name__}({next(filter(None, found), '')})" if found else CALLS[kind.__name__]
    return f" Example: `{call}`."


def _describe_fields(kind: type[Any]) -> Iterator[tuple[object, ...]]:
    """Fields of a measure or a reduction, with what its docstring says of them."""
    told = parameters(kind)
    for one in fields(kind):
        if one.init:
            value = one.default if one.default is not MISSING else "must be stated"
            shown = f"`{value!r}`" if one.default is not MISSING else value
            yield f"`{one.name}`", shown, told.get(one.name, "")


def parameters(kind: type[Any]) -> dict[str, str]:
    """What the docstrings of a class and its bases say of each parameter."""
    told: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        text = inspect.cleandoc(vars(one).get("__doc__") or "")
        section = re.search(r"Parameters\n-+\n(.*?)(?=\n\n\w+\n-+\n|\Z)", text, re.DOTALL)
        entries = (
            re.findall(r"^(\S.*) : .*\n((?:    .*\n?|\n)+)", section[1] + "\n", re.M)
            if section
            else []
        )
        for named, meaning in entries:
            told |= {
                name.strip(): strip_markup(" ".join(meaning.split())) for name in named.split(",")
            }
    return told


def _output(output: Output) -> tuple[object, ...]:
    about: Quantity = output if output.long_name else find_quantity(output.name)
    return (f"`{output.name}`", html_symbol(about.symbol), html_unit(about), output.error,
            ", ".join(output.dims), strip_markup(about.long_name))  # fmt: skip


def reductions() -> str:
    """Every reduction, with its fields."""
    kinds = (getattr(reduce, name) for name in reduce.__all__)
    own = (
        k for k in kinds if isinstance(k, type) and issubclass(k, Reduction) and k is not Reduction
    )
    stated = [one for study in _studies().values() for one in study.reductions]
    return "\n\n".join(
        f"### {kind.__name__}\n\n{first_paragraph(kind)}{_format_call(kind, stated)}\n\n"
        + markdown_table(("field", "default", "meaning"), _describe_fields(kind))
        for kind in own
    )


def claims() -> str:
    """Every claim of the named studies."""
    rows = (
        (f"`{name}`", claim.id, strip_markup(claim.statement), strip_markup(claim.source),
         format_published_value(claim.describe()), claim.tolerance, strip_markup(claim.because))
        for name, study in _studies().items()
        for claim in study.claims
    )  # fmt: skip
    headings = ("study", "id", "claim", "source", "published", "tolerance", "differs because")
    return markdown_table(headings, rows)


def statuses() -> str:
    """Every status of a cell."""
    return markdown_table(
        ("status", "flag", "kind", "meaning"),
        ((f"`{s.label}`", int(s), "answer" if s.is_answer else "failure", strip_markup(s.meaning))
         for s in Status),
    )  # fmt: skip


def vocabulary() -> str:
    """Every number of datasets that several studies share, but for fields of scenes."""
    rows = (
        (
            f"`{about.name}`",
            html_symbol(about.symbol),
            html_unit(about),
            strip_markup(about.long_name),
        )
        for about in QUANTITIES.values()
        if about.name not in registry.FIELD_NAMES
    )
    return markdown_table(("name", "symbol", "unit", "meaning"), rows)


# ---- the command line, and Python ----------------------------------------------------------------


def commands() -> str:
    """Every command with its arguments and options."""
    return "\n\n".join(_command(name, command) for name, command in cli.commands.items())


def _command(name: str, command: click.Command) -> str:
    # without "[OPTIONS]", which the table lists
    taken = " ".join(command.collect_usage_pieces(click.Context(command))[1:])
    rows = (
        (
            ", ".join(f"`{text}`" for text in (*option.opts, *option.secondary_opts)),
            _describe_option(option),
            strip_markup(option.help or ""),
        )
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden
    )
    words = strip_markup(inspect.cleandoc((command.help or "").split("\f")[0]).replace("\b\n", ""))
    made = markdown_table(("option", "default", "meaning"), rows)
    return f"### rsfstudy {name}\n\n`rsfstudy {name} {taken}`\n\n{words}\n\n{made}"


def _describe_option(option: click.Option) -> str:
    if option.is_flag or option.default in (None, (), []) or callable(option.default):
        return ""
    return "" if type(option.default).__name__ == "Sentinel" else f"`{option.default}`"


def python() -> str:
    """Entries of the public names, for autodoc."""
    return "\n\n".join(map(_entry, rsfstudy.__all__))


def accessor() -> str:
    """Entry of ``dataset.rsf``."""
    return _rst("autoclass:: rsfstudy.api.accessor.Accessor", "members:")


def classes() -> str:
    """Entries of what is derived from, or handed over, by studies of one's own."""
    return "\n\n".join(
        f"### {name}\n\n" + _rst(f"autoclass:: {home}.{name}", "members:", "show-inheritance:")
        for name, home in CLASSES.items()
    )


def _entry(name: str) -> str:
    kind = "class" if isinstance(getattr(rsfstudy, name), type) else "function"
    return f"### {name}\n\n" + _rst(
        f"auto{kind}:: rsfstudy.{name}", *["members:"] * (kind == "class")
    )


def _rst(directive: str, *options: str) -> str:
    lines = "".join(f"   :{option}\n" for option in options)
    return f"```{{eval-rst}}\n.. {directive}\n{lines}```"


#: What makes the text of each name.
MADE: dict[str, Callable[[], str]] = {
    one.__name__: one
    for one in (scene_fields, parts, rig, every_measure, reductions, claims, statuses, vocabulary,
                commands, python, accessor, classes)
}  # fmt: skip
