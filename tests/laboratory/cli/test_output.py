"""Output and files that cannot be written: one line, its exit code, and nothing half-made."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from command import Run

from space_robot.console.files import ABANDONED_S, whole_file, whole_folder
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.errors import InputError

COMMAND = [sys.executable, "-m", "space_robot.cli.main"]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("output") / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.1))), path)
    return path


def test_a_reader_that_has_gone_is_no_error_to_tell(bag: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        result = subprocess.run(
            [*COMMAND, "analyze", str(bag), "--json"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (result.returncode, result.stderr) == (1, "")


def test_a_replay_that_is_refused_leaves_no_empty_table(tmp_path: Path, space_robot: Run) -> None:
    code, _, err = space_robot("replay", tmp_path / "nowhere", "--csv", tmp_path / "x.csv")
    assert code == 2
    assert list(tmp_path.iterdir()) == []
    assert "no such bag" in err


def test_an_older_file_stays_whole_if_the_new_one_fails(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("older")

    def fail() -> None:
        with whole_file(path, replace=True) as file:
            file.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="cannot be written"):
        fail()
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]
    with whole_file(path, replace=True) as f:
        f.write(b"newer")
    assert path.read_text() == "newer"


def test_a_flight_that_diverges_is_told_in_json_too(tmp_path: Path, space_robot: Run) -> None:
    given = ["simulate", "--controller", "ctc", "--gains", "printed", "--duration", "1", "--json"]
    for bag in (None, tmp_path / "bag"):
        options = ["--bag", str(bag)] if bag else []
        code, out, err = space_robot(*given, *options)
        assert code == 1
        report = json.loads(out)
        assert (report["controller"], report["gains"]) == ("ctc", "printed")
        tick = report["diverged"]["tick"]
        assert f"diverged at tick {tick}" in report["error"]
        assert report["error"] in err
        assert (report["outcome"], report["reason"]) == ("diverged", report["error"])
        assert report["diverged"]["time_s"] == pytest.approx(tick * 0.0005)
        if bag:
            assert 0 < report["ticks"] <= tick + 1
            assert report["bag"] == str(bag)


@pytest.mark.parametrize("name", ["c.parquet", "[a]*.csv"])
def test_what_a_killed_process_has_left_is_removed_by_the_next_one(
    name: str, tmp_path: Path
) -> None:
    """Not what may still be written, and not what has another name."""
    left, folder, new, other = (
        tmp_path / f".{text}"
        for text in (f"{name}.0123abcd", f"{name}.ffffffff", f"{name}.00000000", "x.0123abcd")
    )
    folder.mkdir()
    (folder / "inner").write_text("half", "utf-8")
    for path in (left, new, other):
        path.write_text("half", "utf-8")
    for path in (left, folder, other):
        before = path.stat().st_mtime - 2.0 * ABANDONED_S
        os.utime(path, (before, before))
    with whole_file(tmp_path / name) as file:
        file.write(b"whole")
    assert (tmp_path / name).read_text("utf-8") == "whole"
    assert sorted(tmp_path.iterdir()) == sorted([tmp_path / name, new, other])


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    with pytest.raises(InputError, match="cannot be written"), whole_folder(folder) as place:
        (place / "a").rename(place / "b")
    assert not [*tmp_path.iterdir()]
    for text in ("1", "2"):
        with whole_folder(folder) as place:
            (place / "a").write_text(text, "utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["one"]
    assert (folder / "a").read_text("utf-8") == "2"


def test_below_a_file_nothing_can_be_written(bag: Path, tmp_path: Path, space_robot: Run) -> None:
    (tmp_path / "file").touch()
    for option in ("--csv", "--html", "--plot"):
        target = tmp_path / "file" / "x" / f"y.{option[2:]}"
        code, _, err = space_robot("analyze", bag, option, target)
        assert code == 2
        assert str(tmp_path / "file") in err.splitlines()[-1]
