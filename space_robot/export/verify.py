"""Acceptance of an exported folder by every compiler that is here."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from space_robot_msgs_py.errors import InputError

CROSS = {"aarch64": "aarch64-linux-gnu-gcc", "armhf": "arm-linux-gnueabihf-gcc"}
EMULATORS = {"aarch64": "qemu-aarch64", "armhf": "qemu-arm"}


class ReplayVerdict(NamedTuple):
    """Result of the recorded flights on one compiler."""

    target: str
    """Compiler, alone or with other flags than the folder's, or processor."""
    is_accepted: bool
    states: int
    """Answered, every bit equal."""
    tick_ns: float | None
    """Time of a tick in the first flight, ns; None where it was not taken."""
    code_bytes: int | None
    """Code and constants as this compiler makes them; None where it was not taken."""
    largest_frame: int | None
    """Bytes on the stack of the function that needs most."""
    reason: str
    """First line that says why it was not accepted."""


def targets() -> dict[str, list[str]]:
    """Return what can be verified here: the arguments of make by compiler or processor."""
    here = {}
    for name in filter(shutil.which, ("gcc", "clang")):
        here[name] = [f"COMPILERS={name}", "figures"]
        here[f"{name}, other flags"] = [f"COMPILERS={name}", "matrix"]
    for name, compiler in CROSS.items():
        if shutil.which(compiler) and shutil.which(EMULATORS[name]):
            here[name] = [name]
    return here


def verify(folder: Path) -> Iterator[ReplayVerdict]:
    """Build the folder and replay its flights with all compilers.

    Raises:
        InputError: there is no compiler, or no make.
    """
    here = targets()
    if not here or not shutil.which("make"):
        raise InputError("no gcc, clang or make was found to verify the folder with")
    for target, arguments in here.items():
        command = ["make", "--no-print-directory", "-C", str(folder), *arguments]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        counted = re.findall(r"(\d+) states answered, every bit equal", run.stdout)
        times = re.findall(r"mission\.bin: .* (\d+) ns a tick", run.stdout)
        output = (run.stdout + run.stderr).splitlines()
        wrong = [line for line in output if " instead of " in line or "error:" in line]
        yield ReplayVerdict(
            target,
            run.returncode == 0,
            sum(map(int, counted)),
            float(times[0]) if times else None,
            _number(r"constants:\s+(\d+)", run.stdout),
            _number(r"on the stack, bytes:\s+\S+\s+(\d+)", run.stdout),
            "" if run.returncode == 0 else next(iter(wrong), output[-1] if output else "failed"),
        )


def _number(pattern: str, output: str) -> int | None:
    match = re.search(pattern, output)
    return int(match[1]) if match else None
