"""Content of the site that is generated from the code.

A line ``<!-- made: NAME -->`` of a page is replaced by the return value of the function ``NAME``.
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
from _object_pages import (  # type: ignore[import-not-found]
    NAMESPACES,
    PublicObject,
    constants,
    further_objects,
    public_objects,
)

from rsfstudy import Study, measures
from rsfstudy import reductions as reduce
from rsfstudy.cli.command_line import cli
from rsfstudy.measures import Measure, Output, Quantity, Status
from rsfstudy.parts import Part
from rsfstudy.quantities import format_symbol_as_html as in_html
from rsfstudy.quantities import format_unit_as_html as unit_in_html
from rsfstudy.reductions import Reduction
from rsfstudy.rig import rig_quantities
from rsfstudy.slider import SceneFields, part_registry
from rsfstudy.study import named_study_index, study_loader
from rsfstudy.study.claim_verdict_table import format_published_value
from rsfstudy.vocabulary import QUANTITY_BY_NAME, find_quantity

#: Headings of the tables of claims.
CLAIM_HEADINGS = ("id", "claim", "source", "published", "tolerance", "differs because")


def fill_page(text: str) -> str:
    """Insert the generated content into a page.

    Parameters
    ----------
    text : str
        Page in Markdown.

    Returns
    -------
    str
        Page with the generated content.

    Raises
    ------
    KeyError
        If a line of the page contains the name of an unknown function.
    """
    return re.sub(r"<!-- made: (\w+) -->", lambda found: MADE[found[1]](), text)


def escape_asterisks(text: str) -> str:
    """Escape the asterisks of symbols such as V_*.

    Unescaped asterisks would start emphasised text.

    Code and formulas are not changed.

    Parameters
    ----------
    text : str
        Page in Markdown.

    Returns
    -------
    str
        Page with escaped asterisks.
    """
    parts = re.split(
        r"((?:^    [^\n]*\n)+|^```.*?^```|`[^`\n]+(?:\n[^`\n]+)*`|\$\$.*?\$\$|\$[^$\n]+\$)",
        text,
        flags=re.MULTILINE | re.DOTALL,
    )
    return "".join(part if n % 2 else part.replace("_*", "_\\*") for n, part in enumerate(parts))


def markdown_table(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Format a table in Markdown.

    Parameters
    ----------
    headings : sequence of str
        Headings of the columns.
    rows : sequence of sequence of object
        Rows of the table.

    Returns
    -------
    str
        Table in Markdown. The string is empty if there are no rows.
    """
    lines = [[_cell(value) for value in row] for row in rows]
    head = list(headings)
    texts = [head, ["---"] * len(head), *lines] if lines else []
    return "\n".join(f"| {' | '.join(line)} |" for line in texts)


def _cell(value: object) -> str:
    """Format a value for a cell of a Markdown table."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return re.sub(r"\s+", " ", text).replace("|", "\\|")


def strip_markup(text: str) -> str:
    """Escape characters that have a meaning in Markdown.

    Text in single or double backticks is not changed.

    Parameters
    ----------
    text : str
        Text without Markdown.

    Returns
    -------
    str
        Text with escaped characters.
    """
    parts = re.split(r"(``.+?``|`.+?`)", text, flags=re.DOTALL)
    return "".join(
        part if n % 2 else re.sub(r"([*_<\[])", r"\\\1", part) for n, part in enumerate(parts)
    )


def html_symbol(formula: str) -> str:
    """Convert a symbol to HTML that is safe in Markdown.

    Parameters
    ----------
    formula : str
        Symbol in LaTeX.

    Returns
    -------
    str
        Symbol in HTML.
    """
    return in_html(formula).replace("*", "&ast;")


def html_unit(about: Quantity) -> str:
    """Convert the unit of a quantity to HTML that is safe in Markdown.

    Parameters
    ----------
    about : Quantity
        Quantity.

    Returns
    -------
    str
        Unit in HTML.
    """
    return unit_in_html(about).replace("*", "&ast;")


def first_paragraph(thing: object) -> str:
    """Return the first paragraph of a docstring.

    Parameters
    ----------
    thing : object
        Object with a docstring.

    Returns
    -------
    str
        First paragraph with escaped characters.
    """
    return strip_markup((inspect.getdoc(thing) or "").split("\n\n")[0])


# ---- the slider ----------------------------------------------------------------------------------


def scene_fields() -> str:
    """Format a table of all fields of a scene, in the order of the components.

    Returns
    -------
    str
        Table in Markdown.
    """
    abouts = {about.name: about for about in part_registry.SCENE_FIELD_QUANTITIES}
    defaults = part_registry.collect_scene_field_defaults()
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
        for name, about in ((name, abouts[name]) for name in part_registry.SCENE_FIELD_NAMES)
    )
    return markdown_table(("field", "symbol", "unit", "default", "rule", "meaning", "part"), rows)


def _default(name: str, defaults: Mapping[str, Any]) -> object:
    """Format the default of a field."""
    value = defaults[name]
    return f"`{value}`" if isinstance(value, str) else value


def _rule(name: str) -> str:
    """Return the rule for the values of a field."""
    owner = part_registry.PART_CLASS_BY_FIELD_NAME.get(name)
    if owner is None:
        return ""
    return (
        str(owner.__dataclass_fields__[name].metadata["rule"])
        .removeprefix("must ")
        .removeprefix("be ")
    )


def _parts_with(name: str) -> str:
    """Return the names of the scene components that have a field.

    Parameters
    ----------
    name : str
        Name of the field.

    Returns
    -------
    str
        Names of the components. The string is empty if all scenes have the field.
    """
    owners = [
        f"`{part.name}`"
        for slot in part_registry.PART_SLOTS
        for part in slot.built_in_parts.values()
        if name in SceneFields.list_part_field_names(part)
    ]
    return ", ".join(owners)


def parts() -> str:
    """Format tables of all built-in friction laws and other scene components.

    Returns
    -------
    str
        Sections in Markdown.
    """
    return "\n\n".join(_slot(slot) for slot in part_registry.PART_SLOTS)


def _slot(slot: part_registry.PartSlot) -> str:
    """Format the section of a type of component, such as the friction law."""
    rows = (
        (f"`{name}`" + (" (default)" if name == slot.default_part_name else ""),
         first_paragraph(part), equation(part),
         ", ".join(f"`{own}`" for own in SceneFields.list_part_field_names(part)),
         f"`{SCENES[name]}`")
        for name, part in slot.built_in_parts.items()
    )  # fmt: skip
    made = markdown_table(("choice", "description", "equation", "fields", "example"), rows)
    called = (
        ""
        if not slot.part_class_by_selecting_field
        else " A choice is selected if you pass one of its fields."
    )
    return f"## {slot.name}\n\n{slot.long_name.capitalize()}.{called}\n\n{made}"


def equation(part: type[Part]) -> str:
    """Return the equations in the docstrings of a part.

    If the docstring of the part contains no equations, the function uses the docstrings of the
    static methods of the part.

    Parameters
    ----------
    part : type[Part]
        Class of the part.

    Returns
    -------
    str
        Equations in LaTeX between dollar signs, separated by commas.
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
    """Format a table of the quantities of a rig.

    Returns
    -------
    str
        Table in Markdown.
    """
    must = {
        name: name in rig_quantities.REQUIRED_RIG_QUANTITIES
        for name in rig_quantities.RIG_QUANTITIES
    }
    rows = (
        (f"`{name}`", units, must[name], f"{least:g} to {most:g}")
        for name, (units, least, most, *_words) in rig_quantities.RIG_QUANTITIES.items()
    )
    return markdown_table(("quantity", "SI unit", "required", "usual range in SI units"), rows)


# ---- measures, reductions, statuses --------------------------------------------------------------


def measure_classes() -> dict[str, type[Measure]]:
    """Return the measures of the package.

    Returns
    -------
    dict
        Classes by name.
    """
    exported = (getattr(measures, name) for name in measures.__all__)
    own = (kind for kind in exported if isinstance(kind, type) and issubclass(kind, Measure))
    return {kind.name: kind for kind in own if "name" in vars(kind)}


def _examples() -> dict[type[Measure], Measure]:
    """Return an example of each measure.

    The example is a measure with default fields, or else the measure of a named study.
    """
    stated = {type(study.measure): study.measure for study in _studies().values()}
    for kind in measure_classes().values():
        if all(f.default is not MISSING or f.default_factory is not MISSING for f in fields(kind)):
            stated[kind] = kind()
    return stated


def every_measure() -> str:
    """Format sections with the fields and outputs of all measures.

    Returns
    -------
    str
        Sections in Markdown.
    """
    examples = _examples()
    return "\n\n".join(_measure(kind, examples.get(kind)) for kind in measure_classes().values())


def _measure(kind: type[Measure], example: Measure | None) -> str:
    """Format the section of a measure."""
    taken = markdown_table(("field", "default", "meaning"), _describe_fields(kind))
    given = markdown_table(
        ("output", "symbol", "unit", "error estimate", "dimensions", "meaning"),
        map(_output, example.outputs if example else ()),
    )
    headline = (
        f"Primary output: `{example.primary_output}`."
        if example
        else "The outputs depend on the fields."
    )
    source = measures if kind.__name__ in measures.__all__ else sys.modules[kind.__module__]
    home = f"`from {source.__name__} import {kind.__name__}`"
    stated = (study.measure for study in _studies().values())
    words = f"{first_paragraph(kind)} {headline} {home}{_format_call(kind, stated)}"
    return "\n\n".join(filter(None, (f"## {kind.__name__}", words, taken, given)))


@cache
def _studies() -> dict[str, Study]:
    """Return the named studies by name."""
    return {name: study_loader.load_study(name) for name in named_study_index.list_study_names()}


def _format_call(kind: type[Any], stated: Iterable[Measure | Reduction]) -> str:
    """Format an example of a measure or reduction.

    The example is the first instance in the named studies that has at least one field with a value
    other than the default.
    """
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
    """Yield the name, default and meaning of each field of a class."""
    told = parameters(kind)
    for one in fields(kind):
        if one.init:
            value = one.default if one.default is not MISSING else "required"
            shown = f"`{value!r}`" if one.default is not MISSING else value
            yield f"`{one.name}`", shown, told.get(one.name, "")


def parameters(kind: type[Any]) -> dict[str, str]:
    """Return the meaning of each parameter from the docstrings of a class.

    The docstrings of the base classes are included.

    Parameters
    ----------
    kind : type[Any]
        Class with Parameters sections.

    Returns
    -------
    dict
        Meanings by parameter.
    """
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
    """Return the table row of an output."""
    about: Quantity = output if output.long_name else find_quantity(output.name)
    return (f"`{output.name}`", html_symbol(about.symbol), html_unit(about), output.error,
            ", ".join(output.dims), strip_markup(about.long_name))  # fmt: skip


def reductions() -> str:
    """Format sections with the fields of all reductions.

    Returns
    -------
    str
        Sections in Markdown.
    """
    kinds = (getattr(reduce, name) for name in reduce.__all__)
    own = (
        k for k in kinds if isinstance(k, type) and issubclass(k, Reduction) and k is not Reduction
    )
    stated = [one for study in _studies().values() for one in study.reductions]
    return "\n\n".join(
        f"## {kind.__name__}\n\n{first_paragraph(kind)}{_format_call(kind, stated)}\n\n"
        + markdown_table(("field", "default", "meaning"), _describe_fields(kind))
        for kind in own
    )


def claims() -> str:
    """Format a table of the claims of all named studies.

    Returns
    -------
    str
        Table in Markdown.
    """
    rows = (
        (f"[`{name}`](../gallery/{name}.md)", *row) for name in _studies() for row in _claims(name)
    )
    return markdown_table(("study", *CLAIM_HEADINGS), rows)


def claims_of(name: str) -> str:
    """Format a table of the claims of a study.

    Parameters
    ----------
    name : str
        Name of the study.

    Returns
    -------
    str
        Table in Markdown. The string is empty if the study has no claims.
    """
    return markdown_table(CLAIM_HEADINGS, _claims(name))


def _claims(name: str) -> Iterator[tuple[object, ...]]:
    """Yield the table row of each claim of a study."""
    for claim in _studies()[name].claims:
        yield (claim.id, strip_markup(claim.statement), strip_markup(claim.source),
               format_published_value(claim.describe()), claim.tolerance,
               strip_markup(claim.difference_reason))  # fmt: skip


def statuses() -> str:
    """Format a table of all statuses of a cell.

    Returns
    -------
    str
        Table in Markdown.
    """
    return markdown_table(
        ("status", "flag", "kind", "meaning"),
        ((f"`{s.label}`", int(s), "answer" if s.is_answer else "failure", strip_markup(s.meaning))
         for s in Status),
    )  # fmt: skip


def vocabulary() -> str:
    """Format a table of all symbols and variables, with their units and names.

    Returns
    -------
    str
        Table in Markdown, in the order of the names.
    """
    abouts = {about.name: about for about in part_registry.SCENE_FIELD_QUANTITIES}
    rows = (
        (f"`{name}`", html_symbol(about.symbol), html_unit(about), strip_markup(about.long_name),
         "field" if name in abouts else "result")
        for name, about in sorted((abouts | QUANTITY_BY_NAME).items())
    )  # fmt: skip
    return markdown_table(("name", "symbol", "unit", "meaning", "kind"), rows)


# ---- the command line, and Python ----------------------------------------------------------------


def commands() -> str:
    """Format sections with the arguments and options of all commands.

    Returns
    -------
    str
        Sections in Markdown.
    """
    return "\n\n".join(_command(name, command) for name, command in cli.commands.items())


def _command(name: str, command: click.Command) -> str:
    """Format the section of a command."""
    # The first piece of the usage is "[OPTIONS]", which the table replaces.
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
    return f"## rsfstudy {name}\n\n`rsfstudy {name} {taken}`\n\n{words}\n\n{made}"


def _describe_option(option: click.Option) -> str:
    """Format the default of an option."""
    if option.is_flag or option.default in (None, (), []) or callable(option.default):
        return ""
    return "" if type(option.default).__name__ == "Sentinel" else f"`{option.default}`"


def python() -> str:
    """Format tables of the public functions and classes, with links to their pages.

    Returns
    -------
    str
        Sections in Markdown.
    """
    sections = [
        f"## {heading}\n\n{_intro(namespace)}{_object_table(public_objects(namespace))}"
        for namespace, heading in NAMESPACES.items()
    ]
    further = f"## Further classes\n\n{_object_table(further_objects())}"
    pages = [one.path for name in NAMESPACES for one in public_objects(name)]
    pages += [one.path for one in further_objects()]
    contents = "".join(f"objects/{page}\n" for page in pages)
    return "\n\n".join((*sections, further, f"```{{toctree}}\n:hidden:\n{contents}```"))


def _intro(namespace: str) -> str:
    """Format the sentence that names a namespace and the constants in it."""
    others = ", ".join(f"`{name}`" for name in constants(namespace))
    words = f"Import these names from `{namespace}`."
    return f"{words} Constants and types: {others}.\n\n" if others else f"{words}\n\n"


def _object_table(objects: Iterable[PublicObject]) -> str:
    """Format a table of objects with links to their pages."""
    rows = (
        (f"[`{one.title}`](objects/{one.path}.md)", strip_markup(one.summary)) for one in objects
    )
    return markdown_table(("object", "summary"), rows)


#: Functions that generate the content, by name.
MADE: dict[str, Callable[[], str]] = {
    one.__name__: one
    for one in (scene_fields, parts, rig, every_measure, reductions, claims, statuses, vocabulary,
                commands, python)
}  # fmt: skip
