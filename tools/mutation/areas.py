"""Which code is mutated, and which tests must notice: first those near it, then `FURTHER`.

An area is a room of a package (a folder below it, or the package's own files), so a new room is
one without a word here. Its tests are those of the folder of the same name below ``tests/`` and
those of `MORE`. Patterns that match nothing are passed over: tests move.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "msgs": "space_robot_msgs_py",
    "model": "space_robot_model",
    "sim": "space_robot_sim",
    "control": "space_robot_control",
    "laboratory": "space_robot",
}
"""Packages by the folder of their tests."""
SPLIT = ("laboratory/flight",)
"""Rooms whose folders are areas of their own."""
LOOPS = "laboratory/flight/test_*loop*.py"
GRAPHS = "laboratory/flight/graph/test_*nodes*.py"
MORE: dict[str, tuple[str, ...]] = {
    "msgs": ("msgs/bag/*.py", "msgs/ros/test_*record*.py"),
    "sim": (GRAPHS,),
    "control": (GRAPHS,),
    "laboratory": (GRAPHS,),
    "config": ("laboratory/cli/test_*option*.py", "laboratory/cli/test_*refus*.py"),
    "ros": (GRAPHS,),
    "actuators": ("sim/plant/*.py", "control/allocation/*.py"),
    "dynamics": ("model/robot/*.py", "sim/plant/test_*plant*.py", "control/controller/*.py"),
    "hardware": ("sim/actuators/*.py", "sim/sensors/*.py"),
    "robot": ("model/dynamics/*.py",),
    "environment": ("sim/plant/*.py",),
    "faults": ("laboratory/scenario/test_*fault*.py", "sim/sensors/*.py", "sim/plant/*.py"),
    "sensors": ("sim/plant/*.py",),
    "controller": (LOOPS,),
    "laws": (LOOPS, "control/controller/*.py"),
    "guidance": (LOOPS, GRAPHS),
    "flight_code": ("laboratory/flight/test_*code*.py",),
    "batch": ("laboratory/api/*.py",),
    "flight": ("laboratory/api/*.py",),
    "scenario": ("laboratory/api/*.py", "laboratory/flight/test_*.py"),
    "cli": ("test_start_up.py", "laboratory/campaign/test_*report*.py"),
    "help": ("laboratory/cli/test_*help*.py",),
    "console": ("laboratory/cli/test_*output*.py",),
    "tuning": ("laboratory/cli/test_*gains*.py",),
    "view": ("laboratory/cli/test_*view*.py",),
}
"""Tests of an area beside those of its own folder."""
FURTHER = (
    "matrix/**/*.py",
    "outputs/**/*.py",
    "test_reference.py",
    "test_start_up.py",
    "laboratory/cli/test_*output*.py",
    "laboratory/api/*scenario*.py",
    GRAPHS,
)
"""Flights by all ways, pages made from the code, commands with their output, nodes."""
WITH_ROS = ("sim", "control", "laboratory", "ros", "graph", "guidance", "view")
QUICK, NO_ROS = "not ros and not slow", "not ros"


class Area(NamedTuple):
    """A room of a package and the tests near it."""

    modules: tuple[Path, ...]
    """Those that may be mutated, relative to the root."""
    tests: tuple[Path, ...]
    marks: str
    """Which of those tests run, as pytest's ``-m`` takes it."""

    def tests_of(self, module: Path) -> list[str]:
        """Return the tests, nearest first: by the module's import, its name, its folder."""
        dotted = ".".join(module.with_suffix("").parts)
        imports = re.compile(rf"\b{re.escape(dotted)}\b|{dotted.rpartition('.')[0]} import.*")

        def distance(test: Path) -> tuple[bool, bool, bool, Path]:
            found = imports.search((ROOT / test).read_text("utf-8"))
            is_named = module.stem in test.stem
            return not is_named, found is None, module.parent.name != test.parent.name, test

        return [str(path) for path in sorted(self.tests, key=distance)]


def test_files(patterns: Iterable[str]) -> tuple[Path, ...]:
    """Return the tests that match, relative to the root, each once."""
    found = (path for pattern in patterns for path in sorted((ROOT / "tests").glob(pattern)))
    tests = (path.relative_to(ROOT) for path in found if path.name.startswith("test_"))
    return tuple(dict.fromkeys(tests))


def _rooms() -> Iterator[tuple[str, str, bool]]:
    """Yield name and place of each area, and whether it has the folders below it."""
    for place, package in PACKAGES.items():
        yield place, place, False
        for folder in sorted((ROOT / package).glob("*/")):
            room = f"{place}/{folder.name}"
            yield folder.name, room, room not in SPLIT
            if room in SPLIT:
                below = sorted(path.name for path in folder.glob("*/"))
                yield from ((name, f"{room}/{name}", True) for name in below)


def _areas() -> Iterator[tuple[str, Area]]:
    for name, place, is_deep in _rooms():
        package, _, room = place.partition("/")
        folder = ROOT / PACKAGES[package] / room
        files = sorted(folder.rglob("*.py") if is_deep else folder.glob("*.py"))
        modules = tuple(f.relative_to(ROOT) for f in files if f.name != "__init__.py")
        own = f"{place}/**/*.py" if is_deep else f"{place}/*.py"
        marks = NO_ROS if package == "laboratory" else QUICK
        if modules:
            tests = test_files((own, *MORE.get(name, ())))
            yield name, Area(modules, tests, "" if name in WITH_ROS else marks)


AREAS = dict(_areas())
"""Every module of the five packages is in one of them, by what is said on the command line."""
