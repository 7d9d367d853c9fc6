"""Pages of the site that are written before each build: one per public object and per study.

The pages lie in the folders ``reference/objects`` and ``gallery``, which are not under version
control.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rsfstudy
from rsfstudy.api.accessor import DatasetAccessor
from rsfstudy.motion.steppers import Stepper

HERE = Path(__file__).parent
OBJECTS, STUDIES = HERE / "reference" / "objects", HERE / "gallery"
#: Public namespaces with the headings of their tables.
NAMESPACES = {
    "rsfstudy": "Functions and classes",
    "rsfstudy.measures": "Measures",
    "rsfstudy.reductions": "Reductions",
    "rsfstudy.parts": "Base classes of parts",
    "rsfstudy.fitting": "Records and fits",
    "rsfstudy.plots": "Figures",
}
#: Public classes that are not exported by a namespace, with the titles of their pages.
FURTHER_CLASSES = {
    f"{DatasetAccessor.__module__}.DatasetAccessor": (DatasetAccessor, "Dataset accessor rsf"),
    "rsfstudy.motion.steppers.Stepper": (Stepper, "rsfstudy.motion.steppers.Stepper"),
}


@dataclass(frozen=True)
class PublicObject:
    """Public function or class with a page of its own.

    Parameters
    ----------
    path : str
        Import path, which is also the name of the page.
    title : str
        Title of the page.
    documented : object
        Function or class.
    """

    path: str
    title: str
    documented: Any

    @property
    def summary(self) -> str:
        """First paragraph of the docstring."""
        return " ".join((inspect.getdoc(self.documented) or "").split("\n\n")[0].split())

    @property
    def page(self) -> str:
        """Content of the page in Markdown."""
        kind = "class" if inspect.isclass(self.documented) else "function"
        options = (
            "   :members:\n   :exclude-members: set\n   :show-inheritance:\n"
            if kind == "class"
            else ""
        )
        return (
            f"# {self.title}\n\n```{{eval-rst}}\n.. auto{kind}:: {self.path}\n{options}```\n\n"
            f"See the [list of all public objects](../python.md).\n"
        )


def public_objects(namespace: str) -> Iterator[PublicObject]:
    """Yield the public functions and classes of a namespace.

    An object that several namespaces export belongs to the first of them.

    Parameters
    ----------
    namespace : str
        Import path of the namespace, one of `NAMESPACES`.
    """
    earlier = list(NAMESPACES)[: list(NAMESPACES).index(namespace)]
    known = {id(value) for name in earlier for value in _exports(name).values()}
    for name, value in _exports(namespace).items():
        if id(value) not in known and (inspect.isfunction(value) or inspect.isclass(value)):
            yield PublicObject(f"{namespace}.{name}", f"{namespace}.{name}", value)


def _exports(namespace: str) -> dict[str, Any]:
    """Return the exported objects of the package in a namespace, by name."""
    module = importlib.import_module(namespace)
    values = {name: getattr(module, name) for name in module.__all__}
    return {
        name: value
        for name, value in values.items()
        if str(getattr(value, "__module__", "")).startswith("rsfstudy.")
    }


def constants(namespace: str) -> list[str]:
    """Return the names that a namespace exports in addition to functions and classes.

    Parameters
    ----------
    namespace : str
        Import path of the namespace.

    Returns
    -------
    list of str
        Names of constants and of types.
    """
    module = importlib.import_module(namespace)
    return [
        name
        for name in module.__all__
        if not inspect.isfunction(getattr(module, name))
        and not inspect.isclass(getattr(module, name))
    ]


def further_objects() -> list[PublicObject]:
    """Return the public classes that are not exported by a namespace.

    Returns
    -------
    list of PublicObject
        Dataset accessor and base class of steppers.
    """
    return [PublicObject(path, title, kind) for path, (kind, title) in FURTHER_CLASSES.items()]


def study_rows() -> dict[str, list[str]]:
    """Return the cells of the tables of the gallery by the name of the study.

    Returns
    -------
    dict
        Cells after the name: the figure of the paper if the table has this column, and the
        description.
    """
    text = (HERE / "gallery.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", text, re.MULTILINE)
    return {name: cells.split(" | ") for name, cells in rows}


def gallery_cards(text: str) -> str:
    """Replace the tables of studies on the gallery page by cards.

    Parameters
    ----------
    text : str
        Gallery page in Markdown.

    Returns
    -------
    str
        Page with cards, and with a table of contents of the pages of studies.
    """
    rows = study_rows()

    def cards(found: re.Match[str]) -> str:
        names = re.findall(r"^\| `(\w+)` \|", found[0], re.MULTILINE)
        inside = "\n\n".join(_card(name, rows[name]) for name in names)
        return f"::::{{grid}} 1 2 3 3\n:gutter: 2\n\n{inside}\n::::\n"

    text = re.sub(r"^\| study \|.*\n(?:\|.*\n)+", cards, text, flags=re.MULTILINE)
    return text + "\n```{toctree}\n:hidden:\n" + "".join(f"gallery/{n}\n" for n in rows) + "```\n"


def _card(name: str, cells: list[str]) -> str:
    """Format the card of a study with the first sentence of its description."""
    sentence = re.split(r"(?<=\.) (?=[A-Z])|: ", cells[-1])[0]
    figure = f" ({cells[0]})" if len(cells) > 1 else ""
    sentence = sentence[0].upper() + sentence[1:].rstrip(".")
    return (
        f":::{{grid-item-card}} {name}{figure}\n:img-top: ../../.github/gallery/{name}.png\n"
        f":img-alt: Figure of the study {name}\n:link: gallery/{name}\n:link-type: doc\n\n"
        f"{sentence}.\n:::"
    )


def _study_page(name: str, cells: list[str], claims: str) -> str:
    """Format the page of a study."""
    figure = f" It refers to {cells[0]} of the paper." if len(cells) > 1 else ""
    description = cells[-1][0].upper() + cells[-1][1:].rstrip(".")
    checked = f"## Claims\n\n{claims}\n\n" if claims else ""
    return (
        f"# {name}\n\n{description}.{figure}\n\n"
        f"![Figure of the study {name}](../../../.github/gallery/{name}.png)\n\n"
        f"```sh\nrsfstudy run {name}\n```\n\n{checked}"
        f"## Code\n\n```{{literalinclude}} ../../{name}.py\n:language: python\n```\n"
    )


def write_pages(claims_of: Any) -> None:
    """Write the pages of public objects and of studies, and delete pages of former names.

    Parameters
    ----------
    claims_of : callable
        Function that returns the table of claims of a study.
    """
    objects = [one for namespace in NAMESPACES for one in public_objects(namespace)]
    rows = study_rows()
    assert set(rows) == set(rsfstudy.studies()), set(rows) ^ set(rsfstudy.studies())
    _write(OBJECTS, {one.path: one.page for one in (*objects, *further_objects())})
    _write(STUDIES, {name: _study_page(name, rows[name], claims_of(name)) for name in rows})


def _write(folder: Path, pages: dict[str, str]) -> None:
    """Write pages into a folder if their content has changed, and delete all other pages."""
    folder.mkdir(exist_ok=True)
    for file in folder.glob("*.md"):
        if file.stem not in pages:
            file.unlink()
    for name, text in pages.items():
        file = folder / f"{name}.md"
        if not file.exists() or file.read_text() != text:
            file.write_text(text)
