"""Measures of the house: lines and files by room, names defined twice, functions of one command.

python tools/measures.py
python tools/measures.py --entered    # functions entered by simulate --controller ctc --case 3
python tools/measures.py --lower      # after a cut: the limits in measures.yaml, held by a test
"""

from __future__ import annotations

import ast
import contextlib
import inspect
import io
import signal
import sys
from collections import defaultdict
from pathlib import Path
from types import FrameType
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
PACKAGES = (
    "space_robot_msgs_py",
    "space_robot_model",
    "space_robot_sim",
    "space_robot_control",
    "space_robot",
    "tests",
)
FLOWN = ["simulate", "--controller", "ctc", "--case", "3"]
LIMITS = Path(__file__).with_suffix(".yaml")
MOST_LISTED = 4
"""Files of a name that are listed; of a name in more, their number is."""


def rooms_of(package: str) -> dict[str, list[int]]:
    """Return the lines of each file of a package by its room."""
    rooms: dict[str, list[int]] = defaultdict(list)
    for file in sorted((ROOT / package).rglob("*.py")):
        inner = file.relative_to(ROOT / package).parts
        room = inner[0] if len(inner) > 1 else "(top)"
        rooms[room].append(len(file.read_text("utf-8").splitlines()))
    return rooms


def size_of(package: str) -> tuple[int, int]:
    """Return the lines and files of a package."""
    rooms = rooms_of(package).values()
    return sum(map(sum, rooms)), sum(map(len, rooms))


def print_measures() -> None:
    """Print lines and files of each package and of its rooms, then the names defined twice."""
    for package in PACKAGES:
        print("{:24} {:6} {:4}".format(package, *size_of(package)))
        for room, lines in rooms_of(package).items():
            print(f"    {room:20} {sum(lines):6} {len(lines):4}")
    for name, files in names_defined_twice().items():
        print(f"{name}: {', '.join(files) if len(files) <= MOST_LISTED else f'{len(files)} files'}")


def limits() -> dict[str, Any]:
    """Return what the test holds: ``sizes`` by package, and the names defined ``twice``."""
    content: dict[str, Any] = yaml.safe_load(LIMITS.read_text("utf-8"))
    return {**content, "twice": content["twice"].split()}


def lower_limits() -> None:
    """Write the limits that the code keeps now, up to a hundred lines, where they are lower."""
    before, sizes = limits(), {}
    for package in PACKAGES:
        lines, files = size_of(package)
        sizes[package] = map(min, (-(-lines // 100) * 100, files), before["sizes"][package])
    names = " ".join(sorted({*before["twice"]} & names_defined_twice().keys()))
    head = "".join(line for line in LIMITS.open(encoding="utf-8") if line.startswith("#"))
    content = {"sizes": {package: [*size] for package, size in sizes.items()}, "twice": names}
    text = yaml.safe_dump(content, sort_keys=False, width=100, default_flow_style=None)
    LIMITS.write_text(head + text, "utf-8")


def names_defined_twice() -> dict[str, list[str]]:
    """Return the files of each public class, function and constant that several modules define."""
    places: dict[str, list[str]] = defaultdict(list)
    for package in PACKAGES[:-1]:
        for file in sorted((ROOT / package).rglob("*.py")):
            for node in ast.parse(file.read_text("utf-8")).body:
                names: list[str] = []
                if isinstance(node, ast.ClassDef | ast.FunctionDef):
                    names = [node.name]
                elif isinstance(node, ast.Assign):
                    names = [t.id for t in node.targets if isinstance(t, ast.Name)]
                elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                    names = [node.target.id]
                for name in names:
                    if not name.startswith("_"):
                        places[name].append(str(file.relative_to(ROOT)))
    return {name: files for name, files in sorted(places.items()) if len(files) > 1}


def count_entered() -> tuple[int, int]:
    """Return how many functions of the packages a flight enters, and in how many files."""
    from space_robot.cli.main import main

    entered: set[tuple[str, int]] = set()
    prefix = str(ROOT / "space_robot")

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        is_function = code.co_flags & inspect.CO_OPTIMIZED and code.co_name[0] != "<"
        if event == "call" and is_function and code.co_filename.startswith(prefix):
            entered.add((code.co_filename, code.co_firstlineno))

    sys.setprofile(note)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
            main(FLOWN)
    finally:
        sys.setprofile(None)
    return len(entered), len({file for file, _ in entered})


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `| head` ends it without a traceback
    if "--entered" in sys.argv:
        print("{} functions in {} files: space-robot {}".format(*count_entered(), " ".join(FLOWN)))
    elif "--lower" in sys.argv:
        lower_limits()
    else:
        print_measures()
