"""Documentation pages of the repository, for the tests that read them."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
#: Folder of the documentation pages and of the records of their examples.
PAGES = ROOT / "studies" / "pages"
#: Folders of pages that the site generates before each build.
GENERATED = (PAGES / "gallery", PAGES / "reference" / "objects")
#: The README and all pages under version control.
FILES = [
    ROOT / "README.md",
    *sorted(file for file in PAGES.rglob("*.md") if file.parent not in GENERATED),
]


def find_page(text: str) -> str:
    """Return the content of the page that contains a text.

    The README is not searched.
    """
    found = [page for file in FILES[1:] if text in (page := file.read_text())]
    assert len(found) == 1, f"{len(found)} pages contain {text!r}"
    return found[0]


def code_blocks(text: str) -> list[str]:
    """Return the Python code blocks of a page."""
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)
