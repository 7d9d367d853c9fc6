"""Fixtures of the tests in a browser: servers in processes, and Chromium.

The tests need Panel, Playwright and Chromium. Without them, the modules of this directory are
skipped. If the environment variable ``RSFSTUDY_BROWSER`` is ``required``, they fail instead.
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

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: Time in ms after which a page that does not show what a test waits for fails the test.
PATIENCE = 60_000


def find_missing_requirement() -> str:
    """Return the reason for which the tests cannot run, or an empty string."""
    for name in ("panel", "playwright"):
        if find_spec(name) is None:
            return f"{name} is not installed: pip install 'rsfstudy[browser]'"
    return "" if CHROMIUM else "chromium is not installed: apt-get install chromium"


class ModuleWithoutBrowser(pytest.Module):
    """Module of tests that is not imported, because a requirement is missing."""

    def collect(self) -> list[Any]:
        """Skip the module, or fail if the browser is required."""
        missing = find_missing_requirement()
        if os.environ.get("RSFSTUDY_BROWSER") == "required":
            pytest.fail(missing)
        pytest.skip(missing)


def pytest_pycollect_makemodule(module_path: Path, parent: Any) -> pytest.Module | None:
    """Replace a test module if a requirement is missing."""
    if find_missing_requirement():
        return ModuleWithoutBrowser.from_parent(parent, path=module_path)
    return None


class Explorer(NamedTuple):
    """Process of ``rsfstudy explore``, and its first address."""

    process: subprocess.Popen[str]
    url: str

    @property
    def origin(self) -> str:
        """Address without path and token."""
        return self.url.partition("/?")[0]

    def stop(self) -> int:
        """Press Ctrl-C, and return the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(30)


@pytest.fixture(scope="session")
def explore() -> Iterator[Callable[..., Explorer]]:
    """Yield a function that starts ``rsfstudy explore`` with arguments on a free port."""
    started = []

    def start(*arguments: str) -> Explorer:
        command = [sys.executable, "-m", "rsfstudy.cli.command_line", "explore", "--no-browser"]
        process = subprocess.Popen(
            [*command, "--port", str(free_port()), *arguments], stdout=subprocess.PIPE, text=True
        )
        started.append(process)
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith("http://127.0.0.1:"), f"the server has not started: {url}"
        return Explorer(process, url)

    yield start
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.fixture(scope="session")
def server(explore: Callable[..., Explorer]) -> Explorer:
    """Return a server that shows a scene."""
    return explore()


def free_port() -> int:
    """Return a port that no process uses."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Yield a headless Chromium."""
    from playwright.sync_api import sync_playwright

    options = ["--no-sandbox"] if os.geteuid() == 0 else []
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
