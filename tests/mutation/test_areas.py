"""The areas of `make mutation` name what is there, and nothing is left out."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from areas import AREAS, PACKAGES, ROOT


@pytest.mark.parametrize("name", AREAS)
def test_an_area_has_modules_and_tests(name: str) -> None:
    assert list(AREAS[name].modules())
    assert AREAS[name].tests_of(Path())


def test_every_module_is_in_one_area() -> None:
    mutated = Counter(module for area in AREAS.values() for module in area.modules())
    modules = {
        file.relative_to(ROOT)
        for package in PACKAGES.values()
        for file in (ROOT / package).rglob("*.py")
    }
    assert mutated == Counter(file for file in modules if file.name != "__init__.py")


def test_the_tests_of_a_module_come_first() -> None:
    first = AREAS["controller"].tests_of(Path("space_robot_control/controller/supervisor.py"))[0]
    assert first == "tests/control/controller/test_supervisor.py"
