"""Chromium without a window, spoken to by its DevTools protocol: what a page looks like there."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tornado.websocket import websocket_connect

NAMES = ("chromium", "chromium-browser", "google-chrome")
#: Time in s after which a browser never answers.
HANGS = 120.0


def installed() -> str | None:
    """The browser, if there is one."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@dataclass
class Opened:
    """What came of opening a page at some width."""

    width: int
    inner: int = 0
    scroll: int = 0
    images: list[int] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


LOOK = """JSON.stringify({
    inner: window.innerWidth, scroll: document.scrollingElement.scrollWidth,
    images: Array.from(document.images, image => image.naturalWidth)})"""


class _Tab:
    """A tab: commands, and what happens meanwhile."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.session, self.number, self.happened = socket, None, 0, []

    async def ask(self, method: str, **given: Any) -> dict[str, Any]:
        self.number += 1
        session = {"sessionId": self.session} if self.session else {}
        asked = {"id": self.number, "method": method, "params": given, **session}
        await self.socket.write_message(json.dumps(asked))
        while (answer := await self._next()).get("id") != self.number:
            self.happened.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    async def until(self, method: str) -> None:
        while not any(one["method"] == method for one in self.happened):
            self.happened.append(await self._next())

    async def _next(self) -> dict[str, Any]:
        text = await asyncio.wait_for(self.socket.read_message(), HANGS)
        assert text is not None, "the browser has closed"
        return json.loads(text)


async def _look(address: str, page: Path, width: int, media: str) -> Opened:
    tab = _Tab(await websocket_connect(address, max_message_size=2**28))
    target = await tab.ask("Target.createTarget", url="about:blank")
    attached = await tab.ask("Target.attachToTarget", flatten=True, **target)
    tab.session = attached["sessionId"]
    for domain in ("Page", "Runtime", "Log", "Network"):
        await tab.ask(f"{domain}.enable")
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    await tab.ask("Emulation.setDeviceMetricsOverride", **screen)
    await tab.ask("Emulation.setEmulatedMedia", media=media)
    await tab.ask("Page.navigate", url=page.resolve().as_uri())
    await tab.until("Page.loadEventFired")
    found = await tab.ask("Runtime.evaluate", expression=LOOK)
    opened = Opened(width, **json.loads(found["result"]["value"]))
    for one in tab.happened:
        what, about = one.get("method"), one.get("params", {})
        if what == "Log.entryAdded" and about["entry"]["level"] in ("error", "warning"):
            opened.errors.append(about["entry"]["text"])
        if what == "Runtime.exceptionThrown" or (
            what == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert")
        ):
            opened.errors.append(json.dumps(about))
        if what == "Network.requestWillBeSent":
            opened.asked.append(about["request"]["url"])
    tab.socket.close()
    return opened


def opened(page: Path, looks: list[tuple[int, str]], scratch: Path) -> list[Opened]:
    """A page opened at some widths, on a screen or in print, by the browser that is installed."""
    browser = installed()
    assert browser
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    words += ["--hide-scrollbars", f"--user-data-dir={scratch}", "about:blank"]
    home = {**os.environ, "HOME": str(scratch)}
    with subprocess.Popen(
        [browser, *words], stderr=subprocess.PIPE, text=True, env=home
    ) as process:
        try:
            assert process.stderr is not None
            lines = iter(process.stderr.readline, "")
            address = next(line for line in lines if "DevTools listening on" in line).split()[-1]
            return [asyncio.run(_look(address, page, *look)) for look in looks]
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.communicate(timeout=20.0)
            process.kill()
