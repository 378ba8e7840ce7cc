"""The doctor: checks of machine and ROS 2 by faked sources, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import Run
from flights import space_robot as started

from space_robot.doctor import (
    CheckedItem,
    check_compilers,
    check_deadlines,
    check_distribution,
    check_domain,
    check_kernels,
    check_memory,
    check_middleware,
    check_packages,
    check_python,
)
from space_robot.flight.graph.domain import ros_domain
from space_robot_msgs_py.config.installation import requirements
from space_robot_msgs_py.ros.locks import FileLock, domain_lock


def named(items: list[CheckedItem], name: str) -> CheckedItem:
    (item,) = [item for item in items if item.name == name]
    return item


@pytest.mark.parametrize(
    ("python", "status"),
    [((3, 9), "missing"), ((3, 10), "ok"), ((3, 13), "ok"), ((4, 0), "missing")],
)
def test_python(python: tuple[int, int], status: str) -> None:
    item = check_python(python)
    assert item.status == status
    assert item.prevents_flights == (status == "missing")
    assert bool(item.advice) == (status == "missing")


LINES = [
    "numpy<3,>=1.26",
    "no-such-package>=2",
    'viser>=1.1; extra == "view"',
    "no-such-viewer; python_version < '4' and extra == 'view'",
    "pandas>=2.1 ; extra == 'campaign'",
]


def test_a_missing_package_is_named_with_the_command_that_installs_it() -> None:
    """Without an installation nobody knows."""
    assert requirements(LINES) == {
        "": ["numpy<3,>=1.26", "no-such-package>=2"],
        "view": ["viser>=1.1", "no-such-viewer"],
        "campaign": ["pandas>=2.1"],
    }
    items = list(check_packages(requirements(LINES)))
    required, view = named(items, "packages"), named(items, "extra view")
    assert required.prevents_flights
    assert required.advice == "pip install 'no-such-package>=2'"
    assert (view.status, view.prevents_flights) == ("missing", False)
    assert "no-such-viewer" in view.advice
    assert view.values["no-such-viewer"] is None
    assert named(items, "extra dask").status == "warning"  # the installed version lists none
    (required, *_) = check_packages({})
    assert (required.status, required.prevents_flights) == ("warning", False)
    assert "pip install -e ." in required.advice


def test_memory(tmp_path: Path) -> None:
    table = tmp_path / "meminfo"
    for available_kb, status in ((4_000_000, "ok"), (400_000, "warning")):
        table.write_text(f"MemTotal: 8000000 kB\nMemAvailable: {available_kb} kB\nHugePages: 0\n")
        item = check_memory(table)
        assert item.status == status
        assert item.values["available_bytes"] == 1024 * available_kb


def test_kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "cache"
    mark = folder / "complete"
    monkeypatch.setattr("space_robot.flight.compilation.mark_file", lambda _: mark)
    monkeypatch.setattr("space_robot_msgs_py.compiled.cache.cache_directory", lambda: folder)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    refused = check_kernels()
    assert refused.prevents_flights
    assert "NUMBA_CACHE_DIR" in refused.advice
    folder.mkdir()
    assert "not compiled yet" in check_kernels().text
    mark.touch()
    assert check_kernels().status == "ok"
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    temporary = check_kernels()
    assert (temporary.status, temporary.prevents_flights) == ("warning", False)
    assert list(folder.iterdir()) == [mark]


def test_deadlines_are_kept_if_99_percent_of_the_ticks_are_late_by_less_than_a_period() -> None:
    good = {"period_s": 0.0005, "ticks": 4000, "median_s": 1e-6, "percentile_99_s": 100e-6}
    good |= {"worst_s": 2e-3, "late_ticks": 7, "lost_time_s": 0.0}
    kept = check_deadlines(good)
    assert kept.status == "ok"
    assert "2 kHz can be kept" in kept.text
    assert "1 us (median), 100 us (99 %), 2000 us (worst); 7 of 4000 ticks" in kept.text
    for late in ({**good, "percentile_99_s": 600e-6}, {**good, "lost_time_s": 0.3}):
        item = check_deadlines(late)
        assert (item.status, item.prevents_flights) == ("warning", False)
        assert "2 kHz cannot be kept" in item.text
        assert "--period" in item.advice
        assert item.values["percentile_99_s"] == late["percentile_99_s"]


def test_compilers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By their search path; they are started for their version."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    lacking = check_compilers(str(tmp_path))
    assert (lacking.status, lacking.prevents_flights) == ("missing", False)
    for name in ("gcc", "make"):
        (tmp_path / name).write_text("#!/bin/sh\necho gcc 99.1\necho more\n")
        (tmp_path / name).chmod(0o755)
    assert check_compilers(str(tmp_path)).values == {"gcc": "gcc 99.1"}
    monkeypatch.setenv("CC", "icc")
    assert check_compilers(str(tmp_path)).text == "CC=icc is not there"


def test_another_distribution_or_middleware_is_a_warning() -> None:
    """The project's transports and range, unless the user has others."""
    file = "/opt/ros/humble/lib/python3/site-packages/rclpy/__init__.py"
    item = check_distribution(file, {"ROS_DISTRO": "humble"})
    assert item.status == "warning"
    assert item.text.startswith(f"humble, rclpy from {file}")
    assert ("(no wheel)" in item.text) == (item.values["wheel"] is None)
    assert check_distribution(file, {"ROS_DISTRO": "jazzy"}).status == "ok"

    item = check_middleware("rmw_fastrtps_cpp", {})
    assert item.status == "ok"
    assert item.text == "rmw_fastrtps_cpp, discovery LOCALHOST, transports UDPv4"
    for own in ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_STATIC_PEERS": "192.168.0.7"}):
        item = check_middleware("rmw_cyclonedds_cpp", own)
        assert item.status == "warning"
        assert own.items() <= item.values.items()


def test_the_domain_is_that_of_ros_domain_id_or_a_free_one(
    free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is released after the check."""
    lock = FileLock(domain_lock(free_domain), "another flight")
    try:
        item = check_domain(free_domain)
    finally:
        lock.release()
    assert item.status == "warning"
    assert f"ROS domain {free_domain} is taken by another flight" in item.text
    assert check_domain(free_domain).values["domain"] == free_domain
    with ros_domain(free_domain) as domain:
        assert domain == free_domain
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    item = check_domain()
    assert 1 <= item.values["domain"] <= 100
    assert "a flight takes such a one by itself" in item.text


NAMES = (
    *("Python", "packages", "extra ros", "extra campaign", "extra view", "flights", "kernels"),
    *("processor", "memory", "wall clock", "ROS 2", "C compiler"),
)


def test_the_report_as_json(space_robot: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("space_robot.doctor.CLOCK_S", 0.05)
    code, out, _ = space_robot("doctor", "--json")
    report = json.loads(out)
    keys = {"can_fly_in_process", "can_fly_with_ros", "commit", "versions", "items"}
    assert report.keys() == keys
    assert (code, report["can_fly_in_process"]) == (0, True)
    items = {item["name"]: item for item in report["items"]}
    assert report["can_fly_with_ros"] is (items["ROS 2"]["status"] != "missing")
    assert report["versions"].keys() >= {"python", "space_robot", "numba"}
    for item in report["items"]:
        assert item.keys() == {"name", "status", "text", "advice", "values"}
        assert item["status"] in {"ok", "warning", "missing"}
        assert item["text"]
        assert item["advice"] or item["status"] == "ok", item
    assert [name for name in NAMES if name not in items] == []
    assert items["wall clock"]["values"]["ticks"] == 100


def test_where_flights_cannot_run_it_says_why_and_ends_with_1(tmp_path: Path) -> None:
    """Numba is broken here; the text is for people."""
    (tmp_path / "numba.py").write_text("raise ImportError('compiled for another NumPy')")
    ended = started("doctor", python_path=tmp_path)
    assert (ended.returncode, ended.stderr) == (1, "")
    lines = ended.stdout.splitlines()
    (line,) = [text for text in lines if " flights:" in text]
    assert line.startswith("missing")
    assert "ImportError: compiled for another NumPy" in line
    assert lines[-1] == "flights cannot run"
