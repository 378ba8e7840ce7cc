"""Which code is mutated, and which tests must notice: those near it, not whole flights."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Area(NamedTuple):
    """Patterns of files below the root."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]

    def modules(self) -> Iterator[Path]:
        """Modules that may be mutated, relative to the root."""
        for pattern in self.sources:
            found = (path.relative_to(ROOT) for path in _found(pattern))
            yield from (path for path in found if path.name != "__init__.py")

    def tests_of(self, module: Path) -> list[str]:
        """Tests of the area, those that bear the module's name first."""
        tests = {path.relative_to(ROOT) for pattern in self.tests for path in _found(pattern)}
        return [str(path) for path in sorted(tests, key=lambda test: module.stem not in test.stem)]


def _found(pattern: str) -> list[Path]:
    if not (found := sorted(ROOT.glob(pattern))):
        raise LookupError(f"no file is named {pattern}")
    return found


SIM, CONTROL, MSGS = "space_robot_sim", "space_robot_control", "space_robot_msgs_py"


def _rooms(package: str, *rooms: str, further: tuple[str, ...] = ()) -> Area:
    """Rooms of a package with the tests that stand in rooms of the same names, and further ones."""
    tests = f"tests/{package.split('_')[2]}"
    return Area(
        tuple(f"{package}/{room}/**/*.py" for room in rooms),
        (*(f"{tests}/{room}/**/test_*.py" for room in rooms), *further),
    )


CLOSED_LOOP = (
    "tests/control/flight/test_compiled_loop.py", "tests/control/flight/test_closed_loop.py",
)  # fmt: skip
GUARDS = (
    f"{CONTROL}/controller/supervisor.py", f"{MSGS}/wire/*_guard.py", f"{SIM}/plant/*_guard.py",
)  # fmt: skip
AREAS = {
    "laws": _rooms(
        CONTROL, "laws", further=("tests/control/controller/test_takeover.py", *CLOSED_LOOP)
    ),
    "controller": _rooms(CONTROL, "controller", further=CLOSED_LOOP),
    "mission": _rooms(CONTROL, "mission", further=CLOSED_LOOP),
    "elementary": _rooms(SIM, "elementary"),
    "dynamics": _rooms(
        SIM, "dynamics",
        further=("tests/sim/robot/test_*.py", "tests/sim/plant/test_conservation.py",
                 "tests/sim/plant/test_plant.py"),
    ),
    "robot": _rooms(SIM, "robot", further=("tests/sim/dynamics/test_equations_of_motion.py",)),
    "environment": _rooms(SIM, "environment", further=("tests/sim/plant/test_plant.py",)),
    "faults": _rooms(
        SIM, "faults", further=("tests/sim/sensors/test_*.py", "tests/sim/plant/test_*.py")
    ),
    "sensors": Area(
        (f"{SIM}/sensors/*.py", f"{SIM}/actuators/*.py"),
        ("tests/sim/sensors/test_*.py", "tests/sim/plant/test_*.py"),
    ),
    "plant": _rooms(SIM, "plant"),
    "guards": Area(
        GUARDS,
        ("tests/control/controller/test_supervisor.py", "tests/msgs/wire/test_*_guard.py",
         "tests/sim/plant/test_command_guard.py"),
    ),
    "metrics": _rooms(CONTROL, "analysis"),
    "view": _rooms(CONTROL, "view"),
    "flight": Area(
        (f"{CONTROL}/flight/*.py",), ("tests/control/flight/test_*.py",),
    ),
    "bag": _rooms(MSGS, "bag"),
    "wire": _rooms(MSGS, "wire"),
    "config": _rooms(MSGS, "config"),
    "compiled": _rooms(MSGS, "compiled"),
}  # fmt: skip
"""By what is said on the command line. The tests of an area are those without the marks ros and
slow: they would take minutes for each mutant."""
