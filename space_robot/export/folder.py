"""Writing the exported folder: whole, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.instances import write_sources
from space_robot_msgs_py.errors import InputError

from ..console.files import atomic_folder
from .software import RecordedFlight
from .verify import ReplayVerdict

BUILD_FILES = ("Makefile", "CMakeLists.txt", "misra_deviations.txt", "MISRA.md")


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
) -> list[tuple[str, str, int]]:
    """Write flight software and recorded flights; replace the folder if it exists.

    Args:
        folder: to be written.
        exported: the flight software.
        flights: to be recorded.
        advance: called after each of them.

    Returns:
        Name, description and number of records of each flight.
    """
    with atomic_folder(folder.resolve()) as new:
        write_sources(new, exported.sources)
        acceptance = new / "acceptance"
        acceptance.mkdir()
        (acceptance / "acceptance.c").write_text(exported.render("acceptance.c"), encoding="utf-8")
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
    text = exported.render("README.md", flights=flights, verdicts=verdicts, **exported.figures())
    (folder / "README.md").write_text(text, encoding="utf-8")
