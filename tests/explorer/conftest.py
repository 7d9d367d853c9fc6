"""Fixtures of the tests of the explorer: one server process and one Chromium for all tests.

The tests need Panel. The modules whose names end with ``_page`` also need Playwright and Chromium.
Without a requirement, modules are skipped. If the environment variable ``RSFSTUDY_BROWSER`` is
``required``, they fail instead.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import xarray as xr
from explorer_pages import PATIENCE, STEP

import rsfstudy
from rsfstudy import Accuracy, Axis, Scene, Study
from rsfstudy.measures import CriticalStep

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: Options of Chromium that save time: no other process draws, and no page is shown.
OPTIONS = ("--disable-gpu", "--disable-extensions", "--disable-background-networking")
#: Program that prints the addresses of several files, each on a port of its own, and then runs the
#: command ``rsfstudy explore`` in the same process.
PROGRAM = """
import signal, sys
from rsfstudy.cli.command_line import main
from rsfstudy.explorer.server import ExplorerServer
signal.signal(signal.SIGINT, signal.default_int_handler)  # shells may ignore the signal
port, *places = sys.argv[1:]
for place in places:
    number, _, file = place.partition(":")
    server = ExplorerServer(file, port=int(number))
    server._server.start()
    print(server.url, flush=True)
sys.argv = ["rsfstudy", "explore", "--no-browser", "--port", port]
main()
"""


def find_missing_requirement(needs_browser: bool) -> str:
    """Return the reason for which tests cannot run, or an empty string."""
    for name in ("panel", "playwright")[: 1 + needs_browser]:
        if find_spec(name) is None:
            return f"{name} is not installed: pip install 'rsfstudy[browser]'"
    return "" if CHROMIUM or not needs_browser else "chromium is missing: apt-get install chromium"


class SkippedModule(pytest.Module):
    """Module of tests that is not imported, because a requirement is missing."""

    def collect(self) -> list[Any]:
        """Skip the module, or fail if the browser is required."""
        missing = find_missing_requirement(needs_browser=True)
        if os.environ.get("RSFSTUDY_BROWSER") == "required":
            pytest.fail(missing)
        pytest.skip(missing)


def pytest_pycollect_makemodule(module_path: Path, parent: Any) -> pytest.Module | None:
    """Replace a test module if a requirement is missing."""
    if find_missing_requirement(module_path.stem.endswith("_page")):
        return SkippedModule.from_parent(parent, path=module_path)
    return None


class Explorer(NamedTuple):
    """Process of ``rsfstudy explore``, the first addresses, and the files that it shows."""

    process: subprocess.Popen[str]
    scene: str
    step: str
    record: str
    results: str
    record_file: Path
    results_file: Path

    @property
    def origin(self) -> str:
        """Address of the scene view without path and token."""
        return self.scene.partition("/?")[0]


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Explorer]:
    """Start the server of all tests. At the end, Ctrl-C stops it.

    The tests write the files ``record_file`` and ``results_file`` before they open the page.
    """
    directory = tmp_path_factory.mktemp("files")
    files = directory / "record.csv", directory / "results.nc"
    places = [f"{free_port()}:{file}" for file in (STEP, *files)]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(free_port()), *places],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    urls = [process.stdout.readline().strip() for _ in range(4)]
    started = Explorer(process, urls[3], *urls[:3], *files)
    try:
        assert all(url.startswith("http://127.0.0.1:") for url in urls), urls
        yield started
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
        with pytest.raises(OSError, match="refused"):
            socket.create_connection(("127.0.0.1", int(started.origin.rpartition(":")[2])), 5)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def free_port() -> int:
    """Return a port that no process uses."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Yield a headless Chromium."""
    from playwright.sync_api import sync_playwright

    options = [*OPTIONS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def open_page(browser: Any) -> Iterator[Callable[..., Any]]:
    """Yield a function that opens a page in a new browser profile.

    The page fails the test if a script raises an error, or if it requests anything from another
    host.
    """
    contexts, faults = [], []

    def open_in_profile(url: str, width: int = 1280, **settings: Any) -> Any:
        context = browser.new_context(viewport={"width": width, "height": 900}, **settings)
        context.set_default_timeout(PATIENCE)
        contexts.append(context)
        page = context.new_page()
        origin = "/".join(url.split("/")[:3])
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith((origin, "data:", "blob:"))
                else faults.append(request.url)
            ),
        )
        page.goto(url)
        return page

    yield open_in_profile
    for context in contexts:
        context.close()
    assert faults == []


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """Return the results of a study in a file, with 12 answers and 4 failed cells."""
    study = Study(
        name="explored",
        title="Critical velocity step",
        base=Scene(a=0.01, normal_stress="variable", alpha=0.3),
        axes=[
            Axis("law", ["slip", "slowness"]),
            Axis("stiffness_ratio", [1.1, 1.2]),
            Axis("b_over_a", [1.5, 2.0, 3.0, 4.0]),
        ],
        measure=CriticalStep(),
        accuracy=Accuracy(1e-4, budget=2200),
    )
    place = tmp_path_factory.mktemp("results")
    with pytest.warns(rsfstudy.errors.IncompleteWarning):
        rsfstudy.run(study, workers=0, output=place, progress=False, keep_going=True)
    return rsfstudy.open(place / "explored.nc")
