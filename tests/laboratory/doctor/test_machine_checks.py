"""Checks of the machine, whose sources are faked through parameters: files, folders, numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

from space_robot.doctor import CheckedItem, can_fly
from space_robot.doctor.clock import (
    DeadlineLateness,
    check_deadlines,
    check_scheduling,
    measure_lateness,
)
from space_robot.doctor.packages import check_packages, check_python
from space_robot.doctor.storage import check_disk, check_kernels, check_memory
from space_robot.doctor.tools import check_tools
from space_robot_msgs_py.config.extras import requirements


def named(items: list[CheckedItem], name: str) -> CheckedItem:
    (item,) = [item for item in items if item.name == name]
    return item


def test_only_what_is_required_and_missing_prevents_flights() -> None:
    optional = CheckedItem("x", "missing", "")
    doubtful = CheckedItem("x", "warning", "", is_required=True)
    required = CheckedItem("x", "missing", "", is_required=True)
    assert can_fly([optional, doubtful])
    assert not can_fly([optional, required])


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


def test_requirements_by_extra() -> None:
    assert requirements(LINES) == {
        "": ["numpy<3,>=1.26", "no-such-package>=2"],
        "view": ["viser>=1.1", "no-such-viewer"],
        "campaign": ["pandas>=2.1"],
    }


def test_a_missing_package_is_named_with_the_command_that_installs_it() -> None:
    items = list(check_packages(requirements(LINES)))
    required, view = named(items, "packages"), named(items, "extra view")
    assert required.prevents_flights
    assert required.advice == "pip install 'no-such-package>=2'"
    assert (view.status, view.prevents_flights) == ("missing", False)
    assert "no-such-viewer" in view.advice
    assert view.values["no-such-viewer"] is None
    assert named(items, "extra dask").status == "warning"  # the installed version lists none


def test_without_an_installation_packages_are_unknown() -> None:
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
    assert "cannot be read" in check_memory(tmp_path / "nothing").text


def test_disk(tmp_path: Path) -> None:
    item = check_disk(tmp_path)
    assert str(tmp_path) in item.text
    assert item.status == ("ok" if item.values["free_bytes"] >= 1 << 30 else "warning")


def test_kernels(tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "cache", tmp_path / "temporary"
    mark = folder / "complete"
    refused = check_kernels(folder, mark, elsewhere)
    assert refused.prevents_flights
    assert "NUMBA_CACHE_DIR" in refused.advice
    folder.mkdir()
    assert "not compiled yet" in check_kernels(folder, mark, elsewhere).text
    mark.touch()
    assert check_kernels(folder, mark, elsewhere).status == "ok"
    temporary = check_kernels(folder, mark, tmp_path)
    assert (temporary.status, temporary.prevents_flights) == ("warning", False)
    assert list(folder.iterdir()) == [mark]


def lateness(percentile_99_s: float, lost_time_s: float = 0.0) -> DeadlineLateness:
    return DeadlineLateness(0.0005, 4000, 1e-6, percentile_99_s, 2e-3, 7, lost_time_s)


def test_deadlines_are_kept_if_99_percent_of_the_ticks_are_late_by_less_than_a_period() -> None:
    kept = check_deadlines(lateness(100e-6))
    assert kept.status == "ok"
    assert "2 kHz can be kept" in kept.text
    assert "1 us (median), 100 us (99 %), 2000 us (worst); 7 of 4000 ticks" in kept.text
    for late in (lateness(600e-6), lateness(100e-6, lost_time_s=0.3)):
        item = check_deadlines(late)
        assert (item.status, item.prevents_flights) == ("warning", False)
        assert "2 kHz cannot be kept" in item.text
        assert "--period" in item.advice
        assert item.values["percentile_99_s"] == late.percentile_99_s


def test_deadlines_are_measured() -> None:
    measured = measure_lateness(period_s=0.001, duration_s=0.05)
    assert measured.ticks == 50
    assert 0.0 <= measured.median_s <= measured.percentile_99_s <= measured.worst_s
    assert 0 <= measured.late_ticks <= 50


def test_one_core_is_a_warning() -> None:
    item = check_scheduling(frozenset({0}))
    assert item.status == "warning"
    assert item.values["cores"] == 1


def test_tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By their search path; compilers are started for their version."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    lacking = list(check_tools(str(tmp_path)))
    assert {item.status for item in lacking} == {"missing"}
    assert not any(item.prevents_flights for item in lacking)
    assert "gcc-aarch64-linux-gnu qemu-user" in named(lacking, "C for aarch64").advice
    for name in ("gcc", "make", "aarch64-linux-gnu-gcc", "chromium"):
        (tmp_path / name).write_text("#!/bin/sh\necho gcc 99.1\necho more\n")
        (tmp_path / name).chmod(0o755)
    items = list(check_tools(str(tmp_path)))
    assert named(items, "C compiler").values == {"gcc": "gcc 99.1"}
    assert named(items, "C for aarch64").advice.startswith("sudo apt install qemu-user,")
    assert named(items, "browser").text == str(tmp_path / "chromium")
    monkeypatch.setenv("CC", "icc")
    assert named(list(check_tools(str(tmp_path))), "C compiler").text == "CC=icc is not there"
