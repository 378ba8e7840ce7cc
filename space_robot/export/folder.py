"""The exported folder: written whole, or not at all, and accepted by every compiler here."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.frameworks import framework_files
from space_robot_control.flight_code.instances import write_sources
from space_robot_msgs_py.errors import InputError

from ..console.files import atomic_folder
from .software import RecordedFlight

BUILD_FILES = ("Makefile", "CMakeLists.txt", "misra_deviations.txt", "MISRA.md")
CROSS = {"aarch64": "aarch64-linux-gnu-gcc", "armhf": "arm-linux-gnueabihf-gcc"}
EMULATORS = {"aarch64": "qemu-aarch64", "armhf": "qemu-arm"}
FRAMEWORKS = {"fprime": ("F'", "FPRIME_ROOT"), "cfs": ("cFS", "CFS_ROOT")}
"""Names of the frameworks, and the environment variables with the folders of their sources."""


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

    @property
    def text(self) -> str:
        """The verdict in words."""
        return self.reason or ("every bit equal" if self.states else "accepted")


def check_folder(folder: Path, force: bool) -> None:
    """Check that a folder can be written.

    Raises:
        InputError: it exists, and ``force`` does not say that it may be replaced.
    """
    if folder.exists() and not force:
        raise InputError(f"{folder}: exists; --force replaces it")
    is_exported = (folder / "include" / "space_robot_flight.h").is_file()
    is_empty = folder.is_dir() and not any(folder.iterdir())
    if folder.exists() and not (is_exported or is_empty):
        raise InputError(f"{folder}: is not an exported folder, so --force does not replace it")
    if not folder.resolve().parent.is_dir():
        raise InputError(f"{folder}: there is no folder {folder.resolve().parent}")


def write_folder(
    folder: Path,
    exported: Exported,
    flights: Iterable[RecordedFlight],
    advance: Callable[[], None] = lambda: None,
    framework: str | None = None,
) -> list[tuple[str, str, int]]:
    """Write flight software and recorded flights; replace the folder if it exists.

    Args:
        folder: to be written.
        exported: the flight software.
        flights: to be recorded.
        advance: called after each of them.
        framework: key of `FRAMEWORKS`: its component is written, too.

    Returns:
        Name, description and number of records of each flight.
    """
    with atomic_folder(folder.resolve()) as new:
        write_sources(new, exported.sources)
        if framework:
            write_sources(new, framework_files(exported, framework))
        acceptance = new / "acceptance"
        acceptance.mkdir()
        for file in ("acceptance.c", "recorded.h"):
            (acceptance / file).write_text(exported.render(file), encoding="utf-8")
        written = []
        for flight in flights:
            flight.recording.write(acceptance / f"{flight.name}.bin")
            written.append((flight.name, flight.about, len(flight.recording.records)))
            advance()
        for file in BUILD_FILES:
            (new / file).write_text(exported.render(file), encoding="utf-8")
        write_readme(new, exported, written)
    return written


def write_readme(
    folder: Path,
    exported: Exported,
    flights: Sequence[tuple[str, str, int]],
    verdicts: Sequence[ReplayVerdict] = (),
) -> None:
    """Write the README, with the verdicts of compilers and processors if there are any."""
    content = {"flights": flights, "verdicts": verdicts, **exported.figures()}
    content["frameworks"] = [name for name in FRAMEWORKS if (folder / name).is_dir()]
    text = exported.render("README.md", **content)
    (folder / "README.md").write_text(text, encoding="utf-8")


def framework_checks(folder: Path) -> Iterator[tuple[str, list[str], str]]:
    """Yield the checks of components: name, arguments of make, and what is missing here."""
    for framework, (name, variable) in FRAMEWORKS.items():
        if not (folder / framework).is_dir():
            continue
        if framework == "fprime":
            missing = "" if shutil.which("fpp-check") else "fpp-check is not installed"
            yield "fpp-check", ["-C", framework, "check"], missing
        missing = "" if os.environ.get(variable) else f"{variable} is not set"
        yield name, ["-C", framework, "replay"], missing


def targets(folder: Path) -> dict[str, list[str]]:
    """Return what can be verified here: arguments of make by compiler, processor or framework."""
    here = {}
    for name in filter(shutil.which, ("gcc", "clang")):
        here[name] = [f"COMPILERS={name}", "figures"]
        here[f"{name}, other flags"] = [f"COMPILERS={name}", "matrix"]
    for name, compiler in CROSS.items():
        if shutil.which(compiler) and shutil.which(EMULATORS[name]):
            here[name] = [name]
    checks = framework_checks(folder)
    return here | {name: arguments for name, arguments, missing in checks if not missing}


def verify(folder: Path) -> Iterator[ReplayVerdict]:
    """Build the folder and replay its flights with all compilers.

    Raises:
        InputError: there is no compiler, or no make.
    """
    here = targets(folder)
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
