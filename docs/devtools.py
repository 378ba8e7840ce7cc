"""Chromium without a window, driven by its DevTools protocol: for pictures and for tests of pages.

    with Browser() as browser:
        tab = browser.tab(390, 800)
        tab.open((site / "index.html").as_uri())
        assert not tab.messages

Needs `websockets` and Chromium of the system; no page reaches the network.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import websockets
from typing_extensions import Self
from websockets.sync.client import ClientConnection, connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--hide-scrollbars",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
    "--remote-debugging-port=0",
)
TIMEOUT_S = 240.0
"""Without a graphics card a scene takes its time where others compute as well."""
LOOK_S = 0.05


def chromium() -> str | None:
    """Path of Chromium or Chrome; None if there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """A browser with a profile of its own, which ends with the context."""

    def __enter__(self) -> Self:
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        silent = subprocess.DEVNULL
        self._process = subprocess.Popen(
            [str(chromium()), *OPTIONS, f"--user-data-dir={self._profile.name}", "about:blank"],
            stdin=silent,
            stdout=silent,
            stderr=silent,
        )
        self._tabs: list[ClientConnection] = []
        file = Path(self._profile.name) / "DevToolsActivePort"
        until = time.monotonic() + TIMEOUT_S
        while not (file.exists() and file.read_text().count("\n")):
            if self._process.poll() is not None or time.monotonic() > until:
                raise OSError("Chromium did not start")
            time.sleep(LOOK_S)
        self._port, self._path = file.read_text().split("\n")[:2]
        self._control = Tab(self._connect(self._path))
        return self

    def __exit__(self, *_: object) -> None:
        for tab in self._tabs:
            tab.close()
        self._process.terminate()
        self._process.wait(TIMEOUT_S)
        self._profile.cleanup()

    def tab(self, width: int = 1200, height: int = 800, is_phone: bool = False) -> Tab:
        """Open a tab of a size in CSS pixels."""
        target = self._control.ask("Target.createTarget", url="about:blank")["targetId"]
        tab = Tab(self._connect(f"/devtools/page/{target}"))
        for domain in ("Page", "Runtime", "Log", "Network"):
            tab.ask(f"{domain}.enable")
        tab.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=is_phone,
        )
        return tab

    def _connect(self, path: str) -> ClientConnection:
        direct: dict[str, Any] = {"proxy": None} if int(websockets.__version__[:2]) >= 15 else {}
        tab = connect(f"ws://127.0.0.1:{self._port}{path}", max_size=None, **direct)
        self._tabs.append(tab)
        return tab


class Tab:
    """A page, with what it said on the console and what it asked for."""

    def __init__(self, connection: ClientConnection) -> None:
        """Use a connection to its DevTools."""
        self._connection, self._number = connection, 0
        self._events: list[str] = []
        self.messages: list[str] = []
        """On the console: errors, warnings and whatever a script prints."""
        self.requests: list[str] = []
        """Addresses that were asked for."""

    def ask(self, method: str, **parameters: Any) -> Any:
        """Call a method of the protocol and return its result.

        Raises:
            RuntimeError: the browser refused it.
        """
        self._number += 1
        call = {"id": self._number, "method": method, "params": parameters}
        self._connection.send(json.dumps(call))
        while (answer := self._next(TIMEOUT_S)).get("id") != self._number:
            pass
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def open(self, address: str) -> None:
        """Go to a page and wait until it is loaded."""
        self._events.clear()
        self.ask("Page.navigate", url=address)
        while "Page.loadEventFired" not in self._events:
            self._next(TIMEOUT_S)

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, or of its promise.

        Raises:
            RuntimeError: it threw an exception.
        """
        answer = self.ask(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if details := answer.get("exceptionDetails"):
            raise RuntimeError(details.get("exception", details).get("description", expression))
        return answer["result"].get("value")

    def wait(self, expression: str, timeout_s: float = TIMEOUT_S) -> Any:
        """Return the value of an expression once it is true.

        Raises:
            TimeoutError: it never was.
        """
        until = time.monotonic() + timeout_s
        while not (value := self.value(expression)):
            if time.monotonic() > until:
                raise TimeoutError(expression)
            time.sleep(LOOK_S)
        return value

    def type(self, text: str) -> None:
        """Type a text where the focus is, key by key."""
        for letter in text:
            for kind in ("keyDown", "keyUp"):
                letters = {"text": letter} if kind == "keyDown" else {}
                self.ask("Input.dispatchKeyEvent", type=kind, key=letter, **letters)

    def shut(self) -> None:
        """Close the tab."""
        self.ask("Page.close")

    def picture(self) -> bytes:
        """Return what is shown, as PNG."""
        return base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])

    def _next(self, timeout_s: float) -> dict[str, Any]:
        """Take the next answer or event; events are noted."""
        message: dict[str, Any] = json.loads(self._connection.recv(timeout_s))
        content = message.get("params", {})
        match message.get("method", ""):
            case "Runtime.consoleAPICalled":
                words = [str(a.get("value", a.get("description"))) for a in content["args"]]
                self.messages.append(f"{content['type']}: {' '.join(words)}")
            case "Runtime.exceptionThrown":
                details = content["exceptionDetails"]
                said = details.get("exception", {}).get("description", details["text"])
                self.messages.append(f"exception: {said}")
            case "Log.entryAdded":
                entry = content["entry"]
                self.messages.append(f"{entry['level']}: {entry['text']} {entry.get('url', '')}")
            case "Network.requestWillBeSent":
                self.requests.append(content["request"]["url"])
        if "method" in message:
            self._events.append(message["method"])
        return message
