"""Programs that some commands start: compilers, emulators, a browser."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator

from space_robot_control.flight_code.instances import COMPILERS

from ..export.verify import CROSS, EMULATORS
from .checked_item import CheckedItem

TIMEOUT_S = 5.0
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def check_tools(search_path: str | None = None) -> Iterator[CheckedItem]:
    """Report the compilers of flight code, the cross compilers with emulators, and the browser.

    Args:
        search_path: folders separated by colons; None: ``PATH``.
    """
    yield _check_compilers(search_path)
    for processor, compiler in CROSS.items():
        yield _check_cross(processor, compiler, EMULATORS[processor], search_path)
    yield check_browser()


def _check_compilers(search_path: str | None) -> CheckedItem:
    own = os.environ.get("CC", "")
    names = list(dict.fromkeys(filter(None, (own, *COMPILERS))))
    paths = {name: shutil.which(name, path=search_path) for name in names}
    versions = {name: _first_line(path) for name, path in paths.items() if path}
    if own and own not in versions:
        text, advice = f"CC={own} is not there", "unset CC, or set it to gcc or clang"
    elif not versions:
        text = "no cc, gcc or clang"
        advice = "sudo apt install gcc make, if you need export or --controller-code c"
    elif not shutil.which("make", path=search_path):
        text, advice = "no make", "sudo apt install make, if you need export"
    else:
        text = "; ".join(f"{name}: {line}" for name, line in versions.items())
        return CheckedItem("C compiler", "ok", text, values=versions)
    return CheckedItem("C compiler", "missing", text, advice, versions)


def _check_cross(
    processor: str, compiler: str, emulator: str, search_path: str | None
) -> CheckedItem:
    name = f"C for {processor}"
    paths = {tool: shutil.which(tool, path=search_path) for tool in (compiler, emulator)}
    if lacking := [tool for tool, path in paths.items() if not path]:
        package = {compiler: f"gcc-{compiler.removesuffix('-gcc')}", emulator: "qemu-user"}
        needed = " ".join(package[tool] for tool in lacking)
        return CheckedItem(
            name,
            "missing",
            f"no {' and no '.join(lacking)}",
            f"sudo apt install {needed}, if you need export for this processor",
            paths,
        )
    return CheckedItem(name, "ok", f"{compiler}, {emulator}", values=paths)


def check_browser() -> CheckedItem:
    """Report the browser that pictures of the pages of `view` are made with."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not path:
        text = f"no browser is installed: one of {', '.join(BROWSERS)} is needed"
        advice = "install Chromium, if you need pictures of view; its pages open in any browser"
        return CheckedItem("browser", "missing", text, advice)
    return CheckedItem("browser", "ok", path, values={"path": path})


def _first_line(path: str) -> str:
    """Return the first line of a compiler's ``--version``."""
    try:
        done = subprocess.run(
            [path, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT_S,
            check=False,
        )
    except (OSError, subprocess.SubprocessError) as error:
        return f"does not run ({error})"
    return next(iter(done.stdout.splitlines()), "")
