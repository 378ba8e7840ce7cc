"""The areas of `make mutation` name what is there, and nothing of the core is left out."""

from __future__ import annotations

from pathlib import Path

import pytest
from areas import AREAS, CONTROL, ROOT, SIM


@pytest.mark.parametrize("name", AREAS)
def test_an_area_has_modules_and_tests(name: str) -> None:
    assert list(AREAS[name].modules())
    assert AREAS[name].tests_of(Path())


def test_every_module_of_the_core_is_in_an_area() -> None:
    mutated = {module for area in AREAS.values() for module in area.modules()}
    folders = [SIM, *(f"{CONTROL}/{room}" for room in ("laws", "controller", "mission"))]
    core = {
        file.relative_to(ROOT) for folder in folders for file in (ROOT / folder).glob("*/**/*.py")
    } | {file.relative_to(ROOT) for folder in folders[1:] for file in (ROOT / folder).glob("*.py")}
    assert {file for file in core if file.name != "__init__.py"} <= mutated


def test_the_tests_of_a_module_come_first() -> None:
    first = AREAS["controller"].tests_of(Path(f"{CONTROL}/controller/supervisor.py"))[0]
    assert first == "tests/control/controller/test_supervisor.py"
