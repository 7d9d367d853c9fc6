"""Sphinx configuration of the site.

The site consists of the pages, the notebooks and the docstrings. Build it with::

    sphinx-build -W --keep-going -c studies/pages . outputs/site

The tables of the reference, the pages of public objects and the gallery are generated from the
code.
"""

from __future__ import annotations

import json
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import _generated_content  # type: ignore[import-not-found]  # noqa: E402 (same directory)
import _object_pages  # type: ignore[import-not-found]  # noqa: E402
from docutils import nodes  # type: ignore[import-untyped]  # noqa: E402
from docutils.utils.math import MathError  # type: ignore[import-untyped]  # noqa: E402
from docutils.utils.math.latex2mathml import (  # type: ignore[import-untyped]  # noqa: E402
    tex2mathml,
)
from sphinx.util import logging  # noqa: E402

project = "rsfstudy"
author = copyright = "The rsfstudy developers"
version = release = metadata.version("rsfstudy")
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx_design"]

root_doc = "studies/pages/index"
source_suffix = {".md": "markdown", ".ipynb": "markdown"}
include_patterns = ["studies/*.ipynb", "studies/pages/**"]
exclude_patterns = [".*", "build", "outputs", "rsfstudy", "tests"]

myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence", "dollarmath"]
default_role = "code"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = project
html_copy_source = False
html_math_renderer = "mathml"
html_show_sphinx = False
#: Style of tables. Seven columns fit into a window with a width of 1200 pixels.
TABLES = "table.docutils { font-size: .78rem } table.docutils :is(td, th) { padding: .2rem .35rem }"

#: Name of a function in MathML that is not followed by a parenthesis.
FUNCTION_BEFORE_NAME = re.compile(r"<mo>&ApplyFunction;</mo>(?!\s*(?:<mrow>\s*)?<mo[^>]*>[(\[{])")


def _table_of_contents(folder: Path, text: str) -> str:
    """Return the table of contents of an index page.

    Parameters
    ----------
    folder : Path
        Folder of the page.
    text : str
        Page in Markdown, with links to its pages in the desired order.

    Returns
    -------
    str
        Directive with the linked pages of the folder, the index pages of its subfolders, and the
        pages of the folder without a link.
    """
    linked = re.findall(r"\]\(([\w/]+)\.md\)|^:link: (\S+)", text, flags=re.MULTILINE)
    named = [one or other for one, other in linked]
    named = [page for page in named if "/" not in page or page.endswith("/index")]
    others = sorted(file.stem for file in folder.glob("*.md") if file.stem != "index")
    pages = "".join(f"{page}\n" for page in dict.fromkeys((*named, *others)))
    return f"```{{toctree}}\n:hidden:\n{pages}```"


def _index_entries(found: re.Match[str]) -> str:
    """Return the main index entries of a page, which the search ranks first.

    Parameters
    ----------
    found : re.Match
        Comment of the page with terms that are separated by commas.
    """
    return "```{index} " + ", ".join(f"! {term}" for term in found[1].split(", ")) + "\n```"


def _fill_source(app: Any, page: str, text: list[str]) -> None:
    """Insert generated content into a page.

    Notebooks are converted to Markdown, the tables of the gallery become cards, and comments with
    terms become index entries.
    """
    if str(app.env.doc2path(page)).endswith(".ipynb"):
        text[0] = _notebook_to_markdown(text[0])
    text[0] = re.sub(r"<!-- search: (.*) -->", _index_entries, text[0])
    if "<!-- contents -->" in text[0]:
        folder = Path(app.env.doc2path(page)).parent
        text[0] = text[0].replace("<!-- contents -->", _table_of_contents(folder, text[0]))
    if page.endswith("pages/gallery"):
        text[0] = _object_pages.gallery_cards(text[0])
    text[0] = _generated_content.fill_page(_generated_content.escape_asterisks(text[0]))


def _notebook_to_markdown(notebook: str) -> str:
    """Convert a notebook with its outputs to Markdown."""
    parts: list[str] = []
    for cell in json.loads(notebook)["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            if parts:  # A page has a single title.
                text = re.sub(r"^# ", "## ", text, flags=re.MULTILINE)
            parts.append(
                re.sub(
                    r"\$[^$]+\$", lambda formula: _generated_content.html_symbol(formula[0]), text
                )
            )
            continue
        parts.append(f"```python\n{text}\n```")
        for output in cell["outputs"]:
            shown = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in shown:
                image = "".join(shown["image/png"]).replace("\n", "")
                parts.append(f"![What the code above draws](data:image/png;base64,{image})")
            else:
                parts.append(f"```text\n{''.join(shown['text/plain'])}\n```")
    return "\n\n".join(parts)


def _add_table_style(
    app: Any, page: str, template: str, context: dict[str, Any], tree: Any
) -> None:
    """Add the style of tables to a page."""
    context["metatags"] = context.get("metatags", "") + f"<style>{TABLES}</style>"


def _write_math(writer: Any, node: nodes.math | nodes.math_block) -> None:
    """Write formulas as MathML, which browsers display without a script from the net."""
    for formula in node.astext().split("\n\n"):
        source = " ".join(formula.split()).replace(r"\dots", r"\ldots")
        try:
            markup = tex2mathml(source, as_block=isinstance(node, nodes.math_block))
        except MathError as error:
            logging.getLogger(__name__).warning("%s: %s", error, source, location=node)
            markup = writer.encode(source)
        writer.body.append(FUNCTION_BEFORE_NAME.sub(r"\g<0><mspace width='0.17em'/>", markup))
    raise nodes.SkipNode


def _write_redirect(app: Any, error: Exception | None) -> None:
    """Write an index page that redirects to the first page."""
    if error is None:
        to_first = f'<meta http-equiv="refresh" content="0; url={root_doc}.html">'
        Path(app.outdir, "index.html").write_text(
            f"<!doctype html><title>{project}</title>{to_first}"
        )


def _write_generated_pages(app: Any) -> None:
    """Write the pages of public objects and of studies before Sphinx looks for pages."""
    _object_pages.write_pages(_generated_content.claims_of)


def setup(app: Any) -> None:
    """Connect the functions of this module to Sphinx events.

    Parameters
    ----------
    app : object
        Sphinx application.
    """
    app.add_html_math_renderer("mathml", (_write_math, None), (_write_math, None))
    app.connect("builder-inited", _write_generated_pages)
    app.connect("source-read", _fill_source)
    app.connect("html-page-context", _add_table_style)
    app.connect("build-finished", _write_redirect)
