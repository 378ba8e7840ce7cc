"""Which code is mutated, and which tests must notice: those of its room."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Area(NamedTuple):
    """A room of a package and the tests that stand near it, as patterns below the root."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    marks: str = "not ros and not slow"
    """Which of those tests run, as pytest's ``-m`` takes it."""

    def modules(self) -> Iterator[Path]:
        """Modules that may be mutated, relative to the root."""
        for pattern in self.sources:
            paths = (path.relative_to(ROOT) for path in _paths(pattern))
            yield from (path for path in paths if path.name != "__init__.py")

    def tests_of(self, module: Path) -> list[str]:
        """Tests of the area: those that bear the module's name first, then those of its folder."""
        tests = {path.relative_to(ROOT) for pattern in self.tests for path in _paths(pattern)}
        folder = module.parent.name

        def distance(test: Path) -> tuple[bool, bool, Path]:
            return module.stem not in test.stem, folder != test.parent.name, test

        return [str(path) for path in sorted(tests, key=distance)]


def _paths(pattern: str) -> list[Path]:
    if not (paths := sorted(ROOT.glob(pattern))):
        raise LookupError(f"no file is named {pattern}")
    return paths


PACKAGES = {
    "msgs": "space_robot_msgs_py",
    "model": "space_robot_model",
    "sim": "space_robot_sim",
    "control": "space_robot_control",
    "laboratory": "space_robot",
}


def _room(place: str, *further: str, marks: str = Area(sources=(), tests=()).marks) -> Area:
    """A room such as ``sim/plant`` with the tests of the same name, and further ones."""
    package, _, room = place.partition("/")
    tests = (f"tests/{place}/**/test_*.py", *(f"tests/{name}" for name in further))
    return Area((f"{PACKAGES[package]}/{room}/**/*.py",), tests, marks)


def _files(place: str, *tests: str, marks: str = Area(sources=(), tests=()).marks) -> Area:
    """The modules of a folder without those of the folders in it."""
    package, _, room = place.partition("/")
    return Area(
        (str(Path(PACKAGES[package], room, "*.py")),),
        tuple(f"tests/{name}" for name in tests),
        marks,
    )


FURTHER = (
    "tests/test_reference.py",
    "tests/test_start_up.py",
    "tests/laboratory/cli/test_output.py",
    "tests/laboratory/api/test_scenario.py",
    "tests/laboratory/flight/graph/test_graph_nodes.py",
)
"""Pages made from the code, commands with their output, flights in process and on the graph."""
CLOSED_LOOP = ("laboratory/flight/test_compiled_loop.py", "laboratory/flight/test_closed_loop.py")
AREAS = {
    "messages": _files(
        "msgs",
        "msgs/test_*.py",
        "msgs/bag/test_*.py",
        "msgs/ros/test_recorder_*.py",
        marks="not slow",
    ),
    "bag": _room("msgs/bag"),
    "compiled": _room("msgs/compiled"),
    "config": _room("msgs/config", "laboratory/cli/test_options.py"),
    "ros": _room("msgs/ros", "laboratory/flight/graph/test_graph_nodes.py", marks=""),
    "wire": _room("msgs/wire"),
    "actuators": _room("sim/actuators", "sim/plant/test_*.py", "control/allocation/test_*.py"),
    "dynamics": _room(
        "model/dynamics", "model/robot/test_*.py", "test_conservation.py", "sim/plant/test_plant.py"
    ),
    "elementary": _room("model/elementary"),
    "environment": _room("sim/environment", "sim/plant/test_*.py"),
    "faults": _room(
        "sim/faults",
        "laboratory/scenario/test_faults.py",
        "sim/sensors/test_*.py",
        "sim/plant/test_*.py",
    ),
    "plant": _room("sim/plant"),
    "robot": _room("model/robot", "model/dynamics/test_equations_of_motion.py"),
    "sensors": _room("sim/sensors", "sim/plant/test_*.py"),
    "nodes": Area(
        tuple(f"{PACKAGES[name]}/*.py" for name in ("sim", "control", "laboratory")),
        ("tests/laboratory/flight/graph/test_graph_nodes.py",),
        "",
    ),
    "analysis": _room("laboratory/analysis", marks="not ros"),
    "campaign": _room("laboratory/campaign", marks="not ros"),
    "cli": _room("laboratory/cli", "test_start_up.py", marks="not ros"),
    "controller": _room("control/controller", *CLOSED_LOOP),
    "flight_code": _room("control/flight_code", "laboratory/flight/test_flight_code.py"),
    "export": _room("laboratory/export", marks="not ros"),
    "flight": _files("laboratory/flight", "laboratory/flight/test_*.py"),
    "batch": _room("laboratory/flight/batch", "laboratory/api/test_together.py"),
    "learning": _room("laboratory/learning"),
    "graph": _room("laboratory/flight/graph", marks=""),
    "replay": _room("laboratory/flight/replay", marks=""),
    "laws": _room("control/laws", "control/controller/test_takeover.py", *CLOSED_LOOP),
    "guidance": _room(
        "control/guidance", *CLOSED_LOOP, "laboratory/flight/graph/test_graph_nodes.py", marks=""
    ),
    "paper": _room("laboratory/paper", "laboratory/cli/test_stability_command.py", marks="not ros"),
    "api": _room("laboratory/api", marks="not ros"),
    "scenario": _room(
        "laboratory/scenario",
        "laboratory/api/test_*.py",
        "laboratory/flight/test_*.py",
        marks="not ros",
    ),
    "console": _room("laboratory/console", "laboratory/cli/test_output.py", marks="not ros"),
    "doctor": _room("laboratory/doctor", marks="not ros"),
    "help": Area(("space_robot/help/*.py",), ("tests/laboratory/cli/test_help_command.py",)),
    "processes": _room("laboratory/processes", marks="not ros"),
    "navigation": _room("control/navigation"),
    "allocation": _room("control/allocation"),
    "orbit": _room("model/orbit"),
    "hardware": _room("model/hardware", "sim/actuators/test_*.py", "sim/sensors/test_*.py"),
    "tuning": _room("laboratory/tuning", "laboratory/cli/test_gains_command.py", marks="not ros"),
    "view": _room("laboratory/view", "laboratory/cli/test_view_command.py", marks="not ros"),
}
"""Every module of the five packages is in one of them, by what is said on the command line."""
