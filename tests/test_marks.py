"""What conftest.py gives all tests: marks by fixture, folder and file, and a shell of no workspace.

`make quick` leaves out what is marked.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from conftest import SLOW, WITH_ROS, forget_workspace, marks
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


def test_a_sourced_workspace_and_its_domain_are_forgotten(tmp_path: Path) -> None:
    mine, theirs = tmp_path / "install", tmp_path / "jazzy"
    for prefix, package in ((mine, "space_robot"), (theirs, "launch_ros")):
        marker = prefix / "share/ament_index/resource_index/packages" / package
        marker.parent.mkdir(parents=True)
        marker.touch()
    prefixes = os.pathsep.join([str(mine), str(theirs)])
    sourced = {"ROS_DOMAIN_ID": "50", "AMENT_PREFIX_PATH": prefixes, "PATH": "/bin"}
    forget_workspace(sourced)
    assert sourced == {"AMENT_PREFIX_PATH": str(theirs), "PATH": "/bin"}
    forget_workspace(none := {"PATH": "/bin"})
    assert none == {"PATH": "/bin"}
