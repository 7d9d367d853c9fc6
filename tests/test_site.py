"""Tests of the documentation site.

The site is built with warnings as errors, has no broken links, loads no files from the
network, and lists all public names.
"""

from __future__ import annotations

import importlib
import inspect
import json
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from site_pages import FILES, find_page

import rsfstudy
from rsfstudy import measures, reductions
from rsfstudy.api.accessor import DatasetAccessor
from rsfstudy.cli.command_line import cli
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.slider import part_registry
from rsfstudy.status import Status
from rsfstudy.vocabulary import QUANTITY_BY_NAME

ROOT = Path(__file__).parent.parent
SLIDER = ROOT / "rsfstudy" / "slider"
#: Public namespaces.
NAMESPACES = (
    "rsfstudy",
    *(f"rsfstudy.{name}" for name in ("measures", "reductions", "parts", "fitting", "plots")),
)
SLOTS = ("laws", "normal_stress", "fluid", "dynamics", "loading", "temperature")


class Page(HTMLParser):
    """Links, anchors, loaded files and text of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.text = ""
        self.feed(file.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in ("link", "script", "img", "source", "iframe"):
            self.loaded += [given[name] for name in ("href", "src") if name in given]

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """Build the site without access to the network."""
    made = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", "studies/pages"]
    nowhere = dict.fromkeys(("http_proxy", "https_proxy"), "http://127.0.0.1:9")
    built = subprocess.run(
        [*command, ".", str(made)],
        cwd=ROOT,
        env=os.environ | nowhere,
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return made


@pytest.fixture(scope="module")
def pages(site) -> dict[Path, Page]:
    return {file: Page(file) for file in sorted(site.rglob("*.html"))}


def text_of(pages: dict[Path, Page], folder: str) -> str:
    return "\n".join(page.text for file, page in pages.items() if file.parent.name == folder)


def words_in(text: str) -> set[str]:
    return set(re.findall(r"--[\w-]+|\w+", text))


def test_every_page_and_every_notebook_is_there(pages, site):
    kept = [*(ROOT / "studies").glob("*.ipynb"), *FILES[1:]]
    needed = {site / "index.html"}
    needed |= {site / file.relative_to(ROOT).with_suffix(".html") for file in kept}
    assert needed <= set(pages)


def test_links_lead_somewhere(pages):
    for file, page in pages.items():
        for link in (*page.links, *page.loaded):
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "mailto", "data") or link == "#":
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), (file.name, link)
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].anchors, (file.name, link)


def test_nothing_is_loaded_from_the_net(pages, site):
    for file, page in pages.items():
        assert not [link for link in page.loaded if urlsplit(link).netloc], file.name
    for style in site.rglob("*.css"):
        assert not re.findall(r"(?:url\(|@import )[\"' ]*(?:https?:)?//", style.read_text()), style


def test_nothing_is_left_to_be_made(pages):
    assert not [file.name for file in pages if "<!-- made:" in file.read_text()]


@pytest.fixture
def examples():
    return runpy.run_path(str(ROOT / "studies" / "pages" / "_examples.py"))


def test_examples_make_what_they_stand_beside(examples):
    for slot in part_registry.PART_SLOTS:
        for name, part in slot.built_in_parts.items():
            scene = eval(examples["SCENES"][name], {"Scene": rsfstudy.Scene})
            assert isinstance(getattr(scene.parts, slot.name), part)


def test_examples_that_no_study_states_can_be_called(examples):
    known = {name: getattr(measures, name) for name in measures.__all__}
    record = rsfstudy.read_record(ROOT / "studies/pages/step.csv", normal_stress="20 MPa")
    for name, call in examples["CALLS"].items():
        made = eval(call, {**vars(reductions), **known, "record": record})
        assert type(made).__name__ == name


def test_no_symbol_is_taken_for_emphasis(pages):
    """Asterisks in symbols such as ``sigma_*`` are escaped."""
    for file in pages:
        taken = re.findall(r"<em>([^<]*_)</em>", file.read_text())
        assert not taken, (file.name, taken)


def names() -> Iterator[tuple[str, list[str]]]:
    """Yield the names that the reference must contain.

    The names come from the signature of a scene, the folders of parts, and declarations in
    the code.
    """
    yield "fields", [*rsfstudy.Scene().as_dict()]
    kept = [file.stem for slot in SLOTS for file in (SLIDER / slot).glob("[!_]*.py")]
    yield "parts", kept
    exported = [getattr(measures, name) for name in measures.__all__]
    yield (
        "measures",
        [kind.__name__ for kind in exported if "name" in getattr(kind, "__dict__", {})],
    )
    yield "outputs", [about.name for about in LimitCycle().outputs]
    kinds = [
        n
        for n in reductions.__all__
        if isinstance(getattr(reductions, n), type) and n != "Reduction"
    ]
    yield "reductions", kinds
    yield "statuses", [status.label for status in Status]
    yield "numbers", [*QUANTITY_BY_NAME]
    params = [param for command in cli.commands.values() for param in command.params]
    yield "commands", [*cli.commands, *(o for p in params for o in p.opts if o.startswith("--"))]


NAMES = dict(names())


@pytest.mark.parametrize("kind", NAMES)
def test_every_name_is_there(pages, kind):
    assert NAMES[kind]
    assert set(NAMES[kind]) <= words_in(text_of(pages, "reference"))


def test_every_public_object_has_a_page_with_an_example(pages):
    """Functions and classes of the public namespaces have pages with examples.

    Constants and types are listed on the page of the Python interface.
    """
    objects = {file.stem: page for file, page in pages.items() if file.parent.name == "objects"}
    listed = text_of(pages, "reference")
    for namespace in NAMESPACES:
        module = importlib.import_module(namespace)
        for name in module.__all__:
            value = getattr(module, name)
            known = [space for space in NAMESPACES if f"{space}.{name}" in objects]
            if not known:
                assert not inspect.isfunction(value), name
                assert name in words_in(listed), name
                continue
            path = f"{known[0]}.{name}"
            assert path in objects[path].anchors, path
            assert ">>>" in objects[path].text or getattr(value, "_is_protocol", False), path
    members = {name for name in vars(DatasetAccessor) if not name.startswith("_")}
    accessor = f"{DatasetAccessor.__module__}.DatasetAccessor"
    assert {f"{accessor}.{name}" for name in members} <= objects[accessor].anchors
    assert "rsfstudy.motion.steppers.Stepper" in objects


def test_every_study_has_a_thumbnail_and_a_page(pages):
    """Thumbnails are small, and no thumbnail belongs to a study that does not exist."""
    thumbnails = {file.stem: file for file in (ROOT / ".github" / "gallery").glob("*.png")}
    assert set(thumbnails) == set(rsfstudy.studies())
    assert all(file.stat().st_size <= 15_000 for file in thumbnails.values())
    shown = next(page for file, page in pages.items() if file.name == "gallery.html")
    code = {file.stem: page.text for file, page in pages.items() if file.parent.name == "gallery"}
    for name in thumbnails:
        assert any(link.endswith(f"/{name}.png") for link in shown.loaded), name
        assert f"gallery/{name}.html" in shown.links
        assert "study = Study(" in code[name], name


#: Terms that users search for, with the page that the search should show first.
SEARCHES = {
    "AIC": "how_to/fit_many_steps",
    "stick-slip": "tutorials/your_rig",
    "ageing law": "explanation/scene",
    "slip law": "explanation/scene",
    "radiation damping": "explanation/scene",
    "critical stiffness": "explanation/scene",
    "healing": "how_to/measure_healing",
    "slide-hold-slide": "how_to/measure_healing",
    "xlook": "how_to/read_a_file",
    "Excel": "how_to/read_a_file",
    "MPa": "reference/units",
    "cluster": "how_to/run_on_a_cluster",
    "SLURM": "how_to/run_on_a_cluster",
    "resume": "how_to/resume_a_run",
    "stress drop": "how_to/find_events",
    "limit cycle": "explanation/limit_cycles",
    "standard error": "explanation/noise_and_intervals",
    "effective sample size": "explanation/noise_and_intervals",
    "p-value": "explanation/noise_and_intervals",
    "Sobol indices": "how_to/sample_uncertainty",
    "NetCDF": "reference/files",
    "JSON": "reference/json",
    "MATLAB": "how_to/export_results",
    "PowerShell": "how_to/install",
    "critical step": "how_to/compute_one_scene",
}


def test_the_search_shows_the_page_that_answers_first(site):
    """Each term is a main index entry of a single page.

    The search of Sphinx gives a main index entry that equals the query 100 points. All other
    matches have fewer points.
    """
    text = (site / "searchindex.js").read_text()
    index = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    for term, page in SEARCHES.items():
        entries = index["indexentries"][term.lower()]
        found = {index["docnames"][number] for number, _anchor, is_main in entries if is_main}
        assert found == {f"studies/pages/{page}"}, term


def test_quick_tests_exist():
    files = (ROOT / "tests" / "quick.txt").read_text().split()
    assert len(files) >= 10
    assert all((ROOT / file).is_file() for file in files)
    assert "@tests/quick.txt" in find_page("## Run the tests")


def test_files_to_copy_exist():
    table = find_page("<!-- files to copy -->").partition("<!-- files to copy -->")[2]
    named = re.findall(r"`(\w+/[\w/.]+\.(?:py|csv|md))`", table.partition("\n## ")[0])
    assert len(named) >= 14
    assert all((ROOT / file).is_file() for file in named), named


def test_starting_points_of_changes_exist():
    """The files and functions that the page for contributors names exist."""
    text = find_page("<!-- starting points -->")
    table = text.partition("<!-- starting points -->")[2].partition("\n## ")[0]
    found = re.findall(r"`([a-z_/]+\.(?:py|csv))(?:: (\w+))?`", table)
    assert len(found) >= 15
    for path, function in found:
        source = (ROOT / "rsfstudy" / path).read_text()
        assert not function or f"def {function}(" in source, path
