"""Measures of the house: lines and files by room, names defined twice, functions of one command.

python tools/measures.py
python tools/measures.py --entered    # functions entered by simulate --controller ctc --case 3
"""

from __future__ import annotations

import ast
import contextlib
import inspect
import io
import sys
from collections import defaultdict
from pathlib import Path
from types import FrameType
from typing import Any

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


def print_sizes() -> None:
    """Print lines and files of each package, and of its rooms."""
    for package in PACKAGES:
        rooms: dict[str, list[int]] = defaultdict(list)
        for file in sorted((ROOT / package).rglob("*.py")):
            inner = file.relative_to(ROOT / package).parts
            rooms[inner[0] if len(inner) > 1 else ""].append(
                len(file.read_text("utf-8").splitlines())
            )
        print(f"{package:24} {sum(map(sum, rooms.values())):6} {sum(map(len, rooms.values())):4}")
        for room, lines in rooms.items():
            print(f"    {room or '(top)':20} {sum(lines):6} {len(lines):4}")


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
    if "--entered" in sys.argv:
        print("{} functions in {} files: space-robot {}".format(*count_entered(), " ".join(FLOWN)))
    else:
        print_sizes()
        for name, files in names_defined_twice().items():
            print(f"{name}: {', '.join(files)}")
