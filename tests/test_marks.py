"""Which tests `make quick` leaves out: the marks are given by fixture, folder and file."""

from __future__ import annotations

import pytest
from conftest import SLOW, WITH_ROS, marks
from paths import TESTS


def test_folders_and_files_that_are_marked_exist() -> None:
    for name in (*SLOW, *WITH_ROS):
        assert (TESTS / name).exists(), name


@pytest.mark.parametrize(
    ("where", "fixtures", "given"),
    [
        ("msgs/ros/test_lifecycle.py", {"domain", "ground"}, {"ros"}),
        ("laboratory/flight/test_closed_loop.py", {"fly", "tmp_path"}, {"ros"}),
        ("laboratory/flight/graph/test_graph_failures.py", set(), {"ros"}),
        ("laboratory/paper/test_reproduction.py", set(), {"slow"}),
        ("model/dynamics/test_aba.py", {"paper_robot"}, set()),
    ],
)
def test_what_starts_ros_or_takes_long_is_marked(
    where: str, fixtures: set[str], given: set[str]
) -> None:
    assert set(marks(where, fixtures)) == given


def test_every_test_has_its_marks_and_a_timeout(request: pytest.FixtureRequest) -> None:
    for item in request.session.items:
        where = item.path.relative_to(TESTS).as_posix()
        for mark in marks(where, getattr(item, "fixturenames", ())):
            assert item.get_closest_marker(mark), item.nodeid
        assert item.get_closest_marker("timeout"), item.nodeid
