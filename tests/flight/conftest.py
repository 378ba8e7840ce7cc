"""Graph flights shared by the tests of a session."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from flights import Flown, space_robot


@pytest.fixture(scope="session")
def fly(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Flown]:
    """Fly a graph with the given options; each set of options flies once a session."""
    pytest.importorskip("rclpy")
    flown: dict[tuple[str, ...], Flown] = {}

    def run(*options: str) -> Flown:
        if options not in flown:
            bag = tmp_path_factory.mktemp("flights") / "bag"
            result = space_robot("fly", *options, "--bag", str(bag), "--json")
            assert result.returncode == 0, result.stderr
            flown[options] = Flown(json.loads(result.stdout), bag, result.stderr)
        return flown[options]

    return run


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Graphs fly one after the other, whatever runs beside them: four processes fill two cores."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("graph"))
