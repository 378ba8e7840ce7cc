"""A headless browser that renders a scene for this process."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from space_robot_msgs_py.errors import FlightError, InputError

if TYPE_CHECKING:
    from viser import ClientHandle, ViserServer

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
OPTIONS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
"""Options: software rendering, and no network requests except to this process."""
TIMEOUT_S = 60.0
LOOK_S = 0.1
END_S = 10.0
"""Time to end when asked."""
FRAME_TIMEOUT_S = 120.0
"""Timeout of a picture; the first one is slow without a graphics card."""


def find_browser() -> str:
    """Return the path of Chromium or Chrome.

    Raises:
        InputError: none is installed.
    """
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if not path:
        raise InputError(f"no browser is installed: one of {', '.join(NAMES)} is needed")
    return path


@contextmanager
def headless_browser(server: ViserServer) -> Iterator[ClientHandle]:
    """Open the scene of a server in a headless browser, which ends with the context.

    Its window is small; rendered pictures may be larger.

    Args:
        server: of viser.

    Raises:
        InputError: no browser is installed.
        FlightError: the browser did not start.
    """
    options = [*OPTIONS]
    if os.geteuid() == 0:  # Chromium's sandbox does not run as root
        options.append("--no-sandbox")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [
            find_browser(),
            *options,
            f"--user-data-dir={profile}",
            "--window-size=300,200",
            f"http://127.0.0.1:{server.get_port()}",
        ]
        silent = subprocess.DEVNULL
        with subprocess.Popen(command, stdin=silent, stdout=silent, stderr=silent) as process:
            try:
                yield _client(server, process)
            finally:
                process.terminate()
                with suppress(subprocess.TimeoutExpired):
                    process.wait(END_S)
                process.kill()


def _client(server: ViserServer, process: subprocess.Popen[bytes]) -> ClientHandle:
    until = time.monotonic() + TIMEOUT_S
    while not (clients := server.get_clients()):
        if process.poll() is not None or time.monotonic() > until:
            raise FlightError("the browser did not open the scene")
        time.sleep(LOOK_S)
    return next(iter(clients.values()))
